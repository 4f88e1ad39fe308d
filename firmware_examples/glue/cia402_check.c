/* A minimal CSP drive and the cycles of an axis in their usual sequence: the exit code
 * of `check_cia402` is the number of the first check that fails. */
#include "checks.h"
#include "cia402.h"
#include "params.h"

#define PERIOD_S 5e-4f
#define LOAD_NM (-12.0f)
#define INCREMENTS 131072u
#define RATIO (-100.0f)
#define RAD (131072.0f * -100.0f / 6.28318531f) /* increments */
#define STAND_CYCLES 510                        /* CIA402_STAND_S, and the states of the drive */
#define STEP_RAD 5e-7f /* a motor that is enabled, braked or off moves by less: one increment */

typedef struct csp_drive {
  uint16_t status;
  int32_t motor; /* increments */
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
      drive->status = CIA402_SWITCH_ON_DISABLED; /* stops at once, and the brake closes */
      break;
    default:
      break;
  }
  if (drive->status == CIA402_OPERATION_ENABLED) {
    drive->motor = out->target_position + out->position_offset;
  }
}

typedef struct cell {
  cia402_axis axis;
  csp_drive drive;
  lm_memory gear;
  float largest_rad; /* greatest step of the motor from cycle to cycle */
} cell;

static cia402_input read_drive(const cell *c) {
  cia402_input in;
  in.statusword = c->drive.status;
  in.position_actual = c->drive.motor;
  return in;
}

static float output_of(cell *c, float torque_Nm) {
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  at.torque_Nm = torque_Nm;
  return (float)c->drive.motor / RAD + lm_step_model(&joint_parameters, &c->gear, &at);
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
    out = cia402_cycle(&c->axis, &in, &at, *wish_rad, enable);
    run_drive(&c->drive, &out);
    moved_rad = (float)(c->drive.motor - before) / RAD;
    moved_rad = moved_rad < 0 ? -moved_rad : moved_rad;
    c->largest_rad = moved_rad > c->largest_rad ? moved_rad : c->largest_rad;
    (void)output_of(c, torque_Nm);
    if (enable == 0 || c->drive.status != CIA402_OPERATION_ENABLED) {
      *wish_rad = c->axis.command_rad; /* the planner starts at the reported angle */
    }
  }
}

/* A loop on the output: enabled at once, only the rate of the correction is sent. */
static int check_output_loop(cell *c, lm_conditions *at) {
  static const cia402_drive drive = {INCREMENTS, 1, 50, -5, 1, 1};
  cia402_input in = {CIA402_SWITCH_ON_DISABLED, 1234567};
  cia402_output out;
  lm_fault fault;
  int32_t rate = 0;
  int k;
  if (cia402_start(&c->axis, &drive, &joint_parameters, 0, at, &in, &fault) != LM_OK) {
    return 10;
  }
  for (k = 0; k < 100; ++k) {
    out = cia402_cycle(&c->axis, &in, at, c->axis.command_rad, 1);
    in.statusword = out.controlword == CIA402_SHUTDOWN    ? CIA402_READY
                    : out.controlword == CIA402_SWITCH_ON ? CIA402_SWITCHED_ON
                                                          : CIA402_OPERATION_ENABLED;
    at->torque_Nm = k < 10 ? LOAD_NM : -LOAD_NM;
    rate = out.velocity_offset < rate ? out.velocity_offset : rate;
    if (out.position_offset != 0 || out.target_position != 1234567) {
      return 11;
    }
  }
  return in.statusword == CIA402_OPERATION_ENABLED && rate < 0 ? 0 : 12;
}

int check_cia402(void) {
  static cell c;
  static const cia402_drive wrong_period = {INCREMENTS, RATIO, 1, -3, 1, 0};
  static const cia402_drive drive = {INCREMENTS, RATIO, 50, -5, 1, 0}; /* 50 * 10 us */
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  lm_fault fault;
  lm_saved kept;
  cia402_input in;
  float wish_rad;
  float start_rad;
  at.torque_Nm = LOAD_NM;
  c.drive.status = CIA402_SWITCH_ON_DISABLED;
  c.drive.motor = 1234567;
  lm_start_model(&c.gear, LOAD_NM);
  lm_settle_model(&joint_parameters, &c.gear);
  in = read_drive(&c);
  if (cia402_start(&c.axis, &wrong_period, &joint_parameters, 0, &at, &in, &fault) !=
          LM_INCONSISTENT ||
      fault.input[0] != 'p') {
    return 1;
  }
  if (cia402_start(&c.axis, &drive, &joint_parameters, 0, &at, &in, &fault) != LM_OK) {
    return 2;
  }
  /* Enabling moves nothing: the command begins at the reported angle. */
  wish_rad = c.axis.command_rad;
  start_rad = wish_rad;
  c.largest_rad = 0;
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
  (void)cia402_reference(&c.axis, &in, 1.0f);
  wish_rad = c.axis.command_rad;
  c.largest_rad = 0;
  cycles(&c, 500, LOAD_NM, &wish_rad, 0, 1);
  in = read_drive(&c);
  if (c.largest_rad > STEP_RAD || !is_close(cia402_reported(&c.axis, &in), 1.0f)) {
    return 7;
  }
  /* Power-down with the brake on, power-up with the history. */
  cycles(&c, STAND_CYCLES, LOAD_NM, &wish_rad, 0, 0);
  lm_save_compensator(&c.axis.compensator, &kept);
  in = read_drive(&c);
  if (cia402_start(&c.axis, &drive, &joint_parameters, &kept, &at, &in, &fault) != LM_OK ||
      kept.format != 0) {
    return 8;
  }
  wish_rad = c.axis.command_rad;
  c.largest_rad = 0;
  cycles(&c, STAND_CYCLES, LOAD_NM, &wish_rad, 0, 1);
  if (c.drive.status != CIA402_OPERATION_ENABLED || c.largest_rad > 2 * STEP_RAD) {
    return 9;
  }
  return check_output_loop(&c, &at);
}
