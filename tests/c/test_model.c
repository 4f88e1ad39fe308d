#include "lostmotion/model.h"

#include "size20.h"
#include "test.h"

#define ARCMIN LM_REAL(2.908882086657216e-4) /* rad */

static lm_parameters parameters;
static lm_memory memory;
static lm_conditions at;
static lm_fault fault;

void setUp(void) {
  parameters = size20();
  memset(&at, 0, sizeof at);
  memset(&memory, 0, sizeof memory);
  at.temperature_C = LM_REFERENCE_TEMPERATURE_C;
  lm_start_model(&memory, 0);
  seed = 1;
}

static lm_real step(lm_real torque_Nm) {
  at.torque_Nm = torque_Nm;
  return lm_step_model(&parameters, &memory, &at);
}

TEST(the_sum_is_torsion_curve_and_friction) {
  /* Test set S20: hysteresis loss 1.0000 arcmin over a +-40 N*m loop. */
  lm_real down;
  lm_real up;
  step(40);
  step(-40);
  up = step(0);
  step(40);
  down = step(0);
  TEST_ASSERT_TRUE(distance((down - up) / ARCMIN, 1) < LM_REAL(LM_REAL_BITS == 64 ? 5e-5 : 0.01));
}

TEST(zero_parameters_are_the_identity) {
  static const lm_real torque_Nm[] = {-1, 1};
  static const lm_real angle_rad[] = {0, 0};
  (void)lm_build_curve(&parameters.curve, torque_Nm, angle_rad, 2, &fault);
  (void)lm_build_play_bank(&parameters.plays, 0, 0, 0, &fault);
  TEST_ASSERT_EQUAL(LM_OK, lm_check_parameters(&parameters, &fault));
  TEST_ASSERT_TRUE(step(30) == 0 && step(-70) == 0 && step(0) == 0);
}

TEST(evaluating_commits_nothing) {
  lm_memory before;
  lm_memory trial;
  lm_real angle;
  step(12);
  before = memory;
  at.torque_Nm = -30;
  angle = lm_evaluate_model(&parameters, &memory, &trial, &at);
  TEST_ASSERT_EQUAL_MEMORY(&before, &memory, sizeof memory);
  TEST_ASSERT_TRUE(lm_step_model(&parameters, &memory, &at) == angle);
  TEST_ASSERT_EQUAL_MEMORY(&trial, &memory, sizeof memory);
}

TEST(one_big_step_is_many_small_ones) {
  int trial;
  for (trial = 0; trial < 400; ++trial) {
    if (trial == 200) {
      follow_envelope(&parameters);
      lm_settle_model(&parameters, &memory);
    }
    lm_memory fine;
    lm_real from_Nm;
    lm_real to_Nm = draw(-80, 80);
    int i;
    for (i = 0; i < 5; ++i) {
      step(draw(-60, 60));
    }
    fine = memory;
    from_Nm = memory.plays.torque_Nm;
    step(to_Nm);
    for (i = 1; i <= 37; ++i) {
      at.torque_Nm = i == 37 ? to_Nm : from_Nm + (to_Nm - from_Nm) * LM_REAL(i) / 37;
      lm_step_model(&parameters, &fine, &at);
    }
    TEST_ASSERT_EQUAL_MEMORY(&fine, &memory, sizeof memory);
  }
}

/* A swing erases all smaller ones before it, for friction inside and outside, also with an
 * envelope. */
TEST(a_larger_swing_wipes_out_what_went_before) {
  int form;
  for (form = 0; form < 3; ++form) {
    int trial;
    if (form == 1) {
      put_friction_inside(&parameters);
    } else if (form == 2) {
      follow_envelope(&parameters);
    }
    for (trial = 0; trial < 200; ++trial) {
      lm_memory plain;
      int i;
      lm_start_model(&memory, 0);
      lm_start_model(&plain, 0);
      for (i = 0; i < 20; ++i) {
        step(draw(-60, 60));
      }
      step(70);
      step(-70);
      at.torque_Nm = 70;
      lm_step_model(&parameters, &plain, &at);
      at.torque_Nm = -70;
      lm_step_model(&parameters, &plain, &at);
      TEST_ASSERT_EQUAL_MEMORY(&plain, &memory, sizeof memory);
    }
  }
}

