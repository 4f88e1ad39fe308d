/* The drive as an FMU, float64: torque in and angle out (FMU_TORQUE_IN), or the inverse.
 *
 *     lost motion = model(torque, conditions, memory)          lostmotion/model.h
 *     output angle = input angle / ratio + lost motion
 *
 * It begins at rest, with the memory of a drive that was never loaded, and then moves directly to
 * the inputs of the start.
 */
#include "fmu.h"

/* Passes in which the output angle, a condition of some effects, follows from itself. Such an
 * effect changes by a small share of the change of the angle: each pass gains three digits. */
#define FMU_PASSES 8

/* Stiffness of a rigid drive, N*m/rad: larger than that of any real drive. */
#define FMU_RIGID 1e12

/* Steps of one-sided differences. Model and inverse are straight lines between knots, and their
 * rounding is 1e-16 of the value: 1e-6 of the range leaves 9 digits. */
#define FMU_DIFFERENCE 1e-6

static const lm_parameters *fmu_parameters(const fmu_instance *instance) {
  return &instance->parameters[instance->used];
}

/* An angle in the range of the effects, for which whole turns have no meaning. */
static double fmu_wrap(double angle_rad) {
  const double turn_rad = 6.283185307179586;
  if (angle_rad <= (double)LM_ANGLE_MAX_RAD && angle_rad >= -(double)LM_ANGLE_MAX_RAD) {
    return angle_rad;
  }
  if (!(angle_rad < 1e15 && angle_rad > -1e15)) {
    return angle_rad;
  }
  return angle_rad - turn_rad * (double)(int64_t)(angle_rad / turn_rad);
}

#define FMU_CONDITION(field, ...) at->field = input[IN_##field];

static void fmu_conditions(const double *input, double elapsed_s, lm_conditions *at) {
  const lm_conditions unknown = LM_CONDITIONS_UNKNOWN;
  *at = unknown;
  LM_CONDITION_LIST(FMU_CONDITION, FMU_CONDITION, FMU_CONDITION, FMU_CONDITION)
  at->input_angle_rad = fmu_wrap(at->input_angle_rad);
  at->output_angle_rad = fmu_wrap(at->output_angle_rad);
  at->elapsed_s = elapsed_s;
}

static uint32_t fmu_needs(const lm_parameters *parameters) {
  uint32_t needs = LM_NEEDS_TORQUE;
  int32_t i;
  for (i = 0; i < parameters->effect_count; ++i) {
    needs |= parameters->effect[i].effect->covariates;
  }
  return needs;
}

/* Lost motion at a torque; the output angle among the conditions is the resulting one. */
static double fmu_lost_motion(const lm_parameters *parameters, double ratio, const double *input,
                              double torque_Nm, double elapsed_s, const lm_memory *before,
                              lm_memory *after) {
  lm_conditions at;
  double lost_rad;
  int32_t pass;
  fmu_conditions(input, elapsed_s, &at);
  at.torque_Nm = torque_Nm;
#if FMU_KIND == FMU_TORQUE_IN
  at.output_angle_rad = fmu_wrap(input[IN_input_angle_rad] / ratio);
#endif
  lost_rad = lm_evaluate_model(parameters, before, after, &at);
#if FMU_KIND == FMU_TORQUE_IN
  if (fmu_needs(parameters) & LM_NEEDS_OUTPUT_ANGLE) {
    for (pass = 0; pass < FMU_PASSES; ++pass) {
      double earlier_rad = lost_rad;
      at.output_angle_rad = fmu_wrap(input[IN_input_angle_rad] / ratio + lost_rad);
      lost_rad = lm_evaluate_model(parameters, before, after, &at);
      if (lost_rad == earlier_rad) {
        break;
      }
    }
  }
#else
  (void)ratio;
  (void)pass;
#endif
  return lost_rad;
}

