/* A program in float64, for a build without CMake: its structs have the library's sizes. */
#include <string.h>

#include "lostmotion/model.h"
#include "lostmotion/status.h"

int main(void) {
  struct {
    lm_memory memory;
    unsigned char behind[1024];
  } drive;
  size_t i;
  memset(&drive, 0xA5, sizeof drive);
  lm_start_model(&drive.memory, 1);
  for (i = 0; i < sizeof drive.behind; ++i) {
    if (drive.behind[i] != 0xA5) {
      return 1;
    }
  }
  return !(sizeof(lm_real) == 8 && drive.memory.plays.z_Nm[LM_PLAYS_MAX - 1] == 1 &&
           lm_status_sentence(LM_OK)[0] != '\0');
}
