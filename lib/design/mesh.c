#include "lostmotion/mesh.h"

#include "half_turn.h"
#include "real_math.h"
#include "refuse.h"

/* A lobe of the largest drive has its place. */
typedef char lobe_teeth_suffice[LM_LOBE_TEETH_MAX == LM_FLEXSPLINE_TEETH_MAX / 2 + 1 ? 1 : -1];

/* Factors of the bounds of the second derivative of the gap. */
typedef struct bend_factors {
  lm_plain turned;      /* bound of the sine between the tooth's axis and the radius of any point */
  lm_plain speed;       /* of the radius by the parameter, at most */
  lm_plain per_radius;  /* 1 / the least radius */
  lm_plain rigid_slope; /* of the rigid flank's half angle by the radius, at most */
  lm_plain turning;     /* of the slope of the speed, with a straight flank */
  lm_plain across;      /* for the difference of the second derivatives of position, */
  lm_plain along;
  lm_plain by_width; /* and for the width of the part */
} bend_factors;

/* One flank of one placed tooth against the rigid gear. */
typedef struct flank_pair {
  const lm_mesh *mesh;
  lm_placement place;
  lm_real lead_rad; /* polar angle of the tooth's foot ahead of the axis of the rigid space */
  lm_real side;     /* +1: flank at growing angles, -1: the other */
  lm_real closing;  /* +1 internal, -1 external: which way the gap is counted */
  bend_factors bound;
} flank_pair;

/* A point of the placed flank: its polar radius, the gap of the pair on that radius, and both
 * derivatives along the flank (per mm of the flexspline's own radius). */
typedef struct flank_point {
  lm_real foot_mm; /* the flexspline's own radius */
  lm_real radius_mm;
  lm_real radius_slope;
  lm_real gap_rad;
  lm_real gap_slope;
  lm_real flank_angle_rad; /* of an involute; of others what touch_corner adds to it */
  lm_real tangent;         /* of the rigid flank against the radius, */
  lm_real half_angle_rad;  /* its half angle, */
  int piece;               /* and its piece of the conjugate, of flanks that are no involutes */
} flank_point;

lm_involute_point lm_rigid_flank_at(const lm_mesh *mesh, lm_real radius_mm) {
  return mesh->rigid_kind != LM_FLANK_INVOLUTE
             ? lm_evaluate_conjugate(&mesh->conjugate, radius_mm)
             : lm_evaluate_involute(&mesh->geometry.rigid, radius_mm);
}

/* Position of the foot of the placed tooth: along the radius of the tooth's axis and across it. */
static void place_foot(const flank_pair *pair, const lm_flank_foot *foot, lm_real *along,
                       lm_real *across) {
  const lm_real x = pair->side * foot->across_mm;
  *along = pair->place.radius_mm + foot->along_mm * pair->place.tilt_cos - x * pair->place.tilt_sin;
  *across = foot->along_mm * pair->place.tilt_sin + x * pair->place.tilt_cos;
}

static lm_real polar_radius(const flank_pair *pair, const lm_flank_foot *foot) {
  lm_real along;
  lm_real across;
  place_foot(pair, foot, &along, &across);
  return real_sqrt(along * along + across * across);
}

/* All angles are relative to the nearby axis of the rigid gear, so that float32 is accurate. */
static flank_point evaluate_foot(const flank_pair *pair, const lm_flank_foot *foot) {
  const lm_real dx = pair->side * foot->across_slope;
  const lm_real dy = foot->along_slope;
  const lm_real d_along = dy * pair->place.tilt_cos - dx * pair->place.tilt_sin;
  const lm_real d_across = dy * pair->place.tilt_sin + dx * pair->place.tilt_cos;
  lm_involute_point rigid;
  lm_real along;
  lm_real across;
  lm_real square;
  flank_point point;
  place_foot(pair, foot, &along, &across);
  square = along * along + across * across;
  point.foot_mm = foot->radius_mm;
  point.radius_mm = real_sqrt(square);
  point.radius_slope = (along * d_along + across * d_across) / point.radius_mm;
  rigid = lm_rigid_flank_at(pair->mesh, point.radius_mm);
  point.gap_rad = pair->closing * (rigid.half_angle_rad -
                                   pair->side * (real_atan(across / along) + pair->lead_rad));
  point.gap_slope = -pair->closing * (rigid.tangent * point.radius_slope / point.radius_mm +
                                      pair->side * (along * d_across - across * d_along) / square);
  point.flank_angle_rad = rigid.pressure_angle_rad - rigid.half_angle_rad;
  point.tangent = rigid.tangent;
  point.half_angle_rad = rigid.half_angle_rad;
  point.piece = 0;
  return point;
}

static flank_point evaluate_flank(const flank_pair *pair, lm_real radius_mm) {
  const lm_flank_foot foot = lm_evaluate_flank(&pair->mesh->flank, radius_mm);
  return evaluate_foot(pair, &foot);
}

/* The flank point on a polar radius between those of both ends: the chord and, where it is off by
 * more than a thousandth of a module, one step of Newton. The flank is nearly radial, so the error
 * is below 1e-5 in any drive; the slopes correct the rest to 1e-10 rad. */
static flank_point point_on_radius(const flank_pair *pair, lm_real target, lm_real at_low,
                                   lm_real at_high) {
  const lm_real low = pair->mesh->low.radius_mm;
  const lm_real share = (target - at_low) / (at_high - at_low);
  flank_point point = evaluate_flank(pair, low + share * (pair->mesh->high.radius_mm - low));
  lm_real left = (target - point.radius_mm) / point.radius_slope;
  if (real_fabs(left) > LM_REAL(1e-3) * pair->mesh->geometry.module_mm) {
    point = evaluate_flank(pair, point.foot_mm + left);
    left = (target - point.radius_mm) / point.radius_slope;
  }
  point.foot_mm += left;
  point.radius_mm = target;
  point.gap_rad += point.gap_slope * left;
  return point;
}

static lm_gap no_overlap(void) {
  lm_gap gap;
  gap.gap_rad = REAL_INFINITY;
  gap.radius_mm = LM_REAL(0);
  gap.flank_angle_rad = LM_REAL(0);
  gap.is_bound = 0;
  return gap;
}

/* Minimum of the gap between two flank points with falling and rising slope: regula falsi
 * with the Illinois correction, which keeps the bracket, and two steps of Newton with one
 * curvature. The bracket may shrink to rounding, where the slope of the chord is meaningless; the
 * Newton steps reduce the remaining error by the square of the curvature error, in the value and in
 * its derivatives by the dimensions of the drive. */
#define ILLINOIS_STEPS 4
#define NEWTON_STEPS 2
#define CURVATURE_SHARE LM_REAL(0.015625) /* of the bracket */

static flank_point interior_minimum(const flank_pair *pair, const flank_point *low,
                                    const flank_point *high) {
  const lm_real width = CURVATURE_SHARE * (high->foot_mm - low->foot_mm);
  lm_real a = low->foot_mm;
  lm_real b = high->foot_mm;
  lm_real slope_a = low->gap_slope;
  lm_real slope_b = high->gap_slope;
  lm_real rho = (a * slope_b - b * slope_a) / (slope_b - slope_a);
  lm_real curvature;
  flank_point middle = evaluate_flank(pair, rho);
  int side = 0; /* which end the last round replaced */
  int i;
  for (i = 0; i < ILLINOIS_STEPS; i++) {
    if (middle.gap_slope < LM_REAL(0)) {
      a = rho;
      slope_a = middle.gap_slope;
      slope_b = side == -1 ? slope_b / LM_REAL(2) : slope_b;
      side = -1;
    } else {
      b = rho;
      slope_b = middle.gap_slope;
      slope_a = side == 1 ? slope_a / LM_REAL(2) : slope_a;
      side = 1;
    }
    rho = (a * slope_b - b * slope_a) / (slope_b - slope_a);
    middle = evaluate_flank(pair, rho);
  }
  curvature =
      (evaluate_flank(pair, rho + width).gap_slope - evaluate_flank(pair, rho - width).gap_slope) /
      (LM_REAL(2) * width);
  for (i = 0; i < NEWTON_STEPS && curvature > LM_REAL(0); i++) {
    rho -= middle.gap_slope / curvature;
    middle = evaluate_flank(pair, rho);
  }
  return middle;
}

