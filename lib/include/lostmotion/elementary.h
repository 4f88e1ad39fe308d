/* Elementary functions for effects: short polynomials, no libm, the same bits on every target, and
 * a finite result for every input, including NaN and infinity.
 *
 * Error bounds, absolute unless stated otherwise, against the exact function of the given number
 * (tests/c/test_elementary.c measures them):
 *
 *                        float      double
 * lm_sine, lm_cosine     1.5e-7     4e-16     |x| <= LM_TURN_MAX_RAD
 * lm_exponential         2.5e-7     1e-15     relative, between the two bounds of the argument
 * lm_logarithm           2.5e-7     5e-16     relative to the larger of |ln x| and 1
 * lm_hyperbolic_tangent  2.5e-7     5e-16
 * lm_relaxation          2.5e-7     1e-15     relative
 * lm_power               relative, 2e-7 (1 + 4 |exponent ln x|), double 1e-15 (1 + 4 |...|)
 */
#ifndef LOSTMOTION_ELEMENTARY_H
#define LOSTMOTION_ELEMENTARY_H

#include "lostmotion/real.h"

LM_BEGIN_DECLS

/* Largest angle [rad] that is reduced to one turn: 1018 turns. Beyond it, and for NaN, sine and
 * cosine are those of zero. A float angle of that size is only known to 5e-4 rad anyway: wrap
 * angles to one turn before they come here. */
#define LM_TURN_MAX_RAD LM_REAL(6400)

lm_real lm_sine(lm_real angle_rad);
lm_real lm_cosine(lm_real angle_rad);

/* Sine and cosine of one angle: the same bits as from the two functions, at little more than the
 * cost of one. */
typedef struct lm_sine_cosine {
  lm_real sine;
  lm_real cosine;
} lm_sine_cosine;

lm_sine_cosine lm_sine_and_cosine(lm_real angle_rad);

/* e^x; x is clipped to +-LM_EXPONENT_MAX (NaN counts as the lower end), so the result is positive
 * and finite. */
#define LM_EXPONENT_MAX LM_REAL(87)
lm_real lm_exponential(lm_real x);

/* Natural logarithm; x is clipped between LM_LOGARITHM_MIN and the largest finite number (NaN
 * counts as the minimum). */
#define LM_LOGARITHM_MIN LM_REAL(1.2e-38)
#define LM_LOGARITHM_MAX LM_REAL(3.4e38)
lm_real lm_logarithm(lm_real x);

/* tanh x; NaN gives -1. */
lm_real lm_hyperbolic_tangent(lm_real x);

/* 1 - e^-x for x >= 0, accurate for small x too: step response of a first-order lag after x time
 * constants. NaN gives 1. */
lm_real lm_relaxation(lm_real x);

/* x^exponent: 0 for x <= 0 and NaN, whatever the exponent; otherwise clipped between e^-87 and
 * e^87. */
lm_real lm_power(lm_real x, lm_real exponent);

LM_END_DECLS

#endif
