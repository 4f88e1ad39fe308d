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
  lm_gapless gapless[LM_PHASE_MAX];
};

// A range that changes only tolerances: contacts and their equilibrium are unchanged. The reference
// of the tests, with one lane, evaluates the whole model for every range.
static bool is_grade(const lm_problem *problem, int range) {
  return LM_LANES > 1 && problem->range[range].key >= LM_KEY_GRADE &&
         !problem->bounds.gap_at_worst_corner;
}

// The drive of a point, with its derivatives by the ranges lane[].
static lm_status build(const lm_problem *problem, int combination, const double unit[],
                       const int lane[], int lanes, number_workspace *w, lm_fault *fault) {
  for (int i = 0; i < problem->range_count; i++) {
    w->unit[i] = lm_real(unit[i]);
  }
  for (int k = 0; k < lanes; k++) {
    set_slope(&w->unit[lane[k]], k);
  }
  lm_fill_values(problem, combination, w->unit, w->value);
  return lm_build_drive(problem, w->value, &w->drive, fault);
}

static void forget_slopes(lm_real *x) {
  *x = lm_real(value_of(*x));
}

// Before the next ranges: reset those of the last pass.
static void forget_gapless(const lm_problem *problem, lm_gapless gapless[]) {
  for (int p = 0; p < problem->phases; p++) {
    forget_slopes(&gapless[p].mesh.middle_rad);
    forget_slopes(&gapless[p].mesh.flank_angle_rad);
    forget_slopes(&gapless[p].mesh.radius_mm);
    for (int t = 0; t < LM_GAPLESS_TORQUES; t++) {
      forget_slopes(&gapless[p].total_rad[t]);
    }
  }
}

// Values, and the derivatives by the ranges lane[].
static void write(const lm_problem *problem, const lm_layout *layout, const int lane[], int lanes,
                  const lm_real from[], double result[], double slope[]) {
  for (int i = 0; i < layout->count; i++) {
    result[i] = value_of(from[i]);
    for (int k = 0; k < lanes; k++) {
      slope[i * problem->range_count + lane[k]] = slope_of(from[i], k);
    }
  }
}

// The next ranges of one kind, at most LM_LANES from *next on.
static int choose_lanes(const lm_problem *problem, bool grades, int *next, int lane[]) {
  int lanes = 0;
  for (; *next < problem->range_count && lanes < LM_LANES; ++*next) {
    if (is_grade(problem, *next) == grades) {
      lane[lanes++] = *next;
    }
  }
  return lanes;
}

static int evaluate(const lm_problem *problem, const lm_scan *scan, const lm_layout *layout,
                    int combination, const double unit[], double result[], double slope[],
                    number_workspace *w, const char **input) {
  int lane[LM_LANES];
  int next = 0;
  int lanes = choose_lanes(problem, false, &next, lane);
  lm_fault fault;
  lm_status status;
  // At least one pass of the whole model, so that a problem without ranges gets its values.
  do {
    status = build(problem, combination, unit, lane, lanes, w, &fault);
    if (status == LM_OK) {
      status = lm_measure_drive(problem, scan, layout, w->value, &w->drive, w->result, w->gapless,
                                &w->design, &fault);
    }
    if (status != LM_OK) {
      *input = fault.input;
      return status;
    }
    write(problem, layout, lane, lanes, w->result, result, slope);
    lanes = choose_lanes(problem, false, &next, lane);
  } while (lanes > 0);
  forget_gapless(problem, w->gapless);
  for (int i = 0; i < layout->count; i++) {
    forget_slopes(&w->result[i]);
  }
  next = 0;
  while ((lanes = choose_lanes(problem, true, &next, lane)) > 0) {
    status = build(problem, combination, unit, lane, lanes, w, &fault);
    if (status == LM_OK) {
      status = lm_measure_tolerances(problem, layout, w->value, &w->drive, w->gapless, w->result,
                                     &fault);
    }
    if (status != LM_OK) {
      *input = fault.input;
      return status;
    }
    write(problem, layout, lane, lanes, w->result, result, slope);
  }
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
