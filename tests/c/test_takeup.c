#include "lostmotion/takeup.h"

#include "reference_drives.h"
#include "test.h"

#define NMM_PER_NM LM_REAL(1000)

static lm_contact contacts[LM_CONTACTS_MAX];
static lm_foundation foundation;
static lm_take_up_workspace workspace;
static lm_rest rest;
static lm_fault fault;
static uint32_t seed;
static int count;

void setUp(void) {
  seed = 1;
  count = 0;
  memset(&foundation, 0, sizeof foundation);
  foundation.sections = 1;
  foundation.lobes = 1;
}

/* --- eq (1) --- */

TEST(stage_increments_add_up_to_the_gaps_in_rising_order) {
  lm_real clearance[40];
  lm_real radius[40];
  lm_real increment[40];
  int order[40];
  int seen[40] = {0};
  double reached = 0;
  int i;
  for (i = 0; i < 40; i++) {
    clearance[i] = LM_REAL(draw(&seed, -0.01, 0.05));
    radius[i] = LM_REAL(draw(&seed, 24, 26));
  }
  TEST_ASSERT_EQUAL(LM_OK, lm_stage_increments(clearance, radius, 40, increment, order, &fault));
  for (i = 0; i < 40; i++) {
    reached += (double)increment[i];
    seen[order[i]]++;
    ASSERT_NEAR(BOUND(1e-17, 1e-9), clearance[order[i]] / radius[order[i]], reached);
    TEST_ASSERT_TRUE(i == 0 || increment[i] >= 0);
  }
  for (i = 0; i < 40; i++) {
    TEST_ASSERT_EQUAL(1, seen[i]);
  }
}

/* Eq (1) as intended in the paper: j 10, 30, 20 um on 25 mm close at .4, .8, 1.2e-3 rad, not at
 * their sum. */
TEST(stage_increments_are_what_remains_of_a_clearance) {
  const lm_real clearance[] = {LM_REAL(0.01), LM_REAL(0.03), LM_REAL(0.02)};
  const lm_real radius[] = {25, 25, 25};
  lm_real increment[3];
  int order[3];
  TEST_ASSERT_EQUAL(LM_OK, lm_stage_increments(clearance, radius, 3, increment, order, 0));
  ASSERT_NEAR(1e-10, 0.4e-3, increment[0]);
  ASSERT_NEAR(1e-10, 0.4e-3, increment[1]);
  ASSERT_NEAR(1e-10, 0.4e-3, increment[2]);
  TEST_ASSERT_EQUAL(0, order[0]);
  TEST_ASSERT_EQUAL(2, order[1]);
  TEST_ASSERT_EQUAL(1, order[2]);
}

TEST(pairs_with_equal_gaps_keep_their_order) {
  const lm_real clearance[] = {2, 1, 2, 1};
  const lm_real radius[] = {1, 1, 1, 1};
  const int expected[] = {1, 3, 0, 2};
  lm_real increment[4];
  int order[4];
  TEST_ASSERT_EQUAL(LM_OK, lm_stage_increments(clearance, radius, 4, increment, order, &fault));
  TEST_ASSERT_EQUAL_INT_ARRAY(expected, order, 4);
  ASSERT_NEAR(0, 1, increment[0]);
  ASSERT_NEAR(0, 0, increment[1]);
  ASSERT_NEAR(0, 1, increment[2]);
  ASSERT_NEAR(0, 0, increment[3]);
}

static void assert_refused(lm_status expected, const char *input, lm_status found) {
  TEST_ASSERT_EQUAL(expected, found);
  TEST_ASSERT_EQUAL(expected, fault.status);
  TEST_ASSERT_EQUAL_STRING(input, fault.input);
}

/* The same with the number that was found and the range that was expected. */
static void assert_refused_range(lm_status expected, const char *input, lm_real value, lm_real low,
                                 lm_real high, lm_status found) {
  assert_refused(expected, input, found);
  TEST_ASSERT_TRUE(fault.found == value || (isnan(fault.found) && isnan(value)));
  TEST_ASSERT_TRUE(fault.low == low);
  TEST_ASSERT_TRUE(fault.high == high);
}

TEST(stage_increments_refuse_nonsense_and_write_nothing) {
  lm_real clearance[2] = {1, 2};
  lm_real radius[2] = {1, 1};
  lm_real increment[2] = {-7, -7};
  int order[2] = {-7, -7};
  const lm_real least = LM_REAL(1e-3);
  const lm_real most = LM_REAL(1e6);
  const char *pointers = "clearance_mm, radius_mm, increment_rad, order";
  const lm_real nan = LM_REAL(NAN);
  const lm_real inf = LM_REAL(INFINITY);
  assert_refused(LM_NULL, pointers, lm_stage_increments(0, radius, 2, increment, order, &fault));
  assert_refused(LM_NULL, pointers, lm_stage_increments(clearance, 0, 2, increment, order, &fault));
  assert_refused(LM_NULL, pointers, lm_stage_increments(clearance, radius, 2, 0, order, &fault));
  assert_refused(LM_NULL, pointers,
                 lm_stage_increments(clearance, radius, 2, increment, 0, &fault));
  assert_refused_range(LM_OUT_OF_RANGE, "count", 0, 1, 1284,
                       lm_stage_increments(clearance, radius, 0, increment, order, &fault));
  assert_refused_range(LM_OUT_OF_RANGE, "count", 1285, 1, 1284,
                       lm_stage_increments(clearance, radius, 1285, increment, order, &fault));
  clearance[1] = nan;
  assert_refused_range(LM_NOT_FINITE, "clearance_mm", nan, -most, most,
                       lm_stage_increments(clearance, radius, 2, increment, order, &fault));
  clearance[1] = 2;
  radius[1] = 0;
  assert_refused_range(LM_OUT_OF_RANGE, "radius_mm", 0, least, most,
                       lm_stage_increments(clearance, radius, 2, increment, order, &fault));
  radius[1] = inf;
  assert_refused_range(LM_NOT_FINITE, "radius_mm", inf, least, most,
                       lm_stage_increments(clearance, radius, 2, increment, order, &fault));
  radius[1] = nan;
  TEST_ASSERT_EQUAL(LM_NOT_FINITE, lm_stage_increments(clearance, radius, 2, increment, order, 0));
  TEST_ASSERT_TRUE(increment[0] == -7 && increment[1] == -7 && order[0] == -7 && order[1] == -7);
}

/* --- independent pairs --- */

static void put_spring(lm_spring *spring, double stiffness, double gap, int side) {
  spring->stiffness_Nm_per_rad = LM_REAL(stiffness);
  spring->gap_rad = LM_REAL(gap);
  spring->side = side;
}

/* check_values.md, take-up: gaps 0, 1e-4, 3e-4 rad and 1, 2, 3 kN m/rad give the angles below;
 * events at 0.1 and 0.7 N m, where the rotation is the next gap exactly. The springs are not
 * sorted.
 */
TEST(the_springs_of_the_specification) {
  static const double torque[] = {0.05, 0.1, 0.4, 0.7, 1.0};
  static const double angle[] = {5e-5, 1e-4, 2e-4, 3e-4, 3.5e-4};
  static const int carrying[] = {1, 1, 2, 2, 3};
  int side;
  int i;
  for (side = -1; side <= 1; side += 2) {
    for (i = 0; i < 5; i++) {
      lm_spring springs[3];
      lm_real found = 0;
      int engaged = 0;
      put_spring(&springs[0], 3000, 3e-4, side);
      put_spring(&springs[1], 1000, 0, side);
      put_spring(&springs[2], 2000, 1e-4, side);
      TEST_ASSERT_EQUAL(LM_OK, lm_independent_take_up(springs, 3, LM_REAL(side * torque[i]), &found,
                                                      &engaged, &fault));
      ASSERT_NEAR(BOUND(1e-18, 1e-10), side * angle[i], found);
      if (i != 1 && i != 3) { /* at the event either count is correct */
        TEST_ASSERT_EQUAL(carrying[i], engaged);
      }
    }
  }
}

/* The definition: T(phi) = sum K (phi - g+)_+ - sum K (-phi - g-)_+. */
static double torque_of_springs(const lm_spring springs[], int n, double phi) {
  double sum = 0;
  int i;
  for (i = 0; i < n; i++) {
    const double closed = springs[i].side * phi - (double)springs[i].gap_rad;
    sum += closed > 0 ? springs[i].side * (double)springs[i].stiffness_Nm_per_rad * closed : 0;
  }
  return sum;
}

static void random_springs(lm_spring springs[], int n, double low, double high) {
  int i;
  for (i = 0; i < n; i++) {
    put_spring(&springs[i], draw(&seed, 1e3, 1e4), draw(&seed, low, high), i % 2 == 0 ? 1 : -1);
  }
}

TEST(springs_carry_the_torque_that_was_asked) {
  lm_spring springs[31];
  lm_real angle;
  lm_real before = 0;
  int engaged;
  int round;
  int i;
  for (round = 0; round < 50; round++) {
    const double lowest = round % 2 == 0 ? -2e-4 : 2e-5;
    random_springs(springs, 31, lowest, 1e-3);
    for (i = -20; i <= 20; i++) {
      const double torque = 0.5 * i;
      TEST_ASSERT_EQUAL(
          LM_OK, lm_independent_take_up(springs, 31, LM_REAL(torque), &angle, &engaged, &fault));
      ASSERT_NEAR(BOUND(1e-12, 2e-4), torque, torque_of_springs(springs, 31, (double)angle));
      TEST_ASSERT_TRUE(i == -20 || angle > before);
      TEST_ASSERT_TRUE(engaged >= 1 || (i == 0 && round % 2 == 1));
      before = angle;
    }
  }
}

