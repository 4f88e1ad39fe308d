#include "lostmotion/play.h"

#include <string.h>

#include "draw.h"

#include "lostmotion/curve.h"
#include "test.h"

#define ARCMIN LM_REAL(2.908882086657216e-4) /* rad */

/* Test set S20 of the model specification, section 6: catalogue torsion curve of size 20, four
 * operators. */
static const lm_real knot_Nm[] = {-40, -25, -7, 7, 25, 40};
static const lm_real knot_rad[] = {LM_REAL(-7.0 / 16e3 - 18.0 / 25e3 - 15.0 / 29e3),
                                   LM_REAL(-7.0 / 16e3 - 18.0 / 25e3),
                                   LM_REAL(-7.0 / 16e3),
                                   LM_REAL(7.0 / 16e3),
                                   LM_REAL(7.0 / 16e3 + 18.0 / 25e3),
                                   LM_REAL(7.0 / 16e3 + 18.0 / 25e3 + 15.0 / 29e3)};
static const lm_play s20[] = {
    {LM_REAL(0.5), LM_REAL(0.5 / 80), LM_REAL(1.5852218e-6 * 1.5)},
    {LM_REAL(2.0), LM_REAL(2.0 / 80), LM_REAL(1.5852218e-6 * 3.0)},
    {LM_REAL(5.0), LM_REAL(5.0 / 80), LM_REAL(1.5852218e-6 * 5.0)},
    {LM_REAL(10.0), LM_REAL(10.0 / 80), LM_REAL(1.5852218e-6 * 6.0)},
};
#define S20_COUNT 4

static lm_curve torsion_curve;
static lm_play_bank bank;
static lm_play_memory memory;
static lm_fault fault;

void setUp(void) {
  seed = 1;
  TEST_ASSERT_EQUAL(LM_OK, lm_build_curve(&torsion_curve, knot_Nm, knot_rad, 6, &fault));
  TEST_ASSERT_EQUAL(LM_OK, lm_build_play_bank(&bank, s20, S20_COUNT, S20_COUNT, &fault));
  lm_center_plays(&memory, 0);
}

static lm_real angle_at(lm_real torque_Nm) {
  lm_play_sum sum = lm_advance_plays(&bank, &memory, torque_Nm);
  return lm_evaluate_curve(&torsion_curve, torque_Nm + sum.inside_Nm) + sum.outside_rad;
}

/* Monotone motion from the state of the memory, in equal steps; returns the last angle. */
static lm_real go(lm_real to_Nm, int steps) {
  lm_real from_Nm = memory.torque_Nm;
  lm_real angle = 0;
  int i;
  for (i = 1; i <= steps; ++i) {
    angle =
        angle_at(i == steps ? to_Nm : from_Nm + (to_Nm - from_Nm) * LM_REAL(i) / LM_REAL(steps));
  }
  return angle;
}

/* Unloading less loading angle at a torque, after full cycles of +-40 N*m. */
static lm_real loop_width_arcmin(lm_real torque_Nm) {
  lm_real down;
  lm_real up;
  go(40, 1);
  down = go(torque_Nm, 7);
  go(-40, 3);
  up = go(torque_Nm, 5);
  go(40, 2);
  return (down - up) / ARCMIN;
}

static void assert_arcmin(double expected, lm_real found, double tolerance) {
  double bound = LM_REAL_BITS == 64 ? tolerance : 0.01;
  double difference = (double)found - expected;
  TEST_ASSERT_TRUE(difference <= bound && difference >= -bound);
}

TEST(the_check_values_of_the_specification_hold) {
  lm_real center_high;
  lm_real center_low;
  assert_arcmin(1.0, loop_width_arcmin(0), 5e-5);
  assert_arcmin(1.125, loop_width_arcmin(10), 5e-5);
  assert_arcmin(0.643, loop_width_arcmin(30), 5e-4);
  assert_arcmin(0.0, loop_width_arcmin(40), 1e-9);
  assert_arcmin(0.0, loop_width_arcmin(-40), 1e-9);
  /* Reversal lost motion at 4 % of 40 N*m: difference of the loop's centre lines. */
  go(40, 1);
  center_high = go(LM_REAL(1.6), 1);
  center_low = go(LM_REAL(-1.6), 1);
  go(-40, 1);
  center_low += go(LM_REAL(-1.6), 1);
  center_high += go(LM_REAL(1.6), 1);
  assert_arcmin(0.68755, (center_high - center_low) / 2 / ARCMIN, 5e-6);
}

