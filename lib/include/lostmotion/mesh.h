/* Side clearances of the unloaded mesh, theory/geometry.md.
 *
 * A tooth of the flexspline is placed on the deformed neutral line; the rigid gear turns about the
 * axis, so every point of it keeps its radius. The rotation to first contact is therefore the
 * minimum, over the radii common to both flanks, of the difference of their polar angles. A
 * negative minimum is interference; it keeps its sign.
 */
#ifndef LOSTMOTION_MESH_H
#define LOSTMOTION_MESH_H

#include "lostmotion/conjugate.h"
#include "lostmotion/drive.h"
#include "lostmotion/flank.h"
#include "lostmotion/involute.h"
#include "lostmotion/real.h"
#include "lostmotion/shape.h"
#include "lostmotion/status.h"

LM_BEGIN_DECLS

/* Largest number of teeth of one lobe: half of LM_FLEXSPLINE_TEETH_MAX, and one. */
#define LM_LOBE_TEETH_MAX 321

/* One flank pair. */
typedef struct lm_gap {
  lm_real gap_rad;   /* output rotation until contact; < 0 interference; infinite: no overlap */
  lm_real radius_mm; /* r_k, where they touch; 0 without overlap */
  lm_real flank_angle_rad; /* alpha_w: flank against the radius of the rigid gear's axis there */
  int is_bound;            /* 1: the gap is at least gap_rad, the rest is near */
} lm_gap;

/* One tooth of the flexspline. */
typedef struct lm_clearance {
  lm_real angle_rad; /* of the tooth axis, material, from the deformation axis */
  lm_gap forward;    /* closes for positive torque */
  lm_gap backward;
  lm_real foot_mm; /* distance of the tooth's foot on the neutral line from the centre */
} lm_clearance;

/* Largest number of points at which a flank is compared with the rigid one: a flank of 4 modules at
 * distances of 0.2. */
#define LM_FLANK_SAMPLES_MAX 24

/* Sizes of the second derivatives of a flank between two samples, and by how much each of them
 * changes there, 1/mm. */
typedef struct lm_sample_bend {
  lm_plain across;
  lm_plain along;
  lm_plain across_change;
  lm_plain along_change;
} lm_sample_bend;

/* One axial section of the mesh. */
typedef struct lm_mesh {
  lm_geometry geometry;
  lm_neutral_line line;
  lm_flank flank;           /* of the flexspline */
  lm_flank_kind rigid_kind; /* of the rigid gear: an involute is geometry.rigid, others conjugate */
  lm_conjugate conjugate;
  lm_flank_foot low;                          /* ends of the flexspline's flank, at flank.low_mm */
  lm_flank_foot high;                         /* and flank.high_mm */
  lm_flank_foot sample[LM_FLANK_SAMPLES_MAX]; /* from root to tip, unless both are involutes */
  lm_sample_bend bend[LM_FLANK_SAMPLES_MAX];  /* from each sample to the next */
  lm_plain along_speed;                       /* bounds of its slopes */
  lm_plain across_speed;
  int samples;
  lm_real polar_low_mm; /* radii between which the rigid gear has a flank */
  lm_real polar_high_mm;
} lm_mesh;

/* Prepares the mesh of an axial section. section_factor scales the deflection of this section (1 in
 * the planar model; lm_section_factor for the others); the teeth are the same. nodes as in
 * lm_make_neutral_line. LM_NULL, LM_NOT_FINITE, LM_OUT_OF_RANGE ("section_factor" 0.2 .. 2, or what
 * lm_make_geometry, lm_make_neutral_line, lm_make_flank and lm_make_conjugate refuse),
 * LM_INCONSISTENT. A conjugate flank is generated at the nominal deflection, the
 * same in every section. */
lm_status lm_make_mesh(const lm_drive *drive, lm_real section_factor, int nodes, lm_mesh *mesh,
                       lm_fault *fault);

/* The rigid gear's flank at a radius, of either kind, in the terms of involute.h: half angle of the
 * space (internal deformation) or of the tooth (external). */
lm_involute_point lm_rigid_flank_at(const lm_mesh *mesh, lm_real radius_mm);

/* Where axial section `section` of `sections` is on the face width: 0 at the edge towards the cup
 * bottom, 1 at the open end; equally spaced and including both edges, because these touch first;
 * 0.5 for a single section. */
lm_real lm_section_place(int section, int sections);

/* Local over nominal deflection of an axial section, straight generatrix (theory/geometry.md): it
 * grows in proportion to the distance from the cup bottom and is nominal in the middle of the
 * teeth. Reads a checked drive. */
lm_real lm_section_factor(const lm_drive *drive, int section, int sections);

/* Of a drive with 2 or more axial sections: the root that the rack does not cut is as deep as the
 * opposite tip requires, which reaches furthest in the section of the largest wave. */
void lm_deepen_root(const lm_drive *drive, int sections, lm_geometry *geometry);

/* Number of axial sections that share the rated load in the checks: both edges and the middle; 1,
 * the middle, with planar_only. The same for any drive.axial_sections, so that a verdict does not
 * depend on it. */
