#include "lostmotion/tolerance.h"

#include <string.h>

#include "expect.h"
#include "test.h"

#define LOG2_SAMPLES 12

static lm_tolerance_limits limits;
static lm_gap_statistics statistics;
static lm_sampling_plan plan;
static lm_real workspace[LM_SAMPLE_GAP_WORKSPACE(LOG2_SAMPLES)];
static uint32_t points[1 << LOG2_SAMPLES];

void setUp(void) {
  forget_results();
  memset(&limits, 0, sizeof(limits));
  memset(&statistics, 0, sizeof(statistics));
  plan.samples_log2 = LOG2_SAMPLES;
  plan.scramblings = 8;
  plan.seed = 1;
  plan.low_probability = LM_REAL(0.00135);
  plan.high_probability = LM_REAL(0.99865);
  plan.limit_mm = LM_REAL(1);
}

static void near_to(double expected, lm_real found, double absolute) {
  TEST_ASSERT_DOUBLE_WITHIN(absolute, expected, (double)found);
}

static lm_tolerance_link link_of(double influence, double lower_um, double upper_um,
                                 lm_distribution distribution, lm_gap_zone zone) {
  lm_tolerance_link made;
  made.influence = LM_REAL(influence);
  made.lower_mm = LM_REAL(lower_um * 1e-3);
  made.upper_mm = LM_REAL(upper_um * 1e-3);
  made.distribution = distribution;
  made.zone = zone;
  return made;
}

/* ---- pairs, grades ---- */

TEST(clearance_limits_of_a_fit_are_those_of_its_signed_deviations) {
  /* ISO 286, d 40: H7 +25/0; g6 -9/-25: clearance 9 .. 50 um; p6 +42/+26: interference to -42. */
  close_to(0.050, lm_clearance_max(LM_REAL(0.025), LM_REAL(-0.025)), 0);
  close_to(0.009, lm_clearance_min(0, LM_REAL(-0.009)), 0);
  close_to(-0.042, lm_clearance_min(0, LM_REAL(0.042)), 0);
  close_to(-0.001, lm_clearance_max(LM_REAL(0.025), LM_REAL(0.026)), 5e-6);
}

TEST(tolerance_grades_are_those_of_the_standard) {
  /* ISO 286-1, table of standard tolerances: IT3, IT5, IT6, IT7, IT12 and IT16 of a diameter in
   * each step. */
  static const int grade[] = {3, 5, 6, 7, 12, 16};
  static const struct {
    double diameter_mm;
    double table_um[6];
  } step[] = {
      {0.4, {2, 4, 6, 10, 100, 600}},     {3, {2, 4, 6, 10, 100, 600}},
      {3.001, {2.5, 5, 8, 12, 120, 750}}, {10, {2.5, 6, 9, 15, 150, 900}},
      {18, {3, 8, 11, 18, 180, 1100}},    {19, {4, 9, 13, 21, 210, 1300}},
      {31, {4, 11, 16, 25, 250, 1600}},   {50, {4, 11, 16, 25, 250, 1600}},
      {80, {5, 13, 19, 30, 300, 1900}},   {100, {6, 15, 22, 35, 350, 2200}},
      {180, {8, 18, 25, 40, 400, 2500}},  {200, {10, 20, 29, 46, 460, 2900}},
      {315, {12, 23, 32, 52, 520, 3200}}, {320, {13, 25, 36, 57, 570, 3600}},
      {500, {15, 27, 40, 63, 630, 4000}},
  };
  int i;
  int k;
  for (i = 0; i < (int)(sizeof(step) / sizeof(step[0])); i++) {
    for (k = 0; k < 6; k++) {
      ACCEPTED(lm_it_tolerance(LM_REAL(step[i].diameter_mm), grade[k], &out, &fault));
      close_to(step[i].table_um[k] * 1e-3, out, 1e-12);
    }
  }
  OUTSIDE("grade", lm_it_tolerance(40, 2, &out, fault_or_null));
  OUTSIDE("grade", lm_it_tolerance(40, 17, &out, fault_or_null));
  OUTSIDE("diameter_mm", lm_it_tolerance(0, 6, &out, fault_or_null));
  OUTSIDE("diameter_mm", lm_it_tolerance(501, 6, &out, fault_or_null));
  REFUSED(LM_NOT_FINITE, "diameter_mm", lm_it_tolerance(NAN_VALUE, 6, &out, fault_or_null));
  REFUSED(LM_NULL, "tolerance_mm", lm_it_tolerance(40, 6, 0, fault_or_null));
}

/* The rule that the table was made by: IT6 to IT16 as multiples of i = 0.45 D^(1/3) + 0.001 D with
 * the geometric mean of a step, rounded. Below 10 mm the rounding is coarse. */
TEST(the_table_is_the_rule_rounded) {
  static const double multiple[] = {10, 16, 25, 40, 64, 100, 160, 250, 400, 640, 1000};
  static const double end[] = {10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500};
  int step;
  int grade;
  for (step = 1; step < 11; step++) {
    const double d = sqrt(end[step - 1] * end[step]);
    for (grade = 6; grade <= 16; grade++) {
      ACCEPTED(lm_it_tolerance(LM_REAL(d), grade, &out, &fault));
      close_to(multiple[grade - 6] * (0.45 * cbrt(d) + 0.001 * d) * 1e-3, out, 0.04);
    }
  }
}

