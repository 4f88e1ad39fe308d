/* The float32 half of the program: the same names in the source, other symbols in the library. */
#include "lostmotion/status.h"

const char *single_sentence(int status, int *real_bits);

const char *single_sentence(int status, int *real_bits) {
  *real_bits = (int)(8 * sizeof(lm_real));
  return lm_status_sentence((lm_status)status);
}
