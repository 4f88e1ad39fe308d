/* The teeth themselves: equations (6) and (7) of Timofeev, Kostikov and Barbashov (2015). The
 * printed equations contain errors; the correct form is: (6)  the bending term carries the factor
 * 12 of I = b (2x)^3 / 12 (7)  the tooth displacement is along the force: delta / (r cos alpha)
 *
 * Units: mm, N, MPa, rad; torque N m on the OUTPUT shaft.
 *
 * Every function returns a status. On an error the output is unchanged and `fault` (which may be
 * null) names the input, the value found and the range. LM_NULL: a required pointer is null;
 * LM_NOT_FINITE: NaN or infinity; LM_OUT_OF_RANGE: outside the range stated here. Ranges that are
 * not stated with the function:
 *   length, radius, width, thickness  1e-4 .. 1e4 mm
 *   force |F| <= 1e7 N, torque |T| <= 1e6 N m
 *   flank angle 0 .. 1.4 rad (80 deg)
 *   modulus 1 .. 1e7 MPa, Poisson ratio 0 .. 0.49
 * All functions are pure. In float32 the results agree with float64 within 2e-6 relative, except
 * for involute teeth, see there. */
#ifndef LOSTMOTION_TOOTH_BENDING_H
#define LOSTMOTION_TOOTH_BENDING_H

#include "lostmotion/real.h"
#include "lostmotion/status.h"

LM_BEGIN_DECLS

/* Steel. */
#define LM_STEEL_YOUNGS_MODULUS_MPA 2.1e5
#define LM_STEEL_SHEAR_MODULUS_MPA 8.0e4
#define LM_STEEL_POISSON_RATIO 0.3

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

/* Equation (6) for an outline with a fillet by quadrature: half_thickness_mm[LM_TOOTH_SAMPLES] is x
 * at the heights lm_tooth_sample_height(i, fillet_share) y0, Gauss-Legendre panels of 16 points in
 * the fillet, the lowest fillet_share of y0 (0 .. 1), and on the flank above it. A jump of the
 * curvature inside a panel causes an error of 1e-5 relative, one of the slope 1e-4.
 * load_height_mm y0 > 0. */
#define LM_TOOTH_SAMPLES 32

/* sample 0 .. LM_TOOTH_SAMPLES - 1; share of y0. */
lm_real lm_tooth_sample_height(int sample, lm_real fillet_share);

lm_status lm_tooth_outline_compliance(const lm_real half_thickness_mm[LM_TOOTH_SAMPLES],
                                      lm_real fillet_share, lm_real load_height_mm,
                                      lm_real face_width_mm, lm_real load_angle_rad,
                                      const lm_tooth_material *material,
                                      lm_tooth_compliance *compliance, lm_fault *fault);

typedef enum lm_tooth_side {
  LM_TOOTH_OUTWARD = 0, /* external gear: the tooth points outward */
  LM_TOOTH_INWARD = 1   /* internal gear: the tooth points inward */
} lm_tooth_side;

/* An involute tooth. Half angle of the TOOTH at radius R: base_half_angle - inv (outward) or + inv
 * (inward), inv = tan(acos(base / R)) - acos(base / R); below the base circle it continues radially
 * with the base half angle. Without fillet: the thickness at the root is that of the flank. */
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

/* Equation (6) for an involute tooth, from the root to the loaded radius. The loaded radius
 * lies beyond the root on the tooth's side (LM_OUT_OF_RANGE "loaded_radius_mm"), where the
 * tooth still has thickness (LM_INCONSISTENT). Gauss-Legendre, 32 points on each side of
 * the base circle: relative error below 1e-9 for teeth at least 0.25 modules thick where
 * loaded (float32: 3e-5, the rounding of the radii). Thickness is taken along the arc.
 * Cost: 64 square roots and arc tangents. */
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
 * almost no approach. */
lm_status lm_line_contact_compliance(lm_real depth1_mm, lm_real depth2_mm, lm_real half_width_mm,
                                     lm_real face_width_mm, const lm_tooth_material *material,
                                     lm_real *compliance_mm_per_N, lm_fault *fault);

/* Equation (7), corrected: output rotation for a displacement delta along the tooth force,
 * delta / (r cos(flank angle)), from T dphi = P delta with T = P r cos(flank angle). */
lm_status lm_tooth_bending_angle(lm_real deflection_mm, lm_real radius_mm, lm_real flank_angle_rad,
                                 lm_real *angle_rad, lm_fault *fault);

LM_END_DECLS

#endif
