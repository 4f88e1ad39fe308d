#include "lostmotion/radial_gap.h"

#include "expect.h"
#include "lostmotion/radial_chain.h"
#include "test.h"

#define STEEL_E LM_REAL(2.1e5)

static lm_radial_law law;

void setUp(void) {
  forget_results();
}

TEST(both_gaps_add_up_and_neither_may_be_negative) {
  ACCEPTED(lm_radial_gap_sum(LM_REAL(0.004), LM_REAL(0.006), &out, &fault));
  close_to(0.010, out, 0);
  OUTSIDE("generator_gap_mm", lm_radial_gap_sum(LM_REAL(-0.001), 0, &out, fault_or_null));
  OUTSIDE("teeth_gap_mm", lm_radial_gap_sum(0, LM_REAL(-0.001), &out, fault_or_null));
  REFUSED(LM_NULL, "gap_mm", lm_radial_gap_sum(0, 0, 0, fault_or_null));
}

TEST(a_gap_of_20_um_is_76_arcsec) {
  /* check_values.md, radial gap, eq (9): 20 um, 26 deg, 26.4 mm: 3.694944e-4 rad = 76.214
   * arcsec. */
  ACCEPTED(lm_radial_gap_angle(LM_REAL(0.02), LM_REAL(26 * DEG), LM_REAL(26.4), &out, &fault));
  close_to(3.694944e-4, out, 1.3e-7);
  close_to(76.214 * ARCSEC, out, 7e-6);
  OUTSIDE("gap_mm", lm_radial_gap_angle(LM_REAL(-0.001), 0, 26, &out, fault_or_null));
  OUTSIDE("flank_angle_rad", lm_radial_gap_angle(1, LM_REAL(1.5), 26, &out, fault_or_null));
  OUTSIDE("radius_mm", lm_radial_gap_angle(1, 0, 0, &out, fault_or_null));
  REFUSED(LM_NULL, "angle_rad", lm_radial_gap_angle(1, 0, 26, 0, fault_or_null));
}

TEST(a_size_20_rim_needs_0_04_to_0_19_Nm_to_close_10_um) {
  /* check_values.md, radial gap, (9a): rim 0.6 x 12, k = 35.5 N/mm (r_m = 25.8, not printed),
   * stiffening 1
   * .. 5: 0.04 .. 0.19 N m, 38.1 arcsec at 26.4 mm, 26 deg. */
  lm_real k;
  ACCEPTED(lm_ring_stiffness(LM_REAL(25.8), LM_REAL(0.6), 12, STEEL_E, 1, &k, &fault));
  close_to(35.5, k, 1.4e-3);
  ACCEPTED(lm_gap_closing_torque(LM_REAL(0.01), LM_REAL(26.4), k, LM_REAL(26 * DEG), &out, &fault));
  TEST_ASSERT_DOUBLE_WITHIN(0.005, 0.04, (double)out);
  ACCEPTED(lm_ring_stiffness(LM_REAL(25.8), LM_REAL(0.6), 12, STEEL_E, 5, &k, &fault));
  ACCEPTED(lm_gap_closing_torque(LM_REAL(0.01), LM_REAL(26.4), k, LM_REAL(26 * DEG), &out, &fault));
  TEST_ASSERT_DOUBLE_WITHIN(0.005, 0.19, (double)out);
  ACCEPTED(lm_radial_gap_angle(LM_REAL(0.01), LM_REAL(26 * DEG), LM_REAL(26.4), &out, &fault));
  close_to(38.1 * ARCSEC, out, 1e-3);
}

TEST(the_ring_is_the_spring_of_its_ovalisation) {
  /* Both are derived from the thin ring under two point forces. */
  ACCEPTED(lm_make_rim_ovalisation_law(26, LM_REAL(0.6), 12, 0, STEEL_E, 1, &law, &fault));
  ACCEPTED(lm_ring_stiffness(26, LM_REAL(0.6), 12, STEEL_E, 1, &out, &fault));
  close_to(1.0, out * law.coefficient_mm_per_Nn, 1e-6);
}

