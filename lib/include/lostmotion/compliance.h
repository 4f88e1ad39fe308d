/* The elastic members of a strain-wave drive and the radial gap: equations (2) to (9) of Timofeev,
 * Kostikov and Barbashov (2015), one named function for each.
 *
 * Units: mm, N, MPa, rad; torque at the public edge N m. Torque is the torque on the OUTPUT shaft.
 * "Lobe" is one of the two engagement zones; a lobe carries half the torque.
 *
 * Where the printed equations are wrong, these functions are right:
 *   (5)  G is 8e4 MPa (printed 8e9); a stiffness seen from the output carries the ratio twice
 *   (6)  the bending term carries the factor 12 of I = b (2x)^3 / 12
 *   (7)  the tooth displacement is along the force: delta / (r cos alpha)
 *   (9)  the gap closes gradually, (9a)
 *
 * Every function returns a status. On anything but LM_OK the output is untouched and `fault` (which
 * may be null) names the input, what was found and the range. LM_NULL: a required pointer is null;
 * LM_NOT_FINITE: NaN or infinity; LM_OUT_OF_RANGE: outside the range stated here. Ranges that are
 * not stated with the function:
 *   length, radius, width, thickness  1e-4 .. 1e4 mm
 *   force |F| <= 1e7 N, torque |T| <= 1e6 N m
 *   radial displacement or gap of a lobe |x| <= 100 mm
 *   flank angle 0 .. 1.4 rad (80 deg); where its tangent divides, from 0.01
 *   modulus 1 .. 1e7 MPa, Poisson ratio 0 .. 0.49
 *   stiffness 1e-6 .. 1e15 in its unit; ratio 1e-3 <= |u| <= 1e5
 * All functions are pure: reentrant, no memory of their own. In float32 the results agree with
 * float64 within 2e-6 relative, but for differences: a radial approach within 2e-6 of the approach
 * at preload plus load, an involute tooth as said there.
 */
#ifndef LOSTMOTION_COMPLIANCE_H
#define LOSTMOTION_COMPLIANCE_H

#include "lostmotion/real.h"
#include "lostmotion/status.h"

LM_BEGIN_DECLS

/* Steel. */
#define LM_STEEL_YOUNGS_MODULUS_MPA 2.1e5
#define LM_STEEL_SHEAR_MODULUS_MPA 8.0e4
#define LM_STEEL_POISSON_RATIO 0.3

/* ---- Radial chain: equations (2), (3), (4) ------------------------------------------------ */

/* One member of the radial chain: a force-approach law  c F^n  at the force
 *   F = preload + share * (radial force of the lobe).
 * share may be negative for a member that the load relieves. */
typedef struct lm_radial_law {
  lm_real coefficient_mm_per_Nn; /* c, 0 .. 1 */
  lm_real exponent;              /* n, 0.25 .. 2; 2/3 balls, 0.9 rollers, 1 springs */
  lm_real share;                 /* force on the member / radial force of the lobe, -1 .. 1 */
  lm_real preload_N;             /* Q0, force at zero torque, 0 .. 1e6 */
} lm_radial_law;

/* Below this force a law runs into zero with a finite slope: c F^n with n < 1 has an unbounded
 * slope at zero, which no bearing shows (roughness, the parts' own weight) and no solver bears.
 * With s = F / floor the law is c floor^n [(2-n) s - (1-n) s^2] for 0 <= s < 1: value and slope
 * join c F^n at s = 1, the slope at zero is (2-n) c floor^(n-1). For a 4 mm ball the whole zone
 * spans 0.06 um, 0.2 arcsec on a size 20. n = 1 is not changed. A preload of zero is allowed. */
#define LM_RADIAL_FORCE_FLOOR_N 0.1

/* Ball between two grooves, both contacts together, in mm and N: c = coefficient D^(-1/3) /
 * cos(contact angle), n = 2/3. Palmgren's 0.002 mm with kgf is 4.36e-4. */
#define LM_BALL_PALMGREN 4.36e-4
#define LM_BALL_SELF_ALIGNING 6.98e-4
#define LM_BALL_THRUST 5.24e-4

/* Whether `count` laws (0 .. 64; `laws` may be null when 0) lie in their ranges; the fault names
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
 * disc or roller of the generator): elements 5 .. 200, contact angle 0 .. 1.2 rad. The result is at
 * most 1. */
lm_status lm_bearing_share(lm_bearing_kind kind, int elements, lm_real contact_angle_rad,
                           lm_real *share, lm_fault *fault);

/* Share of the most loaded ball of a thin flexible bearing on a cam: 0.35 at 5 balls in a lobe,
 * 0.25 at 7, linear between; 5 .. 7 (not an integer in general: the mean over a ball passage). */
