/* Limits that no design met keeps together: how far each of them would have to give. */
#ifndef LOSTMOTION_OPTIMIZER_INFEASIBLE_H
#define LOSTMOTION_OPTIMIZER_INFEASIBLE_H

#include "task_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/* From the start of the task to the point whose limits have to give least. Where none has to, a
 * design is found, and made better by the scalarised objective; otherwise the answer is of that
 * point, with whole grades, and its value what the limits give in all. */
void lm_repair(lm_task_state *s, const lm_task *task);

#ifdef __cplusplus
}
#endif

#endif