/* Exactly, so that whole grades of a search give fields of the standard. */
TEST(a_whole_grade_has_the_field_of_the_table_to_the_last_bit) {
  static const double diameter_mm[] = {0.25, 3, 25, 48, 60, 190, 500};
  lm_real whole;
  int grade;
  int i;
  for (i = 0; i < 7; i++) {
    for (grade = 3; grade <= 16; grade++) {
      ACCEPTED(lm_it_tolerance(LM_REAL(diameter_mm[i]), grade, &whole, &fault));
      ACCEPTED(lm_it_tolerance_continuous(LM_REAL(diameter_mm[i]), (lm_real)grade, &out, &fault));
      TEST_ASSERT_TRUE(out == whole);
    }
  }
}

/* An optimizer needs a function without steps and corners: the field always grows, and its
 * logarithm has the same slope on either side of a grade, half of its difference between the grades
 * below and above.
 */
TEST(between_whole_grades_the_field_grows_smoothly) {
  static const double diameter_mm[] = {0.25, 25, 60, 190, 500};
  const double step = LM_REAL_BITS == 64 ? 1e-5 : 1e-2;
  int i;
  int k;
  for (i = 0; i < 5; i++) {
    const lm_real d = LM_REAL(diameter_mm[i]);
    double previous = 0;
    for (k = 0; k <= 650; k++) {
      ACCEPTED(lm_it_tolerance_continuous(d, LM_REAL(3 + 0.02 * k), &out, &fault));
      TEST_ASSERT_TRUE((double)out > previous);
      previous = (double)out;
    }
    for (k = 4; k <= 15; k++) {
      double field[5];
      int j;
      for (j = 0; j < 5; j++) {
        const double away[] = {-1, -step, 0, step, 1};
        ACCEPTED(lm_it_tolerance_continuous(d, LM_REAL(k + away[j]), &out, &fault));
        field[j] = log((double)out);
      }
      TEST_ASSERT_DOUBLE_WITHIN(10 * step, (field[4] - field[0]) / 2, (field[3] - field[2]) / step);
      TEST_ASSERT_DOUBLE_WITHIN(10 * step, (field[4] - field[0]) / 2, (field[2] - field[1]) / step);
    }
  }
  OUTSIDE("grade", lm_it_tolerance_continuous(25, LM_REAL(2.9), &out, fault_or_null));
  OUTSIDE("grade", lm_it_tolerance_continuous(25, LM_REAL(16.1), &out, fault_or_null));
  OUTSIDE("diameter_mm", lm_it_tolerance_continuous(-1, 6, &out, fault_or_null));
  REFUSED(LM_NULL, "tolerance_mm", lm_it_tolerance_continuous(25, 6, 0, fault_or_null));
}

/* ---- limits ---- */

TEST(worst_case_sums_equations_10_and_11_over_the_pairs) {
  /* Two fits of d 40, H7/g6 (clearance 9 .. 50 um on the diameter) and H7/p6 (-42 .. -1), as four
   * links of half a diameter: S = 4.5 - 21 .. 25 - 0.5 um. */
  lm_tolerance_link chain[4];
  chain[0] = link_of(0.5, 0, 25, LM_NORMAL, LM_GENERATOR_GAP);
  chain[1] = link_of(-0.5, -25, -9, LM_NORMAL, LM_GENERATOR_GAP);
  chain[2] = link_of(0.5, 0, 25, LM_NORMAL, LM_GENERATOR_GAP);
  chain[3] = link_of(-0.5, 26, 42, LM_NORMAL, LM_GENERATOR_GAP);
  ACCEPTED(lm_worst_limits(chain, 4, &limits, &fault));
  close_to(-0.0165, limits.signed_min_mm[LM_GENERATOR_GAP], 0);
  close_to(0.0245, limits.signed_max_mm[LM_GENERATOR_GAP], 0);
  close_to(0, limits.gap_min_mm[LM_GENERATOR_GAP], 0);
  close_to(0.0245, limits.gap_max_mm[LM_GENERATOR_GAP], 0);
  close_to(0, limits.total_min_mm, 0);
  close_to(0.0245, limits.total_max_mm, 0);
  close_to(0, limits.gap_max_mm[LM_TEETH_GAP], 0);
}

TEST(each_zone_is_clipped_after_its_own_sum_and_before_the_total) {
  /* Equation (8): interference in one zone does not close the gap of the other. Within a zone it
   * does: clipping link by link would give 7 .. 15. */
  lm_tolerance_link chain[3];
  chain[0] = link_of(1, 2, 10, LM_UNIFORM, LM_TEETH_GAP);
  chain[1] = link_of(-1, 20, 30, LM_UNIFORM, LM_GENERATOR_GAP);
  chain[2] = link_of(1, 5, 5, LM_UNIFORM, LM_GENERATOR_GAP);
  ACCEPTED(lm_worst_limits(chain, 3, &limits, &fault));
  close_to(-0.025, limits.signed_min_mm[LM_GENERATOR_GAP], 0);
  close_to(-0.015, limits.signed_max_mm[LM_GENERATOR_GAP], 0);
  close_to(0, limits.gap_max_mm[LM_GENERATOR_GAP], 0);
  close_to(0.002, limits.total_min_mm, 2e-6);
  close_to(0.010, limits.total_max_mm, 0);
  ACCEPTED(lm_probable_limits(chain, 3, 3, &limits, &fault));
  close_to(0.006 - 0.004 * sqrt(3), limits.signed_min_mm[LM_TEETH_GAP], 3e-5);
  close_to(0.002, limits.total_min_mm, 3e-5);
  close_to(0.010, limits.total_max_mm, 0);
}

/* The root of squares with K = 1.73 is wider than one uniform field or two. No part within its
 * drawing can be there; only a normal distribution exceeds its field, from t = 3 on. */