TEST(minor_loops_close) {
  lm_real first;
  go(40, 1);
  go(-40, 1);
  first = go(10, 3);
  go(3, 10);
  TEST_ASSERT_TRUE(go(10, 10) == first);
}

TEST(the_steps_do_not_matter) {
  static const int steps[] = {1, 10, 100, 1000};
  lm_play_memory reference;
  int k;
  for (k = 0; k < 4; ++k) {
    lm_center_plays(&memory, 0);
    go(40, steps[k]);
    go(-20, steps[k]);
    go(10, steps[k]);
    if (k == 0) {
      reference = memory;
    }
    TEST_ASSERT_EQUAL_MEMORY(&reference, &memory, sizeof memory);
  }
}

TEST(a_larger_swing_wipes_out_what_went_before) {
  lm_play_memory a;
  int trial;
  for (trial = 0; trial < 300; ++trial) {
    int i;
    lm_center_plays(&memory, 0);
    for (i = 0; i < 20; ++i) {
      angle_at(draw(-30, 30));
    }
    angle_at(40);
    angle_at(-40);
    if (trial == 0) {
      a = memory;
    }
    TEST_ASSERT_EQUAL_MEMORY(&a, &memory, sizeof memory);
  }
}

/* The published operator, with both edges in every step: the one-sided step must give the same
 * bits. */
TEST(one_edge_does_what_both_edges_do) {
  lm_real radius[S20_COUNT];
  lm_real widening[S20_COUNT];
  lm_real z[S20_COUNT];
  int i;
  int k;
  for (i = 0; i < S20_COUNT; ++i) {
    radius[i] = s20[i].radius_Nm;
    widening[i] = s20[i].widening;
    z[i] = 0;
  }
  for (k = 0; k < 20000; ++k) {
    lm_real torque_Nm = draw(-60, 60) * draw(0, 1);
    lm_real row[S20_COUNT];
    lm_play_memory trial = memory;
    lm_play_sum sum = lm_advance_plays(&bank, &trial, torque_Nm);
    lm_play_sum scaled = lm_advance_scaled_plays(&bank, &memory, torque_Nm, 1);
    lm_real h = 0;
    lm_run_plays(radius, widening, S20_COUNT, z, &torque_Nm, 0, 1, row);
    for (i = 0; i < S20_COUNT; ++i) {
      TEST_ASSERT_TRUE(trial.z_Nm[i] == z[i]);
      TEST_ASSERT_TRUE(distance(memory.z_Nm[i], z[i]) <= 4 * ROUNDING * 60);
      h += s20[i].weight * row[i];
    }
    TEST_ASSERT_TRUE(distance(h, sum.outside_rad) <= 8 * ROUNDING * LM_REAL(1.6e-3));
    TEST_ASSERT_TRUE(distance(sum.outside_rad, scaled.outside_rad) <=
                     8 * ROUNDING * LM_REAL(1.6e-3));
    memory = trial;
  }
}

/* For fitting: every band is widened by a factor that changes from sample to sample. */
TEST(columns_of_wider_bands_are_the_wider_bank) {
  lm_real radius[S20_COUNT];
  lm_real widening[S20_COUNT];
  lm_real z[S20_COUNT];
  int i;
  int k;
  for (i = 0; i < S20_COUNT; ++i) {
    radius[i] = s20[i].radius_Nm;
    widening[i] = s20[i].widening;
    z[i] = 0;
  }
  for (k = 0; k < 2000; ++k) {
    lm_real torque_Nm = draw(-60, 60);
    lm_real scale = draw(0, 3);
    lm_real row[S20_COUNT];
    (void)lm_advance_scaled_plays(&bank, &memory, torque_Nm, scale);
    lm_run_plays(radius, widening, S20_COUNT, z, &torque_Nm, &scale, 1, row);
    for (i = 0; i < S20_COUNT; ++i) {
      TEST_ASSERT_TRUE(z[i] == memory.z_Nm[i] && row[i] == z[i] - torque_Nm);
    }
  }
}

