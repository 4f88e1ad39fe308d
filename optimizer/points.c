#include "points.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "archive.h"
#include "evaluate.h"
#include "lostmotion/tolerance.h"
#include "workspace.h"

#define DEGREE (3.14159265358979323846 / 180.0)
#define ARCMIN (DEGREE / 60.0)

/* Name of a key, its value if a spec does not state it, and its permitted range in a spec. A value
 * of 0 means the default of lm_complete_drive. */
typedef struct key_entry {
  const char *name; /* "" where a search cannot set it */
  int discrete;     /* 1: values between two integers have no meaning */
  double otherwise;
  double low;
  double high;
} key_entry;

/* A row of design_key_list.h as an entry: the range is the widest that any size of drive allows, in
 * the unit in which a search states the key. */
#define NAME_SAME(prefix, stem, suffix) prefix stem suffix
#define NAME_IN_DEG(prefix, stem, suffix) prefix stem "_deg"
#define NAME_IN_ARCMIN(prefix, stem, suffix) prefix stem "_arcmin"
#define NAME_FOLLOWS(prefix, stem, suffix) ""
#define PREFIX_teeth "teeth."
#define PREFIX_generator "generator."
#define PREFIX_flexspline "flexspline."
#define PREFIX_material "material."
#define PREFIX_support "support."
#define PREFIX_gap "gap."
#define PREFIX_flank "flank."
#define PREFIX_drive ""
#define DISCRETE_REAL 0
#define DISCRETE_COUNT 1
#define DISCRETE_SWITCH 1
#define DISCRETE_DEFORMATION 1
#define DISCRETE_GENERATOR 1
#define DISCRETE_FLANK 1
#define LEAST_DIAMETER_MM (LM_MODULE_LEAST_MM * LM_FLEXSPLINE_TEETH_MIN)
#define MOST_DIAMETER_MM (LM_MODULE_MOST_MM * LM_FLEXSPLINE_TEETH_MAX)
#define LEAST_ONE_SAME 1
#define MOST_ONE_SAME 1
#define LEAST_ONE_FOLLOWS 1
#define MOST_ONE_FOLLOWS 1
#define LEAST_ONE_IN_DEG (1 / DEGREE)
#define MOST_ONE_IN_DEG (1 / DEGREE)
#define LEAST_DEGREE_IN_DEG 1
#define MOST_DEGREE_IN_DEG 1
#define LEAST_ARCMIN_IN_ARCMIN 1
#define MOST_ARCMIN_IN_ARCMIN 1
#define LEAST_MODULE_SAME LM_MODULE_LEAST_MM
#define MOST_MODULE_SAME LM_MODULE_MOST_MM
#define LEAST_MODULE_FOLLOWS LM_MODULE_LEAST_MM
#define MOST_MODULE_FOLLOWS LM_MODULE_MOST_MM
#define LEAST_DIAMETER_SAME LEAST_DIAMETER_MM
#define MOST_DIAMETER_SAME MOST_DIAMETER_MM
#define LEAST_RIM_SAME (LM_RIM_LEAST * LEAST_DIAMETER_MM)
#define MOST_RIM_SAME (LM_RIM_MOST * MOST_DIAMETER_MM)
#define LEAST_FACE_SAME LM_FACE_WIDTH_LEAST_MM
#define MOST_FACE_SAME LM_FACE_WIDTH_MOST_MM
#define OR_ZERO_REQUIRED(low) (low)
#define OR_ZERO_DEFAULT(low) (low)
#define OR_ZERO_FILLED(low) 0
#define ENTRY(id, section, stem, suffix, kind, per, low, high, file, usual, vary, meaning) \
  {NAME_##vary(PREFIX_##section, #stem, #suffix), DISCRETE_##kind, usual,                  \
   OR_ZERO_##file((low) * LEAST_##per##_##vary), (high) * MOST_##per##_##vary},

/* By lm_key; the grades share the last one. */
static const key_entry keys[LM_KEY_GRADE + 1] = {
    LM_DESIGN_KEYS(ENTRY, ENTRY) /* clang-format off */
    {"teeth.shift_difference", 0, 0, -2, 2},
    {"generator.deflection_modules", 0, 0, 0.2, 2},
    {"tolerance.grade", 0, 7, 3, 12},
                                 /* clang-format on */
};

static const key_entry *entry_of(int key) {
  return &keys[key < LM_KEY_GRADE ? key : LM_KEY_GRADE];
}

void lm_write_key(int key, char text[LM_KEY_NAME_MAX]) {
  if (key < 0 || key >= LM_KEY_COUNT) {
    text[0] = '\0';
  } else if (key < LM_KEY_GRADE) {
    snprintf(text, LM_KEY_NAME_MAX, "%s", keys[key].name);
  } else {
    snprintf(text, LM_KEY_NAME_MAX, "tolerance.%d.grade", key - LM_KEY_GRADE);
  }
}

int lm_rival_key(int key) {
  static const int pairs[][2] = {{LM_KEY_RIGID_SHIFT, LM_KEY_SHIFT_DIFFERENCE},
                                 {LM_KEY_DEFLECTION_MM, LM_KEY_DEFLECTION_MODULES}};
  int i;
  for (i = 0; i < 4; i++) {
    if (pairs[i / 2][i % 2] == key) {
      return pairs[i / 2][1 - i % 2];
    }
  }
  return key;
}

int lm_find_key(const char *name) {
  char text[LM_KEY_NAME_MAX];
  int key;
  for (key = 0; key < LM_KEY_COUNT; key++) {
    lm_write_key(key, text);
    if (text[0] != '\0' && strcmp(text, name) == 0) {
      return key;
    }
  }
  return -1;
}

static const char *const figure_names[LM_FIGURE_COUNT] = {
    "lost_motion", "tolerance_lost_motion", "compliance", "kinematic_error", "stress", "cost"};
static const char *const figure_units[LM_FIGURE_COUNT] = {"arcmin", "arcmin", "arcmin_per_Nm",
                                                          "arcsec", "1",      "units"};

const char *lm_figure_name(int figure) {
  return figure >= 0 && figure < LM_FIGURE_COUNT ? figure_names[figure] : "";
}

const char *lm_figure_unit(int figure) {
  return figure >= 0 && figure < LM_FIGURE_COUNT ? figure_units[figure] : "";
}

int lm_find_figure(const char *name) {
  int figure;
  for (figure = 0; figure < LM_FIGURE_COUNT; figure++) {
    if (strcmp(name, figure_names[figure]) == 0) {
      return figure;
    }
  }
  return strcmp(name, "stiffness") == 0 ? LM_FIGURE_COMPLIANCE : -1;
}

#define IS_MOST 0
#define IS_LEAST 1
#define IS_LEAST_OF_ROW(id, name, unit, scale, meaning) \
  case LM_LIMIT_##id:                                   \
    return IS_##scale;

static int is_least(int limit) {
  switch (limit) {
    LM_CAPACITY_CHECKS(IS_LEAST_OF_ROW)
    default:
      return limit == (int)LM_LIMIT_FIGURE + (int)LM_FIGURE_COMPLIANCE;
  }
}

double lm_share_of_limit(int limit, double row) {
  return is_least(limit) && row > -1 ? row / (1 + row) : row;
}

int lm_is_set_by_spec(int limit) {
  return limit >= LM_LIMIT_SAFETY;
}

#define NAME_OF_ROW(id, name, unit, scale, meaning) name,

const char *lm_limit_name(int limit) {
  static const char *const names[LM_LIMIT_COUNT] = {
      "form_radius",
      "flexspline_tip_thickness",
      "rigid_tip_thickness",
      "flexspline_root_clearance",
      "rigid_root_clearance",
      "disengagement",
      "free_assembly",
      "bending_stress",
      "torsion_stress",
      LM_CAPACITY_CHECKS(NAME_OF_ROW) "safety_factor_min",
      "outer_diameter_max_mm",
      "interference_max_mm",
      "gap_min_arcmin",
      "lost_motion_max_arcmin",
      "tolerance_lost_motion_max_arcmin",
      "stiffness_min_Nm_per_rad",
      "kinematic_error_max_arcsec",
      "stress_max",
      "cost_max"};
  return limit >= 0 && limit < LM_LIMIT_COUNT ? names[limit] : "";
}

/* --- the problem ------------------------------------------------------------------------------ */

void lm_start_problem(lm_problem *problem) {
  static const double generator_cost[5] = {4, 4, 3, 5, 3};
  int key;
  memset(problem, 0, sizeof *problem);
  for (key = 0; key < LM_KEY_COUNT; key++) {
    problem->value[key] = entry_of(key)->otherwise;
  }
  problem->ratio_sign = 1;
  problem->phases = 2;
  problem->level = LM_LEVEL_QUANTILE;
  problem->bounds.safety_factor_min = 1.5;
  problem->bounds.interference_max_mm = -1;
  problem->cost.tolerance_exponent = 1;
  problem->cost.size = 1;
  memcpy(problem->cost.generator, generator_cost, sizeof generator_cost);
  problem->seed = 1;
  problem->evaluations = 20000;
}

static lm_status check_number(lm_fault *fault, const char *input, double found, double low,
                              double high) {
  if (found >= low && found <= high) {
    return LM_OK;
  }
  return lm_refuse(fault, isfinite(found) ? LM_OUT_OF_RANGE : LM_NOT_FINITE, input, found, low,
                   high);
}

static lm_status check_key(lm_fault *fault, int key, double found) {
  const key_entry *entry = entry_of(key);
  const double step = key == LM_KEY_FLEXSPLINE_TEETH ? 2 : 1;
  const lm_status status = check_number(fault, entry->name, found, entry->low, entry->high);
  if (status == LM_OK && entry->discrete && fmod(found, step) != 0) {
    const double low = step * floor(found / step);
    return lm_refuse(fault, LM_INCONSISTENT, entry->name, found, low, low + step);
  }
  return status;
}

static lm_status check_range(const lm_range *range, unsigned char seen[], lm_fault *fault) {
  const char *name = entry_of(range->key)->name;
  lm_status status = check_key(fault, range->key, range->low);
  if (status == LM_OK) {
    status = check_key(fault, range->key, range->high);
  }
  if (status != LM_OK) {
    return status;
  }
  if (range->low >= range->high || seen[range->key]++) {
    return lm_refuse(fault, LM_INCONSISTENT, name, range->low, range->low, range->high);
  }
  return entry_of(range->key)->discrete ? lm_refuse(fault, LM_INCONSISTENT, name, range->low, 0, 0)
                                        : LM_OK;
}

static lm_status check_choice(const lm_choice *choice, unsigned char seen[], lm_fault *fault) {
  lm_status status = LM_OK;
  int k;
  if (seen[choice->key]++ || choice->key == LM_KEY_AXIAL_SECTIONS ||
      choice->key == LM_KEY_PLANAR_ONLY) {
    return lm_refuse(fault, LM_INCONSISTENT, entry_of(choice->key)->name, 0, 0, 0);
  }
  for (k = 0; k < choice->count && status == LM_OK; k++) {
    status = check_key(fault, choice->key, choice->value[k]);
  }
  return status;
}

/* Ranges and choices lie in the ranges of their keys, and no key is named twice. */
static lm_status check_variables(const lm_problem *problem, lm_fault *fault) {
  unsigned char seen[LM_KEY_COUNT] = {0};
  lm_status status = LM_OK;
  int i;
  for (i = 0; i < problem->range_count && status == LM_OK; i++) {
    status = check_range(&problem->range[i], seen, fault);
  }
  for (i = 0; i < problem->choice_count && status == LM_OK; i++) {
    status = check_choice(&problem->choice[i], seen, fault);
  }
  for (i = 0; i < LM_KEY_COUNT && status == LM_OK; i++) {
    if (!seen[i] && (problem->given[i] || problem->value[i] != 0)) {
      status = check_key(fault, i, problem->value[i]);
    }
  }
  return status;
}

static lm_status check_objectives(const lm_problem *problem, lm_fault *fault) {
  unsigned char seen[LM_FIGURE_COUNT] = {0};
  int i;
  for (i = 0; i < problem->objective_count; i++) {
    if (seen[problem->objective[i]]++) {
      return lm_refuse(fault, LM_INCONSISTENT, "search.objectives", i + 1.0, 1, i);
    }
    if (problem->objective[i] == LM_FIGURE_KINEMATIC_ERROR && problem->phases < 3) {
      return lm_refuse(fault, LM_INCONSISTENT, "search.phases", problem->phases, 3, LM_PHASE_MAX);
    }
  }
  return LM_OK;
}

/* Permitted range of a number of the problem. */
typedef struct bounded_number {
  const char *input;
  double found;
  double low;
  double high;
} bounded_number;

static lm_status check_all(const bounded_number list[], int count, lm_fault *fault) {
  lm_status status = LM_OK;
  int i;
  for (i = 0; i < count && status == LM_OK; i++) {
    status = check_number(fault, list[i].input, list[i].found, list[i].low, list[i].high);
  }
  return status;
}

#define COUNT(array) ((int)(sizeof(array) / sizeof((array)[0])))

static lm_status check_link(const lm_graded_link *link, lm_fault *fault) {
  const bounded_number list[] = {{"tolerance.diameter_mm", link->diameter_mm, 0, 500},
                                 {"tolerance.influence", link->influence, -100, 100},
                                 {"tolerance.distribution", link->distribution, 0, 3},
                                 {"tolerance.zone", link->zone, 0, 1}};
  return check_all(list, COUNT(list), fault);
}

/* A nominal gap is one more link of the certificate. */
static int count_links(const lm_problem *problem) {
  return problem->link_count + problem->given[LM_KEY_GENERATOR_GAP_MM] +
         problem->given[LM_KEY_TEETH_GAP_MM];
}

static lm_status check_numbers(const lm_problem *problem, lm_fault *fault) {
  const lm_bounds *bounds = &problem->bounds;
  const bounded_number list[] = {
      {"drive.rated_torque_Nm", problem->rated_torque_Nm, LM_RATED_LEAST_NM, LM_RATED_MOST_NM},
      {"search.torque_Nm", problem->torque_Nm, 0, problem->rated_torque_Nm / 2},
      {"search.phases", problem->phases, 1, LM_PHASE_MAX},
      {"search.objectives", problem->objective_count, 1, LM_OBJECTIVE_MAX},
      {"search.evaluations", problem->evaluations, 10, 1e9},
      {"limits.safety_factor_min", bounds->safety_factor_min, 1e-3, 100},
      {"limits.gap_min_arcmin", bounds->gap_min_arcmin, -60, 60},
      {"search.ranges", problem->range_count, 1, LM_FREE_MAX},
      {"tolerance.links", count_links(problem), 0, LM_LINK_MAX}};
  lm_status status = check_all(list, COUNT(list), fault);
  int i;
  if (status == LM_OK) {
    status = check_objectives(problem, fault);
  }
  for (i = 0; i < problem->link_count && status == LM_OK; i++) {
    status = check_link(&problem->link[i], fault);
  }
  return status;
}

/* Deviation in units of tau for a point of the unit interval, by the inverse distributions of
 * lostmotion/tolerance.h. */
static double deviate_of(int distribution, double share) {
  const double tail = share < 0.5 ? share : 1.0 - share;
  const double cut = 1.35e-3;
  double lower = 2.0 * tail - 1.0;
  if (distribution == LM_NORMAL || distribution == LM_NORMAL_INSPECTED) {
    const double p = distribution == LM_NORMAL ? tail : cut + (1.0 - 2.0 * cut) * tail;
    lm_real quantile = 0;
    (void)lm_normal_tail_quantile(p, &quantile, NULL);
    lower = quantile / 3.0;
  } else if (distribution == LM_TRIANGULAR) {
    lower = sqrt(2.0 * tail) - 1.0;
  }
  return share < 0.5 ? lower : -lower;
}

static void draw_deviates(lm_problem *problem) {
  uint32_t point[LM_LOOP_SAMPLES];
  int i;
  int s;
  for (i = 0; i < problem->link_count; i++) {
    (void)lm_sobol_points(i, problem->seed + 1u + (uint32_t)i, LM_LOOP_SAMPLES, point, NULL);
    for (s = 0; s < LM_LOOP_SAMPLES; s++) {
      problem->deviate[i][s] =
          deviate_of(problem->link[i].distribution, ((double)point[s] + 0.5) / 4294967296.0);
    }
  }
}

lm_status lm_prepare_problem(lm_problem *problem, lm_fault *fault) {
  lm_status status;
  int i;
  if (problem == NULL) {
    return lm_refuse(fault, LM_NULL, "problem", 0, 0, 0);
  }
  for (i = 0; i < problem->range_count; i++) {
    problem->given[problem->range[i].key] = 1;
  }
  for (i = 0; i < problem->choice_count; i++) {
    problem->given[problem->choice[i].key] = 1;
  }
  status = check_numbers(problem, fault);
  if (status == LM_OK) {
    status = check_variables(problem, fault);
  }
  if (status == LM_OK && lm_count_combinations(problem) < 0) {
    status = lm_refuse(fault, LM_TOO_SMALL, "search.range", LM_COMBINATION_MAX + 1.0, 1,
                       LM_COMBINATION_MAX);
  }
  if (status != LM_OK) {
    return status;
  }
  for (i = 0; i < problem->link_count; i++) {
    if (problem->link[i].cost_weight == 0) {
      problem->link[i].cost_weight = 1;
    }
  }
  if (problem->torque_Nm == 0) {
    problem->torque_Nm = LM_LOST_MOTION_SHARE * problem->rated_torque_Nm;
  }
  draw_deviates(problem);
  return LM_OK;
}

int lm_count_combinations(const lm_problem *problem) {
  int count = 1;
  int i;
  for (i = 0; i < problem->choice_count; i++) {
    count *= problem->choice[i].count;
    if (count > LM_COMBINATION_MAX) {
      return -1;
    }
  }
  return count;
}

double lm_chosen_value(const lm_problem *problem, int combination, int choice) {
  int i;
  for (i = 0; i < choice; i++) {
    combination /= problem->choice[i].count;
  }
  return problem->choice[choice].value[combination % problem->choice[choice].count];
}

lm_status lm_choose_teeth_by_ratio(lm_problem *problem, double ratio_low, double ratio_high,
                                   lm_fault *fault) {
  lm_choice *choice = &problem->choice[problem->choice_count];
  const int external = problem->value[LM_KEY_DEFORMATION] > 0.5;
  int count = 0;
  int z;
  if (problem->choice_count == LM_CHOICE_MAX) {
    return lm_refuse(fault, LM_TOO_SMALL, "search.choice", LM_CHOICE_MAX + 1.0, 0, LM_CHOICE_MAX);
  }
  for (z = LM_FLEXSPLINE_TEETH_MIN; z <= LM_FLEXSPLINE_TEETH_MAX; z += 2) {
    const int turning = problem->rigid_gear_turns ? (external ? z - 2 : z + 2) : z;
    if (turning / 2.0 >= ratio_low && turning / 2.0 <= ratio_high) {
      if (count == LM_CHOICE_VALUES_MAX) {
        return lm_refuse(fault, LM_TOO_SMALL, "limits.ratio", count + 1.0, 1, LM_CHOICE_VALUES_MAX);
      }
      choice->value[count++] = z;
    }
  }
  if (count == 0) {
    return lm_refuse(fault, LM_OUT_OF_RANGE, "limits.ratio", ratio_low, LM_FLEXSPLINE_TEETH_MIN / 2,
                     LM_FLEXSPLINE_TEETH_MAX / 2 + 1);
  }
  choice->key = LM_KEY_FLEXSPLINE_TEETH;
  choice->count = count;
  problem->choice_count++;
  return LM_OK;
}

/* --- evaluation ------------------------------------------------------------------------------- */

void lm_default_scan(lm_scan *scan) {
  static const double about_junction[] = {-1.0, 0.0, 1.0, 3.0};
  int i;
  scan->count = 0;
  scan->nodes = 24;
  for (i = 0; i <= 42; i++) {
    scan->angle[scan->count].offset_rad = 2.0 * i * DEGREE;
    scan->angle[scan->count].from_junction = 0;
    scan->count++;
  }
  scan->rising = scan->count;
  for (i = 0; i < 4; i++) {
    scan->angle[scan->count].offset_rad = about_junction[i] * DEGREE;
    scan->angle[scan->count].from_junction = 1;
    scan->count++;
  }
}

void lm_lay_out(const lm_problem *problem, const lm_scan *scan, lm_layout *layout) {
  const int sections = problem->value[LM_KEY_PLANAR_ONLY] > 0.5 ? 1 : LM_EDGES;
  int figure;
  int next = 0;
  for (figure = 0; figure < LM_FIGURE_COUNT; figure++) {
    int count = problem->phases;
    if (figure == LM_FIGURE_KINEMATIC_ERROR) {
      count = problem->phases > 1 ? problem->phases * (problem->phases - 1) : 1;
    } else if (figure == LM_FIGURE_STRESS || figure == LM_FIGURE_COST) {
      count = 1;
    }
    layout->figure_start[figure] = next;
    layout->figure_count[figure] = count;
    next += count;
  }
  layout->single_start = next;
  layout->gap_start = next + LM_SINGLE_ROWS;
  layout->gap_count = 2 * (scan->count + 2) * sections;
  layout->count = layout->gap_start + layout->gap_count;
}

double lm_clip(double unit) {
  return unit < 0.0 ? 0.0 : unit > 1.0 ? 1.0 : unit;
}

lm_workspace *lm_create_workspace(void) {
  lm_workspace *workspace = (lm_workspace *)malloc(sizeof *workspace);
  if (workspace != NULL) {
    workspace->known.gaps = NULL;
    workspace->known.points = NULL;
    workspace->dual = malloc(lm_dual_workspace_size());
    if (workspace->dual == NULL) {
      free(workspace);
      workspace = NULL;
    }
  }
  return workspace;
}

void lm_free_workspace(lm_workspace *workspace) {
  if (workspace != NULL) {
    free(workspace->dual);
    free(workspace);
  }
}

/* Whether a test of the search needs this point to fail; depends on the point alone. */
static int is_damaged(const lm_problem *problem, int combination, const double unit[]) {
  uint64_t hash = (uint64_t)combination;
  int i;
  if (!(problem->damaged_share > 0)) {
    return 0;
  }
  for (i = 0; i < problem->range_count; i++) {
    uint64_t bits;
    memcpy(&bits, &unit[i], sizeof bits);
    hash = lm_mix(hash ^ bits);
  }
  return (double)(hash >> 11) / 9007199254740992.0 < problem->damaged_share;
}

static lm_status check_result(const lm_problem *problem, const lm_layout *layout, int combination,
                              const double unit[], double result[], lm_fault *fault) {
  int i;
  if (is_damaged(problem, combination, unit)) {
    result[0] = (double)NAN;
  }
  for (i = 0; i < layout->count; i++) {
    if (!isfinite(result[i])) {
      return lm_refuse(fault, LM_NOT_FINITE, "figures and limits", result[i], 0, 0);
    }
  }
  return LM_OK;
}

void lm_point_values(const lm_problem *problem, int combination, const double unit[],
                     double value[LM_KEY_COUNT]) {
  lm_fill_values(problem, combination, unit, value);
}

lm_status lm_point_drive(const lm_problem *problem, int combination, const double unit[],
                         lm_drive *drive, lm_fault *fault) {
  double value[LM_KEY_COUNT];
  lm_fill_values(problem, combination, unit, value);
  return lm_build_drive(problem, value, drive, fault);
}

lm_status lm_evaluate_point(const lm_problem *problem, const lm_scan *scan, const lm_layout *layout,
                            int combination, const double unit[], double result[],
                            lm_workspace *workspace, lm_fault *fault) {
  lm_status status;
  lm_fill_values(problem, combination, unit, workspace->value);
  status = lm_build_drive(problem, workspace->value, &workspace->drive, fault);
  if (status == LM_OK) {
    status = lm_measure_drive(problem, scan, layout, workspace->value, &workspace->drive, result,
                              workspace->gapless, &workspace->design, fault);
  }
  if (status == LM_OK) {
    status = check_result(problem, layout, combination, unit, result, fault);
  }
  return status;
}

int lm_has_cheap_tolerances(const lm_problem *problem) {
  return !problem->bounds.gap_at_worst_corner;
}

lm_status lm_evaluate_tolerances(const lm_problem *problem, const lm_layout *layout,
                                 int combination, const double unit[], double result[],
                                 lm_workspace *workspace, lm_fault *fault) {
  lm_status status;
  lm_fill_values(problem, combination, unit, workspace->value);
  status = lm_grade_drive(problem, workspace->value, &workspace->drive, fault);
  if (status == LM_OK) {
    status = lm_measure_tolerances(problem, layout, workspace->value, &workspace->drive,
                                   workspace->gapless, result, fault);
  }
  if (status == LM_OK) {
    status = check_result(problem, layout, combination, unit, result, fault);
  }
  return status;
}

lm_status lm_evaluate_slopes(const lm_problem *problem, const lm_scan *scan,
                             const lm_layout *layout, int combination, const double unit[],
                             double result[], double slope[], lm_workspace *workspace,
                             lm_fault *fault) {
  const char *input = "";
  lm_status status = (lm_status)lm_dual_evaluate(problem, scan, layout, combination, unit, result,
                                                 slope, workspace->dual, &input);
  int i;
  if (status != LM_OK) {
    return lm_refuse(fault, status, input, 0, 0, 0);
  }
  status = check_result(problem, layout, combination, unit, result, fault);
  for (i = 0; i < layout->count * problem->range_count && status == LM_OK; i++) {
    if (!isfinite(slope[i])) {
      status = lm_refuse(fault, LM_NOT_FINITE, "derivatives", slope[i], 0, 0);
    }
  }
  return status;
}

int lm_slope_charge(const lm_problem *problem) {
  int ranges = 0;
  int i;
  for (i = 0; i < problem->range_count; i++) {
    ranges += problem->range[i].key < LM_KEY_GRADE || !lm_has_cheap_tolerances(problem);
  }
  return LM_GRADIENT_CHARGE * (ranges > 8 ? (ranges + 7) / 8 : 1);
}

static double larger(double a, double b) {
  return a > b ? a : b;
}

/* Four at a time, because each comparison depends on the previous one. */
static double largest_of(const double row[], int count) {
  double a = row[0];
  double b = a;
  double c = a;
  double d = a;
  int i;
  for (i = 1; i + 3 < count; i += 4) {
    a = larger(row[i], a);
    b = larger(row[i + 1], b);
    c = larger(row[i + 2], c);
    d = larger(row[i + 3], d);
  }
  for (; i < count; i++) {
    a = larger(row[i], a);
  }
  return larger(larger(a, b), larger(c, d));
}

double lm_figure_of(const lm_layout *layout, const double result[], int figure) {
  return largest_of(result + layout->figure_start[figure], layout->figure_count[figure]);
}

static double with_figures(const lm_problem *problem, const lm_layout *layout,
                           const double result[], double largest) {
  int i;
  for (i = 0; i < LM_FIGURE_COUNT; i++) {
    if (problem->bounds.figure_max[i] > 0) {
      const double over = lm_figure_of(layout, result, i) / problem->bounds.figure_max[i] - 1.0;
      largest = larger(over, largest);
    }
  }
  return largest;
}

double lm_violation_of(const lm_problem *problem, const lm_layout *layout, const double result[]) {
  return with_figures(
      problem, layout, result,
      largest_of(result + layout->single_start, layout->count - layout->single_start));
}

double lm_tolerance_violation_of(const lm_problem *problem, const lm_layout *layout,
                                 const double result[]) {
  return with_figures(problem, layout, result,
                      result[layout->single_start + LM_LIMIT_INTERFERENCE]);
}

/* --- closing the gap -------------------------------------------------------------------------- */

/* A value of the discrete kind, fixed or chosen. */
static double discrete_value(const lm_problem *problem, int combination, int key) {
  int i;
  for (i = 0; i < problem->choice_count; i++) {
    if (problem->choice[i].key == key) {
      return lm_chosen_value(problem, combination, i);
    }
  }
  return problem->value[key];
}

static int is_conjugate(const lm_problem *problem, int combination) {
  return discrete_value(problem, combination, LM_KEY_RIGID_FLANK) > LM_FLANK_CONJUGATE - 0.5;
}

/* The range that moves all side clearances equally, or -1. */
static int closing_range(const lm_problem *problem, int combination) {
  const int external = discrete_value(problem, combination, LM_KEY_DEFORMATION) > 0.5;
  const int conjugate = is_conjugate(problem, combination);
  int i;
  for (i = 0; i < problem->range_count; i++) {
    const int key = problem->range[i].key;
    if (conjugate) {
      if (key == LM_KEY_BACKLASH_MM) {
        return i;
      }
    } else if (external ? key == LM_KEY_FLEXSPLINE_SHIFT
                        : key == LM_KEY_RIGID_SHIFT || key == LM_KEY_SHIFT_DIFFERENCE) {
      return i;
    }
  }
  return -1;
}

/* Move a range by a number of its own units; returns the part that a bound does not prevent. */
static double move_range(const lm_range *range, double by, double *unit) {
  const double before = *unit;
  *unit = lm_clip(before + by / (range->high - range->low));
  return (*unit - before) * (range->high - range->low);
}

/* Rotation of a flank by a shift of one module, 2 tan(alpha) / z on either side (involute.h); of a
 * conjugate flank by its backlash, 1 / r per mm. */
int lm_open_gap(const lm_problem *problem, int combination, double by_arcmin, double unit[]) {
  const int range = closing_range(problem, combination);
  double value[LM_KEY_COUNT];
  double moved;
  double teeth;
  int i;
  if (range < 0) {
    return 0;
  }
  lm_fill_values(problem, combination, unit, value);
  teeth = value[LM_KEY_FLEXSPLINE_TEETH];
  if (value[LM_KEY_DEFORMATION] < 0.5) {
    teeth += 2;
  } else if (by_arcmin < 0) {
    /* The rotation of the flexspline's own flanks has a factor between 1 and z_F / z_R at the
     * output: the factor is chosen such that the gap is closed too little rather than too much. */
    teeth -= 2;
  }
  moved = move_range(&problem->range[range],
                     by_arcmin * ARCMIN * teeth *
                         (is_conjugate(problem, combination)
                              ? value[LM_KEY_MODULE_MM] / 2
                              : 1 / (2 * tan(value[LM_KEY_PRESSURE_ANGLE_DEG] * DEGREE))),
                     &unit[range]);
  if (fabs(moved) < 1e-9) {
    return 0;
  }
  /* The rigid gear is unchanged, also if its shift is stated as the difference to that of the
   * flexspline. */
  for (i = 0; i < problem->range_count && value[LM_KEY_DEFORMATION] > 0.5; i++) {
    if (problem->range[i].key == LM_KEY_SHIFT_DIFFERENCE) {
      (void)move_range(&problem->range[i], -moved, &unit[i]);
    }
  }
  return 1;
}

double lm_gap_row_of(const lm_layout *layout, const double result[]) {
  return largest_of(result + layout->gap_start, layout->gap_count);
}

int lm_close_gap(const lm_problem *problem, const lm_layout *layout, int combination,
                 const double result[], double unit[]) {
  return lm_open_gap(problem, combination, lm_gap_row_of(layout, result) + LM_RESERVE, unit);
}
