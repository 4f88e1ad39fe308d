/* A design evaluated again on a finer grid than in the search: margins of all limits, active
 * limits, and their prices.
 */
#ifndef LOSTMOTION_OPTIMIZER_CERTIFICATE_H
#define LOSTMOTION_OPTIMIZER_CERTIFICATE_H

#include "lostmotion/checks.h"
#include "lostmotion/tolerance.h"
#include "points.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A limit with a smaller margin (scaled as in evaluate.h) is active. */
#define LM_BINDING 1e-4

typedef struct lm_limit_report {
  int stated;        /* 0: not limited */
  double margin;     /* scaled, > 0: holds; modules, arcmin or shares of the limit */
  int binds;         /* 1: nearer than LM_BINDING */
  double multiplier; /* decrease of the first objective per unit of relaxation, >= 0 */
} lm_limit_report;

typedef struct lm_certificate {
  int holds; /* 1: every limit holds on the fine evaluation */
  lm_drive drive;
  double figure[LM_FIGURE_COUNT];        /* fine: 8 tooth phases, 256 nodes */
  double search_figure[LM_FIGURE_COUNT]; /* as evaluated by the search */
  lm_limit_report limit[LM_LIMIT_COUNT];
  lm_smallest_gap smallest; /* of the whole face: 32 steps a tooth pitch, refined */
  lm_load load;             /* at rated torque, the worst of the 8 tooth phases */
  lm_check check[LM_CHECK_COUNT];
  /* lost motion of a reversal over the tolerances, arcmin, at the worst of the 8 tooth phases */
  double lost_motion_worst;
  double lost_motion_probable;
  lm_estimate lost_motion_median;
  lm_estimate lost_motion_quantile; /* 99.73 % of 8 x 2^14 sampled drives */
  lm_gap_statistics gap;            /* radial gap of the same samples */
  double worst_percent[LM_LINK_MAX];
  double probable_percent[LM_LINK_MAX];
  int end[LM_FREE_MAX]; /* of each range: -1 at its low end, 1 at its high end, 0 between */
  double end_price[LM_FREE_MAX]; /* decrease of the first objective for one more width of the range
  beyond that end, to first order, >= 0 */
  double residual; /* of the optimality conditions, relative to the objective's derivatives: 0 at a
                      smooth local optimum; large where the objective has a kink */
} lm_certificate;

/* LM_NULL, and what the model refuses. Allocates and frees the samples (LM_TOO_SMALL). */
lm_status lm_certify(const lm_problem *problem, int combination, const double unit[],
                     lm_certificate *certificate, lm_workspace *workspace, lm_fault *fault);

#ifdef __cplusplus
}
#endif

#endif
