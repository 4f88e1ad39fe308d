#include "lostmotion/runtime.h"
#include "params.h" /* lostmotion export joint.toml -o params.h */

static lm_compensator joint;

/* Every tick: what the output shall do goes in, what the position loop shall do comes out. */
static float compensate(float command_rad, float torque_Nm) {
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  at.torque_Nm = torque_Nm; /* on the output, by gravity, inertia and friction of the load */
  return command_rad + lm_step_compensator(&joint, &at).correction_rad;
}

int main(void) {
  float wish_rad = 0;
  if (lm_start_compensator(&joint, &joint_parameters, 0, 0) != LM_OK) {
    return 1; /* an lm_fault as the last argument says what is wrong with the parameters */
  }
  for (int tick = 0; tick < 1000; ++tick) {
    wish_rad = compensate(0.5f, -12.0f); /* the arm weighs on the gear: it has to aim higher */
  }
  return wish_rad > 0.5f ? 0 : 1;
}
