/* Dual numbers (optimizer/dual.h) against complex steps (complex_number.h) on the whole model. */
#include <stdlib.h>
#include <string.h>

#include "points.h"
#include "reference_drives.h"
#include "test.h"
#include "workspace.h"

/* The same evaluation in the oracle's number type. */
size_t lm_complex_workspace_size(void);
int lm_complex_evaluate(const lm_problem *problem, const lm_scan *scan, const lm_layout *layout,
                        int combination, const double unit[], double result[], double slope[],
                        void *workspace, const char **input);

/* Results are of order 1 to 100 (arcmin, arcsec, shares); an angle of 15 arcmin known to 1e-13
 * gives a kinematic error known to 1e-10 arcsec. A corner where two zones cross at a small angle
 * amplifies it: 1.03e-9 in the worst of 1,000 designs. */
#define VALUE_BOUND 2e-9

static lm_problem problem;
static lm_scan scan;
static lm_layout layout;
static lm_workspace *workspace;
static void *oracle;
static double dual_result[LM_RESULT_MAX];
static double dual_slope[LM_RESULT_MAX * LM_FREE_MAX];
static double oracle_result[LM_RESULT_MAX];
static double oracle_slope[LM_RESULT_MAX * LM_FREE_MAX];
static double neighbour_slope[LM_RESULT_MAX * LM_FREE_MAX]; /* of the oracle beside the point */

void setUp(void) {
  workspace = lm_create_workspace();
  oracle = malloc(lm_complex_workspace_size());
  TEST_ASSERT_NOT_NULL(workspace);
  TEST_ASSERT_NOT_NULL(oracle);
}

void tearDown(void) {
  lm_free_workspace(workspace);
  free(oracle);
}

static void add_range(int key, double low, double high) {
  lm_range *range = &problem.range[problem.range_count++];
  range->key = key;
  range->whole = 0;
  range->low = low;
  range->high = high;
}

static void add_link(double influence, double position, int distribution, int zone) {
  lm_graded_link *link = &problem.link[problem.link_count];
  link->influence = influence;
  link->position = position;
  link->distribution = distribution;
  link->zone = zone;
  add_range(LM_KEY_GRADE + problem.link_count, 5, 9);
  problem.link_count++;
}

/* A joint of size 20. */
static void start_joint(lm_generator_type type) {
  lm_start_problem(&problem);
  problem.rated_torque_Nm = 40;
  problem.value[LM_KEY_MODULE_MM] = 0.25;
  problem.value[LM_KEY_FACE_WIDTH_MM] = 10;
  problem.value[LM_KEY_GENERATOR_TYPE] = type;
  problem.value[LM_KEY_DEFORMATION] = type == LM_RING ? 1 : 0;
  problem.value[LM_KEY_FLEXSPLINE_TEETH] = type == LM_RING ? 202 : 200;
  problem.value[LM_KEY_AXIAL_SECTIONS] = 2;
  problem.phases = 3;
  problem.objective_count = 1;
}

static void lay_out_joint(void) {
  lm_fault fault;
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_prepare_problem(&problem, &fault));
  lm_default_scan(&scan);
  lm_lay_out(&problem, &scan, &layout);
}

