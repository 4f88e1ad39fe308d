#include "lostmotion/effects.h"

#include "runtime/number.h"

enum { LAG_S, VALUES };

/* A lag below this is none. */
#define SHORTEST_S LM_REAL(1e-9)
#define LONGEST_S LM_REAL(10)

/* Torque and angle are not sampled at the same instant: the angle follows with a first-order lag,
 * or, where the lag is negative, is ahead by as much. Memory: the lagging angle, and whether it has
 * started. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  lm_real way = lm_relaxation(at->elapsed_s / clamp(absolute(value[LAG_S]), SHORTEST_S, LONGEST_S));
  lm_real behind_rad;
  if (!(memory[1] > 0)) {
    memory[0] = at->elastic_rad;
    memory[1] = 1;
  }
  memory[0] += way * (at->elastic_rad - memory[0]);
  behind_rad = memory[0] - at->elastic_rad;
  return value[LAG_S] >= 0 ? behind_rad : -behind_rad;
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
                                        2,
                                        LM_NEEDS_TORQUE | LM_NEEDS_TIME,
                                        run,
                                        {{-LONGEST_S, LONGEST_S}},
                                        LM_EFFECT_CARD(card)};
