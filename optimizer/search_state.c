#include "search_state.h"

#include <string.h>

#include "archive.h"

/* Random number `which` of the stream of a task, 0 .. 1. */
double lm_draw_number(const lm_search *search, int id, int which) {
  const uint64_t seed = lm_mix((uint64_t)search->problem.seed ^ lm_mix((uint64_t)id));
  return (double)(lm_mix(seed + (uint64_t)which) >> 11) / 9007199254740992.0;
}

/* --- tasks ------------------------------------------------------------------------------------ */

lm_task *lm_add_task(lm_search *search, int kind, int combination, int budget,
                     const double unit[]) {
  lm_task *task = &search->batch[search->batch_count++];
  memset(task, 0, sizeof *task);
  task->id = search->next_id++;
  task->kind = kind;
  task->combination = combination;
  task->budget = budget;
  task->seed = lm_mix((uint64_t)search->problem.seed ^ lm_mix((uint64_t)task->id));
  lm_scalarise_first(&task->scalar);
  if (unit != NULL) {
    memcpy(task->unit, unit, sizeof task->unit);
  }
  return task;
}

/* Move a start by up to `width` of each range. */
void lm_disturb(const lm_search *search, lm_task *task, double width) {
  int k;
  for (k = 0; k < search->problem.range_count; k++) {
    task->unit[k] =
        lm_clip(task->unit[k] + width * (2 * lm_draw_number(search, task->id, 100 + k) - 1));
  }
}

/* --- ranking ---------------------------------------------------------------------------------- */

int lm_is_ahead(const lm_combination_state *a, const lm_combination_state *b) {
  if (a->violation <= 0 && b->violation <= 0) {
    return a->value < b->value;
  }
  return a->violation < b->violation;
}

/* A population also evaluates points of pruned combinations. They show how far their limit is from
 * being satisfied, but they are not in the race. */
static int may_run(const lm_combination_state *state) {
  return state->screened && state->fate != LM_FATE_PRUNED;
}

int lm_count_screened(const lm_search *search) {
  int screened = 0;
  int i;
  for (i = 0; i < search->combinations; i++) {
    screened += may_run(&search->state[i]);
  }
  return screened;
}

/* A merge by insertion of runs, because Shell sort would not keep the order of ties; count is at
 * most LM_COMBINATION_MAX, once per rung. */
void lm_rank(lm_search *search, int count) {
  int i;
  for (i = 1; i < count; i++) {
    const int moved = search->order[i];
    int low = 0;
    int high = i;
    while (low < high) {
      const int middle = (low + high) / 2;
      if (lm_is_ahead(&search->state[moved], &search->state[search->order[middle]])) {
        high = middle;
      } else {
        low = middle + 1;
      }
    }
    memmove(&search->order[low + 1], &search->order[low],
            (size_t)(i - low) * sizeof search->order[0]);
    search->order[low] = moved;
  }
}

int lm_rank_screened(lm_search *search) {
  int screened = 0;
  int i;
  for (i = 0; i < search->combinations; i++) {
    if (may_run(&search->state[i])) {
      search->order[screened++] = i;
    }
  }
  lm_rank(search, screened);
  return screened;
}
