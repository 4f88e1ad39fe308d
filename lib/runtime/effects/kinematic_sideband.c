#include "lostmotion/effects.h"

#include "runtime/as_written.h"

enum { UPPER_COSINE_RAD, UPPER_SINE_RAD, LOWER_COSINE_RAD, LOWER_SINE_RAD, VALUES };

/* Pitch errors of the flexspline move with the deformation wave: orders 2 +- 2/ratio of the wave
 * generator. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  lm_sine_cosine upper = lm_sine_and_cosine(2 * (at->input_angle_rad + at->output_angle_rad));
  lm_sine_cosine lower = lm_sine_and_cosine(2 * (at->input_angle_rad - at->output_angle_rad));
  return value[UPPER_COSINE_RAD] * upper.cosine + value[UPPER_SINE_RAD] * upper.sine +
         value[LOWER_COSINE_RAD] * lower.cosine + value[LOWER_SINE_RAD] * lower.sine;
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "kinematic_sideband",
    "pitch errors of the flexspline, which turns with the output under the deformation wave",
    "cos and sin of 2 (input_angle + output_angle) and of 2 (input_angle - output_angle)",
    "2 to 15 arcsec",
    "kinematic_error",
    "record at least half a turn of the output: two lines beside the second order",
    {{"upper_cosine_rad", LM_VALUE_LINEAR, LM_REAL(2e-5), LM_VALUE_AS_USUAL},
     {"upper_sine_rad", LM_VALUE_LINEAR, LM_REAL(0), LM_VALUE_AS_USUAL},
     {"lower_cosine_rad", LM_VALUE_LINEAR, LM_REAL(2e-5), LM_VALUE_AS_USUAL},
     {"lower_sine_rad", LM_VALUE_LINEAR, LM_REAL(0), LM_VALUE_AS_USUAL}},
    LM_CARD_AS_USUAL};
#endif

const lm_effect lm_effect_kinematic_sideband = {0xe35faf6cu,
                                                LM_EFFECT_ANGLE,
                                                VALUES,
                                                0,
                                                LM_NEEDS_INPUT_ANGLE | LM_NEEDS_OUTPUT_ANGLE,
                                                run,
                                                {{LM_REAL(-0.05), LM_REAL(0.05)},
                                                 {LM_REAL(-0.05), LM_REAL(0.05)},
                                                 {LM_REAL(-0.05), LM_REAL(0.05)},
                                                 {LM_REAL(-0.05), LM_REAL(0.05)}},
                                                LM_EFFECT_CARD(card)};
