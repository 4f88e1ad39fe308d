/* Figures and limits of a point against the model's own functions, and the certificate. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "certificate.h"
#include "evaluate.h"
#include "lostmotion/radial_gap.h"
#include "reference_drives.h"
#include "spec.h"
#include "test.h"
#include "workspace.h"

static lm_problem problem;
static lm_scan scan;
static lm_layout layout;
static lm_workspace *workspace;
static double result[LM_RESULT_MAX];
static double other[LM_RESULT_MAX];
static lm_certificate *certificate;
static lm_fault fault;

static const double middle[LM_FREE_MAX] = {0.5, 0.5, 0.5, 0.5};

void setUp(void) {
  workspace = lm_create_workspace();
  certificate = (lm_certificate *)malloc(sizeof *certificate);
  TEST_ASSERT_NOT_NULL(workspace);
  TEST_ASSERT_NOT_NULL(certificate);
}

void tearDown(void) {
  lm_free_workspace(workspace);
  free(certificate);
}

/* Reference drive A of check_values.md, without the values that the tests below vary. */
static const char base_spec[] =
    "rated_torque_Nm 40\n"
    "torque_Nm 1.6\n"
    "objective tolerance_lost_motion\n"
    "fixed teeth.module_mm 0.25\n"
    "fixed teeth.flexspline_teeth 200\n"
    "fixed teeth.face_width_mm 10\n"
    "fixed flexspline.rim_thickness_mm 0.6\n"
    "range teeth.flexspline_shift 2.9 3.1\n";

static const char by_differences[] =
    "range teeth.shift_difference -0.143 0.057\n"
    "range generator.deflection_modules 0.9 1\n";

static const char links[] =
    "link 0.5 50 0.5 0 1 normal generator\n"
    "link 1.37 0.25 0 0 2 uniform teeth\n";

static lm_status read_text(const char *text) {
  lm_spec_error error = {0, ""};
  const lm_status status = lm_read_spec(text, &problem, &error);
  TEST_ASSERT_EQUAL_INT_MESSAGE(LM_OK, status, error.text);
  lm_default_scan(&scan);
  lm_lay_out(&problem, &scan, &layout);
  return status;
}

static void read_with(const char *a, const char *b, const char *c) {
  char text[4096];
  const char *type = strstr(c, "generator.type") == NULL ? "fixed generator.type discs\n" : "";
  snprintf(text, sizeof text, "%s%s%s%s%s", base_spec, type, a, b, c);
  (void)read_text(text);
}

static lm_status evaluate(double into[]) {
  return lm_evaluate_point(&problem, &scan, &layout, 0, middle, into, workspace, &fault);
}

static void assert_evaluated(double into[]) {
  TEST_ASSERT_EQUAL_INT_MESSAGE(LM_OK, evaluate(into), fault.input);
}

static double figure(const double from[], int which) {
  return lm_figure_of(&layout, from, which);
}

static double single(const double from[], int limit) {
  return from[layout.single_start + limit];
}

/* --- the drive --- */

TEST(test_shift_and_deflection_are_given_in_two_ways) {
  lm_drive a;
  lm_drive b;
  read_with(by_differences, "", "");
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_point_drive(&problem, 0, middle, &a, &fault));
  read_with("range teeth.rigid_shift 2.857 3.057\n", "range generator.deflection_mm 0.225 0.25\n",
            "");
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_point_drive(&problem, 0, middle, &b, &fault));
  ASSERT_NEAR(1e-12, a.teeth.rigid_shift, b.teeth.rigid_shift);
  ASSERT_NEAR(1e-12, a.generator.deflection_mm, b.generator.deflection_mm);
}

TEST(test_the_gear_that_turns_gives_the_ratio) {
  lm_drive drive;
  double value[LM_KEY_COUNT];
  read_with(by_differences, "rigid_gear_turns 1\n", "ratio_sign -1\n");
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_point_drive(&problem, 0, middle, &drive, &fault));
  ASSERT_NEAR(1e-12, -101, drive.ratio);
  lm_point_values(&problem, 0, middle, value);
  ASSERT_NEAR(1e-12, 3, value[LM_KEY_FLEXSPLINE_SHIFT]);
}

