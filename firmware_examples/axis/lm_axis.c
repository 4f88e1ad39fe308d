#include "lm_axis.h"

#include <string.h>

/* Share of the filter in a tick: response * period / 4, with response 2.5 times the resonance:
 * 2 pi times a tenth of the resonance, times the period. */
#define FILTER 0.25f

#define FAR_RAD 1e6f

/* Of the rms that export states for the fit: largest of normally distributed values. */
#define RESIDUALS 3.0f

/* A loop on the output corrects the lost motion itself: added, it would shift the output. */
static float added_rad(const lm_axis *a) {
  return a->output_loop ? 0 : a->correction.correction_rad;
}

/* Motor angles per angle of the output: those of the encoder of the loop. */
static float turns(const lm_axis *a) {
  return a->output_loop ? 1 : a->ratio;
}

static float report(const lm_axis *a, float motor_over_ratio_rad) {
  return motor_over_ratio_rad - added_rad(a) + a->zero_rad;
}

float lm_axis_reported(const lm_axis *a, float motor_rad) {
  return report(a, motor_rad / turns(a));
}

static float size(float value) {
  return value < 0 ? -value : value;
}

/* Finite, and not LM_UNKNOWN. */
static int is_known(float value) {
  return size(value) < LM_UNKNOWN;
}

/* An angle of the motor was measured: not NaN, nor LM_UNKNOWN divided by a ratio. */
static int is_there(float angle_rad) {
  return size(angle_rad) < FAR_RAD;
}

/* Not: NaN, or too coarse. */
static int is_angle(float angle_rad) {
  return size(angle_rad) <= LM_AXIS_ANGLE_MAX_RAD;
}

static void forget_standstill(lm_axis *a) {
  a->standstill.ticks = 0;
  a->stood_s = 0;
}

void lm_axis_forget(lm_axis *a) {
  a->unseen = 1;
  lm_declare_memory_unknown(&a->compensator);
}

static void take_parameters(lm_axis *a, const lm_parameters *parameters) {
  a->follow.period_s = parameters->limits.period_s;
  a->follow.stand_s = LM_AXIS_STAND / parameters->limits.response_per_s;
  a->share = FILTER * parameters->limits.response_per_s * a->follow.period_s;
  a->limit_Nm = parameters->torque_limit_Nm;
  a->step_Nm = parameters->torque_limit_Nm * LM_AXIS_FAST_RAD_S * a->follow.period_s;
  a->creep_Nm_s = parameters->torque_limit_Nm / LM_AXIS_CREEP_S;
  a->rang = 0;
}

static lm_status refuse(lm_fault *fault, lm_status status, const char *input, float found,
                        float most) {
  if (fault) {
    fault->status = status;
    fault->input = input;
    fault->found = found;
    fault->low = -most;
    fault->high = most;
  }
  return status;
}

