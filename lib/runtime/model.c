#include "lostmotion/model.h"

#include "runtime/model_kernel.h"
#include "runtime/number.h"
#include "runtime/plain_symbol.h"

#if LM_REAL_BITS == 64
#define HALVINGS 52
#else
#define HALVINGS 24
#endif

uint32_t lm_find_needs(const lm_parameters *parameters) {
  if (!parameters) {
    return 0;
  }
#if LM_PROFILE == LM_PROFILE_GAP
  return LM_NEEDS_OUTPUT_ANGLE;
#else
  return (needs_of(parameters) & ~NEEDS_MORE) | LM_NEEDS_TORQUE;
#endif
}

void lm_start_model(lm_memory *memory, lm_real torque_Nm) {
#if LM_EFFECT_MEMORY_MAX > 0
  int32_t i;
  for (i = 0; i < LM_EFFECT_MEMORY_MAX; ++i) {
    memory->effect[i] = 0;
  }
#endif
#if LM_EFFECTS_MAX > 0
  memory->width_scale = 1;
#endif
  lm_center_plays(&memory->plays, is_finite(torque_Nm) ? torque_Nm : 0);
}
PLAIN_SYMBOL(lm_start_model, LM_SIZES_TEXT)

#if LM_EFFECTS_MAX > 0
/* Effects that widen the bands. Without them every operator stays within its band, as advance_plays
 * requires. */
static int has_widths(const lm_parameters *parameters) {
  int32_t i;
  for (i = 0; i < parameters->effect_count; ++i) {
    if (parameters->effect[i].effect->kind == LM_EFFECT_WIDTH) {
      return 1;
    }
  }
  return 0;
}
#endif

void lm_settle_model(const lm_parameters *parameters, lm_memory *memory) {
  lm_real torque_Nm = believe(memory->plays.torque_Nm, 0, parameters->torque_limit_Nm);
#if LM_EFFECT_MEMORY_MAX > 0
  int32_t i;
  for (i = 0; i < LM_EFFECT_MEMORY_MAX; ++i) {
    memory->effect[i] = is_finite(memory->effect[i]) ? memory->effect[i] : 0;
  }
#endif
  memory->plays.torque_Nm = torque_Nm;
#if LM_EFFECTS_MAX > 0
  /* Effects may have widened the bands; the present factor is unknown, the largest is known. */
  if (has_widths(parameters)) {
    memory->width_scale = clamp(memory->width_scale, 1, LM_WIDTH_SCALE_MAX);
    (void)lm_advance_scaled_plays(&parameters->plays, &memory->plays, torque_Nm,
                                  memory->width_scale);
    return;
  }
  memory->width_scale = 1;
#endif
  lm_settle_plays(&parameters->plays, &memory->plays);
}

#if LM_EFFECTS_MAX > 0
#define SKIP(field, ...)
#define READ_BOUNDED(field, NEED, most)                \
  if (needs & LM_NEEDS_##NEED) {                       \
    at->field = judge(given->field, most, 0, &status); \
  }
