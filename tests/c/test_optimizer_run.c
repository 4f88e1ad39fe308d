/* A search in a folder, and the program: their files, and their messages if the disk or the spec
 * has errors. */
#if !defined(_WIN32)
#define _XOPEN_SOURCE 700 /* terminals */
#endif
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#if !defined(_WIN32)
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>
#endif

#include "journal.h"
#include "machine.h"
#include "output.h"
#include "platform.h"
#include "run.h"
#include "run_task.h"
#include "spec.h"
#include "test.h"

static char folder[OWN_FOLDER_MAX];
static char note[LM_NOTE_MAX];
static lm_run *run;

/* Both deformations, so that a choice of names and one of generators are written. At this depth
 * the tips stay on the involute at both edges of the face. */
static const char small_spec[] =
    "seed 3\n"
    "evaluations 300\n"
    "rated_torque_Nm 40\n"
    "objective tolerance_lost_motion\n"
    "objective cost\n"
    "fixed teeth.module_mm 0.25\n"
    "fixed teeth.face_width_mm 10\n"
    "fixed teeth.engagement_depth 1\n"
    "choose teeth.deformation internal external\n"
    "choose generator.type discs ring\n"
    "choose teeth.flexspline_teeth 200\n"
    "range teeth.flexspline_shift 2 4\n"
    "range teeth.shift_difference -0.3 0.3\n"
    "range generator.deflection_modules 0.88 1.05\n"
    "range generator.contact_half_angle_deg 22 35\n"
    "whole tolerance.0.grade 5 9\n"
    "link 0.5 48 0.5 0 1 normal generator\n"
    "radial 1e-5 0.6666666666666666 0.5 30\n"
    "torsion 100000 1\n";

void setUp(void) {
  TEST_ASSERT_TRUE(make_own_folder(folder, "optimizer_run"));
  run = NULL;
}

void tearDown(void) {
  lm_close_run(run);
  run = NULL;
  (void)remove_tree(folder, 0);
}

static void place(char path[256], const char *name) {
  const int length = snprintf(path, 256, "%s/%s", folder, name);
  TEST_ASSERT_TRUE(length > 0 && length < 256);
}

static char *content(const char *name) {
  char path[256];
  char *text = (char *)calloc(1, 1 << 20);
  FILE *file;
  place(path, name);
  file = fopen(path, "rb");
  TEST_ASSERT_NOT_NULL(text);
  if (file == NULL) {
    free(text);
    return NULL;
  }
  (void)!fread(text, 1, (1 << 20) - 1, file);
  fclose(file);
  return text;
}

static void assert_holds(const char *name, const char *words) {
  char *text = content(name);
  TEST_ASSERT_NOT_NULL_MESSAGE(text, name);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, words), words);
  free(text);
}

static void assert_missing(const char *name) {
  char *text = content(name);
  TEST_ASSERT_NULL_MESSAGE(text, name);
}

static void assert_noted(const char *words) {
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(note, words), note);
}

static int open_here(const char *spec, int resume) {
  lm_close_run(run);
  return lm_open_run("the spec", spec, folder, resume, &run, note);
}

static int hooked;

static void count_hook(void *context) {
  (*(int *)context)++;
}

static int work_and_finish(int workers, volatile int *stop) {
  const int status = lm_work_run(run, workers, count_hook, &hooked, stop, note);
  return status == LM_EXIT_FAILED ? status : lm_finish_run(run, status, note);
}

static int do_all(const char *spec) {
  volatile int stop = 0;
  const int status = open_here(spec, 0);
  return status != LM_EXIT_DONE ? status : work_and_finish(1, &stop);
}

TEST(test_a_run_leaves_its_files) {
  hooked = 0;
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, do_all(small_spec));
  TEST_ASSERT_EQUAL_STRING("", note);
  TEST_ASSERT_GREATER_THAN_INT(0, hooked);
  assert_holds("best.toml", "kind = \"power\"\ndeflection_mm = 1.0000000000000001e-05\n");
  assert_holds("best.toml", "kind = \"stiffness\"");
  assert_holds("front.csv", "verified,teeth.deformation,generator.type");
  assert_holds("front.csv", "1,internal,discs,200,");
  assert_holds("combinations.csv", "external,discs,200,pruned,wave generator against deformation");
  assert_holds("combinations.csv", "external,ring,200,dominated,");
  assert_holds("certificate.json", "\"holds\": true");
  assert_holds("certificate.json", "\"stiffness_Nm_per_rad\": ");
  assert_holds("history.csv", "tasks,evaluations,best,front\n");
  assert_missing("best.toml.part");
  TEST_ASSERT_EQUAL_INT(1, lm_run_problem(run)->link_count);
}

