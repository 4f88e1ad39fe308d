#include "lostmotion/checks.h"

#include "reference_drives.h"
#include "test.h"

static lm_mesh meshes[LM_SECTIONS_MAX];
static lm_check checks[LM_CHECK_COUNT];
static lm_load load; /* none: its checks are those of test_load_capacity.c */
static lm_smallest_gap smallest;
static lm_fault fault;

static void prepare(const lm_drive *drive, int sections) {
  int i;
  for (i = 0; i < sections; i++) {
    TEST_ASSERT_EQUAL(LM_OK, lm_make_mesh(drive, lm_section_factor(drive, i, sections),
                                          LM_NEUTRAL_LINE_NODES, &meshes[i], &fault));
  }
}

static void run(const lm_drive *drive, int sections) {
  prepare(drive, sections);
  TEST_ASSERT_EQUAL(LM_OK, lm_find_smallest_gap(meshes, sections, 8, &smallest, &fault));
  TEST_ASSERT_EQUAL(LM_OK,
                    lm_check_design(drive, meshes, sections, &smallest, &load, checks, &fault));
}

/* check_values.md, reference drive A: r_l1 = 25.5370 for z = 200, x = 3, m = 0.25. */
TEST(rack_form_radius_of_the_reference) {
  const lm_drive a = reference_a();
  ASSERT_NEAR(5e-5, 25.5370, lm_rack_form_radius(&a.teeth, 200, a.teeth.flexspline_shift));
}

/* Radii of check_values.md, reference drive A: r_a1 25.85, r_a2 25.7875, r_f1 25.4125, w0 0.2375,
 * |w(90 deg)| 1.04376. */
TEST(radial_margins_of_the_reference) {
  const lm_drive a = completed(reference_a());
  run(&a, 1);
  ASSERT_NEAR(1e-4, 25.7875 - 0.2375, checks[LM_CHECK_FORM_RADIUS].value);
  ASSERT_NEAR(1e-4, 25.5370, checks[LM_CHECK_FORM_RADIUS].limit);
  ASSERT_NEAR(1e-5, 25.7875 - 0.2375 - 25.4125, checks[LM_CHECK_FLEXSPLINE_ROOT].value);
  ASSERT_NEAR(1e-5, 0.15 * 0.25, checks[LM_CHECK_FLEXSPLINE_ROOT].limit);
  ASSERT_NEAR(1e-5, 0.2 * 0.25, checks[LM_CHECK_RIGID_ROOT].value);
  ASSERT_NEAR(1e-5, 25.7875 - 25.85 + 0.2375 * 1.04376, checks[LM_CHECK_DISENGAGEMENT].value);
  ASSERT_NEAR(1e-5, 25.7875 - 25.85, checks[LM_CHECK_FREE_ASSEMBLY].value);
  TEST_ASSERT_TRUE(checks[LM_CHECK_FREE_ASSEMBLY].margin < 0);
}

/* The tip of a rack-cut tooth: 2 r (pi/2z + 2 x tan a / z + inv a - inv acos(r_b / r)), and of an
 * internal tooth the pitch minus the space, computed in double here. */
TEST(tip_thickness_of_both_gears) {
  const lm_drive a = completed(reference_a());
  const double alpha = 20.0 * 3.14159265358979323846 / 180.0;
  const double inv = tan(alpha) - alpha;
  const double at1 = acos(25.0 * cos(alpha) / 25.85);
  const double at2 = acos(25.25 * cos(alpha) / 25.7875);
  const double pi = 3.14159265358979323846;
  const double half1 = pi / 400 + 6.0 * tan(alpha) / 200 + inv - (tan(at1) - at1);
  const double half2 = pi / 404 + 2 * 2.957 * tan(alpha) / 202 + inv - (tan(at2) - at2);
  run(&a, 1);
  ASSERT_NEAR(BOUND(1e-12, 2e-5), 2 * 25.85 * half1, checks[LM_CHECK_FLEXSPLINE_TIP].value);
  ASSERT_NEAR(BOUND(1e-12, 2e-5), 2 * 25.7875 * (pi / 202 - half2),
              checks[LM_CHECK_RIGID_TIP].value);
  ASSERT_NEAR(1e-6, 0.25 * 0.25, checks[LM_CHECK_RIGID_TIP].limit);
}

