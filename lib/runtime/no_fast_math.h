/* Every source of the library refuses compiler flags that change its results. The public headers do
 * not, so that a host's sources may use any flags. */
#ifndef LOSTMOTION_RUNTIME_NO_FAST_MATH_H
#define LOSTMOTION_RUNTIME_NO_FAST_MATH_H

#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__) || \
    (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ > 0)
#error "lostmotion: -ffast-math drops NaN handling and bit-identical results; build without it"
#endif

#endif
