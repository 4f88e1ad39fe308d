#include "lostmotion/mesh.h"

#include "reference_drives.h"
#include "test.h"

static lm_fault fault;
static lm_mesh mesh;
static lm_clearance lobe[LM_LOBE_TEETH_MAX];
static uint32_t seed;

void setUp(void) {
  seed = 1;
  memset(&fault, 0, sizeof fault);
}

static void make(const lm_drive *drive, double section_factor) {
  TEST_ASSERT_EQUAL_MESSAGE(
      LM_OK, lm_make_mesh(drive, LM_REAL(section_factor), LM_NEUTRAL_LINE_NODES, &mesh, &fault),
      fault.input);
}

static lm_clearance at_degrees(double angle) {
  return lm_tooth_clearance(&mesh, LM_REAL(angle) * DEGREE);
}

/* Printed tables agree within 0.003 arcmin; float32 within 0.01 of the exact value. */
#define TABLE BOUND(0.003, 0.011)

/* --- published values ------------------------------------------------------------------------- */

typedef struct printed_gap {
  double angle_deg;
  double discs;
  double cosine;
  double rollers;
  double radius_mm; /* of contact, discs */
} printed_gap;

/* check_values.md, reference drive A. */
static const printed_gap reference_a_gaps[] = {
    {-10, 1.531, 1.688, 1.417, 25.788}, {-5, .642, .691, .607, 25.788},
    {0, .174, .174, .174, 25.788},      {5, .011, -.001, .020, 26.084},
    {10, .069, .094, .051, 26.074},     {15, .351, .445, .283, 26.059},
    {20, .780, .952, .654, 26.037},     {25, 1.277, 1.506, 1.105, 26.010},
    {30, 1.761, 1.998, 1.574, 25.976},  {35, 2.163, 2.318, 2.021, 25.938},
    {40, 2.368, 2.347, 2.332, 25.896},  {45, 2.206, 1.990, 2.322, 25.788},
    {50, 1.614, 1.216, 1.877, 25.788}};
#define REFERENCE_A_GAPS ((int)(sizeof reference_a_gaps / sizeof reference_a_gaps[0]))

TEST(the_gaps_of_reference_a) {
  static const lm_generator_type types[] = {LM_DISCS, LM_COSINE, LM_ROLLERS};
  int k;
  int i;
  for (k = 0; k < 3; k++) {
    lm_drive drive = reference_a();
    drive.generator.type = types[k];
    make(&drive, 1);
    for (i = 0; i < REFERENCE_A_GAPS; i++) {
      const printed_gap *row = &reference_a_gaps[i];
      const lm_clearance ahead = at_degrees(row->angle_deg);
      const lm_clearance behind = at_degrees(-row->angle_deg);
      ASSERT_NEAR(TABLE,
                  k == 0   ? row->discs
                  : k == 1 ? row->cosine
                           : row->rollers,
                  in_arcmin(ahead.forward.gap_rad));
      ASSERT_NEAR(0, ahead.forward.gap_rad, behind.backward.gap_rad);
      ASSERT_NEAR(0, ahead.backward.gap_rad, behind.forward.gap_rad);
      ASSERT_NEAR(0, ahead.forward.radius_mm, behind.backward.radius_mm);
      /* Section 2.4: flank angles of A lie at 22.5 to 24.3 deg. */
      TEST_ASSERT_TRUE(ahead.forward.flank_angle_rad > LM_REAL(22.4) * DEGREE);
      TEST_ASSERT_TRUE(ahead.forward.flank_angle_rad < LM_REAL(24.35) * DEGREE);
      if (k == 0) {
        ASSERT_NEAR(0.003, row->radius_mm, ahead.forward.radius_mm);
      }
    }
  }
}

/* check_values.md, reference drive E: polygons rotated until they touch. */
TEST(the_gaps_of_reference_e) {
  static const double angle[] = {-20, -10, 0, 5, 10, 20, 30, 40, 50};
  static const double gap[] = {1.893, .567, .090, .282, .905, 3.733, 9.119, 17.519, 28.646};
  const lm_drive drive = reference_e();
  int i;
  make(&drive, 1);
  for (i = 0; i < 9; i++) {
    ASSERT_NEAR(TABLE, gap[i], in_arcmin(at_degrees(angle[i]).forward.gap_rad));
    ASSERT_NEAR(0, at_degrees(angle[i]).forward.gap_rad, at_degrees(-angle[i]).backward.gap_rad);
  }
}

/* check_values.md, axial sections: smallest gap of an axial section, scanned in steps of
 * 0.25 deg. */
