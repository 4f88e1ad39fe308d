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
#endif

#endif
