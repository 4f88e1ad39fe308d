/* The build for controllers without a torque: one play, driven by the commanded angle. */
#include <string.h>

#include "draw.h"

#include "lostmotion/runtime.h"
#include "test.h"

#define HALF_GAP LM_REAL(1.5e-4) /* rad */
#define ANGLE_LIMIT 10           /* rad */

static lm_parameters parameters;
static lm_compensator joint;
static lm_conditions at;
static lm_fault fault;

static void make_parameters(lm_parameters *p, lm_real half_gap) {
  lm_play play;
  memset(p, 0, sizeof *p);
  play.radius_Nm = half_gap;
  play.widening = 0;
  play.weight = 1;
  p->format = LM_PARAMETERS_LAYOUT;
  p->torque_limit_Nm = ANGLE_LIMIT;
  p->limits.period_s = LM_REAL(1e-3);
  p->limits.correction_rad = LM_REAL(1e-3);
  p->limits.velocity_rad_s = LM_REAL(0.02);
  p->limits.acceleration_rad_s2 = 5;
  p->limits.jerk_rad_s3 = LM_REAL(3e3);
  p->limits.response_per_s = 60;
  p->watch.window_s = 1;
  p->watch.fade_s = 2;
  p->watch.noise_rad = LM_REAL(1e-5);
  p->watch.misfit_rad = LM_REAL(1e-4);
  TEST_ASSERT_EQUAL(LM_OK, lm_build_play_bank(&p->plays, &play, 1, 1, &fault));
}

void setUp(void) {
  static const lm_conditions unknown = LM_CONDITIONS_UNKNOWN;
  make_parameters(&parameters, HALF_GAP);
  at = unknown;
  seed = 1;
  TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 0, &fault));
}

static lm_correction go_to(lm_real angle_rad) {
  at.output_angle_rad = angle_rad;
  return lm_step_compensator(&joint, &at);
}

static lm_correction rest(lm_real angle_rad, int ticks) {
  lm_correction now = go_to(angle_rad);
  for (; ticks > 1; --ticks) {
    now = go_to(angle_rad);
  }
  return now;
}

TEST(the_gap_is_crossed_after_each_reversal) {
  lm_correction now = rest(LM_REAL(0.5), 500);
  TEST_ASSERT_TRUE(distance(now.lost_motion_rad, -HALF_GAP) < ROUNDING);
  TEST_ASSERT_TRUE(distance(now.correction_rad, HALF_GAP) < LM_REAL(1e-7));
  now = rest(LM_REAL(0.5) - 2 * HALF_GAP, 500);
  TEST_ASSERT_TRUE(distance(now.lost_motion_rad, HALF_GAP) < LM_REAL(2e-7));
  now = rest(LM_REAL(0.1), 500);
  TEST_ASSERT_TRUE(distance(now.correction_rad, -HALF_GAP) < LM_REAL(1e-7));
}

/* Dither within the gap moves nothing on the far side: output = angle + lost motion is at rest. */
TEST(dither_within_the_gap_leaves_the_output_where_it_is) {
  lm_real stood = LM_REAL(0.25) + rest(LM_REAL(0.25), 10).lost_motion_rad;
  int k;
  for (k = 0; k < 1000; ++k) {
    lm_real angle = LM_REAL(0.25) - draw(0, 2 * HALF_GAP);
    TEST_ASSERT_TRUE(distance(angle + go_to(angle).lost_motion_rad, stood) < 2 * ROUNDING);
  }
}

TEST(the_lost_motion_never_leaves_the_gap) {
  int k;
  for (k = 0; k < 100000; ++k) {
    lm_correction now = go_to(draw(-12, 12) * draw(0, 1));
    TEST_ASSERT_TRUE(distance(now.lost_motion_rad, 0) <= HALF_GAP + 2 * ANGLE_LIMIT * ROUNDING);
    TEST_ASSERT_TRUE(distance(now.correction_rad, 0) <= parameters.limits.correction_rad);
    TEST_ASSERT_TRUE(distance(now.acceleration_rad_s2, 0) <= LM_REAL(5.0001));
  }
}

TEST(one_big_step_is_many_small_ones_and_wipes_out_what_was) {
  lm_memory fine = joint.memory;
  lm_memory coarse;
  int k;
  for (k = 0; k < 200; ++k) {
    at.output_angle_rad = draw(LM_REAL(-1e-4), LM_REAL(1e-4));
    (void)lm_step_model(&parameters, &fine, &at);
  }
  for (k = 0; k <= 50; ++k) {
    at.output_angle_rad = LM_REAL(0.02) * LM_REAL(k);
    (void)lm_step_model(&parameters, &fine, &at);
  }
  lm_start_model(&coarse, 0);
  (void)lm_step_model(&parameters, &coarse, &at);
  TEST_ASSERT_EQUAL_MEMORY(&coarse, &fine, sizeof fine);
}