TEST(the_smallest_gap_of_a_section) {
  static const double factor[] = {.89, .95, 1, 1.05, 1.11, 1.26};
  static const double printed[] = {-1.04, .21, 0, -.57, -1.33, -3.51};
  const lm_drive drive = reference_a();
  int k;
  int i;
  for (k = 0; k < 6; k++) {
    double smallest = 99;
    make(&drive, factor[k]);
    for (i = -240; i <= 240; i++) {
      smallest = fmin(smallest, in_arcmin(at_degrees(0.25 * i).forward.gap_rad));
    }
    ASSERT_NEAR(BOUND(0.0051, 0.012), printed[k], smallest);
  }
}

/* check_values.md, reference drive A: change of j per loss of the whole deformation, metal
 * fixed. */
TEST(a_smaller_wave_opens_near_teeth_and_closes_far_ones) {
  static const double printed[] = {.417, .268, .054, -.171, -.384};
  const lm_drive drive = reference_a();
  const double loss = BOUND(1e-4, 1e-3); /* mm */
  double gap[5];
  int i;
  make(&drive, 1);
  for (i = 0; i < 5; i++) {
    gap[i] = (double)at_degrees(10 * i).forward.gap_rad;
  }
  make(&drive, 1 - loss / 0.2375);
  for (i = 0; i < 5; i++) {
    const lm_gap now = at_degrees(10 * i).forward;
    ASSERT_NEAR(BOUND(0.006, 0.02), printed[i],
                ((double)now.gap_rad - gap[i]) * (double)now.radius_mm / loss);
  }
}

/* check_values.md, neutral line: the ellipse differs from the cosine by at most 6 arcsec up to 45
 * deg. */
TEST(the_elliptical_cam_is_nearly_the_cosine) {
  lm_drive drive = reference_a();
  double gap[19];
  int i;
  drive.generator.type = LM_COSINE;
  make(&drive, 1);
  for (i = -9; i <= 9; i++) {
    gap[i + 9] = in_arcmin(at_degrees(5 * i).forward.gap_rad);
  }
  drive.generator.type = LM_ELLIPSE;
  make(&drive, 1);
  for (i = -2; i <= 9; i++) {
    const double off = in_arcmin(at_degrees(5 * i).forward.gap_rad) - gap[i + 9];
    ASSERT_NEAR(0.1, 0, off);
    TEST_ASSERT_TRUE(i == 0 || fabs(off) > 1e-4);
  }
}

/* --- the definition --------------------------------------------------------------------------- */

/* Half angle of a flank by its definition, in double. */
static double half_angle(const lm_involute *flank, double radius) {
  const double base = (double)flank->base_mm;
  const double pressure = radius > base ? acos(base / radius) : 0;
  return (double)flank->half_angle_rad - (tan(pressure) - pressure);
}

/* The gap by sampling the flank: the smallest angle over the radii that both flanks have. Points
 * outside are left out, so this is an upper bound, a close one if contact is inside. */
static double sampled_gap(double angle, int forward) {
  enum { POINTS = 4000 };
  const lm_geometry *g = &mesh.geometry;
  const double sense = g->deformation == LM_INTERNAL ? 1 : -1;
  const double side = forward ? sense : -sense;
  const lm_placement place = lm_place_tooth(&mesh.line, LM_REAL(angle));
  const double root = fmax((double)g->flexspline_root_mm, (double)g->flexspline.base_mm);
  const double tip = fmax((double)g->flexspline_tip_mm, (double)g->flexspline.base_mm);
  const double lead = (double)place.lead_rad + angle * (double)g->lead_per_angle;
  double smallest = HUGE_VAL;
  int i;
  for (i = 0; i <= POINTS; i++) {
    const double rho = tip + (root - tip) * (double)i / (double)POINTS;
    const double xi = half_angle(&g->flexspline, rho);
    const double x = side * rho * sin(xi);
    const double y = rho * cos(xi) - (double)g->neutral_mm;
    const double along =
        (double)place.radius_mm + y * (double)place.tilt_cos - x * (double)place.tilt_sin;
    const double across = y * (double)place.tilt_sin + x * (double)place.tilt_cos;
    const double radius = hypot(along, across);
    const int shared = sense > 0
                           ? radius >= (double)g->rigid_tip_mm
                           : radius <= (double)g->rigid_tip_mm &&
                                 radius >= fmax((double)g->rigid_root_mm, (double)g->rigid.base_mm);
    if (shared) {
      smallest = fmin(
          smallest, sense * (half_angle(&g->rigid, radius) - side * (atan2(across, along) + lead)));
    }
  }
  return smallest;
}

