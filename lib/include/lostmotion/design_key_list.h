/* The dotted keys of [design], each stated once: name, range, default, meaning.
 *
 * This list is their only source: of the ranges in lm_check_drive (drive.c), of the variables of
 * the optimizer (problem.h, points.c, evaluate.c, output.c), of the keys of drive files and search
 * specs in Python (through design_keys.h), and of the table on the reference page. A new scalar of
 * the design is a member of a struct in drive.h and a row here.
 *
 * A row: ROW(ID, section, stem, suffix, KIND, PER, low, high, FILE, usual, VARY, meaning)
 *   ID       of the search: LM_KEY_<ID> in the optimizer
 *   section  of the drive file, and the member of lm_drive that holds it; drive: [design] itself
 *   stem, suffix  name and unit: member and key are stem##suffix; the suffix may be empty
 *   KIND     REAL, COUNT (int), SWITCH (0 or 1), DEFORMATION, GENERATOR or FLANK (drive.h)
 *   PER      unit of `low` and `high`: ONE (the unit of the name), DEGREE, ARCMIN (of an angle
 *            in rad), MODULE, DIAMETER (module times flexspline teeth), RIM (rim thickness),
 *            FACE (face width)
 *   FILE     treatment in a drive file: REQUIRED; DEFAULT (if left out, it is `usual`); FILLED
 *            (if left out, it is 0, which lm_complete_drive replaces where 0 means nothing)
 *   usual    default of a search; 0: as FILLED. Unit as VARY.
 *   VARY     how a search spec states it: SAME, IN_DEG, IN_ARCMIN (the suffix of the name), or
 *            FOLLOWS (from other keys or from an assumption of the search: the wave generator is
 *            floating and has no eccentricity)
 * DEPENDENT rows have the same columns; their range depends on another key, so another function
 * checks them (lm_make_shape, check_teeth); low and high are the widest range.
 *
 * The lists are in the order in which lm_check_drive examines the values.
 */
#ifndef LOSTMOTION_DESIGN_KEY_LIST_H
#define LOSTMOTION_DESIGN_KEY_LIST_H

/* The member of `drive`, a pointer to lm_drive, that holds a section: LM_OWNER_##section
 * stem##suffix.
 */
#define LM_OWNER_teeth drive->teeth.
#define LM_OWNER_generator drive->generator.
#define LM_OWNER_flexspline drive->flexspline.
#define LM_OWNER_material drive->material.
#define LM_OWNER_support drive->support.
#define LM_OWNER_gap drive->gap.
#define LM_OWNER_flank drive->flank.
#define LM_OWNER_drive drive->

/* Smallest and largest module and face width; other ranges are multiples of them. */
#define LM_MODULE_LEAST_MM 0.05
#define LM_MODULE_MOST_MM 10.0
#define LM_FACE_WIDTH_LEAST_MM 0.5
#define LM_FACE_WIDTH_MOST_MM 400.0

/* Thinnest and thickest rim, in pitch diameters. */
#define LM_RIM_LEAST 0.002
#define LM_RIM_MOST 0.1

