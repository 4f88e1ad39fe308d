/* What a motor controller does: links the runtime alone, in float32. */
#include "lostmotion/status.h"

int main(void) {
  return !(sizeof(lm_real) == 4 && lm_status_sentence(LM_OK)[0] != '\0');
}
