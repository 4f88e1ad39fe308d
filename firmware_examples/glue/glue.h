/* Two minimal motor drives, each with the structure of a well-known one, that show where to call
 * the library. When to enable them, and when to save the history, is in ../axis/lm_drive.h. */
#ifndef GLUE_H
#define GLUE_H

#include "lostmotion/runtime.h"

#define GLUE_RATIO 100.0f

/* --- A drive in the style of SimpleFOC: the user's own loop calls "run the phases", then "go to
 * this angle"; angles are those of the motor's shaft, in rad; the user
 * converts them to gear units. */
typedef struct foc_motor {
  float shaft_angle_rad; /* measured */
  float shaft_velocity_rad_s;
  float velocity_limit_rad_s;
  float position_gain; /* 1/s */
} foc_motor;

typedef struct foc_joint {
  foc_motor motor;
  lm_compensator compensator;
  float correction_rad; /* included in the last commanded shaft angle */
  float zero_rad;       /* of the output angle, from homing */
  int enabled;          /* the user's motor.enable() and motor.disable() with the brake */
} foc_joint;

/* Power-up, disabled, with this torque on the output, at the present shaft angle. kept: the
 * history of the last power-down, or null. If the result is not LM_OK, do not enable the loop. */
lm_status foc_start(foc_joint *joint, const lm_parameters *parameters, const lm_saved *kept,
                    float torque_Nm, float shaft_rad);
/* In every period, enabled or not; the target begins at foc_output as it is enabled. */
void foc_loop(foc_joint *joint, float output_rad, float torque_Nm, float period_s);
float foc_output(const foc_joint *joint);
/* Homing: the output is now at this angle. Nothing moves if the command is set to it too. */
void foc_reference(foc_joint *joint, float output_rad);

/* --- A drive in the style of moteus: one interrupt runs everything, angles are turns of the
 * output, the drive plans its own ramp to a position within a velocity and an acceleration, and
 * commands carry a feed-forward torque. */
typedef enum servo_mode { SERVO_STOPPED, SERVO_POSITION } servo_mode;

typedef struct servo_command {
  servo_mode mode;
  float position_rev;
  float velocity_limit_rev_s;
  float acceleration_rev_s2;
  float feedforward_torque_Nm; /* torque that the drive must produce for the load */
} servo_command;

typedef struct servo {
  float measured_rev; /* motor encoder over the ratio */
  float zero_rev;     /* of the output angle, by homing */
  float control_position_rev;
  float control_velocity_rev_s;
  float reported_position_rev;
  float period_s;
  lm_compensator compensator;
  lm_correction correction;
} servo;

/* Power-up, stopped, with this torque on the output, at the present motor angle; kept: the
 * history of the last power-down, or null. If the result is not LM_OK, do not start the interrupt.
 * LM_INCONSISTENT: parameters exported for another period than the interrupt's. */
lm_status servo_start(servo *drive, const lm_parameters *parameters, const lm_saved *kept,
                      float torque_Nm, float measured_rev, float period_s);
/* The torque for the current loop. */
float servo_interrupt(servo *drive, const servo_command *command);
/* Homing: the output is now here. The command shifts with the zero, so nothing moves. */
void servo_reference(servo *drive, float position_rev);

#endif
