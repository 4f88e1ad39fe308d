#include "evolve.h"

#include <math.h>
#include <string.h>

#include "found.h"
#include "stop.h"

#define CROSSING_INDEX 15.0 /* Deb's simulated binary crossover and polynomial mutation */
#define MUTATION_INDEX 20.0
#define DIFFERENCE_SHARE 0.5 /* of the children; the others are crossed */
#define GRAFT_SHARE_MAX 0.5  /* of the children, where tolerances are weighed */
#define CHOICE_MUTATION 0.04

typedef struct breeder {
  const lm_problem *problem;
  lm_answer *answer;
  lm_workspace *workspace;
  const volatile int *stop;
  uint64_t state; /* of the generator */
  int left;
  int combinations;
  double graft_share;
  lm_scan scan;
  lm_layout layout;
  double result[LM_RESULT_MAX];
  lm_found population[2 * LM_PARENT_MAX];
  int count;
} breeder;

static double draw(breeder *b) {
  b->state += UINT64_C(0x9e3779b97f4a7c15);
  return (double)(lm_mix(b->state) >> 11) / 9007199254740992.0;
}

static int pick(breeder *b, int count) {
  return (int)(draw(b) * count);
}

/* Violation, or 1e3 where the model refuses. */
static double evaluate(breeder *b, int combination, const double unit[], double objective[]) {
  double violation;
  int j;
  b->answer->plain++;
  b->left--;
  if (lm_evaluate_point(b->problem, &b->scan, &b->layout, combination, unit, b->result,
                        b->workspace, NULL) != LM_OK) {
    b->answer->refused++;
    for (j = 0; j < b->problem->objective_count; j++) {
      objective[j] = 1e3;
    }
    return 1e3;
  }
  for (j = 0; j < b->problem->objective_count; j++) {
    objective[j] = lm_figure_of(&b->layout, b->result, b->problem->objective[j]);
  }
  violation = lm_violation_of(b->problem, &b->layout, b->result);
  b->answer->feasible += violation <= 0;
  return violation;
}

/* Whether a second look, with the gap closed, may bring a better design. Not where another limit is
 * broken further. Closing moves all flanks alike: it takes its own amount from the lost motion of
 * either direction and leaves the other figures, so where even that would be no better than a
 * member of the population it is not looked at. What interferes hides some of its lost motion:
 * hoped for is what it shows. */
static int may_gain(const breeder *b, const double objective[], double violation) {
  const lm_problem *p = b->problem;
  const double row = lm_gap_row_of(&b->layout, b->result);
  double hoped[LM_OBJECTIVE_MAX];
  int i;
  if (violation > 0 && row < violation) {
    return 0;
  }
  for (i = 0; i < p->objective_count; i++) {
    const int figure = p->objective[i];
    hoped[i] = objective[i];
    if (row < 0 && (figure == LM_FIGURE_LOST_MOTION || figure == LM_FIGURE_TOLERANCE_LOST_MOTION)) {
      hoped[i] += 2 * row;
    }
  }
  for (i = 0; i < b->count - 1; i++) {
    if (b->population[i].violation <= 0 && lm_is_as_good(p, b->population[i].objective, hoped)) {
      return 0;
    }
  }
  return 1;
}

/* Judge a point and, where that may gain, once more with its gap closed; the better of both joins
 * the population. */
static void admit(breeder *b, int combination, double unit[]) {
  lm_found *place = &b->population[b->count++];
  double objective[LM_OBJECTIVE_MAX] = {0};
  double violation = evaluate(b, combination, unit, objective);
  lm_fill_found(b->problem, place, combination, unit, objective, violation);
  if (violation <= 0) {
    lm_insert_found(b->problem, b->answer->found, &b->answer->found_count, LM_FOUND_MAX, place);
  }
  if (violation < 1e3 && b->left > 0 && may_gain(b, objective, violation) &&
      lm_close_gap(b->problem, &b->layout, combination, b->result, unit)) {
    lm_found closed;
    violation = evaluate(b, combination, unit, objective);
    lm_fill_found(b->problem, &closed, combination, unit, objective, violation);
    if (violation <= 0) {
      lm_insert_found(b->problem, b->answer->found, &b->answer->found_count, LM_FOUND_MAX, &closed);
    }
    if (violation <= 0 || violation < place->violation) {
      *place = closed;
    }
  }
}

/* A parent: the better of two drawn ones; the population is sorted best first. */
static const lm_found *choose_parent(breeder *b, int parents) {
  const int x = pick(b, parents);
  const int y = pick(b, parents);
  return &b->population[x < y ? x : y];
}

static int cross_combinations(breeder *b, int x, int y) {
  const lm_problem *p = b->problem;
  int combination = 0;
  int factor = 1;
  int i;
  for (i = 0; i < p->choice_count; i++) {
    const int count = p->choice[i].count;
    int digit = draw(b) < 0.5 ? x % count : y % count;
    if (draw(b) < CHOICE_MUTATION) {
      digit = pick(b, count);
    }
    combination += factor * digit;
    factor *= count;
    x /= count;
    y /= count;
  }
  return combination;
}