/* The bound of the header: 2^-23 limit + 8 e (angle + sum c limit) / ((1 - r sum w) s - r
 * sum c). */
static void check_round_trips(int histories) {
  lm_real s = lm_find_least_slope(&parameters.curve);
  const lm_play_bank *bank = &parameters.plays;
  lm_real r = 1 + bank->envelope_Nm / bank->knee_Nm;
  lm_real bound = (LM_REAL_BITS == 64 ? LM_REAL(2.3e-16) : LM_REAL(1.2e-7)) * 80 +
                  8 * ROUNDING * (LM_REAL(4e-3) + bank->outside_rad_per_Nm * 80) /
                      ((1 - r * bank->inside_share) * s - r * bank->outside_rad_per_Nm);
  int trial;
  for (trial = 0; trial < histories; ++trial) {
    lm_memory kept;
    lm_memory next;
    lm_real wanted_Nm;
    lm_real found_Nm = 0;
    lm_real angle;
    step(draw(-70, 70));
    kept = memory;
    wanted_Nm = draw(-79, 79);
    at.torque_Nm = wanted_Nm;
    angle = lm_evaluate_model(&parameters, &memory, &next, &at);
    TEST_ASSERT_EQUAL(LM_OK, lm_invert_model(&parameters, &memory, &at, angle, &found_Nm, &fault));
    TEST_ASSERT_TRUE(distance(found_Nm, wanted_Nm) <= bound);
    TEST_ASSERT_EQUAL_MEMORY(&kept, &memory, sizeof memory);
  }
}

/* A million random histories, a third of each form of friction; fewer in builds without
 * optimization or with sanitizers or coverage. */
#ifdef __OPTIMIZE__
#define HISTORIES 1000000
#else
#define HISTORIES 20000
#endif

TEST(the_inverse_undoes_the_model) {
  check_round_trips(HISTORIES / 3);
  put_friction_inside(&parameters);
  lm_settle_model(&parameters, &memory);
  check_round_trips(HISTORIES / 3);
  follow_envelope(&parameters);
  lm_settle_model(&parameters, &memory);
  check_round_trips(HISTORIES / 3);
}

