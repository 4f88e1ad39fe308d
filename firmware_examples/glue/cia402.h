/* A drive of CiA 402 (CANopen, EtherCAT) in mode CSP: the controller that sends its set points
 * runs the compensator and sends the correction in the offset objects.
 *
 *     object  to the drive                       object  from the drive
 *     0x6040  controlword                        0x6041  statusword
 *     0x607A  target position                    0x6064  position actual value
 *     0x60B0  position offset: correction
 *     0x60B1  velocity offset: rate of the correction
 *
 * The drive adds 0x60B0 to its position demand and 0x60B1 to its velocity demand, so the target
 * is the output angle, and the measured output angle is (0x6064 - 0x60B0) in increments. (If the
 * drive reports 0x6064 without the offset, set reports_offset to 0: before the drive is enabled for
 * the first time, with the brake on, send another 0x60B0; if 0x6064 changes, it does.) Increments:
 * 0x608F encoder increments per motor turn times the gear's ratio over one turn of the output;
 * 0x6091 and 0x6092 are assumed to be 1. Velocity is in increments per second.
 *
 * An offset is an absolute number, rounded to the nearest increment: rounding errors do not
 * accumulate. Set points take effect one sync period after they were sent; the correction has the
 * same delay as its target.
 *
 *     0x6060  modes of operation                 0x6061  its display
 *
 * Mode: 0x6060 = 8 (CSP) before the drive is enabled; 0x60C2 is the sync period, which must equal
 * the period of the parameters. In modes PP, HM and CSV drives ignore 0x60B0 or add it
 * differently: keep the compensator in LM_MODE_HOLD (cia402_set_mode) while the drive homes itself
 * (mode HM). Then, while it is disabled, LM_MODE_RUN and cia402_reference; enable it in CSP. While
 * 0x6061 is not 8 the drive is not enabled, or the target follows the output; back in CSP the motor
 * is held until the correction stands, and the planner starts at command_rad.
 */
#ifndef CIA402_H
#define CIA402_H

#include "lm_follow.h"

/* 0x6041 & CIA402_STATE_MASK */
#define CIA402_STATE_MASK 0x6Fu
#define CIA402_READY 0x21u
#define CIA402_SWITCHED_ON 0x23u
#define CIA402_OPERATION_ENABLED 0x27u
#define CIA402_QUICK_STOP_ACTIVE 0x07u
#define CIA402_SWITCH_ON_DISABLED 0x40u
#define CIA402_FAULT 0x08u
#define CIA402_FAULT_MASK 0x08u /* set in FAULT and while the drive reacts to one */

#define CIA402_CSP 8 /* 0x6061 */

/* 0x6040 */
#define CIA402_SHUTDOWN 0x06u
#define CIA402_SWITCH_ON 0x07u
#define CIA402_ENABLE 0x0Fu
#define CIA402_QUICK_STOP 0x02u
#define CIA402_DISABLE_VOLTAGE 0x00u
#define CIA402_FAULT_RESET 0x80u

/* Configuration of the drive. */
typedef struct cia402_drive {
  uint32_t increments_per_rev; /* 0x608F, of the motor, at least 1; output_loop: of the encoder at
                                  the output */
  float ratio;                 /* signed: motor turns per output turn; output_loop: 1, or -1 */
  uint8_t period_value;        /* 0x60C2:01 */
  int8_t period_exponent;      /* 0x60C2:02, -6 to 0: seconds are value * 10^exponent */
  int32_t reports_offset;      /* 1: 0x6064 is the motor's encoder, offset included; 0: the drive
                                  has subtracted 0x60B0 */
  int32_t output_loop;  /* 1: the drive closes its position loop on an encoder at the output. Only
                          the velocity offset is sent, 0x60B0 remains 0 */
  int32_t derives_rate; /* 1: the drive derives its velocity feed-forward from the position demand,
                           which has the rate already: 0x60B1 remains 0 */
  float opening_s; /* of the brake, if it opens after OPERATION_ENABLED is reported; otherwise 0 */
  int32_t origin_inc; /* fixed origin within 5 turns of the output of every position, for an encoder
                          that counts further: a float would not resolve its increments. Store it
                          with the zero; otherwise 0 */
} cia402_drive;

/* 5 turns of the output: one step of binary32 is 2e-6 rad (0.4 arcsec) there. */
#define CIA402_ANGLE_MAX_RAD 32.0f

/* Process data of one cycle. */
typedef struct cia402_output {
  uint16_t controlword;
  int32_t target_position;
  int32_t position_offset;
  int32_t velocity_offset;
} cia402_output;

typedef struct cia402_input {
  uint16_t statusword;
  int32_t position_actual;
  int32_t valid; /* 1: of this cycle; 0: lost (working counter, bus) */
  int32_t mode;  /* 0x6061 */
} cia402_input;

typedef struct cia402_axis {
  cia402_drive drive;
  lm_compensator compensator;
  lm_correction correction;
  float increments_per_rad; /* of the output, signed */
  float zero_rad;           /* output angle at the origin, from homing */
  float command_rad;        /* commanded output angle; the reported angle while the loop is open */
  lm_standstill standstill; /* of the correction */
  float stood_s;
  lm_follow follow;  /* of the planner, with period and CIA402_STAND in seconds */
  float rest_s;      /* for which the motor has been at rest, the drive not enabled */
  int32_t rest_inc;  /* where */
  int32_t saved;     /* cia402_power_down */
  cia402_input last; /* valid one */
  int32_t lost_cycles;
  int32_t operated; /* OPERATION_ENABLED in that cycle, in any mode */
  int32_t enabled;  /* in CSP */
  float enabled_s;
  int32_t tripped; /* disabled by itself, or not enabled in CIA402_ENABLING_S: not enabled until
                       enable has been 0 */
  float enabling_s;
  lm_mode mode;
  int32_t rang;          /* LM_STATE_RINGING was set while the drive was enabled */
  int32_t joined;        /* the planner has begun at command_rad */
  int32_t held;          /* cia402_pause */
  int32_t held_inc;      /* demand of the motor meanwhile: target and offset */
  int32_t moves_alone;   /* the correction moves to a new target, the load does not */
  uint32_t moving_state; /* bits of the last cycle that change the target */
  cia402_output sent;
} cia402_axis;

