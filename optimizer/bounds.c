#include "bounds.h"

#include "evaluate.h"

/* A limit that grows or falls with every variable is best at one corner of the box; the corner is
 * found variable by variable. The signs are those of checks.h: stress grows with rim and
 * deflection, falls with the wall; the diameter grows with all lengths. */
static int low_corner(int key) {
  return key == LM_KEY_RIM_THICKNESS_MM || key == LM_KEY_DEFLECTION_MM ||
         key == LM_KEY_DEFLECTION_MODULES || key == LM_KEY_MODULE_MM ||
         key == LM_KEY_FLEXSPLINE_SHIFT || key == LM_KEY_RIGID_SHIFT ||
         key == LM_KEY_SHIFT_DIFFERENCE || key == LM_KEY_TOOTH_HEIGHT;
}

/* Outer diameter of the smallest drive of the combination (evaluate.c), without building it: the
 * pitch radius and the ring beyond it are certain, everything else is taken at its least. */
static double least_diameter(const lm_problem *p, const double value[]) {
  const double m = value[LM_KEY_MODULE_MM];
  const double z = value[LM_KEY_FLEXSPLINE_TEETH];
  const double w = p->given[LM_KEY_DEFLECTION_MODULES] ? value[LM_KEY_DEFLECTION_MODULES] * m
                                                       : value[LM_KEY_DEFLECTION_MM];
  const int external = value[LM_KEY_DEFORMATION] > 0.5;
  const double shift = external && p->given[LM_KEY_SHIFT_DIFFERENCE]
                           ? value[LM_KEY_FLEXSPLINE_SHIFT] + value[LM_KEY_SHIFT_DIFFERENCE]
                       : external ? value[LM_KEY_RIGID_SHIFT]
                                  : value[LM_KEY_FLEXSPLINE_SHIFT];
  const double teeth = external ? z - 2 : z;
  const double root =
      m * (teeth / 2 + shift - value[LM_KEY_RACK_ADDENDUM] - value[LM_KEY_ROOT_CLEARANCE]);
  return 2 * (root + m * value[LM_KEY_TOOTH_HEIGHT] + w + 0.2 * m + 0.1 * m * z);
}

/* Shear in the wall at the largest radius that the neutral line can have, MPa. */
static double least_shear(const lm_problem *p, const double value[]) {
  const double r =
      value[LM_KEY_MODULE_MM] * value[LM_KEY_FLEXSPLINE_TEETH] / 2 + 12 * value[LM_KEY_MODULE_MM];
  return p->rated_torque_Nm * 1000 /
         (2 * 3.14159265358979323846 * r * r * value[LM_KEY_WALL_THICKNESS_MM]);
}

int lm_is_excluded(const lm_problem *p, int combination, int *limit) {
  double unit[LM_FREE_MAX];
  double value[LM_KEY_COUNT];
  int external;
  int ring;
  int i;
  for (i = 0; i < p->range_count; i++) {
    unit[i] = low_corner(p->range[i].key) ? 0 : 1;
  }
  lm_fill_values(p, combination, unit, value);
  external = value[LM_KEY_DEFORMATION] > 0.5;
  ring = (int)(value[LM_KEY_GENERATOR_TYPE] + 0.5) == LM_RING;
  if (external != ring) {
    *limit = -1;
    return 1;
  }
  if (p->bounds.outer_diameter_max_mm > 0 &&
      least_diameter(p, value) > p->bounds.outer_diameter_max_mm) {
    *limit = LM_LIMIT_OUTER_DIAMETER;
    return 1;
  }
  if (value[LM_KEY_WALL_THICKNESS_MM] > 0) {
    const double allowed =
        value[LM_KEY_SHEAR_FATIGUE_MPA] > 0 ? value[LM_KEY_SHEAR_FATIGUE_MPA] : 250;
    if (least_shear(p, value) > allowed) {
      *limit = LM_LIMIT_TORSION_STRESS;
      return 1;
    }
  }
  return 0;
}
