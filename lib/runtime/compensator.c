#include "lostmotion/compensator.h"

#include <stddef.h>

#include "runtime/model_kernel.h"
#include "runtime/number.h"
#include "runtime/plain_symbol.h"

#define SAVED_FORMAT 1u

/* A measured lost motion beyond this many turns is invalid. The bound keeps the mean squares
 * finite. */
#define LOST_MOTION_MAX_RAD LM_REAL(1000)

/* The three stages of the limiter, position to velocity to acceleration to jerk, each four times as
 * fast as the one before. Then each stage approaches its bound without exceeding it:
 *
 * Let a be the acceleration after a tick, v the velocity, V its bound, k2 the second rate, k3 the
 * third, all in ticks, and assume a <= 2 k2 (V - v). The next acceleration is at most
 * (1 - k3) a + k3 k2 (V - v), and with k3 = 4 k2 the assumption remains true, so v <= V always.
 * Where the jerk limit is active, jerk >= 2 k2 a is also required, hence the acceleration is held
 * below jerk / (2 k2) = jerk / (8 response). The same argument one stage up holds the velocity
 * below acceleration / (2 response). */
#define STAGE_RATIO LM_REAL(4)

/* Relative excess over a bound that is rounding. */
#define ROUNDING LM_REAL(1.00001)

/* Rounding error of a slowly moving correction: 16 roundings of a float at the largest
 * correction. */
#define RESTING LM_REAL(1e-6)

/* Successive reversals, and their size relative to the noise, that count as ringing: three periods
 * of at least +-2 noise. With fewer, a move with its end and a reversal would count; smaller
 * oscillations are below the resolution of the output encoder. */
#define RINGING_TURNS 6
#define RINGING_NOISES LM_REAL(4)

/* The watch; see lm_watch_output. */
#define SWING_NOISES2 LM_REAL(4)
#define SWING_SHARE2 LM_REAL(0.0625)
#define HELP_SHARE LM_REAL(0.5)
/* The correction must have been useful five times as long as it was harmful: otherwise a loop that
 * rings when the correction returns would make it fade in and out endlessly. */
#define FORGIVING LM_REAL(0.2)
/* In the first half of the window the mean is that of all samples: a single sample, taken during a
 * motion or while a torque filter settles, would otherwise represent a whole window. */
#define FIRST_SHARES 2
/* Harm counts in proportion to its mean square over misfit_rad^2, up to this factor on its
 * duration: a wrong sign, which doubles the error, is detected in the first move; slight harm takes
 * longer. */
#define PLAIN LM_REAL(4)

/* An acceleration limit, reduced by the jerk limit at a response. */
NOINLINE static lm_real usable_acceleration(lm_real acceleration_rad_s2, lm_real jerk_rad_s3,
                                            lm_real response_per_s) {
  return least(acceleration_rad_s2, jerk_rad_s3 / (2 * STAGE_RATIO * response_per_s));
}

/* The assumptions of the argument above for the present motion: with the response r, the position
 * limit X and the acceleration limit A that the parameters state, V = min(velocity, A / (2 r)), and
 * with the presently permitted acceleration A',
 *
 *     |a| <= A',  2 r |v| <= A',  |v| <= V                                  what is there at all
 *     +-a <= 8 r (V -+ v)                                                   v will not pass V
 *     +-v <= 2 r (X -+ x),  +-a <= 8 r (3/2 r (X -+ x) -+ v)                x will not pass X
 *
 * The last pair: with e = X - x, z = 8 r (3/2 r e - v) - a and the stages at work, z' on z = 0 is
 * 32 r^3 e - 12 r^2 v, which is not negative for v <= 2 r e; and v = 2 r e with z >= 0 has
 * a <= -2 r v, so v falls as fast as 2 r e.
 *
 * A motion started under the present limits fulfils them. A motion started under other limits ends
 * under those: its response stays, and the acceleration is at least what it has now, A'' = max(|a|,
 * 2 r |v|), with 8 r A'' of jerk. Neither is more than the limits it was made under let it have. In
 * position it may go out as far as those let it. */
NOINLINE static int fits_side(const lm_compensator *c, lm_real x, lm_real v, lm_real a) {
  const lm_limits *limits = &c->parameters->limits;
  lm_real twice_per_s = 2 * limits->response_per_s;
  lm_real limit_rad_s2 =
      usable_acceleration(limits->acceleration_rad_s2, limits->jerk_rad_s3, limits->response_per_s);
  lm_real limit_rad_s = least(limits->velocity_rad_s, limit_rad_s2 / twice_per_s);
  lm_real room_rad = ROUNDING * limits->correction_rad - x;
  lm_real room_rad_s = ROUNDING * limit_rad_s - v;
  lm_real way_rad_s = LM_REAL(0.75) * twice_per_s * room_rad - v;
  return !is_negative(room_rad) && !is_negative(room_rad_s) &&
         !is_greater(v, twice_per_s * room_rad) &&
         !is_greater(a, STAGE_RATIO * twice_per_s * least(room_rad_s, way_rad_s));
}

/* The acceleration that the present motion needs at a response. */
static inline lm_real needed_acceleration(const lm_compensator *c, lm_real response_per_s) {
  return greatest(absolute(c->acceleration_rad_s2),
                  2 * response_per_s * absolute(c->velocity_rad_s));
}