/* tau = 30 MPa at 40 N m with a wall of 0.35 (check_values.md, limits of a design, r_m 24.7 there;
 * at r_m 25.1125 by the same formula 28.8). sigma of two discs by the formula with |k|max = 3.165
 * at 90 deg. */
TEST(stresses_of_the_reference) {
  lm_drive a = reference_a();
  double sigma;
  double tension;
  double amplitude;
  double bending;
  double shear;
  a.flexspline.wall_thickness_mm = LM_REAL(0.35);
  a = completed(a);
  run(&a, 1);
  ASSERT_NEAR(0.05, 40e3 / (2 * 3.14159265 * 25.1125 * 25.1125 * 0.35),
              checks[LM_CHECK_TORSION_STRESS].value);
  sigma = 1.45 * 2.1e5 / 0.91 * 0.6 * 0.2375 / (2 * 25.1125 * 25.1125);
  ASSERT_NEAR(0.02, sigma * 3.165, checks[LM_CHECK_BENDING_STRESS].value);
  /* Safety, from the same figures: curvature runs from 2.447 to -3.165, rim tension N = 11.2 E I w0
   * / r_m^3 on b s. */
  tension = 11.2 * 2.1e5 * 0.36 / 12 * 0.2375 / (25.1125 * 25.1125 * 25.1125);
  amplitude = sigma * (2.447 + 3.165) / 2;
  bending = 450 / (1.9 * amplitude + 0.1 * (sigma * 3.165 - amplitude + tension));
  shear = 250 / (1.6 * (double)checks[LM_CHECK_TORSION_STRESS].value / 2);
  ASSERT_NEAR(2e-3, bending * shear / sqrt(bending * bending + shear * shear),
              checks[LM_CHECK_SAFETY].value);
  TEST_ASSERT_TRUE(checks[LM_CHECK_SAFETY].margin > 0);
}

/* The scan finds the same as a scan fifty times finer. */
TEST(smallest_gap_is_the_smallest_over_all_angles_and_phases) {
  const lm_generator_type types[] = {LM_COSINE, LM_DISCS, LM_ROLLERS, LM_ELLIPSE};
  int t;
  for (t = 0; t < 4; t++) {
    lm_drive a = reference_a();
    lm_real least = LM_REAL(1);
    int i;
    a.generator.type = types[t];
    a = completed(a);
    prepare(&a, 1);
    TEST_ASSERT_EQUAL(LM_OK, lm_find_smallest_gap(meshes, 1, 8, &smallest, &fault));
    for (i = -45000; i <= 45000; i += 2) {
      const lm_clearance c = lm_tooth_clearance(&meshes[0], LM_REAL(i) * DEGREE / LM_REAL(500));
      least = c.forward.gap_rad < least ? c.forward.gap_rad : least;
      least = c.backward.gap_rad < least ? c.backward.gap_rad : least;
    }
    ASSERT_NEAR(BOUND(2e-5, 1e-3) * (double)ARCMIN, least, smallest.gap_rad);
    TEST_ASSERT_TRUE(smallest.angle_rad > LM_REAL(-0.01) && smallest.angle_rad < HALF_PI);
    ASSERT_NEAR(BOUND(1e-12, 1e-6), smallest.gap_rad,
                smallest.forward
                    ? lm_tooth_clearance(&meshes[0], smallest.angle_rad).forward.gap_rad
                    : lm_tooth_clearance(&meshes[0], smallest.angle_rad).backward.gap_rad);
  }
}