lm_status lm_axis_power_up(lm_axis *a, const lm_parameters *parameters, lm_axis_kept *kept,
                           const lm_conditions *at, float motor_rad, lm_fault *fault) {
  const float ratio = a->ratio;
  const int output_loop = a->output_loop;
  const float zero_rad = kept ? kept->zero_rad : 0;
  lm_conditions first = *at;
  lm_status status;
  float motor_over_ratio_rad;
  memset(a, 0, sizeof *a);
  a->ratio = ratio;
  a->output_loop = output_loop;
  if (!(size(ratio) > 0 && size(ratio) < LM_UNKNOWN)) {
    return refuse(fault, LM_OUT_OF_RANGE, "ratio", ratio, LM_UNKNOWN);
  }
  motor_over_ratio_rad = motor_rad / turns(a);
  if (!is_angle(motor_over_ratio_rad)) {
    return refuse(fault, LM_OUT_OF_RANGE, "motor_rad", motor_rad,
                  LM_AXIS_ANGLE_MAX_RAD * size(turns(a)));
  }
  if (!is_angle(zero_rad)) {
    return refuse(fault, LM_OUT_OF_RANGE, "zero_rad", zero_rad, LM_AXIS_ANGLE_MAX_RAD);
  }
  a->gravity_Nm = is_known(at->torque_Nm) ? at->torque_Nm : 0;
  status = lm_start_compensator(&a->compensator, parameters, a->gravity_Nm, fault);
  if (status != LM_OK) {
    return status;
  }
  take_parameters(a, parameters);
  a->unseen = 1;
  if (kept) {
    a->commissioned = kept->commissioned == 1 && kept->fingerprint == parameters->fingerprint;
    /* A history that was never saved, or belongs to other parameters, is refused: the memory
     * remains unknown. */
    if (lm_restore_compensator(&a->compensator, &kept->history, 0) == LM_OK &&
        is_known(kept->beyond_Nm) && is_known(kept->gravity_Nm)) {
      a->beyond_Nm = kept->beyond_Nm;
      a->gravity_Nm = is_known(at->torque_Nm) ? at->torque_Nm : kept->gravity_Nm;
      a->unseen = kept->unseen || size(a->gravity_Nm - kept->gravity_Nm) > a->step_Nm;
    }
    kept->history.format = 0;
  }
  first.torque_Nm = a->gravity_Nm + a->beyond_Nm;
  a->torque_Nm = first.torque_Nm;
  a->fed_Nm = first.torque_Nm;
  a->follow.temperature_C = at->temperature_C;
  a->last = *at;
  a->command_Nm = a->gravity_Nm;
  a->sensed_Nm = LM_UNKNOWN;
  a->guided_rad = LM_UNKNOWN;
  a->correction = lm_settle_compensator(&a->compensator, &first);
  if (a->unseen) {
    lm_axis_forget(a);
  }
  a->follow.step_rad_s = LM_FOLLOW_STEP_RAD_S;
  a->state = LM_AXIS_OPEN;
  a->waits = LM_AXIS_WAITS_STAND;
  a->mode = LM_MODE_RUN;
  a->zero_rad = zero_rad;
  a->stood_at_rad = motor_over_ratio_rad;
  a->setpoint_rad = motor_over_ratio_rad;
  a->motor_rad = motor_over_ratio_rad;
  a->seen_rad = motor_over_ratio_rad;
  a->command_rad = report(a, motor_over_ratio_rad);
  return LM_OK;
}

static float approach(float from, float to, float most) {
  return to - from > most ? from + most : from - to > most ? from - most : to;
}

/* A finite number may be a wrong one. */
static float clip(lm_axis *a, float torque_Nm) {
  const float clipped_Nm = approach(0, torque_Nm, a->limit_Nm);
  a->clipped = a->clipped || size(torque_Nm) > a->limit_Nm;
  return clipped_Nm;
}

/* A jump of gravity that is no change of the load, with the zero or a payload: the torque in use
 * stays. A sensor has it already, and what it adds compensates the jump. Otherwise the offset does:
 * of a current as far as friction may have hidden it, where gravity is known better. */
static void absorb_jump(lm_axis *a, float jump_Nm) {
  if (a->source == LM_AXIS_COMMAND) {
    a->off_Nm -= jump_Nm;
  } else {
    a->beyond_Nm -= jump_Nm;
    a->believed_Nm -= jump_Nm;
  }
  if (a->source == LM_AXIS_CURRENT) {
    const float kept_Nm = a->believed_Nm;
    a->believed_Nm = 0;
    a->off_Nm += kept_Nm - lm_hold_torque(&a->believed_Nm, a->beyond_Nm, a->bound_Nm);
    lm_axis_forget(a);
  }
}

/* The torque of the command. Its changes are fed forward, those that the load makes, and no faster
 * than an axis can turn: one wrong acceleration is no blow. */
static void take_command(lm_axis *a, float commanded_Nm) {
  const float before_Nm = a->command_Nm;
  const float jumped_Nm = clip(a, before_Nm + a->jump_Nm);
  commanded_Nm = clip(a, commanded_Nm);
  a->command_Nm =
      a->state != LM_AXIS_CLOSED ? commanded_Nm : approach(jumped_Nm, commanded_Nm, a->step_Nm);
  if (size(a->jump_Nm) > 0) {
    absorb_jump(a, jumped_Nm - before_Nm);
    a->jump_Nm = 0;
  }
  if (a->state == LM_AXIS_CLOSED) {
    a->fed_Nm += a->command_Nm - jumped_Nm;
  }
}

/* A measured source moves the torque: it begins only while the motor does not follow, and from the
 * torque in use. */