static inline int fits(const lm_compensator *c, lm_real acceleration_rad_s2) {
  lm_real v = c->velocity_rad_s;
  lm_real a = c->acceleration_rad_s2;
  return !is_greater(needed_acceleration(c, c->parameters->limits.response_per_s),
                     ROUNDING * acceleration_rad_s2) &&
         fits_side(c, c->correction_rad, v, a) && fits_side(c, -c->correction_rad, -v, -a);
}

/* The response of the parameters takes effect. */
NOINLINE static void set_rates(lm_compensator *c) {
  lm_real response_per_s = c->parameters->limits.response_per_s;
  lm_real tick = response_per_s * c->parameters->limits.period_s;
  c->lead_ticks = 1 / tick;
  c->velocity_per_s = response_per_s;
  c->acceleration_per_s = STAGE_RATIO * response_per_s;
  c->jerk_share = least(STAGE_RATIO * STAGE_RATIO * tick, 1);
}

/* The second half of set_bounds. Separate, and with intermediate values in the instance, to save
 * stack: without an FPU every value that is live across a call takes a register. */
NOINLINE static void narrow_bounds(lm_compensator *c) {
  const lm_limits *limits = &c->parameters->limits;
  lm_real response_per_s = c->velocity_per_s;
  lm_real jerk_rad_s3 = c->jerk_step_rad_s2;
  lm_real acceleration_rad_s2 =
      usable_acceleration(c->acceleration_max_rad_s2, jerk_rad_s3, response_per_s);
  c->velocity_max_rad_s = least(least(limits->velocity_rad_s, c->room.velocity_rad_s),
                                acceleration_rad_s2 / (2 * response_per_s));
  if (c->standing & LM_STATE_HEADROOM_SHORT) {
    acceleration_rad_s2 = greatest(acceleration_rad_s2, needed_acceleration(c, response_per_s));
    jerk_rad_s3 = greatest(jerk_rad_s3, 2 * STAGE_RATIO * response_per_s * acceleration_rad_s2);
  }
  c->acceleration_max_rad_s2 = acceleration_rad_s2;
  c->jerk_step_rad_s2 = jerk_rad_s3 * limits->period_s;
}

/* The active bounds, from the limits of the parameters, the headroom and the present motion. */
NOINLINE static void set_bounds(lm_compensator *c) {
  const lm_limits *limits = &c->parameters->limits;
  lm_real reached_rad = c->correction_end_rad;
  c->correction_max_rad = least(limits->correction_rad, c->room.correction_rad);
  c->acceleration_max_rad_s2 = least(limits->acceleration_rad_s2, c->room.acceleration_rad_s2);
  c->jerk_step_rad_s2 = least(limits->jerk_rad_s3, c->room.jerk_rad_s3);
  c->standing |= LM_STATE_HEADROOM_SHORT;
  if (fits(c, usable_acceleration(c->acceleration_max_rad_s2, c->jerk_step_rad_s2,
                                  limits->response_per_s))) {
    c->standing &= ~LM_STATE_HEADROOM_SHORT;
    set_rates(c);
    reached_rad = absolute(c->correction_rad);
  }
  c->correction_end_rad = greatest(limits->correction_rad, reached_rad);
  narrow_bounds(c);
}

static int is_started(const lm_compensator *compensator) {
  return compensator && compensator->parameters;
}

NOINLINE static lm_real room_of(lm_real told) {
  return clamp(told, 0, LARGEST);
}

void lm_set_headroom(lm_compensator *compensator, const lm_headroom *headroom) {
  lm_headroom *room;
  if (!is_started(compensator)) {
    return;
  }
  room = &compensator->room;
  room->correction_rad = LARGEST;
  room->velocity_rad_s = LARGEST;
  room->acceleration_rad_s2 = LARGEST;
  room->jerk_rad_s3 = LARGEST;
  if (headroom) {
    room->correction_rad = room_of(headroom->correction_rad);
    room->velocity_rad_s = room_of(headroom->velocity_rad_s);
    room->acceleration_rad_s2 = room_of(headroom->acceleration_rad_s2);
    room->jerk_rad_s3 = room_of(headroom->jerk_rad_s3);
  }
  set_bounds(compensator);
}

/* Difference of the torsion curve's angle between two torques. */
static lm_real wind(const lm_parameters *parameters, lm_real torque_Nm, lm_real more_Nm) {
#if LM_PROFILE == LM_PROFILE_GAP
  (void)parameters;
  (void)torque_Nm;
  return more_Nm;
#else
  return lm_evaluate_curve(&parameters->curve, torque_Nm + more_Nm) -
         lm_evaluate_curve(&parameters->curve, torque_Nm);
#endif
}

/* Resets the detection of ringing. */
static void listen_anew(lm_compensator *compensator) {
  compensator->turns = 0;
  compensator->turn_rad = compensator->correction_rad;
#if LM_EFFECTS_MAX > 0
  compensator->heard_Nm = compensator->memory.plays.torque_Nm;
  compensator->turn_Nm = compensator->heard_Nm;
#endif
  compensator->ticks = 0;
  compensator->standing &= ~LM_STATE_RINGING;
}

/* Largest error of the target from a torque error, either sign: at zero load. */
static void find_unsure(lm_compensator *c) {
  c->unsure_rad = LM_REAL(0.5) * wind(c->parameters, -c->torque_error_Nm, 2 * c->torque_error_Nm);
}

