#include "subproblem.h"

#include <math.h>
#include <string.h>

#include "lostmotion/checks.h"

/* Number of limits from which only those that are nearly active are in the subproblem. */
#define NEAR_GAP_ARCMIN 2.0

/* One run of SLSQP ends after about 15 gradients, unless a kink prevents this.
 */
#define SLSQP_EVALUATIONS 80

/* --- rows of the subproblem ------------------------------------------------------------------- */

#define ROW_OF_LIMIT LM_RESULT_MAX
#define ROW_OF_AIM (LM_RESULT_MAX + LM_BRANCH_MAX)

void lm_choose_rows(lm_task_state *s, int all) {
  const lm_problem *p = s->problem;
  int figure;
  int i;
  int j;
  s->row_count = 0;
  for (figure = 0; figure < LM_FIGURE_COUNT; figure++) {
    for (i = 0; i < s->layout.figure_count[figure] && p->bounds.figure_max[figure] > 0; i++) {
      s->row[s->row_count++] = ROW_OF_LIMIT + s->layout.figure_start[figure] + i;
    }
  }
  for (j = 0; j < p->objective_count; j++) {
    for (i = 0; i < s->layout.figure_count[p->objective[j]] && isfinite(s->scalar.most[j]); i++) {
      s->row[s->row_count++] = ROW_OF_AIM + s->layout.figure_start[p->objective[j]] + i;
    }
  }
  for (i = 0; i < LM_SINGLE_ROWS; i++) {
    /* -1 exactly: not limited */
    if (s->result[s->layout.single_start + i] != -1.0) {
      s->row[s->row_count++] = s->layout.single_start + i;
    }
  }
  for (i = 0; i < s->layout.gap_count; i++) {
    if (all || s->result[s->layout.gap_start + i] > -NEAR_GAP_ARCMIN) {
      s->row[s->row_count++] = s->layout.gap_start + i;
    }
  }
}

static int figure_at(const lm_layout *layout, int place) {
  int figure = 0;
  while (place >= layout->figure_start[figure] + layout->figure_count[figure]) {
    figure++;
  }
  return figure;
}

static int objective_at(const lm_task_state *s, int place) {
  const int figure = figure_at(&s->layout, place);
  int j = 0;
  while (s->problem->objective[j] != figure) {
    j++;
  }
  return j;
}

int lm_resolve_row(const lm_task_state *s, int row, lm_row_kind *kind) {
  kind->scale = 1;
  kind->shift = -LM_RESERVE;
  if (row >= ROW_OF_AIM) {
    const int j = objective_at(s, row - ROW_OF_AIM);
    kind->scale = s->scalar.scale[j];
    kind->shift += s->scalar.most[j] / s->scalar.scale[j];
    return row - ROW_OF_AIM;
  }
  if (row >= ROW_OF_LIMIT) {
    kind->scale = s->problem->bounds.figure_max[figure_at(&s->layout, row - ROW_OF_LIMIT)];
    kind->shift += 1;
    return row - ROW_OF_LIMIT;
  }
  return row;
}

int lm_limit_of_row(const lm_task_state *s, int row) {
  if (row >= ROW_OF_LIMIT) {
    return LM_LIMIT_FIGURE + figure_at(&s->layout, row - ROW_OF_LIMIT);
  }
  if (row >= s->layout.gap_start) {
    return LM_LIMIT_GAP;
  }
  return row - s->layout.single_start;
}

void lm_spread_unit(const lm_task_state *s, const double x[], double unit[]) {
  int k;
  memcpy(unit, s->fixed, sizeof s->fixed);
  for (k = 0; k < s->moving_count; k++) {
    unit[s->moving[k]] = lm_clip(x[k]);
  }
}

/* --- SLSQP on the epigraph -------------------------------------------------------------------- */

/* min t; t is the last variable. */
static double epigraph_objective(unsigned n, const double *x, double *gradient, void *data) {
  (void)data;
  if (gradient != NULL) {
    memset(gradient, 0, (size_t)n * sizeof gradient[0]);
    gradient[n - 1] = 1;
  }
  return x[n - 1];
}

static int branch_count(const lm_task_state *s) {
  int count = 0;
  int j;
  for (j = 0; j < s->problem->objective_count; j++) {
    if (s->scalar.weight[j] > 0) {
      count += s->layout.figure_count[s->problem->objective[j]];
    }
  }
  return count;
}

/* SLSQP moves along the gaps slightly beyond their limit, so for a long time none of its points is
 * feasible. A point whose largest violation is that of its gaps becomes feasible when they are
 * closed: a plain evaluation in addition to one with derivatives, made if a better value is
 * possible. The solver continues from its own point. Without a range that closes gaps the point is
 * unchanged and already evaluated. */
