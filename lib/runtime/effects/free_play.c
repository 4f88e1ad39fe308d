#include "lostmotion/effects.h"

#include "runtime/effects/closed_share.h"

enum { GAP_RAD, TAKEUP_NM, VALUES };

/* A side clearance that remains when the drive is assembled. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  return value[GAP_RAD] * closed_share(at->wound_Nm, value[TAKEUP_NM]);
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "free_play",
    "side clearance left between the teeth",
    "gap sat(torque/takeup)",
    "3.9 arcsec per um of tooth thinning",
    "input_coupling_play, wear, thermal_gap, axial_shift, soft_windup",
    "lock the wave generator itself, not the motor; shim the wave generator anew",
    {{"gap_rad", LM_VALUE_LINEAR, LM_REAL(2e-5), LM_VALUE_AS_USUAL}, TAKEUP_VALUE(LM_REAL(0.4))},
    "absorbed by the torsion curve of the baseline",
    0u,
    0};
#endif

const lm_effect lm_effect_free_play = {
    0x633cde7au,
    LM_EFFECT_ANGLE,
    VALUES,
    0,
    LM_NEEDS_TORQUE,
    run,
    {{LM_REAL(-0.05), LM_REAL(0.05)}, {LM_REAL(1e-3), LM_REAL(1e4)}},
    LM_EFFECT_CARD(card)};
