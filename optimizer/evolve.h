/* A population of designs of all combinations, improved by crossover, differences and mutation. The
 * gap of every child is closed before it is evaluated. If tolerances have a cost, feasible designs
 * are also evaluated with other tolerances, each for a sixteenth of an evaluation.
 */
#ifndef LOSTMOTION_OPTIMIZER_EVOLVE_H
#define LOSTMOTION_OPTIMIZER_EVOLVE_H

#include "points.h"
#include "task.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Task of kind LM_TASK_EVOLVE: from task->parent[] (filled up with drawn designs) to a population
 * of the same size in answer->solution[solution_count ..]. Called by lm_run_task. */
lm_status lm_evolve(const lm_problem *problem, const lm_task *task, lm_answer *answer,
                    lm_workspace *workspace, const volatile int *stop);

#ifdef __cplusplus
}
#endif

#endif
