#include "solve.h"

#include <math.h>
#include <nlopt.h>
#include <stdlib.h>
#include <string.h>

#include "evolve.h"
#include "found.h"
#include "lostmotion/checks.h"
#include "workspace.h"

/* Limits beyond this many are left out of the subproblem unless they come near. */
#define NEAR_GAP_ARCMIN 2.0
#define ROW_MAX (LM_RESULT_MAX + LM_BRANCH_MAX)

/* Value and violation of a point that the model refuses. */
#define REFUSED 1e3

/* Where the settling looks for angles that its scan lacks: steps a pitch, nodes of the line. */
#define STEPS 8
#define NODES 64

/* One run of SLSQP ends after about 15 gradients; where it does not, a kink keeps it from ending.
 */
#define SLSQP_EVALUATIONS 80

/* Everything one task works on. */
typedef struct solver {
  const lm_problem *problem;
  const volatile int *stop;
  lm_workspace *workspace;
  lm_answer *answer;
  lm_aim aim;
  lm_scan scan;
  lm_layout layout;
  int combination;
  int left; /* budget */
  int interrupted;
  nlopt_opt running;
  /* variables that the solver may move, as indices of ranges */
  int moving[LM_FREE_MAX];
  int moving_count;
  double fixed[LM_FREE_MAX]; /* the others' values */
  /* rows of the subproblem */
  int row[ROW_MAX];
  int row_count;
  /* the last point evaluated */
  int known;
  int known_slopes;
  double at[LM_FREE_MAX];
  double *result; /* LM_RESULT_MAX */
  double *slope;  /* LM_RESULT_MAX * LM_FREE_MAX, by range */
  double value;
  double violation;
} solver;

void lm_lead_aim(lm_aim *aim) {
  int j;
  for (j = 0; j < LM_OBJECTIVE_MAX; j++) {
    aim->weight[j] = j == 0 ? 1 : 0;
    aim->origin[j] = 0;
    aim->scale[j] = 1;
    aim->most[j] = HUGE_VAL;
  }
}

int lm_charge_of(const lm_problem *problem, const lm_answer *answer) {
  return answer->plain + answer->slopes * lm_slope_charge(problem);
}

double lm_aim_value(const lm_problem *problem, const lm_aim *aim, const double objective[]) {
  double largest = -HUGE_VAL;
  int j;
  for (j = 0; j < problem->objective_count; j++) {
    if (aim->weight[j] > 0) {
      const double value = aim->weight[j] * (objective[j] - aim->origin[j]) / aim->scale[j];
      largest = value > largest ? value : largest;
    }
  }
  return largest;
}

/* --- evaluation with a memory of the last point -------------------------------------------------
 */

static void read_objectives(const solver *s, double objective[]) {
  int j;
  for (j = 0; j < s->problem->objective_count; j++) {
    objective[j] = lm_figure_of(&s->layout, s->result, s->problem->objective[j]);
  }
}

/* Bounds of the aim count as limits. */
static double with_aim(const solver *s, const double objective[], double violation) {
  double largest = violation;
  int j;
  for (j = 0; j < s->problem->objective_count; j++) {
    const double over = (objective[j] - s->aim.most[j]) / s->aim.scale[j];
    largest = over > largest ? over : largest;
  }
  return largest;
}

static void keep_found(solver *s, const double unit[], const double objective[], int settled) {
  lm_found found;
  lm_fill_found(s->problem, &found, s->combination, unit, objective, s->violation);
  found.settled = settled;
  lm_insert_found(s->problem, s->answer->found, &s->answer->found_count, LM_FOUND_MAX, &found);
}

/* Feasible before infeasible, then the smaller value (violation). */
static int is_better(double value, double violation, double than_value, double than_violation) {
  if (violation <= LM_FEASIBLE && than_violation <= LM_FEASIBLE) {
    return value < than_value;
  }
  return violation < than_violation;
}

static void keep_best(solver *s, const double unit[]) {
  lm_answer *a = s->answer;
  int figure;
  if (a->computed && !is_better(s->value, s->violation, a->value, a->violation)) {
    return;
  }
  a->computed = 1;
  a->value = s->value;
  a->violation = s->violation;
  memcpy(a->unit, unit, (size_t)s->problem->range_count * sizeof unit[0]);
  for (figure = 0; figure < LM_FIGURE_COUNT; figure++) {
    a->figure[figure] = lm_figure_of(&s->layout, s->result, figure);
  }
}

