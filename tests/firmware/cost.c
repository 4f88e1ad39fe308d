/* Instructions of one step, counted by a QEMU plugin between mark_begin and mark_end, and its
 * stack. The measured functions run one after the other; mark_next separates them. */
#include "drive.h"
#include "target.h"

#define STEPS 4000
#define CHANGES 400 /* a change costs as much as a hundred steps */

typedef enum measured {
  NOTHING, /* cost of the marks themselves */
  MODEL,   /* curve and operators */
  STEP,    /* the whole compensator with limiter and status */
  ENDING, /* the same, including steps that end a motion under limits that were reduced meanwhile */
  CHANGE, /* to parameters with a different band */
  MEASURED
} measured;

void mark_begin(void);
void mark_end(void);
void mark_next(void);

__attribute__((noinline, used)) void mark_begin(void) {
  __asm__ volatile("");
}
__attribute__((noinline, used)) void mark_end(void) {
  __asm__ volatile("");
}
__attribute__((noinline, used)) void mark_next(void) {
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

/* Every limit is active at some time: small headroom, large headroom. */
static void next_headroom(int32_t k) {
  lm_headroom room;
  lm_real share = (k & 512) ? LM_REAL(0.01) : LM_REAL(0.8);
  room.correction_rad = LM_REAL(0.005) * share;
  room.velocity_rad_s = LM_REAL(0.05) * share;
  room.acceleration_rad_s2 = 20 * share;
  room.jerk_rad_s3 = LM_REAL(4e4) * share;
  lm_set_headroom(&compensator, &room);
}

static volatile lm_real sink;
static int refused;

/* The switch is outside the marks. */
#define BETWEEN_MARKS(call)  \
  sp = target_paint_stack(); \
  mark_begin();              \
  call;                      \
  mark_end();                \
  used = target_used_stack(sp)

static int32_t run(measured what) {
  uint32_t seed = 1;
  int32_t deepest = 0;
  int32_t k;
  refused |= lm_start_compensator(&compensator, &parameters, 0, 0) != LM_OK;
  lm_start_model(&memory, 0);
  lm_settle_model(&parameters, &memory);
  for (k = 0; k < (what == CHANGE ? CHANGES : STEPS); ++k) {
    volatile uint32_t *sp;
    int32_t used;
    at.torque_Nm = next_torque(&seed, k);
    at.output_angle_rad = at.torque_Nm * LM_REAL(1e-4);
    at.temperature_C = draw_number(&seed, 0, 60);
    next_headroom(k);
    switch (what) {
      case MODEL:
        BETWEEN_MARKS(sink = lm_step_model(&parameters, &memory, &at));
        break;
      case STEP:
        while (compensator.standing & LM_STATE_HEADROOM_SHORT) {
          (void)lm_step_compensator(&compensator, &at);
        }
        BETWEEN_MARKS(sink = lm_step_compensator(&compensator, &at).correction_rad);
        break;
      case ENDING:
        BETWEEN_MARKS(sink = lm_step_compensator(&compensator, &at).correction_rad);
        break;
      case CHANGE:
        BETWEEN_MARKS(refused |= lm_change_parameters(&compensator, (k & 1) ? &parameters : &others,
                                                      0) != LM_OK);
        break;
      default:
        BETWEEN_MARKS((void)0);
        break;
    }
    deepest = used > deepest ? used : deepest;
  }
  return deepest;
}

int main(void) {
  int what;
  if (make_drive(&parameters)) {
    return 1;
  }
  others = parameters;
  others.plays.slot[0].radius_Nm *= LM_REAL(1.01);
  for (what = NOTHING; what < MEASURED; ++what) {
    mark_next();
    target_print("stack ");
    target_print_number(run((measured)what));
    target_print("\n");
  }
  return refused;
}