static void change_source(lm_axis *a, lm_axis_source source) {
  if (source == a->source || (source != LM_AXIS_COMMAND && a->state == LM_AXIS_CLOSED)) {
    a->source_waits = source != a->source;
    return;
  }
  a->source = source;
  a->source_waits = 0;
  a->beyond_Nm = a->torque_Nm - a->command_Nm - a->off_Nm;
  a->believed_Nm = a->beyond_Nm;
  forget_standstill(a);
}

/* A measured source is in use while it is there, or lost for a short time only. */
static void measure(lm_axis *a, lm_axis_source source, float sensed_Nm) {
  const int there = is_known(sensed_Nm);
  a->lost_s = there ? 0 : a->lost_s + a->follow.period_s;
  if (a->lost_s >= a->follow.stand_s) {
    change_source(a, LM_AXIS_COMMAND);
    lm_axis_forget(a);
  } else if (there) {
    change_source(a, source);
  }
  a->source_waits = a->source != source;
  a->source_lost = a->source_waits;
  a->input_missing = a->input_missing || !there;
  if (there && a->source == source && !(a->still && source == LM_AXIS_CURRENT)) {
    a->sensed_Nm = clip(a, sensed_Nm);
    a->beyond_Nm += a->share * (a->sensed_Nm - a->command_Nm - a->beyond_Nm);
  }
}

/* What becomes known of the load while the drive bears it, its integrator bears already; and a
 * measurement that is fed forward closes a loop around the joint: both creep. A drive that has been
 * disabled may still stop with it. On a lost bus it gets nothing. */
static void feed(lm_axis *a, float torque_Nm) {
  const float rate_Nm_s =
      a->unfeeds ? a->creep_Nm_s * LM_AXIS_CREEP_S / LM_AXIS_FEED_S : a->creep_Nm_s;
  const float end_Nm = a->unfeeds || a->unfed ? 0 : torque_Nm;
  a->fed_Nm = approach(a->fed_Nm, end_Nm, a->lost_ticks ? 0 : a->follow.period_s * rate_Nm_s);
}

static float use(lm_axis *a, float beyond_Nm) {
  const float most_Nm =
      a->state == LM_AXIS_CLOSED ? a->follow.period_s * a->creep_Nm_s : LM_UNKNOWN;
  a->off_Nm = approach(a->off_Nm, 0, most_Nm);
  a->torque_Nm = a->command_Nm + beyond_Nm + a->off_Nm;
  feed(a, a->torque_Nm);
  return a->torque_Nm;
}

float lm_axis_gravity(lm_axis *a, float gravity_Nm, int homed) {
  a->homed = homed;
  if (!homed) {
    if (a->source == LM_AXIS_COMMAND) {
      lm_axis_forget(a);
    }
    return a->gravity_Nm;
  }
  if (!is_known(gravity_Nm)) {
    return gravity_Nm;
  }
  if (size(gravity_Nm - a->gravity_Nm) > a->step_Nm) {
    if (a->source == LM_AXIS_COMMAND) { /* no measurement has it */
      a->off_Nm += a->beyond_Nm;
      a->beyond_Nm = 0;
      lm_axis_forget(a);
    }
    a->jump_Nm = gravity_Nm - a->gravity_Nm;
    forget_standstill(a);
  }
  a->gravity_Nm = gravity_Nm;
  return gravity_Nm;
}

float lm_axis_use_command(lm_axis *a, float commanded_Nm) {
  if (!is_known(commanded_Nm)) {
    lm_axis_forget(a);
    return commanded_Nm;
  }
  take_command(a, commanded_Nm);
  change_source(a, LM_AXIS_COMMAND);
  a->source_lost = 0;
  a->sensed_Nm = LM_UNKNOWN;
  return use(a, a->beyond_Nm);
}

float lm_axis_use_sensor(lm_axis *a, float commanded_Nm, float sensed_Nm) {
  if (!is_known(commanded_Nm)) {
    lm_axis_forget(a);
    return commanded_Nm;
  }
  take_command(a, commanded_Nm);
  measure(a, LM_AXIS_SENSOR, sensed_Nm);
  return use(a, a->beyond_Nm);
}

