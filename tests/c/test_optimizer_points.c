/* Specs, names and points of the search. */
#include <stdio.h>

#include "archive.h"
#include "certificate.h"
#include "lostmotion/design_keys.h"
#include "one_workspace.h"
#include "output.h"
#include "reference_drives.h"
#include "spec.h"
#include "test.h"
#include "workspace.h"

/* Reference drive A of check_values.md in the middle of its ranges. */
static const char reference_spec[] =
    "# a comment\n"
    "rated_torque_Nm 40   # and another\n"
    "torque_Nm 1.6\n"
    "objective lost_motion\n"
    "phases 1\n"
    "fixed generator.type discs\n"
    "fixed planar_only 1\nfixed teeth.module_mm 0.25\n"
    "fixed teeth.flexspline_teeth 200\n"
    "fixed teeth.face_width_mm 10\n"
    "fixed flexspline.rim_thickness_mm 0.6\n"
    "fixed generator.contact_half_angle_deg 30\n"
    "range teeth.flexspline_shift 2 4\n"
    "range teeth.shift_difference -0.143 0.057\n"
    "range generator.deflection_modules 0.9 1\n";

static const double middle[LM_FREE_MAX] = {0.5, 0.5, 0.5};

static void read_reference(void) {
  lm_spec_error error = {0, ""};
  TEST_ASSERT_EQUAL_INT_MESSAGE(LM_OK, lm_read_spec(reference_spec, &problem, &error), error.text);
  lm_default_scan(&scan);
  lm_lay_out(&problem, &scan, &layout);
}

/* The point gives the same drive as a drive file with the same values. */
TEST(test_a_point_is_the_drive_that_its_values_say) {
  lm_drive expected = reference_a();
  lm_drive drive;
  lm_fault fault;
  read_reference();
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_point_drive(&problem, 0, middle, &drive, &fault));
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_complete_drive(&expected, &fault));
  ASSERT_NEAR(1e-12, expected.teeth.rigid_shift, drive.teeth.rigid_shift);
  ASSERT_NEAR(1e-12, expected.generator.deflection_mm, drive.generator.deflection_mm);
  ASSERT_NEAR(1e-12, expected.ratio, drive.ratio);
  ASSERT_NEAR(1e-9, expected.flexspline.length_mm, drive.flexspline.length_mm);
  TEST_ASSERT_EQUAL_INT(expected.teeth.rigid_teeth, drive.teeth.rigid_teeth);
}

/* check_values.md, reference drive A, two discs: 0.174, 0.069 and 0.780 arcmin at 0, 10 and 20 deg,
 * forward. */
TEST(test_gap_rows_are_the_published_clearances) {
  lm_fault fault;
  read_reference();
  TEST_ASSERT_EQUAL_INT(
      LM_OK, lm_evaluate_point(&problem, &scan, &layout, 0, middle, result, workspace, &fault));
  ASSERT_NEAR(0.003, -0.174, result[layout.gap_start]);
  ASSERT_NEAR(0.003, -0.069, result[layout.gap_start + 2 * 5]);
  ASSERT_NEAR(0.003, -0.780, result[layout.gap_start + 2 * 10]);
}

