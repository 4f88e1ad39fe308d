#include "lostmotion/involute.h"

#include "reference_drives.h"
#include "test.h"

static lm_fault fault;
static lm_geometry geometry;
static uint32_t seed;

void setUp(void) {
  seed = 1;
  memset(&fault, 0, sizeof fault);
}

static void make(const lm_drive *drive) {
  TEST_ASSERT_EQUAL(LM_OK, lm_make_geometry(&drive->teeth, drive->generator.deflection_mm,
                                            drive->flexspline.rim_thickness_mm, &geometry, &fault));
}

/* --- flanks ----------------------------------------------------------------------------------- */

/* inv a = tan a - a by its definition, in double. */
static double inv(double angle) {
  return tan(angle) - angle;
}

/* Half angle pi/(2z) + 2 x tan(alpha)/z + inv(alpha) - inv(arccos(r_b/rho)), by definition.
 */
TEST(half_angles_are_those_of_the_involute) {
  int k;
  int i;
  for (k = 0; k < 200; k++) {
    const double module = draw(&seed, 0.1, 5);
    const int teeth = 2 * (int)draw(&seed, 15, 300);
    const double alpha = draw(&seed, 0.18, 0.6);
    const double shift = draw(&seed, -1, 6);
    const lm_involute flank =
        lm_make_involute(LM_REAL(module), teeth, LM_REAL(alpha), LM_REAL(shift));
    const double base = module * teeth / 2 * cos(alpha);
    ASSERT_NEAR(base * BOUND(1e-14, 2e-7), base, flank.base_mm);
    for (i = 1; i < 20; i++) {
      const double rho = base * (1 + 0.01 * i);
      const double pressure = acos(base / rho);
      const double expected = 3.14159265358979323846 / (2 * teeth) +
                              2 * shift * tan(alpha) / teeth + inv(alpha) - inv(pressure);
      const lm_involute_point at = lm_evaluate_involute(&flank, LM_REAL(rho));
      ASSERT_NEAR(BOUND(1e-14, 2e-6), pressure, at.pressure_angle_rad);
      ASSERT_NEAR(BOUND(1e-14, 2e-6), tan(pressure), at.tangent);
      ASSERT_NEAR(BOUND(1e-13, 1e-6), expected, at.half_angle_rad);
    }
  }
}

/* Without shift, half of the pitch is tooth and half is space on the reference circle. */
TEST(tooth_and_space_are_equal_on_the_reference_circle) {
  const lm_involute flank = lm_make_involute(LM_REAL(0.25), 200, LM_REAL(20) * DEGREE, 0);
  ASSERT_NEAR(BOUND(1e-16, 1e-7), LM_PI / 400, lm_evaluate_involute(&flank, 25).half_angle_rad);
}

/* The involute is the path of a string unrolled from the base circle: after a roll t its end is at
 * r_b (cos t + t sin t, sin t - t cos t). */
TEST(the_flank_is_an_unrolled_string) {
  const lm_involute flank = lm_make_involute(LM_REAL(1), 40, LM_REAL(20) * DEGREE, LM_REAL(0.5));
  const double base = (double)flank.base_mm;
  int i;
  for (i = 1; i <= 60; i++) {
    const double t = 0.01 * i;
    const double x = base * (cos(t) + t * sin(t));
    const double y = base * (sin(t) - t * cos(t));
    const lm_involute_point at = lm_evaluate_involute(&flank, LM_REAL(hypot(x, y)));
    ASSERT_NEAR(BOUND(1e-13, 2e-6), (double)flank.half_angle_rad - atan2(y, x), at.half_angle_rad);
    ASSERT_NEAR(BOUND(1e-12, 2e-4), t,
                at.tangent); /* the roll is the tangent of the pressure angle */
  }
}

/* d xi / d rho = -tangent / rho. */
TEST(the_half_angle_falls_by_the_tangent_over_the_radius) {
  const lm_involute flank = lm_make_involute(LM_REAL(0.25), 200, LM_REAL(20) * DEGREE, 3);
  const double step = BOUND(1e-5, 0.02);
  int i;
  for (i = 1; i <= 20; i++) {
    const double rho = (double)flank.base_mm + 0.1 * i;
    const double fall = ((double)lm_evaluate_involute(&flank, LM_REAL(rho + step)).half_angle_rad -
                         (double)lm_evaluate_involute(&flank, LM_REAL(rho - step)).half_angle_rad) /
                        (2 * step);
    ASSERT_NEAR(BOUND(1e-9, 1e-5),
                -(double)lm_evaluate_involute(&flank, LM_REAL(rho)).tangent / rho, fall);
  }
}

