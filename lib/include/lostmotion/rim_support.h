/* Support of the flexspline's rim from the geometry: a closed thin ring with the bending stiffness
 * of rim and race, on the supports of the wave generator.
 *
 * Cams: the balls of the flexible bearing within 45 deg of the axis, where the cam pushes. Discs
 * and ring: their arc, on one rigid body on its bearing. Rollers: their positions. Between and
 * beyond its supports the rim is free. Both lobes are loaded equally, so the deformation repeats
 * every half turn.
 *
 * Idealisations: the supports act in both directions (the wave preloads them), one ball is on the
 * deformation axis, balls are springs with their stiffness at rated torque, and tangential tooth
 * forces do not bend the rim.
 */
#ifndef LOSTMOTION_RIM_SUPPORT_H
#define LOSTMOTION_RIM_SUPPORT_H

#include "lostmotion/mesh.h"
#include "lostmotion/takeup.h"

LM_BEGIN_DECLS

/* Radial deflection of a free thin ring at `angle_rad` from a unit force that acts on both lobes:
 *   r^3 / (4 E I) (sin a + (pi/2 - a) cos a - 4 / pi), a in 0 .. pi/2, period pi. */
lm_real lm_free_ring_yield(lm_real radius_mm, lm_real stiffness_N_mm2, lm_real angle_rad);

/* Compliance of one ball between its races at a load (Palmgren's law for point contact on both
 * sides, d/dQ of 4.36e-4 Q^(2/3) D^(-1/3)), mm/N. */
lm_real lm_ball_compliance(lm_real ball_diameter_mm, lm_real force_N);

/* Fill hold of *foundation for the teeth `first` .. `last` of a lobe, in rising order, and yield
 * for their distances, from the mesh of the middle section. Times support.ring_factor. Reads a
 * checked drive. LM_NULL, LM_OUT_OF_RANGE ("teeth"). */
lm_status lm_make_rim_support(const lm_drive *drive, const lm_mesh *mesh,
                              const lm_clearance teeth[], int first, int last,
                              lm_foundation *foundation, lm_fault *fault);

LM_END_DECLS

#endif
