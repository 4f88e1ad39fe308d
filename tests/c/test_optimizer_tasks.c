/* Single tasks of the search: the answer of each kind of task. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "archive.h"
#include "certificate.h"
#include "known_results.h"
#include "pool.h"
#include "run_task.h"
#include "spec.h"
#include "test.h"
#include "workspace.h"

static lm_problem problem;
static lm_workspace *workspace;
static lm_answer *answer;
static lm_task task;

void setUp(void) {
  workspace = lm_create_workspace();
  answer = (lm_answer *)malloc(sizeof *answer);
  TEST_ASSERT_NOT_NULL(workspace);
  TEST_ASSERT_NOT_NULL(answer);
}

void tearDown(void) {
  lm_free_workspace(workspace);
  free(answer);
}

static const char small_spec[] =
    "rated_torque_Nm 40\n"
    "fixed planar_only 1\nfixed teeth.module_mm 0.25\n"
    "fixed teeth.flexspline_teeth 200\n"
    "fixed teeth.face_width_mm 10\n"
    "range teeth.flexspline_shift 2 4\n"
    "range teeth.shift_difference -0.3 0.3\n"
    "range generator.deflection_modules 0.88 1.05\n"
    "range generator.contact_half_angle_deg 22 35\n"
    "link 0.5 48 0.5 0 1 normal generator\n"
    "link 1.37 0.25 0.5 0 2 uniform teeth\n";

static const char two_grades[] = "whole tolerance.0.grade 5 9\nwhole tolerance.1.grade 5 9\n";
static const char two_objectives[] = "objective tolerance_lost_motion\nobjective cost\n";

static void read_with(const char *a, const char *b, const char *c) {
  lm_spec_error error = {0, ""};
  char text[4096];
  snprintf(text, sizeof text, "%s%s%s%s", small_spec, a, b, c);
  TEST_ASSERT_EQUAL_INT_MESSAGE(LM_OK, lm_read_spec(text, &problem, &error), error.text);
}

/* Discs, or with choices the combination of the same. */
static void make_task(int kind, int budget) {
  int k;
  memset(&task, 0, sizeof task);
  task.id = 7;
  task.kind = kind;
  task.budget = budget;
  task.seed = 12345;
  lm_scalarise_first(&task.scalar);
  for (k = 0; k < problem.range_count; k++) {
    task.unit[k] = 0.5;
  }
}

static void run(void) {
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_run_task(&problem, &task, answer, workspace, NULL));
}

/* Conditions of every answer. */
static void check_answer(void) {
  int i;
  int j;
  TEST_ASSERT_EQUAL_INT(task.id, answer->id);
  TEST_ASSERT_EQUAL_INT(task.combination, answer->combination);
  TEST_ASSERT_TRUE(answer->refused + answer->feasible <= answer->plain + answer->slopes);
  TEST_ASSERT_EQUAL_INT(answer->plain + answer->slopes * lm_slope_charge(&problem) +
                            (int)ceil(answer->tolerance_only / (double)LM_LOOKS_CHARGED),
                        lm_charge_of(&problem, answer));
  for (i = 0; i < answer->solution_count; i++) {
    TEST_ASSERT_TRUE(answer->solution[i].violation <= 0 || task.kind != LM_TASK_VERIFY);
    for (j = 0; j < problem.range_count; j++) {
      TEST_ASSERT_TRUE(answer->solution[i].unit[j] >= 0 && answer->solution[i].unit[j] <= 1);
    }
  }
}

TEST(test_a_screen_looks_at_half_its_budget_of_points) {
  read_with("fixed generator.type discs\n", two_objectives, "");
  make_task(LM_TASK_SCREEN, 1);
  run();
  check_answer();
  TEST_ASSERT_TRUE(answer->plain >= 1 && answer->plain <= 2);
  make_task(LM_TASK_SCREEN, 40);
  run();
  check_answer();
  TEST_ASSERT_TRUE(answer->plain >= 20 && answer->plain <= 40);
  TEST_ASSERT_EQUAL_INT(1, answer->computed);
  make_task(LM_TASK_SCREEN, 1000);
  run();
  TEST_ASSERT_TRUE(answer->plain >= 256 && answer->plain <= 512);
}

/* The design itself, and if it interferes, the same with its gap closed. */
TEST(test_a_look_is_at_one_design) {
  read_with("fixed generator.type discs\n", "objective lost_motion\n", "");
  make_task(LM_TASK_EVALUATE, 2);
  task.unit[1] = 0.4;
  run();
  check_answer();
  TEST_ASSERT_EQUAL_INT(2, answer->plain);
  TEST_ASSERT_EQUAL_INT(1, answer->computed);
  TEST_ASSERT_TRUE(answer->unit[0] == 0.5 && answer->unit[2] == 0.5 && answer->unit[3] == 0.5);
  TEST_ASSERT_TRUE(answer->unit[1] > 0.4);
  task.unit[1] = 0.7;
  run();
  TEST_ASSERT_EQUAL_INT(1, answer->plain);
  TEST_ASSERT_EQUAL_INT(1, answer->solution_count);
  TEST_ASSERT_EQUAL_MEMORY(task.unit, answer->unit, sizeof task.unit);
}