lm_status lm_cam_bearing_share(lm_real balls_in_lobe, lm_real *share, lm_fault *fault);

/* Radial force of ONE lobe: |T| / (2 r) tan(flank angle - friction angle), N. The friction angle is
 * positive while loading (the flexspline slides out of mesh), negative while unloading; both sum
 * and difference with the flank angle must stay in 0 .. 1.4. The force does not change sign with
 * the torque: either flank pushes the teeth apart. */
lm_status lm_lobe_radial_force(lm_real torque_Nm, lm_real radius_mm, lm_real flank_angle_rad,
                               lm_real friction_angle_rad, lm_real *force_N, lm_fault *fault);

/* Equation (2): radial approach of the chain beyond its preload, and its derivative by the radial
 * force of the lobe:
 *   Delta_p = sum [law(Q0 + share F) - law(Q0)].
 * A member that has lifted off (Q0 + share F < 0) stays where it was at zero force, slope 0. All
 * members feel the same lobe force. count 0 .. 64 gives 0 for 0. Cost: two powers a law. */
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

/* ---- Torsion chain: equation (5) ----------------------------------------------------------- */

/* One member in torsion and the ratio between it and the output: turns of the member for one turn
 * of the output (input shaft: the drive's ratio; cup and output shaft: 1; sign irrelevant). */
typedef struct lm_torsion_element {
  lm_real stiffness_Nm_per_rad; /* K at the member itself */
  lm_real ratio;                /* u */
} lm_torsion_element;

/* Whether `count` elements (0 .. 64; may be null when 0) lie in their ranges; the fault names
 * "torsion_chain.stiffness_Nm_per_rad" or "torsion_chain.ratio". */
lm_status lm_check_torsion_elements(const lm_torsion_element *elements, int count, lm_fault *fault);

/* Round shaft: K = G pi (D^4 - d^4) / (32 l). bore 0 = solid. LM_INCONSISTENT unless bore < outer.
 */
lm_status lm_make_shaft_torsion(lm_real outer_diameter_mm, lm_real bore_mm, lm_real length_mm,
                                lm_real shear_modulus_MPa, lm_real ratio,
                                lm_torsion_element *element, lm_fault *fault);

/* Cup cylinder: K = G J / l, J = 2 pi r s (r^2 + s^2 / 4), exact for every wall s < 2 r
 * (LM_INCONSISTENT otherwise); r mean radius. Ratio 1. */
lm_status lm_make_shell_torsion(lm_real mean_radius_mm, lm_real wall_mm, lm_real length_mm,
                                lm_real shear_modulus_MPa, lm_torsion_element *element,
                                lm_fault *fault);

/* Diaphragm (cup bottom) in in-plane shear between hub radius a and outer radius r:
 * K = 4 pi G h / (a^-2 - r^-2). LM_INCONSISTENT unless a < r. Ratio 1. */
lm_status lm_make_diaphragm_torsion(lm_real hub_radius_mm, lm_real outer_radius_mm,
                                    lm_real thickness_mm, lm_real shear_modulus_MPa,
                                    lm_torsion_element *element, lm_fault *fault);

/* Locked input (motor, brake) of stiffness K_l at the input shaft; adds T / (u^2 K_l). */
lm_status lm_make_input_lock(lm_real stiffness_Nm_per_rad, lm_real ratio,
                             lm_torsion_element *element, lm_fault *fault);

/* Equation (5): wind-up at the output, T sum 1 / (K u^2). One factor 1/u is the torque in the
 * member, the other its angle seen from the output. count 0 .. 64 gives 0 for 0. compliance is
 * angle / T, rad per N m. */
lm_status lm_sum_torsion(lm_real torque_Nm, const lm_torsion_element *elements, int count,
                         lm_real *angle_rad, lm_real *compliance_rad_per_Nm, lm_fault *fault);

/* ---- Teeth: equations (6), (7) ------------------------------------------------------------- */

/* Elastic constants of a tooth. plane_strain 1: a tooth wider than high, E / (1 - nu^2) in bending;
 * 0: as in the paper. */
typedef struct lm_tooth_material {
  lm_real youngs_modulus_MPa;
  lm_real shear_modulus_MPa;
  lm_real poisson_ratio;
  int plane_strain;
} lm_tooth_material;

/* Steel, plane stress (as the paper). */
lm_tooth_material lm_steel_tooth_material(void);

/* Displacement of the contact point along the force, for one newton: the three terms of (6). */
typedef struct lm_tooth_compliance {
  lm_real bending_mm_per_N;
  lm_real shear_mm_per_N;
  lm_real axial_mm_per_N;
  lm_real total_mm_per_N;
} lm_tooth_compliance;

