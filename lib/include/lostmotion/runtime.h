/* The only library header that a motor controller includes.
 *
 *     static lm_compensator joint;
 *     lm_start_compensator(&joint, &joint_parameters, torque_Nm, &fault);      once
 *     correction = lm_step_compensator(&joint, &conditions);                   every tick
 *
 * firmware_examples/axis makes these and all other calls of an axis in an order that moves nothing
 * by surprise (page "Integration"): copy it, and begin there.
 *
 * joint_parameters is in the header that `lostmotion export` writes; include it as well.
 *
 * Build lib/runtime/ and lib/status.c with LM_REAL_BITS=32; profile.h lists the configurable sizes.
 * No heap, no libm, of libc at most memcpy, no static variables, no double, no recursion.
 *
 * Trusted: parameters that passed lm_check_parameters, and pointers. Not trusted: all inputs of a
 * tick, blobs and saved histories.
 */
#ifndef LOSTMOTION_RUNTIME_H
#define LOSTMOTION_RUNTIME_H

#if defined(LM_CONFIG_HEADER)
#include LM_CONFIG_HEADER /* profile.h */
#endif
#if defined(LM_REAL_BITS_BY_DEFAULT)
#error "lostmotion: include lostmotion/runtime.h before other headers, or define LM_REAL_BITS"
#endif
#ifndef LM_REAL_BITS
#define LM_REAL_BITS 32
#endif

#include "lostmotion/compensator.h"
#include "lostmotion/model.h"
#include "lostmotion/parameters.h"
#include "lostmotion/torque.h"

#endif
