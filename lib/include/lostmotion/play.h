/* Friction memory: a bank of generalised play operators (generalised Prandtl-Ishlinskii).
 *
 * Operator i follows an envelope U(T) of the torque within a band of half width
 * R_i = radius + widening * |U|:
 *
 *     U   = T + A sgn(T) (1 - 1 / (1 + t + t^2)),   t = |T| / K
 *     z_i <- max(U - R_i(U), min(U + R_i(U), z_i))
 *
 * The first `outside_count` operators sit in series with the spring and add an angle; the rest sit
 * inside: friction takes its part of the torque before the remainder winds the drive up.
 *
 *     h   =     sum_outside c_i (z_i - U)         angle = backbone(T_e) + h
 *     T_e = T + sum_inside  w_i (z_i - U)
 *
 * A bank as it is built follows the torque itself, A = 0 (lm_set_envelope). Friction in parallel
 * with the elasticity sticks by the angle: until its contacts slip they hold most of a change of
 * torque where the drive is soft, about no torque. There the envelope rises most, by 1 + A / K.
 *
 * Rate independent; the memory is the last torque and z_1 .. z_n, nothing else. With
 * 0 <= widening < 1 both edges of every band rise with the torque, hence: a larger swing wipes out
 * the smaller ones before it, minor loops close, and one big step of torque does what many small
 * ones do, bit for bit. At full slip the loop of the outside part is 2 sum c_i R_i wide.
 *
 * Cost: always LM_PLAYS_MAX operators, whatever the count (the rest carry no weight), so the time
 * does not depend on the torque. A bank of which no band widens takes a seventh less time, without
 * an FPU a fifth. Everything here is reentrant.
 */
#ifndef LOSTMOTION_PLAY_H
#define LOSTMOTION_PLAY_H

#include <stdint.h>

#include "lostmotion/profile.h"
#include "lostmotion/real.h"
#include "lostmotion/status.h"
#include "lostmotion/symbols.h"

LM_BEGIN_DECLS

/* One operator as a fit or a person states it. */
typedef struct lm_play {
  lm_real radius_Nm; /* half width of the band at no torque, 0 to LM_PLAY_RADIUS_MAX_NM */
  lm_real widening;  /* growth of the half width per |torque|, 0 to LM_PLAY_WIDENING_MAX */
  lm_real weight;    /* outside: compliance, rad/(N*m), 0 to 1; inside: share of the torque, 0 to 1.
                      * Gap profile: half gap over radius, 0 to 1e6 (model.h) */
} lm_play;

#if LM_PROFILE == LM_PROFILE_GAP
#define LM_PLAY_WEIGHT_MAX LM_REAL(1e6)
#else
#define LM_PLAY_WEIGHT_MAX LM_REAL(1)
#endif

#define LM_PLAY_RADIUS_MAX_NM LM_REAL(1e6) /* a band's edge must not overflow */
#define LM_PLAY_KNEE_MIN_NM LM_REAL(1e-6)
#define LM_PLAY_WIDENING_MAX LM_REAL(0.999) /* both edges must rise with the torque */
#define LM_PLAY_SUM_TOLERANCE LM_REAL(1e-5) /* relative, of the cached sums and edges */

/* One operator as the hot path reads it: a band's edge is the straight line
 * edge_slope * torque -+ radius_Nm, shallow (0) or steep (1) by the sign of the torque. */
typedef struct lm_play_slot {
  lm_real radius_Nm;
  lm_real edge_slope[2]; /* 1 - widening, 1 + widening */
  lm_real weight;
} lm_play_slot;

/* Made by lm_build_play_bank or by `lostmotion export`; trusted by every function that runs it. */
typedef struct lm_play_bank {
  int32_t count;                   /* operators used, 0 to LM_PLAYS_MAX */
  int32_t outside_count;           /* the first of them that sit outside, 0 to count */
  int32_t widens;                  /* 1: some band widens with the torque; 0: none does */
  lm_real outside_rad_per_Nm;      /* sum of the weights outside, in order */
  lm_real inside_share;            /* sum of the weights inside, in order */
  lm_real envelope_Nm;             /* A, 0 to LM_PLAY_RADIUS_MAX_NM; 0: none (LM_ENVELOPE) */
  lm_real knee_Nm;                 /* K, LM_PLAY_KNEE_MIN_NM to LM_PLAY_RADIUS_MAX_NM */
  lm_play_slot slot[LM_PLAYS_MAX]; /* unused: radius 0, slopes 1, weight 0 */
} lm_play_bank;

/* The load history, as far as it still matters. */
typedef struct lm_play_memory {
  lm_real torque_Nm;          /* where the torque stands */
  lm_real z_Nm[LM_PLAYS_MAX]; /* each within its band at that torque */
} lm_play_memory;

/* What the bank adds: to the angle, and to the torque that winds the drive up. */
typedef struct lm_play_sum {
  lm_real outside_rad; /* h */
  lm_real inside_Nm;   /* T_e - T */
} lm_play_sum;

