#include "lostmotion/compensator.h"

#include <math.h>

#include "size20.h"
#include "test.h"

static lm_parameters parameters;
static lm_compensator joint;
static lm_conditions at;
static lm_fault fault;

void setUp(void) {
  parameters = size20();
  memset(&at, 0, sizeof at);
  at.temperature_C = LM_REFERENCE_TEMPERATURE_C;
  seed = 1;
  TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 0, &fault));
}

static lm_correction step(lm_real torque_Nm) {
  at.torque_Nm = torque_Nm;
  return lm_step_compensator(&joint, &at);
}

/* Starts an instance again after a change of parameters, which it reads at its start. */
static void restart(void) {
  TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 0, &fault));
}

static lm_correction rest(lm_real torque_Nm, int ticks) {
  lm_correction now = step(torque_Nm);
  int i;
  for (i = 1; i < ticks; ++i) {
    now = step(torque_Nm);
  }
  return now;
}

/* Memory that a fault has changed: no number in the limiter leads beyond the position limit. */
TEST(a_corrupted_velocity_stays_within_the_position_limit) {
  lm_correction now = rest(10, 500);
  joint.velocity_rad_s = LM_REAL(1e3);
  now = step(10);
  TEST_ASSERT_TRUE(distance(now.correction_rad, 0) <= parameters.limits.correction_rad);
  TEST_ASSERT_TRUE(now.status & LM_STATE_POSITION_LIMITED);
}

TEST(at_rest_the_correction_takes_the_lost_motion_out) {
  lm_correction now = rest(10, 2000);
  TEST_ASSERT_TRUE(now.lost_motion_rad > LM_REAL(4e-4));
  TEST_ASSERT_TRUE(distance(now.correction_rad, -now.lost_motion_rad) < LM_REAL(2e-8));
  TEST_ASSERT_TRUE(distance(now.velocity_rad_s, 0) < LM_REAL(1e-6));
  TEST_ASSERT_EQUAL(LM_STATE_MEMORY_UNKNOWN | LM_STATE_SETTLED, now.status);
}

/* The slope of the torsion curve with its friction is constant while a torque rises between two
 * knots: the target moves at a constant rate and must be followed without lag. */
TEST(a_steady_rate_is_followed_without_lag) {
  lm_correction now = rest(8, 1000);
  int i;
  for (i = 0; i < 1500; ++i) {
    now = step(8 + LM_REAL(i) * LM_REAL(0.011));
  }
  TEST_ASSERT_TRUE(now.velocity_rad_s < LM_REAL(-1e-4));
  /* The rate itself is 5e-4 rad/s; a lag of one tick alone would be 5e-7 rad. */
  TEST_ASSERT_TRUE(distance(now.correction_rad, -now.lost_motion_rad) < LM_REAL(8e-7));
}

/* Checks of the bounds by differences of the outputs, for arbitrary loads. `slack` is rounding. */
static void check_limits(lm_headroom most, int ticks) {
  const lm_real tick_s = parameters.limits.period_s;
  lm_correction before;
  lm_correction now;
  int i;
  lm_real torque_Nm = 0;
  memset(&before, 0, sizeof before);
  for (i = 0; i < ticks; ++i) {
    uint32_t kind = seed >> 29;
    if (kind == 0) {
      torque_Nm = draw(-80, 80);
    } else if (kind == 1) {
      torque_Nm = -torque_Nm;
    } else {
      torque_Nm += draw(-2, 2);
    }
    if (draw(0, 1) < LM_REAL(0.01)) {
      lm_set_mode(&joint, (lm_mode)(seed >> 28 & 3));
    }
    now = step(torque_Nm);
    TEST_ASSERT_TRUE(distance(now.correction_rad, 0) <= most.correction_rad * (1 + 4 * ROUNDING));
    TEST_ASSERT_TRUE(distance(now.velocity_rad_s, 0) <= most.velocity_rad_s * (1 + 8 * ROUNDING));
    TEST_ASSERT_TRUE(distance(now.acceleration_rad_s2, 0) <=
                     most.acceleration_rad_s2 * (1 + 8 * ROUNDING));
    TEST_ASSERT_TRUE(distance(now.acceleration_rad_s2, before.acceleration_rad_s2) <=
                     most.jerk_rad_s3 * tick_s + 8 * ROUNDING * most.acceleration_rad_s2);
    /* The rates are those of the outputs themselves. */
    TEST_ASSERT_TRUE(
        distance(now.velocity_rad_s, before.velocity_rad_s + now.acceleration_rad_s2 * tick_s) <=
        8 * ROUNDING * most.velocity_rad_s);
    TEST_ASSERT_TRUE(
        distance(now.correction_rad, before.correction_rad + now.velocity_rad_s * tick_s) <=
        8 * ROUNDING * most.correction_rad);
    before = now;
  }
}

static lm_headroom own_limits(void) {
  lm_headroom most;
  most.correction_rad = parameters.limits.correction_rad;
  most.velocity_rad_s = parameters.limits.velocity_rad_s;
  most.acceleration_rad_s2 = parameters.limits.acceleration_rad_s2;
  most.jerk_rad_s3 = parameters.limits.jerk_rad_s3;
  return most;
}

TEST(no_limit_is_ever_passed) {
  static const lm_real response[] = {5, 20, LM_REAL(62.5)};
  static const lm_real narrowing[] = {1, LM_REAL(0.1), LM_REAL(0.001)};
  int r;
  int k;
  for (r = 0; r < 3; ++r) {
    for (k = 0; k < 81; ++k) {
      parameters = size20();
      parameters.limits.response_per_s = response[r];
      parameters.limits.correction_rad *= narrowing[k % 3];
      parameters.limits.velocity_rad_s *= narrowing[k / 3 % 3];
      parameters.limits.acceleration_rad_s2 *= narrowing[k / 9 % 3];
      parameters.limits.jerk_rad_s3 *= narrowing[k / 27 % 3];
      TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 0, &fault));
      check_limits(own_limits(), 3000);
    }
  }
}

TEST(headroom_narrows_and_never_widens) {
  lm_headroom room = own_limits();
  lm_real zero = 0;
  room.correction_rad *= LM_REAL(0.1);
  room.velocity_rad_s *= LM_REAL(0.2);
  room.acceleration_rad_s2 *= LM_REAL(0.3);
  room.jerk_rad_s3 *= LM_REAL(0.4);
  lm_set_headroom(&joint, &room);
  check_limits(room, 20000);
  room.correction_rad = 1 / zero;
  room.velocity_rad_s = 100;
  room.acceleration_rad_s2 = LM_REAL(1e6);
  room.jerk_rad_s3 = 1 / zero;
  TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 0, &fault));
  lm_set_headroom(&joint, &room);
  check_limits(own_limits(), 20000);
}

TEST(no_headroom_means_no_motion) {
  lm_headroom none;
  lm_real zero = 0;
  none.correction_rad = 1;
  none.velocity_rad_s = -1;
  none.acceleration_rad_s2 = zero / zero;
  none.jerk_rad_s3 = 0;
  lm_set_headroom(&joint, &none);
  TEST_ASSERT_TRUE(rest(30, 100).correction_rad == 0);
  lm_set_headroom(&joint, NULL);
  TEST_ASSERT_TRUE(rest(30, 2000).correction_rad < LM_REAL(-5e-4));
}

/* After the bounds are narrowed nothing exceeds the bounds of the motion in progress, nothing
 * jumps, and the correction comes to rest. */
static lm_correction check_ending(lm_headroom most, int ticks) {
  const lm_real tick_s = parameters.limits.period_s;
  lm_real position_rad = joint.correction_rad;
  lm_real acceleration_rad_s2 = joint.acceleration_rad_s2;
  lm_correction now = step(70);
  int i;
  for (i = 0; i < ticks; ++i) {
    TEST_ASSERT_TRUE(distance(now.velocity_rad_s, 0) <= most.velocity_rad_s * (1 + 8 * ROUNDING));
    TEST_ASSERT_TRUE(distance(now.acceleration_rad_s2, 0) <=
                     most.acceleration_rad_s2 * (1 + 8 * ROUNDING));
    TEST_ASSERT_TRUE(distance(now.acceleration_rad_s2, acceleration_rad_s2) <=
                     most.jerk_rad_s3 * tick_s * (1 + 8 * ROUNDING) +
                         8 * ROUNDING * most.acceleration_rad_s2);
    TEST_ASSERT_TRUE(distance(now.correction_rad, position_rad) <=
                     most.velocity_rad_s * tick_s * (1 + 8 * ROUNDING) +
                         8 * ROUNDING * most.correction_rad);
    position_rad = now.correction_rad;
    acceleration_rad_s2 = now.acceleration_rad_s2;
    now = step(70);
  }
  return now;
}

