/* A test of a Unity program. The runner, which calls every TEST of a source in their order, is written
 * from the source (tests/cmake/Runner.cmake). */
#ifndef LOSTMOTION_TESTS_TEST_H
#define LOSTMOTION_TESTS_TEST_H

#include <unity.h>

#define TEST(name) \
  void name(void); \
  void name(void)

/* All tests of the source; the result is that of main. */
int run_tests(void);

#endif
