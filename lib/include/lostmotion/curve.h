/* The torsion curve on the controller: monotone and piecewise linear.
 *
 * angle(torque) runs through up to LM_CURVE_POINTS_MAX knots over both signs of torque and
 * continues beyond the first and last knot with the slope of the end segment. Slopes are cached:
 * one evaluation is a search of fixed length, one multiplication and two additions.
 *
 * Cost: log2(LM_CURVE_POINTS_MAX) comparisons, always the same number. All functions are pure and
 * reentrant. Memory: three numbers per knot.
 */
#ifndef LOSTMOTION_CURVE_H
#define LOSTMOTION_CURVE_H

#include <stdint.h>

#include "lostmotion/profile.h"
#include "lostmotion/real.h"
#include "lostmotion/status.h"
#include "lostmotion/symbols.h"

LM_BEGIN_DECLS

/* Length of the arrays: one more than a power of two, so that the search needs no bounds check. */
#if LM_CURVE_POINTS_MAX <= 17
#define LM_CURVE_STORE 17
#elif LM_CURVE_POINTS_MAX <= 33
#define LM_CURVE_STORE 33
#else
#define LM_CURVE_STORE 65
#endif

/* Made by lm_build_curve or by `lostmotion export`; the functions that evaluate it do not check it.
 * Entries from `count` on repeat the last knot; the search relies on this. */
typedef struct lm_curve {
  int32_t count;                            /* knots, 2 to LM_CURVE_POINTS_MAX */
  lm_real torque_Nm[LM_CURVE_STORE];        /* strictly rising */
  lm_real angle_rad[LM_CURVE_STORE];        /* not falling */
  lm_real slope_rad_per_Nm[LM_CURVE_STORE]; /* of the segment that starts at the knot */
} lm_curve;

/* Builds a curve through `count` knots.
 *
 * torque_Nm[count]: strictly rising, at most LM_CURVE_TORQUE_MAX_NM in size. angle_rad[count]: not
 * falling (strictly rising where lm_invert_curve is to be exact), at most LM_CURVE_ANGLE_MAX_RAD in
 * size, by at most LM_CURVE_SLOPE_MAX. count: 2 to LM_CURVE_POINTS_MAX.
 * Errors: LM_NULL; LM_OUT_OF_RANGE; LM_NOT_FINITE; LM_NOT_MONOTONE. The fault names "count",
 * "torque_Nm", "angle_rad" or "slope_rad_per_Nm". */
lm_status lm_build_curve(lm_curve *curve, const lm_real *torque_Nm, const lm_real *angle_rad,
                         int32_t count, lm_fault *fault) LM_SIZED(lm_build_curve);

/* Checks a curve from an external source (flash, a file): the knots as lm_build_curve does, the
 * entries after the last knot, and the cached slopes against the knots (relative
 * LM_CURVE_SLOPE_TOLERANCE, so that slopes written with nine digits pass in both precisions).
 * Errors: as lm_build_curve; LM_INCONSISTENT with the fault "slope_rad_per_Nm" or "padding". */
lm_status lm_check_curve(const lm_curve *curve, lm_fault *fault);

/* Limits that prevent overflow in float: a torque within its limit plus operators of the widest
 * permitted bands stays below 1e9 N*m; times the steepest slope that is below 1e18 rad, so that
 * every sum and difference of two such numbers is finite. */
#define LM_CURVE_TORQUE_MAX_NM LM_REAL(1e9)
#define LM_CURVE_ANGLE_MAX_RAD LM_REAL(1e3)
#define LM_CURVE_SLOPE_MAX LM_REAL(1e9)

/* Nine decimal digits represent a float exactly; the quotient of two rounded differences is
 * accurate to five. */
#define LM_CURVE_SLOPE_TOLERANCE LM_REAL(1e-4)

/* Angle [rad] at a torque [N*m]. Beyond the knots the end segments continue as straight lines.
 * NaN or infinity gives a result that is not finite; the search stays inside the arrays. */
lm_real lm_evaluate_curve(const lm_curve *curve, lm_real torque_Nm);

/* Slope [rad/(N*m)] at a torque; at a knot, the slope of the segment above it. */
lm_real lm_evaluate_curve_slope(const lm_curve *curve, lm_real torque_Nm);

/* Torque [N*m] at an angle [rad]: the inverse of lm_evaluate_curve, exact to rounding where the
 * angle rises strictly. On a flat segment it returns the upper end; on a flat end segment, and
 * beyond it, the lower end. */
lm_real lm_invert_curve(const lm_curve *curve, lm_real angle_rad);

/* Smallest and largest slope [rad/(N*m)] of all segments. */
lm_real lm_find_least_slope(const lm_curve *curve);
lm_real lm_find_greatest_slope(const lm_curve *curve);

LM_END_DECLS

#endif
