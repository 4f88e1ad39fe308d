/* The deformed flexspline: first-order wave shapes and the neutral line of exact arc length.
 *
 * Angles are measured from the deformation axis (drive.h). Shapes are dimensionless: the
 * radial displacement in units of w0, counted in the direction in which the wave generator
 * pushes (outward for internal, inward for external deformation); the tangential
 * displacement in units of w0; the rotation of a tooth in units of w0 / r_m. Displacements
 * of an external drive are the negatives. */
#ifndef LOSTMOTION_SHAPE_H
#define LOSTMOTION_SHAPE_H

#include "lostmotion/drive.h"
#include "lostmotion/real.h"
#include "lostmotion/status.h"

LM_BEGIN_DECLS

/* Nodes of the arc-length table in one quadrant. With 64 nodes the error is below 1e-6 arcmin. */
#define LM_NEUTRAL_LINE_NODES_MAX 256
#define LM_NEUTRAL_LINE_NODES 64

/* Coefficients of one wave shape, made once by lm_make_shape. */
typedef struct lm_shape {
  lm_generator_type type;
  lm_real contact_half_angle_rad; /* beta; pi/4 for shapes without a junction */
  lm_real inner[3];               /* contact zone  (phi <= beta): constant, cos, phi sin */
  lm_real outer[3]; /* free zone (phi >= beta), p = pi/2 - phi: constant, cos p, p sin p */
} lm_shape;

/* One point of a shape, and the slopes of the radial displacement by angle. */
typedef struct lm_wave {
  lm_real radial;     /* w / w0 */
  lm_real tangential; /* v / w0 */
  lm_real rotation;   /* theta r_m / w0 = v - dw/dphi, first order */
  lm_real slope;      /* dw/dphi / w0 */
  lm_real curvature;  /* -(d2w/dphi2 + w) / w0: bending of the rim in units of w0 / r_m^2 */
} lm_wave;

/* Shape of a wave generator (inextensible thin ring, theory/geometry.md):
 * cosine and ellipse (to first order the same), two discs and external ring (arc of constant
 * curvature over +-beta), four rollers at +-beta (beta = 0: two rollers).
 * contact_half_angle_rad: discs and ring 0.05 .. 1.2; rollers 0 .. 0.6109 (35 deg; the four-roller
 * shape changes sign at 43.9 deg); ignored for cosine and ellipse. LM_NULL, LM_NOT_FINITE,
 * LM_OUT_OF_RANGE ("generator.type", "generator.contact_half_angle_rad").
 */
lm_status lm_make_shape(lm_generator_type type, lm_real contact_half_angle_rad, lm_shape *shape,
                        lm_fault *fault);

/* The wave at any finite angle; period pi, even about 0 and pi/2. */
lm_wave lm_evaluate_shape(const lm_shape *shape, lm_real angle_rad);

/* Largest |curvature| of the shape, which sets the bending stress; found at 0, beta or pi/2. */
lm_real lm_largest_shape_curvature(const lm_shape *shape);

/* Half the range of the curvature over a quadrant: the amplitude of the bending stress, which
 * reverses twice in a turn of the wave generator. */
lm_real lm_shape_curvature_amplitude(const lm_shape *shape);

/* Force of the wave generator on one lobe without load, in units of E I w0 / r_m^3: 4 G for discs
 * and ring, 4 cos(beta) / D for rollers, 6 for a cam. Times E I of rim, times the cup and tooth
 * factor.
 */
lm_real lm_shape_generator_force(const lm_shape *shape);

/* The neutral line of exact arc length, theory/geometry.md: polar radius
 *   R(p) = r_m +- [(w0 - c0) w(p) + c0],  R(0) = r_m +- w0  (+ internal, - external),
 * with c0 such that the closed length stays 2 pi r_m; an ellipse (or its parallel curve at the cam
 * offset) of the same length for LM_ELLIPSE. A tooth keeps its arc length from the axis. */
typedef struct lm_neutral_line {
  lm_shape shape;
  lm_real sense;         /* +1 internal, -1 external */
  lm_real radius_mm;     /* r_m, undeformed */
  lm_real deflection_mm; /* w0 of this axial section */
  lm_real offset_mm;     /* c0; 0 for the ellipse */
  lm_real along_mm;      /* ellipse: semi-axis of the cam along the deformation axis */
  lm_real across_mm;     /* ellipse: the other semi-axis */
  lm_real parallel_mm;   /* ellipse: signed distance from cam to neutral line */
  int nodes;
  lm_real lead_rad[LM_NEUTRAL_LINE_NODES_MAX + 1];   /* polar angle - material angle at the nodes */
  lm_real lead_slope[LM_NEUTRAL_LINE_NODES_MAX + 1]; /* its derivative by the material angle */
} lm_neutral_line;

/* Position of a tooth axis on the deformed neutral line. */
typedef struct lm_placement {
  lm_real lead_rad;  /* polar angle of the foot of the tooth minus its material angle */
  lm_real radius_mm; /* R there */
  lm_real above_mm;  /* R - r_m, without the rounding of R */
  lm_real tilt_sin;  /* sine and cosine of the turn of the tooth axis against the radius, */
  lm_real tilt_cos;  /*   positive in the direction of growing angle */
} lm_placement;

/* Build the neutral line for one axial section.
 * radius_mm 0.1 .. 1e4; deflection_mm 1e-4 .. 1/8 of it (on two wide discs no line of that length
 * exists beyond 1/7); cam_offset_mm up to half of it; nodes 8 .. LM_NEUTRAL_LINE_NODES_MAX.
 * LM_NULL, LM_NOT_FINITE, LM_OUT_OF_RANGE. */
lm_status lm_make_neutral_line(const lm_generator *generator, lm_deformation deformation,
                               lm_real radius_mm, lm_real deflection_mm, int nodes,
                               lm_neutral_line *line, lm_fault *fault);

/* Polar radius and its derivative by the polar angle (mm, mm/rad), at any finite polar angle. */
void lm_neutral_radius(const lm_neutral_line *line, lm_real polar_rad, lm_real *radius_mm,
                       lm_real *slope_mm);

/* Place the tooth whose material angle (undeformed, from the deformation axis) is angle_rad. */
lm_placement lm_place_tooth(const lm_neutral_line *line, lm_real angle_rad);

/* Derivatives of a placement by the material angle: the foot moves along the line by r_m per
 * radian, and the axis turns with the line's curvature. */
typedef struct lm_placement_rate {
  lm_real lead;
  lm_real radius_mm;
  lm_real tilt;
} lm_placement_rate;

/* The same placement, and its derivatives. */
lm_placement lm_move_tooth(const lm_neutral_line *line, lm_real angle_rad, lm_placement_rate *rate);

LM_END_DECLS

#endif
