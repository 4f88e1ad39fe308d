#include "lostmotion/radial_chain.h"

#include "expect.h"
#include "test.h"

#define STEEL_E LM_REAL(2.1e5)

static lm_real slope;
static lm_radial_law law;

void setUp(void) {
  forget_results();
  slope = LM_REAL(-77);
}

static lm_real approach(lm_real force, const lm_radial_law *laws, int count) {
  ACCEPTED(lm_sum_radial(force, laws, count, &out, &slope, &fault));
  return out;
}

TEST(a_ball_of_3_97_mm_approaches_4_220_um_at_60_N) {
  /* check_values.md, radial chain: diameter 3.97 mm, Q = 60 N, Palmgren. */
  ACCEPTED(lm_make_ball_law(LM_REAL(3.97), 0, LM_REAL(LM_BALL_PALMGREN), 1, 0, &law, &fault));
  close_to(4.220e-3, approach(60, &law, 1), 1.2e-4);
}

TEST(a_contact_angle_divides_by_its_cosine) {
  lm_radial_law straight;
  ACCEPTED(lm_make_ball_law(4, 0, LM_REAL(5e-4), LM_REAL(0.3), 15, &straight, &fault));
  ACCEPTED(lm_make_ball_law(4, LM_REAL(60 * DEG), LM_REAL(5e-4), LM_REAL(0.3), 15, &law, &fault));
  close_to(2.0 * (double)straight.coefficient_mm_per_Nn, law.coefficient_mm_per_Nn, 0);
}

TEST(ball_part_of_a_size_20_at_rated_torque_is_4_to_5_um) {
  /* check_values.md, radial chain: Q = 90 .. 120 N above a preload of 15 N gives 3.9 .. 5.0 um,
   * diameter 4 mm.
   */
  ACCEPTED(lm_make_ball_law(4, 0, LM_REAL(LM_BALL_PALMGREN), 1, 15, &law, &fault));
  close_to(3.9e-3, approach(90 - 15, &law, 1), 0.03);
  close_to(5.0e-3, approach(120 - 15, &law, 1), 0.03);
}

TEST(hertz_coefficients_are_those_of_the_table_and_straight_between) {
  /* check_values.md, radial chain, Hertz solution by groove conformity. */
  static const double f[] = {0.515, 0.52, 0.53, 0.54, 0.5175, 0.525, 0.535};
  static const double c[] = {4.24e-4, 4.53e-4, 4.97e-4, 5.29e-4, 4.385e-4, 4.75e-4, 5.13e-4};
  int i;
  for (i = 0; i < 7; i++) {
    ACCEPTED(lm_ball_hertz_coefficient(LM_REAL(f[i]), &out, &fault));
    close_to(c[i], out, LM_REAL_BITS == 64 ? 1e-12 : 2e-5);
  }
  OUTSIDE("conformity", lm_ball_hertz_coefficient(LM_REAL(0.514), &out, fault_or_null));
  OUTSIDE("conformity", lm_ball_hertz_coefficient(LM_REAL(0.541), &out, fault_or_null));
  REFUSED(LM_NOT_FINITE, "conformity", lm_ball_hertz_coefficient(NAN_VALUE, &out, fault_or_null));
  REFUSED(LM_NULL, "coefficient", lm_ball_hertz_coefficient(LM_REAL(0.52), 0, fault_or_null));
}

TEST(roller_laws_are_the_published_powers) {
  /* check_values.md, radial chain: 7.68e-5 Q^0.9 l^-0.8 and 1.81e-4 Q^(3/4) l^(-1/2) at Q = 1000, l
   * = 10. */
  ACCEPTED(lm_make_roller_law(10, 1, 0, &law, &fault));
  close_to(7.68e-5 * 501.187233627272 / 6.30957344480193, approach(1000, &law, 1), 1e-12);
  ACCEPTED(lm_make_crowned_roller_law(16, 1, 0, &law, &fault));
  close_to(1.81e-4 * 1000.0 / 4.0, approach(10000, &law, 1), 1e-12);
}

