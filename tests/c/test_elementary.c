#include "lostmotion/elementary.h"

#include <math.h>

#include "test.h"

/* The bounds are those of the header; libm in double is the reference. In double the reference
 * itself has rounding errors (1.1e-16), which the bounds allow for. */
#define IN_DOUBLE (LM_REAL_BITS == 64)

static lm_real nan_of_the_type(void) {
  lm_real zero = 0;
  return zero / zero;
}

static lm_real infinity_of_the_type(void) {
  lm_real zero = 0;
  return 1 / zero;
}

static void assert_within(double found, double expected, double bound) {
  double difference = fabs(found - expected);
  TEST_ASSERT_TRUE_MESSAGE(difference <= bound, "further from libm than the header states");
}

TEST(sine_and_cosine_keep_their_bound) {
  double bound = IN_DOUBLE ? 4e-16 : 1.5e-7;
  int i;
  for (i = -800000; i <= 800000; ++i) {
    /* Small steps near zero, large ones further out; the last is just inside 6400 rad. */
    lm_real x = LM_REAL(i) * LM_REAL(fabs((double)i) < 400000 ? 1.25e-5 : 7.99e-3);
    assert_within((double)lm_sine(x), sin((double)x), bound);
    assert_within((double)lm_cosine(x), cos((double)x), bound);
    TEST_ASSERT_TRUE(lm_sine_and_cosine(x).sine == lm_sine(x));
    TEST_ASSERT_TRUE(lm_sine_and_cosine(x).cosine == lm_cosine(x));
  }
}

TEST(sine_and_cosine_never_leave_their_range_by_more_than_rounding) {
  lm_real top = 1 + (IN_DOUBLE ? LM_REAL(3e-16) : LM_REAL(1.2e-7));
  lm_real x;
  for (x = -10; x < 10; x += LM_REAL(1e-4)) {
    TEST_ASSERT_TRUE(lm_sine(x) <= top && lm_sine(x) >= -top);
    TEST_ASSERT_TRUE(lm_cosine(x) <= top && lm_cosine(x) >= -top);
  }
}

TEST(angles_without_meaning_count_as_zero) {
  lm_real strange[4];
  int i;
  strange[0] = nan_of_the_type();
  strange[1] = infinity_of_the_type();
  strange[2] = -infinity_of_the_type();
  strange[3] = LM_REAL(6401);
  for (i = 0; i < 4; ++i) {
    TEST_ASSERT_TRUE(lm_sine(strange[i]) == 0);
    TEST_ASSERT_TRUE(lm_cosine(strange[i]) == 1);
    TEST_ASSERT_TRUE(lm_sine_and_cosine(strange[i]).sine == 0);
  }
}

TEST(the_exponential_keeps_its_bound) {
  double bound = IN_DOUBLE ? 1e-15 : 2.5e-7;
  int i;
  for (i = -870000; i <= 870000; ++i) {
    lm_real x = LM_REAL(i) * LM_REAL(1e-4);
    double expected;
    x = x > 87 ? 87 : x < -87 ? -87 : x;
    expected = exp((double)x);
    assert_within((double)lm_exponential(x) / expected, 1, bound);
  }
}

TEST(the_exponential_is_held_at_its_ends) {
  TEST_ASSERT_TRUE(lm_exponential(LM_REAL(1e30)) == lm_exponential(87));
  TEST_ASSERT_TRUE(lm_exponential(LM_REAL(-1e30)) == lm_exponential(-87));
  TEST_ASSERT_TRUE(lm_exponential(nan_of_the_type()) == lm_exponential(-87));
  TEST_ASSERT_TRUE(lm_exponential(infinity_of_the_type()) == lm_exponential(87));
  TEST_ASSERT_TRUE(lm_exponential(0) == 1);
}

TEST(the_logarithm_keeps_its_bound) {
  double bound = IN_DOUBLE ? 5e-16 : 2.5e-7;
  int i;
  for (i = -86000; i <= 86000; ++i) {
    lm_real x = LM_REAL(exp(i * 1e-3));
    double expected = log((double)x);
    assert_within((double)lm_logarithm(x), expected, bound * fmax(1, fabs(expected)));
  }
  for (i = -100000; i <= 100000; ++i) {
    lm_real x = 1 + LM_REAL(i) * LM_REAL(9e-6);
    double expected = log((double)x);
    assert_within((double)lm_logarithm(x), expected, bound * fmax(1, fabs(expected)));
  }
  TEST_ASSERT_TRUE(lm_logarithm(1) == 0);
}

TEST(the_logarithm_is_held_at_its_ends) {
  TEST_ASSERT_TRUE(lm_logarithm(0) == lm_logarithm(LM_LOGARITHM_MIN));
  TEST_ASSERT_TRUE(lm_logarithm(-3) == lm_logarithm(LM_LOGARITHM_MIN));
  TEST_ASSERT_TRUE(lm_logarithm(nan_of_the_type()) == lm_logarithm(LM_LOGARITHM_MIN));
  TEST_ASSERT_TRUE(lm_logarithm(infinity_of_the_type()) == lm_logarithm(LM_LOGARITHM_MAX));
}

TEST(the_hyperbolic_tangent_keeps_its_bound) {
  double bound = IN_DOUBLE ? 5e-16 : 2.5e-7;
  int i;
  for (i = -300000; i <= 300000; ++i) {
    lm_real x = LM_REAL(i) * LM_REAL(1e-4);
    assert_within((double)lm_hyperbolic_tangent(x), tanh((double)x), bound);
    TEST_ASSERT_TRUE(lm_hyperbolic_tangent(x) == -lm_hyperbolic_tangent(-x));
  }
  TEST_ASSERT_TRUE(lm_hyperbolic_tangent(infinity_of_the_type()) == 1);
  TEST_ASSERT_TRUE(lm_hyperbolic_tangent(nan_of_the_type()) == -1);
}

TEST(the_relaxation_keeps_its_bound_down_to_the_smallest_steps) {
  double bound = IN_DOUBLE ? 1e-15 : 2.5e-7;
  int i;
  for (i = -3000; i <= 400; ++i) {
    lm_real x = LM_REAL(exp(i * 1e-2));
    assert_within((double)lm_relaxation(x) / -expm1(-(double)x), 1, bound);
  }
  TEST_ASSERT_TRUE(lm_relaxation(0) == 0);
  TEST_ASSERT_TRUE(lm_relaxation(nan_of_the_type()) == 1);
}

TEST(powers_keep_their_bound) {
  double unit = IN_DOUBLE ? 1e-15 : 2e-7;
  int i;
  int k;
  for (i = -2000; i <= 2000; ++i) {
    lm_real x = LM_REAL(exp(i * 1e-2));
    for (k = -6; k <= 6; ++k) {
      lm_real exponent = LM_REAL(k) / 3;
      double expected = pow((double)x, (double)exponent);
      assert_within((double)lm_power(x, exponent) / expected, 1,
                    unit * (1 + 4 * fabs((double)exponent * log((double)x))));
    }
  }
  TEST_ASSERT_TRUE(lm_power(0, -1) == 0);
  TEST_ASSERT_TRUE(lm_power(-1, 2) == 0);
  TEST_ASSERT_TRUE(lm_power(nan_of_the_type(), 2) == 0);
}
