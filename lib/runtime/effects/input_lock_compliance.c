#include "lostmotion/effects.h"

#include "runtime/as_written.h"

enum { COMPLIANCE_RAD_PER_NM, RATIO, VALUES };

/* The lock of the input is compliant; at the output its compliance is divided by the square of the
 * ratio. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  return value[COMPLIANCE_RAD_PER_NM] * at->torque_Nm / (value[RATIO] * value[RATIO]);
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "input_lock_compliance",
    "the lock that holds the input is elastic",
    "compliance torque / ratio^2",
    "33 arcsec at 1.6 N*m for 1 N*m/rad",
    "torque_scale, output_tilt",
    "a second encoder on the wave generator",
    {{"compliance_rad_per_Nm", LM_VALUE_LINEAR, LM_REAL(1), LM_VALUE_AS_USUAL},
     {"ratio", LM_VALUE_GIVEN, LM_REAL(100), LM_SCALE_RATIO, {0, 0, 0, 0}, 0u, 0}},
    "absorbed by the compliance of the baseline",
    0u,
    0};
#endif

const lm_effect lm_effect_input_lock_compliance = {
    0x31d49b42u,
    LM_EFFECT_ANGLE,
    VALUES,
    0,
    LM_NEEDS_TORQUE,
    run,
    {{LM_REAL(-1e3), LM_REAL(1e3)}, {LM_REAL(1), LM_REAL(1000)}},
    LM_EFFECT_CARD(card)};