TEST(a_spring_is_linear_with_its_stiffness) {
  ACCEPTED(lm_make_spring_law(LM_REAL(2e5), LM_REAL(0.5), &law, &fault));
  close_to(400 * 0.5 / 2e5, approach(400, &law, 1), 0);
  close_to(0.5 / 2e5, slope, 0);
  close_to(0.01 * 0.5 / 2e5, approach(LM_REAL(0.01), &law, 1), 0);
  close_to(0.5 / 2e5, slope, 0);
}

TEST(a_shaft_bends_as_a_beam_on_two_supports) {
  /* d 20, a 16, b 24: a^2 b^2 / (3 E I L) = 7.450270e-7 mm/N. */
  ACCEPTED(lm_make_shaft_bending_law(20, 16, 24, STEEL_E, &law, &fault));
  close_to(7.450270250336039e-7, law.coefficient_mm_per_Nn, 1e-12);
}

TEST(the_rim_ovalises_25_times_as_much_as_it_widens) {
  /* check_values.md, radial chain: size 20 (bore 52, outer 70, width 10) at 400 N: 0.2 um by Lame,
   * 5 .. 6 um by ovalisation of the free ring. */
  double widening;
  ACCEPTED(lm_make_rim_widening_law(26, 35, 10, STEEL_E, LM_REAL(0.3), &law, &fault));
  widening = (double)approach(400, &law, 1);
  close_to(2.2813174842e-4, out, 1e-10);
  ACCEPTED(lm_make_rim_ovalisation_law(LM_REAL(30.5), 9, 10, LM_REAL(30 * DEG), STEEL_E, 1, &law,
                                       &fault));
  close_to(5.551093239e-3, approach(400, &law, 1), 7e-4); /* the factor 0.0624 has three digits */
  TEST_ASSERT_DOUBLE_WITHIN(1.0, 24.5, (double)out / widening);
  ACCEPTED(lm_make_rim_ovalisation_law(LM_REAL(30.5), 9, 10, LM_REAL(30 * DEG), STEEL_E, 4, &law,
                                       &fault));
  close_to(5.551093239e-3 / 4, approach(400, &law, 1), 7e-4);
  close_to(0, law.preload_N, 0);
}

TEST(ovalisation_factors_are_those_published) {
  /* Four digits: check_values.md, radial chain. All digits: the series summed to n = 4000. */
  static const double angle[] = {0, 15, 30, 40, 60};
  static const double published[] = {0.0744, 0.0711, 0.0624, 0.0544, 0.0346746490346};
  static const double series[] = {0.0743891955133, 0.0711002081129, 0.0624406506814,
                                  0.0544348676634, 0.0346746490346};
  int i;
  for (i = 0; i < 5; i++) {
    ACCEPTED(lm_ovalisation_factor(LM_REAL(angle[i] * DEG), &out, &fault));
    TEST_ASSERT_DOUBLE_WITHIN(5e-5, published[i], (double)out);
    TEST_ASSERT_DOUBLE_WITHIN(1.5e-7, series[i], (double)out);
  }
  OUTSIDE("patch_half_angle_rad", lm_ovalisation_factor(LM_REAL(-0.01), &out, fault_or_null));
  OUTSIDE("patch_half_angle_rad", lm_ovalisation_factor(LM_REAL(1.21), &out, fault_or_null));
  REFUSED(LM_NULL, "factor", lm_ovalisation_factor(0, 0, fault_or_null));
}