/* The pitch diameter is 50 mm; of 600 teeth of module 2 it is beyond the grades' 500 mm. */
TEST(test_a_link_without_a_diameter_has_the_flexsplines) {
  lm_drive a;
  lm_drive b;
  read_with(by_differences, links, "");
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_point_drive(&problem, 0, middle, &a, &fault));
  problem.link[0].diameter_mm = 0;
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_point_drive(&problem, 0, middle, &b, &fault));
  ASSERT_NEAR(1e-15, a.tolerances[0].upper_mm, b.tolerances[0].upper_mm);
  problem.value[LM_KEY_MODULE_MM] = 2;
  problem.value[LM_KEY_FLEXSPLINE_TEETH] = 600;
  TEST_ASSERT_EQUAL_INT(LM_OUT_OF_RANGE, lm_point_drive(&problem, 0, middle, &b, &fault));
  TEST_ASSERT_EQUAL_INT(LM_OUT_OF_RANGE, evaluate(result));
}

/* --- tolerances --- */

/* ISO 286: IT6 of 50 mm is 16 um and of 0.25 mm 6 um, IT7 25 um and 10 um. */
TEST(test_a_whole_grade_is_the_tables_in_the_drive_and_in_the_cost) {
  lm_drive drive;
  double unpaid;
  read_with(by_differences, "", "cost tolerance_exponent 2\n");
  assert_evaluated(result);
  unpaid = figure(result, LM_FIGURE_COST);
  read_with(by_differences, links,
            "cost tolerance_exponent 2\nfixed tolerance.0.grade 6\nfixed tolerance.1.grade 6\n");
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_point_drive(&problem, 0, middle, &drive, &fault));
  ASSERT_NEAR(1e-15, 0.016, drive.tolerances[0].upper_mm - drive.tolerances[0].lower_mm);
  ASSERT_NEAR(1e-15, 0.006, drive.tolerances[1].upper_mm - drive.tolerances[1].lower_mm);
  assert_evaluated(result);
  ASSERT_NEAR(1e-12, unpaid + (25.0 / 16) * (25.0 / 16) + 2 * (10.0 / 6) * (10.0 / 6),
              figure(result, LM_FIGURE_COST));
}

/* At 64 nodes against the search's 24 the lost motion without any gap differs a little. */
TEST(test_each_level_is_the_certificates) {
  static const char *const levels[] = {"level worst\n", "level probable\n", "level quantile\n"};
  double expected[3];
  int i;
  for (i = 0; i < 3; i++) {
    read_with(by_differences, links, levels[i]);
    assert_evaluated(result);
    TEST_ASSERT_EQUAL_INT(LM_OK, lm_certify(&problem, 0, middle, certificate, workspace, &fault));
    expected[0] = certificate->lost_motion_worst;
    expected[1] = certificate->lost_motion_probable;
    expected[2] = certificate->lost_motion_quantile.value;
    /* the figure is the largest of two tooth phases, the certificate is of the first */
    ASSERT_NEAR((i == 2 ? 0.03 : 0.003) * expected[i], expected[i],
                result[layout.figure_start[LM_FIGURE_TOLERANCE_LOST_MOTION]]);
    TEST_ASSERT_TRUE(figure(result, LM_FIGURE_LOST_MOTION) <
                     figure(result, LM_FIGURE_TOLERANCE_LOST_MOTION));
  }
}

/* Two links that are hardly ever both at their ends have a probable gap below the worst one; the
 * gap of a triangular one is at most at its limits. */
TEST(test_the_probable_gap_is_never_above_the_worst) {
  static const char *const chain[] = {
      "link 0.5 48 0.5 0 1 normal generator\nlink 1.37 0.25 0.5 0 2 normal teeth\n",
      "link 0.5 48 0.5 0 1 triangular generator\n"};
  int i;
  for (i = 0; i < 2; i++) {
    double worst;
    double probable;
    read_with(by_differences, chain[i], "level worst\n");
    assert_evaluated(result);
    worst = figure(result, LM_FIGURE_TOLERANCE_LOST_MOTION);
    read_with(by_differences, chain[i], "level probable\n");
    assert_evaluated(result);
    probable = figure(result, LM_FIGURE_TOLERANCE_LOST_MOTION);
    TEST_ASSERT_TRUE(i == 0 ? probable < 0.95 * worst : probable == worst);
  }
}

