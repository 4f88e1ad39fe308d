#include "lostmotion/conjugate.h"

#include "half_turn.h"
#include "real_math.h"
#include "refuse.h"

/* The search for the maximum ends when a step changes neither the value nor its derivatives. A
 * point on the edge of the land within rounding has the flank's tangent. */
#if LM_REAL_BITS == 32
#define CLIMB_END LM_REAL(1e-3)
#define LAND_SLACK LM_REAL(1e-3)
#else
#define CLIMB_END LM_REAL(1e-12)
#define LAND_SLACK LM_REAL(1e-7)
#endif

/* Angles of the search for all maxima, from 20 deg behind the deformation axis to 60 deg ahead:
 * beyond, a tooth is out of mesh, and behind the axis its flank moves away. Chosen; the polygons of
 * tests/brute_force/arcs.py are swept through 70 deg in either direction. */
#define SCAN_BEHIND 8
#define SCAN_COUNT 33
#define SCAN_STEP (LM_PI / LM_REAL(72)) /* 2.5 deg */

/* Nodes of the flank before corners are added, and interval of nodes between searches for all
 * maxima. */
#define NODES 28
#define SCAN_EVERY 4

/* Steps towards the position of a corner, until the tangents of both sides cross within this share
 * of the flank's height, with an error of 1e-7 modules in the cubics beside it, or the error of the
 * straight line between both sides is less than that many modules. A corner has at least this share
 * of the interval that it divides as its distance from both ends. */
#define CORNER_STEPS 14
#if LM_REAL_BITS == 32
#define CORNER_SHARE LM_REAL(1e-4)
#define CORNER_MODULES LM_REAL(2e-6)
#define CORNER_MARGIN LM_REAL(1e-3)
#else
#define CORNER_SHARE LM_REAL(3e-5)
#define CORNER_MODULES LM_REAL(5e-8)
#define CORNER_MARGIN LM_REAL(1e-6)
#endif

/* Maxima further apart than this belong to different zones. */
#define SAME_ZONE (LM_PI / LM_REAL(36)) /* 5 deg */

/* A moving tooth: its position and the derivatives by the material angle. */
typedef struct motion {
  lm_placement place;
  lm_placement_rate rate;
  lm_real lead_rad; /* of the foot ahead of the rigid space's axis */
  lm_real lead_rate;
} motion;

typedef struct generation {
  const lm_flank *flank;
  const lm_geometry *geometry;
  const lm_neutral_line *line;
  lm_real sense; /* +1 internal; -1 external: a space of the flexspline leaves a rigid tooth, whose
                    half angle is the least one: all angles and radii are compared as negatives */
  lm_flank_foot tip;
  lm_placement scan[SCAN_COUNT];
  lm_real scan_lead[SCAN_COUNT];
  lm_real scan_reach[SCAN_COUNT]; /* of the tip's corner */
} generation;

/* A point of the moving flank in polar coordinates of the rigid space, and its derivatives along
 * the flank (u) and by the material angle (phi). Radii are counted from the undeformed neutral line:
 * where two flanks are nearly parallel, the rounding of a radius would move their contact. */
typedef struct swept_point {
  lm_real above_mm; /* radius minus r_m */
  lm_real radius_mm;
  lm_real radius_u;
  lm_real radius_phi;
  lm_real theta_rad;
  lm_real theta_u;
  lm_real theta_phi;
} swept_point;

static lm_real lead_of(const generation *g, const lm_placement *place, lm_real angle) {
  return place->lead_rad + fold_half_turn(angle) * g->geometry->lead_per_angle;
}

static motion move_tooth(const generation *g, lm_real angle) {
  motion m;
  m.place = lm_move_tooth(g->line, angle, &m.rate);
  m.lead_rad = lead_of(g, &m.place, angle);
  m.lead_rate = m.rate.lead + g->geometry->lead_per_angle;
  return m;
}

static swept_point sweep(const generation *g, const motion *m, const lm_flank_foot *foot) {
  const lm_real c = m->place.tilt_cos;
  const lm_real s = m->place.tilt_sin;
  const lm_real height = foot->along_mm * c - foot->across_mm * s;
  const lm_real along = m->place.radius_mm + height;
  const lm_real across = foot->along_mm * s + foot->across_mm * c;
  const lm_real along_u = foot->along_slope * c - foot->across_slope * s;
  const lm_real across_u = foot->along_slope * s + foot->across_slope * c;
  const lm_real along_phi = m->rate.radius_mm - m->rate.tilt * across;
  const lm_real across_phi = m->rate.tilt * height;
  const lm_real square = along * along + across * across;
  swept_point p;
  p.radius_mm = real_sqrt(square);
  p.above_mm = m->place.above_mm + height + across * across / (along + p.radius_mm);
  p.radius_u = (along * along_u + across * across_u) / p.radius_mm;
  p.radius_phi = (along * along_phi + across * across_phi) / p.radius_mm;
  p.theta_rad = g->sense * (real_near_atan(across / along) + m->lead_rad);
  p.theta_u = g->sense * ((along * across_u - across * along_u) / square);
  p.theta_phi = g->sense * ((along * across_phi - across * along_phi) / square + m->lead_rate);
  return p;
}

/* --- the flank of one placed tooth on a radius ------------------------------------------------ */

/* A placed point of the flank. */
typedef struct placed_point {
  lm_real along_mm;
  lm_real across_mm;
  lm_real radius_mm;
  lm_real above_mm; /* radius minus r_m */
} placed_point;

static placed_point place_point(const lm_placement *place, const lm_flank_foot *foot) {
  const lm_real height = foot->along_mm * place->tilt_cos - foot->across_mm * place->tilt_sin;
  placed_point p;
  p.along_mm = place->radius_mm + height;
  p.across_mm = foot->along_mm * place->tilt_sin + foot->across_mm * place->tilt_cos;
  p.radius_mm = real_sqrt(p.along_mm * p.along_mm + p.across_mm * p.across_mm);
  p.above_mm = place->above_mm + height + p.across_mm * p.across_mm / (p.along_mm + p.radius_mm);
  return p;
}

static lm_real reach_of(const lm_placement *place, const lm_flank_foot *foot) {
  return place_point(place, foot).above_mm;
}

/* Step along the flank from a point of it towards a radius. */
static lm_real step_towards(const lm_placement *place, const lm_flank_foot *foot,
                            const placed_point *at, lm_real above) {
  return (above - at->above_mm) * at->radius_mm /
         (at->along_mm *
              (foot->along_slope * place->tilt_cos - foot->across_slope * place->tilt_sin) +
          at->across_mm *
              (foot->along_slope * place->tilt_sin + foot->across_slope * place->tilt_cos));
}

static lm_flank_foot evaluate_within(const lm_flank *flank, lm_real u) {
  u = u < flank->low_mm ? flank->low_mm : u;
  return lm_evaluate_flank(flank, u > flank->high_mm ? flank->high_mm : u);
}