/* --- flanks that are no involutes ------------------------------------------------------------- */

/* As evaluate_foot; the angle of the flank is found for the nearest point alone. */
static void general_foot(const flank_pair *pair, const lm_flank_foot *foot, flank_point *point) {
  const lm_placement *p = &pair->place;
  const lm_real x = pair->side * foot->across_mm;
  const lm_real dx = pair->side * foot->across_slope;
  const lm_real along = p->radius_mm + foot->along_mm * p->tilt_cos - x * p->tilt_sin;
  const lm_real across = foot->along_mm * p->tilt_sin + x * p->tilt_cos;
  const lm_real d_along = foot->along_slope * p->tilt_cos - dx * p->tilt_sin;
  const lm_real d_across = foot->along_slope * p->tilt_sin + dx * p->tilt_cos;
  lm_real per_radius;
  point->foot_mm = foot->radius_mm;
  point->radius_mm = real_sqrt(along * along + across * across);
  per_radius = LM_REAL(1) / point->radius_mm;
  point->radius_slope = (along * d_along + across * d_across) * per_radius;
  if (pair->mesh->rigid_kind != LM_FLANK_INVOLUTE) {
    point->half_angle_rad = lm_conjugate_half_angle(&pair->mesh->conjugate, point->radius_mm,
                                                    &point->tangent, &point->piece);
  } else {
    const lm_involute_point rigid =
        lm_evaluate_involute(&pair->mesh->geometry.rigid, point->radius_mm);
    point->half_angle_rad = rigid.half_angle_rad;
    point->tangent = rigid.tangent;
    point->piece = 0;
  }
  point->gap_rad = pair->closing * (point->half_angle_rad -
                                    pair->side * (real_near_atan(across / along) + pair->lead_rad));
  point->gap_slope = -pair->closing * per_radius *
                     (point->tangent * point->radius_slope +
                      pair->side * (along * d_across - across * d_along) * per_radius);
  point->flank_angle_rad = LM_REAL(0);
}

static flank_point general_point(const flank_pair *pair, lm_real parameter_mm) {
  const lm_flank_foot foot = lm_evaluate_flank(&pair->mesh->flank, parameter_mm);
  flank_point point;
  general_foot(pair, &foot, &point);
  return point;
}

static lm_real general_angle(const flank_point *point) {
  return real_atan(point->tangent) - point->half_angle_rad + point->flank_angle_rad;
}

/* Newton, kept between the ends of the flank. After a step shorter than this share of the module the
 * tangent leads to the radius: with a curvature of 1 / module the error is half of its square, 5e-11
 * modules. Derivatives converge one step later than values. */
#define RADIUS_STEPS 4
#if LM_REAL_BITS == 32
#define RADIUS_END LM_REAL(1e-4)
#elif defined(LM_REAL_HEADER)
#define RADIUS_END LM_REAL(1e-8)
#else
#define RADIUS_END LM_REAL(1e-5)
#endif

/* The foot on a polar radius, from one near it. */
static lm_flank_foot foot_on_radius(const flank_pair *pair, lm_flank_foot foot, lm_real target) {
  const lm_flank *flank = &pair->mesh->flank;
  const lm_real c = pair->place.tilt_cos;
  const lm_real s = pair->place.tilt_sin;
  int i;
  for (i = 0;; i++) {
    lm_real along;
    lm_real across;
    lm_real radius;
    lm_real step;
    lm_real next;
    place_foot(pair, &foot, &along, &across);
    radius = real_sqrt(along * along + across * across);
    step = (target - radius) * radius /
           (along * (foot.along_slope * c - pair->side * foot.across_slope * s) +
            across * (foot.along_slope * s + pair->side * foot.across_slope * c));
    next = foot.radius_mm + step;
    next = next < flank->low_mm ? flank->low_mm : next;
    next = next > flank->high_mm ? flank->high_mm : next;
    if (i == RADIUS_STEPS || real_fabs(step) <= RADIUS_END * pair->mesh->geometry.module_mm) {
      step = next - foot.radius_mm;
      foot.radius_mm = next;
      foot.along_mm += foot.along_slope * step;
      foot.across_mm += foot.across_slope * step;
      return foot;
    }
    foot = lm_evaluate_flank(flank, next);
  }
}

/* Lower end of the chords from both ends of a bracket with a share of their slopes to where the
 * slope is 0: 1/2 gives the minimum of the parabola of the slopes, 1 a value below it. */
static lm_real bracket_floor(const flank_point *low, const flank_point *high, lm_real share) {
  const lm_real width = high->foot_mm - low->foot_mm;
  const lm_real x = low->gap_slope / (low->gap_slope - high->gap_slope);
  const lm_real from_low = low->gap_rad + share * x * width * low->gap_slope;
  const lm_real from_high = high->gap_rad - share * (LM_REAL(1) - x) * width * high->gap_slope;
  return from_low < from_high ? from_low : from_high;
}

/* Within a bracket whose slopes enclose a smooth minimum: the minimum of the cubic through both
 * ends and slopes, then Newton with the chord of the slopes, until the remaining step is
 * insignificant; a step out of the bracket is again that of the cubic. The gain of the last step is
 * added. The error of the derivatives by the dimensions of the drive is in proportion to the last
 * step times the error of the curvature, so the steps go far beyond the accuracy of the value. */
#if LM_REAL_BITS == 32
#define STEP_MODULES LM_REAL(1e-3)
#else
#define STEP_MODULES LM_REAL(1e-7)
#endif
#define BRACKET_STEPS 16

static flank_point bracketed_minimum(const flank_pair *pair, const flank_point *low,
                                     const flank_point *high) {
  flank_point a = *low;
  flank_point b = *high;
  flank_point middle;
  const lm_real end = STEP_MODULES * pair->mesh->geometry.module_mm;
  lm_real step = LM_REAL(0);
  int i;
  middle.foot_mm = LM_REAL(0);
  middle.gap_slope = LM_REAL(0);
  for (i = 0;; i++) {
    const lm_real last_foot = middle.foot_mm;
    const lm_real last_slope = middle.gap_slope;
    const lm_real next = last_foot + step;
    lm_real curvature;
    if (i > 0 && next > a.foot_mm && next < b.foot_mm) {
      middle = general_point(pair, next);
      curvature = (middle.gap_slope - last_slope) / (next - last_foot);
    } else {
      const lm_real width = b.foot_mm - a.foot_mm;
      const lm_real bend = LM_REAL(3) * (a.gap_rad - b.gap_rad) / width + a.gap_slope + b.gap_slope;
      const lm_real root = real_sqrt(bend * bend - a.gap_slope * b.gap_slope);
      middle = general_point(pair, b.foot_mm - width * (b.gap_slope + root - bend) /
                                                   (b.gap_slope - a.gap_slope + LM_REAL(2) * root));
      curvature = LM_REAL(2) * root / width;
    }
    step = LM_REAL(0);
    if (curvature > LM_REAL(0)) {
      step = -middle.gap_slope / curvature;
    }
    if (middle.gap_slope == LM_REAL(0) || i == BRACKET_STEPS ||
        (curvature > LM_REAL(0) && real_fabs(step) <= end)) {
      break;
    }
    if (middle.gap_slope < LM_REAL(0)) {
      a = middle;
    } else {
      b = middle;
    }
  }
  middle.foot_mm += step;
  middle.radius_mm += middle.radius_slope * step;
  middle.gap_rad += LM_REAL(0.5) * middle.gap_slope * step;
  return middle;
}

