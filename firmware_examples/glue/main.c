/* Runs the drives of this folder through a usual sequence, under load: power-up, settle, close,
 * run, emergency stop, resume, home, brake, power-down with the history, power-up. The motor goes
 * beyond its command by the wind-up while the reported position is the commanded one, and closing
 * moves nothing. The exit code is ten times the drive's number and the check that fails. */
#include "glue.h"

#include "checks.h"
#include "params.h"

#define PERIOD_S 5e-4f
#define TICKS 4000
#define COMMAND_RAD 0.5f
#define LOAD_NM (-12.0f)
#define STILL_RAD 2e-6f /* 0.4 arcsec */
#define TURN_RAD 6.28318531f
#define DAMPING 45.0f /* N*m*s/rev of the simulated motor, which has no inertia */

static float wind_up(void) {
  static lm_memory memory;
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  at.torque_Nm = LOAD_NM;
  lm_start_model(&memory, LOAD_NM);
  lm_settle_model(&joint_parameters, &memory);
  return lm_step_model(&joint_parameters, &memory, &at);
}

static float size(float value) {
  return value < 0 ? -value : value;
}

static void run_foc(foc_joint *joint, float output_rad, float load_Nm, int ticks) {
  for (; ticks > 0; --ticks) {
    foc_loop(joint, output_rad, load_Nm, PERIOD_S);
  }
}

static int check_foc(void) {
  static foc_joint joint;
  lm_saved kept;
  float before_rad;
  if (foc_start(&joint, &joint_parameters, 0, LOAD_NM, 0) != LM_OK) {
    return 1;
  }
  /* Enabled at the reported angle: nothing moves. */
  joint.enabled = 1;
  run_foc(&joint, foc_output(&joint), LOAD_NM, 10);
  if (size(joint.motor.shaft_angle_rad) > STILL_RAD * GLUE_RATIO) {
    return 2;
  }
  run_foc(&joint, COMMAND_RAD, LOAD_NM, TICKS);
  if (!is_close(foc_output(&joint), COMMAND_RAD) ||
      !is_close(joint.motor.shaft_angle_rad / GLUE_RATIO, COMMAND_RAD - wind_up())) {
    return 3;
  }
  /* Emergency stop, a push under the brake, and resume. */
  joint.enabled = 0;
  before_rad = joint.motor.shaft_angle_rad;
  run_foc(&joint, COMMAND_RAD, LOAD_NM - 5.0f, TICKS / 10);
  run_foc(&joint, COMMAND_RAD, LOAD_NM, TICKS / 10);
  joint.enabled = 1;
  run_foc(&joint, foc_output(&joint), LOAD_NM, 10);
  if (size(joint.motor.shaft_angle_rad - before_rad) > STILL_RAD * GLUE_RATIO) {
    return 4;
  }
  /* Home, resume. */
  foc_reference(&joint, 1.0f);
  before_rad = joint.motor.shaft_angle_rad;
  run_foc(&joint, 1.0f, LOAD_NM, TICKS / 10);
  if (size(joint.motor.shaft_angle_rad - before_rad) > STILL_RAD * GLUE_RATIO) {
    return 5;
  }
  /* Power-down with the history, power-up, enabled: nothing moves. */
  joint.enabled = 0;
  run_foc(&joint, 1.0f, LOAD_NM, 10);
  lm_save_compensator(&joint.compensator, &kept);
  before_rad = joint.motor.shaft_angle_rad;
  if (foc_start(&joint, &joint_parameters, &kept, LOAD_NM, before_rad) != LM_OK) {
    return 6;
  }
  joint.enabled = 1;
  run_foc(&joint, foc_output(&joint), LOAD_NM, TICKS / 10);
  return size(joint.motor.shaft_angle_rad - before_rad) > STILL_RAD * GLUE_RATIO ? 7 : 0;
}

/* A brake holds the stopped motor. */
static void run_servo(servo *drive, const servo_command *command, int ticks) {
  for (; ticks > 0; --ticks) {
    float torque_Nm = servo_interrupt(drive, command);
    float made_Nm = command->mode == SERVO_STOPPED ? 0 : torque_Nm + LOAD_NM;
    drive->measured_rev += made_Nm / DAMPING * drive->period_s;
  }
}

static int check_servo(void) {
  static servo drive;
  lm_saved kept;
  servo_command command = {SERVO_STOPPED, COMMAND_RAD / TURN_RAD, 0.5f, 2.0f, -LOAD_NM};
  float before_rev;
  if (servo_start(&drive, &joint_parameters, 0, LOAD_NM, 0, 2 * PERIOD_S) != LM_INCONSISTENT) {
    return 1;
  }
  if (servo_start(&drive, &joint_parameters, 0, LOAD_NM, 0, PERIOD_S) != LM_OK) {
    return 2;
  }
  run_servo(&drive, &command, 10);
  command.mode = SERVO_POSITION;
  run_servo(&drive, &command, TICKS / 10);
  command.mode = SERVO_STOPPED; /* during the ramp */
  run_servo(&drive, &command, TICKS / 10);
  command.mode = SERVO_POSITION;
  run_servo(&drive, &command, TICKS);
  if (!is_close(drive.reported_position_rev * TURN_RAD, COMMAND_RAD) ||
      !is_close(drive.measured_rev * TURN_RAD, COMMAND_RAD - wind_up())) {
    return 3;
  }
  /* Home, resume. */
  servo_reference(&drive, 1);
  command.position_rev = 1;
  before_rev = drive.measured_rev;
  run_servo(&drive, &command, TICKS / 10);
  if (size(drive.measured_rev - before_rev) * TURN_RAD > STILL_RAD) {
    return 5;
  }
  /* Brake, power-down with the history, power-up, at work again: nothing moves. */
  command.mode = SERVO_STOPPED;
  run_servo(&drive, &command, 10);
  lm_save_compensator(&drive.compensator, &kept);
  before_rev = drive.measured_rev;
  if (servo_start(&drive, &joint_parameters, &kept, LOAD_NM, before_rev, PERIOD_S) != LM_OK) {
    return 6;
  }
  run_servo(&drive, &command, 10);
  command.position_rev = drive.reported_position_rev;
  command.mode = SERVO_POSITION;
  run_servo(&drive, &command, TICKS / 10);
  return size(drive.measured_rev - before_rev) * TURN_RAD > STILL_RAD ? 7 : 0;
}

int main(void) {
  int (*const check[])(void) = {check_foc, check_servo, check_cia402};
  int i;
  for (i = 0; i < 3; ++i) {
    int failed = check[i]();
    if (failed) {
      return 10 * (i + 1) + failed;
    }
  }
  return 0;
}
