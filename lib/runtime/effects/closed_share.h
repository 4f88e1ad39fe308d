/* Share of a gap that is taken up. */
#ifndef LOSTMOTION_RUNTIME_EFFECTS_CLOSED_SHARE_H
#define LOSTMOTION_RUNTIME_EFFECTS_CLOSED_SHARE_H

#include "lostmotion/effects.h"
#include "runtime/number.h"

#if LM_EFFECT_CARDS
/* The torque that takes up a gap, as a value of a card; a fit starts from 0.4 and 3 % of the rated
 * torque. */
#define TAKEUP_VALUE(typical_Nm)          \
  {"takeup_Nm",                           \
   LM_VALUE_SHAPE,                        \
   (typical_Nm),                          \
   LM_SCALE_RATED_TORQUE,                 \
   {LM_REAL(0.004), LM_REAL(0.03), 0, 0}, \
   0u,                                    \
   "take-up"}
#endif

/* -1 to 1: linear up to the load that closes the gap, then closed (model equation 9a). */
static inline lm_real closed_share(lm_real load, lm_real closing_load) {
  return clamp(load / closing_load, -1, 1);
}

#endif
