/* A desktop program that uses both precisions. Returns 0 when both answer as they should. */
#include <string.h>

#include "lostmotion/status.h"

const char *single_sentence(int status, int *real_bits);

int main(void) {
  int single_bits = 0;
  const char *single = single_sentence((int)LM_OK, &single_bits);
  return !(sizeof(lm_real) == 8 && single_bits == 32 &&
           strcmp(single, lm_status_sentence(LM_OK)) == 0);
}