/* Contact at a corner of the rigid flank, a known step above the lower sample. In contact it has
 * the direction of the flank that it touches, between those of its sides. */
static flank_point touch_corner(const flank_point *low, const flank_point *high, lm_real step) {
  const lm_real share = low->gap_slope / (low->gap_slope - high->gap_slope);
  flank_point tip = *low;
  tip.foot_mm += step;
  tip.radius_mm += low->radius_slope * step;
  tip.gap_rad += low->gap_slope * step;
  tip.flank_angle_rad += share * (general_angle(high) - general_angle(low));
  return tip;
}

/* Distance of the samples on both sides of a corner from it, so that rounding does not choose the
 * side. */
#if LM_REAL_BITS == 32
#define ASIDE_MODULES LM_REAL(1e-3)
#else
#define ASIDE_MODULES LM_REAL(1e-6)
#endif

static void see(flank_point *best, const flank_point *point) {
  if (point->gap_rad < best->gap_rad) {
    *best = *point;
  }
}

static int falls_and_rises(const flank_point *low, const flank_point *high) {
  return low->gap_slope < LM_REAL(0) && high->gap_slope > LM_REAL(0);
}

/* --- a bound of the second derivative of the gap ---------------------------------------------- */

static lm_plain larger(lm_plain a, lm_plain b) {
  return a > b ? a : b;
}

static lm_plain size_of(lm_plain least, lm_plain most) {
  return larger(plain_fabs(least), plain_fabs(most));
}

/* Bounds of the second derivative of the rigid flank's half angle between two points. */
static void bound_rigid(const lm_mesh *mesh, const flank_point *a, const flank_point *b,
                        lm_plain *least, lm_plain *most) {
  if (mesh->rigid_kind != LM_FLANK_INVOLUTE) {
    lm_bound_conjugate_bend(&mesh->conjugate, a->piece, b->piece, least, most);
  } else { /* -cot a / rho^2 = -r_b / (rho^2 sqrt(rho^2 - r_b^2)) */
    const lm_plain base = LM_VALUE(mesh->geometry.rigid.base_mm);
    const int rising = a->radius_mm < b->radius_mm;
    const lm_plain low = LM_VALUE(rising ? a->radius_mm : b->radius_mm);
    const lm_plain high = LM_VALUE(rising ? b->radius_mm : a->radius_mm);
    *least = low > base ? -base / (low * low * plain_sqrt((low - base) * (low + base)))
                        : -PLAIN_INFINITY;
    *most = high > base ? -base / (high * high * plain_sqrt((high - base) * (high + base)))
                        : -PLAIN_INFINITY;
  }
}

/* The factors of the bounds (theory/flanks.md). With a flank below 45 deg against the radius, the
 * sums of the terms that change only because a part has a width are rounded up. */
static bend_factors find_factors(const flank_pair *pair, lm_real at_low, lm_real at_high) {
  const lm_mesh *mesh = pair->mesh;
  const lm_plain per_radius = LM_PLAIN(1) / LM_VALUE(at_low < at_high ? at_low : at_high);
  const lm_plain rigid_slope = mesh->rigid_kind != LM_FLANK_INVOLUTE
                                   ? mesh->conjugate.slope_size
                                   : LM_PLAIN(1) / LM_VALUE(mesh->geometry.rigid.base_mm);
  const lm_plain turned =
      plain_fabs(LM_VALUE(pair->place.tilt_sin)) + LM_VALUE(mesh->flank.pitch_half_rad);
  const lm_plain speed = mesh->along_speed + turned * mesh->across_speed;
  bend_factors factors;
  factors.turned = turned;
  factors.speed = speed;
  factors.per_radius = per_radius;
  factors.rigid_slope = rigid_slope;
  factors.turning = per_radius * speed * speed;
  factors.across = per_radius + rigid_slope * turned;
  factors.along = per_radius * turned + rigid_slope;
  factors.by_width = per_radius * speed * (LM_PLAIN(3) * rigid_slope + LM_PLAIN(9) * per_radius);
  return factors;
}

/* Bound of the second derivative of the radius by the parameter. */
static lm_plain radial_bend(const bend_factors *f, const lm_sample_bend *bend) {
  return f->turning + f->turned * bend->across + bend->along;
}

/* Bound of the difference between the second derivatives of the gap at any two points of a part of
 * the flank between two samples. */
static lm_plain bend_spread(const bend_factors *f, const lm_sample_bend *bend, lm_plain rigid_least,
                            lm_plain rigid_most, lm_plain width_mm) {
  const lm_plain by_width =
      LM_PLAIN(3) * f->speed * radial_bend(f, bend) * size_of(rigid_least, rigid_most) +
      f->by_width * (bend->across + bend->along + f->turning);
  return f->speed * f->speed * (rigid_most - rigid_least) + f->across * bend->across_change +
         f->along * bend->along_change + width_mm * by_width;
}

/* The second derivative has the mean (s_b - s_a) / width and differs from it by less than the
 * spread. If it is nowhere below -c, the gap plus c x (x - width) / 2 is convex, so it is above its
 * tangents at both ends: the gap is above the lower of both ends and of its value where they cross.
 * *split is near that place. *convex: the only minimum between them is where the slope is 0. */
static lm_plain lowest_of_part(const flank_point *low, const flank_point *high, lm_plain spread,
                               lm_plain *split, int *convex) {
  const lm_plain width = LM_VALUE(high->foot_mm - low->foot_mm);
  const lm_plain at_low = LM_VALUE(low->gap_rad);
  const lm_plain at_high = LM_VALUE(high->gap_rad);
  const lm_plain ends = at_low < at_high ? at_low : at_high;
  const lm_plain change = LM_VALUE(high->gap_slope - low->gap_slope);
  lm_plain tilt = LM_PLAIN(0.5) * (spread * width - change); /* of both tangents */
  lm_plain falls;
  lm_plain rises;
  lm_plain x;
  lm_plain between;
  *split = LM_PLAIN(0.5);
  *convex = !(tilt > LM_PLAIN(0));
  tilt = *convex ? LM_PLAIN(0) : tilt;
  falls = LM_VALUE(low->gap_slope) - tilt;
  rises = LM_VALUE(high->gap_slope) + tilt;
  if (!(falls < LM_PLAIN(0) && rises > LM_PLAIN(0)) || spread * width < -change) { /* concave */
    return ends;
  }
  x = (at_high - at_low - rises * width) / (falls - rises);
  if (!(x > LM_PLAIN(0) && x < width)) {
    return *convex ? ends : -PLAIN_INFINITY;
  }
  between = at_low + x * falls + tilt * x * (width - x) / width;
  *split = x / width;
  return between < ends ? between : ends;
}

/* A gap that the flank does not fall below between two points without a corner between them. */
static lm_plain lowest_between(const flank_pair *pair, const lm_sample_bend *bend,
                               const flank_point *low, const flank_point *high, lm_plain *split,
                               int *convex) {
  lm_plain least;
  lm_plain most;
  bound_rigid(pair->mesh, low, high, &least, &most);
  return lowest_of_part(
      low, high,
      bend_spread(&pair->bound, bend, least, most, LM_VALUE(high->foot_mm - low->foot_mm)), split,
      convex);
}

/* Corners of the rigid flank, from root to tip of the flexspline's: they are listed the other way,
 * and the edge of the land, -1, is beyond all of them. */
#define NO_CORNER (-2)

static lm_real radius_of_corner(const lm_conjugate *rigid, int corner) {
  return corner < 0 ? rigid->land_mm : rigid->corner_mm[corner];
}