/* The flank point on a radius: Newton; the flank is nearly radial. */
#define FOOT_STEPS 2

static lm_flank_foot foot_on(const generation *g, const lm_placement *place, lm_real above) {
  lm_flank_foot foot =
      evaluate_within(g->flank, g->sense * (above - place->above_mm) + g->flank->neutral_mm);
  int i;
  for (i = 0; i < FOOT_STEPS; i++) {
    const placed_point at = place_point(place, &foot);
    foot = evaluate_within(g->flank, foot.radius_mm + step_towards(place, &foot, &at, above));
  }
  return foot;
}

/* Angle of the flank point on a radius ahead of the tooth's foot, from the foot of a neighbouring
 * position, which becomes that of this one: a step of Newton, and the tangent from there. */
static lm_real rough_angle(const generation *g, const lm_placement *place, lm_real above,
                           lm_flank_foot *foot) {
  placed_point at = place_point(place, foot);
  lm_real rest;
  *foot = evaluate_within(g->flank, foot->radius_mm + step_towards(place, foot, &at, above));
  at = place_point(place, foot);
  rest = step_towards(place, foot, &at, above);
  at.along_mm +=
      rest * (foot->along_slope * place->tilt_cos - foot->across_slope * place->tilt_sin);
  at.across_mm +=
      rest * (foot->along_slope * place->tilt_sin + foot->across_slope * place->tilt_cos);
  return real_near_atan(at.across_mm / at.along_mm);
}

/* --- the greatest angle on a radius ----------------------------------------------------------- */

/* Part that generates the flank at a radius. */
typedef struct maker {
  lm_real angle; /* material angle of the tooth */
  lm_real theta;
  lm_real slope;   /* of theta by the radius */
  lm_real bend;    /* slope of the slope by the angle, on the radius; 0: not known */
  lm_real foot_mm; /* parameter of the flexspline's flank */
  lm_contact_part part;
  int piece; /* of the flexspline's flank */
  int rival; /* another zone is near, if all maxima were searched */
} maker;

/* Slope by the material angle on a constant radius. */
static lm_real along_radius(const swept_point *p) {
  return p->theta_phi - p->theta_u * p->radius_phi / p->radius_u;
}

static maker make_here(const generation *g, const motion *m, lm_real angle, lm_real above,
                       lm_real *slope) {
  const lm_flank_foot foot = foot_on(g, &m->place, above);
  const swept_point p = sweep(g, m, &foot);
  maker found;
  int i;
  found.angle = angle;
  found.theta = p.theta_rad + p.theta_u / p.radius_u * (above - p.above_mm);
  found.slope = p.theta_u / p.radius_u;
  found.bend = LM_REAL(0);
  found.foot_mm = foot.radius_mm;
  found.part = LM_PART_FLANK;
  found.piece = 0;
  found.rival = 0;
  for (i = 0; i < g->flank->joints; i++) {
    found.piece += foot.radius_mm > g->flank->joint_mm[i];
  }
  *slope = along_radius(&p);
  return found;
}

/* Where the tip's corner passes a radius, near an angle: Newton. */
static maker tip_on(const generation *g, lm_real angle, lm_real above, lm_real *inside) {
  swept_point p;
  maker found;
  int i;
  for (i = 0;; i++) {
    const motion m = move_tooth(g, angle);
    p = sweep(g, &m, &g->tip);
    if (i == 4) {
      break;
    }
    angle += (above - p.above_mm) / p.radius_phi;
  }
  found.angle = angle;
  found.slope = p.theta_phi / p.radius_phi;
  found.theta = p.theta_rad + found.slope * (above - p.above_mm);
  found.bend = LM_REAL(0);
  found.foot_mm = g->tip.radius_mm;
  found.part = LM_PART_TIP;
  found.piece = g->flank->joints + 1;
  found.rival = 0;
  /* Above 0: the flank reaches further before the corner gets here. */
  *inside = along_radius(&p) * (p.radius_phi > LM_REAL(0) ? g->sense : -g->sense);
  return found;
}

static int reaches(const generation *g, const lm_placement *place, lm_real above) {
  return g->sense * reach_of(place, &g->tip) > g->sense * above;
}

/* Newton with the slope of a chord from an angle near the maximum, the first step with the slope of
 * a neighbour; steps out of the mesh end at the tip. Two to four steps reach a smooth maximum. If
 * the curvature of the flank jumps, the chord is misleading: a step out of the angles between a
 * rising and a falling slope is replaced by halving the bracket. */
#define CLIMB_STEPS 16
#define STEP_MAX (LM_PI / LM_REAL(60)) /* 3 deg */
#define INSIDE_STEP (SCAN_STEP / LM_REAL(16))

static lm_real next_step(lm_real slope, lm_real bend, lm_real otherwise) {
  lm_real step = slope > LM_REAL(0) ? otherwise : -otherwise;
  if (bend < LM_REAL(0)) {
    step = -slope / bend;
  }
  step = step > STEP_MAX ? STEP_MAX : step;
  return step < -STEP_MAX ? -STEP_MAX : step;
}

static maker climb(const generation *g, lm_real angle, lm_real above, lm_real bend) {
  motion m = move_tooth(g, angle);
  lm_real slope;
  maker at;
  lm_real step;
  lm_real rising = -REAL_INFINITY;
  lm_real falling = REAL_INFINITY;
  int i;
  if (!reaches(g, &m.place, above)) {
    lm_real inside;
    const maker tip = tip_on(g, angle, above, &inside);
    if (!(inside > LM_REAL(0))) {
      return tip;
    }
    angle =
        tip.angle - (tip.angle > LM_REAL(0) ? INSIDE_STEP : -INSIDE_STEP); /* towards the axis */
    m = move_tooth(g, angle);
  }
  at = make_here(g, &m, angle, above, &slope);
  step = next_step(slope, bend, SCAN_STEP / LM_REAL(4));
  at.bend = bend;
  for (i = 0; i < CLIMB_STEPS && real_fabs(step) > CLIMB_END; i++) {
    const lm_real last_slope = slope;
    const lm_real last_angle = at.angle;
    lm_real chord;
    if (slope > LM_REAL(0)) {
      rising = at.angle;
    } else {
      falling = at.angle;
    }
    if (!(at.angle + step > rising && at.angle + step < falling)) {
      step = (rising + falling) / LM_REAL(2) - at.angle;
    }
    m = move_tooth(g, at.angle + step);
    if (!reaches(g, &m.place, above)) {
      lm_real inside;
      const maker tip = tip_on(g, at.angle + step, above, &inside);
      if (!(inside > LM_REAL(0))) {
        return tip;
      }
      step = (tip.angle - at.angle) / LM_REAL(2);
      m = move_tooth(g, at.angle + step);
    }
    at = make_here(g, &m, at.angle + step, above, &slope);
    chord = (slope - last_slope) / (at.angle - last_angle);
    at.bend = chord;
    step = next_step(slope, chord, SCAN_STEP / LM_REAL(2));
  }
  /* Gain of the last step, so that the derivatives by the dimensions of the drive are those of the
   * maximum. */
  if (real_fabs(step) <= CLIMB_END) {
    at.theta += LM_REAL(0.5) * slope * step;
  }
  return at;
}

