/* Every call of the optimizer to the system that can fail, failed once: memory, files, threads. The
 * linker puts the functions below in the place of the system's (--wrap). A run must end with a
 * status and a word, leak nothing and go on later to the same bytes. */
#define _POSIX_C_SOURCE 200809L
#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>

#include "run.h"
#include "unity.h"

static int left = -1; /* calls until one fails; < 0: none does */
static int failed;

static int fails(void) {
  if (left < 0 || left-- > 0) {
    return 0;
  }
  failed = 1;
  left = -1;
  errno = ENOSPC;
  return 1;
}

#define WRAP(type, name, declared, passed, failure)    \
  type __real_##name declared;                         \
  type __wrap_##name declared;                         \
  type __wrap_##name declared {                        \
    return fails() ? (failure) : __real_##name passed; \
  }

WRAP(void *, malloc, (size_t size), (size), NULL)
WRAP(void *, calloc, (size_t count, size_t size), (count, size), NULL)
WRAP(void *, realloc, (void *memory, size_t size), (memory, size), NULL)
WRAP(FILE *, fopen, (const char *path, const char *mode), (path, mode), NULL)
WRAP(FILE *, tmpfile, (void), (), NULL)
WRAP(size_t, fwrite, (const void *from, size_t size, size_t count, FILE *file),
     (from, size, count, file), 0)
WRAP(int, fflush, (FILE * file), (file), EOF)
WRAP(int, fsync, (int handle), (handle), -1)
WRAP(int, ftruncate, (int handle, off_t length), (handle, length), -1)
WRAP(int, fseek, (FILE * file, long offset, int from), (file, offset, from), -1)
WRAP(int, rename, (const char *from, const char *to), (from, to), -1)
WRAP(int, pthread_create,
     (pthread_t * thread, const pthread_attr_t *attributes, void *(*work)(void *), void *data),
     (thread, attributes, work, data), EAGAIN)

static const char folder[] = "optimizer_failures";

static const char spec[] =
    "seed 3\n"
    "evaluations 60\n"
    "rated_torque_Nm 40\n"
    "objective lost_motion\n"
    "fixed teeth.module_mm 0.25\n"
    "fixed teeth.face_width_mm 10\n"
    "fixed teeth.flexspline_teeth 200\n"
    "fixed generator.type discs\n"
    "range teeth.flexspline_shift 2 4\n"
    "range teeth.shift_difference -0.3 0.3\n"
    "fixed generator.deflection_modules 0.95\n";

void setUp(void) {
  TEST_ASSERT_EQUAL_INT(0, system("rm -rf optimizer_failures"));
}

void tearDown(void) {
  left = -1;
  TEST_ASSERT_EQUAL_INT(0, system("rm -rf optimizer_failures"));
}

/* One run in which the call number `at` fails; its exit status. */
static int run_with_failure(int at, int resume, int workers, char note[LM_NOTE_MAX]) {
  lm_run *run = NULL;
  volatile int stop = 0;
  int status;
  left = at;
  failed = 0;
  note[0] = '\0';
  status = lm_open_run("spec", spec, folder, resume, &run, note);
  if (status == LM_EXIT_DONE) {
    status = lm_work_run(run, workers, NULL, NULL, &stop, note);
    if (status == LM_EXIT_DONE) {
      status = lm_finish_run(run, status, note);
    }
  }
  lm_close_run(run);
  left = -1;
  return status;
}

static void fail_each_call(int resume, int workers) {
  char note[LM_NOTE_MAX];
  int at = 0;
  int silent = 0;
  do {
    int status;
    TEST_ASSERT_EQUAL_INT(0, system("rm -rf optimizer_failures"));
    if (resume) {
      TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, run_with_failure(-1, 0, 1, note));
      TEST_ASSERT_EQUAL_INT(0, system("truncate -s -20 optimizer_failures/journal.bin"));
    }
    status = run_with_failure(at, resume, workers, note);
    if (failed && status == LM_EXIT_DONE) {
      silent++; /* a thread that did not start, a drive that was tried again */
    } else if (failed) {
      TEST_ASSERT_TRUE(note[0] != '\0');
    } else {
      TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, status);
    }
    at++;
    TEST_ASSERT_LESS_THAN_INT(20000, at);
  } while (failed);
  TEST_ASSERT_GREATER_THAN_INT(20, at);
  TEST_ASSERT_LESS_THAN_INT(at / 2, silent);
}

static void test_every_failure_of_a_new_run_is_told(void) {
  fail_each_call(0, 2);
}

static void test_every_failure_of_a_resumed_run_is_told(void) {
  fail_each_call(1, 1);
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(test_every_failure_of_a_new_run_is_told);
  RUN_TEST(test_every_failure_of_a_resumed_run_is_told);
  return UNITY_END();
}