TEST(probable_limits_never_leave_what_the_parts_can_do) {
  lm_tolerance_link chain[2];
  chain[0] = link_of(1, -5, 5, LM_UNIFORM, LM_GENERATOR_GAP);
  chain[1] = link_of(0.5, 20, 32, LM_UNIFORM, LM_GENERATOR_GAP);
  ACCEPTED(lm_probable_limits(chain, 2, 3, &limits, &fault));
  close_to(0.013 - 0.008, limits.total_min_mm, 4e-6);
  close_to(0.013 + 0.008, limits.total_max_mm, 0);
  chain[1].distribution = LM_NORMAL;
  ACCEPTED(lm_probable_limits(chain, 2, LM_REAL(4.5), &limits, &fault));
  close_to(0.013 - 0.005 - 1.5 * 0.003, limits.total_min_mm, 4e-6);
  close_to(0.013 + 0.005 + 1.5 * 0.003, limits.total_max_mm, 0);
}

/* Each zone is a gap in one half of the drives and interference in the other: a quarter has
 * no gap. */
TEST(a_zone_that_may_interfere_adds_nothing_to_the_least_gap) {
  lm_tolerance_link chain[2];
  chain[0] = link_of(1, -10, 10, LM_NORMAL, LM_GENERATOR_GAP);
  chain[1] = link_of(1, -10, 10, LM_NORMAL, LM_TEETH_GAP);
  ACCEPTED(lm_probable_limits(chain, 2, 3, &limits, &fault));
  TEST_ASSERT_TRUE(limits.total_min_mm == 0);
  close_to(0.010 + 0.005 * sqrt(2), limits.total_max_mm, 0);
  chain[1] = link_of(1, 2, 10, LM_NORMAL, LM_TEETH_GAP);
  ACCEPTED(lm_probable_limits(chain, 2, 3, &limits, &fault));
  close_to(0.002, limits.total_min_mm, 4e-6);
}

TEST(one_normal_link_is_as_wide_probably_as_at_worst) {
  lm_tolerance_limits probable;
  const lm_tolerance_link one = link_of(-2, -7, -1, LM_NORMAL, LM_TEETH_GAP);
  ACCEPTED(lm_worst_limits(&one, 1, &limits, &fault));
  ACCEPTED(lm_probable_limits(&one, 1, 3, &probable, &fault));
  close_to(0.002, limits.total_min_mm, 4e-6);
  close_to(0.014, limits.total_max_mm, 0);
  close_to((double)limits.total_min_mm, probable.total_min_mm, 4e-6);
  close_to((double)limits.total_max_mm, probable.total_max_mm, 0);
}

TEST(probable_limits_are_the_root_of_squares_over_both_zones) {
  /* sum A E = 30 + 20 = 50 um; (A tau K / 3)^2: (3)^2 + (1.2247 4)^2 + (1.7321 2)^2 with tau = 3, 4
   * (A = -1), 4 (A = 1/2). */
  lm_tolerance_link chain[3];
  const double half = sqrt(9 + 1.5 * 16 + 3 * 4);
  chain[0] = link_of(1, 27, 33, LM_NORMAL, LM_GENERATOR_GAP);
  chain[1] = link_of(-1, -14, -6, LM_TRIANGULAR, LM_TEETH_GAP);
  chain[2] = link_of(0.5, 16, 24, LM_UNIFORM, LM_TEETH_GAP);
  ACCEPTED(lm_probable_limits(chain, 3, 3, &limits, &fault));
  close_to((50 - half) * 1e-3, limits.total_min_mm, 0);
  close_to((50 + half) * 1e-3, limits.total_max_mm, 0);
  close_to((20 - sqrt(36)) * 1e-3, limits.gap_min_mm[LM_TEETH_GAP], 0);
  close_to((20 + sqrt(36)) * 1e-3, limits.gap_max_mm[LM_TEETH_GAP], 0);
  ACCEPTED(lm_probable_limits(chain, 3, LM_REAL(1.5), &limits, &fault));
  close_to((50 + half / 2) * 1e-3, limits.total_max_mm, 0);
  ACCEPTED(lm_probable_limits(chain, 3, 0, &limits, &fault));
  close_to(0.050, limits.total_min_mm, 0);
  close_to(0.050, limits.total_max_mm, 0);
}

TEST(distribution_factors_are_three_sigma_over_tau) {
  /* Uniform: tau / sqrt 3; triangular: tau / sqrt 6; the truncated normal by scipy.stats.truncnorm
   * cut at 0.135 % a side. */
  close_to(1, lm_distribution_factor(LM_NORMAL), 0);
  close_to(0.9865775607186067, lm_distribution_factor(LM_NORMAL_INSPECTED), 0);
  close_to(3 / sqrt(6), lm_distribution_factor(LM_TRIANGULAR), 0);
  close_to(3 / sqrt(3), lm_distribution_factor(LM_UNIFORM), 0);
  close_to(0, lm_distribution_factor((lm_distribution)7), 0);
}

TEST(an_empty_chain_has_no_gap) {
  ACCEPTED(lm_worst_limits(0, 0, &limits, &fault));
  close_to(0, limits.total_max_mm, 0);
  ACCEPTED(lm_probable_limits(0, 0, 3, &limits, &fault));
  close_to(0, limits.total_max_mm, 0);
  ACCEPTED(lm_sample_gap(0, 0, &plan, workspace, sizeof(workspace) / sizeof(workspace[0]),
                         &statistics, &fault));
  close_to(0, statistics.mean_mm.value, 0);
  close_to(1, statistics.closed_share.value, 0);
  close_to(0, statistics.largest_mm, 0);
}

