#include "lostmotion/flank.h"

#include "real_math.h"
#include "refuse.h"

/* Newton on the distance from the gear's centre; the flank is nearly radial, so the error after
 * three steps is rounding. */
#define RADIUS_STEPS 3

/* --- involute --------------------------------------------------------------------------------- */

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

/* The same of a tooth that points inwards: the rest of the pitch beside the space. */
static lm_flank_foot involute_tooth_foot(const lm_flank *flank, lm_real parameter_mm) {
  const lm_real radius = LM_REAL(2) * flank->neutral_mm - parameter_mm;
  const lm_involute_point at = lm_evaluate_involute(&flank->involute, radius);
  const lm_real half = flank->pitch_half_rad - at.half_angle_rad;
  const lm_real s = real_sin(half);
  const lm_real c = real_cos(half);
  lm_flank_foot foot;
  foot.radius_mm = parameter_mm;
  foot.across_mm = radius * s;
  foot.along_mm = flank->neutral_mm - radius * c;
  foot.across_slope = -s - at.tangent * c;
  foot.along_slope = c - at.tangent * s;
  return foot;
}

/* --- double arc ------------------------------------------------------------------------------- */

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

/* y of the reference circle, displaced as the tool is. */
static lm_real reference_of(const lm_drive *drive, const lm_geometry *g, const lm_flank *flank) {
  const lm_real above =
      g->module_mm * (LM_REAL(g->flexspline_teeth) / LM_REAL(2) + drive->teeth.flexspline_shift) -
      g->neutral_mm;
  return flank->inward ? -above : above;
}