/* Eq (1) results: at the torque of an event the rotation is the next gap, for any stiffnesses.
 */
TEST(at_an_event_the_rotation_is_the_next_gap) {
  lm_spring springs[12];
  lm_real angle;
  int engaged;
  int i;
  random_springs(springs, 12, 1e-5, 1e-3);
  for (i = 0; i < 12; i++) {
    springs[i].side = 1;
  }
  for (i = 0; i < 12; i++) {
    const lm_real gap = springs[i].gap_rad;
    const double torque = torque_of_springs(springs, 12, (double)gap);
    TEST_ASSERT_EQUAL(
        LM_OK, lm_independent_take_up(springs, 12, LM_REAL(torque), &angle, &engaged, &fault));
    ASSERT_NEAR(BOUND(1e-16, 1e-9), gap, angle);
  }
}

TEST(springs_rest_in_the_middle_of_their_play) {
  lm_spring springs[4];
  lm_real angle;
  int engaged;
  put_spring(&springs[0], 1000, 3e-4, 1);
  put_spring(&springs[1], 1000, 5e-4, 1);
  put_spring(&springs[2], 1000, 1e-4, -1);
  put_spring(&springs[3], 1000, 2e-4, -1);
  TEST_ASSERT_EQUAL(LM_OK, lm_independent_take_up(springs, 4, 0, &angle, &engaged, &fault));
  ASSERT_NEAR(BOUND(1e-18, 1e-10), 1e-4, angle);
  TEST_ASSERT_EQUAL(0, engaged);
  TEST_ASSERT_EQUAL(LM_OK,
                    lm_independent_take_up(springs, 4, LM_REAL(0.01), &angle, &engaged, &fault));
  ASSERT_NEAR(BOUND(1e-17, 1e-9), 3e-4 + 1e-5, angle);
  TEST_ASSERT_EQUAL(1, engaged);
  TEST_ASSERT_EQUAL(LM_OK,
                    lm_independent_take_up(springs, 4, LM_REAL(-0.01), &angle, &engaged, &fault));
  ASSERT_NEAR(BOUND(1e-17, 1e-9), -1e-4 - 1e-5, angle);
  TEST_ASSERT_EQUAL(1, engaged);
}

/* Preload 1e-4 rad: both flanks carry until one lifts off at 2 K 1e-4 = 0.2 N m. */
TEST(preloaded_springs_are_twice_as_stiff_until_one_lifts_off) {
  static const double torque[] = {-0.3, -0.1, 0, 0.1, 0.2, 0.3};
  static const double angle[] = {-2e-4, -0.5e-4, 0, 0.5e-4, 1e-4, 2e-4};
  lm_spring springs[2];
  lm_real found;
  int engaged;
  int i;
  put_spring(&springs[0], 1000, -1e-4, 1);
  put_spring(&springs[1], 1000, -1e-4, -1);
  for (i = 0; i < 6; i++) {
    TEST_ASSERT_EQUAL(
        LM_OK, lm_independent_take_up(springs, 2, LM_REAL(torque[i]), &found, &engaged, &fault));
    ASSERT_NEAR(BOUND(1e-18, 1e-10), angle[i], found);
  }
}

/* Springs push; none may pull. */
TEST(springs_of_one_side_carry_only_its_torque) {
  int n;
  for (n = 1; n <= 3; n++) {
    int side;
    for (side = -1; side <= 1; side += 2) {
      lm_spring springs[3];
      lm_real angle = 7;
      int engaged = 7;
      int i;
      for (i = 0; i < n; i++) {
        put_spring(&springs[i], 1000, 1e-4 * (i + 1), side);
      }
      assert_refused(LM_NO_CONTACT, "springs",
                     lm_independent_take_up(springs, n, LM_REAL(-side), &angle, &engaged, &fault));
      TEST_ASSERT_TRUE(angle == 7 && engaged == 7);
      TEST_ASSERT_EQUAL(LM_OK, lm_independent_take_up(springs, n, LM_REAL(side * 0.01), &angle,
                                                      &engaged, &fault));
      ASSERT_NEAR(BOUND(1e-17, 1e-10), side * 1.1e-4, angle);
      TEST_ASSERT_EQUAL(LM_OK, lm_independent_take_up(springs, n, 0, &angle, &engaged, &fault));
      ASSERT_NEAR(BOUND(1e-17, 1e-10), side * 1e-4, angle);
    }
  }
}

/* For any small torque the flank that it closes carries it: rounding must not move the springs
 * across their play. */
TEST(the_smallest_torque_keeps_to_its_side_of_the_play) {
  int round;
  for (round = 0; round < 200; round++) {
    lm_spring springs[24];
    lm_real angle;
    int engaged;
    random_springs(springs, 24, 1e-4, 1e-3);
    TEST_ASSERT_EQUAL(LM_OK, lm_independent_take_up(springs, 24, -LM_REAL(BOUND(1e-25, 1e-20)),
                                                    &angle, &engaged, &fault));
    TEST_ASSERT_TRUE(angle < 0);
    TEST_ASSERT_EQUAL(LM_OK, lm_independent_take_up(springs, 24, LM_REAL(BOUND(1e-25, 1e-20)),
                                                    &angle, &engaged, &fault));
    TEST_ASSERT_TRUE(angle > 0);
  }
}

/* Both flanks of both lobes of the largest drive. */
TEST(as_many_springs_as_a_drive_has_are_accepted) {
  static lm_spring springs[1284];
  static lm_real clearance[1284];
  static lm_real radius[1284];
  static lm_real increment[1284];
  static int order[1284];
  lm_real angle;
  int engaged;
  int i;
  for (i = 0; i < 1284; i++) {
    put_spring(&springs[i], 1000, 1e-7 * (1284 - i), 1);
    clearance[i] = LM_REAL(1284 - i);
    radius[i] = 1;
  }
  TEST_ASSERT_EQUAL(LM_OK, lm_independent_take_up(springs, 1284, 1000, &angle, &engaged, &fault));
  TEST_ASSERT_EQUAL(1284, engaged);
  TEST_ASSERT_EQUAL(LM_OK, lm_stage_increments(clearance, radius, 1284, increment, order, &fault));
  TEST_ASSERT_EQUAL(1283, order[0]);
}

TEST(springs_refuse_nonsense_and_write_nothing) {
  const lm_real nan = LM_REAL(NAN);
  const lm_real inf = LM_REAL(INFINITY);
  const lm_real most = LM_REAL(1e9);
  const lm_real soft = LM_REAL(1e-9);
  const lm_real stiff = LM_REAL(1e15);
  lm_spring springs[2];
  lm_real angle = -7;
  int engaged = -7;
  put_spring(&springs[0], 1000, 1e-4, 1);
  put_spring(&springs[1], 1000, 1e-4, -1);
#define TAKE_UP(n, torque) lm_independent_take_up(springs, n, torque, &angle, &engaged, &fault)
  assert_refused(LM_NULL, "springs, angle_rad, engaged",
                 lm_independent_take_up(0, 2, 1, &angle, &engaged, &fault));
  assert_refused(LM_NULL, "springs, angle_rad, engaged",
                 lm_independent_take_up(springs, 2, 1, 0, &engaged, &fault));
  assert_refused(LM_NULL, "springs, angle_rad, engaged",
                 lm_independent_take_up(springs, 2, 1, &angle, 0, &fault));
  assert_refused_range(LM_OUT_OF_RANGE, "count", 0, 1, 1284, TAKE_UP(0, 1));
  assert_refused_range(LM_OUT_OF_RANGE, "count", 1285, 1, 1284, TAKE_UP(1285, 1));
  assert_refused_range(LM_NOT_FINITE, "torque_Nm", nan, -most, most, TAKE_UP(2, nan));
  assert_refused_range(LM_NOT_FINITE, "torque_Nm", -inf, -most, most, TAKE_UP(2, -inf));
  springs[1].stiffness_Nm_per_rad = 0;
  assert_refused_range(LM_OUT_OF_RANGE, "stiffness_Nm_per_rad", 0, soft, stiff, TAKE_UP(2, 1));
  springs[1].stiffness_Nm_per_rad = inf;
  assert_refused_range(LM_NOT_FINITE, "stiffness_Nm_per_rad", inf, soft, stiff, TAKE_UP(2, 1));
  springs[1].stiffness_Nm_per_rad = nan;
  assert_refused_range(LM_NOT_FINITE, "stiffness_Nm_per_rad", nan, soft, stiff, TAKE_UP(2, 1));
  springs[1].stiffness_Nm_per_rad = 1000;
  springs[1].gap_rad = inf;
  assert_refused_range(LM_NOT_FINITE, "gap_rad", inf, -LM_PI, LM_PI, TAKE_UP(2, 1));
  springs[1].gap_rad = 0;
  springs[1].side = 0;
  assert_refused_range(LM_OUT_OF_RANGE, "side", 0, -1, 1, TAKE_UP(2, 1));
#undef TAKE_UP
  TEST_ASSERT_TRUE(angle == -7 && engaged == -7);
}

