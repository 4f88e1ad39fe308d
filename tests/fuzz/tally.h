/* How many calls of the library, or blobs, a fuzz target has made; printed when it ends. */
#ifndef LOSTMOTION_TESTS_FUZZ_TALLY_H
#define LOSTMOTION_TESTS_FUZZ_TALLY_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

static uint64_t tally;
static const char *tally_of;

static void print_tally(void) {
  fprintf(stderr, "%llu %s\n", (unsigned long long)tally, tally_of);
}

/* Counts one; `what` is reported at the end. */
static void count_one(const char *what) {
  if (!tally_of) {
    tally_of = what;
    (void)atexit(print_tally);
  }
  tally += 1;
}

#endif
