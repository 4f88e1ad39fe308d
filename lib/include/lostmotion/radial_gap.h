/* The radial gap: equations (8) and (9) of Timofeev, Kostikov and Barbashov (2015), and (9a), the
 * torque that closes it, which the paper does not give.
 *
 * "Lobe" is one of the two engagement zones; a lobe carries half the torque.
 * Units: mm, N, MPa, rad; torque N m on the OUTPUT shaft.
 *
 * Every function returns a status. On an error the output is unchanged and `fault` (which may be
 * null) names the input, the value found and the range. LM_NULL: a required pointer is null;
 * LM_NOT_FINITE: NaN or infinity; LM_OUT_OF_RANGE: outside the range stated here. Ranges that are
 * not stated with the function:
 *   length, radius, width, thickness  1e-4 .. 1e4 mm
 *   torque |T| <= 1e6 N m
 *   radial displacement or gap of a lobe |x| <= 100 mm
 *   flank angle 0 .. 1.4 rad (80 deg); where its tangent divides, from 0.01
 *   Young's modulus 1 .. 1e7 MPa
 *   stiffness 1e-6 .. 1e15 in its unit
 * All functions are pure. In float32 the results agree with float64 within 2e-6 relative. */
#ifndef LOSTMOTION_RADIAL_GAP_H
#define LOSTMOTION_RADIAL_GAP_H

#include "lostmotion/real.h"
#include "lostmotion/status.h"

LM_BEGIN_DECLS

/* Equation (8): Delta_0 = Delta_0' (wave generator to flexspline) + Delta_0'' (tooth profiles),
 * both on the deformation axis, each 0 .. 100 mm. Negative sums of deviations must be clipped to 0
 * before (tolerance.h). */
lm_status lm_radial_gap_sum(lm_real generator_gap_mm, lm_real teeth_gap_mm, lm_real *gap_mm,
                            lm_fault *fault);

/* Equation (9): full rotation of the closed gap in ONE direction, gap tan(flank angle) / r; the
 * reversal lost motion is twice that. 20 um, 26 deg, 26.4 mm: 3.694944e-4 rad. */
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

/* Its smooth form, tanh(T / T0) full_angle: the same slope at zero and the same limits; the largest
 * difference, at T = T0, is 24 % of the full angle. */
lm_status lm_gap_rotation_smooth(lm_real torque_Nm, lm_real closing_torque_Nm,
                                 lm_real full_angle_rad, lm_real *angle_rad, lm_fault *fault);

LM_END_DECLS

#endif
