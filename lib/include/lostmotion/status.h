/* Error codes, and the input that caused an error. */
#ifndef LOSTMOTION_STATUS_H
#define LOSTMOTION_STATUS_H

#include "lostmotion/real.h"

LM_BEGIN_DECLS

/* Returned by every function that checks its inputs. On an error no output has been written except
 * the fault (lm_load_parameters fills its struct while it reads). */
typedef enum lm_status {
  LM_OK = 0,
  LM_NULL = 1,          /* a required pointer is null */
  LM_NOT_FINITE = 2,    /* an input is NaN or infinite */
  LM_OUT_OF_RANGE = 3,  /* an input lies outside its stated range */
  LM_INCONSISTENT = 4,  /* two inputs contradict each other */
  LM_TOO_SMALL = 5,     /* the caller's array or workspace is too small */
  LM_NOT_MONOTONE = 6,  /* a sequence that must rise does not */
  LM_NO_CONTACT = 7,    /* no pair of teeth can touch */
  LM_NOT_CONVERGED = 8, /* a bounded iteration ended before its tolerance was met */
  LM_CORRUPT = 9,       /* stored parameters are damaged or of another format */
  LM_STATUS_COUNT = 10
} lm_status;

/* The input that was refused: its name as in the header or drive file, the value found and the
 * range expected (low = high = 0 if there is no range). `input` points to constant text and is
 * never freed. */
typedef struct lm_fault {
  lm_status status;
  const char *input;
  lm_real found;
  lm_real low;
  lm_real high;
} lm_fault;

/* Returns a sentence that describes a status; never null. Values outside the enumeration give
 * "unknown status". */
const char *lm_status_sentence(lm_status status);

/* Fills the caller's fault, which may be null, and returns the status. */
lm_status lm_refuse(lm_fault *fault, lm_status status, const char *input, lm_real found,
                    lm_real low, lm_real high);

/* Returns LM_OK if low <= value <= high; otherwise fills the fault and returns LM_OUT_OF_RANGE, or
 * LM_NOT_FINITE for NaN and infinity. */
lm_status lm_check_range(lm_fault *fault, const char *input, lm_real value, lm_real low,
                         lm_real high);

LM_END_DECLS

#endif
