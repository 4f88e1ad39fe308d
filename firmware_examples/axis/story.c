#include "story.h"

#include "../joint/params.h" /* lostmotion export joint.toml -o params.h */
#include "axis.h"

#define LOAD_NM (-12.0f) /* weight of the arm */
#define PUSH_NM (-5.0f)  /* external push while the brake is on */
#define FAST_RAD 0.0005f /* a tick */
#define STILL_RAD 2e-6f  /* 0.4 arcsec */
#define ARRIVED_RAD 2e-5f

/* The motor follows at once while the loop is closed and the brake is off; the gear winds up. */
typedef struct joint {
  axis drive;
  lm_memory gear;
  float motor_rad, twist_rad, wish_rad;
} joint;

static float output(const joint *j) {
  return j->motor_rad + j->twist_rad;
}

static float size(float value) {
  return value < 0 ? -value : value;
}

static void run(joint *j, int ticks, float torque_Nm, float rate_rad) {
  const float from_rad = j->wish_rad;
  int k;
  for (k = 1; k <= ticks; ++k) {
    lm_conditions at = LM_CONDITIONS_UNKNOWN;
    at.torque_Nm = torque_Nm;
    j->wish_rad = from_rad + rate_rad * (float)k;
    j->motor_rad = axis_tick(&j->drive, torque_Nm, j->motor_rad, j->wish_rad);
    j->twist_rad = lm_step_model(&joint_parameters, &j->gear, &at);
    if (j->drive.state != AXIS_CLOSED && j->drive.state != AXIS_HOMING) {
      j->wish_rad = j->drive.command_rad;
    }
  }
}

/* Closes the loop; how far the output moves in the ticks after it. */
static float close_loop(joint *j) {
  float before_rad = output(j);
  j->wish_rad = j->drive.command_rad; /* the planner starts at the output angle */
  if (axis_close(&j->drive)) {
    return 1;
  }
  run(j, 200, LOAD_NM, 0);
  return size(output(j) - before_rad);
}

int axis_story(float *most_rad) {
  static joint j;
  static lm_saved kept; /* in memory that survives power-down */
  float moved_rad;
  float torque_Nm;
  float zero_rad;
  kept.format = 0; /* nothing saved yet */
  *most_rad = 0;
  j.motor_rad = 0.2f;
  j.twist_rad = 0;
  lm_start_model(&j.gear, LOAD_NM);
  lm_settle_model(&joint_parameters, &j.gear);
  /* Power-up, the brake on, and a load cycle under the brake would do as well as this motion. */
  if (axis_power_up(&j.drive, &joint_parameters, &kept, LOAD_NM, j.motor_rad, 0) != LM_OK) {
    return 1;
  }
  run(&j, 10, LOAD_NM, 0);
  moved_rad = close_loop(&j);
  *most_rad = moved_rad > *most_rad ? moved_rad : *most_rad;
  if (moved_rad > STILL_RAD) {
    return 2;
  }
  /* Run: half a radian, with a load that reverses and returns. */
  run(&j, 1000, LOAD_NM, FAST_RAD);
  for (torque_Nm = LOAD_NM; torque_Nm < 50; torque_Nm += 0.05f) {
    run(&j, 1, torque_Nm, 0);
  }
  for (; torque_Nm > -50; torque_Nm -= 0.05f) {
    run(&j, 1, torque_Nm, 0);
  }
  for (; torque_Nm < LOAD_NM; torque_Nm += 0.05f) {
    run(&j, 1, torque_Nm, 0);
  }
  run(&j, 400, LOAD_NM, 0);
  (void)lm_bound_uncertainty(&j.drive.compensator); /* the history is known now */
  if (size(output(&j) - j.wish_rad) > ARRIVED_RAD) {
    return 3;
  }
  /* Emergency stop in the middle of a motion, a push under the brake, and resume. */
  run(&j, 100, LOAD_NM, -FAST_RAD);
  axis_brake(&j.drive);
  run(&j, 200, LOAD_NM + PUSH_NM, 0);
  run(&j, 400, LOAD_NM, 0);
  moved_rad = close_loop(&j);
  *most_rad = moved_rad > *most_rad ? moved_rad : *most_rad;
  if (moved_rad > STILL_RAD) {
    return 4;
  }
  /* Home: the reference is rejected until the correction has settled. */
  axis_home(&j.drive);
  run(&j, 1, LOAD_NM, 0);
  zero_rad = output(&j);
  run(&j, 400, LOAD_NM, 0);
  if (axis_reference(&j.drive, j.motor_rad, 1.0f)) {
    return 5;
  }
  j.wish_rad = j.drive.command_rad;
  run(&j, 200, LOAD_NM, 0);
  if (size(output(&j) - zero_rad) > STILL_RAD) {
    return 6;
  }
  run(&j, 1000, LOAD_NM, FAST_RAD); /* resume: to 1.5 rad */
  run(&j, 400, LOAD_NM, 0);
  if (size(output(&j) - zero_rad - 0.5f) > ARRIVED_RAD ||
      size(axis_reported(&j.drive, j.motor_rad) - 1.5f) > ARRIVED_RAD) {
    return 7;
  }
  /* Brake, power-down with the history, power-up: nothing moves. */
  axis_brake(&j.drive);
  run(&j, 400, LOAD_NM, 0);
  axis_power_down(&j.drive, &kept);
  if (axis_power_up(&j.drive, &joint_parameters, &kept, LOAD_NM, j.motor_rad, 0) != LM_OK ||
      (j.drive.correction.status & LM_STATE_MEMORY_UNKNOWN)) {
    return 8;
  }
  run(&j, 10, LOAD_NM, 0);
  moved_rad = close_loop(&j);
  *most_rad = moved_rad > *most_rad ? moved_rad : *most_rad;
  return moved_rad > STILL_RAD ? 9 : 0;
}