TEST(coverage_is_the_normal_integral) {
  /* scipy.stats.norm; 0.27 % outside at t = 3. */
  static const double t[] = {0, 0.5, 1, 2, 3, 4.5, 6};
  static const double share[] = {0,
                                 0.38292492254802624,
                                 0.68268949213708585,
                                 0.95449973610364158,
                                 0.99730020393673979,
                                 0.99999320465375052,
                                 0.99999999802682471};
  int i;
  for (i = 0; i < 7; i++) {
    ACCEPTED(lm_probable_coverage(LM_REAL(t[i]), &out, &fault));
    near_to(share[i], out, LM_REAL_BITS == 64 ? 2e-15 : 2e-6);
  }
  OUTSIDE("t", lm_probable_coverage(LM_REAL(-0.1), &out, fault_or_null));
  OUTSIDE("t", lm_probable_coverage(LM_REAL(6.1), &out, fault_or_null));
  REFUSED(LM_NULL, "share", lm_probable_coverage(3, 0, fault_or_null));
}

TEST(contributions_add_up_to_a_hundred_percent) {
  lm_tolerance_link chain[3];
  lm_real worst[3];
  lm_real probable[3];
  chain[0] = link_of(1, -3, 3, LM_NORMAL, LM_GENERATOR_GAP);
  chain[1] = link_of(-0.5, -8, 8, LM_NORMAL, LM_TEETH_GAP);
  chain[2] = link_of(1, -1, 1, LM_UNIFORM, LM_TEETH_GAP);
  ACCEPTED(lm_tolerance_contributions(chain, 3, worst, probable, &fault));
  close_to(37.5, worst[0], 0);
  close_to(50, worst[1], 0);
  close_to(12.5, worst[2], 0);
  close_to(900.0 / 28, probable[0], 0);
  close_to(1600.0 / 28, probable[1], 0);
  close_to(300.0 / 28, probable[2], 0);
  chain[0].upper_mm = chain[0].lower_mm;
  ACCEPTED(lm_tolerance_contributions(chain, 1, worst, probable, &fault));
  close_to(0, worst[0], 0);
  close_to(0, probable[0], 0);
  REFUSED(LM_NULL, "worst_percent or probable_percent",
          lm_tolerance_contributions(chain, 3, 0, probable, fault_or_null));
  REFUSED(LM_NULL, "worst_percent or probable_percent",
          lm_tolerance_contributions(chain, 3, worst, 0, fault_or_null));
  REFUSED(LM_NULL, "tolerance", lm_tolerance_contributions(0, 3, worst, probable, fault_or_null));
}

TEST(links_out_of_range_are_refused_by_name) {
  static const char *const name[] = {
      "tolerance.influence",    "tolerance.influence", "tolerance.lower_mm",
      "tolerance.lower_mm",     "tolerance.upper_mm",  "tolerance.distribution",
      "tolerance.distribution", "tolerance.zone",      "tolerance.zone"};
  lm_tolerance_link bad[9];
  lm_tolerance_link good = link_of(1, -3, 3, LM_NORMAL, LM_GENERATOR_GAP);
  int i;
  for (i = 0; i < 9; i++) {
    bad[i] = good;
  }
  bad[0].influence = 101;
  bad[1].influence = -101;
  bad[2].lower_mm = -11;
  bad[3].lower_mm = 11;
  bad[4].upper_mm = 11;
  bad[5].distribution = (lm_distribution)4;
  bad[6].distribution = (lm_distribution)-1;
  bad[7].zone = (lm_gap_zone)2;
  bad[8].zone = (lm_gap_zone)-1;
  for (i = 0; i < 9; i++) {
    OUTSIDE(name[i], lm_check_tolerance_links(&bad[i], 1, fault_or_null));
    OUTSIDE(name[i], lm_worst_limits(&bad[i], 1, &limits, fault_or_null));
    OUTSIDE(name[i], lm_probable_limits(&bad[i], 1, 3, &limits, fault_or_null));
  }
  good.influence = NAN_VALUE;
  REFUSED(LM_NOT_FINITE, "tolerance.influence", lm_check_tolerance_links(&good, 1, fault_or_null));
  good = link_of(1, 3, -3, LM_NORMAL, LM_GENERATOR_GAP);
  REFUSED(LM_INCONSISTENT, "tolerance.upper_mm", lm_check_tolerance_links(&good, 1, fault_or_null));
  REFUSED(LM_NULL, "tolerance", lm_check_tolerance_links(0, 1, fault_or_null));
  OUTSIDE("count", lm_check_tolerance_links(&good, -1, fault_or_null));
  OUTSIDE("count", lm_check_tolerance_links(&good, LM_TOLERANCE_CHAIN_MAX + 1, fault_or_null));
  REFUSED(LM_NULL, "limits", lm_worst_limits(0, 0, 0, fault_or_null));
  REFUSED(LM_NULL, "limits", lm_probable_limits(0, 0, 3, 0, fault_or_null));
  OUTSIDE("t", lm_probable_limits(0, 0, LM_REAL(6.1), &limits, fault_or_null));
  OUTSIDE("t", lm_probable_limits(0, 0, LM_REAL(-0.1), &limits, fault_or_null));
}

/* ---- normal quantile, Sobol points ---- */

