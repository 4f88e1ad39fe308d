/* Hysteresis: a bank of generalised play operators (generalised Prandtl-Ishlinskii model).
 *
 * Operator i follows an envelope U(T) of the torque within a band of half width
 * R_i = radius + widening * |U|:
 *
 *     U   = T + A sgn(T) (1 - 1 / (1 + t + t^2)),   t = |T| / K
 *     z_i <- max(U - R_i(U), min(U + R_i(U), z_i))
 *
 * The first `outside_count` operators act in series with the spring and add an angle; the others
 * act in parallel with it: friction carries part of the torque, and the rest winds the drive up.
 *
 *     h   =     sum_outside c_i (z_i - U)         angle = curve(T_e) + h
 *     T_e = T + sum_inside  w_i (z_i - U)
 *
 * A new bank follows the torque itself, A = 0 (lm_set_envelope). Friction in parallel with the
 * spring sticks in proportion to the angle: until the contacts slip, they carry most of a torque
 * change where the drive is soft, near zero torque. There the envelope is steepest, 1 + A / K.
 *
 * Rate independent; the state is the last torque and z_1 .. z_n. With 0 <= widening < 1 both edges
 * of every band rise with the torque. Therefore larger cycles erase smaller earlier ones
 * (wiping-out property), minor loops close, and one large torque step gives the same bits as many
 * small ones. At full slip the loop of the part in series is 2 sum c_i R_i wide.
 *
 * Cost: always LM_PLAYS_MAX operators, whatever the count (unused ones have weight 0), so the time
 * does not depend on the torque. A bank without widening takes a seventh less time, a fifth less
 * without an FPU. All functions are reentrant.
 */
#ifndef LOSTMOTION_PLAY_H
#define LOSTMOTION_PLAY_H

#include <stdint.h>

#include "lostmotion/profile.h"
#include "lostmotion/real.h"
#include "lostmotion/status.h"
#include "lostmotion/symbols.h"

LM_BEGIN_DECLS

/* One operator, as a fit or a user states it. */
typedef struct lm_play {
  lm_real radius_Nm; /* half width of the band at zero torque, 0 to LM_PLAY_RADIUS_MAX_NM */
  lm_real widening;  /* growth of the half width per |torque|, 0 to LM_PLAY_WIDENING_MAX */
  lm_real weight;    /* outside: compliance, rad/(N*m), 0 to 1; inside: share of the torque, 0 to 1.
                      * Gap profile: half gap over radius, 0 to 1e6 (model.h) */
} lm_play;

#if LM_PROFILE == LM_PROFILE_GAP
#define LM_PLAY_WEIGHT_MAX LM_REAL(1e6)
#else
#define LM_PLAY_WEIGHT_MAX LM_REAL(1)
#endif

#define LM_PLAY_RADIUS_MAX_NM LM_REAL(1e6) /* prevents overflow of a band's edge */
#define LM_PLAY_KNEE_MIN_NM LM_REAL(1e-6)
#define LM_PLAY_WIDENING_MAX LM_REAL(0.999) /* both edges must rise with the torque */
#define LM_PLAY_SUM_TOLERANCE LM_REAL(1e-5) /* relative, of the cached sums and edges */

/* One operator in the form used at run time: an edge of the band is the straight line edge_slope *
 * torque -+ radius_Nm; the sign of the torque selects the shallow (0) or the steep (1) slope. */
typedef struct lm_play_slot {
  lm_real radius_Nm;
  lm_real edge_slope[2]; /* 1 - widening, 1 + widening */
  lm_real weight;
} lm_play_slot;

/* Made by lm_build_play_bank or by `lostmotion export`; the functions that run it do not
 * check it. */
typedef struct lm_play_bank {
  int32_t count;         /* operators used, 0 to LM_PLAYS_MAX */
  int32_t outside_count; /* number of them in series with the spring, first in order, 0 to count */
  int32_t widens;        /* 1: some band widens with the torque; 0: none does */
  lm_real outside_rad_per_Nm;      /* sum of the weights in series, in order */
  lm_real inside_share;            /* sum of the weights in parallel, in order */
  lm_real envelope_Nm;             /* A, 0 to LM_PLAY_RADIUS_MAX_NM; 0: none (LM_ENVELOPE) */
  lm_real knee_Nm;                 /* K, LM_PLAY_KNEE_MIN_NM to LM_PLAY_RADIUS_MAX_NM */
  lm_play_slot slot[LM_PLAYS_MAX]; /* unused: radius 0, slopes 1, weight 0 */
} lm_play_bank;

/* The load history, as far as it affects the model. */
typedef struct lm_play_memory {
  lm_real torque_Nm;          /* present torque, as they follow it */
  lm_real z_Nm[LM_PLAYS_MAX]; /* each within its band at that torque */
} lm_play_memory;

/* Output of the bank: added to the angle, and to the torque that winds the drive up. */
typedef struct lm_play_sum {
  lm_real outside_rad; /* h */
  lm_real inside_Nm;   /* T_e - T */
} lm_play_sum;

/* Builds a bank from `count` operators, those in series first.
 * play[count] (may be null where count is 0); count: 0 to LM_PLAYS_MAX; outside_count: 0 to count.
 * Errors: LM_NULL, LM_OUT_OF_RANGE, LM_NOT_FINITE; the fault names "count", "outside_count",
 * "radius_Nm", "widening" or "weight". */
lm_status lm_build_play_bank(lm_play_bank *bank, const lm_play *play, int32_t count,
                             int32_t outside_count, lm_fault *fault) LM_SIZED(lm_build_play_bank);

