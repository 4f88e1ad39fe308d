#include <string.h>

#include "glue.h"

/* Represents the two calls of the user's loop: phases, then motion. The shaft follows at once
 * within its velocity limit. */
static void move(foc_motor *motor, float target_rad, float period_s) {
  float velocity = motor->position_gain * (target_rad - motor->shaft_angle_rad);
  float most = motor->velocity_limit_rad_s;
  motor->shaft_velocity_rad_s = velocity > most ? most : velocity < -most ? -most : velocity;
  motor->shaft_angle_rad += motor->shaft_velocity_rad_s * period_s;
}

lm_status foc_start(foc_joint *joint, const lm_parameters *parameters, const lm_saved *kept,
                    float torque_Nm, float shaft_rad) {
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  lm_status status;
  memset(joint, 0, sizeof *joint);
  joint->motor.velocity_limit_rad_s = 200;
  joint->motor.position_gain = 100;
  joint->motor.shaft_angle_rad = shaft_rad;
  status = lm_start_compensator(&joint->compensator, parameters, torque_Nm, 0);
  if (status == LM_OK && kept) {
    (void)lm_restore_compensator(&joint->compensator, kept, 0); /* refused: history unknown */
  }
  /* Settled before the first move: foc_output is then the angle of the output, at which the user's
   * target must begin. */
  at.torque_Nm = torque_Nm;
  joint->correction_rad = lm_settle_compensator(&joint->compensator, &at).correction_rad;
  return status;
}

void foc_loop(foc_joint *joint, float output_rad, float torque_Nm, float period_s) {
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  at.torque_Nm = torque_Nm;

  /* Here: between the user's target and the call that moves the motor; also while that call is
   * omitted because the motor is braked. */
  joint->correction_rad = lm_step_compensator(&joint->compensator, &at).correction_rad;
  if (joint->enabled) {
    float target_rad = output_rad - joint->zero_rad + joint->correction_rad;
    move(&joint->motor, target_rad * GLUE_RATIO, period_s);
  }
}

/* And here: wherever the shaft angle is converted to an angle of the output. */
float foc_output(const foc_joint *joint) {
  return joint->motor.shaft_angle_rad / GLUE_RATIO - joint->correction_rad + joint->zero_rad;
}

void foc_reference(foc_joint *joint, float output_rad) {
  joint->zero_rad += output_rad - foc_output(joint);
}
