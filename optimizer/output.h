/* Results of a search as text: drive file, front, combinations, certificate. */
#ifndef LOSTMOTION_OPTIMIZER_OUTPUT_H
#define LOSTMOTION_OPTIMIZER_OUTPUT_H

#include <stdio.h>

#include "certificate.h"
#include "search.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A drive file (TOML) that reads back as this drive, to the last bit: angles are in rad, and
 * every radial law as a deflection at 1 N and an exponent. */
void lm_write_drive(FILE *file, const lm_drive *drive, const char *name);

/* Margin of a limit in an evaluated result: modules for dimensions, arcmin for the gap, a share of
 * the limit for the others; 1 if the limit is not stated. */
double lm_margin_of(const lm_problem *problem, const lm_layout *layout, const double result[],
                    int limit);

/* A design with its figures and margins as in the search. */
typedef struct lm_measured {
  lm_solution design;
  int computed; /* 0: the model refuses it, without figures and margins */
  double figure[LM_FIGURE_COUNT];
  double margin[LM_LIMIT_COUNT];
} lm_measured;

/* Compute figures and margins of measured->design. */
void lm_measure_design(const lm_problem *problem, lm_measured *measured, lm_workspace *workspace);

/* One design per row: combination, variables, figures, margins of all limits. Designs that the
 * model refuses are left out. */
void lm_write_designs(FILE *file, const lm_problem *problem, const lm_measured measured[],
                      int count);

/* Every combination: its choices, its result and the limit that pruned it. */
void lm_write_combinations(FILE *file, const lm_problem *problem, const lm_search *search);

/* The certificate as JSON. */
void lm_write_certificate(FILE *file, const lm_problem *problem, int combination,
                          const lm_certificate *certificate);

/* Required relaxation of a limit in its stated unit, from a row of evaluate.h; module_mm
 * of the design. */
double lm_stated_relaxation(int limit, double row, double module_mm, const char **unit);

/* Answer of an infeasible search: limits to relax and by how much, JSON. */
void lm_write_relaxation(FILE *file, const double relax[LM_LIMIT_COUNT], double module_mm);

/* One line of JSON. seconds: since the start of the program; left: estimate, < 0 unknown. */
void lm_write_progress(FILE *file, const lm_progress *progress, double seconds, double left);

#ifdef __cplusplus
}
#endif

#endif