#define LM_TEETH_KEYS(ROW, DEPENDENT)                                                              \
  ROW(DEFORMATION, teeth, deformation, , DEFORMATION, ONE, 0, 1, DEFAULT, 0, SAME,                 \
      "internal: external teeth on the flexspline, wave generator inside; external: ring "         \
      "wave generator outside, teeth inside")                                                      \
  ROW(MODULE_MM, teeth, module, _mm, REAL, ONE, LM_MODULE_LEAST_MM, LM_MODULE_MOST_MM, REQUIRED,   \
      0, SAME, "module m: pitch diameter over number of teeth")                                    \
  ROW(FLEXSPLINE_TEETH, teeth, flexspline_teeth, , COUNT, ONE, LM_FLEXSPLINE_TEETH_MIN,            \
      LM_FLEXSPLINE_TEETH_MAX, REQUIRED, 0, SAME, "teeth of the flexspline z1, an even number")    \
  DEPENDENT(RIGID_TEETH, teeth, rigid_teeth, , COUNT, ONE, LM_FLEXSPLINE_TEETH_MIN - 2,            \
            LM_FLEXSPLINE_TEETH_MAX + 2, REQUIRED, 0, FOLLOWS,                                     \
            "teeth of the rigid gear z2: z1 + 2 (internal) or z1 - 2 (external)")                  \
  ROW(PRESSURE_ANGLE_DEG, teeth, pressure_angle, _rad, REAL, DEGREE, 10, 35, DEFAULT, 20, IN_DEG,  \
      "pressure angle of the basic rack; 20 deg in ISO 53")                                        \
  ROW(FLEXSPLINE_SHIFT, teeth, flexspline_shift, , REAL, ONE, -2, 12, REQUIRED, 3, SAME,           \
      "profile shift x1 of the flexspline, in modules")                                            \
  ROW(RIGID_SHIFT, teeth, rigid_shift, , REAL, ONE, -2, 12, REQUIRED, 3, SAME,                     \
      "profile shift x2 of the rigid gear, in modules; a larger x2 - x1 opens the side "           \
      "clearance")                                                                                 \
  ROW(RACK_ADDENDUM, teeth, rack_addendum, , REAL, ONE, 0.5, 1.5, DEFAULT, 1, SAME,                \
      "addendum h_a* of the basic rack, in modules; 1 in ISO 53")                                  \
  ROW(ROOT_CLEARANCE, teeth, root_clearance, , REAL, ONE, 0.05, 0.6, DEFAULT, 0.35, SAME,          \
      "root clearance c* of the basic rack, in modules; 0.35 for fine modules (up to 0.5 mm)")     \
  ROW(TOOTH_HEIGHT, teeth, tooth_height, , REAL, ONE, 0.5, 3, REQUIRED, 1.75, SAME,                \
      "whole depth h of the rack-cut tooth, in modules")                                           \
  ROW(ENGAGEMENT_DEPTH, teeth, engagement_depth, , REAL, ONE, 0.2, 2.5, REQUIRED, 1.2, SAME,       \
      "engagement depth h_d on the deformation axis, in modules")                                  \
  ROW(FACE_WIDTH_MM, teeth, face_width, _mm, REAL, ONE, LM_FACE_WIDTH_LEAST_MM,                    \
      LM_FACE_WIDTH_MOST_MM, REQUIRED, 0, SAME, "face width b of the mesh")                        \
  DEPENDENT(FLEXSPLINE_FLANK, teeth, flexspline_flank, , FLANK, ONE, 0, 4, DEFAULT, 0, SAME,       \
            "flank of the flexspline: an involute, two arcs with a common tangent, an S tooth or " \
            "points (table flank), whose shift is the radial displacement of the tool")            \
  DEPENDENT(RIGID_FLANK, teeth, rigid_flank, , FLANK, ONE, 0, 4, DEFAULT, 0, SAME,                 \
            "flank of the rigid gear: an involute, the conjugate that the moving teeth of the "    \
            "flexspline leave free, or points (table flank); the shift displaces the latter two")

#define LM_GENERATOR_KEYS(ROW, DEPENDENT)                                                        \
  DEPENDENT(GENERATOR_TYPE, generator, type, , GENERATOR, ONE, 0, 4, REQUIRED, 0, SAME,          \
            "wave generator: a cosine or elliptical cam, two discs, rollers, or an external "    \
            "ring")                                                                              \
  ROW(DEFLECTION_MM, generator, deflection, _mm, REAL, MODULE, 0.2, 2, REQUIRED, 0, SAME,        \
      "radial deflection w0 of the flexspline on the deformation axis")                          \
  DEPENDENT(CONTACT_HALF_ANGLE_DEG, generator, contact_half_angle, _rad, REAL, ONE, 0, 1.2,      \
            FILLED, 30, IN_DEG,                                                                  \
            "half angle beta of the contact arc: discs and ring 0.05 to 1.2 rad, rollers 0 to "  \
            "0.611 rad (0: two rollers); unused by cams")                                        \
  ROW(CAM_OFFSET_MM, generator, cam_offset, _mm, REAL, DIAMETER, 0, 0.2, FILLED, 0, SAME,        \
      "ellipse: distance from the cam to the neutral line, which is bearing and half the rim; "  \
      "0: the neutral line itself is the ellipse")                                               \
  ROW(GENERATOR_FLOATING, generator, floating, , SWITCH, ONE, 0, 1, DEFAULT, 1, FOLLOWS,         \
      "true: the wave generator is floating, with equal load on both lobes; false: it is fixed") \
  ROW(GENERATOR_ECCENTRICITY_MM, generator, eccentricity, _mm, REAL, MODULE, 0, 1, FILLED, 0,    \
      FOLLOWS, "eccentricity of a fixed wave generator against the rigid gear")                  \
  ROW(GENERATOR_ECCENTRICITY_ANGLE_RAD, generator, eccentricity_angle, _rad, REAL, ONE, -10, 10, \
      FILLED, 0, FOLLOWS, "direction of that eccentricity from the deformation axis")

