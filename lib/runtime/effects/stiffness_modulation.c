#include "lostmotion/effects.h"

#include "runtime/as_written.h"

enum { COSINE, SINE, VALUES };

/* Stiffness varies with the tooth phase and the balls of the wave generator bearing, twice
 * a turn. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  lm_sine_cosine two = lm_sine_and_cosine(2 * at->input_angle_rad);
  return value[COSINE] * two.cosine + value[SINE] * two.sine;
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "stiffness_modulation",
    "stiffness varies with the angle of the wave generator",
    "compliance (1 + cosine cos(2 input_angle) + sine sin(2 input_angle))",
    "0.5 to 4 % of the elastic angle",
    "kinematic_error, lobe_eccentricity",
    "amplitude against |torque|: it grows with the elastic angle and changes sign with it",
    {{"cosine", LM_VALUE_LINEAR, LM_REAL(0.01), LM_VALUE_AS_USUAL},
     {"sine", LM_VALUE_LINEAR, LM_REAL(0), LM_VALUE_AS_USUAL}},
    LM_CARD_AS_USUAL};
#endif

const lm_effect lm_effect_stiffness_modulation = {
    0x3a2cdefau,
    LM_EFFECT_COMPLIANCE,
    VALUES,
    0,
    LM_NEEDS_TORQUE | LM_NEEDS_INPUT_ANGLE,
    run,
    {{LM_REAL(-0.5), LM_REAL(0.5)}, {LM_REAL(-0.5), LM_REAL(0.5)}},
    LM_EFFECT_CARD(card)};
