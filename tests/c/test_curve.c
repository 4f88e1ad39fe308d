#include "lostmotion/curve.h"

#include "draw.h"
#include "test.h"

/* Rounding of lm_real; bounds below are a few of these. */

/* Harmonic Drive size 20, ratio above 50 (catalogue): T1 7, T2 25 N*m, K 16, 25, 29e3 N*m/rad. */
static const lm_real torque_Nm[] = {-40, -25, -7, 0, 7, 25, 40};
static const lm_real angle_rad[] = {LM_REAL(-7.0 / 16e3 - 18.0 / 25e3 - 15.0 / 29e3),
                                    LM_REAL(-7.0 / 16e3 - 18.0 / 25e3),
                                    LM_REAL(-7.0 / 16e3),
                                    0,
                                    LM_REAL(7.0 / 16e3),
                                    LM_REAL(7.0 / 16e3 + 18.0 / 25e3),
                                    LM_REAL(7.0 / 16e3 + 18.0 / 25e3 + 15.0 / 29e3)};
#define KNOTS 7

static lm_curve curve;
static lm_fault fault;

void setUp(void) {
  seed = 1;
  TEST_ASSERT_EQUAL(LM_OK, lm_build_curve(&curve, torque_Nm, angle_rad, KNOTS, &fault));
}

TEST(the_curve_passes_through_its_knots) {
  int i;
  for (i = 0; i < KNOTS; ++i) {
    TEST_ASSERT_TRUE(distance(lm_evaluate_curve(&curve, torque_Nm[i]), angle_rad[i]) <=
                     4 * ROUNDING * LM_REAL(2e-3));
    TEST_ASSERT_TRUE(distance(lm_invert_curve(&curve, angle_rad[i]), torque_Nm[i]) <=
                     4 * ROUNDING * 40);
  }
}

TEST(between_knots_it_is_straight_and_beyond_them_it_continues) {
  /* phi(T1), phi(T2), phi(2 T2) from the catalogue's piecewise linear torsion. */
  TEST_ASSERT_TRUE(distance(lm_evaluate_curve(&curve, 16), LM_REAL(7.0 / 16e3 + 9.0 / 25e3)) <=
                   8 * ROUNDING * LM_REAL(1e-3));
  TEST_ASSERT_TRUE(
      distance(lm_evaluate_curve(&curve, 50), LM_REAL(7.0 / 16e3 + 18.0 / 25e3 + 25.0 / 29e3)) <=
      16 * ROUNDING * LM_REAL(1e-3));
  TEST_ASSERT_TRUE(distance(lm_evaluate_curve(&curve, -50), -lm_evaluate_curve(&curve, 50)) <=
                   16 * ROUNDING * LM_REAL(1e-3));
}

TEST(the_slope_is_the_segments) {
  TEST_ASSERT_TRUE(distance(lm_evaluate_curve_slope(&curve, 3), LM_REAL(1 / 16e3)) <=
                   LM_REAL(1e-4 / 16e3));
  TEST_ASSERT_TRUE(distance(lm_evaluate_curve_slope(&curve, -9), LM_REAL(1 / 25e3)) <=
                   LM_REAL(1e-4 / 25e3));
  TEST_ASSERT_TRUE(distance(lm_evaluate_curve_slope(&curve, 99), LM_REAL(1 / 29e3)) <=
                   LM_REAL(1e-4 / 29e3));
  TEST_ASSERT_TRUE(distance(lm_evaluate_curve_slope(&curve, -99), LM_REAL(1 / 29e3)) <=
                   LM_REAL(1e-4 / 29e3));
  TEST_ASSERT_TRUE(distance(lm_find_least_slope(&curve), LM_REAL(1 / 29e3)) <=
                   LM_REAL(1e-4 / 29e3));
  TEST_ASSERT_TRUE(distance(lm_find_greatest_slope(&curve), LM_REAL(1 / 16e3)) <=
                   LM_REAL(1e-4 / 16e3));
}

/* Random curves of every size: the search compared with a plain loop through the knots. */
TEST(every_size_finds_its_segment_and_inverts) {
  int count;
  int trial;
  for (count = 2; count <= LM_CURVE_POINTS_MAX; ++count) {
    lm_real t[LM_CURVE_POINTS_MAX];
    lm_real a[LM_CURVE_POINTS_MAX];
    int i;
    t[0] = draw(-50, -40);
    a[0] = draw(LM_REAL(-1e-3), 0);
    for (i = 1; i < count; ++i) {
      t[i] = t[i - 1] + draw(LM_REAL(0.1), 5);
      a[i] = a[i - 1] + draw(LM_REAL(1e-5), LM_REAL(1e-3));
    }
    TEST_ASSERT_EQUAL(LM_OK, lm_build_curve(&curve, t, a, count, &fault));
    TEST_ASSERT_EQUAL(LM_OK, lm_check_curve(&curve, &fault));
    for (trial = 0; trial < 200; ++trial) {
      lm_real torque = draw(t[0] - 5, t[count - 1] + 5);
      lm_real angle = lm_evaluate_curve(&curve, torque);
      lm_real expected;
      int segment = 0;
      while (segment < count - 2 && torque >= t[segment + 1]) {
        ++segment;
      }
      expected = a[segment] + (a[segment + 1] - a[segment]) / (t[segment + 1] - t[segment]) *
                                  (torque - t[segment]);
      TEST_ASSERT_TRUE(distance(angle, expected) <= 16 * ROUNDING * LM_REAL(0.1));
      /* An angle is known to its rounding (0.064 rad at most), the slope is at least 2e-6. */
      TEST_ASSERT_TRUE(distance(lm_invert_curve(&curve, angle), torque) <=
                       ROUNDING * (LM_REAL(0.2) / LM_REAL(2e-6) + 1000));
    }
  }
}

