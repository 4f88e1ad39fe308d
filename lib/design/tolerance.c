#include "lostmotion/tolerance.h"

#include "real_math.h"
#include "refuse.h"

#define INFLUENCE_MAX LM_REAL(100)
#define DEVIATION_MAX_MM LM_REAL(10)
#define MM_PER_UM LM_REAL(1e-3)

/* ---- Pairs and grades ---- */

lm_real lm_clearance_max(lm_real hole_upper_mm, lm_real shaft_lower_mm) {
  return hole_upper_mm - shaft_lower_mm;
}

lm_real lm_clearance_min(lm_real hole_lower_mm, lm_real shaft_upper_mm) {
  return hole_lower_mm - shaft_upper_mm;
}

#define IT_FIRST 3
#define IT_LAST 16
#define IT_STEPS 13

/* ISO 286-1: end of each step of diameters in mm, and the table in um from IT3 on. */
static const double it_end_mm[IT_STEPS] = {3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500};
static const double it_field_um[IT_STEPS][IT_LAST - IT_FIRST + 1] = {
    {2, 3, 4, 6, 10, 14, 25, 40, 60, 100, 140, 250, 400, 600},
    {2.5, 4, 5, 8, 12, 18, 30, 48, 75, 120, 180, 300, 480, 750},
    {2.5, 4, 6, 9, 15, 22, 36, 58, 90, 150, 220, 360, 580, 900},
    {3, 5, 8, 11, 18, 27, 43, 70, 110, 180, 270, 430, 700, 1100},
    {4, 6, 9, 13, 21, 33, 52, 84, 130, 210, 330, 520, 840, 1300},
    {4, 7, 11, 16, 25, 39, 62, 100, 160, 250, 390, 620, 1000, 1600},
    {5, 8, 13, 19, 30, 46, 74, 120, 190, 300, 460, 740, 1200, 1900},
    {6, 10, 15, 22, 35, 54, 87, 140, 220, 350, 540, 870, 1400, 2200},
    {8, 12, 18, 25, 40, 63, 100, 160, 250, 400, 630, 1000, 1600, 2500},
    {10, 14, 20, 29, 46, 72, 115, 185, 290, 460, 720, 1150, 1850, 2900},
    {12, 16, 23, 32, 52, 81, 130, 210, 320, 520, 810, 1300, 2100, 3200},
    {13, 18, 25, 36, 57, 89, 140, 230, 360, 570, 890, 1400, 2300, 3600},
    {15, 20, 27, 40, 63, 97, 155, 250, 400, 630, 970, 1550, 2500, 4000}};

/* Fields of a diameter, from IT3 on. */
static lm_status find_it_fields(lm_real diameter_mm, lm_real grade, const lm_real *tolerance_mm,
                                const double **field_um, lm_fault *fault) {
  int step = 0;
  lm_status status = check_range(fault, "grade", grade, LM_REAL(IT_FIRST), LM_REAL(IT_LAST));
  if (status == LM_OK) {
    status = check_range(fault, "diameter_mm", diameter_mm, LM_REAL(1e-3), LM_REAL(500));
  }
  if (status == LM_OK && tolerance_mm == 0) {
    status = refuse(fault, LM_NULL, "tolerance_mm");
  }
  if (status != LM_OK) {
    return status;
  }
  while (diameter_mm > LM_REAL(it_end_mm[step])) { /* ends at 500, the largest diameter */
    step++;
  }
  *field_um = it_field_um[step];
  return LM_OK;
}

lm_status lm_it_tolerance(lm_real diameter_mm, int grade, lm_real *tolerance_mm, lm_fault *fault) {
  const double *field_um;
  const lm_status status =
      find_it_fields(diameter_mm, (lm_real)grade, tolerance_mm, &field_um, fault);
  if (status == LM_OK) {
    *tolerance_mm = LM_REAL(field_um[grade - IT_FIRST]) * MM_PER_UM;
  }
  return status;
}

static int nearest_index(int i, int last) {
  if (i < 0) {
    return 0;
  }
  return i < last ? i : last;
}

/* Logarithm of the growth of the field from the i-th to the next grade; beyond the table that of
 * its last pair. */
static lm_real log_growth(const double field_um[], int i) {
  const int first = nearest_index(i, IT_LAST - IT_FIRST - 1);
  return real_log(LM_REAL(field_um[first + 1] / field_um[first]));
}

