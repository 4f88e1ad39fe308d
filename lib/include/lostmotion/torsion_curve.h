/* The torsion curve of a drive: lost motion over torque, as the sum of five contributions.
 *
 *   phi(T) = radial gap (8), (9), (9a)          closes first, below about 2 % of rated torque
 *          + side clearance (1)                 staged take-up of the pairs
 *          + radial compliance (2) - (4)        rim, wave generator, then the radial chain
 *          + torsion (5)                        shafts, cup, and the rim between axial sections
 *          + tooth bending (6), (7)
 * All act in series under the same torque, so their angles add. phi is the ONE-SIDED
 * deflection, from the torque-free middle; lost motion of a reversal is phi(+T) - phi(-T).
 */
#ifndef LOSTMOTION_TORSION_CURVE_H
#define LOSTMOTION_TORSION_CURVE_H

#include "lostmotion/drive.h"
#include "lostmotion/mesh.h"
#include "lostmotion/real.h"
#include "lostmotion/status.h"
#include "lostmotion/takeup.h"

LM_BEGIN_DECLS

/* Torques of one evaluation. */
#define LM_TORQUES_MAX 1025

/* One torque. Contributions have the sign of the torque; they add up to total_rad to rounding. */
typedef struct lm_contributions {
  lm_real torque_Nm;
  lm_real total_rad;
  lm_real radial_gap_rad;
  lm_real side_clearance_rad;
  lm_real radial_compliance_rad;
  lm_real torsion_rad;
  lm_real tooth_bending_rad;
  lm_real stiffness_Nm_per_rad; /* dT / dphi, away from zero torque; infinite for a rigid drive */
  lm_real friction_half_width_rad; /* half the width of the loop that friction of the flanks adds */
  int forward_teeth;               /* loaded teeth, of the lobe with more of them */
  int backward_teeth;
} lm_contributions;

/* Values that do not depend on the torque. */
typedef struct lm_mesh_state {
  lm_real middle_rad;    /* torque-free middle of the output, moves with the tooth phase */
  lm_real free_play_rad; /* half of it; 0 when preloaded */
  /* alpha_w of (4), (9): mean of the pairs that touch first on each flank */
  lm_real flank_angle_rad;
  lm_real radius_mm;     /* r of (4), (9) */
  lm_real gap_mm;        /* Delta0, eq (8), with the mean of the tolerance chain, clipped at 0 */
  lm_real gap_torque_Nm; /* T0, (9a) */
  int pairs;             /* candidates for contact, both flanks, all sections */
  int preloaded_pairs;   /* preloaded: in contact without torque */
} lm_mesh_state;

/* Compliance of a tooth of one gear at its flank, eq (6) and the tilt in its rim, over the loaded
 * radius: linear between the nodes, because the compliance of the pair is about 1 % of the lost
 * motion. */
#define LM_GIVE_NODES 5
typedef struct lm_give_table {
  lm_real low_mm;
  lm_real step_mm;
  lm_real give_mm_per_N[LM_GIVE_NODES];
} lm_give_table;

typedef struct lm_pair_give {
  int known;
  lm_real fixed_mm_per_N; /* > 0: drive.support.tooth_compliance_mm_per_N, no tables */
  lm_give_table flexspline;
  lm_give_table rigid;
} lm_pair_give;

/* Memory of one evaluation, owned by the caller; sizeof is its constant size. */
typedef struct lm_design_workspace {
  lm_mesh meshes[LM_SECTIONS_MAX]; /* of the axial sections, which share the load */
  lm_mesh face[LM_SECTIONS_MAX]; /* sections for the checks (lm_make_face); filled by the caller */
  lm_pair_give give; /* the same at all tooth phases: computed by the first evaluation */
  int near_only; /* 0 after lm_prepare_meshes; 1: the same states in less time, with lower bounds in
                    place of clearances that do not matter for them */
  lm_clearance clearances[LM_SECTIONS_MAX][LM_LOBE_TEETH_MAX];
  lm_contact contacts[LM_CONTACTS_MAX];
  lm_foundation foundation;
  lm_take_up states[LM_TORQUES_MAX];
  lm_take_up_workspace take_up;
} lm_design_workspace;

/* Torque of the lost motion that data sheets state, as a share of the rated torque: 4 % in those of
 * Harmonic Drive SE. */
#define LM_LOST_MOTION_SHARE LM_REAL(0.04)

/* Radial gap Delta0 of the drive: gap.generator_mm + gap.teeth_mm, each plus the mean of its zone
 * of the tolerance chain and clipped at 0. Reads a checked drive. */
lm_real lm_mean_radial_gap(const lm_drive *drive);

/* Fills workspace->meshes for the axial sections of the drive; results of another drive are
 * discarded. nodes: LM_NEUTRAL_LINE_NODES, or more. Errors as lm_make_mesh. */
lm_status lm_prepare_meshes(const lm_drive *drive, int nodes, lm_design_workspace *workspace,
                            lm_fault *fault);

/* The torsion curve at one tooth phase of the wave generator (rad, 0 .. 2 pi / z). torque_Nm[count]
 * rising, 1 .. LM_TORQUES_MAX; contributions[count]; state may be null. Needs lm_prepare_meshes
 * of the same drive before. The events of the take-up are left in workspace->take_up.stages,
 * contacts in workspace->contacts. LM_NULL, LM_NOT_FINITE, LM_OUT_OF_RANGE, LM_NOT_MONOTONE;
 * LM_NO_CONTACT if the teeth of a flank cannot touch within the limits of drive.support. On error
 * contributions[] is not complete. */
lm_status lm_evaluate_torsion_curve(const lm_drive *drive, lm_real phase_rad,
                                    const lm_real torque_Nm[], int count,
                                    lm_contributions contributions[], lm_mesh_state *state,
                                    lm_design_workspace *workspace, lm_fault *fault);

/* Lost motion of a reversal, phi(+T) - phi(-T), torque_Nm > 0. Same preparation and errors. */
lm_status lm_reversal_lost_motion(const lm_drive *drive, lm_real phase_rad, lm_real torque_Nm,
                                  lm_real *lost_motion_rad, lm_design_workspace *workspace,
                                  lm_fault *fault);

/* The compact curve for the controller: `knots` of the `count` samples of a monotone
 * torsion curve, chosen by greedy insertion (starting with both ends and zero torque, then always
 * at the largest error of linear interpolation). Loss-free: the mean of both branches.
 * torque_Nm[count] strictly rising, angle_rad[count] not falling; count >= knots >= 2;
 * chosen[knots]: indices into the samples, rising; largest_error_rad over the samples. LM_NULL,
 * LM_NOT_FINITE, LM_NOT_MONOTONE ("torque_Nm", "angle_rad"), LM_OUT_OF_RANGE
 * ("knots"). O(knots count). */
lm_status lm_choose_knots(const lm_real torque_Nm[], const lm_real angle_rad[], int count,
                          int knots, int chosen[], lm_real *largest_error_rad, lm_fault *fault);

LM_END_DECLS

#endif
