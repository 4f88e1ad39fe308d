#include "lostmotion/effects.h"

#include "runtime/as_written.h"

enum { SHARE_PER_K, VALUES };

/* Young's modulus falls as steel warms. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  return value[SHARE_PER_K] * (at->temperature_C - LM_REFERENCE_TEMPERATURE_C);
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "thermal_stiffness",
    "the elastic moduli fall as the drive warms",
    "compliance (1 + share_per_K (temperature - 20 C))",
    "3 to 4 arcsec at rated torque and 40 K",
    "thermal_gap, torque_scale, creep",
    "its angle grows with torque, that of a thermal gap does not",
    {{"share_per_K", LM_VALUE_LINEAR, LM_REAL(2.7e-4), LM_VALUE_AS_USUAL}},
    LM_CARD_AS_USUAL};
#endif

const lm_effect lm_effect_thermal_stiffness = {0x697e419au,
                                               LM_EFFECT_COMPLIANCE,
                                               VALUES,
                                               0,
                                               LM_NEEDS_TORQUE | LM_NEEDS_TEMPERATURE,
                                               run,
                                               {{LM_REAL(-0.01), LM_REAL(0.01)}},
                                               LM_EFFECT_CARD(card)};
