#include "lostmotion/shape.h"

#include "reference_drives.h"
#include "test.h"

static lm_fault fault;
static lm_shape shape;
static lm_generator generator;
static lm_neutral_line line;
static uint32_t seed;

/* Dimensionless shapes have the order of one. */
#define ROUNDING BOUND(4e-15, 2e-6)

void setUp(void) {
  seed = 1;
  memset(&fault, 0, sizeof fault);
  memset(&generator, 0, sizeof generator);
}

/* Every wave generator that the specification names; angles in degrees. */
typedef struct kind {
  lm_generator_type type;
  double beta_deg;
} kind;

static const kind kinds[] = {{LM_COSINE, 0},   {LM_ELLIPSE, 0}, {LM_ROLLERS, 0}, {LM_ROLLERS, 30},
                             {LM_ROLLERS, 35}, {LM_DISCS, 2.9}, {LM_DISCS, 20},  {LM_DISCS, 30},
                             {LM_DISCS, 68.7}, {LM_RING, 2.9},  {LM_RING, 30},   {LM_RING, 68.7}};
#define KINDS ((int)(sizeof kinds / sizeof kinds[0]))

static void make(const kind *k) {
  const lm_real beta = LM_REAL(k->beta_deg) * DEGREE;
  TEST_ASSERT_EQUAL(LM_OK, lm_make_shape(k->type, beta, &shape, &fault));
  generator.type = k->type;
  generator.contact_half_angle_rad = beta;
}

/* --- wave shapes ------------------------------------------------------------------------------ */

/* check_values.md, neutral line, table of check values: w, v, theta at 0, 15, .. 90 deg; curvature
 * at 0, largest |curvature|, force of the wave generator. */
typedef struct printed_shape {
  kind of;
  double wave[7][3];
  double curvature;
  double largest;
  double force;
} printed_shape;

static const printed_shape printed[] = {{{LM_COSINE, 0},
                                         {{1, 0, 0},
                                          {.86603, -.25, .75},
                                          {.5, -.43301, 1.29904},
                                          {0, -.5, 1.5},
                                          {-.5, -.43301, 1.29904},
                                          {-.86603, -.25, .75},
                                          {-1, 0, 0}},
                                         3,
                                         3,
                                         6},
                                        {{LM_ROLLERS, 0},
                                         {{1, 0, 0},
                                          {.84009, -.24738, .89121},
                                          {.44919, -.41969, 1.33997},
                                          {-.03620, -.47435, 1.39205},
                                          {-.48870, -.40368, 1.12023},
                                          {-.80507, -.23046, .61939},
                                          {-.91828, 0, 0}},
                                         4.279,
                                         4.279,
                                         13.44},
                                        {{LM_ROLLERS, 30},
                                         {{1, 0, 0},
                                          {.89481, -.25265, .55749},
                                          {.56914, -.44934, 1.24694},
                                          {.03897, -.53188, 1.68147},
                                          {-.52214, -.46716, 1.49153},
                                          {-.93643, -.27148, .86005},
                                          {-1.08794, 0, 0}},
                                         2.044,
                                         3.433,
                                         25.9},
                                        {{LM_ROLLERS, 35},
                                         {{1, 0, 0},
                                          {.91377, -.25435, .42033},
                                          {.63041, -.46138, 1.07412},
                                          {.10001, -.56209, 1.82834},
                                          {-.53012, -.50504, 1.75945},
                                          {-1.01603, -.29736, 1.04644},
                                          {-1.19665, 0, 0}},
                                         1.455,
                                         4.212,
                                         37.8},
                                        {{LM_DISCS, 20},
                                         {{1, 0, 0},
                                          {.86996, -.25043, .73732},
                                          {.49563, -.43384, 1.35619},
                                          {-.01390, -.49811, 1.50535},
                                          {-.50583, -.42818, 1.24599},
                                          {-.85534, -.24582, .69776},
                                          {-.98123, 0, 0}},
                                         2.816,
                                         2.816,
                                         17.0},
                                        {{LM_DISCS, 30},
                                         {{1, 0, 0},
                                          {.88256, -.25153, .64055},
                                          {.53823, -.44226, 1.28110},
                                          {.01825, -.51739, 1.60718},
                                          {-.51438, -.45082, 1.39240},
                                          {-.90253, -.26083, .79518},
                                          {-1.04376, 0, 0}},
                                         2.447,
                                         3.165,
                                         22.4}};