/* The same by the bounds of the whole rigid flank, which are known. */
static lm_plain roughly_lowest(const flank_pair *pair, const lm_sample_bend *bend,
                               const flank_point *low, const flank_point *high) {
  const lm_conjugate *rigid = &pair->mesh->conjugate;
  lm_plain split;
  int convex;
  if (pair->mesh->rigid_kind == LM_FLANK_INVOLUTE) {
    return -PLAIN_INFINITY;
  }
  return lowest_of_part(low, high,
                        bend_spread(&pair->bound, bend, rigid->bend_lowest, rigid->bend_highest,
                                    LM_VALUE(high->foot_mm - low->foot_mm)),
                        &split, &convex);
}

/* Of a part that ends at a corner of the rigid flank: its other end, its greatest width, the slope
 * of the gap from that end towards the corner, and bounds of its second derivative, below 0 and
 * above 0. */
typedef struct side_of_corner {
  lm_plain gap_rad;
  lm_plain width_mm;
  lm_plain slope;
  lm_plain falling;
  lm_plain rising;
} side_of_corner;

static side_of_corner beside_corner(const flank_pair *pair, const lm_sample_bend *bend,
                                    const flank_point *end, const flank_point *other,
                                    lm_real corner_mm, int is_land) {
  const bend_factors *f = &pair->bound;
  const lm_plain towards = other->foot_mm > end->foot_mm ? LM_PLAIN(1) : LM_PLAIN(-1);
  const lm_plain whole = plain_fabs(LM_VALUE(other->foot_mm - end->foot_mm));
  const lm_plain radial = radial_bend(f, bend);
  const lm_plain speed = plain_fabs(LM_VALUE(end->radius_slope)) - radial * whole;
  const lm_plain way = plain_fabs(LM_VALUE(corner_mm - end->radius_mm));
  const lm_plain other_parts =
      f->rigid_slope * radial +
      f->per_radius * (bend->across + f->turned * bend->along + LM_PLAIN(2) * f->turning);
  const lm_plain square = f->speed * f->speed;
  side_of_corner side;
  lm_plain least = LM_PLAIN(0);
  lm_plain most = LM_PLAIN(0);
  if (!is_land) {
    lm_bound_conjugate_bend(&pair->mesh->conjugate, end->piece < 0 ? 0 : end->piece,
                            other->piece < 0 ? 0 : other->piece, &least, &most);
  }
  if (pair->closing < LM_REAL(0)) {
    const lm_plain turned = -least;
    least = -most;
    most = turned;
  }
  side.gap_rad = LM_VALUE(end->gap_rad);
  side.slope = towards * LM_VALUE(end->gap_slope);
  side.width_mm = way < speed * whole ? way / speed : whole;
  side.falling = other_parts - square * (least < LM_PLAIN(0) ? least : LM_PLAIN(0));
  side.rising = other_parts + square * larger(most, LM_PLAIN(0));
  return side;
}

/* Least gap of a part, from its end. */
static lm_plain lowest_from_end(const side_of_corner *side) {
  const lm_plain at_corner =
      side->gap_rad +
      side->width_mm * (side->slope - LM_PLAIN(0.5) * side->falling * side->width_mm);
  return at_corner < side->gap_rad ? at_corner : side->gap_rad;
}

/* The same, or that of the chord between both ends, which the gap falls below by no more than a
 * parabola: with a concave flank, as next to the land, that is the better bound. */
static lm_plain lowest_of_side(const side_of_corner *side, lm_plain from_end, lm_plain corner) {
  const lm_plain ends = corner < side->gap_rad ? corner : side->gap_rad;
  return larger(from_end, ends - side->rising * side->width_mm * side->width_mm / LM_PLAIN(8));
}

/* A gap that the flank does not fall below between two points with one corner of the rigid flank,
 * or the edge of its land, between them. */
static lm_plain lowest_at_corner(const flank_pair *pair, const lm_sample_bend *bend,
                                 const flank_point *low, const flank_point *high, int corner) {
  const lm_conjugate *rigid = &pair->mesh->conjugate;
  const lm_real corner_mm = radius_of_corner(rigid, corner);
  const side_of_corner below = beside_corner(pair, bend, low, high, corner_mm, 0);
  const side_of_corner beyond = beside_corner(pair, bend, high, low, corner_mm, corner < 0);
  const lm_plain from_below = lowest_from_end(&below);
  const lm_plain from_beyond = lowest_from_end(&beyond);
  const lm_plain at_corner = larger(from_below, from_beyond);
  const lm_plain a = lowest_of_side(&below, from_below, at_corner);
  const lm_plain b = lowest_of_side(&beyond, from_beyond, at_corner);
  return a < b ? a : b;
}

/* A point that is lower than the nearest one by less than this is not searched. */
#if LM_REAL_BITS == 32
#define NEAR_RAD LM_PLAIN(3e-7)
#else
#define NEAR_RAD LM_PLAIN(3e-13) /* 1e-9 arcmin */
#endif

/* Least share of a part in which its halves are searched. */
#define SPLIT_SHARE LM_PLAIN(0.125)

/* Divisions of an interval between two samples. Usually there are none or one; at a minimum between
 * nearly parallel flanks the bound w^2 V / 8 has to fall from 1e-6 rad to NEAR_RAD on both of its
 * sides, about ten halves of the width w on each. */
#define SPLITS_MAX 24

/* Between two points of the flank without a corner between them: parts that may contain a nearer
 * point are divided until none may. A minimum that is found is not searched again in a smaller
 * bracket, where the slopes are those of rounding; a point of division is not the nearest one,
 * because one of the parts beside it has its minimum inside. */
static void look_between(const flank_pair *pair, const lm_sample_bend *bend,
                         const flank_point *from, const flank_point *to, flank_point *best) {
  flank_point end[SPLITS_MAX + 1];
  flank_point low;
  int ends = 1;
  int splits = 0;
  if (roughly_lowest(pair, bend, from, to) >= LM_VALUE(best->gap_rad) - NEAR_RAD) {
    return;
  }
  low = *from;
  end[0] = *to;
  while (ends > 0) {
    const flank_point *high = &end[ends - 1];
    const int encloses = falls_and_rises(&low, high);
    int found = best->foot_mm > low.foot_mm && best->foot_mm < high->foot_mm;
    lm_plain split;
    lm_plain lowest;
    int convex;
    if (encloses && !found && bracket_floor(&low, high, LM_REAL(0.5)) < best->gap_rad) {
      const flank_point inside = bracketed_minimum(pair, &low, high);
      see(best, &inside);
      found = 1;
    }
    lowest = lowest_between(pair, bend, &low, high, &split, &convex);
    if (lowest >= LM_VALUE(best->gap_rad) - NEAR_RAD || (convex && (found || !encloses)) ||
        splits == SPLITS_MAX) {
      low = *high;
      ends--;
    } else {
      split = split > SPLIT_SHARE ? split : SPLIT_SHARE;
      split = split < LM_PLAIN(1) - SPLIT_SHARE ? split : LM_PLAIN(1) - SPLIT_SHARE;
      end[ends] = general_point(pair, low.foot_mm + LM_REAL(split) * (high->foot_mm - low.foot_mm));
      ends++;
      splits++;
    }
  }
}

/* The flank on a corner's radius between two samples: a point on each side of it, and the corner
 * itself where it touches. *before is the last point below, then the first one beyond. */