TEST(the_bands_hold_and_a_second_step_changes_nothing) {
  int k;
  int i;
  for (k = 0; k < 2000; ++k) {
    lm_real torque_Nm = draw(-80, 80);
    lm_play_memory once;
    lm_real angle = angle_at(torque_Nm);
    for (i = 0; i < S20_COUNT; ++i) {
      lm_real radius_Nm = lm_find_play_radius(&bank, i, torque_Nm);
      TEST_ASSERT_TRUE(distance(memory.z_Nm[i], torque_Nm) <= radius_Nm + 8 * ROUNDING * 80);
    }
    once = memory;
    TEST_ASSERT_TRUE(angle_at(torque_Nm) == angle);
    TEST_ASSERT_EQUAL_MEMORY(&once, &memory, sizeof memory);
    lm_settle_plays(&bank, &memory);
    TEST_ASSERT_EQUAL_MEMORY(&once, &memory, sizeof memory);
  }
}

TEST(a_wider_band_widens_the_loop_in_proportion) {
  lm_play_sum up;
  lm_play_sum down;
  lm_real width[2];
  int scale;
  for (scale = 1; scale <= 2; ++scale) {
    lm_advance_scaled_plays(&bank, &memory, -200, LM_REAL(scale));
    up = lm_advance_scaled_plays(&bank, &memory, 0, LM_REAL(scale));
    lm_advance_scaled_plays(&bank, &memory, 200, LM_REAL(scale));
    down = lm_advance_scaled_plays(&bank, &memory, 0, LM_REAL(scale));
    width[scale - 1] = down.outside_rad - up.outside_rad;
  }
  TEST_ASSERT_TRUE(distance(width[1], 2 * width[0]) <= LM_REAL(1e-6) * width[0]);
}

/* Friction inside: at full slip the spring has T - sum w R on loading, T + sum w R on unloading;
 * both places together keep their own sums. */
TEST(inside_friction_takes_its_part_of_the_torque) {
  static const lm_play mixed[] = {
      {2, 0, LM_REAL(1e-6)}, {1, 0, LM_REAL(0.25)}, {3, LM_REAL(0.1), LM_REAL(0.5)}};
  lm_play_sum sum;
  TEST_ASSERT_EQUAL(LM_OK, lm_build_play_bank(&bank, mixed, 3, 1, &fault));
  TEST_ASSERT_EQUAL(LM_OK, lm_check_play_bank(&bank, lm_find_least_slope(&torsion_curve), &fault));
  lm_center_plays(&memory, 0);
  sum = lm_advance_plays(&bank, &memory, 30);
  /* -(0.25 * 1 + 0.5 * (3 + 0.1 * 30)) = -3.25 N*m; -2 * 1e-6 rad */
  TEST_ASSERT_TRUE(distance(sum.inside_Nm, LM_REAL(-3.25)) <= 32 * ROUNDING * 30);
  TEST_ASSERT_TRUE(distance(sum.outside_rad, LM_REAL(-2e-6)) <= 16 * ROUNDING * LM_REAL(30e-6));
  lm_advance_plays(&bank, &memory, 90);
  sum = lm_advance_plays(&bank, &memory, 30);
  TEST_ASSERT_TRUE(distance(sum.inside_Nm, LM_REAL(3.25)) <= 32 * ROUNDING * 30);
}