/* The clearances of a sweep give the same as the scan, in every section. */
TEST(smallest_gap_from_a_sweep) {
  static lm_clearance swept[3][LM_SWEEP_COUNT(202, 8)];
  const lm_clearance *const table[] = {swept[0], swept[1], swept[2]};
  lm_drive drives[2];
  lm_smallest_gap scanned;
  int count = 0;
  int d;
  drives[0] = completed(reference_a());
  drives[1] = completed(reference_e());
  for (d = 0; d < 2; d++) {
    int i;
    prepare(&drives[d], 3);
    for (i = 0; i < 3; i++) {
      TEST_ASSERT_EQUAL(LM_OK, lm_sweep_clearances(&meshes[i], 8, swept[i], LM_SWEEP_COUNT(202, 8),
                                                   &count, &fault));
    }
    TEST_ASSERT_EQUAL(LM_OK, lm_find_smallest_gap(meshes, 3, 8, &scanned, &fault));
    TEST_ASSERT_EQUAL(LM_OK, lm_refine_smallest_gap(meshes, 3, table, count, 8, &smallest, &fault));
    ASSERT_NEAR(BOUND(1e-12, 1e-7), scanned.gap_rad, smallest.gap_rad);
    TEST_ASSERT_EQUAL(scanned.section, smallest.section);
    TEST_ASSERT_EQUAL(scanned.forward, smallest.forward);
  }
  meshes[0].polar_high_mm = LM_REAL(1);
  TEST_ASSERT_EQUAL(
      LM_OK, lm_sweep_clearances(&meshes[0], 8, swept[0], LM_SWEEP_COUNT(202, 8), &count, &fault));
  TEST_ASSERT_EQUAL(LM_NO_CONTACT,
                    lm_refine_smallest_gap(meshes, 1, table, count, 8, &smallest, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_refine_smallest_gap(0, 1, table, count, 8, &smallest, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_refine_smallest_gap(meshes, 1, 0, count, 8, &smallest, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_refine_smallest_gap(meshes, 1, table, count, 8, 0, &fault));
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE,
                    lm_refine_smallest_gap(meshes, 0, table, count, 8, &smallest, &fault));
  TEST_ASSERT_EQUAL_STRING("sections", fault.input);
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE,
                    lm_refine_smallest_gap(meshes, 1, table, count, 0, &smallest, &fault));
  TEST_ASSERT_EQUAL_STRING("phases", fault.input);
}

/* A shallow mesh of an elliptical cam that is nearest on the backward flank beyond the axis. */
TEST(smallest_gap_may_lie_on_the_backward_flank) {
  lm_drive a = reference_a();
  lm_real least = LM_REAL(1);
  int i;
  a.ratio = LM_REAL(97);
  a.teeth.module_mm = LM_REAL(0.5);
  a.teeth.flexspline_teeth = 194;
  a.teeth.rigid_teeth = 196;
  a.teeth.pressure_angle_rad = LM_REAL(17.5) * DEGREE;
  a.teeth.flexspline_shift = LM_REAL(1.0766);
  a.teeth.rigid_shift = LM_REAL(1.3530);
  a.teeth.tooth_height = LM_REAL(1.6198);
  a.teeth.engagement_depth = LM_REAL(0.8124);
  a.generator.type = LM_ELLIPSE;
  a.generator.deflection_mm = LM_REAL(0.56757);
  a.flexspline.rim_thickness_mm = LM_REAL(1.677);
  a = completed(a);
  prepare(&a, 1);
  TEST_ASSERT_EQUAL(LM_OK, lm_find_smallest_gap(meshes, 1, 8, &smallest, &fault));
  TEST_ASSERT_EQUAL(0, smallest.forward);
  for (i = 0; i <= 9000; i++) {
    const lm_clearance c = lm_tooth_clearance(&meshes[0], LM_REAL(i) * DEGREE / LM_REAL(100));
    least = c.forward.gap_rad < least ? c.forward.gap_rad : least;
    least = c.backward.gap_rad < least ? c.backward.gap_rad : least;
  }
  ASSERT_NEAR(BOUND(2e-5, 1e-3) * (double)ARCMIN, least, smallest.gap_rad);
}

/* check_values.md, axial sections: the open end, where the wave is higher by 11 %, collides by 1.33
 * arcmin near the axis, the inner end by 1.04 near 53 deg. */
TEST(ends_of_a_short_cup_collide) {
  lm_drive a = reference_a();
  a.flexspline.length_mm = LM_REAL(10 / 0.22);
  prepare(&a, 3);
  TEST_ASSERT_EQUAL(LM_OK, lm_find_smallest_gap(meshes, 3, 8, &smallest, &fault));
  TEST_ASSERT_EQUAL(2, smallest.section);
  ASSERT_NEAR(0.01, -1.33, in_arcmin(smallest.gap_rad));
  TEST_ASSERT_TRUE(smallest.angle_rad < LM_REAL(4) * DEGREE);
  TEST_ASSERT_EQUAL(LM_OK, lm_find_smallest_gap(meshes, 1, 64, &smallest, &fault));
  ASSERT_NEAR(0.06, -1.04, in_arcmin(smallest.gap_rad));
  ASSERT_NEAR(1.0, 53, smallest.angle_rad / DEGREE);
}

/* The widest section sets every margin of a spatial drive. */
TEST(spatial_margins_are_the_narrowest) {
  const lm_drive a = completed(reference_a());
  lm_check planar[LM_CHECK_COUNT];
  int i;
  run(&a, 1);
  memcpy(planar, checks, sizeof planar);
  run(&a, 5);
  for (i = 0; i < LM_CHECK_COUNT; i++) {
    TEST_ASSERT_TRUE(checks[i].margin <= planar[i].margin);
  }
  TEST_ASSERT_TRUE(checks[LM_CHECK_FORM_RADIUS].margin < planar[LM_CHECK_FORM_RADIUS].margin);
  TEST_ASSERT_TRUE(checks[LM_CHECK_DISENGAGEMENT].margin < planar[LM_CHECK_DISENGAGEMENT].margin);
}

/* check_values.md, reference drive E: r_ar = r_fr + h m, r_af = r_ar + w0 - h_d m, r_ff = r_ar + w0
 * + 0.2 m.
 */
TEST(external_margins) {
  const lm_drive e = completed(reference_e());
  const double root = 0.25 * (100 + 3.05 - 1 - 0.35);
  const double tip = root + 1.75 * 0.25;
  const double tip_f = tip + 0.2375 - 1.2 * 0.25;
  run(&e, 1);
  ASSERT_NEAR(1e-4, tip_f - 0.2375, checks[LM_CHECK_FORM_RADIUS].value);
  ASSERT_NEAR(1e-5, 0.2 * 0.25, checks[LM_CHECK_FLEXSPLINE_ROOT].value);
  ASSERT_NEAR(2e-5, tip_f - 0.2375 - root, checks[LM_CHECK_RIGID_ROOT].value);
  ASSERT_NEAR(2e-5, tip_f + 0.2375 * 1.04376 - tip, checks[LM_CHECK_DISENGAGEMENT].value);
  ASSERT_NEAR(2e-5, tip_f - tip, checks[LM_CHECK_FREE_ASSEMBLY].value);
  TEST_ASSERT_TRUE(checks[LM_CHECK_FLEXSPLINE_TIP].value > 0);
  TEST_ASSERT_TRUE(checks[LM_CHECK_RIGID_TIP].margin > 0);
  ASSERT_NEAR(0.01, 0.09, in_arcmin(smallest.gap_rad)); /* table of E: 0.090 at 0 deg */
}

/* A short cup opens by 26 % at its edge, 0.062 mm; the root that no rack cuts is deeper by that, so
 * that 0.2 modules stay. */
TEST(the_free_root_is_as_deep_as_the_widest_section_needs) {
  lm_drive drives[2];
  int i;
  drives[0] = reference_a();
  drives[1] = reference_e();
  for (i = 0; i < 2; i++) {
    lm_drive *d = &drives[i];
    d->axial_sections = 3;
    d->flexspline.length_mm = LM_REAL(0.5 / 0.26) * d->teeth.face_width_mm;
    *d = completed(*d);
    prepare(d, 3);
    TEST_ASSERT_EQUAL(LM_OK, lm_find_smallest_gap(meshes, 3, 8, &smallest, &fault));
    TEST_ASSERT_EQUAL(LM_OK, lm_check_design(d, meshes, 3, &smallest, &load, checks, &fault));
    ASSERT_NEAR(1e-5, 0.2 * 0.25,
                checks[i == 0 ? LM_CHECK_RIGID_ROOT : LM_CHECK_FLEXSPLINE_ROOT].value);
  }
}

/* At the end of the overlap tip meets tip: the gap is finite there, and infinite just beyond. */
TEST(the_end_of_the_overlap_is_found) {
  lm_drive drives[2];
  int i;
  int forward;
  drives[0] = reference_a();
  drives[1] = reference_e();
  for (i = 0; i < 2; i++) {
    const lm_drive d = completed(drives[i]);
    prepare(&d, 1);
    for (forward = 0; forward < 2; forward++) {
      const lm_real step = LM_REAL(1e-3);
      lm_real angle = LM_REAL(0);
      lm_clearance_end end;
      lm_clearance at = lm_tooth_clearance(&meshes[0], angle);
      while (isfinite(forward ? at.forward.gap_rad : at.backward.gap_rad)) {
        angle += step;
        TEST_ASSERT_TRUE(angle < LM_REAL(1.5));
        at = lm_tooth_clearance(&meshes[0], angle);
      }
      end = lm_find_overlap_end(&meshes[0], angle - LM_REAL(20) * step, angle + step, forward);
      TEST_ASSERT_TRUE(end.angle_rad <= angle && end.angle_rad >= angle - step);
      ASSERT_NEAR(1e-5, i == 0 ? meshes[0].polar_low_mm : meshes[0].polar_high_mm,
                  end.gap.radius_mm);
      at = lm_tooth_clearance(&meshes[0], end.angle_rad - LM_REAL(1e-5));
      ASSERT_NEAR(2e-4, in_arcmin(forward ? at.forward.gap_rad : at.backward.gap_rad) / 60,
                  in_arcmin(end.gap.gap_rad) / 60);
    }
  }
}

TEST(every_check_has_a_name_and_a_unit) {
  int i;
  int j;
  for (i = 0; i < LM_CHECK_COUNT; i++) {
    TEST_ASSERT_TRUE(strlen(lm_check_name((lm_check_id)i)) > 5);
    TEST_ASSERT_TRUE(strlen(lm_check_unit((lm_check_id)i)) > 0);
    for (j = 0; j < i; j++) {
      TEST_ASSERT_TRUE(strcmp(lm_check_name((lm_check_id)i), lm_check_name((lm_check_id)j)) != 0);
    }
  }
  TEST_ASSERT_EQUAL_STRING("", lm_check_name((lm_check_id)-1));
  TEST_ASSERT_EQUAL_STRING("", lm_check_unit((lm_check_id)-1));
  TEST_ASSERT_EQUAL_STRING("", lm_check_name(LM_CHECK_COUNT));
  TEST_ASSERT_EQUAL_STRING("", lm_check_unit(LM_CHECK_COUNT));
}

TEST(nonsense_is_refused_and_nothing_written) {
  lm_drive a = completed(reference_a());
  lm_smallest_gap kept;
  run(&a, 1);
  kept = smallest;
  TEST_ASSERT_EQUAL(LM_NULL, lm_find_smallest_gap(0, 1, 8, &smallest, &fault));
  TEST_ASSERT_EQUAL_STRING("meshes", fault.input);
  TEST_ASSERT_EQUAL(LM_NULL, lm_find_smallest_gap(meshes, 1, 8, 0, &fault));
  TEST_ASSERT_EQUAL_STRING("smallest", fault.input);
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_find_smallest_gap(meshes, 0, 8, &smallest, &fault));
  TEST_ASSERT_EQUAL_STRING("sections", fault.input);
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_find_smallest_gap(meshes, 1, 65, &smallest, &fault));
  TEST_ASSERT_EQUAL_STRING("steps_per_pitch", fault.input);
  TEST_ASSERT_EQUAL(LM_NULL, lm_check_design(0, meshes, 1, &smallest, &load, checks, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_check_design(&a, 0, 1, &smallest, &load, checks, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_check_design(&a, meshes, 1, 0, &load, checks, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_check_design(&a, meshes, 1, &smallest, &load, 0, &fault));
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE,
                    lm_check_design(&a, meshes, 0, &smallest, &load, checks, &fault));
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE,
                    lm_check_design(&a, meshes, 8, &smallest, &load, checks, &fault));
  TEST_ASSERT_EQUAL_STRING("sections", fault.input);
  TEST_ASSERT_EQUAL_MEMORY(&kept, &smallest, sizeof kept);
}