TEST(no_gap_is_the_identity) {
  lm_real angle;
  make_parameters(&parameters, 0);
  TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 0, &fault));
  for (angle = -1; angle < 1; angle += LM_REAL(0.03)) {
    lm_correction now = go_to(angle);
    TEST_ASSERT_TRUE(now.lost_motion_rad == 0 && now.correction_rad == 0);
  }
}

/* A play inside shares the torque with an elasticity, which this profile does not have. */
TEST(a_play_inside_moves_nothing) {
  lm_play play;
  lm_real angle;
  play.radius_Nm = HALF_GAP;
  play.widening = 0;
  play.weight = LM_REAL(0.5);
  TEST_ASSERT_EQUAL(LM_OK, lm_build_play_bank(&parameters.plays, &play, 1, 0, &fault));
  TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 0, &fault));
  for (angle = -1; angle < 1; angle += LM_REAL(0.03)) {
    TEST_ASSERT_TRUE(go_to(angle).lost_motion_rad == 0);
  }
}

TEST(a_recording_is_its_samples_one_by_one) {
  static lm_real commanded[2000], whole[2000];
  lm_recording recording = {0};
  lm_memory apart = joint.memory;
  lm_memory together = joint.memory;
  int k;
  recording.count = 2000;
  recording.output_angle_rad = commanded;
  for (k = 0; k < 2000; ++k) {
    commanded[k] = draw(LM_REAL(-1e-3), LM_REAL(1e-3));
  }
  lm_run_model(&parameters, &together, &recording, whole);
  for (k = 0; k < 2000; ++k) {
    at.output_angle_rad = commanded[k];
    TEST_ASSERT_TRUE(lm_step_model(&parameters, &apart, &at) == whole[k]);
  }
  TEST_ASSERT_EQUAL_MEMORY(&apart, &together, sizeof apart);
  recording.output_angle_rad = 0; /* not measured: the angle remains zero */
  lm_start_model(&together, 0);
  lm_run_model(&parameters, &together, &recording, whole);
  TEST_ASSERT_TRUE(whole[0] == 0 && whole[1999] == 0);
}

TEST(evaluating_commits_nothing) {
  lm_memory before = joint.memory;
  lm_memory trial;
  lm_real angle;
  at.output_angle_rad = LM_REAL(0.3);
  angle = lm_evaluate_model(&parameters, &joint.memory, &trial, &at);
  TEST_ASSERT_EQUAL_MEMORY(&before, &joint.memory, sizeof before);
  TEST_ASSERT_TRUE(lm_step_model(&parameters, &joint.memory, &at) == angle);
}

TEST(the_uncertainty_is_half_the_gap_until_it_was_crossed) {
  TEST_ASSERT_TRUE(distance(lm_bound_uncertainty(&joint), HALF_GAP) < ROUNDING);
  go_to(HALF_GAP);
  TEST_ASSERT_TRUE(lm_bound_uncertainty(&joint) > LM_REAL(0.4) * HALF_GAP);
  TEST_ASSERT_TRUE(go_to(HALF_GAP).status & LM_STATE_MEMORY_UNKNOWN);
  go_to(LM_REAL(2.01) * HALF_GAP);
  TEST_ASSERT_TRUE(lm_bound_uncertainty(&joint) == 0);
  TEST_ASSERT_FALSE(go_to(0).status & LM_STATE_MEMORY_UNKNOWN);
}

TEST(angles_without_meaning_are_refused_or_clipped) {
  lm_real zero = 0;
  lm_real kept = go_to(LM_REAL(0.2)).lost_motion_rad;
  lm_correction now = go_to(zero / zero);
  TEST_ASSERT_TRUE(now.lost_motion_rad == kept && (now.status & LM_STATE_INPUT_REFUSED));
  TEST_ASSERT_TRUE(go_to(11).status & LM_STATE_TORQUE_CLIPPED);
  TEST_ASSERT_TRUE(joint.memory.plays.torque_Nm == ANGLE_LIMIT);
  now = go_to(-1 / zero);
  TEST_ASSERT_TRUE(now.status & LM_STATE_INPUT_REFUSED);
  TEST_ASSERT_TRUE(joint.memory.plays.torque_Nm == ANGLE_LIMIT);
  TEST_ASSERT_TRUE(now.correction_rad - now.correction_rad == 0);
}

/* The other conditions do not reach the model: it has no effects to use them. */
TEST(other_conditions_do_not_matter) {
  lm_real zero = 0;
  at.torque_Nm = zero / zero;
  at.temperature_C = 1 / zero;
  at.elapsed_s = zero / zero;
  TEST_ASSERT_FALSE(go_to(LM_REAL(0.1)).status & LM_STATE_INPUT_REFUSED);
}

