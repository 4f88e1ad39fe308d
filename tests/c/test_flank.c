/* Flanks other than involutes, and the flanks that they generate. tests/python/test_flanks.py
 * compares both with polygons. */
#include "lostmotion/flank.h"

#include <stddef.h>

#include "expect.h"
#include "lostmotion/conjugate.h"
#include "lostmotion/mesh.h"
#include "reference_drives.h"
#include "test.h"

static lm_drive drive;
static lm_geometry geometry;
static lm_neutral_line line;
static lm_flank flank;
static lm_mesh mesh;
static lm_flank_points points;

/* The arcs of Liu et al., Machines 13 (2025) 535, section 3.5. */
static void start_arcs(void) {
  drive = reference_a();
  drive.ratio = LM_REAL(50);
  drive.rated_torque_Nm = LM_REAL(10);
  drive.teeth.module_mm = LM_REAL(0.5);
  drive.teeth.flexspline_teeth = 100;
  drive.teeth.rigid_teeth = 102;
  drive.teeth.flexspline_shift = LM_REAL(0);
  drive.teeth.rigid_shift = LM_REAL(0);
  drive.teeth.rack_addendum = LM_REAL(0.6);
  drive.teeth.root_clearance = LM_REAL(0.15);
  drive.teeth.tooth_height = LM_REAL(1.3);
  drive.teeth.engagement_depth = LM_REAL(1);
  drive.teeth.flexspline_flank = LM_FLANK_DOUBLE_ARC;
  drive.teeth.rigid_flank = LM_FLANK_CONJUGATE;
  drive.generator.type = LM_COSINE;
  drive.generator.deflection_mm = LM_REAL(0.5);
  drive.generator.contact_half_angle_rad = LM_REAL(0);
  drive.flexspline.rim_thickness_mm = LM_REAL(0.7);
  drive.flank.rho_a = LM_REAL(1.37);
  drive.flank.l_a = LM_REAL(0.664);
  drive.flank.X_a = LM_REAL(0.31);
  drive.flank.rho_f = LM_REAL(1.57);
  drive.flank.l_f = LM_REAL(0.66);
  drive.flank.X_f = LM_REAL(0.268);
}

static void start_s_teeth(void) {
  start_arcs();
  drive.teeth.flexspline_flank = LM_FLANK_S_TOOTH;
  drive.flank.kappa = LM_REAL(0.9);
  drive.flank.s_M = LM_REAL(1.5);
}

static void start_low_s_teeth(void) {
  start_s_teeth();
  drive.flank.X_M = LM_REAL(-0.3);
}

static void shape_teeth(void) {
  ACCEPTED(lm_make_geometry(&drive.teeth, drive.generator.deflection_mm,
                            drive.flexspline.rim_thickness_mm, &geometry, &fault));
}

static lm_status make_flank(void) {
  return lm_make_flank(&drive, &geometry, 1, &flank, &fault);
}

static void make_mesh(void) {
  TEST_ASSERT_EQUAL_MESSAGE(
      LM_OK, lm_make_mesh(&drive, LM_REAL(1), LM_NEUTRAL_LINE_NODES, &mesh, &fault), fault.input);
}

static lm_real height_of(const lm_flank *of, int i, int count) {
  return of->low_mm + (of->high_mm - of->low_mm) * LM_REAL(i) / LM_REAL(count);
}

/* Points of the flank that is made, with its slopes. */
static void take_points(void) {
  int i;
  points.count = LM_FLANK_POINTS_MAX;
  for (i = 0; i < points.count; i++) {
    const lm_flank_foot foot = lm_evaluate_flank(&flank, height_of(&flank, i, points.count - 1));
    points.along_mm[i] = (double)foot.radius_mm;
    points.across_mm[i] = (double)foot.across_mm;
    points.slope[i] = (double)(foot.across_slope / foot.along_slope);
  }
}

static void start_points(void) {
  start_arcs();
  shape_teeth();
  ACCEPTED(make_flank());
  take_points();
  drive.teeth.flexspline_flank = LM_FLANK_POINTS;
  drive.flank.points = &points;
}

static lm_real angle_of(lm_real slope) {
  return LM_REAL(atan((double)slope));
}

/* Distance of a point of the undeformed tooth from the gear's centre. */
static lm_real polar_of(const lm_flank_foot *foot) {
  const double height = (double)(flank.neutral_mm + foot->along_mm);
  return LM_REAL(hypot(height, (double)foot->across_mm));
}

/* --- one flank -------------------------------------------------------------------------------- */

