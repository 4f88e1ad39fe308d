#include "task_state.h"

#include <math.h>
#include <string.h>

#include "archive.h"
#include "stop.h"

void lm_open_task_state(lm_task_state *s, const lm_problem *problem, int combination, int budget,
                        const lm_scalarisation *scalar, lm_answer *answer, lm_workspace *workspace,
                        const volatile int *stop) {
  int k;
  memset(s, 0, sizeof *s);
  s->problem = problem;
  s->stop = stop;
  s->workspace = workspace;
  s->answer = answer;
  s->scalar = *scalar;
  s->combination = combination;
  s->left = budget;
  lm_default_scan(&s->scan);
  lm_lay_out(problem, &s->scan, &s->layout);
  s->moving_count = problem->range_count;
  for (k = 0; k < problem->range_count; k++) {
    s->moving[k] = k;
  }
  s->result = workspace->task_result;
  s->slope = workspace->task_slope;
}

static void read_objectives(const lm_task_state *s, double objective[]) {
  int j;
  for (j = 0; j < s->problem->objective_count; j++) {
    objective[j] = lm_figure_of(&s->layout, s->result, s->problem->objective[j]);
  }
}

/* Bounds of the scalarised objective count as limits. */
static double with_bounds_of_scalar(const lm_task_state *s, const double objective[],
                                    double violation) {
  double largest = violation;
  int j;
  for (j = 0; j < s->problem->objective_count; j++) {
    const double over = (objective[j] - s->scalar.most[j]) / s->scalar.scale[j];
    largest = over > largest ? over : largest;
  }
  return largest;
}

void lm_keep_solution(lm_task_state *s, const double unit[], const double objective[],
                      int verified) {
  lm_solution found;
  lm_fill_solution(s->problem, &found, s->combination, unit, objective, s->violation);
  found.verified = verified;
  lm_insert_solution(s->problem, s->answer->solution, &s->answer->solution_count, LM_SOLUTION_MAX,
                     &found);
}

int lm_is_better(double value, double violation, double than_value, double than_violation) {
  if (violation <= 0 && than_violation <= 0) {
    return value < than_value;
  }
  return violation < than_violation;
}

static void keep_best(lm_task_state *s, const double unit[]) {
  lm_answer *a = s->answer;
  int figure;
  if (a->computed && !lm_is_better(s->value, s->violation, a->value, a->violation)) {
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

/* Takes the result at a point into the answer; 0 if there is none. */
static int accept_result(lm_task_state *s, const double unit[], lm_status status) {
  double objective[LM_OBJECTIVE_MAX] = {0};
  double broken;
  if (status != LM_OK) {
    s->value = LM_REFUSED;
    s->violation = LM_REFUSED;
    return 0;
  }
  read_objectives(s, objective);
  s->value = lm_scalarised_value(s->problem, &s->scalar, objective);
  broken = lm_violation_of(s->problem, &s->layout, s->result);
  s->violation = with_bounds_of_scalar(s, objective, broken);
  if (broken <= 0) {
    lm_keep_solution(s, unit, objective, 0);
  }
  s->feasible = broken <= 0;
  keep_best(s, unit);
  return 1;
}

int lm_evaluate_task_point(lm_task_state *s, const double unit[], int slopes) {
  const size_t size = (size_t)s->problem->range_count * sizeof unit[0];
  const int charge = slopes ? lm_slope_charge(s->problem) : 1;
  lm_status status;
  if (s->known && memcmp(unit, s->at, size) == 0 && (s->known_slopes || !slopes)) {
    return s->violation < LM_REFUSED;
  }
  if (lm_is_stopped(s->stop)) {
    s->interrupted = 1;
  }
  if ((s->interrupted || s->left < charge) && s->running != NULL) {
    nlopt_force_stop(s->running);
  }
  if (s->capped && s->left < charge) {
    return 0;
  }
  s->left -= charge;
  memcpy(s->at, unit, size);
  s->known = 1;
  s->known_slopes = slopes;
  if (slopes) {
    s->answer->slopes++;
    status = lm_evaluate_slopes(s->problem, &s->scan, &s->layout, s->combination, unit, s->result,
                                s->slope, s->workspace, NULL);
  } else {
    s->answer->plain++;
    status = s->recalls ? lm_find_known_result(s->problem, &s->scan, &s->layout, s->combination,
                                               unit, s->result, s->workspace)
                        : lm_evaluate_point(s->problem, &s->scan, &s->layout, s->combination, unit,
                                            s->result, s->workspace, NULL);
  }
  if (!accept_result(s, unit, status)) {
    s->answer->refused++;
    return 0;
  }
  s->answer->feasible += s->feasible;
  return 1;
}

int lm_evaluate_task_grades(lm_task_state *s, const double unit[]) {
  const size_t size = (size_t)s->problem->range_count * sizeof unit[0];
  lm_status status;
  memcpy(s->at, unit, size);
  s->known_slopes = 0;
  s->answer->tolerance_only++;
  status = lm_evaluate_tolerances(s->problem, &s->layout, s->combination, unit, s->result,
                                  s->workspace, NULL);
  s->known = status == LM_OK;
  return accept_result(s, unit, status);
}