#define PRINTED ((int)(sizeof printed / sizeof printed[0]))

TEST(waves_are_the_printed_ones) {
  int k;
  int i;
  for (k = 0; k < PRINTED; k++) {
    make(&printed[k].of);
    for (i = 0; i < 7; i++) {
      const lm_wave wave = lm_evaluate_shape(&shape, LM_REAL(15 * i) * DEGREE);
      ASSERT_NEAR(6e-6, printed[k].wave[i][0], wave.radial);
      ASSERT_NEAR(6e-6, printed[k].wave[i][1], wave.tangential);
      ASSERT_NEAR(6e-6, printed[k].wave[i][2], wave.rotation);
    }
  }
}

TEST(curvatures_and_forces_are_the_printed_ones) {
  int k;
  for (k = 0; k < PRINTED; k++) {
    make(&printed[k].of);
    ASSERT_NEAR(6e-4, printed[k].curvature, lm_evaluate_shape(&shape, 0).curvature);
    ASSERT_NEAR(6e-4, printed[k].largest, lm_largest_shape_curvature(&shape));
    ASSERT_NEAR(printed[k].force < 14 ? 6e-3 : 6e-2, printed[k].force,
                lm_shape_generator_force(&shape));
  }
  make(&kinds[1]); /* the ellipse, to first order the cosine */
  ASSERT_NEAR(0, 6, lm_shape_generator_force(&shape));
}

/* check_values.md, neutral line: C of discs at 20, 30, 40 deg, the constant part of w in the
 * contact. */
TEST(discs_have_the_radius_of_their_contact) {
  static const double c[] = {-2.816, -2.447, -2.192};
  int i;
  for (i = 0; i < 3; i++) {
    const kind discs = {LM_DISCS, 20 + 10 * i};
    make(&discs);
    ASSERT_NEAR(6e-4, c[i], shape.inner[0]);
    ASSERT_NEAR(6e-4, 1 - c[i], shape.inner[1]);
  }
}

TEST(curvature_extremes_bound_the_curvature_and_are_met) {
  int k;
  int i;
  for (k = 0; k < KINDS; k++) {
    double low = 99;
    double high = -99;
    make(&kinds[k]);
    for (i = 0; i <= 9000; i++) {
      const double at = (double)lm_evaluate_shape(&shape, LM_REAL(i) / 100 * DEGREE).curvature;
      low = fmin(low, at);
      high = fmax(high, at);
    }
    ASSERT_NEAR(2e-3, fmax(high, -low), lm_largest_shape_curvature(&shape));
    ASSERT_NEAR(2e-3, (high - low) / 2, lm_shape_curvature_amplitude(&shape));
  }
}

/* w has slope `slope`, v' = -w (inextensible), theta = v - w', curvature = -(w'' + w). */
TEST(waves_are_their_own_derivatives) {
  const lm_real step = LM_REAL(BOUND(1e-4, 1e-2));
  const double bound = BOUND(2e-6, 2e-2); /* the curvature has a kink at beta */
  int k;
  int i;
  for (k = 0; k < KINDS; k++) {
    make(&kinds[k]);
    for (i = -100; i <= 100; i++) {
      const lm_real at = LM_REAL(i) * DEGREE * LM_REAL(1.013);
      const lm_wave here = lm_evaluate_shape(&shape, at);
      const lm_wave below = lm_evaluate_shape(&shape, at - step);
      const lm_wave above = lm_evaluate_shape(&shape, at + step);
      const double twice = 2 * (double)step;
      ASSERT_NEAR(bound, (double)(above.radial - below.radial) / twice, here.slope);
      ASSERT_NEAR(bound, (double)(above.tangential - below.tangential) / twice, -here.radial);
      ASSERT_NEAR(ROUNDING, here.tangential - here.slope, here.rotation);
      ASSERT_NEAR(BOUND(2e-3, 0.1),
                  -(double)(above.slope - below.slope) / twice - (double)here.radial,
                  here.curvature);
    }
  }
}