TEST(the_envelope_is_odd_and_rises_to_its_end) {
  lm_real before = -1000000;
  lm_real torque_Nm;
  int k;
  TEST_ASSERT_TRUE(lm_find_envelope(&bank, LM_REAL(12.3)) == LM_REAL(12.3));
  TEST_ASSERT_EQUAL(LM_OK, lm_set_envelope(&bank, 3, 12, &fault));
  TEST_ASSERT_TRUE(lm_find_envelope(&bank, 0) == 0);
  /* At the knee two thirds of it, far beyond it all of it; near zero torque it rises by 1 +
   * 3 / 12. */
  TEST_ASSERT_TRUE(distance(lm_find_envelope(&bank, 12), 14) <= 8 * ROUNDING * 14);
  TEST_ASSERT_TRUE(distance(lm_find_envelope(&bank, 100000), 100003) <= LM_REAL(0.02));
  TEST_ASSERT_TRUE(distance(lm_find_envelope(&bank, LM_REAL(0.01)), LM_REAL(0.0125)) <=
                   LM_REAL(1e-6));
  for (k = 0; k < 20000; ++k) {
    torque_Nm = draw(-60, 60) * draw(0, 1);
    TEST_ASSERT_TRUE(lm_find_envelope(&bank, -torque_Nm) == -lm_find_envelope(&bank, torque_Nm));
  }
  /* Steps of a few roundings: the larger torque never has the smaller envelope. */
  torque_Nm = -15;
  for (k = 0; k < 200000; ++k) {
    lm_real now = lm_find_envelope(&bank, torque_Nm);
    TEST_ASSERT_TRUE(now >= before);
    before = now;
    torque_Nm += k < 100000 ? 16 * ROUNDING : LM_REAL(3e-4);
  }
}

/* A bank with an envelope at a torque is the bank without at what the envelope is there. */
TEST(a_bank_with_an_envelope_stands_where_the_envelope_is) {
  lm_play_bank plain = bank;
  lm_play_memory other = memory;
  int k;
  int i;
  TEST_ASSERT_EQUAL(LM_OK, lm_set_envelope(&bank, 5, 15, &fault));
  TEST_ASSERT_EQUAL(LM_OK, lm_check_play_bank(&bank, lm_find_least_slope(&torsion_curve), &fault));
  for (k = 0; k < 20000; ++k) {
    lm_real torque_Nm = draw(-60, 60) * draw(0, 1);
    lm_real at_Nm = lm_find_envelope(&bank, torque_Nm);
    lm_play_memory scaled = memory;
    lm_play_sum sum = lm_advance_plays(&bank, &memory, torque_Nm);
    lm_play_sum expected = lm_advance_plays(&plain, &other, at_Nm);
    (void)lm_advance_scaled_plays(&bank, &scaled, torque_Nm, 1);
    TEST_ASSERT_TRUE(sum.outside_rad == expected.outside_rad);
    TEST_ASSERT_TRUE(memory.torque_Nm == torque_Nm && scaled.torque_Nm == torque_Nm);
    for (i = 0; i < S20_COUNT; ++i) {
      TEST_ASSERT_TRUE(memory.z_Nm[i] == other.z_Nm[i]);
      TEST_ASSERT_TRUE(distance(scaled.z_Nm[i], other.z_Nm[i]) <= 4 * ROUNDING * 60);
      TEST_ASSERT_TRUE(lm_find_play_radius(&bank, i, torque_Nm) ==
                       lm_find_play_radius(&plain, i, at_Nm));
    }
    scaled = memory;
    lm_settle_plays(&bank, &scaled);
    TEST_ASSERT_EQUAL_MEMORY(&memory, &scaled, sizeof memory);
  }
}

TEST(an_envelope_that_lets_the_angle_fall_is_refused) {
  static const lm_play inside[] = {{1, 0, LM_REAL(0.5)}};
  lm_real slope = lm_find_least_slope(&torsion_curve);
  lm_real zero = 0;
  TEST_ASSERT_EQUAL(LM_NULL, lm_set_envelope(0, 1, 1, &fault));
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_set_envelope(&bank, -1, 1, &fault));
  TEST_ASSERT_EQUAL_STRING("envelope_Nm", fault.input);
  TEST_ASSERT_EQUAL(LM_NOT_FINITE, lm_set_envelope(&bank, zero / zero, 1, &fault));
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_set_envelope(&bank, 1, 0, &fault));
  TEST_ASSERT_EQUAL_STRING("knee_Nm", fault.input);
  TEST_ASSERT_TRUE(bank.envelope_Nm == 0 && bank.knee_Nm == 1);
  /* Outside: S20's weights are an eighth of the least slope, which so steep an envelope exceeds. */
  TEST_ASSERT_EQUAL(LM_OK, lm_set_envelope(&bank, 20, 1, &fault));
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, lm_check_play_bank(&bank, slope, &fault));
  TEST_ASSERT_EQUAL_STRING("outside_rad_per_Nm", fault.input);
  bank.envelope_Nm = -1;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_check_play_bank(&bank, slope, &fault));
  TEST_ASSERT_EQUAL(LM_OK, lm_build_play_bank(&bank, inside, 1, 0, &fault));
  TEST_ASSERT_EQUAL(LM_OK, lm_set_envelope(&bank, LM_REAL(0.9), 1, &fault));
  TEST_ASSERT_EQUAL(LM_OK, lm_check_play_bank(&bank, slope, &fault));
  TEST_ASSERT_EQUAL(LM_OK, lm_set_envelope(&bank, LM_REAL(1.1), 1, &fault));
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, lm_check_play_bank(&bank, slope, &fault));
  TEST_ASSERT_EQUAL_STRING("inside_share", fault.input);
}