TEST(holding_resetting_and_saving_lose_nothing) {
  lm_compensator other;
  lm_saved saved;
  rest(LM_REAL(0.4), 100);
  lm_set_mode(&joint, LM_MODE_HOLD);
  rest(LM_REAL(0.3), 50);
  lm_set_mode(&joint, LM_MODE_RESET);
  TEST_ASSERT_TRUE(distance(rest(LM_REAL(0.35), 800).correction_rad, 0) < LM_REAL(1e-7));
  lm_save_compensator(&joint, &saved);
  TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&other, &parameters, 0, &fault));
  TEST_ASSERT_EQUAL(LM_OK, lm_restore_compensator(&other, &saved, &fault));
  TEST_ASSERT_EQUAL_MEMORY(&joint.memory, &other.memory, sizeof other.memory);
  lm_set_mode(&joint, LM_MODE_RUN);
  TEST_ASSERT_TRUE(distance(rest(LM_REAL(0.35), 800).correction_rad, HALF_GAP) < LM_REAL(1e-7));
}

TEST(the_binary_form_is_read_unchanged_and_a_curve_is_refused) {
  static uint8_t blob[LM_BLOB_BYTES_MAX];
  lm_parameters loaded;
  size_t length = 0;
  TEST_ASSERT_EQUAL(LM_OK, lm_store_parameters(&parameters, blob, sizeof blob, &length, &fault));
  TEST_ASSERT_EQUAL(LM_OK, lm_load_parameters(&loaded, blob, length, 0, 0, &fault));
  TEST_ASSERT_TRUE(loaded.plays.slot[0].radius_Nm == HALF_GAP);
  TEST_ASSERT_TRUE(loaded.torque_limit_Nm == ANGLE_LIMIT);
  blob[20] = 2; /* knots of a curve */
  {
    uint32_t crc = lm_find_crc(0, blob, length - 4);
    int i;
    for (i = 0; i < 4; ++i) {
      blob[length - 4 + (size_t)i] = (uint8_t)(crc >> (8 * i) & 0xFFu);
    }
  }
  TEST_ASSERT_EQUAL(LM_TOO_SMALL, lm_load_parameters(&loaded, blob, length, 0, 0, &fault));
  TEST_ASSERT_EQUAL_STRING("LM_CURVE_POINTS_MAX", fault.input);
  TEST_ASSERT_EQUAL(LM_NEEDS_OUTPUT_ANGLE, lm_find_needs(&loaded));
}

TEST(a_change_of_parameters_makes_no_step) {
  static lm_parameters wider;
  lm_correction before = rest(LM_REAL(0.5), 500);
  lm_correction now;
  make_parameters(&wider, 2 * HALF_GAP);
  TEST_ASSERT_EQUAL(LM_OK, lm_change_parameters(&joint, &wider, &fault));
  now = go_to(LM_REAL(0.5));
  TEST_ASSERT_TRUE(distance(now.correction_rad, before.correction_rad) < LM_REAL(1e-5));
  rest(LM_REAL(0.6), 500);
  now = rest(LM_REAL(0.6), 500);
  TEST_ASSERT_TRUE(distance(now.correction_rad, 2 * HALF_GAP) < LM_REAL(1e-7));
}

TEST(the_watch_fades_a_gap_out_that_is_not_there) {
  int k;
  lm_correction now = go_to(0);
  for (k = 0; k < 8000; ++k) {
    now = go_to((k / 400) % 2 ? LM_REAL(0.1) : LM_REAL(-0.1));
    lm_watch_output(&joint, LM_REAL(1e-6) * LM_REAL(k % 3), LM_REAL(1e-3));
  }
  TEST_ASSERT_TRUE(now.status & LM_STATE_FADED);
  TEST_ASSERT_TRUE(joint.gain == 0);
}

/* The command continues for 500 turns within a limit of less than two, as the host takes each turn
 * off it: the motion is the one of a joint that never left the first turn. */
TEST(a_joint_that_turns_endlessly_keeps_its_gap) {
  const lm_real turn = 2 * LM_PI;
  lm_real angle = 0;
  lm_real step = turn / 50;
  lm_correction now = rest(LM_REAL(0.1), 500);
  int turns = 0;
  while (turns < 500) {
    angle += step;
    if (angle > turn) {
      angle -= turn;
      TEST_ASSERT_EQUAL(LM_OK, lm_shift_angle(&joint, -turn, &fault));
      turns += 1;
    }
    now = go_to(angle);
    TEST_ASSERT_TRUE(distance(now.lost_motion_rad, -HALF_GAP) < LM_REAL(1e-6));
    TEST_ASSERT_TRUE(distance(now.correction_rad, HALF_GAP) < LM_REAL(1e-6));
    TEST_ASSERT_FALSE(now.status & (LM_STATE_TORQUE_CLIPPED | LM_STATE_VELOCITY_LIMITED));
  }
  now = rest(angle - 2 * HALF_GAP, 500);
  TEST_ASSERT_TRUE(distance(now.correction_rad, -HALF_GAP) < LM_REAL(1e-6));
}

