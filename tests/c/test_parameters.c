#include "lostmotion/parameters.h"

#include "size20.h"
#include "test.h"

static lm_parameters parameters;
static lm_parameters loaded;
static lm_fault fault;
static uint8_t blob[LM_BLOB_BYTES_MAX];
static size_t length;

void setUp(void) {
  parameters = size20();
  add_effect(&parameters, &lm_effect_torque_scale, LM_REAL(0.25), 0);
  add_effect(&parameters, &lm_effect_thermal_friction, LM_REAL(0.03125), 0);
  add_effect(&parameters, &lm_effect_creep, LM_REAL(0.0078125), 2);
  TEST_ASSERT_EQUAL(LM_OK, lm_check_parameters(&parameters, &fault));
  TEST_ASSERT_EQUAL(LM_OK, lm_store_parameters(&parameters, blob, sizeof blob, &length, &fault));
}
void tearDown(void) {
  (void)put_friction_inside;
  follow_envelope(&parameters);
  (void)draw;
  (void)distance;
}

static lm_status load(size_t bytes) {
  return lm_load_parameters(&loaded, blob, bytes, lm_effects, LM_EFFECT_COUNT, &fault);
}

static void put_word(size_t at, uint32_t word) {
  int i;
  for (i = 0; i < 4; ++i) {
    blob[at + (size_t)i] = (uint8_t)(word >> (8 * i));
  }
}

static void seal(size_t bytes) {
  put_word(12, (uint32_t)bytes);
  put_word(bytes - 4, lm_find_crc(0, blob, bytes - 4));
}

TEST(the_crc_is_the_one_of_zlib) {
  /* The check value of CRC-32/ISO-HDLC for "123456789". */
  TEST_ASSERT_EQUAL_HEX32(0xCBF43926u, lm_find_crc(0, "123456789", 9));
  TEST_ASSERT_EQUAL_HEX32(0xCBF43926u, lm_find_crc(lm_find_crc(0, "1234", 4), "56789", 5));
  TEST_ASSERT_EQUAL_HEX32(0u, lm_find_crc(0, "", 0));
}

TEST(what_is_stored_comes_back) {
  uint8_t again[LM_BLOB_BYTES_MAX];
  size_t again_length = 0;
  int i;
  TEST_ASSERT_EQUAL(LM_OK, load(length));
  TEST_ASSERT_EQUAL(parameters.curve.count, loaded.curve.count);
  TEST_ASSERT_EQUAL(4, loaded.plays.count);
  TEST_ASSERT_EQUAL(3, loaded.effect_count);
  TEST_ASSERT_TRUE(loaded.effect[2].effect == &lm_effect_creep);
  TEST_ASSERT_TRUE(loaded.effect[0].value[0] == LM_REAL(0.25));
  TEST_ASSERT_TRUE(loaded.effect[2].value[1] == 2 && loaded.effect[2].value[2] == 0);
  for (i = 0; i < 6; ++i) {
    TEST_ASSERT_TRUE(loaded.curve.torque_Nm[i] == parameters.curve.torque_Nm[i]);
    TEST_ASSERT_TRUE(loaded.curve.angle_rad[i] == LM_REAL((float)parameters.curve.angle_rad[i]));
  }
  TEST_ASSERT_EQUAL_HEX32(lm_find_crc(0, blob, length - 4), loaded.fingerprint);
  /* Numbers that are rounded to float do not change by storing and loading. */
  TEST_ASSERT_EQUAL(LM_OK,
                    lm_store_parameters(&loaded, again, sizeof again, &again_length, &fault));
  TEST_ASSERT_EQUAL(length, again_length);
  TEST_ASSERT_EQUAL_MEMORY(blob, again, length);
}

/* Written by hand: the order of the bytes is part of the format. */
TEST(the_binary_form_is_little_endian) {
  static const uint8_t start[] = {'L', 'M', 'P', '1', 4, 3, 2, 1, 3, 0, 0, 0};
  static const uint8_t eighty[] = {0x00, 0x00, 0xA0, 0x42}; /* 80 in binary32 */
  TEST_ASSERT_EQUAL_MEMORY(start, blob, sizeof start);
  TEST_ASSERT_EQUAL_MEMORY(eighty, blob + 16, sizeof eighty);
  TEST_ASSERT_EQUAL(6, blob[20]);
}

