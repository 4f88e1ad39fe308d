/* Random numbers that are the same in every run. */
#ifndef LOSTMOTION_TESTS_DRAW_H
#define LOSTMOTION_TESTS_DRAW_H

#include <stdint.h>

#include "lostmotion/real.h"

/* Rounding of one operation. */
#define ROUNDING (LM_REAL_BITS == 64 ? LM_REAL(1.2e-16) : LM_REAL(6.0e-8))

static uint32_t seed; /* setUp sets the state to 1 */

/* A number between two limits; generator of Numerical Recipes. */
static inline lm_real draw(lm_real low, lm_real high) {
  seed = seed * 1664525u + 1013904223u;
  return low + (high - low) * LM_REAL(seed >> 8) / LM_REAL(16777216);
}

static inline lm_real distance(lm_real a, lm_real b) {
  return a < b ? b - a : a - b;
}

#endif