static maker greater(maker a, maker b) {
  return b.theta > a.theta ? b : a;
}

/* Maximum of the parabola through three samples, the middle one the greatest. */
static lm_real vertex(lm_real before, lm_real last, lm_real now) {
  const lm_real bend = LM_REAL(2) * last - before - now;
  return bend > LM_REAL(0) ? last + (now - before) * (now - before) / (LM_REAL(8) * bend) : last;
}

/* Parabolas are off their maximum by less than the first share of the pitch. A zone that is below
 * the greatest by more than the second share generates no flank before the next radius that is
 * scanned. Chosen: 400 drives of tests/python/test_flanks.py are right with both. */
#define MISSED_PITCHES LM_REAL(1e-3)
#define RIVAL_PITCHES LM_REAL(1e-2)

/* All maxima on a radius, from the samples of the scan; the greatest. Beside a sample that does not
 * reach the radius, the maximum may be far above its own sample. The sample on the deformation
 * axis reaches every radius of the flank. */
static maker scan_radius(const generation *g, lm_real above) {
  const lm_real pitch = LM_REAL(2) * LM_PI / LM_REAL(g->geometry->rigid_teeth);
  maker best;
  lm_real before = -REAL_INFINITY; /* two samples back, one back */
  lm_real last = -REAL_INFINITY;
  lm_real limit = -REAL_INFINITY;
  lm_real candidate[SCAN_COUNT];
  lm_real value[SCAN_COUNT];
  lm_flank_foot foot = g->tip;
  int candidates = 0;
  int rivals;
  int i;
  for (i = 0; i <= SCAN_COUNT; i++) {
    lm_real now = -REAL_INFINITY;
    if (i < SCAN_COUNT && g->sense * g->scan_reach[i] > g->sense * above) {
      now = g->sense * (rough_angle(g, &g->scan[i], above, &foot) + g->scan_lead[i]);
    }
    if (real_isfinite(last) && last >= before && last >= now) {
      candidate[candidates] = SCAN_STEP * LM_REAL(i - 1 - SCAN_BEHIND);
      value[candidates] = REAL_INFINITY;
      if (real_isfinite(before) && real_isfinite(now)) {
        value[candidates] = vertex(before, last, now);
      }
      limit = last > limit ? last : limit;
      candidates++;
    }
    before = last;
    last = now;
  }
  best.theta = -REAL_INFINITY;
  best.angle = LM_REAL(0);
  best.slope = LM_REAL(0);
  best.bend = LM_REAL(0);
  best.foot_mm = LM_REAL(0);
  best.part = LM_PART_FLANK;
  best.piece = 0;
  best.rival = 0;
  rivals = 0;
  for (i = 0; i < candidates; i++) {
    if (value[i] >= limit - MISSED_PITCHES * pitch) {
      best = greater(best, climb(g, candidate[i], above, LM_REAL(0)));
    }
    rivals += value[i] >= limit - RIVAL_PITCHES * pitch;
  }
  best.rival = rivals > 1;
  return best;
}

/* --- the table -------------------------------------------------------------------------------- */

static lm_real radius_at(const lm_conjugate *c, lm_real place) {
  return c->top_mm - (c->top_mm - c->low_mm) * place * place;
}

static int same_maker(const maker *a, const maker *b) {
  return a->part == b->part && a->piece == b->piece && real_fabs(a->angle - b->angle) < SAME_ZONE;
}

/* Near the angles that generate the flank on both sides, which belong to one zone or to the two
 * sides of a corner: then either side may have its own maximum, at any distance. */
static maker between(const generation *g, const maker *a, const maker *b, lm_real share,
                     lm_real above) {
  if (same_maker(a, b)) {
    return climb(g, a->angle + share * (b->angle - a->angle), above, a->bend);
  }
  return greater(climb(g, a->angle, above, a->bend), climb(g, b->angle, above, b->bend));
}

/* Between two nodes at which all maxima were searched. If they belong to different zones, or
 * another zone is near, any zone may generate the flank between them. */
static maker find_between(const generation *g, const maker *a, const maker *b, lm_real share,
                          lm_real above) {
  return real_fabs(a->angle - b->angle) < SAME_ZONE && !a->rival && !b->rival
             ? between(g, a, b, share, above)
             : scan_radius(g, above);
}

/* An incomplete table, whose radii are counted from the neutral line, with the parts that generate
 * the flank on both sides of each node: towards the top, and away from it. They differ at a
 * corner. */
typedef struct draft {
  const generation *g;
  lm_conjugate table;
  maker reached[LM_CONJUGATE_INTERVALS_MAX + 1];
  maker node[LM_CONJUGATE_INTERVALS_MAX + 1];
} draft;

static maker last_node(const draft *d) {
  return d->node[d->table.intervals];
}

static lm_real last_place(const draft *d) {
  return d->table.place[d->table.intervals];
}

/* Slope by s. */
static lm_real by_place(const lm_conjugate *c, const maker *m, lm_real place) {
  return m->slope * LM_REAL(-2) * (c->top_mm - c->low_mm) * place;
}

static void first_node(draft *d, lm_real place, const maker *at) {
  d->table.intervals = 0;
  d->table.corners = 0;
  d->table.place[0] = place;
  d->table.half_angle_rad[0] = at->theta;
  d->reached[0] = *at;
  d->node[0] = *at;
}

/* The next node: the parts that generate the flank between the last node and this one, and beyond
 * it. */
static void add_node(draft *d, lm_real place, const maker *to, const maker *beyond) {
  lm_conjugate *c = &d->table;
  const int i = c->intervals;
  c->place[i + 1] = place;
  c->half_angle_rad[i + 1] = to->theta;
  c->slope_low[i] = by_place(c, &d->node[i], c->place[i]);
  c->slope_high[i] = by_place(c, to, place);
  c->intervals = i + 1;
  d->reached[i + 1] = *to;
  d->node[i + 1] = *beyond;
  if (!same_maker(to, beyond)) {
    c->corner_mm[c->corners] = radius_at(c, place);
    c->corners++;
  }
}

/* A position from which on another part of the flank, or another zone, generates it, with the parts
 * on both sides. */
typedef struct corner {
  lm_real place;
  maker before;
  maker after;
} corner;

/* Whether the error of the chord between two positions may be significant: its slope differs from
 * those at the ends. */