TEST(ring_and_closing_torque_refuse_nonsense_by_name) {
  OUTSIDE("mean_radius_mm", lm_ring_stiffness(0, 1, 1, STEEL_E, 1, &out, fault_or_null));
  OUTSIDE("thickness_mm", lm_ring_stiffness(26, 0, 1, STEEL_E, 1, &out, fault_or_null));
  OUTSIDE("width_mm", lm_ring_stiffness(26, 1, 0, STEEL_E, 1, &out, fault_or_null));
  OUTSIDE("youngs_modulus_MPa", lm_ring_stiffness(26, 1, 1, 0, 1, &out, fault_or_null));
  OUTSIDE("stiffening", lm_ring_stiffness(26, 1, 1, STEEL_E, LM_REAL(0.5), &out, fault_or_null));
  REFUSED(LM_NULL, "stiffness_N_per_mm", lm_ring_stiffness(26, 1, 1, STEEL_E, 1, 0, fault_or_null));
  OUTSIDE("gap_mm", lm_gap_closing_torque(-1, 26, 35, LM_REAL(0.4), &out, fault_or_null));
  OUTSIDE("radius_mm", lm_gap_closing_torque(1, 0, 35, LM_REAL(0.4), &out, fault_or_null));
  OUTSIDE("ring_stiffness_N_per_mm",
          lm_gap_closing_torque(1, 26, 0, LM_REAL(0.4), &out, fault_or_null));
  OUTSIDE("flank_angle_rad", lm_gap_closing_torque(1, 26, 35, 0, &out, fault_or_null));
  REFUSED(LM_NULL, "torque_Nm", lm_gap_closing_torque(1, 26, 35, LM_REAL(0.4), 0, fault_or_null));
}

static lm_real rotation(lm_real torque, lm_real closing) {
  ACCEPTED(lm_gap_rotation(torque, closing, LM_REAL(2e-4), &out, &fault));
  return out;
}

static lm_real smooth_rotation(lm_real torque, lm_real closing) {
  ACCEPTED(lm_gap_rotation_smooth(torque, closing, LM_REAL(2e-4), &out, &fault));
  return out;
}

TEST(the_gap_closes_in_proportion_up_to_its_torque_and_stays_closed) {
  close_to(0, rotation(0, LM_REAL(0.1)), 0);
  close_to(1e-4, rotation(LM_REAL(0.05), LM_REAL(0.1)), 0);
  close_to(-1e-4, rotation(LM_REAL(-0.05), LM_REAL(0.1)), 0);
  close_to(2e-4, rotation(LM_REAL(0.1), LM_REAL(0.1)), 0);
  close_to(2e-4, rotation(5, LM_REAL(0.1)), 0);
  close_to(-2e-4, rotation(-5, LM_REAL(0.1)), 0);
}

TEST(a_gap_that_costs_no_torque_is_a_step) {
  close_to(0, rotation(0, 0), 0);
  close_to(2e-4, rotation(LM_REAL(1e-9), 0), 0);
  close_to(-2e-4, rotation(LM_REAL(-1e-9), 0), 0);
  close_to(0, smooth_rotation(0, 0), 0);
  close_to(2e-4, smooth_rotation(LM_REAL(1e-9), 0), 0);
  close_to(-2e-4, smooth_rotation(LM_REAL(-1e-9), 0), 0);
}

TEST(the_smooth_twin_is_the_hyperbolic_tangent) {
  static const double x[] = {-30, -19, -3, -1, -0.1, 0, 0.01, 0.5, 1, 2, 10, 25};
  double worst = 0;
  int i;
  for (i = 0; i < 12; i++) {
    const double found = (double)smooth_rotation(LM_REAL(0.1 * x[i]), LM_REAL(0.1));
    TEST_ASSERT_DOUBLE_WITHIN(2e-4 * 2 * ROUNDING, 2e-4 * tanh(x[i]), found);
    TEST_ASSERT_EQUAL_DOUBLE(-found, (double)smooth_rotation(LM_REAL(-0.1 * x[i]), LM_REAL(0.1)));
    if (fabs(found - (double)rotation(LM_REAL(0.1 * x[i]), LM_REAL(0.1))) > worst) {
      worst = fabs(found - (double)rotation(LM_REAL(0.1 * x[i]), LM_REAL(0.1)));
    }
  }
  TEST_ASSERT_DOUBLE_WITHIN(0.002, 0.238, worst / 2e-4); /* header: 24 % at T = T0 */
}

TEST(gap_rotation_refuses_nonsense_by_name) {
  OUTSIDE("torque_Nm", lm_gap_rotation(LM_REAL(2e6), 1, 0, &out, fault_or_null));
  OUTSIDE("closing_torque_Nm", lm_gap_rotation(1, -1, 0, &out, fault_or_null));
  OUTSIDE("full_angle_rad", lm_gap_rotation(1, 1, -1, &out, fault_or_null));
  REFUSED(LM_NULL, "angle_rad", lm_gap_rotation(1, 1, 0, 0, fault_or_null));
  REFUSED(LM_NOT_FINITE, "torque_Nm", lm_gap_rotation_smooth(NAN_VALUE, 1, 0, &out, fault_or_null));
  REFUSED(LM_NULL, "angle_rad", lm_gap_rotation_smooth(1, 1, 0, 0, fault_or_null));
}
