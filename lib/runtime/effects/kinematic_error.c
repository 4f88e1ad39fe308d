#include "lostmotion/effects.h"

#include "runtime/as_written.h"

enum { COSINE_2_RAD, SINE_2_RAD, COSINE_4_RAD, SINE_4_RAD, VALUES };

/* Even pitch errors of both gears, two and four times a turn of the wave generator; odd orders
 * cancel between the two lobes. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  lm_sine_cosine two = lm_sine_and_cosine(2 * at->input_angle_rad);
  lm_real four_sine = 2 * two.sine * two.cosine;
  lm_real four_cosine = 1 - 2 * two.sine * two.sine;
  return value[COSINE_2_RAD] * two.cosine + value[SINE_2_RAD] * two.sine +
         value[COSINE_4_RAD] * four_cosine + value[SINE_4_RAD] * four_sine;
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "kinematic_error",
    "even pitch errors of the gears, carried round by the wave generator",
    "cosine_2 cos(2 input_angle) + sine_2 sin(2 input_angle) + cosine_4 cos(4 input_angle) + "
    "sine_4 sin(4 input_angle)",
    "5 to 30 arcsec twice a turn, 1 to 8 four times a turn",
    "stiffness_modulation, lobe_eccentricity, thermal_drift",
    "load both ways at the same wave generator angle: the half sum keeps it, the half difference "
    "does "
    "not",
    {{"cosine_2_rad", LM_VALUE_LINEAR, LM_REAL(5e-5), LM_VALUE_AS_USUAL},
     {"sine_2_rad", LM_VALUE_LINEAR, LM_REAL(0), LM_VALUE_AS_USUAL},
     {"cosine_4_rad", LM_VALUE_LINEAR, LM_REAL(1e-5), LM_VALUE_AS_USUAL},
     {"sine_4_rad", LM_VALUE_LINEAR, LM_REAL(0), LM_VALUE_AS_USUAL}},
    LM_CARD_AS_USUAL};
#endif

const lm_effect lm_effect_kinematic_error = {0x3681676bu,
                                             LM_EFFECT_ANGLE,
                                             VALUES,
                                             0,
                                             LM_NEEDS_INPUT_ANGLE,
                                             run,
                                             {{LM_REAL(-0.05), LM_REAL(0.05)},
                                              {LM_REAL(-0.05), LM_REAL(0.05)},
                                              {LM_REAL(-0.05), LM_REAL(0.05)},
                                              {LM_REAL(-0.05), LM_REAL(0.05)}},
                                             LM_EFFECT_CARD(card)};
