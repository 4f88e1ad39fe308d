#include "lostmotion/tooth_outline.h"

#include "real_math.h"

/* Regula falsi with the Illinois correction, then Newton with one slope, as mesh.c: a bracket of
 * the width of rounding has no usable slope. Each step of Newton reduces the error to a few
 * hundredths, in the value and in its derivatives by the dimensions of the drive. */
#define ILLINOIS_STEPS 4
#define NEWTON_STEPS 5
#define SLOPE_SHARE LM_REAL(0.015625) /* of the bracket */

/* The smallest full fillet, as a share of the rack's: a narrower space has hardly any root. */
#define FULL_SHARE LM_REAL(0.01)

/* Distance from the edge of a shoulder on both sides, so that rounding does not choose the side. */
#if LM_REAL_BITS == 32
#define EDGE_MODULES LM_REAL(1e-3)
#else
#define EDGE_MODULES LM_REAL(1e-6)
#endif

/* Sections on the fillet and on the flank that are compared for the largest stress. */
#define LEWIS_SECTIONS 16

/* From root to tip. */
static lm_real up(const lm_tooth_outline *o) {
  return o->outward ? LM_REAL(1) : LM_REAL(-1);
}

/* Whether heights are along the radius, and widths along the circumference. */
static int is_polar(const lm_tooth_outline *o) {
  return o->rigid || !o->outward;
}

lm_outline_point lm_outline_flank(const lm_tooth_outline *outline, lm_real height_mm) {
  const lm_mesh *mesh = outline->mesh;
  lm_outline_point point;
  if (outline->rigid) {
    const lm_real radius = outline->root_mm + up(outline) * height_mm;
    const lm_involute_point at = lm_rigid_flank_at(mesh, radius);
    const lm_real half = outline->outward
                             ? at.half_angle_rad
                             : LM_PI / LM_REAL(mesh->geometry.rigid_teeth) - at.half_angle_rad;
    point.half_mm = radius * half;
    point.angle_rad = at.pressure_angle_rad - up(outline) * half;
  } else if (outline->outward) {
    const lm_flank_foot foot = lm_evaluate_flank(&mesh->flank, outline->root_mm + height_mm);
    point.half_mm = foot.across_mm;
    point.angle_rad = real_atan(-foot.across_slope / foot.along_slope);
  } else {
    const lm_flank *flank = &mesh->flank;
    const lm_real radius = outline->root_mm - height_mm;
    const lm_flank_foot foot = lm_evaluate_tooth_flank(flank, lm_flank_at_radius(flank, radius));
    point.half_mm = radius * real_atan(foot.across_mm / (flank->neutral_mm - foot.along_mm));
    point.angle_rad = real_atan(-foot.across_slope / foot.along_slope);
  }
  return point;
}

/* Angle at the gear's centre between a point of the fillet's circle, at a radius or a height above
 * the root, and the circle's centre: exactly 0 at the root. */
static lm_real angle_in_fillet(const lm_tooth_outline *o, lm_real radius_mm, lm_real height_mm) {
  const lm_real square = height_mm * (LM_REAL(2) * o->fillet_mm - height_mm);
  const lm_real whole = LM_REAL(4) * radius_mm * o->centre_mm;
  return LM_REAL(2) * real_atan(real_sqrt(square / (whole - square)));
}

/* Point of the flank in polar coordinates about the gear's centre, from the tooth's axis. */
static void to_polar(const lm_tooth_outline *o, const lm_outline_point *at, lm_real height,
                     lm_real *radius, lm_real *angle) {
  if (is_polar(o)) {
    *radius = o->root_mm + up(o) * height;
    *angle = at->half_mm / *radius;
  } else {
    const lm_real along = o->root_mm + height;
    *radius = real_sqrt(along * along + at->half_mm * at->half_mm);
    *angle = real_atan(at->half_mm / along);
  }
}