/* Sets the fields of an instance that follow from the parameters. */
static void prepare(lm_compensator *compensator) {
  const lm_parameters *parameters = compensator->parameters;
  const lm_limits *limits = &parameters->limits;
  lm_real valid_Nm = parameters->valid.torque_Nm;
  compensator->swing_rad = RINGING_NOISES * parameters->watch.noise_rad;
  compensator->swing_ticks = 0;
#if LM_PROFILE != LM_PROFILE_GAP
  if (parameters->watch.ringing_Hz > 0) {
    compensator->swing_ticks = 1 / (2 * parameters->watch.ringing_Hz * limits->period_s);
  }
#endif
  compensator->usual_Nm = parameters->torque_limit_Nm;
  if (valid_Nm > 0) {
    compensator->usual_Nm = least(valid_Nm, parameters->torque_limit_Nm);
  }
  find_unsure(compensator);
  compensator->settled_rad_s = limits->response_per_s * greatest(parameters->watch.noise_rad,
                                                                 RESTING * limits->correction_rad);
#if LM_EFFECTS_MAX > 0
  compensator->needs = needs_of(parameters);
  /* Torque that winds the torsion curve by one counted reversal on average. */
  compensator->swing_Nm = 2 * compensator->usual_Nm * compensator->swing_rad /
                          wind(parameters, -compensator->usual_Nm, 2 * compensator->usual_Nm);
#endif
  listen_anew(compensator);
  lm_set_headroom(compensator, 0);
}

static void forget(lm_compensator *compensator) {
  lm_real torque_Nm = compensator->memory.plays.torque_Nm;
  compensator->lowest_Nm = torque_Nm;
  compensator->highest_Nm = torque_Nm;
  compensator->standing |= LM_STATE_MEMORY_UNKNOWN;
}

/* Every field zero, at the full gain. */
static void rest(lm_compensator *compensator) {
  unsigned char *byte = (unsigned char *)compensator;
  size_t i;
  for (i = 0; i < sizeof *compensator; ++i) {
    byte[i] = 0;
  }
  compensator->gain = 1;
  compensator->torque_error_Nm = LARGEST; /* not declared */
}

lm_status lm_start_compensator(lm_compensator *compensator, const lm_parameters *parameters,
                               lm_real torque_Nm, lm_fault *fault) {
  lm_status status;
  if (!compensator) {
    return lm_refuse(fault, LM_NULL, "compensator", 0, 0, 0);
  }
  status = lm_check_parameters(parameters, fault);
  compensator->parameters = NULL; /* the first member: nothing behind it is touched by a refusal */
  if (status != LM_OK) {
    return status;
  }
  rest(compensator);
  compensator->parameters = parameters;
  set_rates(compensator);
  compensator->correction_end_rad = parameters->limits.correction_rad;
  lm_start_model(&compensator->memory, torque_Nm);
#if LM_ENVELOPE
  {
    lm_play_memory *plays = &compensator->memory.plays;
    lm_real held_Nm = plays->torque_Nm;
    lm_center_plays(plays, lm_find_envelope(&parameters->plays, held_Nm));
    plays->torque_Nm = held_Nm;
  }
#endif
  lm_settle_model(parameters, &compensator->memory);
  forget(compensator);
  prepare(compensator);
  return LM_OK;
}
PLAIN_SYMBOL(lm_start_compensator, LM_SIZES_TEXT)

/* Returns the finite requested value clipped to its bounds; sets the status bit if it was
 * clipped. */
static lm_real hold(lm_real wish, lm_real most, uint32_t bit, uint32_t *status) {
  if (is_within(wish, most)) {
    return wish;
  }
  *status |= bit;
  return with_sign_of(wish, most);
}

/* End of a swing: larger than the noise, opposite to the last that counted. */
NOINLINE static void count_swing(lm_compensator *c, lm_real swing_rad) {
  int32_t turns = LM_REAL(c->ticks) < c->swing_ticks ? c->turns : 0;
  if (is_negative(swing_rad)) {
    turns = turns > 0 ? -turns - 1 : -1;
  } else {
    turns = turns < 0 ? 1 - turns : 1;
  }
  if (turns >= RINGING_TURNS || turns <= -RINGING_TURNS) {
    turns = 0;
    if (!(c->standing & LM_STATE_RINGING)) {
      c->standing |= LM_STATE_RINGING;
      c->slow_rad = c->correction_rad;
    }
  }
  c->turns = (int8_t)turns;
  c->turn_rad = c->correction_rad;
  c->ticks = 0;
}

#if LM_EFFECTS_MAX > 0
/* Detects ringing from the torque, delayed like the correction. turn_Nm is its extreme; a swing
 * ends when it has returned by swing_Nm, whose sign gives the direction. */
NOINLINE static void hear_torque(lm_compensator *c) {
  lm_real back_Nm;
  if (c->standing & (LM_STATE_HOLDING | LM_STATE_RESETTING)) {
    return; /* the correction does not follow the torque */
  }
  c->heard_Nm += (c->memory.plays.torque_Nm - c->heard_Nm) * (LM_REAL(0.25) * c->jerk_share);
  back_Nm = c->heard_Nm - c->turn_Nm;
  if (signs_differ(back_Nm, c->swing_Nm)) {
    c->turn_Nm = c->heard_Nm;
  } else if (!is_within(back_Nm, absolute(c->swing_Nm))) {
    c->turn_Nm = c->heard_Nm;
    c->swing_Nm = -c->swing_Nm;
    count_swing(c, with_sign_of(c->swing_Nm, c->swing_rad));
  } else {
    /* on its way */
  }
}
#endif