static lm_drive random_drive(void) {
  lm_drive drive = draw(&seed, 0, 1) < 0.7 ? reference_a() : reference_e();
  const int external = drive.teeth.deformation == LM_EXTERNAL;
  const int teeth = 2 * (int)draw(&seed, 16, 160);
  const double module = draw(&seed, 0.1, 2);
  drive.teeth.flexspline_teeth = teeth;
  drive.teeth.rigid_teeth = teeth + (external ? -2 : 2);
  drive.teeth.module_mm = LM_REAL(module);
  drive.teeth.flexspline_shift = LM_REAL(draw(&seed, -0.5, 5));
  drive.teeth.rigid_shift = drive.teeth.flexspline_shift + LM_REAL(draw(&seed, -0.3, 0.4));
  drive.teeth.pressure_angle_rad = LM_REAL(draw(&seed, 15, 30)) * DEGREE;
  drive.teeth.tooth_height = LM_REAL(draw(&seed, 1, 2.2));
  drive.teeth.engagement_depth = LM_REAL(draw(&seed, 0.5, 1.8));
  drive.generator.deflection_mm = LM_REAL(module * draw(&seed, 0.7, 1.4));
  drive.flexspline.rim_thickness_mm = LM_REAL(0.012 * module * teeth);
  if (!external) {
    drive.generator.type = (lm_generator_type)(int)draw(&seed, 0, 4);
  }
  return drive;
}

/* Both flanks at twelve angles; returns the number of compared gaps. */
static int compare_with_samples(const lm_drive *drive) {
  int compared = 0;
  int i;
  make(drive, 1);
  for (i = 0; i < 24; i++) {
    const int forward = i % 2;
    const double angle = draw(&seed, -1.5, 1.5);
    const lm_clearance found = lm_tooth_clearance(&mesh, LM_REAL(angle));
    const lm_gap *gap = forward ? &found.forward : &found.backward;
    const double sampled = in_arcmin(LM_REAL(sampled_gap(angle, forward)));
    if (isinf(gap->gap_rad)) {
      TEST_ASSERT_TRUE(gap->radius_mm == 0 && gap->flank_angle_rad == 0);
      TEST_ASSERT_TRUE(isinf(sampled) || LM_REAL_BITS == 32);
    } else if (!isinf(sampled)) { /* an overlap thinner than the sampling is skipped */
      TEST_ASSERT_TRUE(in_arcmin(gap->gap_rad) <= sampled + BOUND(1e-4, 0.05));
      ASSERT_NEAR(BOUND(0.02, 0.08), sampled, in_arcmin(gap->gap_rad));
      compared++;
    }
  }
  return compared;
}

/* Internal and external drives of any size. */
TEST(the_gap_is_the_smallest_over_the_common_radii) {
  int compared = 0;
  int round;
  for (round = 0; round < 60; round++) {
    const lm_drive drive = random_drive();
    compared += compare_with_samples(&drive);
  }
  TEST_ASSERT_TRUE(compared > 300);
}

/* If the flanks fit so well that the curvature of the gap is below float32's rounding, it is zero
 * or negative at a few minima of random drives: Newton steps must not use it. In double the same
 * drives are ordinary. */
TEST(a_gap_without_a_bend_keeps_its_minimum) {
  static const struct {
    int external;
    double shift, rigid_shift, height, depth, pressure_deg, wave, angle;
  } flat[] = {
      {1, 2.09034157, 1.73618603, 1.3822999, .820701778, 29.7058451, .792069077, -.15482053},
      {0, 3.37490344, 3.21062279, 1.2533572, .668744922, 30.8043307, .767518640, .17366717},
      {1, 1.14491677, 1.55204773, 2.0128694, .809550762, 21.9097323, .874499977, -.12177242},
      {0, 3.24132657, 3.72612786, 1.5047645, .806814611, 27.1546209, .815078318, .15147291},
      {0, 5.35258961, 6.14399099, 1.9005272, .421283484, 17.6374062, .891940475, -.12965463}};
  int i;
  for (i = 0; i < (int)(sizeof flat / sizeof flat[0]); i++) {
    lm_drive drive = flat[i].external ? reference_e() : reference_a();
    const lm_gap *gap;
    lm_clearance found;
    int forward;
    drive.teeth.flexspline_shift = LM_REAL(flat[i].shift);
    drive.teeth.rigid_shift = LM_REAL(flat[i].rigid_shift);
    drive.teeth.tooth_height = LM_REAL(flat[i].height);
    drive.teeth.engagement_depth = LM_REAL(flat[i].depth);
    drive.teeth.pressure_angle_rad = LM_REAL(flat[i].pressure_deg) * DEGREE;
    drive.generator.deflection_mm = drive.teeth.module_mm * LM_REAL(flat[i].wave);
    make(&drive, 1);
    found = lm_tooth_clearance(&mesh, LM_REAL(flat[i].angle));
    for (forward = 0; forward < 2; forward++) {
      gap = forward ? &found.forward : &found.backward;
      ASSERT_NEAR(BOUND(0.02, 0.08), in_arcmin(LM_REAL(sampled_gap(flat[i].angle, forward))),
                  in_arcmin(gap->gap_rad));
    }
  }
}

