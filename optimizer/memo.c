#include "memo.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "platform.h"

struct lm_memo {
  size_t key_size;
  size_t value_size;
  int capacity;
  int count;
  int next; /* the oldest is replaced */
  lm_lock *lock;
  uint64_t *hash;        /* of each key, which is compared first */
  unsigned char *result; /* key and value of each */
};

lm_memo *lm_create_memo(size_t key_size, size_t value_size, int capacity) {
  lm_memo *memo = (lm_memo *)calloc(1, sizeof *memo);
  if (memo == NULL) {
    return NULL;
  }
  memo->key_size = key_size;
  memo->value_size = value_size;
  memo->capacity = capacity;
  memo->lock = lm_create_lock();
  memo->hash = (uint64_t *)malloc((size_t)capacity * sizeof memo->hash[0]);
  memo->result = (unsigned char *)malloc((size_t)capacity * (key_size + value_size));
  if (memo->lock == NULL || memo->hash == NULL || memo->result == NULL) {
    lm_free_memo(memo);
    return NULL;
  }
  return memo;
}

void lm_free_memo(lm_memo *memo) {
  if (memo != NULL) {
    lm_free_lock(memo->lock);
    free(memo->hash);
    free(memo->result);
    free(memo);
  }
}

/* FNV-1a */
static uint64_t hash_of(const void *key, size_t size) {
  const unsigned char *byte = (const unsigned char *)key;
  uint64_t hash = UINT64_C(0xcbf29ce484222325);
  size_t i;
  for (i = 0; i < size; i++) {
    hash = (hash ^ byte[i]) * UINT64_C(0x100000001b3);
  }
  return hash;
}

static unsigned char *result_at(const lm_memo *memo, int place) {
  return memo->result + (size_t)place * (memo->key_size + memo->value_size);
}

int lm_recall(lm_memo *memo, const void *key, void *value) {
  uint64_t hash;
  int known = 0;
  int i;
  if (memo == NULL) {
    return 0;
  }
  hash = hash_of(key, memo->key_size);
  lm_acquire(memo->lock);
  for (i = 0; i < memo->count && !known; i++) {
    if (memo->hash[i] == hash && memcmp(result_at(memo, i), key, memo->key_size) == 0) {
      memcpy(value, result_at(memo, i) + memo->key_size, memo->value_size);
      known = 1;
    }
  }
  lm_release(memo->lock);
  return known;
}

void lm_memorise(lm_memo *memo, const void *key, const void *value) {
  uint64_t hash;
  if (memo == NULL) {
    return;
  }
  hash = hash_of(key, memo->key_size);
  lm_acquire(memo->lock);
  memo->hash[memo->next] = hash;
  memcpy(result_at(memo, memo->next), key, memo->key_size);
  memcpy(result_at(memo, memo->next) + memo->key_size, value, memo->value_size);
  memo->next = (memo->next + 1) % memo->capacity;
  memo->count += memo->count < memo->capacity;
  lm_release(memo->lock);
}
