#include "lostmotion/effects.h"

#include "runtime/as_written.h"

enum { DRAG_NM_S, VALUES };

/* Viscous drag between the two sides reduces the torque that winds up the drive, in proportion to
 * the speed of the input. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  return -value[DRAG_NM_S] * at->input_velocity_rad_s;
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "viscous_friction",
    "viscous drag reduces the torque that winds the drive up",
    "torque - drag input_velocity",
    "30 to 40 arcsec at full speed",
    "stribeck_friction, sensor_lag, inertia",
    "at least four speeds both ways, extrapolated to standstill",
    {{"drag_Nm_s", LM_VALUE_LINEAR, LM_REAL(0.01), LM_VALUE_AS_USUAL}},
    LM_CARD_AS_USUAL};
#endif

const lm_effect lm_effect_viscous_friction = {0x633f99bcu,
                                              LM_EFFECT_TORQUE,
                                              VALUES,
                                              0,
                                              LM_NEEDS_INPUT_VELOCITY,
                                              run,
                                              {{LM_REAL(-100), LM_REAL(100)}},
                                              LM_EFFECT_CARD(card)};
