/* Tasks on the cores of this machine.
 *
 * Threads take tasks in their order; each has its own workspace and its own NLopt state. The
 * answers do not depend on the number of threads.
 */
#ifndef LOSTMOTION_OPTIMIZER_POOL_H
#define LOSTMOTION_OPTIMIZER_POOL_H

#include "output.h"
#include "run_task.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LM_WORKERS_MAX 256

typedef struct lm_pool lm_pool;

/* workers 1 .. LM_WORKERS_MAX; 0: as many as the machine has cores. Null: out of memory. */
lm_pool *lm_open_pool(int workers);
void lm_close_pool(lm_pool *pool);

/* Called with each answer, one at a time, in any order, from any thread. */
typedef void (*lm_answer_sink)(void *context, const lm_answer *answer);

/* Run tasks[count] except those for which skip(context, id) is true, which are answered (skip may
 * be null). Returns when all are done, or soon after *stop was set (stop may be null); then answers
 * are missing and the result is LM_NOT_CONVERGED. LM_TOO_SMALL: no thread or memory. */
lm_status lm_run_tasks(lm_pool *pool, const lm_problem *problem, const lm_task tasks[], int count,
                       int (*skip)(void *context, int id), lm_answer_sink sink, void *context,
                       const volatile int *stop);

/* Compute figures and margins of measured[count]. */
void lm_measure_designs(lm_pool *pool, const lm_problem *problem, lm_measured measured[],
                        int count);

#ifdef __cplusplus
}
#endif

#endif