TEST(waves_have_no_mean_and_start_at_one) {
  int k;
  int i;
  for (k = 0; k < KINDS; k++) {
    double sum = 0;
    make(&kinds[k]);
    for (i = 0; i < 3000; i++) {
      sum += (double)lm_evaluate_shape(&shape, HALF_PI * (LM_REAL(i) + LM_REAL(0.5)) / 3000).radial;
    }
    ASSERT_NEAR(BOUND(1e-6, 1e-5), 0, sum / 3000);
    ASSERT_NEAR(ROUNDING, 1, lm_evaluate_shape(&shape, 0).radial);
    ASSERT_NEAR(ROUNDING, 0, lm_evaluate_shape(&shape, 0).tangential);
    ASSERT_NEAR(ROUNDING, 0, lm_evaluate_shape(&shape, HALF_PI).tangential);
    ASSERT_NEAR(ROUNDING, 0, lm_evaluate_shape(&shape, HALF_PI).slope);
  }
}

TEST(waves_are_smooth_where_the_contact_ends) {
  const lm_real hair = LM_REAL(BOUND(1e-12, 1e-6));
  int k;
  for (k = 2; k < KINDS; k++) {
    lm_wave before;
    lm_wave after;
    make(&kinds[k]);
    before = lm_evaluate_shape(&shape, shape.contact_half_angle_rad - hair);
    after = lm_evaluate_shape(&shape, shape.contact_half_angle_rad + hair);
    ASSERT_NEAR(BOUND(1e-10, 2e-5), before.radial, after.radial);
    ASSERT_NEAR(BOUND(1e-10, 2e-5), before.tangential, after.tangential);
    ASSERT_NEAR(BOUND(1e-10, 2e-5), before.slope, after.slope);
    ASSERT_NEAR(BOUND(1e-9, 1e-4), before.curvature, after.curvature);
  }
}

/* The same shape as a Fourier series, sum over n = 2, 4, .. of cos(n beta) cos(n phi)/(n^2
 * - 1)^2. */
TEST(rollers_are_their_fourier_series) {
  const double pi = 3.14159265358979323846;
  int k;
  int i;
  int n;
  for (k = 0; k <= 35; k += 5) {
    const kind rollers = {LM_ROLLERS, k};
    const double beta = k * pi / 180;
    double at_zero = 0;
    make(&rollers);
    for (n = 2; n < 4000; n += 2) {
      at_zero += cos(n * beta) / pow(n * n - 1.0, 2);
    }
    for (i = 0; i <= 90; i += 6) {
      const double phi = i * pi / 180;
      double sum = 0;
      for (n = 2; n < 4000; n += 2) {
        sum += cos(n * beta) * cos(n * phi) / pow(n * n - 1.0, 2);
      }
      ASSERT_NEAR(BOUND(5e-10, 3e-6), sum / at_zero,
                  lm_evaluate_shape(&shape, LM_REAL(i) * DEGREE).radial);
    }
  }
}

TEST(waves_repeat_every_half_turn_and_mirror) {
  int k;
  int i;
  for (k = 0; k < KINDS; k++) {
    make(&kinds[k]);
    for (i = 0; i < 40; i++) {
      const lm_real at = LM_REAL(draw(&seed, -1.6, 1.6));
      const lm_wave wave = lm_evaluate_shape(&shape, at);
      const lm_wave mirrored = lm_evaluate_shape(&shape, -at);
      const lm_wave later = lm_evaluate_shape(&shape, at + 3 * LM_PI);
      const lm_wave across = lm_evaluate_shape(&shape, LM_PI - at);
      const double bound = BOUND(1e-13, 1e-4);
      ASSERT_NEAR(0, wave.radial, mirrored.radial);
      ASSERT_NEAR(0, -wave.tangential, mirrored.tangential);
      ASSERT_NEAR(0, -wave.rotation, mirrored.rotation);
      ASSERT_NEAR(0, -wave.slope, mirrored.slope);
      ASSERT_NEAR(0, wave.curvature, mirrored.curvature);
      ASSERT_NEAR(bound, wave.radial, later.radial);
      ASSERT_NEAR(bound, wave.rotation, later.rotation);
      ASSERT_NEAR(bound, wave.radial, across.radial);
      ASSERT_NEAR(bound, -wave.tangential, across.tangential);
    }
  }
}

/* Angles up to the largest number there is, i = -FAR .. FAR. */
#define FAR 80

static lm_real far_angle(int i) {
  return LM_REAL(i) / FAR * LM_REAL(i % 3 == 0 ? BOUND(DBL_MAX, (double)FLT_MAX) : 1e18);
}

