/* One axis in the right order: what a drive's firmware does round the compensator, and no more.
 *
 *     axis_power_up     off -> open       start, take up the history, settle
 *     axis_close        open -> closed    the command begins where the output is
 *     axis_tick         in every state    the memory sees the load
 *     axis_brake        any -> braked     brake and emergency stop in the same way
 *     axis_home         closed            hold the correction; axis_reference once it stands
 *     axis_power_down   braked -> off     save
 *
 * The projects in ../projects build it with CMake, make, PlatformIO, Arduino, Zephyr and ESP-IDF.
 */
#ifndef AXIS_H
#define AXIS_H

#include "lostmotion/runtime.h"

typedef enum axis_state {
  AXIS_OFF = 0,
  AXIS_OPEN,   /* powered, the position loop open, the motor braked or off */
  AXIS_CLOSED, /* the position loop follows axis_tick's answer */
  AXIS_HOMING, /* as closed, the correction held */
  AXIS_BRAKED
} axis_state;

typedef struct axis {
  axis_state state;
  lm_compensator compensator;
  lm_correction correction;
  float zero_rad;    /* of the output angle, by homing */
  float command_rad; /* where the output is told to be; where it is while the loop is open */
} axis;

/* With the torque that the gear bears and the motor's angle over the ratio. kept: the history that
 * axis_power_down saved, or null; refused where nothing was saved. Anything but LM_OK: do not
 * close the loop. */
lm_status axis_power_up(axis *a, const lm_parameters *parameters, const lm_saved *kept,
                        float torque_Nm, float motor_rad, lm_fault *fault);

/* Every tick. wish_rad: where the output is to be, from the planner; read in the states closed and
 * homing alone, and to begin at command_rad. Returns the motor's angle over the ratio for the
 * position loop. */
float axis_tick(axis *a, float torque_Nm, float motor_rad, float wish_rad);

/* Closes the loop: after power-up, and after a brake once the load stands. Returns 0, or 1 where
 * the compensator is not started: the loop stays open. */
int axis_close(axis *a);

/* Brake or emergency stop: ticks go on, the command follows the output. */
void axis_brake(axis *a);

/* Homing: the correction goes on to its target and rests there. */
void axis_home(axis *a);

/* The output stands at angle_rad. Returns 0 and goes on closed; 1: not homing, the correction does
 * not yet rest, or the history is not known (then drive a load cycle first). */
int axis_reference(axis *a, float motor_rad, float angle_rad);

/* The brake is on and the load stands. */
void axis_power_down(axis *a, lm_saved *kept);

/* Where the output is. */
float axis_reported(const axis *a, float motor_rad);

#endif
