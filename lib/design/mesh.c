#include "lostmotion/mesh.h"

#include "real_math.h"
#include "refuse.h"

#define HALF_PI (LM_PI / LM_REAL(2))

/* One flank of one placed tooth against the rigid gear. */
typedef struct flank_pair {
  const lm_geometry *geometry;
  lm_placement place;
  lm_real lead_rad; /* polar angle of the tooth's foot ahead of the axis of the rigid gear's space */
  lm_real side;     /* +1: flank at growing angles, -1: the other */
  lm_real closing;  /* +1 internal, -1 external: which way the gap is counted */
} flank_pair;

/* A point of the placed flank: its polar radius, the gap of the pair on that radius, and both
 * derivatives along the flank (per mm of the flexspline's own radius). */
typedef struct flank_point {
  lm_real radius_mm;
  lm_real radius_slope;
  lm_real gap_rad;
  lm_real gap_slope;
} flank_point;

/* The flank point at radius rho of the undeformed flexspline. All angles are kept relative to the
 * rigid gear's axis nearby, so float32 loses nothing. */
static flank_point evaluate_flank(const flank_pair *pair, lm_real rho) {
  const lm_geometry *g = pair->geometry;
  const lm_real t = lm_involute_tangent(&g->flexspline, rho);
  const lm_real xi = lm_involute_half_angle(&g->flexspline, rho);
  const lm_real s = real_sin(xi);
  const lm_real c = real_cos(xi);
  const lm_real x = pair->side * rho * s;
  const lm_real y = rho * c - g->neutral_mm;
  const lm_real dx = pair->side * (s - t * c);
  const lm_real dy = c + t * s;
  const lm_real across = y * pair->place.tilt_sin + x * pair->place.tilt_cos;
  const lm_real along = pair->place.radius_mm + y * pair->place.tilt_cos - x * pair->place.tilt_sin;
  const lm_real d_across = dy * pair->place.tilt_sin + dx * pair->place.tilt_cos;
  const lm_real d_along = dy * pair->place.tilt_cos - dx * pair->place.tilt_sin;
  const lm_real square = along * along + across * across;
  flank_point point;
  point.radius_mm = real_sqrt(square);
  point.radius_slope = (along * d_along + across * d_across) / point.radius_mm;
  point.gap_rad =
      pair->closing * (lm_involute_half_angle(&g->rigid, point.radius_mm) -
                       pair->side * (real_atan(across / along) + pair->lead_rad));
  point.gap_slope =
      pair->closing *
      (-lm_involute_tangent(&g->rigid, point.radius_mm) * point.radius_slope / point.radius_mm -
       pair->side * (along * d_across - across * d_along) / square);
  return point;
}

/* The flank radius whose point lies on the polar radius target. The flank is nearly radial, so
 * Newton from its end closes in a few rounds. */
static lm_real flank_radius_at(const flank_pair *pair, lm_real target, lm_real start,
                               flank_point from) {
  lm_real rho = start;
  int i;
  for (i = 0; i < 3; i++) {
    rho -= (from.radius_mm - target) / from.radius_slope;
    from = evaluate_flank(pair, rho);
  }
  return rho;
}

static lm_gap contact_at(const flank_pair *pair, const flank_point *point) {
  const lm_involute *rigid = &pair->geometry->rigid;
  lm_gap gap;
  gap.gap_rad = point->gap_rad;
  gap.radius_mm = point->radius_mm;
  gap.flank_angle_rad = real_atan(lm_involute_tangent(rigid, point->radius_mm)) -
                        lm_involute_half_angle(rigid, point->radius_mm);
  return gap;
}

static lm_gap no_overlap(void) {
  lm_gap gap;
  gap.gap_rad = REAL_INFINITY;
  gap.radius_mm = LM_REAL(0);
  gap.flank_angle_rad = LM_REAL(0);
  return gap;
}

/* Where the slope of the gap changes from falling to rising between two points: regula falsi with
 * the Illinois correction, which keeps the bracket. */
static flank_point interior_minimum(const flank_pair *pair, lm_real a, flank_point at_a, lm_real b,
                                    flank_point at_b) {
  lm_real slope_a = at_a.gap_slope;
  lm_real slope_b = at_b.gap_slope;
  flank_point middle = at_a;
  int i;
  for (i = 0; i < 8; i++) {
    const lm_real rho = (a * slope_b - b * slope_a) / (slope_b - slope_a);
    middle = evaluate_flank(pair, rho);
    if (middle.gap_slope < LM_REAL(0)) {
      a = rho;
      slope_a = middle.gap_slope;
      slope_b = slope_b / LM_REAL(2);
    } else {
      b = rho;
      slope_b = middle.gap_slope;
      slope_a = slope_a / LM_REAL(2);
    }
  }
  return middle;
}
