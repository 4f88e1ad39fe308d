#include "task.h"

#include <limits.h>
#include <math.h>

#include "points.h"

void lm_lead_aim(lm_aim *aim) {
  int j;
  for (j = 0; j < LM_OBJECTIVE_MAX; j++) {
    aim->weight[j] = j == 0 ? 1 : 0;
    aim->origin[j] = 0;
    aim->scale[j] = 1;
    aim->most[j] = HUGE_VAL;
  }
}

int lm_charge_of(const lm_problem *problem, const lm_answer *answer) {
  const int64_t charge = answer->plain + (int64_t)answer->slopes * lm_slope_charge(problem) +
                         ((int64_t)answer->looks + LM_LOOKS_CHARGED - 1) / LM_LOOKS_CHARGED;
  return charge < INT_MAX ? (int)charge : INT_MAX;
}

double lm_aim_value(const lm_problem *problem, const lm_aim *aim, const double objective[]) {
  double largest = -HUGE_VAL;
  int j;
  for (j = 0; j < problem->objective_count; j++) {
    if (aim->weight[j] > 0) {
      const double value = aim->weight[j] * (objective[j] - aim->origin[j]) / aim->scale[j];
      largest = value > largest ? value : largest;
    }
  }
  return largest;
}
