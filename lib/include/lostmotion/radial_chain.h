/* The radial chain: equations (2), (3), (4) of Timofeev, Kostikov and Barbashov (2015), one named
 * function for each. Bearing, wave generator and rigid gear deflect radially under the force of a
 * lobe; the wedge angle of the flanks converts this to a rotation.
 *
 * "Lobe" is one of the two engagement zones; a lobe carries half the torque.
 * Units: mm, N, MPa, rad; torque N m on the OUTPUT shaft.
 *
 * Every function returns a status. On an error the output is unchanged and `fault` (which may be
 * null) names the input, the value found and the range. LM_NULL: a required pointer is null;
 * LM_NOT_FINITE: NaN or infinity; LM_OUT_OF_RANGE: outside the range stated here. Ranges that are
 * not stated with the function:
 *   length, radius, width, thickness  1e-4 .. 1e4 mm
 *   force |F| <= 1e7 N, torque |T| <= 1e6 N m
 *   radial displacement or gap of a lobe |x| <= 100 mm
 *   flank angle 0 .. 1.4 rad (80 deg)
 *   modulus 1 .. 1e7 MPa, Poisson ratio 0 .. 0.49
 * All functions are pure: reentrant, no memory of their own. In float32 the results agree
 * with float64 within 2e-6 relative, a radial approach within 2e-6 of the approach at
 * preload plus load. */
#ifndef LOSTMOTION_RADIAL_CHAIN_H
#define LOSTMOTION_RADIAL_CHAIN_H

#include "lostmotion/real.h"
#include "lostmotion/status.h"

LM_BEGIN_DECLS

/* One member of the radial chain: a force-approach law  c F^n  at the force
 *   F = preload + share * (radial force of the lobe).
 * share may be negative for a member that the load relieves. */
typedef struct lm_radial_law {
  lm_real coefficient_mm_per_Nn; /* c, 0 .. 1 */
  lm_real exponent;              /* n, 0.25 .. 2; 2/3 balls, 0.9 rollers, 1 springs */
  lm_real share;                 /* force on the member / radial force of the lobe, -1 .. 1 */
  lm_real preload_N;             /* Q0, force at zero torque, 0 .. 1e6 */
} lm_radial_law;

/* Below this force the slope of a law is finite: c F^n with n < 1 has an unbounded slope at zero,
 * which does not occur in real bearings (roughness, own weight) and which no solver can handle.
 * With s = F / floor the law is c floor^n [(2-n) s - (1-n) s^2] for 0 <= s < 1: value and slope
 * join c F^n at s = 1, the slope at zero is (2-n) c floor^(n-1). For a 4 mm ball the whole zone
 * spans 0.06 um, 0.2 arcsec on a size 20. n = 1 is not changed. A preload of zero is allowed. */
#define LM_RADIAL_FORCE_FLOOR_N 0.1

/* Ball between two grooves, both contacts together, in mm and N: c = coefficient D^(-1/3) /
 * cos(contact angle), n = 2/3. Palmgren's 0.002 mm with kgf is 4.36e-4. */
#define LM_BALL_PALMGREN 4.36e-4
#define LM_BALL_SELF_ALIGNING 6.98e-4
#define LM_BALL_THRUST 5.24e-4

/* Checks that `count` laws (0 .. 64; `laws` may be null if 0) are in their ranges; the fault names
 * "radial_chain.exponent" and so on. */
lm_status lm_check_radial_laws(const lm_radial_law *laws, int count, lm_fault *fault);

/* Hertz coefficient of a ball by groove conformity f = groove radius / ball diameter, 0.515 ..
 * 0.54: 4.24 / 4.53 / 4.97 / 5.29 e-4 at 0.515 / 0.52 / 0.53 / 0.54, linear between. */
lm_status lm_ball_hertz_coefficient(lm_real conformity, lm_real *coefficient, lm_fault *fault);

/* Ball: diameter 0.1 .. 200 mm, contact angle 0 .. 1.2 rad, coefficient 1e-4 .. 1e-3 (one of the
 * above), share and preload of the most loaded ball as in lm_radial_law. */
lm_status lm_make_ball_law(lm_real ball_diameter_mm, lm_real contact_angle_rad, lm_real coefficient,
                           lm_real share, lm_real preload_N, lm_radial_law *law, lm_fault *fault);

/* Roller between two rings, both line contacts: 7.68e-5 Q^0.9 l^-0.8; roller length 0.1 .. 500. */
lm_status lm_make_roller_law(lm_real roller_length_mm, lm_real share, lm_real preload_N,
                             lm_radial_law *law, lm_fault *fault);

/* Crowned roller, one line and one point contact: 1.81e-4 Q^(3/4) l^(-1/2). */
lm_status lm_make_crowned_roller_law(lm_real roller_length_mm, lm_real share, lm_real preload_N,
                                     lm_radial_law *law, lm_fault *fault);

/* Linear spring (disc, cam, hub, housing): stiffness 1e-6 .. 1e15 N/mm; a solid steel disc has more
 * than 2e5. */
lm_status lm_make_spring_law(lm_real stiffness_N_per_mm, lm_real share, lm_radial_law *law,
                             lm_fault *fault);

