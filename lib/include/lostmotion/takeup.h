/* Staged take-up: closing of the side clearances under load, one pair after the other.
 *
 * Two models. Independent pairs (theory/load.md) are unilateral springs side by side: the
 * closed form from which eq (1) of the paper follows. Coupled pairs deflect the flexspline rim, a
 * beam on the elastic foundation of the wave generator, and thus act on each other: a linear
 * complementarity problem, solved from event to event.
 */
#ifndef LOSTMOTION_TAKEUP_H
#define LOSTMOTION_TAKEUP_H

#include "lostmotion/mesh.h"
#include "lostmotion/real.h"
#include "lostmotion/status.h"

LM_BEGIN_DECLS

/* --- eq (1): increments of the lost motion, stage by stage --- */

/* Eq (1), corrected: sort the side clearances j_k / r_k of `count` pairs and give the increment of
 * the lost motion by each stage, g_(k+1) - g_k with g_0 = 0. (The paper's j_(k+1) is the clearance
 * that REMAINS at stage k; unloaded clearances must not be summed.) The cumulated increments are
 * the k-th smallest gap. clearance_mm[] (-1e6 .. 1e6), radius_mm[] (1e-3 .. 1e6), increment_rad[],
 * order[]: length count; order[k] is the pair that closes at stage k. Ties keep their order.
 * O(count^2), for reports.
 * LM_NULL, LM_NOT_FINITE, LM_OUT_OF_RANGE ("clearance_mm", "radius_mm", "count" 1 .. 1284). */
lm_status lm_stage_increments(const lm_real clearance_mm[], const lm_real radius_mm[], int count,
                              lm_real increment_rad[], int order[], lm_fault *fault);

/* --- independent pairs --- */

/* A pair of flanks as a spring that carries load only after its gap has closed. */
typedef struct lm_spring {
  lm_real stiffness_Nm_per_rad; /* 1e-9 .. 1e15; r^2 / C of the pair, at the output */
  lm_real gap_rad;              /* output rotation until contact, -pi .. pi; < 0: preloaded */
  int side;                     /* +1 closes for positive rotation, -1 for negative */
} lm_spring;

/* Output rotation under a torque, solved exactly from section 3.1 of theory/load.md:
 *     T(phi) = sum K (phi - g+)_+ - sum K (-phi - g-)_+
 * Springs are sorted in place by the rotation at which they begin or cease to carry load. The
 * rotation is absolute (same zero as the gaps); inside a free play, at torque 0, it is the middle
 * of the play. `engaged` is the number of springs that carry. torque_Nm: -1e9 .. 1e9. LM_NULL,
 * LM_NOT_FINITE, LM_OUT_OF_RANGE ("stiffness_Nm_per_rad", "gap_rad", "side", "torque_Nm", "count" 1
 * .. 1284), LM_NO_CONTACT if no spring can carry a torque of that sign. O(count^2) the first time,
 * O(count) when sorted. */
lm_status lm_independent_take_up(lm_spring springs[], int count, lm_real torque_Nm,
                                 lm_real *angle_rad, int *engaged, lm_fault *fault);

/* --- coupled pairs --- */

/* One flank pair of one tooth in one axial section of one lobe. */
typedef struct lm_contact {
  lm_real arm_mm;  /* r_k, 1e-3 .. 1e6 */
  lm_real wedge;   /* tan(alpha_w): radial force per tangential force, 0 .. 1e6 */
  lm_real gap_rad; /* -pi .. pi; < 0: preloaded */
  /* of the pair itself, tangential: C_t / cos^2(alpha_w), 1e-12 .. 1e6 */
  lm_real compliance_mm_per_N;
  int tooth;   /* place on the rim, 0 .. LM_LOBE_TEETH_MAX - 1 */
  int lobe;    /* 0 or 1 */
  int section; /* 0 .. LM_SECTIONS_MAX - 1 */
  int side;    /* +1 forward, -1 backward */
} lm_contact;

/* Candidates: both flanks of every tooth of both lobes in all sections. */
#define LM_CONTACTS_MAX (4 * LM_SECTIONS_MAX * LM_LOBE_TEETH_MAX)
#define LM_ACTIVE_MAX 384 /* pairs that carry at the same time */
#define LM_STAGES_MAX 512

/* Coupling of the pairs: each lobe rests on the wave generator as one rim, on which the forces of
 * all axial sections act together; the lobes are independent. */
#define LM_SUPPORTS_MAX 15 /* support points of the rim on the wave generator, per lobe */
typedef struct lm_foundation {
  lm_real yield_mm_per_N[LM_LOBE_TEETH_MAX]; /* radial compliance of the rim at that many teeth from
                                                a radial unit force, -1e6 .. 1e6 */
  int supports; /* 0: uniform foundation, described by yield alone; else 1 .. LM_SUPPORTS_MAX
                   supports, see lm_rim_yield */
  lm_real hold[LM_LOBE_TEETH_MAX][LM_SUPPORTS_MAX]; /* of each tooth, sqrt(mm/N) */
  int sections;                                     /* 1 .. LM_SECTIONS_MAX */
  int lobes; /* lobes listed one by one: 1 (then both are equal and count twice) or 2 */
  lm_real twist_rad_per_Nmm[LM_SECTIONS_MAX]
                           [LM_SECTIONS_MAX]; /* rotation of one section by a torque in another, -1
                               .. 1, symmetric; 0 in the planar model */
} lm_foundation;

/* Radial compliance of the rim at one tooth for a unit force on another: yield at their distance,
 * minus the sum over the supports of hold a times hold b. */
lm_real lm_rim_yield(const lm_foundation *foundation, int tooth, int other);