TEST(the_most_loaded_element_carries_the_published_share) {
  /* check_values.md, radial chain: 4.37 / (Z cos a) balls, 5 with clearance, 4.08 rollers. */
  ACCEPTED(lm_bearing_share(LM_BEARING_BALLS, 19, 0, &out, &fault));
  close_to(4.37 / 19, out, 0);
  ACCEPTED(lm_bearing_share(LM_BEARING_BALLS_CLEARANCE, 20, LM_REAL(60 * DEG), &out, &fault));
  close_to(0.5, out, 1e-12);
  ACCEPTED(lm_bearing_share(LM_BEARING_ROLLERS, 12, 0, &out, &fault));
  close_to(0.34, out, 0);
  ACCEPTED(lm_bearing_share(LM_BEARING_BALLS, 5, LM_REAL(1.2), &out, &fault));
  close_to(1.0, out, 0); /* never more than the whole force: the formula gives 2.4 */
  ACCEPTED(lm_bearing_share(LM_BEARING_BALLS, 5, LM_REAL(0.9), &out, &fault));
  close_to(1.0, out, 0); /* 1.4 */
  OUTSIDE("kind", lm_bearing_share((lm_bearing_kind)3, 19, 0, &out, fault_or_null));
  OUTSIDE("elements", lm_bearing_share(LM_BEARING_BALLS, 4, 0, &out, fault_or_null));
  OUTSIDE("elements", lm_bearing_share(LM_BEARING_BALLS, 201, 0, &out, fault_or_null));
  OUTSIDE("contact_angle_rad",
          lm_bearing_share(LM_BEARING_BALLS, 19, LM_REAL(1.3), &out, fault_or_null));
  REFUSED(LM_NULL, "share", lm_bearing_share(LM_BEARING_BALLS, 19, 0, 0, fault_or_null));
}

TEST(a_cam_bearing_spreads_the_lobe_over_five_to_seven_balls) {
  ACCEPTED(lm_cam_bearing_share(5, &out, &fault));
  close_to(0.35, out, 0);
  ACCEPTED(lm_cam_bearing_share(LM_REAL(6.5), &out, &fault));
  close_to(0.275, out, 0);
  ACCEPTED(lm_cam_bearing_share(7, &out, &fault));
  close_to(0.25, out, 0);
  OUTSIDE("balls_in_lobe", lm_cam_bearing_share(LM_REAL(4.9), &out, fault_or_null));
  OUTSIDE("balls_in_lobe", lm_cam_bearing_share(LM_REAL(7.1), &out, fault_or_null));
  REFUSED(LM_NULL, "share", lm_cam_bearing_share(6, 0, fault_or_null));
}

static lm_radial_law law_of(double c, double n, double share, double preload) {
  lm_radial_law made;
  made.coefficient_mm_per_Nn = LM_REAL(c);
  made.exponent = LM_REAL(n);
  made.share = LM_REAL(share);
  made.preload_N = LM_REAL(preload);
  return made;
}

TEST(preload_takes_its_own_approach_off) {
  /* Equation (2) with preload: c [(Q0 + q)^n - Q0^n], n = 1/2 so that roots are whole. */
  law = law_of(1e-4, 0.5, 0.5, 16);
  close_to(1e-4 * (10 - 4), approach(2 * (100 - 16), &law, 1), 0);
  close_to(0.5 * 0.5 * 1e-4 / 10, slope, 0);
  close_to(1e-4 * (3 - 4), approach(2 * (9 - 16), &law, 1), 0);
}

TEST(all_members_feel_the_same_lobe_force) {
  lm_radial_law laws[3];
  double sum = 0;
  double slopes = 0;
  int i;
  laws[0] = law_of(4.36e-4, 2.0 / 3.0, 0.3, 15);
  laws[1] = law_of(5e-6, 1, 1, 0);
  laws[2] = law_of(7e-5, 0.9, -0.1, 40);
  for (i = 0; i < 3; i++) {
    sum += (double)approach(120, &laws[i], 1);
    slopes += (double)slope;
  }
  close_to(sum, approach(120, laws, 3), 0);
  close_to(slopes, slope, 0);
  close_to(0, approach(120, 0, 0), 0);
  close_to(0, slope, 0);
}

TEST(a_member_that_has_lifted_off_stays_where_it_was) {
  lm_real at_lift_off;
  law = law_of(4.36e-4, 2.0 / 3.0, 0.5, 15);
  at_lift_off = approach(-30, &law, 1);
  close_to(-4.36e-4 * pow(15, 2.0 / 3.0), at_lift_off, 1e-12);
  close_to(0, slope, 0);
  close_to((double)at_lift_off, approach(-1000, &law, 1), 0);
  close_to(0, slope, 0);
}

