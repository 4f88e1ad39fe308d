/* What a motor controller does, for a build without CMake. */
#include "lostmotion/runtime.h"

int main(void) {
  static lm_parameters parameters; /* none: refused */
  static lm_compensator joint;
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  return !(lm_start_compensator(&joint, &parameters, 0, 0) == LM_CORRUPT &&
           lm_step_compensator(&joint, &at).status == LM_STATE_NOT_STARTED);
}
