/* The compensator as an FMU, in the controller's float32 and with its bits: a call of doStep is a
 * tick of lm_step_compensator, and the communication step is the time since the previous tick. It
 * begins as at power-up, with the torque of the start.
 */
#include "fmu.h"

#define FMU_CONDITION(field, ...) at.field = fmu_real(value[IN_##field]);

static int fmu_step(fmu_instance *instance, double step_s) {
  fmu_state *state = &instance->state;
  double *value = state->value;
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  lm_correction now;
  LM_CONDITION_LIST(FMU_CONDITION, FMU_CONDITION, FMU_CONDITION, FMU_CONDITION)
  at.elapsed_s = fmu_real(step_s);
  lm_set_mode(&state->compensator, value[IN_MODE] == 0   ? LM_MODE_RUN
                                   : value[IN_MODE] == 1 ? LM_MODE_HOLD
                                                         : LM_MODE_RESET);
  now = lm_step_compensator(&state->compensator, &at);
  value[OUT_CORRECTION] = (double)now.correction_rad;
  value[OUT_VELOCITY] = (double)now.velocity_rad_s;
  value[OUT_ACCELERATION] = (double)now.acceleration_rad_s2;
  value[OUT_LOST_MOTION] = (double)now.lost_motion_rad;
  value[OUT_STATUS] = (double)now.status;
  return 1;
}

static int fmu_start(fmu_instance *instance) {
  fmu_state *state = &instance->state;
  lm_fault fault;
  if (lm_start_compensator(&state->compensator, &instance->parameters[instance->used],
                           fmu_real(state->value[IN_torque_Nm]), &fault) != LM_OK) {
    return fmu_refuse(instance, "parameters", &fault);
  }
  /* A history without influence counts as known, for example of friction that is zero
   * without load. */
  (void)lm_bound_uncertainty(&state->compensator);
  state->value[OUT_CORRECTION] = 0;
  state->value[OUT_VELOCITY] = 0;
  state->value[OUT_ACCELERATION] = 0;
  state->value[OUT_LOST_MOTION] = (double)state->compensator.lost_motion_rad;
  state->value[OUT_STATUS] = (double)state->compensator.standing;
  return 1;
}

static int fmu_adopt(fmu_instance *instance, const lm_parameters *parameters) {
  lm_fault fault;
  if (lm_change_parameters(&instance->state.compensator, parameters, &fault) != LM_OK) {
    return fmu_refuse(instance, "parameters", &fault);
  }
  return 1;
}

/* A program that runs in ticks has no derivatives. */
static int fmu_derive(const fmu_instance *instance, const double *seed, double *derivative) {
  (void)seed;
  (void)derivative;
  return fmu_refuse(instance, "the compensator provides no directional derivatives", 0);
}