/* Power-up: the drive is not enabled and has reported its position. Checks the parameters, and that
 * the sync period is theirs. A stored zero: cia402_set_zero. kept: the history of the last
 * power-down, or null. It is used up: write *kept back to its memory before the drive is enabled,
 * so that a later reset does not restore it again. LM_OUT_OF_RANGE ("increments_per_rev", "ratio",
 * "period_exponent", "position_actual": beyond CIA402_ANGLE_MAX_RAD from the origin),
 * LM_INCONSISTENT ("period_s"; "valid": the input is not; "statusword": the drive is enabled),
 * those of lm_start_compensator. */
lm_status cia402_start(cia402_axis *axis, const cia402_drive *drive,
                       const lm_parameters *parameters, lm_saved *kept, const lm_conditions *at,
                       const cia402_input *in, lm_fault *fault);

/* Standstill of correction and motor before the drive is enabled or the history is saved, in units
 * of 1 / response_per_s: seven time constants of a torque filter at a tenth of the resonance for
 * which the parameters were exported. A slower filter: more. */
#define CIA402_STAND 28.0f

/* A drive that is not enabled within this time has a reason, such as safe torque off: the command
 * has expired, so that the drive does not start by itself when that ends. */
#define CIA402_ENABLING_S 5.0f

/* Motion of a motor at rest in that time, at the output: more than an encoder's noise. */
#define CIA402_STILL_RAD 1e-4f

/* One sync period. wish_rad: the desired output angle. Until statusword reports OPERATION_ENABLED
 * it is not used, and the planner starts at command_rad of the cycle before, which follows the
 * output; the target stays there until wish_rad has been there for LM_FOLLOW_REST_S (lm_follow.h).
 * A wish_rad that steps, or is missing (not finite) for more than LM_FOLLOW_LOST_TICKS, is not
 * followed: the target stays until the planner starts at command_rad anew. enable 0: the target
 * stays, quick stop, then switched off (0x605A = 2; with 5 to 8 once the motor has been at rest for
 * CIA402_STAND; the drive closes the brake); 1: the drive is enabled once correction and motor have
 * stood for CIA402_STAND, an output_loop once the motor has and no condition is missing; after a
 * fault, if it was disabled otherwise or was not enabled within CIA402_ENABLING_S, not before
 * enable has been 0 (tripped). Steps the compensator in every state of the drive.
 *
 * in->valid 0 for more than LM_FOLLOW_LOST_TICKS: the demand stays, as after cia402_pause; the
 * same when the bus returns. */
cia402_output cia402_cycle(cia402_axis *axis, const cia402_input *in, const lm_conditions *at,
                           float wish_rad, int32_t enable);

/* Holds the motor at its demand (lm_axis_pause), for whatever moves the correction although the
 * load does not: another source of the torque, an input that becomes known. Make the change before
 * the next cycle. Target plus offset then stays, and command_rad follows the offset, until the
 * correction has stood for CIA402_STAND (held); after that the planner starts at command_rad, as
 * after enabling. Returns 1, and does nothing, until the planner has been at rest for
 * LM_FOLLOW_REST_S. With an output_loop the motor is not held: the loop holds the output, and the
 * velocity offset is 0 until the correction stands again. */
int32_t cia402_pause(cia402_axis *axis);

/* Another mode, other parameters. While the drive is enabled they pause first (not for
 * LM_MODE_HOLD), so that nothing moves, and are refused while the planner moves: 1; LM_INCONSISTENT
 * ("wish_rad"). Otherwise 0; the results of lm_change_parameters. LM_MODE_RESET and in the same
 * cycle LM_MODE_RUN end the ringing. */
int32_t cia402_set_mode(cia402_axis *axis, lm_mode mode);
lm_status cia402_change(cia402_axis *axis, const lm_parameters *parameters, lm_fault *fault);

/* Output angle as reported to the planner. */
float cia402_reported(const cia402_axis *axis, const cia402_input *in);

/* Homing: the output is now at angle_rad. command_rad shifts with the zero, the planner with it or
 * some cycles later, with every sample that an interpolator holds: a wish on the way from the old
 * to the shifted one is not followed, and the planner begins anew at command_rad. Nothing moves if
 * the torque does not depend on the angle. If it does (gravity): while the drive is disabled, or at
 * rest with cia402_pause before it. Returns by how much the zero may be wrong, rad, if the torque
 * is right; -1, and changes nothing, if an angle is not finite or the input not valid. */
float cia402_reference(cia402_axis *axis, const cia402_input *in, float angle_rad);

/* A stored zero_rad of an absolute encoder, after cia402_start; ignored if it is not finite.
 * Nothing moves if the planner continues from command_rad. */
void cia402_set_zero(cia402_axis *axis, float zero_rad);

/* Saves the history. Returns 0, and cia402_cycle enables the drive no more; returns 1 and saves
 * nothing while the drive is enabled, or correction and motor have not stood for CIA402_STAND: try
 * again in the next cycle. */
int32_t cia402_power_down(cia402_axis *axis, lm_saved *kept);

#endif
