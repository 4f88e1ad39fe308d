#include "cia402.h"

#include <string.h>

#define TURN_RAD 6.28318531f
#define PERIOD_TOLERANCE 0.01f
#define RATIO_MAX 1e4f

/* To the nearest increment, within an INTEGER32. */
static int32_t to_increments(float value) {
  const float most = 2147483520.0f; /* largest float below 2^31 */
  value = value > most ? most : value < -most ? -most : value == value ? value : 0;
  return (int32_t)(value < 0 ? value - 0.5f : value + 0.5f);
}

static int is_finite(float value) {
  return lm_follow_is_known(value);
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

/* A loop on the output corrects the lost motion itself: an offset would shift the output. */
static int32_t find_offset(const cia402_axis *axis) {
  return axis->drive.output_loop
             ? 0
             : to_increments(axis->correction.correction_rad * axis->increments_per_rad);
}

/* The motor follows the correction only while it is enabled and not held. If a loop on the output
 * feeds the rate forward, the joint has to move with it. */
static int32_t find_rate(const cia402_axis *axis, int enabled) {
  return enabled && !axis->held && !axis->drive.derives_rate &&
                 !(axis->drive.output_loop && axis->moves_alone)
             ? to_increments(axis->correction.velocity_rad_s * axis->increments_per_rad)
             : 0;
}

static float period_of(const cia402_drive *drive) {
  float period_s = (float)drive->period_value;
  int32_t i;
  for (i = drive->period_exponent; i < 0; ++i) {
    period_s *= 0.1f;
  }
  return period_s;
}

static void take_parameters(cia402_axis *axis, const lm_parameters *parameters) {
  axis->follow.period_s = parameters->limits.period_s;
  axis->follow.stand_s = CIA402_STAND / parameters->limits.response_per_s;
}

lm_status cia402_start(cia402_axis *axis, const cia402_drive *drive,
                       const lm_parameters *parameters, lm_saved *kept, const lm_conditions *at,
                       const cia402_input *in, lm_fault *fault) {
  lm_status status;
  float period_s = period_of(drive);
  memset(axis, 0, sizeof *axis);
  if (!in->valid) {
    return refuse(fault, LM_INCONSISTENT, "valid", 0, 1, 1);
  }
  if ((in->statusword & CIA402_STATE_MASK) == CIA402_OPERATION_ENABLED) {
    return refuse(fault, LM_INCONSISTENT, "statusword", in->statusword, 0, 0);
  }
  if (drive->increments_per_rev < 1) {
    return refuse(fault, LM_OUT_OF_RANGE, "increments_per_rev", 0, 1, 4294967295.0f);
  }
  if (!(size(drive->ratio) >= 1 && size(drive->ratio) <= RATIO_MAX)) {
    return refuse(fault, LM_OUT_OF_RANGE, "ratio", drive->ratio, 1, RATIO_MAX);
  }
  if (drive->period_exponent < -6 || drive->period_exponent > 0) {
    return refuse(fault, LM_OUT_OF_RANGE, "period_exponent", drive->period_exponent, -6, 0);
  }
  status = lm_start_compensator(&axis->compensator, parameters, at->torque_Nm, fault);
  if (status != LM_OK) {
    return status;
  }
  if (!(period_s > (1 - PERIOD_TOLERANCE) * parameters->limits.period_s &&
        period_s < (1 + PERIOD_TOLERANCE) * parameters->limits.period_s)) {
    memset(&axis->compensator, 0, sizeof axis->compensator); /* not started: corrects nothing */
    return refuse(fault, LM_INCONSISTENT, "period_s", period_s,
                  (1 - PERIOD_TOLERANCE) * parameters->limits.period_s,
                  (1 + PERIOD_TOLERANCE) * parameters->limits.period_s);
  }
  if (kept) {
    (void)lm_restore_compensator(&axis->compensator, kept, 0); /* refused: history unknown */
    kept->format = 0;
  }
  axis->drive = *drive;
  take_parameters(axis, parameters);
  axis->follow.temperature_C = at->temperature_C;
  axis->last = *in;
  axis->rest_inc = in->position_actual;
  axis->increments_per_rad = (float)drive->increments_per_rev * drive->ratio / TURN_RAD;
  /* The drive is off: the correction settles before the loop closes on it. */
  axis->correction = lm_settle_compensator(&axis->compensator, at);
  axis->sent.position_offset = find_offset(axis);
  axis->command_rad = cia402_reported(axis, in);
  if (!(size(axis->command_rad) <= CIA402_ANGLE_MAX_RAD)) {
    memset(&axis->compensator, 0, sizeof axis->compensator);
    return refuse(fault, LM_OUT_OF_RANGE, "position_actual", axis->command_rad,
                  -CIA402_ANGLE_MAX_RAD, CIA402_ANGLE_MAX_RAD);
  }
  return LM_OK;
}

/* Increments of the output are exact in integers; a float would lose the last digits in a long
 * motion.
 */
static int32_t output_increments(const cia402_axis *axis, const cia402_input *in) {
  return axis->drive.reports_offset ? in->position_actual - axis->sent.position_offset
                                    : in->position_actual;
}

static float angle_at(const cia402_axis *axis, int32_t increments) {
  return axis->zero_rad + (float)(increments - axis->drive.origin_inc) / axis->increments_per_rad;
}

float cia402_reported(const cia402_axis *axis, const cia402_input *in) {
  return angle_at(axis, output_increments(axis, in));
}

void cia402_set_zero(cia402_axis *axis, float zero_rad) {
  if (is_finite(zero_rad)) {
    const float shift_rad = zero_rad - axis->zero_rad;
    axis->command_rad += shift_rad;
    axis->zero_rad = zero_rad;
    axis->follow.late_rad += axis->joined ? shift_rad : 0;
  }
}

float cia402_reference(cia402_axis *axis, const cia402_input *in, float angle_rad) {
  const float shift_rad = angle_rad - cia402_reported(axis, in);
  const float follows_rad = axis->correction.correction_rad + axis->correction.lost_motion_rad;
  if (!in->valid || !is_finite(shift_rad)) {
    return -1;
  }
  cia402_set_zero(axis, axis->zero_rad + shift_rad);
  if (axis->drive.output_loop) {
    return 0;
  }
  return size(follows_rad) + lm_bound_uncertainty(&axis->compensator);
}

/* With the loop open the correction moves nothing. What looks like ringing then is the load that
 * swings against the brake. */
static void judge_ringing(cia402_axis *axis, int enabled) {
  const int rings = (axis->correction.status & LM_STATE_RINGING) != 0;
  if (enabled) {
    axis->rang = rings;
  } else if (rings && !axis->rang) {
    lm_set_mode(&axis->compensator, LM_MODE_RESET);
    lm_set_mode(&axis->compensator, axis->mode);
  }
}

/* The correction moves without the load. */
static void expect_motion(cia402_axis *axis) {
  axis->moves_alone = 1;
  axis->standstill.ticks = 0;
  axis->stood_s = 0;
}

static void hold(cia402_axis *axis) {
  if (!axis->drive.output_loop && !axis->held) {
    axis->held = 1;
    axis->held_inc = axis->sent.target_position + axis->sent.position_offset;
  }
  expect_motion(axis);
}

int32_t cia402_pause(cia402_axis *axis) {
  if (axis->joined && !axis->drive.output_loop && axis->follow.rested_s < LM_FOLLOW_REST_S) {
    return 1;
  }
  hold(axis);
  return 0;
}

int32_t cia402_set_mode(cia402_axis *axis, lm_mode mode) {
  if (axis->enabled && mode != LM_MODE_HOLD && cia402_pause(axis)) {
    return 1;
  }
  lm_set_mode(&axis->compensator, mode);
  axis->mode = mode;
  axis->rang = mode == LM_MODE_RESET ? 0 : axis->rang;
  expect_motion(axis);
  return 0;
}

lm_status cia402_change(cia402_axis *axis, const lm_parameters *parameters, lm_fault *fault) {
  lm_status status;
  if (axis->enabled && cia402_pause(axis)) {
    return refuse(fault, LM_INCONSISTENT, "wish_rad", axis->follow.moved_rad, 0, 0);
  }
  status = lm_change_parameters(&axis->compensator, parameters, fault);
  if (status == LM_OK) {
    take_parameters(axis, parameters);
    axis->rang = 0;
  }
  expect_motion(axis);
  return status;
}

/* The target is not that of the actual load. */
#define NOT_TO_ENABLE (LM_STATE_CONDITION_MISSING | LM_STATE_INPUT_REFUSED | LM_STATE_NOT_STARTED)

/* Time for which the correction has stood since the motor followed it last. */
static void find_stood(cia402_axis *axis, int follows) {
  const uint32_t state =
      axis->correction.status & (LM_STATE_FADED | LM_STATE_RINGING | NOT_TO_ENABLE);
  if (state != axis->moving_state) {
    axis->moving_state = state;
    expect_motion(axis);
  }
  if (follows || (axis->correction.status & NOT_TO_ENABLE)) {
    axis->standstill.ticks = 0;
  }
  axis->stood_s = lm_find_standstill(&axis->compensator, &axis->standstill);
  if (axis->stood_s >= axis->follow.stand_s) {
    axis->moves_alone = 0;
  }
}

/* Time for which the motor has been at rest: behind its brake, or stopped by the drive. */
static void find_rest(cia402_axis *axis, int32_t motor_inc, int enabled) {
  const float moved_rad = (float)(motor_inc - axis->rest_inc) / axis->increments_per_rad;
  axis->rest_s += period_of(&axis->drive);
  if (enabled || !(size(moved_rad) < CIA402_STILL_RAD)) {
    axis->rest_inc = motor_inc;
    axis->rest_s = 0;
  }
}

static int rests(const cia402_axis *axis) {
  return axis->rest_s >= axis->follow.stand_s;
}

int32_t cia402_power_down(cia402_axis *axis, lm_saved *kept) {
  if (!rests(axis) || axis->stood_s < axis->follow.stand_s) {
    return 1;
  }
  lm_save_compensator(&axis->compensator, kept);
  axis->saved = 1;
  return 0;
}

/* A loop on the output need not wait until the correction stands. */
static int may_enable(const cia402_axis *axis) {
  return axis->last.mode == CIA402_CSP && rests(axis) &&
         !(axis->correction.status & NOT_TO_ENABLE) &&
         (axis->drive.output_loop || axis->stood_s >= axis->follow.stand_s);
}

/* Steps through the drive's states, one per cycle. */
static uint16_t controlword(uint16_t statusword, int32_t enable, int at_rest) {
  switch (statusword & CIA402_STATE_MASK) {
    case CIA402_OPERATION_ENABLED:
      return enable ? CIA402_ENABLE : CIA402_QUICK_STOP;
    case CIA402_SWITCHED_ON:
      return enable ? CIA402_ENABLE : CIA402_SHUTDOWN;
    case CIA402_READY:
      return enable ? CIA402_SWITCH_ON : CIA402_SHUTDOWN;
    case CIA402_QUICK_STOP_ACTIVE: /* with 0x605A = 5 to 8 the drive does not leave it by itself */
      return at_rest ? CIA402_DISABLE_VOLTAGE : CIA402_QUICK_STOP;
    default: /* switch on disabled; a fault is reset by the host alone */
      return enable ? CIA402_SHUTDOWN : CIA402_DISABLE_VOLTAGE;
  }
}

/* The planner has to begin at the command, once the brake has opened. */
static void follow(cia402_axis *axis, float wish_rad) {
  if (!axis->joined) {
    axis->joined = lm_follow_waits(&axis->follow, axis->command_rad, wish_rad) &&
                   axis->enabled_s >= axis->drive.opening_s;
  } else if (!lm_follow_wish(&axis->follow, &axis->command_rad, wish_rad)) {
    axis->joined = 0;
  }
}

/* A lost bus: the drive may still follow the demand of before, or stop; the demand stays. */
static cia402_output keep_demand(cia402_axis *axis, int32_t enable) {
  if (axis->enabled) {
    hold(axis);
  }
  axis->joined = 0;
  axis->rest_s = 0;
  find_stood(axis, 1);
  axis->sent.position_offset = find_offset(axis);
  axis->sent.velocity_offset = 0;
  axis->sent.controlword = !axis->enabled ? CIA402_DISABLE_VOLTAGE
                           : enable       ? CIA402_ENABLE
                                          : CIA402_QUICK_STOP;
  if (axis->held) {
    axis->sent.target_position = axis->held_inc - axis->sent.position_offset;
    axis->command_rad = angle_at(axis, axis->sent.target_position);
  }
  return axis->sent;
}

/* Never enabled again by itself: a fault, safe torque off, a lost bus. In another mode the drive
 * moves by itself; back in CSP it is held where it is until the correction stands. */
static int32_t judge_enable(cia402_axis *axis, int operates, int enabled, int fault,
                            int32_t enable) {
  axis->tripped = enable && (axis->tripped || fault || (axis->operated && !operates));
  if (enabled && axis->operated && !axis->enabled) {
    axis->sent.target_position = output_increments(axis, &axis->last);
    hold(axis);
  }
  axis->operated = operates;
  axis->enabled = enabled;
  axis->enabled_s = enabled ? axis->enabled_s + period_of(&axis->drive) : 0;
  return enable && !axis->tripped && !axis->saved;
}

cia402_output cia402_cycle(cia402_axis *axis, const cia402_input *in, const lm_conditions *at,
                           float wish_rad, int32_t enable) {
  lm_conditions now = *at;
  float reported_rad;
  int32_t standing;
  int operates;
  int enabled;
  now.temperature_C =
      lm_follow_temperature(&axis->follow, at->temperature_C, axis->enabled && !axis->held);
  axis->correction = lm_step_compensator(&axis->compensator, &now);
  axis->lost_cycles = in->valid ? 0 : axis->lost_cycles + 1;
  if (in->valid) {
    axis->last = *in;
  } else if (!axis->joined || axis->lost_cycles > LM_FOLLOW_LOST_TICKS) {
    return keep_demand(axis, enable);
  }
  in = &axis->last;
  operates = (in->statusword & CIA402_STATE_MASK) == CIA402_OPERATION_ENABLED;
  enabled = operates && in->mode == CIA402_CSP;
  reported_rad = cia402_reported(axis, in);
  standing = output_increments(axis, in);
  enable = judge_enable(axis, operates, enabled, (in->statusword & CIA402_FAULT_MASK) != 0, enable);
  judge_ringing(axis, enabled);
  axis->held = axis->held && enabled && axis->stood_s < axis->follow.stand_s;
  find_rest(axis, standing + axis->sent.position_offset, operates);
  find_stood(axis, enabled && !axis->held && !axis->drive.output_loop);
  axis->enabling_s = enable && !operates ? axis->enabling_s + period_of(&axis->drive) : 0;
  enable = enable && (operates || may_enable(axis));
  axis->tripped = axis->tripped || axis->enabling_s > CIA402_ENABLING_S;
  axis->sent.controlword = controlword(in->statusword, enable, rests(axis));
  axis->sent.position_offset = find_offset(axis);
  axis->sent.velocity_offset = find_rate(axis, enabled);
  if (axis->held) {
    standing = axis->held_inc - axis->sent.position_offset;
    reported_rad = angle_at(axis, standing);
  }
  if (enabled && !enable && !axis->held) {
    axis->joined = 0;
    return axis->sent; /* the drive brakes from its demand, not from the following error */
  }
  if (enabled && !axis->held) {
    follow(axis, wish_rad);
    axis->sent.target_position =
        axis->drive.origin_inc +
        to_increments((axis->command_rad - axis->zero_rad) * axis->increments_per_rad);
  } else {
    /* At rest, stopped by the drive, held or moved from outside: the target follows the output, no
     * jump. */
    axis->joined = 0;
    axis->follow.rested_s = 0;
    axis->command_rad = reported_rad;
    axis->sent.target_position = standing;
  }
  return axis->sent;
}
