#include "lostmotion/effects.h"

#include "runtime/as_written.h"

enum { SHARE, ONSET_S, VALUES };

/* Memory: the angles of the elements, then the time and angle gathered for their next step. */
enum { ELEMENTS = 4, GATHERED_S = ELEMENTS, GATHERED_RAD_S = ELEMENTS + 1, MEMORY = ELEMENTS + 2 };
#define FIRST_TIME LM_REAL(1.6)
#define TIME_RATIO LM_REAL(7.4)
#define BATCH LM_REAL(0.015625)

static const lm_real weight[ELEMENTS] = {LM_REAL(1.0838), LM_REAL(1.8605), LM_REAL(1.8649),
                                         LM_REAL(2.6421)};

/* Anelastic creep, share * ln(1 + t / onset) of the elastic angle under constant load, and its
 * recovery. Four Kelvin elements approximate the logarithm: time constants 1.6 * 7.4^k * onset,
 * weights from a least-squares fit of ln(1 + t) on 0.01 <= t <= 1000, largest error 0.031 (0.5 % of
 * the end value).
 *
 * In one tick of a controller the slow elements would move by less than the rounding of a float.
 * Therefore time and angle are gathered until BATCH of the shortest time constant has passed; then
 * the elements move, by the mean angle. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  lm_real first_s = FIRST_TIME * value[ONSET_S];
  lm_real crept_rad = 0;
  int32_t k;
  memory[GATHERED_S] += at->elapsed_s;
  memory[GATHERED_RAD_S] += at->elapsed_s * at->elastic_rad;
  /* At the tick nearest to the batch's end, so that a batch of a whole number of ticks is not
   * decided by how their sum is rounded. */
  if (memory[GATHERED_S] + LM_REAL(0.5) * at->elapsed_s > BATCH * first_s) {
    lm_real mean_rad = memory[GATHERED_RAD_S] / memory[GATHERED_S];
    lm_real elapsed = memory[GATHERED_S] / first_s;
    for (k = 0; k < ELEMENTS; ++k) {
      memory[k] += lm_relaxation(elapsed) * (mean_rad - memory[k]);
      elapsed /= TIME_RATIO;
    }
    memory[GATHERED_S] = 0;
    memory[GATHERED_RAD_S] = 0;
  }
  for (k = 0; k < ELEMENTS; ++k) {
    crept_rad += weight[k] * memory[k];
  }
  return value[SHARE] * crept_rad;
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "creep",
    "the flexspline creeps under load and recovers without",
    "share ln(1 + t / onset) elastic_angle, as four Kelvin elements",
    "0.3 to 1.5 % an e-fold, 1 to 5 arcsec; a polymer ten times that",
    "thermal_stiffness, load_dependent_friction, sensor_lag",
    "hold rated torque of either sign for 30 min, unload, record the recovery",
    {{"share", LM_VALUE_LINEAR, LM_REAL(0.01), LM_VALUE_AS_USUAL},
     {"onset_s", LM_VALUE_SHAPE, LM_REAL(1), LM_SCALE_TIMES, {0, 0, 0, 0}, 0u, 0}},
    LM_CARD_AS_USUAL};
#endif

const lm_effect lm_effect_creep = {0xdf157582u,
                                   LM_EFFECT_ANGLE,
                                   VALUES,
                                   MEMORY,
                                   LM_NEEDS_TORQUE | LM_NEEDS_TIME,
                                   run,
                                   {{LM_REAL(0), LM_REAL(0.5)}, {LM_REAL(1e-3), LM_REAL(1e5)}},
                                   LM_EFFECT_CARD(card)};
