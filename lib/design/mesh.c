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

/* Move from `point` at flank radius *rho to the flank point on the polar radius target. The flank is
 * nearly radial, so three rounds of Newton leave nothing. */
static flank_point move_to_radius(const flank_pair *pair, lm_real target, lm_real *rho,
                                  flank_point point) {
  int i;
  for (i = 0; i < 3; i++) {
    *rho -= (point.radius_mm - target) / point.radius_slope;
    point = evaluate_flank(pair, *rho);
  }
  return point;
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

/* Where the slope of the gap passes from falling to rising between two flank radii: regula falsi
 * with the Illinois correction, which keeps the bracket. */
static flank_point interior_minimum(const flank_pair *pair, lm_real a, lm_real slope_a, lm_real b,
                                    lm_real slope_b) {
  flank_point middle = evaluate_flank(pair, (a + b) / LM_REAL(2));
  lm_real rho = (a + b) / LM_REAL(2);
  int side = 0; /* which end the last round replaced */
  int i;
  for (i = 0; i < 7; i++) {
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
  return middle;
}

/* The limits between which both flanks exist: the flexspline's flank from its tip or base circle to
 * its root, the rigid one from its tip inwards (external) or outwards (internal). */
static lm_gap flank_gap(const flank_pair *pair) {
  const lm_geometry *g = pair->geometry;
  const int internal = g->deformation == LM_INTERNAL;
  const lm_real end = internal ? g->flexspline_root_mm : g->flexspline_tip_mm;
  lm_real low = end > g->flexspline.base_mm ? end : g->flexspline.base_mm;
  lm_real high = internal ? g->flexspline_tip_mm : g->flexspline_root_mm;
  const lm_real rigid_end =
      g->rigid_root_mm > g->rigid.base_mm ? g->rigid_root_mm : g->rigid.base_mm;
  const lm_real polar_low = internal ? g->rigid_tip_mm : rigid_end;
  const lm_real polar_high = internal ? REAL_INFINITY : g->rigid_tip_mm;
  flank_point at_high = evaluate_flank(pair, high);
  flank_point at_low;
  if (at_high.radius_mm <= polar_low) {
    return no_overlap();
  }
  at_low = evaluate_flank(pair, low);
  if (at_low.radius_mm >= polar_high) {
    return no_overlap();
  }
  if (at_low.radius_mm < polar_low) {
    at_low = move_to_radius(pair, polar_low, &low, at_low);
  }
  if (at_high.radius_mm > polar_high) {
    at_high = move_to_radius(pair, polar_high, &high, at_high);
  }
  if (at_low.gap_slope < LM_REAL(0) && at_high.gap_slope > LM_REAL(0)) {
    at_low = interior_minimum(pair, low, at_low.gap_slope, high, at_high.gap_slope);
  }
  return contact_at(pair, at_low.gap_rad < at_high.gap_rad ? &at_low : &at_high);
}

lm_real lm_section_place(int section, int sections) {
  return sections > 1 ? LM_REAL(section) / LM_REAL(sections - 1) : LM_REAL(0.5);
}

lm_real lm_section_factor(const lm_drive *drive, int section, int sections) {
  const lm_real from_middle = lm_section_place(section, sections) - LM_REAL(0.5);
  return LM_REAL(1) + from_middle * drive->teeth.face_width_mm / drive->flexspline.length_mm;
}

lm_status lm_make_mesh(const lm_drive *drive, lm_real section_factor, int nodes, lm_mesh *mesh,
                       lm_fault *fault) {
  lm_geometry geometry;
  lm_status status;
  if (drive == 0 || mesh == 0) {
    return refuse(fault, LM_NULL, drive == 0 ? "drive" : "mesh");
  }
  status = check_range(fault, "section_factor", section_factor, LM_REAL(0.2), LM_REAL(2));
  if (status == LM_OK) {
    status = lm_make_geometry(&drive->teeth, drive->generator.deflection_mm,
                              drive->flexspline.rim_thickness_mm, &geometry, fault);
  }
  if (status == LM_OK) {
    status = lm_make_neutral_line(&drive->generator, drive->teeth.deformation, geometry.neutral_mm,
                                  drive->generator.deflection_mm * section_factor, nodes,
                                  &mesh->line, fault);
  }
  if (status == LM_OK) {
    mesh->geometry = geometry;
  }
  return status;
}

lm_clearance lm_tooth_clearance(const lm_mesh *mesh, lm_real angle_rad) {
  lm_clearance clearance;
  flank_pair pair;
  pair.geometry = &mesh->geometry;
  pair.place = lm_place_tooth(&mesh->line, angle_rad);
  pair.lead_rad = pair.place.lead_rad + angle_rad * mesh->geometry.lead_per_angle;
  pair.closing = mesh->line.sense;
  clearance.angle_rad = angle_rad;
  pair.side = mesh->line.sense;
  clearance.forward = flank_gap(&pair);
  pair.side = -mesh->line.sense;
  clearance.backward = flank_gap(&pair);
  return clearance;
}

lm_status lm_lobe_clearances(const lm_mesh *mesh, lm_real phase_rad, lm_clearance clearances[],
                             int capacity, int *count, lm_fault *fault) {
  lm_real pitch;
  lm_real shift;
  int first;
  int last;
  int k;
  if (mesh == 0 || clearances == 0 || count == 0) {
    return refuse(fault, LM_NULL, mesh == 0 ? "mesh" : clearances == 0 ? "clearances" : "count");
  }
  if (!real_isfinite(phase_rad)) {
    return refuse_range(fault, "phase_rad", phase_rad, LM_REAL(0), LM_REAL(2) * LM_PI);
  }
  pitch = LM_REAL(2) * LM_PI / LM_REAL(mesh->geometry.flexspline_teeth);
  shift = phase_rad / pitch - real_floor(phase_rad / pitch);
  /* A hair beyond 90 deg, so that the tooth that stands on it exactly is counted at both ends. */
  last = (int)real_floor(LM_REAL(mesh->geometry.flexspline_teeth) / LM_REAL(4) + LM_REAL(1e-4) -
                         shift);
  first = -(int)real_floor(LM_REAL(mesh->geometry.flexspline_teeth) / LM_REAL(4) + LM_REAL(1e-4) +
                           shift);
  if (last - first + 1 > capacity) {
    return refuse_capacity(fault, "capacity", capacity, last - first + 1);
  }
  for (k = first; k <= last; k++) {
    clearances[k - first] = lm_tooth_clearance(mesh, (LM_REAL(k) + shift) * pitch);
  }
  *count = last - first + 1;
  return LM_OK;
}
