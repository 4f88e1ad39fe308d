/* Search and evaluation of the curve, inlined in the control loop functions. */
#ifndef LOSTMOTION_RUNTIME_CURVE_KERNEL_H
#define LOSTMOTION_RUNTIME_CURVE_KERNEL_H

#include "lostmotion/curve.h"
#include "runtime/number.h"

/* Segment of the last entry that is not above the value; 0 where all are.  The last knot starts no
 * segment: counted from it, results beyond it would differ in the last bit between builds that
 * hold more knots and builds that hold fewer. The steps are halves of the number of segments down
 * to one, written out because compilers keep the loop; they sum up to the number of segments less
 * one, so the index cannot leave the array. */
static inline int32_t find_segment(const lm_curve *curve, const lm_real *rising, lm_real value) {
  const lm_real *at = rising;
  int32_t found;
#if LM_CURVE_STORE > 33
  if (!is_greater(at[32], value)) {
    at += 32;
  }
#endif
#if LM_CURVE_STORE > 17
  if (!is_greater(at[16], value)) {
    at += 16;
  }
#endif
  if (!is_greater(at[8], value)) {
    at += 8;
  }
  if (!is_greater(at[4], value)) {
    at += 4;
  }
  if (!is_greater(at[2], value)) {
    at += 2;
  }
  if (!is_greater(at[1], value)) {
    at += 1;
  }
  found = (int32_t)(at - rising);
  return found < curve->count - 2 ? found : curve->count - 2;
}

static inline lm_real evaluate_curve(const lm_curve *curve, lm_real torque_Nm) {
  int32_t at = find_segment(curve, curve->torque_Nm, torque_Nm);
  return curve->angle_rad[at] + curve->slope_rad_per_Nm[at] * (torque_Nm - curve->torque_Nm[at]);
}

/* As a function, where size has priority over speed. */
#if defined(__OPTIMIZE_SIZE__)
#define EVALUATE_CURVE lm_evaluate_curve
#else
#define EVALUATE_CURVE evaluate_curve
#endif

#endif
