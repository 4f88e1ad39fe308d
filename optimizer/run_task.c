#include "run_task.h"

#include <string.h>

#include "archive.h"
#include "evolve.h"
#include "infeasible.h"
#include "verify.h"

/* A point, and again with its gap closed. */
static void look(lm_task_state *s, double unit[]) {
  if (lm_evaluate_task_point(s, unit, 0) &&
      lm_close_gap(s->problem, &s->layout, s->combination, s->result, unit)) {
    (void)lm_evaluate_task_point(s, unit, 0);
  }
}

/* Scattered points: a Sobol net shifted by the seed, with the shift that closes the gaps
 * adjusted. */
static void screen(lm_task_state *s, const lm_task *task) {
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
    look(s, unit[i]);
  }
}

lm_status lm_run_task(const lm_problem *problem, const lm_task *task, lm_answer *answer,
                      lm_workspace *workspace, const volatile int *stop) {
  lm_task_state s;
  double unit[LM_FREE_MAX];
  if (problem == NULL || task == NULL || answer == NULL || workspace == NULL) {
    return LM_NULL;
  }
  memset(answer, 0, sizeof *answer);
  answer->id = task->id;
  answer->combination = task->combination;
  if (task->kind == LM_TASK_EVOLVE) {
    return lm_evolve(problem, task, answer, workspace, stop);
  }
  lm_open_task_state(&s, problem, task->combination, task->budget, &task->scalar, answer, workspace,
                     stop);
  /* which is not charged against the budget */
  s.capped = task->kind < LM_TASK_REPAIR;
  switch (task->kind) {
    case LM_TASK_SCREEN:
      screen(&s, task);
      break;
    case LM_TASK_COBYLA:
      lm_run_plain(&s, task->unit, NLOPT_LN_COBYLA, 0.1, task->seed);
      break;
    case LM_TASK_ISRES:
      lm_run_plain(&s, task->unit, NLOPT_GN_ISRES, 0.3, task->seed);
      break;
    case LM_TASK_EVALUATE:
      memcpy(unit, task->unit, sizeof unit);
      if (lm_evaluate_task_point(&s, unit, 0) && answer->solution_count == 0) {
        look(&s, unit);
      }
      lm_mark_verified(&s);
      break;
    case LM_TASK_REPAIR:
      lm_repair(&s, task);
      break;
    case LM_TASK_ROUND:
      lm_round_design(&s, task);
      break;
    case LM_TASK_CONFIRM:
      lm_confirm_design(&s, task);
      break;
    case LM_TASK_VERIFY:
      lm_verify_design(&s, task);
      break;
    case LM_TASK_SLSQP:
    default:
      s.closes = 1;
      lm_run_slsqp(&s, task->unit);
      break;
  }
  if (s.out_of_memory) {
    return LM_TOO_SMALL;
  }
  return s.interrupted ? LM_NOT_CONVERGED : LM_OK;
}
