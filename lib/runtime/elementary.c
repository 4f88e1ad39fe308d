#include "lostmotion/elementary.h"

#include <string.h>

#include "runtime/number.h"

/* Series are cut where their first neglected term, at the end of the reduced interval,
 * falls below half a rounding of the number type: sine x^11/11! at pi/4 is 1.8e-9 (float),
 * x^17/17! 4.7e-17 (double); cosine x^10/10! 2.5e-8 and x^18/18! 2.1e-18; exponential
 * x^8/8! at ln(2)/2 5.7e-9 and x^14/14! 4.6e-18; 2 artanh s = 2 (s + s^3/3 + ..) with s^11
 * 2/11 at 0.1716 6.9e-10, s^21 8e-18. */
#if LM_REAL_BITS == 64
#define SINE_TERMS 7
#define COSINE_TERMS 8
#define EXPONENTIAL_TERMS 13
#define ARTANH_TERMS 9
/* pi/2 in parts of 33 bits: times a 12-bit count the first two are exact (fdlibm's split). */
#define HALF_PI_1 LM_REAL(1.57079632673412561417e+00)
#define HALF_PI_2 LM_REAL(6.07710050630396597660e-11)
#define HALF_PI_3 LM_REAL(2.02226624879595063154e-21)
/* ln 2 in a part of 32 bits and the rest (fdlibm's split). */
#define LN2_1 LM_REAL(6.93147180369123816490e-01)
#define LN2_2 LM_REAL(1.90821492927058770002e-10)
#else
#define SINE_TERMS 4
#define COSINE_TERMS 4
#define EXPONENTIAL_TERMS 7
#define ARTANH_TERMS 4
/* pi/2 in parts of 8 and 11 bits and the rest (Cephes' split, doubled). */
#define HALF_PI_1 LM_REAL(1.5703125)
#define HALF_PI_2 LM_REAL(4.837512969970703125e-4)
#define HALF_PI_3 LM_REAL(7.54978995489188216e-8)
/* ln 2 in a part of 9 bits and the rest (Cephes' split). */
#define LN2_1 LM_REAL(0.693359375)
#define LN2_2 LM_REAL(-2.12194440e-4)
#endif

#define TWO_OVER_PI LM_REAL(0.63661977236758134308)
#define ONE_OVER_LN2 LM_REAL(1.44269504088896340736)
#define SQRT_2 LM_REAL(1.41421356237309504880)

/* Taylor coefficients: (-1)^k / (2k+1)!, (-1)^k / (2k)!, 1/k!, 1/(2k+1), from k = 1. */
static const lm_real sine_series[SINE_TERMS] = {
    LM_REAL(-1.0 / 6.0),        LM_REAL(1.0 / 120.0),        LM_REAL(-1.0 / 5040.0),
    LM_REAL(1.0 / 362880.0),
#if LM_REAL_BITS == 64
    LM_REAL(-1.0 / 39916800.0), LM_REAL(1.0 / 6227020800.0), LM_REAL(-1.0 / 1307674368000.0),
#endif
};
static const lm_real cosine_series[COSINE_TERMS] = {
    LM_REAL(-1.0 / 2.0),           LM_REAL(1.0 / 24.0),
    LM_REAL(-1.0 / 720.0),         LM_REAL(1.0 / 40320.0),
#if LM_REAL_BITS == 64
    LM_REAL(-1.0 / 3628800.0),     LM_REAL(1.0 / 479001600.0),
    LM_REAL(-1.0 / 87178291200.0), LM_REAL(1.0 / 20922789888000.0),
#endif
};
static const lm_real exponential_series[EXPONENTIAL_TERMS] = {
    LM_REAL(1.0),
    LM_REAL(1.0 / 2.0),
    LM_REAL(1.0 / 6.0),
    LM_REAL(1.0 / 24.0),
    LM_REAL(1.0 / 120.0),
    LM_REAL(1.0 / 720.0),
    LM_REAL(1.0 / 5040.0),
#if LM_REAL_BITS == 64
    LM_REAL(1.0 / 40320.0),
    LM_REAL(1.0 / 362880.0),
    LM_REAL(1.0 / 3628800.0),
    LM_REAL(1.0 / 39916800.0),
    LM_REAL(1.0 / 479001600.0),
    LM_REAL(1.0 / 6227020800.0),
#endif
};
static const lm_real artanh_series[ARTANH_TERMS] = {
    LM_REAL(1.0 / 3.0),  LM_REAL(1.0 / 5.0),  LM_REAL(1.0 / 7.0),  LM_REAL(1.0 / 9.0),
#if LM_REAL_BITS == 64
    LM_REAL(1.0 / 11.0), LM_REAL(1.0 / 13.0), LM_REAL(1.0 / 15.0), LM_REAL(1.0 / 17.0),
    LM_REAL(1.0 / 19.0),
#endif
};

/* x (c[0] + x (c[1] + ..)) */
static lm_real horner(const lm_real *series, int32_t terms, lm_real x) {
  lm_real sum = series[terms - 1];
  int32_t i;
  for (i = terms - 2; i >= 0; --i) {
    sum = series[i] + x * sum;
  }
  return x * sum;
}

/* Nearest whole number of a value known to fit. */
static int32_t nearest(lm_real value) {
  return (int32_t)(value + (value < 0 ? LM_REAL(-0.5) : LM_REAL(0.5)));
}

