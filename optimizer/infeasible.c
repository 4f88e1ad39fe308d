/* Why there is no design: how far each limit must give. */
#include <string.h>

#include "solve.h"
#include "subproblem.h"

/* min sum of the slacks, one for each limit; they stand behind the moving variables. */
static double elastic_objective(unsigned n, const double *x, double *gradient, void *data) {
  const lm_solver *s = (const lm_solver *)data;
  double sum = 0;
  unsigned i;
  for (i = 0; i < n; i++) {
    const int slack = i >= (unsigned)s->moving_count;
    sum += slack ? x[i] : 0;
    if (gradient != NULL) {
      gradient[i] = slack ? 1 : 0;
    }
  }
  return sum;
}

static void elastic_rows(unsigned m, double *rows, unsigned n, const double *x, double *gradient,
                         void *data) {
  lm_solver *s = (lm_solver *)data;
  const int ranges = s->problem->range_count;
  double unit[LM_FREE_MAX];
  unsigned i;
  int k;
  lm_spread_unit(s, x, unit);
  if (gradient != NULL) {
    memset(gradient, 0, (size_t)m * n * sizeof gradient[0]);
  }
  if (!lm_evaluate_solver(s, unit, gradient != NULL)) {
    for (i = 0; i < m; i++) {
      rows[i] = LM_REFUSED;
    }
    return;
  }
  for (i = 0; i < m; i++) {
    lm_row_kind kind;
    const int place = lm_resolve_row(s, s->row[i], &kind);
    const unsigned slack = (unsigned)(s->moving_count + lm_limit_of_row(s, s->row[i]));
    rows[i] = s->result[place] / kind.scale - kind.shift - x[slack];
    if (gradient != NULL) {
      for (k = 0; k < s->moving_count; k++) {
        gradient[i * n + (unsigned)k] = s->slope[place * ranges + s->moving[k]] / kind.scale;
      }
      gradient[i * n + slack] = -1;
    }
  }
}

static void read_relaxation(lm_solver *s, double relax[]) {
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
static void shrink_slacks(lm_solver *s, double unit[], const double relax[]) {
  static const double far = 100; /* slacks are shares of a limit, modules or arcmin */
  const unsigned n = (unsigned)(s->moving_count + LM_LIMIT_COUNT);
  double low[LM_FREE_MAX + LM_LIMIT_COUNT] = {0};
  double high[LM_FREE_MAX + LM_LIMIT_COUNT];
  double x[LM_FREE_MAX + LM_LIMIT_COUNT];
  double tolerance[LM_ROW_MAX];
  double least;
  int i;
  for (i = 0; i < s->moving_count; i++) {
    x[i] = unit[i];
    high[i] = 1;
  }
  for (i = 0; i < LM_LIMIT_COUNT; i++) {
    x[s->moving_count + i] = relax[i];
    high[s->moving_count + i] = far + relax[i];
  }
  for (i = 0; i < s->row_count; i++) {
    tolerance[i] = 1e-8;
  }
  memcpy(s->fixed, unit, sizeof s->fixed);
  s->running = nlopt_create(NLOPT_LD_SLSQP, n);
  nlopt_set_lower_bounds(s->running, low);
  nlopt_set_upper_bounds(s->running, high);
  nlopt_set_min_objective(s->running, elastic_objective, s);
  nlopt_add_inequality_mconstraint(s->running, (unsigned)s->row_count, elastic_rows, s, tolerance);
  nlopt_set_xtol_rel(s->running, 1e-7);
  nlopt_set_maxeval(s->running, 200);
  (void)nlopt_optimize(s->running, x, &least);
  nlopt_destroy(s->running);
  s->running = NULL;
  lm_spread_unit(s, x, unit);
}

lm_status lm_explain_infeasible(const lm_problem *problem, int combination, double unit[],
                                int budget, double relax[], lm_workspace *workspace,
                                const volatile int *stop) {
  lm_answer answer;
  lm_aim aim;
  lm_solver s;
  if (problem == NULL || unit == NULL || relax == NULL || workspace == NULL) {
    return LM_NULL;
  }
  memset(&answer, 0, sizeof answer);
  lm_lead_aim(&aim);
  lm_open_solver(&s, problem, combination, budget, &aim, &answer, workspace, stop);
  if (!lm_evaluate_solver(&s, unit, 1)) {
    return s.interrupted ? LM_NOT_CONVERGED : LM_OUT_OF_RANGE;
  }
  read_relaxation(&s, relax);
  shrink_slacks(&s, unit, relax);
  if (lm_evaluate_solver(&s, unit, 0)) {
    read_relaxation(&s, relax);
  }
  return s.interrupted ? LM_NOT_CONVERGED : LM_OK;
}