float lm_axis_use_current(lm_axis *a, const lm_motor *motor, float commanded_Nm, float current_A,
                          float motor_rad_s, float acceleration_rad_s2, int follows) {
  const int bears = follows && a->state >= LM_AXIS_PAUSED;
  const lm_axis_source before = a->source;
  lm_motor here = *motor;
  float sensed_Nm;
  here.ratio = a->output_loop ? motor->ratio : a->ratio;
  sensed_Nm =
      lm_estimate_torque(&here, current_A, motor_rad_s,
                         here.ratio * (acceleration_rad_s2 + a->correction.acceleration_rad_s2));
  if (!is_known(commanded_Nm)) {
    lm_axis_forget(a);
    return commanded_Nm;
  }
  take_command(a, commanded_Nm);
  a->motor_rad_s = motor_rad_s;
  a->borne_s = bears ? a->borne_s + a->follow.period_s : 0;
  if (a->borne_s < a->follow.stand_s) {
    change_source(a, LM_AXIS_COMMAND);
    a->source_waits = 1;
    a->source_lost = 0;
  } else {
    measure(a, LM_AXIS_CURRENT, sensed_Nm);
  }
  if (a->source_waits) {
    return use(a, a->beyond_Nm);
  }
  if (a->still) {
    return use(a, a->believed_Nm);
  }
  if (before != LM_AXIS_CURRENT) {
    a->bound_Nm = lm_bound_torque(&here, a->torque_Nm, 0);
  }
  a->bound_Nm += a->share * (lm_bound_torque(&here, a->sensed_Nm, motor_rad_s) - a->bound_Nm);
  return use(a, lm_hold_torque(&a->believed_Nm, a->beyond_Nm, a->bound_Nm));
}

static float rate(const lm_axis *a) {
  return a->guides ? a->correction.velocity_rad_s + a->guide_rad_s
         : a->state == LM_AXIS_CLOSED
             ? a->correction.velocity_rad_s + a->moved_rad / a->follow.period_s
             : 0;
}

/* Around the setpoint: what a position loop yields, and the way of a motor that is behind, or stops. */
static float find_room(const lm_axis *a) {
  return LM_AXIS_APART_RAD + a->fast_rad_s * a->follow.stand_s;
}

/* The position loop holds the motor near the setpoint, as near as it has time to. An angle that does
 * not change while the setpoint does is not that of the motor. */
static void judge_motor(lm_axis *a, float motor_over_ratio_rad) {
  const float period_s = a->follow.period_s;
  const float moved_rad = motor_over_ratio_rad - a->motor_rad;
  const float rate_rad_s = size(a->state == LM_AXIS_OPEN ? moved_rad / period_s : rate(a));
  const float apart_rad = motor_over_ratio_rad - a->setpoint_rad;
  a->parted = 0;
  if (!is_there(motor_over_ratio_rad)) {
    return;
  }
  a->fast_rad_s -= a->fast_rad_s * period_s / a->follow.stand_s;
  a->fast_rad_s = rate_rad_s > a->fast_rad_s ? rate_rad_s : a->fast_rad_s;
  if (size(moved_rad) > 0) {
    a->seen_rad = a->setpoint_rad;
  }
  a->motor_rad = motor_over_ratio_rad;
  a->parted =
      a->state >= LM_AXIS_PAUSED && !a->holds &&
      (size(apart_rad) > find_room(a) || size(a->setpoint_rad - a->seen_rad) > LM_AXIS_APART_RAD);
}

/* 1: the command continues. */
static int follow_planner(lm_axis *a, float elapsed_s, float wish_rad) {
  const float most_rad = LM_AXIS_ANGLE_MAX_RAD - find_room(a);
  const int missed = is_known(elapsed_s) && elapsed_s * LM_AXIS_STAND > a->follow.stand_s;
  float next_rad;
  if (!lm_follow_wish(&a->follow, &a->command_rad, wish_rad) || missed) {
    return 0;
  }
  next_rad = size(a->command_rad - a->zero_rad + added_rad(a));
  a->far = next_rad > most_rad && next_rad > size(a->setpoint_rad);
  return !a->far;
}

/* While the planner rests and the motor has not moved either, friction bears any change of the
 * current: its bound is known only for the friction that was stated. A motor that has moved
 * (another load) has to stand for the time of the filter again. */
static void find_stillness(lm_axis *a, float motor_over_ratio_rad) {
  const float apart_rad = motor_over_ratio_rad - a->setpoint_rad;
  const int rests = a->follow.rested_s >= LM_FOLLOW_REST_S;
  if (!rests) {
    a->still_s = a->follow.stand_s;
    a->still_at_rad = apart_rad;
  } else if (!(size(apart_rad - a->still_at_rad) < LM_AXIS_STILL_RAD)) {
    a->still_s = 0;
    a->still_at_rad = apart_rad;
  } else {
    a->still_s += a->follow.period_s;
  }
  a->still = rests && a->still_s >= a->follow.stand_s;
}