/* Series below tan a = 0.3, difference above it: both are equal there. */
TEST(the_series_joins_the_difference) {
  lm_involute flank;
  double below;
  double above;
  flank.base_mm = 20;
  flank.half_angle_rad = LM_REAL(0.03);
  below = (double)lm_evaluate_involute(&flank, LM_REAL(20 * sqrt(1.09) - BOUND(1e-12, 1e-5)))
              .half_angle_rad;
  above = (double)lm_evaluate_involute(&flank, LM_REAL(20 * sqrt(1.09) + BOUND(1e-12, 1e-5)))
              .half_angle_rad;
  ASSERT_NEAR(BOUND(5e-13, 6e-7), below, above);
}

TEST(on_and_below_the_base_circle_nothing_changes) {
  const lm_involute flank = lm_make_involute(LM_REAL(0.25), 200, LM_REAL(20) * DEGREE, 3);
  int i;
  for (i = 0; i < 3; i++) {
    const lm_involute_point at = lm_evaluate_involute(&flank, flank.base_mm - LM_REAL(i) / 2);
    TEST_ASSERT_TRUE(at.tangent == 0);
    TEST_ASSERT_TRUE(at.pressure_angle_rad == 0);
    TEST_ASSERT_TRUE(at.half_angle_rad == flank.half_angle_rad);
  }
}

/* --- radii ------------------------------------------------------------------------------------ */

/* check_values.md, reference drive A. */
TEST(the_radii_of_reference_a) {
  const lm_drive drive = reference_a();
  const double bound = BOUND(5e-6, 8e-6);
  make(&drive);
  ASSERT_NEAR(bound, 23.49232, geometry.flexspline.base_mm);
  ASSERT_NEAR(bound, 23.72724, geometry.rigid.base_mm);
  ASSERT_NEAR(bound, 25.4125, geometry.flexspline_root_mm);
  ASSERT_NEAR(bound, 25.1125, geometry.neutral_mm);
  ASSERT_NEAR(bound, 25.85, geometry.flexspline_tip_mm);
  ASSERT_NEAR(bound, 25.7875, geometry.rigid_tip_mm);
  ASSERT_NEAR(bound, 25.85 + 0.2375 + 0.05, geometry.rigid_root_mm);
  ASSERT_NEAR(bound, (25.85 + 0.2375 + 25.7875) / 2, geometry.mean_mm); /* both tips on the axis */
  ASSERT_NEAR(BOUND(1e-15, 1e-8), 2.0 / 202, geometry.lead_per_angle);
  TEST_ASSERT_EQUAL(200, geometry.flexspline_teeth);
  TEST_ASSERT_EQUAL(202, geometry.rigid_teeth);
  TEST_ASSERT_EQUAL(LM_INTERNAL, geometry.deformation);
  TEST_ASSERT_TRUE(geometry.module_mm == drive.teeth.module_mm);
  TEST_ASSERT_TRUE(geometry.deflection_mm == drive.generator.deflection_mm);
}

/* check_values.md, reference drive E: r_fr, r_ar, r_af, r_ff, r_m of reference E. */
TEST(the_radii_of_reference_e) {
  const lm_drive drive = reference_e();
  const double bound = BOUND(1e-12, 8e-6);
  const double root = 0.25 * 200 / 2 + 0.25 * (3.05 - 1 - 0.35);
  const double tip = root + 1.75 * 0.25;
  make(&drive);
  ASSERT_NEAR(bound, root, geometry.rigid_root_mm);
  ASSERT_NEAR(bound, tip, geometry.rigid_tip_mm);
  ASSERT_NEAR(bound, tip + 0.2375 - 1.2 * 0.25, geometry.flexspline_tip_mm);
  ASSERT_NEAR(bound, tip + 0.2375 + 0.2 * 0.25, geometry.flexspline_root_mm);
  ASSERT_NEAR(bound, tip + 0.2375 + 0.2 * 0.25 + 0.3, geometry.neutral_mm);
  ASSERT_NEAR(
      bound,
      (geometry.flexspline_tip_mm - drive.generator.deflection_mm + geometry.rigid_tip_mm) / 2,
      geometry.mean_mm);
  ASSERT_NEAR(BOUND(1e-15, 1e-8), -2.0 / 200, geometry.lead_per_angle);
}

