/* The number type of the whole library, and its two precisions.
 *
 * Every source file is written once in `lm_real` and built twice: LM_REAL_BITS = 64 (double, the
 * desktop's default) and LM_REAL_BITS = 32 (float, what a motor controller runs). Names and symbols
 * are the same in both, so a program links one of them; who needs both loads them as two shared
 * libraries. A program in one precision does not link with a library in the other (symbols.h).
 *
 * A third number type (dual numbers for derivatives, say) can be put in its place by defining
 * LM_REAL_HEADER to a header that defines `lm_real` and the `real_*` functions of
 * lib/design/real_math.h. The sources are C99 that also compiles as C++ for that reason.
 *
 * Results are the same bits on every target as long as the compiler neither reorders nor
 * contracts. The run-time sources forbid contraction themselves, the others want
 * -ffp-contract=off (the CMake targets set it). The library's sources refuse -ffast-math and its
 * parts; sources that only include the headers may use them.
 */
#ifndef LOSTMOTION_REAL_H
#define LOSTMOTION_REAL_H

#include "lostmotion/version.h"

#if defined(LM_CONFIG_HEADER)
#include LM_CONFIG_HEADER /* profile.h */
#endif

#ifndef LM_REAL_BITS
#define LM_REAL_BITS 64 /* 32 or 64: bits of lm_real */
#endif

#if defined(LM_REAL_HEADER)
#include LM_REAL_HEADER
#elif LM_REAL_BITS == 64
typedef double lm_real;
#elif LM_REAL_BITS == 32
typedef float lm_real;
#else
#error "lostmotion: LM_REAL_BITS must be 32 or 64"
#endif

/* A literal in the number type at hand: LM_REAL(0.5). */
#if defined(__cplusplus)
#define LM_REAL(literal) (static_cast<lm_real>(literal))
#else
#define LM_REAL(literal) ((lm_real)(literal))
#endif

#define LM_PI LM_REAL(3.14159265358979323846)

/* Functions on another number type are other functions: they need C++'s names to stand beside the
 * plain ones. */
#if defined(__cplusplus) && !defined(LM_REAL_HEADER)
#define LM_BEGIN_DECLS extern "C" {
#define LM_END_DECLS }
#else
#define LM_BEGIN_DECLS
#define LM_END_DECLS
#endif

#endif
