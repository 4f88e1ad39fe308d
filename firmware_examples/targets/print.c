#include "target.h"

void target_print_number(int32_t number) {
  char text[12];
  uint32_t size = number < 0 ? 0u - (uint32_t)number : (uint32_t)number;
  int at = 11;
  text[at] = '\0';
  do {
    text[--at] = (char)('0' + size % 10u);
    size /= 10u;
  } while (size != 0u);
  if (number < 0) {
    text[--at] = '-';
  }
  target_print(&text[at]);
}

void target_print_hex(uint32_t word) {
  char text[9];
  int i;
  for (i = 0; i < 8; ++i) {
    uint32_t digit = (word >> (28 - 4 * i)) & 15u;
    text[i] = (char)(digit < 10u ? '0' + digit : 'a' + digit - 10u);
  }
  text[8] = '\0';
  target_print(text);
}