/* Within the gap, also while the position in the gap is unknown. */
TEST(a_shift_changes_nothing_but_the_reference) {
  lm_real shift;
  for (shift = -6; shift < 7; shift += 2) {
    lm_real angle = LM_REAL(0.3) * HALF_GAP;
    lm_real unsure;
    lm_real behind;
    lm_compensator moved;
    TEST_ASSERT_EQUAL(LM_OK, lm_start_compensator(&joint, &parameters, 0, &fault));
    (void)rest(LM_REAL(1.2) * HALF_GAP, 5);
    (void)rest(angle, 20);
    unsure = lm_bound_uncertainty(&joint);
    behind = joint.lost_motion_rad;
    moved = joint;
    TEST_ASSERT_EQUAL(LM_OK, lm_shift_angle(&moved, shift, &fault));
    TEST_ASSERT_TRUE(moved.correction_rad == joint.correction_rad);
    TEST_ASSERT_TRUE(moved.velocity_rad_s == joint.velocity_rad_s);
    TEST_ASSERT_TRUE(unsure > 0 && unsure < HALF_GAP);
    TEST_ASSERT_TRUE(distance(lm_bound_uncertainty(&moved), unsure) < LM_REAL(2e-6));
    at.output_angle_rad = angle + shift;
    TEST_ASSERT_TRUE(distance(lm_step_compensator(&moved, &at).lost_motion_rad, behind) <
                     LM_REAL(2e-6));
  }
}

TEST(what_was_swept_ends_at_the_limit) {
  lm_saved saved;
  (void)rest(-9, 1);
  (void)rest(1, 1);
  TEST_ASSERT_EQUAL(LM_OK, lm_shift_angle(&joint, -8, &fault));
  TEST_ASSERT_TRUE(joint.lowest_Nm == -ANGLE_LIMIT && joint.highest_Nm == -7);
  TEST_ASSERT_EQUAL(LM_OK, lm_shift_angle(&joint, 16, &fault));
  TEST_ASSERT_TRUE(joint.lowest_Nm == 6 && joint.highest_Nm == 9);
  TEST_ASSERT_EQUAL(LM_OK, lm_shift_angle(&joint, -6, &fault));
  (void)rest(9, 1);
  (void)rest(1, 1);
  TEST_ASSERT_EQUAL(LM_OK, lm_shift_angle(&joint, 7, &fault));
  TEST_ASSERT_TRUE(joint.lowest_Nm == 7 && joint.highest_Nm == ANGLE_LIMIT);
  lm_save_compensator(&joint, &saved);
  TEST_ASSERT_TRUE(saved.unknown);
  TEST_ASSERT_EQUAL(LM_OK, lm_restore_compensator(&joint, &saved, &fault));
  TEST_ASSERT_TRUE(lm_bound_uncertainty(&joint) == 0);
}

TEST(a_shift_without_meaning_is_refused) {
  lm_real zero = 0;
  lm_compensator before;
  (void)rest(LM_REAL(0.5), 20);
  before = joint;
  TEST_ASSERT_EQUAL(LM_NULL, lm_shift_angle(0, 1, &fault));
  TEST_ASSERT_EQUAL_STRING("compensator", fault.input);
  TEST_ASSERT_EQUAL(LM_NOT_FINITE, lm_shift_angle(&joint, zero / zero, &fault));
  TEST_ASSERT_EQUAL_STRING("by_rad", fault.input);
  TEST_ASSERT_EQUAL(LM_NOT_FINITE, lm_shift_angle(&joint, 1 / zero, &fault));
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_shift_angle(&joint, LM_REAL(9.6), &fault));
  TEST_ASSERT_EQUAL_STRING("by_rad", fault.input);
  TEST_ASSERT_TRUE(fault.found == LM_REAL(9.6) && fault.low == LM_REAL(-10.5) &&
                   fault.high == LM_REAL(9.5));
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_shift_angle(&joint, LM_REAL(-10.6), 0));
  TEST_ASSERT_EQUAL_MEMORY(&before, &joint, sizeof before);
}

TEST(bad_parameters_do_not_start) {
  parameters.plays.slot[0].radius_Nm = -1;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_start_compensator(&joint, &parameters, 0, &fault));
  TEST_ASSERT_EQUAL_STRING("radius_Nm", fault.input);
}