/* Any finite angle gives a wave, for any number of turns. */
TEST(a_wave_stays_in_its_bounds_at_any_angle) {
  int k;
  int i;
  for (k = 0; k < KINDS; k++) {
    make(&kinds[k]);
    for (i = -FAR; i <= FAR; i++) {
      const lm_real at = far_angle(i);
      const lm_wave wave = lm_evaluate_shape(&shape, at);
      TEST_ASSERT_TRUE(wave.radial <= LM_REAL(1.00001) && wave.radial >= LM_REAL(-2));
      TEST_ASSERT_TRUE(wave.tangential <= LM_REAL(0.7) && wave.tangential >= LM_REAL(-0.7));
    }
  }
}

static void assert_refused(lm_status status, const char *input, lm_real value, lm_real low,
                           lm_real high, lm_status found) {
  TEST_ASSERT_EQUAL(status, found);
  TEST_ASSERT_EQUAL(status, fault.status);
  TEST_ASSERT_EQUAL_STRING(input, fault.input);
  TEST_ASSERT_TRUE(fault.found == value || (isnan(fault.found) && isnan(value)));
  TEST_ASSERT_TRUE(fault.low == low);
  TEST_ASSERT_TRUE(fault.high == high);
}

TEST(shapes_refuse_nonsense_and_write_nothing) {
  const char *angle = "generator.contact_half_angle_rad";
  const lm_real nan = LM_REAL(NAN);
  const lm_real rollers = LM_REAL(0.6108652381980153); /* 35 deg */
  const lm_real low = LM_REAL(0.05);
  const lm_real high = LM_REAL(1.2);
  lm_shape before;
  memset(&shape, 0x55, sizeof shape);
  before = shape;
  assert_refused(LM_NULL, "shape", 0, 0, 0, lm_make_shape(LM_DISCS, LM_REAL(0.5), 0, &fault));
  assert_refused(LM_OUT_OF_RANGE, "generator.type", 5, 0, 4,
                 lm_make_shape((lm_generator_type)5, LM_REAL(0.5), &shape, &fault));
  assert_refused(LM_OUT_OF_RANGE, angle, LM_REAL(0.04), low, high,
                 lm_make_shape(LM_DISCS, LM_REAL(0.04), &shape, &fault));
  assert_refused(LM_OUT_OF_RANGE, angle, LM_REAL(1.3), low, high,
                 lm_make_shape(LM_RING, LM_REAL(1.3), &shape, &fault));
  assert_refused(LM_NOT_FINITE, angle, nan, low, high,
                 lm_make_shape(LM_DISCS, nan, &shape, &fault));
  assert_refused(LM_OUT_OF_RANGE, angle, LM_REAL(0.62), 0, rollers,
                 lm_make_shape(LM_ROLLERS, LM_REAL(0.62), &shape, &fault));
  assert_refused(LM_OUT_OF_RANGE, angle, LM_REAL(-0.1), 0, rollers,
                 lm_make_shape(LM_ROLLERS, LM_REAL(-0.1), &shape, &fault));
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_make_shape((lm_generator_type)5, 0, &shape, 0));
  TEST_ASSERT_EQUAL_MEMORY(&before, &shape, sizeof shape);
  TEST_ASSERT_EQUAL(LM_OK, lm_make_shape(LM_COSINE, nan, &shape, &fault)); /* not used there */
  TEST_ASSERT_EQUAL(LM_OK, lm_make_shape(LM_ROLLERS, LM_REAL(35) * DEGREE, &shape, &fault));
}

/* --- neutral line ----------------------------------------------------------------------------- */

static void make_line(lm_deformation deformation, double radius, double deflection) {
  TEST_ASSERT_EQUAL_MESSAGE(
      LM_OK,
      lm_make_neutral_line(&generator, deformation, LM_REAL(radius), LM_REAL(deflection),
                           LM_NEUTRAL_LINE_NODES, &line, &fault),
      fault.input);
}

/* check_values.md, reference drive A: c0 of reference A on discs of 30 deg. */
TEST(the_offset_of_reference_a) {
  const kind discs = {LM_DISCS, 30};
  make(&discs);
  make_line(LM_INTERNAL, 25.1125, 0.2375);
  ASSERT_NEAR(BOUND(6e-7, 1e-6), -0.002446, line.offset_mm);
  ASSERT_NEAR(BOUND(1e-12, 4e-6), 25.1125 + 0.2375, lm_place_tooth(&line, 0).radius_mm);
}

