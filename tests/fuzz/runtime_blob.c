/* Any bytes as a parameter blob, and as a saved history: refused, or safe to run. Bytes are also
 * put after a valid header and CRC, so that the fuzzer reaches the code after these checks. */
#include <stdlib.h>
#include <string.h>

#include "lostmotion/runtime.h"
#include "tally.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void write_word(uint8_t *at, uint32_t word) {
  at[0] = (uint8_t)word;
  at[1] = (uint8_t)(word >> 8);
  at[2] = (uint8_t)(word >> 16);
  at[3] = (uint8_t)(word >> 24);
}

/* Accepted parameters must run: finite and within their limit, for any input. */
static void run(const lm_parameters *parameters, const uint8_t *data, size_t size) {
  static lm_compensator compensator;
  lm_saved saved;
  lm_conditions at;
  size_t k;
  if (lm_start_compensator(&compensator, parameters, 0, 0) != LM_OK) {
    abort();
  }
  for (k = 0; k + sizeof at <= size && k < 8 * sizeof at; k += sizeof at) {
    lm_correction now;
    memcpy(&at, data + k, sizeof at);
    now = lm_step_compensator(&compensator, &at);
    if (!(now.correction_rad >= -parameters->limits.correction_rad &&
          now.correction_rad <= parameters->limits.correction_rad) ||
        now.velocity_rad_s - now.velocity_rad_s != 0 ||
        now.lost_motion_rad - now.lost_motion_rad != 0) {
      abort();
    }
    lm_watch_output(&compensator, at.cycles, at.elapsed_s);
    (void)lm_bound_uncertainty(&compensator);
  }
  if (size >= sizeof saved) {
    memcpy(&saved, data, sizeof saved);
    (void)lm_restore_compensator(&compensator, &saved, 0);
    saved.format = 1;
    saved.fingerprint = parameters->fingerprint;
    saved.crc = lm_find_crc(0, &saved, offsetof(lm_saved, crc));
    if (lm_restore_compensator(&compensator, &saved, 0) != LM_OK) {
      abort();
    }
    memset(&at, 0, sizeof at);
    if (!(lm_step_compensator(&compensator, &at).correction_rad <= 1)) {
      abort();
    }
  }
}

static void load(const uint8_t *blob, size_t length, const uint8_t *data, size_t size) {
  static lm_parameters parameters;
  lm_fault fault;
  lm_status status;
  count_one("blobs");
  status = lm_load_parameters(&parameters, blob, length, lm_effects, LM_EFFECT_COUNT, &fault);
  if (status == LM_OK) {
    run(&parameters, data, size);
  } else if (fault.status != status || !fault.input) {
    abort();
  }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  static uint8_t blob[LM_BLOB_BYTES_MAX + 64];
  size_t body = size < sizeof blob - 20 ? size & ~(size_t)3 : sizeof blob - 20;
  size_t length = 16 + body + 4;
  load(data, size, data, size);
  memcpy(blob, "LMP1", 4);
  write_word(blob + 4, 0x01020304u);
  write_word(blob + 8, LM_PARAMETERS_FORMAT);
  write_word(blob + 12, (uint32_t)length);
  memcpy(blob + 16, data, body);
  write_word(blob + 16 + body, lm_find_crc(0, blob, 16 + body));
  load(blob, length, data, size);
  return 0;
}