/* No range of this spec opens gaps: each point is examined once. */
TEST(test_points_without_a_shift_leave_the_gaps) {
  lm_spec_error error = {0, ""};
  static const char spec[] =
      "rated_torque_Nm 40\nobjective lost_motion\n"
      "fixed planar_only 1\nfixed generator.type discs\nfixed teeth.module_mm 0.25\n"
      "fixed teeth.flexspline_teeth 200\nfixed teeth.face_width_mm 10\n"
      "range generator.deflection_modules 0.88 1.05\n";
  TEST_ASSERT_EQUAL_INT_MESSAGE(LM_OK, lm_read_spec(spec, &problem, &error), error.text);
  make_task(LM_TASK_SCREEN, 20);
  run();
  TEST_ASSERT_EQUAL_INT(10, answer->plain);
}

TEST(test_gradients_end_at_or_below_where_they_began) {
  double begun;
  read_with("fixed generator.type discs\n", two_objectives, "limit stress_max 0.6\n");
  make_task(LM_TASK_SCREEN, 40);
  run();
  memcpy(task.unit, answer->unit, sizeof task.unit);
  begun = answer->value;
  task.kind = LM_TASK_SLSQP;
  task.budget = 400;
  run();
  check_answer();
  TEST_ASSERT_GREATER_THAN_INT(2, answer->slopes);
  TEST_ASSERT_EQUAL_INT(1, answer->computed);
  TEST_ASSERT_TRUE(answer->violation <= 0);
  TEST_ASSERT_TRUE(answer->value <= begun);
}

/* How many of the designs that a task reports have their gap closed to the reserve. */
static int count_closed(void) {
  static double result[LM_RESULT_MAX];
  lm_layout layout;
  lm_scan scan;
  int closed = 0;
  int i;
  lm_default_scan(&scan);
  lm_lay_out(&problem, &scan, &layout);
  for (i = 0; i < answer->solution_count; i++) {
    const lm_solution *found = &answer->solution[i];
    TEST_ASSERT_EQUAL_INT(LM_OK, lm_evaluate_point(&problem, &scan, &layout, found->combination,
                                                   found->unit, result, workspace, NULL));
    closed += lm_gap_row_of(&layout, result) > -2 * LM_RESERVE;
  }
  return closed;
}

/* A gradient if only the gaps are violated, and the remaining budget. */
static void take_one_gradient(const double unit[]) {
  make_task(LM_TASK_SLSQP, lm_slope_charge(&problem) + 1);
  memcpy(task.unit, unit, sizeof task.unit);
  run();
  check_answer();
}

/* SLSQP goes slightly beyond the gaps: its points are designs after these are closed. */
TEST(test_gradients_look_at_points_that_interfere_with_their_gaps_closed) {
  static const char without_shift[] =
      "rated_torque_Nm 40\nobjective lost_motion\n"
      "fixed planar_only 1\nfixed generator.type discs\nfixed teeth.module_mm 0.25\n"
      "fixed teeth.flexspline_teeth 200\nfixed teeth.face_width_mm 10\n"
      "fixed teeth.flexspline_shift 3\nfixed teeth.shift_difference -0.1\n"
      "range generator.deflection_modules 0.94 0.96\n";
  /* reference drive A, whose flanks are 0.07 arcmin apart, 0.2 closer */
  static const double apart[LM_FREE_MAX] = {0.5, 0.4283, 0.4118, 0.6154};
  lm_spec_error error = {0, ""};
  double unit[LM_FREE_MAX];
  memcpy(unit, apart, sizeof unit);
  read_with("fixed generator.type discs\nlimit safety_factor_min 0.5\n", "objective lost_motion\n",
            "");
  TEST_ASSERT_EQUAL_INT(1, lm_open_gap(&problem, 0, -0.2, unit));
  take_one_gradient(unit);
  TEST_ASSERT_TRUE(answer->violation <= 0);
  TEST_ASSERT_GREATER_THAN_INT(0, answer->solution_count);
  TEST_ASSERT_EQUAL_INT(answer->solution_count, count_closed());
  /* no range of this spec closes them, so the point is not examined again */
  TEST_ASSERT_EQUAL_INT_MESSAGE(LM_OK, lm_read_spec(without_shift, &problem, &error), error.text);
  unit[0] = 0.5;
  take_one_gradient(unit);
  TEST_ASSERT_TRUE(answer->violation > 0);
  TEST_ASSERT_EQUAL_INT(0, answer->solution_count);
}