TEST(test_a_search_already_there_is_not_overwritten) {
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, do_all(small_spec));
  TEST_ASSERT_EQUAL_INT(LM_EXIT_BAD_INPUT, open_here(small_spec, 0));
  assert_noted("expected --resume");
  TEST_ASSERT_NULL(run);
}

/* Cut so many bytes off the end of the journal. */
static void tear_journal(long bytes) {
  char path[256];
  FILE *file;
  long length;
  place(path, "journal.bin");
  file = fopen(path, "rb");
  TEST_ASSERT_NOT_NULL(file);
  TEST_ASSERT_EQUAL_INT(0, fseek(file, 0, SEEK_END));
  length = ftell(file);
  fclose(file);
  TEST_ASSERT_TRUE(set_length(path, length - bytes));
}

TEST(test_a_stopped_run_continues_to_the_same_bytes) {
  static const char *const names[] = {"best.toml", "front.csv", "history.csv", "certificate.json"};
  char *whole[4];
  volatile int stop = 1;
  int i;
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, do_all(small_spec));
  for (i = 0; i < 4; i++) {
    whole[i] = content(names[i]);
  }
  lm_close_run(run);
  run = NULL;
  TEST_ASSERT_TRUE(remove_tree(folder, 1));
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, open_here(small_spec, 0));
  TEST_ASSERT_EQUAL_INT(LM_EXIT_STOPPED, work_and_finish(2, &stop));
  assert_missing("best.toml");
  stop = 0;
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, open_here(small_spec, 1));
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, work_and_finish(2, &stop));
  /* an incomplete end is reported and repaired */
  tear_journal(9);
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, open_here(small_spec, 1));
  assert_noted("incomplete after");
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, work_and_finish(0, &stop));
  for (i = 0; i < 4; i++) {
    char *again = content(names[i]);
    TEST_ASSERT_EQUAL_STRING_MESSAGE(whole[i], again, names[i]);
    free(again);
    free(whole[i]);
  }
}

static void put(const char *name, const char *text) {
  char path[256];
  FILE *file;
  place(path, name);
  file = fopen(path, "wb");
  TEST_ASSERT_NOT_NULL(file);
  fputs(text, file);
  fclose(file);
}

TEST(test_what_cannot_be_opened_is_reported_and_nothing_written) {
  char path[5000];
  char journal[256];
  memset(path, 'a', sizeof path);
  path[sizeof path - 1] = '\0';
  TEST_ASSERT_EQUAL_INT(LM_EXIT_BAD_INPUT, lm_open_run("", small_spec, path, 0, &run, note));
  assert_noted("a path of 4999 characters");
  TEST_ASSERT_EQUAL_INT(LM_EXIT_BAD_INPUT,
                        lm_open_run("", small_spec, "none/that/is/here", 0, &run, note));
  assert_noted("expected a folder to write to");
  TEST_ASSERT_EQUAL_INT(LM_EXIT_BAD_INPUT, open_here("fixed teeth.modul_mm 1\n", 0));
  assert_noted("the spec: line 1: unknown key");
  TEST_ASSERT_EQUAL_INT(LM_EXIT_BAD_INPUT, open_here(small_spec, 1));
  assert_noted("No such file");
  assert_missing("journal.bin");
  place(journal, "journal.bin");
  TEST_ASSERT_TRUE(lm_make_folder(journal));
  TEST_ASSERT_EQUAL_INT(LM_EXIT_BAD_INPUT, open_here(small_spec, 1));
  TEST_ASSERT_TRUE(lm_remove_folder(journal));
  put("journal.bin", "hello\n");
  TEST_ASSERT_EQUAL_INT(LM_EXIT_BAD_INPUT, open_here(small_spec, 1));
  assert_noted("expected the journal of a search");
}

/* A result replaces only files that a search wrote, and never the spec. */
TEST(test_files_that_no_search_wrote_are_not_overwritten) {
  static const char *const names[] = LM_RESULT_NAMES;
  char path[256];
  size_t i;
  for (i = 0; i < sizeof names / sizeof names[0]; i++) {
    snprintf(path, sizeof path, "%s/%s", folder, names[i]);
    put(names[i], "mine");
    TEST_ASSERT_EQUAL_INT_MESSAGE(LM_EXIT_BAD_INPUT, open_here(small_spec, 0), names[i]);
    assert_noted("that no search in this folder wrote");
    TEST_ASSERT_EQUAL_INT(LM_EXIT_BAD_INPUT, lm_open_run(path, small_spec, folder, 0, &run, note));
    assert_noted("the spec under the name of a result");
    assert_missing("journal.bin");
    assert_holds(names[i], "mine");
    TEST_ASSERT_EQUAL_INT(0, remove(path));
  }
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, open_here(small_spec, 0));
  put("best.toml", "mine");
  snprintf(path, sizeof path, "%s/best.toml", folder);
  lm_close_run(run);
  TEST_ASSERT_EQUAL_INT(LM_EXIT_BAD_INPUT, lm_open_run(path, small_spec, folder, 1, &run, note));
  assert_noted("the spec under the name of a result");
  assert_holds("best.toml", "mine");
}