/* Length of the line from polar angle 0, by Simpson's rule over its own radius and slope, the zones
 * of the shape apart. */
static double length_to(double polar) {
  enum { PIECES = 400 };
  const double junction = (double)line.shape.contact_half_angle_rad;
  double sum = 0;
  int zone;
  int i;
  for (zone = 0; zone < 2; zone++) {
    const double from = zone == 0 ? 0 : fmin(junction, polar);
    const double to = zone == 0 ? fmin(junction, polar) : polar;
    for (i = 0; i <= PIECES; i++) {
      const double weight = i == 0 || i == PIECES ? 1 : i % 2 == 1 ? 4 : 2;
      lm_real radius;
      lm_real slope;
      lm_neutral_radius(&line, LM_REAL(from + (to - from) * i / (double)PIECES), &radius, &slope);
      sum += weight * hypot((double)radius, (double)slope) * (to - from) / (double)PIECES / 3;
    }
  }
  return sum;
}

static const double deflections[] = {1e-4, 3e-3, 0.01, 0.04, 0.125}; /* of the radius */

/* For every wave generator, direction and deflection up to an eighth of the radius: the line keeps
 * its length and is displaced by w0 on the axis, and every tooth keeps its arc from the axis.
 */
TEST(the_line_keeps_its_length_and_every_tooth_its_arc) {
  int k;
  int d;
  int sense;
  int i;
  for (k = 0; k < KINDS; k++) {
    make(&kinds[k]);
    for (d = 0; d < 5; d++) {
      for (sense = 0; sense < 2; sense++) {
        const double r = 20;
        const double w = r * deflections[d];
        lm_real radius;
        lm_real slope;
        make_line(sense == 0 ? LM_INTERNAL : LM_EXTERNAL, r, w);
        lm_neutral_radius(&line, 0, &radius, &slope);
        ASSERT_NEAR(BOUND(1e-11, 2e-5), sense == 0 ? r + w : r - w, radius);
        ASSERT_NEAR(BOUND(1e-12, 1e-5), 0, slope);
        ASSERT_NEAR(BOUND(1e-9, 2e-5), r * 1.5707963267948966, length_to(1.5707963267948966));
        for (i = 1; i < 9; i++) {
          const double at = 0.19 * i;
          const lm_placement place = lm_place_tooth(&line, LM_REAL(at));
          const double bound = BOUND(d < 3 ? 1e-9 : d < 4 ? 2e-8 : 1e-6, 1e-6);
          ASSERT_NEAR(bound * r, r * at, length_to(at + (double)place.lead_rad));
        }
        ASSERT_NEAR(BOUND(d < 3   ? 1e-9
                          : d < 4 ? 2e-8
                                  : 1e-6,
                          2e-6),
                    0, lm_place_tooth(&line, HALF_PI).lead_rad);
      }
    }
  }
}

/* A tooth's foot is on the line, its axis normal to it: mu = -atan2(R', R). */
TEST(teeth_stand_upright_on_the_line) {
  int k;
  int i;
  for (k = 0; k < KINDS; k++) {
    make(&kinds[k]);
    make_line(kinds[k].type == LM_RING ? LM_EXTERNAL : LM_INTERNAL, 25, 0.25);
    for (i = -9; i <= 9; i++) {
      const lm_real at = LM_REAL(0.17) * LM_REAL(i);
      const lm_placement place = lm_place_tooth(&line, at);
      lm_real radius;
      lm_real slope;
      double tilt;
      lm_neutral_radius(&line, at + place.lead_rad, &radius, &slope);
      tilt = -atan2((double)slope, (double)radius);
      ASSERT_NEAR(BOUND(1e-12, 1e-5), radius, place.radius_mm);
      ASSERT_NEAR(BOUND(1e-14, 3e-7), sin(tilt), place.tilt_sin);
      ASSERT_NEAR(BOUND(1e-14, 3e-7), cos(tilt), place.tilt_cos);
    }
  }
}