/* The target of a correction that rang. If the torque error is at most the declared one, the right
 * correction is within unsure_rad of the target t. With s = |t| - unsure_rad (zero if that is
 * negative or nothing was declared), no value from zero to 2 s, on the side of t, makes the output
 * worse than without a correction. Three rules:
 *
 *   - From s to the lesser of 2 s and |t| it stays where it is: a torque that wanders within its
 *     declared error, as the friction of a motor at rest does, moves nothing, so the position loop
 *     comes to rest as it does without a correction.
 *   - Outwards it goes through a filter of the first order at SLOW_SHARE of ringing_Hz: a loop that
 *     rang at that frequency or above has a tenth of its gain, or less.
 *   - It is never farther out than that, whatever the filter's lag. */
#define SLOW_SHARE LM_REAL(0.1)
NOINLINE static lm_real follow_slowly(lm_compensator *c, lm_real target_rad) {
  lm_real near_rad = greatest(absolute(target_rad) - c->unsure_rad, 0);
  lm_real slow_rad = signs_differ(c->slow_rad, target_rad) ? 0 : absolute(c->slow_rad);
  slow_rad = least(slow_rad, least(2 * near_rad, absolute(target_rad)));
  if (is_greater(near_rad, slow_rad)) {
    /* 2 pi SLOW_SHARE ringing_Hz period_s, backwards in time: swing_ticks is half a period of it */
    lm_real share = LM_PI * SLOW_SHARE / (LM_PI * SLOW_SHARE + c->swing_ticks);
    slow_rad += (near_rad - slow_rad) * share;
  }
  c->slow_rad = with_sign_of(target_rad, slow_rad);
  return c->slow_rad;
}

/* Detects ringing, from the correction if only the torque and slow conditions move it. Noise causes
 * small reversals; the distance from the last counted reversal decides. Effects that need more than
 * torque, temperature and time, such as a kinematic error, move the correction without a torque and
 * close no loop: with them the torque is examined. */
static inline void listen(lm_compensator *c, lm_real before_rad_s) {
  c->ticks += 1;
#if LM_EFFECTS_MAX > 0
  if (UNLIKELY((c->needs & NEEDS_MORE) != 0)) {
    hear_torque(c);
    return;
  }
#endif
  if (signs_differ(before_rad_s, c->velocity_rad_s) &&
      !is_within(c->correction_rad - c->turn_rad, c->swing_rad)) {
    count_swing(c, c->correction_rad - c->turn_rad);
  }
}

static inline uint32_t follow_target(lm_compensator *c, lm_real target_rad, uint32_t status) {
  lm_real period_s = c->parameters->limits.period_s;
  /* Adding the motion of the target in 1 / response compensates the lag of the first stage. */
  lm_real aim_rad = hold(target_rad + (target_rad - c->target_rad) * c->lead_ticks,
                         c->correction_max_rad, LM_STATE_POSITION_LIMITED, &status);
  lm_real before_rad_s = c->velocity_rad_s;
  lm_real wish_rad_s = (aim_rad - c->correction_rad) * c->velocity_per_s;
  lm_real velocity = hold(wish_rad_s, c->velocity_max_rad_s, LM_STATE_VELOCITY_LIMITED, &status);
  lm_real acceleration = hold((velocity - before_rad_s) * c->acceleration_per_s,
                              c->acceleration_max_rad_s2, LM_STATE_ACCELERATION_LIMITED, &status);
  lm_real change = hold((acceleration - c->acceleration_rad_s2) * c->jerk_share,
                        c->jerk_step_rad_s2, LM_STATE_JERK_LIMITED, &status);
  lm_real reached_rad;
  if (is_within(wish_rad_s, c->settled_rad_s) && is_within(before_rad_s, c->settled_rad_s)) {
    status |= LM_STATE_SETTLED;
  }
  c->target_rad = target_rad;
  c->acceleration_rad_s2 += change;
  c->velocity_rad_s = before_rad_s + c->acceleration_rad_s2 * period_s;
  reached_rad = c->correction_rad + c->velocity_rad_s * period_s;
  if (UNLIKELY(!is_within(reached_rad, c->correction_end_rad))) {
    reached_rad = hold(reached_rad, c->correction_end_rad, LM_STATE_POSITION_LIMITED, &status);
  }
  c->correction_rad = reached_rad;
  listen(c, before_rad_s);
  return status;
}

/* Replaces inputs that are invalid, beyond the limit or outside the fitted range; sets the status
 * bits. */
static inline lm_real judge_unusual(const lm_compensator *c, lm_real told, uint32_t *status) {
  lm_real limit = c->parameters->torque_limit_Nm;
  if (is_within(told, limit)) {
    *status |= LM_STATE_EXTRAPOLATED;
    return told;
  }
  if (!is_told(told)) {
    *status |= told == LM_UNKNOWN ? LM_STATE_CONDITION_MISSING : LM_STATE_INPUT_REFUSED;
    return c->memory.plays.torque_Nm;
  }
  *status |= is_positive(c->parameters->valid.torque_Nm)
                 ? LM_STATE_TORQUE_CLIPPED | LM_STATE_EXTRAPOLATED
                 : LM_STATE_TORQUE_CLIPPED;
  return with_sign_of(told, limit);
}

/* States in which a tick differs from the usual one. */
#define UNUSUAL (LM_STATE_HOLDING | LM_STATE_RESETTING | LM_STATE_RINGING | LM_STATE_HEADROOM_SHORT)

