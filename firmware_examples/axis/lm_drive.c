#include "lm_drive.h"

#include <string.h>

/* The report of this tick. 1: the drive left its operation, though it should be in it, or does not
 * hold the motor. */
static int take_report(lm_drive *d, lm_axis *a, const lm_drive_report *report) {
  const int parts = a->parted && d->operated && d->release;
  const int operated = d->operated;
  int tripped;
  int left;
  d->last = report->lost ? d->last : *report;
  d->last.fault = d->last.fault || (!d->own_brake && a->lost_ticks > LM_FOLLOW_LOST_TICKS);
  left = operated && !d->last.enabled;
  d->operated = d->last.enabled && !d->last.fault;
  d->ending = d->ending && d->operated;
  d->ended = parts ? LM_AXIS_WAITS_PARTED : d->ended;
  tripped = d->last.fault || parts || (left && d->enable);
  if (tripped && operated) {
    lm_axis_forget(a);
  }
  if (d->last.fault || left || parts || (d->operated ? d->last.other_mode : d->last.preparing)) {
    lm_axis_open(a);
  }
  return tripped;
}

static void judge_command(lm_drive *d, const lm_axis *a, int tripped, int run) {
  const float period_s = a->follow.period_s;
  d->armed = a->state != LM_AXIS_OFF && a->begun && (!run || (d->armed && !tripped));
  d->enabling_s = run && d->armed && !d->operated ? d->enabling_s + period_s : 0;
  if (d->enabling_s > LM_DRIVE_ENABLING_S) {
    d->armed = 0;
    d->ended = d->wait;
  }
  d->runs = run && d->armed;
  d->ended = d->runs ? LM_AXIS_READY : d->ended;
}

static lm_axis_wait start(lm_drive *d, lm_axis *a) {
  if (d->ending) { /* it may have moved away from the setpoint */
    return LM_AXIS_WAITS_DRIVE;
  }
  d->stopped_s = 0;
  if (a->state == LM_AXIS_OPEN) {
    if (d->last.other_mode || ((d->last.preparing || d->leave) && !d->operated)) {
      d->enable = d->enable && d->operated;
      return LM_AXIS_WAITS_DRIVE;
    }
    if (d->operated && d->release) { /* back from another mode */
      lm_axis_hold(a);
    } else if (lm_axis_close(a) != LM_AXIS_READY) {
      d->enable = d->enable && d->operated;
      if (a->waits == LM_AXIS_WAITS_COMMISSION) { /* another request */
        d->armed = 0;
        d->runs = 0;
        d->ended = a->waits;
      }
      return a->waits;
    }
  }
  d->enable = 1;
  return a->waits;
}

/* The setpoint stays; then the brake bears the load, or the drive has withdrawn from the
 * command. */
static void stop(lm_drive *d, lm_axis *a, int at_once, float period_s) {
  d->stopped_s += period_s;
  d->release = 0;
  if (at_once || d->own_brake || d->stopped_s >= d->closing_s) {
    d->enable = 0;
  }
  d->ending = d->own_brake && d->operated && !d->enable;
  if (!d->enable && !(d->own_brake && (d->operated || d->stopped_s < LM_FOLLOW_REST_S))) {
    lm_axis_open(a);
  }
}

/* Another mode may ignore the torque that is fed forward, or the position loop of the drive. */
static void leave(lm_drive *d, lm_axis *a, int rests) {
  a->unfeeds = rests && (d->leave || d->last.other_mode);
  d->may_leave = d->leave && a->unfeeds && a->state != LM_AXIS_CLOSED &&
                 (!d->operated || lm_follow_size(a->fed_Nm) <= 0);
}