/* --- the beam under the rim --- */

/* check_values.md, coupled teeth: lambda = (2600 / (4 * 3.5e5))^(1/4), deflection under the force
 * lambda / (2 k_f). The foundation carries the whole force: k_f times the integral is 1. */
TEST(the_foundation_carries_the_whole_force) {
  lm_real yield[LM_LOBE_TEETH_MAX];
  const double lambda = pow(2600 / 1.4e6, 0.25);
  const double spacing = 0.4;
  double sum;
  int i;
  TEST_ASSERT_EQUAL(LM_OK, lm_beam_yield(LM_REAL(2600), LM_REAL(3.5e5), LM_REAL(spacing), 1,
                                         LM_LOBE_TEETH_MAX, yield, &fault));
  ASSERT_NEAR(BOUND(1e-18, 1e-11), lambda / 5200, yield[0]);
  sum = (double)yield[0];
  for (i = 1; i < LM_LOBE_TEETH_MAX; i++) {
    sum += 2 * (double)yield[i];
  }
  ASSERT_NEAR(1e-4, 1, 2600 * spacing * sum);
  ASSERT_NEAR(1e-9, 0, yield[LM_LOBE_TEETH_MAX - 1]);
}

/* E I y'''' + k_f y = 0 away from the force, by central differences. */
TEST(the_rim_bends_as_a_beam) {
  lm_real y[7];
  double fourth;
  if (LM_REAL_BITS == 32) {
    return; /* fourth differences have no correct digits */
  }
  TEST_ASSERT_EQUAL(LM_OK, lm_beam_yield(LM_REAL(2600), LM_REAL(3.5e5), LM_REAL(0.2), LM_REAL(7.88),
                                         7, y, &fault));
  fourth = (double)(y[6] - 4 * y[5] + 6 * y[4] - 4 * y[3] + y[2]) / (0.2 * 0.2 * 0.2 * 0.2);
  ASSERT_NEAR(2e-3 * 2600 * (double)y[4], -2600 * (double)y[4], 3.5e5 * fourth);
}

TEST(the_beam_refuses_nonsense_and_writes_nothing) {
  const lm_real nan = LM_REAL(NAN);
  const lm_real small = LM_REAL(1e-12);
  const lm_real large = LM_REAL(1e15);
  lm_real yield[2] = {-7, -7};
  assert_refused(LM_NULL, "yield_mm_per_N", lm_beam_yield(1, 1, 1, 1, 2, 0, &fault));
  assert_refused_range(LM_OUT_OF_RANGE, "support.foundation_N_per_mm2", 0, small, large,
                       lm_beam_yield(0, 1, 1, 1, 2, yield, &fault));
  assert_refused_range(LM_OUT_OF_RANGE, "support.ring_stiffness_N_mm2", -1, small, large,
                       lm_beam_yield(1, -1, 1, 1, 2, yield, &fault));
  assert_refused_range(LM_NOT_FINITE, "spacing_mm", nan, small, large,
                       lm_beam_yield(1, 1, nan, 1, 2, yield, &fault));
  assert_refused_range(LM_OUT_OF_RANGE, "support.ring_factor", -1, 0, LM_REAL(1e6),
                       lm_beam_yield(1, 1, 1, -1, 2, yield, &fault));
  assert_refused_range(LM_OUT_OF_RANGE, "teeth", 0, 1, LM_LOBE_TEETH_MAX,
                       lm_beam_yield(1, 1, 1, 1, 0, yield, &fault));
  assert_refused_range(LM_OUT_OF_RANGE, "teeth", LM_LOBE_TEETH_MAX + 1, 1, LM_LOBE_TEETH_MAX,
                       lm_beam_yield(1, 1, 1, 1, LM_LOBE_TEETH_MAX + 1, yield, &fault));
  TEST_ASSERT_TRUE(yield[0] == -7 && yield[1] == -7);
}

/* --- coupled pairs against the definition --- */

#define PAIRS_MAX 40

static void put_contact(double arm, double wedge, double gap, double compliance, int tooth,
                        int side) {
  lm_contact *c = &contacts[count++];
  c->arm_mm = LM_REAL(arm);
  c->wedge = LM_REAL(wedge);
  c->gap_rad = LM_REAL(gap);
  c->compliance_mm_per_N = LM_REAL(compliance);
  c->tooth = tooth;
  c->lobe = 0;
  c->section = 0;
  c->side = side;
}

static double radial_give(const lm_contact *a, const lm_contact *b) {
  const int apart = abs(a->tooth - b->tooth);
  return a->lobe == b->lobe
             ? (double)a->wedge * (double)b->wedge * (double)foundation.yield_mm_per_N[apart]
             : 0;
}

static double twist_give(const lm_contact *a, const lm_contact *b) {
  return a->side * b->side * (double)a->arm_mm * (double)b->arm_mm *
         (double)foundation.twist_rad_per_Nmm[a->section][b->section] *
         (foundation.lobes == 1 ? 2 : 1);
}

static double give(int i, int j) {
  return radial_give(&contacts[i], &contacts[j]) + twist_give(&contacts[i], &contacts[j]) +
         (i == j ? (double)contacts[i].compliance_mm_per_N : 0);
}

static double closed_by(int i, double phi) {
  return (double)contacts[i].arm_mm * (contacts[i].side * phi - (double)contacts[i].gap_rad);
}

/* Forces of the pairs in `set` when all of them touch; Gaussian elimination with pivots. */
static void forces_of_set(const int set[], double phi, double force[]) {
  static double m[PAIRS_MAX][PAIRS_MAX + 1];
  int at[PAIRS_MAX];
  int n = 0;
  int i;
  int j;
  int k;
  for (i = 0; i < count; i++) {
    force[i] = 0;
    if (set[i]) {
      at[n++] = i;
    }
  }
  for (i = 0; i < n; i++) {
    for (j = 0; j < n; j++) {
      m[i][j] = give(at[i], at[j]);
    }
    m[i][n] = closed_by(at[i], phi);
  }
  for (k = 0; k < n; k++) {
    int best = k;
    for (i = k + 1; i < n; i++) {
      best = fabs(m[i][k]) > fabs(m[best][k]) ? i : best;
    }
    for (j = k; j <= n; j++) {
      const double swap = m[k][j];
      m[k][j] = m[best][j];
      m[best][j] = swap;
    }
    for (i = k + 1; i < n; i++) {
      const double factor = m[i][k] / m[k][k];
      for (j = k; j <= n; j++) {
        m[i][j] -= factor * m[k][j];
      }
    }
  }
  for (i = n - 1; i >= 0; i--) {
    double sum = m[i][n];
    for (j = i + 1; j < n; j++) {
      sum -= m[i][j] * force[at[j]];
    }
    force[at[i]] = sum / m[i][i];
  }
}

/* Remaining approach of pair i, mm; 0 if it carries. */
static double slack_of(int i, double phi, const double force[]) {
  double slack = -closed_by(i, phi);
  int j;
  for (j = 0; j < count; j++) {
    slack += give(i, j) * force[j];
  }
  return slack;
}

/* The complementarity problem at one rotation from its definition: of all sets of pairs the one
 * with F >= 0 where they touch and a slack >= 0 where they do not (Murty's least-index pivoting).
 * Returns the torque, N m. */
static double torque_by_definition(double phi, double force[]) {
  int set[PAIRS_MAX] = {0};
  double torque = 0;
  int rounds;
  int i;
  for (rounds = 0; rounds < 100000; rounds++) {
    int wrong = -1;
    forces_of_set(set, phi, force);
    for (i = 0; i < count && wrong < 0; i++) {
      if (set[i] ? force[i] < -1e-11 : slack_of(i, phi, force) < -1e-15) {
        wrong = i;
      }
    }
    if (wrong < 0) {
      break;
    }
    set[wrong] = !set[wrong];
  }
  for (i = 0; i < count; i++) { /* the conditions themselves */
    const double slack = slack_of(i, phi, force);
    TEST_ASSERT_TRUE(force[i] >= -1e-11);
    TEST_ASSERT_TRUE(slack >= -1e-12);
    ASSERT_NEAR(1e-10, 0, force[i] * slack);
    torque += contacts[i].side * (double)contacts[i].arm_mm * force[i];
  }
  return torque * (foundation.lobes == 1 ? 2 : 1) / 1000;
}

