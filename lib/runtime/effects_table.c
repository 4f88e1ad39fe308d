/* All effects of the library. A separate file: a program that does not name the table links only
 * the effects in its parameters, whether or not its linker removes unused sections. */
#include "lostmotion/effects.h"

#define LM_EFFECT_POINTER(name) &lm_effect_##name,
const lm_effect *const lm_effects[LM_EFFECT_COUNT] = {LM_EFFECT_LIST(LM_EFFECT_POINTER)};

#if LM_EFFECT_CARDS
#define CONDITION_CARD(field, quantity, meaning, cause, low, high, first, second, least, most, \
                       traits)                                                                 \
  {#field, quantity, meaning, cause, {low, high}, {first, second}, {least, most}, traits},
const lm_condition_card lm_condition_cards[LM_CONDITION_COUNT] = {
    LM_CONDITION_CARD_LIST(CONDITION_CARD)};
#endif
