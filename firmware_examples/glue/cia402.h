/* A drive of CiA 402 (CANopen, EtherCAT) in mode CSP. The controller that sends its set points runs
 * lm_axis.h and lm_drive.h; this file translates both into process data.
 *
 *     object  to the drive                       object  from the drive
 *     0x6040  controlword                        0x6041  statusword
 *     0x607A  target position                    0x6064  position actual value
 *     0x60B0  position offset: correction        0x6061  modes of operation display
 *     0x60B1  velocity offset: rate of the correction
 *     0x60B2  torque offset, against the load
 *
 * The drive adds 0x60B0 to its position demand and 0x60B1 to its velocity demand, so the target
 * is the output angle, and the measured output angle is (0x6064 - 0x60B0) in increments. (If the
 * drive reports 0x6064 without the offset, set reports_offset to 0: before the drive is enabled for
 * the first time, with the brake on, send another 0x60B0; if 0x6064 changes, it does.) Where the
 * correction changes and the motor does not (a pause), the target follows within LM_AXIS_FEED_S:
 * no drive takes that for a motion. In other modes 0x60B0 is 0. Increments:
 * 0x608F encoder increments per motor turn times the gear's ratio over one turn of the output;
 * 0x6091 and 0x6092 are assumed to be 1. Velocity is in increments per second.
 *
 * An offset is an absolute number, rounded to the nearest increment: rounding errors do not
 * accumulate. Set points take effect one sync period after they were sent; the correction has the
 * same delay as its target. 0x60C2 is the sync period, which must equal the period of the
 * parameters.
 *
 * Mode: the host sets `mode` of cia402_axis. 0x6060 changes once the axis is paused and the torque
 * offset has ended. In the other mode the target follows the motor (from its display 0x6061 on;
 * until then overwrite out.target_position only while out.mode is the other mode); back in CSP the
 * motor is held until the correction stands. */
#ifndef CIA402_H
#define CIA402_H

#include "lm_drive.h"

/* 0x6041 & CIA402_STATE_MASK */
#define CIA402_STATE_MASK 0x6Fu
#define CIA402_READY 0x21u
#define CIA402_SWITCHED_ON 0x23u
#define CIA402_OPERATION_ENABLED 0x27u
#define CIA402_QUICK_STOP_ACTIVE 0x07u
#define CIA402_SWITCH_ON_DISABLED 0x40u
#define CIA402_FAULT 0x08u
#define CIA402_FAULT_MASK 0x08u /* set in FAULT and while the drive reacts to one */

#define CIA402_CSP 8           /* 0x6061 */
#define CIA402_FOLLOWS 0x1000u /* bit 12 in CSP */

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
  int32_t output_loop;   /* 1: the drive closes its position loop on an encoder at the output. Only
                          the velocity offset is sent, 0x60B0 remains 0 */
  int32_t derives_rate;  /* 1: the drive derives its velocity feed-forward from the position demand,
                           which has the rate already: 0x60B1 remains 0 */
  float opening_s;       /* of the brake, the longest, after OPERATION_ENABLED is reported */
  float rated_torque_Nm; /* 0x6076, of the motor, for 0x60B2; 0: that remains 0 */
  int32_t origin_inc; /* fixed origin within 5 turns of the output of every position, for an encoder
                          that counts further: a float would not resolve its increments. Store it
                          with the zero; otherwise 0 */
  int32_t ignores_bit12; /* 1: the drive does not report in bit 12 of 0x6041 that it follows */
} cia402_drive;

/* Process data of one cycle. */
typedef struct cia402_output {
  uint16_t controlword;    /* 0x6040 */
  int32_t target_position; /* 0x607A */
  int32_t position_offset; /* 0x60B0 */
  int32_t velocity_offset; /* 0x60B1: rate of the correction, without that of the target */
  int8_t mode;             /* 0x6060 */
  int16_t torque_offset;   /* 0x60B2, 0.1 % of the rated torque */
} cia402_output;

typedef struct cia402_input {
  uint16_t statusword;     /* 0x6041 */
  int32_t position_actual; /* 0x6064 */
  int32_t valid;           /* 1: of this cycle; 0: lost (working counter, bus) */
  int32_t mode;            /* 0x6061 */
} cia402_input;

typedef struct cia402_axis {
  lm_axis axis; /* for the functions of lm_axis.h */
  lm_drive drive;
  cia402_drive values;
  int8_t mode;              /* 0x6060 that the host wants instead of CSP; 0: CSP */
  float increments_per_rad; /* of the output, signed */
  int32_t mode_seen;        /* last 0x6061 */
  float correction_rad;     /* limit of the parameters */
  float offset_rad;         /* sent as 0x60B0 */
  float owed_rad;           /* correction that is still in the target */
  int32_t moves;            /* the motor moves with the correction */
  int32_t demand_inc;       /* of the motor: target and offset */
  int32_t motor_inc;        /* last position */
  uint16_t statusword;
  float rest_s;     /* for which the motor has been at rest, the drive not enabled */
  int32_t rest_inc; /* where */
  cia402_output sent;
} cia402_axis;

/* Power-up: the drive is not enabled and has reported its position. Checks the parameters,
 * and that the sync period is theirs. kept, at: as lm_axis_power_up.
 * LM_OUT_OF_RANGE ("increments_per_rev", "ratio", "period_exponent",
 * "motor_rad": beyond LM_AXIS_ANGLE_MAX_RAD from the origin), LM_INCONSISTENT
 * ("period_s"; "valid": the input is not; "statusword": the drive is enabled: cia402_cycle
 * sends quick stop until it is not), those of lm_axis_power_up. */
lm_status cia402_start(cia402_axis *c, const cia402_drive *values, const lm_parameters *parameters,
                       lm_axis_kept *kept, const lm_conditions *at, const cia402_input *in,
                       lm_fault *fault);

/* One sync period, as lm_drive_step and lm_axis_tick: `run` and `wish_rad`. Before it, in every
 * state of the drive, one of the functions lm_axis_use_... for at->torque_Nm. With run 0 the drive
 * makes a quick stop and is switched off (0x605A = 2; with 5 to 8 once the motor has been at rest
 * for LM_AXIS_STAND); it closes its brake. in->valid 0 for more than LM_FOLLOW_LOST_TICKS: the
 * demand stays, also when the bus returns. A fault of the drive is reset by the host. */
cia402_output cia402_cycle(cia402_axis *c, const cia402_input *in, const lm_conditions *at,
                           float wish_rad, int32_t run);

/* motor_rad for lm_axis.h: of the input of this cycle, LM_UNKNOWN if it is not valid. cia402_angle:
 * before the start, at the output, of a position of the motor without an offset. */
float cia402_motor(const cia402_axis *c, const cia402_input *in);
float cia402_angle(const cia402_drive *values, int32_t motor_inc);

/* The same for a position that the drive has latched in this cycle (0x60BA to 0x60BD). */
float cia402_latched(const cia402_axis *c, int32_t latch_inc);

#endif
