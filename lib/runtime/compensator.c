#include "lostmotion/compensator.h"

#include <stddef.h>

#include "runtime/model_kernel.h"
#include "runtime/number.h"

#define SAVED_FORMAT 1u

/* A measured lost motion beyond this many turns is not one. It keeps the powers finite. */
#define LOST_MOTION_MAX_RAD LM_REAL(1000)

/* The three stages of the limiter, position to velocity to acceleration to jerk, each four times as
 * fast as the one before. Then each stage approaches its bound without passing it:
 *
 * Let a be the acceleration after a tick, v the velocity, V its bound, k2 the second rate, k3 the
 * third, all in ticks, and suppose a <= 2 k2 (V - v). The next acceleration is at most
 * (1 - k3) a + k3 k2 (V - v), and with k3 = 4 k2 that keeps the supposition true, so v <= V for
 * ever. Where the jerk limit binds it needs jerk >= 2 k2 a besides, hence the acceleration is held
 * below jerk / (2 k2) = jerk / (8 response). The same argument one stage up holds the velocity
 * below acceleration / (2 response). */
#define STAGE_RATIO LM_REAL(4)

/* Passing a bound by this, relatively, is rounding. */
#define ROUNDING LM_REAL(1.00001)

/* The argument above wants |a| <= A, |v| <= A / (2 response) and 8 response A of jerk, A being the
 * acceleration's bound. Bounds that were narrowed while the correction moves need not hold that:
 * with no jerk left the acceleration would stay, and the velocity grow, for ever. So A is at least
 * what the motion has now. In position it goes no further out than it stands. */
static void leave_room_to_end(lm_compensator *c) {
  const lm_limits *limits = &c->parameters->limits;
  lm_real twice_per_s = 2 * limits->response_per_s;
  lm_real needed_rad_s2 =
      greatest(absolute(c->acceleration_rad_s2), twice_per_s * absolute(c->velocity_rad_s));
  c->standing &= ~LM_STATE_HEADROOM_SHORT;
  if (is_greater(needed_rad_s2, ROUNDING * c->acceleration_max_rad_s2)) {
    c->acceleration_max_rad_s2 = needed_rad_s2;
    c->jerk_step_rad_s2 =
        greatest(c->jerk_step_rad_s2, STAGE_RATIO * twice_per_s * limits->period_s * needed_rad_s2);
    c->standing |= LM_STATE_HEADROOM_SHORT;
  }
  c->correction_end_rad = greatest(limits->correction_rad, absolute(c->correction_rad));
}

/* min(limit, headroom); zero for a headroom that is negative or NaN. */
static lm_real narrow(lm_real limit, lm_real headroom) {
  return clamp(headroom, 0, limit);
}

void lm_set_headroom(lm_compensator *compensator, const lm_headroom *headroom) {
  const lm_limits *limits = &compensator->parameters->limits;
  lm_real jerk_rad_s3 = limits->jerk_rad_s3;
  lm_real response_per_s = limits->response_per_s;
  compensator->correction_max_rad = limits->correction_rad;
  compensator->velocity_max_rad_s = limits->velocity_rad_s;
  compensator->acceleration_max_rad_s2 = limits->acceleration_rad_s2;
  if (headroom) {
    jerk_rad_s3 = narrow(jerk_rad_s3, headroom->jerk_rad_s3);
    compensator->correction_max_rad =
        narrow(compensator->correction_max_rad, headroom->correction_rad);
    compensator->velocity_max_rad_s =
        narrow(compensator->velocity_max_rad_s, headroom->velocity_rad_s);
    compensator->acceleration_max_rad_s2 =
        narrow(compensator->acceleration_max_rad_s2, headroom->acceleration_rad_s2);
  }
  compensator->jerk_step_rad_s2 = jerk_rad_s3 * limits->period_s;
  compensator->acceleration_max_rad_s2 =
      least(compensator->acceleration_max_rad_s2, jerk_rad_s3 / (2 * STAGE_RATIO * response_per_s));
  compensator->velocity_max_rad_s = least(
      compensator->velocity_max_rad_s, compensator->acceleration_max_rad_s2 / (2 * response_per_s));
  leave_room_to_end(compensator);
}

