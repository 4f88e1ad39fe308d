#include "lostmotion/effects.h"

#include "runtime/as_written.h"

enum { COSINE_RAD, SINE_RAD, VALUES };

/* The output encoder runs eccentrically: e / r_e, once a turn of the output. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  lm_sine_cosine one = lm_sine_and_cosine(at->output_angle_rad);
  return value[COSINE_RAD] * one.cosine + value[SINE_RAD] * one.sine;
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "output_eccentricity",
    "the output encoder runs eccentrically",
    "cosine cos(output_angle) + sine sin(output_angle)",
    "34 arcsec for 5 um on a radius of 30 mm",
    "kinematic_sideband",
    "a second read head opposite the first",
    {{"cosine_rad", LM_VALUE_LINEAR, LM_REAL(1.6e-4), LM_VALUE_AS_USUAL},
     {"sine_rad", LM_VALUE_LINEAR, LM_REAL(0), LM_VALUE_AS_USUAL}},
    LM_CARD_AS_USUAL};
#endif

const lm_effect lm_effect_output_eccentricity = {
    0xa9c3627cu,
    LM_EFFECT_ANGLE,
    VALUES,
    0,
    LM_NEEDS_OUTPUT_ANGLE,
    run,
    {{LM_REAL(-0.05), LM_REAL(0.05)}, {LM_REAL(-0.05), LM_REAL(0.05)}},
    LM_EFFECT_CARD(card)};
