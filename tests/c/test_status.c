#include "lostmotion/status.h"

#include <string.h>

#include "test.h"

TEST(every_status_has_a_sentence_of_its_own) {
  int a;
  int b;
  for (a = 0; a < (int)LM_STATUS_COUNT; a++) {
    TEST_ASSERT_TRUE(strlen(lm_status_sentence((lm_status)a)) > 0);
    for (b = 0; b < a; b++) {
      TEST_ASSERT_TRUE(strcmp(lm_status_sentence((lm_status)a), lm_status_sentence((lm_status)b)) !=
                       0);
    }
  }
}

TEST(values_outside_the_enumeration_are_unknown) {
  TEST_ASSERT_EQUAL_STRING("unknown status", lm_status_sentence(LM_STATUS_COUNT));
  /* The largest value that the enumeration's type must be able to hold: 15, of four bits. */
  TEST_ASSERT_EQUAL_STRING("unknown status", lm_status_sentence((lm_status)15));
}

TEST(lm_real_has_the_bits_asked_for) {
  TEST_ASSERT_EQUAL_INT(LM_REAL_BITS, (int)(8 * sizeof(lm_real)));
}
