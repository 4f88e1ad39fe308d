/* The subproblem of a local solver, and its runs. */
#ifndef LOSTMOTION_OPTIMIZER_SUBPROBLEM_H
#define LOSTMOTION_OPTIMIZER_SUBPROBLEM_H

#include "task_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A row is a place in the result; LM_RESULT_MAX + place: a branch of a figure against its limit or
 * the bound of the scalarised objective; the value and its derivatives by the ranges. */
typedef struct lm_row_kind {
  double scale; /* row = result / scale - shift, with the reserve */
  double shift;
} lm_row_kind;

/* Limits on figures and bounds of the scalarised objective; then single rows; then the gaps, all or
 * those near. */
void lm_choose_rows(lm_task_state *s, int all);

/* Place in the result, and scale and shift of a row. */
int lm_resolve_row(const lm_task_state *s, int row, lm_row_kind *kind);

/* The limit that a chosen row belongs to. */
int lm_limit_of_row(const lm_task_state *s, int row);

/* The point of a solver's variables. */
void lm_spread_unit(const lm_task_state *s, const double x[], double unit[]);

/* Create NLopt's optimizer in s->running. Return 0 if there is no memory for it: NLopt's functions
 * do not accept the null pointer. */
int lm_open_solver(lm_task_state *s, nlopt_algorithm algorithm, unsigned variables);

/* Run s->running from x and destroy it. prepared: the result of the calls that allocate memory in
 * it; if negative, it is not run. */
void lm_run_solver(lm_task_state *s, nlopt_result prepared, double x[]);

/* Gradients, on the epigraph of the scalarised objective. */
void lm_run_slsqp(lm_task_state *s, const double start[]);

/* A method without derivatives, with the largest limits of each group. */
void lm_run_plain(lm_task_state *s, const double start[], nlopt_algorithm algorithm, double step,
                  uint64_t seed);

#ifdef __cplusplus
}
#endif

#endif
