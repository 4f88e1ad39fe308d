/* Why there is no design: the required relaxation of each limit. */
#include "infeasible.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "certificate.h"
#include "run_task.h"
#include "subproblem.h"
#include "verify.h"

/* Weight per module, arcmin or share of a limit that follows from the drive itself. No key of a
 * spec states such a limit, so it is relaxed only if the others do not suffice. */
#define PHYSICAL_WEIGHT 10.0

static double weight_of(int limit) {
  return lm_is_set_by_spec(limit) ? 1.0 : PHYSICAL_WEIGHT;
}

/* Cost of all relaxations: a small decrease of a figure that is many times its limit counts
 * little. */
static double cost_of(const double relax[]) {
  double sum = 0;
  int i;
  for (i = 0; i < LM_LIMIT_COUNT; i++) {
    sum += weight_of(i) * log1p(relax[i]);
  }
  return sum;
}

/* One slack for each limit, after the moving variables, in units of the relaxation at the start if
 * that is more than 1; and the sum of their costs, linearised at the start, in units of its value
 * there. SLSQP requires numbers of order 1. */
typedef struct elastic {
  lm_task_state *s;
  double size[LM_LIMIT_COUNT];
  double cost[LM_LIMIT_COUNT]; /* of one such unit */
} elastic;

static double elastic_objective(unsigned n, const double *x, double *gradient, void *data) {
  const elastic *e = (const elastic *)data;
  double sum = 0;
  unsigned i;
  for (i = 0; i < n; i++) {
    const int limit = (int)i - e->s->moving_count;
    const double cost = limit >= 0 ? e->cost[limit] : 0;
    sum += cost * x[i];
    if (gradient != NULL) {
      gradient[i] = cost;
    }
  }
  return sum;
}

static void elastic_rows(unsigned m, double *rows, unsigned n, const double *x, double *gradient,
                         void *data) {
  const elastic *e = (const elastic *)data;
  lm_task_state *s = e->s;
  const int ranges = s->problem->range_count;
  double unit[LM_FREE_MAX];
  unsigned i;
  int k;
  lm_spread_unit(s, x, unit);
  if (gradient != NULL) {
    memset(gradient, 0, (size_t)m * n * sizeof gradient[0]);
  }
  if (!lm_evaluate_task_point(s, unit, gradient != NULL)) {
    for (i = 0; i < m; i++) {
      rows[i] = LM_REFUSED;
    }
    return;
  }
  for (i = 0; i < m; i++) {
    lm_row_kind kind;
    const int place = lm_resolve_row(s, s->row[i], &kind);
    const int limit = lm_limit_of_row(s, s->row[i]);
    const unsigned slack = (unsigned)(s->moving_count + limit);
    const double size = e->size[limit];
    rows[i] = (s->result[place] / kind.scale - kind.shift) / size - x[slack];
    if (gradient != NULL) {
      for (k = 0; k < s->moving_count; k++) {
        gradient[i * n + (unsigned)k] =
            s->slope[place * ranges + s->moving[k]] / (kind.scale * size);
      }
      gradient[i * n + slack] = -1;
    }
  }
}

static void read_relaxation(lm_task_state *s, double relax[]) {
  int i;
  for (i = 0; i < LM_LIMIT_COUNT; i++) {
    relax[i] = 0;
  }
  lm_choose_rows(s, 1);
  for (i = 0; i < s->row_count; i++) {
    lm_row_kind kind;
    const int place = lm_resolve_row(s, s->row[i], &kind);
    const double row = s->result[place] / kind.scale - kind.shift;
    const int limit = lm_limit_of_row(s, s->row[i]);
    relax[limit] = row > relax[limit] ? row : relax[limit];
  }
}

/* From relax[] at the point of the last evaluation to the least sum. */
static void shrink_slacks(lm_task_state *s, double unit[], const double relax[]) {
  static const double far = 100;
  const unsigned n = (unsigned)(s->moving_count + LM_LIMIT_COUNT);
  double low[LM_FREE_MAX + LM_LIMIT_COUNT] = {0};
  double high[LM_FREE_MAX + LM_LIMIT_COUNT];
  double x[LM_FREE_MAX + LM_LIMIT_COUNT];
  double tolerance[LM_ROW_MAX];
  elastic e;
  nlopt_result prepared;
  double whole = 0;
  int i;
  e.s = s;
  for (i = 0; i < s->moving_count; i++) {
    x[i] = unit[s->moving[i]];
    high[i] = 1;
  }
  for (i = 0; i < LM_LIMIT_COUNT; i++) {
    e.size[i] = relax[i] > 1 ? relax[i] : 1;
    e.cost[i] = weight_of(i) * e.size[i] / (1 + relax[i]);
    x[s->moving_count + i] = relax[i] / e.size[i];
    high[s->moving_count + i] = far;
    whole += e.cost[i] * x[s->moving_count + i];
  }
  if (!(whole > 0)) {
    return;
  }
  for (i = 0; i < LM_LIMIT_COUNT; i++) {
    e.cost[i] /= whole;
  }
  for (i = 0; i < s->row_count; i++) {
    tolerance[i] = 1e-8;
  }
  memcpy(s->fixed, unit, sizeof s->fixed);
  if (!lm_open_solver(s, NLOPT_LD_SLSQP, n)) {
    return;
  }
  nlopt_set_lower_bounds(s->running, low);
  nlopt_set_upper_bounds(s->running, high);
  nlopt_set_min_objective(s->running, elastic_objective, &e);
  prepared = nlopt_add_inequality_mconstraint(s->running, (unsigned)s->row_count, elastic_rows, &e,
                                              tolerance);
  nlopt_set_xtol_rel(s->running, 1e-7);
  nlopt_set_maxeval(s->running, 200);
  lm_run_solver(s, prepared, x);
  lm_spread_unit(s, x, unit);
}

