#include "trade_off.h"

#include <math.h>

#define OTHER_SHARE 0.3     /* of the directions in which a second combination is tried */
#define END_SLOPES 30       /* gradients for an end of the front, which is further away */
#define DIRECTION_SLOPES 15 /* gradients for one direction; warm starts need no more */
/* Two objectives: the natural logarithm of a weight is drawn up to this. Two weights then differ by
 * a factor of up to 55, so that directions are within one degree of both axes. The weight of a
 * single objective changes the solver's first step, which is as long as the slope. */
#define LOG_WEIGHT 2
#define ENDS_PART 0.1     /* largest share of the budget for all ends at a time */
#define LOOK_CHARGE 2     /* of a transferred design: unchanged, and with its gap closed */
#define DIRECTIONS_MAX 12 /* of one round of the trade-off */
#define QUIET_ROUNDS 4    /* restarts without a better design before the search ends early */

/* --- restarts of one objective ---------------------------------------------------------------- */

/* A combination to try: mostly one of the best, sometimes any that was screened. */
static int pick_combination(const lm_search *search, int id) {
  const int screened = lm_count_screened(search);
  int i;
  if (lm_draw_number(search, id, 1) < 0.7) {
    const int best = screened < LM_POLISHED ? screened : LM_POLISHED;
    return search->order[(int)(lm_draw_number(search, id, 2) * best)];
  }
  i = 2 * search->runners + LM_POLISHED;
  i = i < screened ? i : screened;
  return search->order[(int)(lm_draw_number(search, id, 2) * i)];
}

void lm_plan_restarts(lm_search *search) {
  const int left = search->problem.evaluations - search->used;
  const int charge = 30 * lm_slope_charge(&search->problem);
  int i;
  if (left < charge / 2 || search->quiet >= QUIET_ROUNDS) {
    return;
  }
  if (search->round == 0 && search->problem.evaluations >= 10000) {
    const int best = search->order[0];
    (void)lm_add_task(search, LM_TASK_ISRES, best, search->problem.evaluations / 20,
                      search->state[best].unit);
  }
  for (i = 0; i < 8 && (i == 0 || (i + 1) * charge <= left); i++) {
    const int combination = pick_combination(search, search->next_id);
    lm_task *task = lm_add_task(search, i % 2 == 0 ? LM_TASK_COBYLA : LM_TASK_SLSQP, combination,
                                charge < left ? charge : left, search->state[combination].unit);
    lm_disturb(search, task, 0.05 + 0.25 * lm_draw_number(search, task->id, 3));
  }
}

/* --- trade-off -------------------------------------------------------------------------------- */

static void range_of(const lm_search *search, int j, double *low, double *high) {
  int i;
  *low = search->archive[0].objective[j];
  *high = *low;
  for (i = 1; i < search->archive_count; i++) {
    const double f = search->archive[i].objective[j];
    *low = f < *low ? f : *low;
    *high = f > *high ? f : *high;
  }
}

void lm_scale_objectives(const lm_search *search, lm_scalarisation *scalar) {
  int j;
  for (j = 0; j < search->problem.objective_count; j++) {
    double low;
    double high;
    range_of(search, j, &low, &high);
    scalar->origin[j] = low;
    scalar->scale[j] = high - low > 1e-6 * fabs(high) ? high - low : fabs(high) + 1e-12;
  }
}

static int meets(const lm_problem *p, const lm_scalarisation *scalar, const double objective[]) {
  int j;
  for (j = 0; j < p->objective_count; j++) {
    if (objective[j] > scalar->most[j]) {
      return 0;
    }
  }
  return 1;
}

/* The best kept design of a combination for a scalarised objective, null: none meets its bounds. */
static const lm_solution *best_of_pool(const lm_search *search, int combination,
                                       const lm_scalarisation *scalar, double *value) {
  const lm_combination_state *state = &search->state[combination];
  const lm_solution *best = NULL;
  int i;
  for (i = 0; i < state->pool_count; i++) {
    const double here = lm_scalarised_value(&search->problem, scalar, state->pool[i].objective);
    if (meets(&search->problem, scalar, state->pool[i].objective) &&
        (best == NULL || here < *value)) {
      best = &state->pool[i];
      *value = here;
    }
  }
  return best;
}

static const lm_solution *best_of_archive(const lm_search *search, const lm_scalarisation *scalar) {
  const lm_solution *best = &search->archive[0];
  double least = HUGE_VAL;
  int i;
  for (i = 0; i < search->archive_count; i++) {
    const double value =
        lm_scalarised_value(&search->problem, scalar, search->archive[i].objective);
    if (meets(&search->problem, scalar, search->archive[i].objective) && value < least) {
      best = &search->archive[i];
      least = value;
    }
  }
  return best;
}

