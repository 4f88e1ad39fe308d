#include "lostmotion/effects.h"

#include "runtime/number.h"

const lm_effect *lm_find_effect(const lm_effect *const *table, int32_t count, uint32_t id) {
  int32_t i;
  for (i = 0; i < count; ++i) {
    if (table[i]->id == id) {
      return table[i];
    }
  }
  return 0;
}

lm_status lm_check_effect(const lm_effect *effect, const lm_real *value, lm_fault *fault) {
  int32_t i;
  if (!effect || !value) {
    return lm_refuse(fault, LM_NULL, "effect", 0, 0, 0);
  }
  for (i = 0; i < effect->value_count; ++i) {
    const char *name = effect->card ? effect->card->value[i].name : "value";
    lm_status status =
        lm_check_range(fault, name, value[i], effect->bound[i][0], effect->bound[i][1]);
    if (status != LM_OK) {
      return status;
    }
  }
  return LM_OK;
}

static lm_real read(const lm_real *column, int64_t k, lm_real missing) {
  return column ? column[k] : missing;
}

lm_conditions lm_read_conditions(const lm_recording *recording, int64_t k) {
  lm_conditions at;
  at.torque_Nm = read(recording->torque_Nm, k, 0);
  at.input_angle_rad = read(recording->input_angle_rad, k, 0);
  at.output_angle_rad = read(recording->output_angle_rad, k, 0);
  at.input_velocity_rad_s = read(recording->input_velocity_rad_s, k, 0);
  at.output_acceleration_rad_s2 = read(recording->output_acceleration_rad_s2, k, 0);
  at.temperature_C = read(recording->temperature_C, k, LM_REFERENCE_TEMPERATURE_C);
  at.cycles = read(recording->cycles, k, 0);
  at.tilt_moment_Nm = read(recording->tilt_moment_Nm, k, 0);
  at.axial_force_N = read(recording->axial_force_N, k, 0);
  at.elapsed_s = read(recording->elapsed_s, k, 0);
  at.elastic_rad = read(recording->elastic_rad, k, 0);
  at.wound_Nm = read(recording->wound_Nm, k, at.torque_Nm);
  return at;
}

void lm_run_effect(const lm_effect *effect, const lm_real *value, lm_real *memory,
                   const lm_recording *recording, lm_real *result) {
  int64_t k;
  for (k = 0; k < recording->count; ++k) {
    lm_conditions at = lm_read_conditions(recording, k);
    result[k] = effect->run(value, memory, &at);
  }
}
