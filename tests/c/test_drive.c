#include "lostmotion/drive.h"

#include <stddef.h>

#include "lostmotion/mesh.h"
#include "reference_drives.h"
#include "test.h"

static lm_fault fault;
static lm_drive drive;

void setUp(void) {
  memset(&fault, 0, sizeof fault);
  drive = reference_a();
}

static void complete(void) {
  TEST_ASSERT_EQUAL_MESSAGE(LM_OK, lm_complete_drive(&drive, &fault), fault.input);
}

static void assert_accepted(void) {
  TEST_ASSERT_EQUAL_MESSAGE(LM_OK, lm_check_drive(&drive, &fault), fault.input);
}

#define ASSERT_DIGITS(expected, found) \
  ASSERT_NEAR(fabs((double)(expected)) * BOUND(1e-13, 2e-6), expected, found)

/* --- values that the designer has not stated
 * --------------------------------------------------------------
 */

/* drive.h, lm_complete_drive; size 20 has d = 50 mm. */
TEST(a_drive_is_completed_in_proportion_to_its_size) {
  double rim;
  drive.flexspline.rim_thickness_mm = 0;
  complete();
  rim = (65 + 2.5 * pow(100, 2.0 / 3)) * 1e-4 * 50;
  ASSERT_DIGITS(rim, drive.flexspline.rim_thickness_mm);
  ASSERT_DIGITS(0.6 * rim, drive.flexspline.wall_thickness_mm);
  ASSERT_DIGITS(22.5, drive.flexspline.length_mm);
  ASSERT_DIGITS(2.1e5, drive.material.youngs_modulus_MPa);
  ASSERT_DIGITS(8e4, drive.material.shear_modulus_MPa);
  ASSERT_DIGITS(0.3, drive.material.poisson_ratio);
  ASSERT_DIGITS(450, drive.material.bending_fatigue_MPa);
  ASSERT_DIGITS(250, drive.material.shear_fatigue_MPa);
  ASSERT_DIGITS(1.9, drive.material.bending_notch_factor);
  ASSERT_DIGITS(1.5, drive.material.shear_notch_factor);
  ASSERT_DIGITS(0.1, drive.material.mean_stress_factor);
  ASSERT_DIGITS(1.45, drive.material.tooth_stress_factor);
  ASSERT_DIGITS(2600, drive.support.foundation_N_per_mm2);
  ASSERT_DIGITS(3.5e5, drive.support.ring_stiffness_N_mm2);
  TEST_ASSERT_EQUAL(23, drive.support.balls);
  ASSERT_DIGITS(4, drive.support.ball_diameter_mm);
  ASSERT_DIGITS(1.1, drive.support.race_thickness_mm);
  ASSERT_DIGITS(1.3 * 54 * pow(23, 2.0 / 3) * pow(4, 1.8), drive.support.bearing_rating_N);
  ASSERT_DIGITS(240, drive.material.flank_pressure_MPa);
  ASSERT_DIGITS(1, drive.support.ring_factor);
  ASSERT_DIGITS(55 * 3.14159265358979 / 180, drive.support.engagement_limit_rad);
  ASSERT_DIGITS(8 * 2.908882086657216e-4, drive.support.gap_limit_rad);
  TEST_ASSERT_TRUE(drive.support.tooth_compliance_mm_per_N == 0);
  /* (9a): c E I / (0.0744 r^3), I = b s^3 / 12, twice stiffened. */
  ASSERT_NEAR(0.01, 2 * 2.1e5 * 10 * pow(rim, 3) / 12 / (0.0744 * pow(25, 3)),
              drive.gap.ring_stiffness_N_per_mm);
  TEST_ASSERT_TRUE(drive.gap.generator_mm == 0 && drive.gap.teeth_mm == 0);
  TEST_ASSERT_TRUE(drive.friction_angle_rad == 0);
  TEST_ASSERT_EQUAL(1, drive.axial_sections);
  TEST_ASSERT_EQUAL(0, drive.tolerance_count);
  assert_accepted();
}

