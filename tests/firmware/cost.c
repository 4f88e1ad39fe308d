/* Instructions of one step, counted by the QEMU plugin between mark_begin and mark_end, and the
 * stack it uses. MEASURE: 1 the model (curve and plays), 2 the whole compensator. */
#include "drive.h"
#include "target.h"

#define STEPS 4000

__attribute__((noinline, used)) void mark_begin(void) {
  __asm__ volatile("");
}
__attribute__((noinline, used)) void mark_end(void) {
  __asm__ volatile("");
}

static lm_parameters parameters;
static lm_compensator compensator;
static lm_memory memory;

int main(void) {
  lm_conditions at;
  lm_headroom room;
  uint32_t seed = 1;
  uint32_t stack = 0;
  int32_t k;
  if (make_drive(&parameters, 0) ||
      lm_start_compensator(&compensator, &parameters, 0, 0) != LM_OK) {
    return 1;
  }
  lm_start_model(&memory, 0);
  lm_settle_model(&parameters, &memory);
  at = (lm_conditions){0};
  room.correction_rad = LM_REAL(0.004);
  room.velocity_rad_s = LM_REAL(0.04);
  room.acceleration_rad_s2 = 15;
  room.jerk_rad_s3 = LM_REAL(3e4);
  lm_set_headroom(&compensator, &room);
  for (k = 0; k < STEPS; ++k) {
    /* Small moves, full swings, torque beyond the limit, and no torque at all. */
    lm_real reach = (k & 3) == 0 ? LM_REAL(150) : (k & 3) == 1 ? LM_REAL(40) : LM_REAL(3);
    lm_real torque_Nm = (k & 63) == 63 ? LM_REAL(0) : draw_number(&seed, -reach, reach);
    at.torque_Nm = torque_Nm;
    at.output_angle_rad = torque_Nm * LM_REAL(1e-4);
    target_paint_stack();
    mark_begin();
#if MEASURE == 1
    lm_step_model(&parameters, &memory, &at);
#else
    (void)lm_step_compensator(&compensator, &at);
#endif
    mark_end();
    {
      uint32_t used = target_used_stack();
      stack = used > stack ? used : stack;
    }
  }
  target_print("stack ");
  target_print_number((int32_t)stack);
  target_print("\n");
  return 0;
}
