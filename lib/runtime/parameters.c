#include "lostmotion/parameters.h"

#include <string.h>

#include "runtime/number.h"
#include "runtime/plain_symbol.h"

#define MAGIC 0x31504D4Cu /* "LMP1", least significant byte first */
#define ENDIANNESS_MARK 0x01020304u
#define HEADER_BYTES 16
#define CRC_BYTES 4

/* Bit by bit: a table would cost a quarter of the whole runtime's flash to save a millisecond. */
uint32_t lm_find_crc(uint32_t before, const void *bytes, size_t length) {
  const uint8_t *byte = (const uint8_t *)bytes;
  uint32_t crc = ~before;
  size_t i;
  for (i = 0; i < length; ++i) {
    int bit;
    crc ^= byte[i];
    for (bit = 0; bit < 8; ++bit) {
      crc = (crc >> 1) ^ (0xEDB88320u & (0u - (crc & 1u)));
    }
  }
  return ~crc;
}

/* The numbers from the torque limit to the last of the ranges that were fitted: they are
 * consecutive in the struct, in this order, and in the binary form as well. Their bounds
 * are a table, which needs a third of the flash of individual calls; pairs of bounds are
 * another table. */
enum {
  UP_TO_TORQUE_LIMIT,
  PERIOD,
  UP_TO_ONE,
  ABOVE_ZERO,
  RESPONSE,
  WINDOW,
  FROM_ZERO_TO_ONE,
  FROM_ZERO,
  FREQUENCY,
  CONDITION,
  BOUNDS
};

static const lm_real low_and_high[BOUNDS][2] = {
    {SMALLEST, LM_TORQUE_LIMIT_MAX_NM},
    {LM_REAL(1e-6), 1},
    {SMALLEST, 1},
    {SMALLEST, LARGEST},
    {LM_REAL(1e-3), LARGEST},
    {LM_REAL(1e-6), LM_REAL(1e6)},
    {0, 1},
    {0, LARGEST},
    {0, LM_REAL(1e6)},
    {-LM_CONDITION_MAX, LM_CONDITION_MAX},
};

/* The last of a pair has the name of the first, and is not below it. */
static const char *const names[] = {
    "torque_limit_Nm",
    "period_s",
    "correction_rad",
    "velocity_rad_s",
    "acceleration_rad_s2",
    "jerk_rad_s3",
    "response_per_s",
    "window_s",
    "fade_s",
    "noise_rad",
    "misfit_rad",
    "creep_rad_s",
    "ringing_Hz",
    "valid.torque_Nm",
    "valid.temperature_C",
    0,
    "valid.cycles",
    0,
    "valid.input_velocity_rad_s",
    0,
};
#define NUMBERS (sizeof names / sizeof names[0])
static const uint8_t bounds_of[NUMBERS] = {
    UP_TO_TORQUE_LIMIT, PERIOD,    UP_TO_ONE, ABOVE_ZERO, ABOVE_ZERO,
    ABOVE_ZERO,         RESPONSE,  WINDOW,    WINDOW,     FROM_ZERO_TO_ONE,
    FROM_ZERO_TO_ONE,   FROM_ZERO, FREQUENCY, FROM_ZERO,  CONDITION,
    CONDITION,          CONDITION, CONDITION, CONDITION,  CONDITION,
};
#define FIRST_NUMBER offsetof(lm_parameters, torque_limit_Nm)
typedef char numbers_follow_each_other
    [offsetof(lm_parameters, plays) - FIRST_NUMBER == NUMBERS * sizeof(lm_real) ? 1 : -1];
#define LIMITS_FIRST 1 /* what follows the torque limit is in this order in the binary form */

static lm_real number_at(const lm_parameters *parameters, size_t i) {
  lm_real value;
  (void)memcpy(&value, (const char *)parameters + FIRST_NUMBER + i * sizeof value, sizeof value);
  return value;
}