static void assert_element(double stiffness, double ratio, const lm_torsion_element *element) {
  ASSERT_NEAR(stiffness * 1e-4, stiffness, element->stiffness_Nm_per_rad);
  ASSERT_NEAR(0, ratio, element->ratio);
}

/* Circular spline as a ring of 0.1 d, three times stiffened (f 0.0624 at a patch of 30 deg,
 * check_values.md, radial chain); cup, diaphragm, shafts by section 5. */
TEST(the_chains_are_filled_from_the_size) {
  const double pi = 3.14159265358979;
  double wall;
  complete();
  TEST_ASSERT_EQUAL(1, drive.radial_law_count);
  ASSERT_NEAR(2e-8, 0.0624 * pow(27.5, 3) / (2.1e5 * 10 * pow(5, 3) / 12) / 3,
              drive.radial_laws[0].coefficient_mm_per_Nn);
  ASSERT_NEAR(0, 1, drive.radial_laws[0].exponent);
  TEST_ASSERT_EQUAL(4, drive.torsion_count);
  wall = (double)drive.flexspline.wall_thickness_mm;
  assert_element(8e4 * 2 * pi * 25 * wall * (625 + wall * wall / 4) / 22.5 / 1000, 1,
                 &drive.torsion[0]);
  assert_element(8e4 * 4 * pi * 1.5 * wall / (1 / 225.0 - 1 / 625.0) / 1000, 1, &drive.torsion[1]);
  assert_element(8e4 * pi / 32 * pow(8, 4) / 30 / 1000, 100, &drive.torsion[2]);
  assert_element(8e4 * pi / 32 * pow(25, 4) / 40 / 1000, 1, &drive.torsion[3]);
}

/* The rim of a spatial drive twists by itself, from its inner edge on; so the wall ends there. */
TEST(no_part_of_a_spatial_cup_twists_twice) {
  lm_real planar;
  complete();
  planar = drive.torsion[0].stiffness_Nm_per_rad;
  drive = reference_a();
  drive.axial_sections = 3;
  complete();
  TEST_ASSERT_EQUAL(4, drive.torsion_count);
  /* 22.5 mm to the middle of 10 mm of teeth */
  ASSERT_DIGITS((double)planar * 22.5 / 17.5, drive.torsion[0].stiffness_Nm_per_rad);
  assert_accepted();
}

/* G = E / (2 (1 + nu)), in proportion to steel's. */
TEST(a_softer_material_is_softer_in_shear) {
  drive.material.youngs_modulus_MPa = LM_REAL(2600);
  drive.material.poisson_ratio = LM_REAL(0.37);
  complete();
  ASSERT_DIGITS(8e4 * 2600 / 2.1e5 * 1.3 / 1.37, drive.material.shear_modulus_MPa);
  assert_accepted();
}

TEST(a_cam_engages_to_seventy_degrees) {
  drive.generator.type = LM_COSINE;
  drive.generator.contact_half_angle_rad = LM_REAL(0.1); /* unused by a cam */
  complete();
  ASSERT_DIGITS(70 * 3.14159265358979 / 180, drive.support.engagement_limit_rad);
  assert_accepted();
  drive = reference_a();
  drive.generator.type = LM_ELLIPSE;
  drive.generator.contact_half_angle_rad = LM_REAL(0.1);
  complete();
  ASSERT_DIGITS(70 * 3.14159265358979 / 180, drive.support.engagement_limit_rad);
  /* The patch of a cam on the circular spline counts as 30 deg. */
  ASSERT_NEAR(2e-8, 0.0624 * pow(27.5, 3) / (2.1e5 * 10 * pow(5, 3) / 12) / 3,
              drive.radial_laws[0].coefficient_mm_per_Nn);
}

