/* Runs the drives of this folder to a position under load, and checks that the motor goes beyond
 * it by the wind-up while the reported position is the commanded one, and that a stop in between
 * changes nothing. The exit code is the number of the first check that fails. */
#include "glue.h"

#include "checks.h"
#include "params.h"

#define PERIOD_S 5e-4f
#define TICKS 4000
#define COMMAND_RAD 0.5f
#define LOAD_NM (-12.0f)
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

static int check_foc(void) {
  static foc_joint joint;
  int tick;
  if (foc_start(&joint, &joint_parameters, LOAD_NM) != LM_OK) {
    return 1;
  }
  for (tick = 0; tick < TICKS; ++tick) {
    foc_loop(&joint, COMMAND_RAD, LOAD_NM, PERIOD_S);
  }
  if (!is_close(foc_output(&joint), COMMAND_RAD)) {
    return 2;
  }
  return is_close(joint.motor.shaft_angle_rad / GLUE_RATIO, COMMAND_RAD - wind_up()) ? 0 : 3;
}

static void run_servo(servo *drive, const servo_command *command, int ticks) {
  for (; ticks > 0; --ticks) {
    float torque_Nm = servo_interrupt(drive, command);
    float made_Nm = command->mode == SERVO_POSITION ? torque_Nm + LOAD_NM : 0;
    drive->measured_rev += made_Nm / DAMPING * drive->period_s;
  }
}

static int check_servo(void) {
  static servo drive;
  servo_command command = {SERVO_POSITION, COMMAND_RAD / TURN_RAD, 0.5f, 2.0f, -LOAD_NM};
  if (servo_start(&drive, &joint_parameters, LOAD_NM, 2 * PERIOD_S) != LM_INCONSISTENT) {
    return 7;
  }
  if (servo_start(&drive, &joint_parameters, LOAD_NM, PERIOD_S) != LM_OK) {
    return 4;
  }
  run_servo(&drive, &command, TICKS / 10);
  command.mode = SERVO_STOPPED;
  run_servo(&drive, &command, TICKS / 10);
  command.mode = SERVO_POSITION;
  run_servo(&drive, &command, TICKS);
  if (!is_close(drive.reported_position_rev * TURN_RAD, COMMAND_RAD)) {
    return 5;
  }
  return is_close(drive.measured_rev * TURN_RAD, COMMAND_RAD - wind_up()) ? 0 : 6;
}

int main(void) {
  int failed = check_foc();
  failed = failed ? failed : check_servo();
  if (failed == 0) {
    failed = check_cia402();
    failed = failed ? failed + 10 : 0;
  }
  return failed;
}
