/* What can go wrong, and which input was at fault. */
#ifndef LOSTMOTION_STATUS_H
#define LOSTMOTION_STATUS_H

#include "lostmotion/real.h"

LM_BEGIN_DECLS

/* Every function that can be given nonsense returns one of these. On anything but LM_OK no output
 * has been written, except the fault (lm_load_parameters fills its struct as it reads). */
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

/* The input that was refused: its name as in the header or drive file, what was found and the
 * range that was expected (low = high = 0 where there is no range). `input` points to constant
 * text and is never freed. */
typedef struct lm_fault {
  lm_status status;
  const char *input;
  lm_real found;
  lm_real low;
  lm_real high;
} lm_fault;

/* One sentence for a status; never null. Values outside the enumeration give "unknown status". */
const char *lm_status_sentence(lm_status status);

/* Fills the caller's fault, if there is one (fault may be null), and hands back the status. */
lm_status lm_refuse(lm_fault *fault, lm_status status, const char *input, lm_real found,
                    lm_real low, lm_real high);

/* LM_OK when low <= value <= high; else refuses: LM_OUT_OF_RANGE, or LM_NOT_FINITE for NaN and
 * infinity. */
lm_status lm_check_range(lm_fault *fault, const char *input, lm_real value, lm_real low,
                         lm_real high);

LM_END_DECLS

#endif
