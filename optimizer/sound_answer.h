/* Checks that an answer is valid for a problem. Answers come from files and other machines: a
 * checksum detects damage, not wrong content, so each is checked before use. */
#ifndef LOSTMOTION_OPTIMIZER_SOUND_ANSWER_H
#define LOSTMOTION_OPTIMIZER_SOUND_ANSWER_H

#include "task.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Largest number of evaluations of an answer: the largest budget of a spec. */
#define LM_COUNTED_MAX 1000000000

/* 1: every count, combination and point lies in its range, and no value is NaN. `combinations` as
 * by lm_count_combinations(). */
int lm_is_sound_answer(const lm_problem *problem, int combinations, const lm_answer *answer);

/* a + b, at most LM_COUNTED_MAX, so that the sum with another budget is still an int; both 0 ..
 * LM_COUNTED_MAX.
 */
int lm_add_count(int a, int b);

#ifdef __cplusplus
}
#endif

#endif
