/* All effects of the library. A separate file: a program that does not name the table links only
 * the effects in its parameters, whether or not its linker removes unused sections. */
#include "lostmotion/effects.h"

#define LM_EFFECT_POINTER(name) &lm_effect_##name,
const lm_effect *const lm_effects[LM_EFFECT_COUNT] = {LM_EFFECT_LIST(LM_EFFECT_POINTER)};
