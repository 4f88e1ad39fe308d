#include "evolve.h"

#include <math.h>
#include <string.h>

#include "archive.h"
#include "stop.h"

#define CROSSING_INDEX 15.0 /* Deb's simulated binary crossover and polynomial mutation */
#define MUTATION_INDEX 20.0
#define DIFFERENCE_SHARE 0.5 /* of the children; the others are crossed */
#define GRAFT_SHARE_MAX 0.5  /* of the children, if tolerances are varied at full cost */
#define LOOKS 8              /* at other tolerances of a design that no reported one dominates */
#define LOOKS_BEATEN 2       /* ... and of a dominated one */
#define LOOKS_KEPT 2         /* of one design, that join the population */
#define LINE_SHARE 0.8       /* of these evaluations, on lines through others' tolerances */
#define CHOICE_MUTATION 0.04

typedef struct breeder {
  const lm_problem *problem;
  lm_answer *answer;
  lm_workspace *workspace;
  const volatile int *stop;
  uint64_t state; /* of the random generator */
  int left;
  int combinations;
  double graft_share;
  int tolerance_only; /* whether tolerances are examined separately */
  int parents;        /* of the present generation; they are first */
  lm_scan scan;
  lm_layout layout;
  double result[LM_RESULT_MAX];
  lm_solution population[(2 + LOOKS_KEPT) * LM_PARENT_MAX];
  int count;
} breeder;

static double draw(breeder *b) {
  b->state += UINT64_C(0x9e3779b97f4a7c15);
  return (double)(lm_mix(b->state) >> 11) / 9007199254740992.0;
}

static int pick(breeder *b, int count) {
  return (int)(draw(b) * count);
}

/* Make a design of a point, its result[] and its violation; 1 if it is reported: it violates no
 * limit, and no reported design is as good. */
static int read_result(breeder *b, int combination, const double unit[], double violation,
                       lm_solution *found) {
  const lm_problem *p = b->problem;
  double objective[LM_OBJECTIVE_MAX] = {0};
  int j;
  for (j = 0; j < p->objective_count; j++) {
    objective[j] = lm_figure_of(&b->layout, b->result, p->objective[j]);
  }
  lm_fill_solution(p, found, combination, unit, objective, violation);
  return found->violation <= 0 &&
         lm_insert_solution(p, b->answer->solution, &b->answer->solution_count, LM_SOLUTION_MAX,
                            found);
}

/* Evaluate a point; 1 if it is reported. A point that the model refuses is dominated by all. */
static int evaluate(breeder *b, int combination, const double unit[], lm_solution *found) {
  static const double refused[LM_OBJECTIVE_MAX] = {LM_REFUSED, LM_REFUSED, LM_REFUSED, LM_REFUSED};
  int reported;
  b->answer->plain++;
  b->left--;
  if (lm_evaluate_point(b->problem, &b->scan, &b->layout, combination, unit, b->result,
                        b->workspace, NULL) != LM_OK) {
    lm_fill_solution(b->problem, found, combination, unit, refused, LM_REFUSED);
    b->answer->refused++;
    return 0;
  }
  reported =
      read_result(b, combination, unit, lm_violation_of(b->problem, &b->layout, b->result), found);
  b->answer->feasible += found->violation <= 0;
  return reported;
}

static int is_grade(const lm_problem *problem, int range) {
  return problem->range[range].key >= LM_KEY_GRADE;
}

/* Tolerances on the line through those of two designs. */
static void draw_line(breeder *b, const double p[], const double q[], double child[]) {
  const double share = 1.5 * draw(b) - 0.25;
  int k;
  for (k = 0; k < b->problem->range_count; k++) {
    if (is_grade(b->problem, k)) {
      child[k] = lm_clip(p[k] + share * (q[k] - p[k]));
    }
  }
}

/* The teeth of a feasible design with other tolerances, such as those of other designs: the best
 * tolerances depend little on the teeth, and contacts need not be computed again. */
static void look_around(breeder *b, const lm_solution *design, int tolerance_only) {
  int kept = 0;
  int i;
  for (i = 0; i < tolerance_only && b->left > 0; i++) {
    double unit[LM_FREE_MAX];
    lm_solution found;
    int k;
    memcpy(unit, design->unit, sizeof unit);
    if (b->parents > 0 && draw(b) < LINE_SHARE) {
      const lm_solution *p = &b->population[pick(b, b->parents)];
      const lm_solution *q = &b->population[pick(b, b->parents)];
      draw_line(b, p->unit, q->unit, unit);
    } else {
      for (k = 0; k < b->problem->range_count; k++) {
        unit[k] = is_grade(b->problem, k) ? draw(b) : unit[k];
      }
    }
    b->left -= b->answer->tolerance_only % LM_LOOKS_CHARGED == 0;
    b->answer->tolerance_only++;
    if (lm_evaluate_tolerances(b->problem, &b->layout, design->combination, unit, b->result,
                               b->workspace, NULL) != LM_OK) {
      return;
    }
    if (read_result(b, design->combination, unit,
                    lm_tolerance_violation_of(b->problem, &b->layout, b->result), &found) &&
        kept < LOOKS_KEPT) {
      b->population[b->count++] = found;
      kept++;
    }
  }
}

