#include "lostmotion/effects.h"

#include "runtime/as_written.h"

enum { WINDUP_RAD_S2, VALUES };

/* The load's inertia winds the drive up when it accelerates: J / K. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  return value[WINDUP_RAD_S2] * at->output_acceleration_rad_s2;
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {"inertia",
                                    "the load's inertia winds the drive up",
                                    "windup output_acceleration",
                                    "13 arcsec for 1 N*m",
                                    "viscous_friction, sensor_lag",
                                    "a run at constant speed",
                                    {{"windup_rad_s2", LM_VALUE_LINEAR, LM_REAL(1e-5)}}};
#endif

const lm_effect lm_effect_inertia = {0xfc2a69e4u,
                                     LM_EFFECT_ANGLE,
                                     VALUES,
                                     0,
                                     LM_NEEDS_OUTPUT_ACCELERATION,
                                     run,
                                     {{LM_REAL(-0.1), LM_REAL(0.1)}},
                                     LM_EFFECT_CARD(card)};
