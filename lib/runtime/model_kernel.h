/* The model without effects, for the hot path to take in without a call. */
#ifndef LOSTMOTION_RUNTIME_MODEL_KERNEL_H
#define LOSTMOTION_RUNTIME_MODEL_KERNEL_H

#include "lostmotion/model.h"
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

#if LM_EFFECTS_MAX > 0
/* Beyond this no condition means anything, and products with an effect's values would leave float's
 * range. */
#define CONDITION_MAX LM_REAL(1e12)
/* Between two samples, s; a clock that runs backwards stands still. */
#define ELAPSED_MAX LM_REAL(1e6)

static inline lm_real known(lm_real value, lm_real unknown) {
  return is_within(value, CONDITION_MAX) ? value : unknown;
}

/* Twice the sum of two such angles is still one that lm_sine reduces. */
static inline lm_real known_angle(lm_real angle_rad) {
  return is_within(angle_rad, LM_ANGLE_MAX_RAD) ? angle_rad : 0;
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
