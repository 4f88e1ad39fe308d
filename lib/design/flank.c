#include "lostmotion/flank.h"

#include "real_math.h"
#include "refuse.h"

/* Newton on the distance from the gear's centre; the flank is nearly radial, so three steps leave
 * rounding. */
#define RADIUS_STEPS 3

/* --- involute ------------------------------------------------------------------------------------
 */

static lm_flank_foot involute_foot(const lm_flank *flank, lm_real radius_mm) {
  const lm_involute_point at = lm_evaluate_involute(&flank->involute, radius_mm);
  const lm_real s = real_sin(at.half_angle_rad);
  const lm_real c = real_cos(at.half_angle_rad);
  lm_flank_foot foot;
  foot.radius_mm = radius_mm;
  foot.across_mm = radius_mm * s;
  foot.along_mm = radius_mm * c - flank->neutral_mm;
  foot.across_slope = s - at.tangent * c;
  foot.along_slope = c + at.tangent * s;
  return foot;
}

/* --- double arc ----------------------------------------------------------------------------------
 */

static lm_flank_foot arc_foot(const lm_flank *flank, lm_real parameter_mm) {
  const lm_double_arc *arc = &flank->arc;
  lm_flank_foot foot;
  foot.radius_mm = parameter_mm;
  foot.along_mm = parameter_mm - flank->neutral_mm;
  foot.along_slope = LM_REAL(1);
  if (foot.along_mm >= arc->upper_mm) {
    const lm_real up = foot.along_mm - arc->convex_along_mm;
    const lm_real right = real_sqrt((arc->convex_mm - up) * (arc->convex_mm + up));
    foot.across_mm = arc->convex_across_mm + right;
    foot.across_slope = -up / right;
  } else if (foot.along_mm > arc->lower_mm) {
    foot.across_mm = arc->upper_across_mm + (arc->upper_mm - foot.along_mm) * arc->tangent;
    foot.across_slope = -arc->tangent;
  } else {
    const lm_real down = arc->concave_along_mm - foot.along_mm;
    const lm_real left = real_sqrt((arc->concave_mm - down) * (arc->concave_mm + down));
    foot.across_mm = arc->concave_across_mm - left;
    foot.across_slope = -down / left;
  }
  return foot;
}

/* Centres, and the tangent that both arcs have in common (theory/flanks.md). */
static lm_status make_arc(const lm_drive *drive, const lm_geometry *g, lm_double_arc *arc,
                          lm_fault *fault) {
  const lm_flank_form *form = &drive->flank;
  const lm_real m = g->module_mm;
  const lm_real reference =
      m * (LM_REAL(g->flexspline_teeth) / LM_REAL(2) + drive->teeth.flexspline_shift) -
      g->neutral_mm;
  lm_real normal_across;
  lm_real normal_along;
  arc->convex_mm = form->rho_a * m;
  arc->convex_across_mm = -form->l_a * m;
  arc->convex_along_mm = reference - form->X_a * m;
  arc->concave_mm = form->rho_f * m;
  if (form->delta_L_rad > LM_REAL(0)) {
    arc->inclination_rad = form->delta_L_rad;
  } else {
    const lm_real right = (LM_PI / LM_REAL(2) + form->l_f + form->l_a) * m;
    const lm_real up = (form->X_f + form->X_a) * m;
    const lm_real both = arc->convex_mm + arc->concave_mm;
    const lm_real apart = real_sqrt(right * right + up * up);
    if (!(apart > both)) {
      return refuse_contradiction(fault, "flank.rho_a, flank.rho_f", both, LM_REAL(0), apart);
    }
    arc->inclination_rad =
        real_atan2(real_sqrt((apart - both) * (apart + both)), both) + real_atan2(up, right);
  }
  normal_across = real_cos(arc->inclination_rad);
  normal_along = real_sin(arc->inclination_rad);
  arc->tangent = normal_along / normal_across;
  arc->upper_mm = arc->convex_along_mm + arc->convex_mm * normal_along;
  arc->upper_across_mm = arc->convex_across_mm + arc->convex_mm * normal_across;
  if (form->delta_L_rad > LM_REAL(0)) {
    arc->lower_mm = arc->upper_mm - form->h_l * m;
    arc->concave_along_mm = arc->lower_mm + arc->concave_mm * normal_along;
    arc->concave_across_mm =
        arc->upper_across_mm + form->h_l * m * arc->tangent + arc->concave_mm * normal_across;
  } else {
    arc->concave_along_mm = reference + form->X_f * m;
    arc->concave_across_mm = (LM_PI / LM_REAL(2) + form->l_f) * m;
    arc->lower_mm = arc->concave_along_mm - arc->concave_mm * normal_along;
  }
  return LM_OK;
}