/* With the motor at rest the correction moves nothing. What looks like ringing then is the load
 * that swings against the brake. */
static void judge_ringing(lm_axis *a) {
  const int rings = (a->correction.status & LM_STATE_RINGING) != 0;
  if (a->state == LM_AXIS_CLOSED) {
    a->rang = rings;
  } else if (rings && !a->rang) {
    lm_set_mode(&a->compensator, LM_MODE_RESET);
    lm_set_mode(&a->compensator, a->mode);
    forget_standstill(a);
  }
}

/* The target is not that of the actual load; the open motor moves, is not at the setpoint that the
 * drive would take, or its angle is lost. */
#define NOT_TO_CLOSE (LM_STATE_CONDITION_MISSING | LM_STATE_INPUT_REFUSED)
static lm_axis_wait judge_standstill(lm_axis *a, float motor_over_ratio_rad) {
  const int missing = a->input_missing || (a->correction.status & NOT_TO_CLOSE);
  const float apart_rad = size(motor_over_ratio_rad - a->setpoint_rad);
  const float moved_rad = size(motor_over_ratio_rad - a->stood_at_rad);
  const int moves = a->state == LM_AXIS_OPEN
                        ? !is_angle(motor_over_ratio_rad) || !(apart_rad < LM_AXIS_STILL_RAD) ||
                              !(moved_rad < LM_AXIS_STILL_RAD)
                        : !(apart_rad < LM_AXIS_APART_RAD);
  if (a->state == LM_AXIS_OPEN && moved_rad >= LM_AXIS_STILL_RAD) {
    lm_axis_forget(a); /* what moves it may be no torque of the command */
  }
  a->stood_s = lm_find_standstill(&a->compensator, &a->standstill);
  a->input_missing = 0;
  if (moves || missing) {
    a->stood_at_rad = motor_over_ratio_rad;
    forget_standstill(a);
  }
  return moves                            ? LM_AXIS_WAITS_MOTOR
         : missing                        ? LM_AXIS_WAITS_CONDITION
         : a->stood_s < a->follow.stand_s ? LM_AXIS_WAITS_STAND
                                          : LM_AXIS_READY;
}

/* A fade, or ringing: the correction moves, the joint does not. */
static int moves_alone(lm_axis *a) {
  const uint32_t state = a->correction.status & (LM_STATE_FADED | LM_STATE_RINGING);
  if (state != a->moving_state) {
    a->moving_state = state;
    a->alone = 1;
    forget_standstill(a);
  }
  a->alone = a->alone && a->stood_s < a->follow.stand_s;
  return a->alone;
}

/* A test moves the axis, once it would have been closed. */
static void follow_guide(lm_axis *a, int follows) {
  const float before_rad = a->guided_rad;
  a->guides = a->guided && follows && a->state == LM_AXIS_PAUSED &&
              (a->guides || a->waits == LM_AXIS_WAITS_PLANNER);
  a->unfed = a->state == LM_AXIS_OPEN ? a->guided : a->unfed;
  a->guided = 0;
  a->guided_rad = LM_UNKNOWN;
  if (a->guides &&
      size(a->guide_rad + a->guide.correction_rad - a->setpoint_rad) < LM_AXIS_APART_RAD) {
    a->guide.status = a->correction.status;
    a->correction = a->guide;
    a->setpoint_rad = a->guide_rad + added_rad(a);
    a->moved_rad = is_known(before_rad) ? a->guide_rad - before_rad : 0;
    a->guided_rad = a->guide_rad;
    a->command_rad = a->guide_rad + a->zero_rad;
  }
}

/* In LM_AXIS_CLOSED a condition is neither lost nor found: the last value stays; after more than
 * LM_FOLLOW_LOST_TICKS without it until the axis is paused or open. */