TEST(the_angle_never_falls) {
  lm_real torque;
  lm_real before = lm_evaluate_curve(&curve, -60);
  for (torque = -60; torque < 60; torque += LM_REAL(0.0625)) {
    lm_real now = lm_evaluate_curve(&curve, torque);
    TEST_ASSERT_TRUE(now >= before);
    before = now;
  }
}

TEST(flat_pieces_invert_to_their_upper_end) {
  static const lm_real t[] = {-2, -1, 1, 2};
  static const lm_real inner_flat[] = {-1, 0, 0, 1};
  static const lm_real outer_flat[] = {-1, -1, 1, 1};
  TEST_ASSERT_EQUAL(LM_OK, lm_build_curve(&curve, t, inner_flat, 4, &fault));
  TEST_ASSERT_TRUE(lm_invert_curve(&curve, 0) == 1);
  TEST_ASSERT_EQUAL(LM_OK, lm_build_curve(&curve, t, outer_flat, 4, &fault));
  TEST_ASSERT_TRUE(lm_invert_curve(&curve, 5) == 1);
  TEST_ASSERT_TRUE(lm_invert_curve(&curve, -5) == -2);
  TEST_ASSERT_TRUE(lm_find_least_slope(&curve) == 0);
}

TEST(nonsense_is_refused_by_name) {
  lm_real t[LM_CURVE_POINTS_MAX + 1];
  lm_real a[LM_CURVE_POINTS_MAX + 1];
  lm_real zero = 0;
  lm_real nan = zero / zero;
  int i;
  for (i = 0; i <= LM_CURVE_POINTS_MAX; ++i) {
    t[i] = LM_REAL(i);
    a[i] = LM_REAL(i);
  }
  TEST_ASSERT_EQUAL(LM_NULL, lm_build_curve(0, t, a, 3, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_build_curve(&curve, 0, a, 3, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_build_curve(&curve, t, 0, 3, 0));
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_build_curve(&curve, t, a, 1, &fault));
  TEST_ASSERT_EQUAL_STRING("count", fault.input);
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_build_curve(&curve, t, a, LM_CURVE_POINTS_MAX + 1, &fault));
  t[1] = t[0];
  TEST_ASSERT_EQUAL(LM_NOT_MONOTONE, lm_build_curve(&curve, t, a, 3, &fault));
  TEST_ASSERT_EQUAL_STRING("torque_Nm", fault.input);
  t[1] = nan;
  TEST_ASSERT_EQUAL(LM_NOT_FINITE, lm_build_curve(&curve, t, a, 3, &fault));
  TEST_ASSERT_EQUAL_STRING("torque_Nm", fault.input);
  t[1] = 1;
  a[1] = -1;
  TEST_ASSERT_EQUAL(LM_NOT_MONOTONE, lm_build_curve(&curve, t, a, 3, &fault));
  TEST_ASSERT_EQUAL_STRING("angle_rad", fault.input);
  a[1] = 1 / zero;
  TEST_ASSERT_EQUAL(LM_NOT_FINITE, lm_build_curve(&curve, t, a, 3, &fault));
  TEST_ASSERT_EQUAL_STRING("angle_rad", fault.input);
  /* Finite, but beyond the arithmetic of a step. */
  a[1] = LM_REAL(1.001) * LM_CURVE_ANGLE_MAX_RAD;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_build_curve(&curve, t, a, 3, &fault));
  TEST_ASSERT_EQUAL_STRING("angle_rad", fault.input);
  a[1] = 1;
  t[2] = LM_REAL(1.001) * LM_CURVE_TORQUE_MAX_NM;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_build_curve(&curve, t, a, 3, &fault));
  TEST_ASSERT_EQUAL_STRING("torque_Nm", fault.input);
  t[2] = 2;
  t[1] = LM_REAL(0.99e-9);
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_build_curve(&curve, t, a, 3, &fault));
  TEST_ASSERT_EQUAL_STRING("slope_rad_per_Nm", fault.input);
  t[1] = LM_REAL(1.01e-9);
  a[2] = 1;
  {
    lm_curve steep;
    TEST_ASSERT_EQUAL(LM_OK, lm_build_curve(&steep, t, a, 3, &fault));
  }
  /* Nothing was written by any of the refused calls. */
  TEST_ASSERT_EQUAL(KNOTS, curve.count);
  TEST_ASSERT_EQUAL(LM_OK, lm_check_curve(&curve, &fault));
}

TEST(a_damaged_curve_is_found_out) {
  lm_curve good = curve;
  TEST_ASSERT_EQUAL(LM_NULL, lm_check_curve(0, &fault));
  curve.count = 0;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_check_curve(&curve, &fault));
  curve = good;
  curve.angle_rad[2] = 9;
  TEST_ASSERT_EQUAL(LM_NOT_MONOTONE, lm_check_curve(&curve, &fault));
  curve = good;
  curve.slope_rad_per_Nm[2] *= 2;
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, lm_check_curve(&curve, &fault));
  TEST_ASSERT_EQUAL_STRING("slope_rad_per_Nm", fault.input);
  curve = good;
  curve.torque_Nm[KNOTS] += 1;
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, lm_check_curve(&curve, &fault));
  TEST_ASSERT_EQUAL_STRING("padding", fault.input);
  curve = good;
  curve.angle_rad[LM_CURVE_STORE - 1] += 1;
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, lm_check_curve(&curve, &fault));
}
