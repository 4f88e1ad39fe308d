#include "task.h"

#include <math.h>

#include "points.h"
#include "sound_answer.h"

void lm_scalarise_first(lm_scalarisation *scalar) {
  int j;
  for (j = 0; j < LM_OBJECTIVE_MAX; j++) {
    scalar->weight[j] = j == 0 ? 1 : 0;
    scalar->origin[j] = 0;
    scalar->scale[j] = 1;
    scalar->most[j] = HUGE_VAL;
  }
}

int lm_charge_of(const lm_problem *problem, const lm_answer *answer) {
  const int64_t charge =
      answer->plain + (int64_t)answer->slopes * lm_slope_charge(problem) +
      ((int64_t)answer->tolerance_only + LM_LOOKS_CHARGED - 1) / LM_LOOKS_CHARGED;
  return charge < LM_COUNTED_MAX ? (int)charge : LM_COUNTED_MAX;
}

double lm_scalarised_value(const lm_problem *problem, const lm_scalarisation *scalar,
                           const double objective[]) {
  double largest = -HUGE_VAL;
  int j;
  for (j = 0; j < problem->objective_count; j++) {
    if (scalar->weight[j] > 0) {
      const double value =
          scalar->weight[j] * (objective[j] - scalar->origin[j]) / scalar->scale[j];
      largest = value > largest ? value : largest;
    }
  }
  return largest;
}
