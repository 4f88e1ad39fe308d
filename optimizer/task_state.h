/* Working state of one task: evaluated points with a cache of the last one. Only the files that run
 * tasks include this. */
#ifndef LOSTMOTION_OPTIMIZER_TASK_STATE_H
#define LOSTMOTION_OPTIMIZER_TASK_STATE_H

#include <nlopt.h>

#include "task.h"
#include "workspace.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LM_ROW_MAX (LM_RESULT_MAX + LM_BRANCH_MAX)

/* The smallest gap of a point on the grid of the certificate. */
typedef struct lm_certain_gap {
  int computed;
  double at[LM_FREE_MAX];
  double gap_arcmin;
} lm_certain_gap;

/* All data of one task. */
typedef struct lm_task_state {
  const lm_problem *problem;
  const volatile int *stop;
  lm_workspace *workspace;
  lm_answer *answer;
  lm_scalarisation scalar;
  lm_scan scan;
  lm_layout layout;
  int combination;
  int left;   /* budget */
  int capped; /* 1: no evaluation beyond it */
  int interrupted;
  int out_of_memory; /* error of NLopt: the task has no answer */
  int recalls;       /* 1: a point that is known is not evaluated again */
  int closes;        /* 1: SLSQP also examines points that violate their gaps with these closed */
  nlopt_opt running;
  /* variables that the lm_task_state may move, as indices of ranges */
  int moving[LM_FREE_MAX];
  int moving_count;
  double fixed[LM_FREE_MAX]; /* the others' values */
  /* rows of the subproblem */
  int row[LM_ROW_MAX];
  int row_count;
  /* the last point evaluated */
  int known;
  int known_slopes;
  int feasible;
  double at[LM_FREE_MAX];
  double *result; /* of the workspace */
  double *slope;  /* of the workspace, by range */
  double value;
  double violation;
  lm_certain_gap certain; /* of the last point that was checked */
} lm_task_state;

void lm_open_task_state(lm_task_state *s, const lm_problem *problem, int combination, int budget,
                        const lm_scalarisation *scalar, lm_answer *answer, lm_workspace *workspace,
                        const volatile int *stop);

/* Evaluate at a point unless it was the last one; 0 when the model refuses it. */
int lm_evaluate_task_point(lm_task_state *s, const double unit[], int slopes);

/* Evaluate at a point that differs only in its tolerance grades from the last one, which the model
 * did not refuse; 0 when it refuses this one. */
int lm_evaluate_task_grades(lm_task_state *s, const double unit[]);

/* Feasible before infeasible, then the smaller value (violation). */
int lm_is_better(double value, double violation, double than_value, double than_violation);

/* A feasible design joins those of the answer. */
void lm_keep_solution(lm_task_state *s, const double unit[], const double objective[],
                      int verified);

#ifdef __cplusplus
}
#endif

#endif