TEST(slope_and_curvature_are_those_of_the_points) {
  const lm_real step = LM_REAL(BOUND(1e-4, 1e-2));
  int kind;
  for (kind = 0; kind < 4; kind++) {
    int i;
    switch (kind) {
      case 0:
        start_arcs();
        break;
      case 1:
        start_s_teeth();
        break;
      case 2:
        start_points();
        break;
      default:
        start_arcs();
        drive.teeth.flexspline_flank = LM_FLANK_INVOLUTE;
        drive.teeth.flexspline_shift = LM_REAL(1);
    }
    shape_teeth();
    ACCEPTED(make_flank());
    for (i = 1; i < 17; i++) { /* not at a node of the spline */
      const lm_real height = height_of(&flank, i, 17);
      const lm_flank_foot below = lm_evaluate_flank(&flank, height - step);
      const lm_flank_foot here = lm_evaluate_flank(&flank, height);
      const lm_flank_foot above = lm_evaluate_flank(&flank, height + step);
      const lm_real slope = here.across_slope / here.along_slope;
      const lm_real turn = angle_of(above.across_slope / above.along_slope) -
                           angle_of(below.across_slope / below.along_slope);
      const lm_real length =
          LM_REAL(2) * step * here.along_slope * LM_REAL(sqrt(1.0 + (double)(slope * slope)));
      int crossed = 0;
      int j;
      for (j = 0; j < flank.joints; j++) {
        crossed |= fabs((double)(height - flank.joint_mm[j])) < 0.05; /* the curvature jumps */
      }
      if (!crossed) {
        ASSERT_NEAR(BOUND(2e-5, 5e-3), (above.across_mm - below.across_mm) / (LM_REAL(2) * step),
                    here.across_slope);
        ASSERT_NEAR(BOUND(1e-3, 3e-1), -turn / length, lm_flank_curvature(&flank, height));
      }
      ASSERT_NEAR(BOUND(1e-9, 1e-3), height,
                  lm_flank_at_radius(&flank, kind == 3 ? height : polar_of(&here)));
    }
    ASSERT_NEAR(0, flank.low_mm, lm_flank_at_radius(&flank, LM_REAL(1)));
    ASSERT_NEAR(0, flank.high_mm, lm_flank_at_radius(&flank, LM_REAL(90)));
  }
}

TEST(a_stated_tangent_is_the_flank_of_its_centres) {
  lm_flank centres;
  int i;
  start_arcs();
  shape_teeth();
  ACCEPTED(make_flank());
  centres = flank;
  drive.flank.delta_L_rad = centres.arc.inclination_rad;
  drive.flank.h_l = (centres.arc.upper_mm - centres.arc.lower_mm) / drive.teeth.module_mm;
  ACCEPTED(make_flank());
  for (i = 0; i <= 20; i++) {
    const lm_real height = height_of(&flank, i, 20);
    ASSERT_NEAR(BOUND(1e-12, 1e-5), lm_evaluate_flank(&centres, height).across_mm,
                lm_evaluate_flank(&flank, height).across_mm);
  }
}

TEST(relief_thins_the_tip_alone) {
  lm_flank plain;
  start_arcs();
  drive.flank.tip_relief_mm = LM_REAL(0.01);
  drive.flank.tip_relief_height = LM_REAL(0.4);
  shape_teeth();
  ACCEPTED(lm_make_flank(&drive, &geometry, 0, &plain, &fault));
  ACCEPTED(make_flank());
  ASSERT_NEAR(BOUND(1e-12, 1e-6),
              lm_evaluate_flank(&plain, plain.high_mm).across_mm - LM_REAL(0.01),
              lm_evaluate_flank(&flank, flank.high_mm).across_mm);
  ASSERT_NEAR(0, lm_evaluate_flank(&plain, plain.low_mm).across_mm,
              lm_evaluate_flank(&flank, flank.low_mm).across_mm);
}

TEST(an_involute_ends_at_its_base_circle) {
  start_arcs();
  drive.teeth.flexspline_flank = LM_FLANK_INVOLUTE;
  drive.teeth.pressure_angle_rad = LM_REAL(10) * DEGREE;
  drive.teeth.root_clearance = LM_REAL(0.3);
  shape_teeth();
  ACCEPTED(make_flank());
  ASSERT_NEAR(0, geometry.flexspline.base_mm, flank.low_mm);
  drive = reference_e();
  shape_teeth();
  ACCEPTED(make_flank());
  ASSERT_NEAR(0, geometry.flexspline_tip_mm, flank.low_mm);
  ASSERT_NEAR(0, geometry.flexspline_root_mm, flank.high_mm);
}

TEST(a_path_without_deviation_has_no_tangent) {
  start_s_teeth();
  shape_teeth();
  drive.flank.kappa = LM_REAL(LM_KAPPA_MOST);
  ACCEPTED(make_flank());
  TEST_ASSERT_TRUE(flank.s.straight_mm > 0);
  TEST_ASSERT_TRUE(flank.s.straight_mm < LM_REAL(0.02) * drive.teeth.module_mm);
}

TEST(kinds_fit_one_gear_or_both) {
  TEST_ASSERT_TRUE(lm_flank_fits(LM_FLANK_INVOLUTE, 0));
  TEST_ASSERT_TRUE(lm_flank_fits(LM_FLANK_INVOLUTE, 1));
  TEST_ASSERT_FALSE(lm_flank_fits(LM_FLANK_CONJUGATE, 0));
  TEST_ASSERT_TRUE(lm_flank_fits(LM_FLANK_CONJUGATE, 1));
  TEST_ASSERT_TRUE(lm_flank_fits(LM_FLANK_DOUBLE_ARC, 0));
  TEST_ASSERT_FALSE(lm_flank_fits(LM_FLANK_S_TOOTH, 1));
  TEST_ASSERT_TRUE(lm_flank_fits(LM_FLANK_POINTS, 1));
  TEST_ASSERT_FALSE(lm_flank_fits(9, 0));
}

