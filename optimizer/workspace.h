/* Workspace of one thread; opaque to callers. */
#ifndef LOSTMOTION_OPTIMIZER_WORKSPACE_H
#define LOSTMOTION_OPTIMIZER_WORKSPACE_H

#include "evaluate.h"
#include "known_results.h"
#include "lostmotion/torsion_curve.h"
#include "points.h"

struct lm_workspace {
  lm_design_workspace design;
  lm_drive drive;
  double value[LM_KEY_COUNT];
  lm_gapless gapless[LM_PHASE_MAX];
  void *dual;             /* of derivatives.cpp */
  lm_known_results known; /* of the pool to which the thread belongs */
  /* of the running task (task_state.h) */
  double task_result[LM_RESULT_MAX];
  double task_slope[LM_RESULT_MAX * LM_FREE_MAX];
  lm_problem finer; /* the task's problem at the phases of the certificate */
};

#ifdef __cplusplus
extern "C" {
#endif

/* Size of what `dual` points to. */
size_t lm_dual_workspace_size(void);

/* lm_evaluate_slopes in derivatives.cpp; *input names the refused input. */
int lm_dual_evaluate(const lm_problem *problem, const lm_scan *scan, const lm_layout *layout,
                     int combination, const double unit[], double result[], double slope[],
                     void *workspace, const char **input);

#ifdef __cplusplus
}
#endif

#endif
