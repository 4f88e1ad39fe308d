/* Outline of one tooth of a mesh with its root fillet, for the bending of flanks that are no
 * involutes, theory/flanks.md.
 *
 * The fillet is an arc that touches flank and root circle. Its radius is that of the tip of the
 * basic rack, c / (1 - sin alpha) in modules (ISO 53; c: teeth.root_clearance, alpha:
 * teeth.pressure_angle_deg), or less where the space ends at a full fillet. Heights are measured
 * from the root: of the flexspline's external tooth along its axis, of any other along the radius.
 * Lengths mm.
 */
#ifndef LOSTMOTION_TOOTH_OUTLINE_H
#define LOSTMOTION_TOOTH_OUTLINE_H

#include "lostmotion/drive.h"
#include "lostmotion/mesh.h"
#include "lostmotion/real.h"

LM_BEGIN_DECLS

typedef struct lm_tooth_outline {
  const lm_mesh *mesh;
  int rigid;   /* 1: tooth of the rigid gear; 0: of the flexspline */
  int outward; /* 1: external tooth */
  lm_real root_mm;
  lm_real fillet_mm;      /* radius of the arc */
  lm_real form_height_mm; /* height at which the arc meets the flank */
  lm_real centre_mm;      /* distance of the arc's centre from the gear's */
  lm_real centre_rad;     /* angle of the arc's centre from the tooth's axis */
} lm_tooth_outline;

/* Half thickness at a height, and the angle of the flank against the tooth's axis. */
typedef struct lm_outline_point {
  lm_real half_mm;
  lm_real angle_rad;
} lm_outline_point;

/* Of a mesh whose gear has no involute flank. `outline` refers to `mesh`. */
void lm_make_tooth_outline(const lm_drive *drive, const lm_mesh *mesh, int rigid,
                           lm_tooth_outline *outline);

/* On the flank, or on its continuation below the form height. */
lm_outline_point lm_outline_flank(const lm_tooth_outline *outline, lm_real height_mm);

/* Half thickness on fillet and flank, from the root (0) to the tip. */
lm_real lm_outline_half(const lm_tooth_outline *outline, lm_real height_mm);

/* Section that a force at load_height_mm bends most (in which Lewis's parabola touches the
 * outline): largest (load_height - h) / (2 x(h))^2, 1/mm. The nominal bending stress is 6 F
 * / b times it. Sections at 16 places of the fillet and 16 of the flank: within 0.5 % of
 * the largest. */
lm_real lm_outline_leverage(const lm_tooth_outline *outline, lm_real load_height_mm);

LM_END_DECLS

#endif
