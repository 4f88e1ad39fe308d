/* The model without effects, for the hot path to take in without a call. */
#ifndef LOSTMOTION_RUNTIME_MODEL_KERNEL_H
#define LOSTMOTION_RUNTIME_MODEL_KERNEL_H

#include "lostmotion/model.h"
#include "lostmotion/state.h"
#include "runtime/curve_kernel.h"
#include "runtime/number.h"
#include "runtime/play_kernel.h"

#if defined(__GNUC__)
#define NOINLINE __attribute__((noinline))
#else
#define NOINLINE
#endif

/* The torque the model believes: what is not finite is the torque before, and nothing passes the
 * limit. */
static inline lm_real believe(lm_real torque_Nm, lm_real before_Nm, lm_real limit_Nm) {
  if (is_within(torque_Nm, limit_Nm)) {
    return torque_Nm;
  }
  if (!is_finite(torque_Nm)) {
    return before_Nm;
  }
  return is_negative(torque_Nm) ? -limit_Nm : limit_Nm;
}

/* The same, and what it is told by. */
static inline lm_real judge_input(lm_real input, lm_real before, lm_real limit, uint32_t *status) {
  if (input == LM_UNKNOWN) {
    *status |= LM_STATE_CONDITION_MISSING;
    return before;
  }
  if (!is_within(input, limit)) {
    *status |= is_finite(input) ? LM_STATE_TORQUE_CLIPPED : LM_STATE_INPUT_REFUSED;
  }
  return believe(input, before, limit);
}

#if LM_EFFECTS_MAX > 0
/* Beyond this no condition means anything, and products with an effect's values would leave float's
 * range. */
#define CONDITION_MAX LM_REAL(1e12)
/* Between two samples, s; a clock that runs backwards stands still. */
#define ELAPSED_MAX LM_REAL(1e6)

/* A condition, or `unknown` where it is not told or means nothing. Twice the sum of two angles of
 * LM_ANGLE_MAX_RAD is still one that lm_sine reduces. */
static inline lm_real judge(lm_real value, lm_real most, lm_real unknown, uint32_t *status) {
  if (is_within(value, most)) {
    return value;
  }
  *status |= value == LM_UNKNOWN ? LM_STATE_CONDITION_MISSING : LM_STATE_INPUT_REFUSED;
  return unknown;
}

/* The same within the range that was fitted. */
static inline lm_real judge_range(lm_real told, const lm_real *range, lm_real unknown,
                                  uint32_t *status) {
  lm_real value = told;
  if (!(value >= range[0] && value <= range[1])) {
    value = judge(value, CONDITION_MAX, unknown, status);
    if (range[0] != 0 || range[1] != 0) {
      lm_real held = clamp(value, range[0], range[1]);
      *status |= held != value ? LM_STATE_EXTRAPOLATED : 0u;
      value = held;
    }
  }
  return value;
}

/* One step with effects at work, to an input that is judged. `untimed_s` is what an elapsed time of
 * 0 or less counts as. Adds to *status what the conditions are told by. */
lm_real lm_step_effects(const lm_parameters *parameters, lm_memory *memory,
                        const lm_conditions *given, lm_real input, lm_real untimed_s,
                        uint32_t *status);

/* The moment of which nothing is known, as effects see it. */
#define NOTHING_KNOWN {0, 0, 0, 0, 0, LM_REFERENCE_TEMPERATURE_C, 0, 0, 0, 0, 0, 0}

static inline int is_told(lm_real value) {
  return is_finite(value) && value != LM_UNKNOWN;
}

/* Everything the effects at work need, LM_NEEDS_ bits. */
static inline uint32_t needs_of(const lm_parameters *parameters) {
  uint32_t needs = 0;
  int32_t i;
  for (i = 0; i < parameters->effect_count; ++i) {
    needs |= parameters->effect[i].effect->covariates;
  }
  return needs;
}
#endif

/* What drives the model: the torque, in the gap profile the commanded angle. */
static inline lm_real model_input(const lm_conditions *at) {
#if LM_PROFILE == LM_PROFILE_GAP
  return at->output_angle_rad;
#else
  return at->torque_Nm;
#endif
}

/* One step to an input that is believed. */
static inline lm_real step_plain(const lm_parameters *parameters, lm_memory *memory,
                                 lm_real input) {
  lm_play_sum sum = advance_plays(&parameters->plays, &memory->plays, input);
#if LM_PROFILE == LM_PROFILE_GAP
  return sum.outside_rad;
#else
  return evaluate_curve(&parameters->curve, input + sum.inside_Nm) + sum.outside_rad;
#endif
}

#endif
