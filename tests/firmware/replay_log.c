/* The compensator over a log in flash (log.h, written by the test), and the CRC-32 of every result
 * bit: per tick correction, velocity, acceleration, lost motion and status, each little-endian.
 * `lostmotion replay` prints the same for the same log. */
#include <string.h>

#include "bits.h"
#include "log.h"
#include "lostmotion/runtime.h"
#include "params.h"
#include "target.h"

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
