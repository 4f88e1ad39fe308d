/* Load capacity at rated torque: forces of the pairs, tooth stresses, ratcheting and cup buckling
 * torque, coning of the cup, life of the wave generator's bearing.
 *
 * The formulas are those of the sources in check_list.h; where none applies to a strain-wave gear,
 * the rows there state the idealisations. Units: mm, N, MPa; torque N m on the output shaft.
 */
#ifndef LOSTMOTION_LOAD_CAPACITY_H
#define LOSTMOTION_LOAD_CAPACITY_H

#include "lostmotion/real.h"
#include "lostmotion/status.h"
#include "lostmotion/torsion_curve.h"

LM_BEGIN_DECLS

/* At one tooth phase. Root stresses are nominal, without notch factor: of involutes at the
 * root's thickness, of other flanks in the section of the outline that is stressed most
 * (tooth_outline.h). */
typedef struct lm_load {
  lm_real torque_Nm;
  lm_real largest_force_N;    /* normal force of the most loaded pair, whole face */
  lm_real largest_share;      /* its share in the sum of all pairs of a lobe */
  lm_real flank_pressure_MPa; /* that force over face width and engagement depth */
  lm_real flexspline_root_MPa;
  lm_real rigid_root_MPa;
  lm_real section_share;        /* largest share of one axial section in the sum of its lobe */
  lm_real radial_force_N;       /* of one lobe, sum over its pairs */
  lm_real wedge;                /* tan(alpha_w): radial over tangential force of the lobe */
  lm_real deflection_mm;        /* radial displacement of the loaded pairs out of mesh */
  lm_real depth_mm;             /* engaged depth of the loaded pairs, mean by force */
  lm_real ratcheting_torque_Nm; /* at which the deflection is the depth */
} lm_load;

/* Load at the last, positive torque of the last lm_evaluate_torsion_curve in this workspace.
 * LM_NULL, LM_OUT_OF_RANGE ("torque_Nm" not positive), LM_NO_CONTACT if no pair carries load. */
lm_status lm_measure_load(const lm_drive *drive, lm_real torque_Nm,
                          const lm_design_workspace *workspace, lm_load *load, lm_fault *fault);

/* Worst values over `phases` tooth phases at rated torque, item by item, with lm_face_sections
 * axial sections: pairs in the middle of the face alone may be hardly engaged.
 * Fills workspace->meshes of these sections (LM_NEUTRAL_LINE_NODES) and evaluates. Errors as
 * lm_evaluate_torsion_curve. */
lm_status lm_find_rated_load(const lm_drive *drive, int phases, lm_design_workspace *workspace,
                             lm_load *load, lm_fault *fault);

/* Updates *worst with the load of another phase; first = 1 initialises it. */
void lm_keep_worst_load(const lm_load *load, int first, lm_load *worst);

/* Torsional buckling of the cup's wall, NASA SP-8007 (1968), equation for a cylinder of moderate
 * length: tau = 0.747 gamma E (t / r)^(5/4) (r / l)^(1/2), gamma = 0.67. */
lm_real lm_cup_buckling_torque(const lm_drive *drive, lm_real radius_mm);

/* Bending by the cone, slope w / L of the wall: a radial strip of the diaphragm (thickness 1.5
 * walls, hub 0.6 r) is clamped at the hub, rotates with the wall by that slope and follows its
 * axial shift r w / (4 L); the larger stress of hub and wall corner. deflection_mm: w at the middle
 * of the face. */
lm_real lm_coning_stress(const lm_drive *drive, lm_real radius_mm);

/* ISO 281: basic rating C of a radial ball bearing of the wave generator's size, b_m f_c Z^(2/3)
 * D^1.8 with b_m = 1.3, f_c = 54 (ratio of ball and pitch diameter 0.09). */
lm_real lm_ball_bearing_rating(int balls, lm_real ball_diameter_mm);

/* Rating life in hours at rated torque and `speed_rpm` of the input. */
lm_real lm_bearing_life(const lm_drive *drive, const lm_load *load, lm_real speed_rpm);

LM_END_DECLS

#endif
