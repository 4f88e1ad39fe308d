/* One step of the bank, inlined in the control loop functions. */
#ifndef LOSTMOTION_RUNTIME_PLAY_KERNEL_H
#define LOSTMOTION_RUNTIME_PLAY_KERNEL_H

#include "lostmotion/play.h"
#include "runtime/number.h"
#include "runtime/play_edge.h"

/* Written out, the eight steps cost 14 instructions each on a Cortex-M4F, in a loop 18; with -Os
 * the loop is kept. */
#if defined(__GNUC__) && !defined(__OPTIMIZE_SIZE__)
#define UNROLL _Pragma("GCC unroll 8")
#else
#define UNROLL
#endif

/* Banks of which no band widens have loops of their own, where speed counts. In the gap profile,
 * with a single operator, this has no benefit. */
#if defined(__OPTIMIZE_SIZE__) || LM_PROFILE == LM_PROFILE_GAP
#define NARROW_APART 0
#else
#define NARROW_APART 1
#endif

/* The running sum over all operators, so that the part in series is known at the change from series
 * to parallel. The operators in series come first: their radians are the smaller numbers, and
 * subtracting them from the total costs the parallel part no significant digit. Keeping every sum
 * costs one store an operator where a comparison costs three instructions; without an FPU both are
 * negligible, but the stack is not; with one operator there is only one sum.
 */
#if WITHOUT_FPU || LM_PLAYS_MAX == 1
#define KEEP_EVERY_SUM 0
#else
#define KEEP_EVERY_SUM 1
#endif
#if !KEEP_EVERY_SUM
typedef struct running_sum {
  lm_real total;
  lm_real outside;
} running_sum;
#else
typedef struct running_sum {
  lm_real total;
  lm_real partial[LM_PLAYS_MAX + 1];
} running_sum;
#endif

/* The envelope. Written so that every operation rises or falls with the torque in
 * floating point too (rounding is monotone): the envelope of a larger torque is never the smaller
 * one, therefore the edges below push as they do without it. */
#if LM_ENVELOPE == 0
static inline lm_real envelope_at(const lm_play_bank *bank, lm_real torque_Nm) {
  (void)bank;
  return torque_Nm;
}
#else
static inline lm_real envelope_at(const lm_play_bank *bank, lm_real torque_Nm) {
  lm_real size_Nm = absolute(torque_Nm);
  lm_real knee_Nm2 = bank->knee_Nm * bank->knee_Nm;
  lm_real more_Nm;
  if (!is_positive(bank->envelope_Nm)) {
    return torque_Nm;
  }
  more_Nm = bank->envelope_Nm * (1 - knee_Nm2 / (knee_Nm2 + size_Nm * (bank->knee_Nm + size_Nm)));
  return is_negative(torque_Nm) ? torque_Nm - more_Nm : torque_Nm + more_Nm;
}
#endif

/* The torque that the operators follow if the compliance is multiplied by a factor. Friction in
 * parallel moves with the angle, which changes in proportion to the curve at the torque less that
 * friction, T_e; the envelope stands for the curve: (compliance - 1) U(T_e) / U'(T_e) is added, the
 * effect to first order. */
static inline lm_real softened_torque(const lm_play_bank *bank, lm_real torque_Nm,
                                      lm_real inside_Nm, lm_real compliance) {
  lm_real wound_Nm = torque_Nm + inside_Nm;
#if LM_ENVELOPE > 0
  if (is_positive(bank->envelope_Nm)) {
    lm_real share = absolute(wound_Nm) / bank->knee_Nm;
    lm_real square = 1 + share * (1 + share);
    lm_real slope = 1 + bank->envelope_Nm / bank->knee_Nm * (1 + 2 * share) / (square * square);
    return torque_Nm + (compliance - 1) * (envelope_at(bank, wound_Nm) / slope);
  }
#else
  (void)bank;
#endif
  return torque_Nm + (compliance - 1) * wound_Nm;
}

/* Begins with the state of the first operator: adding it to zero would cost an addition, 70
 * instructions without an FPU. */