/* Target of the correction in these states. */
NOINLINE static lm_real find_other_target(lm_compensator *c) {
  lm_real target_rad = -c->gain * c->lost_motion_rad;
  if (c->standing & LM_STATE_RESETTING) {
    return 0;
  }
  if (c->standing & LM_STATE_HOLDING) {
    return c->target_rad;
  }
  return (c->standing & LM_STATE_RINGING) ? follow_slowly(c, target_rad) : target_rad;
}

#if LM_EFFECTS_MAX > 0
#define NEEDS(compensator) ((compensator)->needs)
#else
#define NEEDS(compensator) 0u
#endif

static lm_correction correct_nothing(void) {
  static const lm_correction nothing = {0, 0, 0, 0, LM_STATE_NOT_STARTED};
  return nothing;
}

lm_correction lm_step_compensator(lm_compensator *compensator, const lm_conditions *at) {
  static const lm_conditions unknown = LM_CONDITIONS_UNKNOWN;
  lm_correction result;
  lm_real input;
  lm_real target_rad;
  lm_real angle_rad;
  lm_real period_s;
  lm_real elapsed_s;
  uint32_t status;
  if (!is_started(compensator)) {
    return correct_nothing();
  }
  if (!at) {
    at = &unknown;
  }
  status = compensator->standing;
  input = model_input(at);
  if (UNLIKELY(!is_within(input, compensator->usual_Nm))) {
    input = judge_unusual(compensator, input, &status);
  }
  period_s = compensator->parameters->limits.period_s;
  elapsed_s = period_s;
  if (is_positive(at->elapsed_s)) {
    if (!is_within(at->elapsed_s - period_s, LM_REAL(0.5) * period_s)) {
      status |= LM_STATE_PERIOD_WRONG;
    }
    elapsed_s = take_elapsed(at->elapsed_s, period_s);
  }
  angle_rad = STEP_MODEL(compensator->parameters, &compensator->memory, at, input, elapsed_s,
                         NEEDS(compensator), &status);
  if (status & LM_STATE_MEMORY_UNKNOWN) {
    lm_real torque_Nm = compensator->memory.plays.torque_Nm;
    if (is_greater(compensator->lowest_Nm, torque_Nm)) {
      compensator->lowest_Nm = torque_Nm;
    } else if (is_greater(torque_Nm, compensator->highest_Nm)) {
      compensator->highest_Nm = torque_Nm;
    } else {
      /* already swept */
    }
  }
#if LM_EFFECTS_MAX > 0
  if (UNLIKELY(!is_within(angle_rad, LOST_MOTION_MAX_RAD))) {
    status |= LM_STATE_MODEL_REFUSED;
    angle_rad = compensator->lost_motion_rad;
  }
#endif
  compensator->lost_motion_rad = angle_rad;
  result.lost_motion_rad = angle_rad;
  if (UNLIKELY(status & UNUSUAL)) {
    if (status & LM_STATE_HEADROOM_SHORT) {
      set_bounds(compensator);
    }
    target_rad = find_other_target(compensator);
  } else {
    target_rad = -compensator->gain * angle_rad;
  }
  status = follow_target(compensator, target_rad, status);
  result.correction_rad = compensator->correction_rad;
  result.velocity_rad_s = compensator->velocity_rad_s;
  result.acceleration_rad_s2 = compensator->acceleration_rad_s2;
  result.status = status;
  return result;
}

lm_correction lm_settle_compensator(lm_compensator *compensator, const lm_conditions *at) {
  lm_correction result = lm_step_compensator(compensator, at);
  if (is_started(compensator)) {
    result.status &=
        ~(LM_STATE_POSITION_LIMITED | LM_STATE_VELOCITY_LIMITED | LM_STATE_ACCELERATION_LIMITED |
          LM_STATE_JERK_LIMITED | LM_STATE_HEADROOM_SHORT | LM_STATE_RINGING);
    compensator->correction_rad = hold(compensator->target_rad, compensator->correction_max_rad,
                                       LM_STATE_POSITION_LIMITED, &result.status);
    compensator->velocity_rad_s = 0;
    compensator->acceleration_rad_s2 = 0;
    compensator->slow_rad = compensator->target_rad;
    listen_anew(compensator);
    set_bounds(compensator);
    result.correction_rad = compensator->correction_rad;
    result.velocity_rad_s = 0;
    result.acceleration_rad_s2 = 0;
    result.status |= LM_STATE_SETTLED | compensator->standing;
  }
  return result;
}

void lm_set_mode(lm_compensator *compensator, lm_mode mode) {
  if (!is_started(compensator)) {
    return;
  }
  compensator->standing &= ~(LM_STATE_HOLDING | LM_STATE_RESETTING);
  if (mode == LM_MODE_HOLD) {
    compensator->standing |= LM_STATE_HOLDING;
  } else if (mode != LM_MODE_RUN) {
    compensator->standing |= LM_STATE_RESETTING;
    listen_anew(compensator);
  } else {
    /* runs */
  }
}

/* The range of a standstill: +-4 of the noise, as for ringing. settled_rad_s is response noise. */
static lm_real standing_range(const lm_compensator *c) {
  return 2 * RINGING_NOISES * c->settled_rad_s / c->parameters->limits.response_per_s;
}