TEST(the_slope_of_the_line_is_its_derivative) {
  const lm_real step = LM_REAL(BOUND(1e-5, 1e-2));
  int k;
  int i;
  for (k = 0; k < KINDS; k++) {
    make(&kinds[k]);
    generator.cam_offset_mm = LM_REAL(k == 1 ? 5 : 0);
    make_line(kinds[k].type == LM_RING ? LM_EXTERNAL : LM_INTERNAL, 25, 1);
    for (i = -12; i <= 12; i++) {
      const lm_real at = LM_REAL(0.16) * LM_REAL(i);
      lm_real radius;
      lm_real slope;
      lm_real above;
      lm_real below;
      lm_real unused;
      lm_neutral_radius(&line, at, &radius, &slope);
      lm_neutral_radius(&line, at + step, &above, &unused);
      lm_neutral_radius(&line, at - step, &below, &unused);
      ASSERT_NEAR(BOUND(1e-8, 3e-3), (double)(above - below) / (2 * (double)step), slope);
    }
  }
}

TEST(the_line_repeats_every_half_turn_and_mirrors) {
  int k;
  int i;
  for (k = 0; k < KINDS; k++) {
    make(&kinds[k]);
    make_line(kinds[k].type == LM_RING ? LM_EXTERNAL : LM_INTERNAL, 25, 0.25);
    for (i = 0; i < 20; i++) {
      const lm_real at = LM_REAL(draw(&seed, -1.5, 1.5));
      const lm_placement place = lm_place_tooth(&line, at);
      const lm_placement mirrored = lm_place_tooth(&line, -at);
      const lm_placement later = lm_place_tooth(&line, at - 2 * LM_PI);
      lm_real radius[3];
      lm_real slope[3];
      lm_neutral_radius(&line, at, &radius[0], &slope[0]);
      lm_neutral_radius(&line, -at, &radius[1], &slope[1]);
      lm_neutral_radius(&line, at + LM_PI, &radius[2], &slope[2]);
      ASSERT_NEAR(0, radius[0], radius[1]);
      ASSERT_NEAR(0, -slope[0], slope[1]);
      ASSERT_NEAR(BOUND(1e-12, 1e-5), radius[0], radius[2]);
      ASSERT_NEAR(BOUND(1e-12, 1e-5), slope[0], slope[2]);
      ASSERT_NEAR(0, -place.lead_rad, mirrored.lead_rad);
      ASSERT_NEAR(0, place.radius_mm, mirrored.radius_mm);
      ASSERT_NEAR(0, -place.tilt_sin, mirrored.tilt_sin);
      ASSERT_NEAR(0, place.tilt_cos, mirrored.tilt_cos);
      ASSERT_NEAR(BOUND(1e-14, 2e-7), place.lead_rad, later.lead_rad);
      ASSERT_NEAR(BOUND(1e-14, 1e-6), place.tilt_sin, later.tilt_sin);
    }
  }
}

/* Fourth order: with four times the nodes at most a hundredth of the error. The error of the
 * standard number is below 3e-6 arcmin on every wave generator, 5e-7 on those of a usual contact
 * angle. */
TEST(more_nodes_converge) {
  static lm_neutral_line finest;
  int k;
  for (k = 0; k < KINDS; k++) {
    static const int nodes[] = {8, 32, LM_NEUTRAL_LINE_NODES};
    double error[3] = {0};
    const lm_deformation deformation = kinds[k].type == LM_RING ? LM_EXTERNAL : LM_INTERNAL;
    int n;
    int i;
    make(&kinds[k]);
    TEST_ASSERT_EQUAL(
        LM_OK, lm_make_neutral_line(&generator, deformation, LM_REAL(25.1125), LM_REAL(0.2375),
                                    LM_NEUTRAL_LINE_NODES_MAX, &finest, &fault));
    for (n = 0; n < 3; n++) {
      TEST_ASSERT_EQUAL(LM_OK, lm_make_neutral_line(&generator, deformation, LM_REAL(25.1125),
                                                    LM_REAL(0.2375), nodes[n], &line, &fault));
      for (i = 0; i <= 500; i++) {
        const lm_real at = HALF_PI * LM_REAL(i) / 500;
        const lm_real off =
            lm_place_tooth(&line, at).lead_rad - lm_place_tooth(&finest, at).lead_rad;
        error[n] = fmax(error[n], fabs(in_arcmin(off)));
      }
    }
    TEST_ASSERT_TRUE(error[2] < BOUND(kinds[k].beta_deg > 60 ? 3e-6 : 6e-7, 5e-5));
    TEST_ASSERT_TRUE(error[1] < error[0] / BOUND(100, 20));
  }
}