static void keep_conditions(lm_axis *a, lm_conditions *now) {
  const int closed = a->state == LM_AXIS_CLOSED;
  int missing = 0;
#define MISSES(field, ...) missing = missing || (is_known(a->last.field) && !is_known(now->field));
#define KEEPS(field, ...)                                                           \
  if (closed && (a->frozen || !is_known(now->field) || !is_known(a->last.field))) { \
    now->field = a->last.field;                                                     \
  }
#define PASSES(...)
  LM_CONDITION_LIST(PASSES, MISSES, MISSES, PASSES)
  a->missing_ticks = missing ? a->missing_ticks + 1 : 0;
  a->frozen = closed && (a->frozen || a->missing_ticks > LM_FOLLOW_LOST_TICKS);
  a->condition_waits = a->frozen || missing;
  LM_CONDITION_LIST(PASSES, KEEPS, KEEPS, PASSES)
  a->last = *now;
#undef MISSES
#undef KEEPS
#undef PASSES
}

static void step(lm_axis *a, const lm_conditions *at, float motor_over_ratio_rad, float wish_rad,
                 int follows) {
  const int rests = a->follow.rested_s >= LM_FOLLOW_REST_S;
  lm_conditions now = *at;
  int begins;
  if (!a->begun) {
    now.elapsed_s = 0; /* a start takes longer than a period */
    a->begun = 1;
  }
  now.temperature_C =
      lm_follow_temperature(&a->follow, at->temperature_C, a->state == LM_AXIS_CLOSED);
  keep_conditions(a, &now);
  a->correction = lm_step_compensator(&a->compensator, &now);
  if (a->unseen) {
    lm_axis_forget(a);
  }
  a->correction.status |= a->clipped ? LM_STATE_TORQUE_CLIPPED : 0;
  a->clipped = 0;
  a->lost_ticks = is_there(motor_over_ratio_rad) ? 0 : a->lost_ticks + 1;
  judge_motor(a, motor_over_ratio_rad);
  if (a->state == LM_AXIS_CLOSED && !(follows && a->lost_ticks <= LM_FOLLOW_LOST_TICKS &&
                                      follow_planner(a, now.elapsed_s, wish_rad))) {
    a->state = LM_AXIS_PAUSED;
    forget_standstill(a);
    if (!rests) {
      lm_axis_forget(a);
    }
  }
  a->holds = a->holds || (a->state == LM_AXIS_PAUSED &&
                          (float)a->lost_ticks * a->follow.period_s > a->follow.stand_s);
  a->waits = judge_standstill(a, motor_over_ratio_rad);
  judge_ringing(a);
  if (a->state == LM_AXIS_CLOSED) {
    a->waits = LM_AXIS_READY;
    a->unseen = a->unseen && (a->source_lost || size(a->off_Nm) > 0);
    find_stillness(a, motor_over_ratio_rad);
    a->unwatched_s += a->follow.period_s;
    a->late_s = size(a->follow.late_rad) >= LM_FOLLOW_NEAR_RAD ? a->late_s + a->follow.period_s : 0;
    if (a->late_s > a->follow.stand_s) { /* it does not shift: at rest it begins at the command */
      (void)lm_axis_pause(a);
    }
    a->moved_rad = a->follow.moved_rad;
    a->setpoint_rad = a->command_rad - a->zero_rad + added_rad(a);
    if (a->output_loop && moves_alone(a)) {
      a->correction.velocity_rad_s = 0;
      a->correction.acceleration_rad_s2 = 0;
    }
    return;
  }
  a->still = 0;
  a->still_s = 0;
  a->moved_rad = 0;
  a->correction.velocity_rad_s = 0; /* the motor does not follow */
  a->correction.acceleration_rad_s2 = 0;
  a->at_motor =
      (a->holds || (a->state == LM_AXIS_OPEN && !follows)) && is_there(motor_over_ratio_rad);
  if (a->at_motor) {
    a->setpoint_rad = motor_over_ratio_rad; /* no position error */
    a->seen_rad = motor_over_ratio_rad;
    a->holds = 0;
  }
  a->command_rad = report(a, a->setpoint_rad);
  begins = lm_follow_waits(&a->follow, a->command_rad, wish_rad) && !a->guided;
  if (a->state == LM_AXIS_PAUSED && a->waits == LM_AXIS_READY) {
    a->waits = a->source_waits    ? LM_AXIS_WAITS_SOURCE
               : !follows         ? LM_AXIS_WAITS_DRIVE
               : !begins          ? LM_AXIS_WAITS_PLANNER
               : !a->commissioned ? LM_AXIS_WAITS_COMMISSION
                                  : LM_AXIS_READY;
    a->state = begins && a->waits == LM_AXIS_READY ? LM_AXIS_CLOSED : LM_AXIS_PAUSED;
  }
  if (a->state == LM_AXIS_PAUSED && a->far && a->waits == LM_AXIS_WAITS_STAND) {
    a->waits = LM_AXIS_WAITS_ANGLE;
  }
  follow_guide(a, follows);
}

