#include "lostmotion/effects.h"

#include "runtime/effects/closed_share.h"

enum { GAP_RAD_PER_N, TAKEUP_NM, VALUES };

/* An axial force shifts the wave generator along the cup and changes the deflection there. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  return value[GAP_RAD_PER_N] * at->axial_force_N * closed_share(at->wound_Nm, value[TAKEUP_NM]);
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "axial_shift",
    "an axial force shifts the wave generator along the cup",
    "gap_per_N axial_force sat(torque/takeup)",
    "4 arcsec for 0.1 mm",
    "free_play",
    "change the axial preload",
    {{"gap_rad_per_N", LM_VALUE_LINEAR, LM_REAL(2e-7), LM_VALUE_AS_USUAL},
     TAKEUP_VALUE(LM_REAL(0.4))},
    LM_CARD_AS_USUAL};
#endif

const lm_effect lm_effect_axial_shift = {
    0x2125fa49u,
    LM_EFFECT_ANGLE,
    VALUES,
    0,
    LM_NEEDS_TORQUE | LM_NEEDS_AXIAL_FORCE,
    run,
    {{LM_REAL(-0.01), LM_REAL(0.01)}, {LM_REAL(1e-3), LM_REAL(1e4)}},
    LM_EFFECT_CARD(card)};
