/* The smallest program in float64, for a build without CMake. */
#include "lostmotion/status.h"

int main(void) {
  return !(sizeof(lm_real) == 8 && lm_status_sentence(LM_OK)[0] != '\0');
}
