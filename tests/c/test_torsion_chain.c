#include "lostmotion/torsion_chain.h"

#include "expect.h"
#include "test.h"

#define STEEL_G LM_REAL(8e4)

static lm_real slope;
static lm_torsion_element element;

void setUp(void) {
  forget_results();
  slope = LM_REAL(-77);
}

static lm_real wind_up(lm_real torque) {
  ACCEPTED(lm_sum_torsion(torque, &element, 1, &out, &slope, &fault));
  close_to((double)(torque * slope), out, 0);
  return out;
}

TEST(the_ratio_counts_twice) {
  /* check_values.md, torsion chain: input shaft d 8 x 30, u = 100, 40 N m: 0.77 arcsec; with one
   * factor forgotten 77 arcsec. */
  ACCEPTED(lm_make_shaft_torsion(8, 0, 30, STEEL_G, 100, &element, &fault));
  close_to(1072.330292425, element.stiffness_Nm_per_rad, 1e-11);
  close_to(0.7694077 * ARCSEC, wind_up(40), 1e-7);
  element.ratio = -100;
  close_to(0.7694077 * ARCSEC, wind_up(40), 1e-7);
}

TEST(an_output_shaft_winds_up_1_79_arcmin) {
  /* check_values.md, torsion chain: d 25 x 40 solid, 40 N m. */
  ACCEPTED(lm_make_shaft_torsion(25, 0, 40, STEEL_G, 1, &element, &fault));
  close_to(1.7928499747 * 60 * ARCSEC, wind_up(40), 1e-9);
}

TEST(a_hollow_shaft_is_the_difference_of_two_solid_ones) {
  lm_torsion_element solid;
  lm_torsion_element core;
  ACCEPTED(lm_make_shaft_torsion(25, 0, 40, STEEL_G, 1, &solid, &fault));
  ACCEPTED(lm_make_shaft_torsion(20, 0, 40, STEEL_G, 1, &core, &fault));
  ACCEPTED(lm_make_shaft_torsion(25, 20, 40, STEEL_G, 1, &element, &fault));
  close_to((double)solid.stiffness_Nm_per_rad - (double)core.stiffness_Nm_per_rad,
           element.stiffness_Nm_per_rad, 1e-12);
}

TEST(cup_and_diaphragm_have_the_published_stiffness) {
  /* check_values.md, torsion chain: r 24.7, s 0.35, l 12: 2.21e5; hub 15, h 0.5: 1.79e5; in
   * series 9.9e4. */
  lm_torsion_element both[2];
  ACCEPTED(lm_make_shell_torsion(LM_REAL(24.7), LM_REAL(0.35), 12, STEEL_G, &both[0], &fault));
  close_to(220937.437889, both[0].stiffness_Nm_per_rad, 1e-9);
  ACCEPTED(lm_make_diaphragm_torsion(15, LM_REAL(24.7), LM_REAL(0.5), STEEL_G, &both[1], &fault));
  close_to(179177.733603, both[1].stiffness_Nm_per_rad, 1e-9);
  ACCEPTED(lm_sum_torsion(1, both, 2, &out, &slope, &fault));
  close_to(9.9e4, 1 / out, 5e-3);
  /* The shell is the hollow shaft of the same radii. */
  ACCEPTED(lm_make_shaft_torsion(LM_REAL(49.75), LM_REAL(49.05), 12, STEEL_G, 1, &element, &fault));
  close_to((double)both[0].stiffness_Nm_per_rad, element.stiffness_Nm_per_rad,
           LM_REAL_BITS == 64 ? 1e-12 : 1e-5);
}

TEST(a_locked_input_of_1_Nm_per_rad_is_ten_thousand_at_the_output) {
  /* check_values.md, torsion chain: K_l = 1, u = 100: 33 arcsec at 1.6 N m. */
  ACCEPTED(lm_make_input_lock(1, 100, &element, &fault));
  close_to(33 * ARCSEC, wind_up(LM_REAL(1.6)), 1e-3);
}

TEST(no_torsion_elements_give_no_wind_up) {
  ACCEPTED(lm_sum_torsion(40, 0, 0, &out, &slope, &fault));
  close_to(0, out, 0);
  close_to(0, slope, 0);
}

TEST(torsion_refuses_nonsense_by_name) {
  element.stiffness_Nm_per_rad = 7;
  element.ratio = 3;
  OUTSIDE("outer_diameter_mm", lm_make_shaft_torsion(0, 0, 1, STEEL_G, 1, &element, fault_or_null));
  OUTSIDE("bore_mm", lm_make_shaft_torsion(8, -1, 1, STEEL_G, 1, &element, fault_or_null));
  REFUSED(LM_INCONSISTENT, "bore_mm",
          lm_make_shaft_torsion(8, 8, 1, STEEL_G, 1, &element, fault_or_null));
  OUTSIDE("length_mm", lm_make_shaft_torsion(8, 0, 0, STEEL_G, 1, &element, fault_or_null));
  OUTSIDE("shear_modulus_MPa",
          lm_make_shaft_torsion(8, 0, 1, LM_REAL(8e9), 1, &element, fault_or_null));
  OUTSIDE("torsion_chain.ratio",
          lm_make_shaft_torsion(8, 0, 1, STEEL_G, 0, &element, fault_or_null));
  REFUSED(LM_NULL, "element", lm_make_shaft_torsion(8, 0, 1, STEEL_G, 1, 0, fault_or_null));
  OUTSIDE("mean_radius_mm", lm_make_shell_torsion(0, 1, 1, STEEL_G, &element, fault_or_null));
  REFUSED(LM_INCONSISTENT, "wall_mm",
          lm_make_shell_torsion(1, 2, 1, STEEL_G, &element, fault_or_null));
  OUTSIDE("hub_radius_mm", lm_make_diaphragm_torsion(0, 2, 1, STEEL_G, &element, fault_or_null));
  REFUSED(LM_INCONSISTENT, "hub_radius_mm",
          lm_make_diaphragm_torsion(2, 2, 1, STEEL_G, &element, fault_or_null));
  OUTSIDE("torsion_chain.stiffness_Nm_per_rad",
          lm_make_input_lock(0, 100, &element, fault_or_null));
  REFUSED(LM_NOT_FINITE, "torsion_chain.ratio",
          lm_make_input_lock(1, NAN_VALUE, &element, fault_or_null));
  TEST_ASSERT_EQUAL_DOUBLE(7, (double)element.stiffness_Nm_per_rad);
  TEST_ASSERT_EQUAL_DOUBLE(3, (double)element.ratio);
  OUTSIDE("torque_Nm", lm_sum_torsion(LM_REAL(-2e6), &element, 1, &out, &slope, fault_or_null));
  REFUSED(LM_NULL, "torsion_chain", lm_sum_torsion(1, 0, 1, &out, &slope, fault_or_null));
  OUTSIDE("count", lm_check_torsion_elements(&element, 65, fault_or_null));
  REFUSED(LM_NULL, "angle_rad or compliance_rad_per_Nm",
          lm_sum_torsion(1, &element, 1, 0, &slope, fault_or_null));
  REFUSED(LM_NULL, "angle_rad or compliance_rad_per_Nm",
          lm_sum_torsion(1, &element, 1, &out, 0, fault_or_null));
  element.stiffness_Nm_per_rad = INFINITE;
  REFUSED(LM_NOT_FINITE, "torsion_chain.stiffness_Nm_per_rad",
          lm_sum_torsion(1, &element, 1, &out, &slope, fault_or_null));
  TEST_ASSERT_EQUAL_DOUBLE(-77, (double)out);
}