/* Compliance in a direction of the torque (1 or -1) from the present state of the memory. */
static double fmu_compliance(const fmu_instance *instance, int32_t direction) {
  const lm_parameters *parameters = fmu_parameters(instance);
  const fmu_state *state = &instance->state;
  double ratio = state->applied[AT_RATIO];
  double torque_Nm = state->memory.plays.torque_Nm;
  double step_Nm = FMU_DIFFERENCE * parameters->torque_limit_Nm * direction;
  lm_memory trial;
  double here_rad;
  double there_rad;
  if (torque_Nm * direction > 0 && torque_Nm * direction >= parameters->torque_limit_Nm) {
    torque_Nm -= step_Nm; /* the limit itself has no further side */
  }
  here_rad = fmu_lost_motion(parameters, ratio, state->value, torque_Nm, state->elapsed_s,
                             &state->memory, &trial);
  there_rad = fmu_lost_motion(parameters, ratio, state->value, torque_Nm + step_Nm,
                              state->elapsed_s, &state->memory, &trial);
  return (there_rad - here_rad) / step_Nm;
}

static double fmu_stiffness(double compliance_rad_per_Nm) {
  return compliance_rad_per_Nm > 1.0 / FMU_RIGID ? 1.0 / compliance_rad_per_Nm : FMU_RIGID;
}

/* Change of the lost motion at constant torque, with the other inputs in a direction. */
static double fmu_drift(const fmu_instance *instance, const double *direction) {
  const lm_parameters *parameters = fmu_parameters(instance);
  const fmu_state *state = &instance->state;
  double ratio = state->applied[AT_RATIO];
  double torque_Nm = state->memory.plays.torque_Nm;
  double moved[FMU_INPUTS];
  double largest = 0;
  double step;
  lm_memory trial;
  double here_rad;
  int32_t i;
  for (i = 1; i < FMU_INPUTS; ++i) {
    double size = (direction[i] < 0 ? -direction[i] : direction[i]) / fmu_unit[i];
    largest = size > largest ? size : largest;
  }
  if (!(largest > 0)) {
    return 0;
  }
  step = FMU_DIFFERENCE / largest;
  for (i = 0; i < FMU_INPUTS; ++i) {
    moved[i] = state->value[i] + (i > 0 ? step * direction[i] : 0);
  }
  here_rad = fmu_lost_motion(parameters, ratio, state->value, torque_Nm, state->elapsed_s,
                             &state->memory, &trial);
  return (fmu_lost_motion(parameters, ratio, moved, torque_Nm, state->elapsed_s, &state->memory,
                          &trial) -
          here_rad) /
         step;
}

static int fmu_derive(const fmu_instance *instance, const double *seed, double *derivative) {
  double ratio = instance->state.applied[AT_RATIO];
  double elapsed_s = instance->state.elapsed_s;
  double drift_rad = fmu_drift(instance, seed);
  double lost_rad;
#if FMU_KIND == FMU_TORQUE_IN
  lost_rad = drift_rad;
  if (seed[IN_torque_Nm] != 0) {
    lost_rad += seed[IN_torque_Nm] * fmu_compliance(instance, seed[IN_torque_Nm] > 0 ? 1 : -1);
  }
  derivative[OUT_OUTPUT_ANGLE] = seed[IN_input_angle_rad] / ratio + lost_rad;
#else
  double wound_rad;
  lost_rad = seed[IN_output_angle_rad] - seed[IN_input_angle_rad] / ratio;
  wound_rad = lost_rad - drift_rad;
  derivative[OUT_TORQUE] = 0;
  if (wound_rad != 0) {
    derivative[OUT_TORQUE] =
        wound_rad * fmu_stiffness(fmu_compliance(instance, wound_rad > 0 ? 1 : -1));
  }
#endif
  derivative[OUT_LOST_MOTION] = lost_rad;
  derivative[OUT_RATE] = elapsed_s > 0 ? lost_rad / elapsed_s : 0;
  derivative[OUT_STIFFNESS] = 0; /* straight lines between knots */
  return 1;
}

static uint32_t fmu_outside(double value, const lm_real *range, uint32_t needed) {
  int stated = range[0] != 0 || range[1] != 0;
  return needed && stated && !(value >= range[0] && value <= range[1]) ? LM_STATE_EXTRAPOLATED : 0u;
}

