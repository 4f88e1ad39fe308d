/* A strain-wave drive as its designer knows it: the one struct that the design model starts from.
 *
 * Way of the data: drive (this struct) -> geometry and neutral line (shape.h) -> clearances
 * (mesh.h) -> take-up under load (takeup.h) -> torsion curve (torsion_curve.h) -> compact curve
 * (curve.h) for the controller.
 *
 * Conventions, everywhere in the design model:
 *  - lengths mm, forces N, stresses MPa, angles rad; torque at the public edge N m.
 *  - Torque is the external torque on the output shaft. Torque, output angle and lost motion are
 *    positive in the same direction.
 *  - Angles of the geometry are measured from the DEFORMATION AXIS of the wave generator: the
 *    major axis for internal deformation (flexspline inside), the minor axis for external
 *    deformation (ring wave generator outside). Two lobes lie at 0 and pi; both tooth numbers are
 * even, so the lobes are equal.
 *  - "Forward" is the flank pair that closes for positive torque, "backward" the other one.
 */
#ifndef LOSTMOTION_DRIVE_H
#define LOSTMOTION_DRIVE_H

#include "lostmotion/radial_chain.h"
#include "lostmotion/real.h"
#include "lostmotion/status.h"
#include "lostmotion/symbols.h"
#include "lostmotion/tolerance.h"
#include "lostmotion/torsion_chain.h"

LM_BEGIN_DECLS

/* Capacity of the chains that a drive carries. */
#define LM_RADIAL_LAWS_MAX 8
#define LM_TORSION_ELEMENTS_MAX 8
#define LM_TOLERANCE_LINKS_MAX LM_TOLERANCE_CHAIN_MAX
#define LM_SECTIONS_MAX 7

/* Deflection coefficient of an S tooth: at 1 the curvature at the datum point is unbounded, and
 * there is no tangent. Random drives up to 0.996 agree with swept polygons. */
#define LM_KAPPA_MOST 0.995

/* Thickness of the circular spline or the ring wave generator outside its teeth, in pitch
 * diameters. */
#define LM_RING_SHARE LM_REAL(0.1)

/* Teeth of the flexspline: ratios of 15 to 320, the largest in catalogues. */
#define LM_FLEXSPLINE_TEETH_MIN 30
#define LM_FLEXSPLINE_TEETH_MAX 640

typedef enum lm_deformation {
  LM_INTERNAL = 0, /* external teeth on the flexspline, wave generator inside */
  LM_EXTERNAL = 1  /* internal teeth on the flexspline, ring wave generator outside */
} lm_deformation;

typedef enum lm_generator_type {
  LM_COSINE = 0,  /* cam that forces w = w0 cos 2 phi */
  LM_ELLIPSE = 1, /* elliptical cam of constant perimeter */
  LM_DISCS = 2,   /* two discs: contact arc of constant curvature, half angle beta */
  LM_ROLLERS = 3, /* four rollers at +-beta (two rollers: beta = 0) */
  LM_RING = 4 /* external ring generator: contact arc of constant curvature about the minor axis */
} lm_generator_type;

/* What the flank of a gear is (flank.h, conjugate.h). */
typedef enum lm_flank_kind {
  LM_FLANK_INVOLUTE = 0,
  LM_FLANK_DOUBLE_ARC = 1, /* flexspline: convex arc, common tangent, concave arc */
  LM_FLANK_CONJUGATE = 2,  /* rigid gear: what the moving flexspline tooth leaves free */
  LM_FLANK_S_TOOTH = 3, /* flexspline: half the path of a rack's tooth, either way from a point */
  LM_FLANK_POINTS = 4   /* flexspline: a spline through points */
} lm_flank_kind;

/* A flank as points of a spline: heights along the tooth's axis from the gear's centre, rising,
 * half the tooth's thickness there, and its slope by the height. Plain numbers: nothing is varied.
 */
#define LM_FLANK_POINTS_MAX 129
typedef struct lm_flank_points {
  int count; /* 4 .. LM_FLANK_POINTS_MAX */
  double along_mm[LM_FLANK_POINTS_MAX];
  double across_mm[LM_FLANK_POINTS_MAX];
  double slope[LM_FLANK_POINTS_MAX];
} lm_flank_points;

/* Both gears, in the words of a gear drawing. Shifts, heights and depths are in modules. */
typedef struct lm_teeth {
  lm_deformation deformation;
  lm_real module_mm;          /* 0.05 .. 10 */
  int flexspline_teeth;       /* even, 30 .. 640 */
  int rigid_teeth;            /* flexspline_teeth + 2 (internal) or - 2 (external) */
  lm_real pressure_angle_rad; /* of the rack, 0.17 .. 0.62 (10 .. 35 deg) */
  lm_real flexspline_shift;   /* x1, -2 .. 12 */
  lm_real rigid_shift;        /* x2, -2 .. 12 */
  lm_real rack_addendum;      /* h_a*, 0.5 .. 1.5; 1 in ISO 53 */
  lm_real root_clearance;     /* c*, 0.05 .. 0.6 */
  lm_real tooth_height;       /* h, whole depth of the tooth whose root the rack cuts, 0.5 .. 3 */
  lm_real engagement_depth;   /* h_d, on the deformation axis, 0.2 .. 2.5 */
  lm_real face_width_mm;      /* 0.5 .. 400 */
  lm_flank_kind flexspline_flank; /* any but conjugate (others than involutes: internal deformation
                                     only); of other flanks than involutes the shift is the radial
                                     displacement of the tool */
  lm_flank_kind rigid_flank; /* involute or conjugate (internal deformation only); the shift of a
                                conjugate flank is the displacement from where it is generated */
} lm_teeth;

