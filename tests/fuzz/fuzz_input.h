/* The bytes of a fuzzed input, read one after the other; after its end they are zero. What a target
 * demands of the results. */
#ifndef LOSTMOTION_TESTS_FUZZ_INPUT_H
#define LOSTMOTION_TESTS_FUZZ_INPUT_H

#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef struct fuzz_input {
  const uint8_t *data;
  size_t size;
} fuzz_input;

static inline void take(fuzz_input *input, void *target, size_t length) {
  const size_t taken = length < input->size ? length : input->size;
  memset(target, 0, length);
  memcpy(target, input->data, taken);
  input->data += taken;
  input->size -= taken;
}

static inline uint8_t take_byte(fuzz_input *input) {
  uint8_t byte;
  take(input, &byte, 1);
  return byte;
}

static inline void demand(int holds) {
  if (!holds) {
    abort();
  }
}

/* An object whose bytes were set to UNTOUCHED has them still. */
#define UNTOUCHED 0xa5

static inline int untouched(const void *object, size_t length) {
  const uint8_t *bytes = (const uint8_t *)object;
  size_t i;
  for (i = 0; i < length; i++) {
    if (bytes[i] != UNTOUCHED) {
      return 0;
    }
  }
  return 1;
}

#endif