TEST(the_slope_is_finite_through_zero_force_and_continuous_at_the_floor) {
  /* Header: slope at zero (2-n) c floor^(n-1). */
  const double n = 2.0 / 3.0;
  const double floor_N = LM_RADIAL_FORCE_FLOOR_N;
  const double steepest = (2 - n) * 4.36e-4 * pow(floor_N, n - 1);
  lm_real below;
  lm_real below_slope;
  law = law_of(4.36e-4, n, 1, 0);
  close_to(0, approach(0, &law, 1), 0);
  TEST_ASSERT_TRUE(approach(LM_REAL(1e-6), &law, 1) > 0);
  close_to(steepest, slope, 2e-5);
  below = approach(LM_REAL(floor_N * (1 - 1e-6)), &law, 1);
  below_slope = slope;
  close_to((double)below, approach(LM_REAL(floor_N * (1 + 1e-6)), &law, 1), 3e-6);
  close_to((double)below_slope, slope, 3e-6);
  close_to(4.36e-4 * pow(floor_N, n), out, 3e-6);
  /* 0.06 um for the whole zone of a 4 mm ball. */
  TEST_ASSERT_TRUE((double)out / pow(4, 1.0 / 3.0) < 6e-5);
}

TEST(approach_never_falls_with_force_and_its_slope_is_the_difference_quotient) {
  static const double exponents[] = {0.25, 0.5, 2.0 / 3.0, 0.9, 1.0, 1.5, 2.0};
  static const double preloads[] = {0, 0.05, 1, 30};
  int e, p, k;
  for (e = 0; e < 7; e++) {
    for (p = 0; p < 4; p++) {
      double previous = -1;
      law = law_of(1e-4, exponents[e], 0.3, preloads[p]);
      for (k = -40; k <= 400; k++) {
        const double force = 0.05 + 0.37 * k; /* off the floor and off lift-off */
        const double step = LM_REAL_BITS == 64 ? 1e-5 : 2e-2;
        const double here = (double)approach(LM_REAL(force), &law, 1);
        const double derivative = (double)slope;
        const double high = (double)approach(LM_REAL(force + step), &law, 1);
        const double low = (double)approach(LM_REAL(force - step), &law, 1);
        const double scale = 1e-4 * pow(preloads[p] + 60, exponents[e]);
        TEST_ASSERT_TRUE(here >= previous);
        previous = here;
        if (LM_REAL_BITS == 64 || fabs(preloads[p] + 0.3 * force) > 1) {
          TEST_ASSERT_DOUBLE_WITHIN(LM_REAL_BITS == 64 ? 1e-7 * scale : 1e-4 * scale, derivative,
                                    (high - low) / (2 * step));
        }
      }
    }
  }
}

