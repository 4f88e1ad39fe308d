/* The search as a whole: the same bytes with any workers, in any order, and after a kill. */
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "archive.h"
#include "certificate.h"
#include "journal.h"
#include "machine.h"
#include "pool.h"
#include "reference_drives.h"
#include "search.h"
#include "sound_answer.h"
#include "spec.h"
#include "stop.h"
#include "test.h"

#define FRONT_MAX 64

static lm_problem problem;
static lm_search *search;
static lm_workspace *workspace;
static char path[64];

void setUp(void) {
  search = NULL;
  workspace = lm_create_workspace();
  TEST_ASSERT_NOT_NULL(workspace);
  snprintf(path, sizeof path, "optimizer_journal_%ld.bin", process_number());
}

void tearDown(void) {
  lm_close_search(search);
  lm_free_workspace(workspace);
  (void)remove(path);
}

/* A size 20 with two tolerances: reference drive A of check_values.md with free variables. */
static const char small_spec[] =
    "seed 3\n"
    "evaluations 2400\n"
    "rated_torque_Nm 40\n"
    "objective tolerance_lost_motion\n"
    "objective cost\n"
    "fixed teeth.module_mm 0.25\n"
    "fixed teeth.face_width_mm 10\n"
    "choose generator.type discs rollers ring\n"
    "choose teeth.flexspline_teeth 198 200\n"
    "range teeth.flexspline_shift 2 4\n"
    "range teeth.shift_difference -0.3 0.3\n"
    "range generator.deflection_modules 0.88 1.05\n"
    "range generator.contact_half_angle_deg 22 35\n"
    "range teeth.engagement_depth 0.9 1.3\n"
    "whole tolerance.0.grade 5 9\n"
    "whole tolerance.1.grade 5 9\n"
    "link 0.5 48 0.5 0 1 normal generator\n"
    "link 1.37 0.25 0.5 0 2 uniform teeth\n";

static void read_spec(const char *text) {
  lm_spec_error error = {0, ""};
  const lm_status status = lm_read_spec(text, &problem, &error);
  TEST_ASSERT_EQUAL_INT_MESSAGE(LM_OK, status, error.text);
}

static void accept(void *context, const lm_answer *answer) {
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_accept_answer((lm_search *)context, answer));
}

static lm_status take(void *context, const lm_answer *answer) {
  return lm_accept_answer((lm_search *)context, answer);
}

static int is_answered(void *context, int id) {
  return lm_is_answered((lm_search *)context, id);
}

static int run_with(int workers, lm_solution front[]) {
  lm_pool *pool = lm_open_pool(workers);
  const lm_task *tasks;
  int count;
  TEST_ASSERT_NOT_NULL(pool);
  lm_close_search(search);
  search = lm_open_search(&problem);
  while ((count = lm_next_tasks(search, &tasks)) > 0) {
    TEST_ASSERT_EQUAL_INT(
        LM_OK, lm_run_tasks(pool, &problem, tasks, count, is_answered, accept, search, NULL));
  }
  lm_close_pool(pool);
  return lm_read_front(search, front, FRONT_MAX);
}

static void assert_same(const lm_solution a[], int count_a, const lm_solution b[], int count_b) {
  TEST_ASSERT_EQUAL_INT(count_a, count_b);
  TEST_ASSERT_EQUAL_MEMORY(a, b, (size_t)count_a * sizeof a[0]);
}

TEST(test_one_and_three_threads_give_the_same_bytes) {
  lm_solution alone[FRONT_MAX];
  lm_solution together[FRONT_MAX];
  int count;
  read_spec(small_spec);
  count = run_with(1, alone);
  TEST_ASSERT_GREATER_THAN_INT(3, count);
  assert_same(alone, count, together, run_with(3, together));
}