/* To the point with the least relaxation, and the relaxations there; 0 if the model refuses the
 * start. */
static int give_least(lm_task_state *s, double unit[], double relax[]) {
  double start[LM_FREE_MAX];
  memcpy(start, unit, sizeof start);
  if (!lm_evaluate_task_point(s, unit, 1)) {
    return 0;
  }
  read_relaxation(s, relax);
  shrink_slacks(s, unit, relax);
  if (lm_evaluate_task_point(s, unit, 0)) {
    read_relaxation(s, relax);
  } else {
    memcpy(unit, start, sizeof start);
  }
  return 1;
}

/* The same with whole grades: the nearest ones, with the other variables optimised again. */
static int give_least_whole(lm_task_state *s, double unit[], double relax[]) {
  int moving = 0;
  int k;
  if (!give_least(s, unit, relax)) {
    return 0;
  }
  if (s->answer->solution_count > 0 || lm_has_whole_grades(s->problem, unit)) {
    return 1;
  }
  for (k = 0; k < s->problem->range_count; k++) {
    const lm_range *range = &s->problem->range[k];
    if (range->whole) {
      const double wide = range->high - range->low;
      const double nearest = round(range->low + wide * unit[k]);
      const double whole = fmin(fmax(nearest, ceil(range->low)), floor(range->high));
      unit[k] = (whole - range->low) / wide;
    } else {
      s->moving[moving++] = k;
    }
  }
  s->moving_count = moving;
  return give_least(s, unit, relax);
}

void lm_repair(lm_task_state *s, const lm_task *task) {
  double relax[LM_LIMIT_COUNT];
  double unit[LM_FREE_MAX];
  int i;
  memcpy(unit, task->unit, sizeof unit);
  if (!give_least_whole(s, unit, relax)) {
    return;
  }
  if (s->answer->solution_count > 0) {
    memcpy(unit, s->answer->unit, sizeof unit);
    s->closes = 1;
    lm_run_slsqp(s, unit);
    return;
  }
  memcpy(s->answer->unit, unit, sizeof unit);
  s->answer->value = cost_of(relax);
  s->answer->violation = 0;
  for (i = 0; i < LM_LIMIT_COUNT; i++) {
    s->answer->violation = fmax(relax[i], s->answer->violation);
  }
}

/* Between the angles and phases of the search a larger relaxation may be required. If the design
 * cannot be certified, relax[] is unchanged. LM_TOO_SMALL: no memory. */
static lm_status relax_to_certificate(const lm_problem *problem, int combination,
                                      const double unit[], double relax[],
                                      lm_workspace *workspace) {
  lm_certificate *fine = (lm_certificate *)malloc(sizeof *fine);
  const lm_status status =
      fine == NULL ? LM_TOO_SMALL : lm_certify(problem, combination, unit, fine, workspace, NULL);
  int i;
  for (i = 0; status == LM_OK && i < LM_LIMIT_COUNT; i++) {
    const double more = LM_RESERVE - fine->limit[i].margin;
    relax[i] = fine->limit[i].stated && more > relax[i] ? more : relax[i];
  }
  free(fine);
  return status == LM_TOO_SMALL ? status : LM_OK;
}

lm_status lm_explain_infeasible(const lm_problem *problem, int combination, double unit[],
                                int budget, double relax[], lm_workspace *workspace,
                                const volatile int *stop) {
  lm_answer answer;
  lm_scalarisation scalar;
  lm_task_state s;
  int found;
  if (problem == NULL || unit == NULL || relax == NULL || workspace == NULL) {
    return LM_NULL;
  }
  memset(&answer, 0, sizeof answer);
  lm_scalarise_first(&scalar);
  lm_open_task_state(&s, problem, combination, budget, &scalar, &answer, workspace, stop);
  found = give_least_whole(&s, unit, relax);
  if (s.out_of_memory) {
    return LM_TOO_SMALL;
  }
  if (!found) {
    return s.interrupted ? LM_NOT_CONVERGED : LM_OUT_OF_RANGE;
  }
  if (s.interrupted) {
    return LM_NOT_CONVERGED;
  }
  return relax_to_certificate(problem, combination, unit, relax, workspace);
}
