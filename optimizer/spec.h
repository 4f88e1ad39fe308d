/* The search spec as text: one statement per line, "#" begins a comment.
 *
 * It is the content of a spec in TOML, flattened, with every name resolved; it is stored in the
 * journal and identifies the search.
 *
 *   seed 1                                  evaluations 20000
 *   rated_torque_Nm 40                      torque_Nm 1.6            (0: 4 % of rated)
 *   ratio_sign -1                           rigid_gear_turns 1
 *   phases 2                                level worst | probable | quantile
 *   objective lost_motion                   one line each, the first one leads
 *   fixed teeth.module_mm 0.25
 *   range teeth.flexspline_shift 2 5
 *   whole tolerance.0.grade 5 9             a range that ends in integers
 *   choose generator.type discs rollers     numbers, or the names of drive files
 *   ratio 95 105                            every number of teeth with a ratio in there
 *   limit safety_factor_min 1.5             names of lm_limit_name
 *   limit free_assembly 1                   limit gap_at_worst_corner 1
 *   link INFLUENCE DIAMETER_MM POSITION OFFSET_MM COST_WEIGHT DISTRIBUTION ZONE
 *                                           normal normal_inspected triangular uniform;
 *                                           generator teeth
 *   radial COEFFICIENT EXPONENT SHARE PRELOAD_N
 *   torsion STIFFNESS_NM_PER_RAD RATIO
 *   cost tolerance_exponent 1               cost size 1              cost discs 3
 *   damaged_share 0.05                      to test the search
 *   start discs 3.1 7                       a design to begin with: a value of every choice, then
 *                                           of every range, in their order; after all other
 *                                           statements
 *
 * A key is fixed, varied or chosen, once; so is a quantity that two keys can state
 * (rigid_shift and shift_difference, deflection_mm and deflection_modules). `ratio` chooses
 * teeth.flexspline_teeth. */
#ifndef LOSTMOTION_OPTIMIZER_SPEC_H
#define LOSTMOTION_OPTIMIZER_SPEC_H

#include <stddef.h>
#include <stdint.h>

#include "points.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Error in a spec. */
typedef struct lm_spec_error {
  int line;       /* from 1; 0: the spec as a whole */
  char text[160]; /* one sentence: what was found, what was expected */
} lm_spec_error;

/* Read a spec and prepare its problem (lm_prepare_problem). If not LM_OK, *error states the place
 * and the reason, and the problem is invalid. LM_NULL, LM_CORRUPT (a line that is no statement),
 * and what lm_prepare_problem refuses. */
lm_status lm_read_spec(const char *text, lm_problem *problem, lm_spec_error *error);

/* FNV-1a of a text, which distinguishes the journals of different specs. */
uint64_t lm_hash_text(const char *text);

#ifdef __cplusplus
}
#endif

#endif
