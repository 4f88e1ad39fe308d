/* One axis: the calls of a drive's firmware to the compensator, in the right order.
 *
 *     axis_power_up     off -> open       start, restore the load history, settle
 *     axis_close        open -> closed    the command starts at the output angle
 *     axis_tick         in every state    the model receives the whole load history
 *     axis_brake        any -> braked     brake or emergency stop
 *     axis_home         closed            hold the correction; axis_reference once it is at rest
 *     axis_power_down   braked -> off     save the load history
 *
 * The projects in ../projects build it with CMake, make, PlatformIO, Arduino, Zephyr and ESP-IDF.
 */
#ifndef AXIS_H
#define AXIS_H

#include "lostmotion/runtime.h"

typedef enum axis_state {
  AXIS_OFF = 0,
  AXIS_OPEN,   /* powered, position loop open, motor braked or off */
  AXIS_CLOSED, /* the position loop follows the result of axis_tick */
  AXIS_HOMING, /* as AXIS_CLOSED, with the correction held */
  AXIS_BRAKED
} axis_state;

typedef struct axis {
  axis_state state;
  lm_compensator compensator;
  lm_correction correction;
  float zero_rad;    /* zero of the output angle, from homing */
  float command_rad; /* commanded output angle; the actual one while the loop is open */
} axis;

/* torque_Nm: the torque on the output; motor_rad: motor angle / ratio; kept: the history that
 * axis_power_down saved, or null. A history that was never saved is ignored. If the result is not
 * LM_OK, do not close the loop. */
lm_status axis_power_up(axis *a, const lm_parameters *parameters, const lm_saved *kept,
                        float torque_Nm, float motor_rad, lm_fault *fault);

/* Call in every tick. wish_rad: the output angle that the planner asks for, used only in the states
 * closed and homing; it must start at command_rad. Returns motor angle / ratio for the position
 * loop. */
float axis_tick(axis *a, float torque_Nm, float motor_rad, float wish_rad);

/* Closes the loop after power-up, or after braking once the load is at rest. Returns 0; returns 1
 * and leaves the loop open if the compensator is not started. */
int axis_close(axis *a);

/* Brake or emergency stop: ticks continue, the command follows the output. */
void axis_brake(axis *a);

/* Homing: the correction moves to its target and stops there. */
void axis_home(axis *a);

/* States that the output is at angle_rad. Returns 0 and continues closed. Returns 1 if the axis is
 * not homing, the correction is still moving, or the load history is unknown (then drive a load
 * cycle first). */
int axis_reference(axis *a, float motor_rad, float angle_rad);

/* Call it with the brake on and the load at rest. */
void axis_power_down(axis *a, lm_saved *kept);

/* Actual output angle. */
float axis_reported(const axis *a, float motor_rad);

#endif
