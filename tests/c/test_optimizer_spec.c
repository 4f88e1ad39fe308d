/* The search spec as text: the effect of each statement on the problem, and refusals. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "archive.h"
#include "lostmotion/design_keys.h"
#include "lostmotion/tolerance.h"
#include "spec.h"
#include "test.h"

static lm_problem problem;
static lm_spec_error error;

static const char least_spec[] =
    "rated_torque_Nm 40\n"
    "objective lost_motion\n"
    "fixed generator.type discs\n"
    "fixed teeth.module_mm 0.25\n"
    "fixed teeth.flexspline_teeth 200\n"
    "fixed teeth.face_width_mm 10\n"
    "range teeth.flexspline_shift 2 4\n";

static lm_status read_with(const char *lines) {
  static char text[16384];
  snprintf(text, sizeof text, "%s\n%s", lines, least_spec);
  error.line = -1;
  error.text[0] = '\0';
  return lm_read_spec(text, &problem, &error);
}

static void assert_read(const char *lines) {
  TEST_ASSERT_EQUAL_INT_MESSAGE(LM_OK, read_with(lines), error.text);
}

/* Refused at a line, 0 for the whole, with these words in the message. */
static void assert_refused(const char *lines, int line, const char *words) {
  TEST_ASSERT_TRUE_MESSAGE(read_with(lines) != LM_OK, lines);
  TEST_ASSERT_EQUAL_INT_MESSAGE(line, error.line, error.text);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, words), error.text);
}

/* `count` lines, each with its number. */
static const char *repeat(const char *format, int count) {
  static char text[8192];
  int length = 0;
  int i;
  for (i = 0; i < count; i++) {
    length += snprintf(text + length, sizeof text - (size_t)length, format, i);
  }
  return text;
}

static const char *between(const char *before, const char *middle, const char *after) {
  static char text[12288];
  strcpy(text, before);
  strcat(text, middle);
  strcat(text, after);
  return text;
}

TEST(test_every_number_lands_where_it_belongs) {
  assert_read(
      "torque_Nm 1.5\nratio_sign -1\ndamaged_share 0.25\n"
      "evaluations 777\nphases 4\nrigid_gear_turns 1\nseed 4294967295\nlevel probable\n");
  TEST_ASSERT_TRUE(problem.torque_Nm == 1.5);
  TEST_ASSERT_TRUE(problem.ratio_sign == -1);
  TEST_ASSERT_TRUE(problem.damaged_share == 0.25);
  TEST_ASSERT_EQUAL_INT(777, problem.evaluations);
  TEST_ASSERT_EQUAL_INT(4, problem.phases);
  TEST_ASSERT_EQUAL_INT(1, problem.rigid_gear_turns);
  TEST_ASSERT_TRUE(problem.seed == 4294967295u);
  TEST_ASSERT_EQUAL_INT(LM_LEVEL_PROBABLE, problem.level);
}

TEST(test_every_limit_lands_where_it_belongs) {
  assert_read(
      "limit safety_factor_min 2\nlimit outer_diameter_max_mm 70\n"
      "limit interference_max_mm 0.01\nlimit gap_min_arcmin 0.5\nlimit free_assembly 1\n"
      "limit gap_at_worst_corner 1\nlimit stress_max 0.4\n"
      "limit stiffness_min_Nm_per_rad 20000\n");
  TEST_ASSERT_TRUE(problem.bounds.safety_factor_min == 2);
  TEST_ASSERT_TRUE(problem.bounds.outer_diameter_max_mm == 70);
  TEST_ASSERT_TRUE(problem.bounds.interference_max_mm == 0.01);
  TEST_ASSERT_TRUE(problem.bounds.gap_min_arcmin == 0.5);
  TEST_ASSERT_EQUAL_INT(1, problem.bounds.free_assembly);
  TEST_ASSERT_EQUAL_INT(1, problem.bounds.gap_at_worst_corner);
  TEST_ASSERT_TRUE(problem.bounds.figure_max[LM_FIGURE_STRESS] == 0.4);
  /* 20000 N m a radian are 10800 / pi / 20000 arcmin a N m */
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.17188733853924696,
                            problem.bounds.figure_max[LM_FIGURE_COMPLIANCE]);
  assert_read("limit stiffness_min_Nm_per_rad 0\n");
  TEST_ASSERT_TRUE(problem.bounds.figure_max[LM_FIGURE_COMPLIANCE] == 0);
}