/* A temporary file of a killed search, or a foreign link in its place, is not written through. */
TEST(test_a_link_beside_a_result_is_not_followed) {
#if defined(_WIN32)
  TEST_IGNORE_MESSAGE("Windows makes links only with a right that users lack");
#else
  char link[256];
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, open_here(small_spec, 0));
  put("precious", "mine");
  snprintf(link, sizeof link, "%s/front.csv.part", folder);
  TEST_ASSERT_EQUAL_INT(0, symlink("precious", link));
  TEST_ASSERT_EQUAL_INT(LM_EXIT_STOPPED, lm_finish_run(run, LM_EXIT_STOPPED, note));
  assert_holds("precious", "mine");
  assert_holds("front.csv", "verified,");
#endif
}

/* A foreign journal with correct checksums is refused and not changed. */
TEST(test_a_journal_with_an_answer_of_no_task_is_refused) {
  const lm_task *tasks;
  lm_answer *answer = (lm_answer *)calloc(1, sizeof *answer);
  lm_journal *journal;
  char path[256];
  snprintf(path, sizeof path, "%s/journal.bin", folder);
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, open_here(small_spec, 0));
  TEST_ASSERT_GREATER_THAN_INT(0, lm_next_tasks(lm_run_search(run), &tasks));
  answer->id = tasks[0].id;
  answer->combination = tasks[0].combination;
  answer->solution_count = 1;
  answer->solution[0].combination = 123456789;
  lm_close_run(run);
  run = NULL;
  TEST_ASSERT_EQUAL_INT(0, remove(path));
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_create_journal(path, small_spec, &journal));
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_append_answer(journal, answer));
  lm_close_journal(journal);
  TEST_ASSERT_EQUAL_INT(LM_EXIT_BAD_INPUT, open_here(small_spec, 1));
  assert_noted("found an answer that no task of this search has (number 1)");
  TEST_ASSERT_EQUAL_INT(LM_EXIT_BAD_INPUT, open_here(small_spec, 1));
  assert_noted("(number 1)");
  free(answer);
}

TEST(test_a_pipe_is_no_journal) {
#if defined(_WIN32)
  TEST_IGNORE_MESSAGE("Windows has no pipes in folders");
#else
  char path[256];
  snprintf(path, sizeof path, "%s/journal.bin", folder);
  TEST_ASSERT_EQUAL_INT(0, mkfifo(path, 0600));
  TEST_ASSERT_EQUAL_INT(LM_EXIT_BAD_INPUT, open_here(small_spec, 1));
  assert_noted("expected the journal of a search");
#endif
}

TEST(test_another_specs_journal_is_refused) {
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, open_here(small_spec, 0));
  TEST_ASSERT_EQUAL_INT(
      LM_EXIT_BAD_INPUT,
      open_here("objective cost\nrated_torque_Nm 1\nrange teeth.module_mm 1 2\n", 1));
  assert_noted("another spec");
  assert_noted("start_from");
}

TEST(test_limits_that_contradict_say_what_would_have_to_give) {
  char spec[2048];
  snprintf(spec, sizeof spec, "%slimit lost_motion_max_arcmin 0.01\n", small_spec);
  TEST_ASSERT_EQUAL_INT(LM_EXIT_FAILED, do_all(spec));
  assert_noted("no feasible design; relax");
  assert_noted("lost_motion_max_arcmin by");
  assert_holds("infeasible.json", "\"limit\": \"lost_motion_max_arcmin\"");
  assert_holds("infeasible.json", "\"set_by_spec\": true");
  assert_holds("nearest.csv", "\n0,");
  assert_missing("best.toml");
}

/* Ten evaluations do not meet the few designs that there are; the nearest one leads to a design.
 * Planar, on the published foundation of the reference drive, for which the limits were chosen. */
TEST(test_a_design_that_the_budget_does_not_meet_is_found) {
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE,
                        do_all("evaluations 10\nrated_torque_Nm 40\nobjective lost_motion\n"
                               "fixed teeth.module_mm 0.25\nfixed teeth.face_width_mm 10\n"
                               "fixed planar_only 1\n"
                               "fixed support.foundation_N_per_mm2 2600\n"
                               "fixed support.ring_stiffness_N_mm2 350000\n"
                               "fixed teeth.flexspline_teeth 200\nfixed generator.type discs\n"
                               "range generator.deflection_modules 0.85 1.15\n"
                               "range teeth.flexspline_shift 2 5\n"
                               "range flexspline.rim_thickness_mm 0.3 1.2\n"
                               "range teeth.shift_difference -0.4 0.6\n"
                               "limit stiffness_min_Nm_per_rad 29500\nlimit stress_max 0.424\n"
                               "limit lost_motion_max_arcmin 0.37\nlimit gap_min_arcmin -0.13\n"));
  assert_holds("history.csv", "\n1,10,,0\n"); /* no design within the budget */
  assert_holds("best.toml", "[design.teeth]");
  assert_missing("infeasible.json");
  assert_missing("nearest.csv");
}