/* With few teeth and no shift the root circle lies inside the base circle, where the flank ends. */
TEST(a_flank_ends_on_its_base_circle) {
  lm_drive drive = reference_a();
  drive.teeth.flexspline_teeth = 32;
  drive.teeth.rigid_teeth = 34;
  drive.teeth.flexspline_shift = 0;
  drive.teeth.rigid_shift = 0;
  drive.flexspline.rim_thickness_mm = LM_REAL(0.1);
  TEST_ASSERT_TRUE(compare_with_samples(&drive) > 5);
  TEST_ASSERT_TRUE(mesh.geometry.flexspline_root_mm < mesh.geometry.flexspline.base_mm);
  drive = reference_e();
  drive.teeth.flexspline_teeth = 34;
  drive.teeth.rigid_teeth = 32;
  drive.teeth.flexspline_shift = 0;
  drive.teeth.rigid_shift = 0;
  drive.flexspline.rim_thickness_mm = LM_REAL(0.1);
  TEST_ASSERT_TRUE(compare_with_samples(&drive) > 5);
  TEST_ASSERT_TRUE(mesh.geometry.rigid_root_mm < mesh.geometry.rigid.base_mm);
}

/* The same contact in the coordinates of the rigid gear: the flank angle is the pressure angle
 * minus the half angle there. */
TEST(the_flank_angle_belongs_to_the_radius_of_contact) {
  const lm_drive drive = reference_a();
  int i;
  make(&drive, 1);
  for (i = -10; i <= 50; i += 3) {
    const lm_gap gap = at_degrees(i).forward;
    const double radius = (double)gap.radius_mm;
    const double pressure = acos((double)mesh.geometry.rigid.base_mm / radius);
    ASSERT_NEAR(BOUND(2e-5, 3e-5), pressure - half_angle(&mesh.geometry.rigid, radius),
                gap.flank_angle_rad);
  }
}

/* --- properties ------------------------------------------------------------------------------- */

TEST(angles_do_not_depend_on_the_module) {
  static const double scale[] = {2, 4, 40};
  lm_drive drive = reference_a();
  double gap[13];
  double radius[13];
  int k;
  int i;
  make(&drive, 1);
  for (i = 0; i < 13; i++) {
    gap[i] = (double)at_degrees(5 * i - 10).forward.gap_rad;
    radius[i] = (double)at_degrees(5 * i - 10).forward.radius_mm;
  }
  for (k = 0; k < 3; k++) {
    drive = reference_a();
    drive.teeth.module_mm *= LM_REAL(scale[k]);
    drive.generator.deflection_mm *= LM_REAL(scale[k]);
    drive.flexspline.rim_thickness_mm *= LM_REAL(scale[k]);
    make(&drive, 1);
    for (i = 0; i < 13; i++) {
      const lm_gap larger = at_degrees(5 * i - 10).forward;
      ASSERT_NEAR(BOUND(1e-12, 2e-6), gap[i], larger.gap_rad);
      ASSERT_NEAR(scale[k] * BOUND(1e-9, 0.01), scale[k] * radius[i], larger.radius_mm);
    }
  }
}

/* Section 2.3: x2 changes every gap of every tooth by 2 dx2 tan(alpha) / z2, 12.4 arcmin
 * per unit. */
TEST(the_rigid_shift_opens_all_gaps_alike) {
  static const double shifts[] = {-0.2, -0.05, 0.05, 0.2};
  int k;
  int i;
  for (k = 0; k < 4; k++) {
    lm_drive drive = reference_a();
    lm_clearance before[10];
    const double change = 2 * shifts[k] * tan(20 * 3.14159265358979 / 180) / 202;
    make(&drive, 1);
    for (i = 0; i < 10; i++) {
      before[i] = at_degrees(5 * i);
    }
    drive.teeth.rigid_shift += LM_REAL(shifts[k]);
    make(&drive, 1);
    for (i = 0; i < 10; i++) {
      const lm_clearance after = at_degrees(5 * i);
      ASSERT_NEAR(BOUND(1e-9, 1e-6), change, after.forward.gap_rad - before[i].forward.gap_rad);
      if (!isinf(before[i].backward.gap_rad)) {
        ASSERT_NEAR(BOUND(1e-9, 1e-6), change, after.backward.gap_rad - before[i].backward.gap_rad);
      }
    }
    ASSERT_NEAR(0.02, 12.4 * shifts[k], in_arcmin(LM_REAL(change)));
  }
}

