/* A desktop program. Returns 0 when the library answers in the precision that is expected. */
#include <stdlib.h>

#include "lostmotion/status.h"
#include "lostmotion/torsion_curve.h"

int main(int count, char **word) {
  lm_fault fault;
  return !(count == 2 && (int)(8 * sizeof(lm_real)) == atoi(word[1]) &&
           lm_check_drive(NULL, &fault) == LM_NULL && fault.status == LM_NULL);
}