#define LM_FLEXSPLINE_KEYS(ROW, DEPENDENT)                                                         \
  ROW(RIM_THICKNESS_MM, flexspline, rim_thickness, _mm, REAL, DIAMETER, LM_RIM_LEAST, LM_RIM_MOST, \
      FILLED, 0, SAME, "thickness s of the rim below the tooth root")                              \
  ROW(WALL_THICKNESS_MM, flexspline, wall_thickness, _mm, REAL, RIM, 0.1, 3, FILLED, 0, SAME,      \
      "wall thickness of the cup")                                                                 \
  ROW(LENGTH_MM, flexspline, length, _mm, REAL, FACE, 0.8, 20, FILLED, 0, SAME,                    \
      "length L from the cup's bottom to the middle of the teeth")

#define LM_MATERIAL_KEYS(ROW, DEPENDENT)                                                         \
  ROW(YOUNGS_MODULUS_MPA, material, youngs_modulus, _MPa, REAL, ONE, 1, 1e7, FILLED, 0, SAME,    \
      "Young's modulus E; 2.1e5 for steel")                                                      \
  ROW(SHEAR_MODULUS_MPA, material, shear_modulus, _MPa, REAL, ONE, 1, 1e7, FILLED, 0, SAME,      \
      "shear modulus G; 8e4 for steel")                                                          \
  ROW(POISSON_RATIO, material, poisson_ratio, , REAL, ONE, 0, 0.49, FILLED, 0, SAME,             \
      "Poisson's ratio; 0.3 for steel")                                                          \
  ROW(BENDING_FATIGUE_MPA, material, bending_fatigue, _MPa, REAL, ONE, 1, 1e5, FILLED, 0, SAME,  \
      "fatigue strength in reversed bending, sigma_-1, of the flexspline")                       \
  ROW(SHEAR_FATIGUE_MPA, material, shear_fatigue, _MPa, REAL, ONE, 1, 1e5, FILLED, 0, SAME,      \
      "fatigue strength in reversed torsion, tau_-1, of the flexspline")                         \
  ROW(BENDING_NOTCH_FACTOR, material, bending_notch_factor, , REAL, ONE, 1, 10, FILLED, 0, SAME, \
      "notch factor in bending, K_sigma")                                                        \
  ROW(SHEAR_NOTCH_FACTOR, material, shear_notch_factor, , REAL, ONE, 1, 10, FILLED, 0, SAME,     \
      "notch factor in torsion, K_tau")                                                          \
  ROW(MEAN_STRESS_FACTOR, material, mean_stress_factor, , REAL, ONE, 0, 1, FILLED, 0, SAME,      \
      "weight psi of the mean bending stress in fatigue")                                        \
  ROW(FLANK_PRESSURE_MPA, material, flank_pressure, _MPa, REAL, ONE, 1, 1e5, FILLED, 0, SAME,    \
      "permissible mean pressure of the flanks, normal force over face width and engagement "    \
      "depth")                                                                                   \
  ROW(TOOTH_STRESS_FACTOR, material, tooth_stress_factor, , REAL, ONE, 1, 5, FILLED, 0, SAME,    \
      "stress rise Y_z of a toothed rim against a smooth one")