/* No wall of 0.1 mm and 50 mm carries 60 N m without buckling; all other limits are met. */
TEST(test_what_no_limit_of_the_spec_says_is_told_apart) {
  char *text;
  TEST_ASSERT_EQUAL_INT(LM_EXIT_FAILED,
                        do_all("evaluations 200\nrated_torque_Nm 60\nobjective stress\n"
                               "fixed teeth.module_mm 0.25\nfixed teeth.face_width_mm 10\n"
                               "fixed teeth.engagement_depth 0.8\n"
                               "fixed teeth.flexspline_teeth 200\nfixed generator.type cosine\n"
                               "range generator.deflection_modules 0.85 1.15\n"
                               "range teeth.flexspline_shift 2 5\n"
                               "range teeth.shift_difference -0.3 0.3\n"
                               "range flexspline.wall_thickness_mm 0.05 0.1\n"
                               "range flexspline.rim_thickness_mm 0.4 1\n"));
  assert_noted("no feasible design; beyond what the ranges allow: cup_buckling_torque by");
  assert_holds("infeasible.json", "\"set_by_spec\": false");
  text = content("infeasible.json");
  TEST_ASSERT_NULL(strstr(text, "\"set_by_spec\": true"));
  free(text);
}

TEST(test_ranges_without_any_drive_say_so) {
  TEST_ASSERT_EQUAL_INT(LM_EXIT_FAILED, do_all("evaluations 50\n"
                                               "rated_torque_Nm 40\n"
                                               "objective lost_motion\n"
                                               "fixed teeth.module_mm 0.25\n"
                                               "fixed teeth.face_width_mm 10\n"
                                               "fixed teeth.flexspline_teeth 200\n"
                                               "fixed generator.type ring\n"
                                               "range teeth.flexspline_shift 2 4\n"));
  assert_noted("no design exists in these ranges");
  assert_missing("infeasible.json");
}

#define NO_FILE_LIMIT "Windows limits no file's length, with which the tests fill a disk"

/* A disk that is full: the journal grows no further. */
TEST(test_a_journal_that_cannot_grow_ends_the_run) {
#if defined(_WIN32)
  TEST_IGNORE_MESSAGE(NO_FILE_LIMIT);
#else
  struct rlimit before;
  struct rlimit small;
  volatile int stop = 0;
  int status;
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, open_here(small_spec, 0));
  TEST_ASSERT_EQUAL_INT(0, getrlimit(RLIMIT_FSIZE, &before));
  small = before;
  small.rlim_cur = 8192;
  (void)signal(SIGXFSZ, SIG_IGN);
  TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_FSIZE, &small));
  status = lm_work_run(run, 1, NULL, NULL, &stop, note);
  TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_FSIZE, &before));
  TEST_ASSERT_EQUAL_INT(LM_EXIT_FAILED, status);
  TEST_ASSERT_EQUAL_INT(1, stop);
  assert_noted("the journal cannot be written: File too large");
#endif
}

TEST(test_results_that_cannot_be_written_are_told) {
#if defined(_WIN32)
  TEST_IGNORE_MESSAGE("on Windows the folder of an open journal stays");
#else
  volatile int stop = 0;
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, open_here(small_spec, 0));
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, lm_work_run(run, 1, NULL, NULL, &stop, note));
  TEST_ASSERT_TRUE(remove_tree(folder, 0));
  TEST_ASSERT_EQUAL_INT(LM_EXIT_FAILED, lm_finish_run(run, LM_EXIT_DONE, note));
  assert_noted("results cannot be written");
  TEST_ASSERT_EQUAL_INT(LM_EXIT_STOPPED, lm_finish_run(run, LM_EXIT_STOPPED, note));
#endif
}