/* E I of rim and race grows with the fourth power of the size; no foundation is assumed. */
TEST(a_larger_ring_is_stiffer) {
  lm_real once;
  drive.flexspline.rim_thickness_mm = 0;
  drive.support.foundation_N_per_mm2 = 0;
  drive.support.ring_stiffness_N_mm2 = 0;
  complete();
  once = drive.support.ring_stiffness_N_mm2;
  ASSERT_DIGITS(
      2.1e5 * 10 / 12 * (pow((double)drive.flexspline.rim_thickness_mm, 3) + pow(0.022 * 50, 3)),
      once);
  drive = reference_a();
  drive.support.foundation_N_per_mm2 = 0;
  drive.support.ring_stiffness_N_mm2 = 0;
  drive.teeth.face_width_mm *= 2;
  drive.teeth.module_mm *= 2;
  drive.generator.deflection_mm *= 2;
  drive.flexspline.rim_thickness_mm = 0;
  complete();
  ASSERT_DIGITS(16 * once, drive.support.ring_stiffness_N_mm2);
  TEST_ASSERT_TRUE(drive.support.foundation_N_per_mm2 == 0);
  assert_accepted();
}

TEST(no_tooth_engages_beyond_ninety_degrees) {
  drive.generator.contact_half_angle_rad = LM_REAL(1.2);
  complete();
  ASSERT_NEAR(BOUND(1e-15, 2e-7), 1.5707963267948966, drive.support.engagement_limit_rad);
  assert_accepted();
}

/* The cup has at least two face widths, at most the twenty that a drive may have. */
TEST(a_cup_is_in_proportion_to_its_face) {
  static const double face[] = {0.5, 1, 10, 15, 40};
  static const double length[] = {10, 20, 22.5, 30, 80};
  int i;
  for (i = 0; i < 5; i++) {
    drive = reference_a();
    drive.teeth.face_width_mm = LM_REAL(face[i]);
    complete();
    ASSERT_DIGITS(length[i], drive.flexspline.length_mm);
    assert_accepted();
  }
}

/* Stated values are kept. */
TEST(given_values_are_kept) {
  lm_drive given;
  complete();
  drive.flexspline.wall_thickness_mm = LM_REAL(0.4);
  drive.flexspline.length_mm = 30;
  drive.material.youngs_modulus_MPa = LM_REAL(2e5);
  drive.material.poisson_ratio = LM_REAL(0.28);
  drive.support.ring_factor = LM_REAL(7.88);
  drive.support.engagement_limit_rad = 1;
  drive.support.gap_limit_rad = LM_REAL(1e-3);
  drive.gap.ring_stiffness_N_per_mm = 50;
  drive.gap.generator_mm = LM_REAL(0.01);
  drive.axial_sections = 3;
  drive.radial_laws[0].coefficient_mm_per_Nn = LM_REAL(1e-5);
  drive.torsion_count = 1;
  drive.torsion[0].stiffness_Nm_per_rad = LM_REAL(4.48e4);
  given = drive;
  complete();
  TEST_ASSERT_EQUAL_MEMORY(&given, &drive, sizeof drive);
  assert_accepted();
}

/* Every wave generator, every size and ratio in range: the completed drive is accepted and has a
 * mesh. */
