/* Results of designs that are verified, for the designs that have them in common. A front has
 * several designs of each geometry, and each of its designs is evaluated when its grades are
 * rounded, when it is confirmed, and for the results.
 */
#ifndef LOSTMOTION_OPTIMIZER_KNOWN_RESULTS_H
#define LOSTMOTION_OPTIMIZER_KNOWN_RESULTS_H

#include "lostmotion/checks.h"
#include "memo.h"
#include "points.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Of the threads of a pool; without one both are null, and nothing is known. */
typedef struct lm_known_results {
  lm_memo *gaps;   /* by the drive up to its tolerances */
  lm_memo *points; /* by combination and unit variables: result[] with the default scan */
} lm_known_results;

/* 0: out of memory. */
int lm_open_known_results(lm_known_results *known);
void lm_close_known_results(lm_known_results *known);

/* lm_find_face_gap on the grid of the certificate, without an evaluation if the geometry is known;
 * the bytes of the drive must have been zero before it was filled. */
lm_status lm_find_known_gap(const lm_known_results *known, const lm_drive *drive, lm_mesh meshes[],
                            lm_smallest_gap *smallest);

/* Keep result[LM_RESULT_MAX] of a point with the default scan. */
void lm_keep_result(const lm_known_results *known, const lm_problem *problem, int combination,
                    const double unit[], const double result[]);

/* lm_evaluate_point with the default scan, without an evaluation if the result is known to the
 * workspace; then lm_evaluate_tolerances must not follow. */
lm_status lm_find_known_result(const lm_problem *problem, const lm_scan *scan,
                               const lm_layout *layout, int combination, const double unit[],
                               double result[], lm_workspace *workspace);

#ifdef __cplusplus
}
#endif

#endif