float lm_axis_tick(lm_axis *a, const lm_conditions *at, float motor_rad, float wish_rad,
                   int follows) {
  if (a->state == LM_AXIS_OFF) {
    a->waits = LM_AXIS_WAITS_START;
  } else {
    step(a, at, motor_rad / turns(a), wish_rad, follows);
  }
  return a->setpoint_rad * turns(a);
}

float lm_axis_rate(const lm_axis *a) {
  return rate(a) * a->ratio;
}

float lm_axis_feed(const lm_axis *a) {
  return a->state == LM_AXIS_OFF
             ? 0
             : -approach(0, a->guides ? a->guide_Nm : a->fed_Nm, a->limit_Nm) / a->ratio;
}

int lm_axis_guide(lm_axis *a, float command_rad, const lm_correction *correction) {
  a->guided = 1;
  a->guide_rad = command_rad;
  if (correction) {
    a->guide = *correction;
  }
  return a->guides;
}

lm_axis_wait lm_axis_close(lm_axis *a) {
  if (a->state != LM_AXIS_OPEN) {
    return a->state == LM_AXIS_OFF ? LM_AXIS_WAITS_START : LM_AXIS_READY;
  }
  a->unfed = a->unfed || a->guided;
  if (!a->commissioned && !a->unfed) {
    a->waits = LM_AXIS_WAITS_COMMISSION;
  } else if (a->waits == LM_AXIS_READY && a->stood_s < a->follow.stand_s) {
    a->waits = LM_AXIS_WAITS_STAND; /* a change since the tick */
  }
  if (a->waits == LM_AXIS_READY) {
    a->state = LM_AXIS_PAUSED;
    a->fed_Nm = a->unfed ? 0 : a->torque_Nm;
  }
  return a->waits;
}

void lm_axis_hold(lm_axis *a) {
  if (a->state == LM_AXIS_OPEN) {
    a->state = LM_AXIS_PAUSED;
    a->holds = 1;
    forget_standstill(a);
  }
}

lm_axis_wait lm_axis_pause(lm_axis *a) {
  if (a->state < LM_AXIS_PAUSED) {
    return a->state == LM_AXIS_OFF ? LM_AXIS_WAITS_START : LM_AXIS_WAITS_LOOP;
  }
  if (a->state == LM_AXIS_CLOSED && a->follow.rested_s < LM_FOLLOW_REST_S) {
    return LM_AXIS_WAITS_PLANNER;
  }
  a->state = LM_AXIS_PAUSED;
  a->waits = LM_AXIS_WAITS_STAND;
  forget_standstill(a);
  return LM_AXIS_READY;
}

void lm_axis_open(lm_axis *a) {
  if (a->state == LM_AXIS_CLOSED && a->follow.rested_s < LM_FOLLOW_REST_S) {
    lm_axis_forget(a);
  }
  if (a->state >= LM_AXIS_PAUSED) {
    a->state = LM_AXIS_OPEN;
    a->waits = LM_AXIS_WAITS_STAND;
    a->parted = 0;
    a->far = 0;
    a->stood_at_rad = a->motor_rad;
    forget_standstill(a);
  }
}

lm_axis_wait lm_axis_set_mode(lm_axis *a, lm_mode mode) {
  if (a->state == LM_AXIS_CLOSED && mode != LM_MODE_HOLD && lm_axis_pause(a)) {
    return LM_AXIS_WAITS_PLANNER;
  }
  lm_set_mode(&a->compensator, mode);
  a->mode = mode;
  a->rang = mode == LM_MODE_RESET ? 0 : a->rang;
  forget_standstill(a);
  return LM_AXIS_READY;
}

lm_axis_wait lm_axis_headroom(lm_axis *a, const lm_headroom *headroom) {
  if (a->state == LM_AXIS_CLOSED && lm_axis_pause(a)) {
    return LM_AXIS_WAITS_PLANNER;
  }
  lm_set_headroom(&a->compensator, headroom);
  forget_standstill(a);
  return LM_AXIS_READY;
}