static lm_status check_numbers(const lm_parameters *parameters, lm_fault *fault) {
  const lm_limits *limits = &parameters->limits;
  const lm_watch *watch = &parameters->watch;
  const char *name = NULL;
  lm_real before = 0;
  size_t i;
  for (i = 0; i < NUMBERS; ++i) {
    const lm_real *bound = low_and_high[bounds_of[i]];
    lm_real value = number_at(parameters, i);
    lm_status status;
    name = names[i] ? names[i] : name;
    status = lm_check_range(fault, name, value, bound[0], bound[1]);
    if (status == LM_OK && !names[i] && before > value) {
      status = lm_refuse(fault, LM_INCONSISTENT, name, before, -LM_CONDITION_MAX, value);
    }
    if (status != LM_OK) {
      return status;
    }
    before = value;
  }
  /* Tolerance of one rounding, so that 1 / (16 period) itself passes. */
  if (!(limits->response_per_s * limits->period_s <= LM_REAL(0.062501))) {
    return lm_refuse(fault, LM_OUT_OF_RANGE, "response_per_s", limits->response_per_s, 0,
                     LM_REAL(0.0625) / limits->period_s);
  }
  if (!(watch->misfit_rad >= watch->noise_rad)) {
    return lm_refuse(fault, LM_OUT_OF_RANGE, "misfit_rad", watch->misfit_rad, watch->noise_rad, 1);
  }
  return LM_OK;
}

#if LM_EFFECTS_MAX > 0
static lm_status check_effects(const lm_parameters *parameters, lm_fault *fault) {
  int32_t count = parameters->effect_count;
  lm_real memory_count = 0; /* the sum of integers may not fit an integer */
  int32_t i;
  if (count < 0 || count > LM_EFFECTS_MAX) {
    return lm_refuse(fault, LM_OUT_OF_RANGE, "effect_count", LM_REAL(count), 0,
                     LM_REAL(LM_EFFECTS_MAX));
  }
  for (i = 0; i < count; ++i) {
    const lm_effect_use *use = &parameters->effect[i];
    lm_status status = lm_check_effect(use->effect, use->value, fault);
    if (status != LM_OK) {
      return status;
    }
    if (i > 0 && use->effect->kind < parameters->effect[i - 1].effect->kind) {
      return lm_refuse(fault, LM_INCONSISTENT, "effect", LM_REAL(i), 0, 0);
    }
    memory_count += LM_REAL(use->effect->memory_count);
  }
  if (memory_count > LM_REAL(LM_EFFECT_MEMORY_MAX)) {
    return lm_refuse(fault, LM_TOO_SMALL, "LM_EFFECT_MEMORY_MAX", memory_count, 0,
                     LM_REAL(LM_EFFECT_MEMORY_MAX));
  }
  return LM_OK;
}
#endif

lm_status lm_check_parameters(const lm_parameters *parameters, lm_fault *fault) {
  const uint32_t layout = LM_PARAMETERS_LAYOUT;
  lm_status status;
  lm_real least_slope_rad_per_Nm = LM_PLAY_WEIGHT_MAX;
  if (!parameters) {
    return lm_refuse(fault, LM_NULL, "parameters", 0, 0, 0);
  }
  if (parameters->format != layout) {
    return lm_refuse(fault, LM_CORRUPT, "format", LM_REAL(parameters->format), LM_REAL(layout),
                     LM_REAL(layout));
  }
  status = check_numbers(parameters, fault);
#if LM_PROFILE != LM_PROFILE_GAP
  if (status == LM_OK) {
    status = lm_check_curve(&parameters->curve, fault);
  }
  if (status == LM_OK) {
    least_slope_rad_per_Nm = lm_find_least_slope(&parameters->curve);
  }
#endif
  if (status == LM_OK) {
    status = lm_check_play_bank(&parameters->plays, least_slope_rad_per_Nm, fault);
  }
#if LM_EFFECTS_MAX > 0
  if (status == LM_OK) {
    status = check_effects(parameters, fault);
  }
#endif
  return status;
}

/* The binary form is read and written byte by byte, so that the host's own order does not
 * matter. */
