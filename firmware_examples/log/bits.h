/* Numbers of a log by their bits, and the CRC-32 of the results, each word little-endian. */
#ifndef LOG_BITS_H
#define LOG_BITS_H

#include <string.h>

#include "lostmotion/runtime.h"

static lm_real read_bits(uint32_t bits) {
  lm_real value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

static uint32_t add_word(uint32_t crc, uint32_t word) {
  uint8_t byte[4];
  int i;
  for (i = 0; i < 4; ++i) {
    byte[i] = (uint8_t)(word >> (8 * i) & 0xFFu);
  }
  return lm_find_crc(crc, byte, sizeof byte);
}

static uint32_t add_bits(uint32_t crc, lm_real value) {
  uint32_t bits;
  memcpy(&bits, &value, sizeof bits);
  return add_word(crc, bits);
}

#endif