/* One in which everything that can vary varies: 15 ranges, so two passes of dual numbers. */
static void start(lm_generator_type type) {
  start_joint(type);
  problem.value[LM_KEY_CAM_OFFSET_MM] = type == LM_ELLIPSE ? 2 : 0;
  problem.bounds.gap_at_worst_corner = 1;
  problem.bounds.outer_diameter_max_mm = 70;
  problem.bounds.interference_max_mm = 0.005;
  add_range(LM_KEY_FLEXSPLINE_SHIFT, 2.5, 4);
  add_range(LM_KEY_SHIFT_DIFFERENCE, -0.05, 0.15);
  add_range(LM_KEY_DEFLECTION_MODULES, 0.9, 1.1);
  add_range(LM_KEY_CONTACT_HALF_ANGLE_DEG, 20, 34);
  add_range(LM_KEY_TOOTH_HEIGHT, 1.6, 1.9);
  add_range(LM_KEY_ENGAGEMENT_DEPTH, 1.0, 1.3);
  add_range(LM_KEY_RIM_THICKNESS_MM, 0.5, 0.8);
  add_range(LM_KEY_WALL_THICKNESS_MM, 0.25, 0.4);
  add_range(LM_KEY_FACE_WIDTH_MM, 8, 12);
  add_range(LM_KEY_PRESSURE_ANGLE_DEG, 19, 22);
  add_range(LM_KEY_FRICTION_ANGLE_DEG, 2, 6);
  add_link(0.5, 0.5, LM_NORMAL, LM_GENERATOR_GAP);
  add_link(-0.5, -0.5, LM_UNIFORM, LM_GENERATOR_GAP);
  add_link(1.37, 0.25, LM_TRIANGULAR, LM_TEETH_GAP);
  add_link(1.37, 0.0, LM_NORMAL_INSPECTED, LM_TEETH_GAP);
  lay_out_joint();
}

/* The same joint with a flexspline of double arcs or S teeth, whose every dimension varies, and the
 * circular spline (ring: the rigid gear inside) that it generates. */
static void start_flank(lm_flank_kind kind, lm_generator_type type) {
  start_joint(type);
  problem.value[LM_KEY_FLEXSPLINE_FLANK] = kind;
  problem.value[LM_KEY_RIGID_FLANK] = LM_FLANK_CONJUGATE;
  problem.value[LM_KEY_RACK_ADDENDUM] = 0.6;
  problem.value[LM_KEY_ROOT_CLEARANCE] = 0.15;
  problem.value[LM_KEY_RIGID_SHIFT] = 0;
  add_range(LM_KEY_FLEXSPLINE_SHIFT, -0.1, 0.3);
  add_range(LM_KEY_DEFLECTION_MODULES, 0.9, 1.1);
  add_range(LM_KEY_TOOTH_HEIGHT, 1.2, 1.4);
  add_range(LM_KEY_ENGAGEMENT_DEPTH, 0.8, 1.0);
  add_range(LM_KEY_RIM_THICKNESS_MM, 0.5, 0.7);
  add_range(LM_KEY_BACKLASH_MM, 0, 0.01);
  add_range(LM_KEY_TIP_RELIEF_MM, 0.001, 0.005);
  add_range(LM_KEY_FRICTION_ANGLE_DEG, 2, 6);
  if (type == LM_DISCS || type == LM_ROLLERS || type == LM_RING) {
    add_range(LM_KEY_CONTACT_HALF_ANGLE_DEG, 20, 32);
  }
  if (kind == LM_FLANK_S_TOOTH) {
    add_range(LM_KEY_KAPPA, 0.8, 0.98);
    add_range(LM_KEY_X_M, -0.1, 0.05);
    add_range(LM_KEY_S_M, 1.35, 1.55);
  } else {
    add_range(LM_KEY_RHO_A, 1.2, 2.0);
    add_range(LM_KEY_X_A, 0.0, 0.3);
    add_range(LM_KEY_L_A, 0.6, 1.3);
    add_range(LM_KEY_RHO_F, 1.1, 1.8);
    add_range(LM_KEY_DELTA_L_DEG, 9, 16);
    add_range(LM_KEY_H_L, 0.1, 0.3);
  }
  lay_out_joint();
}

/* Sum of squares of the oracle's derivatives, of the differences to them, and of their change
 * between two points that differ by rounding. */
typedef struct norm {
  double size;
  double difference;
  double scatter;
} norm;

static void add_results(norm *sum, int first, int count, double weight) {
  int i;
  for (i = first * problem.range_count; i < (first + count) * problem.range_count; i++) {
    const double size = weight * oracle_slope[i];
    const double difference = weight * (dual_slope[i] - oracle_slope[i]);
    const double scatter = weight * (neighbour_slope[i] - oracle_slope[i]);
    sum->size += size * size;
    sum->difference += difference * difference;
    sum->scatter += scatter * scatter;
  }
}

