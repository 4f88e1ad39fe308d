/* The list of design keys as data is complete, with the names of drive files. */
#include <string.h>

#include "lostmotion/design_keys.h"
#include "test.h"

TEST(test_every_row_is_described) {
  int i;
  for (i = 0; i < LM_DESIGN_KEY_COUNT; i++) {
    lm_design_key key = {0};
    TEST_ASSERT_EQUAL_INT(LM_OK, lm_describe_design_key(i, &key, NULL));
    TEST_ASSERT_TRUE(strlen(key.section) > 0);
    TEST_ASSERT_TRUE(strlen(key.stem) > 0);
    TEST_ASSERT_TRUE_MESSAGE(strlen(key.meaning) > 10, key.stem);
    TEST_ASSERT_TRUE_MESSAGE(key.low < key.high, key.stem);
  }
}

TEST(test_rows_stand_in_the_order_of_the_list) {
  lm_design_key key;
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_describe_design_key(4, &key, NULL));
  TEST_ASSERT_EQUAL_STRING("teeth", key.section);
  TEST_ASSERT_EQUAL_STRING("pressure_angle", key.stem);
  TEST_ASSERT_EQUAL_STRING("_rad", key.suffix);
  TEST_ASSERT_EQUAL_INT(LM_KIND_REAL, key.kind);
  TEST_ASSERT_EQUAL_INT(LM_PER_DEGREE, key.per);
  TEST_ASSERT_EQUAL_INT(LM_FILE_DEFAULT, key.file);
  TEST_ASSERT_TRUE(key.low == LM_REAL(10) && key.high == LM_REAL(35));
  /* 20 deg of ISO 53 in rad */
  TEST_ASSERT_TRUE(key.usual > LM_REAL(0.349065) && key.usual < LM_REAL(0.349066));
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_describe_design_key(LM_DESIGN_KEY_COUNT - 1, &key, NULL));
  TEST_ASSERT_EQUAL_STRING("drive", key.section);
  TEST_ASSERT_EQUAL_STRING("planar_only", key.stem);
  TEST_ASSERT_EQUAL_STRING("", key.suffix);
}

TEST(test_what_is_no_row_is_refused) {
  lm_design_key key;
  lm_fault fault;
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_describe_design_key(0, NULL, &fault));
  TEST_ASSERT_EQUAL_INT(LM_OUT_OF_RANGE, lm_describe_design_key(-1, &key, &fault));
  TEST_ASSERT_EQUAL_STRING("index", fault.input);
  TEST_ASSERT_EQUAL_INT(LM_OUT_OF_RANGE, lm_describe_design_key(LM_DESIGN_KEY_COUNT, &key, &fault));
}

/* Each enumeration has as many names as values, all different, and "" beyond both ends. */
static void check_names(const char *(*name_of)(int), int count) {
  int i;
  int k;
  for (i = 0; i < count; i++) {
    TEST_ASSERT_TRUE(strlen(name_of(i)) > 0);
    for (k = 0; k < i; k++) {
      TEST_ASSERT_TRUE(strcmp(name_of(i), name_of(k)) != 0);
    }
  }
  TEST_ASSERT_EQUAL_STRING("", name_of(count));
  TEST_ASSERT_EQUAL_STRING("", name_of(-1));
}

TEST(test_names_of_enumerations) {
  check_names(lm_deformation_name, LM_EXTERNAL + 1);
  check_names(lm_generator_name, LM_RING + 1);
  check_names(lm_distribution_name, LM_UNIFORM + 1);
  check_names(lm_zone_name, LM_GAP_ZONES);
  TEST_ASSERT_EQUAL_STRING("rollers", lm_generator_name(LM_ROLLERS));
  TEST_ASSERT_EQUAL_STRING("normal_inspected", lm_distribution_name(LM_NORMAL_INSPECTED));
}
