/* The stage that spends the rest of the budget: on directions between objectives, or for one
 * objective on restarts. A plan adds tasks
 * to the batch, or none when the stage is over. */
#ifndef LOSTMOTION_OPTIMIZER_TRADE_OFF_H
#define LOSTMOTION_OPTIMIZER_TRADE_OFF_H

#include "search_state.h"

#ifdef __cplusplus
extern "C" {
#endif

void lm_plan_restarts(lm_search *search);

/* Also restarts, as long as no feasible design is found. */
void lm_plan_front(lm_search *search);

/* Tasks for the extreme point of every axis, each from the best kept design; there must be one. */
void lm_add_extreme_points(lm_search *search);

/* Evaluates the ends of the front with every other open combination, whose end may be better: the
 * design at the end, transferred, with its gap closed; within this share of the budget. Returns the
 * number of tasks. */
int lm_add_end_looks(lm_search *search, double share);

/* Two objectives: a task of the solver, beside the population or in the verification. In turn the
 * first objective alone, from a point up to a whole range away from the best design of a
 * combination, and from a design of the front towards the inner corner of one of its steps. */
void lm_add_solver_task(lm_search *search, int kind, const lm_solution front[], int count,
                        int budget);

/* Origin and scale of a scalarised objective by the extreme points of the front. */
void lm_scale_objectives(const lm_search *search, lm_scalarisation *scalar);

#ifdef __cplusplus
}
#endif

#endif
