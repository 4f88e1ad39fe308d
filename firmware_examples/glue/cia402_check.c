/* A minimal CSP drive and the cycles of an axis in their usual sequence: the exit code
 * of `check_cia402` is the number of the first check that fails. */
#include "checks.h"
#include "cia402.h"
#include "params.h"

#define PERIOD_S 5e-4f
#define LOAD_NM (-12.0f)
#define INCREMENTS 131072u
#define RATIO (-100.0f)
#define RATED_NM 0.5f
#define ORIGIN 1200000000                       /* 90 turns of the output */
#define RAD (131072.0f * -100.0f / 6.28318531f) /* increments */
#define STAND_CYCLES 620 /* LM_AXIS_STAND, the states of the drive, its brake */
#define SWING_NM 10.0f   /* of the arm against the brake, at 20 Hz */
#define SWING_CYCLES 50
#define MODE_CYCLES 2200 /* LM_AXIS_FEED_S, of 60 N m, for FED_NM */
#define FED_NM (LOAD_NM / 10)
#define STEP_RAD 5e-7f /* a motor that is enabled, braked or off moves by less: one increment */

typedef struct csp_drive {
  uint16_t status;
  int32_t mode;      /* 0x6061 */
  int32_t motor;     /* increments */
  int32_t apart_inc; /* in another mode */
  int halts;         /* it does not follow, and reports so in bit 12 */
  int subtracts;     /* reports_offset 0: the offset of CSP, which other modes do not have */
  int stays_there;   /* 0x605A = 5: after the stop the drive holds its position */
} csp_drive;

/* One cycle of the drive: its states, and the motor at the demand while it is enabled. */
static void run_drive(csp_drive *drive, const cia402_output *out) {
  switch (out->controlword) {
    case CIA402_ENABLE:
      drive->status =
          drive->status == CIA402_SWITCHED_ON ? CIA402_OPERATION_ENABLED : drive->status;
      break;
    case CIA402_SWITCH_ON:
      drive->status = drive->status == CIA402_READY ? CIA402_SWITCHED_ON : drive->status;
      break;
    case CIA402_SHUTDOWN:
      drive->status = CIA402_READY;
      break;
    case CIA402_QUICK_STOP:
      /* Stops at once, and the brake closes. */
      drive->status = drive->stays_there ? CIA402_QUICK_STOP_ACTIVE : CIA402_SWITCH_ON_DISABLED;
      break;
    case CIA402_DISABLE_VOLTAGE:
      drive->status = CIA402_SWITCH_ON_DISABLED;
      break;
    default:
      break;
  }
  if (drive->status == CIA402_OPERATION_ENABLED) {
    drive->motor = drive->halts                ? drive->motor
                   : drive->mode == CIA402_CSP ? out->target_position + out->position_offset
                                               : drive->motor + drive->apart_inc;
  }
}

typedef struct cell {
  cia402_axis cia;
  csp_drive drive;
  lm_memory gear;
  float largest_rad; /* greatest step of the motor from cycle to cycle */
} cell;

static int is_closed(const cell *c) {
  return c->cia.axis.state == LM_AXIS_CLOSED;
}

/* The correction has not stood yet. */
static int is_held(const cell *c) {
  return c->cia.axis.state == LM_AXIS_PAUSED && c->cia.axis.waits != LM_AXIS_WAITS_PLANNER;
}

static float reported(const cia402_axis *cia, const cia402_input *in) {
  return lm_axis_reported(&cia->axis, cia402_motor(cia, in));
}

static float reference(cia402_axis *cia, const cia402_input *in, float angle_rad) {
  return lm_axis_reference(&cia->axis, cia402_motor(cia, in), angle_rad);
}

static cia402_input read_drive(const cell *c) {
  cia402_input in;
  in.statusword = (uint16_t)(c->drive.status | (c->drive.halts ? 0 : CIA402_FOLLOWS));
  in.position_actual =
      c->drive.motor -
      (c->drive.subtracts && c->drive.mode == CIA402_CSP ? c->cia.sent.position_offset : 0);
  in.valid = 1;
  in.mode = c->drive.mode;
  return in;
}

static float output_of(cell *c, float torque_Nm) {
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  at.torque_Nm = torque_Nm;
  return (float)(c->drive.motor - ORIGIN) / RAD + lm_step_model(&joint_parameters, &c->gear, &at);
}

