/* For ESBMC (prove.sh): for any knots and any argument, NaN included, the search ends on a segment;
 * with rising knots it is the right one. */
#include "lostmotion/curve.h"
#include "runtime/curve_kernel.h"

float nondet_float(void);
int nondet_int(void);
void __ESBMC_assume(_Bool);
void __ESBMC_assert(_Bool, const char *);

int main(void) {
  lm_curve curve;
  float value = nondet_float();
  int found;
  int i;
  curve.count = nondet_int();
  __ESBMC_assume(curve.count >= 2 && curve.count <= LM_CURVE_POINTS_MAX);
  for (i = 0; i < LM_CURVE_STORE; ++i) {
    curve.torque_Nm[i] = nondet_float();
  }
  found = find_segment(&curve, curve.torque_Nm, value);
  __ESBMC_assert(found >= 0 && found <= curve.count - 2, "index range");

  /* As lm_build_curve leaves them: rising, then the last knot again. */
  for (i = 1; i < LM_CURVE_STORE; ++i) {
    __ESBMC_assume(i < curve.count ? curve.torque_Nm[i] > curve.torque_Nm[i - 1]
                                   : curve.torque_Nm[i] == curve.torque_Nm[i - 1]);
  }
  __ESBMC_assume(value == value);
  __ESBMC_assert(found == 0 || curve.torque_Nm[found] <= value, "not above");
  __ESBMC_assert(found == curve.count - 2 || value < curve.torque_Nm[found + 1], "not below");
  return 0;
}
