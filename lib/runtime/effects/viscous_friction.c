#include "lostmotion/effects.h"

#include "runtime/as_written.h"

enum { WINDUP_RAD_S, VALUES };

/* Viscous drag on the input winds the drive up in proportion to the speed. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  return value[WINDUP_RAD_S] * at->input_velocity_rad_s;
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {"viscous_friction",
                                    "viscous drag winds the input side up",
                                    "windup input_velocity",
                                    "30 to 40 arcsec at full speed",
                                    "stribeck_friction, sensor_lag, inertia",
                                    "at least four speeds both ways, extrapolated to standstill",
                                    {{"windup_rad_s", LM_VALUE_LINEAR, LM_REAL(1e-6)}}};
#endif

const lm_effect lm_effect_viscous_friction = {0x633f99bcu,
                                              LM_EFFECT_ANGLE,
                                              VALUES,
                                              0,
                                              LM_NEEDS_INPUT_VELOCITY,
                                              run,
                                              {{LM_REAL(-0.01), LM_REAL(0.01)}},
                                              LM_EFFECT_CARD(card)};