/* A host without headroom during any motion: the velocity once grew as long as there was no
 * headroom, because the acceleration was kept. */
TEST(a_motion_without_headroom_comes_to_rest) {
  static const lm_real jerk_rad_s3[] = {0, 1, 100};
  int moment;
  int k;
  for (k = 0; k < 3; ++k) {
    for (moment = 1; moment < 60; ++moment) {
      lm_headroom room = own_limits();
      lm_correction now;
      TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 0, &fault));
      rest(70, moment);
      room.jerk_rad_s3 = jerk_rad_s3[k];
      room.velocity_rad_s = 0;
      lm_set_headroom(&joint, &room);
      now = check_ending(own_limits(), 500);
      TEST_ASSERT_TRUE(distance(now.velocity_rad_s, 0) < LM_REAL(1e-6));
      lm_set_headroom(&joint, NULL);
      TEST_ASSERT_EQUAL(0, step(70).status & LM_STATE_HEADROOM_SHORT);
      now = check_ending(own_limits(), 2000);
      TEST_ASSERT_TRUE(distance(now.correction_rad, -now.lost_motion_rad) < LM_REAL(1e-7));
    }
  }
}

TEST(headroom_too_short_to_stop_is_reported) {
  lm_headroom none = {0, 0, 0, 0};
  int k;
  rest(70, 5);
  lm_set_headroom(&joint, &none);
  TEST_ASSERT_TRUE(step(70).status & LM_STATE_HEADROOM_SHORT);
  /* The same if the host states it in every tick. */
  for (k = 0; k < 500; ++k) {
    lm_set_headroom(&joint, &none);
    step(70);
  }
  TEST_ASSERT_TRUE(distance(step(70).velocity_rad_s, 0) < LM_REAL(1e-6));
}

/* Narrower limits arrive while the correction is beyond them, or moves faster than they permit: it
 * once jumped to the new limit within one tick. */
TEST(narrower_parameters_are_approached_without_a_jump) {
  lm_parameters narrow = parameters;
  lm_headroom most = own_limits();
  int moment;
  narrow.limits.correction_rad *= LM_REAL(0.1);
  narrow.limits.velocity_rad_s *= LM_REAL(0.1);
  narrow.limits.acceleration_rad_s2 *= LM_REAL(0.1);
  narrow.limits.jerk_rad_s3 *= LM_REAL(0.1);
  for (moment = 1; moment < 2000; moment += moment < 60 ? 1 : 100) {
    lm_correction now;
    TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 0, &fault));
    rest(70, moment);
    TEST_ASSERT_EQUAL(LM_OK, lm_change_parameters(&joint, &narrow, &fault));
    now = check_ending(most, 3000);
    TEST_ASSERT_TRUE(distance(now.correction_rad, -narrow.limits.correction_rad) < LM_REAL(1e-7));
  }
}

TEST(a_narrower_position_is_approached_without_a_jump) {
  lm_headroom room = own_limits();
  lm_correction before = rest(40, 3000);
  int i;
  room.correction_rad = LM_REAL(2e-4);
  lm_set_headroom(&joint, &room);
  for (i = 0; i < 3000; ++i) {
    lm_correction now = step(40);
    TEST_ASSERT_TRUE(distance(now.correction_rad, before.correction_rad) <=
                     parameters.limits.velocity_rad_s * parameters.limits.period_s);
    before = now;
  }
  TEST_ASSERT_TRUE(distance(before.correction_rad, -room.correction_rad) < LM_REAL(1e-8));
  TEST_ASSERT_TRUE(before.status & LM_STATE_POSITION_LIMITED);
}

TEST(a_step_is_approached_without_overshoot) {
  int i;
  lm_correction now = step(30);
  for (i = 0; i < 4000; ++i) {
    now = step(30);
    TEST_ASSERT_TRUE(now.correction_rad >= -now.lost_motion_rad * (1 + 16 * ROUNDING));
  }
  TEST_ASSERT_TRUE(distance(now.correction_rad, -now.lost_motion_rad) < LM_REAL(1e-7));
}

TEST(binding_limits_are_reported) {
  uint32_t seen = 0;
  int i;
  parameters.limits.velocity_rad_s = LM_REAL(1e-3);
  parameters.limits.acceleration_rad_s2 = LM_REAL(0.05);
  parameters.limits.jerk_rad_s3 = 10;
  TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 0, &fault));
  for (i = 0; i < 200; ++i) {
    seen |= step(70).status;
  }
  TEST_ASSERT_TRUE(seen & LM_STATE_VELOCITY_LIMITED);
  TEST_ASSERT_TRUE(seen & LM_STATE_ACCELERATION_LIMITED);
  TEST_ASSERT_TRUE(seen & LM_STATE_JERK_LIMITED);
  TEST_ASSERT_TRUE(step(100).status & LM_STATE_TORQUE_CLIPPED);
}

TEST(holding_stays_and_resetting_moves_to_zero_while_the_memory_follows) {
  lm_correction held = rest(30, 2000);
  lm_compensator other;
  lm_set_mode(&joint, LM_MODE_HOLD);
  rest(-40, 500);
  TEST_ASSERT_TRUE(distance(step(-40).correction_rad, held.correction_rad) < LM_REAL(1e-7));
  TEST_ASSERT_EQUAL(LM_STATE_HOLDING | LM_STATE_MEMORY_UNKNOWN | LM_STATE_SETTLED,
                    step(-40).status);
  lm_set_mode(&joint, LM_MODE_RESET);
  TEST_ASSERT_TRUE(distance(rest(-40, 3000).correction_rad, 0) < LM_REAL(1e-7));
  TEST_ASSERT_EQUAL(LM_STATE_RESETTING | LM_STATE_MEMORY_UNKNOWN | LM_STATE_SETTLED,
                    step(-40).status);
  lm_set_mode(&joint, LM_MODE_RUN);
  /* Stop, abort and re-homing lose nothing: the history is that of the load. */
  TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&other, &parameters, 0, &fault));
  at.torque_Nm = 30;
  lm_step_compensator(&other, &at);
  at.torque_Nm = -40;
  lm_step_compensator(&other, &at);
  TEST_ASSERT_EQUAL_MEMORY(&other.memory, &joint.memory, sizeof joint.memory);
  TEST_ASSERT_EQUAL(LM_STATE_MEMORY_UNKNOWN | LM_STATE_SETTLED, rest(-40, 3000).status);
}

/* Stop, abort, re-homing, new parameters and power-down at random moments: the history is that of a
 * model without interruption. */
TEST(nothing_that_the_host_does_loses_the_history) {
  lm_memory undisturbed = joint.memory;
  lm_parameters same = parameters;
  lm_saved saved;
  int k;
  for (k = 0; k < 20000; ++k) {
    lm_headroom none = {0, 0, 0, 0};
    lm_correction now = step(draw(-70, 70));
    TEST_ASSERT_TRUE(lm_step_model(&parameters, &undisturbed, &at) == now.lost_motion_rad);
    TEST_ASSERT_EQUAL_MEMORY(&undisturbed, &joint.memory, sizeof undisturbed);
    switch ((int)draw(0, 12)) {
      case 0:
        lm_set_mode(&joint, LM_MODE_HOLD);
        break;
      case 1:
        lm_set_mode(&joint, LM_MODE_RESET);
        break;
      case 2:
        lm_set_mode(&joint, LM_MODE_RUN);
        break;
      case 3:
        lm_set_headroom(&joint, &none);
        break;
      case 4:
        lm_set_headroom(&joint, 0);
        break;
      case 5:
        TEST_ASSERT_EQUAL(LM_OK, lm_change_parameters(&joint, &same, &fault));
        break;
      case 6:
        lm_save_compensator(&joint, &saved);
        TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 0, &fault));
        TEST_ASSERT_EQUAL(LM_OK, lm_restore_compensator(&joint, &saved, &fault));
        break;
      default:
        break;
    }
  }
}

/* The truth is a model that starts anywhere in its bands. The bound must contain it at every
 * moment. */