#define LM_SUPPORT_KEYS(ROW, DEPENDENT)                                                            \
  ROW(FOUNDATION_N_PER_MM2, support, foundation, _N_per_mm2, REAL, ONE, 0, 1e15, FILLED, 0, SAME,  \
      "foundation k_f, equal under all teeth: ball stiffness over ball pitch; 0: supports from "   \
      "the "                                                                                       \
      "geometry")                                                                                  \
  ROW(RING_STIFFNESS_N_MM2, support, ring_stiffness, _N_mm2, REAL, ONE, 1e-9, 1e15, FILLED, 0,     \
      SAME, "bending stiffness E I of rim and bearing race")                                       \
  ROW(RING_FACTOR, support, ring_factor, , REAL, ONE, 0, 1000, FILLED, 0, SAME,                    \
      "calibration c_rad of the ring's share in the compliance; 1: first principles")              \
  ROW(TOOTH_COMPLIANCE_MM_PER_N, support, tooth_compliance, _mm_per_N, REAL, ONE, 0, 1, FILLED, 0, \
      SAME, "compliance C_t of a pair of teeth; 0: from the energy integral, equation (6)")        \
  ROW(BALLS, support, balls, , COUNT, ONE, 7, 60, FILLED, 0, SAME,                                 \
      "balls of the wave generator's bearing")                                                     \
  ROW(BALL_DIAMETER_MM, support, ball_diameter, _mm, REAL, DIAMETER, 0.01, 0.3, FILLED, 0, SAME,   \
      "diameter of these balls")                                                                   \
  ROW(RACE_THICKNESS_MM, support, race_thickness, _mm, REAL, DIAMETER, 0.0005, 0.1, FILLED, 0,     \
      SAME, "thickness of the race or backing ring under the rim, bent with it")                   \
  ROW(BEARING_RATING_N, support, bearing_rating, _N, REAL, ONE, 1, 1e9, FILLED, 0, SAME,           \
      "basic dynamic load rating C of the wave generator's bearing, ISO 281")                      \
  ROW(ENGAGEMENT_LIMIT_DEG, support, engagement_limit, _rad, REAL, DEGREE, 5, 90, FILLED, 0,       \
      IN_DEG, "only teeth within this angle of the deformation axis carry")                        \
  ROW(GAP_LIMIT_ARCMIN, support, gap_limit, _rad, REAL, ARCMIN, 0.01, 600, FILLED, 0, IN_ARCMIN,   \
      "pairs of teeth with a wider side clearance are ignored")

#define LM_GAP_KEYS(ROW, DEPENDENT)                                                               \
  ROW(GENERATOR_GAP_MM, gap, generator, _mm, REAL, MODULE, 0, 1, FILLED, 0, SAME,                 \
      "radial gap Delta0' between wave generator and flexspline, equation (8)")                   \
  ROW(TEETH_GAP_MM, gap, teeth, _mm, REAL, MODULE, 0, 1, FILLED, 0, SAME,                         \
      "radial gap Delta0'' of the tooth profiles, equation (8)")                                  \
  ROW(GAP_RING_STIFFNESS_N_PER_MM, gap, ring_stiffness, _N_per_mm, REAL, ONE, 1e-9, 1e15, FILLED, \
      0, SAME, "radial stiffness of one lobe of the ring that closes the gap, equation (9a)")

/* Flanks other than involutes. Usual arcs: Liu et al., Machines 2025, 13, 535, section 3.5, in
 * modules; the tangent's height as those arcs give it. A radius or height of 0 means that the flank
 * is an involute and has none. */