/* A mesh of about reference A's compliances: gaps lowest .. highest arcmin. */
static void random_mesh(int n, int sections, int lobes, double lowest, double highest) {
  int i;
  int s;
  int t;
  count = 0;
  foundation.sections = sections;
  foundation.lobes = lobes;
  TEST_ASSERT_EQUAL(LM_OK, lm_beam_yield(LM_REAL(2600), LM_REAL(3.5e5), LM_REAL(0.8),
                                         LM_REAL(draw(&seed, 0.5, 10)), LM_LOBE_TEETH_MAX,
                                         foundation.yield_mm_per_N, &fault));
  for (s = 0; s < sections; s++) {
    for (t = 0; t < sections; t++) {
      foundation.twist_rad_per_Nmm[s][t] = LM_REAL((s < t ? s : t) + 1) * LM_REAL(2e-9);
    }
  }
  for (i = 0; i < n; i++) {
    const double alpha = draw(&seed, 22, 25) * 3.14159265358979 / 180;
    put_contact(draw(&seed, 25.7, 26.1), tan(alpha),
                draw(&seed, lowest, highest) * 2.908882086657216e-4,
                draw(&seed, 3e-6, 8e-6) / (cos(alpha) * cos(alpha)), (int)draw(&seed, 20, 60),
                i % 2 == 0 ? 1 : -1);
    contacts[i].lobe = (int)draw(&seed, 0, lobes);
    contacts[i].section = (int)draw(&seed, 0, sections);
  }
}

#define TORQUES 9
static const double some_torques[TORQUES] = {-70, -20, -3, -0.2, 0, 0.2, 3, 20, 70};

static void take_up(const double torque[], int torques, lm_take_up states[]) {
  lm_real values[64];
  int i;
  for (i = 0; i < torques; i++) {
    values[i] = LM_REAL(torque[i]);
  }
  TEST_ASSERT_EQUAL_MESSAGE(LM_OK,
                            lm_coupled_take_up(contacts, count, &foundation, values, torques,
                                               states, &rest, &workspace, &fault),
                            fault.input);
}

/* Every state against the definition: torque, shares and number of teeth. */
static void assert_states_by_definition(void) {
  lm_take_up states[TORQUES];
  double at_rest[PAIRS_MAX];
  double force[PAIRS_MAX];
  double slack_at_rest[PAIRS_MAX];
  const double middle_bound = BOUND(1e-9, 0.02);
  int k;
  int i;
  take_up(some_torques, TORQUES, states);
  ASSERT_NEAR(middle_bound, 0, torque_by_definition((double)rest.middle_rad, at_rest));
  for (i = 0; i < count; i++) {
    slack_at_rest[i] = slack_of(i, (double)rest.middle_rad, at_rest);
  }
  for (k = 0; k < TORQUES; k++) {
    const double phi = (double)rest.middle_rad + (double)states[k].angle_rad;
    const double torque = torque_by_definition(phi, force);
    const double per_torque = torque != 0 ? (foundation.lobes == 1 ? 2 : 1) / torque / 1000 : 0;
    const double bound = BOUND(2e-13, 3e-7);
    double clearance = 0;
    double tooth = 0;
    double ring = 0;
    double twist = 0;
    int j;
    ASSERT_NEAR(BOUND(1e-9, 0.02) + fabs(some_torques[k]) * BOUND(1e-10, 1e-3), some_torques[k],
                torque);
    if (some_torques[k] == 0) {
      continue;
    }
    for (i = 0; i < count; i++) {
      const double change = force[i] - at_rest[i];
      clearance += force[i] * slack_at_rest[i] + at_rest[i] * slack_of(i, phi, force);
      tooth += change * change * (double)contacts[i].compliance_mm_per_N;
      for (j = 0; j < count; j++) {
        const double both = change * (force[j] - at_rest[j]);
        ring += both * radial_give(&contacts[i], &contacts[j]);
        twist += both * twist_give(&contacts[i], &contacts[j]);
      }
    }
    if (LM_REAL_BITS == 32 && fabs(some_torques[k]) < 1) {
      continue; /* a torque that float32's angle determines to few digits */
    }
    ASSERT_NEAR(bound, clearance * per_torque, states[k].clearance_rad);
    ASSERT_NEAR(bound, tooth * per_torque, states[k].tooth_rad);
    ASSERT_NEAR(bound, ring * per_torque, states[k].ring_rad);
    ASSERT_NEAR(bound, twist * per_torque, states[k].twist_rad);
  }
}

TEST(open_meshes_satisfy_the_definition) {
  int round;
  for (round = 0; round < 60; round++) {
    random_mesh(4 + round % 30, 1 + round % 3, 1 + round / 3 % 2, 0.05, 6);
    assert_states_by_definition();
    TEST_ASSERT_EQUAL(0, rest.preloaded);
    TEST_ASSERT_TRUE(rest.free_play_rad > 0);
  }
}

TEST(preloaded_meshes_satisfy_the_definition) {
  int round;
  for (round = 0; round < 60; round++) {
    random_mesh(4 + round % 30, 1 + round % 3, 1 + round / 3 % 2, -1.5, 5);
    contacts[0].gap_rad = LM_REAL(-1) * ARCMIN;
    contacts[1].gap_rad = LM_REAL(-0.5) * ARCMIN;
    assert_states_by_definition();
    TEST_ASSERT_TRUE(rest.preloaded >= 2);
    TEST_ASSERT_TRUE(rest.free_play_rad == 0);
  }
}

/* Sum exact, every share >= 0 (rounding aside), angle rising with the torque, stiffness its
 * slope. */
TEST(shares_add_up_and_the_angle_rises) {
  enum { STEPS = 61 };
  double torque[STEPS];
  lm_take_up states[STEPS];
  int round;
  for (round = 0; round < 30; round++) {
    const lm_real little = -LM_REAL(BOUND(1e-17, 3e-8));
    int i;
    random_mesh(8 + round, 1 + round % 3, 1 + round / 3 % 2, round % 2 == 0 ? 0.05 : -1, 6);
    for (i = 0; i < STEPS; i++) {
      torque[i] = i - STEPS / 2;
    }
    take_up(torque, STEPS, states);
    for (i = 0; i < STEPS; i++) {
      const lm_take_up *s = &states[i];
      const lm_real sign = i < STEPS / 2 ? LM_REAL(-1) : LM_REAL(1);
      ASSERT_NEAR(BOUND(1e-18, 1e-9), s->angle_rad,
                  s->clearance_rad + s->tooth_rad + s->ring_rad + s->twist_rad);
      TEST_ASSERT_TRUE(sign * s->clearance_rad >= little);
      TEST_ASSERT_TRUE(sign * s->tooth_rad >= little);
      TEST_ASSERT_TRUE(sign * s->ring_rad >= little);
      TEST_ASSERT_TRUE(sign * s->twist_rad >= little);
      if (i > 0) {
        const double rise = (double)(states[i].angle_rad - states[i - 1].angle_rad);
        const double soft = 1 / (double)states[i].stiffness_Nm_per_rad;
        const double hard = 1 / (double)states[i - 1].stiffness_Nm_per_rad;
        TEST_ASSERT_TRUE(rise > 0);
        TEST_ASSERT_TRUE(states[i].stiffness_Nm_per_rad > 0 || i == STEPS / 2);
        if (soft == hard) { /* no event between: the stiffness is the slope */
          ASSERT_NEAR(1e-3 * soft, soft, rise);
        }
      }
    }
  }
}

/* A mesh with a free play can only become stiffer, for any gaps. */
TEST(an_open_mesh_hardens) {
  enum { STEPS = 40 };
  double torque[STEPS];
  lm_take_up states[STEPS];
  int i;
  random_mesh(36, 1, 1, 0.1, 4);
  for (i = 0; i < 36; i++) {
    contacts[i].wedge = 0; /* without the rim the pairs are independent: convex */
    torque[i] = 0.2 * (i + 1);
  }
  take_up(torque, 36, states);
  for (i = 1; i < 36; i++) {
    TEST_ASSERT_TRUE(states[i].stiffness_Nm_per_rad >=
                     states[i - 1].stiffness_Nm_per_rad * LM_REAL(0.99999));
    TEST_ASSERT_TRUE(states[i].forward_teeth >= states[i - 1].forward_teeth);
  }
}

/* Small steps of torque give small steps of all results, through every event. */
TEST(every_share_is_continuous_in_torque) {
  enum { STEPS = 64 };
  double torque[STEPS];
  lm_take_up states[STEPS];
  int preloaded;
  for (preloaded = 0; preloaded < 2; preloaded++) {
    int k;
    random_mesh(30, 2, 1, preloaded ? -1 : 0.1, 5);
    take_up(some_torques, TORQUES, states);
    TEST_ASSERT_TRUE(workspace.stage_count >= 4);
    for (k = 0; k < workspace.stage_count; k++) {
      const lm_stage stage = workspace.stages[k];
      const double around[2] = {(double)stage.torque_Nm * (1 - 1e-4),
                                (double)stage.torque_Nm * (1 + 1e-4)};
      const int up = stage.torque_Nm > 0;
      const double bound =
          (double)(stage.angle_rad < 0 ? -stage.angle_rad : stage.angle_rad) * BOUND(1e-3, 5e-3);
      if (fabs(around[0]) < 1e-3) {
        continue; /* the jump across the play */
      }
      torque[0] = around[!up];
      torque[1] = around[up];
      take_up(torque, 2, states);
      ASSERT_NEAR(bound, states[0].angle_rad, states[1].angle_rad);
      ASSERT_NEAR(bound, stage.angle_rad, states[1].angle_rad);
      ASSERT_NEAR(bound, states[0].clearance_rad, states[1].clearance_rad);
      ASSERT_NEAR(bound, states[0].tooth_rad, states[1].tooth_rad);
      ASSERT_NEAR(bound, states[0].ring_rad, states[1].ring_rad);
      ASSERT_NEAR(bound, states[0].twist_rad, states[1].twist_rad);
      take_up(some_torques, TORQUES, states);
    }
  }
}