static void check_uncertainty(void) {
  int trial;
  for (trial = 0; trial < 300; ++trial) {
    lm_memory truth;
    lm_real start_Nm = draw(-40, 40);
    lm_real before = LM_REAL(1e9);
    int i;
    TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, start_Nm, &fault));
    truth = joint.memory;
    for (i = 0; i < 4; ++i) {
      lm_real radius_Nm = lm_find_play_radius(&parameters.plays, i, start_Nm);
      truth.plays.z_Nm[i] = lm_find_envelope(&parameters.plays, start_Nm) + draw(-1, 1) * radius_Nm;
      TEST_ASSERT_TRUE(joint.memory.plays.z_Nm[i] == lm_find_envelope(&parameters.plays, start_Nm));
    }
    lm_settle_model(&parameters, &truth);
    for (i = 0; i < 25; ++i) {
      lm_real model;
      lm_real real;
      lm_real bound;
      at.torque_Nm = draw(-3, 3) * LM_REAL(i);
      real = lm_step_model(&parameters, &truth, &at);
      model = lm_step_compensator(&joint, &at).lost_motion_rad;
      bound = lm_bound_uncertainty(&joint);
      TEST_ASSERT_TRUE(distance(model, real) <= bound + 32 * ROUNDING * LM_REAL(4e-3));
      /* Inside, the torsion curve's slope at the load changes the angle at the same torque.
       */
      TEST_ASSERT_TRUE(bound <= before * LM_REAL(2.0));
      before = bound;
    }
    step(80);
    step(-80);
    TEST_ASSERT_TRUE(lm_bound_uncertainty(&joint) == 0);
    TEST_ASSERT_FALSE(step(0).status & LM_STATE_MEMORY_UNKNOWN);
    TEST_ASSERT_TRUE(lm_bound_uncertainty(&joint) == 0);
  }
}

TEST(the_uncertainty_bounds_the_truth_and_shrinks_to_nothing) {
  check_uncertainty();
  put_friction_inside(&parameters);
  check_uncertainty();
  follow_envelope(&parameters);
  check_uncertainty();
}

TEST(a_known_start_has_no_uncertainty) {
  TEST_ASSERT_TRUE(lm_bound_uncertainty(&joint) > LM_REAL(1e-5));
  lm_declare_memory_known(&joint);
  TEST_ASSERT_TRUE(lm_bound_uncertainty(&joint) == 0);
  TEST_ASSERT_EQUAL(0, step(1).status & LM_STATE_MEMORY_UNKNOWN);
}

/* The truth bears a load that no step contains, and returns from it: the bound contains that, and
 * nothing moves. */
TEST(a_history_may_become_unknown_again) {
  int trial;
  for (trial = 0; trial < 100; ++trial) {
    lm_memory truth;
    lm_correction before;
    lm_real load_Nm = draw(-40, 40);
    int i;
    restart();
    lm_start_model(&truth, 0);
    for (i = 0; i < 3; ++i) {
      at.torque_Nm = i == 0 ? 80 : i == 1 ? -80 : load_Nm;
      lm_step_model(&parameters, &truth, &at);
      before = rest(at.torque_Nm, 2000);
    }
    TEST_ASSERT_TRUE(lm_bound_uncertainty(&joint) == 0);
    at.torque_Nm = draw(-80, 80);
    lm_step_model(&parameters, &truth, &at);
    lm_declare_memory_unknown(&joint);
    for (i = 0; i < 25; ++i) {
      lm_correction now;
      lm_real real;
      at.torque_Nm = load_Nm + LM_REAL(i) * draw(-1, 1);
      real = lm_step_model(&parameters, &truth, &at);
      now = lm_step_compensator(&joint, &at);
      TEST_ASSERT_TRUE(distance(now.lost_motion_rad, real) <=
                       lm_bound_uncertainty(&joint) + 32 * ROUNDING * LM_REAL(4e-3));
      if (i == 0) {
        TEST_ASSERT_TRUE(now.status & LM_STATE_MEMORY_UNKNOWN);
        TEST_ASSERT_TRUE(now.lost_motion_rad == before.lost_motion_rad);
        TEST_ASSERT_TRUE(distance(now.correction_rad, before.correction_rad) < LM_REAL(1e-8));
      }
    }
    step(80);
    step(-80);
    TEST_ASSERT_TRUE(lm_bound_uncertainty(&joint) == 0);
  }
}

TEST(a_change_of_parameters_makes_no_step) {
  lm_parameters other = size20();
  lm_correction before = rest(20, 2000);
  lm_real first;
  int i;
  put_friction_inside(&other);
  other.limits.velocity_rad_s = LM_REAL(0.01);
  TEST_ASSERT_EQUAL(LM_OK, lm_change_parameters(&joint, &other, &fault));
  first = before.correction_rad;
  for (i = 0; i < 3000; ++i) {
    lm_correction now = step(20);
    TEST_ASSERT_TRUE(distance(now.correction_rad, before.correction_rad) <=
                     LM_REAL(0.1) * LM_REAL(1e-3));
    TEST_ASSERT_TRUE(distance(now.acceleration_rad_s2, before.acceleration_rad_s2) <=
                     LM_REAL(5.001));
    before = now;
  }
  TEST_ASSERT_TRUE(distance(before.correction_rad, first) > LM_REAL(1e-6));
  TEST_ASSERT_TRUE(distance(before.correction_rad, -before.lost_motion_rad) < LM_REAL(1e-7));
  other.format = 0;
  TEST_ASSERT_EQUAL(LM_CORRUPT, lm_change_parameters(&joint, &other, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_change_parameters(NULL, &other, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_change_parameters(&joint, NULL, &fault));
}

/* Wider bands: the old ones do not determine the position of a play in them, for any swing of the
 * load before. The truth is a model that always had the new bands. */
TEST(a_change_of_bands_makes_the_memory_unknown) {
  lm_parameters wider = parameters;
  lm_memory truth;
  lm_play play[4];
  lm_real bound_rad;
  int i;
  for (i = 0; i < 4; ++i) {
    play[i] = size20_play[i];
    play[i].radius_Nm *= 3;
    play[i].widening = 0;
  }
  TEST_ASSERT_EQUAL(LM_OK, lm_build_play_bank(&wider.plays, play, 4, 4, &fault));
  lm_start_model(&truth, 0);
  for (i = 0; i < 3; ++i) {
    at.torque_Nm = LM_REAL(80 - 160 * (i % 2)) * LM_REAL(i < 2);
    lm_step_model(&wider, &truth, &at);
    step(at.torque_Nm);
  }
  TEST_ASSERT_TRUE(lm_bound_uncertainty(&joint) == 0);
  wider.limits.velocity_rad_s *= 2;
  TEST_ASSERT_EQUAL(LM_OK, lm_change_parameters(&joint, &wider, &fault));
  TEST_ASSERT_TRUE(step(0).status & LM_STATE_MEMORY_UNKNOWN);
  bound_rad = lm_bound_uncertainty(&joint);
  for (i = 0; i < 50; ++i) {
    at.torque_Nm = draw(-1, 1) * LM_REAL(i);
    TEST_ASSERT_TRUE(distance(lm_step_model(&wider, &truth, &at),
                              lm_step_compensator(&joint, &at).lost_motion_rad) <=
                     lm_bound_uncertainty(&joint) + 32 * ROUNDING * LM_REAL(4e-3));
  }
  TEST_ASSERT_TRUE(bound_rad > LM_REAL(1e-4));
  /* Other numbers with the same bands do not change it. */
  step(80);
  step(-80);
  TEST_ASSERT_TRUE(lm_bound_uncertainty(&joint) == 0);
  wider.limits.velocity_rad_s *= 2;
  wider.plays.slot[0].weight *= LM_REAL(0.999999);
  TEST_ASSERT_EQUAL(LM_OK, lm_change_parameters(&joint, &wider, &fault));
  TEST_ASSERT_EQUAL(0, step(0).status & LM_STATE_MEMORY_UNKNOWN);
}

/* Change of only the radius, the widening, the envelope or its knee. */
TEST(any_other_band_counts) {
  int i;
  for (i = 0; i < 4; ++i) {
    lm_parameters other;
    put_friction_inside(&parameters);
    follow_envelope(&parameters);
    other = parameters;
    other.plays.envelope_Nm += LM_REAL(i == 2);
    other.plays.knee_Nm += LM_REAL(i == 3);
    other.plays.slot[2].radius_Nm += LM_REAL(i == 0);
    other.plays.slot[2].edge_slope[0] -= LM_REAL(i == 1) / 64;
    other.plays.slot[2].edge_slope[1] += LM_REAL(i == 1) / 64;
    TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 0, &fault));
    lm_declare_memory_known(&joint);
    TEST_ASSERT_EQUAL(LM_OK, lm_change_parameters(&joint, &other, &fault));
    TEST_ASSERT_TRUE(step(0).status & LM_STATE_MEMORY_UNKNOWN);
  }
}

/* Another torque effect moves what the operators follow, although the load does not move. An effect
 * on the angle does not. */