/* Evaluate at a point unless it was the last one; 0 when the model refuses it. */
static int evaluate(solver *s, const double unit[], int slopes) {
  const size_t size = (size_t)s->problem->range_count * sizeof unit[0];
  double objective[LM_OBJECTIVE_MAX] = {0};
  double broken;
  lm_status status;
  if (s->known && memcmp(unit, s->at, size) == 0 && (s->known_slopes || !slopes)) {
    return s->violation < REFUSED;
  }
  if (LM_READ_FLAG(s->stop)) {
    s->interrupted = 1;
  }
  if ((s->interrupted || s->left <= 0) && s->running != NULL) {
    nlopt_force_stop(s->running);
  }
  s->left -= slopes ? lm_slope_charge(s->problem) : 1;
  memcpy(s->at, unit, size);
  s->known = 1;
  s->known_slopes = slopes;
  if (slopes) {
    s->answer->slopes++;
    status = lm_evaluate_slopes(s->problem, &s->scan, &s->layout, s->combination, unit, s->result,
                                s->slope, s->workspace, NULL);
  } else {
    s->answer->plain++;
    status = lm_evaluate_point(s->problem, &s->scan, &s->layout, s->combination, unit, s->result,
                               s->workspace, NULL);
  }
  if (status != LM_OK) {
    s->answer->refused++;
    s->value = REFUSED;
    s->violation = REFUSED;
    return 0;
  }
  read_objectives(s, objective);
  s->value = lm_aim_value(s->problem, &s->aim, objective);
  broken = lm_violation_of(s->problem, &s->layout, s->result);
  s->violation = with_aim(s, objective, broken);
  if (broken <= LM_FEASIBLE) {
    s->answer->feasible++;
    keep_found(s, unit, objective, 0);
  }
  keep_best(s, unit);
  return 1;
}

/* --- rows of the subproblem ---------------------------------------------------------------------
 */

/* A row is a place in the result; LM_RESULT_MAX + place: a branch of a figure against its limit or
 * the bound of the aim; the value and its derivatives by the ranges. */
typedef struct row_kind {
  double scale; /* row = result / scale - shift */
  double shift;
} row_kind;

#define ROW_OF_LIMIT LM_RESULT_MAX
#define ROW_OF_AIM (LM_RESULT_MAX + LM_BRANCH_MAX)