static int is_open(const draft *d, const corner *side) {
  const lm_conjugate *c = &d->table;
  const lm_real width = side[1].place - side[0].place;
  const lm_real rise = side[1].after.theta - side[0].before.theta;
  return (real_fabs(by_place(c, &side[0].before, side[0].place) * width - rise) +
          real_fabs(by_place(c, &side[1].after, side[1].place) * width - rise)) *
             d->g->line->radius_mm >
         LM_REAL(4) * CORNER_MODULES * d->g->geometry->module_mm;
}

/* Distance from a position to the crossing of the tangents of both sides. */
static lm_real to_crossing(const lm_conjugate *c, const corner *at) {
  return (at->after.theta - at->before.theta) /
         (by_place(c, &at->before, at->place) - by_place(c, &at->after, at->place));
}

/* The chord of the last two positions, within a bracket; the flank is smooth, so the error after
 * the last step is rounding. */
#define JOINT_STEPS 12
#if LM_REAL_BITS == 32
#define JOINT_END LM_REAL(1e-4)
#else
#define JOINT_END LM_REAL(1e-9)
#endif

/* Whether the flank of a tooth reaches less far on a radius a little way towards another angle. */
#define LITTLE_WAY LM_REAL(0.01)

static int falls_towards(const generation *g, lm_real angle, lm_real other, lm_real above) {
  const lm_real at = angle + LITTLE_WAY * (other - angle);
  const motion m = move_tooth(g, at);
  lm_real slope;
  make_here(g, &m, at, above, &slope);
  return slope * (other - angle) < LM_REAL(0);
}

/* Where a joint of the flank passes between two neighbouring pieces of one zone: the angle at which
 * the joint itself generates the flank. 0 if it does not between the last node and `b_place`: a
 * joint from which the reach grows on one side is no maximum, and both pieces have their own. */
static int find_joint(const draft *d, const maker *a, const maker *b, lm_real b_place,
                      lm_real margin, corner *at) {
  const lm_conjugate *c = &d->table;
  const lm_flank *flank = d->g->flank;
  const int lower = a->piece < b->piece ? a->piece : b->piece;
  lm_flank_foot foot;
  swept_point p;
  lm_real low = a->angle;
  lm_real high = b->angle;
  lm_real angle;
  lm_real step;
  lm_real last_angle = LM_REAL(0);
  lm_real last = LM_REAL(0);
  int rises; /* from low to high */
  int i;
  if (a->part != LM_PART_FLANK || b->part != LM_PART_FLANK ||
      (a->piece - b->piece) * (a->piece - b->piece) != 1 ||
      !(real_fabs(a->angle - b->angle) < SAME_ZONE)) {
    return 0;
  }
  foot = lm_evaluate_flank(flank, flank->joint_mm[lower]);
  angle = low + (foot.radius_mm - a->foot_mm) / (b->foot_mm - a->foot_mm) * (high - low);
  {
    const motion from = move_tooth(d->g, low);
    const motion to = move_tooth(d->g, high);
    const swept_point first = sweep(d->g, &from, &foot);
    const swept_point end = sweep(d->g, &to, &foot);
    last = along_radius(&first);
    rises = along_radius(&end) > last;
    last_angle = low;
    if ((along_radius(&end) > LM_REAL(0)) == (last > LM_REAL(0))) {
      return 0;
    }
  }
  step = high - low;
  for (i = 0;; i++) {
    const motion m = move_tooth(d->g, angle);
    lm_real now;
    lm_real next;
    p = sweep(d->g, &m, &foot);
    now = along_radius(&p);
    if (i == JOINT_STEPS || real_fabs(step) <= JOINT_END) {
      break;
    }
    if ((now > LM_REAL(0)) == rises) {
      high = angle;
    } else {
      low = angle;
    }
    next = angle - now * (angle - last_angle) / (now - last);
    if (!((next > low) == (next < high))) { /* out of the bracket */
      next = (low + high) / LM_REAL(2);
    }
    step = next - angle;
    last_angle = angle;
    last = now;
    angle = next;
  }
  at->place = real_sqrt((c->top_mm - p.above_mm) / (c->top_mm - c->low_mm));
  if (!(at->place > last_place(d) + margin && at->place < b_place - margin) ||
      !falls_towards(d->g, angle, a->angle, p.above_mm) ||
      !falls_towards(d->g, angle, b->angle, p.above_mm)) {
    return 0;
  }
  at->before = *a;
  at->before.angle = angle;
  at->before.theta = p.theta_rad;
  at->before.slope = p.theta_u / p.radius_u;
  at->before.foot_mm = foot.radius_mm;
  at->after = at->before;
  at->after.bend = b->bend;
  at->after.piece = b->piece;
  return 1;
}

/* Between the last node and another one. Two zones, or the tip and the flank, have each a maximum
 * on both sides of the corner: Newton on the difference of both. */
static corner find_corner(const draft *d, const maker *b, lm_real b_place) {
  const lm_conjugate *c = &d->table;
  const lm_real margin = CORNER_MARGIN * (b_place - last_place(d));
  corner side[2];
  corner at;
  lm_real next;
  int i;
  side[0].place = last_place(d);
  side[0].before = last_node(d);
  if (find_joint(d, &side[0].before, b, b_place, margin, &at)) {
    return at;
  }
  side[1].place = b_place;
  side[1].after = *b;
  next = (side[0].place + side[1].place) / LM_REAL(2);
  for (i = 0; i < CORNER_STEPS && is_open(d, side); i++) {
    int below;
    at.place = next;
    at.before = climb(d->g, side[0].before.angle, radius_at(c, next), side[0].before.bend);
    at.after = climb(d->g, side[1].after.angle, radius_at(c, next), side[1].after.bend);
    below = at.after.theta > at.before.theta ? same_maker(&at.after, &side[0].before)
                                             : same_maker(&at.before, &side[0].before);
    next = at.place;
    if (same_maker(&at.after, &side[0].before) && same_maker(&at.after, &side[1].after)) {
      at.before = at.after;
      return at; /* one zone that moves fast: a node between the two */
    }
    if (!same_maker(&at.before, &at.after)) {
      next += to_crossing(c, &at);
      if (real_fabs(next - at.place) < CORNER_SHARE && next > last_place(d) + margin &&
          next < b_place - margin) {
        at.place = next;
        at.before = climb(d->g, at.before.angle, radius_at(c, next), at.before.bend);
        at.after = climb(d->g, at.after.angle, radius_at(c, next), at.after.bend);
        at.after.theta = at.before.theta;
        return at;
      }
    }
    if (below) {
      side[0].place = at.place;
      side[0].before = at.after.theta > at.before.theta ? at.after : at.before;
    } else {
      side[1].place = at.place;
      side[1].after = at.after.theta > at.before.theta ? at.after : at.before;
    }
    if (!(next > side[0].place && next < side[1].place)) {
      next = (side[0].place + side[1].place) / LM_REAL(2);
    }
  }
  at.place = side[1].place < b_place ? side[1].place : b_place - margin;
  at.before = side[0].before;
  at.after = side[1].after;
  at.after.theta -= by_place(c, &at.after, at.place) * (side[1].place - at.place);
  at.before.theta = at.after.theta;
  return at;
}