/* At every level only the results that depend on tolerances are computed again. */
TEST(test_other_tolerances_alone_are_the_same_as_a_whole_evaluation) {
  static const char *const levels[] = {"level worst\n", "level probable\n", "level quantile\n"};
  static double whole[LM_RESULT_MAX];
  static lm_workspace *other;
  int changed = 0;
  int i;
  other = lm_create_workspace();
  TEST_ASSERT_NOT_NULL(other);
  for (i = 0; i < 60; i++) {
    lm_spec_error error = {0, ""};
    char text[4096];
    double unit[LM_FREE_MAX] = {0};
    double before;
    int k;
    snprintf(text, sizeof text,
             "%sobjective cost\n%slink 0.5 48 0.5 0 1 normal generator\n"
             "link 1.37 0.25 0.5 0 2 uniform teeth\n"
             "range tolerance.0.grade 5 9\nrange tolerance.1.grade 5 9\n",
             reference_spec, levels[i % 3]);
    TEST_ASSERT_EQUAL_INT_MESSAGE(LM_OK, lm_read_spec(text, &problem, &error), error.text);
    TEST_ASSERT_TRUE(lm_has_cheap_tolerances(&problem));
    lm_default_scan(&scan);
    lm_lay_out(&problem, &scan, &layout);
    for (k = 0; k < problem.range_count; k++) {
      unit[k] = fmod(0.618034 * (i + 1) * (k + 1), 1);
    }
    TEST_ASSERT_EQUAL_INT(
        LM_OK, lm_evaluate_point(&problem, &scan, &layout, 0, unit, result, workspace, NULL));
    before = lm_figure_of(&layout, result, LM_FIGURE_TOLERANCE_LOST_MOTION);
    unit[3] = fmod(unit[3] + 0.3, 1);
    unit[4] = fmod(unit[4] + 0.5, 1);
    TEST_ASSERT_EQUAL_INT(
        LM_OK, lm_evaluate_tolerances(&problem, &layout, 0, unit, result, workspace, NULL));
    TEST_ASSERT_EQUAL_INT(LM_OK,
                          lm_evaluate_point(&problem, &scan, &layout, 0, unit, whole, other, NULL));
    for (k = 0; k < layout.count; k++) {
      ASSERT_NEAR(1e-12 * (1 + fabs(whole[k])), whole[k], result[k]);
    }
    changed += lm_figure_of(&layout, result, LM_FIGURE_TOLERANCE_LOST_MOTION) != before;
  }
  TEST_ASSERT_GREATER_THAN_INT(50, changed);
  problem.damaged_share = 1;
  TEST_ASSERT_EQUAL_INT(
      LM_NOT_FINITE, lm_evaluate_tolerances(&problem, &layout, 0, middle, result, workspace, NULL));
  problem.damaged_share = 0;
  problem.link[1].distribution = 99;
  TEST_ASSERT_NOT_EQUAL_INT(
      LM_OK, lm_evaluate_tolerances(&problem, &layout, 0, middle, result, workspace, NULL));
  problem.link[0].diameter_mm = 1e9;
  TEST_ASSERT_NOT_EQUAL_INT(
      LM_OK, lm_evaluate_tolerances(&problem, &layout, 0, middle, result, workspace, NULL));
  problem.bounds.gap_at_worst_corner = 1;
  TEST_ASSERT_FALSE(lm_has_cheap_tolerances(&problem));
  lm_free_workspace(other);
}

/* The figure equals lm_reversal_lost_motion of the same drive. */
TEST(test_lost_motion_is_the_models) {
  lm_drive drive;
  lm_fault fault;
  lm_real reversal = 0;
  read_reference();
  TEST_ASSERT_EQUAL_INT(
      LM_OK, lm_evaluate_point(&problem, &scan, &layout, 0, middle, result, workspace, &fault));
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_point_drive(&problem, 0, middle, &drive, &fault));
  TEST_ASSERT_EQUAL_INT(
      LM_OK, lm_prepare_meshes(&drive, LM_NEUTRAL_LINE_NODES, &workspace->design, &fault));
  TEST_ASSERT_EQUAL_INT(
      LM_OK, lm_reversal_lost_motion(&drive, 0, 1.6, &reversal, &workspace->design, &fault));
  /* 24 nodes in the search, 64 here */
  ASSERT_NEAR(1e-3, in_arcmin(reversal), lm_figure_of(&layout, result, LM_FIGURE_LOST_MOTION));
}

/* Closing the gap moves the rigid shift until the smallest gap of the scan is zero. */
TEST(test_closing_the_gap_leaves_the_reserve) {
  double unit[LM_FREE_MAX] = {0.4, 0.9, 0.7};
  double largest = -HUGE_VAL;
  lm_fault fault;
  int i;
  read_reference();
  TEST_ASSERT_EQUAL_INT(
      LM_OK, lm_evaluate_point(&problem, &scan, &layout, 0, unit, result, workspace, &fault));
  TEST_ASSERT_EQUAL_INT(1, lm_close_gap(&problem, &layout, 0, result, unit));
  TEST_ASSERT_EQUAL_INT(
      LM_OK, lm_evaluate_point(&problem, &scan, &layout, 0, unit, result, workspace, &fault));
  for (i = 0; i < layout.gap_count; i++) {
    largest = fmax(largest, result[layout.gap_start + i]);
  }
  ASSERT_NEAR(1e-9, -LM_RESERVE, largest);
}

/* With the ring outside the shift's turn is known within one part in the number of teeth: a small
 * gap remains, whether it was closed or opened. */