TEST(normal_quantiles_keep_the_stated_error) {
  /* scipy.stats.norm.ppf; 0.075 is the seam of both approximations. */
  static const double p[] = {1e-10, 1e-6, 0.00135, 0.0243, 0.0749, 0.0751, 0.1, 0.3, 0.5};
  static const double z[] = {-6.361340902404056, -4.753424308822899,  -2.999976992703393,
                             -1.972084159029288, -1.440238267527963,  -1.43882539275254,
                             -1.2815515655446,   -0.5244005127080409, 0};
  int i;
  for (i = 0; i < 9; i++) {
    const double scale = fabs(z[i]) > 1 ? fabs(z[i]) : 1;
    ACCEPTED(lm_normal_tail_quantile(LM_REAL(p[i]), &out, &fault));
    near_to(z[i], out, LM_REAL_BITS == 64 ? 1e-14 * scale : 1e-6 * scale);
  }
  OUTSIDE("tail_probability", lm_normal_tail_quantile(0, &out, fault_or_null));
  OUTSIDE("tail_probability", lm_normal_tail_quantile(LM_REAL(0.51), &out, fault_or_null));
  REFUSED(LM_NULL, "quantile", lm_normal_tail_quantile(LM_REAL(0.5), 0, fault_or_null));
}

TEST(normal_quantiles_rise_and_invert_the_coverage) {
  double previous = -9;
  int k;
  for (k = 1; k <= 2000; k++) {
    lm_real share;
    const double p = 0.5 * k / 2000;
    ACCEPTED(lm_normal_tail_quantile(LM_REAL(p), &out, &fault));
    TEST_ASSERT_TRUE((double)out > previous);
    previous = (double)out;
    ACCEPTED(lm_probable_coverage(-out, &share, &fault));
    near_to(1 - 2 * p, share, LM_REAL_BITS == 64 ? 1e-14 : 1e-6);
  }
}

TEST(sobol_points_are_those_of_joe_and_kuo) {
  /* scipy.stats.qmc.Sobol(32, scramble=False, bits=32): first eight points of six dimensions, then
   * point 1000 of all. */
  static const int dimension[] = {0, 1, 2, 7, 19, 31};
  static const uint32_t first[6][8] = {{0u, 2147483648u, 3221225472u, 1073741824u, 1610612736u,
                                        3758096384u, 2684354560u, 536870912u},
                                       {0u, 2147483648u, 1073741824u, 3221225472u, 1610612736u,
                                        3758096384u, 536870912u, 2684354560u},
                                       {0u, 2147483648u, 1073741824u, 3221225472u, 2684354560u,
                                        536870912u, 3758096384u, 1610612736u},
                                       {0u, 2147483648u, 3221225472u, 1073741824u, 3758096384u,
                                        1610612736u, 536870912u, 2684354560u},
                                       {0u, 2147483648u, 1073741824u, 3221225472u, 536870912u,
                                        2684354560u, 1610612736u, 3758096384u},
                                       {0u, 2147483648u, 1073741824u, 3221225472u, 536870912u,
                                        2684354560u, 1610612736u, 3758096384u}};
  static const uint32_t at_1000[32] = {
      943718400u,  415236096u,  2227175424u, 2906652672u, 1203765248u, 3896508416u, 197132288u,
      3862953984u, 2151677952u, 297795584u,  364904448u,  1094713344u, 692060160u,  1648361472u,
      616562688u,  1589641216u, 3091202048u, 1480589312u, 4257218560u, 3116367872u, 2243952640u,
      2361393152u, 4081057792u, 2319450112u, 2503999488u, 3896508416u, 171966464u,  4206886912u,
      255852544u,  1463812096u, 633339904u,  624951296u};
  int d;
  for (d = 0; d < 6; d++) {
    ACCEPTED(lm_sobol_points(dimension[d], 0, 8, points, &fault));
    TEST_ASSERT_EQUAL_UINT32_ARRAY(first[d], points, 8);
  }
  for (d = 0; d < 32; d++) {
    ACCEPTED(lm_sobol_points(d, 0, 1001, points, &fault));
    TEST_ASSERT_EQUAL_UINT32(at_1000[d], points[1000]);
  }
  OUTSIDE("dimension", lm_sobol_points(-1, 0, 8, points, fault_or_null));
  OUTSIDE("dimension", lm_sobol_points(32, 0, 8, points, fault_or_null));
  OUTSIDE("count", lm_sobol_points(0, 0, 0, points, fault_or_null));
  OUTSIDE("count", lm_sobol_points(0, 0, (1 << 20) + 1, points, fault_or_null));
  REFUSED(LM_NULL, "points", lm_sobol_points(0, 0, 8, 0, fault_or_null));
}

TEST(scrambling_keeps_one_point_in_every_interval) {
  static unsigned char seen[1 << LOG2_SAMPLES];
  int d, i, bits;
  for (d = 0; d < 32; d++) {
    ACCEPTED(lm_sobol_points(d, 12345u + (uint32_t)d, 1 << LOG2_SAMPLES, points, &fault));
    for (bits = 1; bits <= LOG2_SAMPLES; bits++) {
      memset(seen, 0, sizeof(seen));
      for (i = 0; i < 1 << bits; i++) {
        const uint32_t interval = points[i] >> (32 - bits);
        TEST_ASSERT_EQUAL_INT(0, seen[interval]);
        seen[interval] = 1;
      }
    }
  }
}

TEST(scrambling_keeps_the_plane_net_of_the_first_two_dimensions) {
  /* Dimensions 0 and 1 form a (0, m, 2) net: one point in every box of 2^-a by 2^-(m-a). */
  enum { M = 10 };
  static uint32_t other[1 << M];
  static unsigned char seen[1 << M];
  int a, i;
  ACCEPTED(lm_sobol_points(0, 7u, 1 << M, points, &fault));
  ACCEPTED(lm_sobol_points(1, 8u, 1 << M, other, &fault));
  for (a = 1; a < M; a++) {
    memset(seen, 0, sizeof(seen));
    for (i = 0; i < 1 << M; i++) {
      const uint32_t box = ((points[i] >> (32 - a)) << (M - a)) | (other[i] >> (32 - (M - a)));
      TEST_ASSERT_EQUAL_INT(0, seen[box]);
      seen[box] = 1;
    }
  }
}