lm_real lm_find_standstill(const lm_compensator *compensator, lm_standstill *standstill) {
  lm_real now_rad;
  lm_real goal_rad;
  lm_real range_rad;
  if (!is_started(compensator)) {
    standstill->ticks = 0;
    return 0;
  }
  now_rad = compensator->correction_rad;
  range_rad = standing_range(compensator);
  if (standstill->ticks > 0) {
    standstill->lowest_rad = least(standstill->lowest_rad, now_rad);
    standstill->highest_rad = greatest(standstill->highest_rad, now_rad);
  }
  goal_rad = clamp(compensator->target_rad, -compensator->correction_max_rad,
                   compensator->correction_max_rad);
  if (standstill->ticks == 0 || !is_within(goal_rad - now_rad, range_rad) ||
      is_greater(standstill->highest_rad - standstill->lowest_rad, range_rad)) {
    standstill->lowest_rad = now_rad;
    standstill->highest_rad = now_rad;
    standstill->ticks = 0;
  }
  standstill->ticks += standstill->ticks < UINT32_MAX;
  return LM_REAL(standstill->ticks - 1) * compensator->parameters->limits.period_s;
}

void lm_declare_memory_known(lm_compensator *compensator) {
  if (is_started(compensator)) {
    compensator->standing &= ~LM_STATE_MEMORY_UNKNOWN;
  }
}

void lm_declare_memory_unknown(lm_compensator *compensator) {
  if (is_started(compensator)) {
    forget(compensator);
  }
}

/* The possible range of operator i. When its history was unknown it was anywhere in its band. A
 * rising load lifted it at least to the lower edge at the load's highest, a falling one lowered it
 * at most to the upper edge at its lowest, in whatever order: the rest is [low, high] or, once it
 * is known, nothing. The edges rise with the load, so the first band itself adds nothing. */
static int is_unknown(const lm_compensator *compensator, int32_t i, lm_real *low_Nm,
                      lm_real *high_Nm) {
  const lm_play_bank *bank = &compensator->parameters->plays;
#if LM_EFFECTS_MAX > 0
  lm_real scale = compensator->memory.width_scale;
#else
  lm_real scale = 1;
#endif
  *low_Nm = lm_find_envelope(bank, compensator->highest_Nm) -
            scale * lm_find_play_radius(bank, i, compensator->highest_Nm);
  *high_Nm = lm_find_envelope(bank, compensator->lowest_Nm) +
             scale * lm_find_play_radius(bank, i, compensator->lowest_Nm);
  return is_greater(*high_Nm, *low_Nm);
}

static lm_real bound(lm_compensator *compensator) {
  const lm_play_bank *bank = &compensator->parameters->plays;
  const lm_play_memory *plays = &compensator->memory.plays;
  const lm_real at_Nm = lm_find_envelope(bank, plays->torque_Nm);
  lm_real wound_Nm = plays->torque_Nm;
  lm_real up_Nm = 0;
  lm_real down_Nm = 0;
  lm_real up_rad = 0;
  lm_real down_rad = 0;
  int unknown = 0;
  int32_t i;
  for (i = bank->outside_count; i < bank->count; ++i) {
    wound_Nm += bank->slot[i].weight * (plays->z_Nm[i] - at_Nm);
  }
  for (i = 0; i < bank->count; ++i) {
    lm_real low_Nm;
    lm_real high_Nm;
    if (is_unknown(compensator, i, &low_Nm, &high_Nm)) {
      unknown = 1;
      lm_real weight = bank->slot[i].weight;
      lm_real up = weight * greatest(high_Nm - plays->z_Nm[i], 0);
      lm_real down = weight * greatest(plays->z_Nm[i] - low_Nm, 0);
      if (i < bank->outside_count) {
        up_rad += up;
        down_rad += down;
      } else {
        up_Nm += up;
        down_Nm += down;
      }
    }
  }
  if (!unknown) {
    lm_declare_memory_known(compensator);
  }
  up_rad += wind(compensator->parameters, wound_Nm, up_Nm);
  down_rad -= wind(compensator->parameters, wound_Nm, -down_Nm);
  return greatest(up_rad, down_rad);
}

lm_real lm_bound_uncertainty(lm_compensator *compensator) {
  if (!is_started(compensator) || !(compensator->standing & LM_STATE_MEMORY_UNKNOWN)) {
    return 0;
  }
  return bound(compensator);
}

#if LM_EFFECTS_MAX > 0
/* Effects that change what the operators follow, or their bands: the first of the list. */
static int32_t count_loading(const lm_parameters *parameters) {
  int32_t count = 0;
  while (count < parameters->effect_count &&
         parameters->effect[count].effect->kind != LM_EFFECT_ANGLE) {
    ++count;
  }
  return count;
}

static int has_other_effects(const lm_parameters *parameters, const lm_parameters *before) {
  const int32_t count = count_loading(parameters);
  int other = count != count_loading(before);
  int32_t i;
  for (i = 0; i < count; ++i) {
    const lm_effect_use *use = &parameters->effect[i];
    const lm_effect_use *old = &before->effect[i];
    int32_t k;
    other |= use->effect != old->effect;
    for (k = 0; k < use->effect->value_count; ++k) {
      other |= use->value[k] != old->value[k];
    }
  }
  return other;
}
#endif

/* True if the band of an operator has changed, or the torque that it follows: its state is that of
 * the old ones, and the load has not swept the new band. */