TEST(a_completed_drive_is_accepted_and_has_a_mesh) {
  static lm_mesh mesh;
  uint32_t seed = 1;
  int accepted = 0;
  int round;
  for (round = 0; round < 300; round++) {
    const int external = round % 5 == 4;
    const int teeth = round % 7 == 0 ? 640 : 2 * (int)draw(&seed, 25, 300);
    const double module = round % 11 == 0 ? 10 : draw(&seed, 0.05, 10);
    lm_status status;
    drive = external ? reference_e() : reference_a();
    if (!external) {
      drive.generator.type = (lm_generator_type)(round % 4);
    }
    drive.teeth.module_mm = LM_REAL(module);
    drive.teeth.flexspline_teeth = teeth;
    drive.teeth.rigid_teeth = external ? teeth - 2 : teeth + 2;
    drive.teeth.face_width_mm =
        LM_REAL(fmin(400, fmax(0.5, draw(&seed, 0.01, 1) * module * teeth)));
    drive.generator.deflection_mm = LM_REAL(0.95 * module);
    drive.generator.contact_half_angle_rad = LM_REAL(draw(&seed, 0.05, 0.61));
    drive.flexspline.rim_thickness_mm = 0;
    drive.ratio = LM_REAL(round % 2 == 0 ? -1 : 1) *
                  LM_REAL(round % 3 == 0 ? drive.teeth.rigid_teeth : teeth) / 2;
    complete();
    status = lm_check_drive(&drive, &fault);
    TEST_ASSERT_EQUAL_MESSAGE(LM_OK, status, fault.input);
    TEST_ASSERT_EQUAL(LM_OK, lm_make_mesh(&drive, 1, LM_NEUTRAL_LINE_NODES, &mesh, &fault));
    accepted++;
  }
  TEST_ASSERT_EQUAL(300, accepted);
}

/* --- refusals --------------------------------------------------------------------------------- */

static void assert_fault(lm_status status, const char *input, lm_real found, double low,
                         double high, lm_status returned) {
  TEST_ASSERT_EQUAL_MESSAGE(status, returned, input);
  TEST_ASSERT_EQUAL(status, fault.status);
  TEST_ASSERT_EQUAL_STRING(input, fault.input);
  TEST_ASSERT_TRUE_MESSAGE(fault.found == found || (isnan(fault.found) && isnan(found)), input);
  if (isinf(high)) {
    TEST_ASSERT_TRUE(isinf(fault.high));
  } else {
    ASSERT_NEAR_AT(fabs(high) * BOUND(1e-14, 2e-7), high, fault.high, input);
  }
  ASSERT_NEAR_AT(fabs(low) * BOUND(1e-14, 2e-7), low, fault.low, input);
}

/* A number of the drive and its range in reference A: d = 50, m = 0.25, s = 0.6, b = 10. */
typedef struct number {
  const char *key;
  size_t offset;
  double low;
  double high;
  int given; /* set before lm_complete_drive */
} number;

#define AT(member) offsetof(lm_drive, member)
#define DEG (3.14159265358979323846 / 180)

