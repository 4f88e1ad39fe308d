#include "lostmotion/effects.h"

#include "runtime/number.h"

enum { LAG_S, VALUES };

/* Memory: how far the lagging angle is behind, the angle before, and whether it has started. */
enum { BEHIND_RAD, BEFORE_RAD, STARTED, MEMORY };

/* A lag below this is none. */
#define SHORTEST_S LM_REAL(1e-9)
#define LONGEST_S LM_REAL(10)

/* Torque and angle are not sampled at the same instant: the angle follows with a first-order lag,
 * or, where the lag is negative, is ahead by as much.
 *
 * Between two samples the elastic angle x is taken to be a ramp, for which the lag has a closed
 * form whatever the length of the step: with u = elapsed / lag, the angle y - x that it is behind
 *
 *     behind <- behind e^-u - (x - x_before) (1 - e^-u) / u
 *
 * so that a lag far below one sample leaves -lag dx/dt, as it should. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  lm_real steps = at->elapsed_s / clamp(absolute(value[LAG_S]), SHORTEST_S, LONGEST_S);
  lm_real way = lm_relaxation(steps);
  lm_real ramp = steps > 0 ? way / steps : LM_REAL(1);
  lm_real moved_rad = memory[STARTED] > 0 ? at->elastic_rad - memory[BEFORE_RAD] : 0;
  memory[BEHIND_RAD] -= way * memory[BEHIND_RAD] + ramp * moved_rad;
  memory[BEFORE_RAD] = at->elastic_rad;
  memory[STARTED] = 1;
  return value[LAG_S] >= 0 ? memory[BEHIND_RAD] : -memory[BEHIND_RAD];
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {"sensor_lag",
                                    "torque and angle are not sampled at the same instant",
                                    "the elastic angle, lagging by lag, less the elastic angle",
                                    "rate of the elastic angle times lag",
                                    "viscous_friction, load_dependent_friction, creep, inertia",
                                    "the same loop at two rates",
                                    {{"lag_s", LM_VALUE_SHAPE, LM_REAL(0.005)}}};
#endif

const lm_effect lm_effect_sensor_lag = {0xf7c267b4u,
                                        LM_EFFECT_ANGLE,
                                        VALUES,
                                        MEMORY,
                                        LM_NEEDS_TORQUE | LM_NEEDS_TIME,
                                        run,
                                        {{-LONGEST_S, LONGEST_S}},
                                        LM_EFFECT_CARD(card)};