/* Steps of 0.05 deg: no jump, through every change of the corner in contact. */
TEST(gaps_are_continuous_in_the_angle) {
  int external;
  for (external = 0; external < 2; external++) {
    const lm_drive drive = external ? reference_e() : reference_a();
    double before;
    int i;
    make(&drive, 1);
    before = in_arcmin(at_degrees(-60).forward.gap_rad);
    for (i = -1199; i <= 1000; i++) {
      const double gap = in_arcmin(at_degrees(0.05 * i).forward.gap_rad);
      TEST_ASSERT_TRUE(fabs(gap - before) < 0.2 || isinf(before));
      before = gap;
    }
  }
}

TEST(far_teeth_do_not_overlap) {
  const lm_drive drive = reference_a();
  int i;
  make(&drive, 1);
  for (i = -90; i <= 90; i++) {
    const lm_gap gap = at_degrees(i).forward;
    if (abs(i) > 60) {
      TEST_ASSERT_TRUE(isinf(gap.gap_rad) && gap.gap_rad > 0);
      TEST_ASSERT_TRUE(gap.radius_mm == 0 && gap.flank_angle_rad == 0);
    } else if (abs(i) < 50) {
      TEST_ASSERT_TRUE(isfinite(gap.gap_rad));
    }
  }
}

/* Both lobes are equal: the opposite tooth meets its own space in the same way. */
TEST(clearances_repeat_every_half_turn) {
  int round;
  for (round = 0; round < 20; round++) {
    const lm_drive drive = random_drive();
    int i;
    make(&drive, 1);
    for (i = 0; i < 10; i++) {
      const lm_real angle = LM_REAL(draw(&seed, -1.5, 1.5));
      const lm_clearance here = lm_tooth_clearance(&mesh, angle);
      const lm_clearance there = lm_tooth_clearance(&mesh, angle + LM_PI);
      const lm_clearance back = lm_tooth_clearance(&mesh, angle - 2 * LM_PI);
      TEST_ASSERT_TRUE(there.angle_rad == angle + LM_PI);
      if (isfinite(here.forward.gap_rad) && isfinite(there.forward.gap_rad)) {
        ASSERT_NEAR(BOUND(1e-13, 3e-6), here.forward.gap_rad, there.forward.gap_rad);
        ASSERT_NEAR(BOUND(1e-13, 3e-6), here.forward.gap_rad, back.forward.gap_rad);
      }
      if (isfinite(here.backward.gap_rad) && isfinite(there.backward.gap_rad)) {
        ASSERT_NEAR(BOUND(1e-13, 3e-6), here.backward.gap_rad, there.backward.gap_rad);
      }
    }
  }
}

TEST(any_finite_angle_has_a_clearance) {
  const lm_drive drive = reference_a();
  int i;
  make(&drive, 1);
  for (i = -40; i <= 40; i++) {
    const lm_real far = LM_REAL(i) / 40 * LM_REAL(BOUND(DBL_MAX, (double)FLT_MAX));
    const lm_clearance found = lm_tooth_clearance(&mesh, far);
    TEST_ASSERT_TRUE(found.forward.gap_rad > -1 && !isnan(found.backward.gap_rad));
  }
}

TEST(more_nodes_do_not_change_the_gaps) {
  int external;
  for (external = 0; external < 2; external++) {
    const lm_drive drive = external ? reference_e() : reference_a();
    lm_clearance usual[40];
    int i;
    make(&drive, 1);
    for (i = 0; i < 40; i++) {
      usual[i] = at_degrees(i + 0.3);
    }
    TEST_ASSERT_EQUAL(LM_OK, lm_make_mesh(&drive, 1, LM_NEUTRAL_LINE_NODES_MAX, &mesh, &fault));
    for (i = 0; i < 40; i++) {
      ASSERT_NEAR(BOUND(1e-6, 0.01), in_arcmin(usual[i].forward.gap_rad),
                  in_arcmin(at_degrees(i + 0.3).forward.gap_rad));
    }
  }
}

/* --- lists of teeth --------------------------------------------------------------------------- */

static int list(double phase_rad) {
  int count = -1;
  TEST_ASSERT_EQUAL(LM_OK, lm_lobe_clearances(&mesh, LM_REAL(phase_rad), lobe, LM_LOBE_TEETH_MAX,
                                              &count, &fault));
  return count;
}