static const number numbers[] = {
    {"teeth.module_mm", AT(teeth.module_mm), 0.05, 10, 1},
    {"teeth.pressure_angle_rad", AT(teeth.pressure_angle_rad), 10 * DEG, 35 * DEG, 1},
    {"teeth.flexspline_shift", AT(teeth.flexspline_shift), -2, 12, 1},
    {"teeth.rigid_shift", AT(teeth.rigid_shift), -2, 12, 1},
    {"teeth.rack_addendum", AT(teeth.rack_addendum), 0.5, 1.5, 1},
    {"teeth.root_clearance", AT(teeth.root_clearance), 0.05, 0.6, 1},
    {"teeth.tooth_height", AT(teeth.tooth_height), 0.5, 3, 1},
    {"teeth.engagement_depth", AT(teeth.engagement_depth), 0.2, 2.5, 1},
    {"teeth.face_width_mm", AT(teeth.face_width_mm), 0.5, 400, 1},
    {"generator.deflection_mm", AT(generator.deflection_mm), 0.05, 0.5, 1},
    {"generator.contact_half_angle_rad", AT(generator.contact_half_angle_rad), 0.05, 1.2, 1},
    {"generator.cam_offset_mm", AT(generator.cam_offset_mm), 0, 10, 1},
    {"generator.eccentricity_mm", AT(generator.eccentricity_mm), 0, 0.25, 1},
    {"generator.eccentricity_angle_rad", AT(generator.eccentricity_angle_rad), -10, 10, 1},
    {"drive.rated_torque_Nm", AT(rated_torque_Nm), 1e-4, 1e6, 1},
    {"flexspline.rim_thickness_mm", AT(flexspline.rim_thickness_mm), 0.1, 5, 0},
    {"flexspline.wall_thickness_mm", AT(flexspline.wall_thickness_mm), 0.06, 1.8, 0},
    {"flexspline.length_mm", AT(flexspline.length_mm), 8, 200, 0},
    {"material.youngs_modulus_MPa", AT(material.youngs_modulus_MPa), 1, 1e7, 0},
    {"material.shear_modulus_MPa", AT(material.shear_modulus_MPa), 1, 1e7, 0},
    {"material.poisson_ratio", AT(material.poisson_ratio), 0, 0.49, 0},
    {"material.bending_fatigue_MPa", AT(material.bending_fatigue_MPa), 1, 1e5, 0},
    {"material.shear_fatigue_MPa", AT(material.shear_fatigue_MPa), 1, 1e5, 0},
    {"material.bending_notch_factor", AT(material.bending_notch_factor), 1, 10, 0},
    {"material.shear_notch_factor", AT(material.shear_notch_factor), 1, 10, 0},
    {"material.mean_stress_factor", AT(material.mean_stress_factor), 0, 1, 0},
    {"material.tooth_stress_factor", AT(material.tooth_stress_factor), 1, 5, 0},
    {"support.foundation_N_per_mm2", AT(support.foundation_N_per_mm2), 0, 1e15, 0},
    {"support.ring_stiffness_N_mm2", AT(support.ring_stiffness_N_mm2), 1e-9, 1e15, 0},
    {"support.ring_factor", AT(support.ring_factor), 0, 1000, 0},
    {"support.tooth_compliance_mm_per_N", AT(support.tooth_compliance_mm_per_N), 0, 1, 0},
    {"material.flank_pressure_MPa", AT(material.flank_pressure_MPa), 1, 1e5, 0},
    {"support.ball_diameter_mm", AT(support.ball_diameter_mm), 0.5, 15, 0},
    {"support.race_thickness_mm", AT(support.race_thickness_mm), 0.025, 5, 0},
    {"support.bearing_rating_N", AT(support.bearing_rating_N), 1, 1e9, 0},
    {"support.engagement_limit_rad", AT(support.engagement_limit_rad), 5 * DEG, 90 * DEG, 0},
    {"support.gap_limit_rad", AT(support.gap_limit_rad), 0.01 * (DEG / 60), 10 * DEG, 0},
    {"gap.generator_mm", AT(gap.generator_mm), 0, 0.25, 0},
    {"gap.teeth_mm", AT(gap.teeth_mm), 0, 0.25, 0},
    {"gap.ring_stiffness_N_per_mm", AT(gap.ring_stiffness_N_per_mm), 1e-9, 1e15, 0},
    {"drive.friction_angle_rad", AT(friction_angle_rad), 0, 0.3, 0}};
#define NUMBERS ((int)(sizeof numbers / sizeof numbers[0]))

/* A completed reference A with one number replaced. */
static void replace(const number *n, lm_real value) {
  drive = reference_a();
  complete();
  memcpy((char *)&drive + n->offset, &value, sizeof value);
}

/* NaN, infinities and numbers beyond either end; if the number is required, lm_complete_drive
 * refuses it too, and writes nothing. */
