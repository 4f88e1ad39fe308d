#include "lostmotion/effects.h"

#include "runtime/effects/closed_share.h"
#include "runtime/number.h"

enum { GAP_RAD_PER_K, GAP_RAD, TAKEUP_NM, VALUES };

/* Housing and steel expand differently and open or close the radial gap; tan(alpha)/r converts it
 * to an angle. A gap cannot be negative, so the change is limited to -gap. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  lm_real warmer_K = at->temperature_C - LM_REFERENCE_TEMPERATURE_C;
  lm_real opened_rad = greatest(value[GAP_RAD_PER_K] * warmer_K, -value[GAP_RAD]);
  return opened_rad * closed_share(at->wound_Nm, value[TAKEUP_NM]);
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "thermal_gap",
    "the radial gap opens and closes with temperature",
    "max(gap_per_K (temperature - 20 C), -gap) sat(torque/takeup)",
    "11 arcsec per 10 K between wave generator and flexspline; 46 for an aluminium housing at 40 K",
    "wear, thermal_stiffness, free_play",
    "soak at two temperatures or more, at low and at high torque: above the take-up the "
    "angle does not grow",
    {{"gap_rad_per_K", LM_VALUE_LINEAR, LM_REAL(5e-6), LM_VALUE_AS_USUAL},
     {"gap_rad", LM_VALUE_FIXED, LM_REAL(0.01), LM_SCALE_GREATEST, {LM_REAL(1), 0, 0, 0}, 0u, 0},
     TAKEUP_VALUE(LM_REAL(0.4))},
    LM_CARD_AS_USUAL};
#endif

const lm_effect lm_effect_thermal_gap = {
    0x98d30402u,
    LM_EFFECT_ANGLE,
    VALUES,
    0,
    LM_NEEDS_TORQUE | LM_NEEDS_TEMPERATURE,
    run,
    {{LM_REAL(-1e-3), LM_REAL(1e-3)}, {LM_REAL(0), LM_REAL(0.05)}, {LM_REAL(1e-3), LM_REAL(1e4)}},
    LM_EFFECT_CARD(card)};