/* From the last node to another one, with the corners between them as long as there is room for
 * `rest` more intervals. */
static void add_piece(draft *d, const maker *b, lm_real b_place, const maker *beyond, int rest) {
  maker a = last_node(d);
  while (!same_maker(&a, b) && d->table.intervals + 2 + rest <= LM_CONJUGATE_INTERVALS_MAX &&
         d->table.corners + 1 < LM_CONJUGATE_CORNERS_MAX) {
    corner at = find_corner(d, b, b_place);
    if (!same_maker(&a, &at.before)) { /* another corner lies before it */
      at = find_corner(d, &at.before, at.place);
    }
    add_node(d, at.place, &at.before, &at.after);
    a = last_node(d);
  }
  add_node(d, b_place, b, beyond);
}

/* --- intervals in which a cubic is not accurate ----------------------------------------------- */

static lm_real cubic(lm_real width, lm_real x, lm_real low, lm_real slope_low, lm_real high,
                     lm_real slope_high) {
  const lm_real rest = LM_REAL(1) - x;
  return rest * rest * ((LM_REAL(1) + LM_REAL(2) * x) * low + x * width * slope_low) +
         x * x * ((LM_REAL(1) + LM_REAL(2) * rest) * high - rest * width * slope_high);
}

static int is_smooth(const draft *d, int interval) {
  return interval >= 0 && interval < d->table.intervals &&
         same_maker(&d->node[interval], &d->reached[interval + 1]);
}

/* Whether the intervals that meet in a node are smooth, and smooth across it. */
static int is_smooth_across(const draft *d, int node) {
  return is_smooth(d, node - 1) && is_smooth(d, node) &&
         same_maker(&d->reached[node], &d->node[node]);
}

/* Error at a node of the cubic over the two intervals that meet there, modules. */
static lm_real missed_at(const draft *d, int node) {
  const lm_conjugate *c = &d->table;
  const lm_real width = c->place[node + 1] - c->place[node - 1];
  const lm_real found =
      cubic(width, (c->place[node] - c->place[node - 1]) / width, c->half_angle_rad[node - 1],
            c->slope_low[node - 1], c->half_angle_rad[node + 1], c->slope_high[node]);
  return real_fabs(found - c->half_angle_rad[node]) * d->g->line->radius_mm /
         d->g->geometry->module_mm;
}

/* Of a smooth flank, that error is 16 times the one of an interval: it grows with the fourth power
 * of the width. If the curvature jumps within an interval, the error there is up to 0.55 times the
 * greater one at its ends. */
#define WIDER_ERROR LM_REAL(4)
#if LM_REAL_BITS == 32
#define MISSED_MODULES LM_REAL(2e-6) /* ten times the resolution of the angles */
#else
#define MISSED_MODULES LM_REAL(4e-7)
#endif

/* The third derivative of a spline jumps at each of its points, so the error at a node does not
 * bound the one beside it. */
static lm_real wider_error(const draft *d) {
  return d->g->flank->kind == LM_FLANK_POINTS ? LM_REAL(1) : WIDER_ERROR;
}

static int is_doubtful(const draft *d, int interval) {
  const lm_real allowed = wider_error(d) * MISSED_MODULES;
  const int before = is_smooth_across(d, interval);
  const int after = is_smooth_across(d, interval + 1);
  if (!before || !after) { /* beside a corner: nothing on its other side to compare with */
    return is_smooth(d, interval);
  }
  return missed_at(d, interval) > allowed || missed_at(d, interval + 1) > allowed;
}

/* Halves an interval until the cubic meets the middle, at most as often as this: the last time where
 * it misses by more than a node may. The reason may be a zone that is the greatest nowhere else, so
 * all are searched. A flank of points is halved once more in any case. */
#define HALVINGS 5

/* A cubic that meets the middle with another slope misses beside it: an error with the factor
 * x^2 (1 - x)^2 that vanishes in the middle is this share of its slope there at most. */
#define BESIDE_SHARE LM_REAL(0.143)

static void add_halves(draft *d, const maker *b, lm_real b_place, const maker *beyond, int rest,
                       int halvings) {
  lm_conjugate *c = &d->table;
  const maker a = last_node(d);
  const lm_real a_place = last_place(d);
  const lm_real place = (a_place + b_place) / LM_REAL(2);
  const lm_real width = b_place - a_place;
  maker middle;
  lm_real missed;
  lm_real turned;
  if (c->intervals + 2 + rest > LM_CONJUGATE_INTERVALS_MAX) {
    add_piece(d, b, b_place, beyond, rest);
    return;
  }
  middle = scan_radius(d->g, radius_at(c, place));
  missed = cubic(width, LM_REAL(0.5), a.theta, by_place(c, &a, a_place), b->theta,
                 by_place(c, b, b_place)) -
           middle.theta;
  turned = LM_REAL(1.5) * (b->theta - a.theta) -
           LM_REAL(0.25) * width * (by_place(c, &a, a_place) + by_place(c, b, b_place)) -
           width * by_place(c, &middle, place);
  missed = real_fabs(missed) + BESIDE_SHARE * real_fabs(turned);
  if (halvings > HALVINGS ||
      (halvings > 1 &&
       missed * d->g->line->radius_mm > (halvings == HALVINGS ? LM_REAL(1) : wider_error(d)) *
                                            MISSED_MODULES * d->g->geometry->module_mm)) {
    add_halves(d, &middle, place, &middle, rest + 1, halvings - 1);
    add_halves(d, b, b_place, beyond, rest, halvings - 1);
  } else {
    add_piece(d, &middle, place, &middle, rest + 1);
    add_piece(d, b, b_place, beyond, rest);
  }
}

/* The same table with the inaccurate intervals halved. */
static void refine(const draft *rough, draft *d) {
  int k;
  d->g = rough->g;
  d->table.low_mm = rough->table.low_mm;
  d->table.top_mm = rough->table.top_mm;
  first_node(d, rough->table.place[0], &rough->node[0]);
  for (k = 0; k < rough->table.intervals; k++) {
    const maker *to = &rough->reached[k + 1];
    const maker *beyond = &rough->node[k + 1];
    const lm_real place = rough->table.place[k + 1];
    if (is_doubtful(rough, k)) {
      add_halves(d, to, place, beyond, rough->table.intervals - k - 1,
                 d->g->flank->kind == LM_FLANK_POINTS ? HALVINGS + 1 : HALVINGS);
    } else {
      add_node(d, place, to, beyond);
    }
  }
}

