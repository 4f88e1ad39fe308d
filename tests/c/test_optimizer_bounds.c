/* Bounds exclude only combinations in which no design can be within the limits. */
#include <stdio.h>

#include "archive.h"
#include "bounds.h"
#include "one_workspace.h"
#include "reference_drives.h"
#include "search.h"
#include "spec.h"
#include "test.h"

#define POINTS 400

static const char wide_spec[] =
    "rated_torque_Nm 40\n"
    "objective stress\n"
    "phases 1\n"
    "choose teeth.deformation internal external\n"
    "choose generator.type discs ring\n"
    "choose teeth.flexspline_teeth 160 200 240\n"
    "range teeth.module_mm 0.1 0.5\n"
    "range teeth.flexspline_shift 1 5\n"
    "range teeth.tooth_height 1.4 2.1\n"
    "range teeth.rack_addendum 0.9 1.1\n"
    "range teeth.root_clearance 0.2 0.4\n"
    "range flexspline.wall_thickness_mm 0.05 1\n"
    "range material.shear_fatigue_MPa 100 300\n"
    "fixed teeth.face_width_mm 10\n";

static const char *const variants[] = {
    "range teeth.shift_difference -0.3 0.3\nrange generator.deflection_modules 0.85 1.1\n",
    "range teeth.rigid_shift 1 5\nrange generator.deflection_mm 0.1 0.5\n"};

static void read_variant(const char *variant, const char *more) {
  lm_spec_error error = {0, ""};
  char text[2048];
  snprintf(text, sizeof text, "%s%s%s", wide_spec, variant, more);
  TEST_ASSERT_EQUAL_INT_MESSAGE(LM_OK, lm_read_spec(text, &problem, &error), error.text);
  lm_default_scan(&scan);
  lm_lay_out(&problem, &scan, &layout);
}

/* A random point; 1 if the model accepts it. */
static int measure(int which, int *combination) {
  double unit[LM_FREE_MAX];
  int k;
  *combination = which % lm_count_combinations(&problem);
  for (k = 0; k < problem.range_count; k++) {
    unit[k] = (double)(lm_mix((uint64_t)(which * LM_FREE_MAX + k)) >> 11) / 9007199254740992.0;
  }
  return lm_evaluate_point(&problem, &scan, &layout, *combination, unit, result, workspace, NULL) ==
         LM_OK;
}

/* Limits equal to the figures of a random design do not exclude its combination. */
TEST(test_no_design_that_holds_is_excluded) {
  int variant;
  int measured = 0;
  for (variant = 0; variant < 2; variant++) {
    int which;
    read_variant(variants[variant], "limit outer_diameter_max_mm 100\n");
    for (which = 0; which < POINTS; which++) {
      lm_problem bounded = problem;
      int combination;
      int limit = 0;
      double torsion;
      if (!measure(which, &combination)) {
        continue;
      }
      measured++;
      bounded.bounds.outer_diameter_max_mm =
          100 * (1 + 1e-9 + result[layout.single_start + LM_LIMIT_OUTER_DIAMETER]);
      torsion = 1 + result[layout.single_start + LM_LIMIT_TORSION_STRESS];
      bounded.rated_torque_Nm /= torsion * (1 + 1e-9);
      TEST_ASSERT_EQUAL_INT(0, lm_is_excluded(&bounded, combination, &limit));
    }
  }
  TEST_ASSERT_GREATER_THAN_INT(POINTS / 4, measured);
}

