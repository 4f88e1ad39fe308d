#include "sound_answer.h"

static int is_count(int value, int most) {
  return value >= 0 && value <= most;
}

/* A point of the unit cube; NaN is none. */
static int is_point(const lm_problem *problem, const double unit[]) {
  int k;
  for (k = 0; k < problem->range_count; k++) {
    if (!(unit[k] >= 0 && unit[k] <= 1)) {
      return 0;
    }
  }
  return 1;
}

static int is_number(double value) {
  return value == value;
}

static int is_design(const lm_problem *problem, int combinations, const lm_solution *found) {
  int numbers = is_number(found->violation);
  int i;
  for (i = 0; i < problem->objective_count; i++) {
    numbers &= is_number(found->objective[i]);
  }
  return numbers && is_count(found->combination, combinations - 1) &&
         is_count(found->verified, 1) && is_point(problem, found->unit);
}

int lm_is_sound_answer(const lm_problem *problem, int combinations, const lm_answer *answer) {
  const int counts[] = {answer->plain, answer->slopes, answer->tolerance_only, answer->refused,
                        answer->feasible};
  int sound = is_count(answer->combination, combinations - 1) && is_count(answer->computed, 1) &&
              is_count(answer->solution_count, LM_SOLUTION_MAX) &&
              is_count(answer->member_count, LM_PARENT_MAX) && is_number(answer->value) &&
              is_number(answer->violation) && is_point(problem, answer->unit);
  int i;
  for (i = 0; i < (int)(sizeof counts / sizeof counts[0]); i++) {
    sound &= is_count(counts[i], LM_COUNTED_MAX);
  }
  for (i = 0; sound && i < answer->solution_count + answer->member_count; i++) {
    sound = is_design(problem, combinations, &answer->solution[i]);
  }
  return sound;
}

int lm_add_count(int a, int b) {
  return b > LM_COUNTED_MAX - a ? LM_COUNTED_MAX : a + b;
}