/* Bounds of the derivatives by the radius over a piece. With h = 1 / (top - low), the second one is
 * h^2 (s xi_ss - xi_s) / (4 s^3). The bracket n is n_0 + 3 d (s^2 - s_0^2) with the coefficient d of
 * the cube, so this has one extreme at most, 2 d h^2 / (4 s) where n = 2 d s^2. */
static void bound_piece(lm_conjugate *c, int i) {
  const lm_plain cube = LM_VALUE(c->cube[i]);
  const lm_plain from = LM_VALUE(c->place[i]);
  const lm_plain to = LM_VALUE(c->place[i + 1]);
  const lm_plain square = from * from;
  const lm_plain scale = LM_VALUE(c->per_height) * LM_VALUE(c->per_height) / LM_PLAIN(4);
  const lm_plain bracket = LM_PLAIN(2) * LM_VALUE(c->square[i]) * from - LM_VALUE(c->slope_low[i]);
  const lm_plain width = to * to - square;
  const lm_plain at_from = scale * bracket / (square * from);
  const lm_plain at_to = scale * (bracket + LM_PLAIN(3) * cube * width) / (to * to * to);
  const lm_plain extreme = LM_PLAIN(2) * square - bracket / cube; /* s^2 - s_0^2 there */
  lm_plain size = LM_VALUE(c->slope_low[i]) * LM_VALUE(c->per_height) / (LM_PLAIN(2) * from);
  c->bend_least[i] = at_from < at_to ? at_from : at_to;
  c->bend_most[i] = at_from < at_to ? at_to : at_from;
  if (extreme > LM_PLAIN(0) && extreme < width) {
    const lm_plain between = LM_PLAIN(2) * scale * cube / plain_sqrt(square + extreme);
    c->bend_least[i] = between < c->bend_least[i] ? between : c->bend_least[i];
    c->bend_most[i] = between > c->bend_most[i] ? between : c->bend_most[i];
  }
  c->bend_lowest = c->bend_least[i] < c->bend_lowest ? c->bend_least[i] : c->bend_lowest;
  c->bend_highest = c->bend_most[i] > c->bend_highest ? c->bend_most[i] : c->bend_highest;
  size = plain_fabs(size) + (plain_fabs(c->bend_least[i]) > plain_fabs(c->bend_most[i])
                                 ? plain_fabs(c->bend_least[i])
                                 : plain_fabs(c->bend_most[i])) *
                                width / plain_fabs(LM_VALUE(c->per_height));
  c->slope_size = size > c->slope_size ? size : c->slope_size;
}

/* Values that follow from the nodes, for its evaluation. */
static void prepare_evaluation(lm_conjugate *c) {
  int low = 0;
  int i;
  c->per_height = LM_REAL(1) / (c->top_mm - c->low_mm);
  c->slope_size = LM_PLAIN(0);
  c->bend_lowest = PLAIN_INFINITY;
  c->bend_highest = -PLAIN_INFINITY;
  for (i = 0; i < c->intervals; i++) {
    const lm_real per_width = LM_REAL(1) / (c->place[i + 1] - c->place[i]);
    const lm_real chord = (c->half_angle_rad[i + 1] - c->half_angle_rad[i]) * per_width;
    const lm_real bend = c->slope_low[i] + c->slope_high[i] - LM_REAL(2) * chord;
    c->square[i] = (chord - c->slope_low[i] - bend) * per_width;
    c->cube[i] = bend * per_width * per_width;
    bound_piece(c, i);
  }
  for (i = 0; i < LM_CONJUGATE_BINS; i++) {
    const lm_real from = LM_REAL(i) / LM_REAL(LM_CONJUGATE_BINS);
    while (low < c->intervals - 1 && from >= c->place[low + 1]) {
      low++;
    }
    c->first[i] = (unsigned char)low;
  }
}

/* Shift and backlash move the finished flank. A tool that is displaced radially cuts the same width
 * at another radius, so the angle of the flank falls as 1 / radius. */
static void displace(lm_conjugate *c, lm_real shift_mm, lm_real backlash_mm) {
  int i;
  for (i = 0; i <= c->intervals; i++) {
    const lm_real radius = radius_at(c, c->place[i]);
    const lm_real by_place = LM_REAL(-2) * (c->top_mm - c->low_mm) * c->place[i];
    const lm_real moved = radius + shift_mm;
    const lm_real share = radius / moved;
    const lm_real turn = backlash_mm / moved;
    const lm_real slope = (c->half_angle_rad[i] * shift_mm / moved - turn) / moved * by_place;
    c->half_angle_rad[i] = c->half_angle_rad[i] * share + turn;
    if (i < c->intervals) {
      c->slope_low[i] = c->slope_low[i] * share + slope;
    }
    if (i > 0) {
      c->slope_high[i - 1] = c->slope_high[i - 1] * share + slope;
    }
  }
  for (i = 0; i < c->corners; i++) {
    c->corner_mm[i] += shift_mm;
  }
  c->low_mm += shift_mm;
  c->top_mm += shift_mm;
  c->land_mm = radius_at(c, c->place[0]);
  prepare_evaluation(c);
}

/* Half angles in place of what was compared, and radii from the centre. */
static void restore(lm_conjugate *c, lm_real sense, lm_real neutral_mm) {
  int i;
  c->low_mm += neutral_mm;
  c->top_mm += neutral_mm;
  for (i = 0; i < c->corners; i++) {
    c->corner_mm[i] += neutral_mm;
  }
  for (i = 0; i <= c->intervals; i++) {
    c->half_angle_rad[i] *= sense;
  }
  for (i = 0; i < c->intervals; i++) {
    c->slope_low[i] *= sense;
    c->slope_high[i] *= sense;
  }
}

static void start(generation *g, const lm_flank *flank, const lm_geometry *geometry,
                  const lm_neutral_line *line) {
  int i;
  g->flank = flank;
  g->geometry = geometry;
  g->line = line;
  g->sense = line->sense;
  g->tip = lm_evaluate_flank(flank, flank->high_mm);
  for (i = 0; i < SCAN_COUNT; i++) {
    const lm_real angle = SCAN_STEP * LM_REAL(i - SCAN_BEHIND);
    g->scan[i] = lm_place_tooth(line, angle);
    g->scan_lead[i] = lead_of(g, &g->scan[i], angle);
    g->scan_reach[i] = reach_of(&g->scan[i], &g->tip);
  }
}

