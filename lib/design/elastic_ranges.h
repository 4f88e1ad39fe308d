/* Plausible sizes of the elastic members of a drive, with a margin on both sides; within them no
 * intermediate result exceeds the range of float32. The headers of the members state them. */
#ifndef LOSTMOTION_DESIGN_ELASTIC_RANGES_H
#define LOSTMOTION_DESIGN_ELASTIC_RANGES_H

#include "refuse.h"

#define LENGTH_MIN_MM LM_REAL(1e-4)
#define LENGTH_MAX_MM LM_REAL(1e4)
#define FORCE_MAX_N LM_REAL(1e7)
#define TORQUE_MAX_NM LM_REAL(1e6)
#define DISPLACEMENT_MAX_MM LM_REAL(100)
#define FLANK_ANGLE_MAX LM_REAL(1.4)
#define MODULUS_MAX_MPA LM_REAL(1e7)
#define POISSON_MAX LM_REAL(0.49)
#define STIFFNESS_MIN LM_REAL(1e-6)
#define STIFFNESS_MAX LM_REAL(1e15)
#define CHAIN_MAX 64
#define NMM_PER_NM LM_REAL(1000)

/* Refuse a chain that is missing or longer than CHAIN_MAX. */
static inline lm_status check_chain(lm_fault *fault, const char *input, const void *array,
                                    int count) {
  if (array == 0 && count != 0) {
    return refuse(fault, LM_NULL, input);
  }
  return check_range(fault, "count", (lm_real)count, LM_REAL(0), LM_REAL(CHAIN_MAX));
}

#endif
