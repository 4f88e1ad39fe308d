#include "bounds.h"

#include "evaluate.h"

#define STEEL_SHEAR_FATIGUE_MPA 250 /* as lm_complete_drive assumes if none is stated */

/* Keys that make a drive larger or its wall stronger; others make it smaller or have no
 * influence. */
static int enlarges(int key) {
  return key == LM_KEY_WALL_THICKNESS_MM || key == LM_KEY_SHEAR_FATIGUE_MPA ||
         key == LM_KEY_DEFLECTION_MM || key == LM_KEY_DEFLECTION_MODULES ||
         key == LM_KEY_MODULE_MM || key == LM_KEY_FLEXSPLINE_SHIFT || key == LM_KEY_RIGID_SHIFT ||
         key == LM_KEY_SHIFT_DIFFERENCE || key == LM_KEY_TOOTH_HEIGHT;
}

/* A limit that grows or falls with every variable is best at one corner of the box; the corner is
 * found variable by variable: of the smallest drive of the combination, or of the largest. */
static void find_corner(const lm_problem *p, int combination, int largest,
                        double value[LM_KEY_COUNT]) {
  double unit[LM_FREE_MAX];
  int i;
  for (i = 0; i < p->range_count; i++) {
    unit[i] = enlarges(p->range[i].key) == largest;
  }
  lm_fill_values(p, combination, unit, value);
}

/* Radius at the root of the gear that the rack cuts. */
static double root_radius(const lm_problem *p, const double value[]) {
  const int external = value[LM_KEY_DEFORMATION] > 0.5;
  const double teeth = value[LM_KEY_FLEXSPLINE_TEETH] - (external ? 2 : 0);
  double shift = value[LM_KEY_FLEXSPLINE_SHIFT];
  if (external && p->given[LM_KEY_SHIFT_DIFFERENCE]) {
    shift += value[LM_KEY_SHIFT_DIFFERENCE];
  } else if (external) {
    shift = value[LM_KEY_RIGID_SHIFT];
  }
  return value[LM_KEY_MODULE_MM] *
         (teeth / 2 + shift - value[LM_KEY_RACK_ADDENDUM] - value[LM_KEY_ROOT_CLEARANCE]);
}

/* From there to the root of its mate. */
static double beyond_root(const lm_problem *p, const double value[]) {
  const double m = value[LM_KEY_MODULE_MM];
  const double deflection = p->given[LM_KEY_DEFLECTION_MODULES]
                                ? value[LM_KEY_DEFLECTION_MODULES] * m
                                : value[LM_KEY_DEFLECTION_MM];
  return m * (value[LM_KEY_TOOTH_HEIGHT] + LM_ROOT_BEYOND_TIP) + deflection;
}

static double pitch_diameter(const double value[]) {
  return value[LM_KEY_MODULE_MM] * value[LM_KEY_FLEXSPLINE_TEETH];
}

static double least_diameter(const lm_problem *p, int combination) {
  double value[LM_KEY_COUNT];
  find_corner(p, combination, 0, value);
  return 2 *
         (root_radius(p, value) + beyond_root(p, value) + LM_RING_SHARE * pitch_diameter(value));
}

/* Shear in the wall at the largest neutral line and thickest wall, as a share of the fatigue
 * strength; 0: the wall is not stated. */
static double least_shear(const lm_problem *p, int combination) {
  double value[LM_KEY_COUNT];
  double r;
  double bears;
  find_corner(p, combination, 1, value);
  r = root_radius(p, value);
  if (value[LM_KEY_DEFORMATION] > 0.5) {
    r += beyond_root(p, value) + LM_RIM_MOST / 2 * pitch_diameter(value);
  }
  bears = value[LM_KEY_SHEAR_FATIGUE_MPA] > 0 ? value[LM_KEY_SHEAR_FATIGUE_MPA]
                                              : STEEL_SHEAR_FATIGUE_MPA;
  return value[LM_KEY_WALL_THICKNESS_MM] > 0
             ? p->rated_torque_Nm * 1000 /
                   (2 * LM_PI * r * r * value[LM_KEY_WALL_THICKNESS_MM] * bears)
             : 0;
}

int lm_is_excluded(const lm_problem *problem, int combination, int *limit) {
  double value[LM_KEY_COUNT];
  find_corner(problem, combination, 0, value);
  if ((value[LM_KEY_DEFORMATION] > 0.5) != ((int)(value[LM_KEY_GENERATOR_TYPE] + 0.5) == LM_RING)) {
    *limit = -1;
    return 1;
  }
  if (problem->bounds.outer_diameter_max_mm > 0 &&
      least_diameter(problem, combination) > problem->bounds.outer_diameter_max_mm) {
    *limit = LM_LIMIT_OUTER_DIAMETER;
    return 1;
  }
  if (least_shear(problem, combination) > 1) {
    *limit = LM_LIMIT_TORSION_STRESS;
    return 1;
  }
  return 0;
}