/* SLSQP evaluates a point that violates its gaps with these closed, if that may be a gain. A
 * constant cost is the same at the first design as anywhere, and the tolerance-only
 * evaluations end. */
TEST(test_gaps_are_closed_only_where_that_may_gain) {
  static const char *const objectives[] = {"objective lost_motion\n", "objective cost\n"};
  int i;
  for (i = 0; i < 2; i++) {
    read_with("fixed generator.type discs\n", objectives[i], "");
    make_task(LM_TASK_SLSQP, 400);
    task.unit[1] = 0.2;
    run();
    check_answer();
    TEST_ASSERT_TRUE(answer->violation <= 0);
    TEST_ASSERT_GREATER_THAN_INT(1, answer->slopes);
    TEST_ASSERT_TRUE(i == 0 ? answer->plain > 1 : answer->plain == 1);
  }
}

/* One objective bounded at a level: the bound counts as a limit, with gradients and without. */
TEST(test_a_bound_of_the_aim_is_kept) {
  static const int kinds[] = {LM_TASK_SLSQP, LM_TASK_COBYLA, LM_TASK_ISRES};
  int i;
  read_with("fixed generator.type discs\n", two_objectives, two_grades);
  for (i = 0; i < 3; i++) {
    make_task(kinds[i], i == 2 ? 1500 : 600);
    task.scalar.most[1] = 12;
    run();
    check_answer();
    TEST_ASSERT_EQUAL_INT(1, answer->computed);
    TEST_ASSERT_TRUE(answer->violation < 0.05);
    TEST_ASSERT_TRUE(answer->figure[LM_FIGURE_COST] < 12.5);
  }
}

/* Specs without a trade-off of tolerances against cost, and with one by a limit on cost. */
TEST(test_a_population_keeps_its_size) {
  static const char *const objectives[] = {"objective lost_motion\nlimit cost_max 20\n",
                                           "objective lost_motion\nobjective stress\n",
                                           "objective cost\n"};
  int i;
  for (i = 0; i < 3; i++) {
    read_with("choose generator.type discs rollers\n", objectives[i], i < 2 ? two_grades : "");
    make_task(LM_TASK_EVOLVE, 150);
    run();
    check_answer();
    TEST_ASSERT_EQUAL_INT(LM_PARENT_MAX, answer->member_count);
    TEST_ASSERT_TRUE(lm_charge_of(&problem, answer) >= 150);
    TEST_ASSERT_TRUE(lm_charge_of(&problem, answer) <= 152);
  }
  /* too few evaluations for a whole population */
  make_task(LM_TASK_EVOLVE, 5);
  run();
  TEST_ASSERT_TRUE(answer->member_count > 1 && answer->member_count <= 5);
}

/* Tolerances have a cost, and no side clearance depends on them. A tolerance-only evaluation
 * reports the same as a whole evaluation of the point. */
TEST(test_tolerances_are_looked_at_by_themselves_where_they_are_weighed) {
  static const char corner[] =
      "objective lost_motion\nobjective cost\n"
      "limit gap_at_worst_corner 1\n";
  static const char free_of_cost[] = "objective tolerance_lost_motion\nobjective stress\n";
  lm_scan scan;
  lm_layout layout;
  double result[LM_RESULT_MAX];
  int i;
  read_with("choose generator.type discs rollers\n", two_objectives, two_grades);
  make_task(LM_TASK_EVOLVE, 400);
  run();
  check_answer();
  TEST_ASSERT_GREATER_THAN_INT(answer->feasible, answer->tolerance_only);
  TEST_ASSERT_GREATER_THAN_INT(20, answer->solution_count);
  lm_default_scan(&scan);
  lm_lay_out(&problem, &scan, &layout);
  for (i = 0; i < answer->solution_count + answer->member_count; i++) {
    const lm_solution *found = &answer->solution[i];
    const lm_status status = lm_evaluate_point(&problem, &scan, &layout, found->combination,
                                               found->unit, result, workspace, NULL);
    if (status == LM_OK) {
      double objective[LM_OBJECTIVE_MAX] = {0};
      lm_solution again;
      objective[0] = lm_figure_of(&layout, result, problem.objective[0]);
      objective[1] = lm_figure_of(&layout, result, problem.objective[1]);
      lm_fill_solution(&problem, &again, found->combination, found->unit, objective,
                       found->violation);
      TEST_ASSERT_EQUAL_MEMORY(&again, found, sizeof again);
      TEST_ASSERT_TRUE((lm_violation_of(&problem, &layout, result) <= 0) ==
                       (found->violation <= 0));
    } else {
      TEST_ASSERT_TRUE(i >= answer->solution_count && found->violation > 0);
    }
  }
  read_with("choose generator.type discs rollers\n", corner, two_grades);
  make_task(LM_TASK_EVOLVE, 400);
  run();
  TEST_ASSERT_EQUAL_INT(0, answer->tolerance_only);
  read_with("choose generator.type discs rollers\n", free_of_cost, two_grades);
  run();
  TEST_ASSERT_EQUAL_INT(0, answer->tolerance_only);
}

