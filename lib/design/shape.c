#include "lostmotion/shape.h"

#include "half_turn.h"
#include "real_math.h"
#include "refuse.h"

/* Four rollers: D falls to zero at 43.891 deg and the shape changes sign; 35 deg is the largest
 * angle with a usable shape. */
#define ROLLER_ANGLE_MAX LM_REAL(0.6108652381980153)
#define ARC_ANGLE_MIN LM_REAL(0.05)
#define ARC_ANGLE_MAX LM_REAL(1.2)

/* Gauss-Legendre on [-1, 1], twelve points: the closed length of every shape here to 1e-14. */
#define GAUSS_POINTS 12
static const double gauss_node[GAUSS_POINTS] = {
    -0.98156063424671925, -0.90411725637047486, -0.76990267419430469, -0.58731795428661745,
    -0.36783149899818019, -0.12523340851146892, 0.12523340851146892,  0.36783149899818019,
    0.58731795428661745,  0.76990267419430469,  0.90411725637047486,  0.98156063424671925};
static const double gauss_weight[GAUSS_POINTS] = {
    0.04717533638651183, 0.10693932599531843, 0.16007832854334623, 0.20316742672306592,
    0.23349253653835481, 0.24914704581340279, 0.24914704581340279, 0.23349253653835481,
    0.20316742672306592, 0.16007832854334623, 0.10693932599531843, 0.04717533638651183};

/* Four rollers: contact zone [A cos + sin(b) phi sin - 4/pi]/D, free zone in p = pi/2 - phi
 * [k cos p + cos(b) p sin p - 4/pi]/D. */
static void make_rollers(lm_real beta, lm_shape *shape) {
  const lm_real s = real_sin(beta);
  const lm_real c = real_cos(beta);
  const lm_real a = s + (HALF_PI - beta) * c;
  const lm_real mean = LM_REAL(4) / LM_PI;
  const lm_real d = a - mean;
  shape->inner[0] = -mean / d;
  shape->inner[1] = a / d;
  shape->inner[2] = s / d;
  shape->outer[0] = -mean / d;
  shape->outer[1] = (c + beta * s) / d;
  shape->outer[2] = c / d;
}

/* Arc of constant curvature over |phi| <= beta: w, w' and w'' are continuous at beta, the mean of w
 * is zero, w(0) = 1. */
static void make_arc(lm_real beta, lm_shape *shape) {
  const lm_real x = HALF_PI - beta;
  const lm_real s = real_sin(beta);
  const lm_real c = real_cos(beta);
  const lm_real g = HALF_PI / (HALF_PI * (x - s * c) + LM_REAL(2) * x * s - LM_REAL(2) * c);
  const lm_real d = g * (x - s * c);
  const lm_real f = g * (LM_REAL(1) + s * s);
  shape->inner[0] = LM_REAL(1) - d;
  shape->inner[1] = d;
  shape->inner[2] = LM_REAL(0);
  shape->outer[0] = shape->inner[0] + d * c - f * s - g * x * c;
  shape->outer[1] = f;
  shape->outer[2] = g;
}

lm_status lm_make_shape(lm_generator_type type, lm_real contact_half_angle_rad, lm_shape *shape,
                        lm_fault *fault) {
  lm_status status = LM_OK;
  lm_real low = LM_REAL(0);
  lm_real high = ROLLER_ANGLE_MAX;
  if (shape == 0) {
    return refuse(fault, LM_NULL, "shape");
  }
  if (type == LM_COSINE || type == LM_ELLIPSE) {
    shape->type = type;
    shape->contact_half_angle_rad = LM_PI / LM_REAL(4);
    return LM_OK;
  }
  if (type == LM_DISCS || type == LM_RING) {
    low = ARC_ANGLE_MIN;
    high = ARC_ANGLE_MAX;
  } else if (type != LM_ROLLERS) {
    return refuse_range(fault, "generator.type", (lm_real)(int)type, LM_REAL(LM_COSINE),
                        LM_REAL(LM_RING));
  }
  status =
      check_range(fault, "generator.contact_half_angle_rad", contact_half_angle_rad, low, high);
  if (status != LM_OK) {
    return status;
  }
  shape->type = type;
  shape->contact_half_angle_rad = contact_half_angle_rad;
  if (type == LM_ROLLERS) {
    make_rollers(contact_half_angle_rad, shape);
  } else {
    make_arc(contact_half_angle_rad, shape);
  }
  return LM_OK;
}