static int has_other_bands(const lm_parameters *parameters, const lm_parameters *old_parameters) {
  const lm_play_bank *bank = &parameters->plays;
  const lm_play_bank *before = &old_parameters->plays;
  int other = bank->envelope_Nm != before->envelope_Nm || bank->knee_Nm != before->knee_Nm;
  int32_t i;
#if LM_EFFECTS_MAX > 0
  other |= has_other_effects(parameters, old_parameters);
#endif
  for (i = 0; i < LM_PLAYS_MAX; ++i) {
    const lm_play_slot *slot = &bank->slot[i];
    const lm_play_slot *old = &before->slot[i];
    other |= slot->radius_Nm != old->radius_Nm || slot->edge_slope[1] != old->edge_slope[1];
  }
  return other;
}

lm_status lm_change_parameters(lm_compensator *compensator, const lm_parameters *parameters,
                               lm_fault *fault) {
  lm_status status;
  lm_real period_s;
  int other_bands;
  if (!is_started(compensator)) {
    return lm_refuse(fault, LM_NULL, "compensator", 0, 0, 0);
  }
  status = lm_check_parameters(parameters, fault);
  if (status != LM_OK) {
    return status;
  }
  period_s = compensator->parameters->limits.period_s;
  if (parameters->limits.period_s != period_s) {
    return lm_refuse(fault, LM_INCONSISTENT, "period_s", parameters->limits.period_s, period_s,
                     period_s);
  }
  other_bands = has_other_bands(parameters, compensator->parameters);
  compensator->parameters = parameters;
  lm_settle_model(parameters, &compensator->memory);
  if (other_bands) {
    forget(compensator);
  }
  prepare(compensator);
  return LM_OK;
}

void lm_declare_torque_error(lm_compensator *compensator, lm_real error_Nm) {
  if (is_started(compensator)) {
    compensator->torque_error_Nm = error_Nm >= 0 ? least(error_Nm, LARGEST) : LARGEST;
    find_unsure(compensator);
  }
}

#if LM_PROFILE == LM_PROFILE_GAP
lm_status lm_shift_angle(lm_compensator *compensator, lm_real by_rad, lm_fault *fault) {
  lm_play_memory *plays;
  lm_real limit_rad;
  lm_status status;
  int32_t i;
  if (!is_started(compensator)) {
    return lm_refuse(fault, LM_NULL, "compensator", 0, 0, 0);
  }
  plays = &compensator->memory.plays;
  limit_rad = compensator->parameters->torque_limit_Nm;
  status = lm_check_range(fault, "by_rad", by_rad, -limit_rad - plays->torque_Nm,
                          limit_rad - plays->torque_Nm);
  if (status != LM_OK) {
    return status;
  }
  plays->torque_Nm += by_rad;
  for (i = 0; i < LM_PLAYS_MAX; ++i) {
    plays->z_Nm[i] += by_rad;
  }
  lm_settle_model(compensator->parameters, &compensator->memory);
  /* Loads beyond the limit count as loads up to it. */
  compensator->lowest_Nm = clamp(compensator->lowest_Nm + by_rad, -limit_rad, limit_rad);
  compensator->highest_Nm = clamp(compensator->highest_Nm + by_rad, -limit_rad, limit_rad);
  return LM_OK;
}
#endif

/* First-order mean over the window; the backward step is stable for any ratio of the two times. */
static void average(lm_real *mean, lm_real value, lm_real share) {
  *mean += share * (value - *mean);
}

/* Mean squares of the measured lost motion, of the residual, and of the model. */
static void weigh(lm_compensator *c, lm_real measured_rad, lm_real share) {
  lm_real residual_rad = measured_rad - c->lost_motion_rad;
  lm_real measured = measured_rad;
  lm_real residual = residual_rad;
  lm_real model;
  if (!c->zero_shared) {
    lm_real first_share = 1 / (1 + LM_REAL(c->watched));
    lm_real mean_share = first_share > FIRST_SHARES * share ? first_share : share;
    average(&c->mean_measured_rad, measured_rad, mean_share);
    average(&c->mean_residual_rad, residual_rad, mean_share);
    measured -= c->mean_measured_rad;
    residual -= c->mean_residual_rad;
    c->watched = (uint16_t)(c->watched + (c->watched < UINT16_MAX));
  }
  model = measured - residual;
  average(&c->power_measured_rad2, measured * measured, share);
  average(&c->power_residual_rad2, residual * residual, share);
  average(&c->power_model_rad2, model * model, share);
  average(&c->level_rad2, c->lost_motion_rad * c->lost_motion_rad, share);
}

/* Time for which the correction has been harmful, at most the time after which the gain falls. */
static void doubt(lm_compensator *c, lm_real elapsed_s) {
  const lm_watch *watch = &c->parameters->watch;
  lm_real noise_rad2 = watch->noise_rad * watch->noise_rad;
  lm_real misfit_rad2 = watch->misfit_rad * watch->misfit_rad;
  lm_real harm_rad2;
  if (!(c->power_model_rad2 > SWING_NOISES2 * noise_rad2 &&
        c->power_model_rad2 >= SWING_SHARE2 * c->level_rad2)) {
    return;
  }
  harm_rad2 = c->power_residual_rad2 - c->power_measured_rad2;
  if (c->power_residual_rad2 > misfit_rad2 && harm_rad2 > 0) {
    lm_real weight = least(harm_rad2 / misfit_rad2, PLAIN);
    c->doubt_s = least(c->doubt_s + weight * elapsed_s, watch->window_s);
  } else if (c->power_residual_rad2 < HELP_SHARE * c->power_measured_rad2) {
    c->doubt_s = greatest(c->doubt_s - FORGIVING * elapsed_s, 0);
  } else {
    /* neither: unchanged */
  }
}

