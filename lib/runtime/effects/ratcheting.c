#include "lostmotion/effects.h"

#include "runtime/number.h"

enum { THRESHOLD_NM, TOOTH_ANGLE_RAD, VALUES };

#define TEETH_MAX LM_REAL(1000)  /* more than any drive survives */
#define REARM_SHARE LM_REAL(0.9) /* the peak is over below this part of the threshold */

/* Above a torque the mesh slips by whole teeth, permanently. Memory: teeth slipped, and whether
 * the present peak has been counted. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  lm_real load_Nm = absolute(at->torque_Nm);
  if (load_Nm > value[THRESHOLD_NM] && !(memory[1] > 0)) {
    memory[0] = clamp(memory[0] + (at->torque_Nm > 0 ? 1 : -1), -TEETH_MAX, TEETH_MAX);
    memory[1] = 1;
  } else if (load_Nm < REARM_SHARE * value[THRESHOLD_NM]) {
    memory[1] = 0;
  } else {
    /* within a peak, or below one */
  }
  return value[TOOTH_ANGLE_RAD] * memory[0];
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "ratcheting",
    "the mesh slips by whole teeth above a torque",
    "tooth_angle times the number of torque peaks beyond threshold, with their sign",
    "1.78 deg a tooth",
    "output_eccentricity",
    "the offset stays when the load is gone; the pattern of the kinematic error shifts",
    {{"threshold_Nm",
      LM_VALUE_FIXED,
      LM_REAL(240),
      LM_SCALE_LARGEST_TORQUE,
      {LM_REAL(0.7), LM_REAL(0.95), 0, 0},
      0u,
      0},
     {"tooth_angle_rad",
      LM_VALUE_GIVEN,
      LM_REAL(0.0311),
      LM_SCALE_TOOTH_ANGLE,
      {0, 0, 0, 0},
      0u,
      0}},
    0,
    0u,
    1};
#endif

const lm_effect lm_effect_ratcheting = {
    0xf6ec619au,
    LM_EFFECT_ANGLE,
    VALUES,
    2,
    LM_NEEDS_TORQUE,
    run,
    {{LM_REAL(1e-2), LM_REAL(1e6)}, {LM_REAL(1e-3), LM_REAL(1)}},
    LM_EFFECT_CARD(card)};