/* Largest relative difference to the complex step: ten times the rounding in the calculation of the
 * forces of the pairs. A generated flank has corners where two zones cross at a small angle, which
 * amplifies the rounding. */
#define SLOPE_BOUND 1e-11

#define FLANK_SLOPE_BOUND 1e-9

/* Where two flanks are nearly parallel, rounding moves the point where they touch, and no derivative
 * in this precision is more accurate than that: the oracle's own ones differ between points whose
 * variables differ in their last places. That is one sample of the rounding, so three times as much
 * is permitted. */
#define SCATTER_FACTOR 3
#define LAST_PLACES 4.4e-16

static double slope_bound;

static void check_norm(const norm *sum, const char *kind, const char *text) {
  const double relative = sum->size > 0 ? sqrt(sum->difference / sum->size) : sum->difference;
  const double scatter = sum->size > 0 ? sqrt(sum->scatter / sum->size) : 0;
  char message[160];
  snprintf(message, sizeof message, "%s, %s", kind, text);
  TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(slope_bound + SCATTER_FACTOR * scatter, 0, relative, message);
}

/* Every kind of result as one matrix of derivatives: output angles under load in arcmin, side
 * clearances in arcmin, and each other limit and figure by itself. */
static void compare_design(const char *text) {
  norm motion = {0, 0, 0};
  norm gaps = {0, 0, 0};
  int i;
  for (i = 0; i < layout.count; i++) {
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(VALUE_BOUND, oracle_result[i], dual_result[i], text);
  }
  for (i = 0; i < LM_FIGURE_COUNT; i++) {
    const int first = layout.figure_start[i];
    const int count = layout.figure_count[i];
    norm alone = {0, 0, 0};
    if (i == LM_FIGURE_STRESS || i == LM_FIGURE_COST) {
      add_results(&alone, first, count, 1);
      check_norm(&alone, lm_figure_name(i), text);
    } else if (i == LM_FIGURE_COMPLIANCE) {
      add_results(&motion, first, count, problem.rated_torque_Nm);
    } else {
      add_results(&motion, first, count, i == LM_FIGURE_KINEMATIC_ERROR ? 1.0 / 60 : 1);
    }
  }
  check_norm(&motion, "output angle", text);
  for (i = 0; i < LM_SINGLE_ROWS; i++) {
    norm alone = {0, 0, 0};
    add_results(&alone, layout.single_start + i, 1, 1);
    check_norm(&alone, lm_limit_name(i), text);
  }
  add_results(&gaps, layout.gap_start, layout.gap_count, 1);
  check_norm(&gaps, "side clearance", text);
}

/* The oracle's derivatives where every variable is changed by a few units in its last place; of
 * involutes no scatter is permitted. */
static void evaluate_neighbour(const double unit[]) {
  static double unused[LM_RESULT_MAX];
  double beside[LM_FREE_MAX];
  const char *input = "";
  int i;
  if (!(slope_bound > SLOPE_BOUND)) {
    memcpy(neighbour_slope, oracle_slope, sizeof neighbour_slope);
    return;
  }
  for (i = 0; i < problem.range_count; i++) {
    beside[i] = unit[i] * (1 + LAST_PLACES * (1 + i % 3));
  }
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_complex_evaluate(&problem, &scan, &layout, 0, beside, unused,
                                                   neighbour_slope, oracle, &input));
}

/* Random designs of every wave generator: 200, or the number in the program's argument. */
static int designs = 200;

