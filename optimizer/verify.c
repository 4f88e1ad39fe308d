#include "verify.h"

#include <math.h>
#include <string.h>

#include "archive.h"
#include "lostmotion/checks.h"

/* Grid of the verification between the angles of the scan: steps per pitch, nodes of the line. */
#define STEPS 8
#define NODES 64

/* Angles that one solution may add to the scan. */
#define ROUNDS 6

/* Smallest side clearance of a point, between the angles of the scan and the edges as well: arcmin,
 * and the angle at which it is. 0 when the model refuses. */
static int find_gap(lm_task_state *s, const double unit[], double *gap_arcmin, double *angle_rad) {
  lm_drive *drive = &s->workspace->drive;
  lm_smallest_gap smallest;
  if (lm_point_drive(s->problem, s->combination, unit, drive, NULL) != LM_OK ||
      lm_find_face_gap(drive, NODES, STEPS, s->workspace->design.face, &smallest, NULL) != LM_OK) {
    return 0;
  }
  *gap_arcmin = smallest.gap_rad * 10800.0 / LM_PI;
  *angle_rad = smallest.angle_rad;
  return 1;
}

/* The same on the grid of the certificate, once for a point that the model accepts. */
static int find_certain_gap(lm_task_state *s, const double unit[], double *gap_arcmin) {
  lm_certain_gap *known = &s->certain;
  const size_t size = (size_t)s->problem->range_count * sizeof unit[0];
  if (!known->computed || memcmp(known->at, unit, size) != 0) {
    lm_drive drive;
    lm_smallest_gap smallest;
    memset(&drive, 0, sizeof drive);
    memcpy(known->at, unit, size);
    known->computed = lm_point_drive(s->problem, s->combination, unit, &drive, NULL) == LM_OK &&
                      lm_find_known_gap(&s->workspace->known, &drive, s->workspace->design.face,
                                        &smallest) == LM_OK;
    known->gap_arcmin = known->computed ? smallest.gap_rad * 10800.0 / LM_PI : 0;
  }
  *gap_arcmin = known->gap_arcmin;
  return known->computed;
}

/* The answer is for another scan or other phases: limits that held before may not hold now. */
static void begin_anew(lm_task_state *s) {
  lm_lay_out(s->problem, &s->scan, &s->layout);
  s->known = 0;
  s->answer->computed = 0;
  s->answer->solution_count = 0;
}

/* A gap may be smallest at the end of the overlap, which moves with the design and is not at an
 * angle of the scan. A violation there is corrected by the shift that opens all gaps equally. */
static void open_fine_gap(lm_task_state *s) {
  int round;
  for (round = 0; round < 4 && s->answer->computed && !s->interrupted; round++) {
    double gap;
    double unit[LM_FREE_MAX];
    memcpy(unit, s->answer->unit, sizeof unit);
    if (!find_certain_gap(s, unit, &gap) || gap >= s->problem->bounds.gap_min_arcmin ||
        !lm_open_gap(s->problem, s->combination,
                     s->problem->bounds.gap_min_arcmin + LM_RESERVE - gap, unit)) {
      return;
    }
    begin_anew(s);
    (void)lm_evaluate_task_point(s, unit, 0);
  }
}

/* Whether a figure has a limit that depends on the tooth phase: all except stress and cost do. */
static int limits_phases(const lm_problem *p) {
  int figure = 0;
  while (figure < LM_FIGURE_STRESS && !(p->bounds.figure_max[figure] > 0)) {
    figure++;
  }
  return figure < LM_FIGURE_STRESS;
}

/* The problem at the phases of the certificate. */
static const lm_problem *at_fine_phases(lm_task_state *s) {
  lm_problem *finer = &s->workspace->finer;
  if (s->problem != finer) {
    *finer = *s->problem;
    finer->phases = LM_CERTAIN_PHASES;
  }
  return finer;
}

/* Whether the limits of the figures hold at the phases between those of the search as well. */
static int holds_at_fine_phases(lm_task_state *s, const double unit[]) {
  const lm_problem *finer;
  double result[LM_RESULT_MAX];
  lm_scan scan = s->scan;
  lm_layout layout;
  if (!limits_phases(s->problem)) {
    return 1;
  }
  finer = at_fine_phases(s);
  scan.nodes = LM_CERTAIN_NODES;
  lm_lay_out(finer, &scan, &layout);
  return lm_evaluate_point(finer, &scan, &layout, s->combination, unit, result, s->workspace,
                           NULL) == LM_OK &&
         lm_violation_of(finer, &layout, result) <= 0;
}