/* Only variables with a grade continue from measured values. */
TEST(test_other_grades_alone_need_no_new_contacts) {
  lm_gapless gapless[LM_PHASE_MAX];
  double value[LM_KEY_COUNT];
  lm_drive drive;
  int i;
  read_with(by_differences, links, "limit interference_max_mm 0.001\n");
  assert_evaluated(result);
  memcpy(gapless, workspace->gapless, sizeof gapless);
  memcpy(other, result, sizeof other);
  problem.value[LM_KEY_GRADE] = 9;
  lm_point_values(&problem, 0, middle, value);
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_build_drive(&problem, value, &drive, &fault));
  TEST_ASSERT_EQUAL_INT(
      LM_OK, lm_measure_tolerances(&problem, &layout, value, &drive, gapless, other, &fault));
  assert_evaluated(result);
  for (i = 0; i < layout.count; i++) {
    ASSERT_NEAR(1e-12, result[i], other[i]);
  }
  drive.tolerances[0].distribution = (lm_distribution)9;
  TEST_ASSERT_TRUE(LM_OK !=
                   lm_measure_tolerances(&problem, &layout, value, &drive, gapless, other, &fault));
}

/* A symmetric field reduces it by half. */
TEST(test_interference_is_of_the_tightest_chain) {
  read_with(by_differences, "link 1 50 0 0 1 normal generator\n", "");
  assert_evaluated(result);
  ASSERT_NEAR(0, -1, single(result, LM_LIMIT_INTERFERENCE));
  read_with(by_differences, "link 1 50 0 0 1 normal generator\nlevel worst\n",
            "limit interference_max_mm 0.002\n");
  assert_evaluated(result);
  ASSERT_NEAR(1e-12, (workspace->drive.tolerances[0].upper_mm - 0.002 - 1e-9) / 0.25,
              single(result, LM_LIMIT_INTERFERENCE));
}

/* A fit that ends exactly at the limit is allowed, regardless of rounding. */
TEST(test_interference_may_reach_its_limit) {
  const lm_tolerance_link *link = workspace->drive.tolerances;
  read_with(by_differences, links, "link 1 50 0.1 0.0003 1 normal generator\nlevel worst\n");
  assert_evaluated(result);
  problem.bounds.interference_max_mm = -(link[0].influence * link[0].lower_mm + link[2].lower_mm);
  TEST_ASSERT_TRUE(problem.bounds.interference_max_mm > 0);
  problem.bounds.interference_max_mm *= 1 - 1e-15;
  assert_evaluated(result);
  TEST_ASSERT_TRUE(single(result, LM_LIMIT_INTERFERENCE) <= 0);
  ASSERT_NEAR(1e-8, 0, single(result, LM_LIMIT_INTERFERENCE));
}

/* --- limits --- */

TEST(test_the_diameter_is_root_and_ring_of_the_larger_gear) {
  const lm_geometry *g;
  read_with(by_differences, "limit outer_diameter_max_mm 70\n", "");
  assert_evaluated(result);
  g = &workspace->design.face[0].geometry;
  ASSERT_NEAR(1e-12, 2 * (g->rigid_root_mm + 0.1 * 50) / 70 - 1,
              single(result, LM_LIMIT_OUTER_DIAMETER));
  read_with("fixed teeth.deformation external\n",
            "range teeth.shift_difference -0.05 0.05\nrange generator.deflection_modules 0.9 1\n",
            "fixed generator.type ring\nlimit outer_diameter_max_mm 70\n");
  assert_evaluated(result);
  g = &workspace->design.face[0].geometry;
  ASSERT_NEAR(1e-12, 2 * (g->neutral_mm + 0.3 + g->deflection_mm + 0.1 * 50) / 70 - 1,
              single(result, LM_LIMIT_OUTER_DIAMETER));
}

TEST(test_free_assembly_counts_only_where_asked) {
  read_with(by_differences, "", "");
  assert_evaluated(result);
  ASSERT_NEAR(0, -1, single(result, LM_LIMIT_FREE_ASSEMBLY));
  read_with(by_differences, "limit free_assembly 1\n", "");
  assert_evaluated(result);
  TEST_ASSERT_TRUE(single(result, LM_LIMIT_FREE_ASSEMBLY) != -1);
}

/* At the worst corner each flank loses T tan(alpha) / r by the tightest teeth: of 0.5 IT7
 * of 0.25 mm, 5 um, about 2.5 arcsec a um at 25 mm. */
