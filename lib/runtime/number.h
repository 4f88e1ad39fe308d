/* The few operations on numbers that the whole runtime shares, without libm. */
#ifndef LOSTMOTION_RUNTIME_NUMBER_H
#define LOSTMOTION_RUNTIME_NUMBER_H

#include <stdint.h>

#include "lostmotion/real.h"
#include "lostmotion/status.h"

/* Infinity less itself and NaN less itself are NaN, which equals nothing. */
static inline int is_finite(lm_real value) {
  return value - value == 0;
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

static inline lm_real least(lm_real a, lm_real b) {
  return a < b ? a : b;
}

static inline lm_real greatest(lm_real a, lm_real b) {
  return a > b ? a : b;
}

/* value, or the bound it passes; NaN gives `low`, so that no NaN comes out of finite bounds. */
static inline lm_real clamp(lm_real value, lm_real low, lm_real high) {
  lm_real floored = value > low ? value : low;
  return floored < high ? floored : high;
}

/* Fills the caller's fault, if there is one, and hands back the status. */
static inline lm_status refuse(lm_fault *fault, lm_status status, const char *input, lm_real found,
                               lm_real low, lm_real high) {
  if (fault) {
    fault->status = status;
    fault->input = input;
    fault->found = found;
    fault->low = low;
    fault->high = high;
  }
  return status;
}

/* LM_OK when low <= value <= high; NaN and infinity are told apart from a number out of range. */
static inline lm_status check_range(lm_fault *fault, const char *input, lm_real value, lm_real low,
                                    lm_real high) {
  if (value >= low && value <= high) {
    return LM_OK;
  }
  return refuse(fault, is_finite(value) ? LM_OUT_OF_RANGE : LM_NOT_FINITE, input, value, low, high);
}

#endif
