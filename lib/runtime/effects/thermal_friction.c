#include "lostmotion/effects.h"

#include "runtime/as_written.h"

enum { RATE_PER_K, VALUES };

/* Grease stiffens in the cold: every friction band is wider by exp(-rate (temperature - 20 C)). */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  return lm_exponential(-value[RATE_PER_K] * (at->temperature_C - LM_REFERENCE_TEMPERATURE_C));
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "thermal_friction",
    "grease stiffens in the cold and widens the friction loop",
    "every friction band times exp(-rate (temperature - 20 C))",
    "the loop 1.5 to 2 times as wide at 0 C",
    "load_dependent_friction",
    "loops at two temperatures",
    {{"rate_per_K", LM_VALUE_SHAPE, LM_REAL(0.02), LM_VALUE_AS_USUAL}},
    LM_CARD_AS_USUAL};
#endif

const lm_effect lm_effect_thermal_friction = {0x8e349c01u,
                                              LM_EFFECT_WIDTH,
                                              VALUES,
                                              0,
                                              LM_NEEDS_TEMPERATURE,
                                              run,
                                              {{LM_REAL(-0.1), LM_REAL(0.1)}},
                                              LM_EFFECT_CARD(card)};