/* w, v and w' for 0 <= angle <= pi/2. The free zone's v runs from its zero at pi/2 backwards. */
static lm_wave wave_in_quadrant(const lm_shape *shape, lm_real angle) {
  lm_wave wave;
  if (shape->type == LM_COSINE || shape->type == LM_ELLIPSE) {
    const lm_real s = real_sin(LM_REAL(2) * angle);
    const lm_real c = real_cos(LM_REAL(2) * angle);
    wave.radial = c;
    wave.tangential = LM_REAL(-0.5) * s;
    wave.slope = LM_REAL(-2) * s;
    wave.curvature = LM_REAL(3) * c;
  } else {
    const int inside = angle <= shape->contact_half_angle_rad;
    const lm_real *k = inside ? shape->inner : shape->outer;
    const lm_real x = inside ? angle : HALF_PI - angle;
    const lm_real sign = inside ? LM_REAL(1) : LM_REAL(-1);
    const lm_real s = real_sin(x);
    const lm_real c = real_cos(x);
    wave.radial = k[0] + k[1] * c + k[2] * x * s;
    wave.tangential = -sign * (k[0] * x + k[1] * s + k[2] * (s - x * c));
    wave.slope = sign * (k[2] * (s + x * c) - k[1] * s);
    wave.curvature = -(k[0] + LM_REAL(2) * k[2] * c);
  }
  wave.rotation = wave.tangential - wave.slope;
  return wave;
}

lm_wave lm_evaluate_shape(const lm_shape *shape, lm_real angle_rad) {
  const lm_real angle = fold_half_turn(angle_rad);
  lm_wave wave = wave_in_quadrant(shape, real_fabs(angle));
  if (angle < LM_REAL(0)) {
    wave.tangential = -wave.tangential;
    wave.rotation = -wave.rotation;
    wave.slope = -wave.slope;
  }
  return wave;
}

/* Within a zone the curvature is monotone, so its extremes are at 0, beta and pi/2. */
static void curvature_range(const lm_shape *shape, lm_real *low, lm_real *high) {
  lm_real curvature[3];
  int i;
  curvature[0] = wave_in_quadrant(shape, LM_REAL(0)).curvature;
  curvature[1] = wave_in_quadrant(shape, shape->contact_half_angle_rad).curvature;
  curvature[2] = wave_in_quadrant(shape, HALF_PI).curvature;
  *low = curvature[0];
  *high = curvature[0];
  for (i = 1; i < 3; i++) {
    *low = curvature[i] < *low ? curvature[i] : *low;
    *high = curvature[i] > *high ? curvature[i] : *high;
  }
}

lm_real lm_largest_shape_curvature(const lm_shape *shape) {
  lm_real low;
  lm_real high;
  curvature_range(shape, &low, &high);
  return high > -low ? high : -low;
}

lm_real lm_shape_curvature_amplitude(const lm_shape *shape) {
  lm_real low;
  lm_real high;
  curvature_range(shape, &low, &high);
  return (high - low) / LM_REAL(2);
}

/* The jump of the ring's shear force where the contact ends: four times the p sin p coefficient;
 * a bilateral cosine pressure adds up to 6. */
lm_real lm_shape_generator_force(const lm_shape *shape) {
  if (shape->type == LM_COSINE || shape->type == LM_ELLIPSE) {
    return LM_REAL(6);
  }
  return LM_REAL(4) * shape->outer[2];
}

/* --- neutral line --- */

/* A point of the ellipse's parallel curve at parameter t, and the curve's direction there. */
static void parallel_point(const lm_neutral_line *line, lm_real t, lm_real *x, lm_real *y,
                           lm_real *tx, lm_real *ty) {
  const lm_real c = real_cos(t);
  const lm_real s = real_sin(t);
  const lm_real a = line->along_mm;
  const lm_real b = line->across_mm;
  const lm_real h = real_sqrt(b * b * c * c + a * a * s * s);
  const lm_real stretch = LM_REAL(1) + line->parallel_mm * a * b / (h * h * h);
  *x = c * (a + line->parallel_mm * b / h);
  *y = s * (b + line->parallel_mm * a / h);
  *tx = -stretch * a * s;
  *ty = stretch * b * c;
}

/* R(p) of the ellipse: Newton on the parameter t, whose difference from p is of order w0/r_m; each
 * round squares the error, so four reach rounding. */