TEST(test_the_worst_corner_takes_from_the_gaps) {
  int lost = 0;
  int i;
  read_with(by_differences, "link 1 0.25 0 0 1 normal teeth\nlevel worst\n", "");
  assert_evaluated(result);
  read_with(by_differences, "link 1 0.25 0 0 1 normal teeth\nlevel worst\n",
            "limit gap_at_worst_corner 1\n");
  assert_evaluated(other);
  for (i = layout.gap_start; i < layout.gap_start + layout.gap_count; i++) {
    if (result[i] != -LM_GAP_FREE_ARCMIN) {
      TEST_ASSERT_TRUE(other[i] > result[i] + 0.1 && other[i] < result[i] + 0.6);
      lost++;
    }
  }
  TEST_ASSERT_GREATER_THAN_INT(20, lost);
  /* only there do grades make a gradient more expensive */
  TEST_ASSERT_EQUAL_INT(LM_GRADIENT_CHARGE, lm_slope_charge(&problem));
}

TEST(test_a_gradient_is_charged_by_its_variables) {
  char lines[2048] = "";
  int i;
  for (i = 0; i < 9; i++) {
    char line[80];
    snprintf(line, sizeof line, "range tolerance.%d.grade 5 9\nlink 1 50 0 0 1 normal teeth\n", i);
    strcat(lines, line);
  }
  read_with(by_differences, lines, "");
  TEST_ASSERT_EQUAL_INT(LM_GRADIENT_CHARGE, lm_slope_charge(&problem));
  problem.bounds.gap_at_worst_corner = 1;
  TEST_ASSERT_EQUAL_INT(2 * LM_GRADIENT_CHARGE, lm_slope_charge(&problem));
}

/* --- closing the gap --- */

TEST(test_without_a_shift_to_move_the_gap_stays) {
  double unit[LM_FREE_MAX] = {0.5, 0.5};
  (void)read_text(
      "rated_torque_Nm 40\nobjective lost_motion\nfixed generator.type discs\n"
      "fixed teeth.module_mm 0.25\nfixed teeth.flexspline_teeth 200\n"
      "fixed teeth.face_width_mm 10\nrange teeth.engagement_depth 1 1.2\n");
  TEST_ASSERT_EQUAL_INT(0, lm_open_gap(&problem, 0, 1, unit));
  ASSERT_NEAR(0, 0.5, unit[0]);
}

/* Externally the flexspline's own shift moves, and the rigid gear stays: choice 1 is external. */
TEST(test_externally_the_flexspline_moves) {
  double unit[LM_FREE_MAX] = {0.5, 0.5, 0.5};
  double before[LM_KEY_COUNT];
  double after[LM_KEY_COUNT];
  read_with("choose teeth.deformation internal external\n", by_differences,
            "choose generator.type discs ring\n");
  lm_point_values(&problem, 3, unit, before);
  TEST_ASSERT_EQUAL_INT(1, lm_open_gap(&problem, 3, 0.1, unit));
  lm_point_values(&problem, 3, unit, after);
  TEST_ASSERT_TRUE(after[LM_KEY_FLEXSPLINE_SHIFT] != before[LM_KEY_FLEXSPLINE_SHIFT]);
  ASSERT_NEAR(1e-12, before[LM_KEY_FLEXSPLINE_SHIFT] + before[LM_KEY_SHIFT_DIFFERENCE],
              after[LM_KEY_FLEXSPLINE_SHIFT] + after[LM_KEY_SHIFT_DIFFERENCE]);
  /* internally the difference alone */
  lm_point_values(&problem, 0, unit, before);
  TEST_ASSERT_EQUAL_INT(1, lm_open_gap(&problem, 0, 0.1, unit));
  lm_point_values(&problem, 0, unit, after);
  ASSERT_NEAR(0, before[LM_KEY_FLEXSPLINE_SHIFT], after[LM_KEY_FLEXSPLINE_SHIFT]);
  /* at the end of the range the shift cannot move further */
  unit[1] = 1;
  TEST_ASSERT_EQUAL_INT(0, lm_open_gap(&problem, 0, 60, unit));
  read_with("range teeth.rigid_shift 2.8 3.1\n", "", "");
  unit[1] = 0.5;
  TEST_ASSERT_EQUAL_INT(1, lm_open_gap(&problem, 0, 0.1, unit));
}

/* --- the certificate --- */

static lm_status certify(void) {
  return lm_certify(&problem, 0, middle, certificate, workspace, &fault);
}

