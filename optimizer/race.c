#include "race.h"

#include <math.h>

#include "trade_off.h"

#define SCREEN_POINTS 4 /* of a combination */
#define POINT_CHARGE 2  /* of a screened point: unchanged, and with its gap closed */
#define RUNG_SLOPES 12  /* evaluations with derivatives of the first rung */

/* Shares of the budget. */
#define SCREEN_SHARE 0.15
#define EVOLVE_SHARE 0.7 /* up to here, for one objective */
/* With several objectives every member of a population is a design of the front, so an evaluation
 * has several times the benefit of one in a local solver. */
#define EVOLVE_FRONT_SHARE 0.9
/* The extreme points of the front are searched as soon as the population has found its regions, and
 * early enough to be parents in it. */
#define ENDS_SHARE 0.3
#define ENDS_AGAIN_SHARE 0.8 /* from the population, if it has the rest of the budget */
#define LOOKS_SHARE 0.05     /* largest share for examinations of the ends at a time */
#define RACE_SHARE 0.03

/* Two objectives: evaluations of the local solver for one of the population. With three and more
 * there are many more directions than tasks, and the population alone had more of the front. */
#define SOLVER_PART 0.25
#define SOLVER_SLOPES 40 /* gradients of one of its tasks; from far away most take half */

#define EPOCH_BUDGET 4000 /* evaluations of a population before a new one starts */
#define ISLAND_BUDGET 100 /* evaluations of one island between two exchanges: a generation */
/* Below this budget there are two islands; with more than one objective they have all of the budget
 * once the ends of the front are known. The tasks that refine the front then run in parallel with
 * them: in a separate stage they would be few and of different length, so that threads would wait
 * for each other. */
#define FEW_EVALUATIONS 10000

void lm_start_screen(lm_search *search) {
  int i;
  for (i = 0; i < search->combinations; i++) {
    search->order[i] = i;
  }
  /* In random order, so that a short budget does not always miss the same end. */
  for (i = search->combinations - 1; i > 0; i--) {
    const int k = (int)(lm_draw_number(search, -1, i) * (i + 1));
    const int moved = search->order[i];
    search->order[i] = search->order[k];
    search->order[k] = moved;
  }
}

/* The initial designs, before anything else. */
static void plan_starts(lm_search *search) {
  const lm_problem *p = &search->problem;
  for (; search->started < p->start_count; search->started++) {
    const lm_start *start = &p->start[search->started];
    if (search->state[start->combination].fate != LM_FATE_PRUNED) {
      (void)lm_add_task(search, LM_TASK_EVALUATE, start->combination, POINT_CHARGE, start->unit);
    }
  }
}

void lm_plan_screen(lm_search *search) {
  const double share = SCREEN_SHARE * search->problem.evaluations;
  int waiting = 0;
  int points;
  int i;
  plan_starts(search);
  if (search->batch_count > 0) {
    return;
  }
  for (i = 0; i < search->combinations; i++) {
    waiting += search->state[i].fate != LM_FATE_PRUNED;
  }
  points = waiting > 0 ? (int)(share / (POINT_CHARGE * waiting)) : 0;
  points = points < 1 ? 1 : points > SCREEN_POINTS ? SCREEN_POINTS : points;
  if (waiting <= LM_POLISHED) {
    points = 4 * SCREEN_POINTS;
  }
  while (search->cursor < search->combinations && search->batch_count < LM_BATCH_MAX &&
         search->used + POINT_CHARGE * points * search->batch_count < 2 * share) {
    const int combination = search->order[search->cursor++];
    if (search->state[combination].fate != LM_FATE_PRUNED) {
      (void)lm_add_task(search, LM_TASK_SCREEN, combination, POINT_CHARGE * points, NULL);
    }
  }
}

/* Designs spread over the front, including its ends. */
static void add_spread(lm_search *search, int islands) {
  const int places = islands * LM_PARENT_MAX - search->population_count;
  const int count = search->archive_count < places ? search->archive_count : places;
  int n;
  for (n = 0; n < count; n++) {
    const int place = count > 1 ? n * (search->archive_count - 1) / (count - 1) : 0;
    search->population[search->population_count++] = search->archive[place];
  }
}