TEST(a_larger_ring_has_the_same_angles) {
  static lm_neutral_line larger;
  int k;
  int i;
  for (k = 0; k < KINDS; k++) {
    make(&kinds[k]);
    make_line(LM_INTERNAL, 25, 0.25);
    larger = line;
    make_line(LM_INTERNAL, 1000, 10);
    for (i = 0; i < 10; i++) {
      const lm_real at = LM_REAL(0.15) * LM_REAL(i);
      ASSERT_NEAR(BOUND(1e-13, 2e-6), lm_place_tooth(&larger, at).lead_rad,
                  lm_place_tooth(&line, at).lead_rad);
    }
  }
}

/* check_values.md, neutral line, elliptical cam: r_m 25.11, w0 0.23, ellipse of the same perimeter
 * minus the cosine, um at 0, 15, .. 90 deg. */
TEST(the_ellipse_leaves_the_cosine_as_printed) {
  static const double micron[] = {0, -0.9, -2.7, -3.7, -3.2, -1.8, -1.1};
  const kind ellipse = {LM_ELLIPSE, 0};
  int i;
  make(&ellipse);
  make_line(LM_INTERNAL, 25.11, 0.23);
  for (i = 0; i < 7; i++) {
    const double polar = i * 3.14159265358979323846 / 12;
    lm_real radius;
    lm_real slope;
    lm_neutral_radius(&line, LM_REAL(polar), &radius, &slope);
    ASSERT_NEAR(BOUND(0.06, 4), micron[i], 1000 * ((double)radius - 25.11 - 0.23 * cos(2 * polar)));
  }
}

/* With a cam offset the neutral line is the cam's parallel curve: each of its points has the offset
 * as its smallest distance from the ellipse. Both senses, deflection and offset up to the limit. */
TEST(the_line_runs_parallel_to_the_cam) {
  static const double offset[] = {0, 1, 5, 12.5};
  static const double deflection[] = {0.25, 1, 3.125};
  const kind ellipse = {LM_ELLIPSE, 0};
  int sense;
  int o;
  int d;
  int i;
  int j;
  make(&ellipse);
  for (o = 0; o < 4; o++) {
    for (d = 0; d < 3; d++) {
      for (sense = 0; sense < 2; sense++) {
        generator.cam_offset_mm = LM_REAL(offset[o]);
        make_line(sense == 0 ? LM_INTERNAL : LM_EXTERNAL, 25, deflection[d]);
        ASSERT_NEAR(BOUND(1e-9, 2e-5) * 25, 25 * 1.5707963267948966, length_to(1.5707963267948966));
        for (i = 0; i <= 30; i++) {
          const double polar = 1.5707963267948966 * i / 30;
          double nearest = 1e9;
          double x;
          double y;
          lm_real radius;
          lm_real slope;
          lm_neutral_radius(&line, LM_REAL(polar), &radius, &slope);
          x = (double)radius * cos(polar);
          y = (double)radius * sin(polar);
          for (j = 0; j <= 4000; j++) {
            const double t = 1.5707963267948966 * j / 4000;
            nearest = fmin(nearest, hypot(x - (double)line.along_mm * cos(t),
                                          y - (double)line.across_mm * sin(t)));
          }
          ASSERT_NEAR(offset[o] == 0 ? 1e-2 : 2e-4, offset[o], nearest);
        }
      }
    }
  }
}

/* The rates of a moving tooth against differences of fourth order of its placement. */
TEST(a_moving_tooth_has_the_rates_of_its_placements) {
  const double h = 2e-3;
  int k;
  int i;
  for (k = 0; k < KINDS; k++) {
    make(&kinds[k]);
    make_line(kinds[k].type == LM_RING ? LM_EXTERNAL : LM_INTERNAL, 25, 0.25);
    for (i = -8; i <= 8; i++) {
      const double at = 0.17 * i + 0.03; /* not at the end of a contact: the shear jumps there */
      const lm_placement here = lm_place_tooth(&line, LM_REAL(at));
      lm_placement_rate rate;
      const lm_placement moved = lm_move_tooth(&line, LM_REAL(at), &rate);
      lm_placement near[4];
      double tilt[4];
      int j;
      TEST_ASSERT_EQUAL_MEMORY(&here, &moved, sizeof here);
      for (j = 0; j < 4; j++) {
        near[j] = lm_place_tooth(&line, LM_REAL(at + h * (j < 2 ? j - 2 : j - 1)));
        tilt[j] = atan2((double)near[j].tilt_sin, (double)near[j].tilt_cos);
      }
#define RATE(of) ((of(0) - of(3) + 8 * (of(2) - of(1))) / (12 * h))
#define LEAD_OF(j) (double)near[j].lead_rad
#define RADIUS_OF(j) (double)near[j].radius_mm
#define TILT_OF(j) tilt[j]
      ASSERT_NEAR(BOUND(2e-7, 2e-4), RATE(LEAD_OF), rate.lead);
      ASSERT_NEAR(BOUND(1e-7, 1e-2), RATE(RADIUS_OF), rate.radius_mm);
      ASSERT_NEAR(BOUND(2e-7, 2e-4), RATE(TILT_OF), rate.tilt);
    }
  }
}

