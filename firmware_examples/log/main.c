/* Runs the controller on recorded loops and computes the error of the output without and with its
 * correction. `lostmotion demo` writes log.h and params.h and reads the output: one line per run
 * with the rms error without and with the correction [arcsec], then the CRC-32 of all results,
 * which equals that of `lostmotion replay`. */
#include <string.h>

#include "bits.h"
#include "log.h"
#include "lostmotion/runtime.h"
#include "params.h"
#include "sine.h"
#include "table.h"
#include "target.h"

#define RAD_TO_ARCSEC 206264.81f

typedef struct score {
  float zero_rad; /* zero of the recording for the best fit of the model */
  float before;   /* sums of squares [arcsec^2] */
  float after;
} score;

/* One pass over a run, from power-up. */
static int pass(int32_t first, int32_t last, score *found, uint32_t *crc) {
  static lm_compensator compensator;
  lm_conditions at;
  float offset = 0;
  int32_t k;
  memset(&at, 0, sizeof at);
  found->before = 0;
  found->after = 0;
  if (lm_start_compensator(&compensator, &joint_parameters, read_bits(log_bits[first][0]), 0) !=
      LM_OK) {
    return 1;
  }
  (void)lm_bound_uncertainty(&compensator);
  for (k = first; k < last; ++k) {
    float measured_rad = read_bits(log_bits[k][3]);
    float before;
    float after;
    lm_correction now;
    at.torque_Nm = read_bits(log_bits[k][0]);
    at.temperature_C = read_bits(log_bits[k][1]);
    at.elapsed_s = read_bits(log_bits[k][2]);
    now = lm_step_compensator(&compensator, &at);
    before = (measured_rad - found->zero_rad) * RAD_TO_ARCSEC;
    after = (measured_rad - found->zero_rad + now.correction_rad) * RAD_TO_ARCSEC;
    found->before += before * before;
    found->after += after * after;
    offset += (measured_rad - found->zero_rad - now.lost_motion_rad) * RAD_TO_ARCSEC;
    *crc = add_bits(*crc, now.correction_rad);
    *crc = add_bits(*crc, now.velocity_rad_s);
    *crc = add_bits(*crc, now.acceleration_rad_s2);
    *crc = add_bits(*crc, now.lost_motion_rad);
    *crc = add_word(*crc, now.status);
  }
  found->zero_rad += offset / (float)(last - first) / RAD_TO_ARCSEC;
  return 0;
}

/* The first pass finds the zero of the recording, the second scores. */
int main(void) {
  uint32_t crc = 0;
  int run;
  for (run = 0; run < LOG_RUNS; ++run) {
    int32_t first = log_starts[run];
    int32_t last = log_starts[run + 1];
    score found = {0, 0, 0};
    uint32_t unused = 0;
    if (pass(first, last, &found, &unused) || pass(first, last, &found, &crc)) {
      return 1;
    }
    print_right(square_root(found.before / (float)(last - first)), 3, 0);
    print_right(square_root(found.after / (float)(last - first)), 3, 10);
    target_print("\n");
  }
  target_print_hex(crc);
  target_print("\n");
  return 0;
}