static void ellipse_radius(const lm_neutral_line *line, lm_real polar, lm_real *radius,
                           lm_real *slope, lm_real *parameter) {
  const lm_real c = real_cos(polar);
  const lm_real s = real_sin(polar);
  lm_real t = polar;
  lm_real x;
  lm_real y;
  lm_real tx;
  lm_real ty;
  int i;
  parallel_point(line, t, &x, &y, &tx, &ty);
  for (i = 0; i < 4; i++) {
    t -= (y * c - x * s) / (ty * c - tx * s);
    parallel_point(line, t, &x, &y, &tx, &ty);
  }
  *radius = real_sqrt(x * x + y * y);
  *slope = *radius * (x * tx + y * ty) / (x * ty - y * tx);
  *parameter = t;
}

/* R - r_m and dR/dp of a line that is no ellipse. */
static void rise_of_wave(const lm_neutral_line *line, const lm_wave *wave, lm_real *above_mm,
                         lm_real *slope_mm) {
  const lm_real scale = line->deflection_mm - line->offset_mm;
  *above_mm = line->sense * (scale * wave->radial + line->offset_mm);
  *slope_mm = line->sense * scale * wave->slope;
}

/* R - r_m and dR/dp for 0 <= p <= pi/2. Small quantities are computed directly, for float32. */
static void rise(const lm_neutral_line *line, lm_real polar, lm_real *above_mm, lm_real *slope_mm) {
  if (line->shape.type == LM_ELLIPSE) {
    lm_real radius;
    lm_real parameter;
    ellipse_radius(line, polar, &radius, slope_mm, &parameter);
    *above_mm = radius - line->radius_mm;
  } else {
    const lm_wave wave = wave_in_quadrant(&line->shape, polar);
    rise_of_wave(line, &wave, above_mm, slope_mm);
  }
}

/* The same with the curvature of the line, 1/mm. That of a parallel curve is k / (1 + d k). */
static void bend(const lm_neutral_line *line, lm_real polar, lm_real *above_mm, lm_real *slope_mm,
                 lm_real *curvature) {
  lm_real radius;
  if (line->shape.type == LM_ELLIPSE) {
    const lm_real a = line->along_mm;
    const lm_real b = line->across_mm;
    lm_real t;
    lm_real as;
    lm_real bc;
    lm_real square;
    ellipse_radius(line, polar, &radius, slope_mm, &t);
    *above_mm = radius - line->radius_mm;
    as = a * real_sin(t);
    bc = b * real_cos(t);
    square = as * as + bc * bc;
    *curvature = a * b / (square * real_sqrt(square) + line->parallel_mm * a * b);
  } else {
    const lm_wave wave = wave_in_quadrant(&line->shape, polar);
    const lm_real scale = line->sense * (line->deflection_mm - line->offset_mm);
    lm_real square;
    *above_mm = scale * wave.radial + line->sense * line->offset_mm;
    *slope_mm = scale * wave.slope;
    radius = line->radius_mm + *above_mm;
    square = radius * radius + *slope_mm * *slope_mm;
    *curvature =
        (square + *slope_mm * *slope_mm + radius * scale * (wave.curvature + wave.radial)) /
        (square * real_sqrt(square));
  }
}

/* ds/dp - r_m, written without the difference of two large numbers. */
static lm_real excess_length(const lm_neutral_line *line, lm_real above, lm_real slope) {
  const lm_real radius = line->radius_mm + above;
  const lm_real ds = real_sqrt(radius * radius + slope * slope);
  return (above * (LM_REAL(2) * line->radius_mm + above) + slope * slope) / (ds + line->radius_mm);
}

/* A point of the quadrature over a quadrant of a line that is no ellipse. */
typedef struct quadrature_point {
  lm_real weight;
  lm_wave wave;
} quadrature_point;

#define QUADRATURE_POINTS (2 * GAUSS_POINTS) /* both zones of the shape */

static void place_quadrature(const lm_neutral_line *line, quadrature_point point[]) {
  const lm_real junction = line->shape.contact_half_angle_rad;
  int segment;
  int i;
  for (segment = 0; segment < 2; segment++) {
    const lm_real from = segment == 0 ? LM_REAL(0) : junction;
    const lm_real to = segment == 0 ? junction : HALF_PI;
    const lm_real half = (to - from) / LM_REAL(2);
    for (i = 0; i < GAUSS_POINTS; i++) {
      const lm_real polar = from + half * (LM_REAL(1) + LM_REAL(gauss_node[i]));
      point[segment * GAUSS_POINTS + i].weight = half * LM_REAL(gauss_weight[i]);
      point[segment * GAUSS_POINTS + i].wave = wave_in_quadrant(&line->shape, polar);
    }
  }
}