TEST(scrambled_points_are_uniform_over_the_seeds) {
  /* Points 0 and 5 of 4096 seeds, in 16 cells: chi square with 15 degrees of freedom stays below 44
   * (chance 1e-4); the correlation of neighbouring seeds below 4.5 / sqrt(4096). */
  int cell[2][16];
  double neighbours = 0;
  double previous = 0;
  int s, k, c;
  memset(cell, 0, sizeof(cell));
  for (s = 1; s <= 4096; s++) {
    double u;
    ACCEPTED(lm_sobol_points(3, (uint32_t)s, 6, points, &fault));
    cell[0][points[0] >> 28]++;
    cell[1][points[5] >> 28]++;
    u = points[0] / 4294967296.0 - 0.5;
    neighbours += 12 * u * previous;
    previous = u;
  }
  for (k = 0; k < 2; k++) {
    double chi_square = 0;
    for (c = 0; c < 16; c++) {
      chi_square += (cell[k][c] - 256.0) * (cell[k][c] - 256.0) / 256.0;
    }
    TEST_ASSERT_TRUE(chi_square < 44);
  }
  TEST_ASSERT_TRUE(fabs(neighbours) / 4096 < 4.5 / 64);
}

TEST(digits_are_scrambled_independently_once_two_points_have_parted) {
  /* Owen: two points with k leading binary digits in common keep them in common, differ in the next
   * and are independent after it: mean square distance 1.75 4^-k / 6. Points 2^j of dimension 0
   * part from point 0 after j - 1 digits. */
  int j, s;
  for (j = 1; j <= 5; j++) {
    const double expected = 1.75 / 6 * pow(4, 1 - j);
    double square = 0;
    for (s = 1; s <= 4096; s++) {
      double distance;
      ACCEPTED(lm_sobol_points(0, (uint32_t)s, (1 << j) + 1, points, &fault));
      distance = ((double)points[1 << j] - (double)points[0]) / 4294967296.0;
      square += distance * distance / 4096;
    }
    close_to(expected, LM_REAL(square), 0.05);
  }
}

/* ---- sampling ---- */

static void sample(const lm_tolerance_link *chain, int count) {
  ACCEPTED(lm_sample_gap(chain, count, &plan, workspace, sizeof(workspace) / sizeof(workspace[0]),
                         &statistics, &fault));
}

/* Within five standard errors, or the rounding of the sum. */
static void estimates(double expected, const lm_estimate *estimate) {
  const double rounding = LM_REAL_BITS == 64 ? 1e-12 : 1e-6;
  near_to(expected, estimate->value,
          5 * (double)estimate->standard_error + rounding * (fabs(expected) + 1e-3));
}

TEST(quantiles_are_those_of_each_distribution) {
  /* One link 100 .. 300 um (E = 200, tau = 100): quantiles at 10 and 90 % are E -+ tau q, with q =
   * 1.2815515655/3 normal; truncnorm cut at 0.135 % 1.2754217623/3; triangular 1 - sqrt 0.2;
   * uniform 0.8. */
  static const double q[] = {1.2815515655446 / 3, 1.275421762278421 / 3, 0.55278640450004, 0.8};
  int d;
  plan.low_probability = LM_REAL(0.1);
  plan.high_probability = LM_REAL(0.9);
  for (d = 0; d < 4; d++) {
    const lm_tolerance_link one = link_of(1, 100, 300, (lm_distribution)d, LM_TEETH_GAP);
    sample(&one, 1);
    near_to(0.2 - 0.1 * q[d], statistics.low_mm.value, 1e-5);
    near_to(0.2 + 0.1 * q[d], statistics.high_mm.value, 1e-5);
    near_to(0.2, statistics.median_mm.value, 2e-5);
    near_to(0.2, statistics.mean_mm.value, 1e-6);
    estimates(0.2, &statistics.mean_mm);
  }
}

TEST(normal_chains_without_clipping_agree_with_the_probable_formula) {
  lm_tolerance_link chain[6];
  int i;
  for (i = 0; i < 6; i++) {
    chain[i] = link_of(i % 2 == 0 ? 0.5 : -1, i % 2 == 0 ? 60 : -40, i % 2 == 0 ? 60 + 4 * i : -36,
                       LM_NORMAL, i < 3 ? LM_GENERATOR_GAP : LM_TEETH_GAP);
  }
  ACCEPTED(lm_probable_limits(chain, 6, 3, &limits, &fault));
  sample(chain, 6);
  estimates((double)(limits.total_min_mm + limits.total_max_mm) / 2, &statistics.mean_mm);
  estimates((double)(limits.total_min_mm + limits.total_max_mm) / 2, &statistics.median_mm);
  estimates((double)limits.total_min_mm, &statistics.low_mm);
  estimates((double)limits.total_max_mm, &statistics.high_mm);
  /* The errors themselves are small: 3 % of the half width. */
  TEST_ASSERT_TRUE(statistics.high_mm.standard_error <
                   LM_REAL(0.03) * (limits.total_max_mm - limits.total_min_mm) / 2);
  close_to(0, statistics.closed_share.value, 0);
}