/* For each result in turn, a folder has the name of its temporary file or of the result. */
TEST(test_every_result_that_has_no_place_is_told) {
  static const char *const names[] = {"combinations.csv", "front.csv", "history.csv", "best.toml",
                                      "certificate.json"};
  volatile int stop = 0;
  int i;
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, open_here(small_spec, 0));
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, lm_work_run(run, 1, NULL, NULL, &stop, note));
  for (i = 0; i < 5; i++) {
    char path[256];
    char part[256];
    char inside[256];
    snprintf(path, sizeof path, "%s/%s", folder, names[i]);
    snprintf(part, sizeof part, "%s/%s.part", folder, names[i]);
    snprintf(inside, sizeof inside, "%s/%s/x", folder, names[i]);
    TEST_ASSERT_TRUE(lm_make_folder(part));
    TEST_ASSERT_EQUAL_INT_MESSAGE(LM_EXIT_FAILED, lm_finish_run(run, LM_EXIT_DONE, note), names[i]);
    TEST_ASSERT_TRUE(lm_remove_folder(part));
    (void)lm_remove_file(path);
    TEST_ASSERT_TRUE(lm_make_folder(path) && lm_make_folder(inside));
    TEST_ASSERT_EQUAL_INT_MESSAGE(LM_EXIT_FAILED, lm_finish_run(run, LM_EXIT_DONE, note), names[i]);
    TEST_ASSERT_TRUE(remove_tree(path, 0));
    TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, lm_finish_run(run, LM_EXIT_DONE, note));
  }
}

/* Bound by a figure of two tooth phases, a design violates its limit slightly at eight phases
 * before it is verified. Only at the middle of the face: with the gaps at the edges the phases
 * differ less. */
static const char bound_spec[] =
    "seed 2\nevaluations 800\nrated_torque_Nm 40\nobjective cost\n"
    "fixed teeth.module_mm 0.25\nfixed teeth.face_width_mm 10\n"
    "fixed planar_only 1\n"
    "fixed teeth.flexspline_teeth 200\nfixed generator.type discs\n"
    "range teeth.flexspline_shift 2 4\n"
    "range teeth.shift_difference -0.3 0.3\n"
    "range generator.deflection_modules 0.88 1.05\n"
    "range tolerance.0.grade 5 9\n"
    "fixed tolerance.1.grade 5\n"
    "link 0.5 48 0.5 0 1 normal generator\n"
    "link 1.37 0.25 0.5 0 2 uniform teeth\n"
    "limit tolerance_lost_motion_max_arcmin 2.5\n";

TEST(test_a_best_design_bound_by_a_figure_holds) {
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, do_all(bound_spec));
  TEST_ASSERT_EQUAL_STRING("", note);
  assert_holds("certificate.json", "\"holds\": true");
}

/* One phase shows no kinematic error at all, eight more than this in every design. */
TEST(test_a_best_design_that_does_not_hold_on_the_fine_check_is_told) {
  char spec[2048];
  snprintf(spec, sizeof spec, "%sphases 1\nlimit kinematic_error_max_arcsec 0.001\n", bound_spec);
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, do_all(spec));
  assert_holds("front.csv", "\n0,");
  assert_noted("does not hold on the fine check");
  assert_holds("certificate.json", "\"holds\": false");
}

/* A search that was stopped before the verification guarantees nothing. */
TEST(test_a_best_design_that_is_not_settled_need_not_hold) {
  lm_workspace *workspace = lm_create_workspace();
  lm_answer *answer = (lm_answer *)malloc(sizeof *answer);
  lm_task *task = (lm_task *)malloc(sizeof *task);
  const lm_task *tasks;
  int left = 6;
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, open_here(bound_spec, 0));
  while (left-- > 0 && lm_next_tasks(lm_run_search(run), &tasks) > 0) {
    int i = 0;
    while (lm_is_answered(lm_run_search(run), tasks[i].id)) {
      i++;
    }
    *task = tasks[i];
    TEST_ASSERT_EQUAL_INT(LM_OK, lm_run_task(lm_run_problem(run), task, answer, workspace, NULL));
    TEST_ASSERT_EQUAL_INT(LM_OK, lm_take_answer(run, answer));
  }
  TEST_ASSERT_EQUAL_INT(LM_EXIT_STOPPED, lm_finish_run(run, LM_EXIT_STOPPED, note));
  TEST_ASSERT_EQUAL_STRING("", note);
  assert_holds("front.csv", "\n0,");
  assert_holds("certificate.json", "\"holds\": false");
  lm_free_workspace(workspace);
  free(answer);
  free(task);
}