static inline void start_sum(running_sum *sum, const lm_play_bank *bank, lm_real z_Nm) {
  sum->total = bank->slot[0].weight * z_Nm;
#if !KEEP_EVERY_SUM
  sum->outside = bank->outside_count == 1 ? sum->total : 0;
#else
  sum->partial[0] = 0;
  sum->partial[1] = sum->total;
#endif
}

static inline void add_to_sum(running_sum *sum, const lm_play_bank *bank, int32_t i, lm_real z_Nm) {
  sum->total += bank->slot[i].weight * z_Nm;
#if !KEEP_EVERY_SUM
  if (i + 1 == bank->outside_count) {
    sum->outside = sum->total;
  }
#else
  sum->partial[i + 1] = sum->total;
#endif
}

static inline lm_play_sum split_sum(const running_sum *sum, const lm_play_bank *bank,
                                    lm_real torque_Nm) {
#if !KEEP_EVERY_SUM
  lm_real outside = sum->outside;
#else
  lm_real outside = sum->partial[bank->outside_count];
#endif
  lm_play_sum split;
  split.outside_rad = outside - bank->outside_rad_per_Nm * torque_Nm;
  split.inside_Nm = (sum->total - outside) - bank->inside_share * torque_Nm;
  return split;
}

/* The operator's state; `widens` and `up` are constants wherever this is inlined. A slope of 1
 * changes no bit, so a bank without widening bands omits the products: a seventh of the model's
 * time, without an FPU a fifth. */
static inline lm_real push_play(const lm_play_slot *slot, lm_real *place_Nm, lm_real at_Nm,
                                int widens, int up) {
  lm_real z_Nm = *place_Nm;
  if (up) {
    z_Nm = greatest(z_Nm, widens ? lower_edge(slot, at_Nm) : at_Nm - slot->radius_Nm);
  } else {
    z_Nm = least(z_Nm, widens ? upper_edge(slot, at_Nm) : at_Nm + slot->radius_Nm);
  }
  *place_Nm = z_Nm;
  return z_Nm;
}

/* Torque that friction in parallel adds to the torque in a state of the memory, T_e - T. */
static inline lm_real friction_inside(const lm_play_bank *bank, const lm_play_memory *memory) {
  lm_real inside_Nm = -bank->inside_share * envelope_at(bank, memory->torque_Nm);
  int32_t i;
  for (i = bank->outside_count; i < bank->count; ++i) {
    inside_Nm += bank->slot[i].weight * memory->z_Nm[i];
  }
  return inside_Nm;
}

/* The torque that a bank follows from a state of its memory; operators that are all in series follow
 * the torque itself. */
static inline lm_real followed_torque(const lm_play_bank *bank, const lm_play_memory *memory,
                                      lm_real torque_Nm, lm_real compliance) {
  if (bank->outside_count == bank->count) {
    return torque_Nm;
  }
  return softened_torque(bank, torque_Nm, friction_inside(bank, memory), compliance);
}

/* One direction of the torque: only the edge on its far side can push. */
static inline void push_plays(const lm_play_bank *bank, lm_play_memory *memory, lm_real at_Nm,
                              running_sum *sum, int widens, int up) {
  int32_t i;
  start_sum(sum, bank, push_play(&bank->slot[0], &memory->z_Nm[0], at_Nm, widens, up));
  UNROLL
  for (i = 1; i < LM_PLAYS_MAX; ++i) {
    add_to_sum(sum, bank, i, push_play(&bank->slot[i], &memory->z_Nm[i], at_Nm, widens, up));
  }
}

static inline lm_play_sum advance_plays(const lm_play_bank *bank, lm_play_memory *memory,
                                        lm_real torque_Nm) {
  int falls = is_greater(memory->torque_Nm, torque_Nm);
  lm_real at_Nm = envelope_at(bank, torque_Nm);
  running_sum sum;
#if NARROW_APART
  if (!bank->widens) {
    if (falls) {
      push_plays(bank, memory, at_Nm, &sum, 0, 0);
    } else {
      push_plays(bank, memory, at_Nm, &sum, 0, 1);
    }
  } else
#endif
      if (falls) {
    push_plays(bank, memory, at_Nm, &sum, 1, 0);
  } else {
    push_plays(bank, memory, at_Nm, &sum, 1, 1);
  }
  memory->torque_Nm = torque_Nm;
  return split_sum(&sum, bank, at_Nm);
}

#endif