/* Optional conditions are read but not reported as missing. */
#define READ_FITTED(field, NEED, usual, uses)                             \
  if (needs & (LM_NEEDS_##NEED | (uses))) {                               \
    uint32_t told_by = 0;                                                 \
    at->field = judge_range(given->field, valid->field, usual, &told_by); \
    status |= told_by * ((needs / LM_NEEDS_##NEED) & 1u); /* its bit */   \
  }

/* The conditions that few effects need. */
static uint32_t read_rare(lm_conditions *at, const lm_parameters *parameters,
                          const lm_conditions *given, uint32_t needs) {
  const lm_validity *valid = &parameters->valid;
  uint32_t status = 0;
  LM_CONDITION_LIST(SKIP, READ_BOUNDED, READ_FITTED, SKIP)
  return status;
}

uint32_t lm_advance_through_effects(const lm_parameters *parameters, lm_memory *memory,
                                    const lm_conditions *given, lm_conditions *at, uint32_t needs,
                                    lm_progress *progress) {
  uint32_t status = read_rare(at, parameters, given, needs);
  const lm_effect_use *use = progress->use;
  const lm_effect_use *end = parameters->effect + parameters->effect_count;
  lm_real *own = progress->own;
  lm_real input = at->torque_Nm;
  lm_real torque_Nm = input;
  lm_real followed_Nm;
  lm_real compliance = 1;
  lm_play_sum sum;
  at->wound_Nm = input;
  at->elastic_rad = 0;
  if (use->effect->kind == LM_EFFECT_TORQUE) {
    for (; use < end && use->effect->kind == LM_EFFECT_TORQUE; ++use) {
      torque_Nm += use->effect->run(use->value, own, at);
      own += use->effect->memory_count;
    }
    /* A missing torque is replaced by the previous one, which already includes the effects. */
    torque_Nm =
        is_told(given->torque_Nm) ? believe(torque_Nm, input, parameters->torque_limit_Nm) : input;
    at->torque_Nm = torque_Nm;
    at->wound_Nm = torque_Nm;
  }
  followed_Nm = torque_Nm;
  if (use < end && use->effect->kind == LM_EFFECT_COMPLIANCE) {
    for (; use < end && use->effect->kind == LM_EFFECT_COMPLIANCE; ++use) {
      compliance += use->effect->run(use->value, own, at);
      own += use->effect->memory_count;
    }
    compliance = limit_compliance(compliance);
    followed_Nm =
        follow(parameters, &memory->plays, &torque_Nm, compliance, is_told(given->torque_Nm));
    at->torque_Nm = torque_Nm;
    at->wound_Nm = torque_Nm;
  }
  if (use < end && use->effect->kind == LM_EFFECT_WIDTH) {
    lm_real width_scale = 1;
    at->elastic_rad = compliance * EVALUATE_CURVE(&parameters->curve, torque_Nm);
    for (; use < end && use->effect->kind == LM_EFFECT_WIDTH; ++use) {
      width_scale *= use->effect->run(use->value, own, at);
      own += use->effect->memory_count;
    }
    width_scale = clamp(width_scale, 0, LM_WIDTH_SCALE_MAX);
    memory->width_scale = greatest(memory->width_scale, width_scale);
    sum = lm_advance_scaled_plays(&parameters->plays, &memory->plays, followed_Nm, width_scale);
  } else {
    sum = lm_advance_plays(&parameters->plays, &memory->plays, followed_Nm);
  }
  at->wound_Nm = torque_Nm + sum.inside_Nm;
  at->elastic_rad = compliance * EVALUATE_CURVE(&parameters->curve, at->wound_Nm) + sum.outside_rad;
  progress->use = use;
  progress->own = own;
  return status;
}
#endif

#if defined(__OPTIMIZE_SIZE__)
lm_real lm_step_believed(const lm_parameters *parameters, lm_memory *memory,
                         const lm_conditions *given, lm_real input, lm_real elapsed_s,
                         uint32_t needs, uint32_t *status) {
  return step_model(parameters, memory, given, input, elapsed_s, needs, status);
}
#endif

lm_real lm_step_model(const lm_parameters *parameters, lm_memory *memory, const lm_conditions *at) {
  uint32_t status = 0;
  lm_real input = believe(model_input(at), memory->plays.torque_Nm, parameters->torque_limit_Nm);
  return STEP_MODEL(parameters, memory, at, input, take_elapsed(at->elapsed_s, 0),
                    needs_of(parameters), &status);
}

lm_real lm_evaluate_model(const lm_parameters *parameters, const lm_memory *memory,
                          lm_memory *trial, const lm_conditions *at) {
  *trial = *memory;
  return lm_step_model(parameters, trial, at);
}

#if LM_PROFILE != LM_PROFILE_GAP
lm_status lm_invert_model(const lm_parameters *parameters, const lm_memory *memory,
                          const lm_conditions *at, lm_real angle_rad, lm_real *torque_Nm,
                          lm_fault *fault) {
  lm_conditions probe;
  lm_memory trial;
  lm_real low_Nm;
  lm_real high_Nm;
  lm_real low_rad;
  lm_real high_rad;
  int32_t i;
  if (!parameters || !memory || !at || !torque_Nm) {
    return lm_refuse(fault, LM_NULL, "parameters", 0, 0, 0);
  }
  if (!is_finite(angle_rad)) {
    return lm_refuse(fault, LM_NOT_FINITE, "angle_rad", angle_rad, 0, 0);
  }
  probe = *at;
  low_Nm = -parameters->torque_limit_Nm;
  high_Nm = parameters->torque_limit_Nm;
  probe.torque_Nm = low_Nm;
  low_rad = lm_evaluate_model(parameters, memory, &trial, &probe);
  probe.torque_Nm = high_Nm;
  high_rad = lm_evaluate_model(parameters, memory, &trial, &probe);
  if (!(angle_rad >= low_rad && angle_rad <= high_rad)) {
    return lm_refuse(fault, LM_OUT_OF_RANGE, "angle_rad", angle_rad, low_rad, high_rad);
  }
  for (i = 0; i < HALVINGS; ++i) {
    lm_real middle_rad;
    probe.torque_Nm = low_Nm + (high_Nm - low_Nm) * LM_REAL(0.5);
    middle_rad = lm_evaluate_model(parameters, memory, &trial, &probe);
    if (middle_rad <= angle_rad) {
      low_Nm = probe.torque_Nm;
      low_rad = middle_rad;
    } else {
      high_Nm = probe.torque_Nm;
      high_rad = middle_rad;
    }
  }
  /* The model is piecewise linear between the two, or flat there. */
  if (high_rad > low_rad) {
    low_Nm += (high_Nm - low_Nm) * ((angle_rad - low_rad) / (high_rad - low_rad));
  }
  *torque_Nm = low_Nm;
  return LM_OK;
}

#endif