/* Members whose variables before the grades are those of a parent, except the shift that closes the
 * gap, and whose grades are different. */
static int count_grafted(int teeth) {
  int grafted = 0;
  int i;
  for (i = 0; i < answer->member_count; i++) {
    const double *unit = answer->solution[answer->solution_count + i].unit;
    int parent;
    for (parent = 0; parent < LM_PARENT_MAX; parent++) {
      const double *other = task.parent[parent].unit;
      int k = 0;
      while (k < teeth && (k == 1 || unit[k] == other[k])) {
        k++;
      }
      grafted += k == teeth && (unit[k] != other[k] || unit[k + 1] != other[k + 1]);
    }
  }
  return grafted;
}

/* If they are not cheaper, tolerances alone are changed the less often, the more other variables
 * there are. The parents violate limits, so that each child has a place. */
TEST(test_tolerances_alone_change_by_their_share_of_the_variables) {
  static const char *const more[] = {
      "limit gap_at_worst_corner 1\n",
      "limit gap_at_worst_corner 1\n"
      "range teeth.tooth_height 1.4 2\nrange teeth.engagement_depth 0.9 1.3\n"
      "range teeth.pressure_angle_deg 20 25\nrange flexspline.rim_thickness_mm 0.45 0.8\n"
      "range flexspline.wall_thickness_mm 0.3 0.6\nrange flexspline.length_mm 20 30\n"
      "range teeth.root_clearance 0.25 0.4\nrange material.poisson_ratio 0.28 0.32\n"};
  int grafted[2] = {0, 0};
  int i;
  for (i = 0; i < 2; i++) {
    int parent;
    int k;
    read_with(more[i], two_objectives, two_grades);
    make_task(LM_TASK_EVOLVE, 60);
    task.parent_count = LM_PARENT_MAX;
    for (parent = 0; parent < LM_PARENT_MAX; parent++) {
      task.parent[parent].violation = 1e4;
      for (k = 0; k < problem.range_count; k++) {
        task.parent[parent].unit[k] = fmod(0.618034 * (parent + 1) * (k + 1), 1);
      }
    }
    for (task.seed = 0; task.seed < 10; task.seed++) {
      run();
      grafted[i] += count_grafted(problem.range_count - 2);
    }
  }
  TEST_ASSERT_GREATER_THAN_INT(0, grafted[1]);
  TEST_ASSERT_LESS_THAN_INT(2 * grafted[0], 3 * grafted[1]);
}

/* Beside parents that no closed gap can reach, none is closed. */
TEST(test_a_second_look_goes_where_it_may_gain) {
  int i;
  int k;
  read_with("choose generator.type discs rollers\n", "objective lost_motion\nobjective cost\n",
            two_grades);
  make_task(LM_TASK_EVOLVE, 400);
  run();
  check_answer();
  TEST_ASSERT_GREATER_THAN_INT(0, count_closed());
  task.parent_count = LM_PARENT_MAX;
  for (i = 0; i < LM_PARENT_MAX; i++) {
    task.parent[i].objective[0] = -1e3;
    for (k = 0; k < problem.range_count; k++) {
      task.parent[i].unit[k] = fmod(0.618034 * (i + 1) * (k + 1), 1);
    }
  }
  run();
  TEST_ASSERT_GREATER_THAN_INT(0, answer->solution_count);
  TEST_ASSERT_EQUAL_INT(0, count_closed());
}

/* A limit that depends on no variable is no obstacle, although no solver can move off it.
 */
TEST(test_a_limit_that_nothing_moves_hinders_nobody) {
  static const char fits[] =
      "link 0.5 48 0.5 0 1 normal generator\nfixed tolerance.0.grade 7\nlevel worst\n";
  double free_value;
  read_with("fixed generator.type discs\n", "objective lost_motion\n", fits);
  make_task(LM_TASK_SLSQP, 2400);
  run();
  TEST_ASSERT_TRUE(answer->violation <= 0);
  free_value = answer->value;
  read_with("fixed generator.type discs\nlimit interference_max_mm 0\n", "objective lost_motion\n",
            fits);
  make_task(LM_TASK_SLSQP, 2400);
  run();
  TEST_ASSERT_TRUE(answer->violation <= 0);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6 * free_value, free_value, answer->value);
}

