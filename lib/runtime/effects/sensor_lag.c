#include "lostmotion/effects.h"

#include "runtime/number.h"

enum { LAG_S, VALUES };

/* Memory: difference of the lagging torque, previous torque, and whether it has started. */
enum { BEHIND_NM, BEFORE_NM, STARTED, MEMORY };

/* Smaller lags are zero. */
#define SHORTEST_S LM_REAL(1e-9)
#define LONGEST_S LM_REAL(10)

/* Torque and angle are not sampled at the same instant: the torque at the time of the angle follows
 * the recorded one with a first-order lag, or leads it if the lag is negative. It acts on the
 * torque, so that friction reverses when the drive does.
 *
 * Between two samples the torque T is assumed to be a ramp, for which the lag has a closed form for
 * any length of the step: with u = elapsed / lag, the torque difference
 *
 *     behind <- behind e^-u - (T - T_before) (1 - e^-u) / u
 *
 * so that a lag far below one sample gives -lag dT/dt. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  lm_real steps = at->elapsed_s / clamp(absolute(value[LAG_S]), SHORTEST_S, LONGEST_S);
  lm_real way = lm_relaxation(steps);
  lm_real ramp = steps > 0 ? way / steps : LM_REAL(1);
  lm_real moved_Nm = memory[STARTED] > 0 ? at->torque_Nm - memory[BEFORE_NM] : 0;
  memory[BEHIND_NM] -= way * memory[BEHIND_NM] + ramp * moved_Nm;
  memory[BEFORE_NM] = at->torque_Nm;
  memory[STARTED] = 1;
  return value[LAG_S] >= 0 ? memory[BEHIND_NM] : -memory[BEHIND_NM];
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "sensor_lag",
    "torque and angle are sampled at different instants",
    "the torque delayed by lag, minus the torque",
    "slope of the torsion curve times rate of the torque times lag",
    "viscous_friction, load_dependent_friction, creep, inertia",
    "the same loop at two rates",
    {{"lag_s", LM_VALUE_SHAPE, LM_REAL(0.005), LM_SCALE_SAMPLE_TIME, {0, 0, 0, 0}, 0u, 0}},
    LM_CARD_AS_USUAL};
#endif

const lm_effect lm_effect_sensor_lag = {0xf7c267b4u,
                                        LM_EFFECT_TORQUE,
                                        VALUES,
                                        MEMORY,
                                        LM_NEEDS_TORQUE | LM_NEEDS_TIME,
                                        run,
                                        {{-LONGEST_S, LONGEST_S}},
                                        LM_EFFECT_CARD(card)};
