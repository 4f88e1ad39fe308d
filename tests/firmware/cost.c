/* Instructions of one step, counted by a QEMU plugin between mark_begin and mark_end, and the stack
 * it uses. MEASURE: 0 nothing (what the marks themselves cost), 1 the model (curve and plays), 2
 * the whole compensator with limiter and status, 3 the change to parameters with another band, 4 as
 * 2, with the steps that end a motion under limits that were narrowed meanwhile. */
#include "drive.h"
#include "target.h"

#define STEPS 4000

void mark_begin(void);
void mark_end(void);

__attribute__((noinline, used)) void mark_begin(void) {
  __asm__ volatile("");
}
__attribute__((noinline, used)) void mark_end(void) {
  __asm__ volatile("");
}

static lm_parameters parameters;
static lm_parameters others;
static lm_compensator compensator;
static lm_memory memory;
static lm_conditions at;

/* Small moves, full swings, torque beyond the limit, reversal to zero, and none at all. */
static lm_real next_torque(uint32_t *seed, int32_t k) {
  lm_real reach = (k & 3) == 0 ? LM_REAL(150) : (k & 3) == 1 ? LM_REAL(40) : LM_REAL(3);
  if ((k & 63) == 63) {
    return 0;
  }
  if ((k & 63) == 62) {
    return LM_REAL(1e30);
  }
  return draw_number(seed, -reach, reach);
}

/* Everything that can bind binds at some time: narrow room, wide room. */
static void next_headroom(int32_t k) {
  lm_headroom room;
  lm_real share = (k & 512) ? LM_REAL(0.01) : LM_REAL(0.8);
  room.correction_rad = LM_REAL(0.005) * share;
  room.velocity_rad_s = LM_REAL(0.05) * share;
  room.acceleration_rad_s2 = 20 * share;
  room.jerk_rad_s3 = LM_REAL(4e4) * share;
  lm_set_headroom(&compensator, &room);
}

int main(void) {
  volatile lm_real sink = 0;
  uint32_t seed = 1;
  int32_t deepest = 0;
  int32_t k;
  int refused = 0;
  if (make_drive(&parameters) || lm_start_compensator(&compensator, &parameters, 0, 0) != LM_OK) {
    return 1;
  }
  others = parameters;
  others.plays.slot[0].radius_Nm *= LM_REAL(1.01);
  lm_start_model(&memory, 0);
  lm_settle_model(&parameters, &memory);
  for (k = 0; k < STEPS; ++k) {
    volatile uint32_t *sp;
    int32_t used;
    at.torque_Nm = next_torque(&seed, k);
    at.output_angle_rad = at.torque_Nm * LM_REAL(1e-4);
    at.temperature_C = draw_number(&seed, 0, 60);
    next_headroom(k);
#if MEASURE == 2
    /* A step that ends a motion under earlier limits is MEASURE 4's. */
    while (compensator.standing & LM_STATE_HEADROOM_SHORT) {
      (void)lm_step_compensator(&compensator, &at);
    }
#endif
    sp = target_paint_stack();
    mark_begin();
#if MEASURE == 1
    sink = lm_step_model(&parameters, &memory, &at);
#elif MEASURE == 2 || MEASURE == 4
    sink = lm_step_compensator(&compensator, &at).correction_rad;
#elif MEASURE == 3
    refused |= lm_change_parameters(&compensator, (k & 1) ? &parameters : &others, 0) != LM_OK;
#endif
    mark_end();
    used = target_used_stack(sp);
    deepest = used > deepest ? used : deepest;
  }
  (void)sink;
  if (refused) {
    return 1;
  }
  target_print("stack ");
  target_print_number(deepest);
  target_print("\n");
  return 0;
}