TEST(test_costs_and_chains_land_where_they_belong) {
  assert_read(
      "cost tolerance_exponent 0.8\ncost size 2.5\ncost rollers 7\n"
      "radial 1e-5 0.5 0.25 30\nradial 2e-5 0.6 0.75 20\ntorsion 1e5 100\n"
      "link 0.5 48 0.5 0.01 3 triangular teeth\n");
  TEST_ASSERT_TRUE(problem.cost.tolerance_exponent == 0.8);
  TEST_ASSERT_TRUE(problem.cost.size == 2.5);
  TEST_ASSERT_TRUE(problem.cost.generator[3] == 7);
  TEST_ASSERT_EQUAL_INT(2, problem.radial_count);
  TEST_ASSERT_TRUE(problem.radial[1][2] == 0.75);
  TEST_ASSERT_EQUAL_INT(1, problem.torsion_count);
  TEST_ASSERT_TRUE(problem.torsion[0][1] == 100);
  TEST_ASSERT_EQUAL_INT(LM_TRIANGULAR, problem.link[0].distribution);
  TEST_ASSERT_EQUAL_INT(LM_TEETH_GAP, problem.link[0].zone);
  TEST_ASSERT_TRUE(problem.link[0].offset_mm == 0.01);
}

TEST(test_a_link_without_a_cost_counts_as_one) {
  assert_read("link 0.5 48 0.5 0 0 normal teeth\nlink 0.5 48 0.5 0 3 normal teeth\n");
  TEST_ASSERT_TRUE(problem.link[0].cost_weight == 1);
  TEST_ASSERT_TRUE(problem.link[1].cost_weight == 3);
}

TEST(test_lines_that_hold_too_much_are_refused) {
  char line[4096];
  memset(line, 'x', sizeof line);
  memcpy(line, "fixed teeth.", 12);
  line[2048] = '\0';
  assert_refused(line, 1, "too many words or characters");
  assert_refused(between("choose teeth.flexspline_shift", repeat(" 1%02d", 65), ""), 1,
                 "too many words or characters");
  assert_read(between("choose teeth.root_clearance", repeat(" 0.3%02d", 64), "\n"));
  TEST_ASSERT_EQUAL_INT(64, problem.choice[0].count);
}

TEST(test_more_than_there_is_room_for_is_refused) {
  assert_refused(
      "objective cost\nobjective stress\nobjective compliance\n"
      "objective tolerance_lost_motion\n",
      7, "more than four");
  assert_refused(repeat("choose tolerance.%d.grade 5 6\n", 9), 9, "too many variables");
  assert_refused(repeat("range tolerance.%d.grade 5 9\n", 25), 25, "too many variables");
  assert_refused(repeat("link 1 2 0 0 %d normal teeth\n", 33), 33, "too many links");
  assert_refused(repeat("radial 1e-5 0.5 0.5 %d\n", 9), 9, "too many members");
  assert_refused("choose teeth.root_clearance 0.2 0.3\nratio 15 300\n", 2, "ratio");
  /* the certificate needs a link for a nominal gap */
  assert_read(repeat("link 1 2 0 0 %d normal teeth\n", 32));
  TEST_ASSERT_EQUAL_INT(32, problem.link_count);
  assert_refused(
      between("", repeat("link 1 2 0 0 %d normal teeth\n", 32), "fixed gap.teeth_mm 0.01\n"), 0,
      "tolerance.links");
  assert_read(
      between("", repeat("link 1 2 0 0 %d normal teeth\n", 31), "fixed gap.generator_mm 0.01\n"));
}

/* A ninth choice with two values is not a range. */
TEST(test_a_list_of_values_is_never_a_range) {
  lm_choice full;
  assert_refused("choose teeth.root_clearance\n", 1, "wrong number of values");
  assert_refused("range teeth.root_clearance 0.2\n", 1, "wrong number of values");
  assert_refused("whole tolerance.0.grade 5 6 7\n", 1, "wrong number of values");
  assert_refused(between("", repeat("choose tolerance.%d.grade 5 6\n", 8),
                         "choose teeth.tooth_height 1.5 1.7\n"),
                 9, "too many variables");
  assert_read("choose teeth.root_clearance 0.2 0.3\n");
  full = problem.choice[0];
  problem.choice_count = LM_CHOICE_MAX;
  TEST_ASSERT_EQUAL_INT(LM_TOO_SMALL, lm_choose_teeth_by_ratio(&problem, 98, 102, NULL));
  TEST_ASSERT_EQUAL_MEMORY(&full, &problem.choice[0], sizeof full);
}