/* The best design of any other combination for the scalarised objective. */
static const lm_solution *best_other(const lm_search *search, const lm_scalarisation *scalar,
                                     int but) {
  const lm_solution *best = NULL;
  double least = HUGE_VAL;
  int i;
  for (i = 0; i < search->combinations; i++) {
    double value = 0;
    const lm_solution *here = i == but ? NULL : best_of_pool(search, i, scalar, &value);
    if (here != NULL && value < least) {
      best = here;
      least = value;
    }
  }
  return best;
}

/* The end of each axis, then twice as many drawn directions, and so on. */
static void make_direction(lm_search *search, lm_scalarisation *scalar) {
  const int count = search->problem.objective_count;
  const int turn = search->scalarisations++ % (3 * count);
  int j;
  lm_scalarise_first(scalar);
  lm_scale_objectives(search, scalar);
  for (j = 0; j < count; j++) {
    if (turn < count) {
      scalar->weight[j] = j == turn ? 1 : 0;
    } else {
      scalar->weight[j] = -log(1 - lm_draw_number(search, search->next_id, 10 + j)) + 1e-3;
    }
  }
}

/* With many objectives and variables the ends would use half of a small budget, although most of
 * the front is between them. */
static int end_budget(const lm_search *search) {
  const int charge = lm_slope_charge(&search->problem);
  const int part = (int)(ENDS_PART * search->problem.evaluations / search->problem.objective_count);
  if (part < charge) {
    return charge;
  }
  return part < END_SLOPES * charge ? part : END_SLOPES * charge;
}

/* A single objective, scaled by the width of the front: SLSQP's first steps are as long as the
 * slopes, and those of a compliance in its own unit are a thousandth. */
static void scalarise_end(const lm_search *search, int objective, lm_scalarisation *scalar) {
  lm_scalarise_first(scalar);
  lm_scale_objectives(search, scalar);
  scalar->weight[0] = 0;
  scalar->weight[objective] = 1;
}

/* Combinations in the order of their rank, so that the worst are left out if the budget is not
 * sufficient. */
int lm_add_end_looks(lm_search *search, double share) {
  const int ranked = lm_rank_screened(search);
  const int objectives = search->problem.objective_count;
  const int part = (int)(share * search->problem.evaluations / LOOK_CHARGE);
  const int room = LM_BATCH_MAX - search->batch_count;
  const int most = part < room ? part : room;
  int looks = 0;
  int n;
  int j;
  for (n = 0; n < ranked; n++) {
    for (j = 0; j < objectives && looks < most; j++) {
      lm_scalarisation scalar;
      const lm_solution *end;
      scalarise_end(search, j, &scalar);
      end = best_of_archive(search, &scalar);
      if (end->combination != search->order[n]) {
        (void)lm_add_task(search, LM_TASK_EVALUATE, search->order[n], LOOK_CHARGE, end->unit);
        looks++;
      }
    }
  }
  return looks;
}

void lm_add_extreme_points(lm_search *search) {
  int j;
  for (j = 0; j < search->problem.objective_count; j++) {
    const lm_solution *start;
    lm_task *task;
    lm_scalarisation scalar;
    scalarise_end(search, j, &scalar);
    start = best_of_archive(search, &scalar);
    search->state[start->combination].fate = LM_FATE_SOLVED;
    task = lm_add_task(search, LM_TASK_SLSQP, start->combination, end_budget(search), start->unit);
    task->scalar = scalar;
  }
}

/* Into the front, towards the inner corner of a step that is drawn in proportion to its area, from
 * either side. */
static const lm_solution *aim_at_step(const lm_search *search, const lm_solution front[], int count,
                                      lm_scalarisation *scalar) {
  const int id = search->next_id;
  double most = 0;
  int chosen = 0;
  int i;
  int j;
  for (i = 0; i + 1 < count; i++) {
    const double area = (front[i + 1].objective[0] - front[i].objective[0]) *
                        (front[i].objective[1] - front[i + 1].objective[1]);
    const double drawn = area * lm_draw_number(search, id, 1000 + i);
    if (drawn > most) {
      most = drawn;
      chosen = i;
    }
  }
  for (j = 0; j < 2; j++) {
    const double a = front[chosen].objective[j];
    const double b = front[chosen + 1].objective[j];
    scalar->origin[j] = fmin(a, b);
    scalar->scale[j] = fabs(a - b);
  }
  return &front[chosen + (lm_draw_number(search, id, 12) < 0.5)];
}

