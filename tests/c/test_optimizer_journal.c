/* The journal of a search: reading, and all kinds of files that are not journals. */
#include <errno.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "journal.h"
#include "lostmotion/parameters.h"
#include "machine.h"
#include "platform.h"
#include "test.h"

#define MARK UINT32_C(0x4c4d414e)
#define HEADER_BYTES 40

typedef struct head {
  uint32_t mark;
  uint32_t length;
  uint32_t crc;
} head;

static char path[64];
static lm_answer *answer;
static lm_answer *last;
static int taken;
static lm_journal_report report;

static const char spec[] = "seed 1\n";

void setUp(void) {
  snprintf(path, sizeof path, "optimizer_journal_%ld.bin", process_number());
  answer = (lm_answer *)calloc(1, sizeof *answer);
  last = (lm_answer *)calloc(1, sizeof *last);
  taken = 0;
}

void tearDown(void) {
  (void)remove(path);
  free(answer);
  free(last);
}

static lm_status take(void *context, const lm_answer *found) {
  (void)context;
  *last = *found;
  taken++;
  return LM_OK;
}

static lm_status take_one(void *context, const lm_answer *found) {
  return taken > 0 ? LM_OUT_OF_RANGE : take(context, found);
}

/* A journal with two answers, of 3 designs and of 2 members. */
static void write_journal(void) {
  lm_journal *journal;
  (void)remove(path);
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_create_journal(path, spec, &journal));
  answer->id = 1;
  answer->solution_count = 3;
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_append_answer(journal, answer));
  answer->id = 2;
  answer->solution_count = 0;
  answer->member_count = 2;
  answer->solution[1].violation = 0.25;
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_append_answer(journal, answer));
  lm_close_journal(journal);
}

static lm_status resume_with(const char *text) {
  lm_journal *journal = NULL;
  const lm_status status = lm_resume_journal(path, text, take, NULL, &journal, &report);
  lm_close_journal(journal);
  return status;
}

static void overwrite(long at, const void *bytes, size_t length) {
  FILE *file = fopen(path, "r+b");
  TEST_ASSERT_NOT_NULL(file);
  TEST_ASSERT_EQUAL_INT(0, fseek(file, at, SEEK_SET));
  TEST_ASSERT_EQUAL_INT(1, (int)fwrite(bytes, length, 1, file));
  fclose(file);
}

static void append_record(const head *h, const void *bytes, size_t length) {
  FILE *file = fopen(path, "ab");
  TEST_ASSERT_NOT_NULL(file);
  TEST_ASSERT_EQUAL_INT(1, (int)fwrite(h, sizeof *h, 1, file));
  TEST_ASSERT_EQUAL_INT(1, (int)fwrite(bytes, length, 1, file));
  fclose(file);
}

TEST(test_answers_come_back_in_their_order) {
  write_journal();
  TEST_ASSERT_EQUAL_INT(LM_OK, resume_with(spec));
  TEST_ASSERT_EQUAL_INT(2, report.answers);
  TEST_ASSERT_EQUAL_INT(0, report.torn);
  TEST_ASSERT_EQUAL_INT(2, last->id);
  TEST_ASSERT_EQUAL_MEMORY(answer, last,
                           offsetof(lm_answer, solution) + 2 * sizeof last->solution[0]);
}

/* An answer that the reader refuses is not an incomplete end: nothing is cut. */
TEST(test_a_refused_answer_leaves_the_journal_as_it_was) {
  lm_journal *journal = NULL;
  write_journal();
  TEST_ASSERT_EQUAL_INT(LM_OUT_OF_RANGE,
                        lm_resume_journal(path, spec, take_one, NULL, &journal, &report));
  TEST_ASSERT_EQUAL_INT(1, report.answers);
  TEST_ASSERT_EQUAL_INT(0, report.torn);
  TEST_ASSERT_NULL(journal);
  taken = 0;
  TEST_ASSERT_EQUAL_INT(LM_OK, resume_with(spec));
  TEST_ASSERT_EQUAL_INT(2, taken);
}