/* --- refusals of flanks ----------------------------------------------------------------------- */

typedef struct refusal {
  size_t member; /* of lm_drive, lm_real */
  double value;
  double inclination_deg;
  const char *input;
} refusal;

#define MEMBER(path) offsetof(lm_drive, path)

static void refuse_each(void (*start)(void), const refusal list[], int count, lm_status status) {
  int i;
  for (i = 0; i < count; i++) {
    start();
    shape_teeth();
    *(lm_real *)((char *)&drive + list[i].member) = LM_REAL(list[i].value);
    drive.flank.delta_L_rad = LM_REAL(list[i].inclination_deg) * DEGREE;
    if (drive.flank.delta_L_rad > 0 && !(drive.flank.h_l > 0)) {
      drive.flank.h_l = LM_REAL(list[i].member == MEMBER(flank.h_l) ? list[i].value : 0.2);
    }
    REFUSED(status, list[i].input, lm_make_flank(&drive, &geometry, 1, &flank, fault_or_null));
    drive.flank.h_l = 0;
  }
}

TEST(arcs_that_make_no_flank_are_refused) {
  static const refusal contradictions[] = {
      {MEMBER(flank.rho_a), 1.7, 0, "flank.rho_a, flank.rho_f"},
      {MEMBER(flank.rho_a), 0.84, 15, "flank.rho_a, teeth.tooth_height"},
      {MEMBER(flank.X_a), 0.31, 55, "flank.rho_a, flank.X_a"},
      {MEMBER(flank.h_l), 1.2, 12, "flank.rho_f, flank.X_f"},
      {MEMBER(flank.rho_f), 0.3, 12, "flank.rho_f, teeth.root_clearance"},
      {MEMBER(flank.l_a), 1.4, 15, "flank.rho_a, flank.l_a"},
      {MEMBER(flank.l_a), -0.3, 15, "flank.rho_f, flank.l_f"},
  };
  static const refusal ranges[] = {
      {MEMBER(flank.rho_a), 0.1, 0, "flank.rho_a"},
      {MEMBER(flank.rho_f), 30, 0, "flank.rho_f"},
      {MEMBER(flank.h_l), 0.001, 12, "flank.h_l"},
  };
  refuse_each(start_arcs, contradictions, 7, LM_INCONSISTENT);
  refuse_each(start_arcs, ranges, 3, LM_OUT_OF_RANGE);
}

TEST(s_teeth_that_make_no_flank_are_refused) {
  static const refusal contradictions[] = {
      {MEMBER(flank.kappa), 0.7, 0, "flank.kappa, teeth.root_clearance"},
      {MEMBER(flank.X_M), -0.45, 0, "flank.kappa, teeth.tooth_height"},
      {MEMBER(flank.s_M), 2.4, 0, "flank.s_M, teeth.root_clearance"},
  };
  static const refusal ranges[] = {
      {MEMBER(flank.kappa), 0.4, 0, "flank.kappa"},
      {MEMBER(flank.s_M), 3, 0, "flank.s_M"},
  };
  static const refusal pointed = {MEMBER(flank.s_M), 0.5, 0, "flank.s_M, teeth.tooth_height"};
  refuse_each(start_s_teeth, contradictions, 3, LM_INCONSISTENT);
  refuse_each(start_low_s_teeth, &pointed, 1, LM_INCONSISTENT);
  refuse_each(start_s_teeth, ranges, 2, LM_OUT_OF_RANGE);
}

static void refuse_points(lm_status status, const char *input) {
  REFUSED(status, input, lm_make_flank(&drive, &geometry, 1, &flank, fault_or_null));
}

TEST(points_that_make_no_flank_are_refused) {
  start_points();
  drive.flank.points = 0;
  refuse_points(LM_NULL, "flank.points");
  start_points();
  points.count = 3;
  refuse_points(LM_OUT_OF_RANGE, "flank.points");
  points.count = LM_FLANK_POINTS_MAX + 1;
  refuse_points(LM_OUT_OF_RANGE, "flank.points");
  start_points();
  points.along_mm[9] = points.along_mm[8];
  refuse_points(LM_NOT_MONOTONE, "flank.points");
  start_points();
  points.count -= 9;
  refuse_points(LM_INCONSISTENT, "flank.points, teeth.tooth_height");
  start_points();
  points.along_mm[0] += 0.004;
  refuse_points(LM_INCONSISTENT, "flank.points, teeth.root_clearance");
  start_points();
  points.across_mm[points.count - 1] = -0.01;
  refuse_points(LM_INCONSISTENT, "flank.points, teeth.tooth_height");
  start_points();
  points.across_mm[0] = 0.9;
  refuse_points(LM_INCONSISTENT, "flank.points, teeth.root_clearance");
  start_arcs();
  drive.teeth.flexspline_flank = LM_FLANK_CONJUGATE;
  refuse_points(LM_INCONSISTENT, "teeth.flexspline_flank");
  REFUSED(LM_NULL, "drive, geometry, flank", lm_make_flank(0, &geometry, 1, &flank, fault_or_null));
  REFUSED(LM_NULL, "drive, geometry, flank", lm_make_flank(&drive, 0, 1, &flank, fault_or_null));
  REFUSED(LM_NULL, "drive, geometry, flank", lm_make_flank(&drive, &geometry, 1, 0, fault_or_null));
}

