#include "lostmotion/effects.h"

#include "runtime/effects/closed_share.h"
#include "runtime/number.h"

enum {
  COSINE_RAD,
  SINE_RAD,
  RUNOUT_COSINE_RAD,
  RUNOUT_SINE_RAD,
  COMPLIANCE_RAD_PER_NM,
  TAKEUP_NM,
  VALUES
};

/* Run-out of the generator (once a turn), and of the circular spline against it: one lobe closes
 * earlier by delta = |runout|, the other later. Until the torque has wound up the first lobe by
 * twice delta it carries alone, and the drive turns by delta less than with equal lobes. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  lm_sine_cosine one = lm_sine_and_cosine(at->input_angle_rad);
  lm_real runout_rad =
      absolute(value[RUNOUT_COSINE_RAD] * one.cosine + value[RUNOUT_SINE_RAD] * one.sine);
  lm_real left_rad = runout_rad - value[COMPLIANCE_RAD_PER_NM] * absolute(at->wound_Nm);
  return value[COSINE_RAD] * one.cosine + value[SINE_RAD] * one.sine -
         closed_share(at->wound_Nm, value[TAKEUP_NM]) * greatest(left_rad, 0);
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "lobe_eccentricity",
    "the lobes of the generator, or the circular spline under them, do not run true",
    "cosine cos(input_angle) + sine sin(input_angle) - sat(torque/takeup) max(0, |runout_cosine "
    "cos(input_angle) + runout_sine sin(input_angle)| - compliance |torque|)",
    "2 to 15 arcsec once a turn; 5 to 40 at low torque",
    "kinematic_error, stiffness_modulation, wear",
    "turn the circular spline by 90 deg in its housing; turn the generator by 180 deg on its shaft",
    {{"cosine_rad", LM_VALUE_LINEAR, LM_REAL(2e-5)},
     {"sine_rad", LM_VALUE_LINEAR, LM_REAL(0)},
     {"runout_cosine_rad", LM_VALUE_SHAPE, LM_REAL(2e-5)},
     {"runout_sine_rad", LM_VALUE_SHAPE, LM_REAL(0)},
     {"compliance_rad_per_Nm", LM_VALUE_SHAPE, LM_REAL(2e-5)},
     {"takeup_Nm", LM_VALUE_SHAPE, LM_REAL(0.4)}}};
#endif

const lm_effect lm_effect_lobe_eccentricity = {0x02f761fbu,
                                               LM_EFFECT_ANGLE,
                                               VALUES,
                                               0,
                                               LM_NEEDS_TORQUE | LM_NEEDS_INPUT_ANGLE,
                                               run,
                                               {{LM_REAL(-0.05), LM_REAL(0.05)},
                                                {LM_REAL(-0.05), LM_REAL(0.05)},
                                                {LM_REAL(-0.05), LM_REAL(0.05)},
                                                {LM_REAL(-0.05), LM_REAL(0.05)},
                                                {LM_REAL(1e-9), LM_REAL(1)},
                                                {LM_REAL(1e-3), LM_REAL(1e4)}},
                                               LM_EFFECT_CARD(card)};
