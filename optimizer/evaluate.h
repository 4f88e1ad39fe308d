/* From a point of the search to figures and limits, in the number type of the build. The plain
 * build gives values; dual.h in place of lm_real gives their derivatives from the same source.
 */
#ifndef LOSTMOTION_OPTIMIZER_EVALUATE_H
#define LOSTMOTION_OPTIMIZER_EVALUATE_H

#include "lostmotion/drive.h"
#include "lostmotion/load_capacity.h"
#include "lostmotion/status.h"
#include "lostmotion/torsion_curve.h"
#include "problem.h"

LM_BEGIN_DECLS

/* The values of all keys at a point: fixed, chosen by the combination (mixed radix over the
 * choices, first choice fastest), and low + unit (high - low) for each range. */
void lm_fill_values(const lm_problem *problem, int combination, const lm_real unit[],
                    lm_real value[LM_KEY_COUNT]);

/* The drive of a point, completed and checked. LM_OUT_OF_RANGE, LM_INCONSISTENT as
 * lm_check_drive. */
lm_status lm_build_drive(const lm_problem *problem, const lm_real value[LM_KEY_COUNT],
                         lm_drive *drive, lm_fault *fault);

/* Updates the tolerance links of a built drive from the grades of value[]. LM_OUT_OF_RANGE:
 * a field that IT grades do not reach. */
lm_status lm_grade_drive(const lm_problem *problem, const lm_real value[LM_KEY_COUNT],
                         lm_drive *drive, lm_fault *fault);

/* Results of a tooth phase without radial gap: the total rotation at the stated torque backwards
 * and forwards, and at the rated torque. */
#define LM_GAPLESS_TORQUES 3
typedef struct lm_gapless {
  lm_mesh_state mesh;
  lm_real total_rad[LM_GAPLESS_TORQUES];
  lm_load load; /* at the rated torque */
} lm_gapless;

/* Figures and limits of a built drive into result[layout->count], by lm_lay_out.
 *  Figures in their units. Limits are scaled to g <= 0: lengths in modules, stresses in shares of
 *  the limit, gaps in arcmin. A pair without overlap counts -LM_GAP_FREE_ARCMIN.
 * gapless[problem->phases] is the input of lm_measure_tolerances. Errors of the model; then
 * result[] is not complete. */
lm_status lm_measure_drive(const lm_problem *problem, const lm_scan *scan, const lm_layout *layout,
                           const lm_real value[LM_KEY_COUNT], const lm_drive *drive,
                           lm_real result[], lm_gapless gapless[LM_PHASE_MAX],
                           lm_design_workspace *workspace, lm_fault *fault);

/* For a drive that differs from a measured one only in its tolerances: the figures of motion, cost
 * and interference. The rest of result[] is unchanged, because nothing else depends on tolerances.
 * Exception: the side clearances with gap_at_worst_corner, for which it must not be used. Errors as
 * lm_measure_drive. */
lm_status lm_measure_tolerances(const lm_problem *problem, const lm_layout *layout,
                                const lm_real value[LM_KEY_COUNT], const lm_drive *drive,
                                const lm_gapless gapless[LM_PHASE_MAX], lm_real result[],
                                lm_fault *fault);

#define LM_GAP_FREE_ARCMIN 10.0

LM_END_DECLS

#endif