/* --- the generated flank ---------------------------------------------------------------------- */

/* Every contact that no other position of the tooth crosses lies on the table. */
static int touch_the_table(void) {
  lm_conjugate_contact contact[8];
  int touched = 0;
  int piece;
  int i;
  for (i = 0; i <= 40; i++) {
    int count = 0;
    int k;
    ACCEPTED(lm_find_conjugate_contacts(&flank, &geometry, &line, height_of(&flank, i, 40), contact,
                                        8, &count, &fault));
    for (k = 0; k < count; k++) {
      const lm_conjugate_contact *c = &contact[k];
      if (c->radius_mm > mesh.conjugate.low_mm && c->radius_mm < mesh.conjugate.land_mm &&
          fabs((double)c->beyond_mm) < BOUND(1e-9, 1e-5)) {
        ASSERT_NEAR(BOUND(1e-6, 2e-5) * (double)drive.teeth.module_mm / (double)c->radius_mm,
                    c->half_angle_rad,
                    lm_conjugate_half_angle(&mesh.conjugate, c->radius_mm, &out, &piece));
        touched++;
      }
    }
  }
  return touched;
}

static void make_all(void) {
  shape_teeth();
  ACCEPTED(lm_make_flank(&drive, &geometry, 0, &flank, &fault));
  ACCEPTED(lm_make_neutral_line(&drive.generator, LM_INTERNAL, geometry.neutral_mm,
                                drive.generator.deflection_mm, LM_NEUTRAL_LINE_NODES, &line,
                                &fault));
  make_mesh();
}

TEST(a_conjugate_flank_touches_in_its_zones) {
  static const lm_generator_type types[] = {LM_COSINE, LM_ELLIPSE, LM_DISCS, LM_ROLLERS};
  int k;
  for (k = 0; k < 4; k++) {
    start_arcs();
    drive.generator.type = types[k];
    drive.generator.contact_half_angle_rad = LM_REAL(k < 2 ? 0 : 25) * DEGREE;
    make_all();
    TEST_ASSERT_TRUE(touch_the_table() > 8);
    start_s_teeth();
    drive.generator.type = types[k];
    drive.generator.contact_half_angle_rad = LM_REAL(k < 2 ? 0 : 25) * DEGREE;
    make_all();
    TEST_ASSERT_TRUE(touch_the_table() > 8);
  }
}

/* Random arcs and S teeth: the flank is generated, and the tooth that generates it does not cross
 * it at its own nominal deflection. */
TEST(a_tooth_does_not_cross_the_flank_that_it_generates) {
  uint32_t seed = 5;
  int made = 0;
  int n;
  for (n = 0; n < 600; n++) {
    int i;
    if (n % 2 == 0) {
      start_arcs();
      drive.flank.rho_a = LM_REAL(draw(&seed, 0.9, 2));
      drive.flank.X_a = LM_REAL(draw(&seed, 0, 0.5));
      drive.flank.l_a = LM_REAL(sqrt((double)(drive.flank.rho_a * drive.flank.rho_a -
                                              drive.flank.X_a * drive.flank.X_a)) -
                                draw(&seed, 0.55, 0.72));
      drive.flank.rho_f = LM_REAL(draw(&seed, 1, 2));
      drive.flank.delta_L_rad = LM_REAL(draw(&seed, 8, 20)) * DEGREE;
      drive.flank.h_l = LM_REAL(draw(&seed, 0.05, 0.35));
    } else {
      start_s_teeth();
      drive.flank.kappa = LM_REAL(draw(&seed, 0.75, 0.995));
      drive.flank.X_M = LM_REAL(draw(&seed, -0.15, 0.1));
      drive.flank.s_M = LM_REAL(draw(&seed, 1.3, 1.6));
    }
    drive.generator.type = n % 3 == 0 ? LM_DISCS : LM_COSINE;
    drive.generator.contact_half_angle_rad = LM_REAL(n % 3 == 0 ? draw(&seed, 20, 40) : 0) * DEGREE;
    drive.generator.deflection_mm = LM_REAL(draw(&seed, 0.85, 1.15)) * drive.teeth.module_mm;
    drive.planar_only = 1;
    if (lm_make_mesh(&drive, LM_REAL(1), LM_NEUTRAL_LINE_NODES, &mesh, &fault) != LM_OK) {
      continue;
    }
    made++;
    for (i = 0; i < 60; i += 5) {
      const lm_clearance tooth = lm_tooth_clearance(&mesh, LM_REAL(i) * DEGREE);
      TEST_ASSERT_TRUE((double)tooth.forward.gap_rad > -BOUND(2e-3, 5e-2) * (double)ARCMIN);
      TEST_ASSERT_TRUE((double)tooth.backward.gap_rad > -BOUND(2e-3, 5e-2) * (double)ARCMIN);
    }
  }
  TEST_ASSERT_TRUE(made > 300);
}

