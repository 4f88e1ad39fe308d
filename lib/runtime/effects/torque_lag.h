/* First-order lag of the torque. */
#ifndef LOSTMOTION_RUNTIME_EFFECTS_TORQUE_LAG_H
#define LOSTMOTION_RUNTIME_EFFECTS_TORQUE_LAG_H

#include "lostmotion/effects.h"
#include "runtime/number.h"

/* Memory: difference of the lagging torque, previous torque, and whether it has started. */
enum { BEHIND_NM, BEFORE_NM, STARTED, LAG_MEMORY };

/* Torque difference of a lag > 0.
 *
 * Between two samples the torque T is assumed to be a ramp, for which the lag has a closed form for
 * any length of the step: with u = elapsed / lag, the torque difference
 *
 *     behind <- behind e^-u - (T - T_before) (1 - e^-u) / u
 *
 * so that a lag far below one sample gives -lag dT/dt. */
static inline lm_real lag_behind(lm_real *memory, const lm_conditions *at, lm_real lag_s) {
  lm_real steps = at->elapsed_s / lag_s;
  lm_real way = lm_relaxation(steps);
  lm_real ramp = steps > 0 ? way / steps : LM_REAL(1);
  lm_real moved_Nm = memory[STARTED] > 0 ? at->torque_Nm - memory[BEFORE_NM] : 0;
  memory[BEHIND_NM] -= way * memory[BEHIND_NM] + ramp * moved_Nm;
  memory[BEFORE_NM] = at->torque_Nm;
  memory[STARTED] = 1;
  return memory[BEHIND_NM];
}

#endif
