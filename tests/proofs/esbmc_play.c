/* For ESBMC (prove.sh), in IEEE single precision, for every band, every settled memory and every
 * pair of torques: band         after a step z lies between the two edges; one edge     the step by
 * the torque's direction gives the bits of the published two-sided form; idempotence  a second step
 * to the same torque changes nothing.
 *
 * The edges stand for any that rise with the torque, in place of runtime/play_edge.h, which states
 * why they do: comparing two float adders is beyond the solver. */
#define LOSTMOTION_RUNTIME_PLAY_EDGE_H

#include "lostmotion/play.h"
#include "runtime/number.h"

float nondet_float(void);
void __ESBMC_assume(_Bool);
void __ESBMC_assert(_Bool, const char *);

typedef struct band {
  float low;
  float high;
} band;

static float to_Nm;
static band before;
static band after;

static inline float lower_edge(const lm_play_slot *slot, float torque_Nm) {
  (void)slot;
  return torque_Nm == to_Nm ? after.low : before.low;
}

static inline float upper_edge(const lm_play_slot *slot, float torque_Nm) {
  (void)slot;
  return torque_Nm == to_Nm ? after.high : before.high;
}

#include "runtime/play_kernel.h"

int main(void) {
  lm_play_bank bank = {0};
  bank.widens = 1;
  lm_play_memory memory;
  float from_Nm = nondet_float();
  float z_Nm = nondet_float();
  to_Nm = nondet_float();
  before.low = nondet_float();
  before.high = nondet_float();
  after.low = nondet_float();
  after.high = nondet_float();
  __ESBMC_assume(from_Nm == from_Nm && to_Nm == to_Nm && from_Nm != to_Nm);
  __ESBMC_assume(before.low <= before.high && after.low <= after.high);
  __ESBMC_assume(to_Nm > from_Nm ? (after.low >= before.low && after.high >= before.high)
                                 : (after.low <= before.low && after.high <= before.high));
  __ESBMC_assume(z_Nm >= before.low && z_Nm <= before.high);
  memory.torque_Nm = from_Nm;
  memory.z_Nm[0] = z_Nm;

  (void)advance_plays(&bank, &memory, to_Nm);
  __ESBMC_assert(memory.z_Nm[0] >= after.low && memory.z_Nm[0] <= after.high, "band");
  __ESBMC_assert(memory.z_Nm[0] == (z_Nm < after.low    ? after.low
                                    : z_Nm > after.high ? after.high
                                                        : z_Nm),
                 "one edge");
  z_Nm = memory.z_Nm[0];
  (void)advance_plays(&bank, &memory, to_Nm);
  __ESBMC_assert(memory.z_Nm[0] == z_Nm && memory.torque_Nm == to_Nm, "idempotence");
  return 0;
}