/* A certificate's flank, and the unit of each limit to be relaxed. */
TEST(test_words_of_the_json_files) {
  static lm_certificate certificate;
  double relax[LM_LIMIT_COUNT];
  char text[16384] = "";
  FILE *file = lm_open_scratch();
  int i;
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, open_here(small_spec, 0));
  for (i = 0; i < LM_LIMIT_COUNT; i++) {
    relax[i] = i != LM_LIMIT_SAFETY;
  }
  lm_write_certificate(file, lm_run_problem(run), 0, &certificate);
  certificate.smallest.forward = 1;
  lm_write_certificate(file, lm_run_problem(run), 0, &certificate);
  lm_write_relaxation(file, relax, 0.25);
  rewind(file);
  TEST_ASSERT_GREATER_THAN_INT(100, (int)fread(text, 1, sizeof text - 1, file));
  fclose(file);
  TEST_ASSERT_NOT_NULL(strstr(text, "\"forward\": false}"));
  TEST_ASSERT_NOT_NULL(strstr(text, "\"forward\": true}"));
  TEST_ASSERT_NOT_NULL(strstr(text,
                              "\"form_radius\", \"unit\": \"modules\", \"by\": 1, "
                              "\"set_by_spec\": false}"));
  TEST_ASSERT_NOT_NULL(strstr(text, "\"interference_max_mm\", \"unit\": \"mm\", \"by\": 0.25,"));
  /* A compliance that may double is a stiffness that falls to half of the required one. */
  TEST_ASSERT_NOT_NULL(strstr(text,
                              "\"stiffness_min_Nm_per_rad\", \"unit\": \"share of the limit\", "
                              "\"by\": 0.5,"));
  TEST_ASSERT_NOT_NULL(
      strstr(text, "\"ratcheting_torque\", \"unit\": \"share of the limit\", \"by\": 0.5,"));
  TEST_ASSERT_NOT_NULL(strstr(text, "\"gap_min_arcmin\", \"unit\": \"arcmin\""));
  TEST_ASSERT_NOT_NULL(strstr(text, "\"torsion_stress\", \"unit\": \"share of the limit\""));
  TEST_ASSERT_NULL(strstr(text, "\"limit\": \"safety_factor_min\""));
}

/* What is in the files of a search with a limit on a figure, two links and a pruned choice. */
TEST(test_files_name_limits_and_what_pruned) {
  char spec[2048];
  snprintf(spec, sizeof spec,
           "%slink 1.37 0.25 0.5 0 2 uniform teeth\nlimit stress_max 2\n"
           "choose teeth.root_clearance 0.3 0.35\nlimit outer_diameter_max_mm 61.5\n",
           small_spec);
  (void)do_all(spec);
  assert_holds("front.csv", "margin_stress_max");
  assert_holds("combinations.csv", "fate,pruned_by\n");
  snprintf(spec, sizeof spec,
           "%slimit outer_diameter_max_mm 30\nlimit interference_max_mm 0\n"
           "limit lost_motion_max_arcmin 0.01\n",
           small_spec);
  lm_close_run(run);
  run = NULL;
  TEST_ASSERT_TRUE(remove_tree(folder, 1));
  TEST_ASSERT_EQUAL_INT(LM_EXIT_FAILED, do_all(spec));
  assert_holds("combinations.csv", "pruned,outer_diameter_max_mm\n");
  assert_holds("infeasible.json", "\"unit\": \"share of the limit\"");
}

/* A full disk at the end: an incomplete result is not taken for a complete one. */
TEST(test_results_on_a_full_disk_are_told) {
#if defined(_WIN32)
  TEST_IGNORE_MESSAGE(NO_FILE_LIMIT);
#else
  struct rlimit before;
  struct rlimit small;
  volatile int stop = 0;
  int size;
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, open_here(small_spec, 0));
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, lm_work_run(run, 1, NULL, NULL, &stop, note));
  TEST_ASSERT_EQUAL_INT(0, getrlimit(RLIMIT_FSIZE, &before));
  (void)signal(SIGXFSZ, SIG_IGN);
  for (size = 0; size <= 1500; size += 500) {
    int status;
    small = before;
    small.rlim_cur = (rlim_t)size;
    TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_FSIZE, &small));
    status = lm_finish_run(run, LM_EXIT_DONE, note);
    TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_FSIZE, &before));
    TEST_ASSERT_EQUAL_INT(LM_EXIT_FAILED, status);
    assert_noted("results cannot be written: File too large");
    assert_missing("certificate.json");
  }
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, lm_finish_run(run, LM_EXIT_DONE, note));
#endif
}

TEST(test_nothing_is_refused) {
  lm_answer *answer = (lm_answer *)calloc(1, sizeof *answer);
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_take_answer(NULL, answer));
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, open_here(small_spec, 0));
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_take_answer(run, NULL));
  free(answer);
  lm_close_run(NULL);
}

/* --- the program --- */

/* Runs the program with these arguments; its output goes to files of the folder. */
static process *start(const char *words) {
  char out[256];
  char err[256];
  process *started;
  place(out, "out");
  place(err, "err");
  started = start_program(LM_PROGRAM, words, out, err);
  TEST_ASSERT_NOT_NULL(started);
  return started;
}

static int call(const char *words) {
  return wait_for_program(start(words));
}

static void write_spec(const char *spec) {
  put("spec", spec);
}

static void assert_usage(const char *words, const char *said) {
  TEST_ASSERT_EQUAL_INT_MESSAGE(2, call(words), words);
  assert_holds("err", said);
}