TEST(a_lobe_lists_every_tooth_in_its_order) {
  static const int teeth[] = {30, 32, 200, 638, 640};
  int k;
  for (k = 0; k < 5; k++) {
    lm_drive drive = reference_a();
    const double pitch = 2 * 3.14159265358979323846 / teeth[k];
    int p;
    drive.teeth.flexspline_teeth = teeth[k];
    drive.teeth.rigid_teeth = teeth[k] + 2;
    make(&drive, 1);
    for (p = -12; p <= 12; p++) {
      const double phase = p / 8.0 * pitch;
      const int count = list(phase);
      int i;
      TEST_ASSERT_TRUE(count >= teeth[k] / 2 && count <= teeth[k] / 2 + 1);
      for (i = 0; i < count; i++) {
        const double number = ((double)lobe[i].angle_rad - phase) / pitch;
        const lm_clearance alone = lm_tooth_clearance(&mesh, lobe[i].angle_rad);
        ASSERT_NEAR(BOUND(1e-10, 2e-4), floor(number + 0.5), number);
        TEST_ASSERT_TRUE(lobe[i].angle_rad <= HALF_PI && lobe[i].angle_rad >= -HALF_PI);
        TEST_ASSERT_TRUE(i == 0 || lobe[i].angle_rad > lobe[i - 1].angle_rad);
        TEST_ASSERT_TRUE(alone.forward.gap_rad == lobe[i].forward.gap_rad);
        TEST_ASSERT_TRUE(alone.backward.gap_rad == lobe[i].backward.gap_rad);
      }
      /* The teeth next to both ends are the first ones outside. */
      TEST_ASSERT_TRUE((double)lobe[count - 1].angle_rad + 0.999 * pitch > 1.5707963);
      TEST_ASSERT_TRUE((double)lobe[0].angle_rad - 0.999 * pitch < -1.5707963);
    }
  }
}

TEST(the_phase_repeats_every_pitch) {
  const lm_drive drive = reference_a();
  const double pitch = 2 * 3.14159265358979323846 / 200;
  lm_clearance before[LM_LOBE_TEETH_MAX];
  int count;
  int turn;
  make(&drive, 1);
  count = list(0.3 * pitch);
  memcpy(before, lobe, sizeof lobe);
  for (turn = -3; turn <= 3; turn++) {
    int i;
    TEST_ASSERT_EQUAL(count, list((0.3 + turn) * pitch));
    for (i = 0; i < count; i++) {
      ASSERT_NEAR(BOUND(1e-13, 1e-6), before[i].angle_rad, lobe[i].angle_rad);
      if (isfinite(before[i].forward.gap_rad) && isfinite(lobe[i].forward.gap_rad)) {
        ASSERT_NEAR(BOUND(1e-13, 3e-6), before[i].forward.gap_rad, lobe[i].forward.gap_rad);
      }
    }
  }
}

/* Phases p and -p mirror each other, the flanks exchanged. */
TEST(the_lobe_mirrors) {
  int external;
  for (external = 0; external < 2; external++) {
    const lm_drive drive = external ? reference_e() : reference_a();
    int count;
    int i;
    make(&drive, 1);
    count = list(0);
    for (i = 0; i < count; i++) {
      const lm_clearance *a = &lobe[i];
      const lm_clearance *b = &lobe[count - 1 - i];
      ASSERT_NEAR(BOUND(1e-15, 1e-7), -a->angle_rad, b->angle_rad);
      TEST_ASSERT_EQUAL(isinf(a->forward.gap_rad), isinf(b->backward.gap_rad));
      if (isfinite(a->forward.gap_rad)) {
        ASSERT_NEAR(BOUND(1e-14, 1e-7), a->forward.gap_rad, b->backward.gap_rad);
      }
    }
  }
}

/* A tooth within rounding of 90 deg is at 90 deg, at either end. */
TEST(teeth_at_ninety_degrees_are_listed_at_both_ends) {
  const lm_drive drive = reference_a();
  const double pitch = 2 * 3.14159265358979323846 / 200;
  make(&drive, 1);
  TEST_ASSERT_EQUAL(101, list(0));
  ASSERT_NEAR(0, -HALF_PI, lobe[0].angle_rad);
  ASSERT_NEAR(0, HALF_PI, lobe[100].angle_rad);
  TEST_ASSERT_EQUAL(101, list(5e-5 * pitch));
  ASSERT_NEAR(0, HALF_PI, lobe[100].angle_rad);
  TEST_ASSERT_EQUAL(101, list(-5e-5 * pitch));
  ASSERT_NEAR(0, -HALF_PI, lobe[0].angle_rad);
  TEST_ASSERT_EQUAL(100, list(0.5 * pitch));
}