TEST(test_a_settled_design_has_whole_grades_and_certifies) {
  lm_certificate *certificate = (lm_certificate *)malloc(sizeof *certificate);
  read_with("fixed generator.type discs\n", two_objectives, two_grades);
  make_task(LM_TASK_VERIFY, 2400);
  run();
  check_answer();
  TEST_ASSERT_EQUAL_INT(1, answer->solution_count);
  TEST_ASSERT_EQUAL_INT(1, answer->solution[0].verified);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, floor(4 * answer->solution[0].unit[4] + 0.5),
                            4 * answer->solution[0].unit[4]);
  TEST_ASSERT_EQUAL_INT(
      LM_OK, lm_certify(&problem, 0, answer->solution[0].unit, certificate, workspace, NULL));
  TEST_ASSERT_EQUAL_INT(1, certificate->holds);
  free(certificate);
}

/* A limit of a figure that binds at the phases of the search is broken between them: the
 * verification has to move off it, and the figures stay those of the search's phases. */
TEST(test_a_settled_design_keeps_its_figures_limits_between_the_phases) {
  static const char *const limits[] = {"limit tolerance_lost_motion_max_arcmin 2.5\n",
                                       "limit stiffness_min_Nm_per_rad 29800\n",
                                       "limit kinematic_error_max_arcsec 0.3\n"};
  lm_certificate *certificate = (lm_certificate *)malloc(sizeof *certificate);
  int i;
  for (i = 0; i < 3; i++) {
    read_with("fixed generator.type discs\nobjective cost\n",
              "range tolerance.0.grade 5 9\nrange tolerance.1.grade 5 9\n", limits[i]);
    make_task(LM_TASK_VERIFY, 2400);
    run();
    check_answer();
    TEST_ASSERT_EQUAL_INT_MESSAGE(1, answer->solution_count, limits[i]);
    TEST_ASSERT_EQUAL_INT(
        LM_OK, lm_certify(&problem, 0, answer->solution[0].unit, certificate, workspace, NULL));
    TEST_ASSERT_EQUAL_INT_MESSAGE(1, certificate->holds, limits[i]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, certificate->search_figure[LM_FIGURE_COST],
                              answer->solution[0].objective[0]);
  }
  free(certificate);
}

/* Three roundings of two grades; only the first is a complete evaluation. */
TEST(test_roundings_have_the_figures_of_complete_evaluations) {
  lm_solution found[3];
  int count;
  int i;
  int j;
  read_with(two_objectives, two_grades, "");
  make_task(LM_TASK_ROUND, 10);
  task.unit[4] = 0.4; /* grades of 6.6 and 7.4 */
  task.unit[5] = 0.6;
  run();
  TEST_ASSERT_EQUAL_INT(1, answer->plain);
  TEST_ASSERT_EQUAL_INT(2, answer->tolerance_only);
  count = answer->solution_count;
  TEST_ASSERT_GREATER_OR_EQUAL_INT(2, count); /* the coarser is cheaper, the finer is better */
  memcpy(found, answer->solution, (size_t)count * sizeof found[0]);
  for (i = 0; i < count; i++) {
    make_task(LM_TASK_EVALUATE, 10);
    memcpy(task.unit, found[i].unit, sizeof task.unit);
    run();
    for (j = 0; j < problem.objective_count; j++) {
      const double whole = answer->figure[problem.objective[j]];
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, whole, found[i].objective[j]); /* rounded so when kept */
    }
  }
}

/* Between 5.5 and 8.5 the whole grades are 6 .. 8, though 5 and 9 are neighbours of the ends. */
TEST(test_a_grade_is_not_rounded_out_of_its_range) {
  double grade;
  read_with("fixed generator.type discs\n", "objective tolerance_lost_motion\n",
            "whole tolerance.0.grade 5.5 8.5\n");
  make_task(LM_TASK_VERIFY, 2400);
  run();
  TEST_ASSERT_EQUAL_INT(1, answer->solution_count);
  grade = 5.5 + 3 * answer->solution[0].unit[4];
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 6, grade); /* no reason against the finest one */
  read_with("fixed generator.type discs\n", "objective cost\n",
            "whole tolerance.0.grade 5.5 8.5\n");
  make_task(LM_TASK_VERIFY, 2400);
  run();
  TEST_ASSERT_EQUAL_INT(1, answer->solution_count);
  grade = 5.5 + 3 * answer->solution[0].unit[4];
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 8, grade);
}