/* Length of a quadrant minus pi/2 r_m, and its derivative by c0. */
static void quadrant_excess(const lm_neutral_line *line, const quadrature_point point[],
                            lm_real *excess, lm_real *by_offset) {
  int i;
  *excess = LM_REAL(0);
  *by_offset = LM_REAL(0);
  for (i = 0; i < QUADRATURE_POINTS; i++) {
    const lm_wave *wave = &point[i].wave;
    lm_real above;
    lm_real slope;
    lm_real ds;
    rise_of_wave(line, wave, &above, &slope);
    ds = line->radius_mm + excess_length(line, above, slope);
    *excess += point[i].weight * (ds - line->radius_mm);
    *by_offset += point[i].weight * line->sense *
                  ((line->radius_mm + above) * (LM_REAL(1) - wave->radial) - slope * wave->slope) /
                  ds;
  }
}

/* c0 from the closed length: Newton from 0. The length is nearly linear in c0, so five rounds reach
 * rounding for every deflection in range. */
static void close_wave(lm_neutral_line *line) {
  quadrature_point point[QUADRATURE_POINTS];
  int i;
  place_quadrature(line, point);
  for (i = 0; i < 5; i++) {
    lm_real excess;
    lm_real by_offset;
    quadrant_excess(line, point, &excess, &by_offset);
    line->offset_mm -= excess / by_offset;
  }
}

/* The other semi-axis, for which the ellipse has the required length. By Steiner's formula the
 * parallel curve is longer than the ellipse by 2 pi times the distance. Trapezoid on a periodic
 * function: 32 points give the perimeter of any ellipse in range to rounding. */
static void close_ellipse(lm_neutral_line *line) {
  const lm_real target = line->radius_mm - line->parallel_mm;
  int round;
  line->along_mm = target + line->sense * line->deflection_mm;
  line->across_mm = target - line->sense * line->deflection_mm;
  for (round = 0; round < 6; round++) {
    lm_real mean = LM_REAL(0);
    lm_real by_across = LM_REAL(0);
    int i;
    for (i = 0; i < 32; i++) {
      const lm_real t = (LM_REAL(i) + LM_REAL(0.5)) * LM_PI / LM_REAL(64);
      const lm_real as = line->along_mm * real_sin(t);
      const lm_real bc = line->across_mm * real_cos(t);
      const lm_real h = real_sqrt(as * as + bc * bc);
      mean += (h - target) / LM_REAL(32);
      by_across += bc * real_cos(t) / (h * LM_REAL(32));
    }
    line->across_mm -= mean / by_across;
  }
}

/* d(polar - material angle) / d(material angle) at a polar angle. */
static lm_real lead_rate(const lm_neutral_line *line, lm_real polar) {
  lm_real above;
  lm_real slope;
  lm_real excess;
  rise(line, polar, &above, &slope);
  excess = excess_length(line, above, slope);
  return -excess / (line->radius_mm + excess);
}

/* Arc length inverted: the polar angle as a function of the material angle, by fourth-order
 * Runge-Kutta from the deformation axis. */
static void tabulate_lead(lm_neutral_line *line) {
  const lm_real step = HALF_PI / LM_REAL(line->nodes);
  lm_real lead = LM_REAL(0);
  int i;
  line->lead_rad[0] = lead;
  line->lead_slope[0] = lead_rate(line, LM_REAL(0));
  for (i = 0; i < line->nodes; i++) {
    const lm_real angle = step * LM_REAL(i);
    const lm_real k1 = line->lead_slope[i];
    const lm_real k2 = lead_rate(line, angle + step / LM_REAL(2) + lead + k1 * step / LM_REAL(2));
    const lm_real k3 = lead_rate(line, angle + step / LM_REAL(2) + lead + k2 * step / LM_REAL(2));
    const lm_real k4 = lead_rate(line, angle + step + lead + k3 * step);
    lead += step * (k1 + LM_REAL(2) * (k2 + k3) + k4) / LM_REAL(6);
    line->lead_rad[i + 1] = lead;
    line->lead_slope[i + 1] = lead_rate(line, angle + step + lead);
  }
}