TEST(exchanged_flanks_mirror_the_curve) {
  lm_take_up states[TORQUES];
  lm_take_up mirrored[TORQUES];
  int round;
  for (round = 0; round < 20; round++) {
    const double bound = BOUND(1e-14, 2e-7);
    lm_rest before;
    int i;
    random_mesh(20 + round % 8, 1 + round % 3, 1 + round % 2, round % 2 == 0 ? 0.1 : -1, 5);
    take_up(some_torques, TORQUES, states);
    before = rest;
    for (i = 0; i < count; i++) {
      contacts[i].side = -contacts[i].side;
    }
    take_up(some_torques, TORQUES, mirrored);
    ASSERT_NEAR(bound, -before.middle_rad, rest.middle_rad);
    ASSERT_NEAR(bound, before.free_play_rad, rest.free_play_rad);
    TEST_ASSERT_EQUAL(before.preloaded, rest.preloaded);
    for (i = 0; i < TORQUES; i++) {
      const lm_take_up *a = &states[i];
      const lm_take_up *b = &mirrored[TORQUES - 1 - i];
      ASSERT_NEAR(bound, -a->angle_rad, b->angle_rad);
      if (LM_REAL_BITS == 64) {
        ASSERT_NEAR(1e-11, -a->clearance_rad, b->clearance_rad);
        ASSERT_NEAR(1e-11, -a->tooth_rad, b->tooth_rad);
        ASSERT_NEAR(1e-11, -a->ring_rad, b->ring_rad);
        ASSERT_NEAR(1e-11, -a->twist_rad, b->twist_rad);
        ASSERT_NEAR(1e-6 * (double)a->stiffness_Nm_per_rad, a->stiffness_Nm_per_rad,
                    b->stiffness_Nm_per_rad);
        TEST_ASSERT_EQUAL(a->forward_teeth, b->backward_teeth);
        TEST_ASSERT_EQUAL(a->backward_teeth, b->forward_teeth);
      }
    }
  }
}

/* Without a rim between them the pairs are the springs of section 3.1: K = r^2 / C, both lobes. */
TEST(without_the_rim_pairs_are_independent_springs) {
  lm_take_up states[TORQUES];
  int round;
  for (round = 0; round < 20; round++) {
    lm_spring springs[30];
    int i;
    random_mesh(30, 1, 1, round % 2 == 0 ? 0.1 : -1, 5);
    memset(foundation.yield_mm_per_N, 0, sizeof foundation.yield_mm_per_N);
    foundation.twist_rad_per_Nmm[0][0] = 0;
    take_up(some_torques, TORQUES, states);
    for (i = 0; i < count; i++) {
      const lm_contact *c = &contacts[i];
      springs[i].stiffness_Nm_per_rad =
          LM_REAL(2) * c->arm_mm * c->arm_mm / (c->compliance_mm_per_N * NMM_PER_NM);
      springs[i].gap_rad = c->gap_rad;
      springs[i].side = c->side;
    }
    for (i = 0; i < TORQUES; i++) {
      lm_real angle;
      int engaged;
      TEST_ASSERT_EQUAL(LM_OK, lm_independent_take_up(springs, count, LM_REAL(some_torques[i]),
                                                      &angle, &engaged, &fault));
      ASSERT_NEAR(BOUND(4e-12 * 1e-3, 1e-8), angle, rest.middle_rad + states[i].angle_rad);
      ASSERT_NEAR(BOUND(1e-18, 1e-9), 0, states[i].ring_rad);
    }
  }
}

/* One tooth each way: forward gap 2 arcmin, backward 1. */
TEST(a_free_play_rests_in_its_middle) {
  static const double torque[] = {-1, 0, 1};
  const double compliance = 4e-6;
  const double stiffness = 2 * 26.0 * 26.0 / compliance / 1000;
  lm_take_up states[3];
  put_contact(26, 0.4, 2 * 2.908882086657216e-4, compliance, 5, 1);
  put_contact(26, 0.4, 1 * 2.908882086657216e-4, compliance, 5, -1);
  take_up(torque, 3, states);
  ASSERT_NEAR(BOUND(1e-9, 1e-6), 0.5, in_arcmin(rest.middle_rad));
  ASSERT_NEAR(BOUND(1e-9, 1e-6), 1.5, in_arcmin(rest.free_play_rad));
  TEST_ASSERT_EQUAL(0, rest.preloaded);
  TEST_ASSERT_TRUE(states[1].angle_rad == 0 && states[1].stiffness_Nm_per_rad == 0);
  TEST_ASSERT_EQUAL(0, states[1].forward_teeth + states[1].backward_teeth);
  ASSERT_NEAR(1e-9, (double)rest.free_play_rad + 1 / stiffness, states[2].angle_rad);
  ASSERT_NEAR(1e-9, rest.free_play_rad, states[2].clearance_rad);
  ASSERT_NEAR(1e-9, 1 / stiffness, states[2].tooth_rad);
  ASSERT_NEAR(1e-9, -states[2].angle_rad, states[0].angle_rad);
  ASSERT_NEAR(stiffness * 1e-5, stiffness, states[2].stiffness_Nm_per_rad);
  TEST_ASSERT_EQUAL(1, states[2].forward_teeth);
  TEST_ASSERT_EQUAL(0, states[2].backward_teeth);
  TEST_ASSERT_EQUAL(1, states[0].backward_teeth);
}

/* The same teeth with 1 arcmin of preload on either flank: both carry, and share the load, until
 * T = 2 K 1 arcmin lifts one off. */
TEST(a_preload_doubles_the_stiffness_until_a_flank_lifts_off) {
  const double arcmin = 2.908882086657216e-4;
  const double compliance = 4e-6;
  const double stiffness = 2 * 26.0 * 26.0 / compliance / 1000;
  const double lift = 2 * stiffness * arcmin;
  double torque[3];
  lm_take_up states[3];
  torque[0] = 0;
  torque[1] = 0.9 * lift;
  torque[2] = 2 * lift;
  put_contact(26, 0, -arcmin, compliance, 5, 1);
  put_contact(26, 0, -arcmin, compliance, 5, -1);
  take_up(torque, 3, states);
  ASSERT_NEAR(1e-9, 0, rest.middle_rad);
  TEST_ASSERT_EQUAL(2, rest.preloaded);
  TEST_ASSERT_TRUE(rest.free_play_rad == 0);
  ASSERT_NEAR(stiffness * 1e-5, 2 * stiffness, states[0].stiffness_Nm_per_rad);
  TEST_ASSERT_EQUAL(1, states[0].forward_teeth);
  TEST_ASSERT_EQUAL(1, states[0].backward_teeth);
  ASSERT_NEAR(1e-9, 0.9 * arcmin, states[1].angle_rad);
  ASSERT_NEAR(1e-9, 0, states[1].clearance_rad);
  ASSERT_NEAR(stiffness * 1e-5, stiffness, states[2].stiffness_Nm_per_rad);
  ASSERT_NEAR(1e-9, 2 * lift / stiffness - arcmin, states[2].angle_rad);
  TEST_ASSERT_EQUAL(0, states[2].backward_teeth);
}

/* Torques far below the preload's own forces: the angle is the torque over the stiffness at
 * rest. */
TEST(the_smallest_torque_on_a_preload_turns_in_proportion) {
  int round;
  for (round = 0; round < 20; round++) {
    static const double torque[] = {-1e-12, -1e-15, 0, 1e-15, 1e-12};
    lm_take_up states[5];
    int i;
    random_mesh(20, 2, 1, -1.5, 5);
    contacts[0].gap_rad = LM_REAL(-1) * ARCMIN;
    contacts[1].gap_rad = LM_REAL(-1) * ARCMIN;
    take_up(torque, 5, states);
    for (i = 0; i < 5; i++) {
      const double angle = torque[i] / (double)states[2].stiffness_Nm_per_rad;
      const double bound = fabs(angle) * 1e-3;
      ASSERT_NEAR(bound, angle, states[i].angle_rad);
      ASSERT_NEAR(bound, angle, states[i].tooth_rad + states[i].ring_rad + states[i].twist_rad);
      TEST_ASSERT_TRUE(i == 0 || states[i].angle_rad > states[i - 1].angle_rad);
    }
  }
}

/* One lobe in place of both gives the same as both lobes. */
TEST(one_lobe_counts_for_two) {
  lm_take_up one[TORQUES];
  lm_take_up two[TORQUES];
  int preloaded;
  for (preloaded = 0; preloaded < 2; preloaded++) {
    int i;
    random_mesh(18, 3, 1, preloaded ? -1 : 0.1, 5);
    take_up(some_torques, TORQUES, one);
    for (i = 0; i < 18; i++) {
      contacts[18 + i] = contacts[i];
      contacts[18 + i].lobe = 1;
    }
    count = 36;
    foundation.lobes = 2;
    take_up(some_torques, TORQUES, two);
    for (i = 0; i < TORQUES; i++) {
      ASSERT_NEAR(BOUND(1e-13, 3e-7), one[i].angle_rad, two[i].angle_rad);
      ASSERT_NEAR(BOUND(1e-13, 1e-6), one[i].twist_rad, two[i].twist_rad);
      if (LM_REAL_BITS == 64) {
        TEST_ASSERT_EQUAL(one[i].forward_teeth, two[i].forward_teeth);
      }
    }
  }
}