/* With a ring wave generator: at every angle, and a bound of the clearance is below it. */
TEST(a_space_of_a_ring_touches_the_tooth_that_it_leaves) {
  int touching = 0;
  int bounds = 0;
  int i;
  start_arcs();
  drive.teeth.deformation = LM_EXTERNAL;
  drive.teeth.rigid_teeth = 98;
  drive.teeth.tooth_height = LM_REAL(1.4);
  drive.teeth.engagement_depth = LM_REAL(0.9);
  drive.generator.type = LM_RING;
  drive.generator.contact_half_angle_rad = LM_REAL(30) * DEGREE;
  drive.planar_only = 1;
  make_mesh();
  for (i = -60; i <= 120; i++) {
    const lm_real angle = LM_REAL(i) * DEGREE / LM_REAL(2);
    const lm_clearance tooth = lm_tooth_clearance(&mesh, angle);
    const lm_clearance near = lm_clearance_within(&mesh, angle, 2 * ARCMIN);
    TEST_ASSERT_TRUE((double)tooth.forward.gap_rad > -BOUND(2e-3, 5e-2) * (double)ARCMIN);
    touching += (double)tooth.forward.gap_rad < BOUND(2e-3, 5e-2) * (double)ARCMIN;
    if (near.forward.is_bound) {
      TEST_ASSERT_TRUE(near.forward.gap_rad > 2 * ARCMIN);
      TEST_ASSERT_TRUE(near.forward.gap_rad <= tooth.forward.gap_rad);
      bounds++;
    } else {
      ASSERT_NEAR(0, tooth.forward.gap_rad, near.forward.gap_rad);
    }
  }
  TEST_ASSERT_GREATER_THAN_INT(0, touching);
  TEST_ASSERT_GREATER_THAN_INT(20, bounds);
}

TEST(shift_and_backlash_displace_the_flank) {
  lm_conjugate plain;
  lm_conjugate moved;
  int piece;
  int i;
  start_arcs();
  make_all();
  ACCEPTED(lm_make_conjugate(&flank, &geometry, &line, 0, 0, &plain, &fault));
  ACCEPTED(lm_make_conjugate(&flank, &geometry, &line, 0, LM_REAL(0.003), &moved, &fault));
  for (i = 1; i < 20; i++) {
    const lm_real radius = plain.low_mm + (plain.land_mm - plain.low_mm) * LM_REAL(i) / LM_REAL(20);
    const lm_involute_point at = lm_evaluate_conjugate(&moved, radius);
    ASSERT_NEAR(BOUND(1e-8, 1e-5),
                lm_conjugate_half_angle(&plain, radius, &out, &piece) + LM_REAL(0.003) / radius,
                at.half_angle_rad);
    ASSERT_NEAR(BOUND(1e-12, 1e-6), atan((double)at.tangent), at.pressure_angle_rad);
  }
  /* The land is radial. */
  (void)lm_conjugate_half_angle(&moved, moved.top_mm, &out, &piece);
  ASSERT_NEAR(0, 0, out);
  TEST_ASSERT_EQUAL_INT(LM_CONJUGATE_ON_LAND, piece);
  /* A shift moves the flank radially; the width of the space remains. */
  geometry.rigid_tip_mm += LM_REAL(0.1);
  ACCEPTED(lm_make_conjugate(&flank, &geometry, &line, LM_REAL(0.1), 0, &moved, &fault));
  ASSERT_NEAR(BOUND(1e-9, 1e-4), plain.top_mm + LM_REAL(0.1), moved.top_mm);
  for (i = 1; i < 20; i++) {
    const lm_real radius = plain.low_mm + (plain.land_mm - plain.low_mm) * LM_REAL(i) / LM_REAL(20);
    lm_real tangent;
    const lm_real half = lm_conjugate_half_angle(&plain, radius, &out, &piece);
    const lm_real at = lm_conjugate_half_angle(&moved, radius + LM_REAL(0.1), &tangent, &piece);
    ASSERT_NEAR(BOUND(1e-8, 1e-5), half * radius, at * (radius + LM_REAL(0.1)));
    /* the angle of the flank against its own radius, plus the turn of the radius */
    ASSERT_NEAR(BOUND(1e-6, 1e-4), out - half, tangent - at);
  }
}