/* Excess height above the root circle of the centre of an arc that touches the flank there. */
static lm_real centre_too_high(lm_tooth_outline *o, lm_real height) {
  const lm_outline_point at = lm_outline_flank(o, height);
  lm_real radius;
  lm_real angle;
  lm_real along;
  lm_real across;
  to_polar(o, &at, height, &radius, &angle);
  /* from the point along the normal, in the directions of its radius and across it */
  along = radius + up(o) * o->fillet_mm * real_sin(at.angle_rad + up(o) * angle);
  across = o->fillet_mm * real_cos(at.angle_rad + up(o) * angle);
  return up(o) * (real_sqrt(along * along + across * across) - o->centre_mm);
}

/* A property of the outline that grows with one of its dimensions. */
typedef lm_real (*property)(lm_tooth_outline *o, lm_real measure);

/* Zero of the property between a, where it is at_a < 0, and b. */
static lm_real zero_between(property of, lm_tooth_outline *o, lm_real a, lm_real at_a, lm_real b,
                            lm_real at_b) {
  const lm_real middle = (a + b) / LM_REAL(2);
  const lm_real width = SLOPE_SHARE * (b - a);
  lm_real at = (a * at_b - b * at_a) / (at_b - at_a);
  lm_real value = of(o, at);
  lm_real step;
  lm_real slope;
  int side = 0; /* which end the last round replaced */
  int i;
  for (i = 0; i < ILLINOIS_STEPS; i++) {
    if (value < LM_REAL(0)) {
      a = at;
      at_a = value;
      at_b = side == -1 ? at_b / LM_REAL(2) : at_b;
      side = -1;
    } else {
      b = at;
      at_b = value;
      at_a = side == 1 ? at_a / LM_REAL(2) : at_a;
      side = 1;
    }
    at = (a * at_b - b * at_a) / (at_b - at_a);
    value = of(o, at);
  }
  step = at < middle ? width : -width;
  slope = (of(o, at + step) - value) / step;
  for (i = 0; i < NEWTON_STEPS; i++) {
    at -= value / slope;
    value = of(o, at);
  }
  return at;
}

/* Point where the fillet of a radius meets the flank: at the root where the flank is flatter there
 * than the arc, as at the end of the path of an S tooth. A generated flank ends in a shoulder below
 * its radial land: the arc passes through its edge unless it touches on either side. */
static lm_real find_form(lm_tooth_outline *o) {
  const lm_mesh *mesh = o->mesh;
  const lm_real tooth =
      up(o) *
      ((o->rigid ? mesh->geometry.rigid_tip_mm : mesh->geometry.flexspline_tip_mm) - o->root_mm);
  lm_real low = LM_REAL(0);
  lm_real at_low = centre_too_high(o, LM_REAL(0));
  lm_real high = LM_REAL(2) * o->fillet_mm;
  lm_real at_high;
  if (!(at_low < LM_REAL(0))) {
    return LM_REAL(0);
  }
  if (o->rigid && up(o) * (mesh->conjugate.land_mm - o->root_mm) > LM_REAL(0)) {
    const lm_real edge = up(o) * (mesh->conjugate.land_mm - o->root_mm);
    const lm_real aside = EDGE_MODULES * mesh->geometry.module_mm;
    const lm_real on_land = centre_too_high(o, edge - aside);
    const lm_real on_flank = centre_too_high(o, edge + aside);
    if (!(on_land < LM_REAL(0))) {
      return zero_between(centre_too_high, o, low, at_low, edge - aside, on_land);
    }
    if (!(on_flank < LM_REAL(0))) {
      return edge;
    }
    low = edge + aside;
    at_low = on_flank;
    high += low;
  }
  high = high < tooth ? high : tooth;
  at_high = centre_too_high(o, high);
  return at_high > LM_REAL(0) ? zero_between(centre_too_high, o, low, at_low, high, at_high) : high;
}

/* Adds a fillet of this radius; returns how far its centre is beyond the middle of the
 * space, rad. */
