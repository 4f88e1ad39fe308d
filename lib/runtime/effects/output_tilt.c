#include "lostmotion/effects.h"

#include "runtime/as_written.h"

enum { TILT_RAD_PER_NM, VALUES };

/* The output bearing tilts under a moment and the read head, off its plane, sees an angle. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  return value[TILT_RAD_PER_NM] * at->tilt_moment_Nm;
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "output_tilt",
    "the output bearing tilts under a moment",
    "tilt tilt_moment",
    "5 to 30 arcsec at 20 N*m",
    "input_lock_compliance",
    "a pure moment without torque; read heads opposite each other",
    {{"tilt_rad_per_Nm", LM_VALUE_LINEAR, LM_REAL(4e-6), LM_VALUE_AS_USUAL}},
    LM_CARD_AS_USUAL};
#endif

const lm_effect lm_effect_output_tilt = {0x100f202cu,
                                         LM_EFFECT_ANGLE,
                                         VALUES,
                                         0,
                                         LM_NEEDS_TILT_MOMENT,
                                         run,
                                         {{LM_REAL(-0.01), LM_REAL(0.01)}},
                                         LM_EFFECT_CARD(card)};
