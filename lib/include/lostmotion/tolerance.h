/* From drawing tolerances to the radial gap on the deformation axis: equations (10), (11), the
 * probable limits, and a quasi-Monte-Carlo simulation of production.
 *
 * The gap of each zone is a signed sum S = sum A_i delta_i of the deviations in it. A positive sum
 * is a gap, a negative one interference. Only AFTER combining is a zone clipped at zero, and only
 * then do the zones add up, eq (8): gap = max(0, S') + max(0, S''). The mean of the clipped gap is
 * not the clipped mean: if limits include zero, only the sampled figures are correct.
 *
 * Influence A: +1 for a radius whose growth opens the gap, -1 for one whose growth closes it; half
 * of that for a diameter; 1 / (2 tan(flank angle)) for tooth thickness or space width along the
 * chord. A hole d 40 +0.025/0 around a shaft d 40 -0.009/-0.025 is two links, A = 0.5 with 0 ..
 * 0.025 and A = -0.5 with -0.025 .. -0.009. A nominal gap or a fixed offset is a link with both
 * deviations equal.
 *
 * Deviations of different links are independent.
 *
 * Status of all functions: LM_NULL, LM_NOT_FINITE, LM_OUT_OF_RANGE (fault names the input, for a
 * link "tolerance.influence" and so on), LM_INCONSISTENT (upper deviation below the lower one),
 * LM_TOO_SMALL (workspace). On an error no output is changed. All functions are pure; the same
 * input gives the same bits.
 */
#ifndef LOSTMOTION_TOLERANCE_H
#define LOSTMOTION_TOLERANCE_H

#include <stddef.h>
#include <stdint.h>

#include "lostmotion/real.h"
#include "lostmotion/status.h"

LM_BEGIN_DECLS

/* Distribution of a deviation over its tolerance field E +- tau. */
typedef enum lm_distribution {
  LM_NORMAL = 0,           /* 3 sigma = tau, not truncated: 0.27 % of the parts are outside */
  LM_NORMAL_INSPECTED = 1, /* 3 sigma = tau, parts outside the field are rejected */
  LM_TRIANGULAR = 2,       /* peak in the middle of the field */
  LM_UNIFORM = 3
} lm_distribution;

/* Zone of a link: eq (8) has two gaps. */
typedef enum lm_gap_zone {
  LM_GENERATOR_GAP = 0, /* Delta0', wave generator to flexspline */
  LM_TEETH_GAP = 1      /* Delta0'', between the tooth profiles */
} lm_gap_zone;

#define LM_GAP_ZONES 2

/* One deviation of a drawing. */
typedef struct lm_tolerance_link {
  lm_real influence; /* A, -100 .. 100 */
  lm_real lower_mm;  /* ei or EI, -10 .. 10 */
  lm_real upper_mm;  /* es or ES, lower_mm .. 10 */
  lm_distribution distribution;
  lm_gap_zone zone;
} lm_tolerance_link;

/* Largest number of links of a chain: the number of dimensions of the Sobol generator. */
#define LM_TOLERANCE_CHAIN_MAX 32

/* ---- Pairs: equations (10), (11) ------------------------------------------------------------ */

/* Equation (10) with signed deviations: largest clearance of a hole on a shaft, ES - ei, on the
 * diameter. NaN in, NaN out. */
lm_real lm_clearance_max(lm_real hole_upper_mm, lm_real shaft_lower_mm);

/* Equation (11) with signed deviations: smallest clearance, EI - es; negative = interference. */
lm_real lm_clearance_min(lm_real hole_lower_mm, lm_real shaft_upper_mm);

/* ---- Tolerance grades ----------------------------------------------------------------------- */

/* Grade at which a link costs its weight. */
#define LM_COST_GRADE 7

/* ISO 286-1 tolerance of a grade, IT3 .. IT16, from the standard's table: one field for
 * each of its 13 diameter steps. diameter 0 < D <= 500 mm (1e-3 at least). Full width in
 * mm: tau is half of it. */
lm_status lm_it_tolerance(lm_real diameter_mm, int grade, lm_real *tolerance_mm, lm_fault *fault);

/* The same table, continuous in grade (3 .. 16) for an optimiser: at whole grades exactly the field
 * of the table, between them a smooth, increasing cubic in its logarithm. The diameter steps are
 * kept: the field jumps when the diameter passes the end of a step. */
lm_status lm_it_tolerance_continuous(lm_real diameter_mm, lm_real grade, lm_real *tolerance_mm,
                                     lm_fault *fault);

/* ---- Limits of a chain ---------------------------------------------------------------------- */

typedef struct lm_tolerance_limits {
  lm_real signed_min_mm[LM_GAP_ZONES]; /* sum of a zone before clipping, by lm_gap_zone */
  lm_real signed_max_mm[LM_GAP_ZONES];
  lm_real gap_min_mm[LM_GAP_ZONES]; /* clipped at zero */
  lm_real gap_max_mm[LM_GAP_ZONES];
  lm_real total_min_mm; /* Delta_0, eq (8) */
  lm_real total_max_mm;
} lm_tolerance_limits;

/* Checks that `count` links (0 .. LM_TOLERANCE_CHAIN_MAX; may be null if 0) are in their ranges. */
lm_status lm_check_tolerance_links(const lm_tolerance_link *links, int count, lm_fault *fault);

/* Relative spread K = 3 sigma / tau of a distribution: 1 normal, 0.98658 inspected, sqrt(3/2) =
 * 1.2247 triangular, sqrt(3) = 1.7321 uniform; 0 for anything else. */