static void look_at_corner(const flank_pair *pair, const lm_sample_bend *bend, lm_real radius,
                           const flank_point *high, flank_point *before, flank_point *best) {
  const lm_real aside = ASIDE_MODULES * pair->mesh->geometry.module_mm;
  const lm_real share = (radius - before->radius_mm) / (high->radius_mm - before->radius_mm);
  const lm_flank *flank = &pair->mesh->flank;
  const lm_real at =
      foot_on_radius(
          pair,
          lm_evaluate_flank(flank, before->foot_mm + share * (high->foot_mm - before->foot_mm)),
          radius)
          .radius_mm;
  flank_point beyond = *high;
  if (at - aside > before->foot_mm) {
    const flank_point below = general_point(pair, at - aside);
    see(best, &below);
    look_between(pair, bend, before, &below, best);
    *before = below;
  }
  if (at + aside < high->foot_mm) {
    beyond = general_point(pair, at + aside);
    see(best, &beyond);
  }
  if (falls_and_rises(before, &beyond)) {
    const flank_point tip = touch_corner(before, &beyond, at - before->foot_mm);
    see(best, &tip);
  }
  *before = beyond;
}

/* The first corner beyond `after` that lies between two points, else NO_CORNER. */
static int next_corner(const lm_mesh *mesh, int after, const flank_point *low,
                       const flank_point *high) {
  const lm_real sense = mesh->line.sense;
  int i;
  if (mesh->rigid_kind == LM_FLANK_INVOLUTE || low->piece == high->piece) {
    return NO_CORNER;
  }
  for (i = after - 1; i > NO_CORNER; i--) {
    const lm_real radius = radius_of_corner(&mesh->conjugate, i);
    if (sense * radius > sense * low->radius_mm && sense * radius < sense * high->radius_mm) {
      return i;
    }
  }
  return NO_CORNER;
}

/* Between two samples. */
static void look_between_samples(const flank_pair *pair, const lm_sample_bend *bend,
                                 const flank_point *low, const flank_point *high,
                                 flank_point *best) {
  const lm_conjugate *rigid = &pair->mesh->conjugate;
  int corner = next_corner(pair->mesh, rigid->corners, low, high);
  flank_point before;
  if (corner == NO_CORNER) {
    look_between(pair, bend, low, high, best);
    return;
  }
  if (next_corner(pair->mesh, corner, low, high) == NO_CORNER &&
      lowest_at_corner(pair, bend, low, high, corner) >= LM_VALUE(best->gap_rad) - NEAR_RAD) {
    return;
  }
  before = *low;
  for (; corner != NO_CORNER; corner = next_corner(pair->mesh, corner, &before, high)) {
    look_at_corner(pair, bend, radius_of_corner(rigid, corner), high, &before, best);
  }
  look_between(pair, bend, &before, high, best);
}

/* Both flanks may bend either way, so the gap is sampled along the flexspline's flank; the lowest
 * sample, the lowest corner of the rigid flank, or the lowest minimum that two slopes enclose. No
 * bracket contains a corner: the slope jumps there, and the search for a smooth minimum would not
 * converge. The samples go from root to tip. Those beside the lowest one are searched first, because
 * what they give excludes most of the others. */
static flank_point general_minimum(const flank_pair *pair, const lm_sample_bend bend[],
                                   const flank_point sample[], int count) {
  flank_point best;
  int lowest = 0;
  int i;
  for (i = 1; i < count; i++) {
    lowest = sample[i].gap_rad < sample[lowest].gap_rad ? i : lowest;
  }
  best = sample[lowest];
  for (i = lowest; i <= lowest + 1; i++) {
    if (i > 0 && i < count) {
      look_between_samples(pair, &bend[i - 1], &sample[i - 1], &sample[i], &best);
    }
  }
  for (i = 1; i < count; i++) {
    if (i != lowest && i != lowest + 1) {
      look_between_samples(pair, &bend[i - 1], &sample[i - 1], &sample[i], &best);
    }
  }
  return best;
}

static int is_involute_pair(const lm_mesh *mesh) {
  return mesh->flank.kind == LM_FLANK_INVOLUTE && mesh->rigid_kind == LM_FLANK_INVOLUTE &&
         !(mesh->flank.relief_mm > LM_REAL(0)) && !mesh->flank.inward;
}

/* The flank point on a polar radius within the flank, and the number of samples of the mesh below
 * it. */
static void general_on_radius(const flank_pair *pair, lm_real at_low, lm_real at_high,
                              lm_real target, int *below, flank_point *point) {
  const lm_mesh *mesh = pair->mesh;
  const lm_real guess = mesh->low.radius_mm + (target - at_low) / (at_high - at_low) *
                                                  (mesh->high.radius_mm - mesh->low.radius_mm);
  lm_flank_foot foot;
  int i = 0;
  while (i < mesh->samples - 1 && mesh->sample[i].radius_mm < guess) {
    i++;
  }
  foot = foot_on_radius(pair, mesh->sample[i], target);
  while (i > 0 && mesh->sample[i - 1].radius_mm >= foot.radius_mm) {
    i--;
  }
  while (i < mesh->samples && mesh->sample[i].radius_mm < foot.radius_mm) {
    i++;
  }
  *below = i;
  general_foot(pair, &foot, point);
}

/* Whether no point of the flank is closer than the limit; then *lowest is the lowest sample and the
 * least possible gap. */
static int stays_beyond(const flank_pair *pair, const lm_sample_bend bend[],
                        const flank_point sample[], int count, lm_real limit_rad,
                        flank_point *lowest) {
  const lm_mesh *mesh = pair->mesh;
  lm_plain floor = LM_VALUE(sample[0].gap_rad);
  int nearest = 0;
  int i;
  for (i = 1; i < count && floor > LM_VALUE(limit_rad); i++) {
    const int corner = next_corner(mesh, mesh->conjugate.corners, &sample[i - 1], &sample[i]);
    lm_plain between;
    lm_plain split;
    int convex;
    if (corner == NO_CORNER) {
      between = roughly_lowest(pair, &bend[i - 1], &sample[i - 1], &sample[i]);
      if (!(between > LM_VALUE(limit_rad))) {
        between = lowest_between(pair, &bend[i - 1], &sample[i - 1], &sample[i], &split, &convex);
      }
    } else if (next_corner(mesh, corner, &sample[i - 1], &sample[i]) == NO_CORNER) {
      between = lowest_at_corner(pair, &bend[i - 1], &sample[i - 1], &sample[i], corner);
    } else {
      return 0;
    }
    floor = between < floor ? between : floor;
    nearest = sample[i].gap_rad < sample[nearest].gap_rad ? i : nearest;
  }
  *lowest = sample[nearest];
  lowest->gap_rad = LM_REAL(floor);
  return floor > LM_VALUE(limit_rad);
}

/* at_low, at_high: radii of root and tip. The rigid gear's flank goes from its tip, which meets the
 * flexspline's root, to its own root. */
static lm_gap general_gap(flank_pair *pair, lm_real at_low, lm_real at_high, lm_real limit_rad) {
  const lm_mesh *mesh = pair->mesh;
  const lm_real sense = mesh->line.sense;
  const int internal = sense > LM_REAL(0);
  const lm_real rigid_tip = internal ? mesh->polar_low_mm : mesh->polar_high_mm;
  const lm_real rigid_end = internal ? mesh->polar_high_mm : mesh->polar_low_mm;
  const int beyond_tip = sense * at_low < sense * rigid_tip;
  const int beyond_end = sense * at_high > sense * rigid_end;
  flank_point point[LM_FLANK_SAMPLES_MAX + 2];
  const lm_sample_bend *bend = mesh->bend; /* from the first point to the next */
  flank_point nearest;
  lm_gap gap;
  int first = 0;
  int end = mesh->samples;
  int count = 0;
  int i;
  if (!(sense * at_high > sense * rigid_tip && sense * at_low < sense * rigid_end)) {
    return no_overlap();
  }
  pair->bound = find_factors(pair, at_low, at_high);
  if (beyond_tip) {
    general_on_radius(pair, at_low, at_high, rigid_tip, &first, &point[count++]);
    first += first < end && !(mesh->sample[first].radius_mm > point[0].foot_mm);
    bend += first > 0 ? first - 1 : 0;
  }
  if (beyond_end) {
    general_on_radius(pair, at_low, at_high, rigid_end, &end, &point[LM_FLANK_SAMPLES_MAX + 1]);
  }
  for (i = first; i < end; i++) {
    general_foot(pair, &mesh->sample[i], &point[count++]);
  }
  if (beyond_end) {
    point[count++] = point[LM_FLANK_SAMPLES_MAX + 1];
  }
  gap.is_bound =
      limit_rad < REAL_INFINITY && stays_beyond(pair, bend, point, count, limit_rad, &nearest);
  if (!gap.is_bound) {
    nearest = general_minimum(pair, bend, point, count);
  }
  gap.gap_rad = nearest.gap_rad;
  gap.radius_mm = nearest.radius_mm;
  gap.flank_angle_rad = general_angle(&nearest);
  return gap;
}