/* Eccentric shaft in bending under one disc, simply supported: a and b from the force to the
 * supports, F a^2 b^2 / (3 E I (a + b)), I = pi d^4 / 64. */
lm_status lm_make_shaft_bending_law(lm_real diameter_mm, lm_real a_mm, lm_real b_mm,
                                    lm_real youngs_modulus_MPa, lm_radial_law *law,
                                    lm_fault *fault);

/* Circular spline, uniform widening (Lame) under p = 2 F / (2 pi r_i b):
 * (p r_i / E) [(r_o^2 + r_i^2) / (r_o^2 - r_i^2) + nu]. LM_INCONSISTENT unless outer > inner. */
lm_status lm_make_rim_widening_law(lm_real inner_radius_mm, lm_real outer_radius_mm,
                                   lm_real width_mm, lm_real youngs_modulus_MPa,
                                   lm_real poisson_ratio, lm_radial_law *law, lm_fault *fault);

/* Circular spline, ovalisation by the two lobes: f F R^3 / (E I) / housing_factor, R mean radius,
 * I = width thickness^3 / 12, f by lm_ovalisation_factor. housing_factor 1 (free ring) .. 20; 2 ..
 * 4 when bolted into a housing. About 25 times the uniform widening. */
lm_status lm_make_rim_ovalisation_law(lm_real mean_radius_mm, lm_real thickness_mm,
                                      lm_real width_mm, lm_real patch_half_angle_rad,
                                      lm_real youngs_modulus_MPa, lm_real housing_factor,
                                      lm_radial_law *law, lm_fault *fault);

/* Ovalisation factor of a thin ring under two opposite forces, each spread as uniform radial
 * pressure over +-patch (0 .. 1.2 rad):
 *   f = (2 / pi) sum over n = 2, 4, ..128 of sin(n p) / (n sin p) / (n^2 - 1)^2,
 * 0.0744 / 0.0711 / 0.0624 / 0.0544 at 0 / 15 / 30 / 40 deg; the cut tail is below 1e-7. */
lm_status lm_ovalisation_factor(lm_real patch_half_angle_rad, lm_real *factor, lm_fault *fault);

typedef enum lm_bearing_kind {
  LM_BEARING_BALLS = 0,           /* 4.37 / (Z cos a), no clearance */
  LM_BEARING_BALLS_CLEARANCE = 1, /* 5 / (Z cos a), usual clearance */
  LM_BEARING_ROLLERS = 2          /* 4.08 / (Z cos a), no clearance */
} lm_bearing_kind;

/* Share of the most loaded rolling element of an ordinary bearing with rigid rings (bearing of a
 * disc or roller of the wave generator): elements 5 .. 200, contact angle 0 .. 1.2 rad. The result
 * is at most 1. */
lm_status lm_bearing_share(lm_bearing_kind kind, int elements, lm_real contact_angle_rad,
                           lm_real *share, lm_fault *fault);

/* Share of the most loaded ball of a thin flexible bearing on a cam: 0.35 at 5 balls in a lobe,
 * 0.25 at 7, linear between; 5 .. 7 (not an integer in general: the mean over a ball passage). */
lm_status lm_cam_bearing_share(lm_real balls_in_lobe, lm_real *share, lm_fault *fault);

/* Radial force of ONE lobe: |T| / (2 r) tan(flank angle - friction angle), N. The friction angle is
 * positive while loading (the flexspline slides out of mesh), negative while unloading; both sum
 * and difference with the flank angle must stay in 0 .. 1.4. The force has the same sign for both
 * torque directions: both flanks push the teeth apart. */
lm_status lm_lobe_radial_force(lm_real torque_Nm, lm_real radius_mm, lm_real flank_angle_rad,
                               lm_real friction_angle_rad, lm_real *force_N, lm_fault *fault);

/* Equation (2): radial approach of the chain beyond its preload, and its derivative by the radial
 * force of the lobe:
 *   Delta_p = sum [law(Q0 + share F) - law(Q0)].
 * A member that has lifted off (Q0 + share F < 0) keeps its position at zero force, slope 0. The
 * same lobe force acts on all members. count 0 .. 64 gives 0 for 0. Cost: two powers a law. */
lm_status lm_sum_radial(lm_real lobe_force_N, const lm_radial_law *laws, int count,
                        lm_real *approach_mm, lm_real *slope_mm_per_N, lm_fault *fault);

/* Equation (3): tangential from radial displacement, Delta_t = Delta_p tan(flank angle). The flank
 * angle is the one at the contact, 22 .. 27 deg, not the 20 deg of the rack. */
lm_status lm_radial_to_tangential(lm_real radial_mm, lm_real flank_angle_rad,
                                  lm_real *tangential_mm, lm_fault *fault);

/* Equation (4): output rotation from radial displacement, Delta_p tan(flank angle) / r; r midway
 * between both tip circles. */
lm_status lm_radial_compliance_angle(lm_real radial_mm, lm_real flank_angle_rad, lm_real radius_mm,
                                     lm_real *angle_rad, lm_fault *fault);

LM_END_DECLS

#endif
