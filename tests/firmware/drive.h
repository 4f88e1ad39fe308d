/* A size 20 drive of ratio 100 for the measurements: catalogue backbone, eight plays, no effects,
 * or every effect with its typical values. */
#ifndef LOSTMOTION_TESTS_FIRMWARE_DRIVE_H
#define LOSTMOTION_TESTS_FIRMWARE_DRIVE_H

#include "lostmotion/runtime.h"

/* Builds the parameters; `effects` of the library's effects in order of kind, at most
 * LM_EFFECTS_MAX. Returns 0, or 1 where a step is refused. */
int make_drive(lm_parameters *parameters, int32_t effects);

/* A reproducible stream of numbers between low and high (Numerical Recipes' generator). */
lm_real draw_number(uint32_t *seed, lm_real low, lm_real high);

#endif
