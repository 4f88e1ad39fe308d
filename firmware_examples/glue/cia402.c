#include "cia402.h"

#include <string.h>

#define TURN_RAD 6.28318531f
#define PERIOD_TOLERANCE 0.01f
#define RATIO_MAX 1e4f
#define PER_MILLE 1000.0f
#define TORQUE_MAX 32767.0f

/* To the nearest increment, within an INTEGER32. */
static int32_t to_increments(float value) {
  const float most = 2147483520.0f; /* largest float below 2^31 */
  value = value > most ? most : value < -most ? -most : value == value ? value : 0;
  return (int32_t)(value < 0 ? value - 0.5f : value + 0.5f);
}

static float size(float value) {
  return lm_follow_size(value);
}

static lm_status refuse(lm_fault *fault, lm_status status, const char *input, float found,
                        float low, float high) {
  if (fault) {
    fault->status = status;
    fault->input = input;
    fault->found = found;
    fault->low = low;
    fault->high = high;
  }
  return status;
}

static float period_of(const cia402_drive *values) {
  float period_s = (float)values->period_value;
  int32_t i;
  for (i = values->period_exponent; i < 0; ++i) {
    period_s *= 0.1f;
  }
  return period_s;
}

/* Other modes have no offset. In integers: a float would lose the last digits in a long motion. */
static int32_t motor_at(const cia402_axis *c, int32_t position_actual) {
  return c->values.reports_offset || c->mode_seen != CIA402_CSP
             ? position_actual
             : position_actual + c->sent.position_offset;
}

static float increments_of(const cia402_drive *values) {
  return (float)values->increments_per_rev * values->ratio / TURN_RAD;
}

float cia402_angle(const cia402_drive *values, int32_t motor_inc) {
  return (float)(motor_inc - values->origin_inc) / increments_of(values);
}

/* Of the encoder of the loop. */
static float find_motor(const cia402_drive *values, int32_t motor_inc) {
  return cia402_angle(values, motor_inc) * (values->output_loop ? 1 : values->ratio);
}

float cia402_motor(const cia402_axis *c, const cia402_input *in) {
  return in->valid ? find_motor(&c->values, motor_at(c, in->position_actual)) : LM_UNKNOWN;
}

float cia402_latched(const cia402_axis *c, int32_t latch_inc) {
  return find_motor(&c->values, motor_at(c, latch_inc));
}

/* What the drive adds to the target. A loop on the output corrects the lost motion itself. Where the
 * correction changes and the motor does not, the sum stays; a drive that derives a velocity from the
 * target alone would take that for a motion: the target follows slowly. Other modes have no offset,
 * and whether the drive reports it there does not matter. */
static int32_t find_offset(cia402_axis *c) {
  const int moves = c->axis.state == LM_AXIS_CLOSED || c->axis.guides;
  const float wanted_rad = c->values.output_loop ? 0 : c->axis.correction.correction_rad;
  const float most_rad = c->correction_rad * c->axis.follow.period_s / LM_AXIS_FEED_S;
  if (!c->drive.operated) {
    c->owed_rad = 0;
  } else if (c->mode_seen != CIA402_CSP) {
    c->owed_rad = wanted_rad;
  } else if (!moves || !c->moves) {
    c->owed_rad = wanted_rad - c->offset_rad;
  } else {
    /* the offset follows the correction, as the motor does */
  }
  c->moves = moves;
  c->owed_rad -= size(c->owed_rad) < most_rad ? c->owed_rad
                 : c->owed_rad < 0            ? -most_rad
                                              : most_rad;
  c->offset_rad = wanted_rad - c->owed_rad;
  return to_increments(c->offset_rad * c->increments_per_rad);
}

static int32_t find_rate(const cia402_axis *c) {
  return c->values.derives_rate
             ? 0
             : to_increments(c->axis.correction.velocity_rad_s * c->increments_per_rad);
}

static int16_t find_torque(const cia402_axis *c) {
  const float motor_Nm = lm_axis_feed(&c->axis);
  const float share =
      c->values.rated_torque_Nm > 0 ? PER_MILLE * motor_Nm / c->values.rated_torque_Nm : 0;
  return (int16_t)to_increments(share > TORQUE_MAX    ? TORQUE_MAX
                                : share < -TORQUE_MAX ? -TORQUE_MAX
                                                      : share);
}