/* Flanks that are no involutes, in the letters of the literature on double arcs (theory/flanks.md).
 * Centres are given from the tooth's axis and from the reference circle m z1 / 2 + x1 m. Lengths in
 * modules where the name has no unit. */
typedef struct lm_flank_form {
  lm_real rho_a;       /* radius of the convex arc, 0.2 .. 20 */
  lm_real l_a;         /* its centre lies this far across the tooth's axis, -2 .. 20 */
  lm_real X_a;         /* and this far below the reference circle, -2 .. 10 */
  lm_real rho_f;       /* radius of the concave arc, 0.2 .. 20 */
  lm_real l_f;         /* its centre lies this far across the axis of the space, -2 .. 20 */
  lm_real X_f;         /* and this far above the reference circle, -2 .. 10 */
  lm_real delta_L_rad; /* 0: the tangent follows from both centres. Above 0, up to 60 deg: its
                          inclination is given, l_f and X_f follow and are not read */
  lm_real
      h_l; /* height of the common tangent along the tooth's axis, 0.01 .. 2; read with delta_L */
  lm_real kappa;                 /* S tooth: deflection coefficient of the path, 0.5 .. 0.995 */
  lm_real X_M;                   /* its datum point above the reference circle, -2 .. 2 */
  lm_real s_M;                   /* thickness of the tooth there, 0.5 .. 2.5 */
  const lm_flank_points *points; /* of a flank of points, which they outlive; may be null else */
  lm_real tip_relief_mm;         /* taken off the flexspline's flank at its tip; 0 .. 0.1 modules */
  lm_real tip_relief_height; /* of the relieved part, 0 .. 1; the relief grows with the square */
  lm_real
      backlash_mm; /* added to a conjugate flank along the circumference, -0.05 .. 0.2 modules */
} lm_flank_form;

typedef struct lm_generator {
  lm_generator_type type;
  lm_real deflection_mm;          /* w0, 0.2 .. 2 modules */
  lm_real contact_half_angle_rad; /* beta; discs and ring 0.05 .. 1.2, rollers 0 .. 0.611 (35 deg);
                                     unused by cosine and ellipse */
  lm_real cam_offset_mm;          /* ellipse: distance from the cam to the neutral line (bearing and
                                     half the rim); 0 = the neutral line itself is the ellipse */
  int floating;                   /* 1: centres itself, both lobes carry the same; 0: fixed */
  lm_real eccentricity_mm;        /* of a fixed wave generator against the rigid gear, >= 0 */
  lm_real eccentricity_angle_rad; /* of that eccentricity from the deformation axis */
} lm_generator;

typedef struct lm_flexspline {
  lm_real rim_thickness_mm;  /* s, below the tooth root; 0.002 .. 0.1 of the pitch diameter */
  lm_real wall_thickness_mm; /* of the cup; 0.1 .. 3 rim thicknesses */
  lm_real length_mm;         /* L, from the cup bottom to the middle of the teeth; 0.8 .. 20 face
                                widths */
} lm_flexspline;

/* Steel of both gears; fatigue figures of the flexspline. */
typedef struct lm_material {
  lm_real youngs_modulus_MPa;   /* E, 2.1e5 for steel */
  lm_real shear_modulus_MPa;    /* G, 8.0e4 for steel */
  lm_real poisson_ratio;        /* nu, 0.3 */
  lm_real bending_fatigue_MPa;  /* sigma_-1 */
  lm_real shear_fatigue_MPa;    /* tau_-1 */
  lm_real bending_notch_factor; /* K_sigma */
  lm_real shear_notch_factor;   /* K_tau */
  lm_real mean_stress_factor;   /* psi: share of the mean bending stress that counts */
  lm_real flank_pressure_MPa;   /* mean pressure that the flanks stand */
  lm_real tooth_stress_factor;  /* Y_z: stress rise of a toothed rim against a smooth one */
} lm_material;

/* What holds the meshing teeth: the flexspline rim on the wave generator (rim_support.h, or a
 * stated foundation, takeup.h), and the teeth themselves. */
