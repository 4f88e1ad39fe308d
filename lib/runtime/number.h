/* Operations on numbers for the whole runtime, without libm. */
#ifndef LOSTMOTION_RUNTIME_NUMBER_H
#define LOSTMOTION_RUNTIME_NUMBER_H

#include <stdint.h>
#include <string.h>

#include "lostmotion/real.h"
#include "runtime/as_written.h"

/* 1 where every operation on numbers is a call of the compiler's library. */
#if (defined(__arm__) && !defined(__ARM_FP)) || (defined(__riscv) && !defined(__riscv_flen))
#define WITHOUT_FPU 1
#else
#define WITHOUT_FPU 0
#endif

/* Limits of the magnitude of stated numbers. Smaller values count as zero: inverses and products of
 * it would leave float's range. */
#define SMALLEST LM_REAL(1e-9)
#define LARGEST LM_REAL(1e9)

/* Infinity less itself and NaN less itself are NaN, which equals nothing; without an FPU the
 * exponent's bits tell it sooner. */
static inline int is_finite(lm_real value) {
#if WITHOUT_FPU && LM_REAL_BITS == 32
  uint32_t bits;
  (void)memcpy(&bits, &value, sizeof bits);
  return (bits & 0x7F800000u) != 0x7F800000u;
#else
  return value - value == 0;
#endif
}

/* The builtin is one instruction or one mask everywhere; the comparison differs only for -0. */
static inline lm_real absolute(lm_real value) {
#if defined(__GNUC__) && LM_REAL_BITS == 32
  return __builtin_fabsf(value);
#elif defined(__GNUC__)
  return __builtin_fabs(value);
#else
  return value < 0 ? -value : value;
#endif
}

/* 1 where the sign bit is set, else 0: an integer shift where a comparison would take five
 * instructions. It calls -0 negative. */
static inline int32_t is_negative(lm_real value) {
#if defined(__GNUC__) && LM_REAL_BITS == 32
  return __builtin_signbitf(value) != 0;
#elif defined(__GNUC__)
  return __builtin_signbit(value) != 0;
#elif LM_REAL_BITS == 32
  uint32_t bits;
  (void)memcpy(&bits, &value, sizeof bits);
  return (int32_t)(bits >> 31);
#else
  uint64_t bits;
  (void)memcpy(&bits, &value, sizeof bits);
  return (int32_t)(bits >> 63);
#endif
}

/* A size >= 0 with the sign bit of a value. */
static inline lm_real with_sign_of(lm_real value, lm_real size) {
  return is_negative(value) ? -size : size;
}

/* 1 where one sign bit is set and the other is not. */
static inline int signs_differ(lm_real a, lm_real b) {
#if LM_REAL_BITS == 32
  uint32_t first;
  uint32_t second;
  (void)memcpy(&first, &a, sizeof first);
  (void)memcpy(&second, &b, sizeof second);
  return (int)((first ^ second) >> 31);
#else
  return is_negative(a) != is_negative(b);
#endif
}

/* 1 for a number above zero, infinity and a NaN without sign included. */
static inline int is_positive(lm_real value) {
#if LM_REAL_BITS == 32
  int32_t bits;
#else
  int64_t bits;
#endif
  (void)memcpy(&bits, &value, sizeof bits);
  return bits > 0;
}

/* is_greater: a > b for finite numbers. is_within: |value| <= most for any value and a finite
 * most >= 0 (never -0); NaN is not within. Without an FPU a library call costs three times the
 * integers: the bits of a float, taken as sign and size, are ordered as the float is (and both
 * zeros are equal). */
#if WITHOUT_FPU && LM_REAL_BITS == 32
static inline int32_t ordered_bits(lm_real value) {
  int32_t bits;
  int32_t size;
  (void)memcpy(&bits, &value, sizeof bits);
  size = bits & 0x7FFFFFFF;
  return bits < 0 ? -size : size;
}
static inline int is_greater(lm_real a, lm_real b) {
  return ordered_bits(a) > ordered_bits(b);
}
static inline int is_within(lm_real value, lm_real most) {
  int32_t size;
  int32_t bound;
  (void)memcpy(&size, &value, sizeof size);
  (void)memcpy(&bound, &most, sizeof bound);
  return (size & 0x7FFFFFFF) <= bound;
}
#else
static inline int is_greater(lm_real a, lm_real b) {
  return a > b;
}
static inline int is_within(lm_real value, lm_real most) {
  return absolute(value) <= most;
}
#endif

/* The smaller and the larger of two finite numbers. */
static inline lm_real least(lm_real a, lm_real b) {
  return is_greater(b, a) ? a : b;
}

static inline lm_real greatest(lm_real a, lm_real b) {
  return is_greater(a, b) ? a : b;
}

/* value, or the bound it passes; NaN gives `low`, so that no NaN comes out of finite bounds. */
static inline lm_real clamp(lm_real value, lm_real low, lm_real high) {
  if (!(value > low)) {
    return low;
  }
  return value < high ? value : high;
}

#endif