lm_status cia402_start(cia402_axis *c, const cia402_drive *values, const lm_parameters *parameters,
                       lm_axis_kept *kept, const lm_conditions *at, const cia402_input *in,
                       lm_fault *fault) {
  const float period_s = period_of(values);
  lm_status status;
  memset(c, 0, sizeof *c);
  if (!in->valid) {
    return refuse(fault, LM_INCONSISTENT, "valid", 0, 1, 1);
  }
  if ((in->statusword & CIA402_STATE_MASK) == CIA402_OPERATION_ENABLED) {
    return refuse(fault, LM_INCONSISTENT, "statusword", in->statusword, 0, 0);
  }
  if (values->increments_per_rev < 1) {
    return refuse(fault, LM_OUT_OF_RANGE, "increments_per_rev", 0, 1, 4294967295.0f);
  }
  if (!(size(values->ratio) >= 1 && size(values->ratio) <= RATIO_MAX)) {
    return refuse(fault, LM_OUT_OF_RANGE, "ratio", values->ratio, 1, RATIO_MAX);
  }
  if (values->period_exponent < -6 || values->period_exponent > 0) {
    return refuse(fault, LM_OUT_OF_RANGE, "period_exponent", values->period_exponent, -6, 0);
  }
  status = lm_check_parameters(parameters, fault);
  if (status != LM_OK) {
    return status;
  }
  if (!(period_s > (1 - PERIOD_TOLERANCE) * parameters->limits.period_s &&
        period_s < (1 + PERIOD_TOLERANCE) * parameters->limits.period_s)) {
    return refuse(fault, LM_INCONSISTENT, "period_s", period_s,
                  (1 - PERIOD_TOLERANCE) * parameters->limits.period_s,
                  (1 + PERIOD_TOLERANCE) * parameters->limits.period_s);
  }
  c->values = *values;
  c->increments_per_rad = increments_of(values);
  c->drive.own_brake = 1;
  c->drive.own_stop = 1;
  c->drive.opening_s = values->opening_s;
  /* Nothing was sent yet: the position is without an offset. */
  c->motor_inc = in->position_actual;
  c->rest_inc = in->position_actual;
  c->demand_inc = in->position_actual;
  c->sent.target_position = in->position_actual;
  c->correction_rad = parameters->limits.correction_rad;
  c->axis.ratio = values->ratio;
  c->axis.output_loop = values->output_loop;
  return lm_axis_power_up(&c->axis, parameters, kept, at, find_motor(values, c->motor_inc), fault);
}

/* Time for which the motor has been at rest: behind its brake, or stopped by the drive. */
static void find_rest(cia402_axis *c, int operates) {
  const float moved_rad = (float)(c->motor_inc - c->rest_inc) / c->increments_per_rad;
  c->rest_s += c->axis.follow.period_s;
  if (operates || !(size(moved_rad) < LM_AXIS_STILL_RAD)) {
    c->rest_inc = c->motor_inc;
    c->rest_s = 0;
  }
}

/* Steps through the drive's states, one per cycle. */
static uint16_t controlword(const cia402_axis *c) {
  const int waits = c->drive.runs; /* for something that will come */
  switch (c->statusword & CIA402_STATE_MASK) {
    case CIA402_OPERATION_ENABLED:
      return c->drive.enable ? CIA402_ENABLE : CIA402_QUICK_STOP;
    case CIA402_SWITCHED_ON:
      return c->drive.enable ? CIA402_ENABLE : waits ? CIA402_SWITCH_ON : CIA402_SHUTDOWN;
    case CIA402_READY:
      return waits ? CIA402_SWITCH_ON : CIA402_SHUTDOWN;
    case CIA402_QUICK_STOP_ACTIVE: /* with 0x605A = 5 to 8 the drive does not leave it by itself. A
                                      controller that was reset knows no rest: the drive holds. */
      return c->axis.state != LM_AXIS_OFF && c->rest_s >= c->axis.follow.stand_s
                 ? CIA402_DISABLE_VOLTAGE
                 : CIA402_QUICK_STOP;
    default: /* switch on disabled; a fault is reset by the host alone */
      return waits ? CIA402_SHUTDOWN : CIA402_DISABLE_VOLTAGE;
  }
}

static lm_drive_report read_status(const cia402_axis *c, const cia402_input *in) {
  const uint16_t state = in->statusword & CIA402_STATE_MASK;
  lm_drive_report report = {0, 0, 0, 0, 0};
  report.lost = !in->valid;
  report.enabled = state == CIA402_OPERATION_ENABLED;
  report.other_mode = in->mode != CIA402_CSP || (report.enabled && !c->values.ignores_bit12 &&
                                                 !(in->statusword & CIA402_FOLLOWS));
  report.fault = (in->statusword & CIA402_FAULT_MASK) != 0;
  report.preparing = state != CIA402_SWITCHED_ON;
  return report;
}

cia402_output cia402_cycle(cia402_axis *c, const cia402_input *in, const lm_conditions *at,
                           float wish_rad, int32_t run) {
  const lm_drive_report report = read_status(c, in);
  if (in->valid) {
    c->statusword = in->statusword;
    c->mode_seen = in->mode;
    c->motor_inc = motor_at(c, in->position_actual);
  }
  c->drive.leave = c->mode != 0 && c->mode != CIA402_CSP;
  lm_drive_step(&c->drive, &c->axis, &report, run);
  (void)lm_axis_tick(&c->axis, at, cia402_motor(c, in), wish_rad, c->drive.follows);
  find_rest(c, c->drive.operated || !in->valid);
  if (c->axis.state == LM_AXIS_CLOSED || c->axis.guides) {
    c->demand_inc =
        c->values.origin_inc + to_increments(c->axis.setpoint_rad * c->increments_per_rad);
  } else if (c->axis.at_motor || c->axis.state < LM_AXIS_PAUSED) {
    c->demand_inc = c->motor_inc; /* paused it stays, to the increment */
  }
  c->sent.mode = c->drive.may_leave ? c->mode : CIA402_CSP;
  c->sent.controlword = controlword(c);
  c->sent.position_offset = find_offset(c);
  c->sent.target_position = c->demand_inc - c->sent.position_offset;
  c->sent.velocity_offset = find_rate(c);
  c->sent.torque_offset = find_torque(c);
  return c->sent;
}
