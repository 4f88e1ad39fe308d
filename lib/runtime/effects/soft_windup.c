#include "lostmotion/effects.h"

#include "runtime/as_written.h"

enum { WINDUP_RAD, TORQUE_NM, VALUES };

/* More wind-up at low torque than the baseline model has. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  return value[WINDUP_RAD] * lm_hyperbolic_tangent(at->wound_Nm / value[TORQUE_NM]);
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "soft_windup",
    "the drive is softer at low torque than in the baseline model",
    "windup tanh(torque / torque_Nm)",
    "5 to 40 arcsec",
    "free_play, stiffening, torque_scale",
    "curvature up to 0.3 of rated torque; a radial gap ends at 0.01",
    {{"windup_rad", LM_VALUE_LINEAR, LM_REAL(5e-5), LM_SCALE_NONE, {0, 0, 0, 0}, 0u, "wind-up"},
     {"torque_Nm", LM_VALUE_SHAPE, LM_REAL(2), LM_VALUE_AS_USUAL}},
    "absorbed by the torsion curve of the baseline",
    0u,
    0};
#endif

const lm_effect lm_effect_soft_windup = {
    0xea3a13ffu,
    LM_EFFECT_ANGLE,
    VALUES,
    0,
    LM_NEEDS_TORQUE,
    run,
    {{LM_REAL(-0.05), LM_REAL(0.05)}, {LM_REAL(1e-3), LM_REAL(1e4)}},
    LM_EFFECT_CARD(card)};