typedef struct reader {
  const uint8_t *bytes;
  size_t at;
  size_t end;
} reader;

/* Past the end it returns zeros and continues counting, so that `at` shows a form that is too
 * short. */
static uint32_t read_word(reader *from) {
  uint32_t word = 0;
  if (from->at + 4 <= from->end) {
    const uint8_t *byte = from->bytes + from->at;
    word = (uint32_t)byte[0] | (uint32_t)byte[1] << 8 | (uint32_t)byte[2] << 16 |
           (uint32_t)byte[3] << 24;
  }
  from->at += 4;
  return word;
}

static lm_real read_real(reader *from) {
  uint32_t word = read_word(from);
  float value;
  (void)memcpy(&value, &word, sizeof value);
  return (lm_real)value;
}

static lm_status check_header(const uint8_t *bytes, size_t length, lm_fault *fault) {
  reader from;
  uint32_t word;
  from.bytes = bytes;
  from.at = 0;
  from.end = length;
  if (length < HEADER_BYTES + CRC_BYTES) {
    return lm_refuse(fault, LM_CORRUPT, "length", LM_REAL(length), HEADER_BYTES + CRC_BYTES, 0);
  }
  word = read_word(&from);
  if (word != MAGIC) {
    return lm_refuse(fault, LM_CORRUPT, "magic", LM_REAL(word), LM_REAL(MAGIC), LM_REAL(MAGIC));
  }
  word = read_word(&from);
  if (word != ENDIANNESS_MARK) {
    return lm_refuse(fault, LM_CORRUPT, "endianness", LM_REAL(word), LM_REAL(ENDIANNESS_MARK),
                     LM_REAL(ENDIANNESS_MARK));
  }
  word = read_word(&from);
  if (word != LM_PARAMETERS_FORMAT) {
    return lm_refuse(fault, LM_CORRUPT, "format", LM_REAL(word), LM_REAL(LM_PARAMETERS_FORMAT),
                     LM_REAL(LM_PARAMETERS_FORMAT));
  }
  word = read_word(&from);
  if (word != length || word % 4 != 0) {
    return lm_refuse(fault, LM_CORRUPT, "length", LM_REAL(word), LM_REAL(length), LM_REAL(length));
  }
  return LM_OK;
}

static lm_status check_stored_count(const char *size, uint32_t count, int32_t most,
                                    lm_fault *fault) {
  if (count > (uint32_t)most) {
    return lm_refuse(fault, LM_TOO_SMALL, size, LM_REAL(count), 0, LM_REAL(most));
  }
  return LM_OK;
}

static lm_status load_curve(lm_parameters *parameters, reader *from, lm_fault *fault) {
  uint32_t count = read_word(from);
#if LM_PROFILE != LM_PROFILE_GAP
  lm_curve *curve = &parameters->curve;
  lm_status status = check_stored_count("LM_CURVE_POINTS_MAX", count, LM_CURVE_POINTS_MAX, fault);
  uint32_t i;
  if (status != LM_OK) {
    return status;
  }
  for (i = 0; i < count; ++i) {
    curve->torque_Nm[i] = read_real(from);
    curve->angle_rad[i] = read_real(from);
  }
  return lm_build_curve(curve, curve->torque_Nm, curve->angle_rad, (int32_t)count, fault);
#else
  (void)parameters;
  return check_stored_count("LM_CURVE_POINTS_MAX", count, 0, fault);
#endif
}

