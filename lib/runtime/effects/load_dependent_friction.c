#include "lostmotion/effects.h"

#include "runtime/number.h"

enum { COMPLIANCE_RAD_PER_NM, WIDENING, VALUES };

/* Friction in the mesh grows with the load: one more play whose band is `widening` |torque| wide
 * (its memory is the operator's z). */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  lm_real radius_Nm = value[WIDENING] * absolute(at->wound_Nm);
  memory[0] = clamp(memory[0], at->wound_Nm - radius_Nm, at->wound_Nm + radius_Nm);
  return value[COMPLIANCE_RAD_PER_NM] * (memory[0] - at->wound_Nm);
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "load_dependent_friction",
    "friction between the teeth grows with the load",
    "compliance (z - torque), z held within widening |torque| of the torque",
    "13 to 40 % of the radial part",
    "thermal_friction, creep, stribeck_friction, sensor_lag",
    "nested loops at 0.1, 0.3 and 1 of rated torque: the part of the width that is linear in it",
    {{"compliance_rad_per_Nm", LM_VALUE_LINEAR, LM_REAL(1e-6), LM_VALUE_AS_USUAL},
     {"widening",
      LM_VALUE_SHAPE,
      LM_REAL(0.15),
      LM_SCALE_NONE,
      {LM_REAL(0.02), LM_REAL(0.08), LM_REAL(0.3), 0},
      0u,
      0}},
    LM_CARD_AS_USUAL};
#endif

const lm_effect lm_effect_load_dependent_friction = {
    0xb02187c7u,
    LM_EFFECT_ANGLE,
    VALUES,
    1,
    LM_NEEDS_TORQUE,
    run,
    {{LM_REAL(0), LM_REAL(1e-3)}, {LM_REAL(0), LM_REAL(0.9)}},
    LM_EFFECT_CARD(card)};
