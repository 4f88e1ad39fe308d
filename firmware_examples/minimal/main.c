#include "lostmotion/runtime.h"
#include "params.h" /* lostmotion export joint.toml -o params.h */

static lm_compensator joint;
static lm_saved kept;      /* in memory that survives power-down */
static float measured_rad; /* motor encoder angle / ratio; this loop follows without error */

/* Every tick, also with the brake on or in a fault: the model needs the whole load history. */
static lm_correction tick(float torque_Nm) {
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  at.torque_Nm = torque_Nm; /* at the output, from gravity, inertia and friction of the load */
  return lm_step_compensator(&joint, &at);
}

static lm_correction wait_for_standstill(float torque_Nm) {
  lm_standstill standstill = {0, 0, 0}; /* begins anew with every wait */
  lm_correction now;
  do {
    now = tick(torque_Nm);
  } while (lm_find_standstill(&joint, &standstill) < 28 / joint_parameters.limits.response_per_s);
  return now;
}

int main(void) {
  const float load_Nm = -12.0f; /* the arm loads the gear: the motor has to turn further */
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  lm_correction now;
  float command_rad, zero_rad, zero_error_rad;
  at.torque_Nm = load_Nm;

  /* Power-up, position loop open: start, restore the load history, settle. */
  if (lm_start_compensator(&joint, &joint_parameters, load_Nm, 0) != LM_OK) {
    return 1; /* pass an lm_fault as the last argument to learn which parameter is wrong */
  }
  (void)lm_restore_compensator(&joint, &kept, 0); /* returns an error if nothing was saved */
  kept.format = 0; /* used up: a later reset must not restore it again */
  now = lm_settle_compensator(&joint, &at);

  /* Close the loop: the command starts at the output angle, so nothing moves. */
  command_rad = measured_rad - now.correction_rad;

  /* Run: the position loop receives command plus correction. */
  for (int k = 0; k < 1000; ++k) {
    command_rad += 0.0005f;
    now = tick(load_Nm);
    measured_rad = command_rad + now.correction_rad;
  }

  /* Emergency stop: the brake holds the motor, ticks continue, the command follows the output.
   * Close again once the correction has stood for seven time constants of the torque filter. */
  now = wait_for_standstill(load_Nm - 5.0f);
  command_rad = measured_rad - now.correction_rad;

  /* Homing at rest: the reported angle gets a new zero, and nothing moves. With the right torque
   * the zero may be wrong by this; if that is too much, drive a load cycle and home again. */
  zero_rad = 1.0f - (measured_rad - now.correction_rad);
  zero_error_rad = lm_bound_uncertainty(&joint);

  /* Power-down, brake on: after the same standstill save the load history for the next power-up. */
  (void)wait_for_standstill(load_Nm);
  lm_save_compensator(&joint, &kept);
  return zero_rad + command_rad > 0.9999f && zero_error_rad < 1e-4f ? 0 : 2;
}
