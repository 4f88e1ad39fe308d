/* A size 20 drive of ratio 100 for the measurements: 33 knots, every play in use, two of them
 * in parallel with the spring, no effects; with DRIVE_ENVELOPE 1 they follow an envelope, with
 * DRIVE_EFFECTS 1 or 2 this number of effects is active. In the gap profile: one play of +-150
 * urad. */
#ifndef LOSTMOTION_TESTS_FIRMWARE_DRIVE_H
#define LOSTMOTION_TESTS_FIRMWARE_DRIVE_H

#include "lostmotion/runtime.h"

/* Returns 0, or 1 where the parameters are refused. */
int make_drive(lm_parameters *parameters);

/* A reproducible stream of numbers between low and high (Numerical Recipes' generator). */
lm_real draw_number(uint32_t *seed, lm_real low, lm_real high);

#endif