static void prepare(lm_compensator *compensator) {
  const lm_limits *limits = &compensator->parameters->limits;
  lm_real response_per_s = limits->response_per_s;
  lm_real tick = response_per_s * limits->period_s;
  compensator->lead_ticks = 1 / tick;
  compensator->velocity_per_s = response_per_s;
  compensator->acceleration_per_s = STAGE_RATIO * response_per_s;
  compensator->jerk_share = least(STAGE_RATIO * STAGE_RATIO * tick, 1);
  lm_set_headroom(compensator, 0);
}

static void forget(lm_compensator *compensator) {
  lm_real torque_Nm = compensator->memory.plays.torque_Nm;
  compensator->lowest_Nm = torque_Nm;
  compensator->highest_Nm = torque_Nm;
  compensator->standing |= LM_STATE_MEMORY_UNKNOWN;
}

/* Every field that neither the memory nor the parameters determine. */
static void rest(lm_compensator *compensator) {
  compensator->lost_motion_rad = 0;
  compensator->target_rad = 0;
  compensator->correction_rad = 0;
  compensator->velocity_rad_s = 0;
  compensator->acceleration_rad_s2 = 0;
  compensator->gain = 1;
  compensator->mean_measured_rad = 0;
  compensator->mean_residual_rad = 0;
  compensator->power_measured_rad2 = 0;
  compensator->power_residual_rad2 = 0;
  compensator->watching = 0;
  compensator->mode = LM_MODE_RUN;
  compensator->standing = 0;
}

