/* The drive of an axis and its brake: when the drive is enabled, when the brake is released, when
 * the loop of lm_axis.h is closed and opened. Three kinds of drive:
 *
 *     own_brake  own_stop
 *     0          0         the host commands the brake
 *     1          0         the drive releases its brake when it is enabled
 *     1          1         it also stops with its own ramp when it is disabled in motion
 *
 * The host sets the first four values of a zeroed struct once, calls lm_drive_step in every tick,
 * before the torque and lm_axis_tick, and passes `enable` and `release` on in that tick. */
#ifndef LM_DRIVE_H
#define LM_DRIVE_H

#include "lm_axis.h"

/* A drive that is not enabled for so long after the command has a reason, such as safe torque off:
 * the command has expired, so that the axis does not start by itself when that ends. */
#define LM_DRIVE_ENABLING_S 5.0f

/* What the drive reports in this tick. All 0: at rest, disabled. */
typedef struct lm_drive_report {
  int enabled;    /* in operation, in any mode */
  int other_mode; /* not the mode that follows the setpoint */
  int fault;      /* trip, safe torque off; not the button of the emergency stop, with which the
                     planner stops the axis. The position loop of the host (own_brake 0) has one,
                     too, without the motor's angle for more than LM_FOLLOW_LOST_TICKS */
  int preparing;  /* not enabled yet, and cannot be in the next cycle */
  int lost;       /* no report (bus): the last one is used */
} lm_drive_report;

typedef struct lm_drive {
  int own_brake;
  int own_stop;
  /* Times of the brake, each the longest that occurs (worn, cold, slow suppressor): if they are too
   * short, the drive moves against the brake, or the load falls; longer, the axis only waits. */
  float opening_s;   /* from the command, or from the report that the drive is enabled */
  float closing_s;   /* until it bears the load; own_brake: not used */
  int standstill;    /* monitored, with the brake open: once the planner rests the setpoint stays */
  int leave;         /* another mode is wanted: once the planner rests the feed-forward ends */
  int may_leave;     /* it may be requested */
  int enable;        /* to the drive: position loop at the setpoint */
  int release;       /* to the brake; own_brake: the drive has been told so by `enable` */
  int follows;       /* for lm_axis_tick and lm_axis_use_current */
  lm_axis_wait wait; /* why the axis is not LM_AXIS_CLOSED */
  lm_drive_report last;
  int armed;    /* run has been 0 since the power-up, a trip, an expired command */
  int operated; /* enabled, without a fault */
  int runs;     /* the axis shall be closed */
  /* Why the last command has ended, until the next one; LM_AXIS_READY: by run 0 or the drive. */
  lm_axis_wait ended;
  int ending; /* disabled, and has not left its operation yet */
  float enabling_s;
  float released_s;
  float stopped_s;
} lm_drive;

/* run: command of the operator. 1: the axis is closed once everything stands; after a power-up, a
 * trip, or a command that was refused (not commissioned) or has waited for LM_DRIVE_ENABLING_S,
 * only after run has been 0. A motor that the drive does not hold at the setpoint (LM_AXIS_APART_RAD), or whose angle does not change while
 * the setpoint does, is a trip: `enable` and `release` 0 at once. 0: once
 * the planner rests (own_stop: at once) the setpoint stays, the brake is closed, the drive
 * disabled. In another mode the setpoint follows the motor; back from it, the motor is held where
 * it is until the correction stands. */
void lm_drive_step(lm_drive *d, lm_axis *a, const lm_drive_report *report, int run);

/* A trip after the step of this tick: the motor is not where it should be. */
void lm_drive_part(lm_drive *d, lm_axis *a);

/* Why the axis is not LM_AXIS_CLOSED: d->wait. After a command that has expired or was refused: what
 * it waited for. */
const char *lm_drive_sentence(const lm_drive *d);

/* Before the first step, the brake on: lm_axis_power_up, and refused while the drive is enabled or
 * the brake released, or without the closing time of a brake of the host: LM_INCONSISTENT
 * ("enable", "closing_s"); then nothing has changed. */
lm_status lm_drive_power_up(const lm_drive *d, lm_axis *a, const lm_parameters *parameters,
                            lm_axis_kept *kept, const lm_conditions *at, float motor_rad,
                            lm_fault *fault);

/* Saves the history for lm_drive_power_up; the axis is off then, and a new start is a power-up. Not
 * LM_AXIS_READY: the drive is enabled or the brake released, or motor and correction have not
 * stood: nothing was saved, try again in the next tick. */
lm_axis_wait lm_drive_power_down(const lm_drive *d, lm_axis *a, lm_axis_kept *kept);

#endif