/* Whether a point holds between the angles of the scan and between the phases as well, as the
 * certificate asks. */
static int holds_between(lm_task_state *s, const double unit[]) {
  double gap;
  return (s->problem->bounds.gap_at_worst_corner ||
          (find_certain_gap(s, unit, &gap) && gap >= s->problem->bounds.gap_min_arcmin)) &&
         holds_at_fine_phases(s, unit);
}

/* Solve, then check between the angles of the scan; if a gap is too small there, that angle is
 * added to the scan: the exchange method for semi-infinite limits. A verification solves four times
 * at most, so the default scan and four times the rounds are within LM_ANGLE_MAX. */
static void solve_exactly(lm_task_state *s, const double start[]) {
  int round;
  lm_run_slsqp(s, start);
  for (round = 0; round < ROUNDS && s->answer->computed && !s->interrupted; round++) {
    double gap;
    double angle;
    double from[LM_FREE_MAX];
    if (!find_gap(s, s->answer->unit, &gap, &angle) || gap >= s->problem->bounds.gap_min_arcmin) {
      break;
    }
    s->scan.angle[s->scan.count].offset_rad = angle;
    s->scan.angle[s->scan.count].from_junction = 0;
    s->scan.count++;
    memcpy(from, s->answer->unit, sizeof from);
    begin_anew(s);
    lm_run_slsqp(s, from);
  }
  open_fine_gap(s);
}

/* If the answer violates a limit between the phases, continue at those of the certificate. */
static void keep_fine_limits(lm_task_state *s) {
  double unit[LM_FREE_MAX];
  if (!s->answer->computed || holds_at_fine_phases(s, s->answer->unit)) {
    return;
  }
  memcpy(unit, s->answer->unit, sizeof unit);
  s->problem = at_fine_phases(s);
  s->scan.nodes = LM_CERTAIN_NODES;
  begin_anew(s);
  solve_exactly(s, unit);
}

/* The answer at the phases of the search, like the figures of all other designs of the front. Gaps
 * differ there by a part of the reserve, because the line is coarser. */
static void measure_as_searched(lm_task_state *s, const lm_problem *stated, int nodes) {
  double unit[LM_FREE_MAX];
  if (s->problem == stated) {
    return;
  }
  memcpy(unit, s->answer->unit, sizeof unit);
  s->problem = stated;
  s->scan.nodes = nodes;
  begin_anew(s);
  if (lm_evaluate_task_point(s, unit, 0) && lm_gap_row_of(&s->layout, s->result) > 0 &&
      lm_close_gap(s->problem, &s->layout, s->combination, s->result, unit)) {
    begin_anew(s);
    (void)lm_evaluate_task_point(s, unit, 0);
  }
}

/* Fixes the value of the range. */
static void fix_range(lm_task_state *s, int range) {
  int moving = 0;
  int i;
  for (i = 0; i < s->moving_count; i++) {
    if (s->moving[i] != range) {
      s->moving[moving++] = s->moving[i];
    }
  }
  s->moving_count = moving;
}

int lm_has_whole_grades(const lm_problem *p, const double unit[]) {
  int k;
  for (k = 0; k < p->range_count; k++) {
    const lm_range *range = &p->range[k];
    const double grade = range->low + (range->high - range->low) * unit[k];
    if (range->whole && fabs(grade - round(grade)) > 1e-9) {
      return 0;
    }
  }
  return 1;
}

void lm_mark_verified(lm_task_state *s) {
  int i;
  for (i = 0; i < s->answer->solution_count; i++) {
    lm_solution *found = &s->answer->solution[i];
    found->verified = lm_has_whole_grades(s->problem, found->unit) && holds_between(s, found->unit);
  }
}

/* Whether the answer has a design that satisfies the certificate. */
static int holds(lm_task_state *s) {
  return s->answer->computed && s->answer->violation <= 0 && holds_between(s, s->answer->unit);
}

static void keep_verified(lm_task_state *s) {
  double objective[LM_OBJECTIVE_MAX] = {0};
  int i;
  if (!holds(s)) {
    return;
  }
  for (i = 0; i < s->problem->objective_count; i++) {
    objective[i] = s->answer->figure[s->problem->objective[i]];
  }
  s->violation = s->answer->violation; /* of this design, not of the last one examined */
  lm_keep_solution(s, s->answer->unit, objective, 1);
}