TEST(an_effect_on_the_torque_counts) {
  int i;
  for (i = 0; i < 5; ++i) {
    lm_parameters other;
    parameters.effect_count = 2;
    parameters.effect[0].effect = &lm_effect_torque_offset;
    parameters.effect[0].value[0] = LM_REAL(0.1);
    parameters.effect[1].effect = &lm_effect_asymmetric_stiffness;
    parameters.effect[1].value[0] = LM_REAL(0.1);
    other = parameters;
    other.effect[0].value[0] += LM_REAL(i == 0) / 8;
    other.effect[1].value[0] += LM_REAL(i == 1) / 16;
    if (i == 2) {
      other.effect[0].effect = &lm_effect_torque_scale;
    } else if (i == 3) {
      other.effect[0] = other.effect[1];
      other.effect_count = 1;
    } else if (i == 4) {
      other.effect_count = 1;
    }
    TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 0, &fault));
    lm_declare_memory_known(&joint);
    TEST_ASSERT_EQUAL(LM_OK, lm_change_parameters(&joint, &other, &fault));
    TEST_ASSERT_EQUAL(i != 1 && i != 4, (step(0).status & LM_STATE_MEMORY_UNKNOWN) != 0);
  }
}

TEST(a_saved_history_is_taken_up_again) {
  lm_saved saved;
  lm_compensator next;
  rest(40, 10);
  rest(-12, 10);
  lm_save_compensator(&joint, &saved);
  TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&next, &parameters, 0, &fault));
  TEST_ASSERT_EQUAL(LM_OK, lm_restore_compensator(&next, &saved, &fault));
  TEST_ASSERT_EQUAL_MEMORY(&joint.memory, &next.memory, sizeof next.memory);
  TEST_ASSERT_TRUE(lm_bound_uncertainty(&next) == lm_bound_uncertainty(&joint));
  lm_declare_memory_known(&joint);
  lm_save_compensator(&joint, &saved);
  TEST_ASSERT_EQUAL(LM_OK, lm_restore_compensator(&next, &saved, &fault));
  TEST_ASSERT_TRUE(lm_bound_uncertainty(&next) == 0);
}

/* Cold grease has widened the bands: the operators are at the positions by the wide bands. */
TEST(a_history_of_wide_bands_is_taken_up_again) {
  lm_saved saved;
  lm_memory kept;
  add_effect(&parameters, &lm_effect_thermal_friction, LM_REAL(0.03), 0);
  restart();
  at.temperature_C = -20;
  rest(40, 10);
  rest(-12, 10);
  lm_save_compensator(&joint, &saved);
  kept = joint.memory;
  TEST_ASSERT_EQUAL(LM_OK, lm_restore_compensator(&joint, &saved, &fault));
  TEST_ASSERT_EQUAL_MEMORY(&kept, &joint.memory, sizeof kept);
}

TEST(a_saved_history_that_does_not_belong_is_refused) {
  lm_saved saved;
  lm_memory kept;
  size_t i;
  rest(40, 10);
  lm_save_compensator(&joint, &saved);
  kept = joint.memory;
  for (i = 0; i < sizeof saved; ++i) {
    ((uint8_t *)&saved)[i] ^= 0x40;
    TEST_ASSERT_EQUAL(LM_CORRUPT, lm_restore_compensator(&joint, &saved, &fault));
    ((uint8_t *)&saved)[i] ^= 0x40;
  }
  saved.format = 2;
  saved.crc = lm_find_crc(0, &saved, offsetof(lm_saved, crc));
  TEST_ASSERT_EQUAL(LM_CORRUPT, lm_restore_compensator(&joint, &saved, &fault));
  TEST_ASSERT_EQUAL_STRING("format", fault.input);
  /* An impossible range of the load with a correct CRC: nothing is known, the bound is the full
   * one.
   */
  for (i = 0; i < 5; ++i) {
    lm_real zero = 0;
    lm_compensator other;
    TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&other, &parameters, 0, &fault));
    lm_save_compensator(&other, &saved);
    saved.lowest_Nm = i == 0 ? zero / zero : i == 1 ? -1 / zero : i == 2 ? 1 : 0;
    saved.highest_Nm = i == 3 ? LM_REAL(1e30) : i == 4 ? -LM_REAL(1) : 0;
    saved.crc = lm_find_crc(0, &saved, offsetof(lm_saved, crc));
    TEST_ASSERT_EQUAL(LM_OK, lm_restore_compensator(&other, &saved, &fault));
    TEST_ASSERT_TRUE(lm_bound_uncertainty(&other) > LM_REAL(1e-5));
  }
  lm_save_compensator(&joint, &saved);
  parameters.fingerprint = 5;
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, lm_restore_compensator(&joint, &saved, &fault));
  TEST_ASSERT_EQUAL_STRING("fingerprint", fault.input);
  TEST_ASSERT_EQUAL(LM_NULL, lm_restore_compensator(NULL, &saved, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_restore_compensator(&joint, NULL, &fault));
  TEST_ASSERT_EQUAL_MEMORY(&kept, &joint.memory, sizeof kept);
}

/* A load that swings by +-20 N*m; the encoder measures `truth` times the model's lost motion. */
static lm_correction swing(double seconds, lm_real truth) {
  lm_correction now = step(0);
  int i;
  for (i = 0; i < (int)(seconds * 1000); ++i) {
    now = step(20 * LM_REAL(sin(i * 0.00628)));
    if (i % 10 == 0) {
      lm_watch_output(&joint, truth * now.lost_motion_rad + LM_REAL(0.3), LM_REAL(0.01));
    }
  }
  return now;
}

TEST(the_watch_lets_a_model_work_that_fits) {
  lm_correction now = swing(8, 1);
  TEST_ASSERT_EQUAL(0, now.status & (LM_STATE_FADED | LM_STATE_MISFIT));
  TEST_ASSERT_TRUE(joint.gain == 1);
}

TEST(the_watch_fades_a_model_out_that_makes_it_worse) {
  lm_correction now = swing(8, -1);
  TEST_ASSERT_TRUE(now.status & LM_STATE_FADED);
  TEST_ASSERT_TRUE(now.status & LM_STATE_MISFIT);
  TEST_ASSERT_TRUE(joint.gain == 0);
  TEST_ASSERT_TRUE(distance(now.correction_rad, 0) < LM_REAL(1e-5));
  now = swing(12, 1);
  TEST_ASSERT_TRUE(joint.gain == 1);
  TEST_ASSERT_EQUAL(0, now.status & (LM_STATE_FADED | LM_STATE_MISFIT));
}

TEST(the_watch_takes_noise_for_noise) {
  int i;
  for (i = 0; i < 2000; ++i) {
    lm_correction now = step(0);
    lm_watch_output(&joint, now.lost_motion_rad + draw(LM_REAL(-1e-5), LM_REAL(1e-5)),
                    LM_REAL(0.01));
  }
  TEST_ASSERT_TRUE(joint.gain == 1);
}

/* At rest under load the measurement is only its noise, for any result of the model: here five
 * times the noise of the parameters. */
TEST(the_watch_leaves_a_rest_alone_however_noisy_the_encoder) {
  lm_real most_rad = 5 * LM_REAL(1.7320508) * parameters.watch.noise_rad;
  int i;
  (void)rest(20, 3000);
  for (i = 0; i < 60000; ++i) {
    lm_correction now = step(20);
    lm_watch_output(&joint, now.lost_motion_rad + draw(-most_rad, most_rad), LM_REAL(0.01));
    TEST_ASSERT_TRUE(joint.gain == 1);
  }
}

TEST(the_watch_ignores_nonsense_and_reports_it) {
  lm_real zero = 0;
  static const int cases = 5;
  int i;
  for (i = 0; i < cases; ++i) {
    lm_compensator kept = joint;
    lm_watch_output(&joint,
                    i == 0   ? zero / zero
                    : i == 1 ? 1 / zero
                             : LM_REAL(0.1),
                    i == 2   ? zero / zero
                    : i == 3 ? 0
                    : i == 4 ? 1 / zero
                             : LM_REAL(0.1));
    TEST_ASSERT_EQUAL(kept.standing | LM_STATE_WATCH_REFUSED, joint.standing);
    TEST_ASSERT_TRUE(step(0).status & LM_STATE_WATCH_REFUSED);
    lm_watch_output(&joint, 0, LM_REAL(0.1));
    TEST_ASSERT_EQUAL(0, step(0).status & LM_STATE_WATCH_REFUSED);
  }
}

