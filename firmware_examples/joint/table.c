#include "table.h"

#include <stdint.h>

#include "target.h"

#define CELL 16

static void print_blanks(int count) {
  for (; count > 0; --count) {
    target_print(" ");
  }
}

void print_left(const char *text, int width) {
  int length = 0;
  while (text[length] != '\0') {
    ++length;
  }
  target_print(text);
  print_blanks(width - length);
}

void print_right(float number, int decimals, int width) {
  char text[CELL];
  uint32_t units;
  int at = CELL - 1;
  int digits;
  float size = number < 0 ? -number : number;
  for (digits = 0; digits < decimals; ++digits) {
    size *= 10;
  }
  units = (uint32_t)(size + 0.5f);
  text[at] = '\0';
  for (digits = 0; digits <= decimals || units > 0; ++digits) {
    if (digits == decimals && decimals > 0) {
      text[--at] = '.';
    }
    text[--at] = (char)('0' + units % 10u);
    units /= 10u;
  }
  if (number < 0) {
    text[--at] = '-';
  }
  print_blanks(width - (CELL - 1 - at));
  target_print(&text[at]);
}
