#include "lostmotion/effects.h"

#include "runtime/as_written.h"

enum { DRIFT_RAD_PER_K, VALUES };

/* Mounts and encoders move with temperature, independently of the torque. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  return value[DRIFT_RAD_PER_K] * (at->temperature_C - LM_REFERENCE_TEMPERATURE_C);
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "thermal_drift",
    "mounts and encoders move with temperature",
    "drift_per_K (temperature - 20 C)",
    "0.2 to 1 arcsec per K",
    "kinematic_error",
    "the zero without torque against temperature",
    {{"drift_rad_per_K", LM_VALUE_LINEAR, LM_REAL(2e-6), LM_VALUE_AS_USUAL}},
    LM_CARD_AS_USUAL};
#endif

const lm_effect lm_effect_thermal_drift = {0x06b64fedu,
                                           LM_EFFECT_ANGLE,
                                           VALUES,
                                           0,
                                           LM_NEEDS_TEMPERATURE,
                                           run,
                                           {{LM_REAL(-1e-3), LM_REAL(1e-3)}},
                                           LM_EFFECT_CARD(card)};