TEST(inputs_that_are_not_finite_change_nothing) {
  lm_real zero = 0;
  lm_correction before = rest(20, 3000);
  lm_correction now = step(zero / zero);
  TEST_ASSERT_TRUE(now.status & LM_STATE_INPUT_REFUSED);
  TEST_ASSERT_TRUE(now.lost_motion_rad == before.lost_motion_rad);
  now = step(1 / zero);
  TEST_ASSERT_TRUE(now.status & LM_STATE_INPUT_REFUSED);
  TEST_ASSERT_TRUE(now.lost_motion_rad == before.lost_motion_rad);
  at.temperature_C = zero / zero;
  TEST_ASSERT_EQUAL(0, step(20).status & LM_STATE_INPUT_REFUSED); /* not requested */
  add_effect(&parameters, &lm_effect_thermal_drift, LM_REAL(1e-6), 0);
  restart();
  TEST_ASSERT_EQUAL(LM_STATE_INPUT_REFUSED, step(20).status & LM_STATE_INPUT_REFUSED);
  at.temperature_C = 20;
  TEST_ASSERT_EQUAL(0, step(20).status & LM_STATE_INPUT_REFUSED);
}

static lm_real nothing_of(const lm_real *value, lm_real *own, const lm_conditions *now) {
  (void)value;
  (void)own;
  (void)now;
  return 0;
}

#define OF_STEP(field, ...)
#define OTHER(field, ...) &at.field,
#define NEED_OF_OTHER(field, NEED, ...) LM_NEEDS_##NEED,

/* Each condition by itself that an effect needs: not finite, beyond its range, not set. Conditions
 * that no effect needs are not examined. */
TEST(a_condition_that_means_nothing_is_refused) {
  static const uint32_t needs[] = {
      LM_CONDITION_LIST(OF_STEP, NEED_OF_OTHER, NEED_OF_OTHER, NEED_OF_OTHER)};
  lm_real *condition[] = {LM_CONDITION_LIST(OF_STEP, OTHER, OTHER, OTHER)};
  lm_real zero = 0;
  const uint32_t judged =
      LM_STATE_INPUT_REFUSED | LM_STATE_CONDITION_MISSING | LM_STATE_EXTRAPOLATED;
  size_t i;
  size_t k;
  for (i = 0; i < sizeof condition / sizeof condition[0]; ++i) {
    lm_effect needy = {9u, LM_EFFECT_ANGLE, 1, 0, 0, nothing_of, {{-1, 1}}, NULL};
    needy.covariates = needs[i];
    parameters.effect_count = 0;
    TEST_ASSERT_EQUAL(LM_NEEDS_TORQUE, lm_find_needs(&parameters));
    add_effect(&parameters, &needy, 1, 0);
    TEST_ASSERT_EQUAL(LM_NEEDS_TORQUE | needs[i], lm_find_needs(&parameters));
    restart();
    for (k = 0; k < sizeof condition / sizeof condition[0]; ++k) {
      lm_real kept = *condition[k];
      *condition[k] = zero / zero;
      TEST_ASSERT_EQUAL(i == k ? LM_STATE_INPUT_REFUSED : 0u, step(20).status & judged);
      *condition[k] = LM_REAL(-2e12);
      TEST_ASSERT_EQUAL(i == k ? LM_STATE_INPUT_REFUSED : 0u, step(20).status & judged);
      *condition[k] = LM_UNKNOWN;
      TEST_ASSERT_EQUAL(i == k ? LM_STATE_CONDITION_MISSING : 0u, step(20).status & judged);
      *condition[k] = 1000;
      TEST_ASSERT_EQUAL(0, step(20).status & judged);
      *condition[k] = kept;
    }
  }
  parameters.effect_count = 0;
  add_effect(&parameters, &lm_effect_torque_offset, 1, 0); /* of another kind than an angle */
  TEST_ASSERT_EQUAL(LM_NEEDS_TORQUE, lm_find_needs(&parameters));
  parameters.effect_count = 0;
  TEST_ASSERT_EQUAL(0, lm_find_needs(NULL));
}

/* A host that does not wrap its angles is informed before the waves jump, for any order. */
TEST(an_angle_of_many_turns_is_refused_before_the_waves_jump) {
  static const lm_effect *const waves[] = {
      &lm_effect_kinematic_error, &lm_effect_kinematic_sideband, &lm_effect_lobe_eccentricity,
      &lm_effect_stiffness_modulation, &lm_effect_output_eccentricity};
  size_t i;
  for (i = 0; i < sizeof waves / sizeof waves[0]; ++i) {
    lm_real turn_rad;
    int32_t k;
    parameters = size20();
    add_effect(&parameters, waves[i], 0, 0);
    for (k = 0; k < waves[i]->value_count; ++k) {
      parameters.effect[0].value[k] = waves[i]->card->value[k].typical;
    }
    TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 20, &fault));
    for (turn_rad = 0; turn_rad < 7000; turn_rad += LM_REAL(0.5)) {
      lm_correction now;
      lm_real here_rad;
      at.input_angle_rad = turn_rad;
      at.output_angle_rad = turn_rad;
      now = step(20);
      at.input_angle_rad = LM_REAL(remainder((double)turn_rad, 2 * 3.14159265358979323846));
      at.output_angle_rad = at.input_angle_rad;
      here_rad = step(20).lost_motion_rad;
      TEST_ASSERT_TRUE(turn_rad > LM_ANGLE_MAX_RAD ||
                       distance(now.lost_motion_rad, here_rad) < LM_REAL(2e-7));
      TEST_ASSERT_EQUAL(turn_rad > LM_ANGLE_MAX_RAD ? LM_STATE_INPUT_REFUSED : 0u,
                        now.status & LM_STATE_INPUT_REFUSED);
    }
  }
}

/* Conditions of a host that knows only the torque. */
static lm_correction tell(const lm_conditions *told, int ticks) {
  lm_correction now = lm_step_compensator(&joint, told);
  int i;
  for (i = 1; i < ticks; ++i) {
    now = lm_step_compensator(&joint, told);
  }
  return now;
}

TEST(a_tick_whose_length_is_not_given_lasts_one_period) {
  lm_conditions told = LM_CONDITIONS_UNKNOWN;
  lm_conditions timed = LM_CONDITIONS_UNKNOWN;
  lm_conditions nonsense = LM_CONDITIONS_UNKNOWN;
  lm_compensator begun;
  lm_correction now;
  lm_correction again;
  lm_real plain_rad = rest(20, 1).lost_motion_rad;
  add_effect(&parameters, &lm_effect_sensor_lag, LM_REAL(0.01), 0);
  add_effect(&parameters, &lm_effect_creep, LM_REAL(0.01), LM_REAL(0.05));
  TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 0, &fault));
  (void)tell(&told, 1);
  begun = joint;
  told.torque_Nm = 20;
  timed.torque_Nm = 20;
  timed.elapsed_s = parameters.limits.period_s;
  nonsense.torque_Nm = 20;
  nonsense.elapsed_s = -1;
  now = tell(&told, 500);
  /* ln(1 + 0.5 / 0.05) of one hundredth. */
  TEST_ASSERT_TRUE(now.lost_motion_rad > LM_REAL(1.015) * plain_rad);
  TEST_ASSERT_TRUE(now.lost_motion_rad < LM_REAL(1.03) * plain_rad);
  joint = begun;
  again = tell(&timed, 500);
  TEST_ASSERT_TRUE(again.lost_motion_rad == now.lost_motion_rad);
  joint = begun;
  again = tell(&nonsense, 500);
  TEST_ASSERT_TRUE(again.lost_motion_rad == now.lost_motion_rad);
}

static lm_real broken(const lm_real *value, lm_real *own, const lm_conditions *now) {
  (void)own;
  return value[0] / (now->torque_Nm - now->torque_Nm);
}
static const lm_effect broken_effect = {3u,     LM_EFFECT_ANGLE, 1,   0, LM_NEEDS_TORQUE,
                                        broken, {{-1, 1}},       NULL};

TEST(a_users_effect_that_breaks_is_contained) {
  lm_correction before = rest(20, 3000);
  lm_correction now;
  add_effect(&parameters, &broken_effect, 1, 0);
  now = rest(30, 10);
  TEST_ASSERT_TRUE(now.status & LM_STATE_MODEL_REFUSED);
  TEST_ASSERT_TRUE(now.lost_motion_rad == before.lost_motion_rad);
  TEST_ASSERT_TRUE(distance(now.correction_rad, before.correction_rad) < LM_REAL(1e-6));
}