/* Answers in reverse order, each computed in a new workspace, as a cluster may do. */
TEST(test_the_order_of_answers_does_not_matter) {
  lm_solution straight[FRONT_MAX];
  lm_solution reversed[FRONT_MAX];
  lm_answer *answer = (lm_answer *)malloc(sizeof *answer);
  const lm_task *tasks;
  int straight_count;
  int count;
  read_spec(small_spec);
  straight_count = run_with(1, straight);
  lm_close_search(search);
  search = lm_open_search(&problem);
  while ((count = lm_next_tasks(search, &tasks)) > 0) {
    int i;
    for (i = count - 1; i >= 0; i--) {
      lm_workspace *fresh = lm_create_workspace();
      TEST_ASSERT_EQUAL_INT(LM_OK, lm_run_task(&problem, &tasks[i], answer, fresh, NULL));
      lm_free_workspace(fresh);
      TEST_ASSERT_EQUAL_INT(LM_OK, lm_accept_answer(search, answer));
      /* again: a worker that was believed lost */
      if (i > 0) {
        TEST_ASSERT_EQUAL_INT(LM_OK, lm_accept_answer(search, answer));
      }
    }
  }
  free(answer);
  assert_same(straight, straight_count, reversed, lm_read_front(search, reversed, FRONT_MAX));
}

TEST(test_an_answer_that_nobody_awaits_is_refused) {
  lm_answer *answer = (lm_answer *)calloc(1, sizeof *answer);
  read_spec(small_spec);
  search = lm_open_search(&problem);
  answer->id = 100000;
  TEST_ASSERT_EQUAL_INT(LM_OUT_OF_RANGE, lm_accept_answer(search, answer));
  answer->id = -1;
  TEST_ASSERT_EQUAL_INT(LM_OUT_OF_RANGE, lm_accept_answer(search, answer));
  answer->id = INT_MIN; /* found by fuzzing: its distance to the batch overflowed */
  TEST_ASSERT_EQUAL_INT(LM_OUT_OF_RANGE, lm_accept_answer(search, answer));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_accept_answer(search, NULL));
  free(answer);
}

/* Each value of an answer in turn is out of its range: a foreign journal with a correct
 * checksum. */
TEST(test_an_answer_with_a_value_out_of_range_is_refused) {
  lm_answer *sound = (lm_answer *)calloc(1, sizeof *sound);
  lm_answer *bad = (lm_answer *)calloc(1, sizeof *bad);
  int *const whole[] = {&bad->computed,
                        &bad->plain,
                        &bad->slopes,
                        &bad->tolerance_only,
                        &bad->refused,
                        &bad->feasible,
                        &bad->solution_count,
                        &bad->member_count,
                        &bad->solution[0].combination,
                        &bad->solution[0].verified,
                        &bad->solution[2].combination};
  double *const real[] = {&bad->value,
                          &bad->violation,
                          &bad->unit[0],
                          &bad->solution[0].unit[1],
                          &bad->solution[0].violation,
                          &bad->solution[2].unit[0],
                          &bad->solution[1].objective[0]};
  static const int wrong[] = {-1, INT_MIN, INT_MAX, 2000000000};
  const lm_task *tasks;
  size_t i;
  size_t k;
  read_spec(small_spec);
  search = lm_open_search(&problem);
  TEST_ASSERT_GREATER_THAN_INT(0, lm_next_tasks(search, &tasks));
  sound->id = tasks[0].id;
  sound->combination = tasks[0].combination;
  sound->solution_count = 2;
  sound->member_count = 1;
  for (i = 0; i < sizeof whole / sizeof whole[0]; i++) {
    for (k = 0; k < sizeof wrong / sizeof wrong[0]; k++) {
      *bad = *sound;
      *whole[i] = wrong[k];
      TEST_ASSERT_EQUAL_INT(LM_OUT_OF_RANGE, lm_accept_answer(search, bad));
    }
  }
  for (i = 0; i < sizeof real / sizeof real[0]; i++) {
    *bad = *sound;
    *real[i] = NAN;
    TEST_ASSERT_EQUAL_INT(LM_OUT_OF_RANGE, lm_accept_answer(search, bad));
  }
  for (k = 0; k < 2; k++) {
    *bad = *sound;
    bad->unit[0] = k == 0 ? -1e-9 : 1 + 1e-9;
    TEST_ASSERT_EQUAL_INT(LM_OUT_OF_RANGE, lm_accept_answer(search, bad));
  }
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_accept_answer(search, sound));
  TEST_ASSERT_EQUAL_INT(3, lm_add_count(1, 2));
  TEST_ASSERT_EQUAL_INT(LM_COUNTED_MAX, lm_add_count(LM_COUNTED_MAX - 1, 2));
  sound->slopes = LM_COUNTED_MAX;
  TEST_ASSERT_EQUAL_INT(LM_COUNTED_MAX, lm_charge_of(&problem, sound));
  free(sound);
  free(bad);
}