/* Equation (6) for a rectangular tooth, the check case of the theory: 0.5 mm high and thick, 10 mm
 * wide, 20 deg, steel: 1.681947e-6 + 1.324533e-6 + 5.5704e-8 = 3.062184e-6 mm/N.
 * load angle -0.5 .. 1.4 rad: between the force and the normal of the tooth's centre line. */
lm_status lm_tooth_rectangle_compliance(lm_real height_mm, lm_real thickness_mm,
                                        lm_real face_width_mm, lm_real load_angle_rad,
                                        const lm_tooth_material *material,
                                        lm_tooth_compliance *compliance, lm_fault *fault);

/* Equation (6) for any profile,
 *   delta / P = integral 0 .. y0 [12 (y0-y)^2 cos^2 a / (E b (2x)^3) + 1.2 cos^2 a / (2x G b)
 *                                 + sin^2 a / (2x E b)] dy.
 * height_mm[count] rises from 0 at the root (LM_NOT_MONOTONE, LM_OUT_OF_RANGE), half_thickness_mm
 * is x at these heights, straight between; count 2 .. 4096; load height y0 within the samples. */
lm_status lm_tooth_profile_compliance(const lm_real *height_mm, const lm_real *half_thickness_mm,
                                      int count, lm_real load_height_mm, lm_real face_width_mm,
                                      lm_real load_angle_rad, const lm_tooth_material *material,
                                      lm_tooth_compliance *compliance, lm_fault *fault);

typedef enum lm_tooth_side {
  LM_TOOTH_OUTWARD = 0, /* external gear: the tooth points outward */
  LM_TOOTH_INWARD = 1   /* internal gear: the tooth points inward */
} lm_tooth_side;

/* An involute tooth. Half angle of the TOOTH at radius R: base_half_angle - inv (outward) or + inv
 * (inward), inv = tan(acos(base / R)) - acos(base / R); below the base circle it goes on radially
 * with the base half angle. No fillet: the root is as thick as the flank makes it. */
typedef struct lm_involute_tooth {
  lm_tooth_side side;
  lm_real base_radius_mm;
  lm_real base_half_angle_rad;
  lm_real root_radius_mm;
} lm_involute_tooth;

/* Tooth of a gear: module 0.01 .. 100, teeth 10 .. 2000, profile shift -20 .. 20, rack angle 0.1 ..
 * 0.8 rad. The sum pi/(2z) + 2 x tan(a)/z + inv(a) is the base half angle of an outward tooth and
 * of the SPACE of an internal gear, whose tooth has pi/z less that sum. LM_INCONSISTENT when the
 * tooth has no thickness at the root. */
lm_status lm_make_involute_tooth(lm_tooth_side side, lm_real module_mm, int teeth, lm_real shift,
                                 lm_real pressure_angle_rad, lm_real root_radius_mm,
                                 lm_involute_tooth *tooth, lm_fault *fault);

/* Angle between the force on the involute at this radius and the normal of the tooth's centre line:
 * acos(base / R) - half angle (outward), + half angle (inward). Radius from the base circle on. */
lm_status lm_involute_load_angle(const lm_involute_tooth *tooth, lm_real radius_mm,
                                 lm_real *angle_rad, lm_fault *fault);

/* Equation (6) for an involute tooth, from the root to the loaded radius. The loaded radius lies
 * beyond the root on the tooth's side (LM_OUT_OF_RANGE "loaded_radius_mm"), where the tooth still
 * has thickness (LM_INCONSISTENT). Gauss-Legendre, 32 points on each side of the base circle:
 * relative error below 1e-9 for teeth at least 0.25 modules thick where loaded (float32: 3e-5, the
 * rounding of the radii). Thickness is taken along the arc. Cost: 64 square roots and arc tangents.
 */
lm_status lm_involute_tooth_compliance(const lm_involute_tooth *tooth, lm_real loaded_radius_mm,
                                       lm_real face_width_mm, lm_real load_angle_rad,
                                       const lm_tooth_material *material,
                                       lm_tooth_compliance *compliance, lm_fault *fault);

/* Tilt of the tooth in its rim (Weber, Cornell, plane strain), mm/N along the force:
 *   cos^2 a (1-nu^2) / (b E) [5.306 (l/h)^2 + 2 (1-nu-2nu^2)/(1-nu^2) l/h
 *                             + 1.534 (1 + 0.4167 tan^2 a / (1+nu))],
 * l height of the load over the root, h thickness of the root. */