lm_status lm_it_tolerance_continuous(lm_real diameter_mm, lm_real grade, lm_real *tolerance_mm,
                                     lm_fault *fault) {
  const double *field_um;
  const lm_status status = find_it_fields(diameter_mm, grade, tolerance_mm, &field_um, fault);
  if (status == LM_OK) {
    /* Cubic in the logarithm; its slope at a whole grade is the mean of the growths on both
     * sides. */
    const int i = nearest_index((int)grade - IT_FIRST, IT_LAST - IT_FIRST);
    const lm_real beyond = grade - LM_REAL(i + IT_FIRST);
    const lm_real short_of = LM_REAL(1) - beyond;
    const lm_real growth = log_growth(field_um, i);
    const lm_real bend = short_of * (log_growth(field_um, i - 1) - growth) -
                         beyond * (log_growth(field_um, i + 1) - growth);
    *tolerance_mm = LM_REAL(field_um[i]) *
                    real_exp(beyond * (growth + short_of * bend / LM_REAL(2))) * MM_PER_UM;
  }
  return status;
}

/* ---- Limits of a chain ---- */

static lm_status check_link(const lm_tolerance_link *link, lm_fault *fault) {
  lm_status status =
      check_range(fault, "tolerance.influence", link->influence, -INFLUENCE_MAX, INFLUENCE_MAX);
  if (status == LM_OK) {
    status = check_range(fault, "tolerance.lower_mm", link->lower_mm, -DEVIATION_MAX_MM,
                         DEVIATION_MAX_MM);
  }
  if (status == LM_OK) {
    status = check_range(fault, "tolerance.upper_mm", link->upper_mm, -DEVIATION_MAX_MM,
                         DEVIATION_MAX_MM);
  }
  if (status == LM_OK && link->upper_mm < link->lower_mm) {
    status = refuse_contradiction(fault, "tolerance.upper_mm", link->upper_mm, link->lower_mm,
                                  DEVIATION_MAX_MM);
  }
  if (status == LM_OK) {
    status = check_range(fault, "tolerance.distribution", (lm_real)(int)link->distribution,
                         LM_REAL(LM_NORMAL), LM_REAL(LM_UNIFORM));
  }
  if (status == LM_OK) {
    status = check_range(fault, "tolerance.zone", (lm_real)(int)link->zone,
                         LM_REAL(LM_GENERATOR_GAP), LM_REAL(LM_TEETH_GAP));
  }
  return status;
}

lm_status lm_check_tolerance_links(const lm_tolerance_link *links, int count, lm_fault *fault) {
  lm_status status = LM_OK;
  int i = 0;
  if (links == 0 && count != 0) {
    return refuse(fault, LM_NULL, "tolerance");
  }
  status = check_range(fault, "count", (lm_real)count, LM_REAL(0), LM_REAL(LM_TOLERANCE_CHAIN_MAX));
  for (i = 0; status == LM_OK && i < count; ++i) {
    status = check_link(&links[i], fault);
  }
  return status;
}

lm_real lm_distribution_factor(lm_distribution distribution) {
  switch (distribution) {
    case LM_NORMAL:
      return LM_REAL(1);
    case LM_NORMAL_INSPECTED:
      /* Standard deviation of a unit normal cut at 0.135 % on each side. */
      return LM_REAL(0.9865775607186067);
    case LM_TRIANGULAR:
      return LM_REAL(1.2247448713915890);
    case LM_UNIFORM:
      return LM_REAL(1.7320508075688773);
    default:
      return LM_REAL(0);
  }
}

static lm_real centre_of(const lm_tolerance_link *link) {
  return (link->lower_mm + link->upper_mm) / LM_REAL(2);
}

static lm_real half_field_of(const lm_tolerance_link *link) {
  return (link->upper_mm - link->lower_mm) / LM_REAL(2);
}

static lm_real square(lm_real value) {
  return value * value;
}

static lm_real clip(lm_real value) {
  return value > LM_REAL(0) ? value : LM_REAL(0);
}

/* Zone limits centre +- half width, signed and clipped. */
static void put_zone(lm_tolerance_limits *limits, int zone, lm_real centre, lm_real half_width) {
  limits->signed_min_mm[zone] = centre - half_width;
  limits->signed_max_mm[zone] = centre + half_width;
  limits->gap_min_mm[zone] = clip(limits->signed_min_mm[zone]);
  limits->gap_max_mm[zone] = clip(limits->signed_max_mm[zone]);
}