/* --- involutes -------------------------------------------------------------------------------- */

/* Both flanks exist between two ends: the flexspline's own, or the points where the rigid tip
 * limits it. The gap between the ends is nearly linear, so its minimum is at an end unless the
 * slopes enclose it. Above the limit a lower bound may be the result. */
static lm_gap flank_gap(flank_pair *pair, lm_real limit_rad) {
  const lm_mesh *mesh = pair->mesh;
  const lm_real at_high = polar_radius(pair, &mesh->high);
  const lm_real at_low = polar_radius(pair, &mesh->low);
  flank_point high;
  flank_point low;
  lm_gap gap;
  if (!is_involute_pair(mesh)) {
    return general_gap(pair, at_low, at_high, limit_rad);
  }
  if (at_high <= mesh->polar_low_mm || at_low >= mesh->polar_high_mm) {
    return no_overlap();
  }
  low = at_low < mesh->polar_low_mm ? point_on_radius(pair, mesh->polar_low_mm, at_low, at_high)
                                    : evaluate_foot(pair, &mesh->low);
  high = at_high > mesh->polar_high_mm ? point_on_radius(pair, mesh->polar_high_mm, at_low, at_high)
                                       : evaluate_foot(pair, &mesh->high);
  if (low.gap_slope < LM_REAL(0) && high.gap_slope > LM_REAL(0)) {
    low = interior_minimum(pair, &low, &high);
  } else if (high.gap_rad < low.gap_rad) {
    low = high;
  }
  gap.gap_rad = low.gap_rad;
  gap.radius_mm = low.radius_mm;
  gap.flank_angle_rad = low.flank_angle_rad;
  gap.is_bound = 0;
  return gap;
}

/* Largest distance of the samples on the flank, modules: chosen for speed. */
#define SAMPLE_MODULES LM_REAL(0.2)

/* The second derivatives between the samples, and bounds of the first ones. */
static void bound_samples(lm_mesh *mesh) {
  int i;
  mesh->along_speed = LM_PLAIN(0);
  mesh->across_speed = LM_PLAIN(0);
  for (i = 0; i + 1 < mesh->samples; i++) {
    const lm_flank_foot *low = &mesh->sample[i];
    const lm_flank_foot *high = &mesh->sample[i + 1];
    const lm_plain half = LM_PLAIN(0.5) * LM_VALUE(high->radius_mm - low->radius_mm);
    const lm_flank_bend bend = lm_bound_flank_bend(&mesh->flank, low->radius_mm, high->radius_mm);
    const int turns = bend.across_least < LM_PLAIN(0) && bend.across_most > LM_PLAIN(0);
    const lm_plain beyond =
        turns ? half * size_of(bend.across_least, bend.across_most) : LM_PLAIN(0);
    const lm_plain across =
        size_of(LM_VALUE(low->across_slope), LM_VALUE(high->across_slope)) + beyond;
    const lm_plain along = size_of(LM_VALUE(low->along_slope), LM_VALUE(high->along_slope)) +
                           half * size_of(bend.along_least, bend.along_most);
    mesh->bend[i].across = size_of(bend.across_least, bend.across_most);
    mesh->bend[i].along = size_of(bend.along_least, bend.along_most);
    mesh->bend[i].across_change = bend.across_most - bend.across_least;
    mesh->bend[i].along_change = bend.along_most - bend.along_least;
    mesh->along_speed = larger(mesh->along_speed, along);
    mesh->across_speed = larger(mesh->across_speed, across);
  }
}

/* The flank between its joints is sampled in equal steps. */
static void sample_flank(lm_mesh *mesh) {
  const lm_flank *flank = &mesh->flank;
  const lm_real height = flank->high_mm - flank->low_mm;
  const lm_real least = height / LM_REAL(LM_FLANK_SAMPLES_MAX - LM_FLANK_JOINTS_MAX - 2);
  const lm_real usual = SAMPLE_MODULES * mesh->geometry.module_mm;
  const lm_real step = usual > least ? usual : least;
  lm_real from = flank->low_mm;
  int piece;
  mesh->sample[0] = mesh->low;
  mesh->samples = 1;
  for (piece = 0; piece <= flank->joints; piece++) {
    const int inner = piece < flank->joints && flank->joint_mm[piece] < flank->high_mm;
    const lm_real to = inner ? flank->joint_mm[piece] : flank->high_mm;
    const int steps = to > from ? 1 + (int)((to - from) / step) : 0;
    int i;
    for (i = 1; i <= steps; i++) {
      mesh->sample[mesh->samples++] =
          lm_evaluate_flank(flank, from + (to - from) * LM_REAL(i) / LM_REAL(steps));
    }
    from = to > from ? to : from;
  }
  bound_samples(mesh);
}

/* The flexspline's flank runs from its tip or base circle to its root, the rigid one from its root
 * or base circle to its tip; the root of an internal rigid gear, and that below the radial land of
 * any, is no limit, because a separate check examines it.
 */
static void limit_flanks(lm_mesh *mesh) {
  const lm_geometry *g = &mesh->geometry;
  mesh->low = lm_evaluate_flank(&mesh->flank, mesh->flank.low_mm);
  mesh->high = lm_evaluate_flank(&mesh->flank, mesh->flank.high_mm);
  if (g->deformation == LM_INTERNAL) {
    mesh->polar_low_mm = g->rigid_tip_mm;
    mesh->polar_high_mm = REAL_INFINITY;
  } else {
    const int below = g->rigid_root_mm < g->rigid.base_mm;
    mesh->polar_low_mm = below ? g->rigid.base_mm : g->rigid_root_mm;
    mesh->polar_low_mm = mesh->rigid_kind == LM_FLANK_INVOLUTE ? mesh->polar_low_mm : LM_REAL(0);
    mesh->polar_high_mm = g->rigid_tip_mm;
  }
  if (!is_involute_pair(mesh)) {
    sample_flank(mesh);
  }
}

lm_real lm_section_place(int section, int sections) {
  return sections > 1 ? LM_REAL(section) / LM_REAL(sections - 1) : LM_REAL(0.5);
}

static lm_real factor_at(const lm_drive *drive, lm_real place) {
  const lm_real from_middle = place - LM_REAL(0.5);
  return LM_REAL(1) + from_middle * drive->teeth.face_width_mm / drive->flexspline.length_mm;
}

lm_real lm_section_factor(const lm_drive *drive, int section, int sections) {
  return factor_at(drive, lm_section_place(section, sections));
}

void lm_deepen_root(const lm_drive *drive, int sections, lm_geometry *geometry) {
  lm_geometry *g = geometry;
  const lm_real wider =
      g->deflection_mm * (lm_section_factor(drive, sections - 1, sections) - LM_REAL(1));
  if (sections < 2) {
    return;
  }
  if (g->deformation == LM_INTERNAL) {
    g->rigid_root_mm += wider;
  } else {
    g->flexspline_root_mm += wider;
    g->neutral_mm += wider;
  }
}

