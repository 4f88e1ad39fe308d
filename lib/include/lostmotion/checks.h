/* The checks that a designer needs before cutting metal, each with its margin
 * (theory/geometry.md). */
#ifndef LOSTMOTION_CHECKS_H
#define LOSTMOTION_CHECKS_H

#include "lostmotion/check_list.h"
#include "lostmotion/drive.h"
#include "lostmotion/load_capacity.h"
#include "lostmotion/mesh.h"
#include "lostmotion/real.h"
#include "lostmotion/status.h"

LM_BEGIN_DECLS

/* LM_CHECK_<ID> for every row of check_list.h, in its order. */
#define LM_CHECK_OF_ROW(id, name, unit, scale, meaning) LM_CHECK_##id,
typedef enum lm_check_id { LM_CHECKS(LM_CHECK_OF_ROW) LM_CHECK_COUNT } lm_check_id;
#undef LM_CHECK_OF_ROW

/* One check. The design passes when margin >= 0; margin is value - limit where the value must be
 * large and limit - value where it must be small, in the unit of the check. */
typedef struct lm_check {
  lm_real value;
  lm_real limit;
  lm_real margin;
} lm_check;

/* Where the smallest gap was found. */
typedef struct lm_smallest_gap {
  lm_real gap_rad;
  lm_real angle_rad; /* of the tooth from the deformation axis, 0 .. pi/2 */
  int section;       /* index of its mesh */
  lm_real place;     /* on the face width, as lm_section_place */
  int forward; /* 1: flank that closes for positive torque, for a tooth at +angle (mirrored at -) */
} lm_smallest_gap;

/* Name of a check as in the answers ("form_radius"), and its unit ("mm"); "" outside the list. */
const char *lm_check_name(lm_check_id check);
const char *lm_check_unit(lm_check_id check);

/* What it checks, by which rule, and what is idealised. */
const char *lm_check_meaning(lm_check_id check);

/* Radius down to which a rack cuts the involute of an external gear: r_l = sqrt(r_b^2 + (r sin a +
 * (x - h_a) m / sin a)^2). Reads a checked drive. */
lm_real lm_rack_form_radius(const lm_teeth *teeth, int gear_teeth, lm_real shift);

/* Smallest side clearance over all tooth angles -90 .. 90 deg and both flanks, which holds every
 * tooth phase, over `sections` meshes. The scan steps by the tooth pitch over `steps_per_pitch` (1
 * .. 64) and refines around the three smallest by a parabola; by symmetry g-(phi) = g+(-phi) it
 * walks 0 .. 90 deg with both flanks. LM_NULL, LM_OUT_OF_RANGE, LM_NO_CONTACT when no teeth
 * overlap. */
lm_status lm_find_smallest_gap(const lm_mesh meshes[], int sections, int steps_per_pitch,
                               lm_smallest_gap *smallest, lm_fault *fault);

/* Smallest side clearance over the whole face width, all tooth angles and both flanks. The local
 * deflection grows along the face. The smallest gap is at an edge in nearly all drives, but not in
 * all (tests/c/test_checks.c has one): it is no concave function of the place. Therefore the edges
 * are scanned as by lm_find_smallest_gap, the other lm_face_places with a quarter of the steps, and
 * a smallest gap of these that is below its neighbours is refined along the face by a parabola.
 * Does not depend on drive.axial_sections. meshes[]: LM_FACE_PLACES meshes, filled; the first and
 * the last are those of the edges. Errors as lm_make_face and lm_find_smallest_gap. */
lm_status lm_find_face_gap(const lm_drive *drive, int nodes, int steps_per_pitch, lm_mesh meshes[],
                           lm_smallest_gap *smallest, lm_fault *fault);

/* Nodes of the neutral line and steps a pitch for the verdict on a drive: with the same ones
 * everywhere, `lostmotion predict` and the certificate of a design agree to the last bit. */
#define LM_CERTAIN_NODES 256
#define LM_CERTAIN_STEPS 32
#define LM_CERTAIN_PHASES 8

/* The same from clearances that lm_sweep_clearances has left: swept[section] holds `count` of them
 * for meshes[section], `phases` as there; only the refinement is computed again. Same errors. */
lm_status lm_refine_smallest_gap(const lm_mesh meshes[], int sections,
                                 const lm_clearance *const swept[], int count, int phases,
                                 lm_smallest_gap *smallest, lm_fault *fault);

/* All checks of a checked drive. meshes[sections]: of the places along the face, edges first and
 * last, as lm_make_face or lm_find_face_gap leaves them; smallest from lm_find_face_gap.
 * checks[LM_CHECK_COUNT]. Stresses at rated torque: sigma = Y_z
 * E s w0 |k|max / (2 r_m^2 (1 - nu^2)), amplitude with half the range of k over an angle; tension
 * of the rim N = F_WG / 2 on b s as mean stress; tau = T / (2 pi r_m^2 wall), pulsating; n = n_s
 * n_t / sqrt(n_s^2 + n_t^2), n_s = sigma_-1 / (K_s sigma_a + psi sigma_m), n_t = tau_-1 / (K_t
 * tau_a + 0.1 tau_m). The widest section counts. load: at rated torque, lm_find_rated_load.
 * Limits of the load:
 *   flanks: material.flank_pressure_MPa
 *   roots: pulsating bending, 2 sigma_-1 / (1.25 (K_s + psi)); 1.25 is the usual least safety
 *     against breakage of ISO 6336-3
 *   coning: reversed bending, sigma_-1 / 1.5
 *   LM_RATCHETING_FACTOR times the rated torque: the figure is 1.2 to 3.8 times what a catalogue
 *     states (sizes 14, 20 and 32, tests/python/test_load_capacity.py), so that 4 keeps the rated
 *     torque below each of them
 *   LM_BUCKLING_FACTOR times the rated torque: momentary peaks of catalogues are about four times
 *   LM_LIFE_H, chosen: a quarter of the 7000 to 10,000 h of catalogues at their rating speed,
 *     LM_LIFE_SPEED_RPM
 * LM_NULL. */
#define LM_RATCHETING_FACTOR 4
#define LM_BUCKLING_FACTOR 4
#define LM_LIFE_H 2000
#define LM_LIFE_SPEED_RPM 2000
lm_status lm_check_design(const lm_drive *drive, const lm_mesh meshes[], int sections,
                          const lm_smallest_gap *smallest, const lm_load *load,
                          lm_check checks[LM_CHECK_COUNT], lm_fault *fault);

LM_END_DECLS

#endif