void lm_verify_design(lm_task_state *s, const lm_task *task) {
  const lm_problem *p = s->problem;
  const int nodes = s->scan.nodes;
  double unit[LM_FREE_MAX];
  lm_answer kept;
  int rounded = 0;
  int k;
  memcpy(unit, task->unit, sizeof unit);
  solve_exactly(s, unit);
  keep_fine_limits(s);
  for (k = 0; k < p->range_count && s->answer->computed && !s->interrupted; k++) {
    const lm_range *range = &p->range[k];
    const double grade = range->low + (range->high - range->low) * s->answer->unit[k];
    double other[LM_FREE_MAX];
    int side;
    if (!range->whole) {
      continue;
    }
    fix_range(s, k);
    if (fabs(grade - round(grade)) <= 1e-9) {
      continue; /* at a bound: nothing to choose */
    }
    rounded = 1;
    memcpy(other, s->answer->unit, sizeof other);
    kept = *s->answer;
    kept.computed = 0;
    for (side = 0; side < 2; side++) {
      const double whole = side == 0 ? floor(grade + 1e-9) : ceil(grade - 1e-9);
      lm_answer before = *s->answer;
      memcpy(unit, other, sizeof unit);
      unit[k] = (whole - range->low) / (range->high - range->low);
      if (unit[k] < 0 || unit[k] > 1) {
        continue;
      }
      s->answer->computed = 0;
      s->answer->solution_count = 0;
      s->known = 0;
      lm_run_slsqp(s, unit);
      if (s->answer->computed &&
          (!kept.computed ||
           lm_is_better(s->answer->value, s->answer->violation, kept.value, kept.violation))) {
        kept = *s->answer;
      }
      before.plain = s->answer->plain;
      before.slopes = s->answer->slopes;
      before.refused = s->answer->refused;
      before.feasible = s->answer->feasible;
      *s->answer = before;
    }
    kept.plain = s->answer->plain;
    kept.slopes = s->answer->slopes;
    kept.refused = s->answer->refused;
    kept.feasible = s->answer->feasible;
    *s->answer = kept;
  }
  if (s->answer->computed && (rounded || !holds(s))) {
    memcpy(unit, s->answer->unit, sizeof unit);
    solve_exactly(s, unit);
    keep_fine_limits(s);
  }
  measure_as_searched(s, p, nodes);
  /* Only the verified design counts: the others still have fractional grades. */
  s->answer->solution_count = 0;
  keep_verified(s);
}

/* Whether integer ranges are grades of tolerances, whose change costs little. */
static int rounds_grades_only(const lm_problem *p) {
  int k = 0;
  while (k < p->range_count && !(p->range[k].whole && p->range[k].key < LM_KEY_GRADE)) {
    k++;
  }
  return k == p->range_count && lm_has_cheap_tolerances(p);
}

void lm_round_design(lm_task_state *s, const lm_task *task) {
  static double (*const roundings[])(double) = {round, floor, ceil};
  const lm_problem *p = s->problem;
  const int cheap = rounds_grades_only(p);
  int evaluated = 0;
  int way;
  int k;
  for (way = 0; way < 3 && !s->interrupted; way++) {
    double unit[LM_FREE_MAX];
    memcpy(unit, task->unit, sizeof unit);
    for (k = 0; k < p->range_count; k++) {
      const lm_range *range = &p->range[k];
      const double grade = range->low + (range->high - range->low) * unit[k];
      if (range->whole && fabs(grade - round(grade)) > 1e-9) {
        unit[k] = (roundings[way](grade) - range->low) / (range->high - range->low);
        unit[k] = lm_clip(unit[k]);
      }
    }
    if (evaluated && cheap) {
      evaluated = lm_evaluate_task_grades(s, unit);
    } else {
      evaluated = lm_evaluate_task_point(s, unit, 0);
      if (evaluated) {
        lm_keep_result(&s->workspace->known, p, s->combination, unit, s->result);
      }
    }
  }
}

void lm_confirm_design(lm_task_state *s, const lm_task *task) {
  s->recalls = 1;
  (void)lm_evaluate_task_point(s, task->unit, 0);
  if (s->answer->computed && s->answer->violation <= 0) {
    open_fine_gap(s);
  }
  s->answer->solution_count = 0;
  if (lm_has_whole_grades(s->problem, s->answer->unit)) {
    keep_verified(s);
  }
}