/* Makes the operators of a bank follow an envelope of the torque. envelope_Nm, 0 to
 * LM_PLAY_RADIUS_MAX_NM (0: the torque itself), is the asymptotic excess of the envelope over the
 * torque; at knee_Nm, LM_PLAY_KNEE_MIN_NM to LM_PLAY_RADIUS_MAX_NM, it has two thirds of that. With
 * LM_ENVELOPE 0 (profile.h) there is no envelope and envelope_Nm must be 0. Errors: LM_NULL,
 * LM_OUT_OF_RANGE, LM_NOT_FINITE naming "envelope_Nm" or "knee_Nm". */
lm_status lm_set_envelope(lm_play_bank *bank, lm_real envelope_Nm, lm_real knee_Nm,
                          lm_fault *fault);

/* Returns the envelope [N*m], which the operators follow, at a torque [N*m]. */
lm_real lm_find_envelope(const lm_play_bank *bank, lm_real torque_Nm);

/* Checks a bank from an external source against the least slope [rad/(N*m)] of its torsion curve:
 * all that lm_build_play_bank and lm_set_envelope check; cached sums, slopes and unused slots; and
 * two conditions with r = 1 + A / K, the greatest slope of the envelope. Sticking operators in
 * parallel carry at most the whole torque change, r sum w <= 1; the angle does not fall while every
 * operator sticks, (1 - r sum w) least_slope >= r sum c. If that inequality is strict, the angle
 * rises strictly and has an inverse. Errors: as above, with "edge_slope"; LM_INCONSISTENT naming
 * "padding", "edge_slope", "outside_rad_per_Nm" or "inside_share". */
lm_status lm_check_play_bank(const lm_play_bank *bank, lm_real least_slope_rad_per_Nm,
                             lm_fault *fault);

/* Returns the half width [N*m] of the band of operator i about the envelope at a torque [N*m]. */
lm_real lm_find_play_radius(const lm_play_bank *bank, int32_t i, lm_real torque_Nm);

/* Sets every operator to the middle of its band, z_i = torque. At torque 0 this is the virgin
 * state. At other torques the middle of a band about an envelope differs from the torque: call
 * lm_settle_plays afterwards, which moves operators outside their bands to the nearest edge. */
void lm_center_plays(lm_play_memory *memory, lm_real torque_Nm) LM_SIZED(lm_center_plays);

/* Moves every z_i into its band at the torque of the memory. Call it once after the memory
 * was set by hand, restored, or taken over from another bank. A z_i that is NaN is set to
 * the lower edge. */
void lm_settle_plays(const lm_play_bank *bank, lm_play_memory *memory);

/* One step to a finite torque [N*m]. The memory must be settled and stays so. Only the edge that
 * the direction of the torque can move is computed. For a trial step, copy the memory first. */
lm_play_sum lm_advance_plays(const lm_play_bank *bank, lm_play_memory *memory, lm_real torque_Nm);

/* The same with all band widths multiplied by a factor (grease, temperature) that may change from
 * step to step: both edges are computed, and the memory need not be settled. The edges of the bands
 * rise with the torque while width_scale * widening < 1; width_scale: 0 to LM_WIDTH_SCALE_MAX. */
lm_play_sum lm_advance_scaled_plays(const lm_play_bank *bank, lm_play_memory *memory,
                                    lm_real torque_Nm, lm_real width_scale);

/* Cold grease doubles the width; values above 100 are not plausible. */
#define LM_WIDTH_SCALE_MAX LM_REAL(100)

/* Runs a bank over a recording of `count` torques [N*m]; the memory carries the state in and out.
 * Writes h [rad] and T_e - T [N*m] of every sample; either may be null. */
void lm_run_play_bank(const lm_play_bank *bank, lm_play_memory *memory, const lm_real *torque_Nm,
                      int64_t count, lm_real *outside_rad, lm_real *inside_Nm);

/* For the estimation of weights: z_i - T of any number of operators over a recording. torque_Nm may
 * be the envelope of the torque. radius_Nm[operators], widening[operators]; z_Nm[operators] carries
 * the state in and out and need not be settled; width_scale[count], or null, is a factor on all
 * bands at each sample, from 0; difference_Nm[count][operators] is written row by row. Bit for bit
 * the results of lm_advance_plays without width_scale, of lm_advance_scaled_plays with it. */
void lm_run_plays(const lm_real *radius_Nm, const lm_real *widening, int32_t operators,
                  lm_real *z_Nm, const lm_real *torque_Nm, const lm_real *width_scale,
                  int64_t count, lm_real *difference_Nm);

/* For the estimation of weights under effects on the compliance: the envelope U(T') [N*m] that
 * operators follow at every sample, T' of model.h. The bank is read for its envelope only.
 * radius_Nm, widening, share[operators], 0 or more, of friction in parallel, as in
 * lm_build_play_bank; torque_Nm[count]; compliance[count], within LM_COMPLIANCE_MAX; width_scale as
 * in lm_run_plays. difference_Nm[operators] carries z_i - U in and out; followed_Nm[count] is
 * written. Numbers are finite and not checked; operators and count from 0. */
void lm_find_followed(const lm_play_bank *bank, const lm_real *radius_Nm, const lm_real *widening,
                      const lm_real *share, int32_t operators, const lm_real *torque_Nm,
                      const lm_real *compliance, const lm_real *width_scale, int64_t count,
                      lm_real *difference_Nm, lm_real *followed_Nm);

LM_END_DECLS

#endif