lm_status lm_make_neutral_line(const lm_generator *generator, lm_deformation deformation,
                               lm_real radius_mm, lm_real deflection_mm, int nodes,
                               lm_neutral_line *line, lm_fault *fault) {
  lm_neutral_line made;
  lm_status status;
  if (generator == 0 || line == 0) {
    return refuse(fault, LM_NULL, generator == 0 ? "generator" : "line");
  }
  status = lm_make_shape(generator->type, generator->contact_half_angle_rad, &made.shape, fault);
  if (status == LM_OK) {
    status =
        check_range(fault, "flexspline.neutral_radius_mm", radius_mm, LM_REAL(0.1), LM_REAL(1e4));
  }
  if (status == LM_OK) {
    status = check_range(fault, "generator.deflection_mm", deflection_mm, LM_REAL(1e-4) * radius_mm,
                         radius_mm / LM_REAL(8));
  }
  if (status == LM_OK) {
    status = check_range(fault, "generator.cam_offset_mm", generator->cam_offset_mm, LM_REAL(0),
                         radius_mm / LM_REAL(2));
  }
  if (status == LM_OK) {
    status =
        check_range(fault, "nodes", LM_REAL(nodes), LM_REAL(8), LM_REAL(LM_NEUTRAL_LINE_NODES_MAX));
  }
  if (status != LM_OK) {
    return status;
  }
  made.sense = deformation == LM_INTERNAL ? LM_REAL(1) : LM_REAL(-1);
  made.radius_mm = radius_mm;
  made.deflection_mm = deflection_mm;
  made.nodes = nodes;
  made.offset_mm = LM_REAL(0);
  made.along_mm = LM_REAL(0);
  made.across_mm = LM_REAL(0);
  made.parallel_mm = made.sense * generator->cam_offset_mm;
  if (made.shape.type == LM_ELLIPSE) {
    close_ellipse(&made);
  } else {
    close_wave(&made);
  }
  tabulate_lead(&made);
  *line = made;
  return LM_OK;
}

void lm_neutral_radius(const lm_neutral_line *line, lm_real polar_rad, lm_real *radius_mm,
                       lm_real *slope_mm) {
  const lm_real polar = fold_half_turn(polar_rad);
  lm_real above;
  rise(line, real_fabs(polar), &above, slope_mm);
  *radius_mm = line->radius_mm + above;
  if (polar < LM_REAL(0)) {
    *slope_mm = -*slope_mm;
  }
}

/* Cubic Hermite between the nodes; the slopes are exact there, so its error is of fourth order. */
static lm_real interpolate_lead(const lm_neutral_line *line, lm_real angle) {
  const lm_real step = HALF_PI / LM_REAL(line->nodes);
  int i = (int)(angle / step);
  lm_real u;
  lm_real rest;
  i = i < line->nodes ? i : line->nodes - 1;
  u = angle / step - LM_REAL(i);
  rest = LM_REAL(1) - u;
  return rest * rest *
             ((LM_REAL(1) + LM_REAL(2) * u) * line->lead_rad[i] + u * step * line->lead_slope[i]) +
         u * u *
             ((LM_REAL(3) - LM_REAL(2) * u) * line->lead_rad[i + 1] -
              rest * step * line->lead_slope[i + 1]);
}

static lm_placement place_on(const lm_neutral_line *line, lm_real side, lm_real lead, lm_real above,
                             lm_real slope) {
  const lm_real radius = line->radius_mm + above;
  const lm_real norm = real_sqrt(radius * radius + slope * slope);
  lm_placement place;
  place.lead_rad = side * lead;
  place.radius_mm = radius;
  place.above_mm = above;
  place.tilt_cos = radius / norm;
  place.tilt_sin = -side * slope / norm;
  return place;
}

lm_placement lm_place_tooth(const lm_neutral_line *line, lm_real angle_rad) {
  const lm_real angle = fold_half_turn(angle_rad);
  const lm_real side = angle < LM_REAL(0) ? LM_REAL(-1) : LM_REAL(1);
  const lm_real lead = interpolate_lead(line, side * angle);
  lm_real above;
  lm_real slope;
  rise(line, side * angle + lead, &above, &slope);
  return place_on(line, side, lead, above, slope);
}

lm_placement lm_move_tooth(const lm_neutral_line *line, lm_real angle_rad,
                           lm_placement_rate *rate) {
  const lm_real angle = fold_half_turn(angle_rad);
  const lm_real side = angle < LM_REAL(0) ? LM_REAL(-1) : LM_REAL(1);
  const lm_real lead = interpolate_lead(line, side * angle);
  lm_real above;
  lm_real slope;
  lm_real curvature;
  lm_real excess;
  bend(line, side * angle + lead, &above, &slope, &curvature);
  excess = excess_length(line, above, slope);
  rate->lead = -excess / (line->radius_mm + excess);
  rate->radius_mm = side * slope * (LM_REAL(1) + rate->lead);
  rate->tilt = line->radius_mm * curvature - (LM_REAL(1) + rate->lead);
  return place_on(line, side, lead, above, slope);
}
