/* Symbols that carry the precision and the sizes, so that a program which was compiled with others
 * than its library does not link, where it would hand over structs of another length:
 *
 *     undefined reference to `lm_start_compensator_3_64_16_27_32_f32'
 *
 * is a program of the profile 3 (full) with 64 knots, 16 operators, 27 effects and 32 numbers of
 * memory; the library's own symbol tells what that was built with. They are the functions that fill
 * a struct of the caller's before any other function reads it. Nothing in the code gets larger.
 *
 * Only the symbol in the object file changes, by an assembler label: no name in a source is a
 * macro, so debuggers, C++ and whatever parses the headers see the names as they are written. Where
 * the object format is ELF the library defines the plain symbol too, for dlsym. Compilers without
 * such labels have the plain symbols alone; there lm_check_parameters refuses parameters that were
 * compiled with another precision or other sizes.
 */
#ifndef LOSTMOTION_SYMBOLS_H
#define LOSTMOTION_SYMBOLS_H

#include "lostmotion/profile.h"
#include "lostmotion/real.h"

#define LM_TEXT_OF(tokens) #tokens
/* A step between, in which macros become what they stand for. */
#define LM_TEXT(tokens) LM_TEXT_OF(tokens)

/* LM_SIZED(name) behind a declaration: its symbol carries profile, sizes and precision.
 * LM_PRECISE(name): the precision. */
#if defined(__GNUC__) && !defined(LM_REAL_HEADER)
#define LM_PRECISION_TEXT "_f" LM_TEXT(LM_REAL_BITS)
#define LM_SIZES_TEXT                                                                             \
  "_" LM_TEXT(LM_PROFILE) "_" LM_TEXT(LM_CURVE_POINTS_MAX) "_" LM_TEXT(LM_PLAYS_MAX) "_" LM_TEXT( \
      LM_EFFECTS_MAX) "_" LM_TEXT(LM_EFFECT_MEMORY_MAX) LM_PRECISION_TEXT
#define LM_SIZED(name) __asm__(LM_TEXT(__USER_LABEL_PREFIX__) #name LM_SIZES_TEXT)
#define LM_PRECISE(name) __asm__(LM_TEXT(__USER_LABEL_PREFIX__) #name LM_PRECISION_TEXT)
#else
#define LM_SIZED(name)
#define LM_PRECISE(name)
#endif

#endif