/* --- journal --- */

typedef struct recorder {
  lm_journal *journal;
  int left; /* answers until the kill */
  volatile int stop;
} recorder;

static void record(void *context, const lm_answer *answer) {
  recorder *r = (recorder *)context;
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_append_answer(r->journal, answer));
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_accept_answer(search, answer));
  r->left--;
  if (r->left <= 0) {
    lm_stop(&r->stop);
  }
}

static int skip_answered(void *context, int id) {
  (void)context;
  return lm_is_answered(search, id);
}

/* Search until `answers` more have arrived, or to the end. */
static void search_on(recorder *r, int answers) {
  lm_pool *pool = lm_open_pool(2);
  const lm_task *tasks;
  int count;
  r->left = answers;
  r->stop = 0;
  while (!r->stop && (count = lm_next_tasks(search, &tasks)) > 0) {
    (void)lm_run_tasks(pool, &problem, tasks, count, skip_answered, record, r, &r->stop);
  }
  lm_close_pool(pool);
}

static void resume(recorder *r, lm_journal_report *report) {
  lm_close_search(search);
  search = lm_open_search(&problem);
  TEST_ASSERT_EQUAL_INT(LM_OK,
                        lm_resume_journal(path, small_spec, take, search, &r->journal, report));
}

/* Killed twice, the second time in the middle of writing a record. */
TEST(test_a_killed_search_ends_in_the_same_bytes) {
  lm_solution whole[FRONT_MAX];
  lm_solution pieces[FRONT_MAX];
  lm_journal_report report;
  recorder r;
  FILE *file;
  int recorded;
  int count;
  read_spec(small_spec);
  count = run_with(1, whole);
  lm_close_search(search);
  search = lm_open_search(&problem);
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_create_journal(path, small_spec, &r.journal));
  search_on(&r, 5);
  lm_close_journal(r.journal);
  recorded = 5 - r.left;
  resume(&r, &report);
  TEST_ASSERT_EQUAL_INT(recorded, report.answers);
  TEST_ASSERT_EQUAL_INT(0, report.torn);
  search_on(&r, 9);
  lm_close_journal(r.journal);
  file = fopen(path, "ab");
  TEST_ASSERT_EQUAL_INT(7, (int)fwrite("NAML\001\002\003", 1, 7, file));
  fclose(file);
  resume(&r, &report);
  TEST_ASSERT_EQUAL_INT(1, report.torn);
  TEST_ASSERT_GREATER_OR_EQUAL_INT(14, report.answers);
  search_on(&r, 1000000);
  lm_close_journal(r.journal);
  assert_same(whole, count, pieces, lm_read_front(search, pieces, FRONT_MAX));
}

