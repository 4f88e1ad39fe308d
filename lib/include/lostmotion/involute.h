/* Radii and involute flanks of both gears, theory/geometry.md. */
#ifndef LOSTMOTION_INVOLUTE_H
#define LOSTMOTION_INVOLUTE_H

#include "lostmotion/drive.h"
#include "lostmotion/real.h"
#include "lostmotion/status.h"

LM_BEGIN_DECLS

/* An involute flank by its half angle: at radius rho the flank is at
 *   xi(rho) = half_angle_rad - inv(arccos(base_mm / rho)),  inv a = tan a - a,
 * from the axis of a tooth of an external gear, or from the axis of a space of an internal gear. */
typedef struct lm_involute {
  lm_real base_mm;        /* r_b */
  lm_real half_angle_rad; /* half angle on the base circle */
} lm_involute;

/* Flank of a gear of `teeth` teeth cut by a rack: half angle pi/(2 z) + 2 x tan(alpha)/z +
 * inv(alpha) on the base circle. No checks: callers pass a checked drive. */
lm_involute lm_make_involute(lm_real module_mm, int teeth, lm_real pressure_angle_rad,
                             lm_real shift);

/* An involute at one radius. On and below the base circle: as on the base circle. */
typedef struct lm_involute_point {
  lm_real tangent;            /* of the pressure angle, sqrt(rho^2 - r_b^2) / r_b; the half angle
                                 falls by tangent / rho per mm */
  lm_real pressure_angle_rad; /* arccos(r_b / rho) */
  lm_real half_angle_rad;     /* xi(rho) */
} lm_involute_point;

/* The flank at a radius, mm. */
lm_involute_point lm_evaluate_involute(const lm_involute *flank, lm_real radius_mm);

/* All radii of the mesh, mm. "Root" and "tip" are the ends of the teeth: for internal teeth the tip
 * is the smaller radius. Undeformed flexspline. */
typedef struct lm_geometry {
  lm_deformation deformation;
  int flexspline_teeth;
  int rigid_teeth;
  lm_real module_mm;
  lm_real deflection_mm; /* w0, nominal */
  lm_real flexspline_root_mm;
  lm_real flexspline_tip_mm;
  lm_real rigid_root_mm; /* the root of the generated gear is arbitrary: 0.2 m beyond the tip */
  lm_real rigid_tip_mm;
  lm_real neutral_mm; /* r_m, neutral line of the rim */
  lm_real mean_mm; /* r of eq (4), (9): midway between both tip circles on the deformation axis */
  /* (z_rigid - z_flexspline) / z_rigid: tooth axis ahead of the rigid one */
  lm_real lead_per_angle;
  lm_involute flexspline; /* tooth flank (internal deformation) or space flank (external) */
  lm_involute rigid;      /* space flank (internal deformation) or tooth flank (external) */
} lm_geometry;

/* Clearance at the free root of the generated gear, in modules. */
#define LM_ROOT_BEYOND_TIP LM_REAL(0.2)

/* Radii of both gears:
 *  internal: r_f1 = m z1/2 + m (x1 - h_a - c), r_a1 = r_f1 + h m, r_m = r_f1 - s/2,
 *            r_a2 = r_a1 + w0 - h_d m, r_f2 = r_a1 + w0 + 0.2 m;
 *  external: r_fr = m z_r/2 + m (x_r - h_a - c), r_ar = r_fr + h m, r_af = r_ar + w0 - h_d m,
 *            r_ff = r_ar + w0 + 0.2 m, r_m = r_ff + s/2.
 * Reads a checked drive; LM_NULL; LM_INCONSISTENT ("teeth.engagement_depth", "teeth.tooth_height")
 * when a flank ends below its base circle. */
lm_status lm_make_geometry(const lm_teeth *teeth, lm_real deflection_mm, lm_real rim_thickness_mm,
                           lm_geometry *geometry, lm_fault *fault);

LM_END_DECLS

#endif
