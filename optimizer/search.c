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

#define SETTLE_SLOPES 300    /* gradients for one design; most take a third */
#define SETTLE_LEAST 40      /* with fewer, a design is left out instead */
#define NEIGHBOUR_WIDTH 0.05 /* of a range, by which a start differs from a design that fails */
#define SETTLE_PART 0.3      /* of the search's evaluations: largest total of the solver */
#define FRONT_PART 1.0       /* of them, for the verification of a front of two objectives */
#define ROUND_CHARGE 2       /* of a design: grades to the nearest, then down and up */
#define SETTLE_CHECKS 2      /* checks charged of a design: solved, and solved again */
/* Share of a front of whole grades that remains after rounding, to estimate the work; chosen on the
 * specs in the package and of the tests: 0.07 to 0.6 with two objectives, 0.8 with three. */
#define ROUNDED_OF_TWO 0.2
#define ROUNDED_OF_MORE 0.8
#define CHECK_CHARGE 10   /* of a check: its mesh is four times as fine, and there are two */
#define REPAIR_SLOPES 480 /* for one start: twice the elastic program, then SLSQP */
#define REPAIR_WIDTH 0.15 /* of a range, by which starts of one combination differ */

const char *lm_fate_name(int fate) {
  static const char *const names[LM_FATE_COUNT] = {"not reached", "pruned", "dominated", "solved"};
  return fate >= 0 && fate < LM_FATE_COUNT ? names[fate] : "";
}

/* --- verification
 * -----------------------------------------------------------------------------------
 */

/* A solver continues from a design and stays near it: the largest deterioration over the objectives
 * is minimised. */
static lm_task *add_settling(lm_search *search, const lm_solution *found, int budget) {
  lm_task *task = lm_add_task(search, LM_TASK_VERIFY, found->combination, budget, found->unit);
  if (search->problem.objective_count > 1) {
    int j;
    lm_scale_objectives(search, &task->scalar);
    for (j = 0; j < search->problem.objective_count; j++) {
      task->scalar.weight[j] = 1;
      task->scalar.origin[j] = found->objective[j];
    }
  }
  return task;
}

/* Number of designs for the solver, and of evaluations for each. */
static int count_settled(const lm_search *search, int *budget) {
  const int charge = lm_slope_charge(&search->problem);
  const int all = (int)(SETTLE_PART * search->problem.evaluations);
  int wanted = all / (SETTLE_LEAST * charge);
  wanted = wanted < LM_VERIFIED_MAX ? wanted : LM_VERIFIED_MAX;
  wanted = wanted < search->problem.objective_count ? search->problem.objective_count : wanted;
  *budget = all / wanted < SETTLE_SLOPES * charge ? all / wanted : SETTLE_SLOPES * charge;
  *budget = *budget < SETTLE_LEAST * charge ? SETTLE_LEAST * charge : *budget;
  return wanted;
}

/* One task for each design of a list, in as many batches as required. */
static void plan_each(lm_search *search, int kind, const lm_solution list[], int count,
                      int budget) {
  while (search->verify_cursor < count && search->batch_count < LM_BATCH_MAX) {
    const lm_solution *found = &list[search->verify_cursor++];
    (void)lm_add_task(search, kind, found->combination, budget, found->unit);
  }
}

/* The best of each objective, then designs spread over those that did not hold, then over all. */
static void plan_settle(lm_search *search, int wanted, int budget) {
  const int count = search->archive_count;
  int place[LM_ARCHIVE_MAX];
  int open = 0;
  int i;
  int j;
  for (j = 0; j < search->problem.objective_count; j++) {
    int least = 0;
    for (i = 1; i < count; i++) {
      if (search->archive[i].objective[j] < search->archive[least].objective[j]) {
        least = i;
      }
    }
    (void)add_settling(search, &search->archive[least], budget);
  }
  for (i = 0; i < search->rounded_count; i++) {
    if (!search->confirmed[i]) {
      place[open++] = i;
    }
  }
  for (i = 0; i < open && search->batch_count < wanted; i += 1 + open / wanted) {
    (void)add_settling(search, &search->rounded[place[i]], budget);
  }
  for (i = 1 + count / wanted; i < count - 1 && search->batch_count < wanted;
       i += 1 + count / wanted) {
    (void)add_settling(search, &search->archive[i], budget);
  }
}

/* The ends of a front of two objectives are flat: among designs that differ by less in the one than
 * the front can keep apart, the one with the least of the other. */