/* check_values.md, take-up: lobes with gaps g + d and g - d: free play 2 (g - |d|) in all, one lobe
 * alone up to T = 2 K_L |d|, then both, on the line of equal lobes. */
TEST(unequal_lobes_carry_one_after_the_other) {
  const double g = 2e-4;
  const double d = 5e-5;
  const double compliance = 4e-6;
  const double lobe = 26.0 * 26.0 / compliance / 1000;
  const double second = 2 * lobe * d;
  double torque[3];
  lm_take_up states[3];
  int i;
  torque[0] = second * 0.5;
  torque[1] = second * 0.999;
  torque[2] = second * 3;
  foundation.lobes = 2;
  for (i = 0; i < 4; i++) {
    put_contact(26, 0, g + (i % 2 == 0 ? d : -d), compliance, 5, i < 2 ? 1 : -1);
    contacts[i].lobe = i % 2;
  }
  take_up(torque, 3, states);
  ASSERT_NEAR(1e-9, 0, rest.middle_rad);
  ASSERT_NEAR(1e-9, g - d, rest.free_play_rad);
  ASSERT_NEAR(1e-9, g - d + torque[0] / lobe, states[0].angle_rad);
  ASSERT_NEAR(lobe * 1e-5, lobe, states[1].stiffness_Nm_per_rad);
  ASSERT_NEAR(lobe * 2e-5, 2 * lobe, states[2].stiffness_Nm_per_rad);
  ASSERT_NEAR(2e-9, g + torque[2] / (2 * lobe), states[2].angle_rad);
  TEST_ASSERT_EQUAL(1, states[1].forward_teeth); /* of the nearer lobe, alone so far */
  TEST_ASSERT_EQUAL(1, states[2].forward_teeth);
}

TEST(the_events_stand_on_the_curve_in_their_order) {
  static const double torque[] = {-80, 80};
  lm_take_up states[2];
  int k;
  random_mesh(30, 1, 1, 0.1, 5);
  take_up(torque, 2, states);
  TEST_ASSERT_TRUE(workspace.stage_count >= 2);
  for (k = 0; k < workspace.stage_count; k++) {
    const lm_stage *stage = &workspace.stages[k];
    const lm_stage *before = &workspace.stages[k > 0 ? k - 1 : 0];
    const int up = stage->angle_rad > 0;
    const int goes_on = k > 0 && (before->angle_rad > 0) == up;
    TEST_ASSERT_TRUE(stage->contact >= 0 && stage->contact < count);
    TEST_ASSERT_TRUE(stage->joined == 0 || stage->joined == 1);
    if (goes_on) {
      TEST_ASSERT_TRUE(
          up ? stage->torque_Nm >= before->torque_Nm && stage->angle_rad >= before->angle_rad
             : stage->torque_Nm <= before->torque_Nm && stage->angle_rad <= before->angle_rad);
    } else { /* the play has been crossed; the first pair meets without force */
      ASSERT_NEAR(BOUND(1e-15, 1e-8), up ? rest.free_play_rad : -rest.free_play_rad,
                  stage->angle_rad);
      ASSERT_NEAR(0, 0, stage->torque_Nm);
      TEST_ASSERT_EQUAL(1, stage->joined);
      TEST_ASSERT_EQUAL(up ? 1 : -1, contacts[stage->contact].side);
    }
  }
}

/* --- the capacity of the workspace --- */

/* n pairs a flank, far apart on the rim or not coupled at all, gaps in rising order. */
static void many_pairs(int n) {
  int i;
  foundation.lobes = 2;
  for (i = 0; i < 2 * n; i++) {
    put_contact(26, 0, 1e-6 * (1 + i / 2), 4e-6, i / 4 % LM_LOBE_TEETH_MAX, i % 2 == 0 ? 1 : -1);
    contacts[i].lobe = i / 2 % 2;
  }
}

/* Pairs by rising gaps, so that the far ones are the last. */
static void sort_pairs(void) {
  int i;
  for (i = 1; i < count; i++) {
    const lm_contact moved = contacts[i];
    int k = i;
    for (; k > 0 && contacts[k - 1].gap_rad > moved.gap_rad; k--) {
      contacts[k] = contacts[k - 1];
    }
    contacts[k] = moved;
  }
}

/* Far pairs that carry are noticed; where none does, the states are those of all pairs. */
TEST(pairs_left_out_are_noticed_if_they_carry) {
  int left_out = 0;
  int noticed = 0;
  int k;
  for (k = 0; k < 60; k++) {
    static const lm_real torque[] = {LM_REAL(-3), LM_REAL(3), LM_REAL(20)};
    lm_take_up all[3];
    lm_take_up states[3];
    int touched;
    int near;
    int t;
    random_mesh(30, 1 + k % 3, 1 + k % 2, -0.5, 3);
    sort_pairs();
    TEST_ASSERT_EQUAL(LM_OK, lm_coupled_take_up(contacts, count, &foundation, torque, 3, all, &rest,
                                                &workspace, &fault));
    for (near = 12; near < 28; near += 5) {
      TEST_ASSERT_EQUAL(LM_OK, lm_near_take_up(contacts, near, count - near, &touched, &foundation,
                                               torque, 3, states, &rest, &workspace, &fault));
      noticed += touched;
      left_out += !touched;
      for (t = 0; t < 3 && !touched; t++) {
        ASSERT_NEAR(BOUND(1e-12, 1e-6), all[t].angle_rad, states[t].angle_rad);
        TEST_ASSERT_EQUAL(all[t].forward_teeth, states[t].forward_teeth);
      }
    }
  }
  TEST_ASSERT_TRUE(left_out > 40);
  TEST_ASSERT_TRUE(noticed > 40);
}

TEST(all_active_pairs_may_carry_and_the_first_events_are_kept) {
  static const double torque[] = {-1e6, 1e6};
  lm_take_up states[2];
  many_pairs(LM_ACTIVE_MAX);
  take_up(torque, 2, states);
  TEST_ASSERT_EQUAL(LM_ACTIVE_MAX / 2, states[1].forward_teeth);
  TEST_ASSERT_EQUAL(LM_ACTIVE_MAX / 2, states[0].backward_teeth);
  TEST_ASSERT_EQUAL(LM_STAGES_MAX, workspace.stage_count); /* of 2 * LM_ACTIVE_MAX */
}

TEST(more_active_pairs_are_refused) {
  const lm_real torque[] = {LM_REAL(1e6)};
  lm_take_up states[1];
  many_pairs(LM_ACTIVE_MAX + 1);
  assert_refused_range(LM_TOO_SMALL, "LM_ACTIVE_MAX", LM_ACTIVE_MAX, LM_ACTIVE_MAX + 1,
                       LM_REAL(INFINITY),
                       lm_coupled_take_up(contacts, count, &foundation, torque, 1, states, &rest,
                                          &workspace, &fault));
}

/* The largest permitted numbers of sections, lobes and teeth. */
TEST(the_largest_numbers_are_accepted) {
  static const double torque[] = {1};
  lm_take_up states[1];
  foundation.sections = LM_SECTIONS_MAX;
  foundation.lobes = 2;
  put_contact(26, 0.4, 1e-4, 4e-6, LM_LOBE_TEETH_MAX - 1, 1);
  put_contact(26, 0.4, 1e-4, 4e-6, 0, -1);
  contacts[0].section = LM_SECTIONS_MAX - 1;
  contacts[0].lobe = 1;
  take_up(torque, 1, states);
  TEST_ASSERT_EQUAL(1, states[0].forward_teeth);
  ASSERT_NEAR(1e-9, 1e-4 + 1000 * 4e-6 / (26 * 26), states[0].angle_rad);
}

/* --- refusals --- */

static lm_take_up untouched[3];

static lm_status refused_take_up(int n, const lm_real torque[], int torques) {
  lm_take_up states[3];
  lm_rest found;
  lm_status status;
  memset(states, 0x55, sizeof states);
  memset(&found, 0x55, sizeof found);
  memset(untouched, 0x55, sizeof untouched);
  status = lm_coupled_take_up(contacts, n, &foundation, torque, torques, states, &found, &workspace,
                              &fault);
  TEST_ASSERT_EQUAL_MEMORY(untouched, states, sizeof states);
  TEST_ASSERT_EQUAL_MEMORY(untouched, &found, sizeof found);
  return status;
}

static void two_pairs(void) {
  count = 0;
  put_contact(26, 0.4, 1e-4, 4e-6, 5, 1);
  put_contact(26, 0.4, 1e-4, 4e-6, 5, -1);
}