TEST(a_number_out_of_range_is_refused_by_its_key) {
  int k;
  int i;
  for (k = 0; k < NUMBERS; k++) {
    const number *n = &numbers[k];
    const double beyond = 1e-3 * fmax(fabs(n->low), fabs(n->high));
    lm_real wrong[6];
    wrong[0] = LM_REAL(NAN);
    wrong[1] = LM_REAL(INFINITY);
    wrong[2] = -LM_REAL(INFINITY);
    wrong[3] = LM_REAL(n->low - beyond);
    wrong[4] = LM_REAL(n->high + beyond);
    wrong[5] = LM_REAL(n->low - 1e-3 * fabs(n->low) - (n->low == 0 ? 1e-30 : 0));
    for (i = 0; i < 6; i++) {
      const lm_status expected = i < 3 ? LM_NOT_FINITE : LM_OUT_OF_RANGE;
      lm_drive before;
      if (strcmp(n->key, "teeth.module_mm") == 0 && i == 5) {
        continue; /* as 3 */
      }
      replace(n, wrong[i]);
      before = drive;
      assert_fault(expected, n->key, wrong[i], n->low, n->high, lm_check_drive(&drive, &fault));
      if (n->given) {
        memset(&fault, 0, sizeof fault);
        assert_fault(expected, n->key, wrong[i], n->low, n->high,
                     lm_complete_drive(&drive, &fault));
      }
      TEST_ASSERT_EQUAL_MEMORY(&before, &drive, sizeof drive);
    }
  }
}

/* Whether this value of the number is accepted. If the drive is refused, the fault is in another
 * key that contradicts it. */
static int in_range(const number *n, lm_real value) {
  replace(n, value);
  return lm_check_drive(&drive, &fault) == LM_OK || strcmp(fault.input, n->key) != 0;
}

/* The ends that a fault names belong to the range, and so do angles of whole degrees as typed. */
TEST(the_ends_of_a_range_are_in_range) {
  int k;
  for (k = 0; k < NUMBERS; k++) {
    const number *n = &numbers[k];
    lm_real low;
    lm_real high;
    TEST_ASSERT_FALSE(in_range(n, LM_REAL(1e30)));
    low = fault.low;
    high = fault.high;
    TEST_ASSERT_TRUE_MESSAGE(in_range(n, low), n->key);
    TEST_ASSERT_TRUE_MESSAGE(in_range(n, high), n->key);
    if (strstr(n->key, "angle_rad") != 0) {
      TEST_ASSERT_TRUE_MESSAGE(in_range(n, LM_REAL(n->low)), n->key);
      TEST_ASSERT_TRUE_MESSAGE(in_range(n, LM_REAL(n->high)), n->key);
    }
  }
}

TEST(whole_numbers_out_of_range_are_refused) {
  complete();
#define WRONG(member, key, value, low, high)                                  \
  {                                                                           \
    const lm_drive before = drive;                                            \
    drive.member = value;                                                     \
    assert_fault(LM_OUT_OF_RANGE, key, LM_REAL((int)drive.member), low, high, \
                 lm_check_drive(&drive, &fault));                             \
    drive = before;                                                           \
  }
  WRONG(teeth.deformation, "teeth.deformation", (lm_deformation)2, 0, 1)
  WRONG(teeth.flexspline_teeth, "teeth.flexspline_teeth", 28, 30, 640)
  WRONG(teeth.flexspline_teeth, "teeth.flexspline_teeth", 642, 30, 640)
  WRONG(generator.type, "generator.type", (lm_generator_type)7, 0, 4)
  WRONG(generator.floating, "generator.floating", 2, 0, 1)
  WRONG(generator.floating, "generator.floating", -1, 0, 1)
  WRONG(axial_sections, "drive.axial_sections", 0, 1, LM_SECTIONS_MAX)
  WRONG(axial_sections, "drive.axial_sections", 8, 1, LM_SECTIONS_MAX)
  WRONG(radial_law_count, "radial_chain", 9, 0, LM_RADIAL_LAWS_MAX)
  WRONG(radial_law_count, "radial_chain", -1, 0, LM_RADIAL_LAWS_MAX)
  WRONG(torsion_count, "torsion_chain", 9, 0, LM_TORSION_ELEMENTS_MAX)
  WRONG(tolerance_count, "tolerance", 33, 0, LM_TOLERANCE_LINKS_MAX)
#undef WRONG
  assert_accepted();
}