TEST(any_finite_phase_lists_a_lobe) {
  const lm_drive drive = reference_a();
  int i;
  make(&drive, 1);
  for (i = -20; i <= 20; i++) {
    const double scale = i % 2 == 0 ? BOUND(DBL_MAX, (double)FLT_MAX) : 1e12;
    const int count = list(i / 20.0 * scale);
    TEST_ASSERT_TRUE(count == 100 || count == 101);
  }
}

/* --- sections --------------------------------------------------------------------------------- */

TEST(sections_stand_equally_spaced_with_both_edges) {
  TEST_ASSERT_TRUE(lm_section_place(0, 1) == LM_REAL(0.5));
  TEST_ASSERT_TRUE(lm_section_place(0, 5) == 0);
  TEST_ASSERT_TRUE(lm_section_place(1, 5) == LM_REAL(0.25));
  TEST_ASSERT_TRUE(lm_section_place(4, 5) == 1);
}

/* Straight generatrix, check_values.md, axial sections: b = 10 at L = 22 mm gives 1 -+ 5/22. */
TEST(the_deflection_grows_with_the_distance_from_the_cup) {
  lm_drive drive = reference_a();
  drive.flexspline.length_mm = 22;
  ASSERT_NEAR(BOUND(1e-15, 1e-7), 1, lm_section_factor(&drive, 0, 1));
  ASSERT_NEAR(BOUND(1e-15, 1e-7), 1 - 5.0 / 22, lm_section_factor(&drive, 0, 3));
  ASSERT_NEAR(BOUND(1e-15, 1e-7), 1, lm_section_factor(&drive, 1, 3));
  ASSERT_NEAR(BOUND(1e-15, 1e-7), 1 + 5.0 / 22, lm_section_factor(&drive, 2, 3));
  make(&drive, 1.25);
  ASSERT_NEAR(BOUND(1e-15, 1e-7), 1.25 * 0.2375, mesh.line.deflection_mm);
  ASSERT_NEAR(BOUND(1e-15, 1e-7), 0.2375, mesh.geometry.deflection_mm); /* the parts are the same */
}

/* --- refusals --------------------------------------------------------------------------------- */

static void assert_refused(lm_status status, const char *input, lm_status found) {
  TEST_ASSERT_EQUAL(status, found);
  TEST_ASSERT_EQUAL(status, fault.status);
  TEST_ASSERT_EQUAL_STRING(input, fault.input);
}

static void assert_fault_range(lm_real value, lm_real low, lm_real high) {
  TEST_ASSERT_TRUE(fault.found == value || (isnan(fault.found) && isnan(value)));
  TEST_ASSERT_TRUE(fault.low == low);
  TEST_ASSERT_TRUE(fault.high == high);
}

TEST(meshes_refuse_nonsense_and_write_nothing) {
  static lm_mesh before;
  const lm_real nan = LM_REAL(NAN);
  lm_drive drive = reference_a();
  memset(&mesh, 0x55, sizeof mesh);
  before = mesh;
  assert_refused(LM_NULL, "drive", lm_make_mesh(0, 1, 64, &mesh, &fault));
  assert_refused(LM_NULL, "mesh", lm_make_mesh(&drive, 1, 64, 0, &fault));
  assert_refused(LM_OUT_OF_RANGE, "section_factor",
                 lm_make_mesh(&drive, LM_REAL(0.1), 64, &mesh, &fault));
  assert_fault_range(LM_REAL(0.1), LM_REAL(0.2), 2);
  assert_refused(LM_NOT_FINITE, "section_factor", lm_make_mesh(&drive, nan, 64, &mesh, &fault));
  assert_fault_range(nan, LM_REAL(0.2), 2);
  assert_refused(LM_OUT_OF_RANGE, "nodes", lm_make_mesh(&drive, 1, 4, &mesh, &fault));
  assert_fault_range(4, 8, LM_NEUTRAL_LINE_NODES_MAX);
  drive.teeth.engagement_depth = LM_REAL(9.5);
  assert_refused(LM_INCONSISTENT, "teeth.engagement_depth",
                 lm_make_mesh(&drive, 1, 64, &mesh, &fault));
  TEST_ASSERT_EQUAL_MEMORY(&before, &mesh, sizeof mesh);
}