TEST(laws_out_of_range_are_refused_by_name) {
  struct {
    lm_radial_law law;
    const char *input;
  } bad[8];
  int i;
  for (i = 0; i < 8; i++) {
    bad[i].law = law_of(1e-4, 0.67, 0.3, 10);
  }
  bad[0].law.coefficient_mm_per_Nn = LM_REAL(-1e-9);
  bad[1].law.coefficient_mm_per_Nn = LM_REAL(1.1);
  bad[2].law.exponent = LM_REAL(0.24);
  bad[3].law.exponent = LM_REAL(2.1);
  bad[4].law.share = LM_REAL(-1.1);
  bad[5].law.share = LM_REAL(1.1);
  bad[6].law.preload_N = LM_REAL(-0.1);
  bad[7].law.preload_N = LM_REAL(2e6);
  for (i = 0; i < 8; i++) {
    static const char *const input[] = {"radial_chain.coefficient_mm_per_Nn",
                                        "radial_chain.exponent", "radial_chain.share",
                                        "radial_chain.preload_N"};
    OUTSIDE(input[i / 2], lm_check_radial_laws(&bad[i].law, 1, fault_or_null));
    OUTSIDE(input[i / 2], lm_sum_radial(1, &bad[i].law, 1, &out, &slope, fault_or_null));
  }
  law = law_of(1e-4, 0.67, 0.3, 10);
  law.exponent = NAN_VALUE;
  REFUSED(LM_NOT_FINITE, "radial_chain.exponent", lm_check_radial_laws(&law, 1, fault_or_null));
  law = law_of(1e-4, 0.67, 0.3, 10);
  REFUSED(LM_NULL, "radial_chain", lm_check_radial_laws(0, 1, fault_or_null));
  OUTSIDE("count", lm_check_radial_laws(&law, -1, fault_or_null));
  OUTSIDE("count", lm_check_radial_laws(&law, 65, fault_or_null));
  ACCEPTED(lm_check_radial_laws(0, 0, &fault));
  OUTSIDE("lobe_force_N", lm_sum_radial(LM_REAL(2e7), &law, 1, &out, &slope, fault_or_null));
  REFUSED(LM_NOT_FINITE, "lobe_force_N",
          lm_sum_radial(INFINITE, &law, 1, &out, &slope, fault_or_null));
  REFUSED(LM_NULL, "approach_mm or slope_mm_per_N",
          lm_sum_radial(1, &law, 1, 0, &slope, fault_or_null));
  REFUSED(LM_NULL, "approach_mm or slope_mm_per_N",
          lm_sum_radial(1, &law, 1, &out, 0, fault_or_null));
  TEST_ASSERT_EQUAL_DOUBLE(-77, (double)out);
  TEST_ASSERT_EQUAL_DOUBLE(-77, (double)slope);
}

TEST(the_fault_says_what_was_found_and_expected) {
  OUTSIDE("balls_in_lobe", lm_cam_bearing_share(9, &out, fault_or_null));
  TEST_ASSERT_EQUAL_DOUBLE(9, (double)fault.found);
  TEST_ASSERT_EQUAL_DOUBLE(5, (double)fault.low);
  TEST_ASSERT_EQUAL_DOUBLE(7, (double)fault.high);
}