TEST(test_closing_never_takes_too_much) {
  static const char spec[] =
      "rated_torque_Nm 40\nobjective lost_motion\nphases 1\nrigid_gear_turns 1\n"
      "fixed teeth.deformation external\nfixed generator.type ring\n"
      "fixed planar_only 1\nfixed teeth.module_mm 0.25\nfixed teeth.flexspline_teeth 200\n"
      "fixed teeth.face_width_mm 10\nfixed generator.deflection_modules 1\n"
      "fixed generator.contact_half_angle_deg 30\n"
      "range teeth.flexspline_shift 2 4\nrange teeth.shift_difference -0.3 0.3\n";
  lm_spec_error error = {0, ""};
  int i;
  TEST_ASSERT_EQUAL_INT_MESSAGE(LM_OK, lm_read_spec(spec, &problem, &error), error.text);
  lm_default_scan(&scan);
  lm_lay_out(&problem, &scan, &layout);
  for (i = 0; i < 2; i++) {
    double unit[LM_FREE_MAX] = {0.5, i == 0 ? 0.3 : 0.7};
    lm_fault fault;
    double was;
    double left;
    TEST_ASSERT_EQUAL_INT(
        LM_OK, lm_evaluate_point(&problem, &scan, &layout, 0, unit, result, workspace, &fault));
    was = lm_gap_row_of(&layout, result);
    TEST_ASSERT_TRUE(i == 0 ? was < -0.1 : was > 0.1);
    TEST_ASSERT_EQUAL_INT(1, lm_close_gap(&problem, &layout, 0, result, unit));
    TEST_ASSERT_EQUAL_INT(
        LM_OK, lm_evaluate_point(&problem, &scan, &layout, 0, unit, result, workspace, &fault));
    left = lm_gap_row_of(&layout, result);
    TEST_ASSERT_TRUE(left <= 0 && left > -0.012 * fabs(was));
  }
}

/* Objectives that differ only by rounding are equal, so that they do not form a front. */
TEST(test_rounding_makes_no_front) {
  const double unit[LM_FREE_MAX] = {0};
  const double one[LM_OBJECTIVE_MAX] = {5.0, 1.8e-12};
  const double other[LM_OBJECTIVE_MAX] = {7.0, 5.4e-13};
  lm_solution found[2];
  lm_solution list[2];
  int count = 0;
  read_reference();
  problem.objective_count = 2;
  lm_fill_solution(&problem, &found[0], 0, unit, one, 0);
  lm_fill_solution(&problem, &found[1], 0, unit, other, 0);
  lm_insert_solution(&problem, list, &count, 2, &found[0]);
  lm_insert_solution(&problem, list, &count, 2, &found[1]);
  TEST_ASSERT_EQUAL_INT(1, count);
  TEST_ASSERT_TRUE(list[0].objective[0] == 5.0 && list[0].objective[1] == 0);
}

/* A long list that is full: many designs close to an end of the front do not displace the end. In a
 * short list the ends would be most of it. */
TEST(test_a_full_list_keeps_its_ends) {
  static const int places[] = {40, 8};
  const double unit[LM_FREE_MAX] = {0};
  lm_solution list[40];
  lm_solution found;
  int i;
  int k;
  read_reference();
  problem.objective_count = 2;
  for (k = 0; k < 2; k++) {
    int count = 0;
    int ends = 0;
    for (i = 0; i < places[k] + 100; i++) {
      const double share = i < places[k] ? i / (places[k] - 1.0) : 1e-4 * (i + 1 - places[k]);
      const double one[LM_OBJECTIVE_MAX] = {1 + share, 2 - share};
      const double other[LM_OBJECTIVE_MAX] = {2 - share, 1 + share};
      lm_fill_solution(&problem, &found, 0, unit, i < places[k] || i % 2 == 0 ? one : other, 0);
      lm_insert_solution(&problem, list, &count, places[k], &found);
    }
    TEST_ASSERT_EQUAL_INT(places[k], count);
    for (i = 0; i < count; i++) {
      ends += list[i].objective[0] == 1 || list[i].objective[1] == 1;
    }
    TEST_ASSERT_EQUAL_INT(k == 0, ends == 2);
  }
}

/* Designs on a coarse grid, so that many are equally good; every third violates a limit. */
static void draw_designs(lm_solution list[], int count) {
  const double unit[LM_FREE_MAX] = {0};
  uint64_t state = (uint64_t)count;
  int i;
  int j;
  for (i = 0; i < count; i++) {
    double objective[LM_OBJECTIVE_MAX] = {0};
    for (j = 0; j < problem.objective_count; j++) {
      state = lm_mix(state);
      objective[j] = (double)(state % 12);
    }
    lm_fill_solution(&problem, &list[i], i, unit, objective, i % 3 == 0 ? 1.0 + i % 7 : 0);
  }
}