TEST(every_single_damaged_byte_is_noticed) {
  size_t i;
  for (i = 0; i < length; ++i) {
    blob[i] ^= 0x10;
    TEST_ASSERT_EQUAL(LM_CORRUPT, load(length));
    blob[i] ^= 0x10;
  }
  TEST_ASSERT_EQUAL(LM_OK, load(length));
}

TEST(every_truncation_is_noticed) {
  size_t bytes;
  for (bytes = 0; bytes < length; ++bytes) {
    TEST_ASSERT_EQUAL(LM_CORRUPT, load(bytes));
  }
}

TEST(a_foreign_header_is_refused_by_name) {
  uint8_t kept[16];
  memcpy(kept, blob, sizeof kept);
  TEST_ASSERT_EQUAL(LM_CORRUPT, load(8));
  TEST_ASSERT_EQUAL_STRING("length", fault.input);
  blob[0] = 'X';
  TEST_ASSERT_EQUAL(LM_CORRUPT, load(length));
  TEST_ASSERT_EQUAL_STRING("magic", fault.input);
  memcpy(blob, kept, sizeof kept);
  put_word(4, 0x04030201u);
  TEST_ASSERT_EQUAL(LM_CORRUPT, load(length));
  TEST_ASSERT_EQUAL_STRING("endianness", fault.input);
  memcpy(blob, kept, sizeof kept);
  put_word(8, LM_PARAMETERS_FORMAT + 1);
  TEST_ASSERT_EQUAL(LM_CORRUPT, load(length));
  TEST_ASSERT_EQUAL_STRING("format", fault.input);
  memcpy(blob, kept, sizeof kept);
  put_word(12, (uint32_t)length - 1);
  TEST_ASSERT_EQUAL(LM_CORRUPT, load(length - 1)); /* not a whole number of words */
  TEST_ASSERT_EQUAL_STRING("length", fault.input);
  memcpy(blob, kept, sizeof kept);
  blob[length - 1] ^= 1;
  TEST_ASSERT_EQUAL(LM_CORRUPT, load(length));
  TEST_ASSERT_EQUAL_STRING("crc", fault.input);
}