TEST(law_builders_refuse_nonsense_and_leave_the_law_alone) {
  const lm_real c = LM_REAL(LM_BALL_PALMGREN);
  law = law_of(0.125, 1, 0.25, 3);
  OUTSIDE("ball_diameter_mm", lm_make_ball_law(LM_REAL(0.09), 0, c, 1, 0, &law, fault_or_null));
  OUTSIDE("ball_diameter_mm", lm_make_ball_law(201, 0, c, 1, 0, &law, fault_or_null));
  OUTSIDE("contact_angle_rad", lm_make_ball_law(4, LM_REAL(1.21), c, 1, 0, &law, fault_or_null));
  OUTSIDE("coefficient", lm_make_ball_law(4, 0, LM_REAL(1e-5), 1, 0, &law, fault_or_null));
  OUTSIDE("coefficient", lm_make_ball_law(4, 0, LM_REAL(2e-3), 1, 0, &law, fault_or_null));
  OUTSIDE("radial_chain.share", lm_make_ball_law(4, 0, c, 2, 0, &law, fault_or_null));
  REFUSED(LM_NOT_FINITE, "radial_chain.preload_N",
          lm_make_ball_law(4, 0, c, 1, NAN_VALUE, &law, fault_or_null));
  REFUSED(LM_NULL, "law", lm_make_ball_law(4, 0, c, 1, 0, 0, fault_or_null));
  OUTSIDE("roller_length_mm", lm_make_roller_law(LM_REAL(0.01), 1, 0, &law, fault_or_null));
  OUTSIDE("roller_length_mm", lm_make_crowned_roller_law(501, 1, 0, &law, fault_or_null));
  OUTSIDE("stiffness_N_per_mm", lm_make_spring_law(0, 1, &law, fault_or_null));
  OUTSIDE("radial_chain.coefficient_mm_per_Nn",
          lm_make_spring_law(LM_REAL(0.5), 1, &law, fault_or_null));
  OUTSIDE("diameter_mm", lm_make_shaft_bending_law(0, 1, 1, STEEL_E, &law, fault_or_null));
  OUTSIDE("a_mm", lm_make_shaft_bending_law(20, 0, 1, STEEL_E, &law, fault_or_null));
  OUTSIDE("b_mm", lm_make_shaft_bending_law(20, 1, -1, STEEL_E, &law, fault_or_null));
  OUTSIDE("youngs_modulus_MPa", lm_make_shaft_bending_law(20, 1, 1, 0, &law, fault_or_null));
  OUTSIDE("inner_radius_mm", lm_make_rim_widening_law(0, 35, 10, STEEL_E, 0, &law, fault_or_null));
  OUTSIDE("outer_radius_mm",
          lm_make_rim_widening_law(26, LM_REAL(2e4), 10, STEEL_E, 0, &law, fault_or_null));
  REFUSED(LM_INCONSISTENT, "outer_radius_mm",
          lm_make_rim_widening_law(26, 26, 10, STEEL_E, 0, &law, fault_or_null));
  OUTSIDE("width_mm", lm_make_rim_widening_law(26, 35, 0, STEEL_E, 0, &law, fault_or_null));
  OUTSIDE("poisson_ratio",
          lm_make_rim_widening_law(26, 35, 10, STEEL_E, LM_REAL(0.5), &law, fault_or_null));
  OUTSIDE("mean_radius_mm",
          lm_make_rim_ovalisation_law(0, 9, 10, 0, STEEL_E, 1, &law, fault_or_null));
  OUTSIDE("thickness_mm",
          lm_make_rim_ovalisation_law(30, 0, 10, 0, STEEL_E, 1, &law, fault_or_null));
  OUTSIDE("housing_factor",
          lm_make_rim_ovalisation_law(30, 9, 10, 0, STEEL_E, LM_REAL(0.9), &law, fault_or_null));
  OUTSIDE("patch_half_angle_rad",
          lm_make_rim_ovalisation_law(30, 9, 10, 2, STEEL_E, 1, &law, fault_or_null));
  TEST_ASSERT_EQUAL_DOUBLE(0.125, (double)law.coefficient_mm_per_Nn);
  TEST_ASSERT_EQUAL_DOUBLE(3, (double)law.preload_N);
}

/* ---- lobe force, equations (3), (4) ---- */

TEST(a_lobe_carries_half_the_torque_and_the_wedge_gives_its_force) {
  /* T = 40 N m at r = 26.4, 24 deg: F_r = 20000 / 26.4 tan 24 deg. */
  ACCEPTED(lm_lobe_radial_force(40, LM_REAL(26.4), LM_REAL(24 * DEG), 0, &out, &fault));
  close_to(20000 / 26.4 * tan(24 * DEG), out, 0);
  ACCEPTED(lm_lobe_radial_force(-40, LM_REAL(26.4), LM_REAL(24 * DEG), 0, &out, &fault));
  close_to(20000 / 26.4 * tan(24 * DEG), out, 0);
}

TEST(friction_lowers_the_force_while_loading_and_raises_it_while_unloading) {
  /* check_values.md, friction: half width / centre = 0.135, 0.270, 0.405 at mu = 0.05, 0.10, 0.15,
   * 24 deg.
   */
  static const double mu[] = {0.05, 0.10, 0.15};
  static const double share[] = {0.135, 0.270, 0.405};
  int i;
  for (i = 0; i < 3; i++) {
    const lm_real rho = LM_REAL(atan(mu[i]));
    lm_real loading;
    lm_real unloading;
    lm_real without;
    ACCEPTED(lm_lobe_radial_force(10, 26, LM_REAL(24 * DEG), rho, &loading, &fault));
    ACCEPTED(lm_lobe_radial_force(10, 26, LM_REAL(24 * DEG), -rho, &unloading, &fault));
    ACCEPTED(lm_lobe_radial_force(10, 26, LM_REAL(24 * DEG), 0, &without, &fault));
    TEST_ASSERT_DOUBLE_WITHIN(1.5e-3, share[i], (double)((unloading - loading) / (2 * without)));
  }
}