/* The derivatives of every figure and limit agree to 1e-12. */
static void compare_drawn(uint32_t seed, int wanted) {
  int compared = 0;
  int draws = 0;
  while (compared < wanted && draws < 10 * wanted) {
    double unit[LM_FREE_MAX];
    char text[80];
    const char *input = "";
    int i;
    for (i = 0; i < problem.range_count; i++) {
      unit[i] = draw(&seed, 0, 1);
    }
    draws++;
    problem.level = draws % 3;
    problem.bounds.gap_at_worst_corner =
        draws % 2; /* 0: grades have their own, shorter calculation */
    if (lm_evaluate_slopes(&problem, &scan, &layout, 0, unit, dual_result, dual_slope, workspace,
                           NULL) == LM_OK) {
      TEST_ASSERT_EQUAL_INT(
          LM_OK, lm_complex_evaluate(&problem, &scan, &layout, 0, unit, oracle_result, oracle_slope,
                                     oracle, &input));
      evaluate_neighbour(unit);
      snprintf(text, sizeof text, "generator %d, design %d",
               (int)problem.value[LM_KEY_GENERATOR_TYPE], draws);
      compare_design(text);
      compared++;
    }
  }
  TEST_ASSERT_EQUAL_INT(wanted, compared);
}

static void compare(lm_generator_type type) {
  start(type);
  slope_bound = SLOPE_BOUND;
  compare_drawn(1000u + (uint32_t)type, designs);
}

static void compare_flank(lm_flank_kind kind, lm_generator_type type) {
  start_flank(kind, type);
  slope_bound = FLANK_SLOPE_BOUND;
  compare_drawn(2000u + 10u * (uint32_t)kind + (uint32_t)type, 1 + designs / 6);
}

TEST(test_cosine_cam) {
  compare(LM_COSINE);
}

TEST(test_elliptical_cam) {
  compare(LM_ELLIPSE);
}

TEST(test_two_discs) {
  compare(LM_DISCS);
}

TEST(test_four_rollers) {
  compare(LM_ROLLERS);
}

TEST(test_external_ring) {
  compare(LM_RING);
}

TEST(test_double_arcs_on_a_cosine_cam) {
  compare_flank(LM_FLANK_DOUBLE_ARC, LM_COSINE);
}

TEST(test_double_arcs_on_two_discs) {
  compare_flank(LM_FLANK_DOUBLE_ARC, LM_DISCS);
}

TEST(test_double_arcs_on_rollers) {
  compare_flank(LM_FLANK_DOUBLE_ARC, LM_ROLLERS);
}

TEST(test_double_arcs_in_a_ring) {
  compare_flank(LM_FLANK_DOUBLE_ARC, LM_RING);
}

TEST(test_s_teeth_in_a_ring) {
  compare_flank(LM_FLANK_S_TOOTH, LM_RING);
}

TEST(test_s_teeth_on_an_elliptical_cam) {
  compare_flank(LM_FLANK_S_TOOTH, LM_ELLIPSE);
}

TEST(test_s_teeth_on_two_discs) {
  compare_flank(LM_FLANK_S_TOOTH, LM_DISCS);
}

/* The values of a dual evaluation are those of the plain one to rounding: the search mixes them. */
TEST(test_values_are_those_of_the_plain_model) {
  uint32_t seed = 77;
  int n;
  start(LM_DISCS);
  for (n = 0; n < 50; n++) {
    double unit[LM_FREE_MAX];
    int i;
    for (i = 0; i < problem.range_count; i++) {
      unit[i] = draw(&seed, 0, 1);
    }
    if (lm_evaluate_slopes(&problem, &scan, &layout, 0, unit, dual_result, dual_slope, workspace,
                           NULL) != LM_OK) {
      continue;
    }
    TEST_ASSERT_EQUAL_INT(LM_OK, lm_evaluate_point(&problem, &scan, &layout, 0, unit, oracle_result,
                                                   workspace, NULL));
    for (i = 0; i < layout.count; i++) {
      TEST_ASSERT_DOUBLE_WITHIN(VALUE_BOUND, oracle_result[i], dual_result[i]);
    }
  }
}

int main(int count, char **argument) {
  if (count > 1) {
    designs = (int)strtol(argument[1], NULL, 10);
  }
  return run_tests();
}