/* Direction of the gain: down at full doubt, up without doubt. At rest it changes slowly. */
static void fade(lm_compensator *c, lm_real elapsed_s) {
  const lm_watch *watch = &c->parameters->watch;
  lm_real model_rad = absolute(c->lost_motion_rad);
  lm_real moved_rad = absolute(c->lost_motion_rad - c->watched_rad);
  lm_real most = elapsed_s / watch->fade_s;
  if (watch->creep_rad_s > 0 && most * model_rad > watch->creep_rad_s * elapsed_s + moved_rad) {
    most = (watch->creep_rad_s * elapsed_s + moved_rad) / model_rad;
  }
  c->watched_rad = c->lost_motion_rad;
  if (c->doubt_s >= watch->window_s) {
    c->gain = clamp(c->gain - most, 0, 1);
  } else if (!(c->doubt_s > 0)) {
    c->gain = clamp(c->gain + most, 0, 1);
  } else {
    /* in doubt: unchanged */
  }
}

void lm_watch_output(lm_compensator *compensator, lm_real lost_motion_rad, lm_real elapsed_s) {
  const lm_watch *watch;
  if (!is_started(compensator)) {
    return;
  }
  if (!(absolute(lost_motion_rad) <= LOST_MOTION_MAX_RAD) || !(elapsed_s > 0) ||
      !is_finite(elapsed_s)) {
    compensator->standing |= LM_STATE_WATCH_REFUSED;
    return;
  }
  watch = &compensator->parameters->watch;
  compensator->standing &= ~(LM_STATE_WATCH_REFUSED | LM_STATE_MISFIT | LM_STATE_FADED);
  weigh(compensator, lost_motion_rad, elapsed_s / (elapsed_s + watch->window_s));
  doubt(compensator, elapsed_s);
  fade(compensator, elapsed_s);
  if (compensator->gain < 1) {
    compensator->standing |= LM_STATE_FADED;
  }
  if (compensator->power_residual_rad2 > watch->misfit_rad * watch->misfit_rad) {
    compensator->standing |= LM_STATE_MISFIT;
  }
}

void lm_declare_shared_zero(lm_compensator *compensator) {
  if (is_started(compensator)) {
    compensator->zero_shared = 1;
    compensator->power_measured_rad2 = 0;
    compensator->power_residual_rad2 = 0;
    compensator->power_model_rad2 = 0;
    compensator->level_rad2 = 0;
  }
}

/* Fields without padding, so that the CRC covers only written bytes. */
typedef char saved_has_no_holes
    [sizeof(lm_saved) == 4 * sizeof(uint32_t) + sizeof(lm_memory) + 2 * sizeof(lm_real) ? 1 : -1];

void lm_save_compensator(const lm_compensator *compensator, lm_saved *saved) {
  if (!saved) {
    return;
  }
  if (!is_started(compensator)) {
    saved->format = 0; /* none */
    saved->crc = 0;
    return;
  }
  saved->format = SAVED_FORMAT;
  saved->fingerprint = compensator->parameters->fingerprint;
  saved->memory = compensator->memory;
  saved->lowest_Nm = compensator->lowest_Nm;
  saved->highest_Nm = compensator->highest_Nm;
  saved->unknown = compensator->standing & LM_STATE_MEMORY_UNKNOWN;
  saved->crc = lm_find_crc(0, saved, offsetof(lm_saved, crc));
}

/* Checks that the load range contains the present load and has no NaN. */
static int can_be_swept(lm_real lowest_Nm, lm_real torque_Nm, lm_real highest_Nm,
                        lm_real limit_Nm) {
  return lowest_Nm >= -limit_Nm && lowest_Nm <= torque_Nm && torque_Nm <= highest_Nm &&
         highest_Nm <= limit_Nm;
}

lm_status lm_restore_compensator(lm_compensator *compensator, const lm_saved *saved,
                                 lm_fault *fault) {
  if (!is_started(compensator) || !saved) {
    return lm_refuse(fault, LM_NULL, "compensator", 0, 0, 0);
  }
  if (saved->crc != lm_find_crc(0, saved, offsetof(lm_saved, crc))) {
    return lm_refuse(fault, LM_CORRUPT, "crc", LM_REAL(saved->crc), 0, 0);
  }
  if (saved->format != SAVED_FORMAT) {
    return lm_refuse(fault, LM_CORRUPT, "format", LM_REAL(saved->format), LM_REAL(SAVED_FORMAT),
                     LM_REAL(SAVED_FORMAT));
  }
  if (saved->fingerprint != compensator->parameters->fingerprint) {
    return lm_refuse(fault, LM_INCONSISTENT, "fingerprint", LM_REAL(saved->fingerprint), 0, 0);
  }
  compensator->memory = saved->memory;
  lm_settle_model(compensator->parameters, &compensator->memory);
  compensator->lowest_Nm = saved->lowest_Nm;
  compensator->highest_Nm = saved->highest_Nm;
  compensator->standing &= ~LM_STATE_MEMORY_UNKNOWN;
  compensator->standing |= saved->unknown & LM_STATE_MEMORY_UNKNOWN;
  if (saved->unknown &&
      !can_be_swept(saved->lowest_Nm, compensator->memory.plays.torque_Nm, saved->highest_Nm,
                    compensator->parameters->torque_limit_Nm)) {
    forget(compensator);
  }
  return LM_OK;
}