static void cross(breeder *b, const double x[], const double y[], double child[]) {
  int k;
  for (k = 0; k < b->problem->range_count; k++) {
    child[k] = x[k];
    if (draw(b) < 0.5) {
      const double u = draw(b);
      const double spread = u < 0.5 ? pow(2 * u, 1 / (CROSSING_INDEX + 1))
                                    : pow(1 / (2 * (1 - u)), 1 / (CROSSING_INDEX + 1));
      const double side = draw(b) < 0.5 ? spread : -spread;
      child[k] = lm_clip((x[k] + y[k] + side * (x[k] - y[k])) / 2);
    }
  }
}

/* Towards a better design and along the difference of two others. */
static void differ(breeder *b, const double x[], const double better[], const double p[],
                   const double q[], double child[]) {
  const double width = 0.3 + 0.6 * draw(b);
  const double towards = draw(b) * 0.5;
  int k;
  for (k = 0; k < b->problem->range_count; k++) {
    child[k] = x[k];
    if (draw(b) < 0.9) {
      child[k] = lm_clip(x[k] + towards * (better[k] - x[k]) + width * (p[k] - q[k]));
    }
  }
}

static int is_grade(const lm_problem *problem, int range) {
  return problem->range[range].key >= LM_KEY_GRADE;
}

/* Of the children, those that get other tolerances alone: none unless there are several, which cost
 * and so are weighed against each other. Half of them where every fourth variable is a tolerance;
 * the more of the others there are, the more is left to them. */
static double graft_share(const lm_problem *problem) {
  int costs = problem->bounds.figure_max[LM_FIGURE_COST] > 0;
  int grades = 0;
  int i;
  for (i = 0; i < problem->objective_count; i++) {
    costs = costs || problem->objective[i] == LM_FIGURE_COST;
  }
  for (i = 0; i < problem->range_count; i++) {
    grades += is_grade(problem, i);
  }
  return costs && grades > 1 ? fmin(GRAFT_SHARE_MAX, 2.0 * grades / problem->range_count) : 0;
}

/* The teeth of one design with tolerances on the line through two others: which tolerances are
 * worth their cost hangs little on the teeth. */
static void graft(breeder *b, const double teeth[], const double p[], const double q[],
                  double child[]) {
  const double share = 1.5 * draw(b) - 0.25;
  int k;
  for (k = 0; k < b->problem->range_count; k++) {
    child[k] = is_grade(b->problem, k) ? lm_clip(p[k] + share * (q[k] - p[k])) : teeth[k];
  }
}

static void mutate(breeder *b, double child[]) {
  int k;
  for (k = 0; k < b->problem->range_count; k++) {
    if (draw(b) * b->problem->range_count < 1) {
      const double u = draw(b);
      const double step = u < 0.5 ? pow(2 * u, 1 / (MUTATION_INDEX + 1)) - 1
                                  : 1 - pow(2 * (1 - u), 1 / (MUTATION_INDEX + 1));
      child[k] = lm_clip(child[k] + step);
    }
  }
}

static void breed(breeder *b, int parents) {
  while (b->count < 2 * parents && b->left > 0 && !lm_is_stopped(b->stop)) {
    const lm_found *x = choose_parent(b, parents);
    const lm_found *y = choose_parent(b, parents);
    double child[LM_FREE_MAX] = {0};
    int combination;
    if (draw(b) < b->graft_share) {
      const lm_found *p = &b->population[pick(b, parents)];
      graft(b, x->unit, y->unit, p->unit, child);
      admit(b, cross_combinations(b, x->combination, x->combination), child);
      continue;
    }
    if (draw(b) < DIFFERENCE_SHARE) {
      const lm_found *p = &b->population[pick(b, parents)];
      const lm_found *q = &b->population[pick(b, parents)];
      differ(b, x->unit, y->unit, p->unit, q->unit, child);
      combination = cross_combinations(b, x->combination, x->combination);
    } else {
      cross(b, x->unit, y->unit, child);
      combination = cross_combinations(b, x->combination, y->combination);
    }
    mutate(b, child);
    admit(b, combination, child);
  }
}

lm_status lm_evolve(const lm_problem *problem, const lm_task *task, lm_answer *answer,
                    lm_workspace *workspace, const volatile int *stop) {
  breeder own;
  breeder *b = &own;
  int size;
  int i;
  memset(b, 0, sizeof *b);
  b->problem = problem;
  b->answer = answer;
  b->workspace = workspace;
  b->stop = stop;
  b->state = task->seed;
  b->left = task->budget;
  b->graft_share = graft_share(problem);
  b->combinations = lm_count_combinations(problem);
  lm_default_scan(&b->scan);
  lm_lay_out(problem, &b->scan, &b->layout);
  b->count = task->parent_count;
  memcpy(b->population, task->parent, (size_t)task->parent_count * sizeof b->population[0]);
  while (b->count < LM_PARENT_MAX && b->left > 0 && !lm_is_stopped(stop)) {
    double unit[LM_FREE_MAX] = {0};
    for (i = 0; i < problem->range_count; i++) {
      unit[i] = draw(b);
    }
    admit(b, pick(b, b->combinations), unit);
  }
  size = b->count < LM_PARENT_MAX ? b->count : LM_PARENT_MAX;
  lm_select_found(problem, b->population, b->count, size);
  while (b->left > 0 && !lm_is_stopped(stop)) {
    b->count = size;
    breed(b, size);
    lm_select_found(problem, b->population, b->count, size);
  }
  answer->member_count = size;
  memcpy(answer->found + answer->found_count, b->population,
         (size_t)size * sizeof b->population[0]);
  return lm_is_stopped(stop) ? LM_NOT_CONVERGED : LM_OK;
}