/* The rest of an angle beyond the nearest whole number of quarter turns. */
typedef struct reduced_angle {
  lm_real rest_rad;
  uint32_t quadrant;
} reduced_angle;

static reduced_angle reduce(lm_real angle_rad) {
  lm_real known_rad =
      (angle_rad >= -LM_TURN_MAX_RAD && angle_rad <= LM_TURN_MAX_RAD) ? angle_rad : 0;
  int32_t quarter = nearest(known_rad * TWO_OVER_PI);
  lm_real count = LM_REAL(quarter);
  reduced_angle reduced;
  reduced.rest_rad = ((known_rad - count * HALF_PI_1) - count * HALF_PI_2) - count * HALF_PI_3;
  reduced.quadrant = (uint32_t)quarter;
  return reduced;
}

static lm_real near_sine(lm_real rest_rad) {
  return rest_rad + rest_rad * horner(sine_series, SINE_TERMS, rest_rad * rest_rad);
}

static lm_real near_cosine(lm_real rest_rad) {
  return 1 + horner(cosine_series, COSINE_TERMS, rest_rad * rest_rad);
}

/* The sine of the angle a whole number of quarter turns further on. */
static lm_real sine_of_quadrant(lm_real angle_rad, uint32_t quarters) {
  reduced_angle reduced = reduce(angle_rad);
  uint32_t quadrant = reduced.quadrant + quarters;
  lm_real result = (quadrant & 1u) ? near_cosine(reduced.rest_rad) : near_sine(reduced.rest_rad);
  return (quadrant & 2u) ? -result : result;
}

lm_real lm_sine(lm_real angle_rad) {
  return sine_of_quadrant(angle_rad, 0);
}

lm_real lm_cosine(lm_real angle_rad) {
  return sine_of_quadrant(angle_rad, 1);
}

lm_sine_cosine lm_sine_and_cosine(lm_real angle_rad) {
  reduced_angle reduced = reduce(angle_rad);
  lm_real sine = near_sine(reduced.rest_rad);
  lm_real cosine = near_cosine(reduced.rest_rad);
  lm_sine_cosine both;
  both.sine = (reduced.quadrant & 1u) ? cosine : sine;
  both.cosine = (reduced.quadrant & 1u) ? sine : cosine;
  both.sine = (reduced.quadrant & 2u) ? -both.sine : both.sine;
  both.cosine = ((reduced.quadrant + 1u) & 2u) ? -both.cosine : both.cosine;
  return both;
}

/* Exponent field and fraction of an IEEE 754 number: the only place that examines bits. */
#if LM_REAL_BITS == 64
typedef uint64_t real_bits;
#define FRACTION_BITS 52
#define EXPONENT_BIAS 1023
#else
typedef uint32_t real_bits;
#define FRACTION_BITS 23
#define EXPONENT_BIAS 127
#endif

static lm_real power_of_two(int32_t exponent) {
  real_bits bits = (real_bits)(exponent + EXPONENT_BIAS) << FRACTION_BITS;
  lm_real value;
  (void)memcpy(&value, &bits, sizeof value);
  return value;
}

/* value = fraction * 2^exponent with 1 <= fraction < 2, for a normal positive value. */
static lm_real split(lm_real value, int32_t *exponent) {
  real_bits bits;
  lm_real fraction;
  (void)memcpy(&bits, &value, sizeof bits);
  *exponent = (int32_t)(bits >> FRACTION_BITS) - EXPONENT_BIAS;
  bits &= ((real_bits)1 << FRACTION_BITS) - 1;
  bits |= (real_bits)EXPONENT_BIAS << FRACTION_BITS;
  (void)memcpy(&fraction, &bits, sizeof fraction);
  return fraction;
}

lm_real lm_exponential(lm_real x) {
  lm_real held = clamp(x, -LM_EXPONENT_MAX, LM_EXPONENT_MAX);
  int32_t exponent = nearest(held * ONE_OVER_LN2);
  lm_real count = LM_REAL(exponent);
  lm_real rest = (held - count * LN2_1) - count * LN2_2;
  return power_of_two(exponent) * (1 + horner(exponential_series, EXPONENTIAL_TERMS, rest));
}

lm_real lm_logarithm(lm_real x) {
  int32_t exponent;
  lm_real fraction = split(clamp(x, LM_LOGARITHM_MIN, LM_LOGARITHM_MAX), &exponent);
  lm_real s;
  lm_real count;
  /* Centred on one, so that the logarithm of numbers near one keeps its digits. */
  if (fraction > SQRT_2) {
    fraction *= LM_REAL(0.5);
    exponent += 1;
  }
  s = (fraction - 1) / (fraction + 1);
  count = LM_REAL(exponent);
  return count * LN2_1 + (count * LN2_2 + 2 * (s + s * horner(artanh_series, ARTANH_TERMS, s * s)));
}

lm_real lm_hyperbolic_tangent(lm_real x) {
  lm_real decay = lm_exponential(-2 * absolute(x));
  lm_real size = (1 - decay) / (1 + decay);
  return x > 0 ? size : -size;
}

lm_real lm_relaxation(lm_real x) {
  /* Below this the difference 1 - e^-x would lose digits that the series about zero keeps. */
  const lm_real small = LM_REAL(0.25);
  return x < small ? -horner(exponential_series, EXPONENTIAL_TERMS, -x) : 1 - lm_exponential(-x);
}

lm_real lm_power(lm_real x, lm_real exponent) {
  return x > 0 ? lm_exponential(exponent * lm_logarithm(x)) : 0;
}
