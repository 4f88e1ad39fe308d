#include "sine.h"

#include <stdint.h>

#define HALF_TURN_RAD 3.14159265f
#define HALF_TURN_REST_RAD 8.74228e-8f /* HALF_TURN_RAD as a float, less this, is pi */

float sine(float angle_rad) {
  float turns = angle_rad * 0.318309886f;
  int32_t half_turns = (int32_t)(turns < 0 ? turns - 0.5f : turns + 0.5f);
  float x = angle_rad - (float)half_turns * HALF_TURN_RAD;
  float square;
  float series;
  x += (float)half_turns * HALF_TURN_REST_RAD;
  square = x * x;
  /* Taylor to the eleventh power: the rest is below 6e-8 at half pi. */
  series = 2.7557319e-6f - square * 2.5052108e-8f;
  series = -1.9841270e-4f + square * series;
  series = 8.3333333e-3f + square * series;
  series = -0.16666667f + square * series;
  series = x + x * square * series;
  return (half_turns & 1) ? -series : series;
}

float square_root(float value) {
  float root = 0.5f * (1 + value);
  int step;
  /* Newton's method from above decreases monotonically: the value halves until it is near
   * the root, in at most 40 steps over twelve orders of magnitude; then the number of
   * correct digits doubles. */
  for (step = 0; step < 50 && value > 0; ++step) {
    root = 0.5f * (root + value / root);
  }
  return value > 0 ? root : 0;
}