/* Builds a bank from `count` operators, outside ones first.
 * play[count] (may be null where count is 0); count: 0 to LM_PLAYS_MAX; outside_count: 0 to count.
 * Errors: LM_NULL, LM_OUT_OF_RANGE, LM_NOT_FINITE; the fault names "count", "outside_count",
 * "radius_Nm", "widening" or "weight". */
lm_status lm_build_play_bank(lm_play_bank *bank, const lm_play *play, int32_t count,
                             int32_t outside_count, lm_fault *fault) LM_SIZED(lm_build_play_bank);

/* Lets the operators of a bank follow an envelope of the torque: envelope_Nm, 0 to
 * LM_PLAY_RADIUS_MAX_NM (0: the torque itself), is how much further than the torque it goes in the
 * end; knee_Nm, LM_PLAY_KNEE_MIN_NM to LM_PLAY_RADIUS_MAX_NM, the torque at which two thirds of
 * that are reached. Built with LM_ENVELOPE 0 (profile.h) there is none, envelope_Nm 0.
 * Errors: LM_NULL, LM_OUT_OF_RANGE, LM_NOT_FINITE naming "envelope_Nm" or "knee_Nm". */
lm_status lm_set_envelope(lm_play_bank *bank, lm_real envelope_Nm, lm_real knee_Nm,
                          lm_fault *fault);

/* What the operators follow [N*m] at a torque [N*m]. */
lm_real lm_find_envelope(const lm_play_bank *bank, lm_real torque_Nm);

/* Checks a bank that came from outside, against the least slope [rad/(N*m)] of its torsion curve:
 * everything lm_build_play_bank and lm_set_envelope check; cached sums, slopes and unused slots;
 * and, with r = 1 + A / K the greatest slope of the envelope: operators inside that stick hold at
 * most all of a change of torque, r sum w <= 1, and the angle does not fall while every operator
 * sticks, (1 - r sum w) least_slope >= r sum c. The angle rises strictly, and has an inverse, where
 * that inequality is strict.
 * Errors: as above, with "edge_slope"; LM_INCONSISTENT naming "padding", "edge_slope",
 * "outside_rad_per_Nm" or "inside_share". */
lm_status lm_check_play_bank(const lm_play_bank *bank, lm_real least_slope_rad_per_Nm,
                             lm_fault *fault);

/* Half width [N*m] of operator i's band about the envelope at a torque [N*m]. */
lm_real lm_find_play_radius(const lm_play_bank *bank, int32_t i, lm_real torque_Nm);

/* Every operator in the middle of its band, z_i = torque. At torque 0 that is the virgin state. At
 * another torque the middle of a bank with an envelope is elsewhere: settle the memory then, which
 * puts operators that are off onto the edge of their bands. */
void lm_center_plays(lm_play_memory *memory, lm_real torque_Nm) LM_SIZED(lm_center_plays);

/* Pulls every z_i into its band at the memory's torque: to be called once after the memory was set
 * by hand, restored, or carried over to another bank. A z_i that is NaN goes to the lower edge. */
void lm_settle_plays(const lm_play_bank *bank, lm_play_memory *memory);

/* One step to a torque [N*m], finite. Needs a settled memory and leaves one. The torque's direction
 * decides which edge can push, so only that one is computed. For a trial, copy the memory first. */
lm_play_sum lm_advance_plays(const lm_play_bank *bank, lm_play_memory *memory, lm_real torque_Nm);

/* The same with every band wider by a factor (grease, temperature), which may change from step to
 * step: both edges are computed, the memory need not be settled. The bands' edges rise with the
 * torque while width_scale * widening < 1; width_scale: 0 to LM_WIDTH_SCALE_MAX. */
lm_play_sum lm_advance_scaled_plays(const lm_play_bank *bank, lm_play_memory *memory,
                                    lm_real torque_Nm, lm_real width_scale);

/* Cold grease doubles the width; beyond 100 is nonsense. */
#define LM_WIDTH_SCALE_MAX LM_REAL(100)

/* A whole recording: `count` torques [N*m] through a bank; the memory carries the state in and out.
 * Writes h [rad] and T_e - T [N*m] of every sample; either may be null. */
void lm_run_play_bank(const lm_play_bank *bank, lm_play_memory *memory, const lm_real *torque_Nm,
                      int64_t count, lm_real *outside_rad, lm_real *inside_Nm);

/* For fitting the weights: z_i - T of any number of operators over a recording, of which torque_Nm
 * may be the envelope.
 * radius_Nm[operators], widening[operators]; z_Nm[operators] carries the state in and out and need
 * not be settled; width_scale[count], or null, is a factor on all bands at each sample, from 0;
 * difference_Nm[count][operators] is written row by row. Same bits as lm_advance_plays without, as
 * lm_advance_scaled_plays with a width_scale. */
void lm_run_plays(const lm_real *radius_Nm, const lm_real *widening, int32_t operators,
                  lm_real *z_Nm, const lm_real *torque_Nm, const lm_real *width_scale,
                  int64_t count, lm_real *difference_Nm);

LM_END_DECLS

#endif
