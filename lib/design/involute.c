#include "lostmotion/involute.h"

#include "real_math.h"
#include "refuse.h"

/* inv a = tan a - a from t = tan a and a. The difference loses digits for small t, where the series
 * t^3/3 - t^5/5 + ... is used; at t = 0.3 its error after ten terms is 2e-13. */
static lm_real involute_function(lm_real t, lm_real a) {
  if (t < LM_REAL(0.3)) {
    const lm_real t2 = t * t;
    lm_real sum = LM_REAL(0);
    int k;
    for (k = 10; k >= 1; k--) {
      sum = LM_REAL(1) / LM_REAL(2 * k + 1) - t2 * sum;
    }
    return t * t2 * sum;
  }
  return t - a;
}

lm_involute lm_make_involute(lm_real module_mm, int teeth, lm_real pressure_angle_rad,
                             lm_real shift) {
  const lm_real z = LM_REAL(teeth);
  const lm_real t = real_tan(pressure_angle_rad);
  lm_involute flank;
  flank.base_mm = module_mm * z / LM_REAL(2) * real_cos(pressure_angle_rad);
  flank.half_angle_rad = LM_PI / (LM_REAL(2) * z) + LM_REAL(2) * shift * t / z +
                         involute_function(t, pressure_angle_rad);
  return flank;
}

lm_involute_point lm_evaluate_involute(const lm_involute *flank, lm_real radius_mm) {
  const lm_real above = radius_mm - flank->base_mm;
  lm_involute_point point;
  point.tangent = LM_REAL(0);
  if (above > LM_REAL(0)) {
    point.tangent = real_sqrt(above * (radius_mm + flank->base_mm)) / flank->base_mm;
  }
  point.pressure_angle_rad = real_atan(point.tangent);
  point.half_angle_rad =
      flank->half_angle_rad - involute_function(point.tangent, point.pressure_angle_rad);
  return point;
}

static void make_internal(const lm_teeth *teeth, lm_real deflection_mm, lm_real rim_thickness_mm,
                          lm_geometry *g) {
  const lm_real m = teeth->module_mm;
  g->flexspline_root_mm =
      m * (LM_REAL(teeth->flexspline_teeth) / LM_REAL(2) + teeth->flexspline_shift -
           teeth->rack_addendum - teeth->root_clearance);
  g->flexspline_tip_mm = g->flexspline_root_mm + teeth->tooth_height * m;
  g->neutral_mm = g->flexspline_root_mm - rim_thickness_mm / LM_REAL(2);
  g->rigid_tip_mm = g->flexspline_tip_mm + deflection_mm - teeth->engagement_depth * m;
  g->rigid_root_mm = g->flexspline_tip_mm + deflection_mm + LM_ROOT_BEYOND_TIP * m;
  g->mean_mm = (g->flexspline_tip_mm + deflection_mm + g->rigid_tip_mm) / LM_REAL(2);
}

static void make_external(const lm_teeth *teeth, lm_real deflection_mm, lm_real rim_thickness_mm,
                          lm_geometry *g) {
  const lm_real m = teeth->module_mm;
  g->rigid_root_mm = m * (LM_REAL(teeth->rigid_teeth) / LM_REAL(2) + teeth->rigid_shift -
                          teeth->rack_addendum - teeth->root_clearance);
  g->rigid_tip_mm = g->rigid_root_mm + teeth->tooth_height * m;
  g->flexspline_tip_mm = g->rigid_tip_mm + deflection_mm - teeth->engagement_depth * m;
  g->flexspline_root_mm = g->rigid_tip_mm + deflection_mm + LM_ROOT_BEYOND_TIP * m;
  g->neutral_mm = g->flexspline_root_mm + rim_thickness_mm / LM_REAL(2);
  g->mean_mm = (g->flexspline_tip_mm - deflection_mm + g->rigid_tip_mm) / LM_REAL(2);
}

lm_status lm_make_geometry(const lm_teeth *teeth, lm_real deflection_mm, lm_real rim_thickness_mm,
                           lm_geometry *geometry, lm_fault *fault) {
  lm_geometry g;
  if (teeth == 0 || geometry == 0) {
    return refuse(fault, LM_NULL, teeth == 0 ? "teeth" : "geometry");
  }
  g.deformation = teeth->deformation;
  g.flexspline_teeth = teeth->flexspline_teeth;
  g.rigid_teeth = teeth->rigid_teeth;
  g.module_mm = teeth->module_mm;
  g.deflection_mm = deflection_mm;
  g.lead_per_angle =
      LM_REAL(teeth->rigid_teeth - teeth->flexspline_teeth) / LM_REAL(teeth->rigid_teeth);
  g.flexspline = lm_make_involute(teeth->module_mm, teeth->flexspline_teeth,
                                  teeth->pressure_angle_rad, teeth->flexspline_shift);
  g.rigid = lm_make_involute(teeth->module_mm, teeth->rigid_teeth, teeth->pressure_angle_rad,
                             teeth->rigid_shift);
  if (teeth->deformation == LM_INTERNAL) {
    make_internal(teeth, deflection_mm, rim_thickness_mm, &g);
    if (teeth->rigid_flank == LM_FLANK_INVOLUTE && !(g.rigid_tip_mm > g.rigid.base_mm)) {
      return refuse_contradiction(fault, "teeth.engagement_depth", g.rigid_tip_mm, g.rigid.base_mm,
                                  REAL_INFINITY);
    }
    if (teeth->flexspline_flank == LM_FLANK_INVOLUTE &&
        !(g.flexspline_tip_mm > g.flexspline.base_mm)) {
      return refuse_contradiction(fault, "teeth.tooth_height", g.flexspline_tip_mm,
                                  g.flexspline.base_mm, REAL_INFINITY);
    }
  } else {
    make_external(teeth, deflection_mm, rim_thickness_mm, &g);
    if (teeth->rigid_flank == LM_FLANK_INVOLUTE && !(g.rigid_tip_mm > g.rigid.base_mm)) {
      return refuse_contradiction(fault, "teeth.tooth_height", g.rigid_tip_mm, g.rigid.base_mm,
                                  REAL_INFINITY);
    }
    if (teeth->flexspline_flank == LM_FLANK_INVOLUTE &&
        !(g.flexspline_tip_mm > g.flexspline.base_mm)) {
      return refuse_contradiction(fault, "teeth.engagement_depth", g.flexspline_tip_mm,
                                  g.flexspline.base_mm, REAL_INFINITY);
    }
  }
  *geometry = g;
  return LM_OK;
}
