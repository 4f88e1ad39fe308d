/* How the command of an axis follows a planner, and its correction a thermometer. */
#ifndef LM_FOLLOW_H
#define LM_FOLLOW_H

#include "lostmotion/runtime.h"

/* So many ticks in succession may be without a wish or an angle of the motor, as usual drives
 * tolerate without a setpoint: the command continues. */
#define LM_FOLLOW_LOST_TICKS 3

/* Change of the wish's rate in a tick, at the output: more is no motion of a planner but a step.
 * (1000 rad/s2 at a tick of 2 ms, 8000 rad/s2 at 0.25 ms.) */
#define LM_FOLLOW_STEP_RAD_S 2.0f

/* The planner has begun at the command if it has differed by less for LM_FOLLOW_REST_S; the
 * difference ends within the standstill of the correction, without a step. */
#define LM_FOLLOW_NEAR_RAD 1e-4f

/* The planner is at rest if its wish has not changed for this time, longer than its period, by more
 * than the last digits of a float at 5 turns. */
#define LM_FOLLOW_REST_S 0.02f
#define LM_FOLLOW_REST_RAD 4e-6f

/* A joint of 10 kg that loses 500 W warms so fast. */
#define LM_FOLLOW_WARMING_K_S 0.1f

typedef struct lm_follow {
  float period_s;
  float stand_s;    /* standstill of the correction */
  float step_rad_s; /* LM_FOLLOW_STEP_RAD_S, or another value after power-up */
  float rest_rad;   /* wish since which the planner is at rest */
  float moved_rad;  /* change of the command in this tick */
  float begin_rad;  /* by which the command differed from the planner when it began */
  float late_rad;   /* shift of the zero that the planner has not made yet */
  float rested_s;   /* of the planner; until it begins: at the command */
  int wishless_ticks;
  float temperature_C;
} lm_follow;

static inline float lm_follow_size(float value) {
  return value < 0 ? -value : value;
}

/* Finite, and not LM_UNKNOWN. */
static inline int lm_follow_is_known(float value) {
  return lm_follow_size(value) < LM_UNKNOWN;
}

/* A difference between planner and command that is too small to be a shift of the zero: it ends
 * within stand_s, without a step. */
static inline float lm_follow_end_slowly(const lm_follow *f, float difference_rad) {
  const float step_rad = LM_FOLLOW_NEAR_RAD * f->period_s / f->stand_s;
  return lm_follow_size(difference_rad) >= LM_FOLLOW_NEAR_RAD ? difference_rad
         : lm_follow_size(difference_rad) <= step_rad         ? 0
         : difference_rad < 0                                 ? difference_rad + step_rad
                                                              : difference_rad - step_rad;
}

/* Before the planner moves the command: 1 once it may begin. */
static inline int lm_follow_waits(lm_follow *f, float command_rad, float wish_rad) {
  const float beside_rad = command_rad - wish_rad;
  f->rested_s = lm_follow_size(beside_rad) < LM_FOLLOW_NEAR_RAD ? f->rested_s + f->period_s : 0;
  f->rest_rad = wish_rad;
  f->begin_rad = beside_rad;
  f->late_rad = 0;
  f->moved_rad = 0;
  f->wishless_ticks = 0;
  return f->rested_s >= LM_FOLLOW_REST_S;
}

/* The planner may shift some ticks after the zero: of the wish and the shifted wish, the one nearer
 * to the continued command is meant. The wrong one of two that are nearly equal is a step of at
 * most twice the change of the planner's own rate. Returns 0 and follows neither if it is neither:
 * a step of the wish, or an interpolator that makes a ramp of the shift. A wish that is missing:
 * the command continues for LM_FOLLOW_LOST_TICKS. */
static inline int lm_follow_wish(lm_follow *f, float *command_rad, float wish_rad) {
  const int shifts = lm_follow_size(f->late_rad) >= LM_FOLLOW_NEAR_RAD;
  const float most_rad = shifts ? LM_FOLLOW_NEAR_RAD : f->step_rad_s * f->period_s;
  const float before_rad = *command_rad;
  const float begun_rad = wish_rad + f->begin_rad;
  const float off_rad = begun_rad - before_rad - f->moved_rad;
  const float shifted_rad = off_rad + f->late_rad;
  f->rested_s += f->period_s;
  if (!(lm_follow_size(wish_rad - f->rest_rad) < LM_FOLLOW_REST_RAD)) {
    f->rest_rad = wish_rad;
    f->rested_s = 0;
  }
  f->wishless_ticks = lm_follow_is_known(wish_rad) ? 0 : f->wishless_ticks + 1;
  if (f->wishless_ticks > 0 && f->wishless_ticks <= LM_FOLLOW_LOST_TICKS) {
    *command_rad += f->moved_rad;
    return 1;
  }
  if (f->wishless_ticks > 0 ||
      (lm_follow_size(off_rad) >= most_rad && lm_follow_size(shifted_rad) >= most_rad)) {
    return 0;
  }
  if (lm_follow_size(shifted_rad) >= lm_follow_size(off_rad)) {
    f->late_rad = 0;
  }
  *command_rad = begun_rad + f->late_rad;
  f->begin_rad = lm_follow_end_slowly(f, f->begin_rad);
  f->late_rad = lm_follow_end_slowly(f, f->late_rad);
  f->moved_rad = *command_rad - before_rad;
  return 1;
}

/* The last temperature that was measured. A drive that is closed follows it no faster than it can
 * warm: a thermometer that returns moves nothing. */
static inline float lm_follow_temperature(lm_follow *f, float temperature_C, int closed) {
  const float most_K = LM_FOLLOW_WARMING_K_S * f->period_s;
  const float off_K = temperature_C - f->temperature_C;
  if (!lm_follow_is_known(temperature_C)) {
    return f->temperature_C;
  }
  if (closed && lm_follow_size(off_K) > most_K) {
    f->temperature_C += off_K < 0 ? -most_K : most_K;
  } else {
    f->temperature_C = temperature_C;
  }
  return f->temperature_C;
}

#endif
