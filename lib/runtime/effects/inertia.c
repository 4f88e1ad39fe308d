#include "lostmotion/effects.h"

#include "runtime/as_written.h"

enum { INERTIA_KG_M2, VALUES };

/* The torque that accelerates the inertia between torque sensor and drive does not wind up the
 * drive; friction follows the remaining torque. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  return -value[INERTIA_KG_M2] * at->output_acceleration_rad_s2;
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "inertia",
    "accelerating the load reduces the torque that winds the drive up",
    "torque - inertia output_acceleration",
    "13 arcsec for 1 N*m",
    "viscous_friction, sensor_lag",
    "a run at constant speed",
    {{"inertia_kg_m2", LM_VALUE_LINEAR, LM_REAL(1), LM_VALUE_AS_USUAL}},
    LM_CARD_AS_USUAL};
#endif

const lm_effect lm_effect_inertia = {0xfc2a69e4u,
                                     LM_EFFECT_TORQUE,
                                     VALUES,
                                     0,
                                     LM_NEEDS_OUTPUT_ACCELERATION,
                                     run,
                                     {{LM_REAL(-10000), LM_REAL(10000)}},
                                     LM_EFFECT_CARD(card)};