static void look_closed(lm_task_state *s) {
  const double value = s->value;
  const double violation = s->violation;
  double result[LM_RESULT_MAX];
  double at[LM_FREE_MAX];
  double unit[LM_FREE_MAX];
  if (!s->closes || s->violation <= 0 || lm_gap_row_of(&s->layout, s->result) < s->violation ||
      (s->answer->violation <= 0 && s->answer->value <= s->value)) {
    return;
  }
  memcpy(result, s->result, (size_t)s->layout.count * sizeof result[0]);
  memcpy(at, s->at, sizeof at);
  memcpy(unit, s->at, sizeof unit);
  (void)lm_close_gap(s->problem, &s->layout, s->combination, s->result, unit);
  (void)lm_evaluate_task_point(s, unit, 0);
  memcpy(s->result, result, (size_t)s->layout.count * sizeof result[0]);
  memcpy(s->at, at, sizeof at);
  s->known_slopes = 1;
  s->value = value;
  s->violation = violation;
}

/* Rows of the branches less t, then the chosen limits. */
static void epigraph_rows(unsigned m, double *rows, unsigned n, const double *x, double *gradient,
                          void *data) {
  lm_task_state *s = (lm_task_state *)data;
  const int ranges = s->problem->range_count;
  double unit[LM_FREE_MAX];
  unsigned next = 0;
  int i;
  int j;
  int k;
  lm_spread_unit(s, x, unit);
  if (gradient != NULL) {
    memset(gradient, 0, (size_t)m * n * sizeof gradient[0]);
  }
  if (!lm_evaluate_task_point(s, unit, gradient != NULL)) {
    for (next = 0; next < m; next++) {
      rows[next] = LM_REFUSED;
    }
    return;
  }
  if (gradient != NULL) {
    look_closed(s);
  }
  for (j = 0; j < s->problem->objective_count; j++) {
    const int figure = s->problem->objective[j];
    const double factor = s->scalar.weight[j] / s->scalar.scale[j];
    for (i = 0; i < s->layout.figure_count[figure] && s->scalar.weight[j] > 0; i++, next++) {
      const int place = s->layout.figure_start[figure] + i;
      rows[next] = factor * (s->result[place] - s->scalar.origin[j]) - x[n - 1];
      if (gradient != NULL) {
        for (k = 0; k < s->moving_count; k++) {
          gradient[next * n + (unsigned)k] = factor * s->slope[place * ranges + s->moving[k]];
        }
        gradient[next * n + n - 1] = -1;
      }
    }
  }
  for (i = 0; i < s->row_count; i++, next++) {
    lm_row_kind kind;
    const int place = lm_resolve_row(s, s->row[i], &kind);
    rows[next] = s->result[place] / kind.scale - kind.shift;
    if (gradient != NULL) {
      for (k = 0; k < s->moving_count; k++) {
        gradient[next * n + (unsigned)k] = s->slope[place * ranges + s->moving[k]] / kind.scale;
      }
    }
  }
}

/* A row without derivatives would make the subproblem infeasible. */
static void drop_constant_rows(lm_task_state *s) {
  int kept = 0;
  int i;
  for (i = 0; i < s->row_count; i++) {
    lm_row_kind kind;
    const int place = lm_resolve_row(s, s->row[i], &kind);
    int k = 0;
    while (k < s->moving_count && s->slope[place * s->problem->range_count + s->moving[k]] == 0) {
      k++;
    }
    if (k < s->moving_count) {
      s->row[kept++] = s->row[i];
    }
  }
  s->row_count = kept;
}

int lm_open_solver(lm_task_state *s, nlopt_algorithm algorithm, unsigned variables) {
  s->running = nlopt_create(algorithm, variables);
  s->out_of_memory = s->out_of_memory || s->running == NULL;
  return s->running != NULL;
}

void lm_run_solver(lm_task_state *s, nlopt_result prepared, double x[]) {
  double least;
  const nlopt_result result = prepared < 0 ? prepared : nlopt_optimize(s->running, x, &least);
  s->out_of_memory = s->out_of_memory || result == NLOPT_OUT_OF_MEMORY;
  nlopt_destroy(s->running);
  s->running = NULL;
}

