/* A stop flag for other threads, read and set without a lock; a null flag is never set. */
#ifndef LOSTMOTION_OPTIMIZER_STOP_H
#define LOSTMOTION_OPTIMIZER_STOP_H

#include <stddef.h>

#if defined(__GNUC__)
#define LM_LOAD_FLAG(flag) __atomic_load_n((flag), __ATOMIC_RELAXED)
#define LM_STORE_FLAG(flag) __atomic_store_n((flag), 1, __ATOMIC_RELAXED)
#else
#define LM_LOAD_FLAG(flag) (*(flag))
#define LM_STORE_FLAG(flag) ((void)(*(flag) = 1))
#endif

static inline int lm_is_stopped(const volatile int *flag) {
  return flag != NULL && LM_LOAD_FLAG(flag) != 0;
}

static inline void lm_stop(volatile int *flag) {
  LM_STORE_FLAG(flag);
}

#endif