TEST(test_bad_usage_is_told_in_one_line) {
  assert_usage("", "a spec and a folder are needed");
  assert_usage("a", "a spec and a folder are needed");
  assert_usage("a b c", "too many arguments");
  assert_usage("a b --speed", "unknown option");
  assert_usage("a b --workers", "--workers needs a number from 1 to 256");
  assert_usage("a b --workers 0", "--workers needs");
  assert_usage("a b --workers 257", "--workers needs");
  assert_usage("a b --workers 2x", "--workers needs");
  assert_usage("a b --workers 4294967297", "--workers needs");
  assert_usage("a b --progress loud", "--progress needs json, bar or none");
  assert_usage("none/spec b", "none/spec: No such file");
}

TEST(test_the_program_searches) {
  char words[256];
  write_spec(small_spec);
  snprintf(words, sizeof words, "%s/spec %s/run --workers 1 --progress json", folder, folder);
  TEST_ASSERT_EQUAL_INT(0, call(words));
  assert_holds("out", "{\"stage\": \"done\", ");
  assert_holds("run/best.toml", "[design.teeth]");
  TEST_ASSERT_EQUAL_INT(2, call(words));
  assert_holds("err", "lostmotion-optimizer: ");
  snprintf(words, sizeof words, "%s/spec %s/run --resume --progress bar", folder, folder);
  TEST_ASSERT_EQUAL_INT(0, call(words));
  assert_holds("err", "feasible");
  snprintf(words, sizeof words, "%s/spec %s/other --progress none", folder, folder);
  TEST_ASSERT_EQUAL_INT(0, call(words));
  write_spec("nonsense\n");
  TEST_ASSERT_EQUAL_INT(2, call(words));
  assert_holds("err", "line 1");
}

/* A terminal gets a progress bar; if the first batch exceeds the budget, no time is left to show.
 * The output is read while the program runs, because it would wait for a reader. */
TEST(test_a_terminal_is_shown_a_bar) {
#if defined(_WIN32)
  TEST_IGNORE_MESSAGE("the test reads a pseudo terminal of POSIX, which Windows does not have");
#else
  char words[512];
  char shown[65536] = "";
  char spec[2048];
  size_t length = 0;
  ssize_t got;
  const int terminal = posix_openpt(O_RDWR | O_NOCTTY);
  TEST_ASSERT_TRUE(terminal >= 0);
  TEST_ASSERT_EQUAL_INT(0, grantpt(terminal));
  TEST_ASSERT_EQUAL_INT(0, unlockpt(terminal));
  snprintf(spec, sizeof spec, "%sevaluations 10\n", small_spec);
  write_spec(spec);
  snprintf(words, sizeof words, "%s %s %s/spec %s/run --workers 1 2> %s &", LM_EMULATOR, LM_PROGRAM,
           folder, folder, ptsname(terminal));
  TEST_ASSERT_EQUAL_INT(0, system(words));
  /* ends when the program closes its side */
  while (length < sizeof shown - 1 &&
         (got = read(terminal, shown + length, sizeof shown - 1 - length)) > 0) {
    length += (size_t)got;
  }
  close(terminal);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(shown, "of 10"), shown);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(shown, "  0 s left"), shown);
#endif
}

TEST(test_what_is_no_spec_is_told) {
  char words[256];
  char path[128];
  assert_usage(". b", ".: Is a directory");
  write_spec("seed 1\n");
  snprintf(path, sizeof path, "%s/spec", folder);
  TEST_ASSERT_TRUE(set_length(path, (1 << 20) + 1));
  snprintf(words, sizeof words, "%s b", path);
  assert_usage(words, "found more than 1 MiB, expected a spec");
}

/* In three seconds one worker does more than a fiftieth, from which on the remaining time is
 * stated, and far less than everything. */
TEST(test_an_interrupted_program_saves_and_exits_130) {
  char words[256];
  char spec[2048];
  process *searching;
  snprintf(spec, sizeof spec, "%sevaluations 90000\n", small_spec);
  write_spec(spec);
  snprintf(words, sizeof words, "%s/spec %s/run --workers 1 --progress bar", folder, folder);
  searching = start(words);
  wait_ms(3000);
  if (!interrupt_program(searching)) {
    kill_program(searching);
    (void)wait_for_program(searching);
    TEST_IGNORE_MESSAGE("no console: under Wine, apt install bsdutils and run it by script -qec");
  }
  TEST_ASSERT_EQUAL_INT(130, wait_for_program(searching));
  assert_holds("run/front.csv", "verified");
  snprintf(words, sizeof words, "%s/spec %s/run", folder, folder);
  TEST_ASSERT_EQUAL_INT(2, call(words));
}

