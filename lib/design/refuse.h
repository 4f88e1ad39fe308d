/* Refusals of an input by the design model: fill the caller's fault and return the status. */
#ifndef LOSTMOTION_DESIGN_REFUSE_H
#define LOSTMOTION_DESIGN_REFUSE_H

#include "lostmotion/status.h"
#include "real_math.h"

/* Refuse without a range (null pointers, contradictions). */
static inline lm_status refuse(lm_fault *fault, lm_status status, const char *input) {
  return lm_refuse(fault, status, input, LM_REAL(0), LM_REAL(0), LM_REAL(0));
}

/* Refuse a number and state the expected range. */
static inline lm_status refuse_range(lm_fault *fault, const char *input, lm_real found, lm_real low,
                                     lm_real high) {
  const lm_status status = real_isfinite(found) ? LM_OUT_OF_RANGE : LM_NOT_FINITE;
  return lm_refuse(fault, status, input, found, low, high);
}

/* LM_OK if low <= found <= high; never for NaN. */
static inline lm_status check_range(lm_fault *fault, const char *input, lm_real found, lm_real low,
                                    lm_real high) {
  if (found >= low && found <= high) {
    return LM_OK;
  }
  return refuse_range(fault, input, found, low, high);
}

#define COUNT_OF(array) ((int)(sizeof(array) / sizeof((array)[0])))

/* An input and its range. */
typedef struct bound {
  const char *input;
  lm_real found;
  lm_real low;
  lm_real high;
} bound;

/* The first value outside its range decides. */
static inline lm_status check_bounds(lm_fault *fault, const bound *bounds, int count) {
  int i = 0;
  for (i = 0; i < count; ++i) {
    const lm_status status =
        check_range(fault, bounds[i].input, bounds[i].found, bounds[i].low, bounds[i].high);
    if (status != LM_OK) {
      return status;
    }
  }
  return LM_OK;
}

/* Refuse a value that contradicts another one, and state the consistent value. */
static inline lm_status refuse_contradiction(lm_fault *fault, const char *input, lm_real found,
                                             lm_real low, lm_real high) {
  return lm_refuse(fault, LM_INCONSISTENT, input, found, low, high);
}

/* Refuse an array that is too short for its content. */
static inline lm_status refuse_capacity(lm_fault *fault, const char *input, int found, int needed) {
  if (fault != 0) {
    fault->status = LM_TOO_SMALL;
    fault->input = input;
    fault->found = LM_REAL(found);
    fault->low = LM_REAL(needed);
    fault->high = REAL_INFINITY;
  }
  return LM_TOO_SMALL;
}

#endif
