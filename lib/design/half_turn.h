/* Everything about a lobe repeats every half turn of the wave generator. */
#ifndef LOSTMOTION_DESIGN_HALF_TURN_H
#define LOSTMOTION_DESIGN_HALF_TURN_H

#include "real_math.h"

#define HALF_PI (LM_PI / LM_REAL(2))

/* The angle reduced to [-pi/2, pi/2]; both ends are unchanged. For an angle so large that its last
 * digit exceeds this range, the result is one of the ends. */
static inline lm_real fold_half_turn(lm_real angle_rad) {
  const lm_real turned = real_fabs(angle_rad);
  lm_real folded = turned + LM_PI * real_floor(LM_REAL(0.5) - turned / LM_PI);
  if (folded < -HALF_PI) {
    folded = -HALF_PI;
  } else if (folded > HALF_PI) {
    folded = HALF_PI;
  }
  return angle_rad < LM_REAL(0) ? -folded : folded;
}

#endif