/* Beam on an elastic foundation: the deflection at distance s from a unit force is
 *   lambda / (2 k_f) e^(-lambda s) (cos lambda s + sin lambda s), lambda = (k_f / (4 E I))^(1/4),
 * times factor (>= 0). teeth: how many distances to fill, 1 .. LM_LOBE_TEETH_MAX; spacing_mm: arc
 * from tooth to tooth. LM_NULL, LM_NOT_FINITE, LM_OUT_OF_RANGE (the others > 0). */
lm_status lm_beam_yield(lm_real foundation_N_per_mm2, lm_real stiffness_N_mm2, lm_real spacing_mm,
                        lm_real factor, int teeth, lm_real yield_mm_per_N[], lm_fault *fault);

/* State under one torque. The angle is measured from the torque-free middle position and is the sum
 * of four parts, each the work done since rest divided by the torque. Each part has the sign of the
 * torque and is continuous in it; the sum is exact. */
typedef struct lm_take_up {
  lm_real angle_rad;
  lm_real clearance_rad; /* eq (1): clearance of the pairs that joined (or left) since rest */
  lm_real tooth_rad;     /* eq (6), (7): the pairs' own compliance */
  lm_real ring_rad;      /* rim and wave generator foundation: local part of eq (2) - (4) */
  lm_real twist_rad;     /* rim between axial sections: part of eq (5) */
  lm_real stiffness_Nm_per_rad; /* dT / dangle of the mesh, on the side away from rest */
  int forward_teeth;            /* loaded on this flank in any section, of the lobe with more */
  int backward_teeth;
} lm_take_up;

/* One event: a pair begins (joined = 1) or ceases (0) to carry load. */
typedef struct lm_stage {
  lm_real torque_Nm;
  lm_real angle_rad; /* from the torque-free middle */
  int contact;       /* index into contacts[] */
  int joined;
} lm_stage;

/* Rest position of the mesh and the events; filled by lm_coupled_take_up. */
typedef struct lm_rest {
  lm_real middle_rad;    /* torque-free middle, in the zero of the gaps */
  lm_real free_play_rad; /* half of the free play; 0 when preloaded */
  int preloaded;         /* pairs that carry at rest */
} lm_rest;

/* Memory of the solver, owned by the caller; it need not be initialised. */
typedef struct lm_take_up_workspace {
  lm_real factor[LM_ACTIVE_MAX * (LM_ACTIVE_MAX + 1) / 2]; /* Cholesky, packed by rows */
  lm_real force[LM_ACTIVE_MAX];                            /* N, of the active pairs */
  lm_real rate[LM_ACTIVE_MAX];                             /* its change along the path */
  lm_real change[LM_ACTIVE_MAX];                           /* its change since rest */
  int active[LM_ACTIVE_MAX];
  int active_count;
  int place[LM_CONTACTS_MAX];        /* position in active[], or -1 */
  lm_real slack_mm[LM_CONTACTS_MAX]; /* remaining distance of the unloaded pairs */
  lm_real approach[LM_CONTACTS_MAX]; /* rate at which that distance closes along the path */
  int rest_active[LM_ACTIVE_MAX];    /* the state at rest */
  int rest_active_count;
  lm_real rest_factor[LM_ACTIVE_MAX * (LM_ACTIVE_MAX + 1) / 2];
  lm_real rest_force[LM_CONTACTS_MAX];
  lm_real rest_slack_mm[LM_CONTACTS_MAX];
  lm_real give[2][LM_LOBE_TEETH_MAX]; /* radial deflection of the rim, by lobe and tooth */
  lm_stage stages[LM_STAGES_MAX];
  int stage_count; /* number of events; at most LM_STAGES_MAX are kept */
} lm_take_up_workspace;

/* Rotation under each torque: find F >= 0 with r(side phi - g) - C F <= 0 and F
 * complementary to it, T = lobes sum side F r. C is positive definite, so the state is
 * unique; it is piecewise linear in phi and computed exactly from event to event (active
 * set with an updated Cholesky factor), from rest upwards and from rest downwards. With
 * preload (gaps of both flanks with a negative sum) it starts from the equilibrium of both
 * flanks. contacts[count]: 1 .. LM_CONTACTS_MAX, both flanks; torque_Nm[torques]: rising
 * within -1e9 .. 1e9, at least one; states[torques]; rest may be null. LM_NULL,
 * LM_NOT_FINITE, LM_OUT_OF_RANGE (which field of a contact or of the foundation),
 * LM_NOT_MONOTONE ("torque_Nm"), LM_NO_CONTACT if the pairs of a flank cannot carry load,
 * LM_TOO_SMALL if more than LM_ACTIVE_MAX do, LM_NOT_CONVERGED if the factorisation fails
 * by rounding, or pairs join and leave endlessly (compliances of the pairs too small
 * against the ring's, or a twist that is not symmetric). On error states[] is not complete. */
lm_status lm_coupled_take_up(const lm_contact contacts[], int count,
                             const lm_foundation *foundation, const lm_real torque_Nm[],
                             int torques, lm_take_up states[], lm_rest *rest,
                             lm_take_up_workspace *workspace, lm_fault *fault);

/* The same for contacts of which the last `far` (>= 0) are left out: contacts[count + far]; their
 * gaps may be lower bounds and are > 0 within the range of the others. *touched is 1 if one of them
 * would carry in a state or at rest: then the states are not those of all contacts. Otherwise they
 * are, because the state under a torque is unique. On error *touched is not set. */
lm_status lm_near_take_up(const lm_contact contacts[], int count, int far, int *touched,
                          const lm_foundation *foundation, const lm_real torque_Nm[], int torques,
                          lm_take_up states[], lm_rest *rest, lm_take_up_workspace *workspace,
                          lm_fault *fault);

LM_END_DECLS

#endif
