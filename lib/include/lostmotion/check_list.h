/* The checks of a design, each stated once: lm_check_design makes them, the search limits them
 * (problem.h), the answers name them.
 *
 * A row: CHECK(ID, name, unit, SCALE, meaning)
 *   ID     LM_CHECK_<ID>
 *   SCALE  how a search measures a violation: MODULE (margin over the module), MOST (value over
 *          limit, less 1), LEAST (limit over value, less 1), ANGLE (arcmin)
 *   meaning  what is checked, by which rule, and what is idealised
 */
#ifndef LOSTMOTION_CHECK_LIST_H
#define LOSTMOTION_CHECK_LIST_H

#define LM_GEOMETRY_CHECKS(CHECK)                                                                  \
  CHECK(FORM_RADIUS, "form_radius", "mm", MODULE,                                                  \
        "the mating tip stays on the flank: the involute that the rack leaves, or the arcs")       \
  CHECK(FLEXSPLINE_TIP, "flexspline_tip_thickness", "mm", MODULE,                                  \
        "tip thickness of the flexspline tooth, at least 0.25 modules")                            \
  CHECK(RIGID_TIP, "rigid_tip_thickness", "mm", MODULE,                                            \
        "tip thickness of the rigid tooth, at least 0.25 modules")                                 \
  CHECK(FLEXSPLINE_ROOT, "flexspline_root_clearance", "mm", MODULE,                                \
        "radial clearance at the flexspline's root, at least 0.15 modules")                        \
  CHECK(RIGID_ROOT, "rigid_root_clearance", "mm", MODULE,                                          \
        "radial clearance at the rigid gear's root, at least 0.15 modules")                        \
  CHECK(SMALLEST_GAP, "smallest_gap", "rad", ANGLE,                                                \
        "side clearance of both flanks at all angles, tooth phases and places of the face")        \
  CHECK(DISENGAGEMENT, "disengagement", "mm", MODULE,                                              \
        "radial distance of the tips at 90 deg from the deformation axis")                         \
  CHECK(FREE_ASSEMBLY, "free_assembly", "mm", MODULE,                                              \
        "radial distance of the tips with the flexspline round, as it is put in; below 0 it goes " \
        "in deformed alone, by its generator, as most do: advice")

#define LM_STRENGTH_CHECKS(CHECK)                                                                \
  CHECK(BENDING_STRESS, "bending_stress", "MPa", MOST,                                           \
        "largest bending stress of the rim, below sigma_-1; ring theory of a thin rim")          \
  CHECK(TORSION_STRESS, "torsion_stress", "MPa", MOST,                                           \
        "shear in the cup's wall at rated torque, below tau_-1")                                 \
  CHECK(SAFETY, "safety_factor", "-", LEAST,                                                     \
        "fatigue safety of the rim under the amplitude of the rotating wave, with the shear of " \
        "the wall, at least 1.5 (rule of Gough and Pollard)")

/* At rated torque, from the forces of the pairs (load_capacity.h). */
#define LM_CAPACITY_CHECKS(CHECK)                                                                  \
  CHECK(FLANK_PRESSURE, "flank_pressure", "MPa", MOST,                                             \
        "normal force of the pair that carries most over face width and engagement depth; mean "   \
        "pressure, as for splines: Hertz's line contact does not hold for flanks this conformal")  \
  CHECK(FLEXSPLINE_ROOT_STRESS, "flexspline_root_stress", "MPa", MOST,                             \
        "bending at the root of the flexspline's tooth that carries most; cantilever of the "      \
        "root's thickness in the manner of ISO 6336-3, notch factor K_sigma, pulsating")           \
  CHECK(RIGID_ROOT_STRESS, "rigid_root_stress", "MPa", MOST,                                       \
        "the same at the root of the rigid gear's tooth")                                          \
  CHECK(RATCHETING, "ratcheting_torque", "Nm", LEAST,                                              \
        "torque at which rim, wave generator and rigid gear give way by the depth of the pairs "   \
        "that carry; extrapolated from rated torque, an idealisation of this model")               \
  CHECK(CUP_BUCKLING, "cup_buckling_torque", "Nm", LEAST,                                          \
        "torsional buckling of the cup's wall as a thin cylinder, NASA SP-8007 with its "          \
        "correlation factor")                                                                      \
  CHECK(CONING_STRESS, "coning_stress", "MPa", MOST,                                               \
        "bending of diaphragm and wall by the cone of the cup; radial strips of the diaphragm "    \
        "held at the hub, an idealisation of this model")                                          \
  CHECK(                                                                                           \
      BEARING_LIFE, "bearing_life", "h", LEAST,                                                    \
      "rating life of the wave generator's bearing by ISO 281 at rated torque and 2000 rpm; load " \
      "0.65 T tan(alpha_w) k / r, k = 1.3, as in the Vestnik of BMSTU (article 1072)")

#define LM_CHECKS(CHECK)    \
  LM_GEOMETRY_CHECKS(CHECK) \
  LM_STRENGTH_CHECKS(CHECK) \
  LM_CAPACITY_CHECKS(CHECK)

#endif
