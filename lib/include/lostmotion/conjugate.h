/* The flank of the rigid gear that the moving teeth of the flexspline leave free, theory/flanks.md.
 *
 * A flexspline tooth rides on the deformed neutral line while the wave generator turns past it. At
 * every radius of the rigid gear its flank reaches furthest into the rigid tooth at some material
 * angle; that greatest polar angle is the conjugate flank: xi(rho) = max over phi of theta(rho,
 * phi). Where the maximum lies inside the flank it is the envelope of the literature (the relative
 * velocity lies in the flank); where it lies at the tip's corner the corner cuts (undercut); where
 * two maxima exist there are two conjugate zones, and the greater one counts, so that no zone
 * interferes with the other. Internal deformation only.
 */
#ifndef LOSTMOTION_CONJUGATE_H
#define LOSTMOTION_CONJUGATE_H

#include "lostmotion/drive.h"
#include "lostmotion/flank.h"
#include "lostmotion/involute.h"
#include "lostmotion/real.h"
#include "lostmotion/shape.h"
#include "lostmotion/status.h"

LM_BEGIN_DECLS

#define LM_CONJUGATE_INTERVALS_MAX 64

/* Where another part of the flexspline's flank, or another zone, takes over; each takes one of the
 * intervals above the 28 that every flank has. */
#define LM_CONJUGATE_CORNERS_MAX 18

/* Share of the flank's height below the top that is left free, chosen: the path of the tip's corner
 * turns round there and would leave a surface across the force. Beyond it the space continues
 * radially, as wide as it is there. */
#define LM_CONJUGATE_LAND 0.02

/* What makes the conjugate flank at a radius. */
typedef enum lm_contact_part {
  LM_PART_FLANK = 0, /* the flank's own points: the envelope */
  LM_PART_TIP = 1    /* the corner of the flexspline's tip */
} lm_contact_part;

/* The half angle of the SPACE of the rigid gear over the radius: cubic Hermite pieces in
 * s = sqrt((top - rho) / (top - low)), in which the flank is smooth up to the top, where the path
 * of the tip turns round. Pieces end where its curvature or slope jumps, and are halved where a
 * cubic misses it. Within 1e-6 modules of the exact maximum (tests/python/test_flanks.py). */
typedef struct lm_conjugate {
  lm_real low_mm;  /* s = 1 */
  lm_real top_mm;  /* s = 0: reach of the flexspline's tip */
  lm_real land_mm; /* where the generated flank ends and the radial land begins */
  int intervals;
  lm_real place[LM_CONJUGATE_INTERVALS_MAX + 1]; /* s of the nodes, rising */
  lm_real half_angle_rad[LM_CONJUGATE_INTERVALS_MAX + 1];
  lm_real slope_low[LM_CONJUGATE_INTERVALS_MAX]; /* by s, at both ends of a piece */
  lm_real slope_high[LM_CONJUGATE_INTERVALS_MAX];
  int corners; /* where the slope or the curvature jumps, falling radii */
  lm_real corner_mm[LM_CONJUGATE_CORNERS_MAX];
} lm_conjugate;

/* Generate the flank over the radii from the rigid gear's tip circle to the flexspline's tip on the
 * deformation axis. flank: without tip relief; line: of the nominal deflection; shift_mm moves the
 * flank outwards; backlash_mm opens it along the circumference. LM_NULL; LM_INCONSISTENT
 * ("teeth.engagement_depth") when the flexspline's tip does not reach the rigid one. */
lm_status lm_make_conjugate(const lm_flank *flank, const lm_geometry *geometry,
                            const lm_neutral_line *line, lm_real shift_mm, lm_real backlash_mm,
                            lm_conjugate *conjugate, lm_fault *fault);

/* The flank at a radius, in the words of involute.h: tangent and angle of the flank against the
 * radius, half angle of the space. Beyond the top the half angle stays what it is there; below
 * the tip circle, where there is no flank, the last piece continues. */
lm_involute_point lm_evaluate_conjugate(const lm_conjugate *conjugate, lm_real radius_mm);

/* Where a point of the flexspline's flank meets the flank that it generates. */
typedef struct lm_conjugate_contact {
  lm_real angle_rad;      /* material angle of the tooth */
  lm_real radius_mm;      /* on the rigid gear */
  lm_real half_angle_rad; /* of the space there */
  lm_real beyond_mm; /* how far another position of the tooth reaches beyond it; 0: it lies on the
                        conjugate flank */
} lm_conjugate_contact;

/* All material angles within +-60 deg at which the relative velocity of the point at `parameter`
 * lies in the flank, in rising order: none outside the conjugate zones, two where the zones of a
 * double arc overlap. The first `capacity` of them. LM_NULL, LM_OUT_OF_RANGE ("parameter_mm"). */
lm_status lm_find_conjugate_contacts(const lm_flank *flank, const lm_geometry *geometry,
                                     const lm_neutral_line *line, lm_real parameter_mm,
                                     lm_conjugate_contact contacts[], int capacity, int *count,
                                     lm_fault *fault);

LM_END_DECLS

#endif
