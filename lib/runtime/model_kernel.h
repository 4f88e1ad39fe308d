/* The model without effects, inlined in the control loop functions. */
#ifndef LOSTMOTION_RUNTIME_MODEL_KERNEL_H
#define LOSTMOTION_RUNTIME_MODEL_KERNEL_H

#include "lostmotion/model.h"
#include "lostmotion/state.h"
#include "runtime/curve_kernel.h"
#include "runtime/number.h"
#include "runtime/play_kernel.h"

#if defined(__GNUC__)
#define NOINLINE __attribute__((noinline))
#define UNLIKELY(condition) __builtin_expect((condition), 0)
#else
#define NOINLINE
#define UNLIKELY(condition) (condition)
#endif

/* A valid, known condition: none is larger. */
static inline int is_told(lm_real value) {
  return is_greater(LM_UNKNOWN, absolute(value));
}

/* The torque used by the model: an unknown one is replaced by the previous, and it is clipped at
 * the limit. */
static inline lm_real believe(lm_real torque_Nm, lm_real before_Nm, lm_real limit_Nm) {
  if (is_within(torque_Nm, limit_Nm)) {
    return torque_Nm;
  }
  if (!is_told(torque_Nm)) {
    return before_Nm;
  }
  return with_sign_of(torque_Nm, limit_Nm);
}

/* The conditions that are sufficient for most effects, and a bit in addition to those of LM_NEEDS_:
 * some effect needs another condition, or changes torque, compliance or bands. */
#define USUAL_NEEDS (LM_NEEDS_TORQUE | LM_NEEDS_TEMPERATURE | LM_NEEDS_TIME)
#define NEEDS_MORE 0x80000000u

#if LM_EFFECTS_MAX > 0
/* A condition, or `unknown` if it is unknown or invalid. Twice the sum of two angles of
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
  if (value >= range[0] && value <= range[1]) {
    return value;
  }
  value = judge(value, LM_CONDITION_MAX, unknown, status);
  if (value >= range[0] && value <= range[1]) {
    return value;
  }
  if (range[0] != 0 || range[1] != 0) {
    *status |= LM_STATE_EXTRAPOLATED;
    value = value > range[1] ? range[1] : range[0];
  }
  return value;
}

/* Conditions for effects when nothing is known. */
#define ZERO_OF(field, ...) 0,
#define USUAL_OF(field, NEED, usual, uses) usual,
#define NOTHING_KNOWN {LM_CONDITION_LIST(ZERO_OF, ZERO_OF, USUAL_OF, USUAL_OF) 0, 0}

/* Conditions that the active effects need. */
static inline uint32_t needs_of(const lm_parameters *parameters) {
  uint32_t needs = 0;
  uint32_t more = 0;
  int32_t i;
  for (i = 0; i < parameters->effect_count; ++i) {
    const lm_effect *effect = parameters->effect[i].effect;
    needs |= effect->covariates;
    more |= effect->kind != LM_EFFECT_ANGLE ? NEEDS_MORE : 0u;
  }
  more |= (needs & ~USUAL_NEEDS) ? NEEDS_MORE : 0u;
  return needs | more;
}
#else
static inline uint32_t needs_of(const lm_parameters *parameters) {
  (void)parameters;
  return 0;
}
#endif

/* Between two samples, s; a clock that runs backwards is at rest. */
#define ELAPSED_MAX LM_REAL(1e6)

/* The time between two samples for effects; an unknown or invalid one is `untold`. */
static inline lm_real take_elapsed(lm_real told_s, lm_real untold_s) {
  if (!(told_s > 0)) {
    return untold_s;
  }
  return least(told_s, ELAPSED_MAX);
}

/* Input of the model: the torque, in the gap profile the commanded angle. */
static inline lm_real model_input(const lm_conditions *at) {
#if LM_PROFILE == LM_PROFILE_GAP
  return at->output_angle_rad;
#else
  return at->torque_Nm;
#endif
}

#if LM_EFFECTS_MAX > 0
/* State of a step between the effects before the operators' step and effects on the angle. */
typedef struct lm_progress {
  const lm_effect_use *use; /* the next effect */
  lm_real *own;             /* its memory */
} lm_progress;

/* For NEEDS_MORE: reads the conditions that few effects need, runs those on torque, compliance and
 * bands, and then winds the drive up. at->torque_Nm is the input, and becomes the torque with these
 * effects. Returns what the conditions are stated by. */
uint32_t lm_advance_through_effects(const lm_parameters *parameters, lm_memory *memory,
                                    const lm_conditions *given, lm_conditions *at, uint32_t needs,
                                    lm_progress *progress);

