/* Random numbers of the plant's tests. */
#ifndef LOSTMOTION_TESTS_PLANT_DRAW_H
#define LOSTMOTION_TESTS_PLANT_DRAW_H

#include <stdint.h>

static uint64_t state; /* any value except 0 */

/* xorshift64*; the upper 53 bits. */
static inline double draw(double low, double high) {
  state ^= state >> 12;
  state ^= state << 25;
  state ^= state >> 27;
  return low + (high - low) * (double)((state * 2685821657736338717u) >> 11) * 0x1p-53;
}

/* Sum of four, unit variance: rare extremes do not matter here. */
static inline double gauss(void) {
  return (draw(-1, 1) + draw(-1, 1) + draw(-1, 1) + draw(-1, 1)) * 0.8660254;
}

#endif