static lm_status check_limits(const lm_tolerance_link *links, int count,
                              const lm_tolerance_limits *limits, lm_fault *fault) {
  const lm_status status = lm_check_tolerance_links(links, count, fault);
  if (status == LM_OK && limits == 0) {
    return refuse(fault, LM_NULL, "limits");
  }
  return status;
}

lm_status lm_worst_limits(const lm_tolerance_link *links, int count, lm_tolerance_limits *limits,
                          lm_fault *fault) {
  const lm_status status = check_limits(links, count, limits, fault);
  lm_real centre[LM_GAP_ZONES] = {LM_REAL(0), LM_REAL(0)};
  lm_real half_width[LM_GAP_ZONES] = {LM_REAL(0), LM_REAL(0)};
  int i = 0;
  if (status != LM_OK) {
    return status;
  }
  for (i = 0; i < count; ++i) {
    centre[links[i].zone] += links[i].influence * centre_of(&links[i]);
    half_width[links[i].zone] += real_fabs(links[i].influence) * half_field_of(&links[i]);
  }
  for (i = 0; i < LM_GAP_ZONES; ++i) {
    put_zone(limits, i, centre[i], half_width[i]);
  }
  limits->total_min_mm = limits->gap_min_mm[LM_GENERATOR_GAP] + limits->gap_min_mm[LM_TEETH_GAP];
  limits->total_max_mm = limits->gap_max_mm[LM_GENERATOR_GAP] + limits->gap_max_mm[LM_TEETH_GAP];
  return LM_OK;
}

/* Largest deviation of a link as |A| tau: only a normal distribution exceeds its field, from t = 3
 * on. */
static lm_real reach(const lm_tolerance_link *link, lm_real t) {
  const lm_real beyond =
      link->distribution == LM_NORMAL && t > LM_REAL(3) ? t / LM_REAL(3) : LM_REAL(1);
  return real_fabs(link->influence) * half_field_of(link) * beyond;
}

/* (A tau K)^2 */
static lm_real spread_square(const lm_tolerance_link *link) {
  return square(link->influence * half_field_of(link) * lm_distribution_factor(link->distribution));
}