/* With a correct CRC the contents must still be valid. */
TEST(counts_beyond_the_build_are_refused) {
  size_t plays_at = 20 + 4 + 8 * 6;
  size_t envelope_at = plays_at + 8 + 12 * 4;
  size_t effects_at = envelope_at + 8;
  uint8_t kept[LM_BLOB_BYTES_MAX];
  memcpy(kept, blob, length);
  put_word(20, LM_CURVE_POINTS_MAX + 1);
  seal(length);
  TEST_ASSERT_EQUAL(LM_TOO_SMALL, load(length));
  TEST_ASSERT_EQUAL_STRING("LM_CURVE_POINTS_MAX", fault.input);
  TEST_ASSERT_EQUAL(0, loaded.format);
  memcpy(blob, kept, length);
  put_word(20, 1);
  seal(length);
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, load(length));
  memcpy(blob, kept, length);
  put_word(plays_at, LM_PLAYS_MAX + 1);
  seal(length);
  TEST_ASSERT_EQUAL(LM_TOO_SMALL, load(length));
  TEST_ASSERT_EQUAL_STRING("LM_PLAYS_MAX", fault.input);
  memcpy(blob, kept, length);
  put_word(plays_at + 4, 5);
  seal(length);
  TEST_ASSERT_EQUAL(LM_TOO_SMALL, load(length));
  TEST_ASSERT_EQUAL_STRING("outside_count", fault.input);
  memcpy(blob, kept, length);
  put_word(plays_at + 8, 0x7FC00000u); /* a radius that is NaN */
  seal(length);
  TEST_ASSERT_EQUAL(LM_NOT_FINITE, load(length));
  memcpy(blob, kept, length);
  put_word(envelope_at, 0xBF800000u); /* -1 */
  seal(length);
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, load(length));
  TEST_ASSERT_EQUAL_STRING("envelope_Nm", fault.input);
  memcpy(blob, kept, length);
  put_word(effects_at, LM_EFFECTS_MAX + 1);
  seal(length);
  TEST_ASSERT_EQUAL(LM_TOO_SMALL, load(length));
  TEST_ASSERT_EQUAL_STRING("LM_EFFECTS_MAX", fault.input);
  memcpy(blob, kept, length);
  put_word(effects_at + 4, 1); /* no such id */
  seal(length);
  TEST_ASSERT_EQUAL(LM_CORRUPT, load(length));
  TEST_ASSERT_EQUAL_STRING("effect", fault.input);
  memcpy(blob, kept, length);
  put_word(effects_at + 8, 2); /* torque_scale has one value */
  seal(length);
  TEST_ASSERT_EQUAL(LM_CORRUPT, load(length));
  TEST_ASSERT_EQUAL_STRING("effect", fault.input);
  /* One word too many, and too few words. */
  memcpy(blob, kept, length);
  put_word(length, 0);
  seal(length + 4);
  TEST_ASSERT_EQUAL(LM_CORRUPT, load(length + 4));
  TEST_ASSERT_EQUAL_STRING("length", fault.input);
  memcpy(blob, kept, length);
  put_word(effects_at, 0);
  seal(effects_at + 8);
  TEST_ASSERT_EQUAL(LM_CORRUPT, load(effects_at + 8));
  TEST_ASSERT_EQUAL_STRING("length", fault.input);
  TEST_ASSERT_EQUAL(0, loaded.format);
  /* Complete, but with a period of zero. */
  memcpy(blob, kept, length);
  put_word(length - 4 - 4 * 19, 0); /* the nineteen of limits, watch and validity */
  seal(length);
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, load(length));
  TEST_ASSERT_EQUAL_STRING("period_s", fault.input);
  TEST_ASSERT_EQUAL(0, loaded.format);
  /* The last two numbers may be zero, so a form without them must not pass for one with them. */
  memcpy(blob, kept, length);
  seal(length - 8);
  TEST_ASSERT_EQUAL(LM_CORRUPT, load(length - 8));
  TEST_ASSERT_EQUAL_STRING("length", fault.input);
}