/* Whether a second evaluation, with the gap closed, may give a better design. Not if the violation
 * of another limit is larger. Closing moves all flanks equally: it reduces the lost motion in
 * either direction by its own amount and does not change the other figures, so it is not examined
 * if even that would be no better than a member of the population. With interference a part of the
 * lost motion is hidden: the estimate uses the visible part. */
static int may_gain(const breeder *b, const lm_solution *design) {
  const lm_problem *p = b->problem;
  const double row = lm_gap_row_of(&b->layout, b->result);
  double hoped[LM_OBJECTIVE_MAX];
  int i;
  if (design->violation > 0 && row < design->violation) {
    return 0;
  }
  for (i = 0; i < p->objective_count; i++) {
    const int figure = p->objective[i];
    hoped[i] = design->objective[i];
    if (row < 0 && (figure == LM_FIGURE_LOST_MOTION || figure == LM_FIGURE_TOLERANCE_LOST_MOTION)) {
      hoped[i] += 2 * row;
    }
  }
  for (i = 0; i < b->count; i++) {
    if (b->population[i].violation <= 0 && lm_is_as_good(p, b->population[i].objective, hoped)) {
      return 0;
    }
  }
  return 1;
}

/* Evaluate a point and, if that may gain, again with its gap closed; the better of both joins the
 * population, and the last evaluated one is examined with other tolerances. */
static void admit(breeder *b, int combination, double unit[]) {
  lm_solution last;
  lm_solution better;
  int reported = evaluate(b, combination, unit, &last);
  better = last;
  if (last.violation < LM_REFUSED && b->left > 0 && may_gain(b, &last) &&
      lm_close_gap(b->problem, &b->layout, combination, b->result, unit)) {
    reported = evaluate(b, combination, unit, &last);
    if (last.violation <= 0 || last.violation < better.violation) {
      better = last;
    }
  }
  b->population[b->count++] = better;
  if (b->tolerance_only && last.violation <= 0) {
    look_around(b, &last, reported ? LOOKS : LOOKS_BEATEN);
  }
}

/* A parent: the better of two drawn ones; the population is sorted best first. */
static const lm_solution *choose_parent(breeder *b, int parents) {
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

/* If tolerances are not cheaper to evaluate: share of the children that get only other tolerances.
 * None unless there are several tolerances; half of the children if every fourth variable is a
 * tolerance, fewer with more other variables. */
static double graft_share(const lm_problem *problem, int grades) {
  return grades > 1 ? fmin(GRAFT_SHARE_MAX, 2.0 * grades / problem->range_count) : 0;
}

/* Treatment of tolerances that have a cost; without a cost they are not varied separately. */
static void choose_grafts(breeder *b) {
  const lm_problem *p = b->problem;
  int costs = p->bounds.figure_max[LM_FIGURE_COST] > 0;
  int grades = 0;
  int i;
  for (i = 0; i < p->objective_count; i++) {
    costs = costs || p->objective[i] == LM_FIGURE_COST;
  }
  for (i = 0; i < p->range_count; i++) {
    grades += is_grade(p, i);
  }
  if (costs && grades > 0 && lm_has_cheap_tolerances(p)) {
    b->tolerance_only = 1;
  } else if (costs) {
    b->graft_share = graft_share(p, grades);
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
  int i;
  for (i = 0; i < parents && b->left > 0 && !lm_is_stopped(b->stop); i++) {
    const lm_solution *x = choose_parent(b, parents);
    const lm_solution *y = choose_parent(b, parents);
    double child[LM_FREE_MAX] = {0};
    int combination;
    if (draw(b) < b->graft_share) {
      const lm_solution *p = &b->population[pick(b, parents)];
      memcpy(child, x->unit, sizeof child);
      draw_line(b, y->unit, p->unit, child);
      admit(b, cross_combinations(b, x->combination, x->combination), child);
      continue;
    }
    if (draw(b) < DIFFERENCE_SHARE) {
      const lm_solution *p = &b->population[pick(b, parents)];
      const lm_solution *q = &b->population[pick(b, parents)];
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
  choose_grafts(b);
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
  lm_select_solutions(problem, b->population, b->count, size);
  while (b->left > 0 && !lm_is_stopped(stop)) {
    b->count = size;
    b->parents = size;
    breed(b, size);
    lm_select_solutions(problem, b->population, b->count, size);
  }
  answer->member_count = size;
  memcpy(answer->solution + answer->solution_count, b->population,
         (size_t)size * sizeof b->population[0]);
  return lm_is_stopped(stop) ? LM_NOT_CONVERGED : LM_OK;
}
