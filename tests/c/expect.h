/* Expected results of functions of the design model: a value up to rounding, or a refusal. */
#ifndef LOSTMOTION_TESTS_EXPECT_H
#define LOSTMOTION_TESTS_EXPECT_H

#include <math.h>

#include "lostmotion/status.h"
#include "test.h"

#define DEG 0.017453292519943295
#define ARCSEC 4.84813681109536e-6

/* Permitted rounding error of a result: in float32 that of the headers. */
#define ROUNDING (LM_REAL_BITS == 64 ? 1e-13 : 2e-6)

#define NAN_VALUE ((lm_real)NAN)
#define INFINITE ((lm_real)INFINITY)

static lm_fault fault;
static lm_real out;

/* No fault, and a result that no function gives. */
static inline void forget_results(void) {
  fault.status = LM_OK;
  fault.input = "";
  out = LM_REAL(-77);
}

/* Equal within a relative error. */
static inline void close_to(double expected, lm_real found, double relative) {
  const double allowed = (relative > ROUNDING ? relative : ROUNDING) * fabs(expected);
  TEST_ASSERT_DOUBLE_WITHIN(allowed, expected, (double)found);
}

/* A refusal: the status, the input named in the fault, and the same status without a fault. */
#define REFUSED(expected_status, expected_input, call)       \
  do {                                                       \
    lm_fault *fault_or_null = &fault;                        \
    fault.input = "";                                        \
    TEST_ASSERT_EQUAL_INT((expected_status), (call));        \
    TEST_ASSERT_EQUAL_INT((expected_status), fault.status);  \
    TEST_ASSERT_EQUAL_STRING((expected_input), fault.input); \
    fault_or_null = 0;                                       \
    TEST_ASSERT_EQUAL_INT((expected_status), (call));        \
  } while (0)
#define OUTSIDE(input, call) REFUSED(LM_OUT_OF_RANGE, input, call)
#define ACCEPTED(call) TEST_ASSERT_EQUAL_INT(LM_OK, (call))

#endif
