/* The plain symbol beside the one that carries sizes (lostmotion/symbols.h), for dlsym. */
#ifndef LOSTMOTION_RUNTIME_PLAIN_SYMBOL_H
#define LOSTMOTION_RUNTIME_PLAIN_SYMBOL_H

#include "lostmotion/symbols.h"

/* PLAIN_SYMBOL(name, LM_SIZES_TEXT) behind the definition of a function that is declared
 * LM_SIZED(name); LM_PRECISION_TEXT for one that is LM_PRECISE(name). */
#if defined(__ELF__) && defined(__GNUC__) && !defined(LM_REAL_HEADER)
#define PLAIN_SYMBOL(name, text)                                                          \
  LM_BEGIN_DECLS                                                                          \
  extern __typeof__(name) name##_plain __asm__(#name) __attribute__((alias(#name text))); \
  LM_END_DECLS
#else
#define PLAIN_SYMBOL(name, text)
#endif

#endif