/* Whether the arcs reach tip and root, and make a tooth. */
static lm_status check_arc(const lm_flank *flank, const lm_geometry *g, lm_fault *fault) {
  const lm_double_arc *arc = &flank->arc;
  const lm_real tip = flank->high_mm - flank->neutral_mm;
  const lm_real root = flank->low_mm - flank->neutral_mm;
  const lm_real m = g->module_mm;
  if (!(tip - arc->convex_along_mm < arc->convex_mm)) {
    return refuse_contradiction(fault, "flank.rho_a, teeth.tooth_height", arc->convex_mm / m,
                                (tip - arc->convex_along_mm) / m, REAL_INFINITY);
  }
  if (!(tip > arc->upper_mm)) {
    return refuse_contradiction(fault, "flank.rho_a, flank.X_a", arc->upper_mm / m, root / m,
                                tip / m);
  }
  if (!(arc->concave_along_mm - root < arc->concave_mm)) {
    return refuse_contradiction(fault, "flank.rho_f, teeth.root_clearance", arc->concave_mm / m,
                                (arc->concave_along_mm - root) / m, REAL_INFINITY);
  }
  if (!(root < arc->lower_mm)) {
    return refuse_contradiction(fault, "flank.rho_f, flank.X_f", arc->lower_mm / m, root / m,
                                tip / m);
  }
  if (!(arc_foot(flank, flank->high_mm).across_mm > LM_REAL(0))) {
    return refuse_contradiction(fault, "flank.rho_a, flank.l_a",
                                arc_foot(flank, flank->high_mm).across_mm / m, LM_REAL(0),
                                REAL_INFINITY);
  }
  if (!(arc_foot(flank, flank->low_mm).across_mm <
        LM_PI / LM_REAL(g->flexspline_teeth) * flank->low_mm)) {
    return refuse_contradiction(fault, "flank.rho_f, flank.l_f",
                                arc_foot(flank, flank->low_mm).across_mm / m, LM_REAL(0),
                                LM_PI / LM_REAL(g->flexspline_teeth) * flank->low_mm / m);
  }
  return LM_OK;
}

/* What an involute leaves at 0; the other ranges are those of the list of keys. */
static lm_status check_form(const lm_flank_form *form, lm_fault *fault) {
  lm_status status = check_range(fault, "flank.rho_a", form->rho_a, LM_REAL(0.2), LM_REAL(20));
  if (status == LM_OK) {
    status = check_range(fault, "flank.rho_f", form->rho_f, LM_REAL(0.2), LM_REAL(20));
  }
  if (status == LM_OK && form->delta_L_rad > LM_REAL(0)) {
    status = check_range(fault, "flank.h_l", form->h_l, LM_REAL(0.01), LM_REAL(2));
  }
  return status;
}

/* --- any flank -----------------------------------------------------------------------------------
 */

