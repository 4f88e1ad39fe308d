#include "lostmotion/effects.h"

#include "runtime/number.h"

enum { HERTZ_RAD, PRELOAD_NM, CUBIC_RAD, REFERENCE_NM, VALUES };

/* Contacts stiffen with load: Hertz's 2/3 power above a preload, and a cubic part. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  lm_real load_Nm = absolute(at->wound_Nm);
  lm_real share = load_Nm / value[REFERENCE_NM];
  lm_real hertz = lm_power(1 + load_Nm / value[PRELOAD_NM], LM_REAL(2.0 / 3.0)) - 1;
  lm_real size_rad = value[HERTZ_RAD] * hertz - value[CUBIC_RAD] * share * share * share;
  return at->wound_Nm >= 0 ? size_rad : -size_rad;
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "stiffening",
    "contacts stiffen with load",
    "sign(torque) (hertz ((1 + |torque|/preload)^(2/3) - 1) - cubic (|torque|/reference)^3)",
    "2 to 10 % of the elastic angle",
    "soft_windup, torque_scale",
    "a loop to 1.5 times rated torque or more",
    {{"hertz_rad",
      LM_VALUE_LINEAR,
      LM_REAL(1e-5),
      LM_SCALE_NONE,
      {0, 0, 0, 0},
      0u,
      "Hertzian wind-up"},
     {"preload_Nm", LM_VALUE_SHAPE, LM_REAL(5), LM_VALUE_AS_USUAL},
     {"cubic_rad", LM_VALUE_LINEAR, LM_REAL(1e-5), LM_VALUE_AS_USUAL},
     {"reference_Nm", LM_VALUE_GIVEN, LM_REAL(40), LM_SCALE_RATED_TORQUE, {0, 0, 0, 0}, 0u, 0}},
    "absorbed by the torsion curve of the baseline",
    0u,
    0};
#endif

const lm_effect lm_effect_stiffening = {0x4f51d04cu,
                                        LM_EFFECT_ANGLE,
                                        VALUES,
                                        0,
                                        LM_NEEDS_TORQUE,
                                        run,
                                        {{LM_REAL(-0.05), LM_REAL(0.05)},
                                         {LM_REAL(1e-3), LM_REAL(1e4)},
                                         {LM_REAL(-0.05), LM_REAL(0.05)},
                                         {LM_REAL(1e-2), LM_REAL(1e5)}},
                                        LM_EFFECT_CARD(card)};
