/* The test bench: motor locked, a torque on the arm that goes up and down, a torque sensor and an
 * encoder on the output. Prints a recording as `lostmotion` reads it. Runs on a PC. */
#include <stdio.h>

#include "plant.h"

#define RATE_NM_PER_S 4.0f
#define STEPS_PER_SAMPLE 160 /* 50 samples a second */
#define LEVER_INERTIA_KGM2 0.05f
#define ENCODER_COUNTS 4194304.0f /* of one output turn: 22 bits */
#define TORQUE_NOISE_NM 0.01f
#define FULL_TURN_RAD 6.28318531f

/* Turning points of the torque. First full cycles, which erase the previous history; then
 * smaller cycles, one-sided cycles, and cycles of decreasing amplitude. */
static const float turning_Nm[] = {
    40, -40, 40, -40, 20,  -20, 20, -8,  8, -8, 3,  -3, 3,  -1.2f, 1.2f,  -1.2f, 30,    10, 25,
    5,  18,  0,  -30, -10, -25, -5, -18, 0, 12, -9, 6,  -4, 2.5f,  -1.5f, 0.8f,  -0.4f, 0};

/* Uniform between -1 and 1 (Numerical Recipes' generator). */
static float draw(uint32_t *seed) {
  *seed = *seed * 1664525u + 1013904223u;
  return (float)(int32_t)(*seed >> 8) * (1.0f / 8388608.0f) - 1.0f;
}

/* A sum of three uniform numbers has variance 1 and is sufficiently similar to sensor noise. */
static float draw_noise(uint32_t *seed) {
  return draw(seed) + draw(seed) + draw(seed);
}

static float round_to(float value, float step) {
  float steps = value / step;
  return (float)(int32_t)(steps < 0 ? steps - 0.5f : steps + 0.5f) * step;
}

int main(void) {
  plant joint;
  plant_load lever;
  uint32_t seed = 3;
  float torque_Nm = 0;
  long step = 0;
  unsigned turn;
  lever.gravity_Nm = 0;
  lever.inertia_kgm2 = LEVER_INERTIA_KGM2;
  plant_start(&joint, lever);
  puts("time_s,torque_Nm,lost_motion_rad");
  for (turn = 0; turn < sizeof turning_Nm / sizeof turning_Nm[0]; ++turn) {
    float change_Nm = RATE_NM_PER_S * PLANT_STEP_S * (turning_Nm[turn] > torque_Nm ? 1.0f : -1.0f);
    while ((turning_Nm[turn] - torque_Nm) * change_Nm > 0) {
      torque_Nm += change_Nm;
      plant_step_locked(&joint, torque_Nm);
      if (++step % STEPS_PER_SAMPLE == 0) {
        printf("%.3f,%.4f,%.9f\n", (double)((float)step * PLANT_STEP_S),
               (double)(torque_Nm + TORQUE_NOISE_NM * draw_noise(&seed)),
               (double)round_to(joint.twist_rad, FULL_TURN_RAD / ENCODER_COUNTS));
      }
    }
  }
  return 0;
}