static lm_status load_plays(lm_play_bank *bank, reader *from, lm_fault *fault) {
  lm_play play[LM_PLAYS_MAX];
  uint32_t count = read_word(from);
  uint32_t outside_count = read_word(from);
  lm_status status = check_stored_count("LM_PLAYS_MAX", count, LM_PLAYS_MAX, fault);
  uint32_t i;
  if (status == LM_OK) {
    status = check_stored_count("outside_count", outside_count, (int32_t)count, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  for (i = 0; i < LM_PLAYS_MAX; ++i) {
    play[i].radius_Nm = i < count ? read_real(from) : 0;
    play[i].widening = i < count ? read_real(from) : 0;
    play[i].weight = i < count ? read_real(from) : 0;
  }
  status = lm_build_play_bank(bank, play, (int32_t)count, (int32_t)outside_count, fault);
  if (status == LM_OK) {
    lm_real envelope_Nm = read_real(from);
    status = lm_set_envelope(bank, envelope_Nm, read_real(from), fault);
  }
  return status;
}

static lm_status load_effects(lm_parameters *parameters, reader *from,
                              const lm_effect *const *table, int32_t table_count, lm_fault *fault) {
  uint32_t count = read_word(from);
  lm_status status = check_stored_count("LM_EFFECTS_MAX", count, LM_EFFECTS_MAX, fault);
#if LM_EFFECTS_MAX > 0
  uint32_t k;
  if (status != LM_OK) {
    return status;
  }
  parameters->effect_count = (int32_t)count;
  for (k = 0; k < count; ++k) {
    lm_effect_use *use = &parameters->effect[k];
    uint32_t id = read_word(from);
    uint32_t value_count = read_word(from);
    uint32_t i;
    use->effect = lm_find_effect(table, table_count, id);
    if (!use->effect || value_count != (uint32_t)use->effect->value_count) {
      return lm_refuse(fault, LM_CORRUPT, "effect", LM_REAL(id), 0, 0);
    }
    for (i = 0; i < value_count; ++i) {
      use->value[i] = read_real(from);
    }
    for (; i < LM_EFFECT_VALUES_MAX; ++i) {
      use->value[i] = 0;
    }
  }
#else
  (void)parameters;
  (void)table;
  (void)table_count;
#endif
  return status;
}

static void load_limits(lm_parameters *parameters, reader *from) {
  size_t i;
  for (i = LIMITS_FIRST; i < NUMBERS; ++i) {
    lm_real value = read_real(from);
    (void)memcpy((char *)parameters + FIRST_NUMBER + i * sizeof value, &value, sizeof value);
  }
}

lm_status lm_load_parameters(lm_parameters *parameters, const uint8_t *bytes, size_t length,
                             const lm_effect *const *table, int32_t table_count, lm_fault *fault) {
  reader from;
  reader last;
  uint32_t crc;
  lm_status status;
  if (!parameters || !bytes || (!table && table_count != 0)) {
    return lm_refuse(fault, LM_NULL, "parameters", 0, 0, 0);
  }
  status = check_header(bytes, length, fault);
  if (status != LM_OK) {
    return status;
  }
  last.bytes = bytes;
  last.at = length - CRC_BYTES;
  last.end = length;
  crc = read_word(&last);
  if (crc != lm_find_crc(0, bytes, length - CRC_BYTES)) {
    return lm_refuse(fault, LM_CORRUPT, "crc", LM_REAL(crc), 0, 0);
  }
  parameters->format = 0;
  parameters->fingerprint = crc;
  from.bytes = bytes;
  from.at = HEADER_BYTES;
  from.end = length - CRC_BYTES;
  parameters->torque_limit_Nm = read_real(&from);
  status = load_curve(parameters, &from, fault);
  if (status == LM_OK) {
    status = load_plays(&parameters->plays, &from, fault);
  }
  if (status == LM_OK) {
    status = load_effects(parameters, &from, table, table_count, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  load_limits(parameters, &from);
  if (from.at != from.end) {
    return lm_refuse(fault, LM_CORRUPT, "length", LM_REAL(length), 0, 0);
  }
  parameters->format = LM_PARAMETERS_LAYOUT;
  status = lm_check_parameters(parameters, fault);
  if (status != LM_OK) {
    parameters->format = 0;
  }
  return status;
}
PLAIN_SYMBOL(lm_load_parameters, LM_SIZES_TEXT)

typedef struct writer {
  uint8_t *byte;
  size_t at;
} writer;

static void write_word(writer *to, uint32_t word) {
  to->byte[to->at] = (uint8_t)(word & 0xFFu);
  to->byte[to->at + 1] = (uint8_t)(word >> 8 & 0xFFu);
  to->byte[to->at + 2] = (uint8_t)(word >> 16 & 0xFFu);
  to->byte[to->at + 3] = (uint8_t)(word >> 24);
  to->at += 4;
}

static void write_real(writer *to, lm_real value) {
  float rounded = (float)value;
  uint32_t word;
  (void)memcpy(&word, &rounded, sizeof word);
  write_word(to, word);
}

static size_t find_length(const lm_parameters *parameters) {
  size_t words =
      4 + 1 + 1 + 2 + 3 * (size_t)parameters->plays.count + 2 + 1 + (NUMBERS - LIMITS_FIRST) + 1;
#if LM_PROFILE != LM_PROFILE_GAP
  words += 2 * (size_t)parameters->curve.count;
#endif
#if LM_EFFECTS_MAX > 0
  {
    int32_t i;
    for (i = 0; i < parameters->effect_count; ++i) {
      words += 2 + (size_t)parameters->effect[i].effect->value_count;
    }
  }
#endif
  return 4 * words;
}

static void store_curve(const lm_parameters *parameters, writer *to) {
#if LM_PROFILE != LM_PROFILE_GAP
  const lm_curve *curve = &parameters->curve;
  int32_t i;
  write_word(to, (uint32_t)curve->count);
  for (i = 0; i < curve->count; ++i) {
    write_real(to, curve->torque_Nm[i]);
    write_real(to, curve->angle_rad[i]);
  }
#else
  (void)parameters;
  write_word(to, 0);
#endif
}

static void store_plays(const lm_play_bank *bank, writer *to) {
  int32_t i;
  write_word(to, (uint32_t)bank->count);
  write_word(to, (uint32_t)bank->outside_count);
  for (i = 0; i < bank->count; ++i) {
    write_real(to, bank->slot[i].radius_Nm);
    write_real(to, bank->slot[i].edge_slope[1] - 1);
    write_real(to, bank->slot[i].weight);
  }
  write_real(to, bank->envelope_Nm);
  write_real(to, bank->knee_Nm);
}

static void store_effects(const lm_parameters *parameters, writer *to) {
#if LM_EFFECTS_MAX > 0
  int32_t k;
  write_word(to, (uint32_t)parameters->effect_count);
  for (k = 0; k < parameters->effect_count; ++k) {
    const lm_effect_use *use = &parameters->effect[k];
    int32_t i;
    write_word(to, use->effect->id);
    write_word(to, (uint32_t)use->effect->value_count);
    for (i = 0; i < use->effect->value_count; ++i) {
      write_real(to, use->value[i]);
    }
  }
#else
  (void)parameters;
  write_word(to, 0);
#endif
}

lm_status lm_store_parameters(const lm_parameters *parameters, uint8_t *bytes, size_t capacity,
                              size_t *length, lm_fault *fault) {
  writer to;
  size_t needed;
  size_t i;
  if (!parameters || !bytes || !length) {
    return lm_refuse(fault, LM_NULL, "parameters", 0, 0, 0);
  }
  needed = find_length(parameters);
  if (capacity < needed) {
    return lm_refuse(fault, LM_TOO_SMALL, "capacity", LM_REAL(capacity), LM_REAL(needed), 0);
  }
  to.byte = bytes;
  to.at = 0;
  write_word(&to, MAGIC);
  write_word(&to, ENDIANNESS_MARK);
  write_word(&to, LM_PARAMETERS_FORMAT);
  write_word(&to, (uint32_t)needed);
  write_real(&to, parameters->torque_limit_Nm);
  store_curve(parameters, &to);
  store_plays(&parameters->plays, &to);
  store_effects(parameters, &to);
  for (i = LIMITS_FIRST; i < NUMBERS; ++i) {
    write_real(&to, number_at(parameters, i));
  }
  write_word(&to, lm_find_crc(0, bytes, to.at));
  *length = needed;
  return LM_OK;
}