void lm_drive_step(lm_drive *d, lm_axis *a, const lm_drive_report *report, int run) {
  const float period_s = a->follow.period_s;
  const int tripped = take_report(d, a, report);
  const int rests = a->state != LM_AXIS_CLOSED || a->follow.rested_s >= LM_FOLLOW_REST_S;
  judge_command(d, a, tripped, run);
  if (d->runs) {
    d->wait = start(d, a);
    d->release = d->enable && d->operated;
  } else if (rests || d->own_stop || d->last.fault) {
    stop(d, a, tripped, period_s);
  }
  d->wait = d->runs ? d->wait : d->ended ? d->ended : LM_AXIS_WAITS_COMMAND;
  d->released_s = d->release ? d->released_s + period_s : 0;
  leave(d, a, rests);
  d->follows = !a->unfeeds && d->release && !(d->standstill && rests) &&
               a->state >= LM_AXIS_PAUSED && d->released_s >= d->opening_s;
}

void lm_drive_part(lm_drive *d, lm_axis *a) {
  d->armed = 0;
  d->runs = 0;
  d->ended = LM_AXIS_WAITS_PARTED;
  d->enable = 0;
  d->release = 0;
  d->follows = 0;
  lm_axis_forget(a);
}

const char *lm_drive_sentence(const lm_drive *d) {
  static const char *const sentences[] = {
      [LM_AXIS_READY] = "The axis is closed, or about to be.",
      [LM_AXIS_WAITS_START] = "Not started: call the power-up, and read its fault.",
      [LM_AXIS_WAITS_LOOP] = "The position loop is not in the state that the request needs.",
      [LM_AXIS_WAITS_CONDITION] = "A condition or the measured torque is missing or not finite.",
      [LM_AXIS_WAITS_MOTOR] =
          "The motor moves behind the brake, is not at the setpoint, or its angle is missing.",
      [LM_AXIS_WAITS_STAND] = "The correction has not stood for LM_AXIS_STAND yet.",
      [LM_AXIS_WAITS_SOURCE] =
          "The measured torque is not in use yet: the drive has not borne the load long enough, or "
          "the measurement is lost.",
      [LM_AXIS_WAITS_DRIVE] =
          "The drive does not follow: not enabled, another mode, or its brake still opens.",
      [LM_AXIS_WAITS_PLANNER] = "The planner is not at rest at command_rad.",
      [LM_AXIS_WAITS_ANGLE] =
          "The planner went further than LM_AXIS_ANGLE_MAX_RAD: back, or lm_axis_turn.",
      [LM_AXIS_WAITS_COMMAND] =
          "No command: run is 0, or has to be 0 once (after a power-up, a trip, 5 s of waiting).",
      [LM_AXIS_WAITS_PARTED] =
          "The motor was parted from the setpoint: check encoder, brake and position loop.",
      [LM_AXIS_WAITS_COMMISSION] =
          "Not commissioned with these parameters: start the commissioning, then run 1.",
  };
  const size_t count = sizeof sentences / sizeof sentences[0];
  return (size_t)d->wait < count ? sentences[d->wait] : "";
}

static int is_off(const lm_drive *d) {
  return !d->operated && !d->enable && !d->release;
}

lm_status lm_drive_power_up(const lm_drive *d, lm_axis *a, const lm_parameters *parameters,
                            lm_axis_kept *kept, const lm_conditions *at, float motor_rad,
                            lm_fault *fault) {
  if (is_off(d) && (d->own_brake || d->closing_s > 0)) {
    return lm_axis_power_up(a, parameters, kept, at, motor_rad, fault);
  }
  if (fault) {
    memset(fault, 0, sizeof *fault);
    fault->status = LM_INCONSISTENT;
    fault->input = is_off(d) ? "closing_s" : "enable";
    fault->found = is_off(d) ? d->closing_s : 1;
  }
  return LM_INCONSISTENT;
}

lm_axis_wait lm_drive_power_down(const lm_drive *d, lm_axis *a, lm_axis_kept *kept) {
  return is_off(d) ? lm_axis_power_down(a, kept) : LM_AXIS_WAITS_LOOP;
}
