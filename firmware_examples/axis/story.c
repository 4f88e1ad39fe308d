#include "story.h"

#include "../joint/params.h" /* lostmotion export joint.toml -o params.h */
#include "lm_axis.h"

#define LOAD_NM (-12.0f) /* weight of the arm */
#define PUSH_NM (-5.0f)  /* external push while the brake is on */
#define SWING_NM 10.0f   /* of the arm against the brake, at 20 Hz */
#define SLIP_RAD 1e-6f   /* of the brake, a tick */
#define FAST_RAD 0.0005f /* a tick */
#define STILL_RAD 2e-6f  /* 0.4 arcsec */
#define ARRIVED_RAD 2e-5f

#define PERIOD_S 5e-4f  /* of the parameters */
#define STAND_TICKS 501 /* LM_AXIS_STAND */

/* A motor current: what it adds to the torque of the command, what friction at rest can hide of
 * that, its filter at a tenth of the resonance, and the response for this resonance. */
#define PAYLOAD_NM 20.0f
#define HIDDEN_NM 19.2f
#define RESONANCE_HZ 20.0f
#define RESPONSE_PER_S (2.5f * RESONANCE_HZ)
#define SHARE (0.628f * RESONANCE_HZ * PERIOD_S)

/* The motor follows at once while the loop is closed; the gear winds up. */
typedef struct joint {
  lm_axis drive;
  lm_memory gear;
  float motor_rad, twist_rad, wish_rad;
} joint;

static float output(const joint *j) {
  return j->motor_rad + j->twist_rad;
}

static float size(float value) {
  return value < 0 ? -value : value;
}

static lm_conditions conditions(float torque_Nm) {
  lm_conditions at = LM_CONDITIONS_UNKNOWN; /* the parameters of this joint need the torque only */
  at.torque_Nm = torque_Nm;
  return at;
}

static void run(joint *j, int ticks, float torque_Nm, float rate_rad) {
  const float from_rad = j->wish_rad;
  const lm_conditions at = conditions(torque_Nm);
  int k;
  for (k = 1; k <= ticks; ++k) {
    j->wish_rad = from_rad + rate_rad * (float)k;
    j->motor_rad = lm_axis_tick(&j->drive, &at, j->motor_rad, j->wish_rad);
    j->twist_rad = lm_step_model(&joint_parameters, &j->gear, &at);
    if (j->drive.state != LM_AXIS_CLOSED) {
      j->wish_rad = j->drive.command_rad;
    }
  }
}

/* Closes the loop once the load stands; how far the output moves in the ticks after it. */
static float close_loop(joint *j) {
  float before_rad = output(j);
  int ticks = 0;
  while (lm_axis_close(&j->drive)) {
    run(j, 1, LOAD_NM, 0);
    if (++ticks > 2 * STAND_TICKS) {
      return 1;
    }
  }
  j->wish_rad = j->drive.command_rad; /* the planner starts at the output angle */
  run(j, 200, LOAD_NM, 0);
  return size(output(j) - before_rad);
}

/* The motor is held, the change was made: how far the output moves until the planner has it again,
 * or 1 if the loop closes before the correction stands. */
static float hand_over(joint *j) {
  float before_rad = output(j);
  run(j, 1, LOAD_NM, 0);
  if (!lm_axis_close(&j->drive) || j->drive.correction.velocity_rad_s != 0) {
    return 1;
  }
  (void)close_loop(j);
  return size(output(j) - before_rad);
}

/* From the torque of the command to a current with an unknown payload, the motor held: friction
 * hides the payload until the filter has nearly settled. How far the motor moves after closing. */