lm_status lm_make_flank(const lm_drive *drive, const lm_geometry *geometry, int relieved,
                        lm_flank *flank, lm_fault *fault) {
  const lm_geometry *g = geometry;
  lm_flank made;
  lm_status status = LM_OK;
  if (drive == 0 || geometry == 0 || flank == 0) {
    return refuse(fault, LM_NULL, "drive, geometry, flank");
  }
  made.kind = drive->teeth.flexspline_flank;
  made.neutral_mm = g->neutral_mm;
  made.involute = g->flexspline;
  made.joints = 0;
  made.relief_mm = relieved ? drive->flank.tip_relief_mm : LM_REAL(0);
  if (g->deformation == LM_INTERNAL) {
    made.low_mm = g->flexspline_root_mm;
    made.high_mm = g->flexspline_tip_mm;
  } else {
    made.low_mm = g->flexspline_tip_mm;
    made.high_mm = g->flexspline_root_mm;
    made.relief_mm = LM_REAL(0);
  }
  if (made.kind == LM_FLANK_DOUBLE_ARC) {
    status = check_form(&drive->flank, fault);
    if (status == LM_OK) {
      status = make_arc(drive, g, &made.arc, fault);
    }
    if (status == LM_OK) {
      status = check_arc(&made, g, fault);
    }
    if (status == LM_OK) {
      made.joints = 2;
      made.joint_mm[0] = made.neutral_mm + made.arc.lower_mm;
      made.joint_mm[1] = made.neutral_mm + made.arc.upper_mm;
    }
  } else if (g->deformation == LM_INTERNAL && made.low_mm < g->flexspline.base_mm) {
    made.low_mm = g->flexspline.base_mm;
  }
  made.relief_from_mm = made.high_mm - drive->flank.tip_relief_height * g->module_mm;
  if (status == LM_OK) {
    *flank = made;
  }
  return status;
}

lm_flank_foot lm_evaluate_flank(const lm_flank *flank, lm_real parameter_mm) {
  lm_flank_foot foot = flank->kind == LM_FLANK_DOUBLE_ARC ? arc_foot(flank, parameter_mm)
                                                          : involute_foot(flank, parameter_mm);
  if (flank->relief_mm > LM_REAL(0) && parameter_mm > flank->relief_from_mm) {
    const lm_real height = flank->high_mm - flank->relief_from_mm;
    const lm_real share = (parameter_mm - flank->relief_from_mm) / height;
    foot.across_mm -= flank->relief_mm * share * share;
    foot.across_slope -= LM_REAL(2) * flank->relief_mm * share / height;
  }
  return foot;
}

lm_real lm_flank_curvature(const lm_flank *flank, lm_real parameter_mm) {
  if (flank->kind == LM_FLANK_DOUBLE_ARC) {
    const lm_real along = parameter_mm - flank->neutral_mm;
    if (along >= flank->arc.upper_mm) {
      return LM_REAL(1) / flank->arc.convex_mm;
    }
    return along > flank->arc.lower_mm ? LM_REAL(0) : LM_REAL(-1) / flank->arc.concave_mm;
  }
  /* The string unrolled from the base circle is the radius of curvature. */
  return LM_REAL(1) /
         (flank->involute.base_mm * lm_evaluate_involute(&flank->involute, parameter_mm).tangent);
}

lm_real lm_flank_at_radius(const lm_flank *flank, lm_real radius_mm) {
  lm_real parameter = radius_mm;
  int i;
  if (flank->kind != LM_FLANK_INVOLUTE) {
    for (i = 0; i < RADIUS_STEPS; i++) {
      lm_flank_foot foot;
      lm_real height;
      lm_real radius;
      parameter = parameter < flank->low_mm ? flank->low_mm : parameter;
      parameter = parameter > flank->high_mm ? flank->high_mm : parameter;
      foot = lm_evaluate_flank(flank, parameter);
      height = flank->neutral_mm + foot.along_mm;
      radius = real_sqrt(height * height + foot.across_mm * foot.across_mm);
      parameter += (radius_mm - radius) * radius /
                   (height * foot.along_slope + foot.across_mm * foot.across_slope);
    }
  }
  parameter = parameter < flank->low_mm ? flank->low_mm : parameter;
  return parameter > flank->high_mm ? flank->high_mm : parameter;
}
