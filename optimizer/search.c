#include "search.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "archive.h"
#include "bounds.h"
#include "race.h"
#include "search_state.h"
#include "sound_answer.h"
#include "trade_off.h"

#define SETTLE_SLOPES 300 /* gradients for one design; most take a third */
#define REPAIR_SLOPES 480 /* for one start: twice the elastic program, then SLSQP */
#define REPAIR_WIDTH 0.15 /* of a range, by which starts of one combination differ */

const char *lm_fate_name(int fate) {
  static const char *const names[LM_FATE_COUNT] = {"not reached", "pruned", "dominated", "solved"};
  return fate >= 0 && fate < LM_FATE_COUNT ? names[fate] : "";
}

/* --- verification
 * -----------------------------------------------------------------------------------
 */

/* Designs of the front spread over it, each kept near where it is: the largest worsening over the
 * objectives is made small. */
static void plan_settle(lm_search *search) {
  const int wanted =
      search->archive_count < LM_VERIFIED_MAX ? search->archive_count : LM_VERIFIED_MAX;
  int n;
  for (n = 0; n < wanted; n++) {
    const int place = wanted > 1 ? n * (search->archive_count - 1) / (wanted - 1) : 0;
    const lm_solution *found = &search->archive[place];
    lm_task *task = lm_add_task(search, LM_TASK_VERIFY, found->combination,
                                SETTLE_SLOPES * lm_slope_charge(&search->problem), found->unit);
    if (search->problem.objective_count > 1) {
      int j;
      lm_scale_objectives(search, &task->scalar);
      for (j = 0; j < search->problem.objective_count; j++) {
        task->scalar.weight[j] = 1;
        task->scalar.origin[j] = found->objective[j];
      }
    }
  }
}

/* Where nothing keeps all limits, from the combinations that come nearest: what has to give there.
 * Several starts of each where they are few. */
static void plan_repair(lm_search *search) {
  const int screened = lm_rank_screened(search);
  const int most = screened > 0 ? LM_REPAIRED : 0;
  int n;
  for (n = 0; n < most; n++) {
    lm_combination_state *state = &search->state[search->order[n % screened]];
    lm_task *task = lm_add_task(search, LM_TASK_REPAIR, search->order[n % screened],
                                REPAIR_SLOPES * lm_slope_charge(&search->problem), state->unit);
    state->fate = LM_FATE_SOLVED;
    if (n >= screened) {
      lm_disturb(search, task, REPAIR_WIDTH);
    }
  }
}

/* --- the sequence -------------------------------------------------------------------------------
 */

/* Share what is left of the budget when a batch asks for more: all of it, at least one evaluation
 * for a task. Tasks that are left with none are not done. */
static void keep_budget(lm_search *search) {
  int left =
      search->used < search->problem.evaluations ? search->problem.evaluations - search->used : 0;
  double wanted = 0;
  int i;
  for (i = 0; i < search->batch_count; i++) {
    wanted += search->batch[i].budget;
  }
  if (wanted <= left) {
    return;
  }
  if (search->batch_count > left) {
    search->batch_count = left;
    search->next_id = search->batch_first + left;
  }
  left -= search->batch_count;
  for (i = 0; i < search->batch_count; i++) {
    lm_task *task = &search->batch[i];
    const int part = (int)(task->budget * left / wanted);
    wanted -= task->budget;
    task->budget = 1 + part;
    left -= part;
  }
}

/* Fill the next batch; leaves it empty when the search has ended. */
static void plan(lm_search *search) {
  search->batch_count = 0;
  search->batch_first = search->next_id;
  while (search->batch_count == 0 && search->stage != LM_STAGE_DONE) {
    switch (search->stage) {
      case LM_STAGE_SCREEN:
        lm_plan_screen(search);
        break;
      case LM_STAGE_EVOLVE:
        lm_plan_evolve(search);
        break;
      case LM_STAGE_RACE:
        lm_plan_race(search);
        break;
      case LM_STAGE_POLISH:
        if (search->round == 0) {
          lm_plan_polish(search);
        }
        break;
      case LM_STAGE_TRADE_OFF:
        if (search->runners > 0) {
          search->problem.objective_count > 1 ? lm_plan_front(search) : lm_plan_restarts(search);
        }
        break;
      case LM_STAGE_REPAIR:
        if (search->round == 0 && search->archive_count == 0) {
          plan_repair(search);
        }
        break;
      case LM_STAGE_VERIFY:
      default:
        if (search->round == 0) {
          plan_settle(search);
        }
        break;
    }
    if (search->stage < LM_STAGE_REPAIR) {
      keep_budget(search);
    }
    if (search->batch_count == 0) {
      search->stage++;
      search->round = 0;
      search->quiet = 0;
      if (search->stage == LM_STAGE_EVOLVE) {
        lm_start_population(search);
      } else if (search->stage == LM_STAGE_RACE) {
        lm_start_race(search);
      }
    }
  }
  memset(search->answered, 0, sizeof search->answered);
  search->missing = search->batch_count;
}