TEST(test_what_cannot_be_kept_is_not_settled) {
  read_with("fixed generator.type discs\n", two_objectives, "limit safety_factor_min 9\n");
  make_task(LM_TASK_VERIFY, 2400);
  run();
  TEST_ASSERT_EQUAL_INT(0, answer->solution_count);
  TEST_ASSERT_EQUAL_INT(1, answer->computed);
  TEST_ASSERT_TRUE(answer->violation > 0);
  /* not a drive: a ring with internal deformation */
  read_with("fixed generator.type ring\n", two_objectives, two_grades);
  make_task(LM_TASK_VERIFY, 2400);
  run();
  TEST_ASSERT_EQUAL_INT(0, answer->computed);
  TEST_ASSERT_EQUAL_INT(answer->plain + answer->slopes, answer->refused);
}

/* From a start that violates limits comes a design that violates none, whatever its value, and then
 * a better one. */
TEST(test_a_repair_finds_a_design_and_makes_it_better) {
  static const char limits[] = "limit tolerance_lost_motion_max_arcmin 2.5\n";
  double first;
  read_with("fixed generator.type discs\nobjective cost\n", two_grades, limits);
  make_task(LM_TASK_EVALUATE, 1);
  task.unit[4] = 1;
  task.unit[5] = 1;
  run();
  TEST_ASSERT_EQUAL_INT(0, answer->solution_count);
  make_task(LM_TASK_REPAIR, 4000);
  task.unit[4] = 1;
  task.unit[5] = 1;
  run();
  check_answer();
  TEST_ASSERT_GREATER_THAN_INT(0, answer->solution_count);
  TEST_ASSERT_TRUE(answer->violation <= 0);
  /* no worse than from a design that is known */
  first = answer->value;
  make_task(LM_TASK_SLSQP, 4000);
  task.unit[4] = 0;
  task.unit[5] = 0;
  run();
  TEST_ASSERT_TRUE(answer->violation <= 0);
  TEST_ASSERT_DOUBLE_WITHIN(0.02 * answer->value, answer->value, first);
}

/* Limits that cannot be met end at whole grades of the range, with the values of all limits. */
TEST(test_a_repair_without_a_design_says_what_has_to_give) {
  double relax[LM_LIMIT_COUNT];
  double sum = 0;
  int limit;
  read_with("fixed generator.type discs\nobjective cost\n", "whole tolerance.0.grade 5.5 8.5\n",
            "limit tolerance_lost_motion_max_arcmin 0.2\nlimit cost_max 5\n");
  make_task(LM_TASK_REPAIR, 4000);
  run();
  check_answer();
  TEST_ASSERT_EQUAL_INT(0, answer->solution_count);
  TEST_ASSERT_TRUE(answer->computed && answer->violation > 0);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.5, fmod(3 * answer->unit[4], 1.0));
  TEST_ASSERT_EQUAL_INT(
      LM_OK, lm_explain_infeasible(&problem, 0, answer->unit, 4000, relax, workspace, NULL));
  for (limit = 0; limit < LM_LIMIT_COUNT; limit++) {
    sum += log1p(relax[limit]);
  }
  TEST_ASSERT_DOUBLE_WITHIN(0.05 * sum, sum, answer->value);
}

/* Limits of the worst corner are not those of the nominal drive between the angles. */
TEST(test_gaps_of_the_worst_corner_settle_on_the_scan) {
  read_with("fixed generator.type discs\nlevel worst\n", two_objectives,
            "limit gap_at_worst_corner 1\n");
  make_task(LM_TASK_VERIFY, 2400);
  run();
  check_answer();
  TEST_ASSERT_EQUAL_INT(1, answer->solution_count);
}

/* A third of the evaluations returns NaN: every method continues. */
TEST(test_every_kind_lives_with_nan) {
  int kind;
  read_with("fixed generator.type discs\n", two_objectives, "damaged_share 0.33\n");
  for (kind = LM_TASK_SCREEN; kind <= LM_TASK_VERIFY; kind++) {
    make_task(kind, 400);
    run();
    check_answer();
    TEST_ASSERT_GREATER_THAN_INT(0, answer->plain + answer->slopes);
  }
  problem.damaged_share = 1;
  for (kind = LM_TASK_SCREEN; kind <= LM_TASK_VERIFY; kind++) {
    make_task(kind, 100);
    run();
    TEST_ASSERT_EQUAL_INT(answer->plain + answer->slopes, answer->refused);
    TEST_ASSERT_EQUAL_INT(0, answer->solution_count);
  }
}

/* If both neighbours of a grade are refused there is no design, but the task still has its answer:
 * a search waits for it. */
TEST(test_a_settling_without_any_whole_grade_answers_its_task) {
  int lost = 0;
  int start;
  read_with("choose generator.type discs rollers\n", two_objectives, two_grades);
  problem.damaged_share = 0.7;
  for (start = 0; start < 60; start++) {
    make_task(LM_TASK_VERIFY, 2400);
    task.combination = 1;
    task.unit[0] = 0.3 + 0.005 * start;
    run();
    check_answer();
    lost += !answer->computed && answer->refused < answer->plain + answer->slopes;
  }
  TEST_ASSERT_GREATER_THAN_INT(2, lost);
}

