/* Numbers of files in any locale, including those with a decimal comma. */
#include <float.h>
#include <locale.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "decimal.h"
#include "test.h"

void tearDown(void) {
  (void)setlocale(LC_ALL, "C");
}

/* The point of a locale that is not installed cannot be tried. */
static void set(const char *locale) {
  if (setlocale(LC_ALL, locale) == NULL) {
    TEST_IGNORE_MESSAGE("no such locale: apt install locales, then configure the build again");
  }
}

/* The bits of any double come back, and the text is that of the locale "C". */
static void check_all(const char *locale) {
  char wanted[3][64];
  static const double values[] = {0.25, -1234567.875, 1e-300};
  char text[LM_DECIMAL_MAX];
  uint64_t state = 1;
  double back;
  int i;
  (void)setlocale(LC_ALL, "C");
  for (i = 0; i < 3; i++) {
    snprintf(wanted[i], sizeof wanted[i], "%.17g", values[i]);
  }
  set(locale);
  for (i = 0; i < 3; i++) {
    TEST_ASSERT_EQUAL_STRING(wanted[i], lm_write_decimal(text, values[i], LM_DECIMAL_EXACT));
  }
  for (i = 0; i < 100000; i++) {
    double value;
    state = state * UINT64_C(6364136223846793005) + 1442695040888963407u;
    memcpy(&value, &state, sizeof value);
    if (isfinite(value)) {
      TEST_ASSERT_EQUAL_INT(1, lm_read_decimal(lm_write_decimal(text, value, 17), &back));
      TEST_ASSERT_EQUAL_MEMORY(&value, &back, sizeof value);
      TEST_ASSERT_NULL(strchr(text, ','));
    }
  }
  TEST_ASSERT_EQUAL_INT(1, lm_read_decimal("0.25", &back));
  TEST_ASSERT_EQUAL_DOUBLE(0.25, back);
  TEST_ASSERT_EQUAL_INT(1, lm_read_decimal("-.5e+2", &back));
  TEST_ASSERT_EQUAL_DOUBLE(-50, back);
  TEST_ASSERT_EQUAL_INT(1, lm_read_decimal("7", &back));
  TEST_ASSERT_EQUAL_DOUBLE(7, back);
  TEST_ASSERT_EQUAL_INT(0, lm_read_decimal("0,25", &back));
  TEST_ASSERT_EQUAL_INT(0, lm_read_decimal("1.2.3", &back));
  TEST_ASSERT_EQUAL_INT(0, lm_read_decimal("1x", &back));
  TEST_ASSERT_EQUAL_INT(0, lm_read_decimal(".", &back));
  TEST_ASSERT_EQUAL_INT(0, lm_read_decimal("", &back));
  TEST_ASSERT_EQUAL_STRING("0.3333", lm_write_decimal(text, 1.0 / 3, 4));
  TEST_ASSERT_EQUAL_STRING("-1.7976931348623157e+308",
                           lm_write_decimal(text, -DBL_MAX, LM_DECIMAL_EXACT));
  TEST_ASSERT_EQUAL_STRING("inf", lm_write_decimal(text, HUGE_VAL, LM_DECIMAL_EXACT));
}

TEST(test_the_plain_locale) {
  check_all("C");
}

TEST(test_german) {
  check_all("de_DE.UTF-8");
}

TEST(test_turkish) {
  check_all("tr_TR.UTF-8");
}

/* Its point has two bytes. */
TEST(test_persian) {
  check_all("fa_IR.UTF-8");
}

TEST(test_a_word_too_long_is_no_number) {
  static char word[1000];
  double value;
  memset(word, '1', sizeof word - 1);
  TEST_ASSERT_EQUAL_INT(0, lm_read_decimal(word, &value));
}
