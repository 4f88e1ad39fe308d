/* The two edges of an operator's band. */
#ifndef LOSTMOTION_RUNTIME_PLAY_EDGE_H
#define LOSTMOTION_RUNTIME_PLAY_EDGE_H

#include "lostmotion/play.h"
#include "runtime/number.h"

/* Away from zero the band widens, so the edge on the far side of the torque is the steep one. Both
 * edges are straight lines that meet at zero torque in -+radius; a product and a sum with constants
 * are monotone in floating point too (rounding is), therefore a rising torque can only push the
 * lower edge and a falling one the upper, exactly. */
static inline lm_real lower_edge(const lm_play_slot *slot, lm_real torque_Nm) {
  return slot->edge_slope[is_negative(torque_Nm)] * torque_Nm - slot->radius_Nm;
}

static inline lm_real upper_edge(const lm_play_slot *slot, lm_real torque_Nm) {
  return slot->edge_slope[1 - is_negative(torque_Nm)] * torque_Nm + slot->radius_Nm;
}

#endif