/* Centres, and the tangent that both arcs have in common (theory/flanks.md). */
static lm_status make_arc(const lm_drive *drive, const lm_geometry *g, lm_flank *flank,
                          lm_fault *fault) {
  const lm_flank_form *form = &drive->flank;
  const lm_real m = g->module_mm;
  const lm_real reference = reference_of(drive, g, flank);
  lm_double_arc *arc = &flank->arc;
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

/* Whether the arcs reach tip and root, and form a tooth. */
static lm_status check_arc(const lm_flank *flank, const lm_geometry *g, lm_fault *fault) {
  const lm_double_arc *arc = &flank->arc;
  const lm_real tip = flank->high_mm - flank->neutral_mm;
  const lm_real root = flank->low_mm - flank->neutral_mm;
  const lm_real m = g->module_mm;
  if (!(tip - arc->convex_along_mm < arc->convex_mm)) {
    return refuse_contradiction(
        fault,
        flank->inward ? "flank.rho_a, teeth.engagement_depth" : "flank.rho_a, teeth.tooth_height",
        arc->convex_mm / m, (tip - arc->convex_along_mm) / m, REAL_INFINITY);
  }
  if (!(tip > arc->upper_mm)) {
    return refuse_contradiction(fault, "flank.rho_a, flank.X_a", arc->upper_mm / m, root / m,
                                tip / m);
  }
  if (!(arc->concave_along_mm - root < arc->concave_mm)) {
    return refuse_contradiction(fault,
                                flank->inward ? "flank.rho_f, generator.deflection_mm"
                                              : "flank.rho_f, teeth.root_clearance",
                                arc->concave_mm / m, (arc->concave_along_mm - root) / m,
                                REAL_INFINITY);
  }
  if (!(root < arc->lower_mm)) {
    return refuse_contradiction(fault, "flank.rho_f, flank.X_f", arc->lower_mm / m, root / m,
                                tip / m);
  }
  return LM_OK;
}

/* Keys that are 0 for an involute; the other ranges are those of the list of keys. */
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

/* --- S tooth ---------------------------------------------------------------------------------- */

/* Newton for the tangent from the datum point; from its first term in 1 - kappa, the error after
 * five steps is rounding. */
#define TANGENT_STEPS 6

/* theta of the end of the tangent through the origin: (1 + kappa) tan(theta / 2) = theta, with
 * kappa below 1. */
static lm_real tangent_end(lm_real kappa) {
  const lm_real ratio = LM_REAL(2) / (LM_REAL(1) + kappa);
  lm_real half;
  int i;
  half = real_sqrt(LM_REAL(3) * (ratio - LM_REAL(1)));
  for (i = 0; i < TANGENT_STEPS; i++) {
    const lm_real t = real_tan(half);
    half -= (t - ratio * half) / (LM_REAL(1) + t * t - ratio);
  }
  return LM_REAL(2) * half;
}

static lm_s_tooth make_s(const lm_drive *drive, const lm_geometry *g, const lm_flank *flank) {
  const lm_flank_form *form = &drive->flank;
  const lm_real m = g->module_mm;
  const lm_real theta = tangent_end(form->kappa);
  lm_s_tooth s;
  s.kappa = form->kappa;
  s.module_mm = m;
  s.datum_mm = reference_of(drive, g, flank) + form->X_M * m;
  s.datum_across_mm = form->s_M * m / LM_REAL(2);
  s.straight_mm = LM_REAL(0.5) * s.kappa * m * (LM_REAL(1) - real_cos(theta));
  s.tangent = LM_REAL(0.25) * m * (theta - s.kappa * real_sin(theta)) / s.straight_mm;
  return s;
}

/* Displacement of the flank inwards (below the datum point outwards) at a height from the datum
 * point, its slope, and the derivative of the slope by the height. */
static lm_real s_draw(const lm_s_tooth *s, lm_real height_mm, lm_real *slope, lm_real *bend) {
  const lm_real span = LM_REAL(0.5) * s->kappa * s->module_mm;
  const lm_real versine = height_mm / span; /* 1 - cos theta */
  lm_real half;                             /* tan(theta / 2) */
  lm_real sine;
  if (!(height_mm > s->straight_mm)) {
    *slope = s->tangent;
    *bend = LM_REAL(0);
    return height_mm * s->tangent;
  }
  half = real_sqrt(versine / (LM_REAL(2) - versine));
  sine = (LM_REAL(2) - versine) * half;
  *slope = (LM_REAL(1) - s->kappa + s->kappa * versine) / (LM_REAL(2) * s->kappa * sine);
  *bend = (LM_REAL(0.5) - *slope * (LM_REAL(1) - versine) / sine) / (sine * span);
  return LM_REAL(0.25) * s->module_mm * (LM_REAL(2) * real_atan(half) - s->kappa * sine);
}

static lm_flank_foot s_foot(const lm_flank *flank, lm_real parameter_mm) {
  const lm_real height = parameter_mm - flank->neutral_mm - flank->s.datum_mm;
  lm_flank_foot foot;
  lm_real slope;
  lm_real bend;
  const lm_real draw = s_draw(&flank->s, real_fabs(height), &slope, &bend);
  foot.radius_mm = parameter_mm;
  foot.along_mm = parameter_mm - flank->neutral_mm;
  foot.along_slope = LM_REAL(1);
  foot.across_mm = flank->s.datum_across_mm + (height > LM_REAL(0) ? -draw : draw);
  foot.across_slope = -slope;
  return foot;
}

static lm_real s_curvature(const lm_flank *flank, lm_real parameter_mm) {
  const lm_real height = parameter_mm - flank->neutral_mm - flank->s.datum_mm;
  lm_real slope;
  lm_real bend;
  lm_real square;
  s_draw(&flank->s, real_fabs(height), &slope, &bend);
  square = LM_REAL(1) + slope * slope;
  return (height > LM_REAL(0) ? bend : -bend) / (square * real_sqrt(square));
}

/* The path reverses at theta = 180 deg. */
static lm_status check_s(const lm_flank *flank, lm_fault *fault) {
  const lm_s_tooth *s = &flank->s;
  const lm_real datum = flank->neutral_mm + s->datum_mm;
  const lm_real up = (flank->high_mm - datum) / s->module_mm;
  const lm_real down = (datum - flank->low_mm) / s->module_mm;
  if (!(up < s->kappa)) {
    return refuse_contradiction(
        fault,
        flank->inward ? "flank.kappa, teeth.engagement_depth" : "flank.kappa, teeth.tooth_height",
        s->kappa, up, REAL_INFINITY);
  }
  if (!(down < s->kappa)) {
    return refuse_contradiction(fault,
                                flank->inward ? "flank.kappa, generator.deflection_mm"
                                              : "flank.kappa, teeth.root_clearance",
                                s->kappa, down, REAL_INFINITY);
  }
  return LM_OK;
}

/* --- points ----------------------------------------------------------------------------------- */

/* Cubic by the height between two points. */
typedef struct spline_piece {
  lm_real x; /* 0 .. 1 */
  lm_real width_mm;
  lm_real low_mm;
  lm_real high_mm;
  lm_real slope_low;
  lm_real slope_high;
} spline_piece;

static spline_piece find_piece(const lm_flank *flank, lm_real parameter_mm) {
  const lm_flank_points *p = flank->points;
  const lm_real radius =
      flank->inward ? LM_REAL(2) * flank->neutral_mm - parameter_mm : parameter_mm;
  const lm_real along = radius - flank->points_shift_mm;
  spline_piece piece;
  int low = 0;
  int high = p->count - 1;
  while (high - low > 1) {
    const int middle = (low + high) / 2;
    if (along < LM_REAL(p->along_mm[middle])) {
      high = middle;
    } else {
      low = middle;
    }
  }
  piece.width_mm = LM_REAL(p->along_mm[high] - p->along_mm[low]);
  piece.x = (along - LM_REAL(p->along_mm[low])) / piece.width_mm;
  piece.low_mm = LM_REAL(p->across_mm[low]);
  piece.high_mm = LM_REAL(p->across_mm[high]);
  piece.slope_low = LM_REAL(p->slope[low]);
  piece.slope_high = LM_REAL(p->slope[high]);
  return piece;
}

static lm_flank_foot points_foot(const lm_flank *flank, lm_real parameter_mm) {
  const spline_piece p = find_piece(flank, parameter_mm);
  const lm_real rest = LM_REAL(1) - p.x;
  lm_flank_foot foot;
  foot.radius_mm = parameter_mm;
  foot.along_mm = parameter_mm - flank->neutral_mm;
  foot.along_slope = LM_REAL(1);
  foot.across_mm =
      rest * rest * ((LM_REAL(1) + LM_REAL(2) * p.x) * p.low_mm + p.x * p.width_mm * p.slope_low) +
      p.x * p.x * ((LM_REAL(1) + LM_REAL(2) * rest) * p.high_mm - rest * p.width_mm * p.slope_high);
  foot.across_slope = LM_REAL(6) * p.x * rest * (p.high_mm - p.low_mm) / p.width_mm +
                      rest * (LM_REAL(1) - LM_REAL(3) * p.x) * p.slope_low +
                      p.x * (LM_REAL(1) - LM_REAL(3) * rest) * p.slope_high;
  foot.across_slope = flank->inward ? -foot.across_slope : foot.across_slope;
  return foot;
}

static lm_real points_curvature(const lm_flank *flank, lm_real parameter_mm) {
  const spline_piece p = find_piece(flank, parameter_mm);
  const lm_real slope = points_foot(flank, parameter_mm).across_slope;
  const lm_real square = LM_REAL(1) + slope * slope;
  const lm_real bend =
      (LM_REAL(6) * (LM_REAL(1) - LM_REAL(2) * p.x) * (p.high_mm - p.low_mm) / p.width_mm +
       (LM_REAL(6) * p.x - LM_REAL(4)) * p.slope_low +
       (LM_REAL(6) * p.x - LM_REAL(2)) * p.slope_high) /
      p.width_mm;
  return -bend / (square * real_sqrt(square));
}

static lm_status check_points(const lm_flank *flank, const lm_geometry *g, lm_fault *fault) {
  const lm_flank_points *p = flank->points;
  const lm_real hair = LM_REAL(1e-6) * g->module_mm;
  const lm_real inner = flank->inward ? g->flexspline_tip_mm : flank->low_mm;
  const lm_real outer = flank->inward ? g->flexspline_root_mm : flank->high_mm;
  lm_real first;
  lm_real last;
  int i;
  if (p == 0) {
    return refuse(fault, LM_NULL, "flank.points");
  }
  if (p->count < 4 || p->count > LM_FLANK_POINTS_MAX) {
    return refuse_range(fault, "flank.points", LM_REAL(p->count), LM_REAL(4),
                        LM_REAL(LM_FLANK_POINTS_MAX));
  }
  for (i = 1; i < p->count; i++) {
    if (!(p->along_mm[i] > p->along_mm[i - 1])) {
      return refuse(fault, LM_NOT_MONOTONE, "flank.points");
    }
  }
  first = LM_REAL(p->along_mm[0]) + flank->points_shift_mm;
  last = LM_REAL(p->along_mm[p->count - 1]) + flank->points_shift_mm;
  if (!(last >= outer - hair)) {
    return refuse_contradiction(fault,
                                flank->inward ? "flank.points, generator.deflection_mm"
                                              : "flank.points, teeth.tooth_height",
                                last, outer, REAL_INFINITY);
  }
  if (!(first <= inner + hair)) {
    return refuse_contradiction(fault,
                                flank->inward ? "flank.points, teeth.engagement_depth"
                                              : "flank.points, teeth.root_clearance",
                                first, LM_REAL(0), inner);
  }
  return LM_OK;
}

/* --- any flank -------------------------------------------------------------------------------- */

/* Whether the tooth has thickness at its tip, and a space at its root. */
static lm_status check_thickness(const lm_flank *flank, const lm_geometry *g, const char *tip_keys,
                                 const char *root_keys, lm_fault *fault) {
  const lm_real m = g->module_mm;
  const lm_real room = LM_PI / LM_REAL(g->flexspline_teeth) *
                       (flank->inward ? g->flexspline_root_mm : flank->low_mm);
  const lm_real tip = lm_evaluate_tooth_flank(flank, flank->high_mm).across_mm;
  const lm_real root = lm_evaluate_tooth_flank(flank, flank->low_mm).across_mm;
  if (!(tip > LM_REAL(0))) {
    return refuse_contradiction(fault, tip_keys, tip / m, LM_REAL(0), REAL_INFINITY);
  }
  if (!(root < room)) {
    return refuse_contradiction(fault, root_keys, root / m, LM_REAL(0), room / m);
  }
  return LM_OK;
}

static void join(lm_flank *flank, lm_real low, lm_real high) {
  flank->joints = 2;
  flank->joint_mm[0] = flank->neutral_mm + low;
  flank->joint_mm[1] = flank->neutral_mm + high;
}

static lm_status make_double_arc(const lm_drive *drive, const lm_geometry *g, lm_flank *flank,
                                 lm_fault *fault) {
  lm_status status = check_form(&drive->flank, fault);
  if (status == LM_OK) {
    status = make_arc(drive, g, flank, fault);
  }
  if (status == LM_OK) {
    status = check_arc(flank, g, fault);
  }
  if (status == LM_OK) {
    join(flank, flank->arc.lower_mm, flank->arc.upper_mm);
    status = check_thickness(flank, g, "flank.rho_a, flank.l_a", "flank.rho_f, flank.l_f", fault);
  }
  return status;
}

static lm_status make_s_tooth(const lm_drive *drive, const lm_geometry *g, lm_flank *flank,
                              lm_fault *fault) {
  lm_status status =
      check_range(fault, "flank.kappa", drive->flank.kappa, LM_REAL(0.5), LM_REAL(LM_KAPPA_MOST));
  if (status == LM_OK) {
    status = check_range(fault, "flank.s_M", drive->flank.s_M, LM_REAL(0.5), LM_REAL(2.5));
  }
  if (status == LM_OK) {
    flank->s = make_s(drive, g, flank);
    status = check_s(flank, fault);
  }
  if (status == LM_OK) {
    join(flank, flank->s.datum_mm - flank->s.straight_mm, flank->s.datum_mm + flank->s.straight_mm);
    status = check_thickness(
        flank, g,
        flank->inward ? "flank.s_M, teeth.engagement_depth" : "flank.s_M, teeth.tooth_height",
        flank->inward ? "flank.s_M, generator.deflection_mm" : "flank.s_M, teeth.root_clearance",
        fault);
  }
  return status;
}

static lm_status make_points(const lm_drive *drive, const lm_geometry *g, lm_flank *flank,
                             lm_fault *fault) {
  lm_status status;
  flank->points = drive->flank.points;
  flank->points_shift_mm = drive->teeth.flexspline_shift * g->module_mm;
  status = check_points(flank, g, fault);
  if (status == LM_OK) {
    status = check_thickness(
        flank, g,
        flank->inward ? "flank.points, teeth.engagement_depth" : "flank.points, teeth.tooth_height",
        flank->inward ? "flank.points, generator.deflection_mm"
                      : "flank.points, teeth.root_clearance",
        fault);
  }
  return status;
}

int lm_flank_fits(int kind, int rigid) {
  switch (kind) {
    case LM_FLANK_INVOLUTE:
      return 1;
    case LM_FLANK_CONJUGATE:
      return rigid;
    case LM_FLANK_DOUBLE_ARC:
    case LM_FLANK_S_TOOTH:
      return !rigid;
    default:
      return kind == LM_FLANK_POINTS;
  }
}

/* Data of one kind of flank; the ends of the flank are known. */
static lm_status make_kind(const lm_drive *drive, const lm_geometry *g, lm_flank *flank,
                           lm_fault *fault) {
  switch (flank->kind) {
    case LM_FLANK_DOUBLE_ARC:
      return make_double_arc(drive, g, flank, fault);
    case LM_FLANK_S_TOOTH:
      return make_s_tooth(drive, g, flank, fault);
    case LM_FLANK_POINTS:
      return make_points(drive, g, flank, fault);
    default:
      if (g->deformation == LM_INTERNAL && flank->low_mm < g->flexspline.base_mm) {
        flank->low_mm = g->flexspline.base_mm;
      }
      return LM_OK;
  }
}

static lm_flank_foot foot_of_kind(const lm_flank *flank, lm_real parameter_mm) {
  switch (flank->kind) {
    case LM_FLANK_DOUBLE_ARC:
      return arc_foot(flank, parameter_mm);
    case LM_FLANK_S_TOOTH:
      return s_foot(flank, parameter_mm);
    case LM_FLANK_POINTS:
      return points_foot(flank, parameter_mm);
    default:
      return flank->inward ? involute_tooth_foot(flank, parameter_mm)
                           : involute_foot(flank, parameter_mm);
  }
}

lm_status lm_make_flank(const lm_drive *drive, const lm_geometry *geometry, int relieved,
                        lm_flank *flank, lm_fault *fault) {
  const lm_geometry *g = geometry;
  lm_flank made;
  lm_status status;
  if (drive == 0 || geometry == 0 || flank == 0) {
    return refuse(fault, LM_NULL, "drive, geometry, flank");
  }
  made.kind = drive->teeth.flexspline_flank;
  made.neutral_mm = g->neutral_mm;
  made.involute = g->flexspline;
  made.joints = 0;
  made.points = 0;
  made.points_shift_mm = LM_REAL(0);
  made.relief_mm = relieved ? drive->flank.tip_relief_mm : LM_REAL(0);
  made.inward = g->deformation == LM_EXTERNAL &&
                (made.kind != LM_FLANK_INVOLUTE || drive->teeth.rigid_flank != LM_FLANK_INVOLUTE ||
                 drive->flank.tip_relief_mm > LM_REAL(0));
  made.pitch_half_rad = LM_PI / LM_REAL(g->flexspline_teeth);
  made.pitch_half_sin = real_sin(made.pitch_half_rad);
  made.pitch_half_cos = real_cos(made.pitch_half_rad);
  if (g->deformation == LM_INTERNAL) {
    made.low_mm = g->flexspline_root_mm;
    made.high_mm = g->flexspline_tip_mm;
  } else if (made.inward) {
    made.low_mm = LM_REAL(2) * g->neutral_mm - g->flexspline_root_mm;
    made.high_mm = LM_REAL(2) * g->neutral_mm - g->flexspline_tip_mm;
  } else {
    made.low_mm = g->flexspline_tip_mm;
    made.high_mm = g->flexspline_root_mm;
  }
  made.relief_from_mm = made.high_mm - drive->flank.tip_relief_height * g->module_mm;
  status = made.kind == LM_FLANK_INVOLUTE || lm_flank_fits((int)made.kind, 0)
               ? make_kind(drive, g, &made, fault)
               : refuse(fault, LM_INCONSISTENT, "teeth.flexspline_flank");
  if (status == LM_OK) {
    *flank = made;
  }
  return status;
}

lm_flank_foot lm_evaluate_tooth_flank(const lm_flank *flank, lm_real parameter_mm) {
  lm_flank_foot foot = foot_of_kind(flank, parameter_mm);
  if (flank->relief_mm > LM_REAL(0) && parameter_mm > flank->relief_from_mm) {
    const lm_real height = flank->high_mm - flank->relief_from_mm;
    const lm_real share = (parameter_mm - flank->relief_from_mm) / height;
    foot.across_mm -= flank->relief_mm * share * share;
    foot.across_slope -= LM_REAL(2) * flank->relief_mm * share / height;
  }
  return foot;
}

/* The space beside the tooth, at growing angles: the tooth's flank at falling angles, turned by half
 * a pitch. */
static lm_flank_foot beside_space(const lm_flank *flank, const lm_flank_foot *own) {
  const lm_real s = flank->pitch_half_sin;
  const lm_real c = flank->pitch_half_cos;
  const lm_real height = flank->neutral_mm - own->along_mm;
  lm_flank_foot foot;
  foot.radius_mm = own->radius_mm;
  foot.along_mm = height * c + own->across_mm * s - flank->neutral_mm;
  foot.across_mm = height * s - own->across_mm * c;
  foot.along_slope = own->across_slope * s - own->along_slope * c;
  foot.across_slope = -own->along_slope * s - own->across_slope * c;
  return foot;
}

lm_flank_foot lm_evaluate_flank(const lm_flank *flank, lm_real parameter_mm) {
  const lm_flank_foot own = lm_evaluate_tooth_flank(flank, parameter_mm);
  return flank->inward ? beside_space(flank, &own) : own;
}

lm_real lm_flank_curvature(const lm_flank *flank, lm_real parameter_mm) {
  if (flank->kind == LM_FLANK_S_TOOTH) {
    return s_curvature(flank, parameter_mm);
  }
  if (flank->kind == LM_FLANK_POINTS) {
    return points_curvature(flank, parameter_mm);
  }
  if (flank->kind == LM_FLANK_DOUBLE_ARC) {
    const lm_real along = parameter_mm - flank->neutral_mm;
    if (along >= flank->arc.upper_mm) {
      return LM_REAL(1) / flank->arc.convex_mm;
    }
    return along > flank->arc.lower_mm ? LM_REAL(0) : LM_REAL(-1) / flank->arc.concave_mm;
  }
  /* The string unrolled from the base circle is the radius of curvature. */
  {
    const lm_real radius =
        flank->inward ? LM_REAL(2) * flank->neutral_mm - parameter_mm : parameter_mm;
    const lm_real curvature = LM_REAL(1) / (flank->involute.base_mm *
                                            lm_evaluate_involute(&flank->involute, radius).tangent);
    return flank->inward ? -curvature : curvature;
  }
}

/* --- bounds of the second derivatives --------------------------------------------------------- */

static void include(lm_plain value, lm_plain *least, lm_plain *most) {
  *least = value < *least ? value : *least;
  *most = value > *most ? value : *most;
}

/* Of x between two heights of the same piece of arcs: R^2 / h^3 with the half chord h, which has its
 * maximum on the height of the centre. */
static void bound_arc(const lm_flank *flank, lm_plain from, lm_plain to, lm_plain *least,
                      lm_plain *most) {
  const lm_double_arc *arc = &flank->arc;
  const lm_plain middle = (from + to) / LM_PLAIN(2);
  const int convex = middle > LM_VALUE(arc->upper_mm);
  const lm_plain radius = LM_VALUE(convex ? arc->convex_mm : arc->concave_mm);
  const lm_plain centre = LM_VALUE(convex ? arc->convex_along_mm : arc->concave_along_mm);
  const lm_plain end[2] = {from - centre, to - centre};
  int i;
  if (!convex && middle > LM_VALUE(arc->lower_mm)) {
    *least = LM_PLAIN(0);
    *most = LM_PLAIN(0);
    return;
  }
  for (i = 0; i < 2; i++) {
    const lm_plain half = plain_sqrt((radius - end[i]) * (radius + end[i]));
    const lm_plain bend = radius * radius / (half * half * half);
    include(convex ? -bend : bend, least, most);
  }
  if (end[0] * end[1] < LM_PLAIN(0)) {
    include((convex ? LM_PLAIN(-1) : LM_PLAIN(1)) / radius, least, most);
  }
}

/* Of the S tooth between two heights on one side of its datum point: with c = cos theta,
 * (kappa - c) / (2 kappa span (1 - c^2)^(3/2)), which has its extremes where
 * 2 c^2 - 3 kappa c + 1 = 0. */
static void bound_s(const lm_flank *flank, lm_plain from, lm_plain to, lm_plain *least,
                    lm_plain *most) {
  const lm_plain kappa = LM_VALUE(flank->s.kappa);
  const lm_plain datum = LM_VALUE(flank->s.datum_mm);
  const lm_plain span = LM_PLAIN(0.5) * kappa * LM_VALUE(flank->s.module_mm);
  const lm_plain above = (from + to) / LM_PLAIN(2) - datum;
  const lm_plain root = LM_PLAIN(9) * kappa * kappa - LM_PLAIN(8);
  const lm_plain first = LM_PLAIN(1) - plain_fabs(from - datum) / span;
  const lm_plain last = LM_PLAIN(1) - plain_fabs(to - datum) / span;
  lm_plain place[4];
  int count = 2;
  int i;
  if (!(plain_fabs(above) > LM_VALUE(flank->s.straight_mm))) {
    *least = LM_PLAIN(0);
    *most = LM_PLAIN(0);
    return;
  }
  place[0] = first;
  place[1] = last;
  if (root > LM_PLAIN(0)) {
    const lm_plain apart = plain_sqrt(root);
    for (i = -1; i <= 1; i += 2) {
      const lm_plain extreme = (LM_PLAIN(3) * kappa + LM_PLAIN(i) * apart) / LM_PLAIN(4);
      if ((extreme - first) * (extreme - last) < LM_PLAIN(0)) {
        place[count++] = extreme;
      }
    }
  }
  for (i = 0; i < count; i++) {
    const lm_plain square = (LM_PLAIN(1) - place[i]) * (LM_PLAIN(1) + place[i]);
    const lm_plain bend =
        (kappa - place[i]) / (LM_PLAIN(2) * kappa * span * square * plain_sqrt(square));
    include(above > LM_PLAIN(0) ? -bend : bend, least, most);
  }
}

/* The second derivative of a cubic by the height, at one of its ends. */
static lm_plain end_bend(const lm_flank_points *p, int piece, int upper) {
  const lm_plain width = LM_PLAIN(p->along_mm[piece + 1] - p->along_mm[piece]);
  const lm_plain chord = LM_PLAIN(p->across_mm[piece + 1] - p->across_mm[piece]) / width;
  const lm_plain low = LM_PLAIN(p->slope[piece]);
  const lm_plain high = LM_PLAIN(p->slope[piece + 1]);
  return (upper ? LM_PLAIN(2) * low + LM_PLAIN(4) * high - LM_PLAIN(6) * chord
                : LM_PLAIN(6) * chord - LM_PLAIN(4) * low - LM_PLAIN(2) * high) /
         width;
}

/* Of a spline: linear in every piece that the heights touch, so it has its extremes at the points. */
static void bound_points(const lm_flank *flank, lm_plain from, lm_plain to, lm_plain *least,
                         lm_plain *most) {
  const lm_flank_points *p = flank->points;
  const lm_plain zero = LM_VALUE(flank->neutral_mm) - LM_VALUE(flank->points_shift_mm);
  const lm_plain a = flank->inward ? zero - to : zero + from;
  const lm_plain b = flank->inward ? zero - from : zero + to;
  int i;
  for (i = 0; i + 1 < p->count; i++) {
    if ((i + 2 == p->count || LM_PLAIN(p->along_mm[i + 1]) > a) &&
        (i == 0 || LM_PLAIN(p->along_mm[i]) < b)) {
      include(end_bend(p, i, 0), least, most);
      include(end_bend(p, i, 1), least, most);
    }
  }
}

/* Of an involute in its own frame, by the radius: the string is the tangent of the base circle, so
 * the second derivative has the part 1 / r_b along the flank, and 1 / (r_b sin a cos a) across it:
 * both components are monotone up to a = 38 deg. */
static lm_flank_bend bound_involute(const lm_flank *flank, lm_real from_mm, lm_real to_mm) {
  const lm_real end[2] = {from_mm, to_mm};
  const lm_plain base = LM_VALUE(flank->involute.base_mm);
  lm_flank_bend bend = {PLAIN_INFINITY, -PLAIN_INFINITY, PLAIN_INFINITY, -PLAIN_INFINITY};
  int i;
  for (i = 0; i < 2; i++) {
    const lm_real radius = flank->inward ? LM_REAL(2) * flank->neutral_mm - end[i] : end[i];
    const lm_involute_point at = lm_evaluate_involute(&flank->involute, radius);
    const lm_real turn = at.half_angle_rad - at.pressure_angle_rad;
    const lm_plain s = LM_VALUE(real_sin(turn));
    const lm_plain c = LM_VALUE(real_cos(turn));
    const lm_plain tangent = LM_VALUE(at.tangent);
    const lm_plain across = (LM_PLAIN(1) + tangent * tangent) / tangent;
    include((s - across * c) / base, &bend.across_least, &bend.across_most);
    include((c + across * s) / base, &bend.along_least, &bend.along_most);
  }
  return bend;
}

/* The tip relief begins with its whole curvature. */
static void bound_relief(const lm_flank *flank, lm_plain from_mm, lm_plain to_mm, lm_plain *least,
                         lm_plain *most) {
  const lm_plain begin = LM_VALUE(flank->relief_from_mm);
  const lm_plain height = LM_VALUE(flank->high_mm) - begin;
  *least = LM_PLAIN(0);
  *most = LM_PLAIN(0);
  if (LM_VALUE(flank->relief_mm) > LM_PLAIN(0) && to_mm > begin) {
    *most = LM_PLAIN(2) * LM_VALUE(flank->relief_mm) / (height * height);
    *least = from_mm > begin ? *most : LM_PLAIN(0);
  }
}

lm_flank_bend lm_bound_flank_bend(const lm_flank *flank, lm_real from_mm, lm_real to_mm) {
  const lm_plain from = LM_VALUE(from_mm - flank->neutral_mm);
  const lm_plain to = LM_VALUE(to_mm - flank->neutral_mm);
  const lm_plain s = LM_VALUE(flank->pitch_half_sin);
  const lm_plain c = LM_VALUE(flank->pitch_half_cos);
  lm_plain least = PLAIN_INFINITY;
  lm_plain most = -PLAIN_INFINITY;
  lm_plain relief_least;
  lm_plain relief_most;
  lm_flank_bend bend;
  bound_relief(flank, LM_VALUE(from_mm), LM_VALUE(to_mm), &relief_least, &relief_most);
  if (flank->kind == LM_FLANK_INVOLUTE) {
    bend = bound_involute(flank, from_mm, to_mm);
    if (flank->inward) { /* the space beside the tooth is wider by the relief */
      bend.across_least += relief_least * c;
      bend.across_most += relief_most * c;
      bend.along_least -= relief_most * s;
      bend.along_most -= relief_least * s;
    } else {
      bend.across_least -= relief_most;
      bend.across_most -= relief_least;
    }
    return bend;
  }
  if (flank->kind == LM_FLANK_DOUBLE_ARC) {
    bound_arc(flank, from, to, &least, &most);
  } else if (flank->kind == LM_FLANK_S_TOOTH) {
    bound_s(flank, from, to, &least, &most);
  } else {
    bound_points(flank, from, to, &least, &most);
  }
  least -= relief_most;
  most -= relief_least;
  bend.across_least = flank->inward ? -most * c : least;
  bend.across_most = flank->inward ? -least * c : most;
  bend.along_least = flank->inward ? least * s : LM_PLAIN(0);
  bend.along_most = flank->inward ? most * s : LM_PLAIN(0);
  return bend;
}

lm_real lm_flank_at_radius(const lm_flank *flank, lm_real radius_mm) {
  lm_real parameter = flank->inward ? LM_REAL(2) * flank->neutral_mm - radius_mm : radius_mm;
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
