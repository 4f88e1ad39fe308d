/* For ESBMC (prove.sh): for any bits, NaN and infinity included, the integers that sine,
 * exponential and logarithm count with stay in range, so no conversion is undefined and no power of
 * two leaves the format. */
#include "runtime/elementary.c"

float nondet_float(void);
void __ESBMC_assert(_Bool, const char *);

int main(void) {
  float x = nondet_float();
  float held = clamp(x, -LM_EXPONENT_MAX, LM_EXPONENT_MAX);
  float known = (x >= -LM_TURN_MAX_RAD && x <= LM_TURN_MAX_RAD) ? x : 0.0f;
  int32_t exponent = 0;
  __ESBMC_assert(held >= -LM_EXPONENT_MAX && held <= LM_EXPONENT_MAX, "exponential's argument");
  __ESBMC_assert(known >= -LM_TURN_MAX_RAD && known <= LM_TURN_MAX_RAD, "sine's argument");
  __ESBMC_assert(nearest(held * ONE_OVER_LN2) >= -126 && nearest(held * ONE_OVER_LN2) <= 126,
                 "power of two");
  __ESBMC_assert(nearest(known * TWO_OVER_PI) >= -4096 && nearest(known * TWO_OVER_PI) <= 4096,
                 "quarter turns");
  (void)split(clamp(x, LM_LOGARITHM_MIN, LM_LOGARITHM_MAX), &exponent);
  __ESBMC_assert(exponent >= -126 && exponent <= 127, "logarithm's exponent");
  return 0;
}