static void plan_ends(lm_search *search, const lm_solution front[], int count, int budget) {
  int j;
  for (j = 0; j < 2; j++) {
    lm_scalarisation *scalar =
        &add_settling(search, &front[j == 0 ? 0 : count - 1], budget)->scalar;
    scalar->most[j] = scalar->origin[j] + scalar->scale[j] / LM_ARCHIVE_MAX;
    scalar->weight[j] = 0;
  }
}

/* The solver's designs. With two objectives it continues from both ends of the front of the search
 * and then, in rounds, on the front that is delivered: the designs of the search are optimal for
 * fractional grades, and their front is another one. Each round has a quarter of the rest. */
static void plan_solver(lm_search *search) {
  const int verified = search->verified_count > 0;
  const lm_solution *front = verified ? search->verified : search->archive;
  const int count = verified ? search->verified_count : search->archive_count;
  const double left = FRONT_PART * search->problem.evaluations - search->verify_used;
  int budget;
  int wanted = count_settled(search, &budget);
  const int each = budget + SETTLE_CHECKS * CHECK_CHARGE;
  if (search->problem.objective_count != 2) {
    if (search->round == 0) {
      plan_settle(search, wanted, budget);
    }
    return;
  }
  if (search->round == 0) {
    plan_settle(search, 2, budget);
    return;
  }
  if (search->round == 1) {
    plan_ends(search, front, count, budget);
  }
  for (wanted = 0; wanted < left / (4 * each) && search->batch_count < LM_BATCH_MAX; wanted++) {
    lm_add_solver_task(search, LM_TASK_VERIFY, front, count, budget);
  }
}

/* No design holds: from points near the best design, and from the best ones of other
 * combinations. */
static void plan_neighbours(lm_search *search) {
  int budget;
  const int wanted = count_settled(search, &budget);
  const int ranked = lm_rank_screened(search);
  int n;
  for (n = 0; n < LM_REPAIRED && n < 2 * wanted; n++) {
    const lm_combination_state *state = &search->state[search->order[n / 2 % ranked]];
    const int other = n % 2 == 1 && state->pool_count > 0;
    lm_task *task = add_settling(search, other ? &state->pool[0] : &search->archive[0], budget);
    lm_scalarise_first(&task->scalar);
    lm_disturb(search, task, NEIGHBOUR_WIDTH);
  }
}

static int has_grades(const lm_problem *p) {
  int k = 0;
  while (k < p->range_count && !p->range[k].whole) {
    k++;
  }
  return k < p->range_count;
}

/* The next batch of the verification; none at its end. */
static void plan_verification(lm_search *search) {
  while (search->archive_count > 0 && search->batch_count == 0 &&
         search->verify_step < LM_VERIFY_DONE) {
    switch (search->verify_step) {
      case LM_VERIFY_ROUND:
        if (has_grades(&search->problem)) {
          plan_each(search, LM_TASK_ROUND, search->archive, search->archive_count, ROUND_CHARGE);
        } else {
          memcpy(search->rounded, search->archive, sizeof search->rounded);
          search->rounded_count = search->archive_count;
        }
        break;
      case LM_VERIFY_CONFIRM:
        plan_each(search, LM_TASK_CONFIRM, search->rounded, search->rounded_count, CHECK_CHARGE);
        break;
      case LM_VERIFY_SOLVE:
        plan_solver(search);
        break;
      default:
        if (search->round == 0 && search->verified_count == 0) {
          plan_neighbours(search);
        }
        break;
    }
    if (search->batch_count == 0) {
      search->verify_step++;
      search->verify_cursor = 0;
      search->round = 0;
    }
  }
}

/* If no design satisfies all limits: the required relaxations, from the nearest combinations.
 * Several starts of each if they are few. */
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

/* --- the sequence ----------------------------------------------------------------------------- */

/* Share the rest of the budget when a batch requires more: all of it, at least one evaluation
 * for a task. Tasks without any are not run. */
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

/* Fill the next batch; it remains empty when the search has ended. */
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
        plan_verification(search);
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
  (void)lm_insert_solution(&search->problem, search->verified, &search->verified_count,
                           LM_ARCHIVE_MAX, found);
}

/* Cost of a task of the verification, in plain evaluations. */
static int verify_charge(const lm_search *search, const lm_task *task, const lm_answer *answer) {
  const int checks = task->kind == LM_TASK_CONFIRM  ? 1
                     : task->kind == LM_TASK_VERIFY ? SETTLE_CHECKS
                                                    : 0;
  return lm_add_count(lm_charge_of(&search->problem, answer), checks * CHECK_CHARGE);
}