TEST(tips_that_do_not_reach_are_refused) {
  lm_conjugate made;
  lm_conjugate_contact contact[2];
  int count;
  start_arcs();
  make_all();
  REFUSED(LM_INCONSISTENT, "teeth.engagement_depth",
          lm_make_conjugate(&flank, &geometry, &line, LM_REAL(-1), 0, &made, fault_or_null));
  REFUSED(LM_NULL, "flank, geometry, line, conjugate",
          lm_make_conjugate(0, &geometry, &line, 0, 0, &made, fault_or_null));
  REFUSED(LM_NULL, "flank, geometry, line, conjugate",
          lm_make_conjugate(&flank, 0, &line, 0, 0, &made, fault_or_null));
  REFUSED(LM_NULL, "flank, geometry, line, conjugate",
          lm_make_conjugate(&flank, &geometry, 0, 0, 0, &made, fault_or_null));
  REFUSED(LM_NULL, "flank, geometry, line, conjugate",
          lm_make_conjugate(&flank, &geometry, &line, 0, 0, 0, fault_or_null));
  OUTSIDE("parameter_mm", lm_find_conjugate_contacts(&flank, &geometry, &line, LM_REAL(1), contact,
                                                     2, &count, fault_or_null));
#define CONTACTS_NULL(f, g, l, c, n)                         \
  REFUSED(LM_NULL, "flank, geometry, line, contacts, count", \
          lm_find_conjugate_contacts(f, g, l, flank.low_mm, c, 2, n, fault_or_null))
  CONTACTS_NULL(0, &geometry, &line, contact, &count);
  CONTACTS_NULL(&flank, 0, &line, contact, &count);
  CONTACTS_NULL(&flank, &geometry, 0, contact, &count);
  CONTACTS_NULL(&flank, &geometry, &line, 0, &count);
  CONTACTS_NULL(&flank, &geometry, &line, contact, 0);
}

/* Polar radius of the tip's corner of a tooth at an angle; side: 1 forward, -1 backward. */
static lm_real tip_radius(lm_real angle_rad, lm_real side) {
  const lm_placement place = lm_place_tooth(&mesh.line, angle_rad);
  const lm_real x = side * mesh.high.across_mm;
  const lm_real along = place.radius_mm + mesh.high.along_mm * place.tilt_cos - x * place.tilt_sin;
  const lm_real across = mesh.high.along_mm * place.tilt_sin + x * place.tilt_cos;
  return LM_REAL(sqrt((double)(along * along + across * across)));
}

static double gap_of(lm_real angle_rad, lm_real side) {
  const lm_clearance at = lm_tooth_clearance(&mesh, angle_rad);
  return (double)(side > 0 ? at.forward.gap_rad : at.backward.gap_rad);
}

/* Largest change of the gap between angles at which the tip reaches past the end of the generated
 * flank by less than the distance of the samples from it; 0 if the tip does not reach the end. */
static double largest_jump(lm_real side) {
  const double step = BOUND(5e-8, 5e-5);
  lm_real inside = LM_REAL(0);
  lm_real outside = LM_REAL(0.5);
  double jump = 0;
  int i;
  if (tip_radius(inside, side) < mesh.conjugate.land_mm) {
    return 0;
  }
  for (i = 0; i < 60; i++) {
    const lm_real middle = (inside + outside) / LM_REAL(2);
    if (tip_radius(middle, side) > mesh.conjugate.land_mm) {
      inside = middle;
    } else {
      outside = middle;
    }
  }
  for (i = 0; i < 40; i++) {
    const double before = gap_of(inside - LM_REAL(step * i), side);
    jump = fmax(jump, fabs(gap_of(inside - LM_REAL(step * (i + 1)), side) - before));
  }
  return jump;
}

/* Towards the open end of a cup the tip reaches past the end of the flank that its own motion in
 * the middle of the face generates. */
TEST(a_tip_at_the_end_of_the_flank_has_the_clearance_of_its_neighbours) {
  int reaches = 0;
  int k;
  for (k = 1; k <= 10; k++) {
    start_s_teeth();
    drive.flank.kappa = LM_REAL(0.96);
    drive.flank.X_M = LM_REAL(0.126);
    drive.flank.s_M = LM_REAL(1.41);
    drive.teeth.engagement_depth = LM_REAL(0.7);
    drive.generator.deflection_mm = LM_REAL(0.436);
    drive.flank.backlash_mm = LM_REAL(0.0135);
    TEST_ASSERT_EQUAL(LM_OK, lm_make_mesh(&drive, LM_REAL(1) + LM_REAL(0.01) * LM_REAL(k),
                                          LM_NEUTRAL_LINE_NODES, &mesh, &fault));
    reaches += tip_radius(LM_REAL(0), LM_REAL(1)) > mesh.conjugate.land_mm;
    ASSERT_NEAR(BOUND(1e-8, 1e-5), 0, largest_jump(LM_REAL(1)));
    ASSERT_NEAR(BOUND(1e-8, 1e-5), 0, largest_jump(LM_REAL(-1)));
  }
  TEST_ASSERT_TRUE(reaches > 5);
}

/* Lower bounds where a pair is further off than the limit, exact gaps elsewhere; number of
 * bounds. */
