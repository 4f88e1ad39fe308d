#include "lostmotion/effects.h"

#include "runtime/as_written.h"

enum { OFFSET_NM, VALUES };

/* The torque sensor has a zero error. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  (void)at;
  return value[OFFSET_NM];
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "torque_offset",
    "the torque sensor has a zero error",
    "torque + offset",
    "1.3 arcsec for 0.1 N*m",
    "asymmetric_stiffness",
    "dead weights; the part even in the torque is proportional to the torsion curve's slope",
    {{"offset_Nm", LM_VALUE_SHAPE, LM_REAL(0.1), LM_VALUE_AS_USUAL}},
    LM_CARD_AS_USUAL};
#endif

const lm_effect lm_effect_torque_offset = {0x8f507c15u,
                                           LM_EFFECT_TORQUE,
                                           VALUES,
                                           0,
                                           LM_NEEDS_TORQUE,
                                           run,
                                           {{LM_REAL(-1e3), LM_REAL(1e3)}},
                                           LM_EFFECT_CARD(card)};