TEST(test_numbers_that_are_none_are_refused) {
  assert_refused("evaluations 1e300\n", 1, "1e300");
  assert_refused("evaluations 100.5\n", 1, "expected a whole number");
  assert_refused("evaluations nan\n", 1, "expected a whole number");
  assert_refused("phases -1\n", 1, "expected a whole number");
  assert_refused("seed 4294967296\n", 1, "expected a whole number");
  assert_refused("seed -1\n", 1, "expected a whole number");
  assert_refused("phases 3x\n", 1, "3x");
  assert_refused("torque_Nm x\n", 1, "expected a number");
  assert_refused("fixed teeth.pressure_angle_deg nan\n", 0, "teeth.pressure_angle_deg");
  assert_refused("range teeth.root_clearance nan 0.3\n", 0, "teeth.root_clearance");
  assert_refused("limit outer_diameter_max_mm wide\n", 1, "expected one number");
  assert_refused("torsion 1 x\n", 1, "expected a number");
  assert_refused("cost size big\n", 1, "expected one number");
}

TEST(test_ratios_that_no_teeth_give_are_refused) {
  static const char spec[] =
      "rated_torque_Nm 40\nobjective lost_motion\n"
      "fixed generator.type discs\nfixed teeth.module_mm 0.25\n"
      "fixed teeth.face_width_mm 10\nrange teeth.flexspline_shift 2 4\n"
      "ratio 98 102\n";
  assert_refused("ratio 98\n", 1, "a lowest and a highest ratio");
  assert_refused("ratio x 102\n", 1, "a lowest and a highest ratio");
  assert_refused("ratio 98 x\n", 1, "a lowest and a highest ratio");
  assert_refused("ratio 1 2\n", 1, "a lowest and a highest ratio");
  TEST_ASSERT_EQUAL_INT_MESSAGE(LM_OK, lm_read_spec(spec, &problem, &error), error.text);
  TEST_ASSERT_EQUAL_INT(5, lm_count_combinations(&problem));
  TEST_ASSERT_EQUAL_INT(1, problem.given[LM_KEY_FLEXSPLINE_TEETH]);
}

/* The ring is the flexspline then, and the rigid gear has two teeth less. */
TEST(test_teeth_by_ratio_of_an_external_drive) {
  lm_start_problem(&problem);
  problem.value[LM_KEY_DEFORMATION] = 1;
  problem.rigid_gear_turns = 1;
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_choose_teeth_by_ratio(&problem, 98, 102, NULL));
  TEST_ASSERT_TRUE(problem.choice[0].value[0] == 198);
}

static lm_status read_starts(const char *lines) {
  static char text[16384];
  snprintf(text, sizeof text,
           "choose generator.contact_half_angle_deg 25 30 35\nchoose teeth.tooth_height 1.6 1.8\n"
           "range teeth.engagement_depth 0.9 1.3\n%s%s",
           least_spec, lines);
  return lm_read_spec(text, &problem, &error);
}

static void assert_start_refused(const char *lines, int line, const char *words) {
  TEST_ASSERT_EQUAL_INT_MESSAGE(LM_CORRUPT, read_starts(lines), lines);
  TEST_ASSERT_EQUAL_INT_MESSAGE(10 + line, error.line, error.text);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, words), error.text);
}

/* A value of every choice, then of every range, in their order. */
TEST(test_a_start_is_a_point) {
  TEST_ASSERT_EQUAL_INT_MESSAGE(
      LM_OK,
      read_starts("start 25 1.6 0.9 4\nstart 35 1.8 1.2 2.5\nstart 30 1.6 1.3000000000001 2\n"),
      error.text);
  TEST_ASSERT_EQUAL_INT(3, problem.start_count);
  TEST_ASSERT_EQUAL_INT(0, problem.start[0].combination);
  TEST_ASSERT_TRUE(problem.start[0].unit[0] == 0 && problem.start[0].unit[1] == 1);
  TEST_ASSERT_EQUAL_INT(2 + 3, problem.start[1].combination);
  TEST_ASSERT_TRUE(lm_chosen_value(&problem, problem.start[1].combination, 0) == 35);
  TEST_ASSERT_TRUE(lm_chosen_value(&problem, problem.start[1].combination, 1) == 1.8);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.75, problem.start[1].unit[0]);
  TEST_ASSERT_TRUE(problem.start[1].unit[1] == 0.25);
  TEST_ASSERT_TRUE(problem.start[2].unit[0] == 1); /* rounding */
}