TEST(test_every_kind_stops) {
  const volatile int stop = 1;
  int kind;
  read_with("fixed generator.type discs\n", two_objectives, two_grades);
  for (kind = LM_TASK_SCREEN; kind <= LM_TASK_VERIFY; kind++) {
    make_task(kind, 400);
    TEST_ASSERT_EQUAL_INT(LM_NOT_CONVERGED, lm_run_task(&problem, &task, answer, workspace, &stop));
    TEST_ASSERT_LESS_OR_EQUAL_INT(4, answer->plain + answer->slopes);
  }
}

TEST(test_nothing_is_refused) {
  double relax[LM_LIMIT_COUNT];
  double unit[LM_FREE_MAX] = {0.5, 0.5, 0.5, 0.5};
  const volatile int stop = 1;
  read_with("fixed generator.type discs\n", two_objectives, "");
  make_task(LM_TASK_SCREEN, 10);
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_run_task(NULL, &task, answer, workspace, NULL));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_run_task(&problem, NULL, answer, workspace, NULL));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_run_task(&problem, &task, NULL, workspace, NULL));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_run_task(&problem, &task, answer, NULL, NULL));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_explain_infeasible(NULL, 0, unit, 100, relax, workspace, NULL));
  TEST_ASSERT_EQUAL_INT(LM_NULL,
                        lm_explain_infeasible(&problem, 0, NULL, 100, relax, workspace, NULL));
  TEST_ASSERT_EQUAL_INT(LM_NULL,
                        lm_explain_infeasible(&problem, 0, unit, 100, NULL, workspace, NULL));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_explain_infeasible(&problem, 0, unit, 100, relax, NULL, NULL));
  TEST_ASSERT_EQUAL_INT(LM_NOT_CONVERGED,
                        lm_explain_infeasible(&problem, 0, unit, 100, relax, workspace, &stop));
}

/* Two limits that no drive meets together, and how far each must be relaxed. */
TEST(test_what_must_give_is_found_from_any_start) {
  double relax[LM_LIMIT_COUNT];
  double unit[LM_FREE_MAX] = {0.5, 0.5, 0.5, 0.5, 1, 1};
  const volatile int stop = 1;
  int limit;
  int giving = 0;
  read_with("fixed generator.type discs\n", two_objectives,
            "limit tolerance_lost_motion_max_arcmin 0.2\nlimit gap_min_arcmin 0.1\n");
  TEST_ASSERT_EQUAL_INT(LM_OK,
                        lm_explain_infeasible(&problem, 0, unit, 4000, relax, workspace, NULL));
  for (limit = 0; limit < LM_LIMIT_COUNT; limit++) {
    TEST_ASSERT_TRUE(relax[limit] >= 0);
    giving += relax[limit] > LM_RESERVE;
  }
  TEST_ASSERT_GREATER_THAN_INT(0, giving);
  TEST_ASSERT_TRUE(relax[(int)LM_LIMIT_FIGURE + (int)LM_FIGURE_TOLERANCE_LOST_MOTION] > 0.1);
  /* part of the way is refused, as evaluations fail */
  problem.damaged_share = 0.4;
  for (limit = 0; limit < 20; limit++) {
    unit[0] = 0.3 + 0.02 * limit;
    (void)lm_explain_infeasible(&problem, 0, unit, 200, relax, workspace, NULL);
  }
  problem.damaged_share = 1;
  TEST_ASSERT_EQUAL_INT(LM_NOT_CONVERGED,
                        lm_explain_infeasible(&problem, 0, unit, 100, relax, workspace, &stop));
  TEST_ASSERT_EQUAL_INT(LM_OUT_OF_RANGE,
                        lm_explain_infeasible(&problem, 0, unit, 100, relax, workspace, NULL));
}

/* --- known results --- */

static lm_drive drive_at(double shift, double grade) {
  lm_drive drive;
  memset(&drive, 0, sizeof drive);
  make_task(LM_TASK_CONFIRM, 2);
  task.unit[0] = shift;
  task.unit[4] = grade;
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_point_drive(&problem, 0, task.unit, &drive, NULL));
  return drive;
}