static void reduce_answer(lm_search *search, const lm_task *task, const lm_answer *answer) {
  const lm_problem *p = &search->problem;
  int i;
  search->plain = lm_add_count(search->plain, answer->plain);
  search->slopes = lm_add_count(search->slopes, answer->slopes);
  search->refused = lm_add_count(search->refused, answer->refused);
  search->feasible = lm_add_count(search->feasible, answer->feasible);
  search->tasks_done++;
  if (task->kind >= LM_TASK_ROUND) {
    search->verify_used = lm_add_count(search->verify_used, verify_charge(search, task, answer));
    if (task->kind == LM_TASK_CONFIRM) {
      const int place = search->verify_cursor - search->batch_count + (int)(task - search->batch);
      search->confirmed[place] = answer->solution_count > 0;
    }
    for (i = 0; i < answer->solution_count; i++) {
      if (task->kind == LM_TASK_ROUND) {
        lm_insert_solution(p, search->rounded, &search->rounded_count, LM_ARCHIVE_MAX,
                           &answer->solution[i]);
      } else {
        lm_combination_state *state = &search->state[answer->combination];
        insert_settled(search, &answer->solution[i]);
        lm_insert_solution(p, state->pool, &state->pool_count, LM_POOL_MAX, &answer->solution[i]);
      }
    }
    return;
  }
  if (task->kind != LM_TASK_REPAIR) {
    search->used = lm_add_count(search->used, lm_charge_of(p, answer));
    if (task->kind == LM_TASK_EVOLVE) {
      search->evolved = lm_add_count(search->evolved, lm_charge_of(p, answer));
    } else if (task->kind == LM_TASK_SLSQP) {
      search->solver_used = lm_add_count(search->solver_used, lm_charge_of(p, answer));
    }
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
      insert_settled(search, found); /* kept unless a better one is found */
    }
  }
  gather_members(search, answer);
  if (answer->computed && answer->violation > 0) {
    improve_state(&search->state[answer->combination], answer->value, answer->violation,
                  answer->unit);
  }
}

/* The batch is complete: process the answers in the order of the tasks, then plan the next
 * tasks. */
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

/* --- reading ---------------------------------------------------------------------------------- */

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

/* Work done and total work, in plain evaluations, including the answers of the present batch. */
static void foresee_work(const lm_search *search, lm_progress *progress) {
  const int step = search->stage < LM_STAGE_VERIFY    ? LM_VERIFY_ROUND
                   : search->stage == LM_STAGE_VERIFY ? search->verify_step
                                                      : LM_VERIFY_DONE;
  double designs = step == LM_VERIFY_ROUND ? search->archive_count : search->rounded_count;
  int waiting = search->stage == LM_STAGE_VERIFY ? search->missing : 0;
  int pending = 0;
  double left = 0;
  int each;
  const int settled = count_settled(search, &each);
  int i;
  for (i = 0; i < search->batch_count; i++) {
    if (search->answered[i]) {
      pending += verify_charge(search, &search->batch[i], &search->answer[i]);
    }
  }
  if (search->stage < LM_STAGE_REPAIR) {
    left += fmax(search->problem.evaluations - search->used - pending, 0);
  }
  if (step <= LM_VERIFY_CONFIRM) {
    waiting += (int)designs - search->verify_cursor;
  }
  if (step == LM_VERIFY_ROUND) {
    if (has_grades(&search->problem)) {
      left += (double)ROUND_CHARGE * waiting;
      designs *= search->problem.objective_count > 2 ? ROUNDED_OF_MORE : ROUNDED_OF_TWO;
    }
    waiting = (int)ceil(designs);
  }
  if (step <= LM_VERIFY_CONFIRM) {
    left += (1.0 + CHECK_CHARGE) * waiting;
    waiting = settled;
  }
  if (step <= LM_VERIFY_NEIGHBOURS) {
    left += (double)(each + SETTLE_CHECKS * CHECK_CHARGE) * waiting;
  }
  if (step <= LM_VERIFY_SOLVE && search->problem.objective_count == 2) {
    left = fmax(left, FRONT_PART * search->problem.evaluations - search->verify_used - pending +
                          fmax(search->problem.evaluations - search->used, 0));
  }
  progress->work_done = (double)search->used + search->verify_used + pending;
  progress->work_total = progress->work_done + left;
}

void lm_read_progress(const lm_search *search, lm_progress *progress) {
  const int evaluations = lm_add_count(search->plain, search->slopes);
  lm_solution best;
  int i;
  memset(progress, 0, sizeof *progress);
  progress->stage = search->stage;
  progress->evaluations = search->used;
  progress->budget = search->problem.evaluations;
  foresee_work(search, progress);
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