TEST(coupled_pairs_refuse_null) {
  const lm_real torque[] = {1};
  const char *pointers = "contacts, foundation, torque_Nm, states, workspace";
  lm_take_up states[1];
  two_pairs();
  assert_refused(
      LM_NULL, pointers,
      lm_coupled_take_up(0, 2, &foundation, torque, 1, states, &rest, &workspace, &fault));
  assert_refused(LM_NULL, pointers,
                 lm_coupled_take_up(contacts, 2, 0, torque, 1, states, &rest, &workspace, &fault));
  assert_refused(
      LM_NULL, pointers,
      lm_coupled_take_up(contacts, 2, &foundation, 0, 1, states, &rest, &workspace, &fault));
  assert_refused(
      LM_NULL, pointers,
      lm_coupled_take_up(contacts, 2, &foundation, torque, 1, 0, &rest, &workspace, &fault));
  assert_refused(LM_NULL, pointers,
                 lm_coupled_take_up(contacts, 2, &foundation, torque, 1, states, &rest, 0, &fault));
  TEST_ASSERT_EQUAL(
      LM_OK, lm_coupled_take_up(contacts, 2, &foundation, torque, 1, states, 0, &workspace, 0));
}

TEST(coupled_pairs_refuse_counts_and_torques) {
  const lm_real nan = LM_REAL(NAN);
  const lm_real inf = LM_REAL(INFINITY);
  const lm_real most = LM_REAL(1e9);
  lm_real torque[3] = {-1, 0, 1};
  two_pairs();
  assert_refused_range(LM_OUT_OF_RANGE, "count", 0, 1, LM_CONTACTS_MAX,
                       refused_take_up(0, torque, 3));
  assert_refused_range(LM_OUT_OF_RANGE, "count", LM_CONTACTS_MAX + 1, 1, LM_CONTACTS_MAX,
                       refused_take_up(LM_CONTACTS_MAX + 1, torque, 3));
  assert_refused_range(LM_TOO_SMALL, "torques", 0, 1, inf, refused_take_up(2, torque, 0));
  torque[2] = nan;
  assert_refused_range(LM_NOT_FINITE, "torque_Nm", nan, -most, most, refused_take_up(2, torque, 3));
  torque[2] = inf;
  assert_refused_range(LM_NOT_FINITE, "torque_Nm", inf, -most, most, refused_take_up(2, torque, 3));
  torque[2] = 0;
  assert_refused(LM_NOT_MONOTONE, "torque_Nm", refused_take_up(2, torque, 3));
}