/* A changed record ends the journal, and everything from it on is cut. */
static void assert_ends_there(const head *h, size_t length) {
  write_journal();
  append_record(h, last, length);
  TEST_ASSERT_EQUAL_INT(LM_OK, resume_with(spec));
  TEST_ASSERT_EQUAL_INT(2, report.answers);
  TEST_ASSERT_EQUAL_INT(1, report.torn);
  taken = 0;
  TEST_ASSERT_EQUAL_INT(LM_OK, resume_with(spec));
  TEST_ASSERT_EQUAL_INT(2, taken);
  TEST_ASSERT_EQUAL_INT(0, report.torn);
  memset(last, 0, sizeof *last);
  memset(answer, 0, sizeof *answer);
}

static head head_of(const lm_answer *of, size_t length) {
  head h;
  h.mark = MARK;
  h.length = (uint32_t)length;
  h.crc = lm_find_crc(0, of, length);
  return h;
}

TEST(test_a_record_that_is_none_ends_the_journal) {
  const size_t least = offsetof(lm_answer, solution);
  const size_t one = sizeof last->solution[0];
  head h = head_of(last, least);
  h.mark++;
  assert_ends_there(&h, least);
  h = head_of(last, least - 8);
  assert_ends_there(&h, least - 8);
  h = head_of(last, least);
  h.length = (uint32_t)sizeof *last + 1;
  assert_ends_there(&h, least);
  h = head_of(last, least);
  h.crc ^= 1;
  assert_ends_there(&h, least);
  h = head_of(last, least); /* cut off */
  assert_ends_there(&h, least - 1);
  last->solution_count = -1;
  h = head_of(last, least);
  assert_ends_there(&h, least);
  last->solution_count = LM_SOLUTION_MAX + 1;
  h = head_of(last, least + (LM_SOLUTION_MAX + 1) * one);
  assert_ends_there(&h, least + (LM_SOLUTION_MAX + 1) * one);
  last->member_count = -1;
  h = head_of(last, least);
  assert_ends_there(&h, least);
  last->member_count = LM_PARENT_MAX + 1;
  h = head_of(last, least + (LM_PARENT_MAX + 1) * one);
  assert_ends_there(&h, least + (LM_PARENT_MAX + 1) * one);
  last->solution_count = 2; /* and one exists */
  h = head_of(last, least + one);
  assert_ends_there(&h, least + one);
}

static long length_of(const char *name) {
  FILE *file = fopen(name, "rb");
  long length = -1;
  if (file != NULL) {
    TEST_ASSERT_EQUAL_INT(0, fseek(file, 0, SEEK_END));
    length = ftell(file);
    fclose(file);
  }
  return length;
}

/* A faulty disk: the first record is damaged, the second complete. The cut part is saved. */
TEST(test_a_journal_that_is_damaged_in_its_midst_is_kept_beside_itself) {
  char kept[sizeof path + sizeof LM_JOURNAL_DAMAGED];
  const long first = HEADER_BYTES + (long)strlen(spec);
  long before;
  (void)snprintf(kept, sizeof kept, "%s%s", path, LM_JOURNAL_DAMAGED);
  (void)remove(kept);
  write_journal();
  before = length_of(path);
  overwrite(first + 40, "damage", 6);
  TEST_ASSERT_EQUAL_INT(LM_OK, resume_with(spec));
  TEST_ASSERT_EQUAL_INT(0, report.answers);
  TEST_ASSERT_EQUAL_INT(1, report.torn);
  TEST_ASSERT_EQUAL_INT(1, report.behind);
  TEST_ASSERT_EQUAL_INT(before, length_of(kept));
  TEST_ASSERT_EQUAL_INT(first, length_of(path));
  /* The journal is complete again, and nothing more is reported. */
  TEST_ASSERT_EQUAL_INT(LM_OK, resume_with(spec));
  TEST_ASSERT_EQUAL_INT(0, report.torn + report.behind);
  TEST_ASSERT_EQUAL_INT(0, remove(kept));
  /* If the cut part cannot be saved, the journal is not changed. */
  write_journal();
  before = length_of(path);
  overwrite(first + 40, "damage", 6);
  TEST_ASSERT_TRUE(lm_make_folder(kept));
  TEST_ASSERT_EQUAL_INT(LM_CORRUPT, resume_with(spec));
  TEST_ASSERT_EQUAL_INT(before, length_of(path));
  TEST_ASSERT_TRUE(lm_remove_folder(kept));
  /* A mark alone within the damaged part is not a record. */
  write_journal();
  before = length_of(path);
  overwrite(first + 40, &(uint32_t){MARK}, sizeof(uint32_t));
  overwrite(before - 1, "x", 1);
  TEST_ASSERT_EQUAL_INT(LM_OK, resume_with(spec));
  TEST_ASSERT_EQUAL_INT(1, report.torn);
  TEST_ASSERT_EQUAL_INT(0, report.behind);
}

