#include "lostmotion/model.h"

#include "runtime/model_kernel.h"
#include "runtime/number.h"

#if LM_REAL_BITS == 64
#define HALVINGS 52
#else
#define HALVINGS 24
#endif

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
  /* Effects may have widened the bands; by how much just now is not known, by how much at most is.
   */
  if (parameters->effect_count > 0) {
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
static void keep_known(lm_conditions *at) {
  at->input_angle_rad = known_angle(at->input_angle_rad);
  at->output_angle_rad = known_angle(at->output_angle_rad);
  at->input_velocity_rad_s = known(at->input_velocity_rad_s, 0);
  at->output_acceleration_rad_s2 = known(at->output_acceleration_rad_s2, 0);
  at->temperature_C = known(at->temperature_C, LM_REFERENCE_TEMPERATURE_C);
  at->cycles = known(at->cycles, 0);
  at->tilt_moment_Nm = known(at->tilt_moment_Nm, 0);
  at->axial_force_N = known(at->axial_force_N, 0);
  at->elapsed_s = clamp(at->elapsed_s, 0, ELAPSED_MAX);
}

/* Apart from the plain model, so that its frame costs nothing where no effect is at work. Effects
 * come in the order torque, width, angle, and take their memory one after the other. */
NOINLINE static lm_real step_with_effects(const lm_parameters *parameters, lm_memory *memory,
                                          const lm_conditions *given, lm_real measured_Nm) {
  const lm_effect_use *use = parameters->effect;
  const lm_effect_use *end = use + parameters->effect_count;
  lm_conditions at = *given;
  lm_real *own;
  lm_real torque_Nm = measured_Nm;
  lm_real width_scale = 1;
  lm_real angle_rad;
  lm_play_sum sum;
#if LM_EFFECT_MEMORY_MAX > 0
  own = memory->effect;
#else
  own = 0;
#endif
  keep_known(&at);
  at.torque_Nm = torque_Nm;
  at.wound_Nm = torque_Nm;
  at.elastic_rad = 0;
  for (; use < end && use->effect->kind == LM_EFFECT_TORQUE; ++use) {
    torque_Nm += use->effect->run(use->value, own, &at);
    own += use->effect->memory_count;
  }
  /* A torque that is missing is the one before, which has the effects in it already. */
  torque_Nm = is_finite(given->torque_Nm)
                  ? believe(torque_Nm, measured_Nm, parameters->torque_limit_Nm)
                  : measured_Nm;
  at.torque_Nm = torque_Nm;
  at.wound_Nm = torque_Nm;
  for (; use < end && use->effect->kind == LM_EFFECT_WIDTH; ++use) {
    width_scale *= use->effect->run(use->value, own, &at);
    own += use->effect->memory_count;
  }
  width_scale = clamp(width_scale, 0, LM_WIDTH_SCALE_MAX);
  memory->width_scale = greatest(memory->width_scale, width_scale);
  sum = lm_advance_scaled_plays(&parameters->plays, &memory->plays, torque_Nm, width_scale);
  at.wound_Nm = torque_Nm + sum.inside_Nm;
  angle_rad = lm_evaluate_curve(&parameters->curve, at.wound_Nm) + sum.outside_rad;
  at.elastic_rad = angle_rad;
  for (; use < end; ++use) {
    angle_rad += use->effect->run(use->value, own, &at);
    own += use->effect->memory_count;
  }
  return angle_rad;
}

#endif

lm_real lm_step_model(const lm_parameters *parameters, lm_memory *memory, const lm_conditions *at) {
  lm_real input = believe(model_input(at), memory->plays.torque_Nm, parameters->torque_limit_Nm);
#if LM_EFFECTS_MAX > 0
  if (parameters->effect_count > 0) {
    return step_with_effects(parameters, memory, at, input);
  }
#endif
  return step_plain(parameters, memory, input);
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