TEST(test_a_start_that_is_no_point_is_refused) {
  assert_start_refused("start 25 1.6 0.9\n", 1, "a value of every variable");
  assert_start_refused("start 25 1.6 0.9 4 4\n", 1, "a value of every variable");
  assert_start_refused("start 25 1.6 x 4\n", 1, "expected a number");
  assert_start_refused("start 26 1.6 0.9 4\n", 1, "none of the choices");
  assert_start_refused("start 25 1.6 0.9 4.1\n", 1, "outside its range");
  assert_start_refused("start 25 1.6 0.8 4\n", 1, "outside its range");
  assert_start_refused("start 25 1.6 nan 4\n", 1, "outside its range");
  assert_start_refused("start 25 1.6 0.9 4\nseed 2\n", 2, "no other statement after a start");
  assert_start_refused(repeat("start 25 1.6 0.9 %d\n", 2), 1, "outside its range");
  assert_start_refused(repeat("start 25 1.6 0.9 3 # %d\n", LM_START_MAX + 1), LM_START_MAX + 1,
                       "too many starts");
}

/* Values that must be integers. */
TEST(test_sections_teeth_and_kinds_are_whole) {
  char text[1024];
  assert_refused("fixed axial_sections 2.6\n", 0, "found 2.6, expected 2 to 3");
  assert_refused("choose teeth.deformation 0.5\n", 0, "found 0.5, expected 0 to 1");
  assert_read("fixed axial_sections 3\n");
  strcpy(text, least_spec);
  strstr(text, "200")[2] = '1';
  TEST_ASSERT_EQUAL_INT(LM_INCONSISTENT, lm_read_spec(text, &problem, &error));
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "found 201, expected 200 to 202"), error.text);
}

TEST(test_variables_that_contradict_are_refused) {
  assert_refused("range teeth.deformation 0 1\n", 0, "teeth.deformation");
  assert_refused("range axial_sections 1 3\n", 0, "axial_sections");
  assert_refused("range teeth.root_clearance 0.3 9\n", 0, "teeth.root_clearance");
  assert_refused("range teeth.root_clearance 0.3 0.3\n", 0, "teeth.root_clearance");
  assert_refused("choose teeth.root_clearance 0.2 9\n", 0, "teeth.root_clearance");
  assert_refused("choose teeth.root_clearance 9 0.2\nchoose teeth.tooth_height 1.5 1.7\n", 0,
                 "teeth.root_clearance");
  assert_refused("fixed teeth.root_clearance 9\n", 0, "teeth.root_clearance");
  assert_refused("objective lost_motion\n", 0, "search.objectives");
  assert_refused("torque_Nm 21\n", 0, "search.torque_Nm");
  assert_refused("phases 9\n", 0, "search.phases");
  assert_refused("evaluations 9\n", 0, "search.evaluations");
  assert_refused("objective kinematic_error\n", 0, "search.phases");
  assert_read("objective kinematic_error\nphases 3\n");
}

/* The minimal spec, after one line and an empty one, fixes the teeth in line 7 and varies the shift
 * in line 9. */
TEST(test_a_key_has_one_value) {
  static const char second[] = "a second value";
  lm_fault fault;
  assert_refused("choose teeth.flexspline_teeth 198 200\n", 7, second);
  assert_refused("range teeth.flexspline_teeth 100 200\n", 7, second);
  assert_refused("ratio 98 102\n", 7, second);
  assert_refused("fixed teeth.flexspline_shift 3\n", 9, second);
  assert_refused("fixed teeth.root_clearance 0.3\nwhole teeth.root_clearance 0.2 0.3\n", 2, second);
  assert_refused("fixed teeth.flexspline_teeth 200\nratio 98 102\n", 2, "teeth.flexspline_teeth");
  /* nor has what two keys can state */
  assert_refused("fixed teeth.rigid_shift 3\nrange teeth.shift_difference -0.1 0.1\n", 2, second);
  assert_refused("fixed generator.deflection_modules 1\nfixed generator.deflection_mm 0.25\n", 2,
                 second);
  assert_read("fixed teeth.shift_difference 0\nfixed generator.deflection_mm 0.25\n");
  /* the text cannot state this, but a caller of the functions can */
  problem.range_count = 2;
  problem.range[1] = problem.range[0];
  TEST_ASSERT_EQUAL_INT(LM_INCONSISTENT, lm_prepare_problem(&problem, &fault));
  TEST_ASSERT_EQUAL_STRING("teeth.flexspline_shift", fault.input);
  problem.range_count = 1;
  problem.choice_count = 1;
  problem.choice[0].key = problem.range[0].key;
  problem.choice[0].count = 1;
  TEST_ASSERT_EQUAL_INT(LM_INCONSISTENT, lm_prepare_problem(&problem, &fault));
  TEST_ASSERT_EQUAL_STRING("teeth.flexspline_shift", fault.input);
  /* nor are there teeth or types between two others */
  problem.choice_count = 0;
  problem.range[0].low = 1;
  problem.range[0].high = 2;
  problem.range[0].key = LM_KEY_GENERATOR_TYPE;
  TEST_ASSERT_EQUAL_INT(LM_INCONSISTENT, lm_prepare_problem(&problem, &fault));
  TEST_ASSERT_EQUAL_STRING("generator.type", fault.input);
  problem.range[0].low = 100;
  problem.range[0].high = 200;
  problem.range[0].key = LM_KEY_FLEXSPLINE_TEETH;
  TEST_ASSERT_EQUAL_INT(LM_INCONSISTENT, lm_prepare_problem(&problem, &fault));
  TEST_ASSERT_EQUAL_STRING("teeth.flexspline_teeth", fault.input);
}