TEST(no_operators_are_the_identity) {
  lm_play_sum sum;
  TEST_ASSERT_EQUAL(LM_OK, lm_build_play_bank(&bank, 0, 0, 0, &fault));
  TEST_ASSERT_EQUAL(LM_OK, lm_check_play_bank(&bank, 0, &fault));
  sum = lm_advance_plays(&bank, &memory, 33);
  TEST_ASSERT_TRUE(sum.outside_rad == 0 && sum.inside_Nm == 0);
  sum = lm_advance_plays(&bank, &memory, -33);
  TEST_ASSERT_TRUE(sum.outside_rad == 0 && sum.inside_Nm == 0);
}

TEST(settling_repairs_any_memory) {
  lm_real zero = 0;
  int i;
  memory.torque_Nm = -20;
  memory.z_Nm[0] = 99;
  memory.z_Nm[1] = -99;
  memory.z_Nm[2] = zero / zero;
  memory.z_Nm[3] = -20;
  lm_settle_plays(&bank, &memory);
  for (i = 0; i < S20_COUNT; ++i) {
    TEST_ASSERT_TRUE(distance(memory.z_Nm[i], -20) <=
                     lm_find_play_radius(&bank, i, -20) + 8 * ROUNDING * 20);
  }
  TEST_ASSERT_TRUE(memory.z_Nm[3] == -20);
  memory.torque_Nm = 20;
  lm_settle_plays(&bank, &memory);
  TEST_ASSERT_TRUE(memory.z_Nm[0] >= 19);
}

TEST(recordings_are_the_single_steps) {
  static const lm_real torque_Nm[] = {5, 30, -3, -40, 12};
  lm_play_memory other = memory;
  lm_real h[5];
  lm_real inside[5];
  int i;
  lm_run_play_bank(&bank, &other, torque_Nm, 5, h, inside);
  lm_run_play_bank(&bank, &other, torque_Nm, 0, 0, 0);
  for (i = 0; i < 5; ++i) {
    lm_play_sum sum = lm_advance_plays(&bank, &memory, torque_Nm[i]);
    TEST_ASSERT_TRUE(sum.outside_rad == h[i] && sum.inside_Nm == inside[i]);
  }
  TEST_ASSERT_EQUAL_MEMORY(&other, &memory, sizeof memory);
  lm_run_play_bank(&bank, &other, torque_Nm, 5, 0, 0);
}