#define LM_FACE_SECTIONS 3
int lm_face_sections(const lm_drive *drive);

/* Number of places along the face width between which the checks search the smallest gap; 1, the
 * middle, with planar_only. */
#define LM_FACE_PLACES LM_SECTIONS_MAX
int lm_face_places(const lm_drive *drive);

/* The meshes at `sections` (1 .. LM_SECTIONS_MAX) places of the face width; 2: both edges. Errors
 * as lm_make_mesh, and LM_OUT_OF_RANGE ("sections"). */
lm_status lm_make_face(const lm_drive *drive, int sections, int nodes, lm_mesh meshes[],
                       lm_fault *fault);

/* The same; `like`, if not null, is a mesh of the same drive and nodes, whose conjugate flank is
 * copied and not generated again. */
lm_status lm_make_face_like(const lm_drive *drive, int sections, int nodes, const lm_mesh *like,
                            lm_mesh meshes[], lm_fault *fault);

/* The mesh at any place of the face width, 0 .. 1 as lm_section_place, of a cup: the parts are
 * those of lm_make_face with at least 2 sections. like: as there, not null. Errors as lm_make_mesh,
 * and LM_OUT_OF_RANGE ("place"). */
lm_status lm_make_mesh_at(const lm_drive *drive, lm_real place, int nodes, const lm_mesh *like,
                          lm_mesh *mesh, lm_fault *fault);

/* Both clearances of the tooth at any finite material angle. Accuracy 1e-6 arcmin (float64). */
lm_clearance lm_tooth_clearance(const lm_mesh *mesh, lm_real angle_rad);

/* The same, where a gap that is larger than the limit may be a lower bound that is larger than it,
 * too: costs less for flanks that are no involutes. */
lm_clearance lm_clearance_within(const lm_mesh *mesh, lm_real angle_rad, lm_real limit_rad);

/* End of the overlap of one flank of a tooth, and the gap there, tip against tip. */
typedef struct lm_clearance_end {
  lm_real angle_rad;
  lm_gap gap;
} lm_clearance_end;

/* End of the overlap between two material angles at most a few degrees apart: inside_rad, where the
 * flank overlaps (finite gap), and outside_rad, where it does not. At the end the gap jumps to
 * infinity; it may have its minimum there. */
lm_clearance_end lm_find_overlap_end(const lm_mesh *mesh, lm_real inside_rad, lm_real outside_rad,
                                     int forward);

/* Clearances of every tooth of one lobe: teeth at 2 pi k / z + phase_rad with |angle| <= 90 deg, in
 * rising order. phase_rad: tooth phase of the wave generator, any finite value (period 2 pi / z).
 * capacity: length of clearances[], at least LM_LOBE_TEETH_MAX is always enough.
 * LM_NULL, LM_NOT_FINITE ("phase_rad"), LM_TOO_SMALL. */
lm_status lm_lobe_clearances(const lm_mesh *mesh, lm_real phase_rad, lm_clearance clearances[],
                             int capacity, int *count, lm_fault *fault);

/* The least gaps of several lobes or sections. */
typedef struct lm_least_gaps {
  lm_real forward_rad;
  lm_real backward_rad;
} lm_least_gaps;

/* Before the first of them: infinite. */
lm_least_gaps lm_no_gaps(void);

/* The same, but of pairs whose gap exceeds the least one of their flank by more than beyond_rad
 * (> 0) the gap may be a lower bound, which costs less than half. *least contains the least gaps so
 * far and receives those of this lobe. Errors as lm_lobe_clearances, and LM_NULL ("least"). */
lm_status lm_near_clearances(const lm_mesh *mesh, lm_real phase_rad, lm_real beyond_rad,
                             lm_least_gaps *least, lm_clearance clearances[], int capacity,
                             int *count, lm_fault *fault);

/* Tooth phases of a sweep. */
#define LM_SWEEP_PHASES_MAX 64

/* Number of entries of a sweep: teeth at every pitch / phases from -90 to 90 deg. */
#define LM_SWEEP_COUNT(flexspline_teeth, phases) (2 * ((flexspline_teeth) * (phases) / 4) + 1)

/* Clearances of every tooth of one lobe at `phases` equally spaced tooth phases at once: teeth at
 * every pitch / phases, in rising order; the middle entry is on the deformation axis, and the
 * teeth of one phase are every phases-th. Teeth at negative angles are the mirror images of those
 * at positive ones, g-(phi) = g+(-phi), so this costs half of lm_lobe_clearances phase by phase.
 * phases 1 .. LM_SWEEP_PHASES_MAX; capacity at least LM_SWEEP_COUNT. LM_NULL, LM_OUT_OF_RANGE
 * ("phases"), LM_TOO_SMALL. */
lm_status lm_sweep_clearances(const lm_mesh *mesh, int phases, lm_clearance clearances[],
                              int capacity, int *count, lm_fault *fault);

LM_END_DECLS

#endif