TEST(radii_are_in_proportion_to_the_module) {
  lm_geometry one;
  lm_drive drive = reference_a();
  make(&drive);
  one = geometry;
  drive.teeth.module_mm *= 4;
  drive.generator.deflection_mm *= 4;
  drive.flexspline.rim_thickness_mm *= 4;
  make(&drive);
  ASSERT_NEAR(BOUND(1e-12, 4e-5), 4 * one.flexspline_root_mm, geometry.flexspline_root_mm);
  ASSERT_NEAR(BOUND(1e-12, 4e-5), 4 * one.neutral_mm, geometry.neutral_mm);
  ASSERT_NEAR(BOUND(1e-12, 4e-5), 4 * one.rigid_tip_mm, geometry.rigid_tip_mm);
  ASSERT_NEAR(BOUND(1e-12, 4e-5), 4 * one.rigid.base_mm, geometry.rigid.base_mm);
}

static lm_status refused(const lm_drive *drive) {
  lm_geometry before;
  lm_status status;
  memset(&geometry, 0x55, sizeof geometry);
  before = geometry;
  status = lm_make_geometry(&drive->teeth, drive->generator.deflection_mm,
                            drive->flexspline.rim_thickness_mm, &geometry, &fault);
  TEST_ASSERT_EQUAL_MEMORY(&before, &geometry, sizeof geometry);
  TEST_ASSERT_EQUAL(status, fault.status);
  TEST_ASSERT_TRUE(isinf(fault.high));
  TEST_ASSERT_TRUE(!(fault.found > fault.low));
  return status;
}

/* A strong negative shift puts a tip below the base circle. */
TEST(tips_below_the_base_circle_are_refused) {
  lm_drive drive = reference_a();
  drive.teeth.engagement_depth = LM_REAL(9.5); /* reference A's rigid tip is 8.2 m above its base */
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, refused(&drive));
  TEST_ASSERT_EQUAL_STRING("teeth.engagement_depth", fault.input);
  drive = reference_a();
  drive.teeth.flexspline_shift =
      LM_REAL(-7); /* root 8.35 m below the reference circle, 6.03 at base */
  drive.teeth.engagement_depth = LM_REAL(0.2);
  drive.teeth.tooth_height = LM_REAL(0.5);
  drive.generator.deflection_mm = LM_REAL(2);
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, refused(&drive));
  TEST_ASSERT_EQUAL_STRING("teeth.tooth_height", fault.input);
  drive = reference_e();
  drive.teeth.engagement_depth = LM_REAL(9.5);
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, refused(&drive));
  TEST_ASSERT_EQUAL_STRING("teeth.engagement_depth", fault.input);
  drive = reference_e();
  drive.teeth.rigid_shift = LM_REAL(-7);
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, refused(&drive));
  TEST_ASSERT_EQUAL_STRING("teeth.tooth_height", fault.input);
  drive = reference_a();
  drive.generator.deflection_mm = LM_REAL(NAN);
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, refused(&drive));
}

TEST(null_is_refused) {
  const lm_drive drive = reference_a();
  TEST_ASSERT_EQUAL(LM_NULL, lm_make_geometry(0, 1, 1, &geometry, &fault));
  TEST_ASSERT_EQUAL_STRING("teeth", fault.input);
  TEST_ASSERT_EQUAL(LM_NULL, lm_make_geometry(&drive.teeth, 1, 1, 0, &fault));
  TEST_ASSERT_EQUAL_STRING("geometry", fault.input);
  TEST_ASSERT_EQUAL(LM_NULL, fault.status);
  TEST_ASSERT_EQUAL(LM_NULL, lm_make_geometry(&drive.teeth, 1, 1, 0, 0));
}
