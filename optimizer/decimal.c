#include "decimal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Longest word that is read as a number. */
#define WORD_MAX 400

/* Bytes of numbers, "inf" and "nan" in the locale "C". */
static const char plain[] = "+-.0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ()_";

/* Any other byte belongs to the decimal point of the locale, which has one byte or several. */
const char *lm_write_decimal(char text[LM_DECIMAL_MAX], double value, int digits) {
  size_t before;
  size_t point;
  snprintf(text, LM_DECIMAL_MAX, "%.*g", digits, value);
  before = strspn(text, plain);
  point = strcspn(text + before, plain);
  if (point > 0) {
    text[before] = '.';
    memmove(text + before + 1, text + before + point, strlen(text + before + point) + 1);
  }
  return text;
}

/* strtod receives the decimal point of the locale, found between the digits of 0.5. */
int lm_read_decimal(const char *word, double *value) {
  char text[WORD_MAX + LM_DECIMAL_MAX];
  char half[LM_DECIMAL_MAX];
  const size_t length = strlen(word);
  const size_t before = strcspn(word, ".");
  char *end;
  if (length == 0 || length > WORD_MAX || strspn(word, plain) != length) {
    return 0;
  }
  snprintf(half, sizeof half, "%.1f", 0.5);
  half[strlen(half) - 1] = '\0';
  snprintf(text, sizeof text, "%.*s%s%s", (int)before, word, before < length ? half + 1 : "",
           before < length ? word + before + 1 : "");
  *value = strtod(text, &end);
  return end != text && *end == '\0';
}
