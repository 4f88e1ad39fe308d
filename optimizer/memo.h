/* Results that are needed again, by the bytes of what they depend on. Threads may share it.
 */
#ifndef LOSTMOTION_OPTIMIZER_MEMO_H
#define LOSTMOTION_OPTIMIZER_MEMO_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct lm_memo lm_memo;

/* For a number of results; with one more the oldest is replaced. Null: out of memory. */
lm_memo *lm_create_memo(size_t key_size, size_t value_size, int capacity);
void lm_free_memo(lm_memo *memo); /* may be null */

/* Copy the value of a key; 0 if it is not known, or if the memo is null. */
int lm_recall(lm_memo *memo, const void *key, void *value);

/* Keep a value; with a null memo, nothing. */
void lm_memorise(lm_memo *memo, const void *key, const void *value);

#ifdef __cplusplus
}
#endif

#endif