static float take_current(joint *j) {
  static lm_parameters slower;      /* at rest the set before it is in use, and the one after it */
  const float bound_Nm = HIDDEN_NM; /* through its filter: at rest from the begin */
  float current_Nm = LOAD_NM;       /* begins at the torque in use, as the torque itself */
  float torque_Nm = LOAD_NM;
  float before_rad = 0;
  int closed_ticks = 0;
  slower = joint_parameters;
  slower.limits.response_per_s = RESPONSE_PER_S;
  lm_axis_hold(&j->drive);
  if (lm_axis_change(&j->drive, &slower, 0) != LM_OK) {
    return 1;
  }
  while (closed_ticks < 4 * STAND_TICKS) {
    current_Nm += SHARE * (LOAD_NM - PAYLOAD_NM - current_Nm);
    run(j, 1, lm_hold_torque(&torque_Nm, current_Nm, bound_Nm), 0);
    if (closed_ticks == 0 && !lm_axis_close(&j->drive)) {
      j->wish_rad = j->drive.command_rad;
      before_rad = j->motor_rad;
      closed_ticks = 1;
    }
    closed_ticks += closed_ticks > 0;
  }
  before_rad = size(j->motor_rad - before_rad);
  lm_axis_hold(&j->drive);
  return lm_axis_change(&j->drive, &joint_parameters, 0) == LM_OK && hand_over(j) < 1 ? before_rad
                                                                                      : 1;
}

static void turn_load(joint *j, float from_Nm, float to_Nm) {
  const float by_Nm = to_Nm > from_Nm ? 0.05f : -0.05f;
  float torque_Nm;
  for (torque_Nm = from_Nm; (to_Nm - torque_Nm) * by_Nm > 0; torque_Nm += by_Nm) {
    run(j, 1, torque_Nm, 0);
  }
}