/* The value of a combination for a scalarised objective, or beyond every value by its violation. */
static double value_of(const lm_search *search, int combination, const lm_scalarisation *scalar) {
  double value;
  return best_of_pool(search, combination, scalar, &value) != NULL
             ? value
             : LM_REFUSED * (1 + search->state[combination].violation);
}

/* The combination for the next start: each one half as often as the one that is ahead of it. */
static int choose_combination(lm_search *search, const lm_scalarisation *scalar) {
  const int ranked = lm_rank_screened(search);
  double least = HUGE_VAL;
  int chosen = search->order[0];
  int i;
  int k;
  for (i = 0; i < ranked; i++) {
    const int combination = search->order[i];
    const double value = value_of(search, combination, scalar);
    double turns = search->state[combination].solved + 1.0;
    for (k = 0; k < ranked && turns < least; k++) {
      turns *= value_of(search, search->order[k], scalar) < value ? 2 : 1;
    }
    if (turns < least) {
      least = turns;
      chosen = combination;
    }
  }
  return chosen;
}

void lm_add_solver_task(lm_search *search, int kind, const lm_solution front[], int count,
                        int budget) {
  lm_scalarisation scalar;
  int j;
  lm_scalarise_first(&scalar);
  if (search->archive_count > 0) {
    lm_scale_objectives(search, &scalar);
    for (j = 0; j < 2; j++) {
      scalar.weight[j] =
          exp(LOG_WEIGHT * (2 * lm_draw_number(search, search->next_id, 10 + j) - 1));
    }
  }
  if (search->scalarisations++ % 2 == 0 || count < 2) {
    const lm_solution *found;
    lm_combination_state *state;
    lm_task *task;
    double value;
    int combination;
    scalar.weight[1] = 0;
    combination = choose_combination(search, &scalar);
    state = &search->state[combination];
    found = best_of_pool(search, combination, &scalar, &value);
    task =
        lm_add_task(search, kind, combination, budget, found != NULL ? found->unit : state->unit);
    task->scalar = scalar;
    lm_disturb(search, task, lm_draw_number(search, task->id, 2));
    state->solved++;
  } else {
    const lm_solution *found = aim_at_step(search, front, count, &scalar);
    lm_add_task(search, kind, found->combination, budget, found->unit)->scalar = scalar;
  }
}

/* Without any feasible design yet: restarts until one is found. */
void lm_plan_front(lm_search *search) {
  const int charge = DIRECTION_SLOPES * lm_slope_charge(&search->problem);
  const int left = search->problem.evaluations - search->used;
  int directions = left / (3 * charge) / 3;
  int n;
  if (search->archive_count == 0) {
    lm_plan_restarts(search);
    return;
  }
  if (left < charge / 2) {
    return;
  }
  directions = directions < 2 ? 2 : directions > DIRECTIONS_MAX ? DIRECTIONS_MAX : directions;
  for (n = 0; n < directions; n++) {
    lm_scalarisation scalar;
    const lm_solution *start;
    const lm_solution *other;
    lm_task *task;
    if (n > 0 && (search->batch_count + 1) * charge > left) {
      return;
    }
    make_direction(search, &scalar);
    start = best_of_archive(search, &scalar);
    task = lm_add_task(search, (n + search->round) % 3 != 1 ? LM_TASK_SLSQP : LM_TASK_COBYLA,
                       start->combination, charge < left ? charge : left, start->unit);
    task->scalar = scalar;
    if (lm_draw_number(search, task->id, 6) < 0.1) {
      lm_disturb(search, task, 0.1);
    }
    /* always at the end of an axis: another combination may reach further */
    other = scalar.weight[0] == 0 || lm_draw_number(search, search->next_id, 7) < OTHER_SHARE
                ? best_other(search, &scalar, start->combination)
                : NULL;
    if (other != NULL && (search->batch_count + 1) * charge <= left) {
      task = lm_add_task(search, LM_TASK_SLSQP, other->combination, charge, other->unit);
      task->scalar = scalar;
    }
    if ((n + search->round) % 3 == 0 && (search->batch_count + 1) * charge <= left) {
      const int combination = pick_combination(search, search->next_id);
      task =
          lm_add_task(search, LM_TASK_SLSQP, combination, charge, search->state[combination].unit);
      task->scalar = scalar;
      lm_disturb(search, task, 0.1);
    }
  }
}
