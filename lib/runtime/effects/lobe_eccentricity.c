#include "lostmotion/effects.h"

#include "lostmotion/elementary.h"
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

/* Decrease of the rotation of the mesh compared with equal lobes, over the angle g in which a
 * lobe's teeth come into contact; `torque` and `runout` are over the takeup and over g.
 *
 * A lobe at the angle x carries K (sqrt(x^2 + g^2) - g), and as much the other way at -x. One lobe
 * is at x + runout, the other at x - runout, and both carry the torque. While both press the same
 * way, x is a point of the ellipse about the foci +-runout, before that of the hyperbola. */
static lm_real held_back(lm_real torque, lm_real runout) {
  lm_real runout2 = runout * runout;
  lm_real torque2 = torque * torque;
  lm_real equal2 = torque2 + LM_REAL(2) * torque;
  lm_real lobes2;
  if (torque2 + torque >= runout2) {
    lm_real half = torque + LM_REAL(1);
    lobes2 = half * half * ((equal2 - runout2) / (equal2 + LM_REAL(1) - runout2));
  } else {
    lobes2 = torque2 + torque2 / (runout2 - torque2);
  }
  return lm_power(equal2, LM_REAL(0.5)) - lm_power(lobes2, LM_REAL(0.5));
}

/* Run-out of the wave generator (once a turn), and of the circular spline against it: one lobe
 * closes earlier, the other later. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  lm_sine_cosine one = lm_sine_and_cosine(at->input_angle_rad);
  lm_real closing_rad = value[COMPLIANCE_RAD_PER_NM] * value[TAKEUP_NM];
  lm_real runout_rad = value[RUNOUT_COSINE_RAD] * one.cosine + value[RUNOUT_SINE_RAD] * one.sine;
  lm_real less_rad =
      closing_rad * held_back(absolute(at->wound_Nm) / value[TAKEUP_NM], runout_rad / closing_rad);
  return value[COSINE_RAD] * one.cosine + value[SINE_RAD] * one.sine -
         (at->wound_Nm >= 0 ? less_rad : -less_rad);
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "lobe_eccentricity",
    "the lobes of the wave generator, or the circular spline under them, do not run true",
    "cosine cos(input_angle) + sine sin(input_angle) + x(d) - x(0), d = runout_cosine "
    "cos(input_angle) + runout_sine sin(input_angle), x: torque = l(x + d) + l(x - d), "
    "l(y) = sign(y) (sqrt(y^2 + g^2) - g)/(2 compliance), g = compliance takeup",
    "2 to 15 arcsec once a turn; 5 to 40 at low torque",
    "kinematic_error, stiffness_modulation, wear",
    "turn the circular spline by 90 deg in its housing; turn the wave generator by 180 deg on its "
    "shaft",
    {{"cosine_rad", LM_VALUE_LINEAR, LM_REAL(2e-5), LM_VALUE_AS_USUAL},
     {"sine_rad", LM_VALUE_LINEAR, LM_REAL(0), LM_VALUE_AS_USUAL},
     {"runout_cosine_rad",
      LM_VALUE_SHAPE,
      LM_REAL(2e-5),
      LM_SCALE_NONE,
      {0, 0, 0, 0},
      LM_VALUE_SCALES,
      "run-out cosine"},
     {"runout_sine_rad",
      LM_VALUE_SHAPE,
      LM_REAL(0),
      LM_SCALE_NONE,
      {0, 0, 0, 0},
      LM_VALUE_SCALES,
      "run-out sine"},
     {"compliance_rad_per_Nm",
      LM_VALUE_SHAPE,
      LM_REAL(4e-6),
      LM_SCALE_NONE,
      {0, 0, 0, 0},
      LM_VALUE_SCALES,
      0},
     TAKEUP_VALUE(LM_REAL(20))},
    LM_CARD_AS_USUAL};
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
