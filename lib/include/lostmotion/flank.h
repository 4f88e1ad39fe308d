/* The flank of a flexspline tooth as a curve in the tooth's own frame, theory/flanks.md.
 *
 * Frame: origin on the neutral line, y along the tooth's axis away from it, x across it, towards
 * growing angles. A flank is a function of one parameter, the radius: of an involute the distance
 * from the gear's centre; of other flanks r_m + y, the height along the tooth's axis; both agree to
 * within x^2 / (2 r). Every kind has position, tangent and curvature; the involute has the same
 * closed forms as in involute.h.
 *
 * External deformation: the teeth point inwards, and the mesh places the spaces between them. A
 * pair of involutes has the flank of the space, over the radius. In any other pair the flank is
 * `inward`: y points to the centre, the parameter is still r_m + y (2 r_m minus the radius) and
 * rises from root to tip.
 */
#ifndef LOSTMOTION_FLANK_H
#define LOSTMOTION_FLANK_H

#include "lostmotion/drive.h"
#include "lostmotion/involute.h"
#include "lostmotion/real.h"
#include "lostmotion/status.h"

LM_BEGIN_DECLS

/* A point of the flexspline's flank at growing angles, in the frame of its own tooth or space:
 * origin on the neutral line, and the derivatives along the flank by the parameter. */
typedef struct lm_flank_foot {
  lm_real radius_mm; /* the parameter */
  lm_real across_mm;
  lm_real along_mm;
  lm_real across_slope;
  lm_real along_slope;
} lm_flank_foot;

/* Convex arc, common tangent, concave arc, mm in the tooth's frame. From the tip (A) to B the flank
 * lies right of the convex centre, from B to C it is straight, from C to the root (D) it lies left
 * of the concave centre. */
typedef struct lm_double_arc {
  lm_real convex_mm; /* rho_a */
  lm_real convex_across_mm;
  lm_real convex_along_mm;
  lm_real concave_mm; /* rho_f */
  lm_real concave_across_mm;
  lm_real concave_along_mm;
  lm_real inclination_rad; /* delta_L, of the tangent against the tooth's axis */
  lm_real tangent;         /* of delta_L */
  lm_real upper_mm;        /* y of B */
  lm_real upper_across_mm; /* x of B */
  lm_real lower_mm;        /* y of C */
} lm_double_arc;

/* Half the path of a rack's tooth from the datum point M outwards, and its point reflection
 * inwards; next to M its tangent through M. */
typedef struct lm_s_tooth {
  lm_real kappa;
  lm_real module_mm;
  lm_real datum_mm;        /* y of M */
  lm_real datum_across_mm; /* x of M */
  lm_real straight_mm;     /* height of the tangent in either direction */
  lm_real tangent;         /* of its angle against the tooth's axis */
} lm_s_tooth;

/* Largest number of joints: B and C, or both ends of the tangent. */
#define LM_FLANK_JOINTS_MAX 2

typedef struct lm_flank {
  lm_flank_kind kind;
  lm_real neutral_mm;     /* r_m, where the frame's origin lies */
  lm_real low_mm;         /* parameter at the end towards the gear's centre; inward: at the root */
  lm_real high_mm;        /* and at the other end */
  int inward;             /* 1: of a tooth that points inwards */
  lm_real pitch_half_rad; /* half the pitch angle of the gear, and its sine and cosine */
  lm_real pitch_half_sin;
  lm_real pitch_half_cos;
  lm_involute involute;
  lm_double_arc arc;
  lm_s_tooth s;
  const lm_flank_points *points;
  lm_real points_shift_mm; /* added to their heights */
  lm_real relief_mm;       /* tip relief at high_mm; 0: none */
  lm_real relief_from_mm;
  int joints; /* where the curvature jumps, rising parameters */
  lm_real joint_mm[LM_FLANK_JOINTS_MAX];
} lm_flank;

/* The flexspline's flank of a checked drive with its geometry; its tip relief is omitted if
 * `relieved` is 0. LM_INCONSISTENT, naming the keys that disagree: "flank.rho_a, flank.rho_f" (arcs
 * that overlap: no common tangent between them), "flank.rho_a, teeth.tooth_height" and
 * "flank.rho_f, teeth.root_clearance" (an arc that ends before tip or root; "flank.kappa" of an S
 * tooth, "flank.points" of points, LM_NULL where there are none; of teeth that point inwards
 * "teeth.engagement_depth" and "generator.deflection_mm", which set their tip and root), "flank.rho_a,
 * flank.X_a" and "flank.rho_f, flank.X_f" (tip or root on the straight part), "flank.rho_f,
 * flank.l_f" (teeth that overlap at the root), "flank.rho_a, flank.l_a" (a tooth
 * without thickness at its tip; "flank.s_M" of an S tooth). */
lm_status lm_make_flank(const lm_drive *drive, const lm_geometry *geometry, int relieved,
                        lm_flank *flank, lm_fault *fault);

/* Whether a gear can have a flank of a kind; `rigid`: the rigid gear, 0: the flexspline. */
int lm_flank_fits(int kind, int rigid);

/* Position and tangent at a parameter between the ends, in the frame of what the mesh places: the
 * tooth or, if it points inwards, the space beside it. */
lm_flank_foot lm_evaluate_flank(const lm_flank *flank, lm_real parameter_mm);

/* The same in the tooth's own frame. */
lm_flank_foot lm_evaluate_tooth_flank(const lm_flank *flank, lm_real parameter_mm);

/* Curvature there, 1/mm: above 0 where the tooth is convex. Without tip relief. */
lm_real lm_flank_curvature(const lm_flank *flank, lm_real parameter_mm);

/* Bounds of the second derivatives of position by the parameter, 1/mm. */
typedef struct lm_flank_bend {
  lm_plain across_least;
  lm_plain across_most;
  lm_plain along_least;
  lm_plain along_most;
} lm_flank_bend;

/* Bounds between two parameters without a joint between them, in the frame of lm_evaluate_flank. */
lm_flank_bend lm_bound_flank_bend(const lm_flank *flank, lm_real from_mm, lm_real to_mm);

/* The parameter of the point at a distance from the undeformed gear's centre, between the ends. */
lm_real lm_flank_at_radius(const lm_flank *flank, lm_real radius_mm);

LM_END_DECLS

#endif