/* Scale of the scalarised objective's value at the start: t of order 1. */
void lm_run_slsqp(lm_task_state *s, const double start[]) {
  const unsigned n = (unsigned)s->moving_count + 1;
  double low[LM_FREE_MAX + 1];
  double high[LM_FREE_MAX + 1];
  double x[LM_FREE_MAX + 1];
  double tolerance[LM_ROW_MAX];
  nlopt_result prepared;
  unsigned rows;
  unsigned i;
  memcpy(s->fixed, start, sizeof s->fixed);
  if (!lm_evaluate_task_point(s, start, 1)) {
    return;
  }
  lm_choose_rows(s, 0);
  drop_constant_rows(s);
  rows = (unsigned)(branch_count(s) + s->row_count);
  for (i = 0; i + 1 < n; i++) {
    low[i] = 0;
    high[i] = 1;
    x[i] = start[s->moving[i]];
  }
  low[n - 1] = -HUGE_VAL;
  high[n - 1] = HUGE_VAL;
  x[n - 1] = s->value;
  for (i = 0; i < rows; i++) {
    tolerance[i] = 1e-8;
  }
  if (!lm_open_solver(s, NLOPT_LD_SLSQP, n)) {
    return;
  }
  nlopt_set_lower_bounds(s->running, low);
  nlopt_set_upper_bounds(s->running, high);
  nlopt_set_min_objective(s->running, epigraph_objective, s);
  prepared = nlopt_add_inequality_mconstraint(s->running, rows, epigraph_rows, s, tolerance);
  nlopt_set_xtol_rel(s->running, 1e-7);
  nlopt_set_ftol_rel(s->running, 1e-7);
  nlopt_set_maxeval(s->running, SLSQP_EVALUATIONS);
  lm_run_solver(s, prepared, x);
}

/* --- methods without derivatives -------------------------------------------------------------- */

static double plain_objective(unsigned n, const double *x, double *gradient, void *data) {
  lm_task_state *s = (lm_task_state *)data;
  double unit[LM_FREE_MAX];
  (void)n;
  (void)gradient;
  lm_spread_unit(s, x, unit);
  (void)lm_evaluate_task_point(s, unit, 0);
  return s->value;
}

/* Groups of limits: geometry, strength and size, gaps, figures and bounds of the scalarised
 * objective. */
#define GROUPS 4

static void grouped_rows(unsigned m, double *rows, unsigned n, const double *x, double *gradient,
                         void *data) {
  lm_task_state *s = (lm_task_state *)data;
  double unit[LM_FREE_MAX];
  unsigned g;
  int i;
  (void)n;
  (void)gradient;
  lm_spread_unit(s, x, unit);
  if (!lm_evaluate_task_point(s, unit, 0)) {
    for (g = 0; g < m; g++) {
      rows[g] = LM_REFUSED;
    }
    return;
  }
  for (g = 0; g < m; g++) {
    rows[g] = -1;
  }
  lm_choose_rows(s, 1);
  for (i = 0; i < s->row_count; i++) {
    lm_row_kind kind;
    const int place = lm_resolve_row(s, s->row[i], &kind);
    const double row = s->result[place] / kind.scale - kind.shift;
    const int single = place - s->layout.single_start;
    if (s->row[i] >= ROW_OF_LIMIT) {
      g = 3;
    } else if (place >= s->layout.gap_start) {
      g = 2;
    } else {
      g = single < LM_LIMIT_BENDING_STRESS ? 0 : 1;
    }
    rows[g] = row > rows[g] ? row : rows[g];
  }
}

void lm_run_plain(lm_task_state *s, const double start[], nlopt_algorithm algorithm, double step,
                  uint64_t seed) {
  const unsigned n = (unsigned)s->moving_count;
  const double tolerance[GROUPS] = {1e-8, 1e-8, 1e-8, 1e-8};
  double x[LM_FREE_MAX];
  nlopt_result prepared;
  unsigned i;
  memcpy(s->fixed, start, sizeof s->fixed);
  for (i = 0; i < n; i++) {
    x[i] = start[s->moving[i]];
  }
  /* NLopt's generator belongs to the thread: each run restarts it. */
  nlopt_srand((unsigned long)(seed & 0xffffffffu));
  if (!lm_open_solver(s, algorithm, n)) {
    return;
  }
  nlopt_set_lower_bounds1(s->running, 0);
  nlopt_set_upper_bounds1(s->running, 1);
  nlopt_set_min_objective(s->running, plain_objective, s);
  prepared = nlopt_add_inequality_mconstraint(s->running, GROUPS, grouped_rows, s, tolerance);
  if (prepared > 0) {
    prepared = nlopt_set_initial_step1(s->running, step);
  }
  nlopt_set_population(s->running, 60);
  nlopt_set_xtol_rel(s->running, 1e-6);
  nlopt_set_maxeval(s->running, s->left > 1 ? s->left : 1);
  lm_run_solver(s, prepared, x);
}