static void cycles(cell *c, int n, float torque_Nm, float *wish_rad, float rate_rad, int enable) {
  for (; n > 0; --n) {
    lm_conditions at = LM_CONDITIONS_UNKNOWN;
    cia402_input in = read_drive(c);
    cia402_output out;
    int32_t before = c->drive.motor;
    float moved_rad;
    at.torque_Nm = torque_Nm;
    *wish_rad += rate_rad;
    out = cia402_cycle(&c->cia, &in, &at, *wish_rad, enable);
    run_drive(&c->drive, &out);
    moved_rad = (float)(c->drive.motor - before) / RAD;
    moved_rad = moved_rad < 0 ? -moved_rad : moved_rad;
    c->largest_rad = moved_rad > c->largest_rad ? moved_rad : c->largest_rad;
    (void)output_of(c, torque_Nm);
    if (enable == 0 || c->drive.status != CIA402_OPERATION_ENABLED) {
      *wish_rad = c->cia.axis.command_rad; /* the planner starts at the reported angle */
    }
  }
}

/* A mode or other parameters with the motor held: nothing moves, at any time, nor does the target,
 * of which a drive may derive its velocity feed-forward. */
static int check_hold(cell *c, float *wish_rad) {
  static lm_parameters smaller;
  const int32_t motor = c->drive.motor;
  int32_t target;
  int k;
  smaller = joint_parameters;
  smaller.limits.correction_rad *= 0.1f;
  for (k = 0; k < 4; ++k) {
    target = c->cia.sent.target_position;
    if (k < 2) {
      (void)lm_axis_set_mode(&c->cia.axis, k == 0 ? LM_MODE_RESET : LM_MODE_RUN);
    } else if (lm_axis_change(&c->cia.axis, k == 2 ? &smaller : &joint_parameters, 0) != LM_OK) {
      return 14;
    }
    cycles(c, 20, LOAD_NM, wish_rad, 0, 1);
    target -= c->cia.sent.target_position;
    if (target > 3 || target < -3) {
      return 51;
    }
    if (!is_held(c) || c->cia.sent.velocity_offset != 0 || c->cia.axis.follow.rested_s > 0) {
      return 15;
    }
    cycles(c, 2 * STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
    if (is_held(c)) {
      return 16;
    }
    *wish_rad = c->cia.axis.command_rad;
    cycles(c, STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
    if (c->drive.motor < motor - 1 || c->drive.motor > motor + 1) {
      return 17;
    }
  }
  return 0;
}

/* Enable 0 in motion: the target does not go back by the following error. A drive that stays in its
 * quick stop is switched off once the motor is at rest. */
static int check_stop(cell *c, float *wish_rad) {
  const int32_t lag = 2000;
  cia402_input in;
  cia402_output out;
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  int32_t before;
  at.torque_Nm = LOAD_NM;
  cycles(c, 100, LOAD_NM, wish_rad, 5e-4f, 1);
  before = c->cia.sent.target_position;
  in = read_drive(c);
  in.position_actual += lag; /* RATIO is negative */
  out = cia402_cycle(&c->cia, &in, &at, *wish_rad, 0);
  if (out.controlword != CIA402_QUICK_STOP || out.target_position != before) {
    return 24;
  }
  c->drive.stays_there = 1;
  run_drive(&c->drive, &out);
  cycles(c, 20, LOAD_NM, wish_rad, 0, 0);
  if (c->drive.status != CIA402_QUICK_STOP_ACTIVE) {
    return 25; /* the motor may still turn */
  }
  cycles(c, STAND_CYCLES, LOAD_NM, wish_rad, 0, 0);
  if (c->drive.status != CIA402_SWITCH_ON_DISABLED) {
    return 25;
  }
  cycles(c, STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
  c->drive.stays_there = 0;
  return c->drive.status == CIA402_OPERATION_ENABLED ? 0 : 25;
}

/* The brake slips: the drive is not enabled, the history is not saved. */
static int check_slip(cell *c, float *wish_rad, lm_axis_kept *kept) {
  int k;
  if (!lm_drive_power_down(&c->cia.drive, &c->cia.axis, kept)) {
    return 26; /* enabled */
  }
  cycles(c, 1, LOAD_NM, wish_rad, 0, 0);
  for (k = 0; k < 2 * STAND_CYCLES; ++k) {
    c->drive.motor += 10;
    cycles(c, 1, LOAD_NM, wish_rad, 0, k > STAND_CYCLES);
  }
  return c->drive.status != CIA402_OPERATION_ENABLED &&
                 lm_drive_power_down(&c->cia.drive, &c->cia.axis, kept)
             ? 0
             : 26;
}

static float not_a_number(void) {
  volatile float none = 0;
  return none / none;
}

/* A wish, a latch or a zero that is not finite: nothing moves, and the zero remains. */
static int check_not_finite(cell *c, float *wish_rad) {
  float no_number = not_a_number();
  const float zero_rad = c->cia.axis.zero_rad;
  const cia402_input in = read_drive(c);
  c->largest_rad = 0;
  cycles(c, STAND_CYCLES, LOAD_NM, &no_number, 0, 1);
  if (reference(&c->cia, &in, no_number) >= 0) {
    return 21;
  }
  cycles(c, STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
  return c->largest_rad > STEP_RAD || c->cia.axis.zero_rad < zero_rad ||
                 c->cia.axis.zero_rad > zero_rad
             ? 21
             : 0;
}

/* The planner shifts three cycles after the zero, and does not begin at the command: no jump. */
static int check_planner(cell *c, float *wish_rad) {
  const float rate_rad = 5e-4f;
  const float shift_rad = 0.7f;
  float elsewhere_rad;
  int32_t motor;
  int k;
  cia402_input in;
  cycles(c, 10, LOAD_NM, wish_rad, rate_rad, 1);
  in = read_drive(c);
  (void)reference(&c->cia, &in, reported(&c->cia, &in) + shift_rad);
  c->largest_rad = 0;
  for (k = 0; k < 10; ++k) {
    *wish_rad += k == 3 ? shift_rad : 0;
    cycles(c, 1, LOAD_NM, wish_rad, rate_rad, 1);
  }
  if (c->largest_rad > 1.1f * rate_rad || c->cia.axis.follow.late_rad > 0 || !is_closed(c)) {
    return 28;
  }
  cycles(c, 50, LOAD_NM, wish_rad, 0, 1);
  motor = c->drive.motor;
  lm_axis_pause(&c->cia.axis);
  elsewhere_rad = *wish_rad + 1;
  cycles(c, 2 * STAND_CYCLES, LOAD_NM, &elsewhere_rad, 0, 1);
  if (is_held(c) || is_closed(c) || c->drive.motor < motor - 1 || c->drive.motor > motor + 1) {
    return 29;
  }
  *wish_rad = c->cia.axis.command_rad;
  cycles(c, 50, LOAD_NM, wish_rad, 0, 1);
  return is_closed(c) ? 0 : 29;
}

/* After a fault or a trip the drive is enabled by a new command alone. */
static int check_trip(cell *c, float *wish_rad) {
  const uint16_t trip[] = {CIA402_FAULT, CIA402_SWITCH_ON_DISABLED};
  int k;
  for (k = 0; k < 2; ++k) { /* a fault while disabled, reset by the host; safe torque off */
    cycles(c, 2, LOAD_NM, wish_rad, 0, k);
    c->drive.status = trip[k];
    cycles(c, 1, LOAD_NM, wish_rad, 0, 1);
    c->drive.status = CIA402_SWITCH_ON_DISABLED;
    cycles(c, 2 * STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
    if (c->drive.status != CIA402_SWITCH_ON_DISABLED) {
      return 30;
    }
    cycles(c, 1, LOAD_NM, wish_rad, 0, 0);
    cycles(c, STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
    if (c->drive.status != CIA402_OPERATION_ENABLED) {
      return 30;
    }
  }
  return 0;
}

/* The bus is lost in motion, and returns: the demand stays, although the planner went on. After a
 * long time it is where the drive has stopped. */
static int check_bus(cell *c, float *wish_rad) {
  const lm_conditions none = LM_CONDITIONS_UNKNOWN;
  int32_t motor;
  int k;
  cycles(c, 100, LOAD_NM, wish_rad, 5e-4f, 1);
  motor = c->drive.motor;
  for (k = 0; k < 40; ++k) {
    const cia402_input in = {0, 0, 0, 0};
    *wish_rad += 5e-4f;
    (void)cia402_cycle(&c->cia, &in, &none, *wish_rad, 1);
    if (reference(&c->cia, &in, 0) >= 0 ||
        is_held(c) != (k >= LM_FOLLOW_LOST_TICKS)) { /* as usual drives tolerate */
      return 31;
    }
  }
  motor += (int32_t)((float)LM_FOLLOW_LOST_TICKS * 5e-4f * RAD);
  cycles(c, 1, LOAD_NM, wish_rad, 0, 1);
  if (!is_held(c)) {
    return 31;
  }
  cycles(c, 2 * STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
  if (is_held(c)) {
    return 31;
  }
  *wish_rad = c->cia.axis.command_rad;
  cycles(c, STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
  if (!is_closed(c) || c->drive.motor < motor - 5 || c->drive.motor > motor + 5) {
    return 31;
  }
  for (k = 0; k < STAND_CYCLES; ++k) {
    const cia402_input in = {0, 0, 0, 0};
    (void)cia402_cycle(&c->cia, &in, &none, *wish_rad, 1);
  }
  c->drive.motor += 2000;
  c->largest_rad = 0;
  cycles(c, 2 * STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
  *wish_rad = c->cia.axis.command_rad;
  cycles(c, STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
  return is_closed(c) && c->largest_rad <= 2 * STEP_RAD ? 0 : 31;
}

/* The wish steps or is missing for some cycles in motion; enable is 0 for three cycles that the
 * drive does not see; the drive is moved in another mode; a mode in motion: no jump. */
static int check_steps(cell *c, float *wish_rad) {
  const float rate_rad = 5e-4f;
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  int32_t before;
  int k;
  at.torque_Nm = LOAD_NM;
  for (k = 0; k < 3; ++k) {
    int j;
    *wish_rad = c->cia.axis.command_rad;
    cycles(c, STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
    cycles(c, 100, LOAD_NM, wish_rad, rate_rad, 1);
    if (!is_closed(c) || !lm_axis_pause(&c->cia.axis) ||
        !lm_axis_set_mode(&c->cia.axis, LM_MODE_RESET)) {
      return 35;
    }
    c->largest_rad = 0;
    for (j = 0; j < 20; ++j) {
      const cia402_input in = read_drive(c);
      float wish = k == 0 ? not_a_number() : *wish_rad;
      if (k == 2 && j < 3) {
        (void)cia402_cycle(&c->cia, &in, &at, wish, 0);
      } else {
        cycles(c, 1, LOAD_NM, &wish, 0, 1);
      }
      *wish_rad += rate_rad + (k == 1 && j == 0 ? 0.2f : 0);
    }
    cycles(c, 20, LOAD_NM, wish_rad, rate_rad, 1);
    if (c->largest_rad > 1.1f * rate_rad || is_closed(c)) {
      return 36;
    }
  }
  *wish_rad = c->cia.axis.command_rad;
  cycles(c, STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
  c->drive.mode = 9; /* CSV */
  for (k = 0; k < 100; ++k) {
    c->drive.apart_inc = 500 * k;
    cycles(c, 1, LOAD_NM, wish_rad, 0, 1);
  }
  before = c->drive.motor;
  c->drive.mode = CIA402_CSP;
  cycles(c, 20, LOAD_NM - 5.0f, wish_rad, 0, 1);
  if (!is_held(c) || !c->cia.drive.armed) {
    return 37;
  }
  cycles(c, 2 * STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
  if (c->drive.motor < before - 1 || c->drive.motor > before + 1) {
    return 38;
  }
  *wish_rad = c->cia.axis.command_rad;
  cycles(c, STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
  return is_closed(c) ? 0 : 39;
}

/* A thermometer that is lost, and returns with another temperature. */
static int check_thermometer(cell *c) {
  const cia402_input in = read_drive(c);
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  float before_C = 20;
  int k;
  at.torque_Nm = LOAD_NM;
  c->cia.axis.follow.temperature_C = before_C;
  for (k = 0; k < 4000; ++k) {
    at.temperature_C = k < 2000 ? not_a_number() : 45;
    (void)cia402_cycle(&c->cia, &in, &at, c->cia.axis.command_rad, 1);
    if (!(c->cia.axis.follow.temperature_C - before_C <=
          1.01f * LM_FOLLOW_WARMING_K_S * PERIOD_S)) {
      return 44;
    }
    before_C = c->cia.axis.follow.temperature_C;
  }
  return before_C > 20.05f && is_closed(c) ? 0 : 44;
}

/* A drive that does not follow although it is enabled (bit 12), in motion, while the planner
 * continues: no jump. Another mode is requested once no torque is fed forward, which then begins
 * slowly. */
static int check_bit12(cell *c, float *wish_rad) {
  const float rate_rad = 5e-4f;
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  cia402_output out = c->cia.sent;
  int16_t fed = 0;
  int k;
  at.torque_Nm = LOAD_NM;
  cycles(c, STAND_CYCLES, LOAD_NM, wish_rad, 0, 0);
  c->drive.halts = 1;
  cycles(c, 3 * STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
  if (c->drive.status != CIA402_OPERATION_ENABLED || is_closed(c)) {
    return 50; /* the planner would go where the drive does not */
  }
  c->drive.halts = 0;
  cycles(c, 2 * STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
  *wish_rad = c->cia.axis.command_rad;
  cycles(c, STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
  if (!is_closed(c)) {
    return 50;
  }
  cycles(c, 100, LOAD_NM, wish_rad, rate_rad, 1);
  c->largest_rad = 0;
  c->drive.halts = 1;
  for (k = 0; k < 200; ++k) {
    const cia402_input in = read_drive(c);
    *wish_rad += rate_rad;
    at.torque_Nm = lm_axis_use_command(&c->cia.axis, LOAD_NM);
    (void)cia402_cycle(&c->cia, &in, &at, *wish_rad, 1);
    fed = k == 10 ? c->cia.sent.torque_offset : fed;
  }
  c->drive.halts = 0;
  cycles(c, 20, LOAD_NM, wish_rad, rate_rad, 1);
  if (c->largest_rad > 1.1f * rate_rad || is_closed(c) || c->cia.sent.torque_offset == fed) {
    return 46;
  }
  *wish_rad = c->cia.axis.command_rad;
  cycles(c, 10 * STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
  c->drive.apart_inc = 0;
  c->cia.mode = 1;
  c->cia.values.reports_offset = 0;
  c->drive.subtracts = 1;
  c->cia.axis.fed_Nm = FED_NM;
  cycles(c, 1, LOAD_NM, wish_rad, 0, 1);
  for (k = 0; k < MODE_CYCLES + 5 * STAND_CYCLES; ++k) {
    const cia402_input in = read_drive(c);
    const int16_t before = c->cia.sent.torque_offset;
    const int32_t motor = c->drive.motor;
    if (k == MODE_CYCLES) {
      c->cia.mode = 0;
    }
    at.torque_Nm = lm_axis_use_command(&c->cia.axis, LOAD_NM);
    out = cia402_cycle(&c->cia, &in, &at, c->cia.axis.command_rad, 1);
    if (!is_close(cia402_latched(&c->cia, in.position_actual) / RATIO,
                  cia402_angle(&c->cia.values, motor))) {
      return 49;
    }
    if ((c->cia.mode_seen == 1 && out.position_offset != 0) || out.torque_offset > before + 1 ||
        out.torque_offset < before - 1 ||
        (out.mode == 1 && (out.torque_offset != 0 || k < MODE_CYCLES * 3 / 4)) ||
        (k == MODE_CYCLES - 1 && out.mode != 1)) {
      return 47;
    }
    c->drive.mode = out.mode;
    run_drive(&c->drive, &out);
    if (c->drive.motor > motor + 1 || c->drive.motor < motor - 1) {
      return 49;
    }
  }
  c->cia.values.reports_offset = 1;
  c->drive.subtracts = 0;
  cycles(c, 2 * STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
  *wish_rad = c->cia.axis.command_rad;
  cycles(c, STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
  return is_closed(c) ? 0 : 48;
}

/* The planner begins within LM_FOLLOW_NEAR_RAD of the command, and only after the brake has opened:
 * no step. */
static int check_begin(cell *c, float *wish_rad) {
  int32_t before = 0;
  float beside_rad;
  int k;
  cycles(c, STAND_CYCLES, LOAD_NM, wish_rad, 0, 0);
  c->drive.mode = 0; /* never read from the drive */
  cycles(c, 2 * STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
  if (c->drive.status == CIA402_OPERATION_ENABLED) {
    return 43;
  }
  c->drive.mode = CIA402_CSP;
  cycles(c, 1, LOAD_NM, wish_rad, 0, 0);
  for (k = 0; k < 3 * STAND_CYCLES; ++k) {
    const int begun = is_closed(c);
    beside_rad = c->cia.axis.command_rad + 9e-5f;
    c->largest_rad = 0;
    cycles(c, 1, LOAD_NM, begun ? wish_rad : &beside_rad, 0, 1);
    *wish_rad = begun ? *wish_rad : beside_rad;
    before += c->drive.status == CIA402_OPERATION_ENABLED && !is_closed(c);
    if (c->largest_rad > 2 * STEP_RAD) {
      return 40;
    }
  }
  return is_closed(c) && before >= 99 && is_close(c->cia.axis.command_rad, *wish_rad) ? 0 : 41;
}

/* A command during safe torque off expires. */
static int check_safe_torque_off(cell *c, float *wish_rad) {
  int k;
  cycles(c, STAND_CYCLES, LOAD_NM, wish_rad, 0, 0);
  for (k = 0; k < STAND_CYCLES + (int)(LM_DRIVE_ENABLING_S / PERIOD_S); ++k) {
    cycles(c, 1, LOAD_NM, wish_rad, 0, 1);
    c->drive.status = CIA402_SWITCH_ON_DISABLED;
  }
  cycles(c, 2 * STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
  if (c->drive.status == CIA402_OPERATION_ENABLED) {
    return 32;
  }
  cycles(c, 1, LOAD_NM, wish_rad, 0, 0);
  cycles(c, 2 * STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
  return c->drive.status == CIA402_OPERATION_ENABLED ? 0 : 32;
}

/* An interpolator makes a ramp of the shift of the zero: the axis stops, and is not displaced. */
static int check_ramp(cell *c, float *wish_rad) {
  const float shift_rad = 0.05f;
  const cia402_input in = read_drive(c);
  const int32_t motor = c->drive.motor;
  const float before_rad = c->cia.axis.command_rad;
  (void)reference(&c->cia, &in, reported(&c->cia, &in) + shift_rad);
  cycles(c, 4, LOAD_NM, wish_rad, shift_rad / 4, 1);
  cycles(c, 4, LOAD_NM, wish_rad, 0, 1);
  if (c->drive.motor < motor - 1 || c->drive.motor > motor + 1 ||
      !is_close(c->cia.axis.command_rad, before_rad + shift_rad)) {
    return 33;
  }
  *wish_rad = c->cia.axis.command_rad;
  cycles(c, STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
  return is_closed(c) && c->cia.axis.follow.late_rad == 0 ? 0 : 33;
}

/* A drive that derives the rate from the demand gets none. */
static int check_rate(cell *c, float *wish_rad) {
  int rates = 0;
  int k;
  for (k = 0; k < 2 * STAND_CYCLES; ++k) {
    c->cia.values.derives_rate = k < STAND_CYCLES;
    cycles(c, 1, k % STAND_CYCLES < 100 ? -LOAD_NM : LOAD_NM, wish_rad, 0, 1);
    rates += c->cia.sent.velocity_offset != 0;
    if (k < STAND_CYCLES && rates > 0) {
      return 34;
    }
  }
  return rates > 0 ? 0 : 34;
}

static void swing(cell *c, float *wish_rad, int enable) {
  int k;
  for (k = 0; k < 10; ++k) {
    cycles(c, SWING_CYCLES, LOAD_NM + SWING_NM, wish_rad, 0, enable);
    cycles(c, SWING_CYCLES, LOAD_NM - SWING_NM, wish_rad, 0, enable);
  }
}

/* Ringing: the bit remains if the drive was enabled, and is cleared if the load swings against the
 * brake alone. */
static int check_ringing(cell *c, float *wish_rad) {
  cycles(c, STAND_CYCLES, LOAD_NM, wish_rad, 0, 0);
  swing(c, wish_rad, 0);
  if (c->cia.axis.correction.status & LM_STATE_RINGING) {
    return 18;
  }
  cycles(c, 3 * STAND_CYCLES, LOAD_NM, wish_rad, 0, 1);
  swing(c, wish_rad, 1);
  cycles(c, STAND_CYCLES, LOAD_NM, wish_rad, 0, 0);
  if (!(c->cia.axis.correction.status & LM_STATE_RINGING)) {
    return 19;
  }
  lm_axis_set_mode(&c->cia.axis, LM_MODE_RESET);
  lm_axis_set_mode(&c->cia.axis, LM_MODE_RUN);
  cycles(c, STAND_CYCLES, LOAD_NM, wish_rad, 0, 0);
  return c->cia.axis.correction.status & LM_STATE_RINGING ? 20 : 0;
}

/* A loop on the output: enabled with the first torque, only the rate of the correction is sent. */
static int check_output_loop(cell *c, lm_conditions *at) {
  static const cia402_drive drive = {INCREMENTS, 1, 50, -5, 1, 1, 0, 0, 0, 0, 0};
  cia402_input in = {CIA402_SWITCH_ON_DISABLED, 123456, 1, CIA402_CSP};
  cia402_output out;
  lm_fault fault;
  int32_t rate = 0;
  int k;
  if (cia402_start(&c->cia, &drive, &joint_parameters, 0, at, &in, &fault) != LM_OK) {
    return 10;
  }
  c->cia.axis.commissioned = 1;
  at->torque_Nm = not_a_number(); /* of a sensor that is not ready */
  for (k = 0; k < 2 * STAND_CYCLES; ++k) {
    out = cia402_cycle(&c->cia, &in, at, c->cia.axis.command_rad, k > 1);
    in.statusword = k > 1 ? CIA402_SWITCHED_ON : in.statusword;
    if (out.controlword == CIA402_ENABLE) {
      return 22;
    }
  }
  at->torque_Nm = LOAD_NM;
  for (k = 0; k < 2 * STAND_CYCLES; ++k) { /* the correction moves alone, until it stands */
    (void)cia402_cycle(&c->cia, &in, at, c->cia.axis.command_rad, 0);
  }
  for (k = 0; k < 200; ++k) {
    out = cia402_cycle(&c->cia, &in, at, c->cia.axis.command_rad, 1);
    in.statusword = out.controlword == CIA402_SHUTDOWN ? CIA402_READY
                    : out.controlword == CIA402_SWITCH_ON
                        ? CIA402_SWITCHED_ON
                        : CIA402_OPERATION_ENABLED | CIA402_FOLLOWS;
    at->torque_Nm = k < 100 ? LOAD_NM : -LOAD_NM;
    rate = out.velocity_offset < rate ? out.velocity_offset : rate;
    if (out.position_offset != 0 || out.target_position != 123456) {
      return 11;
    }
  }
  if (!(in.statusword & CIA402_FOLLOWS) || rate >= 0) {
    return 12;
  }
  /* A mode moves the correction, but not the joint: no rate. */
  lm_axis_set_mode(&c->cia.axis, LM_MODE_RESET);
  for (k = 0; k < 2 * STAND_CYCLES; ++k) {
    out = cia402_cycle(&c->cia, &in, at, c->cia.axis.command_rad, 1);
    if (out.velocity_offset != 0) {
      return 13;
    }
  }
  if (!is_close(c->cia.axis.correction.correction_rad, 0)) {
    return 13;
  }
  /* Nor does another source of the torque. */
  lm_axis_set_mode(&c->cia.axis, LM_MODE_RUN);
  for (k = 0; k < 2 * STAND_CYCLES; ++k) {
    (void)cia402_cycle(&c->cia, &in, at, c->cia.axis.command_rad, 1);
  }
  lm_axis_pause(&c->cia.axis);
  at->torque_Nm = LOAD_NM;
  for (k = 0; k < 2 * STAND_CYCLES; ++k) {
    out = cia402_cycle(&c->cia, &in, at, c->cia.axis.command_rad, 1);
    if (out.velocity_offset != 0) {
      return 23;
    }
  }
  return is_closed(c) ? 0 : 23;
}

int check_cia402(void) {
  static cell c;
  static const cia402_drive wrong_period = {INCREMENTS, RATIO, 1, -3, 1, 0, 0, 0, 0, 0, 0};
  static const cia402_drive near = {INCREMENTS, RATIO, 50, -5, 1, 0,
                                    0,          0,     0,  0,  0}; /* 50 * 10 us */
  static const cia402_drive drive = {INCREMENTS, RATIO, 50,       -5,     1, 0,
                                     0,          0.05f, RATED_NM, ORIGIN, 0};
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  lm_fault fault;
  lm_axis_kept kept;
  cia402_input in;
  float wish_rad;
  float start_rad;
  int k;
  at.torque_Nm = LOAD_NM;
  c.drive.mode = CIA402_CSP;
  c.drive.status = CIA402_SWITCH_ON_DISABLED;
  c.drive.motor = ORIGIN + 1234567;
  lm_start_model(&c.gear, LOAD_NM);
  lm_settle_model(&joint_parameters, &c.gear);
  in = read_drive(&c);
  if (cia402_start(&c.cia, &wrong_period, &joint_parameters, 0, &at, &in, &fault) !=
          LM_INCONSISTENT ||
      fault.input[0] != 'p') {
    return 1;
  }
  in.statusword = CIA402_OPERATION_ENABLED;
  if (cia402_start(&c.cia, &drive, &joint_parameters, 0, &at, &in, &fault) != LM_INCONSISTENT) {
    return 42;
  }
  for (k = 0; k < 20; ++k) { /* the host calls it nevertheless: the drive is not let fall */
    const cia402_output out = cia402_cycle(&c.cia, &in, &at, 0, 0);
    in.statusword = CIA402_QUICK_STOP_ACTIVE;
    if (out.controlword != CIA402_QUICK_STOP) {
      return 42;
    }
  }
  in = read_drive(&c);
  if (cia402_start(&c.cia, &near, &joint_parameters, 0, &at, &in, &fault) != LM_OUT_OF_RANGE ||
      cia402_start(&c.cia, &drive, &joint_parameters, 0, &at, &in, &fault) != LM_OK) {
    return 2;
  }
  /* Never commissioned: not enabled, and it does not start by itself once it may. */
  wish_rad = c.cia.axis.command_rad;
  cycles(&c, 2, LOAD_NM, &wish_rad, 0, 0);
  cycles(&c, STAND_CYCLES, LOAD_NM, &wish_rad, 0, 1);
  c.cia.axis.commissioned = 1;
  cycles(&c, STAND_CYCLES, LOAD_NM, &wish_rad, 0, 1);
  if (c.drive.status == CIA402_OPERATION_ENABLED || c.cia.drive.wait != LM_AXIS_WAITS_COMMISSION) {
    return 52;
  }
  c.drive.status = CIA402_SWITCH_ON_DISABLED;
  if (cia402_start(&c.cia, &drive, &joint_parameters, 0, &at, &in, &fault) != LM_OK) {
    return 2;
  }
  c.cia.axis.commissioned = 1;
  /* Enabling moves nothing: the command begins at the reported angle. */
  wish_rad = c.cia.axis.command_rad;
  start_rad = wish_rad;
  c.largest_rad = 0;
  cycles(&c, STAND_CYCLES, LOAD_NM, &wish_rad, 0, 1);
  if (c.drive.status != CIA402_SWITCH_ON_DISABLED) {
    return 45; /* by a command of before */
  }
  cycles(&c, 1, LOAD_NM, &wish_rad, 0, 0);
  cycles(&c, STAND_CYCLES, LOAD_NM, &wish_rad, 0, 1);
  if (c.drive.status != CIA402_OPERATION_ENABLED || c.largest_rad > STEP_RAD) {
    return 3;
  }
  /* Run: the output reaches the command, the motor goes beyond it by the lost motion. */
  cycles(&c, 1000, LOAD_NM, &wish_rad, 5e-4f, 1);
  cycles(&c, 500, LOAD_NM, &wish_rad, 0, 1);
  if (!is_close(output_of(&c, LOAD_NM), start_rad + 0.5f)) {
    return 4;
  }
  /* Emergency stop under an outside push, and back: nothing jumps. */
  c.largest_rad = 0;
  cycles(&c, 500, LOAD_NM - 5.0f, &wish_rad, 0, 0);
  cycles(&c, 20, LOAD_NM, &wish_rad, 0, 1);
  if (c.drive.status == CIA402_OPERATION_ENABLED) {
    return 6; /* the correction still follows the load */
  }
  cycles(&c, 2 * STAND_CYCLES, LOAD_NM, &wish_rad, 0, 1);
  if (c.drive.status != CIA402_OPERATION_ENABLED || c.largest_rad > STEP_RAD) {
    return 5;
  }
  /* Home: nothing moves. */
  in = read_drive(&c);
  (void)reference(&c.cia, &in, 1.0f);
  wish_rad = c.cia.axis.command_rad;
  c.largest_rad = 0;
  cycles(&c, 500, LOAD_NM, &wish_rad, 0, 1);
  in = read_drive(&c);
  if (c.largest_rad > STEP_RAD || !is_close(reported(&c.cia, &in), 1.0f)) {
    return 7;
  }
  k = check_hold(&c, &wish_rad);
  k = k ? k : check_not_finite(&c, &wish_rad);
  k = k ? k : check_planner(&c, &wish_rad);
  k = k ? k : check_trip(&c, &wish_rad);
  k = k ? k : check_bus(&c, &wish_rad);
  k = k ? k : check_steps(&c, &wish_rad);
  k = k ? k : check_bit12(&c, &wish_rad);
  k = k ? k : check_thermometer(&c);
  k = k ? k : check_begin(&c, &wish_rad);
  k = k ? k : check_safe_torque_off(&c, &wish_rad);
  k = k ? k : check_ramp(&c, &wish_rad);
  k = k ? k : check_rate(&c, &wish_rad);
  k = k ? k : check_ringing(&c, &wish_rad);
  cycles(&c, STAND_CYCLES, LOAD_NM, &wish_rad, 0, 1);
  k = k ? k : check_stop(&c, &wish_rad);
  k = k ? k : check_slip(&c, &wish_rad, &kept);
  if (k) {
    return k;
  }
  /* Power-down with the brake on, power-up with the history. */
  cycles(&c, STAND_CYCLES, LOAD_NM, &wish_rad, 0, 0);
  in = read_drive(&c);
  start_rad = reported(&c.cia, &in);
  if (lm_drive_power_down(&c.cia.drive, &c.cia.axis, &kept)) {
    return 27;
  }
  cycles(&c, STAND_CYCLES, LOAD_NM, &wish_rad, 0, 1);
  if (c.drive.status == CIA402_OPERATION_ENABLED) {
    return 27; /* the history is saved */
  }
  in = read_drive(&c);
  if (cia402_start(&c.cia, &drive, &joint_parameters, &kept, &at, &in, &fault) != LM_OK ||
      kept.history.format != 0) {
    return 8;
  }
  wish_rad = c.cia.axis.command_rad;
  c.largest_rad = 0;
  cycles(&c, 2, LOAD_NM, &wish_rad, 0, 0);
  cycles(&c, STAND_CYCLES, LOAD_NM, &wish_rad, 0, 1);
  if (c.drive.status != CIA402_OPERATION_ENABLED || c.largest_rad > 2 * STEP_RAD) {
    return 9;
  }
  wish_rad = c.cia.axis.command_rad;
  cycles(&c, STAND_CYCLES, LOAD_NM, &wish_rad, 0, 1);
  in = read_drive(&c);
  if (c.largest_rad > 2 * STEP_RAD || !is_close(reported(&c.cia, &in), start_rad)) {
    return 9;
  }
  return check_output_loop(&c, &at);
}
