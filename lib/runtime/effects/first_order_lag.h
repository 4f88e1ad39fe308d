/* First-order lag of a condition. */
#ifndef LOSTMOTION_RUNTIME_EFFECTS_FIRST_ORDER_LAG_H
#define LOSTMOTION_RUNTIME_EFFECTS_FIRST_ORDER_LAG_H

#include "lostmotion/effects.h"
#include "runtime/number.h"

/* Memory: difference of the lagging condition, its previous value, and whether it has started. */
enum { BEHIND, BEFORE, STARTED, LAG_MEMORY };

/* Difference of a condition with a lag > 0 from the condition, in its unit.
 *
 * Between two samples the condition x is assumed to be a ramp, for which the lag has a closed form
 * for any length of the step: with u = elapsed / lag, the difference
 *
 *     behind <- behind e^-u - (x - x_before) (1 - e^-u) / u
 *
 * so that a lag far below one sample gives -lag dx/dt. */
static inline lm_real lag_behind(lm_real *memory, lm_real condition, lm_real elapsed_s,
                                 lm_real lag_s) {
  lm_real steps = elapsed_s / lag_s;
  lm_real way = lm_relaxation(steps);
  lm_real ramp = steps > 0 ? way / steps : LM_REAL(1);
  lm_real moved = memory[STARTED] > 0 ? condition - memory[BEFORE] : 0;
  memory[BEHIND] -= way * memory[BEHIND] + ramp * moved;
  memory[BEFORE] = condition;
  memory[STARTED] = 1;
  return memory[BEHIND];
}

#endif
