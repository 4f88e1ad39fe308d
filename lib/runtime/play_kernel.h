/* One step of the bank, for the hot path to take in without a call. */
#ifndef LOSTMOTION_RUNTIME_PLAY_KERNEL_H
#define LOSTMOTION_RUNTIME_PLAY_KERNEL_H

#include "lostmotion/play.h"
#include "runtime/number.h"
#include "runtime/play_edge.h"

/* Written out, the eight steps cost 14 instructions each on a Cortex-M4F, in a loop 18; where size
 * counts (-Os) the loop stays. */
#if defined(__GNUC__) && !defined(__OPTIMIZE_SIZE__)
#define UNROLL _Pragma("GCC unroll 8")
#else
#define UNROLL
#endif

/* The running sum over all operators is kept as it grows, so that the part outside can be read off
 * where the places change. Outside comes first: its radians are the smaller numbers, and
 * subtracting them from the total costs the inside part no digit that matters. */
static inline lm_play_sum split_sum(const lm_play_bank *bank, const lm_real *partial,
                                    lm_real torque_Nm) {
  lm_real outside = partial[bank->outside_count];
  lm_play_sum sum;
  sum.outside_rad = outside - bank->outside_rad_per_Nm * torque_Nm;
  sum.inside_Nm = (partial[LM_PLAYS_MAX] - outside) - bank->inside_share * torque_Nm;
  return sum;
}

static inline lm_play_sum advance_plays(const lm_play_bank *bank, lm_play_memory *memory,
                                        lm_real torque_Nm) {
  lm_real partial[LM_PLAYS_MAX + 1];
  lm_real sum = 0;
  int32_t i;
  partial[0] = 0;
  if (!is_greater(memory->torque_Nm, torque_Nm)) {
    UNROLL
    for (i = 0; i < LM_PLAYS_MAX; ++i) {
      const lm_play_slot *slot = &bank->slot[i];
      lm_real edge_Nm = lower_edge(slot, torque_Nm);
      lm_real z_Nm = greatest(memory->z_Nm[i], edge_Nm);
      memory->z_Nm[i] = z_Nm;
      sum += slot->weight * z_Nm;
      partial[i + 1] = sum;
    }
  } else {
    UNROLL
    for (i = 0; i < LM_PLAYS_MAX; ++i) {
      const lm_play_slot *slot = &bank->slot[i];
      lm_real edge_Nm = upper_edge(slot, torque_Nm);
      lm_real z_Nm = least(memory->z_Nm[i], edge_Nm);
      memory->z_Nm[i] = z_Nm;
      sum += slot->weight * z_Nm;
      partial[i + 1] = sum;
    }
  }
  memory->torque_Nm = torque_Nm;
  return split_sum(bank, partial, torque_Nm);
}

#endif
