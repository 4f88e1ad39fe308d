/* The number type of the library and its two precisions.
 *
 * Every source file is written once in `lm_real` and built twice: LM_REAL_BITS = 64 (double, the
 * desktop's default) and LM_REAL_BITS = 32 (float, what a motor controller runs). Names are the
 * same in both, so a program links one of them; a program that needs both loads them as two shared
 * libraries. A program in one precision does not link with a library in the other (symbols.h).
 *
 * Another number type (dual numbers for derivatives, for example) can be used: define
 * LM_REAL_HEADER as the name of a header that defines `lm_real` with a member function `value` and
 * the `real_*` functions of lib/design/real_math.h. For this purpose the C99 sources also compile as C++.
 *
 * Results are bit-identical on every target as long as the compiler neither reorders nor contracts
 * floating-point operations. The run-time sources disable contraction themselves; the others need
 * -ffp-contract=off (the CMake targets set it). The library's sources do not compile with
 * -ffast-math or its parts; sources that only include the headers may use them.
 */
#ifndef LOSTMOTION_REAL_H
#define LOSTMOTION_REAL_H

#include "lostmotion/version.h"

#if defined(LM_CONFIG_HEADER)
#include LM_CONFIG_HEADER /* profile.h */
#endif

#ifndef LM_REAL_BITS
#define LM_REAL_BITS 64 /* 32 or 64: bits of lm_real */
#define LM_REAL_BITS_BY_DEFAULT
#endif

#if defined(LM_REAL_HEADER)
#include LM_REAL_HEADER
typedef double lm_plain;
#elif LM_REAL_BITS == 64
typedef double lm_real;
typedef lm_real lm_plain;
#elif LM_REAL_BITS == 32
typedef float lm_real;
typedef lm_real lm_plain;
#else
#error "lostmotion: LM_REAL_BITS must be 32 or 64"
#endif

/* lm_plain is for bounds that only decide: the value of a number, without its derivatives where it
 * has some. */
#if defined(LM_REAL_HEADER)
#define LM_VALUE(number) ((number).value())
#else
#define LM_VALUE(number) (number)
#endif

/* A literal of type lm_real: LM_REAL(0.5). */
#if defined(__cplusplus)
#define LM_REAL(literal) (static_cast<lm_real>(literal))
#define LM_PLAIN(literal) (static_cast<lm_plain>(literal))
#else
#define LM_REAL(literal) ((lm_real)(literal))
#define LM_PLAIN(literal) ((lm_plain)(literal))
#endif

#define LM_PI LM_REAL(3.14159265358979323846)
#define LM_MM_PER_M LM_REAL(1000)

/* Functions of another number type need C++ name mangling to coexist with the plain ones. */
#if defined(__cplusplus) && !defined(LM_REAL_HEADER)
#define LM_BEGIN_DECLS extern "C" {
#define LM_END_DECLS }
#else
#define LM_BEGIN_DECLS
#define LM_END_DECLS
#endif

#endif