TEST(coupled_pairs_refuse_a_wrong_contact) {
  const lm_real torque[] = {1};
  const lm_real nan = LM_REAL(NAN);
  const lm_real least = LM_REAL(1e-12);
  const lm_real large = LM_REAL(1e6);
#define WRONG(field, value, status, low, high) \
  two_pairs();                                 \
  contacts[1].field = value;                   \
  assert_refused_range(status, #field, LM_REAL(value), low, high, refused_take_up(2, torque, 1))
  WRONG(arm_mm, 0, LM_OUT_OF_RANGE, LM_REAL(1e-3), large);
  WRONG(arm_mm, nan, LM_NOT_FINITE, LM_REAL(1e-3), large);
  WRONG(wedge, -1, LM_OUT_OF_RANGE, 0, large);
  WRONG(gap_rad, 4, LM_OUT_OF_RANGE, -LM_PI, LM_PI);
  WRONG(gap_rad, LM_REAL(INFINITY), LM_NOT_FINITE, -LM_PI, LM_PI);
  WRONG(compliance_mm_per_N, 0, LM_OUT_OF_RANGE, least, large);
  WRONG(tooth, -1, LM_OUT_OF_RANGE, 0, LM_LOBE_TEETH_MAX - 1);
  WRONG(tooth, LM_LOBE_TEETH_MAX, LM_OUT_OF_RANGE, 0, LM_LOBE_TEETH_MAX - 1);
  WRONG(lobe, 1, LM_OUT_OF_RANGE, 0, 0);
  WRONG(lobe, -1, LM_OUT_OF_RANGE, 0, 0);
  WRONG(section, 1, LM_OUT_OF_RANGE, 0, 0);
  WRONG(section, -1, LM_OUT_OF_RANGE, 0, 0);
  WRONG(side, 0, LM_OUT_OF_RANGE, -1, 1);
#undef WRONG
  two_pairs();
  contacts[1].side = 1;
  assert_refused(LM_NO_CONTACT, "contacts", refused_take_up(2, torque, 1));
  contacts[0].side = -1;
  contacts[1].side = -1;
  assert_refused(LM_NO_CONTACT, "contacts", refused_take_up(2, torque, 1));
}

TEST(coupled_pairs_refuse_a_wrong_foundation) {
  const lm_real torque[] = {1};
  const lm_real nan = LM_REAL(NAN);
  const lm_real inf = LM_REAL(INFINITY);
  two_pairs();
  foundation.sections = 0;
  assert_refused_range(LM_OUT_OF_RANGE, "sections", 0, 1, LM_SECTIONS_MAX,
                       refused_take_up(2, torque, 1));
  foundation.sections = LM_SECTIONS_MAX + 1;
  assert_refused_range(LM_OUT_OF_RANGE, "sections", LM_SECTIONS_MAX + 1, 1, LM_SECTIONS_MAX,
                       refused_take_up(2, torque, 1));
  foundation.sections = 2;
  foundation.lobes = 0;
  assert_refused_range(LM_OUT_OF_RANGE, "lobes", 0, 1, 2, refused_take_up(2, torque, 1));
  foundation.lobes = 3;
  assert_refused_range(LM_OUT_OF_RANGE, "lobes", 3, 1, 2, refused_take_up(2, torque, 1));
  foundation.lobes = 1;
  contacts[1].tooth = 8;
  foundation.yield_mm_per_N[3] = nan;
  assert_refused_range(LM_NOT_FINITE, "yield_mm_per_N", nan, -LM_REAL(1e6), LM_REAL(1e6),
                       refused_take_up(2, torque, 1));
  foundation.yield_mm_per_N[3] = 0;
  foundation.yield_mm_per_N[4] = nan; /* beyond the teeth that are used */
  foundation.twist_rad_per_Nmm[1][0] = inf;
  assert_refused_range(LM_NOT_FINITE, "twist_rad_per_Nmm", inf, -1, 1,
                       refused_take_up(2, torque, 1));
  foundation.twist_rad_per_Nmm[1][0] =
      LM_REAL(2e21); /* float32 overflows during the solution at rest */
  assert_refused_range(LM_OUT_OF_RANGE, "twist_rad_per_Nmm", LM_REAL(2e21), -1, 1,
                       refused_take_up(2, torque, 1));
  foundation.twist_rad_per_Nmm[1][0] = 0;
  foundation.twist_rad_per_Nmm[2][2] = inf; /* beyond the sections that are used */
  {
    lm_take_up state;
    TEST_ASSERT_EQUAL(LM_OK, lm_coupled_take_up(contacts, 2, &foundation, torque, 1, &state, &rest,
                                                &workspace, &fault));
  }
}

/* --- what rounding defeats --- */

/* Two pairs on one tooth whose own compliance is below the rounding of the rim's: C is
 * singular to rounding. The second arm is twice as long, so that it comes into contact when
 * the output turns. */
static void singular_pairs(double first_gap, double second_gap, int side) {
  foundation.yield_mm_per_N[0] = 1;
  put_contact(26, 1e3, first_gap, 1e-12, 0, side);
  put_contact(52, 1e3, second_gap, 1e-12, 0, side);
}

TEST(a_singular_mesh_is_refused_on_the_way) {
  const lm_real torque[] = {-1000, 1000};
  lm_take_up states[2];
  int side;
  for (side = -1; side <= 1; side += 2) {
    count = 0;
    singular_pairs(1e-4, 1e-3, side);
    put_contact(26, 0, 1e-4, 4e-6, 9, -side);
    assert_refused(LM_NOT_CONVERGED, "compliance_mm_per_N",
                   lm_coupled_take_up(contacts, count, &foundation, torque, 2, states, &rest,
                                      &workspace, &fault));
  }
}

TEST(a_singular_preload_is_refused) {
  const lm_real torque[] = {0};
  singular_pairs(-1e-3, -0.9e-3, 1);
  put_contact(26, 0, 1e-4, 4e-6, 9, -1);
  assert_refused(LM_NOT_CONVERGED, "compliance_mm_per_N", refused_take_up(count, torque, 1));
}

/* A soft pair against a stiff one: after the preload has been applied, the output turns by it, and
 * only then the second pair touches. */
TEST(a_mesh_that_is_singular_at_rest_is_refused) {
  const lm_real torque[] = {0};
  singular_pairs(-1e-4, -0.25e-4, 1);
  put_contact(26, 0, -1e-4, 4e-6, 9, -1);
  assert_refused(LM_NOT_CONVERGED, "compliance_mm_per_N", refused_take_up(count, torque, 1));
}

/* Compliances at the last digit of the rim's: most such meshes are solved, in some the
 * factorisation and the slacks disagree by rounding, and pairs join and leave without end. This
 * ends in a refusal, too.
 */
TEST(an_endless_exchange_of_pairs_is_refused) {
  const lm_real torque[] = {-1000, 1000};
  const double last_digit = BOUND(2e-17, 1e-8);
  const lm_real rim = LM_REAL(1e5);
  lm_status status = LM_OK;
  lm_take_up states[2];
  int exchanges = 0;
  uint32_t round;
  int i;
  for (round = BOUND(1700, 1); round < 60000 && exchanges == 0; round++) {
    seed = round;
    count = 0;
    for (i = 0; i < 3; i++) {
      foundation.yield_mm_per_N[i] = rim * LM_REAL(1 - 0.1 * last_digit * i);
    }
    for (i = 0; i < 4; i++) {
      lm_contact *c = &contacts[count];
      put_contact(draw(&seed, 1, 2), 0, 0, 1, 0, i == 3 ? -1 : 1);
      c->wedge = c->arm_mm * LM_REAL(0.3);
      c->gap_rad = LM_REAL(1e-3 * draw(&seed, -0.2, 1));
      c->compliance_mm_per_N = rim * LM_REAL(last_digit * draw(&seed, 1, 3));
      c->tooth = (int)draw(&seed, 0, 3);
    }
    status = lm_coupled_take_up(contacts, count, &foundation, torque, 2, states, &rest, &workspace,
                                &fault);
    TEST_ASSERT_TRUE(status == LM_OK || status == LM_NOT_CONVERGED);
    exchanges = status == LM_NOT_CONVERGED && strcmp(fault.input, "contacts") == 0;
  }
  TEST_ASSERT_TRUE(exchanges);
}

/* --- meshes of the reference drive --- */

/* Contact lists as in check_values.md: coupled teeth, axial sections. */
typedef struct recipe {
  double rigid_shift;
  int sections;
  int minus_smallest_gap;
  int common_flank_angle; /* 23.5 deg for every pair */
} recipe;

static lm_clearance lobe[LM_LOBE_TEETH_MAX];

static void mesh_of_reference_a(const recipe *how) {
  const lm_real alpha = LM_REAL(23.5) * DEGREE;
  const lm_real within = LM_REAL(55) * DEGREE; /* beta + 25 deg */
  const lm_real widest = LM_REAL(8) * ARCMIN;
  lm_drive drive = reference_a();
  lm_real smallest = widest;
  lm_mesh mesh;
  int section;
  int s;
  int i;
  drive.teeth.rigid_shift = LM_REAL(how->rigid_shift);
  count = 0;
  foundation.sections = how->sections;
  for (section = 0; section < how->sections; section++) {
    const lm_real factor = how->sections == 1 ? LM_REAL(1)
                                              : LM_REAL(0.89) + LM_REAL(0.22) * LM_REAL(section) /
                                                                    LM_REAL(how->sections - 1);
    int teeth;
    TEST_ASSERT_EQUAL(LM_OK, lm_make_mesh(&drive, factor, LM_NEUTRAL_LINE_NODES, &mesh, &fault));
    TEST_ASSERT_EQUAL(LM_OK, lm_lobe_clearances(&mesh, 0, lobe, LM_LOBE_TEETH_MAX, &teeth, &fault));
    for (i = 0; i < 2 * teeth; i++) {
      const lm_gap *gap = i % 2 == 0 ? &lobe[i / 2].forward : &lobe[i / 2].backward;
      const lm_real at = lobe[i / 2].angle_rad;
      if (at > -within && at < within && gap->gap_rad < widest) {
        const double angle = (double)(how->common_flank_angle ? alpha : gap->flank_angle_rad);
        put_contact((double)gap->radius_mm, tan(angle), (double)gap->gap_rad,
                    3.5e-6 * how->sections / (cos(angle) * cos(angle)), i / 2, i % 2 == 0 ? 1 : -1);
        contacts[count - 1].section = section;
        smallest = gap->gap_rad < smallest ? gap->gap_rad : smallest;
      }
    }
  }
  for (i = 0; i < count; i++) {
    contacts[i].gap_rad -= how->minus_smallest_gap ? smallest : LM_REAL(0);
  }
  TEST_ASSERT_EQUAL(
      LM_OK,
      lm_beam_yield(LM_REAL(2600), LM_REAL(3.5e5), mesh.geometry.neutral_mm * LM_PI / LM_REAL(100),
                    LM_REAL(7.88), LM_LOBE_TEETH_MAX, foundation.yield_mm_per_N, &fault));
  /* Twist of the rim, middles of equal slices: min(z) / (G 2 pi r^3 s). */
  for (section = 0; section < how->sections; section++) {
    for (s = 0; s < how->sections; s++) {
      const double z = ((section < s ? section : s) + 0.5) * 10 / how->sections;
      const double r = (double)mesh.geometry.neutral_mm;
      foundation.twist_rad_per_Nmm[section][s] =
          how->sections == 1 ? LM_REAL(0)
                             : LM_REAL(z / (8e4 * 2 * 3.14159265358979 * r * r * r * 0.6));
    }
  }
}

/* check_values.md, coupled teeth: mesh alone. */
TEST(the_calibrated_mesh_of_reference_a) {
  static const double torque[] = {0.4, 1.6, 4, 7, 10, 16, 25, 40, 60, 80};
  static const double angle[] = {.067, .264, .612, .969, 1.235, 1.569, 2.031, 2.732, 3.597, 4.424};
  static const int teeth[] = {2, 2, 4, 6, 8, 10, 13, 17, 22, 24};
  recipe how = {2.957, 1, 1, 0};
  lm_take_up states[10];
  int i;
  mesh_of_reference_a(&how);
  take_up(torque, 10, states);
  for (i = 0; i < 10; i++) {
    ASSERT_NEAR(BOUND(0.0011, 0.004), angle[i], in_arcmin(states[i].angle_rad));
    TEST_ASSERT_EQUAL(teeth[i], states[i].forward_teeth);
    TEST_ASSERT_EQUAL(0, states[i].backward_teeth);
  }
  /* Section 0: the teeth are about 1 % of the whole 5.8 arcmin at rated torque. */
  ASSERT_NEAR(0.005, 0.01, in_arcmin(states[7].tooth_rad) / 5.800);
}

#define TORSION 4.48e4 /* N m/rad, in series with the mesh; check_values.md, coupled teeth */

/* check_values.md, coupled teeth: x2 varied, one flank angle for all pairs. K1 =
 * T1/phi(T1), K3 between T2 and 80 N m, lost motion 2 phi(1.6). */
TEST(the_stiffness_ratio_shows_the_smallest_gap) {
  static const double torque[] = {1.6, 7, 25, 80};
  static const double row[][4] = {{-.12, -1.48, 1.18, .33}, {-.08, -.99, 1.04, .40},
                                  {-.04, -.49, .82, .41},   {-.02, -.24, .66, .40},
                                  {0, 0, .56, .75},         {.02, .25, .48, 1.24},
                                  {.05, .62, .40, 1.99}};
  int k;
  for (k = 0; k < 7; k++) {
    recipe how = {2.957 + row[k][0], 1, 0, 1};
    lm_take_up states[4];
    double phi[4];
    double smallest = 99;
    int i;
    mesh_of_reference_a(&how);
    for (i = 0; i < count; i++) {
      smallest = fmin(smallest, in_arcmin(contacts[i].gap_rad));
    }
    ASSERT_NEAR(BOUND(0.0051, 0.01), row[k][1], smallest);
    take_up(torque, 4, states);
    for (i = 0; i < 4; i++) {
      phi[i] = (double)states[i].angle_rad + torque[i] / TORSION;
    }
    ASSERT_NEAR(BOUND(0.0075, 0.02), row[k][2], 7 / phi[1] / (55 / (phi[3] - phi[2])));
    ASSERT_NEAR(BOUND(0.0051, 0.02), row[k][3], 2 * in_arcmin(LM_REAL(phi[0])));
  }
}

/* check_values.md, axial sections: five sections, factors .89 .. 1.11, x2 opened by 0.11. */
TEST(the_spatial_mesh_of_reference_a) {
  static const double torque[] = {1.6, 7, 40};
  static const double five[] = {.4428, 1.4291, 6.1517};
  static const double half[] = {.15, 0, 0};
  recipe how = {2.957 + 0.11, 5, 0, 1};
  lm_take_up states[3];
  double phi[3];
  int i;
  mesh_of_reference_a(&how);
  take_up(torque, 3, states);
  for (i = 0; i < 3; i++) {
    phi[i] = in_arcmin(states[i].angle_rad + LM_REAL(torque[i] / TORSION));
    ASSERT_NEAR(BOUND(0.0002, 0.006), five[i], phi[i]);
    TEST_ASSERT_TRUE(states[i].twist_rad > 0);
    TEST_ASSERT_TRUE(states[i].twist_rad < LM_REAL(0.05) * states[i].angle_rad);
  }
  how.sections = 3; /* changes at most 3 % */
  mesh_of_reference_a(&how);
  take_up(torque, 3, states);
  for (i = 0; i < 3; i++) {
    ASSERT_NEAR(0.03 * phi[i], phi[i],
                in_arcmin(states[i].angle_rad) + in_arcmin(LM_REAL(torque[i] / TORSION)));
  }
  /* Opened by half: preloaded ends double K1 to 3.2e4, lost motion 0.30 arcmin. */
  how.sections = 5;
  how.rigid_shift = 2.957 + 0.055;
  mesh_of_reference_a(&how);
  take_up(torque, 3, states);
  ASSERT_NEAR(BOUND(0.003, 0.01), half[0],
              in_arcmin(states[0].angle_rad + LM_REAL(torque[0] / TORSION)));
  ASSERT_NEAR(BOUND(320, 500), 3.2e4, 7 / ((double)states[1].angle_rad + 7 / TORSION));
}