TEST(bad_parameters_do_not_start) {
  TEST_ASSERT_EQUAL(LM_NULL, lm_start_compensator(NULL, &parameters, 0, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_start_compensator(&joint, NULL, 0, &fault));
  parameters.format = 0;
  TEST_ASSERT_EQUAL(LM_CORRUPT, lm_start_compensator(&joint, &parameters, 0, &fault));
  TEST_ASSERT_EQUAL(LM_STATE_NOT_STARTED, step(20).status);
}

/* Null, zeroed, and of any bytes after a refused start: nothing is corrected, and nothing is read
 * or written through a null pointer. */
TEST(an_instance_that_was_not_started_corrects_nothing) {
  static lm_compensator zeroed;
  lm_compensator refused;
  lm_compensator *every[3];
  lm_standstill standstill = {0, 0, 0};
  int i;
  memset(&refused, 0xA5, sizeof refused);
  parameters.torque_limit_Nm = -1;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_start_compensator(&refused, &parameters, 0, &fault));
  parameters.torque_limit_Nm = 80;
  every[0] = NULL;
  every[1] = &zeroed;
  every[2] = &refused;
  for (i = 0; i < 3; ++i) {
    lm_correction now;
    lm_saved saved;
    lm_set_headroom(every[i], NULL);
    lm_set_mode(every[i], LM_MODE_HOLD);
    lm_declare_memory_unknown(every[i]);
    lm_declare_memory_known(every[i]);
    lm_declare_shared_zero(every[i]);
    lm_declare_torque_error(every[i], 1);
    lm_watch_output(every[i], 1, 1);
    standstill.ticks = 9;
    TEST_ASSERT_TRUE(lm_find_standstill(every[i], &standstill) == 0);
    TEST_ASSERT_EQUAL(0, standstill.ticks);
    TEST_ASSERT_TRUE(lm_bound_uncertainty(every[i]) == 0);
    TEST_ASSERT_EQUAL(LM_NULL, lm_change_parameters(every[i], &parameters, &fault));
    now = lm_step_compensator(every[i], &at);
    TEST_ASSERT_EQUAL(LM_STATE_NOT_STARTED, now.status);
    TEST_ASSERT_TRUE(now.correction_rad == 0 && now.velocity_rad_s == 0);
    TEST_ASSERT_TRUE(now.acceleration_rad_s2 == 0 && now.lost_motion_rad == 0);
    now = lm_settle_compensator(every[i], &at);
    TEST_ASSERT_EQUAL(LM_STATE_NOT_STARTED, now.status);
    memset(&saved, 0, sizeof saved);
    lm_save_compensator(every[i], &saved);
    TEST_ASSERT_EQUAL(LM_CORRUPT, lm_restore_compensator(&joint, &saved, &fault));
    TEST_ASSERT_EQUAL(LM_NULL, lm_restore_compensator(every[i], &saved, &fault));
  }
  lm_save_compensator(&joint, NULL);
  TEST_ASSERT_EQUAL(0, step(0).status & LM_STATE_NOT_STARTED);
}

/* Power-up under load: the correction is at its target at once, and nothing moves from then on. */
TEST(a_settled_start_moves_nothing) {
  lm_correction now;
  int i;
  TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 30, &fault));
  at.torque_Nm = 30;
  now = lm_settle_compensator(&joint, &at);
  TEST_ASSERT_TRUE(now.correction_rad == -now.lost_motion_rad && now.velocity_rad_s == 0);
  TEST_ASSERT_EQUAL(LM_STATE_MEMORY_UNKNOWN | LM_STATE_SETTLED, now.status);
  for (i = 0; i < 1000; ++i) {
    TEST_ASSERT_TRUE(step(30).correction_rad == now.correction_rad);
    TEST_ASSERT_TRUE(step(30).status & LM_STATE_SETTLED);
  }
  /* During a motion, and beyond the limit of the position. */
  (void)rest(-30, 20);
  TEST_ASSERT_EQUAL(0, step(-30).status & LM_STATE_SETTLED);
  parameters.limits.correction_rad = LM_REAL(1e-4);
  TEST_ASSERT_EQUAL(LM_OK, lm_change_parameters(&joint, &parameters, &fault));
  at.torque_Nm = 30;
  now = lm_settle_compensator(&joint, &at);
  TEST_ASSERT_TRUE(now.correction_rad == -parameters.limits.correction_rad);
  TEST_ASSERT_EQUAL(LM_STATE_POSITION_LIMITED | LM_STATE_SETTLED,
                    now.status & ~LM_STATE_MEMORY_UNKNOWN);
  TEST_ASSERT_TRUE(step(30).correction_rad == now.correction_rad);
}

TEST(conditions_end_at_the_range_that_was_fitted) {
  lm_real cold_rad;
  lm_real warm_rad;
  const uint32_t judged =
      LM_STATE_EXTRAPOLATED | LM_STATE_CONDITION_MISSING | LM_STATE_INPUT_REFUSED;
  parameters.valid.temperature_C[0] = 10;
  parameters.valid.temperature_C[1] = 50;
  parameters.valid.torque_Nm = 40;
  add_effect(&parameters, &lm_effect_thermal_drift, LM_REAL(1e-6), 0);
  TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 0, &fault));
  at.temperature_C = 10;
  cold_rad = rest(20, 5).lost_motion_rad;
  TEST_ASSERT_EQUAL(0, step(20).status & judged);
  at.temperature_C = LM_REAL(-273.15);
  TEST_ASSERT_EQUAL(LM_STATE_EXTRAPOLATED, step(20).status & judged);
  TEST_ASSERT_TRUE(step(20).lost_motion_rad == cold_rad);
  at.temperature_C = 50;
  warm_rad = step(20).lost_motion_rad;
  TEST_ASSERT_TRUE(distance(warm_rad - cold_rad, LM_REAL(40e-6)) < LM_REAL(1e-9));
  at.temperature_C = 400;
  TEST_ASSERT_EQUAL(LM_STATE_EXTRAPOLATED, step(20).status & judged);
  TEST_ASSERT_TRUE(step(20).lost_motion_rad == warm_rad);
  at.temperature_C = LM_UNKNOWN;
  TEST_ASSERT_EQUAL(LM_STATE_CONDITION_MISSING, step(20).status & judged);
  parameters.valid.temperature_C[0] = 0; /* a range that begins at zero is valid */
  at.temperature_C = 400;
  TEST_ASSERT_EQUAL(LM_STATE_EXTRAPOLATED, step(20).status & judged);
  TEST_ASSERT_TRUE(step(20).lost_motion_rad == warm_rad);
  at.temperature_C = 20;
  TEST_ASSERT_EQUAL(0, step(40).status & judged);
  TEST_ASSERT_EQUAL(LM_STATE_EXTRAPOLATED, step(41).status & judged);
  TEST_ASSERT_EQUAL(LM_STATE_EXTRAPOLATED | LM_STATE_TORQUE_CLIPPED,
                    step(90).status & (judged | LM_STATE_TORQUE_CLIPPED));
  TEST_ASSERT_EQUAL(LM_STATE_CONDITION_MISSING,
                    step(LM_UNKNOWN).status & LM_STATE_CONDITION_MISSING);
  TEST_ASSERT_TRUE(joint.memory.plays.torque_Nm == 80);
  parameters.effect_count = 0;
}

TEST(a_missing_condition_is_reported) {
  lm_correction now = lm_step_compensator(&joint, NULL);
  TEST_ASSERT_TRUE(now.status & LM_STATE_CONDITION_MISSING);
  TEST_ASSERT_TRUE(now.lost_motion_rad == 0);
}

TEST(a_period_that_is_not_the_loops_is_reported) {
  static const lm_real share[] = {
      LM_REAL(0.25), LM_REAL(0.45), LM_REAL(0.6), 1, LM_REAL(1.4), LM_REAL(1.6), 10};
  static const int wrong[] = {1, 1, 0, 0, 0, 1, 1};
  size_t i;
  for (i = 0; i < sizeof share / sizeof share[0]; ++i) {
    at.elapsed_s = share[i] * parameters.limits.period_s;
    TEST_ASSERT_EQUAL(wrong[i] ? LM_STATE_PERIOD_WRONG : 0u,
                      step(1).status & LM_STATE_PERIOD_WRONG);
  }
  at.elapsed_s = 0;
}

TEST(a_change_of_the_period_is_refused) {
  lm_parameters other = parameters;
  lm_compensator kept = joint;
  other.limits.period_s = LM_REAL(5e-4);
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, lm_change_parameters(&joint, &other, &fault));
  TEST_ASSERT_EQUAL_STRING("period_s", fault.input);
  TEST_ASSERT_EQUAL_MEMORY(&kept, &joint, sizeof joint);
}

/* A move under load, then a rest of a minute: the model is wrong by a twentieth; the resulting 2
 * arcsec at rest must not remove the 100 arcsec that the correction compensates. */