/* A rigid tip raised beyond the reach of the flexspline: teeth that never overlap. */
TEST(teeth_that_never_meet_have_no_smallest_gap) {
  const lm_drive a = completed(reference_a());
  prepare(&a, 1);
  meshes[0].polar_low_mm = LM_REAL(30);
  TEST_ASSERT_EQUAL(LM_NO_CONTACT, lm_find_smallest_gap(meshes, 1, 8, &smallest, &fault));
  TEST_ASSERT_EQUAL_STRING("teeth.engagement_depth", fault.input);
}

TEST(a_face_that_is_none_is_refused) {
  const lm_drive drive = completed(reference_a());
  TEST_ASSERT_EQUAL(LM_NULL, lm_find_face_gap(0, 64, 8, meshes, &smallest, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_find_face_gap(&drive, 64, 8, 0, &smallest, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_find_face_gap(&drive, 64, 8, meshes, 0, &fault));
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_find_face_gap(&drive, 64, 65, meshes, &smallest, &fault));
  TEST_ASSERT_EQUAL_STRING("steps_per_pitch", fault.input);
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_find_face_gap(&drive, 1, 8, meshes, &smallest, &fault));
  TEST_ASSERT_EQUAL_STRING("nodes", fault.input);
  prepare(&drive, 1);
  TEST_ASSERT_EQUAL(LM_NULL, lm_make_mesh_at(0, 0, 64, meshes, &meshes[1], &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_make_mesh_at(&drive, 0, 64, 0, &meshes[1], &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_make_mesh_at(&drive, 0, 64, meshes, 0, &fault));
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE,
                    lm_make_mesh_at(&drive, LM_REAL(1.01), 64, meshes, &meshes[1], &fault));
  TEST_ASSERT_EQUAL_STRING("place", fault.input);
}

/* A wave that hardly enters the teeth of a short, wide cup: between the edges the smallest gap is
 * below that of both, and all numbers of sections have it. */
TEST(the_smallest_gap_may_be_inside_the_face) {
  lm_drive drive = reference_a();
  double places[41];
  lm_smallest_gap one;
  int lowest = 0;
  int i;
  drive.generator.type = LM_COSINE;
  drive.generator.contact_half_angle_rad = LM_REAL(0);
  drive.generator.deflection_mm = LM_REAL(0.7 * 0.25);
  drive.teeth.flexspline_shift = LM_REAL(3.16);
  drive.teeth.rigid_shift = LM_REAL(3.335);
  drive.teeth.tooth_height = LM_REAL(1.58);
  drive.teeth.engagement_depth = LM_REAL(0.4);
  drive.flexspline.length_mm = LM_REAL(1.8) * drive.teeth.face_width_mm;
  drive = completed(drive);
  TEST_ASSERT_EQUAL(LM_OK, lm_make_face(&drive, 2, LM_CERTAIN_NODES, meshes, &fault));
  for (i = 0; i <= 40; i++) {
    TEST_ASSERT_EQUAL(LM_OK, lm_make_mesh_at(&drive, LM_REAL(i) / LM_REAL(40), LM_CERTAIN_NODES,
                                             &meshes[0], &meshes[2], &fault));
    TEST_ASSERT_EQUAL(LM_OK, lm_find_smallest_gap(&meshes[2], 1, LM_CERTAIN_STEPS, &one, &fault));
    places[i] = in_arcmin(one.gap_rad);
    lowest = places[i] < places[lowest] ? i : lowest;
  }
  TEST_ASSERT_TRUE(places[lowest] < fmin(places[0], places[40]) - 0.05);
  for (drive.axial_sections = 1; drive.axial_sections <= LM_SECTIONS_MAX; drive.axial_sections++) {
    TEST_ASSERT_EQUAL(
        LM_OK, lm_find_face_gap(&drive, LM_CERTAIN_NODES, LM_CERTAIN_STEPS, meshes, &one, &fault));
    ASSERT_NEAR(BOUND(1e-3, 1e-2), places[lowest], in_arcmin(one.gap_rad));
    ASSERT_NEAR(0.05, lowest / 40.0, one.place);
  }
}
