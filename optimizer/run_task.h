/* Execution of a task, and the analysis of infeasibility. */
#ifndef LOSTMOTION_OPTIMIZER_RUN_TASK_H
#define LOSTMOTION_OPTIMIZER_RUN_TASK_H

#include "points.h"
#include "task.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Run a task. stop: checked between evaluations, may be null; if it is set, the answer is invalid
 * and LM_NOT_CONVERGED is returned. LM_NULL, LM_TOO_SMALL (no memory for NLopt). */
lm_status lm_run_task(const lm_problem *problem, const lm_task *task, lm_answer *answer,
                      lm_workspace *workspace, const volatile int *stop);

/* --- infeasibility --- */

/* Relaxation of each limit with which a design exists: minimises the sum of all relative violations
 * from the given start, with whole grades; unit[] becomes it. relax[LM_LIMIT_COUNT]: scaled
 * violations (0: the limit can hold) in the unit of evaluate.h, also on the grid of the
 * certificate. LM_NULL, LM_OUT_OF_RANGE (the model refuses the start), LM_NOT_CONVERGED (stopped),
 * LM_TOO_SMALL (no memory for NLopt). */
lm_status lm_explain_infeasible(const lm_problem *problem, int combination, double unit[],
                                int budget, double relax[], lm_workspace *workspace,
                                const volatile int *stop);

#ifdef __cplusplus
}
#endif

#endif