TEST(nonsense_is_refused_by_name) {
  lm_real zero = 0;
  lm_play bad[LM_PLAYS_MAX + 1];
  memset(bad, 0, sizeof bad);
  TEST_ASSERT_EQUAL(LM_NULL, lm_build_play_bank(0, bad, 1, 1, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_build_play_bank(&bank, 0, 1, 1, &fault));
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_build_play_bank(&bank, bad, LM_PLAYS_MAX + 1, 0, &fault));
  TEST_ASSERT_EQUAL_STRING("count", fault.input);
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_build_play_bank(&bank, bad, -1, 0, &fault));
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_build_play_bank(&bank, bad, 1, 2, &fault));
  TEST_ASSERT_EQUAL_STRING("outside_count", fault.input);
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_build_play_bank(&bank, bad, 1, -1, &fault));
  bad[0].radius_Nm = -1;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_build_play_bank(&bank, bad, 1, 1, &fault));
  TEST_ASSERT_EQUAL_STRING("radius_Nm", fault.input);
  bad[0].radius_Nm = zero / zero;
  TEST_ASSERT_EQUAL(LM_NOT_FINITE, lm_build_play_bank(&bank, bad, 1, 1, &fault));
  bad[0].radius_Nm = 1;
  bad[0].widening = 1;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_build_play_bank(&bank, bad, 1, 1, &fault));
  TEST_ASSERT_EQUAL_STRING("widening", fault.input);
  bad[0].widening = 0;
  bad[0].weight = 2;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_build_play_bank(&bank, bad, 1, 1, &fault));
  TEST_ASSERT_EQUAL_STRING("weight", fault.input);
  TEST_ASSERT_EQUAL(S20_COUNT, bank.count);
}

TEST(a_damaged_bank_is_found_out) {
  lm_play_bank good = bank;
  lm_real slope = lm_find_least_slope(&torsion_curve);
  static const lm_play heavy[] = {{1, 0, LM_REAL(0.75)}, {2, 0, LM_REAL(0.75)}};
  static const lm_play soft[] = {{1, 0, LM_REAL(2e-5)}, {1, 0, LM_REAL(0.5)}};
  TEST_ASSERT_EQUAL(LM_OK, lm_check_play_bank(&bank, slope, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_check_play_bank(0, slope, &fault));
  bank.count = LM_PLAYS_MAX + 1;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_check_play_bank(&bank, slope, &fault));
  bank = good;
  bank.slot[1].weight = -1;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_check_play_bank(&bank, slope, &fault));
  bank = good;
  bank.slot[1].edge_slope[0] = LM_REAL(0.5);
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, lm_check_play_bank(&bank, slope, &fault));
  TEST_ASSERT_EQUAL_STRING("edge_slope", fault.input);
  bank = good;
  bank.slot[LM_PLAYS_MAX - 1].radius_Nm = 1;
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, lm_check_play_bank(&bank, slope, &fault));
  TEST_ASSERT_EQUAL_STRING("padding", fault.input);
  bank.slot[LM_PLAYS_MAX - 1].radius_Nm = 0;
  bank.slot[LM_PLAYS_MAX - 1].weight = LM_REAL(1e-9);
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, lm_check_play_bank(&bank, slope, &fault));
  bank.slot[LM_PLAYS_MAX - 1].weight = 0;
  bank.slot[LM_PLAYS_MAX - 1].edge_slope[0] = LM_REAL(0.5);
  bank.slot[LM_PLAYS_MAX - 1].edge_slope[1] = LM_REAL(1.5);
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, lm_check_play_bank(&bank, slope, &fault));
  TEST_ASSERT_EQUAL_STRING("padding", fault.input);
  bank = good;
  bank.widens = 0; /* some band does so */
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, lm_check_play_bank(&bank, slope, &fault));
  TEST_ASSERT_EQUAL_STRING("widens", fault.input);
  bank = good;
  bank.outside_rad_per_Nm *= 2;
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, lm_check_play_bank(&bank, slope, &fault));
  TEST_ASSERT_EQUAL_STRING("outside_rad_per_Nm", fault.input);
  bank = good;
  bank.inside_share = LM_REAL(0.5);
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, lm_check_play_bank(&bank, slope, &fault));
  TEST_ASSERT_EQUAL_STRING("inside_share", fault.input);
  /* Conditions of the operator: shares inside at most 1, and no falling branch. */
  TEST_ASSERT_EQUAL(LM_OK, lm_build_play_bank(&bank, heavy, 2, 0, &fault));
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, lm_check_play_bank(&bank, slope, &fault));
  TEST_ASSERT_EQUAL_STRING("inside_share", fault.input);
  TEST_ASSERT_EQUAL(LM_OK, lm_build_play_bank(&bank, soft, 2, 1, &fault));
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, lm_check_play_bank(&bank, slope, &fault));
  TEST_ASSERT_EQUAL_STRING("outside_rad_per_Nm", fault.input);
}
