#include "lostmotion/effects.h"

#include "runtime/number.h"

enum { SHARE, VALUES };

/* The two flanks differ: softer one way by `share`, stiffer the other. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  return value[SHARE] * absolute(at->elastic_rad);
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "asymmetric_stiffness",
    "the drive is softer in one direction",
    "share |elastic_angle|",
    "1 to 5 % of the elastic angle",
    "torque_offset",
    "loops of both signs with the sensor's zero checked by dead weights",
    {{"share", LM_VALUE_LINEAR, LM_REAL(0.02), LM_VALUE_AS_USUAL}},
    LM_CARD_AS_USUAL};
#endif

const lm_effect lm_effect_asymmetric_stiffness = {0xfd2b311cu,
                                                  LM_EFFECT_ANGLE,
                                                  VALUES,
                                                  0,
                                                  LM_NEEDS_TORQUE,
                                                  run,
                                                  {{LM_REAL(-0.5), LM_REAL(0.5)}},
                                                  LM_EFFECT_CARD(card)};
