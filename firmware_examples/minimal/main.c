#include "lostmotion/runtime.h"
#include "params.h" /* lostmotion export joint.toml -o params.h */

static lm_compensator joint;
static lm_saved kept;      /* in memory that outlives power-down */
static float measured_rad; /* motor encoder over the ratio; in here of a loop without error */

/* Every tick, also with the brake on or at fault: the memory must see the load. */
static lm_correction tick(float torque_Nm) {
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  at.torque_Nm = torque_Nm; /* on the output, by gravity, inertia and friction of the load */
  return lm_step_compensator(&joint, &at);
}

int main(void) {
  const float load_Nm = -12.0f; /* the arm weighs on the gear: the motor has to go further */
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  lm_correction now;
  float command_rad;
  at.torque_Nm = load_Nm;

  /* Power-up, the position loop open: start, take up the history, settle. */
  if (lm_start_compensator(&joint, &joint_parameters, load_Nm, 0) != LM_OK) {
    return 1; /* an lm_fault as the last argument states what is wrong with the parameters */
  }
  (void)lm_restore_compensator(&joint, &kept, 0); /* refused where none was saved */
  now = lm_settle_compensator(&joint, &at);

  /* Close the loop: the command begins where the output is, so nothing moves. */
  command_rad = measured_rad - now.correction_rad;

  /* Run: command and correction go to the position loop. */
  for (int k = 0; k < 1000; ++k) {
    command_rad += 0.0005f;
    now = tick(load_Nm);
    measured_rad = command_rad + now.correction_rad;
  }

  /* Emergency stop: the brake holds the motor, ticks continue, the command follows the output. */
  for (int k = 0; k < 500; ++k) {
    now = tick(load_Nm - 5.0f);
    command_rad = measured_rad - now.correction_rad;
  }

  /* Home: a reference is taken of the reported angle while the correction is at rest. */
  lm_set_mode(&joint, LM_MODE_HOLD);
  do {
    now = tick(load_Nm);
  } while (!(now.status & LM_STATE_SETTLED));
  lm_set_mode(&joint, LM_MODE_RUN); /* and continue from command_rad */

  /* Power-down, the brake on: the history goes to the next power-up. */
  lm_save_compensator(&joint, &kept);
  return measured_rad > 0.4999f && measured_rad < 0.5001f ? 0 : 2;
}