TEST(null_pointers_and_small_buffers_are_refused) {
  TEST_ASSERT_EQUAL(LM_NULL, lm_load_parameters(0, blob, length, lm_effects, 1, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_load_parameters(&loaded, 0, length, lm_effects, 1, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_load_parameters(&loaded, blob, length, 0, 1, &fault));
  TEST_ASSERT_EQUAL(LM_CORRUPT, lm_load_parameters(&loaded, blob, length, 0, 0, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_store_parameters(0, blob, sizeof blob, &length, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_store_parameters(&parameters, 0, 9, &length, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_store_parameters(&parameters, blob, 9, 0, &fault));
  TEST_ASSERT_EQUAL(LM_TOO_SMALL,
                    lm_store_parameters(&parameters, blob, length - 1, &length, &fault));
  TEST_ASSERT_TRUE(fault.low == LM_REAL(length));
  TEST_ASSERT_EQUAL(LM_NULL, lm_check_parameters(0, &fault));
}

static void expect(lm_status status, const char *input) {
  TEST_ASSERT_EQUAL(status, lm_check_parameters(&parameters, &fault));
  TEST_ASSERT_EQUAL_STRING(input, fault.input);
  parameters = size20();
}

TEST(every_limit_is_checked) {
  parameters = size20();
  parameters.format = 9;
  expect(LM_CORRUPT, "format");
  parameters.torque_limit_Nm = 0;
  expect(LM_OUT_OF_RANGE, "torque_limit_Nm");
  parameters.limits.period_s = 2;
  expect(LM_OUT_OF_RANGE, "period_s");
  parameters.limits.correction_rad = 2;
  expect(LM_OUT_OF_RANGE, "correction_rad");
  parameters.limits.velocity_rad_s = 0;
  expect(LM_OUT_OF_RANGE, "velocity_rad_s");
  parameters.limits.acceleration_rad_s2 = -1;
  expect(LM_OUT_OF_RANGE, "acceleration_rad_s2");
  parameters.limits.jerk_rad_s3 = 0;
  expect(LM_OUT_OF_RANGE, "jerk_rad_s3");
  parameters.limits.response_per_s = LM_REAL(62.6); /* 1 / (16 * 1 ms) = 62.5 */
  expect(LM_OUT_OF_RANGE, "response_per_s");
  parameters.watch.window_s = 0;
  expect(LM_OUT_OF_RANGE, "window_s");
  parameters.watch.fade_s = 0;
  expect(LM_OUT_OF_RANGE, "fade_s");
  parameters.watch.noise_rad = -1;
  expect(LM_OUT_OF_RANGE, "noise_rad");
  parameters.watch.misfit_rad = 0;
  expect(LM_OUT_OF_RANGE, "misfit_rad");
  parameters.valid.cycles[1] = LM_REAL(2e12);
  expect(LM_OUT_OF_RANGE, "valid.cycles");
  parameters.valid.temperature_C[0] = 50;
  parameters.valid.temperature_C[1] = 10;
  expect(LM_INCONSISTENT, "valid.temperature_C");
  parameters.valid.input_velocity_rad_s[0] = 1;
  expect(LM_INCONSISTENT, "valid.input_velocity_rad_s");
  parameters.curve.count = 1;
  expect(LM_OUT_OF_RANGE, "count");
  parameters.plays.inside_share = 1;
  expect(LM_INCONSISTENT, "inside_share");
  parameters.effect_count = LM_EFFECTS_MAX + 1;
  expect(LM_OUT_OF_RANGE, "effect_count");
  parameters.effect_count = -1;
  expect(LM_OUT_OF_RANGE, "effect_count");
  parameters.effect_count = 1;
  expect(LM_NULL, "effect");
  add_effect(&parameters, &lm_effect_wear, LM_REAL(1e-5), 9);
  expect(LM_OUT_OF_RANGE, "exponent");
  add_effect(&parameters, &lm_effect_thermal_drift, 0, 0);
  add_effect(&parameters, &lm_effect_torque_offset, 0, 0);
  expect(LM_INCONSISTENT, "effect");
}

static lm_real idle(const lm_real *value, lm_real *own, const lm_conditions *at) {
  return value[0] * own[0] * at->torque_Nm;
}
static const lm_effect hungry = {
    1u, LM_EFFECT_ANGLE, 1, LM_EFFECT_MEMORY_MAX + 1, LM_NEEDS_TORQUE, idle, {{0, 1}}, 0};

TEST(effects_that_need_too_much_memory_are_refused) {
  parameters = size20();
  add_effect(&parameters, &hungry, 0, 0);
  expect(LM_TOO_SMALL, "LM_EFFECT_MEMORY_MAX");
}

TEST(a_users_effect_that_cannot_be_run_is_refused) {
  static lm_effect own;
  const lm_effect sound = {1u, LM_EFFECT_ANGLE, 1, 1, LM_NEEDS_TORQUE, idle, {{0, 1}}, 0};
  parameters = size20();
  own = sound;
  add_effect(&parameters, &own, 0, 0);
  TEST_ASSERT_EQUAL(LM_OK, lm_check_parameters(&parameters, &fault));
  own.run = 0;
  expect(LM_NULL, "run");
  own = sound;
  own.value_count = LM_EFFECT_VALUES_MAX + 1;
  add_effect(&parameters, &own, 0, 0);
  expect(LM_OUT_OF_RANGE, "value_count");
  TEST_ASSERT_TRUE(fault.found == LM_EFFECT_VALUES_MAX + 1 && fault.high == LM_EFFECT_VALUES_MAX);
  own.value_count = 0;
  add_effect(&parameters, &own, 0, 0);
  expect(LM_OUT_OF_RANGE, "value_count");
  own = sound;
  own.kind = (lm_effect_kind)(LM_EFFECT_ANGLE + 1);
  add_effect(&parameters, &own, 0, 0);
  expect(LM_OUT_OF_RANGE, "kind");
  own = sound;
  own.memory_count = -1;
  add_effect(&parameters, &own, 0, 0);
  expect(LM_OUT_OF_RANGE, "memory_count");
  own.memory_count = INT32_MAX;
  add_effect(&parameters, &own, 0, 0);
  add_effect(&parameters, &own, 0, 0);
  expect(LM_TOO_SMALL, "LM_EFFECT_MEMORY_MAX");
}
