/* Foreign journals: records with correct checksums and arbitrary values. A search resumed from one
 * is refused, or it continues with values in range; nothing is read or written out of bounds. The
 * first byte selects the number of sound answers before the changed one.
 */
#define _POSIX_C_SOURCE 200809L
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "fuzz_input.h"
#include "journal.h"
#include "search.h"
#include "spec.h"
#include "tally.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static const char spec[] =
    "seed 3\nevaluations 60\nrated_torque_Nm 40\nobjective tolerance_lost_motion\nobjective cost\n"
    "fixed teeth.module_mm 0.25\nfixed teeth.face_width_mm 10\n"
    "choose generator.type discs ring cosine\nchoose teeth.flexspline_teeth 200 160\n"
    "range teeth.flexspline_shift 2 4\nrange generator.deflection_modules 0.88 1.05\n";

static void require_at(int line, int holds) {
  if (!holds) {
    fprintf(stderr, "fuzz_journal.c:%d does not hold\n", line);
    abort();
  }
}

#define require(holds) require_at(__LINE__, holds)

/* A sound answer to a task: points within the cube, one design of its own and one member. */
static void answer_soundly(const lm_problem *problem, const lm_task *task, fuzz_input *from,
                           lm_answer *answer) {
  int i;
  int k;
  memset(answer, 0, sizeof *answer);
  answer->id = task->id;
  answer->combination = task->combination;
  answer->computed = 1;
  answer->plain = 1 + take_byte(from) % 8;
  answer->violation = take_byte(from) % 3;
  answer->value = take_byte(from);
  answer->solution_count = take_byte(from) % 3;
  answer->member_count = task->kind == LM_TASK_EVOLVE ? 2 : 0;
  for (k = 0; k < problem->range_count; k++) {
    answer->unit[k] = take_byte(from) / 255.0;
  }
  for (i = 0; i < answer->solution_count + answer->member_count; i++) {
    lm_solution *found = &answer->solution[i];
    found->combination = task->combination;
    for (k = 0; k < problem->range_count; k++) {
      found->unit[k] = take_byte(from) / 255.0;
    }
    for (k = 0; k < problem->objective_count; k++) {
      found->objective[k] = 1 + take_byte(from);
    }
  }
}

/* Up to four values of an answer get arbitrary bits. */
static void change(lm_answer *answer, fuzz_input *from) {
  const size_t used = offsetof(lm_answer, solution) + 6 * sizeof answer->solution[0];
  int changes = 1 + take_byte(from) % 4;
  while (changes-- > 0) {
    uint16_t place;
    uint64_t bits;
    size_t size = take_byte(from) & 1u ? sizeof(double) : sizeof(int);
    take(from, &place, sizeof place);
    take(from, &bits, sizeof bits);
    memcpy((unsigned char *)answer + place % (used / size) * size, &bits, size);
  }
}

typedef struct reader {
  lm_search *search;
} reader;

static lm_status take_answer(void *context, const lm_answer *answer) {
  return lm_accept_answer(((reader *)context)->search, answer);
}

/* The accepted state can be output: every design in range. */
static void look(lm_search *search, const lm_problem *problem) {
  static lm_solution front[64];
  lm_progress progress;
  const int combinations = lm_count_combinations(problem);
  int count = lm_read_front(search, front, 64);
  int i;
  int k;
  lm_read_progress(search, &progress);
  require(progress.evaluations >= 0 && progress.refused >= 0);
  for (i = 0; i < count && i < 64; i++) {
    require(front[i].combination >= 0 && front[i].combination < combinations);
    for (k = 0; k < problem->range_count; k++) {
      require(front[i].unit[k] >= 0 && front[i].unit[k] <= 1);
    }
  }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  static lm_problem problem;
  static lm_answer answer;
  static char path[64];
  lm_spec_error error;
  lm_journal_report report;
  lm_journal *journal;
  const lm_task *tasks;
  lm_status status;
  reader to;
  fuzz_input from;
  int sound;
  from.data = data;
  from.size = size;
  count_one("journals");
  if (path[0] == '\0') {
    snprintf(path, sizeof path, "/dev/shm/fuzz_journal_%ld.bin", (long)getpid());
    require(lm_read_spec(spec, &problem, &error) == LM_OK);
  }
  (void)remove(path);
  require(lm_create_journal(path, spec, &journal) == LM_OK);
  to.search = lm_open_search(&problem);
  require(to.search != NULL);
  sound = take_byte(&from) % 24;
  while (sound-- > 0 && lm_next_tasks(to.search, &tasks) > 0) {
    int i = 0;
    while (lm_is_answered(to.search, tasks[i].id)) {
      i++;
    }
    answer_soundly(&problem, &tasks[i], &from, &answer);
    require(lm_accept_answer(to.search, &answer) == LM_OK);
    require(lm_append_answer(journal, &answer) == LM_OK);
  }
  while (from.size > 0 && lm_next_tasks(to.search, &tasks) > 0) {
    int i = 0;
    while (lm_is_answered(to.search, tasks[i].id)) {
      i++;
    }
    answer_soundly(&problem, &tasks[i], &from, &answer);
    change(&answer, &from);
    /* A record contains as many designs as its counts state. */
    if (answer.solution_count < 0 || answer.solution_count > LM_SOLUTION_MAX ||
        answer.member_count < 0 || answer.member_count > LM_PARENT_MAX) {
      const int known =
          answer.id >= 0 && lm_is_answered(to.search, answer.id); /* then it is not read */
      require(known || lm_accept_answer(to.search, &answer) != LM_OK);
      break;
    }
    require(lm_append_answer(journal, &answer) == LM_OK);
    if (lm_accept_answer(to.search, &answer) != LM_OK) {
      break;
    }
  }
  look(to.search, &problem);
  lm_close_search(to.search);
  lm_close_journal(journal);
  to.search = lm_open_search(&problem);
  require(to.search != NULL);
  status = lm_resume_journal(path, spec, take_answer, &to, &journal, &report);
  require(status == LM_OK || status == LM_OUT_OF_RANGE);
  if (status == LM_OK) {
    lm_close_journal(journal);
  }
  look(to.search, &problem);
  lm_close_search(to.search);
  (void)remove(path);
  return 0;
}
