/* Size of the runtime: a profile, or each size separately.
 *
 * LM_PROFILE selects the defaults below. Each macro may be set to a plain decimal number on the
 * compiler's command line, or in a user header named by LM_CONFIG_HEADER:
 * -DLM_CONFIG_HEADER='"lostmotion_config.h"'. Every source of the library and of the program must
 * see the same values; otherwise the program does not link (symbols.h).
 *
 *                        GAP   STANDARD   FULL
 * LM_CURVE_POINTS_MAX     16         33     64   knots of the torsion curve
 * LM_PLAYS_MAX             1          8     16   play operators (memory of the load history)
 * LM_EFFECTS_MAX           0          0     28   active secondary effects
 * LM_EFFECT_MEMORY_MAX     0          0     32   memory of all active effects, in numbers
 * LM_ENVELOPE              0          1      1   1: operators can follow an envelope (play.h)
 *
 * The standard profile can hold a few effects as well, for example -DLM_EFFECTS_MAX=2
 * -DLM_EFFECT_MEMORY_MAX=6; the memory of each effect is stated in its file. The desktop library
 * uses the full profile.
 *
 * The gap profile has neither curve nor effects: its model is one play operator driven by the
 * commanded output angle, for controllers without torque information.
 */
#ifndef LOSTMOTION_PROFILE_H
#define LOSTMOTION_PROFILE_H

#if defined(LM_CONFIG_HEADER)
#include LM_CONFIG_HEADER
#endif

#define LM_PROFILE_GAP 1      /* one operator, no curve */
#define LM_PROFILE_STANDARD 2 /* fewer knots and operators, no effects */
#define LM_PROFILE_FULL 3     /* every effect */

/* Knots of the torsion curve and play operators of these two. */
#define LM_CURVE_POINTS_STANDARD 33
#define LM_CURVE_POINTS_FULL 64
#define LM_PLAYS_STANDARD 8
#define LM_PLAYS_FULL 16

#ifndef LM_PROFILE
#define LM_PROFILE LM_PROFILE_STANDARD /* LM_PROFILE_GAP, LM_PROFILE_STANDARD, LM_PROFILE_FULL */
#endif
#if LM_PROFILE < LM_PROFILE_GAP || LM_PROFILE > LM_PROFILE_FULL
#error "lostmotion: LM_PROFILE must be LM_PROFILE_GAP, LM_PROFILE_STANDARD or LM_PROFILE_FULL"
#endif

#ifndef LM_CURVE_POINTS_MAX
#if LM_PROFILE == LM_PROFILE_GAP
#define LM_CURVE_POINTS_MAX 16
#elif LM_PROFILE == LM_PROFILE_STANDARD
#define LM_CURVE_POINTS_MAX LM_CURVE_POINTS_STANDARD /* 16 to 64: knots of the torsion curve */
#else
#define LM_CURVE_POINTS_MAX LM_CURVE_POINTS_FULL
#endif
#endif
#if LM_CURVE_POINTS_MAX < 16 || LM_CURVE_POINTS_MAX > 64
#error "lostmotion: LM_CURVE_POINTS_MAX must be 16 to 64"
#endif

#ifndef LM_PLAYS_MAX
#if LM_PROFILE == LM_PROFILE_GAP
#define LM_PLAYS_MAX 1
#elif LM_PROFILE == LM_PROFILE_STANDARD
#define LM_PLAYS_MAX LM_PLAYS_STANDARD /* 1 to 32: play operators */
#else
#define LM_PLAYS_MAX LM_PLAYS_FULL
#endif
#endif
#if LM_PLAYS_MAX < 1 || LM_PLAYS_MAX > 32
#error "lostmotion: LM_PLAYS_MAX must be 1 to 32"
#endif

#ifndef LM_EFFECTS_MAX
#if LM_PROFILE == LM_PROFILE_FULL
#define LM_EFFECTS_MAX 28 /* 0 to 64: active effects */
#else
#define LM_EFFECTS_MAX 0
#endif
#endif
#if LM_EFFECTS_MAX < 0 || LM_EFFECTS_MAX > 64
#error "lostmotion: LM_EFFECTS_MAX must be 0 to 64"
#endif
#if LM_PROFILE == LM_PROFILE_GAP && LM_EFFECTS_MAX > 0
#error "lostmotion: the gap profile has no effects: LM_EFFECTS_MAX must be 0"
#endif

#ifndef LM_EFFECT_MEMORY_MAX
#if LM_PROFILE == LM_PROFILE_FULL
#define LM_EFFECT_MEMORY_MAX 32 /* 0 to 256: memory of all active effects, in numbers */
#else
#define LM_EFFECT_MEMORY_MAX 0
#endif
#endif
#if LM_EFFECT_MEMORY_MAX < 0 || LM_EFFECT_MEMORY_MAX > 256
#error "lostmotion: LM_EFFECT_MEMORY_MAX must be 0 to 256"
#endif

#ifndef LM_ENVELOPE
#if LM_PROFILE == LM_PROFILE_GAP
#define LM_ENVELOPE 0
#else
/* 0 or 1: operators can follow an envelope of the torque, as fitted ones do. */
#define LM_ENVELOPE 1
#endif
#endif
#if LM_ENVELOPE < 0 || LM_ENVELOPE > 1
#error "lostmotion: LM_ENVELOPE must be 0 or 1"
#endif
#if LM_PROFILE == LM_PROFILE_GAP && LM_ENVELOPE > 0
#error "lostmotion: the gap profile has no torque: LM_ENVELOPE must be 0"
#endif

#endif