lm_status lm_make_conjugate(const lm_flank *flank, const lm_geometry *geometry,
                            const lm_neutral_line *line, lm_real shift_mm, lm_real backlash_mm,
                            lm_conjugate *conjugate, lm_fault *fault) {
  const lm_real first_place = real_sqrt(LM_REAL(LM_CONJUGATE_LAND));
  generation g;
  draft rough;
  draft fine;
  maker after;
  int block;
  if (flank == 0 || geometry == 0 || line == 0 || conjugate == 0) {
    return refuse(fault, LM_NULL, "flank, geometry, line, conjugate");
  }
  start(&g, flank, geometry, line);
  rough.g = &g;
  rough.table.low_mm = geometry->rigid_tip_mm - shift_mm - line->radius_mm;
  rough.table.top_mm = g.scan_reach[SCAN_BEHIND];
  if (!(g.sense * (rough.table.top_mm - rough.table.low_mm) >
        LM_REAL(0.01) * geometry->module_mm)) {
    const lm_real tip = geometry->rigid_tip_mm - shift_mm;
    return refuse_contradiction(
        fault, "teeth.engagement_depth", line->radius_mm + rough.table.top_mm,
        g.sense > LM_REAL(0) ? tip : LM_REAL(0), g.sense > LM_REAL(0) ? REAL_INFINITY : tip);
  }
  after = scan_radius(&g, radius_at(&rough.table, first_place));
  first_node(&rough, first_place, &after);
  for (block = 0; block < NODES / SCAN_EVERY; block++) {
    const lm_real width = (LM_REAL(1) - first_place) / LM_REAL(NODES / SCAN_EVERY);
    const lm_real from = last_place(&rough);
    const maker before = after;
    const lm_real end = first_place + width * LM_REAL(block + 1);
    int i;
    after = scan_radius(&g, radius_at(&rough.table, end));
    for (i = 1; i <= SCAN_EVERY; i++) {
      const lm_real share = LM_REAL(i) / LM_REAL(SCAN_EVERY);
      const lm_real place = from + share * (end - from);
      const maker here =
          i < SCAN_EVERY ? find_between(&g, &before, &after, share, radius_at(&rough.table, place))
                         : after;
      add_piece(&rough, &here, place, &here, NODES - (block * SCAN_EVERY + i));
    }
  }
  refine(&rough, &fine);
  restore(&fine.table, g.sense, line->radius_mm);
  displace(&fine.table, shift_mm, g.sense * backlash_mm);
  *conjugate = fine.table;
  return LM_OK;
}

/* --- a flank of points ------------------------------------------------------------------------ */

/* Whether the points, which end at two radii, form a flank between the tip circle and the
 * flexspline's tip on the axis. */
static lm_status check_rigid_points(const lm_flank_points *p, const lm_geometry *g,
                                    lm_real shift_mm, lm_real inner_mm, lm_real outer_mm,
                                    lm_fault *fault) {
  const int internal = g->deformation == LM_INTERNAL;
  const lm_real pitch_half = LM_PI / LM_REAL(g->rigid_teeth);
  const lm_real tip = g->rigid_tip_mm - shift_mm;
  const lm_real reach = g->flexspline_tip_mm + (internal ? g->deflection_mm : -g->deflection_mm);
  const lm_real land = reach - LM_REAL(LM_CONJUGATE_LAND) * (reach - tip) - shift_mm;
  const lm_real inner = internal ? tip : land; /* radii to which the points have to reach */
  const lm_real outer = internal ? land : tip;
  int i;
  if (!(outer_mm >= outer)) {
    return refuse_contradiction(fault, "flank.rigid_points, teeth.engagement_depth", outer_mm,
                                outer, REAL_INFINITY);
  }
  if (!(inner_mm <= inner)) {
    return refuse_contradiction(fault, "flank.rigid_points, teeth.engagement_depth", inner_mm,
                                LM_REAL(0), inner);
  }
  for (i = 0; i < p->count; i++) {
    const lm_real width = LM_REAL(p->across_mm[i]);
    const lm_real room = pitch_half * LM_REAL(p->along_mm[i]);
    if (!(width > LM_REAL(0) && width < room)) {
      return refuse_contradiction(fault, "flank.rigid_points", width, LM_REAL(0), room);
    }
  }
  return LM_OK;
}

/* The points as a flank about the gear's own centre. */
static void take_points(const lm_flank_points *p, lm_flank *flank) {
  flank->kind = LM_FLANK_POINTS;
  flank->neutral_mm = LM_REAL(0);
  flank->low_mm = LM_REAL(p->along_mm[0]);
  flank->high_mm = LM_REAL(p->along_mm[p->count - 1]);
  flank->points = p;
  flank->points_shift_mm = LM_REAL(0);
  flank->relief_mm = LM_REAL(0);
  flank->joints = 0;
  flank->inward = 0;
}

static lm_real radius_of_end(const lm_flank *flank, lm_real parameter_mm) {
  const lm_flank_foot end = lm_evaluate_flank(flank, parameter_mm);
  return real_sqrt(end.along_mm * end.along_mm + end.across_mm * end.across_mm);
}

lm_status lm_tabulate_rigid_points(const lm_flank_points *points, const lm_geometry *geometry,
                                   lm_real shift_mm, lm_real backlash_mm, lm_conjugate *conjugate,
                                   lm_fault *fault) {
  const lm_real first_place = real_sqrt(LM_REAL(LM_CONJUGATE_LAND));
  lm_conjugate made;
  lm_flank flank;
  lm_real inner_mm;
  lm_real outer_mm;
  lm_real last_mm;
  lm_status status;
  const int internal = geometry != 0 && geometry->deformation == LM_INTERNAL;
  int i;
  if (points == 0 || geometry == 0 || conjugate == 0) {
    return refuse(fault, LM_NULL, points == 0 ? "flank.rigid_points" : "geometry, conjugate");
  }
  status = check_range(fault, "flank.rigid_points", LM_REAL(points->count), LM_REAL(4),
                       LM_REAL(LM_FLANK_POINTS_MAX));
  for (i = 1; status == LM_OK && i < points->count; i++) {
    status = points->along_mm[i] > points->along_mm[i - 1]
                 ? LM_OK
                 : refuse(fault, LM_NOT_MONOTONE, "flank.rigid_points");
  }
  if (status != LM_OK) {
    return status;
  }
  take_points(points, &flank);
  inner_mm = radius_of_end(&flank, flank.low_mm);
  outer_mm = radius_of_end(&flank, flank.high_mm);
  made.low_mm = geometry->rigid_tip_mm - shift_mm;
  status = check_rigid_points(points, geometry, shift_mm, inner_mm, outer_mm, fault);
  if (status != LM_OK) {
    return status;
  }
  /* The land begins at the last point. */
  last_mm = internal ? outer_mm : inner_mm;
  made.top_mm = made.low_mm + (last_mm - made.low_mm) / (LM_REAL(1) - LM_REAL(LM_CONJUGATE_LAND));
  made.intervals = LM_CONJUGATE_INTERVALS_MAX;
  made.corners = 0;
  for (i = 0; i <= made.intervals; i++) {
    const lm_real place =
        first_place + (LM_REAL(1) - first_place) * LM_REAL(i) / LM_REAL(made.intervals);
    const lm_real radius = radius_at(&made, place);
    const lm_flank_foot foot = lm_evaluate_flank(&flank, lm_flank_at_radius(&flank, radius));
    const lm_real slope = (foot.along_mm * foot.across_slope - foot.across_mm) /
                          (foot.along_mm + foot.across_mm * foot.across_slope) / radius *
                          LM_REAL(-2) * (made.top_mm - made.low_mm) * place;
    made.place[i] = place;
    made.half_angle_rad[i] = real_atan(foot.across_mm / foot.along_mm);
    if (i < made.intervals) {
      made.slope_low[i] = slope;
    }
    if (i > 0) {
      made.slope_high[i - 1] = slope;
    }
  }
  displace(&made, shift_mm, internal ? backlash_mm : -backlash_mm);
  *conjugate = made;
  return LM_OK;
}