/* The sweep is the list of every phase at once. */
TEST(a_sweep_holds_every_phase) {
  static lm_clearance swept[LM_SWEEP_COUNT(202, 5)];
  lm_drive drives[2];
  int d;
  drives[0] = reference_a();
  drives[1] = reference_e();
  for (d = 0; d < 2; d++) {
    const int z = drives[d].teeth.flexspline_teeth;
    const lm_real pitch = LM_REAL(2) * LM_PI / LM_REAL(z);
    int count = 0;
    int phase;
    make(&drives[d], 1);
    TEST_ASSERT_EQUAL(LM_OK,
                      lm_sweep_clearances(&mesh, 5, swept, LM_SWEEP_COUNT(202, 5), &count, &fault));
    TEST_ASSERT_EQUAL(LM_SWEEP_COUNT(z, 5), count);
    for (phase = 0; phase < 5; phase++) {
      int listed = 0;
      int i;
      TEST_ASSERT_EQUAL(LM_OK, lm_lobe_clearances(&mesh, pitch * LM_REAL(phase) / LM_REAL(5), lobe,
                                                  LM_LOBE_TEETH_MAX, &listed, &fault));
      for (i = 0; i < listed; i++) {
        const int k = count / 2 + (int)floor((double)(lobe[i].angle_rad / pitch) * 5 + 0.5);
        if (k >= 0 && k < count && isfinite(lobe[i].forward.gap_rad)) {
          ASSERT_NEAR(BOUND(1e-13, 2e-6), lobe[i].angle_rad, swept[k].angle_rad);
          ASSERT_NEAR(BOUND(1e-12, 3e-7), lobe[i].forward.gap_rad, swept[k].forward.gap_rad);
        }
      }
    }
  }
}

TEST(a_sweep_refuses_nonsense) {
  static lm_clearance swept[LM_SWEEP_COUNT(200, 1)];
  const lm_drive drive = reference_a();
  int count = -7;
  make(&drive, 1);
  assert_refused(LM_NULL, "mesh", lm_sweep_clearances(0, 1, swept, 101, &count, &fault));
  assert_refused(LM_NULL, "clearances", lm_sweep_clearances(&mesh, 1, 0, 101, &count, &fault));
  assert_refused(LM_NULL, "count", lm_sweep_clearances(&mesh, 1, swept, 101, 0, &fault));
  assert_refused(LM_OUT_OF_RANGE, "phases",
                 lm_sweep_clearances(&mesh, 0, swept, 101, &count, &fault));
  assert_refused(LM_TOO_SMALL, "capacity",
                 lm_sweep_clearances(&mesh, 1, swept, 100, &count, &fault));
  TEST_ASSERT_EQUAL(-7, count);
}

TEST(lists_refuse_nonsense_and_write_nothing) {
  const lm_drive drive = reference_a();
  const lm_real nan = LM_REAL(NAN);
  const lm_real inf = LM_REAL(INFINITY);
  lm_clearance before[LM_LOBE_TEETH_MAX];
  int count = -7;
  make(&drive, 1);
  memset(lobe, 0x55, sizeof lobe);
  memcpy(before, lobe, sizeof lobe);
  assert_refused(LM_NULL, "mesh",
                 lm_lobe_clearances(0, 0, lobe, LM_LOBE_TEETH_MAX, &count, &fault));
  assert_refused(LM_NULL, "clearances",
                 lm_lobe_clearances(&mesh, 0, 0, LM_LOBE_TEETH_MAX, &count, &fault));
  assert_refused(LM_NULL, "count",
                 lm_lobe_clearances(&mesh, 0, lobe, LM_LOBE_TEETH_MAX, 0, &fault));
  assert_refused(LM_NOT_FINITE, "phase_rad",
                 lm_lobe_clearances(&mesh, nan, lobe, LM_LOBE_TEETH_MAX, &count, &fault));
  assert_fault_range(nan, -inf, inf);
  assert_refused(LM_NOT_FINITE, "phase_rad",
                 lm_lobe_clearances(&mesh, -inf, lobe, LM_LOBE_TEETH_MAX, &count, &fault));
  assert_fault_range(-inf, -inf, inf);
  assert_refused(LM_TOO_SMALL, "capacity", lm_lobe_clearances(&mesh, 0, lobe, 100, &count, &fault));
  assert_fault_range(100, 101, inf);
  TEST_ASSERT_EQUAL(LM_TOO_SMALL, lm_lobe_clearances(&mesh, 0, lobe, 100, &count, 0));
  TEST_ASSERT_EQUAL_MEMORY(before, lobe, sizeof lobe);
  TEST_ASSERT_EQUAL(-7, count);
  TEST_ASSERT_EQUAL(LM_OK, lm_lobe_clearances(&mesh, 0, lobe, 101, &count, 0));
}
