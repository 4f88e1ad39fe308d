/* Symbols that carry the sizes of profile.h, so that a program which was compiled with other sizes
 * than its library does not link, where else it would hand over structs of another length:
 *
 *     undefined reference to `lm_start_compensator_3_64_16_27_32_f32'
 *
 * is a program of the profile 3 (full) with 64 knots, 16 plays, 27 effects and 32 numbers of
 * memory; the library's own symbol tells what that was built with. They are the functions that fill
 * a struct of the caller's before any other function reads it. Nothing in the code gets larger.
 */
#ifndef LOSTMOTION_NAMES_SIZED_H
#define LOSTMOTION_NAMES_SIZED_H

#include "lostmotion/profile.h"
#include "lostmotion/real.h"

#if LM_REAL_BITS == 32
#define LM_JOIN_SIZES(name, profile, knots, plays, effects, memory) \
  name##_##profile##_##knots##_##plays##_##effects##_##memory##_f32
#else
#define LM_JOIN_SIZES(name, profile, knots, plays, effects, memory) \
  name##_##profile##_##knots##_##plays##_##effects##_##memory
#endif
/* A step between, in which the sizes become numbers. */
#define LM_NAME_SIZES(name, profile, knots, plays, effects, memory) \
  LM_JOIN_SIZES(name, profile, knots, plays, effects, memory)
#define LM_SIZED(name)                                                               \
  LM_NAME_SIZES(name, LM_PROFILE, LM_CURVE_POINTS_MAX, LM_PLAYS_MAX, LM_EFFECTS_MAX, \
                LM_EFFECT_MEMORY_MAX)

#define lm_build_curve LM_SIZED(lm_build_curve)
#define lm_build_play_bank LM_SIZED(lm_build_play_bank)
#define lm_center_plays LM_SIZED(lm_center_plays)
#define lm_load_parameters LM_SIZED(lm_load_parameters)
#define lm_start_compensator LM_SIZED(lm_start_compensator)
#define lm_start_model LM_SIZED(lm_start_model)

#endif