lm_status lm_foundation_compliance(lm_real load_height_mm, lm_real root_thickness_mm,
                                   lm_real face_width_mm, lm_real load_angle_rad,
                                   const lm_tooth_material *material, lm_real *compliance_mm_per_N,
                                   lm_fault *fault);

/* The same for an involute tooth: l and h from its root and loaded radius. */
lm_status lm_involute_foundation_compliance(const lm_involute_tooth *tooth,
                                            lm_real loaded_radius_mm, lm_real face_width_mm,
                                            lm_real load_angle_rad,
                                            const lm_tooth_material *material,
                                            lm_real *compliance_mm_per_N, lm_fault *fault);

/* Half width of a Hertz line contact of two bodies of one steel: sqrt(8 P R (1-nu^2) / (pi b E)),
 * R = relative radius of curvature, P >= 0 in N. */
lm_status lm_line_contact_half_width(lm_real force_N, lm_real relative_radius_mm,
                                     lm_real face_width_mm, const lm_tooth_material *material,
                                     lm_real *half_width_mm, lm_fault *fault);

/* Approach of two bodies in line contact, mm/N: 2 (1-nu^2) / (pi E b) [ln(4 h1 h2 / a^2)
 * - nu / (1-nu)], h depth to the tooth's centre line, a half width of the contact
 * (LM_INCONSISTENT unless a <= h1 and a <= h2). Near-conformal flanks have a wide contact and
 * hardly any of it. */
lm_status lm_line_contact_compliance(lm_real depth1_mm, lm_real depth2_mm, lm_real half_width_mm,
                                     lm_real face_width_mm, const lm_tooth_material *material,
                                     lm_real *compliance_mm_per_N, lm_fault *fault);

/* Equation (7) put right: output rotation for a displacement delta along the tooth force,
 * delta / (r cos(flank angle)), from T dphi = P delta with T = P r cos(flank angle). */
lm_status lm_tooth_bending_angle(lm_real deflection_mm, lm_real radius_mm, lm_real flank_angle_rad,
                                 lm_real *angle_rad, lm_fault *fault);

/* ---- Radial gap: equations (8), (9), (9a) -------------------------------------------------- */

/* Equation (8): Delta_0 = Delta_0' (generator to flexspline) + Delta_0'' (tooth profiles), both on
 * the deformation axis, each 0 .. 100 mm. A negative sum of deviations is clipped to 0 before it
 * comes here (tolerance.h). */
lm_status lm_radial_gap_sum(lm_real generator_gap_mm, lm_real teeth_gap_mm, lm_real *gap_mm,
                            lm_fault *fault);

/* Equation (9): full rotation of the closed gap in ONE direction, gap tan(flank angle) / r; a
 * reversal sees twice that. 20 um, 26 deg, 26.4 mm: 3.694944e-4 rad. */
lm_status lm_radial_gap_angle(lm_real gap_mm, lm_real flank_angle_rad, lm_real radius_mm,
                              lm_real *angle_rad, lm_fault *fault);

/* Ring opened by two opposite forces, per lobe: c_s E I / (0.0744 r_m^3), N/mm, I = width
 * thickness^3 / 12. stiffening c_s 1 (bare rim) .. 20; 2 .. 5 for cup and bearing race. */
lm_status lm_ring_stiffness(lm_real mean_radius_mm, lm_real thickness_mm, lm_real width_mm,
                            lm_real youngs_modulus_MPa, lm_real stiffening,
                            lm_real *stiffness_N_per_mm, lm_fault *fault);

/* Equation (9a): torque that closes the gap, T0 = 2 r k gap / tan(flank angle), N m. */
lm_status lm_gap_closing_torque(lm_real gap_mm, lm_real radius_mm, lm_real ring_stiffness_N_per_mm,
                                lm_real flank_angle_rad, lm_real *torque_Nm, lm_fault *fault);

/* Equation (9a): rotation at a torque, sgn(T) min(|T| / T0, 1) full_angle. T0 = 0: sgn(T)
 * full_angle, 0 at T = 0. closing torque 0 .. 1e6, full angle 0 .. 1 rad. */
lm_status lm_gap_rotation(lm_real torque_Nm, lm_real closing_torque_Nm, lm_real full_angle_rad,
                          lm_real *angle_rad, lm_fault *fault);

/* Its smooth twin, tanh(T / T0) full_angle: the same slope at zero and the same limits; the largest
 * difference, at T = T0, is 24 % of the full angle. */
lm_status lm_gap_rotation_smooth(lm_real torque_Nm, lm_real closing_torque_Nm,
                                 lm_real full_angle_rad, lm_real *angle_rad, lm_fault *fault);

LM_END_DECLS

#endif