static int beats(const lm_solution *a, const lm_solution *b) {
  if (a->violation > 0 || b->violation > 0) {
    return a->violation < b->violation;
  }
  return lm_is_as_good(&problem, a->objective, b->objective) &&
         !lm_is_as_good(&problem, b->objective, a->objective);
}

/* The list keeps exactly the designs that no other dominates, of equal ones the first. */
TEST(test_a_list_holds_what_nothing_is_as_good_as) {
  lm_solution drawn[60];
  lm_solution list[60];
  int i;
  int k;
  read_reference();
  for (problem.objective_count = 1; problem.objective_count <= 4; problem.objective_count++) {
    int count = 0;
    int expected = 0;
    draw_designs(drawn, 60);
    for (i = 0; i < 60; i++) {
      lm_insert_solution(&problem, list, &count, 60, &drawn[i]);
    }
    for (i = 0; i < 60; i++) {
      int stays = 1;
      for (k = 0; k < 60 && stays; k++) {
        stays = k == i || !lm_is_as_good(&problem, drawn[k].objective, drawn[i].objective) ||
                (k > i && lm_is_as_good(&problem, drawn[i].objective, drawn[k].objective));
      }
      for (k = 0; k < count && list[k].combination != drawn[i].combination; k++) {
      }
      TEST_ASSERT_EQUAL_INT(stays, k < count);
      expected += stays;
    }
    TEST_ASSERT_EQUAL_INT(expected, count);
  }
}

/* Each front consists of all designs that none of it or of later fronts dominates. */
TEST(test_selection_proceeds_front_by_front) {
  lm_solution list[80];
  int first;
  int last;
  int i;
  int k;
  read_reference();
  for (problem.objective_count = 1; problem.objective_count <= 4; problem.objective_count++) {
    int fronts = 0;
    draw_designs(list, 80);
    lm_select_solutions(&problem, list, 80, 80);
    for (first = 0; first < 80; first = last) {
      for (last = first; last < 80; last++) {
        int beaten = 0;
        for (k = first; k < 80; k++) {
          beaten |= beats(&list[k], &list[last]);
        }
        if (beaten) {
          break;
        }
      }
      TEST_ASSERT_GREATER_THAN_INT(first, last);
      for (i = last; i < 80; i++) {
        int beaten = 0;
        for (k = first; k < 80; k++) {
          beaten |= beats(&list[k], &list[i]);
        }
        TEST_ASSERT_TRUE(beaten);
      }
      fronts++;
    }
    TEST_ASSERT_GREATER_THAN_INT(7, fronts); /* the violations alone make 7 */
  }
}

/* A spec that differs from the reference in one line, and the line that is named. */
static void assert_refused(const char *line, int at, const char *word) {
  lm_spec_error error = {-1, ""};
  char text[2048];
  snprintf(text, sizeof text, "%s\n%s", line, reference_spec);
  TEST_ASSERT_TRUE_MESSAGE(lm_read_spec(text, &problem, &error) != LM_OK, line);
  TEST_ASSERT_EQUAL_INT_MESSAGE(at, error.line, line);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, word), error.text);
}

TEST(test_refusals_name_line_and_word) {
  assert_refused("fixd teeth.module_mm 1", 1, "fixd");
  assert_refused("fixed teeth.modul_mm 1", 1, "teeth.modul_mm");
  assert_refused("fixed teeth.module_mm one", 1, "one");
  assert_refused("fixed teeth.module_mm 1 2", 1, "teeth.module_mm");
  assert_refused("objective beauty", 1, "beauty");
  assert_refused("level sometimes", 1, "sometimes");
  assert_refused("limit beauty 1", 1, "beauty");
  assert_refused("limit safety_factor_min", 1, "safety_factor_min");
  assert_refused("link 1 2 3", 1, "link");
  assert_refused("link 1 2 3 4 x normal teeth", 1, "x");
  assert_refused("link 1 2 3 4 5 even teeth", 1, "even");
  assert_refused("link 1 2 3 4 5 normal nowhere", 1, "nowhere");
  assert_refused("torsion 1", 1, "torsion");
  assert_refused("radial 1 2 x 3", 1, "x");
  assert_refused("cost beauty 3", 1, "beauty");
  assert_refused("cost size", 1, "size");
  assert_refused("ratio 100.2 100.3", 1, "ratio");
  assert_refused("seed", 1, "seed");
  assert_refused("seed one", 1, "one");
}

