/* The torsion chain: equation (5) of Timofeev, Kostikov and Barbashov (2015). Shafts and cup wind
 * up. Corrections of the printed equation: G is 8e4 MPa (printed 8e9), and a stiffness referred to
 * the output has the square of the ratio.
 *
 * Units: mm, N, MPa, rad; torque N m on the OUTPUT shaft.
 *
 * Every function returns a status. On an error the output is unchanged and `fault` (which may be
 * null) names the input, the value found and the range. LM_NULL: a required pointer is null;
 * LM_NOT_FINITE: NaN or infinity; LM_OUT_OF_RANGE: outside the range stated here. Ranges that are
 * not stated with the function:
 *   length, radius, width, thickness  1e-4 .. 1e4 mm
 *   torque |T| <= 1e6 N m
 *   shear modulus 1 .. 1e7 MPa
 *   stiffness 1e-6 .. 1e15 in its unit; ratio 1e-3 <= |u| <= 1e5
 * All functions are pure. In float32 the results agree with float64 within 2e-6 relative. */
#ifndef LOSTMOTION_TORSION_CHAIN_H
#define LOSTMOTION_TORSION_CHAIN_H

#include "lostmotion/real.h"
#include "lostmotion/status.h"

LM_BEGIN_DECLS

/* One member in torsion and the ratio between it and the output: turns of the member for one turn
 * of the output (input shaft: the drive's ratio; cup and output shaft: 1; sign irrelevant). */
typedef struct lm_torsion_element {
  lm_real stiffness_Nm_per_rad; /* K at the member itself */
  lm_real ratio;                /* u */
} lm_torsion_element;

/* Checks that `count` elements (0 .. 64; may be null if 0) are in their ranges; the fault names
 * "torsion_chain.stiffness_Nm_per_rad" or "torsion_chain.ratio". */
lm_status lm_check_torsion_elements(const lm_torsion_element *elements, int count, lm_fault *fault);

/* Round shaft: K = G pi (D^4 - d^4) / (32 l). bore 0 = solid. LM_INCONSISTENT unless bore <
 * outer. */
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

LM_END_DECLS

#endif