static lm_real fillet_too_wide(lm_tooth_outline *o, lm_real fillet_mm) {
  const lm_geometry *g = &o->mesh->geometry;
  lm_outline_point at;
  lm_real radius;
  lm_real angle;
  o->fillet_mm = fillet_mm;
  o->centre_mm = o->root_mm + up(o) * fillet_mm;
  o->form_height_mm = find_form(o);
  at = lm_outline_flank(o, o->form_height_mm);
  to_polar(o, &at, o->form_height_mm, &radius, &angle);
  o->centre_rad = angle + angle_in_fillet(o, radius, up(o) * (radius - o->root_mm));
  return o->centre_rad - LM_PI / LM_REAL(o->rigid ? g->rigid_teeth : g->flexspline_teeth);
}

void lm_make_tooth_outline(const lm_drive *drive, const lm_mesh *mesh, int rigid,
                           lm_tooth_outline *outline) {
  const lm_real rounding = drive->teeth.root_clearance * mesh->geometry.module_mm /
                           (LM_REAL(1) - real_sin(drive->teeth.pressure_angle_rad));
  lm_real too_wide;
  outline->mesh = mesh;
  outline->rigid = rigid;
  outline->outward = rigid == (mesh->geometry.deformation == LM_EXTERNAL);
  outline->root_mm = rigid ? mesh->geometry.rigid_root_mm : mesh->geometry.flexspline_root_mm;
  too_wide = fillet_too_wide(outline, rounding);
  if (too_wide > LM_REAL(0)) { /* a full fillet, centred in the space */
    const lm_real narrow = FULL_SHARE * rounding;
    const lm_real at_narrow = fillet_too_wide(outline, narrow);
    if (at_narrow < LM_REAL(0)) {
      zero_between(fillet_too_wide, outline, narrow, at_narrow, rounding, too_wide);
    }
  }
}

/* lm_outline_flank without the angle. */
static lm_real flank_half(const lm_tooth_outline *o, lm_real height_mm) {
  const lm_mesh *mesh = o->mesh;
  const lm_real radius = o->root_mm + up(o) * height_mm;
  lm_real tangent;
  lm_real half;
  int piece;
  if (!is_polar(o)) {
    return lm_evaluate_flank(&mesh->flank, o->root_mm + height_mm).across_mm;
  }
  if (!o->rigid || mesh->rigid_kind == LM_FLANK_INVOLUTE) {
    return lm_outline_flank(o, height_mm).half_mm;
  }
  half = lm_conjugate_half_angle(&mesh->conjugate, radius, &tangent, &piece);
  return radius * (o->outward ? half : LM_PI / LM_REAL(mesh->geometry.rigid_teeth) - half);
}

lm_real lm_outline_half(const lm_tooth_outline *outline, lm_real height_mm) {
  const lm_tooth_outline *o = outline;
  if (height_mm >= o->form_height_mm) {
    return flank_half(o, height_mm);
  }
  if (is_polar(o)) {
    const lm_real radius = o->root_mm + up(o) * height_mm;
    return radius * (o->centre_rad - angle_in_fillet(o, radius, height_mm));
  }
  {
    const lm_real down =
        o->centre_mm * real_cos(o->centre_rad) - o->root_mm - height_mm; /* below the centre */
    return o->centre_mm * real_sin(o->centre_rad) -
           real_sqrt((o->fillet_mm - down) * (o->fillet_mm + down));
  }
}

static lm_real smaller(lm_real a, lm_real b) {
  return a < b ? a : b;
}

static lm_real leverage_at(const lm_tooth_outline *o, lm_real load, lm_real height) {
  const lm_real thickness = LM_REAL(2) * lm_outline_half(o, height);
  return (load - height) / (thickness * thickness);
}

lm_real lm_outline_leverage(const lm_tooth_outline *outline, lm_real load_height_mm) {
  const lm_real joint = smaller(outline->form_height_mm, load_height_mm);
  lm_real largest = LM_REAL(0);
  int i;
  for (i = 0; i < 2 * LEWIS_SECTIONS; i++) {
    const lm_real share = LM_REAL(1 + i % LEWIS_SECTIONS) / LM_REAL(LEWIS_SECTIONS);
    const lm_real found = leverage_at(
        outline, load_height_mm,
        i < LEWIS_SECTIONS ? joint * share * share : joint + (load_height_mm - joint) * share);
    largest = found > largest ? found : largest;
  }
  return largest;
}
