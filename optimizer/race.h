/* The stages that find the promising combinations: a screen examines a few points of each,
 * populations over all of them find the promising regions, a race halves their number while it
 * doubles their budget, and the last ones are polished. A plan adds tasks to the batch, or none
 * when its stage is over. */
#ifndef LOSTMOTION_OPTIMIZER_RACE_H
#define LOSTMOTION_OPTIMIZER_RACE_H

#include "search_state.h"

#ifdef __cplusplus
extern "C" {
#endif

void lm_start_screen(lm_search *search);
void lm_plan_screen(lm_search *search);

/* Islands start from the screened designs. */
void lm_start_population(lm_search *search);
void lm_plan_evolve(lm_search *search);

void lm_start_race(lm_search *search);
void lm_plan_race(lm_search *search);
void lm_plan_polish(lm_search *search);

#ifdef __cplusplus
}
#endif

#endif
