#include "lostmotion/effects.h"

#include "runtime/as_written.h"

enum { SHARE, VALUES };

/* The torque sensor has a scale error. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  return value[SHARE] * at->torque_Nm;
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "torque_scale",
    "the torque sensor has a scale error",
    "torque (1 + share)",
    "2.8 arcsec at rated torque for 1 %",
    "thermal_stiffness, input_lock_compliance, soft_windup, stiffening",
    "dead weights",
    {{"share", LM_VALUE_SHAPE, LM_REAL(0.01), LM_VALUE_AS_USUAL}},
    "absorbed by the compliance of the baseline",
    0u,
    0};
#endif

const lm_effect lm_effect_torque_scale = {0x60530824u,
                                          LM_EFFECT_TORQUE,
                                          VALUES,
                                          0,
                                          LM_NEEDS_TORQUE,
                                          run,
                                          {{LM_REAL(-0.5), LM_REAL(0.5)}},
                                          LM_EFFECT_CARD(card)};
