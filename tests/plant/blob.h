/* Parameters from a file. */
#ifndef LOSTMOTION_TESTS_PLANT_BLOB_H
#define LOSTMOTION_TESTS_PLANT_BLOB_H

#include <stdio.h>

#include "lostmotion/parameters.h"

/* 0, or 1 with the reason on stderr. table[count]: the effects that may occur. */
static inline int load(const char *file, const lm_effect *const *table, int32_t count,
                       lm_parameters *parameters) {
  static uint8_t bytes[LM_BLOB_BYTES_MAX + 1];
  FILE *from = fopen(file, "rb");
  lm_fault why;
  size_t length;
  if (!from) {
    perror(file);
    return 1;
  }
  length = fread(bytes, 1, sizeof bytes, from);
  fclose(from);
  if (lm_load_parameters(parameters, bytes, length, table, count, &why) != LM_OK) {
    fprintf(stderr, "%s: %s: %s\n", file, why.input, lm_status_sentence(why.status));
    return 1;
  }
  return 0;
}

#endif