static int compare_near(const lm_gap *near, const lm_gap *exact, lm_real smallest) {
  const lm_real beyond = LM_REAL(1.5) * ARCMIN;
  if (near->is_bound) {
    TEST_ASSERT_TRUE(near->gap_rad <= exact->gap_rad);
    TEST_ASSERT_TRUE(near->gap_rad > smallest + beyond);
    return 1;
  }
  TEST_ASSERT_TRUE(near->gap_rad == exact->gap_rad);
  TEST_ASSERT_TRUE(near->radius_mm == exact->radius_mm);
  TEST_ASSERT_TRUE(near->flank_angle_rad == exact->flank_angle_rad);
  return 0;
}

static int count_bounds(lm_real phase_pitches) {
  static lm_clearance exact[LM_LOBE_TEETH_MAX];
  static lm_clearance near[LM_LOBE_TEETH_MAX];
  const lm_real phase = phase_pitches * LM_REAL(2) * LM_PI / LM_REAL(100);
  lm_real forward = LM_REAL(INFINITY);
  lm_real backward = LM_REAL(INFINITY);
  lm_least_gaps least = lm_no_gaps();
  int bounds = 0;
  int count;
  int i;
  make_mesh();
  ACCEPTED(lm_lobe_clearances(&mesh, phase, exact, LM_LOBE_TEETH_MAX, &count, &fault));
  ACCEPTED(lm_near_clearances(&mesh, phase, LM_REAL(1.5) * ARCMIN, &least, near, LM_LOBE_TEETH_MAX,
                              &count, &fault));
  for (i = 0; i < count; i++) {
    forward = exact[i].forward.gap_rad < forward ? exact[i].forward.gap_rad : forward;
    backward = exact[i].backward.gap_rad < backward ? exact[i].backward.gap_rad : backward;
  }
  TEST_ASSERT_TRUE(least.forward_rad == forward && least.backward_rad == backward);
  for (i = 0; i < count; i++) {
    const lm_clearance within =
        lm_clearance_within(&mesh, exact[i].angle_rad, forward + LM_REAL(1.5) * ARCMIN);
    bounds += compare_near(&near[i].forward, &exact[i].forward, forward);
    bounds += compare_near(&near[i].backward, &exact[i].backward, backward);
    (void)compare_near(&within.forward, &exact[i].forward, forward);
  }
  return bounds;
}

TEST(far_pairs_have_lower_bounds) {
  int k;
  for (k = 0; k < 6; k++) {
    const lm_real phase = LM_REAL(k) / LM_REAL(6);
    start_arcs();
    drive.flank.rho_a -= LM_REAL(0.02) * LM_REAL(k);
    TEST_ASSERT_TRUE(count_bounds(phase) > 3);
    start_s_teeth();
    TEST_ASSERT_TRUE(count_bounds(phase) > 3);
  }
  drive = reference_a();
  TEST_ASSERT_EQUAL(0, count_bounds(LM_REAL(0)));
}

/* The flank of the rigid gear, of either kind. */
TEST(the_rigid_flank_is_the_one_of_its_kind) {
  lm_involute_point found;
  lm_involute_point expected;
  start_arcs();
  make_mesh();
  found = lm_rigid_flank_at(&mesh, mesh.polar_low_mm + LM_REAL(0.1));
  expected = lm_evaluate_conjugate(&mesh.conjugate, mesh.polar_low_mm + LM_REAL(0.1));
  TEST_ASSERT_TRUE(found.half_angle_rad == expected.half_angle_rad &&
                   found.tangent == expected.tangent);
  drive = reference_a();
  make_mesh();
  found = lm_rigid_flank_at(&mesh, mesh.polar_low_mm + LM_REAL(0.1));
  expected = lm_evaluate_involute(&mesh.geometry.rigid, mesh.polar_low_mm + LM_REAL(0.1));
  TEST_ASSERT_TRUE(found.half_angle_rad == expected.half_angle_rad &&
                   found.tangent == expected.tangent);
}

/* --- a circular spline of points -------------------------------------------------------------- */

/* Points of the generated space from below its tip to its land. */
static void take_space(void) {
  int i;
  points.count = LM_FLANK_POINTS_MAX;
  for (i = 0; i < points.count; i++) {
    const lm_real from = mesh.conjugate.low_mm - LM_REAL(0.02);
    const lm_real radius =
        from + (mesh.conjugate.land_mm - from) * LM_REAL(i) / LM_REAL(points.count - 1);
    const lm_involute_point at = lm_evaluate_conjugate(&mesh.conjugate, radius);
    const double half = (double)at.half_angle_rad;
    const double turned = half + (double)at.pressure_angle_rad * -1.0;
    points.across_mm[i] = (double)radius * sin(half);
    points.along_mm[i] = (double)radius * cos(half);
    points.slope[i] = tan(turned);
  }
}