#define LM_FLANK_KEYS(ROW, DEPENDENT)                                                             \
  ROW(RHO_A, flank, rho_a, , REAL, ONE, 0, 20, DEFAULT, 1.37, SAME,                               \
      "double arc: radius of the convex arc at the tip, in modules, 0.2 at least")                \
  ROW(L_A, flank, l_a, , REAL, ONE, -2, 20, DEFAULT, 0.664, SAME,                                 \
      "double arc: offset of the convex arc's centre across the tooth's axis, in modules")        \
  ROW(X_A, flank, X_a, , REAL, ONE, -2, 10, DEFAULT, 0.31, SAME,                                  \
      "double arc: depth of the convex arc's centre below the reference circle, in modules")      \
  ROW(RHO_F, flank, rho_f, , REAL, ONE, 0, 20, DEFAULT, 1.57, SAME,                               \
      "double arc: radius of the concave arc at the root, in modules, 0.2 at least")              \
  ROW(L_F, flank, l_f, , REAL, ONE, -2, 20, DEFAULT, 0.66, SAME,                                  \
      "double arc: offset of the concave arc's centre across the space's axis, in modules")       \
  ROW(X_F, flank, X_f, , REAL, ONE, -2, 10, DEFAULT, 0.268, SAME,                                 \
      "double arc: height of the concave arc's centre above the reference circle, in "            \
      "modules")                                                                                  \
  ROW(DELTA_L_DEG, flank, delta_L, _rad, REAL, DEGREE, 0, 60, DEFAULT, 0, IN_DEG,                 \
      "double arc: inclination of the common tangent; 0: it follows from both centres; "          \
      "above 0, l_f and X_f follow from it and are not read (arc, straight, arc)")                \
  ROW(H_L, flank, h_l, , REAL, ONE, 0, 2, DEFAULT, 0.25, SAME,                                    \
      "double arc: height of the common tangent, in modules, 0.01 at least; read with delta_L")   \
  ROW(KAPPA, flank, kappa, , REAL, ONE, 0, LM_KAPPA_MOST, DEFAULT, 0.9, SAME,                     \
      "S tooth: deflection coefficient of the rack tooth's path, half of which is the flank; "    \
      "0.5 at least")                                                                             \
  ROW(X_M, flank, X_M, , REAL, ONE, -2, 2, DEFAULT, 0, SAME,                                      \
      "S tooth: height of its datum point above the reference circle, in modules")                \
  ROW(S_M, flank, s_M, , REAL, ONE, 0, 2.5, DEFAULT, 1.5, SAME,                                   \
      "S tooth: thickness at its datum point, in modules, 0.5 at least")                          \
  ROW(TIP_RELIEF_MM, flank, tip_relief, _mm, REAL, MODULE, 0, 0.1, FILLED, 0, SAME,               \
      "relief of the flexspline's tip: material removed from its flank there, across the tooth; " \
      "the conjugate is generated without it")                                                    \
  ROW(TIP_RELIEF_HEIGHT, flank, tip_relief_height, , REAL, ONE, 0, 1, DEFAULT, 0.3, SAME,         \
      "height below the tip at which the relief begins, in modules; it grows with the square")    \
  ROW(BACKLASH_MM, flank, backlash, _mm, REAL, MODULE, -0.05, 0.2, FILLED, 0, SAME,               \
      "constant side clearance of a conjugate flank, along the circumference")

/* Keys of [design] itself. */
#define LM_DRIVE_KEYS(ROW, DEPENDENT)                                                              \
  ROW(FRICTION_ANGLE_DEG, drive, friction_angle, _rad, REAL, ONE, 0, 0.3, FILLED, 0, IN_DEG,       \
      "friction angle rho of the flanks: separates the loading and the unloading branch")          \
  ROW(AXIAL_SECTIONS, drive, axial_sections, , COUNT, ONE, 1, LM_SECTIONS_MAX, FILLED, 1, SAME,    \
      "sections of the face width that share the load: 1 is the planar model, 2 to 7 the spatial " \
      "one")                                                                                       \
  ROW(PLANAR_ONLY, drive, planar_only, , SWITCH, ONE, 0, 1, DEFAULT, 0, SAME,                      \
      "true: the checks examine only the middle of the face; false: both edges as well")

/* All of them, by section. */
#define LM_DESIGN_KEYS(ROW, DEPENDENT) \
  LM_TEETH_KEYS(ROW, DEPENDENT)        \
  LM_GENERATOR_KEYS(ROW, DEPENDENT)    \
  LM_FLEXSPLINE_KEYS(ROW, DEPENDENT)   \
  LM_MATERIAL_KEYS(ROW, DEPENDENT)     \
  LM_SUPPORT_KEYS(ROW, DEPENDENT)      \
  LM_GAP_KEYS(ROW, DEPENDENT)          \
  LM_FLANK_KEYS(ROW, DEPENDENT)        \
  LM_DRIVE_KEYS(ROW, DEPENDENT)

#endif