TEST(test_a_changed_byte_ends_the_journal_there) {
  lm_journal_report report;
  recorder r;
  FILE *file;
  int recorded;
  read_spec(small_spec);
  search = lm_open_search(&problem);
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_create_journal(path, small_spec, &r.journal));
  search_on(&r, 3);
  lm_close_journal(r.journal);
  recorded = 3 - r.left;
  file = fopen(path, "r+b");
  fseek(file, -40, SEEK_END);
  fputc('x', file);
  fclose(file);
  resume(&r, &report);
  TEST_ASSERT_EQUAL_INT(1, report.torn);
  TEST_ASSERT_EQUAL_INT(recorded - 1, report.answers);
  lm_close_journal(r.journal);
}

TEST(test_another_specs_journal_is_refused) {
  lm_journal *journal;
  lm_journal_report report;
  read_spec(small_spec);
  search = lm_open_search(&problem);
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_create_journal(path, "seed 4\n", &journal));
  lm_close_journal(journal);
  TEST_ASSERT_EQUAL_INT(LM_INCONSISTENT,
                        lm_resume_journal(path, small_spec, take, search, &journal, &report));
}

TEST(test_what_is_no_journal_is_refused) {
  lm_journal *journal;
  lm_journal_report report;
  FILE *file = fopen(path, "wb");
  fputs("[drive]\n", file);
  fclose(file);
  TEST_ASSERT_EQUAL_INT(LM_CORRUPT,
                        lm_resume_journal(path, small_spec, take, NULL, &journal, &report));
  TEST_ASSERT_EQUAL_INT(
      LM_CORRUPT, lm_resume_journal("no/such/file", small_spec, take, NULL, &journal, &report));
  TEST_ASSERT_EQUAL_INT(LM_CORRUPT, lm_create_journal("no/such/file", small_spec, &journal));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_append_answer(NULL, NULL));
}

/* --- what the search promises --- */

TEST(test_every_combination_has_a_fate) {
  lm_solution front[FRONT_MAX];
  lm_progress progress;
  int limit;
  read_spec(small_spec);
  (void)run_with(1, front);
  lm_read_progress(search, &progress);
  TEST_ASSERT_EQUAL_INT(LM_STAGE_DONE, progress.stage);
  TEST_ASSERT_EQUAL_INT(6, progress.fate[LM_FATE_SOLVED] + progress.fate[LM_FATE_DOMINATED] +
                               progress.fate[LM_FATE_PRUNED] + progress.fate[LM_FATE_NOT_REACHED]);
  TEST_ASSERT_EQUAL_INT(2, progress.fate[LM_FATE_PRUNED]);
  TEST_ASSERT_GREATER_THAN_INT(0, progress.fate[LM_FATE_SOLVED]);
  /* a ring wave generator needs external deformation: combinations 2 and 5 */
  TEST_ASSERT_EQUAL_INT(LM_FATE_PRUNED, lm_read_fate(search, 2, &limit));
  TEST_ASSERT_EQUAL_INT(-1, limit);
  TEST_ASSERT_EQUAL_STRING("pruned", lm_fate_name(LM_FATE_PRUNED));
  TEST_ASSERT_EQUAL_STRING("", lm_fate_name(17));
}

/* The budget is never exceeded, even if it is too small for one batch of any stage or for the last
 * gradient of a solver; the unused rest is less than half a restart. */
TEST(test_the_budget_is_kept) {
  static const int budgets[] = {10, 61, 200, 777, 2400};
  lm_solution front[FRONT_MAX];
  lm_progress progress;
  char text[4096];
  int objectives;
  int i;
  for (objectives = 1; objectives <= 2; objectives++) {
    for (i = 0; i < 5; i++) {
      const char *end = objectives == 1 ? strstr(small_spec, "objective cost\n") : NULL;
      const int length = end != NULL ? (int)(end - small_spec) : (int)strlen(small_spec);
      (void)snprintf(text, sizeof text, "%.*s%sevaluations %d\n", length, small_spec,
                     end != NULL ? end + strlen("objective cost\n") : "", budgets[i]);
      read_spec(text);
      (void)run_with(1, front);
      lm_read_progress(search, &progress);
      TEST_ASSERT_LESS_OR_EQUAL_INT(budgets[i], progress.evaluations);
      TEST_ASSERT_GREATER_THAN_INT(budgets[i] - 15 * lm_slope_charge(&problem),
                                   progress.evaluations);
    }
  }
}

