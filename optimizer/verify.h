/* Verification: whole grades, and no violation between the angles of the scan and between the
 * phases.
 */
#ifndef LOSTMOTION_OPTIMIZER_VERIFY_H
#define LOSTMOTION_OPTIMIZER_VERIFY_H

#include "subproblem.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Rounds grades one after the other, in the order of the spec, each to the better of its neighbours
 * while the other variables are optimised. Then the gaps between the angles of the scan, and limits
 * of figures at the phases of the certificate. */
void lm_verify_design(lm_task_state *s, const lm_task *task);

/* The design with its grades rounded to the nearest, all down and all up, evaluated as in the
 * search. */
void lm_round_design(lm_task_state *s, const lm_task *task);

/* The design unchanged, or with its gap opened if it is too small between the angles of the scan:
 * kept if it holds there and between the phases. */
void lm_confirm_design(lm_task_state *s, const lm_task *task);

/* Whether every integer range has an integer value. */
int lm_has_whole_grades(const lm_problem *p, const double unit[]);

/* Designs of the answer that need no verification are marked as verified. */
void lm_mark_verified(lm_task_state *s);

#ifdef __cplusplus
}
#endif

#endif
