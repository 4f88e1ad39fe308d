/* libm in the number type of the build. Only the design model includes this; the runtime uses no
 * libm.
 */
#ifndef LOSTMOTION_DESIGN_REAL_MATH_H
#define LOSTMOTION_DESIGN_REAL_MATH_H

#include "../runtime/no_fast_math.h"
#include "lostmotion/real.h"

#if !defined(LM_REAL_HEADER)
#include <math.h>
#if LM_REAL_BITS == 64
#define real_sin sin
#define real_cos cos
#define real_tan tan
#define real_atan atan
#define real_atan2 atan2
#define real_acos acos
#define real_sqrt sqrt
#define real_exp exp
#define real_log log
#define real_pow pow
#define real_fabs fabs
#define real_floor floor
#else
#define real_sin sinf
#define real_cos cosf
#define real_tan tanf
#define real_atan atanf
#define real_atan2 atan2f
#define real_acos acosf
#define real_sqrt sqrtf
#define real_exp expf
#define real_log logf
#define real_pow powf
#define real_fabs fabsf
#define real_floor floorf
#endif
#define real_isfinite(x) isfinite(x)
#define REAL_INFINITY ((lm_real)INFINITY)

/* The arc tangent by its series where the first term left out, t^15 / 15, is below rounding. The
 * angles between a point of a tooth and the tooth's axis are so small. */
#define SERIES_SQUARE_MAX (LM_REAL(1) / LM_REAL(256))
static inline lm_real real_near_atan(lm_real t) {
  const lm_real q = t * t;
  lm_real sum = LM_REAL(1) / LM_REAL(11) - q / LM_REAL(13);
  if (!(q < SERIES_SQUARE_MAX)) {
    return real_atan(t);
  }
  sum = LM_REAL(1) / LM_REAL(9) - q * sum;
  sum = LM_REAL(1) / LM_REAL(7) - q * sum;
  sum = LM_REAL(1) / LM_REAL(5) - q * sum;
  sum = LM_REAL(1) / LM_REAL(3) - q * sum;
  return t - t * q * sum;
}
#define plain_sqrt real_sqrt
#define plain_fabs real_fabs
#else
#define real_near_atan real_atan /* one derivative instead of one for every term */
#define plain_sqrt sqrt
#define plain_fabs fabs
#endif
#define PLAIN_INFINITY ((lm_plain)INFINITY)

#endif