TEST(test_designs_of_the_front_hold_on_the_fine_check_and_have_whole_grades) {
  lm_solution front[FRONT_MAX];
  lm_certificate *c = (lm_certificate *)malloc(sizeof *c);
  lm_fault fault;
  int count;
  int i;
  int k;
  read_spec(small_spec);
  count = run_with(2, front);
  for (i = 0; i < count; i++) {
    double grade = 5 + 4 * front[i].unit[5];
    TEST_ASSERT_EQUAL_INT(1, front[i].verified);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, floor(grade + 0.5), grade);
    TEST_ASSERT_EQUAL_INT(
        LM_OK, lm_certify(&problem, front[i].combination, front[i].unit, c, workspace, &fault));
    TEST_ASSERT_EQUAL_INT(1, c->holds);
    /* the checks of `lostmotion predict`, except the assembly of the undeformed flexspline, which
     * is advice */
    for (k = 0; k < LM_CHECK_COUNT; k++) {
      TEST_ASSERT_TRUE_MESSAGE(k == LM_CHECK_FREE_ASSEMBLY || c->check[k].margin >= 0,
                               lm_check_name((lm_check_id)k));
    }
    /* worst case above the quantile of production above its median */
    TEST_ASSERT_TRUE(c->lost_motion_worst >= c->lost_motion_quantile.value);
    TEST_ASSERT_TRUE(c->lost_motion_quantile.value >= c->lost_motion_median.value);
    /* the 2048 samples of the loop against 2^14 */
    TEST_ASSERT_DOUBLE_WITHIN(0.03 * c->lost_motion_quantile.value, c->lost_motion_quantile.value,
                              front[i].objective[0]);
  }
  free(c);
}

/* The designs of a front as statements of a spec. */
static void write_starts(const lm_solution front[], int count, char *text, size_t size) {
  size_t length = strlen(text);
  int i;
  int k;
  for (i = 0; i < count; i++) {
    length += (size_t)snprintf(text + length, size - length, "start");
    for (k = 0; k < problem.choice_count; k++) {
      length += (size_t)snprintf(text + length, size - length, " %.17g",
                                 lm_chosen_value(&problem, front[i].combination, k));
    }
    for (k = 0; k < problem.range_count; k++) {
      const lm_range *range = &problem.range[k];
      length += (size_t)snprintf(text + length, size - length, " %.17g",
                                 range->low + (range->high - range->low) * front[i].unit[k]);
    }
    length += (size_t)snprintf(text + length, size - length, "\n");
  }
}

/* Even with a small budget each design is found again, or one that is as good. Designs with a grade
 * that is not whole, or that violate a limit, are valid starts too. */
TEST(test_a_search_that_begins_with_a_front_loses_nothing_of_it) {
  static char text[32768];
  lm_solution first[FRONT_MAX + 2];
  lm_solution front[FRONT_MAX];
  int count;
  int further;
  int i;
  int k;
  read_spec(small_spec);
  count = run_with(2, first);
  first[count] = first[0];
  first[count].unit[5] = 0.3;
  first[count + 1] = first[0];
  first[count + 1].unit[1] = 0.2;
  snprintf(text, sizeof text, "%s", small_spec);
  memcpy(strstr(text, "2400"), " 300", 4);
  write_starts(first, count + 2, text, sizeof text);
  read_spec(text);
  TEST_ASSERT_EQUAL_INT(count + 2, problem.start_count);
  further = run_with(2, front);
  TEST_ASSERT_LESS_OR_EQUAL_INT(FRONT_MAX, further);
  for (i = 0; i < count; i++) {
    int kept = 0;
    for (k = 0; k < further; k++) {
      int j;
      double worse = 0;
      for (j = 0; j < problem.objective_count; j++) {
        const double by = front[k].objective[j] / first[i].objective[j] - 1;
        worse = by > worse ? by : worse;
      }
      kept |= worse < 1e-7;
    }
    TEST_ASSERT_TRUE(kept);
  }
  for (k = 0; k < further; k++) {
    TEST_ASSERT_EQUAL_INT(1, front[k].verified);
  }
}