TEST(bounded_distributions_stay_inside_the_worst_case) {
  lm_tolerance_link chain[5];
  int d, i;
  for (d = LM_NORMAL_INSPECTED; d <= LM_UNIFORM; d++) {
    for (i = 0; i < 5; i++) {
      chain[i] = link_of(i % 2 == 0 ? 1 : -1, i % 2 == 0 ? 10 : -25, i % 2 == 0 ? 30 + i : -8,
                         (lm_distribution)d, i < 2 ? LM_GENERATOR_GAP : LM_TEETH_GAP);
    }
    plan.low_probability = 0;
    plan.high_probability = 1;
    ACCEPTED(lm_worst_limits(chain, 5, &limits, &fault));
    sample(chain, 5);
    TEST_ASSERT_TRUE(statistics.smallest_mm >= limits.total_min_mm - LM_REAL(1e-7));
    TEST_ASSERT_TRUE(statistics.largest_mm <= limits.total_max_mm + LM_REAL(1e-7));
    TEST_ASSERT_TRUE(statistics.smallest_mm < statistics.low_mm.value);
    TEST_ASSERT_TRUE(statistics.largest_mm > statistics.high_mm.value);
  }
  /* A single link fills its whole field: 4096 points miss less than 1e-3 of a uniform one. */
  sample(chain, 1);
  ACCEPTED(lm_worst_limits(chain, 1, &limits, &fault));
  close_to((double)limits.total_min_mm, statistics.smallest_mm, 1e-3);
  close_to((double)limits.total_max_mm, statistics.largest_mm, 1e-3);
}

TEST(probabilities_zero_and_one_are_the_extremes_of_each_scrambling) {
  const lm_tolerance_link one = link_of(1, 10, 30, LM_UNIFORM, LM_TEETH_GAP);
  plan.low_probability = 0;
  plan.high_probability = 1;
  sample(&one, 1);
  near_to(0.010, statistics.low_mm.value, 2e-5);
  near_to(0.030, statistics.high_mm.value, 2e-5);
}

TEST(the_clipped_mean_is_not_the_clip_of_the_mean) {
  /* Sum of two normal links, mean mu, deviation s: E max(0, S) = mu Phi(mu/s) + s phi(mu/s). mu =
   * -2 um, s = sqrt 2 10/3 um: 1.0473949421574 um, though the mean sum is interference. */
  lm_tolerance_link chain[2];
  chain[0] = link_of(1, -12, 8, LM_NORMAL, LM_GENERATOR_GAP);
  chain[1] = link_of(-1, -10, 10, LM_NORMAL, LM_GENERATOR_GAP);
  ACCEPTED(lm_probable_limits(chain, 2, 0, &limits, &fault));
  close_to(0, limits.total_max_mm, 0); /* the clip of the mean */
  sample(chain, 2);
  near_to(1.0473949421574e-3, statistics.mean_mm.value, 1e-6);
  estimates(1.0473949421574e-3, &statistics.mean_mm);
  /* Closed: Phi(2 / 4.714) = 0.66431 of the drives. */
  near_to(0.6643140, statistics.closed_share.value, 2e-3);
  close_to(0, statistics.median_mm.value, 0);
  close_to(0, statistics.smallest_mm, 0);
}

TEST(zones_are_clipped_apart_in_every_sample) {
  /* Two zones, each one normal link: means of max(0, S) add up: 2.562242440805852 + 1.0473949421574
   * um from the closed form above. */
  lm_tolerance_link chain[3];
  chain[0] = link_of(1, -12, 8, LM_NORMAL, LM_GENERATOR_GAP);
  chain[1] = link_of(-1, -10, 10, LM_NORMAL, LM_GENERATOR_GAP);
  chain[2] = link_of(1, -8, 12, LM_NORMAL, LM_TEETH_GAP);
  sample(chain, 3);
  near_to(1.0473949421574e-3 + 2.562242440805852e-3, statistics.mean_mm.value, 2e-6);
}

TEST(the_reject_share_is_the_tail_above_the_limit) {
  const lm_tolerance_link one = link_of(1, 0, 40, LM_UNIFORM, LM_TEETH_GAP);
  plan.limit_mm = LM_REAL(0.030);
  sample(&one, 1);
  near_to(0.25, statistics.reject_share.value, 3e-4);
  plan.limit_mm = LM_REAL(0.041);
  sample(&one, 1);
  close_to(0, statistics.reject_share.value, 0);
}

TEST(a_link_without_tolerance_only_shifts) {
  lm_tolerance_link chain[2];
  lm_real mean;
  chain[0] = link_of(1, 10, 30, LM_TRIANGULAR, LM_TEETH_GAP);
  chain[1] = link_of(1, 5, 5, LM_NORMAL, LM_TEETH_GAP);
  sample(chain, 1);
  mean = statistics.mean_mm.value;
  sample(chain, 2);
  close_to((double)mean + 0.005, statistics.mean_mm.value, 1e-12);
}

TEST(thousands_of_equal_terms_lose_no_digit_in_the_mean) {
  /* 0.1 is no binary number: a plain float32 sum of 4096 of them is off by 3e-5. */
  const lm_tolerance_link one = link_of(1, 100, 100, LM_NORMAL, LM_TEETH_GAP);
  sample(&one, 1);
  TEST_ASSERT_TRUE(fabs((double)statistics.mean_mm.value / (double)LM_REAL(0.1) - 1) < 1.3e-7);
}

TEST(two_scramblings_lie_one_standard_error_on_either_side_of_their_mean) {
  /* sqrt(((a-m)^2 + (b-m)^2) / (2 1)) = |a - b| / 2; at probability 0, a and b are the smallest
   * gaps of the two scramblings. */
  const lm_tolerance_link one = link_of(1, 10, 30, LM_UNIFORM, LM_TEETH_GAP);
  plan.scramblings = 2;
  plan.low_probability = 0;
  plan.samples_log2 = LM_SAMPLES_LOG2_MIN;
  sample(&one, 1);
  close_to((double)statistics.smallest_mm,
           statistics.low_mm.value - statistics.low_mm.standard_error, 1e-12);
}

