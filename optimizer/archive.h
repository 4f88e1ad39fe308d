/* Lists of Pareto-optimal designs. */
#ifndef LOSTMOTION_OPTIMIZER_ARCHIVE_H
#define LOSTMOTION_OPTIMIZER_ARCHIVE_H

#include "task.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A design of a point, with its objectives rounded; the rest of the arrays is zero, so that equal
 * designs are equal bytes. */
void lm_fill_solution(const lm_problem *problem, lm_solution *found, int combination,
                      const double unit[], const double objective[], double violation);

/* 1 when a is as good as b in every objective. */
int lm_is_as_good(const lm_problem *problem, const double a[], const double b[]);

/* Inserts a design unless one of the list is as good in every objective; returns 1 if inserted.
 * Dominated designs are removed. A full list drops the design nearest to the new one; the best of
 * each objective is kept if these are a small part of the list. */
int lm_insert_solution(const lm_problem *problem, lm_solution list[], int *count, int capacity,
                       const lm_solution *found);

/* Sort by the objectives in turn, then by the point: a unique order. */
void lm_sort_solutions(lm_solution list[], int count);

/* Choose `wanted` members of a population: feasible before infeasible, then front by front, then
 * the least crowded (Deb's NSGA-II). The chosen ones come first, best first. count <=
 * LM_POPULATION_MAX. */
#define LM_POPULATION_MAX 256
void lm_select_solutions(const lm_problem *problem, lm_solution list[], int count, int wanted);

/* 64 bits, each of which depends on every bit of x (splitmix64's finaliser). */
uint64_t lm_mix(uint64_t x);

#ifdef __cplusplus
}
#endif

#endif
