/* Combinations that need no search: if the best corner of the box violates a limit, every design
 * does.
 */
#ifndef LOSTMOTION_OPTIMIZER_BOUNDS_H
#define LOSTMOTION_OPTIMIZER_BOUNDS_H

#include "problem.h"

#ifdef __cplusplus
extern "C" {
#endif

/* 1: no design of the combination can keep all limits; *limit: the lm_limit that it breaks, or -1:
 * no drive can be built. */
int lm_is_excluded(const lm_problem *problem, int combination, int *limit);

#ifdef __cplusplus
}
#endif

#endif