int axis_story(float *most_rad) {
  static joint j;
  static lm_saved kept;         /* in memory that survives power-down */
  static lm_parameters smaller; /* another set, with half the correction */
  const lm_conditions at = conditions(LOAD_NM);
  float moved_rad;
  float zero_rad;
  float error_rad;
  int k;
  kept.format = 0; /* nothing saved yet */
  *most_rad = 0;
  j.motor_rad = 0.2f;
  j.twist_rad = 0;
  lm_start_model(&j.gear, LOAD_NM);
  lm_settle_model(&joint_parameters, &j.gear);
  /* Power-up, the brake on. */
  if (lm_axis_power_up(&j.drive, &joint_parameters, &kept, &at, j.motor_rad, 0) != LM_OK) {
    return 1;
  }
  /* The torque is not known yet: the loop stays open. */
  run(&j, STAND_TICKS, LM_UNKNOWN, 0);
  if (!lm_axis_close(&j.drive)) {
    return 2;
  }
  moved_rad = close_loop(&j);
  *most_rad = moved_rad > *most_rad ? moved_rad : *most_rad;
  if (moved_rad > STILL_RAD) {
    return 2;
  }
  /* First homing, in motion: the load history is unknown, and the stated error of the zero includes
   * this. */
  run(&j, 100, LOAD_NM, FAST_RAD);
  zero_rad = j.wish_rad;
  error_rad = lm_axis_reference(&j.drive, j.motor_rad, 0.5f);
  zero_rad -= j.drive.command_rad;
  j.wish_rad = j.drive.command_rad;
  if (error_rad < STILL_RAD || size(j.drive.command_rad - 0.5f) > ARRIVED_RAD) {
    return 3;
  }
  /* Run: half a radian, with a load cycle. */
  run(&j, 900, LOAD_NM, FAST_RAD);
  turn_load(&j, LOAD_NM, 50);
  turn_load(&j, 50, -50);
  turn_load(&j, -50, LOAD_NM);
  run(&j, 400, LOAD_NM, 0);
  if (size(output(&j) - zero_rad - j.wish_rad) > ARRIVED_RAD) {
    return 4;
  }
  /* Emergency stop in the middle of a motion, a push under the brake, and resume: refused as long
   * as the correction still follows the load. */
  run(&j, 100, LOAD_NM, -FAST_RAD);
  lm_axis_open(&j.drive);
  run(&j, 200, LOAD_NM + PUSH_NM, 0);
  run(&j, 20, LOAD_NM, 0);
  if (!lm_axis_close(&j.drive) || !lm_axis_power_down(&j.drive, &kept)) {
    return 5;
  }
  /* The brake slips: the loop stays open. */
  for (k = 0; k < STAND_TICKS; ++k) {
    j.motor_rad += SLIP_RAD;
    run(&j, 1, LOAD_NM, 0);
  }
  if (!lm_axis_close(&j.drive)) {
    return 15;
  }
  /* The arm swings against the brake: that is no ringing of the correction. */
  for (k = 0; k < 10; ++k) {
    run(&j, 50, LOAD_NM + SWING_NM, 0);
    run(&j, 50, LOAD_NM - SWING_NM, 0);
  }
  run(&j, 20, LOAD_NM, 0);
  moved_rad = close_loop(&j);
  *most_rad = moved_rad > *most_rad ? moved_rad : *most_rad;
  if (moved_rad > STILL_RAD || (j.drive.correction.status & LM_STATE_RINGING)) {
    return 6;
  }
  /* Home again: the history is known now, and nothing moves. */
  zero_rad = output(&j);
  error_rad = lm_axis_reference(&j.drive, j.motor_rad, 1.0f);
  j.wish_rad = j.drive.command_rad;
  run(&j, 200, LOAD_NM, 0);
  if (size(error_rad) > STILL_RAD || size(output(&j) - zero_rad) > STILL_RAD) {
    return 7;
  }
  run(&j, 1000, LOAD_NM, FAST_RAD); /* to 1.5 rad */
  run(&j, 400, LOAD_NM, 0);
  if (size(output(&j) - zero_rad - 0.5f) > ARRIVED_RAD ||
      size(lm_axis_reported(&j.drive, j.motor_rad) - 1.5f) > ARRIVED_RAD) {
    return 8;
  }
  /* Held: the correction goes to zero and back, and to other parameters and back; nothing moves. */
  zero_rad = output(&j);
  smaller = joint_parameters;
  smaller.limits.correction_rad = 0.5f * size(j.drive.correction.correction_rad);
  for (k = 0; k < 4; ++k) {
    lm_axis_hold(&j.drive);
    if (k < 2) {
      lm_axis_set_mode(&j.drive, k == 0 ? LM_MODE_RESET : LM_MODE_RUN);
    } else if (lm_axis_change(&j.drive, k == 2 ? &smaller : &joint_parameters, 0) != LM_OK) {
      return 12;
    }
    moved_rad = hand_over(&j);
    *most_rad = moved_rad > *most_rad ? moved_rad : *most_rad;
    if (moved_rad > STILL_RAD || size(output(&j) - zero_rad) > STILL_RAD ||
        (size(j.drive.correction.correction_rad) < STILL_RAD) != (k == 0)) {
      return 13;
    }
  }
  moved_rad = take_current(&j);
  *most_rad = moved_rad > *most_rad ? moved_rad : *most_rad;
  if (moved_rad > STILL_RAD) {
    return 16;
  }
  /* Brake, power-down with the history, power-up: nothing moves, and the history is used up. */
  lm_axis_open(&j.drive);
  run(&j, STAND_TICKS, LOAD_NM, 0);
  zero_rad = j.drive.zero_rad; /* of an absolute encoder: stored */
  if (lm_axis_power_down(&j.drive, &kept) || kept.format == 0) {
    return 9;
  }
  if (lm_axis_power_up(&j.drive, &joint_parameters, &kept, &at, j.motor_rad, 0) != LM_OK ||
      (j.drive.correction.status & LM_STATE_MEMORY_UNKNOWN) || kept.format != 0) {
    return 10;
  }
  moved_rad = close_loop(&j);
  *most_rad = moved_rad > *most_rad ? moved_rad : *most_rad;
  if (moved_rad > STILL_RAD) {
    return 11;
  }
  moved_rad = output(&j);
  lm_axis_set_zero(&j.drive, zero_rad);
  j.wish_rad = j.drive.command_rad;
  run(&j, 200, LOAD_NM, 0);
  return size(output(&j) - moved_rad) > STILL_RAD ||
                 size(lm_axis_reported(&j.drive, j.motor_rad) - 1.5f) > ARRIVED_RAD
             ? 14
             : 0;
}