/* The conjugate flank of the rigid gear, which the nominal deflection generates. */
static lm_status generate_rigid(const lm_drive *drive, const lm_geometry *g, lm_real section_factor,
                                int nodes, lm_mesh *mesh, lm_fault *fault) {
  lm_neutral_line nominal;
  lm_flank flank;
  lm_status status = lm_make_flank(drive, g, 0, &flank, fault);
  if (status == LM_OK && section_factor != LM_REAL(1)) {
    status = lm_make_neutral_line(&drive->generator, drive->teeth.deformation, g->neutral_mm,
                                  drive->generator.deflection_mm, nodes, &nominal, fault);
  }
  if (status == LM_OK) {
    status = lm_make_conjugate(&flank, g, section_factor != LM_REAL(1) ? &nominal : &mesh->line,
                               drive->teeth.rigid_shift * g->module_mm, drive->flank.backlash_mm,
                               &mesh->conjugate, fault);
  }
  return status;
}

/* The mesh of one of `sections` sections; `sibling`, where it is not null, is another one. */
static lm_status make_section(const lm_drive *drive, int sections, lm_real section_factor,
                              int nodes, const lm_mesh *sibling, lm_mesh *mesh, lm_fault *fault) {
  lm_geometry geometry;
  lm_status status = check_range(fault, "section_factor", section_factor, LM_REAL(0.2), LM_REAL(2));
  if (status == LM_OK) {
    status = lm_make_geometry(&drive->teeth, drive->generator.deflection_mm,
                              drive->flexspline.rim_thickness_mm, &geometry, fault);
  }
  if (status == LM_OK) {
    lm_deepen_root(drive, sections, &geometry);
    status = lm_make_neutral_line(&drive->generator, drive->teeth.deformation, geometry.neutral_mm,
                                  drive->generator.deflection_mm * section_factor, nodes,
                                  &mesh->line, fault);
  }
  if (status == LM_OK) {
    status = lm_make_flank(drive, &geometry, 1, &mesh->flank, fault);
  }
  if (status == LM_OK) {
    mesh->rigid_kind = drive->teeth.rigid_flank;
    if (mesh->rigid_kind != LM_FLANK_INVOLUTE && sibling != 0) {
      mesh->conjugate = sibling->conjugate;
    } else if (mesh->rigid_kind == LM_FLANK_POINTS) {
      status = lm_tabulate_rigid_points(drive->flank.rigid_points, &geometry,
                                        drive->teeth.rigid_shift * geometry.module_mm,
                                        drive->flank.backlash_mm, &mesh->conjugate, fault);
    } else if (mesh->rigid_kind == LM_FLANK_CONJUGATE) {
      status = generate_rigid(drive, &geometry, section_factor, nodes, mesh, fault);
    }
  }
  if (status == LM_OK) {
    mesh->geometry = geometry;
    limit_flanks(mesh);
  }
  return status;
}

lm_status lm_make_mesh(const lm_drive *drive, lm_real section_factor, int nodes, lm_mesh *mesh,
                       lm_fault *fault) {
  if (drive == 0 || mesh == 0) {
    return refuse(fault, LM_NULL, drive == 0 ? "drive" : "mesh");
  }
  return make_section(drive, drive->axial_sections, section_factor, nodes, 0, mesh, fault);
}

int lm_face_sections(const lm_drive *drive) {
  return drive->planar_only ? 1 : LM_FACE_SECTIONS;
}

int lm_face_places(const lm_drive *drive) {
  return drive->planar_only ? 1 : LM_FACE_PLACES;
}

lm_status lm_make_face(const lm_drive *drive, int sections, int nodes, lm_mesh meshes[],
                       lm_fault *fault) {
  return lm_make_face_like(drive, sections, nodes, 0, meshes, fault);
}

lm_status lm_make_face_like(const lm_drive *drive, int sections, int nodes, const lm_mesh *like,
                            lm_mesh meshes[], lm_fault *fault) {
  const int middle = sections / 2;
  lm_status status;
  int i;
  if (drive == 0 || meshes == 0) {
    return refuse(fault, LM_NULL, drive == 0 ? "drive" : "meshes");
  }
  status = check_range(fault, "sections", LM_REAL(sections), LM_REAL(1), LM_REAL(LM_SECTIONS_MAX));
  /* The middle first: if it has the nominal deflection, its own line generates the flank. */
  for (i = 0; i < sections && status == LM_OK; i++) {
    const int section = (middle + i) % sections;
    status = make_section(drive, sections, lm_section_factor(drive, section, sections), nodes,
                          i > 0 ? &meshes[middle] : like, &meshes[section], fault);
  }
  return status;
}

lm_status lm_make_mesh_at(const lm_drive *drive, lm_real place, int nodes, const lm_mesh *like,
                          lm_mesh *mesh, lm_fault *fault) {
  lm_status status;
  if (drive == 0 || like == 0 || mesh == 0) {
    return refuse(fault, LM_NULL, "drive, like, mesh");
  }
  status = check_range(fault, "place", place, LM_REAL(0), LM_REAL(1));
  return status != LM_OK ? status
                         : make_section(drive, LM_FACE_PLACES, factor_at(drive, place), nodes, like,
                                        mesh, fault);
}

static flank_pair place_pair(const lm_mesh *mesh, lm_real angle_rad, int forward) {
  static const bend_factors unknown = {0, 0, 0, 0, 0, 0, 0, 0};
  flank_pair pair;
  pair.bound = unknown;
  pair.mesh = mesh;
  pair.place = lm_place_tooth(&mesh->line, angle_rad);
  pair.lead_rad = pair.place.lead_rad + fold_half_turn(angle_rad) * mesh->geometry.lead_per_angle;
  pair.closing = mesh->line.sense;
  pair.side = forward ? mesh->line.sense : -mesh->line.sense;
  return pair;
}

static lm_clearance clearance_within(const lm_mesh *mesh, lm_real angle_rad, lm_real forward_limit,
                                     lm_real backward_limit) {
  lm_clearance clearance;
  flank_pair pair = place_pair(mesh, angle_rad, 1);
  clearance.angle_rad = angle_rad;
  clearance.foot_mm = pair.place.radius_mm;
  clearance.forward = flank_gap(&pair, forward_limit);
  pair.side = -mesh->line.sense;
  clearance.backward = flank_gap(&pair, backward_limit);
  return clearance;
}

lm_clearance lm_clearance_within(const lm_mesh *mesh, lm_real angle_rad, lm_real limit_rad) {
  return clearance_within(mesh, angle_rad, limit_rad, limit_rad);
}

lm_clearance lm_tooth_clearance(const lm_mesh *mesh, lm_real angle_rad) {
  return clearance_within(mesh, angle_rad, REAL_INFINITY, REAL_INFINITY);
}

/* Tip of the flexspline, which leaves the overlap first. */
static const lm_flank_foot *tip_of(const lm_mesh *mesh) {
  return mesh->line.sense > LM_REAL(0) || mesh->flank.inward ? &mesh->high : &mesh->low;
}

/* Its remaining reach into the other gear. */
static lm_real overlap_depth(const flank_pair *pair) {
  const lm_mesh *mesh = pair->mesh;
  const lm_real reach = polar_radius(pair, tip_of(mesh));
  return mesh->line.sense > LM_REAL(0) ? reach - mesh->polar_low_mm : mesh->polar_high_mm - reach;
}

static lm_real depth_at(const lm_mesh *mesh, lm_real angle_rad, int forward) {
  const flank_pair pair = place_pair(mesh, angle_rad, forward);
  return overlap_depth(&pair);
}

