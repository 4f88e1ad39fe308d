/* Symbols that contain the precision and the sizes. A program compiled with other values than its
 * library would pass structs of a different size; with these symbols it does not link:
 *
 *     undefined reference to `lm_start_compensator_3_64_16_28_32_1_f32'
 *
 * is a program built with profile 3 (full), 64 knots, 16 operators, 28 effects, 32 numbers of
 * effect memory and the envelope; the symbol in the library shows its own configuration. The
 * functions concerned are those that fill a struct of the caller before any other function reads
 * it. The code does not grow.
 *
 * Only the symbol in the object file changes, by an assembler label. No name in a source is a
 * macro, so debuggers, C++ and header parsers see the names as written. In ELF objects the library
 * also defines the plain symbol, for dlsym. Compilers without such labels use only the plain
 * symbols; lm_check_parameters then refuses parameters that were compiled with another precision or
 * other sizes.
 */
#ifndef LOSTMOTION_SYMBOLS_H
#define LOSTMOTION_SYMBOLS_H

#include "lostmotion/profile.h"
#include "lostmotion/real.h"

#define LM_TEXT_OF(tokens) #tokens
/* Intermediate macro that expands its argument. */
#define LM_TEXT(tokens) LM_TEXT_OF(tokens)

/* LM_SIZED(name) after a declaration: the symbol contains profile, sizes and precision.
 * LM_PRECISE(name): only the precision. */
#if defined(__GNUC__) && !defined(LM_REAL_HEADER)
#define LM_PRECISION_TEXT "_f" LM_TEXT(LM_REAL_BITS)
#define LM_SIZES_TEXT                                                                             \
  "_" LM_TEXT(LM_PROFILE) "_" LM_TEXT(LM_CURVE_POINTS_MAX) "_" LM_TEXT(LM_PLAYS_MAX) "_" LM_TEXT( \
      LM_EFFECTS_MAX) "_" LM_TEXT(LM_EFFECT_MEMORY_MAX) "_" LM_TEXT(LM_ENVELOPE) LM_PRECISION_TEXT
#define LM_SIZED(name) __asm__(LM_TEXT(__USER_LABEL_PREFIX__) #name LM_SIZES_TEXT)
#define LM_PRECISE(name) __asm__(LM_TEXT(__USER_LABEL_PREFIX__) #name LM_PRECISION_TEXT)
#else
#define LM_SIZED(name)
#define LM_PRECISE(name)
#endif

#endif