TEST(test_more_combinations_than_the_search_holds_are_refused) {
  static char lines[12288];
  strcpy(lines, between("choose teeth.root_clearance", repeat(" 0.3%02d", 64), "\n"));
  strcat(lines, between("choose teeth.tooth_height", repeat(" 1.7%02d", 64), "\n"));
  strcat(lines, between("choose teeth.rack_addendum", repeat(" 1.0%02d", 64), "\n"));
  assert_refused(lines, 0, "search.range");
  TEST_ASSERT_EQUAL_INT(-1, lm_count_combinations(&problem));
}

/* Errors that the text cannot contain, but a caller of the functions can make. */
TEST(test_links_of_no_kind_are_refused) {
  lm_fault fault;
  assert_read("link 0.5 48 0.5 0 1 normal teeth\n");
  problem.link[0].distribution = 4;
  TEST_ASSERT_EQUAL_INT(LM_OUT_OF_RANGE, lm_prepare_problem(&problem, &fault));
  TEST_ASSERT_EQUAL_STRING("tolerance.distribution", fault.input);
  problem.link[0].distribution = 0;
  problem.link[0].zone = 2;
  TEST_ASSERT_EQUAL_INT(LM_OUT_OF_RANGE, lm_prepare_problem(&problem, NULL));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_prepare_problem(NULL, &fault));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_read_spec(NULL, &problem, &error));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_read_spec(least_spec, NULL, &error));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_read_spec(least_spec, &problem, NULL));
}

/* Root mean square of the deviations, in units of tau: a normal one is not truncated and
 * has 1/3, an inspected one is truncated at 3 sigma, a triangle has 1 / sqrt(6), a uniform
 * one 1 / sqrt(3). */
TEST(test_sampled_deviations_have_their_distributions) {
  static const double expected[] = {1.0 / 3, 0.32889, 0.40825, 0.57735};
  int i;
  assert_read(
      "link 1 2 0 0 1 normal teeth\nlink 1 2 0 0 1 normal_inspected teeth\n"
      "link 1 2 0 0 1 triangular teeth\nlink 1 2 0 0 1 uniform generator\n");
  for (i = 0; i < 4; i++) {
    double mean = 0;
    double square = 0;
    double widest = 0;
    int s;
    for (s = 0; s < LM_LOOP_SAMPLES; s++) {
      const double d = problem.deviate[i][s];
      mean += d / LM_LOOP_SAMPLES;
      square += d * d / LM_LOOP_SAMPLES;
      widest = fmax(widest, fabs(d));
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 0, mean);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, expected[i], sqrt(square));
    TEST_ASSERT_TRUE(i == 0 || widest <= 1);
  }
}

TEST(test_names_outside_their_lists_are_empty) {
  char text[LM_KEY_NAME_MAX];
  lm_write_key(LM_KEY_COUNT, text);
  TEST_ASSERT_EQUAL_STRING("", text);
  TEST_ASSERT_EQUAL_STRING("", lm_figure_name(-1));
  TEST_ASSERT_EQUAL_STRING("", lm_figure_name(LM_FIGURE_COUNT));
  TEST_ASSERT_EQUAL_STRING("", lm_figure_unit(-1));
  TEST_ASSERT_EQUAL_STRING("", lm_figure_unit(LM_FIGURE_COUNT));
  TEST_ASSERT_EQUAL_STRING("arcsec", lm_figure_unit(LM_FIGURE_KINEMATIC_ERROR));
  TEST_ASSERT_EQUAL_STRING("", lm_limit_name(-1));
  TEST_ASSERT_EQUAL_STRING("", lm_generator_name(-1));
}
