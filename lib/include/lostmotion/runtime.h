/* The one header a motor controller includes.
 *
 *     static lm_compensator joint;
 *     lm_start_compensator(&joint, &joint_parameters, torque_Nm, &fault);      once
 *     correction = lm_step_compensator(&joint, &conditions);                   every tick
 *
 * joint_parameters comes from the header that `lostmotion export` wrote: the second one.
 *
 * Build lib/runtime/ and lib/status.c with LM_REAL_BITS=32; profile.h lists the sizes that can be
 * chosen. No heap, no libm, no libc but memcpy, no variables of its own, no double, no recursion.
 *
 * What is trusted: parameters that passed lm_check_parameters, and pointers. What is not:
 * everything that arrives per tick, blobs and saved histories.
 */
#ifndef LOSTMOTION_RUNTIME_H
#define LOSTMOTION_RUNTIME_H

#if defined(LM_CONFIG_HEADER)
#include LM_CONFIG_HEADER /* profile.h */
#endif
#ifndef LM_REAL_BITS
#define LM_REAL_BITS 32
#endif

#include "lostmotion/compensator.h"
#include "lostmotion/model.h"
#include "lostmotion/parameters.h"
#include "lostmotion/torque.h"

#endif