/* Meshes are made for an evaluation alone. */
TEST(test_a_gap_is_evaluated_once_for_designs_that_differ_in_their_tolerances) {
  lm_known_results known;
  lm_mesh *meshes = workspace->design.face;
  lm_smallest_gap first;
  lm_smallest_gap found;
  lm_smallest_gap exact;
  lm_drive drive;
  TEST_ASSERT_TRUE(lm_open_known_results(&known));
  read_with("fixed generator.type discs\n", two_objectives, two_grades);
  drive = drive_at(0.5, 0);
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_find_known_gap(&known, &drive, meshes, &first));
  memset(meshes, 0x55, sizeof *meshes);
  drive = drive_at(0.5, 1);
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_find_known_gap(&known, &drive, meshes, &found));
  TEST_ASSERT_EACH_EQUAL_HEX8(0x55, meshes, sizeof *meshes);
  TEST_ASSERT_EQUAL_MEMORY(&first, &found, sizeof found);
  drive = drive_at(0.6, 1);
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_find_known_gap(&known, &drive, meshes, &found));
  TEST_ASSERT_EQUAL_INT(
      LM_OK, lm_find_face_gap(&drive, LM_CERTAIN_NODES, LM_CERTAIN_STEPS, meshes, &exact, NULL));
  TEST_ASSERT_TRUE(found.gap_rad == exact.gap_rad && found.angle_rad == exact.angle_rad);
  TEST_ASSERT_TRUE(found.gap_rad != first.gap_rad);
  memset(meshes, 0x55, sizeof *meshes);
  drive = drive_at(0.5, 0.5);
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_find_known_gap(&workspace->known, &drive, meshes, &found));
  TEST_ASSERT_TRUE(found.gap_rad == first.gap_rad);
  TEST_ASSERT_TRUE(meshes->geometry.module_mm == 0.25); /* evaluated: nothing is known */
  lm_close_known_results(&known);
}

TEST(test_a_known_point_has_the_bytes_of_its_evaluation) {
  static double first[LM_RESULT_MAX];
  static double found[LM_RESULT_MAX];
  const size_t size = (size_t)LM_RESULT_MAX * sizeof found[0];
  lm_known_results known;
  lm_layout layout;
  lm_scan scan;
  TEST_ASSERT_TRUE(lm_open_known_results(&known));
  read_with("fixed generator.type discs\n", two_objectives, two_grades);
  lm_default_scan(&scan);
  lm_lay_out(&problem, &scan, &layout);
  make_task(LM_TASK_CONFIRM, 2);
  workspace->known = known;
  TEST_ASSERT_EQUAL_INT(
      LM_OK, lm_find_known_result(&problem, &scan, &layout, 0, task.unit, first, workspace));
  problem.torque_Nm *= 2; /* an evaluation would have another result */
  TEST_ASSERT_EQUAL_INT(
      LM_OK, lm_find_known_result(&problem, &scan, &layout, 0, task.unit, found, workspace));
  TEST_ASSERT_EQUAL_MEMORY(first, found, size);
  task.unit[0] += 0.125;
  TEST_ASSERT_EQUAL_INT(
      LM_OK, lm_find_known_result(&problem, &scan, &layout, 0, task.unit, found, workspace));
  TEST_ASSERT_TRUE(memcmp(first, found, size) != 0);
  workspace->known.points = NULL;
  workspace->known.gaps = NULL;
  lm_close_known_results(&known);
}

TEST(test_a_memo_keeps_the_latest_results) {
  const char *const word[] = {"ab", "cd", "ef"};
  lm_memo *memo = lm_create_memo(2, sizeof(int), 2);
  int value;
  int i;
  TEST_ASSERT_NOT_NULL(memo);
  for (i = 0; i < 3; i++) {
    TEST_ASSERT_EQUAL_INT(0, lm_recall(memo, word[i], &value));
    lm_memorise(memo, word[i], &i);
  }
  TEST_ASSERT_EQUAL_INT(0, lm_recall(memo, word[0], &value));
  for (i = 1; i < 3; i++) {
    TEST_ASSERT_EQUAL_INT(1, lm_recall(memo, word[i], &value));
    TEST_ASSERT_EQUAL_INT(i, value);
  }
  lm_memorise(NULL, word[0], &value);
  TEST_ASSERT_EQUAL_INT(0, lm_recall(NULL, word[0], &value));
  lm_free_memo(memo);
  lm_free_memo(NULL);
}

/* --- the pool --- */

static int answers;

static void count_answer(void *context, const lm_answer *done) {
  (void)context;
  (void)done;
  answers++;
}

TEST(test_a_pool_needs_a_number_of_workers_that_it_has_room_for) {
  lm_pool *pool;
  TEST_ASSERT_NULL(lm_open_pool(-1));
  TEST_ASSERT_NULL(lm_open_pool(LM_WORKERS_MAX + 1));
  lm_close_pool(NULL);
  read_with("fixed generator.type discs\n", two_objectives, "");
  make_task(LM_TASK_SCREEN, 2);
  pool = lm_open_pool(2);
  answers = 0;
  TEST_ASSERT_EQUAL_INT(LM_OK,
                        lm_run_tasks(pool, &problem, &task, 1, NULL, count_answer, NULL, NULL));
  TEST_ASSERT_EQUAL_INT(1, answers);
  lm_close_pool(pool);
}
