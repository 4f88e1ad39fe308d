/* One axis: the calls of a drive's firmware to the compensator, in the order of the table on the
 * page "Integration". */
#ifndef LM_AXIS_H
#define LM_AXIS_H

#include "lostmotion/runtime.h"

/* Standstill of the correction before the loop closes or the history is saved, in units of
 * 1 / response_per_s: seven time constants of a torque filter at a tenth of the resonance for which
 * the parameters were exported (1.1 s at 10 Hz, 0.45 s at 25 Hz). A slower filter: more. */
#define LM_AXIS_STAND 28.0f

/* Motion of the braked motor in that time, at the output: more than an encoder's noise. */
#define LM_AXIS_STILL_RAD 1e-4f

typedef enum lm_axis_state {
  LM_AXIS_OFF = 0, /* not started */
  LM_AXIS_OPEN,    /* position loop open, brake on */
  LM_AXIS_HELD,    /* position loop closed on a setpoint that stays; the command follows */
  LM_AXIS_CLOSED   /* the position loop follows the planner and the correction */
} lm_axis_state;

typedef struct lm_axis {
  lm_axis_state state;
  lm_compensator compensator;
  lm_correction correction; /* of this tick, with the status and the rates for a feed-forward, which
                               are 0 unless LM_AXIS_CLOSED */
  lm_standstill standstill;
  float stand_s; /* LM_AXIS_STAND, in seconds */
  float stood_s;
  float stood_at_rad; /* of the motor, with the loop open */
  float zero_rad;     /* zero of the output angle, from homing */
  float setpoint_rad; /* last one, motor angle / ratio */
  float command_rad;  /* commanded output angle; while the loop is open, the reported one */
  lm_mode mode;
  int rang; /* LM_STATE_RINGING was set while the loop was closed */
} lm_axis;

/* at: torque on the output, and whatever else the parameters need; motor_rad, here and below: motor
 * angle / signed ratio; kept: the history that lm_axis_power_down saved, or null. It is used up:
 * write *kept back to its memory before the loop closes, so that a later reset does not restore it
 * again. The zero is 0 (lm_axis_set_zero), and the planner starts at command_rad. If the result is
 * not LM_OK, the axis remains off. A measured torque: then lm_declare_torque_error. */
lm_status lm_axis_power_up(lm_axis *a, const lm_parameters *parameters, lm_saved *kept,
                           const lm_conditions *at, float motor_rad, lm_fault *fault);

/* Call in every tick. wish_rad: the output angle that the planner requests; used only in
 * LM_AXIS_CLOSED, and starting at command_rad. Returns the position setpoint, motor angle / ratio;
 * in LM_AXIS_OPEN this is the measured angle, which holds nothing. An angle that is not finite is
 * replaced by the one before. */
float lm_axis_tick(lm_axis *a, const lm_conditions *at, float motor_rad, float wish_rad);

/* After power-up, a brake or lm_axis_hold: LM_AXIS_CLOSED, nothing moves. Call it when the drive is
 * enabled in its position loop, before the brake is released. Returns 0; returns 1 and changes
 * nothing while the correction, and the motor behind the brake, have not stood for LM_AXIS_STAND,
 * or a condition was missing or not finite meanwhile: try again in the next tick. The planner
 * starts at command_rad. Until the position loop bears the load, it yields by its own error: feed
 * the load forward. */
int lm_axis_close(lm_axis *a);

/* When the brake bears the load, and at once when the drive leaves its position loop by itself
 * (fault, safe torque off) or for another mode. Not when the brake begins to close: until it bears
 * the load the position loop has to stop and to hold it. Ticks continue, the command follows. */
void lm_axis_open(lm_axis *a);

/* Holds the motor at its setpoint (LM_AXIS_HELD), for whatever moves the correction although the
 * load does not: a mode, parameters, another source of the torque, an input angle that becomes
 * known. The planner is at rest. Make the change between this call and the next tick, then call
 * lm_axis_close until it returns 0. With the loop open only the standstill begins again. */
void lm_axis_hold(lm_axis *a);

/* Another mode, other parameters: the correction moves to its new target. In LM_AXIS_CLOSED the
 * output moves with it, within the limits of the parameters; in the other states it does not move.
 * LM_MODE_RESET, then LM_MODE_RUN, ends the ringing. Results of lm_change_parameters. */
void lm_axis_set_mode(lm_axis *a, lm_mode mode);
lm_status lm_axis_change(lm_axis *a, const lm_parameters *parameters, lm_fault *fault);

/* States that the output is now at angle_rad, at rest or in motion. Nothing moves if the planner
 * continues from command_rad, which is shifted with the zero, and the shift changes neither a
 * torque that is computed from the angle (gravity, moved_rad of lm_guess_torque) nor a velocity
 * that is the difference of commands. Returns by how much the zero may be wrong, rad, if the torque
 * is right: an error of the torque adds its own wind-up. If that is too much, drive a load cycle
 * and home again. Off, or an angle that is not finite: returns -1 and
 * changes nothing. */
float lm_axis_reference(lm_axis *a, float motor_rad, float angle_rad);

/* A stored zero_rad of an absolute encoder, in any state after lm_axis_power_up. Nothing moves, as
 * with lm_axis_reference. */
void lm_axis_set_zero(lm_axis *a, float zero_rad);

/* Saves the history. Returns 0; returns 1 and saves nothing while the loop is closed or the
 * correction has not stood for LM_AXIS_STAND. */
int lm_axis_power_down(lm_axis *a, lm_saved *kept);

/* Actual output angle. */
float lm_axis_reported(const lm_axis *a, float motor_rad);

#endif