/* A nominal gap is a link without tolerance: the lost motion of every drive contains it. */
TEST(test_a_nominal_gap_is_in_every_sampled_drive) {
  double without;
  double turn = 0;
  read_with(by_differences, links, "level worst\n");
  TEST_ASSERT_EQUAL_INT(LM_OK, certify());
  without = certificate->lost_motion_worst;
  read_with(by_differences, links, "level worst\nfixed gap.generator_mm 0.01\n");
  problem.value[LM_KEY_GAP_RING_STIFFNESS_N_PER_MM] = 1; /* a gap that closes at once */
  assert_evaluated(result);
  TEST_ASSERT_EQUAL_INT(LM_OK, certify());
  TEST_ASSERT_EQUAL_INT(LM_OK,
                        lm_radial_gap_angle(0.01, workspace->gapless[0].mesh.flank_angle_rad,
                                            workspace->gapless[0].mesh.radius_mm, &turn, &fault));
  ASSERT_NEAR(0.002 * in_arcmin(turn), 2 * in_arcmin(turn),
              certificate->lost_motion_worst - without);
  ASSERT_NEAR(0.003 * certificate->lost_motion_worst, certificate->lost_motion_worst,
              result[layout.figure_start[LM_FIGURE_TOLERANCE_LOST_MOTION]]);
}

TEST(test_what_does_not_hold_is_reported) {
  read_with(by_differences, links, "");
  TEST_ASSERT_EQUAL_INT(LM_OK, certify());
  TEST_ASSERT_EQUAL_INT(certificate->smallest.gap_rad > -1e-6 * (double)ARCMIN, certificate->holds);
  read_with(by_differences, links, "limit lost_motion_max_arcmin 0.01\n");
  TEST_ASSERT_EQUAL_INT(LM_OK, certify());
  TEST_ASSERT_EQUAL_INT(0, certificate->holds);
  TEST_ASSERT_EQUAL_INT(1, certificate->limit[LM_LIMIT_FIGURE].stated);
  TEST_ASSERT_TRUE(certificate->limit[LM_LIMIT_FIGURE].margin < 0);
  TEST_ASSERT_EQUAL_INT(1, certificate->limit[LM_LIMIT_FIGURE].binds);
}

/* Where gaps are requested at the worst corner, the smallest gap of the nominal drive does not
 * count. */
TEST(test_gaps_at_the_worst_corner_are_those_of_the_scan) {
  read_with(by_differences, "link 1 0.25 0 0 1 normal teeth\n", "limit gap_at_worst_corner 1\n");
  TEST_ASSERT_EQUAL_INT(LM_OK, certify());
  TEST_ASSERT_TRUE(certificate->limit[LM_LIMIT_GAP].margin <
                   in_arcmin(certificate->smallest.gap_rad) - 0.1);
}

/* No multiplier where nothing depends on anything: the cost of a drive without tolerances and of
 * fixed size is a constant. */
TEST(test_a_constant_objective_has_no_residual) {
  (void)read_text(
      "rated_torque_Nm 40\nobjective cost\nfixed generator.type discs\n"
      "fixed teeth.module_mm 0.25\nfixed teeth.flexspline_teeth 200\n"
      "fixed teeth.face_width_mm 10\nfixed flexspline.rim_thickness_mm 0.6\n"
      "fixed teeth.shift_difference -0.043\nfixed generator.deflection_modules 0.95\n"
      "range teeth.engagement_depth 1.1 1.3\n");
  TEST_ASSERT_EQUAL_INT(LM_OK, certify());
  ASSERT_NEAR(0, 0, certificate->residual);
  /* a limit that is just met is active, and no variable changes it */
  problem.bounds.figure_max[LM_FIGURE_COST] = certificate->figure[LM_FIGURE_COST] * (1 + 1e-6);
  TEST_ASSERT_EQUAL_INT(LM_OK, certify());
  TEST_ASSERT_EQUAL_INT(1, certificate->limit[(int)LM_LIMIT_FIGURE + (int)LM_FIGURE_COST].binds);
  ASSERT_NEAR(0, 0, certificate->limit[(int)LM_LIMIT_FIGURE + (int)LM_FIGURE_COST].multiplier);
}

TEST(test_nothing_and_no_drive_are_refused) {
  read_with(by_differences, links, "");
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_certify(NULL, 0, middle, certificate, workspace, &fault));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_certify(&problem, 0, NULL, certificate, workspace, &fault));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_certify(&problem, 0, middle, NULL, workspace, &fault));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_certify(&problem, 0, middle, certificate, NULL, &fault));
  problem.value[LM_KEY_GENERATOR_TYPE] = LM_RING;
  TEST_ASSERT_TRUE(certify() != LM_OK);
}