lm_status lm_axis_change(lm_axis *a, const lm_parameters *parameters, lm_fault *fault) {
  const lm_parameters *before = a->compensator.parameters;
  lm_status status;
  if (a->state == LM_AXIS_CLOSED && lm_axis_pause(a)) {
    return refuse(fault, LM_INCONSISTENT, "wish_rad", a->moved_rad, 0);
  }
  status = lm_change_parameters(&a->compensator, parameters, fault);
  if (status == LM_OK) {
    a->commissioned = a->commissioned && parameters->fingerprint == before->fingerprint;
    take_parameters(a, parameters);
  }
  forget_standstill(a);
  return status;
}

/* Largest change of the lost motion by the declared error of the torque; not declared, it is beyond
 * the limit. The torque of the command without a zero may be any. */
static float find_wind_up(const lm_axis *a) {
  const int any = a->source == LM_AXIS_COMMAND && !a->homed;
  const float error_Nm = any ? a->limit_Nm : a->compensator.torque_error_Nm;
  lm_conditions at = a->last;
  lm_memory trial;
  float most_rad = 0;
  int k;
  for (k = -1; k <= 1 && error_Nm <= a->limit_Nm; k += 2) {
    float by_rad;
    at.torque_Nm = a->torque_Nm + (float)k * error_Nm;
    by_rad = lm_evaluate_model(a->compensator.parameters, &a->compensator.memory, &trial, &at) -
             a->compensator.lost_motion_rad;
    most_rad = size(by_rad) > most_rad ? size(by_rad) : most_rad;
  }
  return most_rad;
}

float lm_axis_reference(lm_axis *a, float motor_rad, float angle_rad) {
  const float shift_rad = angle_rad - lm_axis_reported(a, motor_rad);
  const float lags_rad = a->correction.correction_rad + a->correction.lost_motion_rad;
  if (a->state == LM_AXIS_OFF || !is_angle(a->zero_rad + shift_rad) ||
      (a->homed && size(shift_rad) > LM_AXIS_APART_RAD)) {
    return -1;
  }
  a->command_rad += shift_rad;
  a->zero_rad += shift_rad;
  a->follow.late_rad += shift_rad;
  if (a->state != LM_AXIS_CLOSED) {
    a->follow.late_rad = 0;
  }
  forget_standstill(a); /* a torque that is computed from the angle changes */
  return a->output_loop ? 0
                        : size(lags_rad) + lm_bound_uncertainty(&a->compensator) + find_wind_up(a) +
                              RESIDUALS * a->compensator.parameters->watch.noise_rad;
}

float lm_axis_index(lm_axis *a, float latched_rad, float index_rad) {
  return lm_axis_reference(a, latched_rad, index_rad - added_rad(a));
}

void lm_axis_turn(lm_axis *a, float by_rad) {
  if (is_known(by_rad)) {
    a->setpoint_rad += by_rad;
    a->stood_at_rad += by_rad;
    a->motor_rad += by_rad;
    a->seen_rad += by_rad;
    a->command_rad += by_rad;
    a->follow.rest_rad += by_rad;
  }
}

void lm_axis_watch(lm_axis *a, float output_rad) {
  if (a->state == LM_AXIS_CLOSED && a->lost_ticks == 0 && a->unwatched_s > 0 && !a->output_loop) {
    lm_watch_output(&a->compensator, output_rad - a->motor_rad, a->unwatched_s);
    a->unwatched_s = 0;
  }
}

lm_axis_wait lm_axis_power_down(lm_axis *a, lm_axis_kept *kept) {
  if (a->state != LM_AXIS_OPEN) {
    return a->state == LM_AXIS_OFF ? LM_AXIS_WAITS_START : LM_AXIS_WAITS_LOOP;
  }
  if (a->stood_s < a->follow.stand_s) {
    return a->waits == LM_AXIS_READY ? LM_AXIS_WAITS_STAND : a->waits;
  }
  lm_save_compensator(&a->compensator, &kept->history);
  kept->beyond_Nm = a->beyond_Nm;
  kept->gravity_Nm = a->gravity_Nm;
  kept->zero_rad = a->zero_rad;
  kept->unseen = a->unseen;
  kept->commissioned = a->commissioned;
  kept->fingerprint = a->compensator.parameters->fingerprint;
  a->state = LM_AXIS_OFF;
  return LM_AXIS_READY;
}