lm_real lm_distribution_factor(lm_distribution distribution);

/* Worst case, equations (10) and (11) for the whole chain: every deviation at the end that opens
 * (closes) the gap. */
lm_status lm_worst_limits(const lm_tolerance_link *links, int count, lm_tolerance_limits *limits,
                          lm_fault *fault);

/* Probable limits of each zone: sum A E +- t sqrt(sum (A tau K / 3)^2), t = 0 .. 6, usually 3; then
 * clipped. For the total, the clipped zones are independent intervals: sum of their middles +- root
 * of the sum of their squared half widths; without clipping that is the formula over all links. A
 * zone that may be gap or interference adds nothing to the lower limit, because an unknown share of
 * the drives has no gap in it; lm_sample_gap counts them. Both limits stay within the worst case,
 * which parts within tolerance never exceed (with t / 3 times the field of a link that is LM_NORMAL
 * when t > 3). */
lm_status lm_probable_limits(const lm_tolerance_link *links, int count, lm_real t,
                             lm_tolerance_limits *limits, lm_fault *fault);

/* Share of a normal sum within +-t standard deviations, 2 Phi(t) - 1, t = 0 .. 6: 0.9973 at 3.
 * Error below 2e-15 (float32: 2e-7). */
lm_status lm_probable_coverage(lm_real t, lm_real *share, lm_fault *fault);

/* Contribution of each link, in percent of the chain before clipping: |A| tau of their sum (worst
 * case) and (A tau K)^2 of their sum (probable). Both arrays have `count` entries; they add up to
 * 100, or are 0 when no link has a tolerance. */
lm_status lm_tolerance_contributions(const lm_tolerance_link *links, int count,
                                     lm_real *worst_percent, lm_real *probable_percent,
                                     lm_fault *fault);

/* ---- Quasi-Monte-Carlo ---------------------------------------------------------------------- */

/* Lower tail of the standard normal distribution: z <= 0 with Phi(z) = tail probability, 1e-10 ..
 * 0.5; the upper tail is its mirror. Wichura's rational approximations AS 241, error below 1e-14
 * (float32: 1e-6) of the larger of 1 and |z|. */
lm_status lm_normal_tail_quantile(lm_real tail_probability, lm_real *quantile, lm_fault *fault);

/* Sobol points, 32 bits each (u = point / 2^32), dimension 0 .. 31 by Joe and Kuo's direction
 * numbers (new-joe-kuo-6), in Gray-code order. seed 0: the bare net, first point 0. Any other seed:
 * nested uniform (Owen) scrambling by a hash of the seed; every scrambling keeps the net: each of
 * the 2^k equal intervals holds one of the first 2^k points. count 1 .. 2^20. */
lm_status lm_sobol_points(int dimension, uint32_t seed, int count, uint32_t *points,
                          lm_fault *fault);

/* Samples of one scrambling as a power of two, and scramblings. */
#define LM_SAMPLES_LOG2_MIN 4
#define LM_SAMPLES_LOG2_MAX 20
#define LM_SCRAMBLINGS_MIN 2
#define LM_SCRAMBLINGS_MAX 64

/* Workspace of lm_sample_gap, in lm_real. */
#define LM_SAMPLE_GAP_WORKSPACE(samples_log2) ((size_t)2 << (samples_log2))

/* How to sample. */
typedef struct lm_sampling_plan {
  int samples_log2;         /* 4 .. 20: 2^samples_log2 drives in each scrambling */
  int scramblings;          /* 2 .. 64 independent ones: they give the standard error */
  uint32_t seed;            /* the same seed gives the same result */
  lm_real low_probability;  /* 0 .. 0.5, e.g. 0.00135 */
  lm_real high_probability; /* 0.5 .. 1, e.g. 0.99865 */
  lm_real limit_mm;         /* largest acceptable total gap, 0 .. 1e4 */
} lm_sampling_plan;

typedef struct lm_estimate {
  lm_real value;
  lm_real standard_error; /* standard deviation over the scramblings / root of their number */
} lm_estimate;

/* Total gap of the sampled drives. */
typedef struct lm_gap_statistics {
  lm_estimate mean_mm;      /* of the clipped gap */
  lm_estimate low_mm;       /* quantile at low_probability */
  lm_estimate median_mm;    /* quantile at 0.5 */
  lm_estimate high_mm;      /* quantile at high_probability */
  lm_estimate reject_share; /* drives with a total gap above limit_mm */
  lm_estimate closed_share; /* drives with no gap in either zone */
  lm_real smallest_mm;      /* among all samples */
  lm_real largest_mm;
} lm_gap_statistics;

/* Samples the chain: one Sobol dimension a link, deviations by the inverse of each distribution.
 * workspace of at least LM_SAMPLE_GAP_WORKSPACE(plan->samples_log2) numbers (LM_TOO_SMALL); its
 * contents on return are unspecified. Quantiles interpolate between order statistics at n p - 1/2.
 * Cost: scramblings * 2^samples_log2 * (links inverse distributions + a heapsort); 2^12 samples, 8
 * scramblings, 10 links: about 6 ms on a PC. Drives whose links are all bounded (not LM_NORMAL)
 * stay inside lm_worst_limits; where all are LM_NORMAL and nothing clips, quantiles at 0.00135 and
 * 0.99865 are lm_probable_limits with t = 3 within a few standard errors. */
lm_status lm_sample_gap(const lm_tolerance_link *links, int count, const lm_sampling_plan *plan,
                        lm_real *workspace, size_t workspace_length, lm_gap_statistics *statistics,
                        lm_fault *fault);

LM_END_DECLS

#endif