/* The best kept design of each combination, the best combinations first. */
static void add_champions(lm_search *search) {
  const int screened = lm_rank_screened(search);
  int i;
  for (i = 0; i < screened && search->population_count < LM_ISLANDS_MAX * LM_PARENT_MAX / 2; i++) {
    const lm_combination_state *state = &search->state[search->order[i]];
    if (state->pool_count > 0) {
      search->population[search->population_count++] = state->pool[0];
    }
  }
}

static int count_islands(const lm_search *search) {
  return search->problem.evaluations < FEW_EVALUATIONS ? LM_ISLANDS_MAX / 2 : LM_ISLANDS_MAX;
}

/* Islands start from the screened designs, and from the front of an earlier search. */
void lm_start_population(lm_search *search) {
  search->population_count = 0;
  add_champions(search);
  if (search->started > 0) {
    add_spread(search, count_islands(search));
  }
  search->epoch_end = search->problem.evaluations < FEW_EVALUATIONS ? search->problem.evaluations
                                                                    : search->used + EPOCH_BUDGET;
}

/* A population converges to one region, so a larger budget is divided between several restarts;
 * the last one, with half of the share, starts from the results of all. */
static void start_epoch(lm_search *search, double share) {
  search->population_count = 0;
  if (search->used + EPOCH_BUDGET <= share / 2) {
    search->epoch_end = search->used + EPOCH_BUDGET;
    return;
  }
  search->epoch_end = search->problem.evaluations;
  add_champions(search);
  add_spread(search, LM_ISLANDS_MAX);
}

/* The least value of each objective of each combination, over the kept designs. */
static void find_least(lm_search *search) {
  const int count = search->problem.objective_count;
  int i;
  int j;
  for (i = 0; i < search->archive_count; i++) {
    for (j = 0; j < count; j++) {
      search->state[search->archive[i].combination].least[j] = HUGE_VAL;
    }
  }
  for (i = 0; i < search->archive_count; i++) {
    const lm_solution *found = &search->archive[i];
    double *least = search->state[found->combination].least;
    for (j = 0; j < count; j++) {
      least[j] = fmin(found->objective[j], least[j]);
    }
  }
}

/* Whether a kept design is the best of its combination in any objective. */
static int is_end(const lm_search *search, const lm_solution *found) {
  const double *least = search->state[found->combination].least;
  int j = 0;
  while (j < search->problem.objective_count && found->objective[j] > least[j]) {
    j++;
  }
  return j < search->problem.objective_count;
}

/* The last population is too small for a wide front: if the kept designs exceed its size, half of
 * its places go to the ends of each combination's part, which are the hardest to reach, and to
 * designs drawn along all kept ones. With two objectives always, so that the solver's designs are
 * parents. */
static void recall_front(lm_search *search, int places) {
  const int held = search->population_count;
  const int first = held < places / 2 ? held : places / 2;
  int last = places;
  int n;
  if (search->archive_count == 0 ||
      (search->problem.objective_count > 2 &&
       (search->epoch_end < search->problem.evaluations || search->archive_count < places))) {
    return;
  }
  find_least(search);
  for (n = 0; n < search->archive_count && last > first; n++) {
    if (is_end(search, &search->archive[n])) {
      search->population[--last] = search->archive[n];
    }
  }
  for (n = first; n < last; n++) {
    const double share =
        (n - first + lm_draw_number(search, search->next_id, 300 + n)) / (last - first);
    search->population[n] = search->archive[(int)(share * (search->archive_count - 1) + 0.5)];
  }
  search->population_count = places;
}

/* Whether this stage has the rest of the budget. */
static int has_rest(const lm_search *search) {
  const int objectives = search->problem.objective_count;
  return search->extremes_sought &&
         (objectives == 2 || (objectives > 2 && search->problem.evaluations < FEW_EVALUATIONS));
}

