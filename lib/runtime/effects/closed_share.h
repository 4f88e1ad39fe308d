/* How far a gap is taken up. */
#ifndef LOSTMOTION_RUNTIME_EFFECTS_CLOSED_SHARE_H
#define LOSTMOTION_RUNTIME_EFFECTS_CLOSED_SHARE_H

#include "runtime/number.h"

/* -1 to 1: linear up to the load that closes the gap, then closed (model equation 9a). */
static inline lm_real closed_share(lm_real load, lm_real closing_load) {
  return clamp(load / closing_load, -1, 1);
}

#endif