TEST(test_values_out_of_range_name_their_key) {
  assert_refused("range teeth.tooth_height 1.9 1.8", 0, "teeth.tooth_height");
  assert_refused("range flexspline.length_mm 1 9000", 0, "flexspline.length_mm");
  assert_refused("range axial_sections 1 2", 0, "axial_sections");
  assert_refused("choose axial_sections 1 3", 0, "axial_sections");
  assert_refused("objective kinematic_error", 0, "phases");
  assert_refused("limit gap_min_arcmin 100", 0, "gap_min_arcmin");
  assert_refused("limit safety_factor_min -1", 0, "safety_factor_min");
  assert_refused("link 1 5000 0 0 1 normal teeth", 0, "tolerance.diameter_mm");
}

TEST(test_names_go_both_ways) {
  char text[LM_KEY_NAME_MAX];
  int i;
  for (i = 0; i < LM_KEY_COUNT; i++) {
    lm_write_key(i, text);
    TEST_ASSERT_EQUAL_INT(text[0] == '\0' ? -1 : i, lm_find_key(text));
  }
  lm_write_key(LM_KEY_RIGID_TEETH, text); /* follows from the flexspline's */
  TEST_ASSERT_EQUAL_STRING("", text);
  lm_write_key(LM_KEY_PRESSURE_ANGLE_DEG, text);
  TEST_ASSERT_EQUAL_STRING("teeth.pressure_angle_deg", text);
  lm_write_key(LM_KEY_AXIAL_SECTIONS, text);
  TEST_ASSERT_EQUAL_STRING("axial_sections", text);
  lm_write_key(-1, text);
  TEST_ASSERT_EQUAL_STRING("", text);
  for (i = 0; i < LM_FIGURE_COUNT; i++) {
    TEST_ASSERT_EQUAL_INT(i, lm_find_figure(lm_figure_name(i)));
  }
  TEST_ASSERT_EQUAL_INT(LM_FIGURE_COMPLIANCE, lm_find_figure("stiffness"));
  TEST_ASSERT_EQUAL_STRING("", lm_limit_name(LM_LIMIT_COUNT));
  TEST_ASSERT_EQUAL_STRING("", lm_generator_name(9));
}

/* Ratio of the gear that turns: 98 .. 102 are the flexsplines of 196 .. 204 teeth; of a turning
 * rigid gear, two more, 194 .. 202. */
TEST(test_teeth_follow_from_the_ratio) {
  lm_fault fault;
  lm_start_problem(&problem);
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_choose_teeth_by_ratio(&problem, 98, 102, &fault));
  TEST_ASSERT_EQUAL_INT(5, problem.choice[0].count);
  ASSERT_NEAR(0, 196, problem.choice[0].value[0]);
  lm_start_problem(&problem);
  problem.rigid_gear_turns = 1;
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_choose_teeth_by_ratio(&problem, 98, 102, &fault));
  ASSERT_NEAR(0, 194, problem.choice[0].value[0]);
  TEST_ASSERT_EQUAL_INT(LM_OUT_OF_RANGE, lm_choose_teeth_by_ratio(&problem, 1, 2, &fault));
  TEST_ASSERT_EQUAL_INT(LM_TOO_SMALL, lm_choose_teeth_by_ratio(&problem, 15, 300, &fault));
}

TEST(test_the_shipped_specs_are_read) {
  static const char *const names[] = {"robot_joint", "instrument", "ring_generator"};
  static const int combinations[] = {15, 5, 5};
  int i;
  for (i = 0; i < 3; i++) {
    char path[512];
    char text[8192];
    lm_spec_error error = {0, ""};
    size_t length;
    FILE *file;
    snprintf(path, sizeof path, "%s/%s.search", LM_SPEC_DIR, names[i]);
    file = fopen(path, "r");
    TEST_ASSERT_NOT_NULL_MESSAGE(file, path);
    length = fread(text, 1, sizeof text - 1, file);
    fclose(file);
    text[length] = '\0';
    TEST_ASSERT_EQUAL_INT_MESSAGE(LM_OK, lm_read_spec(text, &problem, &error), error.text);
    TEST_ASSERT_EQUAL_INT(combinations[i], lm_count_combinations(&problem));
  }
}