TEST(the_watch_leaves_a_constant_correction) {
  int i;
  for (i = 0; i < 6100; ++i) {
    lm_correction now = rest(i < 100 ? LM_REAL(0.2) * LM_REAL(i) : 20, 10);
    lm_real wander_rad = LM_REAL(1e-5) * LM_REAL(sin(i * 0.01));
    lm_watch_output(&joint, LM_REAL(0.95) * now.lost_motion_rad + wander_rad, LM_REAL(0.01));
    TEST_ASSERT_TRUE(joint.gain == 1);
  }
}

/* The measured lost motion is constant, the torque's estimate wanders by 5 of 30 N*m. */
TEST(the_watch_leaves_a_correction_whose_torque_wanders) {
  int i;
  (void)rest(30, 10);
  for (i = 0; i < 6000; ++i) {
    (void)rest(30 + 5 * LM_REAL(sin(i * 0.05)), 10);
    lm_watch_output(&joint, LM_REAL(1e-3), LM_REAL(0.01));
    TEST_ASSERT_TRUE(joint.gain == 1);
  }
}

/* Swings of +-20 N*m in which the drive measures nothing: it compensates by itself. */
TEST(the_watch_finds_a_drive_that_compensates_already) {
  int i;
  lm_correction now = step(0);
  for (i = 0; i < 800 && !(now.status & LM_STATE_FADED); ++i) {
    now = rest(20 * LM_REAL(sin(i * 0.0628)), 10);
    lm_watch_output(&joint, LM_REAL(0.3), LM_REAL(0.01));
  }
  TEST_ASSERT_TRUE(i < 300); /* three seconds */
}

/* Once the doubt is complete, an axis at rest creeps slowly, even if the gain could fade fast. */
TEST(a_fade_of_a_standing_axis_creeps) {
  lm_real before_rad;
  int i;
  parameters.watch.creep_rad_s = LM_REAL(5e-5);
  TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 0, &fault));
  (void)swing(2, -1);
  TEST_ASSERT_TRUE(joint.gain < 1 && joint.gain > 0);
  before_rad = rest(30, 2000).correction_rad;
  lm_watch_output(&joint, 0, LM_REAL(0.01)); /* permitted by the motion so far */
  before_rad = rest(30, 2000).correction_rad;
  for (i = 0; i < 200; ++i) {
    lm_correction now;
    lm_watch_output(&joint, 0, LM_REAL(0.01));
    now = rest(30, 2000);
    TEST_ASSERT_TRUE(distance(now.correction_rad, before_rad) <= LM_REAL(5.1e-7));
    before_rad = now.correction_rad;
  }
}

/* Both encoders share a zero: a constant load and a model of the wrong sign. */
TEST(a_shared_zero_makes_the_mean_count) {
  int i;
  lm_declare_shared_zero(&joint);
  for (i = 0; i < 1000; ++i) {
    lm_correction now = rest(30, 10);
    lm_watch_output(&joint, -now.lost_motion_rad, LM_REAL(0.01));
  }
  TEST_ASSERT_TRUE(joint.gain == 0);
  TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 0, &fault));
  lm_declare_shared_zero(&joint);
  for (i = 0; i < 1000; ++i) {
    lm_correction now = rest(30, 10);
    lm_watch_output(&joint, LM_REAL(0.9) * now.lost_motion_rad, LM_REAL(0.01));
  }
  TEST_ASSERT_TRUE(joint.gain == 1);
}

/* A torque that swings at a rate [Hz] for some seconds; returns the correction's swing in the last
 * one.
 */
static lm_real shake(lm_real rate_Hz, int seconds) {
  lm_real low_rad = 1;
  lm_real high_rad = -1;
  int i;
  for (i = 0; i < 1000 * seconds; ++i) {
    lm_correction now = step(10 + 8 * LM_REAL(sin(6.2831853 * (double)rate_Hz * i * 1e-3)));
    if (i >= 1000 * (seconds - 1)) {
      low_rad = now.correction_rad < low_rad ? now.correction_rad : low_rad;
      high_rad = now.correction_rad > high_rad ? now.correction_rad : high_rad;
    }
  }
  return high_rad - low_rad;
}

TEST(ringing_is_reported_and_ends) {
  lm_correction now;
  lm_real fast_rad;
  lm_real hidden_rad;
  int i;
  TEST_ASSERT_TRUE(shake(15, 2) > LM_REAL(1e-4)); /* no limit of ringing was stated */
  TEST_ASSERT_EQUAL(0, joint.standing & LM_STATE_RINGING);
  parameters.watch.ringing_Hz = 5;
  TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 10, &fault));
  fast_rad = shake(2, 3); /* slower motion is commanded */
  TEST_ASSERT_EQUAL(0, joint.standing & LM_STATE_RINGING);
  TEST_ASSERT_TRUE(shake(15, 2) < LM_REAL(0.1) * fast_rad);
  TEST_ASSERT_TRUE(step(10).status & LM_STATE_RINGING);
  /* No torque error was declared: the axis behaves as without compensation. */
  TEST_ASSERT_TRUE(distance(rest(30, 3000).correction_rad, 0) < LM_REAL(1e-6));
  for (i = 0; i < 4; ++i) {
    static const lm_real nonsense[] = {-1, LM_REAL(NAN), LM_REAL(INFINITY), LM_REAL(1e30)};
    lm_declare_torque_error(&joint, 0);
    lm_declare_torque_error(&joint, nonsense[i]);
    TEST_ASSERT_TRUE(distance(rest(30, 3000).correction_rad, 0) < LM_REAL(1e-6));
  }
  /* A constant lost motion is corrected, except for the possible effect of the error at no load. */
  for (i = 0; i < 2; ++i) {
    lm_real error_Nm = LM_REAL(i * 5);
    hidden_rad = LM_REAL(0.5) * (lm_evaluate_curve(&parameters.curve, error_Nm) -
                                 lm_evaluate_curve(&parameters.curve, -error_Nm));
    lm_declare_torque_error(&joint, error_Nm);
    now = rest(30, 3000);
    TEST_ASSERT_TRUE(i == 0 || hidden_rad > LM_REAL(1e-5));
    TEST_ASSERT_TRUE(distance(now.correction_rad, hidden_rad - now.lost_motion_rad) <
                     LM_REAL(1e-6));
    now = rest(-30, 3000);
    TEST_ASSERT_TRUE(distance(now.correction_rad, -hidden_rad - now.lost_motion_rad) <
                     LM_REAL(1e-6));
  }
  TEST_ASSERT_TRUE(distance(rest(0, 3000).correction_rad, 0) < LM_REAL(1e-6));
  TEST_ASSERT_TRUE(step(30).status & LM_STATE_RINGING);
  lm_set_mode(&joint, LM_MODE_RUN); /* as before */
  TEST_ASSERT_TRUE(step(30).status & LM_STATE_RINGING);
  /* Homing and probing do not restore the correction of a loop that rang; a reset does. */
  lm_set_mode(&joint, LM_MODE_HOLD);
  TEST_ASSERT_TRUE(step(30).status & LM_STATE_RINGING);
  lm_set_mode(&joint, LM_MODE_RUN);
  TEST_ASSERT_TRUE(step(30).status & LM_STATE_RINGING);
  lm_set_mode(&joint, LM_MODE_RESET);
  lm_set_mode(&joint, LM_MODE_RUN);
  TEST_ASSERT_EQUAL(0, step(30).status & LM_STATE_RINGING);
}

/* A noisy sensor behind a filter of the first order, and a load that changes its sign: after three
 * time constants of standstill hardly any motion remains, and the noise does not prevent the
 * standstill. */
TEST(a_standstill_is_found_in_noise_and_not_before_its_time) {
  const lm_real filter_s = LM_REAL(0.08);
  const lm_real load_Nm[] = {-12, 12, 11, -12};
  lm_standstill standstill = {0, 0, 0};
  lm_real filtered_Nm = -12;
  lm_real settled_first_rad = 0;
  size_t k;
  for (k = 0; k < sizeof load_Nm / sizeof load_Nm[0]; ++k) {
    lm_correction now;
    lm_real stood_rad;
    lm_real end_rad = 0;
    int settled = 0;
    int ticks = 0;
    int i;
    standstill.ticks = 0;
    do {
      filtered_Nm += (load_Nm[k] + LM_REAL(0.5) * draw(-1, 1) - filtered_Nm) *
                     parameters.limits.period_s / filter_s;
      now = step(filtered_Nm);
      if (!settled && k == 1 && (now.status & LM_STATE_SETTLED)) {
        settled = 1;
        settled_first_rad = now.correction_rad;
      }
      TEST_ASSERT_TRUE(++ticks < 3000);
    } while (lm_find_standstill(&joint, &standstill) < 3 * filter_s);
    stood_rad = now.correction_rad;
    for (i = 0; i < 1000; ++i) {
      filtered_Nm += (load_Nm[k] + LM_REAL(0.5) * draw(-1, 1) - filtered_Nm) *
                     parameters.limits.period_s / filter_s;
      end_rad += LM_REAL(1e-3) * step(filtered_Nm).correction_rad;
    }
    TEST_ASSERT_TRUE(distance(stood_rad, end_rad) < parameters.watch.noise_rad);
    if (k == 1) {
      TEST_ASSERT_TRUE(distance(settled_first_rad, end_rad) > 2 * parameters.watch.noise_rad);
    }
  }
}

