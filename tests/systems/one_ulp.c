/* Loaded before the C library: its mathematical functions, each result moved by one unit in the
 * last place, up, down or not at all, in a sequence that is the same at every run. It shows how far
 * two C libraries that are both right to the last place can lead the same program apart.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <math.h>
#include <stddef.h>
#include <stdint.h>

static uint64_t state = 88172645463325252U; /* Marsaglia's xorshift, 64 bits */

static double moved(double value) {
  state ^= state << 13;
  state ^= state >> 7;
  state ^= state << 17;
  switch (state % 3) {
    case 0:
      return nextafter(value, INFINITY);
    case 1:
      return nextafter(value, -INFINITY);
    default:
      return value;
  }
}

#define ONE(name)                                \
  double name(double x) {                        \
    static double (*real)(double);               \
    if (real == NULL) {                          \
      *(void **)&real = dlsym(RTLD_NEXT, #name); \
    }                                            \
    return moved(real(x));                       \
  }
#define TWO(name)                                \
  double name(double x, double y) {              \
    static double (*real)(double, double);       \
    if (real == NULL) {                          \
      *(void **)&real = dlsym(RTLD_NEXT, #name); \
    }                                            \
    return moved(real(x, y));                    \
  }

ONE(sin)
ONE(cos)
ONE(tan)
ONE(asin)
ONE(acos)
ONE(atan)
ONE(exp)
ONE(log)
TWO(atan2)
TWO(pow)

void sincos(double x, double *sine, double *cosine) {
  *sine = sin(x);
  *cosine = cos(x);
}
