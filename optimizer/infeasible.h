/* Limits that no evaluated design satisfies together, and their required relaxations. */
#ifndef LOSTMOTION_OPTIMIZER_INFEASIBLE_H
#define LOSTMOTION_OPTIMIZER_INFEASIBLE_H

#include "task_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/* From the start of the task to the point with the least total relaxation. If that is zero, a
 * design is found, and improved by the scalarised objective; otherwise the answer is that point,
 * with whole grades, and its value is the total relaxation. */
void lm_repair(lm_task_state *s, const lm_task *task);

#ifdef __cplusplus
}
#endif

#endif