TEST(points_of_a_space_have_its_clearances) {
  lm_mesh stated;
  int i;
  start_arcs();
  make_all();
  take_space();
  drive.teeth.rigid_flank = LM_FLANK_POINTS;
  drive.flank.rigid_points = &points;
  ACCEPTED(lm_make_mesh(&drive, LM_REAL(1), LM_NEUTRAL_LINE_NODES, &stated, &fault));
  for (i = 0; i < 45; i++) {
    const lm_real angle = LM_REAL(i) * DEGREE;
    const lm_gap made = lm_tooth_clearance(&mesh, angle).forward;
    const lm_gap found = lm_tooth_clearance(&stated, angle).forward;
    TEST_ASSERT_EQUAL(isfinite(made.gap_rad) != 0, isfinite(found.gap_rad) != 0);
    if (isfinite(made.gap_rad)) {
      ASSERT_NEAR(BOUND(2e-3, 2e-2) * (double)ARCMIN, made.gap_rad, found.gap_rad);
    }
  }
}

static void refuse_space(lm_status status, const char *input) {
  lm_conjugate made;
  REFUSED(status, input, lm_tabulate_rigid_points(&points, &geometry, 0, 0, &made, fault_or_null));
}

/* The least angle between the points of an arc's flank and an involute space. */
TEST(an_arc_in_an_involute_space_has_the_clearance_of_its_points) {
  int i;
  start_arcs();
  drive.teeth.rigid_flank = LM_FLANK_INVOLUTE;
  make_mesh();
  for (i = 2; i < 30; i += 3) {
    const lm_real angle = LM_REAL(i) * DEGREE;
    const lm_placement place = lm_place_tooth(&mesh.line, angle);
    const double lead = (double)(place.lead_rad + angle * mesh.geometry.lead_per_angle);
    double least = HUGE_VAL;
    int k;
    for (k = 0; k <= 4000; k++) {
      const lm_flank_foot foot = lm_evaluate_flank(&mesh.flank, height_of(&mesh.flank, k, 4000));
      const double along = (double)(place.radius_mm + foot.along_mm * place.tilt_cos -
                                    foot.across_mm * place.tilt_sin);
      const double across =
          (double)(foot.along_mm * place.tilt_sin + foot.across_mm * place.tilt_cos);
      const lm_real radius = LM_REAL(hypot(along, across));
      if (radius >= mesh.polar_low_mm) {
        const double half = (double)lm_rigid_flank_at(&mesh, radius).half_angle_rad;
        least = fmin(least, half - atan2(across, along) - lead);
      }
    }
    ASSERT_NEAR(BOUND(5e-3, 5e-2) * (double)ARCMIN, least,
                lm_tooth_clearance(&mesh, angle).forward.gap_rad);
  }
}

TEST(all_sections_have_the_flank_of_the_middle) {
  static lm_mesh face[3];
  start_arcs();
  drive.flexspline.length_mm = LM_REAL(50);
  drive.teeth.face_width_mm = LM_REAL(10);
  ACCEPTED(lm_make_face(&drive, 3, LM_NEUTRAL_LINE_NODES, face, &fault));
  TEST_ASSERT_TRUE(face[0].line.deflection_mm < face[2].line.deflection_mm);
  ASSERT_NEAR(0, face[1].conjugate.half_angle_rad[9], face[0].conjugate.half_angle_rad[9]);
  ASSERT_NEAR(0, face[1].conjugate.half_angle_rad[9], face[2].conjugate.half_angle_rad[9]);
  REFUSED(LM_NULL, "drive", lm_make_face(0, 3, LM_NEUTRAL_LINE_NODES, face, fault_or_null));
  REFUSED(LM_NULL, "meshes", lm_make_face(&drive, 3, LM_NEUTRAL_LINE_NODES, 0, fault_or_null));
}

TEST(spaces_that_make_no_mesh_are_refused) {
  lm_conjugate made;
  int i;
  start_arcs();
  make_all();
  REFUSED(LM_NULL, "flank.rigid_points",
          lm_tabulate_rigid_points(0, &geometry, 0, 0, &made, fault_or_null));
  REFUSED(LM_NULL, "geometry, conjugate",
          lm_tabulate_rigid_points(&points, 0, 0, 0, &made, fault_or_null));
  REFUSED(LM_NULL, "geometry, conjugate",
          lm_tabulate_rigid_points(&points, &geometry, 0, 0, 0, fault_or_null));
  take_space();
  points.count = 3;
  refuse_space(LM_OUT_OF_RANGE, "flank.rigid_points");
  take_space();
  points.along_mm[9] = points.along_mm[8];
  refuse_space(LM_NOT_MONOTONE, "flank.rigid_points");
  take_space();
  points.count = 90;
  refuse_space(LM_INCONSISTENT, "flank.rigid_points, teeth.engagement_depth");
  take_space();
  for (i = 0; i < points.count; i++) {
    points.along_mm[i] += 0.03;
  }
  refuse_space(LM_INCONSISTENT, "flank.rigid_points, teeth.engagement_depth");
  take_space();
  points.across_mm[9] = 0.9;
  refuse_space(LM_INCONSISTENT, "flank.rigid_points");
  take_space();
  points.across_mm[9] = -0.1;
  refuse_space(LM_INCONSISTENT, "flank.rigid_points");
}