typedef struct lm_support {
  lm_real foundation_N_per_mm2; /* k_f, equal under all teeth; 0 = supports from the geometry */
  lm_real ring_stiffness_N_mm2; /* E I of rim and bearing race, > 0 */
  lm_real ring_factor;          /* c_rad: calibration of the ring share; 1 = first principles */
  lm_real tooth_compliance_mm_per_N; /* C_t of a pair; 0 = from the energy integral, eq (6) */
  int balls;                         /* of the wave generator's bearing, 7 .. 60 */
  lm_real ball_diameter_mm;
  lm_real race_thickness_mm;    /* of the race or backing ring under the rim */
  lm_real bearing_rating_N;     /* C of the wave generator's bearing, ISO 281 */
  lm_real engagement_limit_rad; /* only teeth within this angle of the deformation axis carry */
  lm_real gap_limit_rad;        /* pairs with a wider side clearance are left out */
} lm_support;

/* Radial gap on the deformation axis, eq (8), and the ring that must be bent to close it, (9a). */
typedef struct lm_radial_gap {
  lm_real generator_mm;            /* Delta0', wave generator to flexspline, 0 .. 1 module */
  lm_real teeth_mm;                /* Delta0'', tooth profiles, 0 .. 1 module */
  lm_real ring_stiffness_N_per_mm; /* of one lobe, > 0 */
} lm_radial_gap;

typedef struct lm_drive {
  lm_real ratio;           /* input turns for one output turn; its sign is the sense of rotation;
                              1 < |ratio| <= 1000 */
  lm_real rated_torque_Nm; /* > 0 */
  lm_teeth teeth;
  lm_generator generator;
  lm_flexspline flexspline;
  lm_material material;
  lm_support support;
  lm_radial_gap gap;
  lm_flank_form flank;
  lm_real friction_angle_rad; /* rho of the flanks, 0 .. 0.3: loading and unloading branch */
  int axial_sections;         /* that share the load: 1 = planar; 2 .. 7 = spatial */
  int planar_only;            /* 1: checks see the middle of the face alone; 0: both edges too. Only
                                 with one axial section */
  int radial_law_count;
  lm_radial_law radial_laws[LM_RADIAL_LAWS_MAX];
  int torsion_count;
  lm_torsion_element torsion[LM_TORSION_ELEMENTS_MAX];
  int tolerance_count;
  lm_tolerance_link tolerances[LM_TOLERANCE_LINKS_MAX];
} lm_drive;

/* Fill everything that the designer has not said, in proportion to size. Reads ratio,
 * rated_torque_Nm, teeth (all of it) and wave generator (type, deflection, contact angle), which
 * must be set, and replaces every other field that is 0 (a number) or empty (a chain) by: rim s =
 * (65 + 2.5 |u|^(2/3)) 1e-4 d, d = module times flexspline teeth; wall 0.6 s; length the larger of
 * 0.45 d and 2 face widths, 20 face widths at most steel: E 2.1e5, G 8e4 MPa, nu 0.3, where E or nu
 * is given G in proportion to E / (1 + nu); sigma_-1 450, tau_-1 250 MPa, K_sigma 1.9, K_tau 1.5,
 * psi 0.1, Y_z 1.45 (middle of the ranges in theory/check_values.md) mean flank pressure 240 MPa,
 * chosen: half above what textbook drives have at the catalogue ratings of sizes 14 to 40 support:
 * from the geometry; 23 balls of 0.08 d (4 mm at size 20), race 0.022 d (the backing ring of
 * rollers 0.075 d), its rating by ISO 281, E I = E b (s^3 + race^3) / 12 of rim and race, ring
 * factor 1; teeth within beta + 25 deg of the axis (70 deg on a cam); side clearances up to 8
 * arcmin; C_t stays 0, which means: from eq (6) gap: ring stiffness (9a) of the rim, twice
 * stiffened by teeth and cup radial chain: ovalisation of the circular spline, thickness 0.1 d,
 * bolted into a housing (factor 3); the wave generator's balls are in k_f torsion chain: cup wall
 * up to the middle of the teeth, or with axial sections, whose rim twists in the mesh, to its inner
 * edge; diaphragm of thickness 1.5 wall, hub 0.3 d; input shaft 0.16 d, long 0.6 d; output shaft
 * 0.5 d, long 0.8 d planar (1 section). A gap of 0, a friction angle of 0 and no tolerances are
 * kept. Errors as lm_check_drive for what must be set. */
lm_status lm_complete_drive(lm_drive *drive, lm_fault *fault) LM_PRECISE(lm_complete_drive);

/* Whether every value lies in its range and none contradicts another. The fault names the key as in
 * a drive file: "teeth.module_mm". LM_NULL, LM_NOT_FINITE, LM_OUT_OF_RANGE, or LM_INCONSISTENT
 * (tooth numbers that are odd or do not differ by 2; wave generator against deformation; a flank
 * that does not reach its base circle; arcs that do not make a flank; a ratio that the teeth cannot
 * give). What is accepted here has a
 * mesh: lm_make_mesh takes every axial section of it. */
lm_status lm_check_drive(const lm_drive *drive, lm_fault *fault) LM_PRECISE(lm_check_drive);

LM_END_DECLS

#endif