/* Regula falsi with the Illinois correction, then Newton with one slope, as interior_minimum. */
lm_clearance_end lm_find_overlap_end(const lm_mesh *mesh, lm_real inside_rad, lm_real outside_rad,
                                     int forward) {
  const lm_real width = CURVATURE_SHARE * (outside_rad - inside_rad);
  lm_real a = inside_rad;
  lm_real b = outside_rad;
  lm_real depth_a = depth_at(mesh, a, forward);
  lm_real depth_b = depth_at(mesh, b, forward);
  lm_real angle = (a * depth_b - b * depth_a) / (depth_b - depth_a);
  lm_real depth = depth_at(mesh, angle, forward);
  lm_real slope;
  lm_clearance_end end;
  flank_pair pair;
  flank_point tip;
  int side = 0;
  int i;
  for (i = 0; i < ILLINOIS_STEPS; i++) {
    if (depth > LM_REAL(0)) {
      a = angle;
      depth_a = depth;
      depth_b = side == -1 ? depth_b / LM_REAL(2) : depth_b;
      side = -1;
    } else {
      b = angle;
      depth_b = depth;
      depth_a = side == 1 ? depth_a / LM_REAL(2) : depth_a;
      side = 1;
    }
    angle = (a * depth_b - b * depth_a) / (depth_b - depth_a);
    depth = depth_at(mesh, angle, forward);
  }
  slope = (depth_at(mesh, angle + width, forward) - depth_at(mesh, angle - width, forward)) /
          (LM_REAL(2) * width);
  for (i = 0; i < NEWTON_STEPS; i++) {
    angle -= depth_at(mesh, angle, forward) / slope;
  }
  pair = place_pair(mesh, angle, forward);
  tip = evaluate_foot(&pair, tip_of(mesh));
  end.angle_rad = angle;
  end.gap.gap_rad = tip.gap_rad;
  end.gap.radius_mm = tip.radius_mm;
  end.gap.flank_angle_rad = tip.flank_angle_rad;
  end.gap.is_bound = 0;
  return end;
}

static lm_status check_pointers(const lm_mesh *mesh, const lm_clearance clearances[],
                                const int *count, lm_fault *fault) {
  if (mesh == 0) {
    return refuse(fault, LM_NULL, "mesh");
  }
  if (clearances == 0) {
    return refuse(fault, LM_NULL, "clearances");
  }
  return count == 0 ? refuse(fault, LM_NULL, "count") : LM_OK;
}

/* A tooth within rounding of 90 deg is treated as at 90 deg, and is then listed at both ends. */
#define HAIR_PITCHES LM_REAL(1e-4)

static lm_real within_lobe(lm_real angle_rad) {
  if (angle_rad < -HALF_PI) {
    return -HALF_PI;
  }
  return angle_rad > HALF_PI ? HALF_PI : angle_rad;
}

lm_least_gaps lm_no_gaps(void) {
  lm_least_gaps none;
  none.forward_rad = REAL_INFINITY;
  none.backward_rad = REAL_INFINITY;
  return none;
}

static lm_real smaller(lm_real a, lm_real b) {
  return a < b ? a : b;
}

/* The same tooth on the other side of the deformation axis. */
static lm_clearance mirror_clearance(const lm_clearance *tooth) {
  lm_clearance mirrored;
  mirrored.angle_rad = -tooth->angle_rad;
  mirrored.foot_mm = tooth->foot_mm;
  mirrored.forward = tooth->backward;
  mirrored.backward = tooth->forward;
  return mirrored;
}

/* Of this many neighbouring teeth one is evaluated before the others, so that a small gap is known
 * early. Chosen for speed. */
#define EARLY_EVERY 4

/* A tooth and the opposite one are evaluated in the same round. */
static int is_early(int k, int opposite) {
  return (k > opposite ? k : opposite) % EARLY_EVERY == 0;
}

lm_status lm_near_clearances(const lm_mesh *mesh, lm_real phase_rad, lm_real beyond_rad,
                             lm_least_gaps *least, lm_clearance clearances[], int capacity,
                             int *count, lm_fault *fault) {
  const lm_status status = check_pointers(mesh, clearances, count, fault);
  lm_real quarter;
  lm_real turns;
  lm_real shift; /* pitches */
  int first;
  int last;
  int outer; /* of the order 0, -1, 1, -2, 2 ... */
  int twice; /* the shift, half pitches */
  int round;
  int i;
  if (status != LM_OK) {
    return status;
  }
  if (least == 0) {
    return refuse(fault, LM_NULL, "least");
  }
  if (!real_isfinite(phase_rad)) {
    return refuse_range(fault, "phase_rad", phase_rad, -REAL_INFINITY, REAL_INFINITY);
  }
  /* Whole turns are subtracted first: a large phase divided by the pitch would overflow. */
  turns = phase_rad / (LM_REAL(2) * LM_PI);
  shift = (turns - real_floor(turns)) * LM_REAL(mesh->geometry.flexspline_teeth);
  shift -= real_floor(shift);
  quarter = LM_REAL(mesh->geometry.flexspline_teeth) / LM_REAL(4);
  last = (int)real_floor(quarter + HAIR_PITCHES - shift);
  first = -(int)real_floor(quarter + HAIR_PITCHES + shift);
  if (last - first + 1 > capacity) {
    return refuse_capacity(fault, "capacity", capacity, last - first + 1);
  }
  /* The flanks of a tooth are those of the tooth at the opposite angle, -k - 2 shift, exchanged. */
  twice = (int)(LM_REAL(2) * shift + LM_REAL(0.5));
  outer = 2 * (last > -first ? last : -first);
  for (round = 0; round < 2; round++) {
    for (i = 0; i <= outer; i++) {
      const int k = i % 2 == 0 ? i / 2 : -(i + 1) / 2;
      const int opposite = -k - twice;
      const int before = opposite >= 0 ? 2 * opposite : -2 * opposite - 1; /* its turn */
      lm_clearance *tooth = &clearances[k - first];
      lm_real angle;
      if (k < first || k > last || is_early(k, opposite) != (round == 0)) {
        continue;
      }
      angle = within_lobe((LM_REAL(k) + shift) / quarter * HALF_PI);
      *tooth = before < i && opposite >= first && opposite <= last &&
                       clearances[opposite - first].angle_rad == -angle
                   ? mirror_clearance(&clearances[opposite - first])
                   : clearance_within(mesh, angle, least->forward_rad + beyond_rad,
                                      least->backward_rad + beyond_rad);
      least->forward_rad = smaller(tooth->forward.gap_rad, least->forward_rad);
      least->backward_rad = smaller(tooth->backward.gap_rad, least->backward_rad);
    }
  }
  *count = last - first + 1;
  return LM_OK;
}

lm_status lm_lobe_clearances(const lm_mesh *mesh, lm_real phase_rad, lm_clearance clearances[],
                             int capacity, int *count, lm_fault *fault) {
  lm_least_gaps least = lm_no_gaps();
  return lm_near_clearances(mesh, phase_rad, REAL_INFINITY, &least, clearances, capacity, count,
                            fault);
}

lm_status lm_sweep_clearances(const lm_mesh *mesh, int phases, lm_clearance clearances[],
                              int capacity, int *count, lm_fault *fault) {
  lm_status status;
  lm_real step;
  int middle;
  int k;
  status = check_pointers(mesh, clearances, count, fault);
  if (status == LM_OK) {
    status =
        check_range(fault, "phases", LM_REAL(phases), LM_REAL(1), LM_REAL(LM_SWEEP_PHASES_MAX));
  }
  if (status != LM_OK) {
    return status;
  }
  middle = mesh->geometry.flexspline_teeth * phases / 4;
  if (2 * middle + 1 > capacity) {
    return refuse_capacity(fault, "capacity", capacity, 2 * middle + 1);
  }
  step = LM_REAL(2) * LM_PI / LM_REAL(mesh->geometry.flexspline_teeth * phases);
  for (k = 0; k <= middle; k++) {
    const lm_clearance tooth = lm_tooth_clearance(mesh, step * LM_REAL(k));
    clearances[middle - k] = mirror_clearance(&tooth);
    clearances[middle + k] = tooth;
  }
  *count = 2 * middle + 1;
  return LM_OK;
}
