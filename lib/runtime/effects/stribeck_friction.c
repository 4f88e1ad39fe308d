#include "lostmotion/effects.h"

#include "runtime/effects/closed_share.h"

enum { COULOMB_NM, BREAKAWAY_NM, STRIBECK_RAD_S, BLEND_RAD_S, VALUES };

/* Dry friction between the two sides, which falls with the speed of the input (Stribeck), reduces
 * the torque that winds up the drive. Below `blend` the sign of the speed is replaced by a ramp, so
 * that noise at standstill does not determine it. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  lm_real fast = at->input_velocity_rad_s / value[STRIBECK_RAD_S];
  lm_real sign = closed_share(at->input_velocity_rad_s, value[BLEND_RAD_S]);
  return -sign * (value[COULOMB_NM] + value[BREAKAWAY_NM] * lm_exponential(-fast * fast));
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "stribeck_friction",
    "dry friction of the input, larger at low speed",
    "torque - (coulomb + breakaway exp(-(input_velocity/stribeck)^2)) sat(input_velocity/blend)",
    "10 to 40 arcsec",
    "viscous_friction, load_dependent_friction",
    "at least four speeds both ways, extrapolated to standstill",
    {{"coulomb_Nm",
      LM_VALUE_LINEAR,
      LM_REAL(0.5),
      LM_SCALE_NONE,
      {0, 0, 0, 0},
      0u,
      "Coulomb friction"},
     {"breakaway_Nm",
      LM_VALUE_LINEAR,
      LM_REAL(0.5),
      LM_SCALE_NONE,
      {0, 0, 0, 0},
      LM_VALUE_SIGN_OF_FIRST,
      "breakaway friction"},
     {"stribeck_rad_s",
      LM_VALUE_SHAPE,
      LM_REAL(5),
      LM_SCALE_SPEEDS,
      {0, 0, 0, 0},
      0u,
      "Stribeck speed of the input"},
     {"blend_rad_s",
      LM_VALUE_FIXED,
      LM_REAL(0.1),
      LM_SCALE_LARGEST_SPEED,
      {LM_REAL(0.02), 0, 0, 0},
      0u,
      "blending speed of the input"}},
    LM_CARD_AS_USUAL};
#endif

const lm_effect lm_effect_stribeck_friction = {0x9d6db2f6u,
                                               LM_EFFECT_TORQUE,
                                               VALUES,
                                               0,
                                               LM_NEEDS_INPUT_VELOCITY,
                                               run,
                                               {{LM_REAL(-1e4), LM_REAL(1e4)},
                                                {LM_REAL(-1e4), LM_REAL(1e4)},
                                                {LM_REAL(1e-3), LM_REAL(1e3)},
                                                {LM_REAL(1e-4), LM_REAL(1e3)}},
                                               LM_EFFECT_CARD(card)};