/* Islands exchange designs by redistributing the population, best first in turn. */
void lm_plan_evolve(lm_search *search) {
  const int islands = count_islands(search);
  const int objectives = search->problem.objective_count;
  const int rest = has_rest(search);
  const double share = (rest             ? 1
                        : objectives > 1 ? EVOLVE_FRONT_SHARE
                                         : EVOLVE_SHARE) *
                       search->problem.evaluations;
  int i;
  int k;
  if (search->used + islands * ISLAND_BUDGET / (rest ? 4 : 2) > share) {
    return;
  }
  if (search->used >= search->epoch_end) {
    start_epoch(search, share);
  }
  recall_front(search, islands * LM_PARENT_MAX);
  for (i = 0; i < islands; i++) {
    lm_task *task = lm_add_task(search, LM_TASK_EVOLVE, 0, ISLAND_BUDGET, NULL);
    /* at most the size of an island, for every source of the population */
    for (k = i; k < search->population_count; k += islands) {
      task->parent[task->parent_count++] = search->population[k];
    }
  }
  if (objectives > 1 && search->archive_count > 0 && search->extremes_sought < (rest ? 2 : 1) &&
      search->used >= (rest ? ENDS_AGAIN_SHARE : ENDS_SHARE) * search->problem.evaluations) {
    /* Both ends of every open combination are examined before a solver continues from the best;
     * a part of less than a generation is not used. */
    const int looking = search->ends_looked == search->extremes_sought &&
                        LOOKS_SHARE * search->problem.evaluations >= ISLAND_BUDGET;
    search->ends_looked += looking;
    if (looking && lm_add_end_looks(search, LOOKS_SHARE) > 0) {
      return;
    }
    search->extremes_sought++;
    lm_add_extreme_points(search);
  }
  if (objectives == 2 && search->solver_used <= SOLVER_PART * search->evolved &&
      lm_count_screened(search) > 0) {
    lm_add_solver_task(search, LM_TASK_SLSQP, search->archive, search->archive_count,
                       SOLVER_SLOPES * lm_slope_charge(&search->problem));
  }
}

/* Number of combinations that the budget of the race permits through all rungs: each rung costs the
 * same, because the number of combinations halves and their budget doubles. */
void lm_start_race(lm_search *search) {
  const double budget =
      RACE_SHARE * search->problem.evaluations / (RUNG_SLOPES * lm_slope_charge(&search->problem));
  const int screened = lm_rank_screened(search);
  int runners = 1;
  int i;
  for (i = 0; i < screened; i++) {
    lm_combination_state *state = &search->state[search->order[i]];
    state->fate = state->fate == LM_FATE_SOLVED ? LM_FATE_SOLVED : LM_FATE_DOMINATED;
  }
  while (runners < screened) {
    int rungs = 1;
    while ((1 << rungs) < runners + 1) {
      rungs++;
    }
    if ((runners + 1) * rungs > budget) {
      break;
    }
    runners++;
  }
  search->runners = runners < screened ? runners : screened;
  search->rung = 0;
}

/* Gradient-based and gradient-free solvers alternate, because they stall at different points. If
 * all of them are polished anyway, there is no race. */
void lm_plan_race(lm_search *search) {
  int i;
  if (search->runners <= LM_POLISHED / 2) {
    return;
  }
  for (i = 0; i < search->runners && search->batch_count < LM_BATCH_MAX; i++) {
    const int combination = search->order[i];
    (void)lm_add_task(search, search->rung % 2 == 0 ? LM_TASK_SLSQP : LM_TASK_COBYLA, combination,
                      (RUNG_SLOPES << search->rung) * lm_slope_charge(&search->problem),
                      search->state[combination].unit);
  }
}

/* A share of the rest of the budget, for as many combinations as it permits: half of it for one
 * objective; with more objectives the extreme points of the front are only a part of the work.
 * Nothing if it is less than a gradient per task. */
void lm_plan_polish(lm_search *search) {
  const double share = search->problem.objective_count > 1 ? 0.2 : 0.5;
  const int left = (int)((search->problem.evaluations - search->used) * share);
  int slopes = 40 * lm_slope_charge(&search->problem);
  int polished = left / (3 * 10 * lm_slope_charge(&search->problem));
  const int screened = lm_count_screened(search);
  int i;
  if (left < 3 * lm_slope_charge(&search->problem)) {
    return;
  }
  polished = polished < LM_POLISHED ? polished : LM_POLISHED;
  polished = polished < 1 ? 1 : polished;
  polished = polished < screened ? polished : screened;
  for (i = 0; i < polished; i++) {
    lm_combination_state *state = &search->state[search->order[i]];
    lm_task *task;
    slopes = left / (3 * polished) < slopes ? left / (3 * polished) : slopes;
    state->fate = LM_FATE_SOLVED;
    (void)lm_add_task(search, LM_TASK_SLSQP, search->order[i], slopes, state->unit);
    (void)lm_add_task(search, LM_TASK_COBYLA, search->order[i], slopes, state->unit);
    task = lm_add_task(search, LM_TASK_SLSQP, search->order[i], slopes, state->unit);
    lm_disturb(search, task, 0.15);
  }
}