/* The seconds since the correction left the range, or since the count was restarted. */
TEST(a_standstill_begins_anew_with_a_motion) {
  lm_standstill standstill = {0, 0, 0};
  int i;
  (void)rest(10, 2000);
  for (i = 0; i < 100; ++i) {
    (void)step(10);
    TEST_ASSERT_TRUE(distance(lm_find_standstill(&joint, &standstill),
                              LM_REAL(i) * parameters.limits.period_s) < LM_REAL(1e-6));
  }
  (void)rest(20, 10);
  TEST_ASSERT_TRUE(lm_find_standstill(&joint, &standstill) == 0);
  (void)rest(20, 2000);
  standstill.ticks = UINT32_MAX;
  standstill.lowest_rad = joint.correction_rad;
  standstill.highest_rad = joint.correction_rad;
  (void)lm_find_standstill(&joint, &standstill);
  TEST_ASSERT_EQUAL(UINT32_MAX, standstill.ticks);
}

/* A new mode or new parameters move the target at once, the correction only within its limits: it
 * does not stand although it has hardly moved. */
TEST(a_standstill_ends_when_the_target_moves) {
  lm_standstill standstill = {0, 0, 0};
  lm_parameters other = parameters;
  int i;
  (void)rest(10, 2000);
  for (i = 0; i < 100; ++i) {
    (void)step(10);
    (void)lm_find_standstill(&joint, &standstill);
  }
  TEST_ASSERT_TRUE(standstill.ticks == 100);
  lm_set_mode(&joint, LM_MODE_RESET);
  (void)step(10);
  TEST_ASSERT_TRUE(lm_find_standstill(&joint, &standstill) == 0);
  (void)rest(10, 2000);
  standstill.ticks = 0;
  for (i = 0; i < 100; ++i) {
    (void)step(10);
    (void)lm_find_standstill(&joint, &standstill);
  }
  TEST_ASSERT_TRUE(standstill.ticks == 100);
  other.limits.correction_rad = LM_REAL(0.5) * distance(joint.lost_motion_rad, 0);
  lm_set_mode(&joint, LM_MODE_RUN);
  TEST_ASSERT_EQUAL(LM_OK, lm_change_parameters(&joint, &other, &fault));
  (void)step(10);
  TEST_ASSERT_TRUE(lm_find_standstill(&joint, &standstill) == 0);
  for (i = 0; i < 3000; ++i) {
    lm_correction now = step(10);
    TEST_ASSERT_TRUE(i < 2900 || (now.status & LM_STATE_POSITION_LIMITED));
    (void)lm_find_standstill(&joint, &standstill);
  }
  TEST_ASSERT_TRUE(standstill.ticks > 1000); /* at the limit, which the target exceeds */
}

/* A kinematic error swings the correction as the axis turns, at any speed, and no torque
 * causes this. A torque that rings in addition is found, unless the correction is held and
 * follows none. */
TEST(a_kinematic_error_does_not_ring) {
  static const lm_real speed_Hz[] = {1, 3, 6, 10, 20, 40};
  int ringing;
  size_t k;
  parameters.effect[0].effect = &lm_effect_kinematic_error;
  parameters.effect[0].value[1] = LM_REAL(1.5e-4); /* 30 arcsec, 7 times the noise */
  parameters.effect_count = 1;
  parameters.watch.ringing_Hz = 5;
  for (ringing = 0; ringing < 3; ++ringing) {
    for (k = 0; k < sizeof speed_Hz / sizeof speed_Hz[0]; ++k) {
      lm_correction now = {0, 0, 0, 0, 0};
      lm_real low_rad = 1;
      lm_real high_rad = -1;
      int i;
      TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 10, &fault));
      lm_set_mode(&joint, ringing == 2 ? LM_MODE_HOLD : LM_MODE_RUN);
      for (i = 0; i < 6000; ++i) {
        int shaken = ringing && i < 1000;
        at.input_angle_rad = LM_REAL(3.14159265 * (double)speed_Hz[k] * i * 1e-3);
        now = step(10 + (shaken ? 8 * LM_REAL(sin(6.2831853 * 15 * i * 1e-3)) : 0) +
                   LM_REAL(0.1) * draw(-1, 1));
        if (i > 5000) {
          low_rad = now.correction_rad < low_rad ? now.correction_rad : low_rad;
          high_rad = now.correction_rad > high_rad ? now.correction_rad : high_rad;
        }
      }
      TEST_ASSERT_EQUAL(ringing == 1 ? LM_STATE_RINGING : 0u, now.status & LM_STATE_RINGING);
      if (!ringing && speed_Hz[k] <= 10) {
        TEST_ASSERT_TRUE(high_rad - low_rad > LM_REAL(2.5e-4));
      }
    }
  }
}

/* Swings far below the noise do not count, and a motion that continues after a small reversal is no
 * swing.
 */
TEST(noise_does_not_ring) {
  int i;
  parameters.watch.ringing_Hz = 5;
  TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 10, &fault));
  for (i = 0; i < 20000; ++i) {
    lm_correction now = step(LM_REAL(i % 4000) * LM_REAL(0.005) + draw(-1, 1) / 8);
    TEST_ASSERT_EQUAL(0, now.status & LM_STATE_RINGING);
  }
}

/* The response falls and the limits with it, during any motion. tests/fuzz/limiter_differences.c
 * shows that nothing jumps; here: the new limits are finally active, and at once if the correction
 * is at rest. */
TEST(narrower_parameters_are_in_force_in_the_end) {
  lm_parameters narrow = parameters;
  int moment;
  narrow.limits.response_per_s = 10;
  narrow.limits.acceleration_rad_s2 = LM_REAL(0.1);
  for (moment = 0; moment < 40; ++moment) {
    TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 0, &fault));
    if (moment > 0) {
      (void)rest(70, moment);
    }
    TEST_ASSERT_EQUAL(LM_OK, lm_change_parameters(&joint, &narrow, &fault));
    TEST_ASSERT_EQUAL(moment == 0 ? 0u : LM_STATE_HEADROOM_SHORT,
                      joint.standing & LM_STATE_HEADROOM_SHORT);
    (void)rest(70, 4000);
    TEST_ASSERT_EQUAL(0, joint.standing & LM_STATE_HEADROOM_SHORT);
    TEST_ASSERT_TRUE(joint.velocity_per_s == 10);
    TEST_ASSERT_TRUE(joint.acceleration_max_rad_s2 == LM_REAL(0.1));
  }
}

/* A motion that exceeds the new limit of velocity, or will exceed it, ends under the old one.
 */
TEST(a_velocity_beyond_the_new_limit_is_reported) {
  lm_parameters slow = parameters;
  int moment;
  for (moment = 1; moment < 40; ++moment) {
    lm_real velocity_rad_s;
    int share;
    for (share = 0; share < 2; ++share) {
      TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 0, &fault));
      velocity_rad_s = rest(70, moment).velocity_rad_s;
      velocity_rad_s = velocity_rad_s < 0 ? -velocity_rad_s : velocity_rad_s;
      slow.limits.velocity_rad_s = velocity_rad_s * (share ? LM_REAL(1.001) : LM_REAL(0.9));
      TEST_ASSERT_EQUAL(LM_OK, lm_change_parameters(&joint, &slow, &fault));
      if (!share) {
        TEST_ASSERT_TRUE(joint.standing & LM_STATE_HEADROOM_SHORT);
      }
      (void)rest(70, 20000);
      TEST_ASSERT_EQUAL(0, joint.standing & LM_STATE_HEADROOM_SHORT);
    }
  }
}

/* In either direction of the first swing. */
TEST(ringing_is_reported_in_either_direction) {
  int side;
  parameters.watch.ringing_Hz = 5;
  for (side = -1; side <= 1; side += 2) {
    TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 10, &fault));
    at.torque_Nm = 10;
    (void)lm_settle_compensator(&joint, &at);
    (void)shake(LM_REAL(15 * side), 2);
    TEST_ASSERT_TRUE(joint.standing & LM_STATE_RINGING);
  }
}