/* Killed again and again, each time as soon as its journal has grown. */
TEST(test_a_killed_program_goes_on_to_the_same_bytes) {
  static const char *const names[] = {"best.toml", "front.csv", "history.csv", "certificate.json",
                                      "combinations.csv"};
  char words[256];
  char spec[2048];
  char path[256];
  int starts = 0;
  int killed = 0;
  int status;
  int i;
  snprintf(spec, sizeof spec, "%sevaluations 1500\n", small_spec);
  write_spec(spec);
  snprintf(words, sizeof words, "%s/spec %s/whole --workers 2", folder, folder);
  TEST_ASSERT_EQUAL_INT(0, call(words));
  snprintf(words, sizeof words, "%s/spec %s/run --workers 2", folder, folder);
  place(path, "run/journal.bin");
  do {
    process *searching = start(words);
    int waited = 0;
    while (starts < 3 && waited < 100 + 100 * starts) {
      wait_ms(10);
      waited += lm_exists(path) ? 10 : 0; /* before that it would begin again */
    }
    if (starts < 3) {
      kill_program(searching);
    }
    status = wait_for_program(searching);
    killed += status == -1;
    starts++;
    snprintf(words, sizeof words, "%s/spec %s/run --workers 2 --resume", folder, folder);
  } while (starts <= 3);
  TEST_ASSERT_GREATER_THAN_INT_MESSAGE(0, killed, "it was done before it could be killed");
  TEST_ASSERT_EQUAL_INT(0, status);
  for (i = 0; i < 5; i++) {
    char *whole;
    char *again;
    snprintf(path, sizeof path, "whole/%s", names[i]);
    whole = content(path);
    snprintf(path, sizeof path, "run/%s", names[i]);
    again = content(path);
    TEST_ASSERT_NOT_NULL_MESSAGE(whole, path);
    TEST_ASSERT_EQUAL_STRING_MESSAGE(whole, again, path);
    free(whole);
    free(again);
  }
}

/* Longer than the 260 characters of an old Windows program, and in letters that no code
 * page has. */
TEST(test_a_long_path_of_other_letters_is_a_folder_like_another) {
  char path[1024];
  char name[1200];
  size_t length;
  FILE *file;
  int part;
  int known;
  snprintf(path, sizeof path, "%s", folder);
  for (part = 0; part < 14; part++) {
    length = strlen(path);
    snprintf(path + length, sizeof path - length,
             "/\xd9\x85\xd8\xad\xd9\x88\xd8\xb1-\xe8\xb0\x90\xe6\xb3\xa2-Getriebepr\xc3\xbc"
             "fstand-%d",
             part);
    TEST_ASSERT_TRUE_MESSAGE(lm_make_folder(path), path);
  }
  TEST_ASSERT_GREATER_THAN_INT(260, (int)strlen(path));
  TEST_ASSERT_EQUAL_INT(LM_EXIT_BAD_INPUT, lm_open_run("s", small_spec, path, 1, &run, note));
  assert_noted("No such file");
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, lm_open_run("s", small_spec, path, 0, &run, note));
  TEST_ASSERT_EQUAL_INT(LM_EXIT_STOPPED, lm_finish_run(run, LM_EXIT_STOPPED, note));
  snprintf(name, sizeof name, "%s/front.csv", path);
  TEST_ASSERT_TRUE(lm_exists(name));
  TEST_ASSERT_TRUE(lm_is_same_file(name, name));
  file = lm_open_file(name, LM_FILE_READ);
  TEST_ASSERT_NOT_NULL(file);
  known = fgetc(file);
  fclose(file);
  TEST_ASSERT_EQUAL_INT('v', known);
  lm_close_run(run);
  run = NULL;
  for (part = 14; part > 0; part--) { /* tearDown's own paths are short */
    static const char *const names[] = {"front.csv", "history.csv", "combinations.csv",
                                        "journal.bin"};
    size_t i;
    for (i = 0; i < sizeof names / sizeof names[0]; i++) {
      snprintf(name, sizeof name, "%s/%s", path, names[i]);
      (void)lm_remove_file(name);
    }
    TEST_ASSERT_TRUE_MESSAGE(lm_remove_folder(path), path);
    *strrchr(path, '/') = '\0';
  }
}

/* The same bytes on every system, including the ends of lines. */
TEST(test_no_result_has_a_carriage_return) {
  static const char *const names[] = {"best.toml", "front.csv", "history.csv", "certificate.json",
                                      "combinations.csv"};
  int i;
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, do_all(small_spec));
  for (i = 0; i < 5; i++) {
    char *text = content(names[i]);
    TEST_ASSERT_NOT_NULL_MESSAGE(text, names[i]);
    TEST_ASSERT_NULL_MESSAGE(strchr(text, '\r'), names[i]);
    free(text);
  }
}

/* With the argument interrupt only the test that needs a console on Windows. */
int main(int count, char **argument) {
  if (count > 1 && strcmp(argument[1], "interrupt") == 0) {
    UNITY_BEGIN();
    RUN_TEST(test_an_interrupted_program_saves_and_exits_130);
    return UNITY_END();
  }
  return run_tests();
}
