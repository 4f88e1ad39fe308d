/* The compensator over a log in flash (log.h, written by the test), and the CRC-32 of every bit
 * that comes out: per tick correction, velocity, acceleration, lost motion and status, each
 * little-endian. `lostmotion replay` prints the same for the same log. */
#include <string.h>

#include "log.h"
#include "lostmotion/runtime.h"
#include "params.h"
#include "target.h"

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

int main(void) {
  static lm_compensator compensator;
  lm_conditions at;
  uint32_t crc = 0;
  int32_t k;
  memset(&at, 0, sizeof at);
  at.temperature_C = LM_REFERENCE_TEMPERATURE_C;
  if (lm_start_compensator(&compensator, &joint_parameters, read_bits(log_bits[0][0]), 0) !=
      LM_OK) {
    return 1;
  }
  (void)lm_bound_uncertainty(&compensator);
  for (k = 0; k < LOG_TICKS; ++k) {
    lm_correction now;
    at.torque_Nm = read_bits(log_bits[k][0]);
    at.temperature_C = read_bits(log_bits[k][1]);
    at.input_angle_rad = read_bits(log_bits[k][2]);
    at.output_angle_rad = read_bits(log_bits[k][3]);
    at.input_velocity_rad_s = read_bits(log_bits[k][4]);
    at.output_acceleration_rad_s2 = read_bits(log_bits[k][5]);
    at.elapsed_s = read_bits(log_bits[k][6]);
    now = lm_step_compensator(&compensator, &at);
    crc = add_bits(crc, now.correction_rad);
    crc = add_bits(crc, now.velocity_rad_s);
    crc = add_bits(crc, now.acceleration_rad_s2);
    crc = add_bits(crc, now.lost_motion_rad);
    crc = add_word(crc, now.status);
  }
  target_print_hex(crc);
  target_print("\n");
  return 0;
}
