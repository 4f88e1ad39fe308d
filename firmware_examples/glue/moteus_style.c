#include <string.h>

#include "glue.h"

#define TURN_RAD 6.28318531f
#define POSITION_GAIN 4000.0f /* N*m/rev */
#define VELOCITY_GAIN 40.0f   /* N*m*s/rev */

lm_status servo_start(servo *drive, const lm_parameters *parameters, const lm_saved *kept,
                      float torque_Nm, float measured_rev, float period_s) {
  lm_status status;
  memset(drive, 0, sizeof *drive);
  drive->period_s = period_s;
  drive->measured_rev = measured_rev;
  status = lm_start_compensator(&drive->compensator, parameters, torque_Nm, 0);
  if (status == LM_OK) {
    /* The limits of the correction are valid only for the period of the parameters. */
    float ratio = period_s / parameters->limits.period_s;
    status = ratio > 0.99f && ratio < 1.01f ? LM_OK : LM_INCONSISTENT;
  }
  if (status == LM_OK) {
    /* The drive is stopped: the correction settles before the loop closes on it. */
    lm_conditions at = LM_CONDITIONS_UNKNOWN;
    if (kept) {
      (void)lm_restore_compensator(&drive->compensator, kept, 0); /* refused: history unknown */
    }
    at.torque_Nm = torque_Nm;
    drive->correction = lm_settle_compensator(&drive->compensator, &at);
  }
  return status;
}

/* The drive's own ramp: at most the velocity from which it can still stop. */
static void advance_ramp(servo *drive, const servo_command *command) {
  float left_rev = command->position_rev - drive->control_position_rev;
  float change = command->acceleration_rev_s2 * drive->period_s;
  float v = drive->control_velocity_rev_s;
  float stopping_rev = v * (v < 0 ? -v : v) / (2 * command->acceleration_rev_s2);
  v += left_rev > stopping_rev ? change : -change;
  v = v > command->velocity_limit_rev_s    ? command->velocity_limit_rev_s
      : v < -command->velocity_limit_rev_s ? -command->velocity_limit_rev_s
                                           : v;
  if (left_rev < change * drive->period_s && left_rev > -change * drive->period_s &&
      v <= 2 * change && v >= -2 * change) {
    drive->control_position_rev = command->position_rev;
    v = 0;
  }
  drive->control_velocity_rev_s = v;
  drive->control_position_rev += v * drive->period_s;
}

/* Part of the permitted velocity that the ramp does not use: available for the correction. */
static void share_velocity(servo *drive, const servo_command *command) {
  lm_headroom room = {1, 0, 1e9f, 1e9f};
  float used = drive->control_velocity_rev_s;
  room.velocity_rad_s = (command->velocity_limit_rev_s - (used < 0 ? -used : used)) * TURN_RAD;
  lm_set_headroom(&drive->compensator, &room);
}

static float report(const servo *drive) {
  return drive->measured_rev - drive->correction.correction_rad / TURN_RAD + drive->zero_rev;
}

void servo_reference(servo *drive, float position_rev) {
  const float shift_rev = position_rev - report(drive);
  drive->zero_rev += shift_rev;
  drive->reported_position_rev = position_rev;
  drive->control_position_rev += shift_rev;
}

float servo_interrupt(servo *drive, const servo_command *command) {
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  float error_rev;
  float rate_rev_s;

  /* The torque of the load on the output is minus the torque that the drive produces for it, or
   * minus that of a brake while the motor is stopped (without a brake it would then be zero). The
   * model steps in every mode, so that a stop keeps its state, and the reported angle follows the
   * output.
   */
  at.torque_Nm = -command->feedforward_torque_Nm;
  if (command->mode != SERVO_STOPPED) {
    advance_ramp(drive, command);
    share_velocity(drive, command);
  }

  /* Here: after the ramp and before the loop; and in the reported position. */
  drive->correction = lm_step_compensator(&drive->compensator, &at);
  drive->reported_position_rev = report(drive);
  if (command->mode == SERVO_STOPPED) {
    drive->control_position_rev = drive->reported_position_rev;
    drive->control_velocity_rev_s = 0;
    return 0;
  }
  error_rev = drive->control_position_rev - drive->reported_position_rev;
  rate_rev_s = drive->control_velocity_rev_s + drive->correction.velocity_rad_s / TURN_RAD;
  return command->feedforward_torque_Nm + POSITION_GAIN * error_rev + VELOCITY_GAIN * rate_rev_s;
}
