/* The position loop of the joint, as in a drive: encoder on the motor, position and velocity loop
 * in cascade, feed-forward. The compensation is added to the commanded angle, and subtracted
 * from the reported angle, so that command and feedback agree. */
#ifndef JOINT_LOOP_H
#define JOINT_LOOP_H

#include "lostmotion/runtime.h"
#include "motion.h"

typedef enum method {
  METHOD_NONE,
  METHOD_CONSTANT, /* half a constant width by the sign of the commanded velocity */
  METHOD_MODEL     /* the library */
} method;

/* Source of the model's output torque. */
typedef enum torque_source {
  TORQUE_FROM_COMMAND, /* gravity, inertia and friction of the commanded motion */
  TORQUE_WITHOUT_FRICTION,
  TORQUE_FROM_CURRENT,
  TORQUE_FROM_SENSOR /* that of the command, plus the slowly filtered difference measured by a
                        sensor */
} torque_source;

typedef struct constant_width {
  float half_rad;
  float correction_rad;
  float velocity_rad_s;
  float side; /* -1, 0, 1 */
} constant_width;

typedef struct loop {
  method how;
  torque_source source;
  plant_load load; /* as the controller knows it */
  lm_compensator compensator;
  lm_load_guess bearing; /* friction of the load, as the controller knows it */
  float resisting_Nm;
  float last_angle_rad;
  constant_width constant;
  float due_rad;     /* target of the motor at the next tick */
  float due_off_rad; /* the correction included in it */
  float angle_rad;   /* of the motor at the last tick */
  float off_rad;     /* the correction that was due with it */
  float error_rad;
  float speed_error_rad_s;
  float speed_rad_s;
  float change_rad_s2;
  float current_Nm;  /* torque from the current, filtered */
  float bound_Nm;    /* its bound, filtered */
  float believed_Nm; /* the same after lm_hold_torque */
  float beyond_Nm;   /* torque of the sensor beyond that of the command, filtered */
  float motor_Nm;    /* torque from the current, referred to the output */
  float sum_Nm;
  lm_correction correction;
} loop;

/* At power-up, and whenever the drive is switched on again: starts from the present encoder angle
 * and command, so that nothing jumps. `load` is the true one; the controller knows it within a few
 * percent. Returns 0 if the library accepts the parameters; otherwise no tick may run. */
int loop_start(loop *joint, method how, torque_source source, const lm_parameters *parameters,
               plant_load load, float constant_half_rad, int32_t counts, const motion *now);

/* One tick: the motor's torque [N*m, referred to the output] from encoder and torque sensor now
 * (any number if there is no sensor) and the command for the next tick, when that torque acts. */
float loop_tick(loop *joint, int32_t counts, float sensed_Nm, const motion *next);

/* Output angle as reported to the planner. */
float loop_position(const loop *joint);

#endif
