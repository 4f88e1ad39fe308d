#include "lostmotion/status.h"

#include "runtime/no_fast_math.h"

const char *lm_status_sentence(lm_status status) {
  switch (status) {
    case LM_OK:
      return "done";
    case LM_NULL:
      return "a required pointer is null";
    case LM_NOT_FINITE:
      return "an input is not a finite number";
    case LM_OUT_OF_RANGE:
      return "an input is outside its range";
    case LM_INCONSISTENT:
      return "two inputs contradict each other";
    case LM_TOO_SMALL:
      return "the memory given is too small";
    case LM_NOT_MONOTONE:
      return "a sequence that must rise does not";
    case LM_NO_CONTACT:
      return "no pair of teeth can touch";
    case LM_NOT_CONVERGED:
      return "an iteration ended before its tolerance was met";
    case LM_CORRUPT:
      return "stored parameters are damaged or of another format";
    case LM_STATUS_COUNT:
    default:
      return "unknown status";
  }
}

lm_status lm_refuse(lm_fault *fault, lm_status status, const char *input, lm_real found,
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

lm_status lm_check_range(lm_fault *fault, const char *input, lm_real value, lm_real low,
                         lm_real high) {
  if (value >= low && value <= high) {
    return LM_OK;
  }
  /* Infinity less itself and NaN less itself are NaN, which equals nothing. */
  return lm_refuse(fault, value - value == LM_REAL(0) ? LM_OUT_OF_RANGE : LM_NOT_FINITE, input,
                   value, low, high);
}