/* One evaluation in twenty answers NaN. */
TEST(test_damaged_evaluations_do_not_hurt) {
  lm_solution front[FRONT_MAX];
  lm_progress progress;
  char text[2048];
  int count;
  snprintf(text, sizeof text, "%sdamaged_share 0.05\n", small_spec);
  read_spec(text);
  count = run_with(1, front);
  lm_read_progress(search, &progress);
  TEST_ASSERT_GREATER_THAN_INT(0, count);
  TEST_ASSERT_GREATER_THAN_INT(50, progress.refused);
  TEST_ASSERT_TRUE(isfinite(front[0].objective[0]));
}

/* No drive in the ranges has a safety factor of 9: the relaxed limit is that of the best drive. */
TEST(test_contradictory_limits_are_explained) {
  lm_solution front[FRONT_MAX];
  double relax[LM_LIMIT_COUNT];
  double unit[LM_FREE_MAX];
  double violation;
  char text[2048];
  int combination;
  snprintf(text, sizeof text, "%slimit safety_factor_min 9\n", small_spec);
  read_spec(text);
  TEST_ASSERT_EQUAL_INT(0, run_with(1, front));
  TEST_ASSERT_EQUAL_INT(1, lm_read_nearest(search, &combination, unit, &violation));
  TEST_ASSERT_EQUAL_INT(
      LM_OK, lm_explain_infeasible(&problem, combination, unit, 4000, relax, workspace, NULL));
  TEST_ASSERT_TRUE(relax[LM_LIMIT_SAFETY] > 0.3);
  TEST_ASSERT_DOUBLE_WITHIN(1e-5, 0, relax[LM_LIMIT_GAP]);
  /* relaxed by that much, there is one */
  problem.bounds.safety_factor_min = 9 * (1 - relax[LM_LIMIT_SAFETY]) - 0.01;
  TEST_ASSERT_GREATER_THAN_INT(0, run_with(1, front));
}

TEST(test_a_stopped_task_says_so) {
  lm_answer *answer = (lm_answer *)malloc(sizeof *answer);
  const volatile int stop = 1;
  const lm_task *tasks;
  read_spec(small_spec);
  search = lm_open_search(&problem);
  TEST_ASSERT_GREATER_THAN_INT(0, lm_next_tasks(search, &tasks));
  TEST_ASSERT_EQUAL_INT(LM_NOT_CONVERGED,
                        lm_run_task(&problem, &tasks[0], answer, workspace, &stop));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_run_task(NULL, &tasks[0], answer, workspace, NULL));
  free(answer);
}

/* --- lists of designs --- */

TEST(test_selection_takes_feasible_first_then_the_front_then_the_least_crowded) {
  lm_solution list[6];
  const double unit[LM_FREE_MAX] = {0};
  const double objective[6][2] = {{1, 5}, {2, 2}, {2.1, 1.9}, {5, 1}, {6, 6}, {0, 0}};
  int i;
  read_spec(small_spec);
  for (i = 0; i < 6; i++) {
    lm_fill_solution(&problem, &list[i], i, unit, objective[i], i == 5 ? 0.5 : 0);
  }
  lm_select_solutions(&problem, list, 6, 6);
  TEST_ASSERT_EQUAL_INT(5, list[5].combination); /* infeasible */
  TEST_ASSERT_EQUAL_INT(4, list[4].combination); /* dominated */
  TEST_ASSERT_TRUE(list[0].combination == 0 || list[0].combination == 3);
  TEST_ASSERT_TRUE(list[1].combination == 0 || list[1].combination == 3);
}
