/* All of the library's effects. A file of its own: a program that does not name the table links
 * none of them but those in its parameters, whatever its linker does with unused sections. */
#include "lostmotion/effects.h"

#define LM_EFFECT_POINTER(name) &lm_effect_##name,
const lm_effect *const lm_effects[LM_EFFECT_COUNT] = {LM_EFFECT_LIST(LM_EFFECT_POINTER)};
