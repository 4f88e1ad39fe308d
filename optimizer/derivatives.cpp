// Values and derivatives of one point: the model's own source in the number type of dual.h.
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "problem.h"
#include LM_REAL_HEADER

namespace LM_NUMBER_SPACE {
#include "evaluate.h"

struct number_workspace {
  lm_design_workspace design;
  lm_drive drive;
  lm_real value[LM_KEY_COUNT];
  lm_real unit[LM_FREE_MAX];
  lm_real result[LM_RESULT_MAX];
};

static int evaluate(const lm_problem *problem, const lm_scan *scan, const lm_layout *layout,
                    int combination, const double unit[], double result[], double slope[],
                    number_workspace *w, const char **input) {
  const int ranges = problem->range_count;
  int first = 0;
  // At least one pass, so that a problem without ranges gets its values.
  do {
    lm_fault fault;
    lm_status status;
    int lanes = ranges - first < LM_LANES ? ranges - first : LM_LANES;
    for (int i = 0; i < ranges; i++) {
      w->unit[i] = lm_real(unit[i]);
      if (i >= first && i < first + lanes) {
        set_slope(&w->unit[i], i - first);
      }
    }
    lm_fill_values(problem, combination, w->unit, w->value);
    status = lm_build_drive(problem, w->value, &w->drive, &fault);
    if (status == LM_OK) {
      status = lm_measure_drive(problem, scan, layout, w->value, &w->drive, w->result, &w->design,
                                &fault);
    }
    if (status != LM_OK) {
      *input = fault.input;
      return status;
    }
    for (int i = 0; i < layout->count; i++) {
      result[i] = value_of(w->result[i]);
      for (int k = 0; k < lanes; k++) {
        slope[i * ranges + first + k] = slope_of(w->result[i], k);
      }
    }
    first += LM_LANES;
  } while (first < ranges);
  return LM_OK;
}
}  // namespace LM_NUMBER_SPACE

extern "C" {
size_t LM_NUMBER_SIZE(void);
int LM_NUMBER_EVALUATE(const lm_problem *problem, const lm_scan *scan, const lm_layout *layout,
                       int combination, const double unit[], double result[], double slope[],
                       void *workspace, const char **input);

size_t LM_NUMBER_SIZE(void) {
  return sizeof(LM_NUMBER_SPACE::number_workspace);
}

int LM_NUMBER_EVALUATE(const lm_problem *problem, const lm_scan *scan, const lm_layout *layout,
                       int combination, const double unit[], double result[], double slope[],
                       void *workspace, const char **input) {
  return LM_NUMBER_SPACE::evaluate(problem, scan, layout, combination, unit, result, slope,
                                   static_cast<LM_NUMBER_SPACE::number_workspace *>(workspace),
                                   input);
}
}