TEST(quantiles_interpolate_between_the_two_order_statistics_around_them) {
  /* 16 drives of a field -10 .. 10: the net puts eight below zero, so the median lies half way
   * between the eighth, 0, and the ninth. */
  const lm_tolerance_link one = link_of(1, -10, 10, LM_UNIFORM, LM_TEETH_GAP);
  plan.samples_log2 = LM_SAMPLES_LOG2_MIN;
  plan.low_probability = LM_REAL(7.5 / 16);  /* the eighth */
  plan.high_probability = LM_REAL(8.5 / 16); /* the ninth */
  sample(&one, 1);
  near_to(0, statistics.low_mm.value, 1e-8);
  TEST_ASSERT_TRUE(statistics.high_mm.value > 0);
  near_to((double)statistics.high_mm.value / 2, statistics.median_mm.value, 1e-8);
  close_to(0.5, statistics.closed_share.value, 0);
}

TEST(equal_seeds_give_equal_bits_and_other_seeds_do_not) {
  lm_tolerance_link chain[2];
  lm_gap_statistics first;
  chain[0] = link_of(1, -12, 8, LM_NORMAL, LM_GENERATOR_GAP);
  chain[1] = link_of(-1, -10, 10, LM_TRIANGULAR, LM_GENERATOR_GAP);
  sample(chain, 2);
  first = statistics;
  sample(chain, 2);
  TEST_ASSERT_EQUAL_MEMORY(&first, &statistics, sizeof(first));
  plan.seed = 2;
  sample(chain, 2);
  TEST_ASSERT_TRUE(first.mean_mm.value != statistics.mean_mm.value);
}

TEST(standard_errors_cover_the_truth_and_beat_plain_sampling) {
  /* Mean of a clipped sum over 40 seeds: the error in units of its standard error follows
   * Student's law with 7 degrees of freedom: |t| > 5.41 has a chance of 0.1 %; the mean
   * square of t is 1.4. */
  const double truth = 1.0473949421574e-3;
  lm_tolerance_link chain[2];
  double mean_square = 0;
  double largest = 0;
  double error = 0;
  int seed;
  chain[0] = link_of(1, -12, 8, LM_NORMAL, LM_GENERATOR_GAP);
  chain[1] = link_of(-1, -10, 10, LM_NORMAL, LM_GENERATOR_GAP);
  plan.samples_log2 = 8;
  for (seed = 1; seed <= 40; seed++) {
    double t;
    plan.seed = (uint32_t)seed;
    sample(chain, 2);
    t = ((double)statistics.mean_mm.value - truth) / (double)statistics.mean_mm.standard_error;
    mean_square += t * t / 40;
    largest = fabs(t) > largest ? fabs(t) : largest;
    error += (double)statistics.mean_mm.standard_error / 40;
  }
  TEST_ASSERT_TRUE(largest < 6);
  TEST_ASSERT_TRUE(mean_square > 0.6 && mean_square < 2.8);
  /* Plain sampling of 8 * 256 drives: standard deviation 2.0 um / sqrt(2048) = 4.4e-5 mm. */
  TEST_ASSERT_TRUE(error < 4.4e-5 / 5);
}

TEST(sampling_refuses_nonsense_by_name) {
  const lm_tolerance_link one = link_of(1, 0, 40, LM_UNIFORM, LM_TEETH_GAP);
  const size_t enough = sizeof(workspace) / sizeof(workspace[0]);
  lm_sampling_plan bad;
  statistics.mean_mm.value = -77;
#define PLAN_REFUSED(name, field, value) \
  bad = plan;                            \
  bad.field = (value);                   \
  OUTSIDE(name, lm_sample_gap(&one, 1, &bad, workspace, enough, &statistics, fault_or_null))
  PLAN_REFUSED("plan.samples_log2", samples_log2, 3);
  PLAN_REFUSED("plan.samples_log2", samples_log2, 21);
  PLAN_REFUSED("plan.scramblings", scramblings, 1);
  PLAN_REFUSED("plan.scramblings", scramblings, 65);
  PLAN_REFUSED("plan.low_probability", low_probability, LM_REAL(-0.1));
  PLAN_REFUSED("plan.low_probability", low_probability, LM_REAL(0.6));
  PLAN_REFUSED("plan.high_probability", high_probability, LM_REAL(0.4));
  PLAN_REFUSED("plan.high_probability", high_probability, LM_REAL(1.1));
  PLAN_REFUSED("plan.limit_mm", limit_mm, LM_REAL(-0.1));
  bad = plan;
  bad.limit_mm = NAN_VALUE;
  REFUSED(LM_NOT_FINITE, "plan.limit_mm",
          lm_sample_gap(&one, 1, &bad, workspace, enough, &statistics, fault_or_null));
  REFUSED(LM_NULL, "plan",
          lm_sample_gap(&one, 1, 0, workspace, enough, &statistics, fault_or_null));
  REFUSED(LM_NULL, "workspace",
          lm_sample_gap(&one, 1, &plan, 0, enough, &statistics, fault_or_null));
  REFUSED(LM_TOO_SMALL, "workspace_length",
          lm_sample_gap(&one, 1, &plan, workspace, enough - 1, &statistics, fault_or_null));
  REFUSED(LM_NULL, "statistics",
          lm_sample_gap(&one, 1, &plan, workspace, enough, 0, fault_or_null));
  REFUSED(LM_NULL, "tolerance",
          lm_sample_gap(0, 1, &plan, workspace, enough, &statistics, fault_or_null));
  TEST_ASSERT_EQUAL_DOUBLE(-77, (double)statistics.mean_mm.value);
}