lm_status lm_start_compensator(lm_compensator *compensator, const lm_parameters *parameters,
                               lm_real torque_Nm, lm_fault *fault) {
  lm_status status;
  if (!compensator) {
    return lm_refuse(fault, LM_NULL, "compensator", 0, 0, 0);
  }
  status = lm_check_parameters(parameters, fault);
  if (status != LM_OK) {
    return status;
  }
  compensator->parameters = parameters;
  rest(compensator);
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

/* The wish, or the bound it passes, and then the status bit that says so; NaN gives the lower
 * bound.
 */
static lm_real hold(lm_real wish, lm_real most, uint32_t bit, uint32_t *status) {
  if (is_within(wish, most)) {
    return wish;
  }
  *status |= bit;
  return wish > 0 ? most : -most;
}

static uint32_t follow_target(lm_compensator *c, lm_real target_rad, uint32_t status) {
  lm_real period_s = c->parameters->limits.period_s;
  /* Aiming ahead by what the target moves in 1 / response makes up for the first stage's lag. */
  lm_real aim_rad = hold(target_rad + (target_rad - c->target_rad) * c->lead_ticks,
                         c->correction_max_rad, LM_STATE_POSITION_LIMITED, &status);
  lm_real velocity = hold((aim_rad - c->correction_rad) * c->velocity_per_s, c->velocity_max_rad_s,
                          LM_STATE_VELOCITY_LIMITED, &status);
  lm_real acceleration = hold((velocity - c->velocity_rad_s) * c->acceleration_per_s,
                              c->acceleration_max_rad_s2, LM_STATE_ACCELERATION_LIMITED, &status);
  lm_real change = hold((acceleration - c->acceleration_rad_s2) * c->jerk_share,
                        c->jerk_step_rad_s2, LM_STATE_JERK_LIMITED, &status);
  c->target_rad = target_rad;
  c->acceleration_rad_s2 += change;
  c->velocity_rad_s += c->acceleration_rad_s2 * period_s;
  c->correction_rad = hold(c->correction_rad + c->velocity_rad_s * period_s, c->correction_end_rad,
                           LM_STATE_POSITION_LIMITED, &status);
  return status;
}

#if LM_EFFECTS_MAX > 0
/* The same judgement as the model's, which replaces what fails. */
static int means_something(const lm_conditions *at) {
  return is_within(at->input_angle_rad, LM_ANGLE_MAX_RAD) &&
         is_within(at->output_angle_rad, LM_ANGLE_MAX_RAD) &&
         is_within(at->input_velocity_rad_s, CONDITION_MAX) &&
         is_within(at->output_acceleration_rad_s2, CONDITION_MAX) &&
         is_within(at->temperature_C, CONDITION_MAX) && is_within(at->cycles, CONDITION_MAX) &&
         is_within(at->tilt_moment_Nm, CONDITION_MAX) &&
         is_within(at->axial_force_N, CONDITION_MAX) && is_finite(at->elapsed_s);
}

/* The period counts where no time is told. Apart, so that the copy's frame costs nothing where no
 * effect is at work. */
NOINLINE static lm_real step_one_period(const lm_parameters *parameters, lm_memory *memory,
                                        const lm_conditions *given) {
  lm_conditions at = *given;
  at.elapsed_s = parameters->limits.period_s;
  return lm_step_model(parameters, memory, &at);
}
#endif

/* The model's step to an input that is judged already. Taken in without a call where speed counts;
 * where size does (-Os), and for effects, the one copy in model.c. */
static inline lm_real step_model(const lm_parameters *parameters, lm_memory *memory,
                                 const lm_conditions *at, lm_real input) {
#if LM_EFFECTS_MAX > 0
  if (parameters->effect_count > 0) {
    return at->elapsed_s > 0 ? lm_step_model(parameters, memory, at)
                             : step_one_period(parameters, memory, at);
  }
#endif
#if defined(__OPTIMIZE_SIZE__)
  (void)input;
  return lm_step_model(parameters, memory, at);
#else
  (void)at;
  return step_plain(parameters, memory, input);
#endif
}

lm_correction lm_step_compensator(lm_compensator *compensator, const lm_conditions *at) {
  lm_correction result;
  const lm_parameters *parameters = compensator->parameters;
  lm_play_memory *plays = &compensator->memory.plays;
  lm_real input = model_input(at);
  lm_real target_rad = compensator->target_rad;
  lm_real angle_rad;
  uint32_t status = compensator->standing;
  if (!is_within(input, parameters->torque_limit_Nm)) {
    status |= is_finite(input) ? LM_STATE_TORQUE_CLIPPED : LM_STATE_INPUT_REFUSED;
    input = believe(input, plays->torque_Nm, parameters->torque_limit_Nm);
  }
#if LM_EFFECTS_MAX > 0
  if (parameters->effect_count > 0) {
    status |= means_something(at) ? 0u : LM_STATE_INPUT_REFUSED;
  }
#endif
  angle_rad = step_model(parameters, &compensator->memory, at, input);
  if (status & LM_STATE_MEMORY_UNKNOWN) {
    if (is_greater(compensator->lowest_Nm, plays->torque_Nm)) {
      compensator->lowest_Nm = plays->torque_Nm;
    }
    if (is_greater(plays->torque_Nm, compensator->highest_Nm)) {
      compensator->highest_Nm = plays->torque_Nm;
    }
  }
  if (is_within(angle_rad, LOST_MOTION_MAX_RAD)) {
    compensator->lost_motion_rad = angle_rad;
  } else {
    status |= LM_STATE_MODEL_REFUSED;
  }
  if (compensator->mode == LM_MODE_RUN) {
    target_rad = -compensator->gain * compensator->lost_motion_rad;
  } else if (compensator->mode == LM_MODE_HOLD) {
    /* stays */
  } else {
    target_rad = 0;
  }
  status = follow_target(compensator, target_rad, status);
  result.correction_rad = compensator->correction_rad;
  result.velocity_rad_s = compensator->velocity_rad_s;
  result.acceleration_rad_s2 = compensator->acceleration_rad_s2;
  result.lost_motion_rad = compensator->lost_motion_rad;
  result.status = status;
  return result;
}

void lm_set_mode(lm_compensator *compensator, lm_mode mode) {
  compensator->mode = mode;
  compensator->standing &= ~(LM_STATE_HOLDING | LM_STATE_RESETTING);
  if (mode == LM_MODE_HOLD) {
    compensator->standing |= LM_STATE_HOLDING;
  } else if (mode == LM_MODE_RUN) {
    /* neither */
  } else {
    compensator->standing |= LM_STATE_RESETTING;
  }
}

void lm_declare_memory_known(lm_compensator *compensator) {
  compensator->standing &= ~LM_STATE_MEMORY_UNKNOWN;
}

/* How much further than the model's own torque the plays inside may let the backbone be wound, as
 * an angle; the backbone rises, so the ends of the range are the extremes. */
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

/* The range that play i may still be in. At the start it was anywhere in its band. A rising load
 * lifted it at least to the lower edge at the load's highest, a falling one lowered it at most to
 * the upper edge at its lowest, in whatever order: what is left is [low, high] or, once it is
 * known, nothing. The edges rise with the load, so the band at the start itself adds nothing. */
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

lm_real lm_bound_uncertainty(lm_compensator *compensator) {
  const lm_play_bank *bank = &compensator->parameters->plays;
  const lm_play_memory *plays = &compensator->memory.plays;
  const lm_real at_Nm = lm_find_envelope(bank, plays->torque_Nm);
  lm_real wound_Nm = plays->torque_Nm;
  lm_real up_Nm = 0;
  lm_real down_Nm = 0;
  lm_real up_rad = 0;
  lm_real down_rad = 0;
  int32_t unknown = 0;
  int32_t i;
  if (!(compensator->standing & LM_STATE_MEMORY_UNKNOWN)) {
    return 0;
  }
  for (i = bank->outside_count; i < bank->count; ++i) {
    wound_Nm += bank->slot[i].weight * (plays->z_Nm[i] - at_Nm);
  }
  for (i = 0; i < bank->count; ++i) {
    lm_real low_Nm;
    lm_real high_Nm;
    if (is_unknown(compensator, i, &low_Nm, &high_Nm)) {
      unknown += 1;
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
  if (unknown == 0) {
    lm_declare_memory_known(compensator);
  }
  up_rad += wind(compensator->parameters, wound_Nm, up_Nm);
  down_rad -= wind(compensator->parameters, wound_Nm, -down_Nm);
  return greatest(up_rad, down_rad);
}

/* True where some play has another band than before: then it stands where the old band left it, and
 * the load that swept the old one has not swept this. */
static int has_other_bands(const lm_play_bank *bank, const lm_play_bank *before) {
  int other = bank->envelope_Nm != before->envelope_Nm || bank->knee_Nm != before->knee_Nm;
  int32_t i;
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
  int other_bands;
  if (!compensator) {
    return lm_refuse(fault, LM_NULL, "compensator", 0, 0, 0);
  }
  status = lm_check_parameters(parameters, fault);
  if (status != LM_OK) {
    return status;
  }
  other_bands = has_other_bands(&parameters->plays, &compensator->parameters->plays);
  compensator->parameters = parameters;
  lm_settle_model(parameters, &compensator->memory);
  if (other_bands) {
    forget(compensator);
  }
  prepare(compensator);
  return LM_OK;
}

#if LM_PROFILE == LM_PROFILE_GAP
lm_status lm_shift_angle(lm_compensator *compensator, lm_real by_rad, lm_fault *fault) {
  lm_play_memory *plays;
  lm_real limit_rad;
  lm_status status;
  int32_t i;
  if (!compensator) {
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
  /* What was swept beyond the limit counts as swept up to it. */
  compensator->lowest_Nm = clamp(compensator->lowest_Nm + by_rad, -limit_rad, limit_rad);
  compensator->highest_Nm = clamp(compensator->highest_Nm + by_rad, -limit_rad, limit_rad);
  return LM_OK;
}
#endif

/* First-order mean over the window; the backward step is stable for any ratio of the two times. */
static void average(lm_real *mean, lm_real value, lm_real share) {
  *mean += share * (value - *mean);
}

void lm_watch_output(lm_compensator *compensator, lm_real lost_motion_rad, lm_real elapsed_s) {
  const lm_watch *watch = &compensator->parameters->watch;
  lm_real residual_rad = lost_motion_rad - compensator->lost_motion_rad;
  lm_real share;
  lm_real fade;
  lm_real measured;
  lm_real residual;
  if (!(absolute(lost_motion_rad) <= LOST_MOTION_MAX_RAD) || !(elapsed_s > 0) ||
      !is_finite(elapsed_s)) {
    compensator->standing |= LM_STATE_WATCH_REFUSED;
    return;
  }
  compensator->standing &= ~(LM_STATE_WATCH_REFUSED | LM_STATE_MISFIT | LM_STATE_FADED);
  if (!compensator->watching) {
    compensator->watching = 1;
    compensator->mean_measured_rad = lost_motion_rad;
    compensator->mean_residual_rad = residual_rad;
  }
  share = elapsed_s / (elapsed_s + watch->window_s);
  average(&compensator->mean_measured_rad, lost_motion_rad, share);
  average(&compensator->mean_residual_rad, residual_rad, share);
  measured = lost_motion_rad - compensator->mean_measured_rad;
  residual = residual_rad - compensator->mean_residual_rad;
  average(&compensator->power_measured_rad2, measured * measured, share);
  average(&compensator->power_residual_rad2, residual * residual, share);
  fade = elapsed_s / watch->fade_s;
  /* The measurement's own noise is in both powers: at rest, where there is nothing else, rounding
   * would decide between them. */
  if (compensator->power_residual_rad2 >
      compensator->power_measured_rad2 + watch->noise_rad * watch->noise_rad) {
    fade = -fade;
  }
  compensator->gain = clamp(compensator->gain + fade, 0, 1);
  if (compensator->gain < 1) {
    compensator->standing |= LM_STATE_FADED;
  }
  if (compensator->power_residual_rad2 > watch->misfit_rad * watch->misfit_rad) {
    compensator->standing |= LM_STATE_MISFIT;
  }
}

/* Fields without a hole between them, so that the CRC sees nothing but what is written. */
typedef char saved_has_no_holes
    [sizeof(lm_saved) == 4 * sizeof(uint32_t) + sizeof(lm_memory) + 2 * sizeof(lm_real) ? 1 : -1];

void lm_save_compensator(const lm_compensator *compensator, lm_saved *saved) {
  saved->format = SAVED_FORMAT;
  saved->fingerprint = compensator->parameters->fingerprint;
  saved->memory = compensator->memory;
  saved->lowest_Nm = compensator->lowest_Nm;
  saved->highest_Nm = compensator->highest_Nm;
  saved->unknown = compensator->standing & LM_STATE_MEMORY_UNKNOWN;
  saved->crc = lm_find_crc(0, saved, offsetof(lm_saved, crc));
}

/* A range that the load can have swept to stand where it does; not if any of it is NaN. */
static int can_be_swept(lm_real lowest_Nm, lm_real torque_Nm, lm_real highest_Nm,
                        lm_real limit_Nm) {
  return lowest_Nm >= -limit_Nm && lowest_Nm <= torque_Nm && torque_Nm <= highest_Nm &&
         highest_Nm <= limit_Nm;
}

lm_status lm_restore_compensator(lm_compensator *compensator, const lm_saved *saved,
                                 lm_fault *fault) {
  if (!compensator || !saved) {
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