/* A combination's own best is by the first objective. */
static void improve_state(lm_combination_state *state, double value, double violation,
                          const double unit[]) {
  lm_combination_state now = *state;
  now.screened = 1;
  now.value = value;
  now.violation = violation;
  if (!state->screened || lm_is_ahead(&now, state)) {
    state->value = value;
    state->violation = violation;
    memcpy(state->unit, unit, sizeof state->unit);
  }
  state->screened = 1;
}

/* Members of the islands gather until the batch is complete. */
static void gather_members(lm_search *search, const lm_answer *answer) {
  int i;
  for (i = 0; i < answer->member_count; i++) {
    const lm_solution *member = &answer->solution[answer->solution_count + i];
    improve_state(&search->state[member->combination], member->objective[0], member->violation,
                  member->unit);
    if (search->population_count < LM_ISLANDS_MAX * LM_PARENT_MAX) {
      search->population[search->population_count++] = *member;
    }
  }
}

static void insert_settled(lm_search *search, const lm_solution *found) {
  lm_insert_solution(&search->problem, search->verified, &search->verified_count,
                     LM_VERIFIED_MAX + LM_START_MAX, found);
}

static void reduce_answer(lm_search *search, const lm_task *task, const lm_answer *answer) {
  const lm_problem *p = &search->problem;
  int i;
  search->plain = lm_add_count(search->plain, answer->plain);
  search->slopes = lm_add_count(search->slopes, answer->slopes);
  search->refused = lm_add_count(search->refused, answer->refused);
  search->feasible = lm_add_count(search->feasible, answer->feasible);
  search->tasks_done++;
  if (task->kind == LM_TASK_VERIFY) {
    for (i = 0; i < answer->solution_count; i++) {
      insert_settled(search, &answer->solution[i]);
    }
    return;
  }
  if (task->kind != LM_TASK_REPAIR) {
    search->used = lm_add_count(search->used, lm_charge_of(p, answer));
  } else if (answer->violation > 0 &&
             (!search->has_nearest || answer->value < search->nearest_slack)) {
    search->has_nearest = 1;
    search->nearest = answer->combination;
    search->nearest_slack = answer->value;
    search->nearest_violation = answer->violation;
    memcpy(search->nearest_unit, answer->unit, sizeof search->nearest_unit);
  }
  for (i = 0; i < answer->solution_count; i++) {
    const lm_solution *found = &answer->solution[i];
    lm_combination_state *state = &search->state[found->combination];
    lm_insert_solution(p, search->archive, &search->archive_count, LM_ARCHIVE_MAX, found);
    lm_insert_solution(p, state->pool, &state->pool_count, LM_POOL_MAX, found);
    improve_state(state, found->objective[0], 0, found->unit);
    if (found->verified) {
      insert_settled(search, found); /* one to begin with, which stays unless it is bettered */
    }
  }
  gather_members(search, answer);
  if (answer->computed && answer->violation > 0) {
    improve_state(&search->state[answer->combination], answer->value, answer->violation,
                  answer->unit);
  }
}

/* The batch is complete: take the answers in the order of the tasks, then plan what follows. */
static void reduce(lm_search *search) {
  double best = HUGE_VAL;
  int i;
  if (search->stage == LM_STAGE_EVOLVE) {
    search->population_count = 0;
  }
  for (i = 0; i < search->batch_count; i++) {
    reduce_answer(search, &search->batch[i], &search->answer[i]);
  }
  lm_sort_solutions(search->archive, search->archive_count);
  lm_sort_solutions(search->verified, search->verified_count);
  if (search->archive_count > 0) {
    best = search->archive[0].objective[0];
  }
  search->quiet = best < search->round_best - 1e-4 * fabs(best) ? 0 : search->quiet + 1;
  search->round_best = best;
  search->round++;
  if (search->stage == LM_STAGE_EVOLVE) {
    lm_select_solutions(&search->problem, search->population, search->population_count,
                        search->population_count);
  }
  if (search->stage == LM_STAGE_RACE) {
    lm_rank(search, search->runners);
    search->runners = (search->runners + 1) / 2;
    search->rung++;
  } else if (search->stage == LM_STAGE_POLISH || search->stage == LM_STAGE_TRADE_OFF) {
    (void)lm_rank_screened(search);
  }
  plan(search);
}