TEST(test_what_the_smallest_drive_breaks_is_excluded) {
  int limit = 0;
  int variant;
  for (variant = 0; variant < 2; variant++) {
    /* combination 0: internal with discs, 160 teeth; 3: external with a ring */
    read_variant(variants[variant], "limit outer_diameter_max_mm 15\n");
    TEST_ASSERT_EQUAL_INT(1, lm_is_excluded(&problem, 0, &limit));
    TEST_ASSERT_EQUAL_INT(LM_LIMIT_OUTER_DIAMETER, limit);
    TEST_ASSERT_EQUAL_INT(1, lm_is_excluded(&problem, 3, &limit));
    read_variant(variants[variant], "limit outer_diameter_max_mm 30\n");
    TEST_ASSERT_EQUAL_INT(0, lm_is_excluded(&problem, 0, &limit));
    TEST_ASSERT_EQUAL_INT(0, lm_is_excluded(&problem, 3, &limit));
    /* 2 pi (0.5 (80 + 5))^2 mm^2 by 1 mm of 300 MPa bear 3405 N m, without the root clearance */
    problem.rated_torque_Nm = 3500;
    TEST_ASSERT_EQUAL_INT(1, lm_is_excluded(&problem, 0, &limit));
    TEST_ASSERT_EQUAL_INT(LM_LIMIT_TORSION_STRESS, limit);
    problem.rated_torque_Nm = 2900;
    TEST_ASSERT_EQUAL_INT(0, lm_is_excluded(&problem, 0, &limit));
  }
}

TEST(test_a_steel_that_is_not_stated_bears_the_models_250_MPa) {
  lm_spec_error error = {0, ""};
  int limit = 0;
  static const char spec[] =
      "rated_torque_Nm 230\n"
      "objective stress\n"
      "fixed generator.type discs\n"
      "fixed teeth.module_mm 0.25\n"
      "fixed teeth.flexspline_teeth 200\n"
      "fixed teeth.face_width_mm 10\n"
      "fixed teeth.flexspline_shift 3.35\n"
      "fixed flexspline.wall_thickness_mm 0.2\n"
      "range generator.deflection_modules 0.9 1\n";
  TEST_ASSERT_EQUAL_INT_MESSAGE(LM_OK, lm_read_spec(spec, &problem, &error), error.text);
  /* 2 pi (25.5 mm)^2 0.2 mm 250 MPa = 204 N m */
  TEST_ASSERT_EQUAL_INT(1, lm_is_excluded(&problem, 0, &limit));
  problem.value[LM_KEY_SHEAR_FATIGUE_MPA] = 300;
  TEST_ASSERT_EQUAL_INT(0, lm_is_excluded(&problem, 0, &limit));
  problem.value[LM_KEY_SHEAR_FATIGUE_MPA] = 0;
  problem.value[LM_KEY_WALL_THICKNESS_MM] = 0;
  TEST_ASSERT_EQUAL_INT(0, lm_is_excluded(&problem, 0, &limit));
}

TEST(test_only_a_ring_suits_external_deformation) {
  int limit = 0;
  read_variant(variants[0], "");
  TEST_ASSERT_EQUAL_INT(0, lm_is_excluded(&problem, 0, &limit)); /* internal, discs */
  TEST_ASSERT_EQUAL_INT(1, lm_is_excluded(&problem, 1, &limit)); /* external, discs */
  TEST_ASSERT_EQUAL_INT(-1, limit);
  TEST_ASSERT_EQUAL_INT(1, lm_is_excluded(&problem, 2, &limit)); /* internal, ring */
  TEST_ASSERT_EQUAL_INT(0, lm_is_excluded(&problem, 3, &limit)); /* external, ring */
}

/* The search states which limit it was. */
TEST(test_the_search_tells_what_pruned_a_combination) {
  lm_search *search;
  int limit = 0;
  read_variant(variants[0], "limit outer_diameter_max_mm 22\n");
  search = lm_open_search(&problem);
  TEST_ASSERT_EQUAL_INT(LM_FATE_NOT_REACHED, lm_read_fate(search, 0, &limit));
  TEST_ASSERT_EQUAL_INT(LM_FATE_PRUNED, lm_read_fate(search, 8, &limit));
  TEST_ASSERT_EQUAL_INT(LM_LIMIT_OUTER_DIAMETER, limit);
  lm_close_search(search);
}
