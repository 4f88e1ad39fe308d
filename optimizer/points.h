/* The space that is searched: names, defaults, combinations, and the evaluation of a point with and
 * without derivatives.
 *
 * A point is a combination of the choices and one number in 0 .. 1 for every range. All functions
 * are reentrant; any other data are in the workspace of the caller.
 */
#ifndef LOSTMOTION_OPTIMIZER_POINTS_H
#define LOSTMOTION_OPTIMIZER_POINTS_H

#include "lostmotion/drive.h"
#include "lostmotion/status.h"
#include "problem.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Cost of a gradient in plain evaluations for up to 8 ranges, and again for each further 8:
 * measured, see tests/benchmarks/bench_search.py. It is fixed, so that a budget means the same on
 * every machine. Ranges of tolerance grades do not count, because the contacts do not depend on
 * them, except with gap_at_worst_corner. */
#define LM_GRADIENT_CHARGE 8
int lm_slope_charge(const lm_problem *problem);

/* Number of tolerance-only evaluations of an evaluated design that are charged as one plain
 * evaluation: measured likewise, at the slowest level. */
#define LM_LOOKS_CHARGED 16

/* --- names; "" outside the list --- */

/* Dotted key: "teeth.module_mm", "tolerance.3.grade". text: at least LM_KEY_NAME_MAX characters. */
#define LM_KEY_NAME_MAX 40
void lm_write_key(int key, char text[LM_KEY_NAME_MAX]);
/* The key of a name, or -1. */
int lm_find_key(const char *name);
/* The key that states the same quantity in another way, or the key itself. */
int lm_rival_key(int key);
const char *lm_figure_name(int figure);
const char *lm_figure_unit(int figure);
int lm_find_figure(const char *name); /* also "stiffness"; -1: unknown */
/* Limits are named as the spec names them: "safety_factor_min", "lost_motion_max_arcmin". */
const char *lm_limit_name(int limit);

/* A row of evaluate.h as a share of its named limit: the search uses the inverse of a least value
 * (a stiffness, a torque, a life). > 0: required relaxation; other rows unchanged. */
double lm_share_of_limit(int limit, double row);

/* Whether a spec states the value of a limit; the others follow from the drive. */
int lm_is_set_by_spec(int limit);

/* --- the problem --- */

/* An empty problem: defaults of everything, nothing varied, no objective. */
void lm_start_problem(lm_problem *problem);

/* Check the problem and make what the evaluation needs (sampled deviations, default torque). Call
 * it once after the last change. The fault names the key as the spec does. LM_NULL,
 * LM_OUT_OF_RANGE, LM_INCONSISTENT (a key both chosen and ranged, low above high, a torque above
 * half the rated torque, kinematic error with fewer than 3 phases), LM_TOO_SMALL (more than
 * LM_COMBINATION_MAX combinations). */
lm_status lm_prepare_problem(lm_problem *problem, lm_fault *fault);

/* Product of the numbers of choices; -1 above LM_COMBINATION_MAX. */
int lm_count_combinations(const lm_problem *problem);

/* The value that a combination gives the choice number `choice`. */
double lm_chosen_value(const lm_problem *problem, int combination, int choice);

/* Add every even number of teeth whose ratio lies in low .. high as a choice of
 * teeth.flexspline_teeth. LM_OUT_OF_RANGE if there is none or too many. */
lm_status lm_choose_teeth_by_ratio(lm_problem *problem, double ratio_low, double ratio_high,
                                   lm_fault *fault);

/* --- evaluation --- */

/* Angles every 2 deg up to 84 deg and four about the junction of the contact zone, 24 nodes. */
void lm_default_scan(lm_scan *scan);

void lm_lay_out(const lm_problem *problem, const lm_scan *scan, lm_layout *layout);

/* Memory of one thread: sizeof a few MB, no pointers to keep. */
typedef struct lm_workspace lm_workspace;
lm_workspace *lm_create_workspace(void); /* null: out of memory */
void lm_free_workspace(lm_workspace *workspace);

/* A unit variable clipped to 0 .. 1. */
double lm_clip(double unit);

/* Figures and limits at a point, evaluate.h. LM_NOT_FINITE if any of them is not finite. */
lm_status lm_evaluate_point(const lm_problem *problem, const lm_scan *scan, const lm_layout *layout,
                            int combination, const double unit[], double result[],
                            lm_workspace *workspace, lm_fault *fault);

/* Whether lm_evaluate_tolerances may be used: not with gap_at_worst_corner. */
int lm_has_cheap_tolerances(const lm_problem *problem);

/* As lm_evaluate_point, except for the last bits, at a point that differs only in its tolerance
 * grades from that of this workspace and result[]: only results that depend on tolerances are
 * computed. After an error the next point must be evaluated completely.
 */
lm_status lm_evaluate_tolerances(const lm_problem *problem, const lm_layout *layout,
                                 int combination, const double unit[], double result[],
                                 lm_workspace *workspace, lm_fault *fault);

/* The same as lm_evaluate_point and the derivatives by each unit variable: slope[i * range_count +
 * k] = d result[i] / d unit[k]. */
lm_status lm_evaluate_slopes(const lm_problem *problem, const lm_scan *scan,
                             const lm_layout *layout, int combination, const double unit[],
                             double result[], double slope[], lm_workspace *workspace,
                             lm_fault *fault);

/* The values of all keys at a point, 0 for defaults of lm_complete_drive. */
void lm_point_values(const lm_problem *problem, int combination, const double unit[],
                     double value[LM_KEY_COUNT]);

/* The completed drive of a point. Errors as lm_check_drive. */
lm_status lm_point_drive(const lm_problem *problem, int combination, const double unit[],
                         lm_drive *drive, lm_fault *fault);

/* The largest branch of a figure. */
double lm_figure_of(const lm_layout *layout, const double result[], int figure);

/* The largest violation of all limits, those on figures included; <= 0: all hold. */
double lm_violation_of(const lm_problem *problem, const lm_layout *layout, const double result[]);

/* The same for only the limits that depend on tolerances, without gap_at_worst_corner.
 */
double lm_tolerance_violation_of(const lm_problem *problem, const lm_layout *layout,
                                 const double result[]);

/* The largest row of the side clearances; if < 0, all clearances may be reduced by that amount. */
double lm_gap_row_of(const lm_layout *layout, const double result[]);

/* Margin of the solvers to every scaled limit, for their tolerances and rounding. A design is
 * feasible if it violates no limit in the certificate and in `lostmotion predict`. */
#define LM_RESERVE 1e-6

/* Move the shift that moves all side clearances equally (rigid gear, internal deformation;
 * flexspline, external) so that they grow by so much (< 0: shrink). 0: nothing to move, or no such
 * range. Exact for internal deformation if no bound of the range is reached. */
int lm_open_gap(const lm_problem *problem, int combination, double by_arcmin, double unit[]);

/* The same by the amount that changes the smallest gap of result[], evaluated at this point, to the
 * smallest permitted gap plus the reserve. */
int lm_close_gap(const lm_problem *problem, const lm_layout *layout, int combination,
                 const double result[], double unit[]);

#ifdef __cplusplus
}
#endif

#endif