/* One by one: a copy of a constant becomes a call of memset. */
#define KEEP(field, ...)
#define START_AT_ZERO(field, ...) at->field = 0;
#define START_AT_USUAL(field, NEED, usual, uses) at->field = usual;
#define READ_USUAL_NEED(field, NEED, usual, uses)                                  \
  if (needs & LM_NEEDS_##NEED) {                                                   \
    at->field = judge_range(given->field, parameters->valid.field, usual, status); \
  }

/* Conditions for the active effects before the operators move. */
static inline void read_moment(lm_conditions *at, const lm_parameters *parameters,
                               const lm_conditions *given, lm_real input, lm_real elapsed_s,
                               uint32_t needs, uint32_t *status) {
  at->torque_Nm = input;
  LM_CONDITION_LIST(KEEP, START_AT_ZERO, START_AT_USUAL, START_AT_USUAL)
  at->elapsed_s = elapsed_s;
  LM_CONDITION_LIST(KEEP, KEEP, KEEP, READ_USUAL_NEED)
}
#endif

/* What the operators follow, with the friction of the step before. What is remembered of a missing
 * torque (not `told`) is what they followed: they stay there, and the torque is found from it. */
static inline lm_real follow(const lm_parameters *parameters, const lm_play_memory *plays,
                             lm_real *torque_Nm, lm_real compliance, int told) {
  const lm_play_bank *bank = &parameters->plays;
  lm_real limit_Nm = parameters->torque_limit_Nm;
  lm_real given_Nm = *torque_Nm;
  if (told) {
    return believe(followed_torque(bank, plays, given_Nm, compliance), given_Nm, limit_Nm);
  }
  *torque_Nm = believe(followed_torque(bank, plays, given_Nm, 1 / compliance), given_Nm, limit_Nm);
  return given_Nm;
}

/* A compliance with all effects on it. */
static inline lm_real limit_compliance(lm_real compliance) {
  return clamp(compliance, 1 / LM_COMPLIANCE_MAX, LM_COMPLIANCE_MAX);
}

/* One step to a valid input, `elapsed_s` after the one before (take_elapsed); `needs` those of the
 * parameters. Adds to *status what the conditions are stated by. Effects come in the order of their
 * kinds and take their memory one after the other. Most are angles that need only torque and
 * temperature; everything else is outside their path. */
static inline lm_real step_model(const lm_parameters *parameters, lm_memory *memory,
                                 const lm_conditions *given, lm_real input, lm_real elapsed_s,
                                 uint32_t needs, uint32_t *status) {
  lm_play_sum sum;
#if LM_EFFECTS_MAX == 0
  (void)given;
  (void)elapsed_s;
  (void)needs;
  (void)status;
  sum = advance_plays(&parameters->plays, &memory->plays, input);
#if LM_PROFILE == LM_PROFILE_GAP
  return sum.outside_rad;
#else
  return EVALUATE_CURVE(&parameters->curve, input + sum.inside_Nm) + sum.outside_rad;
#endif
#else
  const lm_effect_use *use = parameters->effect;
  int32_t left = parameters->effect_count;
  lm_conditions at;
  lm_real *own;
  lm_real angle_rad;
#if LM_EFFECT_MEMORY_MAX > 0
  own = memory->effect;
#else
  own = 0;
#endif
  if (left > 0) {
    read_moment(&at, parameters, given, input, elapsed_s, needs, status);
  }
  if (needs & NEEDS_MORE) {
    lm_progress progress;
    progress.use = use;
    progress.own = own;
    *status |= lm_advance_through_effects(parameters, memory, given, &at, needs, &progress);
    left -= (int32_t)(progress.use - use);
    use = progress.use;
    own = progress.own;
    angle_rad = at.elastic_rad;
  } else {
    sum = advance_plays(&parameters->plays, &memory->plays, input);
    at.wound_Nm = input + sum.inside_Nm;
    angle_rad = EVALUATE_CURVE(&parameters->curve, at.wound_Nm) + sum.outside_rad;
    at.elastic_rad = angle_rad;
  }
  for (; left > 0; --left) {
    const lm_effect *effect = use->effect;
    angle_rad += effect->run(use->value, own, &at);
#if LM_EFFECT_MEMORY_MAX > 0
    own += effect->memory_count;
#endif
    ++use;
  }
  return angle_rad;
#endif
}

#if defined(__OPTIMIZE_SIZE__)
/* The same as a function, where size has priority over speed. */
lm_real lm_step_believed(const lm_parameters *parameters, lm_memory *memory,
                         const lm_conditions *given, lm_real input, lm_real elapsed_s,
                         uint32_t needs, uint32_t *status);
#define STEP_MODEL lm_step_believed
#else
#define STEP_MODEL step_model
#endif

#endif