lm_search *lm_open_search(const lm_problem *problem) {
  lm_search *search = (lm_search *)calloc(1, sizeof *search);
  int i;
  if (search == NULL) {
    return NULL;
  }
  search->problem = *problem;
  search->combinations = lm_count_combinations(problem);
  search->state =
      (lm_combination_state *)calloc((size_t)search->combinations, sizeof *search->state);
  search->order = (int *)calloc((size_t)search->combinations, sizeof *search->order);
  if (search->state == NULL || search->order == NULL) {
    lm_close_search(search);
    return NULL;
  }
  search->round_best = HUGE_VAL;
  for (i = 0; i < search->combinations; i++) {
    search->state[i].violation = HUGE_VAL;
    search->state[i].value = HUGE_VAL;
    if (lm_is_excluded(problem, i, &search->state[i].limit)) {
      search->state[i].fate = LM_FATE_PRUNED;
    }
  }
  lm_start_screen(search);
  plan(search);
  return search;
}

void lm_close_search(lm_search *search) {
  if (search != NULL) {
    free(search->state);
    free(search->order);
    free(search);
  }
}

int lm_next_tasks(lm_search *search, const lm_task **tasks) {
  *tasks = search->batch;
  return search->batch_count;
}

int lm_is_answered(const lm_search *search, int id) {
  const int place = id - search->batch_first;
  return place < 0 || (place < search->batch_count && search->answered[place]);
}

lm_status lm_accept_answer(lm_search *search, const lm_answer *answer) {
  int place;
  if (search == NULL || answer == NULL) {
    return LM_NULL;
  }
  if (answer->id < 0) {
    return LM_OUT_OF_RANGE;
  }
  place = answer->id - search->batch_first;
  if (place >= search->batch_count ||
      (place >= 0 && answer->combination != search->batch[place].combination)) {
    return LM_OUT_OF_RANGE;
  }
  if (lm_is_answered(search, answer->id)) {
    return LM_OK;
  }
  if (!lm_is_sound_answer(&search->problem, search->combinations, answer)) {
    return LM_OUT_OF_RANGE;
  }
  search->answer[place] = *answer;
  search->answered[place] = 1;
  search->missing--;
  if (search->missing == 0) {
    reduce(search);
  }
  return LM_OK;
}

/* --- reading ------------------------------------------------------------------------------------
 */

int lm_read_front(const lm_search *search, lm_solution front[], int capacity) {
  const int verified = search->stage == LM_STAGE_DONE && search->verified_count > 0;
  const lm_solution *list = verified ? search->verified : search->archive;
  const int count = verified ? search->verified_count : search->archive_count;
  const int written = count < capacity ? count : capacity;
  int i;
  for (i = 0; i < written; i++) {
    front[i] = list[i];
  }
  return count;
}

int lm_read_best(const lm_search *search, lm_solution *best) {
  return lm_read_front(search, best, 1) > 0;
}

int lm_read_fate(const lm_search *search, int combination, int *limit) {
  *limit = search->state[combination].limit;
  return search->state[combination].fate;
}

int lm_read_nearest(const lm_search *search, int *combination, double unit[LM_FREE_MAX],
                    double *violation) {
  int found = 0;
  int i;
  if (search->has_nearest) {
    *combination = search->nearest;
    *violation = search->nearest_violation;
    memcpy(unit, search->nearest_unit, sizeof search->nearest_unit);
    return 1;
  }
  for (i = 0; i < search->combinations; i++) {
    const lm_combination_state *state = &search->state[i];
    if (state->screened && (!found || state->violation < *violation)) {
      found = 1;
      *combination = i;
      *violation = state->violation;
      memcpy(unit, state->unit, sizeof state->unit);
    }
  }
  return found;
}

void lm_read_progress(const lm_search *search, lm_progress *progress) {
  const int evaluations = lm_add_count(search->plain, search->slopes);
  lm_solution best;
  int i;
  memset(progress, 0, sizeof *progress);
  progress->stage = search->stage;
  progress->evaluations = search->used;
  progress->budget = search->problem.evaluations;
  progress->feasible_share = evaluations > 0 ? (double)search->feasible / evaluations : 0;
  progress->refused = search->refused;
  progress->tasks_done = search->tasks_done;
  progress->front_size = lm_read_front(search, NULL, 0);
  progress->has_best = lm_read_best(search, &best);
  if (progress->has_best) {
    progress->best_combination = best.combination;
    progress->best_value = best.objective[0];
  }
  for (i = 0; i < search->combinations; i++) {
    progress->fate[search->state[i].fate]++;
  }
}