TEST(lobe_force_refuses_self_locking_angles) {
  const lm_real a = LM_REAL(0.4);
  OUTSIDE("torque_Nm", lm_lobe_radial_force(LM_REAL(2e6), 26, a, 0, &out, fault_or_null));
  OUTSIDE("radius_mm", lm_lobe_radial_force(1, 0, a, 0, &out, fault_or_null));
  OUTSIDE("flank_angle_rad", lm_lobe_radial_force(1, 26, LM_REAL(-0.1), 0, &out, fault_or_null));
  OUTSIDE("friction_angle_rad", lm_lobe_radial_force(1, 26, a, 2, &out, fault_or_null));
  OUTSIDE("flank_angle_rad - friction_angle_rad",
          lm_lobe_radial_force(1, 26, a, LM_REAL(0.5), &out, fault_or_null));
  OUTSIDE("flank_angle_rad + friction_angle_rad",
          lm_lobe_radial_force(1, 26, a, LM_REAL(-0.5), &out, fault_or_null));
  REFUSED(LM_NULL, "force_N", lm_lobe_radial_force(1, 26, a, 0, 0, fault_or_null));
}

TEST(radial_travel_becomes_rotation_by_the_flank_angle) {
  /* check_values.md, radial chain: 1 um radial = 3.81 arcsec at r = 26.4 mm, 26 deg. */
  ACCEPTED(lm_radial_to_tangential(LM_REAL(1e-3), LM_REAL(26 * DEG), &out, &fault));
  close_to(1e-3 * tan(26 * DEG), out, 0);
  ACCEPTED(
      lm_radial_compliance_angle(LM_REAL(1e-3), LM_REAL(26 * DEG), LM_REAL(26.4), &out, &fault));
  close_to(3.81 * ARCSEC, out, 1e-3);
  ACCEPTED(
      lm_radial_compliance_angle(LM_REAL(-1e-3), LM_REAL(26 * DEG), LM_REAL(26.4), &out, &fault));
  close_to(-3.81 * ARCSEC, out, 1e-3);
  OUTSIDE("radial_mm", lm_radial_to_tangential(101, 0, &out, fault_or_null));
  OUTSIDE("flank_angle_rad", lm_radial_to_tangential(1, LM_REAL(1.5), &out, fault_or_null));
  REFUSED(LM_NULL, "tangential_mm", lm_radial_to_tangential(1, 0, 0, fault_or_null));
  OUTSIDE("radius_mm", lm_radial_compliance_angle(1, 0, 0, &out, fault_or_null));
  OUTSIDE("radial_mm", lm_radial_compliance_angle(-101, 0, 26, &out, fault_or_null));
  REFUSED(LM_NULL, "angle_rad", lm_radial_compliance_angle(1, 0, 26, 0, fault_or_null));
}

TEST(torque_work_equals_the_work_in_both_lobes) {
  /* Energy: T dphi = 2 F_r dDelta_p, for any law, eq (4) with the lobe force. */
  const lm_real alpha = LM_REAL(25 * DEG);
  const lm_real r = LM_REAL(26.4);
  const lm_real step = LM_REAL_BITS == 64 ? LM_REAL(1e-4) : LM_REAL(0.25);
  lm_real force[3];
  lm_real travel[3];
  lm_real angle[3];
  int i;
  law = law_of(4.36e-4, 2.0 / 3.0, 0.3, 15);
  for (i = 0; i < 3; i++) {
    ACCEPTED(lm_lobe_radial_force(20 + (lm_real)(i - 1) * step, r, alpha, 0, &force[i], &fault));
    travel[i] = approach(force[i], &law, 1);
    ACCEPTED(lm_radial_compliance_angle(travel[i], alpha, r, &angle[i], &fault));
  }
  close_to(2 * (double)(force[1] * (travel[2] - travel[0])),
           20 * LM_REAL(1000) * (angle[2] - angle[0]), LM_REAL_BITS == 64 ? 1e-9 : 2e-4);
}