/* Limits on figures and bounds of the aim; then single rows; then the gaps that are near. */
static void choose_rows(solver *s, int all) {
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
    for (i = 0; i < s->layout.figure_count[p->objective[j]] && isfinite(s->aim.most[j]); i++) {
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

static int objective_at(const solver *s, int place) {
  const int figure = figure_at(&s->layout, place);
  int j = 0;
  while (s->problem->objective[j] != figure) {
    j++;
  }
  return j;
}

/* Place in the result, and scale and shift of a row. */
static int resolve_row(const solver *s, int row, row_kind *kind) {
  kind->scale = 1;
  kind->shift = 0;
  if (row >= ROW_OF_AIM) {
    const int j = objective_at(s, row - ROW_OF_AIM);
    kind->scale = s->aim.scale[j];
    kind->shift = s->aim.most[j] / s->aim.scale[j];
    return row - ROW_OF_AIM;
  }
  if (row >= ROW_OF_LIMIT) {
    kind->scale = s->problem->bounds.figure_max[figure_at(&s->layout, row - ROW_OF_LIMIT)];
    kind->shift = 1;
    return row - ROW_OF_LIMIT;
  }
  return row;
}

static void spread_unit(const solver *s, const double x[], double unit[]) {
  int k;
  memcpy(unit, s->fixed, sizeof s->fixed);
  for (k = 0; k < s->moving_count; k++) {
    unit[s->moving[k]] = x[k] < 0.0 ? 0.0 : x[k] > 1.0 ? 1.0 : x[k];
  }
}

/* --- SLSQP on the epigraph ----------------------------------------------------------------------
 */

/* min t; t is the last variable. */
static double epigraph_objective(unsigned n, const double *x, double *gradient, void *data) {
  (void)data;
  if (gradient != NULL) {
    memset(gradient, 0, (size_t)n * sizeof gradient[0]);
    gradient[n - 1] = 1;
  }
  return x[n - 1];
}

static int branch_count(const solver *s) {
  int count = 0;
  int j;
  for (j = 0; j < s->problem->objective_count; j++) {
    if (s->aim.weight[j] > 0) {
      count += s->layout.figure_count[s->problem->objective[j]];
    }
  }
  return count;
}

/* Rows of the branches less t, then the chosen limits. */
static void epigraph_rows(unsigned m, double *rows, unsigned n, const double *x, double *gradient,
                          void *data) {
  solver *s = (solver *)data;
  const int ranges = s->problem->range_count;
  double unit[LM_FREE_MAX];
  unsigned next = 0;
  int i;
  int j;
  int k;
  spread_unit(s, x, unit);
  if (gradient != NULL) {
    memset(gradient, 0, (size_t)m * n * sizeof gradient[0]);
  }
  if (!evaluate(s, unit, gradient != NULL)) {
    for (next = 0; next < m; next++) {
      rows[next] = REFUSED;
    }
    return;
  }
  for (j = 0; j < s->problem->objective_count; j++) {
    const int figure = s->problem->objective[j];
    const double factor = s->aim.weight[j] / s->aim.scale[j];
    for (i = 0; i < s->layout.figure_count[figure] && s->aim.weight[j] > 0; i++, next++) {
      const int place = s->layout.figure_start[figure] + i;
      rows[next] = factor * (s->result[place] - s->aim.origin[j]) - x[n - 1];
      if (gradient != NULL) {
        for (k = 0; k < s->moving_count; k++) {
          gradient[next * n + (unsigned)k] = factor * s->slope[place * ranges + s->moving[k]];
        }
        gradient[next * n + n - 1] = -1;
      }
    }
  }
  for (i = 0; i < s->row_count; i++, next++) {
    row_kind kind;
    const int place = resolve_row(s, s->row[i], &kind);
    rows[next] = s->result[place] / kind.scale - kind.shift;
    if (gradient != NULL) {
      for (k = 0; k < s->moving_count; k++) {
        gradient[next * n + (unsigned)k] = s->slope[place * ranges + s->moving[k]] / kind.scale;
      }
    }
  }
}

/* Scale of the aim's value at the start: t of order 1. */
static void run_slsqp(solver *s, const double start[]) {
  const unsigned n = (unsigned)s->moving_count + 1;
  double low[LM_FREE_MAX + 1];
  double high[LM_FREE_MAX + 1];
  double x[LM_FREE_MAX + 1];
  double tolerance[ROW_MAX];
  unsigned rows;
  double least;
  unsigned i;
  memcpy(s->fixed, start, sizeof s->fixed);
  if (!evaluate(s, start, 1)) {
    return;
  }
  choose_rows(s, 0);
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
  s->running = nlopt_create(NLOPT_LD_SLSQP, n);
  nlopt_set_lower_bounds(s->running, low);
  nlopt_set_upper_bounds(s->running, high);
  nlopt_set_min_objective(s->running, epigraph_objective, s);
  nlopt_add_inequality_mconstraint(s->running, rows, epigraph_rows, s, tolerance);
  nlopt_set_xtol_rel(s->running, 1e-7);
  nlopt_set_ftol_rel(s->running, 1e-7);
  nlopt_set_maxeval(s->running, SLSQP_EVALUATIONS);
  (void)nlopt_optimize(s->running, x, &least);
  nlopt_destroy(s->running);
  s->running = NULL;
}

/* --- methods without derivatives ----------------------------------------------------------------
 */

static double plain_objective(unsigned n, const double *x, double *gradient, void *data) {
  solver *s = (solver *)data;
  double unit[LM_FREE_MAX];
  (void)n;
  (void)gradient;
  spread_unit(s, x, unit);
  (void)evaluate(s, unit, 0);
  return s->value;
}

/* Groups of limits: geometry, strength and size, gaps, figures and bounds of the aim. */
#define GROUPS 4

static void grouped_rows(unsigned m, double *rows, unsigned n, const double *x, double *gradient,
                         void *data) {
  solver *s = (solver *)data;
  double unit[LM_FREE_MAX];
  unsigned g;
  int i;
  (void)n;
  (void)gradient;
  spread_unit(s, x, unit);
  if (!evaluate(s, unit, 0)) {
    for (g = 0; g < m; g++) {
      rows[g] = REFUSED;
    }
    return;
  }
  for (g = 0; g < m; g++) {
    rows[g] = -1;
  }
  choose_rows(s, 1);
  for (i = 0; i < s->row_count; i++) {
    row_kind kind;
    const int place = resolve_row(s, s->row[i], &kind);
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

static void run_plain(solver *s, const double start[], nlopt_algorithm algorithm, double step,
                      uint64_t seed) {
  const unsigned n = (unsigned)s->moving_count;
  const double tolerance[GROUPS] = {1e-8, 1e-8, 1e-8, 1e-8};
  double x[LM_FREE_MAX];
  double least;
  unsigned i;
  memcpy(s->fixed, start, sizeof s->fixed);
  for (i = 0; i < n; i++) {
    x[i] = start[s->moving[i]];
  }
  /* NLopt's generator belongs to the thread: each run starts it anew. */
  nlopt_srand((unsigned long)(seed & 0xffffffffu));
  s->running = nlopt_create(algorithm, n);
  nlopt_set_lower_bounds1(s->running, 0);
  nlopt_set_upper_bounds1(s->running, 1);
  nlopt_set_min_objective(s->running, plain_objective, s);
  nlopt_add_inequality_mconstraint(s->running, GROUPS, grouped_rows, s, tolerance);
  nlopt_set_initial_step1(s->running, step);
  nlopt_set_population(s->running, 60);
  nlopt_set_xtol_rel(s->running, 1e-6);
  nlopt_set_maxeval(s->running, s->left > 1 ? s->left : 1);
  (void)nlopt_optimize(s->running, x, &least);
  nlopt_destroy(s->running);
  s->running = NULL;
}

/* --- tasks --------------------------------------------------------------------------------------
 */

/* Scattered points: a Sobol net turned by the seed, the shift that closes the gaps put right. */
static void screen(solver *s, const lm_task *task) {
  const int points = task->budget / 2 > 0 ? task->budget / 2 : 1;
  uint32_t net[256];
  double unit[256][LM_FREE_MAX];
  const int count = points < 256 ? points : 256;
  int i;
  int k;
  for (k = 0; k < s->problem->range_count; k++) {
    (void)lm_sobol_points(k, (uint32_t)(lm_mix(task->seed + (uint64_t)k) | 1u), count, net, NULL);
    for (i = 0; i < count; i++) {
      unit[i][k] = ((double)net[i] + 0.5) / 4294967296.0;
    }
  }
  for (i = 0; i < count && !s->interrupted; i++) {
    if (evaluate(s, unit[i], 0) &&
        lm_close_gap(s->problem, &s->layout, s->combination, s->result, unit[i])) {
      (void)evaluate(s, unit[i], 0);
    }
  }
}

/* Between two designs that are good for neighbouring aims lie designs that are good for the aims
 * between: points at even distances on the line, each with its gap closed. */
static void bridge(solver *s, const lm_task *task) {
  const int points = task->budget / 2 > 0 ? task->budget / 2 : 1;
  int i;
  int k;
  for (i = 1; i <= points && !s->interrupted; i++) {
    const double share = (double)i / (points + 1);
    double unit[LM_FREE_MAX] = {0};
    for (k = 0; k < s->problem->range_count; k++) {
      unit[k] = task->unit[k] + share * (task->parent[0].unit[k] - task->unit[k]);
    }
    if (evaluate(s, unit, 0) &&
        lm_close_gap(s->problem, &s->layout, s->combination, s->result, unit)) {
      (void)evaluate(s, unit, 0);
    }
  }
}

/* Smallest side clearance between all angles at the answer's point, arcmin, and its angle; 0 when
 * the model refuses. */
static int find_gap(solver *s, const double unit[], int nodes, int steps, double *gap_arcmin,
                    double *angle_rad) {
  lm_drive *drive = &s->workspace->drive;
  lm_smallest_gap smallest;
  if (lm_point_drive(s->problem, s->combination, unit, drive, NULL) != LM_OK ||
      lm_prepare_meshes(drive, nodes, &s->workspace->design, NULL) != LM_OK ||
      lm_find_smallest_gap(s->workspace->design.meshes, drive->axial_sections, steps, &smallest,
                           NULL) != LM_OK) {
    return 0;
  }
  *gap_arcmin = smallest.gap_rad * 10800.0 / 3.14159265358979323846;
  *angle_rad = smallest.angle_rad;
  return 1;
}

/* Where the teeth part, a gap may be smallest at the end of the overlap, which moves with the
 * design: no angle of a scan holds it. What is missing there is made up by the shift that opens all
 * gaps alike. */
static void open_fine_gap(solver *s) {
  int round;
  for (round = 0; round < 4 && s->answer->computed && !s->interrupted; round++) {
    double gap;
    double angle;
    double unit[LM_FREE_MAX];
    memcpy(unit, s->answer->unit, sizeof unit);
    if (!find_gap(s, unit, LM_FINE_NODES, LM_FINE_STEPS, &gap, &angle) ||
        gap >= s->problem->bounds.gap_min_arcmin - LM_FEASIBLE ||
        !lm_open_gap(s->problem, s->combination, s->problem->bounds.gap_min_arcmin - gap, unit)) {
      return;
    }
    s->known = 0;
    s->answer->computed = 0;
    s->answer->found_count = 0;
    (void)evaluate(s, unit, 0);
  }
}

/* Whether the answer's gaps hold between the angles of the scan as well, as the certificate asks.
 */
static int holds_between(solver *s) {
  double gap;
  double angle;
  return s->problem->bounds.gap_at_worst_corner ||
         (find_gap(s, s->answer->unit, LM_FINE_NODES, LM_FINE_STEPS, &gap, &angle) &&
          gap >= s->problem->bounds.gap_min_arcmin - LM_FEASIBLE);
}

/* Solve, then look between the angles of the scan; where a gap is too small there, that angle joins
 * the scan: the exchange method for limits that hold along a line. */
static void solve_exactly(solver *s, const double start[]) {
  int round;
  run_slsqp(s, start);
  for (round = 0; round < 6 && s->answer->computed && !s->interrupted; round++) {
    double gap;
    double angle;
    double from[LM_FREE_MAX];
    if (!find_gap(s, s->answer->unit, NODES, STEPS, &gap, &angle) ||
        gap >= s->problem->bounds.gap_min_arcmin - LM_FEASIBLE || s->scan.count == LM_ANGLE_MAX) {
      break;
    }
    s->scan.angle[s->scan.count].offset_rad = angle;
    s->scan.angle[s->scan.count].from_junction = 0;
    s->scan.count++;
    lm_lay_out(s->problem, &s->scan, &s->layout);
    memcpy(from, s->answer->unit, sizeof from);
    s->known = 0;
    s->answer->computed = 0; /* what held on fewer angles need not hold on more */
    s->answer->found_count = 0;
    run_slsqp(s, from);
  }
  open_fine_gap(s);
}

/* Whole grades one after the other, each with the better of its neighbours while the rest moves;
 * links that cost most first. Then the gaps between the angles of the scan. */
static void settle(solver *s, const lm_task *task) {
  const lm_problem *p = s->problem;
  double unit[LM_FREE_MAX];
  lm_answer kept;
  int i;
  int k;
  memcpy(unit, task->unit, sizeof unit);
  solve_exactly(s, unit);
  for (k = 0; k < p->range_count && s->answer->computed && !s->interrupted; k++) {
    const lm_range *range = &p->range[k];
    const double grade = range->low + (range->high - range->low) * s->answer->unit[k];
    double other[LM_FREE_MAX];
    int side;
    if (!range->whole) {
      continue;
    }
    for (i = 0; i < s->moving_count && s->moving[i] != k; i++) {
    }
    for (; i + 1 < s->moving_count; i++) {
      s->moving[i] = s->moving[i + 1];
    }
    s->moving_count--;
    memcpy(other, s->answer->unit, sizeof other);
    memset(&kept, 0, sizeof kept);
    for (side = 0; side < 2; side++) {
      const double whole = side == 0 ? floor(grade + 1e-9) : ceil(grade - 1e-9);
      lm_answer before = *s->answer;
      memcpy(unit, other, sizeof unit);
      unit[k] = (whole - range->low) / (range->high - range->low);
      if (unit[k] < 0 || unit[k] > 1) {
        continue;
      }
      s->answer->computed = 0;
      s->answer->found_count = 0;
      s->known = 0;
      run_slsqp(s, unit);
      if (s->answer->computed &&
          (!kept.computed ||
           is_better(s->answer->value, s->answer->violation, kept.value, kept.violation))) {
        kept = *s->answer;
      }
      before.plain = s->answer->plain;
      before.slopes = s->answer->slopes;
      before.refused = s->answer->refused;
      before.feasible = s->answer->feasible;
      *s->answer = before;
    }
    kept.id = s->answer->id;
    kept.plain = s->answer->plain;
    kept.slopes = s->answer->slopes;
    kept.refused = s->answer->refused;
    kept.feasible = s->answer->feasible;
    *s->answer = kept;
  }
  if (s->answer->computed) {
    memcpy(unit, s->answer->unit, sizeof unit);
    solve_exactly(s, unit);
  }
  /* Only the settled design counts: the others still have broken grades. */
  s->answer->found_count = 0;
  if (s->answer->computed && s->answer->violation <= LM_FEASIBLE && holds_between(s)) {
    double objective[LM_OBJECTIVE_MAX] = {0};
    for (i = 0; i < p->objective_count; i++) {
      objective[i] = s->answer->figure[p->objective[i]];
    }
    keep_found(s, s->answer->unit, objective, 1);
  }
}

static lm_status open_solver(solver *s, const lm_problem *problem, int combination, int budget,
                             const lm_aim *aim, lm_answer *answer, lm_workspace *workspace,
                             const volatile int *stop) {
  int k;
  memset(s, 0, sizeof *s);
  s->problem = problem;
  s->stop = stop;
  s->workspace = workspace;
  s->answer = answer;
  s->aim = *aim;
  s->combination = combination;
  s->left = budget;
  lm_default_scan(&s->scan);
  lm_lay_out(problem, &s->scan, &s->layout);
  s->moving_count = problem->range_count;
  for (k = 0; k < problem->range_count; k++) {
    s->moving[k] = k;
  }
  s->result = (double *)malloc(LM_RESULT_MAX * sizeof s->result[0]);
  s->slope = (double *)malloc((size_t)LM_RESULT_MAX * LM_FREE_MAX * sizeof s->slope[0]);
  if (s->result == NULL || s->slope == NULL) {
    free(s->result);
    free(s->slope);
    return LM_TOO_SMALL;
  }
  return LM_OK;
}

static void close_solver(solver *s) {
  free(s->result);
  free(s->slope);
}

lm_status lm_run_task(const lm_problem *problem, const lm_task *task, lm_answer *answer,
                      lm_workspace *workspace, const volatile int *stop) {
  solver s;
  lm_status status;
  if (problem == NULL || task == NULL || answer == NULL || workspace == NULL) {
    return LM_NULL;
  }
  memset(answer, 0, sizeof *answer);
  answer->id = task->id;
  answer->combination = task->combination;
  if (task->kind == LM_TASK_EVOLVE) {
    return lm_evolve(problem, task, answer, workspace, stop);
  }
  status = open_solver(&s, problem, task->combination, task->budget, &task->aim, answer, workspace,
                       stop);
  if (status != LM_OK) {
    return status;
  }
  switch (task->kind) {
    case LM_TASK_SCREEN:
      screen(&s, task);
      break;
    case LM_TASK_COBYLA:
      run_plain(&s, task->unit, NLOPT_LN_COBYLA, 0.1, task->seed);
      break;
    case LM_TASK_ISRES:
      run_plain(&s, task->unit, NLOPT_GN_ISRES, 0.3, task->seed);
      break;
    case LM_TASK_BRIDGE:
      bridge(&s, task);
      break;
    case LM_TASK_SETTLE:
      settle(&s, task);
      break;
    case LM_TASK_SLSQP:
    default:
      run_slsqp(&s, task->unit);
      break;
  }
  close_solver(&s);
  return s.interrupted ? LM_NOT_CONVERGED : LM_OK;
}

/* --- infeasibility ------------------------------------------------------------------------------
 */

/* The limit that a chosen row belongs to. */
static int limit_of(const solver *s, int row) {
  if (row >= ROW_OF_LIMIT) {
    return LM_LIMIT_FIGURE + figure_at(&s->layout, row - ROW_OF_LIMIT);
  }
  if (row >= s->layout.gap_start) {
    return LM_LIMIT_GAP;
  }
  return row - s->layout.single_start;
}

/* min sum of the slacks, one for each limit; they stand behind the moving variables. */
static double elastic_objective(unsigned n, const double *x, double *gradient, void *data) {
  const solver *s = (const solver *)data;
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
  solver *s = (solver *)data;
  const int ranges = s->problem->range_count;
  double unit[LM_FREE_MAX];
  unsigned i;
  int k;
  spread_unit(s, x, unit);
  if (gradient != NULL) {
    memset(gradient, 0, (size_t)m * n * sizeof gradient[0]);
  }
  if (!evaluate(s, unit, gradient != NULL)) {
    for (i = 0; i < m; i++) {
      rows[i] = REFUSED;
    }
    return;
  }
  for (i = 0; i < m; i++) {
    row_kind kind;
    const int place = resolve_row(s, s->row[i], &kind);
    const unsigned slack = (unsigned)(s->moving_count + limit_of(s, s->row[i]));
    rows[i] = s->result[place] / kind.scale - kind.shift - x[slack];
    if (gradient != NULL) {
      for (k = 0; k < s->moving_count; k++) {
        gradient[i * n + (unsigned)k] = s->slope[place * ranges + s->moving[k]] / kind.scale;
      }
      gradient[i * n + slack] = -1;
    }
  }
}

static void read_relaxation(solver *s, double relax[]) {
  int i;
  for (i = 0; i < LM_LIMIT_COUNT; i++) {
    relax[i] = 0;
  }
  choose_rows(s, 1);
  for (i = 0; i < s->row_count; i++) {
    row_kind kind;
    const int place = resolve_row(s, s->row[i], &kind);
    const double row = s->result[place] / kind.scale - kind.shift;
    const int limit = limit_of(s, s->row[i]);
    relax[limit] = row > relax[limit] ? row : relax[limit];
  }
}

lm_status lm_explain_infeasible(const lm_problem *problem, int combination, double unit[],
                                int budget, double relax[], lm_workspace *workspace,
                                const volatile int *stop) {
  static const double far = 100; /* slacks are shares of a limit, modules or arcmin */
  double low[LM_FREE_MAX + LM_LIMIT_COUNT] = {0};
  double high[LM_FREE_MAX + LM_LIMIT_COUNT];
  double x[LM_FREE_MAX + LM_LIMIT_COUNT];
  double tolerance[ROW_MAX];
  lm_answer *answer;
  lm_aim aim;
  solver s;
  lm_status status;
  double least;
  unsigned n;
  int i;
  if (problem == NULL || unit == NULL || relax == NULL || workspace == NULL) {
    return LM_NULL;
  }
  answer = (lm_answer *)calloc(1, sizeof *answer);
  lm_lead_aim(&aim);
  if (answer == NULL) {
    return LM_TOO_SMALL;
  }
  status = open_solver(&s, problem, combination, budget, &aim, answer, workspace, stop);
  if (status != LM_OK) {
    free(answer);
    return status;
  }
  if (evaluate(&s, unit, 1)) {
    read_relaxation(&s, relax);
    n = (unsigned)(s.moving_count + LM_LIMIT_COUNT);
    for (i = 0; i < s.moving_count; i++) {
      x[i] = unit[i];
      high[i] = 1;
    }
    for (i = 0; i < LM_LIMIT_COUNT; i++) {
      x[s.moving_count + i] = relax[i];
      high[s.moving_count + i] = far;
    }
    for (i = 0; i < s.row_count; i++) {
      tolerance[i] = 1e-8;
    }
    memcpy(s.fixed, unit, sizeof s.fixed);
    s.running = nlopt_create(NLOPT_LD_SLSQP, n);
    nlopt_set_lower_bounds(s.running, low);
    nlopt_set_upper_bounds(s.running, high);
    nlopt_set_min_objective(s.running, elastic_objective, &s);
    nlopt_add_inequality_mconstraint(s.running, (unsigned)s.row_count, elastic_rows, &s, tolerance);
    nlopt_set_xtol_rel(s.running, 1e-7);
    nlopt_set_maxeval(s.running, 200);
    (void)nlopt_optimize(s.running, x, &least);
    nlopt_destroy(s.running);
    s.running = NULL;
    spread_unit(&s, x, unit);
    if (evaluate(&s, unit, 0)) {
      read_relaxation(&s, relax);
    }
  } else {
    status = LM_OUT_OF_RANGE;
  }
  close_solver(&s);
  free(answer);
  return s.interrupted ? LM_NOT_CONVERGED : status;
}