TEST(contradictions_are_refused) {
  complete();
  drive.teeth.flexspline_teeth = 201;
  assert_fault(LM_INCONSISTENT, "teeth.flexspline_teeth", 201, 200, 202,
               lm_check_drive(&drive, &fault));
  drive.teeth.flexspline_teeth = 200;
  drive.teeth.rigid_teeth = 204;
  assert_fault(LM_INCONSISTENT, "teeth.rigid_teeth", 204, 202, 202, lm_check_drive(&drive, &fault));
  drive.teeth.rigid_teeth = 202;
  drive.generator.type = LM_RING;
  assert_fault(LM_INCONSISTENT, "generator.type", LM_RING, LM_COSINE, LM_ROLLERS,
               lm_check_drive(&drive, &fault));
  drive = reference_e();
  drive.generator.type = LM_DISCS;
  assert_fault(LM_INCONSISTENT, "generator.type", LM_DISCS, LM_RING, LM_RING,
               lm_complete_drive(&drive, &fault));
  drive = reference_e();
  drive.teeth.rigid_teeth = 204;
  assert_fault(LM_INCONSISTENT, "teeth.rigid_teeth", 204, 200, 200,
               lm_complete_drive(&drive, &fault));
}

/* Either gear may turn the output: u = z / 2, of either sign. */
TEST(the_ratio_belongs_to_the_teeth) {
  static const double accepted[] = {100, 101, -100, -101};
  static const double refused[] = {0, 0.5, 1001, -5000};
  int i;
  for (i = 0; i < 4; i++) {
    drive.ratio = LM_REAL(accepted[i]);
    complete();
    assert_accepted();
    drive = reference_a();
    drive.ratio = LM_REAL(refused[i]);
    assert_fault(LM_OUT_OF_RANGE, "drive.ratio", LM_REAL(refused[i]), 1, 1000,
                 lm_complete_drive(&drive, &fault));
  }
  drive.ratio = LM_REAL(NAN);
  assert_fault(LM_NOT_FINITE, "drive.ratio", LM_REAL(NAN), 1, 1000,
               lm_complete_drive(&drive, &fault));
  drive.ratio = LM_REAL(-120);
  assert_fault(LM_INCONSISTENT, "drive.ratio", -120, 100, 101, lm_complete_drive(&drive, &fault));
  drive = reference_e();
  drive.ratio = 102;
  assert_fault(LM_INCONSISTENT, "drive.ratio", 102, 100, 101, lm_complete_drive(&drive, &fault));
}

TEST(flanks_below_their_base_circle_are_refused) {
  drive.teeth.flexspline_teeth = 600; /* root and base circles far apart */
  drive.teeth.rigid_teeth = 602;
  drive.teeth.flexspline_shift = -2;
  drive.teeth.rack_addendum = LM_REAL(1.5);
  drive.teeth.root_clearance = LM_REAL(0.6);
  drive.teeth.tooth_height = LM_REAL(0.5);
  drive.teeth.engagement_depth = LM_REAL(2.5);
  drive.teeth.pressure_angle_rad = LM_REAL(10) * DEGREE;
  drive.ratio = 300;
  complete();
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, lm_check_drive(&drive, &fault));
  TEST_ASSERT_EQUAL_STRING("teeth.engagement_depth", fault.input);
  TEST_ASSERT_TRUE(fault.found < fault.low);
}

/* A deflection of two modules on 30 teeth is more than an eighth of the radius. */
TEST(a_wave_that_no_rim_can_have_is_refused) {
  drive.teeth.flexspline_teeth = 30;
  drive.teeth.rigid_teeth = 32;
  drive.teeth.flexspline_shift = 0;
  drive.teeth.rigid_shift = 0;
  drive.generator.deflection_mm = LM_REAL(0.5);
  drive.flexspline.rim_thickness_mm = LM_REAL(0.09);
  drive.ratio = 15;
  complete();
  assert_fault(LM_OUT_OF_RANGE, "generator.deflection_mm", LM_REAL(0.5),
               1e-4 * (0.25 * 13.65 - 0.045), (0.25 * 13.65 - 0.045) / 8,
               lm_check_drive(&drive, &fault));
}