TEST(the_inverse_checks_its_range) {
  lm_real torque_Nm = 7;
  lm_real zero = 0;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE,
                    lm_invert_model(&parameters, &memory, &at, 1, &torque_Nm, &fault));
  TEST_ASSERT_TRUE(fault.low < 0 && fault.high > 0 && fault.high < 1);
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE,
                    lm_invert_model(&parameters, &memory, &at, -1, &torque_Nm, &fault));
  TEST_ASSERT_EQUAL(LM_NOT_FINITE,
                    lm_invert_model(&parameters, &memory, &at, 1 / zero, &torque_Nm, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_invert_model(0, &memory, &at, 0, &torque_Nm, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_invert_model(&parameters, 0, &at, 0, &torque_Nm, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_invert_model(&parameters, &memory, 0, 0, &torque_Nm, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_invert_model(&parameters, &memory, &at, 0, 0, &fault));
  TEST_ASSERT_TRUE(torque_Nm == 7);
}

/* If the model is flat (a gap without friction), any torque of the flat part is correct. */
TEST(a_flat_piece_inverts_to_a_torque_on_it) {
  static const lm_real t[] = {-80, -5, 5, 80};
  static const lm_real a[] = {LM_REAL(-1e-3), 0, 0, LM_REAL(1e-3)};
  lm_real torque_Nm = 99;
  (void)lm_build_curve(&parameters.curve, t, a, 4, &fault);
  (void)lm_build_play_bank(&parameters.plays, 0, 0, 0, &fault);
  TEST_ASSERT_EQUAL(LM_OK, lm_invert_model(&parameters, &memory, &at, 0, &torque_Nm, &fault));
  TEST_ASSERT_TRUE(torque_Nm >= -5 && torque_Nm <= LM_REAL(5.0001));
  (void)lm_build_curve(&parameters.curve, t, t, 2, &fault);
  parameters.curve.slope_rad_per_Nm[0] = 0;
  parameters.curve.angle_rad[0] = 0;
  TEST_ASSERT_EQUAL(LM_OK, lm_invert_model(&parameters, &memory, &at, 0, &torque_Nm, &fault));
}

TEST(a_torque_without_meaning_is_the_torque_before) {
  lm_real zero = 0;
  lm_real angle = step(20);
  TEST_ASSERT_TRUE(step(zero / zero) == angle);
  TEST_ASSERT_TRUE(memory.plays.torque_Nm == 20);
  /* An invalid quotient: one such sample must not reset the whole memory. */
  TEST_ASSERT_TRUE(step(1 / zero) == angle);
  TEST_ASSERT_TRUE(step(-1 / zero) == angle);
  TEST_ASSERT_TRUE(memory.plays.torque_Nm == 20);
  TEST_ASSERT_TRUE(step(LM_REAL(1e30)) == step(80));
  TEST_ASSERT_TRUE(memory.plays.torque_Nm == 80);
  lm_start_model(&memory, zero / zero);
  TEST_ASSERT_TRUE(memory.plays.torque_Nm == 0);
}

/* The previous torque already contains the effects: while a sensor is missing they must not be
 * added in every tick. */
TEST(effects_on_the_torque_do_not_pile_up_while_it_is_missing) {
  lm_real zero = 0;
  lm_real angle;
  int k;
  add_effect(&parameters, &lm_effect_torque_offset, LM_REAL(0.1), 0);
  add_effect(&parameters, &lm_effect_torque_scale, LM_REAL(0.02), 0);
  angle = step(5);
  for (k = 0; k < 1000; ++k) {
    TEST_ASSERT_TRUE(step(zero / zero) == angle);
  }
  TEST_ASSERT_TRUE(step(5) == angle);
}

TEST(effects_act_in_their_places) {
  lm_real plain = step(10);
  lm_memory kept;
  lm_start_model(&memory, 0);
  add_effect(&parameters, &lm_effect_torque_offset, 2, 0);
  add_effect(&parameters, &lm_effect_torque_scale, LM_REAL(0.1), 0);
  add_effect(&parameters, &lm_effect_thermal_friction, LM_REAL(0.05), 0);
  add_effect(&parameters, &lm_effect_thermal_drift, LM_REAL(1e-5), 0);
  add_effect(&parameters, &lm_effect_asymmetric_stiffness, LM_REAL(0.5), 0);
  TEST_ASSERT_EQUAL(LM_OK, lm_check_parameters(&parameters, &fault));
  /* 10 N*m come about as (T + 2 + 0.1 T) with T = 8 / 1.1; half as much elastic angle on top. */
  TEST_ASSERT_TRUE(distance(step(LM_REAL(8.0 / 1.1)), LM_REAL(1.5) * plain) < LM_REAL(1e-6) * 1);
  /* Colder by ln(2) / 0.05: every band twice as wide. Hotter or colder, the drift is a constant. */
  at.temperature_C = LM_REFERENCE_TEMPERATURE_C - LM_REAL(0.6931471805599453 / 0.05);
  lm_start_model(&memory, 0);
  step(0);
  TEST_ASSERT_TRUE(distance(memory.width_scale, 2) < LM_REAL(1e-5));
  kept = memory;
  step(40);
  TEST_ASSERT_TRUE(distance(memory.plays.z_Nm[0],
                            46 - 2 * (LM_REAL(0.5) + LM_REAL(0.5 / 80) * 46)) < LM_REAL(1e-4));
  TEST_ASSERT_TRUE(memory.width_scale >= kept.width_scale);
}

/* Torque effects can neither move the torque beyond the limit nor make it not finite. */
static lm_real poison(const lm_real *value, lm_real *own, const lm_conditions *now) {
  lm_real zero = now->torque_Nm - now->torque_Nm;
  own[0] = 1;
  return value[0] / zero;
}
static const lm_effect poisonous = {2u,     LM_EFFECT_TORQUE, 1, 1, LM_NEEDS_TORQUE,
                                    poison, {{-1, 1}},        0};

TEST(a_bad_torque_effect_is_contained) {
  add_effect(&parameters, &poisonous, 0, 0);
  step(20);
  TEST_ASSERT_TRUE(memory.plays.torque_Nm == 20);
  parameters.effect[0].value[0] = 1;
  step(20);
  TEST_ASSERT_TRUE(memory.plays.torque_Nm == 20);
  parameters.effect[0].effect = &lm_effect_torque_offset;
  parameters.effect[0].value[0] = 1000;
  step(20);
  TEST_ASSERT_TRUE(memory.plays.torque_Nm == 80);
}

/* Friction in parallel follows the angle: on a drive 2.5 % softer its operators follow 2.5 % more of
 * the torque that winds the drive up. In series it follows the torque. */
TEST(a_compliance_scales_the_angle_and_what_friction_follows) {
  const lm_real softer = LM_REAL(1.025);
  int inside;
  for (inside = 0; inside < 2; ++inside) {
    const lm_real more = inside ? softer - 1 : 0;
    lm_memory other;
    lm_parameters plain;
    lm_real wound_Nm;
    lm_real load_Nm;
    lm_play_sum sum = {0, 0};
    parameters = size20();
    lm_start_model(&memory, 0);
    other = memory;
    if (inside) {
      put_friction_inside(&parameters);
    }
    plain = parameters;
    add_effect(&parameters, &lm_effect_thermal_stiffness, LM_REAL(0.001), 0);
    TEST_ASSERT_EQUAL(LM_OK, lm_check_parameters(&parameters, &fault));
    at.temperature_C = LM_REFERENCE_TEMPERATURE_C + 25;
    for (load_Nm = 40; load_Nm > -40; load_Nm -= 7) {
      lm_real angle = step(load_Nm);
      lm_real expected;
      wound_Nm = load_Nm + sum.inside_Nm;
      sum = lm_advance_plays(&plain.plays, &other.plays, load_Nm + more * wound_Nm);
      wound_Nm = load_Nm + sum.inside_Nm;
      expected = softer * lm_evaluate_curve(&plain.curve, wound_Nm) + sum.outside_rad;
      TEST_ASSERT_TRUE(distance(angle, expected) < LM_REAL(1e-4) * ARCMIN);
    }
  }
}

/* At the steepest envelope of a fit, for the softest and the stiffest drive. */
TEST(what_the_operators_follow_rises_with_the_torque) {
  const lm_play play = {LM_REAL(0.5), 0, LM_REAL(0.1)};
  int softest;
  for (softest = 0; softest < 2; ++softest) {
    lm_real load_Nm;
    lm_real before_Nm;
    parameters = size20();
    (void)lm_build_play_bank(&parameters.plays, &play, 1, 0, 0);
    TEST_ASSERT_EQUAL(LM_OK, lm_set_envelope(&parameters.plays, 30, 6, &fault));
    add_effect(&parameters, &lm_effect_thermal_stiffness, LM_REAL(0.01), 0);
    at.temperature_C = LM_REFERENCE_TEMPERATURE_C + (softest ? 90 : -90);
    step(0);
    before_Nm = memory.plays.torque_Nm;
    for (load_Nm = LM_REAL(0.125); load_Nm <= 20; load_Nm += LM_REAL(0.125)) {
      step(load_Nm);
      TEST_ASSERT_TRUE(memory.plays.torque_Nm > before_Nm);
      before_Nm = memory.plays.torque_Nm;
    }
  }
}

/* While a loaded drive turns, the modulated compliance makes it oscillate, and friction with it:
 * narrow bands forget where the load came from. */
TEST(a_modulated_compliance_shakes_friction_at_a_constant_torque) {
  const lm_play play = {LM_REAL(0.5), LM_REAL(0.5 / 80), LM_REAL(0.1)};
  const lm_real band_rad = 2 * play.weight * (LM_REAL(0.5) + LM_REAL(0.5 / 80) * 20) / 25000;
  lm_real apart[2];
  int turning;
  for (turning = 0; turning < 2; ++turning) {
    lm_real reached[2];
    int from;
    for (from = 0; from < 2; ++from) {
      int k;
      parameters = size20();
      (void)lm_build_play_bank(&parameters.plays, &play, 1, 0, 0);
      lm_start_model(&memory, 0);
      add_effect(&parameters, &lm_effect_stiffness_modulation, LM_REAL(0.04), 0);
      at.input_angle_rad = 0;
      step(from ? 40 : 0);
      step(20);
      for (k = 0; turning && k < 200; ++k) {
        at.input_angle_rad += LM_REAL(0.1);
        step(20);
      }
      at.input_angle_rad = 0;
      reached[from] = step(20);
    }
    apart[turning] = reached[1] - reached[0];
  }
  TEST_ASSERT_TRUE(distance(apart[0], band_rad) < LM_REAL(0.06) * band_rad);
  TEST_ASSERT_TRUE(distance(apart[1], 0) < LM_REAL(1e-3) * band_rad);
}

/* Without a torque the operators stay where they are, however long; the compliance does not add up. */
TEST(a_missing_torque_stays_under_a_changing_compliance) {
  lm_memory held;
  int k;
  put_friction_inside(&parameters);
  follow_envelope(&parameters);
  add_effect(&parameters, &lm_effect_stiffness_modulation, LM_REAL(0.04), 0);
  step(20);
  at.input_angle_rad = LM_REAL(0.7);
  held = memory;
  step(20);
  TEST_ASSERT_TRUE(memory.plays.torque_Nm != held.plays.torque_Nm);
  held = memory;
  for (k = 0; k < 1000; ++k) {
    at.input_angle_rad += LM_REAL(0.1);
    step(LM_UNKNOWN);
    TEST_ASSERT_EQUAL_MEMORY(&held.plays, &memory.plays, sizeof held.plays);
  }
}

TEST(conditions_that_are_not_finite_are_not_known) {
  lm_real zero = 0;
  lm_real nan = zero / zero;
  lm_real quiet;
  add_effect(&parameters, &lm_effect_viscous_friction, LM_REAL(1e-5), 0);
  add_effect(&parameters, &lm_effect_inertia, LM_REAL(1e-5), 0);
  add_effect(&parameters, &lm_effect_kinematic_error, LM_REAL(1e-5), LM_REAL(1e-5));
  add_effect(&parameters, &lm_effect_output_eccentricity, LM_REAL(1e-5), LM_REAL(1e-5));
  add_effect(&parameters, &lm_effect_thermal_drift, LM_REAL(1e-5), 0);
  add_effect(&parameters, &lm_effect_output_tilt, LM_REAL(1e-5), 0);
  add_effect(&parameters, &lm_effect_axial_shift, LM_REAL(1e-5), 1);
  add_effect(&parameters, &lm_effect_creep, LM_REAL(0.01), 1);
  TEST_ASSERT_EQUAL(LM_OK, lm_check_parameters(&parameters, &fault));
  quiet = step(5);
  at.input_angle_rad = nan;
  at.output_angle_rad = 1 / zero;
  at.input_velocity_rad_s = nan;
  at.output_acceleration_rad_s2 = nan;
  at.temperature_C = nan;
  at.cycles = nan;
  at.tilt_moment_Nm = nan;
  at.axial_force_N = -1 / zero;
  at.elapsed_s = nan;
  TEST_ASSERT_TRUE(step(5) == quiet);
}

TEST(settling_puts_any_memory_right) {
  lm_real zero = 0;
  memset(&memory, 0xFF, sizeof memory); /* NaN in both precisions */
  lm_settle_model(&parameters, &memory);
  TEST_ASSERT_TRUE(memory.plays.torque_Nm == 0);
  TEST_ASSERT_TRUE(memory.width_scale == 1);
  TEST_ASSERT_TRUE(memory.effect[0] == 0);
  TEST_ASSERT_TRUE(distance(step(10), step(10)) == 0);
  memory.plays.torque_Nm = 1 / zero;
  memory.effect[1] = 3;
  memory.width_scale = 1 / zero;
  add_effect(&parameters, &lm_effect_thermal_friction, LM_REAL(0.03), 0);
  lm_settle_model(&parameters, &memory);
  TEST_ASSERT_TRUE(memory.width_scale == LM_WIDTH_SCALE_MAX);
  TEST_ASSERT_TRUE(memory.plays.torque_Nm == 0);
  TEST_ASSERT_TRUE(memory.effect[1] == 3);
}

TEST(a_recording_is_the_single_steps) {
  static const lm_real torque_Nm[] = {5, 30, -3};
  lm_recording recording;
  lm_memory other = memory;
  lm_real angle[3];
  int i;
  memset(&recording, 0, sizeof recording);
  recording.count = 3;
  recording.torque_Nm = torque_Nm;
  lm_run_model(&parameters, &other, &recording, angle);
  for (i = 0; i < 3; ++i) {
    TEST_ASSERT_TRUE(step(torque_Nm[i]) == angle[i]);
  }
  TEST_ASSERT_EQUAL_MEMORY(&other, &memory, sizeof memory);
}

enum { ROWS = 203, COLUMNS = LM_CONDITION_COUNT };

#define TAKE_COLUMN(field, ...) recording.field = found[i++];

/* A recording with the columns of the set bits; some numbers are not finite. */
static lm_recording draw_recording(uint32_t columns) {
  static lm_real column[COLUMNS][ROWS];
  static const lm_real reach[COLUMNS] = {90, LM_REAL(3.1), LM_REAL(3.1), 100, 50,
                                         60, 1000000,      20,           500, LM_REAL(0.01)};
  const lm_real *found[COLUMNS];
  lm_real zero = 0;
  lm_recording recording;
  int i;
  int k;
  for (i = 0; i < COLUMNS; ++i) {
    found[i] = (columns >> i) & 1u ? column[i] : 0;
    for (k = 0; k < ROWS; ++k) {
      lm_real chance = draw(0, 1);
      column[i][k] = draw(-reach[i], reach[i]);
      if (chance < LM_REAL(0.03)) {
        column[i][k] = chance < LM_REAL(0.01) ? zero / zero : 1 / zero;
      }
    }
  }
  memset(&recording, 0, sizeof recording);
  recording.count = ROWS;
  i = 0;
  LM_CONDITION_LIST(TAKE_COLUMN, TAKE_COLUMN, TAKE_COLUMN, TAKE_COLUMN)
  return recording;
}

/* Up to twelve operators, with bands that widen or not, outside and inside, some with an
 * envelope. */
static void draw_plays(void) {
  lm_play play[LM_PLAYS_MAX];
  int32_t count = (int32_t)draw(0, LM_REAL(12.99));
  int32_t outside = (int32_t)draw(0, LM_REAL(count) + LM_REAL(0.99));
  int widens = draw(0, 1) < LM_REAL(0.3);
  int32_t i;
  for (i = 0; i < count; ++i) {
    play[i].radius_Nm = draw(0, 20);
    play[i].widening = widens ? draw(0, LM_REAL(0.5)) : 0;
    play[i].weight = i < outside ? LM_REAL(1e-7) : LM_REAL(0.05);
  }
  TEST_ASSERT_EQUAL(LM_OK, lm_build_play_bank(&parameters.plays, play, count, outside, &fault));
  if (draw(0, 1) < LM_REAL(0.4)) {
    TEST_ASSERT_EQUAL(LM_OK, lm_set_envelope(&parameters.plays, draw(0, 6), 10, &fault));
  }
}

/* A random choice of the library's effects, in the order of the kinds, at typical values. */
static void draw_effects(lm_real share) {
  int kind;
  int i;
  int32_t j;
  int32_t memories = 0;
  parameters.effect_count = 0;
  for (kind = LM_EFFECT_TORQUE; kind <= LM_EFFECT_ANGLE; ++kind) {
    for (i = 0; i < LM_EFFECT_COUNT; ++i) {
      const lm_effect *effect = lm_effects[i];
      if ((int)effect->kind != kind || draw(0, 1) > share) {
        continue;
      }
      add_effect(&parameters, effect, 0, 0);
      memories += effect->memory_count;
      for (j = 0; j < effect->value_count; ++j) {
        parameters.effect[parameters.effect_count - 1].value[j] = effect->card->value[j].typical;
      }
    }
  }
  TEST_ASSERT_TRUE(memories <= LM_EFFECT_MEMORY_MAX);
}

TEST(any_recording_is_the_single_steps) {
  int trial;
  for (trial = 0; trial < 400; ++trial) {
    lm_recording recording;
    lm_memory other;
    lm_real angle[ROWS];
    int k;
    draw_plays();
    draw_effects(trial % 4 == 0 ? 0 : draw(0, 1));
    TEST_ASSERT_EQUAL(LM_OK, lm_check_parameters(&parameters, &fault));
    recording = draw_recording(trial % 5 == 0 ? 0x3FFu : seed >> 16);
    lm_settle_model(&parameters, &memory);
    other = memory;
    lm_run_model(&parameters, &other, &recording, angle);
    for (k = 0; k < ROWS; ++k) {
      lm_conditions moment = lm_read_conditions(&recording, k);
      lm_real expected = lm_step_model(&parameters, &memory, &moment);
      TEST_ASSERT_EQUAL_MEMORY(&expected, &angle[k], sizeof expected);
    }
    TEST_ASSERT_EQUAL_MEMORY(&memory, &other, sizeof memory);
  }
}