/* Any finite angle has an entry in the table. */
TEST(teeth_are_placed_at_any_angle) {
  int k;
  int i;
  for (k = 0; k < KINDS; k++) {
    make(&kinds[k]);
    make_line(LM_INTERNAL, 25, 0.25);
    for (i = -FAR; i <= FAR; i++) {
      const lm_real at = far_angle(i);
      const lm_placement place = lm_place_tooth(&line, at);
      lm_real radius;
      lm_real slope;
      lm_neutral_radius(&line, at, &radius, &slope);
      ASSERT_NEAR(0.4, 25, radius);
      ASSERT_NEAR(0.4, 25, place.radius_mm);
      ASSERT_NEAR(0.02, 0, place.lead_rad);
    }
  }
}

TEST(neutral_lines_refuse_nonsense_and_write_nothing) {
  static lm_neutral_line before;
  const lm_real nan = LM_REAL(NAN);
  const lm_real inf = LM_REAL(INFINITY);
  const lm_real radius = 25;
  const kind discs = {LM_DISCS, 30};
#define LINE(generator, r, w, n) \
  lm_make_neutral_line(generator, LM_INTERNAL, r, w, n, &line, &fault)
  make(&discs);
  memset(&line, 0x55, sizeof line);
  before = line;
  assert_refused(LM_NULL, "generator", 0, 0, 0, LINE(0, 25, 1, 96));
  assert_refused(LM_NULL, "line", 0, 0, 0,
                 lm_make_neutral_line(&generator, LM_INTERNAL, 25, 1, 96, 0, &fault));
  assert_refused(LM_OUT_OF_RANGE, "flexspline.neutral_radius_mm", 0, LM_REAL(0.1), LM_REAL(1e4),
                 LINE(&generator, 0, 1, 96));
  assert_refused(LM_NOT_FINITE, "flexspline.neutral_radius_mm", nan, LM_REAL(0.1), LM_REAL(1e4),
                 LINE(&generator, nan, 1, 96));
  assert_refused(LM_OUT_OF_RANGE, "generator.deflection_mm", 0, LM_REAL(1e-4) * radius,
                 LM_REAL(3.125), LINE(&generator, radius, 0, 96));
  assert_refused(LM_OUT_OF_RANGE, "generator.deflection_mm", 4, LM_REAL(1e-4) * radius,
                 LM_REAL(3.125), LINE(&generator, radius, 4, 96));
  assert_refused(LM_NOT_FINITE, "generator.deflection_mm", inf, LM_REAL(1e-4) * radius,
                 LM_REAL(3.125), LINE(&generator, radius, inf, 96));
  assert_refused(LM_OUT_OF_RANGE, "nodes", 7, 8, LM_NEUTRAL_LINE_NODES_MAX,
                 LINE(&generator, radius, 1, 7));
  assert_refused(LM_OUT_OF_RANGE, "nodes", 257, 8, LM_NEUTRAL_LINE_NODES_MAX,
                 LINE(&generator, radius, 1, 257));
  generator.cam_offset_mm = 13;
  assert_refused(LM_OUT_OF_RANGE, "generator.cam_offset_mm", 13, 0, LM_REAL(12.5),
                 LINE(&generator, radius, 1, 96));
  generator.type = (lm_generator_type)9;
  assert_refused(LM_OUT_OF_RANGE, "generator.type", 9, 0, 4, LINE(&generator, radius, 1, 96));
#undef LINE
  TEST_ASSERT_EQUAL_MEMORY(&before, &line, sizeof line);
}