/* The open end of a short cup has half as much again; the planar model does not. */
TEST(the_widest_section_of_a_cup_must_have_a_mesh) {
  static lm_mesh mesh;
  drive.teeth.flexspline_teeth = 30;
  drive.teeth.rigid_teeth = 32;
  drive.teeth.flexspline_shift = 0;
  drive.teeth.rigid_shift = 0;
  drive.generator.deflection_mm = LM_REAL(0.4);
  drive.flexspline.rim_thickness_mm = LM_REAL(0.09);
  drive.flexspline.length_mm = 10;
  drive.ratio = 15;
  complete();
  assert_accepted();
  drive.axial_sections = 3;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_check_drive(&drive, &fault));
  TEST_ASSERT_EQUAL_STRING("generator.deflection_mm", fault.input);
  ASSERT_NEAR(1e-6, 0.6, fault.found);
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_make_mesh(&drive, lm_section_factor(&drive, 2, 3),
                                                  LM_NEUTRAL_LINE_NODES, &mesh, &fault));
}

/* Members of a chain are named by their field. */
TEST(members_of_the_chains_are_checked) {
  complete();
  drive.radial_laws[0].exponent = LM_REAL(NAN);
  TEST_ASSERT_EQUAL(LM_NOT_FINITE, lm_check_drive(&drive, &fault));
  TEST_ASSERT_EQUAL_STRING("radial_chain.exponent", fault.input);
  drive = reference_a();
  complete();
  drive.torsion[3].ratio = 0;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_check_drive(&drive, &fault));
  TEST_ASSERT_EQUAL_STRING("torsion_chain.ratio", fault.input);
  drive = reference_a();
  complete();
  drive.tolerance_count = 1;
  drive.tolerances[0].distribution = (lm_distribution)99;
  TEST_ASSERT_TRUE(lm_check_drive(&drive, &fault) != LM_OK);
  TEST_ASSERT_EQUAL_INT(0, strncmp("tolerance", fault.input, 9));
}

/* Invalid moduli and lengths, before the chains are made from them. */
TEST(a_chain_cannot_be_made_from_nonsense) {
  lm_drive before;
  int i;
  for (i = 0; i < 5; i++) {
    drive = reference_a();
    if (i == 0) {
      drive.material.youngs_modulus_MPa = LM_REAL(NAN); /* for the ring's stiffness */
    } else if (i == 1) {
      drive.material.youngs_modulus_MPa = LM_REAL(NAN); /* for the radial chain */
      drive.gap.ring_stiffness_N_per_mm = 30;
    } else if (i == 2) {
      drive.material.shear_modulus_MPa = LM_REAL(NAN); /* for the cup */
    } else if (i == 3) {
      drive.flexspline.wall_thickness_mm = LM_REAL(7e4); /* wider than the cup */
    } else {
      drive.flexspline.length_mm = LM_REAL(NAN);
    }
    before = drive;
    TEST_ASSERT_TRUE(lm_complete_drive(&drive, &fault) != LM_OK);
    TEST_ASSERT_EQUAL_MEMORY(&before, &drive, sizeof drive);
  }
}

TEST(null_is_refused) {
  TEST_ASSERT_EQUAL(LM_NULL, lm_check_drive(0, &fault));
  TEST_ASSERT_EQUAL_STRING("drive", fault.input);
  TEST_ASSERT_EQUAL(LM_NULL, lm_complete_drive(0, &fault));
  TEST_ASSERT_EQUAL_STRING("drive", fault.input);
  TEST_ASSERT_EQUAL(LM_NULL, lm_complete_drive(0, 0));
  drive.teeth.rigid_teeth = 1; /* and a fault that was not requested is not written */
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, lm_complete_drive(&drive, 0));
  drive.teeth.rigid_teeth = 202;
  drive.teeth.module_mm = 0;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_complete_drive(&drive, 0));
}
