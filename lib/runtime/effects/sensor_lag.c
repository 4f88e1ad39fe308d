#include "lostmotion/effects.h"

#include "runtime/effects/first_order_lag.h"

enum { LAG_S, VALUES };

/* Smaller lags are zero. */
#define SHORTEST_S LM_REAL(1e-9)
#define LONGEST_S LM_REAL(10)

/* Torque and angle are not sampled at the same instant: the torque at the time of the angle follows
 * the recorded one with a first-order lag, or leads it if the lag is negative. It acts on the
 * torque, so that friction reverses when the drive does. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  lm_real lag_s = clamp(absolute(value[LAG_S]), SHORTEST_S, LONGEST_S);
  lm_real behind_Nm = lag_behind(memory, at->torque_Nm, at->elapsed_s, lag_s);
  return value[LAG_S] >= 0 ? behind_Nm : -behind_Nm;
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "sensor_lag",
    "torque and angle are sampled at different instants",
    "the torque delayed by lag, minus the torque",
    "slope of the torsion curve times rate of the torque times lag",
    "viscous_friction, load_dependent_friction, rate_dependent_friction, creep, inertia",
    "the same loop at two rates",
    {{"lag_s", LM_VALUE_SHAPE, LM_REAL(0.005), LM_SCALE_SAMPLE_TIME, {0, 0, 0, 0}, 0u, 0}},
    LM_CARD_AS_USUAL};
#endif

const lm_effect lm_effect_sensor_lag = {0xf7c267b4u,
                                        LM_EFFECT_TORQUE,
                                        VALUES,
                                        LAG_MEMORY,
                                        LM_NEEDS_TORQUE | LM_NEEDS_TIME,
                                        run,
                                        {{-LONGEST_S, LONGEST_S}},
                                        LM_EFFECT_CARD(card)};