/* The interval of a place that is not on the land. */
static int find_interval(const lm_conjugate *c, lm_plain place) {
  const int bin = (int)(place * LM_PLAIN(LM_CONJUGATE_BINS));
  int low = c->first[bin < LM_CONJUGATE_BINS ? bin : LM_CONJUGATE_BINS - 1];
  while (low < c->intervals - 1 && place >= LM_VALUE(c->place[low + 1])) {
    low++;
  }
  return low;
}

void lm_bound_conjugate_bend(const lm_conjugate *conjugate, int a, int b, lm_plain *least,
                             lm_plain *most) {
  const lm_conjugate *c = conjugate;
  const int last = a > b ? a : b;
  int i = a < b ? a : b;
  *least = i < 0 ? LM_PLAIN(0) : c->bend_least[i];
  *most = i < 0 ? LM_PLAIN(0) : c->bend_most[i];
  for (i++; i <= last; i++) {
    *least = c->bend_least[i] < *least ? c->bend_least[i] : *least;
    *most = c->bend_most[i] > *most ? c->bend_most[i] : *most;
  }
}

lm_real lm_conjugate_half_angle(const lm_conjugate *conjugate, lm_real radius_mm, lm_real *tangent,
                                int *piece) {
  const lm_conjugate *c = conjugate;
  const lm_real below = (c->top_mm - radius_mm) * c->per_height;
  lm_real place = c->place[0];
  lm_real x;
  int low;
  *tangent = LM_REAL(0);
  *piece = LM_CONJUGATE_ON_LAND;
  if (!(below > place * place * (LM_REAL(1) - LAND_SLACK))) { /* radial */
    return c->half_angle_rad[0];
  }
  place = real_sqrt(below);
  low = find_interval(c, LM_VALUE(place));
  *piece = low;
  x = place - c->place[low];
  *tangent =
      (c->slope_low[low] + x * (LM_REAL(2) * c->square[low] + LM_REAL(3) * c->cube[low] * x)) *
      radius_mm * c->per_height / (LM_REAL(2) * place);
  return c->half_angle_rad[low] + x * (c->slope_low[low] + x * (c->square[low] + x * c->cube[low]));
}

lm_involute_point lm_evaluate_conjugate(const lm_conjugate *conjugate, lm_real radius_mm) {
  lm_involute_point point;
  int piece;
  point.half_angle_rad = lm_conjugate_half_angle(conjugate, radius_mm, &point.tangent, &piece);
  point.pressure_angle_rad = real_atan(point.tangent);
  return point;
}

/* --- zones ------------------------------------------------------------------------------------ */

/* Cross product of both derivatives of the point: 0 where the relative velocity lies in the
 * flank. */
static lm_real envelope(const generation *g, const lm_flank_foot *foot, lm_real angle,
                        swept_point *p) {
  const motion m = move_tooth(g, angle);
  *p = sweep(g, &m, foot);
  return p->theta_phi * p->radius_u - p->theta_u * p->radius_phi;
}

/* Regula falsi with the Illinois correction. */
#define ZONE_STEPS 12

/* Steps of the scan in either direction: 60 deg. */
#define ZONE_HALF 24

static lm_conjugate_contact find_contact(const generation *g, const lm_flank_foot *foot, lm_real a,
                                         lm_real b, lm_real at_a, lm_real at_b) {
  lm_conjugate_contact contact;
  lm_real angle = a;
  swept_point p;
  int side = 0;
  int i;
  for (i = 0; i < ZONE_STEPS; i++) {
    lm_real value;
    angle = (a * at_b - b * at_a) / (at_b - at_a);
    value = envelope(g, foot, angle, &p);
    if (value == LM_REAL(0)) {
      break;
    }
    if ((value > LM_REAL(0)) == (at_a > LM_REAL(0))) {
      a = angle;
      at_a = value;
      at_b = side == -1 ? at_b / LM_REAL(2) : at_b;
      side = -1;
    } else {
      b = angle;
      at_b = value;
      at_a = side == 1 ? at_a / LM_REAL(2) : at_a;
      side = 1;
    }
  }
  contact.angle_rad = angle;
  contact.radius_mm = p.radius_mm;
  contact.half_angle_rad = g->sense * p.theta_rad;
  contact.beyond_mm = (scan_radius(g, p.above_mm).theta - p.theta_rad) * p.radius_mm;
  return contact;
}

lm_status lm_find_conjugate_contacts(const lm_flank *flank, const lm_geometry *geometry,
                                     const lm_neutral_line *line, lm_real parameter_mm,
                                     lm_conjugate_contact contacts[], int capacity, int *count,
                                     lm_fault *fault) {
  generation g;
  lm_flank_foot foot;
  swept_point p;
  lm_real before;
  lm_status status;
  int found = 0;
  int i;
  if (flank == 0 || geometry == 0 || line == 0 || contacts == 0 || count == 0) {
    return refuse(fault, LM_NULL, "flank, geometry, line, contacts, count");
  }
  status = check_range(fault, "parameter_mm", parameter_mm, flank->low_mm, flank->high_mm);
  if (status != LM_OK) {
    return status;
  }
  start(&g, flank, geometry, line);
  foot = lm_evaluate_flank(flank, parameter_mm);
  before = envelope(&g, &foot, -SCAN_STEP * LM_REAL(ZONE_HALF), &p);
  for (i = 1; i <= 2 * ZONE_HALF && found < capacity; i++) {
    const lm_real angle = SCAN_STEP * LM_REAL(i - ZONE_HALF);
    const lm_real now = envelope(&g, &foot, angle, &p);
    if ((before > LM_REAL(0)) != (now > LM_REAL(0))) {
      contacts[found] = find_contact(&g, &foot, angle - SCAN_STEP, angle, before, now);
      found++;
    }
    before = now;
  }
  *count = found;
  return LM_OK;
}
