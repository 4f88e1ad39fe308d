/* The number type of the whole library, and how its two precisions live side by side.
 *
 * Every source file is written once in `lm_real` and built twice: LM_REAL_BITS = 64 (double, the
 * desktop's default) and LM_REAL_BITS = 32 (float, what a motor controller runs). The float build
 * carries the suffix `_f32` in every public symbol (names_f32.h), so both can be linked into one
 * program; the names in the headers and in the caller's source stay the same.
 *
 * A third number type (dual numbers for derivatives, say) can be put in its place by defining
 * LM_REAL_HEADER to a header that defines `lm_real` and the `real_*` functions of
 * lib/design/real_math.h. The sources are C99 that also compiles as C++ for that reason.
 *
 * Results are the same bits on every target as long as the compiler neither reorders nor
 * contracts. The run-time sources forbid contraction themselves, the others want
 * -ffp-contract=off (the CMake targets set it). -ffast-math and its parts are refused here.
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

#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__) || \
    (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ > 0)
#error "lostmotion: -ffast-math drops NaN handling and bit-identical results; build without it"
#endif

#if defined(LM_REAL_HEADER)
#include LM_REAL_HEADER
#elif LM_REAL_BITS == 64
typedef double lm_real;
#elif LM_REAL_BITS == 32
#include "lostmotion/names_f32.h"
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