/* Magic, hash of the spec, its length, size of an answer. */
TEST(test_a_header_of_something_else_is_refused) {
  uint32_t number = 0;
  write_journal();
  overwrite(3, "x", 1);
  TEST_ASSERT_EQUAL_INT(LM_CORRUPT, resume_with(spec));
  write_journal();
  TEST_ASSERT_EQUAL_INT(LM_INCONSISTENT, resume_with("seed 2\n"));
  number = 6;
  overwrite(HEADER_BYTES - 8, &number, sizeof number);
  TEST_ASSERT_EQUAL_INT(LM_INCONSISTENT, resume_with(spec));
  write_journal();
  number = (uint32_t)sizeof(lm_answer) + 8;
  overwrite(HEADER_BYTES - 4, &number, sizeof number);
  TEST_ASSERT_EQUAL_INT(LM_CORRUPT, resume_with(spec));
  TEST_ASSERT_TRUE(set_length(path, HEADER_BYTES - 1));
  TEST_ASSERT_EQUAL_INT(LM_CORRUPT, resume_with(spec));
  TEST_ASSERT_EQUAL_INT(0, taken);
}

TEST(test_a_journal_that_is_there_is_not_replaced) {
  lm_journal *journal = NULL;
  write_journal();
  TEST_ASSERT_EQUAL_INT(LM_CORRUPT, lm_create_journal(path, spec, &journal));
  TEST_ASSERT_EQUAL_INT(EEXIST, errno);
  TEST_ASSERT_EQUAL_INT(LM_OK, resume_with(spec));
  TEST_ASSERT_EQUAL_INT(2, taken);
}

static const char *this_program;

/* 0: another process could continue the journal. It is this program with the argument resume.
 */
static int errno_of_another_process(void) {
  char words[128];
  char said[sizeof path + 8];
  int status;
  (void)snprintf(words, sizeof words, "resume %s", path);
  (void)snprintf(said, sizeof said, "%s.said", path);
  status = run_program(this_program, words, said, said);
  (void)remove(said);
  return status;
}

TEST(test_one_process_has_the_journal_until_it_closes_it) {
  lm_journal *journal;
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_create_journal(path, spec, &journal));
  TEST_ASSERT_EQUAL_INT(EBUSY, errno_of_another_process());
  lm_close_journal(journal);
  TEST_ASSERT_EQUAL_INT(0, errno_of_another_process());
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_resume_journal(path, spec, take, NULL, &journal, &report));
  TEST_ASSERT_EQUAL_INT(EBUSY, errno_of_another_process());
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_append_answer(journal, answer));
  lm_close_journal(journal);
  TEST_ASSERT_EQUAL_INT(LM_OK, resume_with(spec));
  TEST_ASSERT_EQUAL_INT(1, taken);
}

TEST(test_nothing_is_refused) {
  lm_journal *journal;
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_create_journal(NULL, spec, &journal));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_create_journal(path, NULL, &journal));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_create_journal(path, spec, NULL));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_resume_journal(NULL, spec, take, NULL, &journal, &report));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_resume_journal(path, NULL, take, NULL, &journal, &report));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_resume_journal(path, spec, NULL, NULL, &journal, &report));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_resume_journal(path, spec, take, NULL, NULL, &report));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_resume_journal(path, spec, take, NULL, &journal, NULL));
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_create_journal(path, spec, &journal));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_append_answer(NULL, answer));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_append_answer(journal, NULL));
  lm_close_journal(journal);
}

int main(int count, char **argument) {
  if (count == 3 && strcmp(argument[1], "resume") == 0) {
    (void)snprintf(path, sizeof path, "%s", argument[2]);
    last = (lm_answer *)calloc(1, sizeof *last);
    errno = 0;
    return resume_with(spec) == LM_OK ? 0 : errno;
  }
  this_program = argument[0];
  return run_tests();
}
