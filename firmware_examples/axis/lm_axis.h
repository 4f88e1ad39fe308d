/* One axis: the calls of a drive's firmware to the compensator, in the order of the table on the
 * page "Integration". */
#ifndef LM_AXIS_H
#define LM_AXIS_H

#include "lostmotion/runtime.h"

/* Standstill of the correction before the loop closes or the history is saved, s: three time
 * constants of a torque filter of 2 Hz. */
#define LM_AXIS_STAND_S 0.25f

typedef enum lm_axis_state {
  LM_AXIS_OFF = 0, /* not started */
  LM_AXIS_OPEN,    /* position loop open, brake on */
  LM_AXIS_CLOSED   /* the position loop follows the result of lm_axis_tick */
} lm_axis_state;

typedef struct lm_axis {
  lm_axis_state state;
  lm_compensator compensator;
  lm_correction correction; /* of this tick, with the rates for a feed-forward and the status */
  lm_standstill standstill;
  float stood_s;
  float zero_rad;    /* zero of the output angle, from homing */
  float command_rad; /* commanded output angle; while the loop is open, the reported one */
  int rang;          /* LM_STATE_RINGING was set while the loop was closed */
} lm_axis;

/* at: torque on the output, and whatever else the parameters need; motor_rad: motor angle / signed
 * ratio; kept: the history that lm_axis_power_down saved, or null. It is used up: write *kept back
 * to its memory before the loop closes, so that a later reset does not restore it again. If the
 * result is not LM_OK, the axis remains off. A measured torque: then lm_declare_torque_error. */
lm_status lm_axis_power_up(lm_axis *a, const lm_parameters *parameters, lm_saved *kept,
                           const lm_conditions *at, float motor_rad, lm_fault *fault);

/* Call in every tick. wish_rad: the output angle that the planner requests; used only while the
 * loop is closed, and starting at command_rad. Returns the position setpoint, motor angle / ratio.
 */
float lm_axis_tick(lm_axis *a, const lm_conditions *at, float motor_rad, float wish_rad);

/* After power-up and after a brake: closes the loop. Returns 0; returns 1 and leaves it open while
 * the correction has not stood for LM_AXIS_STAND_S: try again in the next tick. */
int lm_axis_close(lm_axis *a);

/* Brake or emergency stop: ticks continue, the command follows the output. */
void lm_axis_open(lm_axis *a);

/* Another mode, other parameters: the correction moves to its new target, and with it the output
 * if the loop is closed. If it is open, it closes after a standstill at the new target.
 * LM_MODE_RESET, then LM_MODE_RUN, ends the ringing. Results of lm_change_parameters. */
void lm_axis_set_mode(lm_axis *a, lm_mode mode);
lm_status lm_axis_change(lm_axis *a, const lm_parameters *parameters, lm_fault *fault);

/* States that the output is now at angle_rad, at rest or in motion. Nothing moves: the planner
 * continues from command_rad, which is shifted with the zero. Returns by how much the zero may be
 * wrong, rad. If that is too much, drive a load cycle and home again. Off: returns -1. */
float lm_axis_reference(lm_axis *a, float motor_rad, float angle_rad);

/* Saves the history. Returns 0; returns 1 and saves nothing while the loop is closed or the
 * correction has not stood for LM_AXIS_STAND_S. */
int lm_axis_power_down(lm_axis *a, lm_saved *kept);

/* Actual output angle. */
float lm_axis_reported(const lm_axis *a, float motor_rad);

#endif