#define FMU_ANY(field, ...)
#define FMU_FITTED(field, need, usual, uses) \
  status |= fmu_outside(input[IN_##field], parameters->valid.field, needs & LM_NEEDS_##need);

/* Status bits (lostmotion/state.h) of the inputs as the model uses them. */
static uint32_t fmu_judge(const lm_parameters *parameters, const double *input, double torque_Nm) {
  uint32_t needs = fmu_needs(parameters);
  uint32_t status = 0;
  double size_Nm = torque_Nm < 0 ? -torque_Nm : torque_Nm;
  int32_t i;
  for (i = 0; i < FMU_INPUTS; ++i) {
    if ((needs >> i & 1u) && input[i] - input[i] != 0) {
      status |= LM_STATE_INPUT_REFUSED;
    }
  }
  status |= size_Nm > parameters->torque_limit_Nm ? LM_STATE_TORQUE_CLIPPED : 0u;
  status |= parameters->valid.torque_Nm > 0 && size_Nm > parameters->valid.torque_Nm
                ? LM_STATE_EXTRAPOLATED
                : 0u;
  LM_CONDITION_LIST(FMU_ANY, FMU_ANY, FMU_FITTED, FMU_FITTED)
  return status;
}

/* One step to the present inputs; `step_s` is 0 at the start. */
static int fmu_step(fmu_instance *instance, double step_s) {
  const lm_parameters *parameters = fmu_parameters(instance);
  fmu_state *state = &instance->state;
  double *value = state->value;
  double ratio = state->applied[AT_RATIO];
  double before_Nm = state->memory.plays.torque_Nm;
  double before_rad = value[OUT_LOST_MOTION];
  double torque_Nm = value[IN_torque_Nm];
  uint32_t beyond = 0;
  lm_memory after;
#if FMU_KIND == FMU_ANGLES_IN
  double angle_rad = value[IN_output_angle_rad] - value[IN_input_angle_rad] / ratio;
  lm_conditions at;
  lm_real found_Nm = 0;
  lm_fault fault;
  fmu_conditions(value, step_s, &at);
  switch (lm_invert_model(parameters, &state->memory, &at, angle_rad, &found_Nm, &fault)) {
    case LM_OK:
      break;
    case LM_OUT_OF_RANGE:
      beyond = LM_STATE_TORQUE_CLIPPED;
      found_Nm = parameters->torque_limit_Nm * (angle_rad > 0 ? 1 : -1);
      break;
    default: /* the angle is not a number: the torque is not changed */
      beyond = LM_STATE_INPUT_REFUSED;
      found_Nm = before_Nm;
      break;
  }
  torque_Nm = found_Nm;
#endif
  value[OUT_LOST_MOTION] =
      fmu_lost_motion(parameters, ratio, value, torque_Nm, step_s, &state->memory, &after);
  state->memory = after;
#if FMU_KIND == FMU_TORQUE_IN
  value[OUT_OUTPUT_ANGLE] = value[IN_input_angle_rad] / ratio + value[OUT_LOST_MOTION];
#else
  value[OUT_TORQUE] = torque_Nm;
#endif
  if (after.plays.torque_Nm != before_Nm) {
    state->direction = after.plays.torque_Nm > before_Nm ? 1 : -1;
  }
  value[OUT_RATE] = step_s > 0 ? (value[OUT_LOST_MOTION] - before_rad) / step_s : 0;
  value[OUT_STIFFNESS] = fmu_stiffness(fmu_compliance(instance, state->direction));
  value[OUT_STATUS] = (double)(fmu_judge(parameters, value, torque_Nm) | beyond);
  return 1;
}

static int fmu_start(fmu_instance *instance) {
  fmu_state *state = &instance->state;
  lm_start_model(&state->memory, 0);
  state->direction = 1;
  state->value[OUT_LOST_MOTION] = 0;
  state->elapsed_s = 0;
  return fmu_step(instance, 0);
}

static int fmu_adopt(fmu_instance *instance, const lm_parameters *parameters) {
  lm_settle_model(parameters, &instance->state.memory);
  return 1;
}