lm_status lm_probable_limits(const lm_tolerance_link *links, int count, lm_real t,
                             lm_tolerance_limits *limits, lm_fault *fault) {
  lm_status status = check_range(fault, "t", t, LM_REAL(0), LM_REAL(6));
  lm_real centre[LM_GAP_ZONES] = {LM_REAL(0), LM_REAL(0)};
  lm_real squares[LM_GAP_ZONES] = {LM_REAL(0), LM_REAL(0)};
  lm_real furthest[LM_GAP_ZONES] = {LM_REAL(0), LM_REAL(0)};
  lm_real least = LM_REAL(0);
  lm_real most = LM_REAL(0);
  lm_real below_square = LM_REAL(0);
  lm_real above_square = LM_REAL(0);
  lm_real worst_least = LM_REAL(0);
  lm_real worst_most = LM_REAL(0);
  int i = 0;
  if (status == LM_OK) {
    status = check_limits(links, count, limits, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  for (i = 0; i < count; ++i) {
    centre[links[i].zone] += links[i].influence * centre_of(&links[i]);
    squares[links[i].zone] += spread_square(&links[i]);
    furthest[links[i].zone] += reach(&links[i], t);
  }
  for (i = 0; i < LM_GAP_ZONES; ++i) {
    lm_real middle;
    lm_real half;
    put_zone(limits, i, centre[i], t / LM_REAL(3) * real_sqrt(squares[i]));
    middle = (limits->gap_min_mm[i] + limits->gap_max_mm[i]) / LM_REAL(2);
    half = (limits->gap_max_mm[i] - limits->gap_min_mm[i]) / LM_REAL(2);
    most += middle;
    above_square += square(half);
    /* A zone that may interfere has no gap in an unknown share of the drives: its lower
     * limit is 0. */
    if (limits->signed_min_mm[i] >= LM_REAL(0)) {
      least += middle;
      below_square += square(half);
    }
    worst_least += clip(centre[i] - furthest[i]);
    worst_most += clip(centre[i] + furthest[i]);
  }
  least -= real_sqrt(below_square);
  most += real_sqrt(above_square);
  limits->total_min_mm = least > worst_least ? least : worst_least;
  limits->total_max_mm = most < worst_most ? most : worst_most;
  return LM_OK;
}

lm_status lm_probable_coverage(lm_real t, lm_real *share, lm_fault *fault) {
  /* 2 Phi(t) - 1 = 2 phi(t) (t + t^3/3 + t^5/(3 5) + ...): all terms positive; at t = 6 the 120th
   * is below 1e-50 of the sum. */
  const lm_status status = check_range(fault, "t", t, LM_REAL(0), LM_REAL(6));
  lm_real term = t;
  lm_real sum = t;
  int k = 0;
  if (status != LM_OK) {
    return status;
  }
  if (share == 0) {
    return refuse(fault, LM_NULL, "share");
  }
  for (k = 1; k < 120; ++k) {
    term *= t * t / (lm_real)(2 * k + 1);
    sum += term;
  }
  *share = sum * real_exp(-t * t / LM_REAL(2)) * real_sqrt(LM_REAL(2) / LM_PI);
  return LM_OK;
}

lm_status lm_tolerance_contributions(const lm_tolerance_link *links, int count,
                                     lm_real *worst_percent, lm_real *probable_percent,
                                     lm_fault *fault) {
  const lm_status status = lm_check_tolerance_links(links, count, fault);
  lm_real worst = LM_REAL(0);
  lm_real squares = LM_REAL(0);
  int i = 0;
  if (status != LM_OK) {
    return status;
  }
  if (worst_percent == 0 || probable_percent == 0) {
    return refuse(fault, LM_NULL, "worst_percent or probable_percent");
  }
  for (i = 0; i < count; ++i) {
    worst_percent[i] = real_fabs(links[i].influence) * half_field_of(&links[i]);
    probable_percent[i] = spread_square(&links[i]);
    worst += worst_percent[i];
    squares += probable_percent[i];
  }
  for (i = 0; i < count; ++i) {
    /* Below one square picometre the tolerances are zero; float32 would divide by a denormal. */
    worst_percent[i] = worst > LM_REAL(1e-9) ? LM_REAL(100) * worst_percent[i] / worst : LM_REAL(0);
    probable_percent[i] =
        squares > LM_REAL(1e-18) ? LM_REAL(100) * probable_percent[i] / squares : LM_REAL(0);
  }
  return LM_OK;
}

/* ---- Quasi-Monte-Carlo ---- */

/* c[0] + x c[1] + ... + x^7 c[7] */
static lm_real polynomial(const double *c, lm_real x) {
  lm_real sum = LM_REAL(c[7]);
  int i = 0;
  for (i = 6; i >= 0; --i) {
    sum = sum * x + LM_REAL(c[i]);
  }
  return sum;
}

/* Phi(z) = p for 1e-10 <= p <= 0.5. M. J. Wichura, algorithm AS 241 (PPND16), its middle and its
 * near tail (p > 1.4e-11). All coefficients are positive, so float32 cancels nothing. */
static lm_real tail_quantile(lm_real p) {
  static const double middle_above[8] = {
      3.3871328727963666080, 133.14166789178437745, 1971.5909503065514427, 13731.693765509461125,
      45921.953931549871457, 67265.770927008700853, 33430.575583588128105, 2509.0809287301226727};
  static const double middle_below[8] = {1.0,
                                         42.313330701600911252,
                                         687.18700749205790830,
                                         5394.1960214247511077,
                                         21213.794301586595867,
                                         39307.895800092710610,
                                         28729.085735721942674,
                                         5226.4952788528545610};
  static const double tail_above[8] = {1.42343711074968357734,   4.63033784615654529590,
                                       5.76949722146069140550,   3.64784832476320460504,
                                       1.27045825245236838258,   0.241780725177450611770,
                                       0.0227238449892691845833, 7.74545014278341407640e-4};
  static const double tail_below[8] = {1.0,
                                       2.05319162663775882187,
                                       1.67638483018380384940,
                                       0.689767334985100004550,
                                       0.148103976427480074590,
                                       0.0151986665636164571966,
                                       5.47593808499534494600e-4,
                                       1.05075007164441684324e-9};
  const lm_real q = p - LM_REAL(0.5);
  lm_real r = LM_REAL(0);
  if (q > LM_REAL(-0.425)) {
    r = LM_REAL(0.180625) - q * q;
    return q * polynomial(middle_above, r) / polynomial(middle_below, r);
  }
  r = real_sqrt(-real_log(p)) - LM_REAL(1.6);
  return -polynomial(tail_above, r) / polynomial(tail_below, r);
}

lm_status lm_normal_tail_quantile(lm_real tail_probability, lm_real *quantile, lm_fault *fault) {
  const lm_status status =
      check_range(fault, "tail_probability", tail_probability, LM_REAL(1e-10), LM_REAL(0.5));
  if (status != LM_OK) {
    return status;
  }
  if (quantile == 0) {
    return refuse(fault, LM_NULL, "quantile");
  }
  *quantile = tail_quantile(tail_probability);
  return LM_OK;
}

/* Sobol dimension: primitive polynomial over GF(2) with all its coefficients as bits, and the odd
 * initial numbers m_1 .. m_degree. S. Joe and F. Y. Kuo, new-joe-kuo-6.21201. Dimension 0 is the
 * van der Corput sequence and has no polynomial. */
#define SOBOL_DEGREE_MAX 7
typedef struct sobol_seed {
  uint32_t polynomial;
  int degree;
  uint32_t initial[SOBOL_DEGREE_MAX];
} sobol_seed;

static const sobol_seed sobol_seeds[LM_TOLERANCE_CHAIN_MAX - 1] = {
    {3, 1, {1}},
    {7, 2, {1, 3}},
    {11, 3, {1, 3, 1}},
    {13, 3, {1, 1, 1}},
    {19, 4, {1, 1, 3, 3}},
    {25, 4, {1, 3, 5, 13}},
    {37, 5, {1, 1, 5, 5, 17}},
    {41, 5, {1, 1, 5, 5, 5}},
    {47, 5, {1, 1, 7, 11, 19}},
    {55, 5, {1, 1, 5, 1, 1}},
    {59, 5, {1, 1, 1, 3, 11}},
    {61, 5, {1, 3, 5, 5, 31}},
    {67, 6, {1, 3, 3, 9, 7, 49}},
    {91, 6, {1, 1, 1, 15, 21, 21}},
    {97, 6, {1, 3, 1, 13, 27, 49}},
    {103, 6, {1, 1, 1, 15, 7, 5}},
    {109, 6, {1, 3, 1, 15, 13, 25}},
    {115, 6, {1, 1, 5, 5, 19, 61}},
    {131, 7, {1, 3, 7, 11, 23, 15, 103}},
    {137, 7, {1, 3, 7, 13, 13, 15, 69}},
    {143, 7, {1, 1, 3, 13, 7, 35, 63}},
    {145, 7, {1, 3, 5, 9, 1, 25, 53}},
    {157, 7, {1, 3, 1, 13, 9, 35, 107}},
    {167, 7, {1, 3, 1, 5, 27, 61, 31}},
    {171, 7, {1, 1, 5, 11, 19, 41, 61}},
    {185, 7, {1, 3, 5, 3, 3, 13, 69}},
    {191, 7, {1, 1, 7, 13, 1, 19, 1}},
    {193, 7, {1, 3, 7, 5, 13, 19, 59}},
    {203, 7, {1, 1, 3, 9, 25, 29, 41}},
    {211, 7, {1, 3, 5, 13, 23, 1, 55}},
    {213, 7, {1, 3, 7, 3, 13, 59, 17}}};

#define SOBOL_BITS 32
typedef struct sobol_directions {
  uint32_t direction[LM_SAMPLES_LOG2_MAX];
} sobol_directions;

static void start_sobol(sobol_directions *sobol, int dimension) {
  int k = 0;
  if (dimension == 0) {
    for (k = 0; k < LM_SAMPLES_LOG2_MAX; ++k) {
      sobol->direction[k] = UINT32_C(1) << (SOBOL_BITS - 1 - k);
    }
    return;
  }
  {
    const sobol_seed *seed = &sobol_seeds[dimension - 1];
    for (k = 0; k < seed->degree; ++k) {
      sobol->direction[k] = seed->initial[k] << (SOBOL_BITS - 1 - k);
    }
    for (k = seed->degree; k < LM_SAMPLES_LOG2_MAX; ++k) {
      const uint32_t oldest = sobol->direction[k - seed->degree];
      uint32_t made = oldest ^ (oldest >> seed->degree);
      int j = 0;
      for (j = 1; j < seed->degree; ++j) {
        const uint32_t coefficient = (seed->polynomial >> (seed->degree - j)) & 1u;
        made ^= coefficient * sobol->direction[k - j];
      }
      sobol->direction[k] = made;
    }
  }
}

/* The point after `point` in Gray-code order; index >= 1 is that of the point requested. */
static uint32_t next_sobol(const sobol_directions *sobol, uint32_t point, uint32_t index) {
  int zeros = 0;
  while ((index & 1u) == 0u) {
    index >>= 1;
    ++zeros;
  }
  return point ^ sobol->direction[zeros];
}

static uint32_t reverse_bits(uint32_t x) {
  x = (x >> 16) | (x << 16);
  x = ((x >> 8) & UINT32_C(0x00ff00ff)) | ((x & UINT32_C(0x00ff00ff)) << 8);
  x = ((x >> 4) & UINT32_C(0x0f0f0f0f)) | ((x & UINT32_C(0x0f0f0f0f)) << 4);
  x = ((x >> 2) & UINT32_C(0x33333333)) | ((x & UINT32_C(0x33333333)) << 2);
  return ((x >> 1) & UINT32_C(0x55555555)) | ((x & UINT32_C(0x55555555)) << 1);
}

/* Nested uniform scrambling by a hash (Laine and Karras 2011, multipliers by Vegdahl 2021). In the
 * reversed word every step lets a bit depend on itself and on lower bits only; turned back, a digit
 * is flipped by the digits before it: Owen's scrambling. */
static uint32_t scramble_nested(uint32_t x, uint32_t seed) {
  x = reverse_bits(x);
  x ^= x * UINT32_C(0x3d20adea);
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * UINT32_C(0x05526c56);
  x ^= x * UINT32_C(0x53a22864);
  return reverse_bits(x);
}

/* Every bit of the word decides every bit of the result (finaliser of MurmurHash3). */
static uint32_t mix(uint32_t x) {
  x ^= x >> 16;
  x *= UINT32_C(0x85ebca6b);
  x ^= x >> 13;
  x *= UINT32_C(0xc2b2ae35);
  x ^= x >> 16;
  return x;
}

lm_status lm_sobol_points(int dimension, uint32_t seed, int count, uint32_t *points,
                          lm_fault *fault) {
  lm_status status = check_range(fault, "dimension", (lm_real)dimension, LM_REAL(0),
                                 LM_REAL(LM_TOLERANCE_CHAIN_MAX - 1));
  sobol_directions sobol;
  uint32_t point = 0;
  int i = 0;
  if (status == LM_OK) {
    status = check_range(fault, "count", (lm_real)count, LM_REAL(1),
                         LM_REAL(INT32_C(1) << LM_SAMPLES_LOG2_MAX));
  }
  if (status != LM_OK) {
    return status;
  }
  if (points == 0) {
    return refuse(fault, LM_NULL, "points");
  }
  start_sobol(&sobol, dimension);
  for (i = 0; i < count; ++i) {
    if (i > 0) {
      point = next_sobol(&sobol, point, (uint32_t)i);
    }
    points[i] = seed == 0 ? point : scramble_nested(point, mix(seed));
  }
  return LM_OK;
}

/* Deviation in units of tau for a point of the unit interval. The point is taken as a tail
 * probability p <= 1/2 and a side: symmetric to the last bit, and float32 keeps the digits of both
 * tails. */
static lm_real standard_deviate(lm_distribution distribution, uint32_t point) {
  const int upper = point >= UINT32_C(0x80000000);
  const uint32_t tail = upper ? ~point : point;
  const lm_real p = ((lm_real)tail + LM_REAL(0.5)) * LM_REAL(2.3283064365386963e-10); /* 2^-32 */
  /* Share rejected on each side: rounded up from Phi(-3), so that every deviate is within +-1.
   */
  const lm_real cut = LM_REAL(1.35e-3);
  lm_real lower = LM_REAL(0);
  switch (distribution) {
    case LM_NORMAL:
      lower = tail_quantile(p) / LM_REAL(3);
      break;
    case LM_NORMAL_INSPECTED:
      lower = tail_quantile(cut + (LM_REAL(1) - LM_REAL(2) * cut) * p) / LM_REAL(3);
      break;
    case LM_TRIANGULAR:
      lower = real_sqrt(LM_REAL(2) * p) - LM_REAL(1);
      break;
    case LM_UNIFORM:
    default:
      lower = LM_REAL(2) * p - LM_REAL(1);
      break;
  }
  return upper ? -lower : lower;
}

/* Ascending, in place, n log n in the worst case, no recursion. */
static void sift_down(lm_real *heap, size_t root, size_t end) {
  size_t child = 2 * root + 1;
  while (child < end) {
    lm_real swap = LM_REAL(0);
    if (child + 1 < end && heap[child + 1] > heap[child]) {
      ++child;
    }
    if (!(heap[child] > heap[root])) {
      return;
    }
    swap = heap[root];
    heap[root] = heap[child];
    heap[child] = swap;
    root = child;
    child = 2 * root + 1;
  }
}

static void sort_ascending(lm_real *values, size_t count) {
  size_t i = 0;
  for (i = count / 2; i > 0; --i) {
    sift_down(values, i - 1, count);
  }
  for (i = count - 1; i > 0; --i) {
    const lm_real largest = values[0];
    values[0] = values[i];
    values[i] = largest;
    sift_down(values, 0, i);
  }
}

/* Order statistic at n p - 1/2, straight between neighbours: the k-th of n drives of a net
 * represents the share (k + 1/2) / n. The whole part of the position is found bit by bit: a number
 * type with derivatives has no conversion to an integer. */
static lm_real quantile_of(const lm_real *sorted, int samples_log2, lm_real probability) {
  const size_t samples = (size_t)1 << samples_log2;
  const size_t last = samples - 1;
  const lm_real position = clip((lm_real)samples * probability - LM_REAL(0.5));
  size_t below = 0;
  int bit = 0;
  for (bit = samples_log2 - 1; bit >= 0; --bit) {
    const size_t candidate = below + ((size_t)1 << bit);
    if ((lm_real)candidate <= position) {
      below = candidate;
    }
  }
  if (below == last) {
    return sorted[last];
  }
  return sorted[below] + (position - (lm_real)below) * (sorted[below + 1] - sorted[below]);
}

/* Running mean and sum of squared departures (Welford). */
static void add_observation(lm_estimate *estimate, lm_real value, int observations) {
  const lm_real before = value - estimate->value;
  estimate->value += before / (lm_real)observations;
  estimate->standard_error += before * (value - estimate->value);
}

static void finish_estimate(lm_estimate *estimate, int observations) {
  const lm_real n = (lm_real)observations;
  estimate->standard_error = real_sqrt(estimate->standard_error / (n * (n - LM_REAL(1))));
}

static lm_status check_plan(const lm_sampling_plan *plan, const lm_real *workspace,
                            size_t workspace_length, lm_fault *fault) {
  lm_status status = LM_OK;
  if (plan == 0) {
    return refuse(fault, LM_NULL, "plan");
  }
  status = check_range(fault, "plan.samples_log2", (lm_real)plan->samples_log2,
                       LM_REAL(LM_SAMPLES_LOG2_MIN), LM_REAL(LM_SAMPLES_LOG2_MAX));
  if (status == LM_OK) {
    status = check_range(fault, "plan.scramblings", (lm_real)plan->scramblings,
                         LM_REAL(LM_SCRAMBLINGS_MIN), LM_REAL(LM_SCRAMBLINGS_MAX));
  }
  if (status == LM_OK) {
    status =
        check_range(fault, "plan.low_probability", plan->low_probability, LM_REAL(0), LM_REAL(0.5));
  }
  if (status == LM_OK) {
    status = check_range(fault, "plan.high_probability", plan->high_probability, LM_REAL(0.5),
                         LM_REAL(1));
  }
  if (status == LM_OK) {
    status = check_range(fault, "plan.limit_mm", plan->limit_mm, LM_REAL(0), LM_REAL(1e4));
  }
  if (status == LM_OK && workspace == 0) {
    status = refuse(fault, LM_NULL, "workspace");
  }
  if (status == LM_OK && workspace_length < LM_SAMPLE_GAP_WORKSPACE(plan->samples_log2)) {
    status = refuse(fault, LM_TOO_SMALL, "workspace_length");
  }
  return status;
}

/* Adds one link's deviations to the signed sums of its zone. */
static void add_link(const lm_tolerance_link *link, int dimension, uint32_t scrambling_seed,
                     lm_real *zone_sums, size_t samples) {
  const lm_real centre = link->influence * centre_of(link);
  const lm_real half_width = link->influence * half_field_of(link);
  const uint32_t seed = mix(scrambling_seed + (uint32_t)dimension);
  sobol_directions sobol;
  uint32_t point = 0;
  size_t i = 0;
  start_sobol(&sobol, dimension);
  for (i = 0; i < samples; ++i) {
    if (i > 0) {
      point = next_sobol(&sobol, point, (uint32_t)i);
    }
    zone_sums[i] +=
        centre + half_width * standard_deviate(link->distribution, scramble_nested(point, seed));
  }
}

/* One scrambling: the total gaps, sorted, in the first half of the workspace. */
static void sample_scrambling(const lm_tolerance_link *links, int count, uint32_t scrambling_seed,
                              lm_real *workspace, size_t samples) {
  size_t i = 0;
  int j = 0;
  for (i = 0; i < LM_GAP_ZONES * samples; ++i) {
    workspace[i] = LM_REAL(0);
  }
  for (j = 0; j < count; ++j) {
    add_link(&links[j], j, scrambling_seed, workspace + (size_t)links[j].zone * samples, samples);
  }
  for (i = 0; i < samples; ++i) {
    workspace[i] = clip(workspace[i]) + clip(workspace[samples + i]);
  }
  sort_ascending(workspace, samples);
}

lm_status lm_sample_gap(const lm_tolerance_link *links, int count, const lm_sampling_plan *plan,
                        lm_real *workspace, size_t workspace_length, lm_gap_statistics *statistics,
                        lm_fault *fault) {
  lm_status status = lm_check_tolerance_links(links, count, fault);
  lm_gap_statistics found;
  lm_estimate *const estimates[] = {&found.mean_mm, &found.low_mm,       &found.median_mm,
                                    &found.high_mm, &found.reject_share, &found.closed_share};
  const int estimate_count = (int)(sizeof(estimates) / sizeof(estimates[0]));
  size_t samples = 0;
  int scrambling = 0;
  int e = 0;
  if (status == LM_OK) {
    status = check_plan(plan, workspace, workspace_length, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  if (statistics == 0) {
    return refuse(fault, LM_NULL, "statistics");
  }
  for (e = 0; e < estimate_count; ++e) {
    estimates[e]->value = LM_REAL(0);
    estimates[e]->standard_error = LM_REAL(0);
  }
  samples = (size_t)1 << plan->samples_log2;
  found.smallest_mm = REAL_INFINITY;
  found.largest_mm = LM_REAL(0);
  for (scrambling = 1; scrambling <= plan->scramblings; ++scrambling) {
    lm_real sum = LM_REAL(0);
    lm_real lost = LM_REAL(0);
    size_t rejected = 0;
    size_t closed = 0;
    size_t i = 0;
    sample_scrambling(links, count,
                      mix(mix(plan->seed) + (uint32_t)scrambling * LM_TOLERANCE_CHAIN_MAX),
                      workspace, samples);
    for (i = 0; i < samples; ++i) {
      /* Kahan: float32 keeps its digits over a million samples. */
      const lm_real term = workspace[i] - lost;
      const lm_real next = sum + term;
      lost = (next - sum) - term;
      sum = next;
      rejected += workspace[i] > plan->limit_mm ? 1u : 0u;
      closed += workspace[i] > LM_REAL(0) ? 0u : 1u;
    }
    add_observation(&found.mean_mm, sum / (lm_real)samples, scrambling);
    add_observation(&found.low_mm,
                    quantile_of(workspace, plan->samples_log2, plan->low_probability), scrambling);
    add_observation(&found.median_mm, quantile_of(workspace, plan->samples_log2, LM_REAL(0.5)),
                    scrambling);
    add_observation(&found.high_mm,
                    quantile_of(workspace, plan->samples_log2, plan->high_probability), scrambling);
    add_observation(&found.reject_share, (lm_real)rejected / (lm_real)samples, scrambling);
    add_observation(&found.closed_share, (lm_real)closed / (lm_real)samples, scrambling);
    if (workspace[0] < found.smallest_mm) {
      found.smallest_mm = workspace[0];
    }
    if (workspace[samples - 1] > found.largest_mm) {
      found.largest_mm = workspace[samples - 1];
    }
  }
  for (e = 0; e < estimate_count; ++e) {
    finish_estimate(estimates[e], plan->scramblings);
  }
  *statistics = found;
  return LM_OK;
}
