/* Every call of the optimizer to the system that can fail, failed once: memory, files, threads; and
 * every call to the model. The linker puts the functions below in the place of both (--wrap). A run
 * must end with a status and a message, leak nothing and continue later to the same bytes. */
#define _XOPEN_SOURCE 700 /* locks */
#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>

#include "certificate.h"
#include "output.h"
#include "pool.h"
#include "run.h"
#include "run_task.h"
#include "spec.h"
#include "stop.h"
#include "test.h"
#include "workspace.h"

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

static const FILE *broken; /* that a write to failed, as ferror tells until it is closed */

size_t __real_fwrite(const void *from, size_t size, size_t count, FILE *file);
size_t __wrap_fwrite(const void *from, size_t size, size_t count, FILE *file);
size_t __wrap_fwrite(const void *from, size_t size, size_t count, FILE *file) {
  if (fails()) {
    broken = file;
    return 0;
  }
  return __real_fwrite(from, size, count, file);
}

int __real_ferror(FILE *file);
int __wrap_ferror(FILE *file);
int __wrap_ferror(FILE *file) {
  return file == broken || __real_ferror(file);
}

/* fclose still closes the file, so that nothing leaks. */
int __real_fclose(FILE *file);
int __wrap_fclose(FILE *file);
int __wrap_fclose(FILE *file) {
  const int closed = __real_fclose(file);
  broken = file == broken ? NULL : broken;
  return fails() ? EOF : closed;
}

WRAP(void *, malloc, (size_t size), (size), NULL)
WRAP(void *, calloc, (size_t count, size_t size), (count, size), NULL)
WRAP(void *, realloc, (void *memory, size_t size), (memory, size), NULL)
WRAP(FILE *, fopen, (const char *path, const char *mode), (path, mode), NULL)
WRAP(FILE *, tmpfile, (void), (), NULL)
WRAP(int, fflush, (FILE * file), (file), EOF)
WRAP(int, fsync, (int handle), (handle), -1)
WRAP(int, ftruncate, (int handle, off_t length), (handle, length), -1)
WRAP(int, fseek, (FILE * file, long offset, int from), (file, offset, from), -1)
WRAP(int, rename, (const char *from, const char *to), (from, to), -1)
WRAP(int, pthread_create,
     (pthread_t * thread, const pthread_attr_t *attributes, void *(*work)(void *), void *data),
     (thread, attributes, work, data), EAGAIN)

static int lock_error; /* != 0: why no file can be locked */

int __real_lockf(int handle, int what, off_t length);
int __wrap_lockf(int handle, int what, off_t length);
int __wrap_lockf(int handle, int what, off_t length) {
  if (lock_error != 0) {
    errno = lock_error;
    return -1;
  }
  return __real_lockf(handle, what, length);
}

static long cores; /* != 0: returned number of cores */

long __real_sysconf(int name);
long __wrap_sysconf(int name);
long __wrap_sysconf(int name) {
  return cores != 0 ? cores : __real_sysconf(name);
}

/* --- the model --- */

/* Functions of the model that an evaluation, a certificate or a search calls. */
typedef enum model_call {
  EVALUATE_POINT = 1,
  EVALUATE_SLOPES = 2,
  POINT_DRIVE = 4,
  MESHES = 8,
  SMALLEST_GAP = 16,
  CHECKS = 32,
  TORSION_CURVE = 64,
  GAP_TURN = 128,
  LIMITS = 256,
  SAMPLES = 512,
  LOOK = 1024 /* meshes between the angles of the scan: those of lm_point_drive's drive */
} model_call;

static int watched;         /* model_call, those that count */
static int model_left = -1; /* of them until one fails */
static int model_failed;
static int stop_left = -1; /* evaluations until a stop is requested */
static volatile int stop_flag;

static int model_fails(model_call call) {
  if ((call == EVALUATE_POINT || call == EVALUATE_SLOPES) && stop_left >= 0 && stop_left-- == 0) {
    lm_stop(&stop_flag);
  }
  if (!(watched & (int)call) || model_left < 0 || model_left-- > 0) {
    return 0;
  }
  model_failed = 1;
  return 1;
}

/* No function of the model itself returns this status. */
#define REFUSAL LM_CORRUPT

#define WRAP_MODEL(call, name, declared, passed)               \
  lm_status __real_##name declared;                            \
  lm_status __wrap_##name declared;                            \
  lm_status __wrap_##name declared {                           \
    return model_fails(call) ? REFUSAL : __real_##name passed; \
  }

WRAP_MODEL(EVALUATE_POINT, lm_evaluate_point,
           (const lm_problem *p, const lm_scan *s, const lm_layout *l, int combination,
            const double unit[], double result[], lm_workspace *w, lm_fault *f),
           (p, s, l, combination, unit, result, w, f))
WRAP_MODEL(EVALUATE_SLOPES, lm_evaluate_slopes,
           (const lm_problem *p, const lm_scan *s, const lm_layout *l, int combination,
            const double unit[], double result[], double slope[], lm_workspace *w, lm_fault *f),
           (p, s, l, combination, unit, result, slope, w, f))

static int tolerance_only; /* 1: the next meshes are of a tolerance-only evaluation */

lm_status __real_lm_point_drive(const lm_problem *p, int combination, const double unit[],
                                lm_drive *drive, lm_fault *f);
lm_status __wrap_lm_point_drive(const lm_problem *p, int combination, const double unit[],
                                lm_drive *drive, lm_fault *f);
lm_status __wrap_lm_point_drive(const lm_problem *p, int combination, const double unit[],
                                lm_drive *drive, lm_fault *f) {
  tolerance_only = 1;
  return model_fails(POINT_DRIVE) ? REFUSAL : __real_lm_point_drive(p, combination, unit, drive, f);
}

lm_status __real_lm_prepare_meshes(const lm_drive *drive, int nodes, lm_design_workspace *w,
                                   lm_fault *f);
lm_status __wrap_lm_prepare_meshes(const lm_drive *drive, int nodes, lm_design_workspace *w,
                                   lm_fault *f);
lm_status __wrap_lm_prepare_meshes(const lm_drive *drive, int nodes, lm_design_workspace *w,
                                   lm_fault *f) {
  const model_call call = tolerance_only ? LOOK : MESHES;
  tolerance_only = 0;
  return model_fails(call) ? REFUSAL : __real_lm_prepare_meshes(drive, nodes, w, f);
}

static int gap_short; /* 1: the smallest gap always remains one arcmin too small */
static int no_slope;  /* 1: derivatives are NaN */

lm_status __real_lm_find_face_gap(const lm_drive *drive, int nodes, int steps, lm_mesh meshes[],
                                  lm_smallest_gap *gap, lm_fault *f);
lm_status __wrap_lm_find_face_gap(const lm_drive *drive, int nodes, int steps, lm_mesh meshes[],
                                  lm_smallest_gap *gap, lm_fault *f);
lm_status __wrap_lm_find_face_gap(const lm_drive *drive, int nodes, int steps, lm_mesh meshes[],
                                  lm_smallest_gap *gap, lm_fault *f) {
  const lm_status status = __real_lm_find_face_gap(drive, nodes, steps, meshes, gap, f);
  if (gap_short) {
    gap->gap_rad = -2.9e-4;
  }
  return model_fails(SMALLEST_GAP) ? REFUSAL : status;
}

int __real_lm_dual_evaluate(const lm_problem *p, const lm_scan *s, const lm_layout *l,
                            int combination, const double unit[], double result[], double slope[],
                            void *w, const char **input);
int __wrap_lm_dual_evaluate(const lm_problem *p, const lm_scan *s, const lm_layout *l,
                            int combination, const double unit[], double result[], double slope[],
                            void *w, const char **input);
int __wrap_lm_dual_evaluate(const lm_problem *p, const lm_scan *s, const lm_layout *l,
                            int combination, const double unit[], double result[], double slope[],
                            void *w, const char **input) {
  const int status = __real_lm_dual_evaluate(p, s, l, combination, unit, result, slope, w, input);
  if (no_slope) {
    slope[1] = (double)NAN;
  }
  return status;
}

WRAP_MODEL(CHECKS, lm_check_design,
           (const lm_drive *drive, const lm_mesh meshes[], int sections, const lm_smallest_gap *gap,
            const lm_load *load, lm_check checks[], lm_fault *f),
           (drive, meshes, sections, gap, load, checks, f))
WRAP_MODEL(TORSION_CURVE, lm_evaluate_torsion_curve,
           (const lm_drive *drive, lm_real phase, const lm_real torque[], int count,
            lm_contributions at[], lm_mesh_state *mesh, lm_design_workspace *w, lm_fault *f),
           (drive, phase, torque, count, at, mesh, w, f))
WRAP_MODEL(GAP_TURN, lm_radial_gap_angle,
           (lm_real gap, lm_real angle, lm_real radius, lm_real *turn, lm_fault *f),
           (gap, angle, radius, turn, f))
WRAP_MODEL(GAP_TURN, lm_gap_closing_torque,
           (lm_real gap, lm_real radius, lm_real stiffness, lm_real angle, lm_real *torque,
            lm_fault *f),
           (gap, radius, stiffness, angle, torque, f))
WRAP_MODEL(GAP_TURN, lm_gap_rotation,
           (lm_real torque, lm_real closing, lm_real full, lm_real *turn, lm_fault *f),
           (torque, closing, full, turn, f))
WRAP_MODEL(LIMITS, lm_worst_limits,
           (const lm_tolerance_link *links, int count, lm_tolerance_limits *limits, lm_fault *f),
           (links, count, limits, f))
WRAP_MODEL(LIMITS, lm_probable_limits,
           (const lm_tolerance_link *links, int count, lm_real t, lm_tolerance_limits *limits,
            lm_fault *f),
           (links, count, t, limits, f))
WRAP_MODEL(LIMITS, lm_tolerance_contributions,
           (const lm_tolerance_link *links, int count, lm_real worst[], lm_real probable[],
            lm_fault *f),
           (links, count, worst, probable, f))
WRAP_MODEL(SAMPLES, lm_sample_gap,
           (const lm_tolerance_link *links, int count, const lm_sampling_plan *plan,
            lm_real samples[], size_t length, lm_gap_statistics *statistics, lm_fault *f),
           (links, count, plan, samples, length, statistics, f))

static char folder[64];

static const char spec[] =
    "seed 3\n"
    "evaluations 100\n"
    "rated_torque_Nm 40\n"
    "objective lost_motion\n"
    "fixed teeth.module_mm 0.25\n"
    "fixed teeth.face_width_mm 10\n"
    "fixed teeth.engagement_depth 1\n" /* the tips stay on the involute at both edges */
    "fixed teeth.flexspline_teeth 200\n"
    "fixed generator.type discs\n"
    "range teeth.flexspline_shift 2 4\n"
    "range teeth.shift_difference -0.3 0.3\n"
    "fixed generator.deflection_modules 0.95\n";

/* A command of the shell within the folder. */
static void shell(const char *words) {
  char command[256];
  snprintf(command, sizeof command, "cd %s && %s", folder, words);
  TEST_ASSERT_EQUAL_INT(0, system(command));
}

/* Its own folder, so that simultaneous runs do not interfere. */
void setUp(void) {
  strcpy(folder, "optimizer_failures_XXXXXX");
  TEST_ASSERT_NOT_NULL(mkdtemp(folder));
}

void tearDown(void) {
  left = -1;
  watched = 0;
  model_left = -1;
  stop_left = -1;
  stop_flag = 0;
  cores = 0;
  lock_error = 0;
  gap_short = 0;
  no_slope = 0;
  shell("rm -rf \"$PWD\"");
}

/* One run in which the call number `at` fails; its exit status. */
static int run_with_failure(int at, int resume, int workers, char note[LM_NOTE_MAX]) {
  lm_run *run = NULL;
  volatile int stop = 0;
  char place[80];
  int status;
  left = at;
  failed = 0;
  note[0] = '\0';
  snprintf(place, sizeof place, "%s/run", folder);
  status = lm_open_run("spec", spec, place, resume, &run, note);
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

/* No result is incomplete, and a search that did not begin left no file. */
static void check_nothing_torn(int never_begun) {
  static const char *const names[] = {"best.toml",  "certificate.json", "combinations.csv",
                                      "front.csv",  "history.csv",      "infeasible.json",
                                      "nearest.csv"};
  char place[128];
  int i;
  for (i = 0; i < 7; i++) {
    snprintf(place, sizeof place, "%s/run/%s.part", folder, names[i]);
    TEST_ASSERT_TRUE_MESSAGE(access(place, F_OK) != 0, place);
  }
  snprintf(place, sizeof place, "%s/run", folder);
  TEST_ASSERT_TRUE(!never_begun || access(place, F_OK) != 0);
}

static void fail_each_call(int resume, int workers) {
  char note[LM_NOTE_MAX];
  int at = 0;
  int silent = 0;
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, run_with_failure(-1, 0, 1, note));
  shell("mkdir .whole && cp run/*.csv run/best.toml run/certificate.json .whole");
  do {
    int status;
    shell("rm -rf ./*");
    if (resume) {
      TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, run_with_failure(-1, 0, 1, note));
      shell("truncate -s -20 run/journal.bin");
    }
    status = run_with_failure(at, resume, workers, note);
    if (failed && status == LM_EXIT_DONE) {
      silent++; /* a thread that did not start */
      shell("for f in .whole/*; do cmp $f run/${f#*/} || exit 1; done");
    } else if (failed) {
      TEST_ASSERT_TRUE(note[0] != '\0');
      check_nothing_torn(status == LM_EXIT_BAD_INPUT && !resume);
    } else {
      TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, status);
    }
    at++;
    TEST_ASSERT_LESS_THAN_INT(20000, at);
  } while (failed);
  TEST_ASSERT_GREATER_THAN_INT(20, at);
  TEST_ASSERT_LESS_THAN_INT(at / 2, silent);
}

TEST(test_every_failure_of_a_new_run_is_reported) {
  fail_each_call(0, 2);
}

TEST(test_every_failure_of_a_resumed_run_is_reported) {
  fail_each_call(1, 1);
}

/* POSIX permits both values if another process has the lock. A search works also in a file system
 * without locks. */
TEST(test_a_journal_that_another_process_has_is_refused) {
  static const int held[] = {EACCES, EAGAIN};
  char note[LM_NOTE_MAX];
  int i;
  lock_error = ENOLCK;
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, run_with_failure(-1, 0, 1, note));
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, run_with_failure(-1, 1, 1, note));
  shell("cp -r run .whole");
  for (i = 0; i < 2; i++) {
    lock_error = held[i];
    TEST_ASSERT_EQUAL_INT(LM_EXIT_BAD_INPUT, run_with_failure(-1, 1, 1, note));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(note, "journal.bin: found a running search"), note);
    shell("diff -r run .whole");
  }
  shell("rm -r run");
  TEST_ASSERT_EQUAL_INT(LM_EXIT_BAD_INPUT, run_with_failure(-1, 0, 1, note));
  check_nothing_torn(1);
}

/* --- the model's failures --- */

static lm_problem problem;
static lm_workspace *workspace;
static lm_answer *answer;
static const double middle[LM_FREE_MAX] = {0.5, 0.5, 0.5};

#define LIMITS_WITH_GRADES(range)    \
  "limit lost_motion_max_arcmin 9\n" \
  "objective cost\n"                 \
  "whole tolerance.0.grade " range   \
  "\n"                               \
  "link 0.5 48 0.5 0 1 normal generator\n"

static const char limits[] = LIMITS_WITH_GRADES("5 9");

static void open_problem(const char *more) {
  lm_spec_error error = {0, ""};
  char text[2048];
  snprintf(text, sizeof text, "%s%s", spec, more);
  TEST_ASSERT_EQUAL_INT_MESSAGE(LM_OK, lm_read_spec(text, &problem, &error), error.text);
  workspace = lm_create_workspace();
  answer = (lm_answer *)malloc(sizeof *answer);
}

static void close_problem(void) {
  lm_free_workspace(workspace);
  free(answer);
}

static void watch(int calls, int at) {
  watched = calls;
  model_left = at;
  model_failed = 0;
}

TEST(test_every_refusal_of_the_model_ends_an_evaluation) {
  static double result[LM_RESULT_MAX];
  static const char *const levels[] = {"level worst\n", "level probable\n", "level quantile\n"};
  lm_scan scan;
  lm_layout layout;
  int level;
  lm_default_scan(&scan);
  for (level = 0; level < 3; level++) {
    int at = -1;
    open_problem(levels[level]);
    lm_lay_out(&problem, &scan, &layout);
    do {
      lm_status status;
      watch(MESHES | CHECKS | TORSION_CURVE | GAP_TURN | LIMITS, ++at);
      status = lm_evaluate_point(&problem, &scan, &layout, 0, middle, result, workspace, NULL);
      TEST_ASSERT_EQUAL_INT(model_failed ? REFUSAL : LM_OK, status);
    } while (model_failed);
    /* limits, meshes, checks; of two phases a torsion curve and three turns of three calls */
    TEST_ASSERT_GREATER_OR_EQUAL_INT(3 + 2 * (1 + 3 * 3), at);
    close_problem();
  }
}

TEST(test_every_refusal_of_the_model_ends_a_certificate) {
  lm_certificate *certificate = (lm_certificate *)malloc(sizeof *certificate);
  int at = -1;
  open_problem(limits);
  do {
    lm_status status;
    watch(POINT_DRIVE | LOOK | MESHES | SMALLEST_GAP | CHECKS | TORSION_CURVE | LIMITS | SAMPLES |
              EVALUATE_POINT | EVALUATE_SLOPES,
          ++at);
    status = lm_certify(&problem, 0, middle, certificate, workspace, NULL);
    TEST_ASSERT_EQUAL_INT(model_failed ? REFUSAL : LM_OK, status);
  } while (model_failed);
  TEST_ASSERT_GREATER_THAN_INT(10, at);
  close_problem();
  free(certificate);
}

static void make_task(int kind, lm_task *task) {
  memset(task, 0, sizeof *task);
  task->kind = kind;
  task->budget = kind == LM_TASK_VERIFY ? 2400 : 120;
  task->seed = 99;
  lm_scalarise_first(&task->scalar);
  memcpy(task->unit, middle, sizeof task->unit);
}

/* A refused point is charged, and no other point is derived from it. */
TEST(test_a_task_continues_past_every_refusal) {
  lm_task task;
  int kind;
  open_problem(limits);
  for (kind = LM_TASK_SCREEN; kind <= LM_TASK_VERIFY; kind++) {
    int at = 0;
    make_task(kind, &task);
    do {
      watch(EVALUATE_POINT | EVALUATE_SLOPES | POINT_DRIVE | MESHES | SMALLEST_GAP, at);
      TEST_ASSERT_EQUAL_INT(LM_OK, lm_run_task(&problem, &task, answer, workspace, NULL));
      TEST_ASSERT_LESS_OR_EQUAL_INT(answer->plain + answer->slopes,
                                    answer->refused + answer->feasible);
      at += 1 + at / 8;
    } while (model_failed);
  }
  close_problem();
}

/* The verification's own tolerance_only between the angles, each alone. */
TEST(test_a_settling_whose_last_look_is_refused_is_none) {
  static const int calls[] = {POINT_DRIVE, LOOK, SMALLEST_GAP};
  lm_task task;
  int i;
  open_problem(LIMITS_WITH_GRADES("5.5 8.5")); /* the best one is rounded, then solved again */
  make_task(LM_TASK_VERIFY, &task);
  for (i = 0; i < 3; i++) {
    int at = -1;
    int verified = -1;
    do {
      watch(calls[i], ++at);
      TEST_ASSERT_EQUAL_INT(LM_OK, lm_run_task(&problem, &task, answer, workspace, NULL));
      TEST_ASSERT_TRUE(!model_failed || verified != 0); /* only the last one decides */
      verified = answer->solution_count;
    } while (model_failed);
    TEST_ASSERT_EQUAL_INT(1, verified);
    TEST_ASSERT_GREATER_THAN_INT(1, at); /* one look by the solver, one by the certificate */
  }
  close_problem();
}

TEST(test_a_gap_that_nothing_opens_is_not_settled) {
  static const char unmoved[] =
      "rated_torque_Nm 40\nobjective lost_motion\n"
      "fixed generator.type discs\nfixed teeth.module_mm 0.25\n"
      "fixed teeth.flexspline_teeth 200\nfixed teeth.face_width_mm 10\n"
      "fixed teeth.shift_difference -0.03\n"
      "range generator.deflection_modules 0.88 1.05\n";
  lm_spec_error error = {0, ""};
  lm_task task;
  open_problem("");
  gap_short = 1;
  make_task(LM_TASK_VERIFY, &task);
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_run_task(&problem, &task, answer, workspace, NULL));
  TEST_ASSERT_EQUAL_INT(1, answer->computed);
  TEST_ASSERT_EQUAL_INT(0, answer->solution_count);
  TEST_ASSERT_EQUAL_INT_MESSAGE(LM_OK, lm_read_spec(unmoved, &problem, &error), error.text);
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_run_task(&problem, &task, answer, workspace, NULL));
  TEST_ASSERT_EQUAL_INT(0, answer->solution_count);
  close_problem();
}

TEST(test_derivatives_that_are_no_numbers_are_refused) {
  lm_fault fault;
  static double result[LM_RESULT_MAX];
  static double slope[LM_RESULT_MAX * LM_FREE_MAX];
  lm_scan scan;
  lm_layout layout;
  open_problem("");
  lm_default_scan(&scan);
  lm_lay_out(&problem, &scan, &layout);
  no_slope = 1;
  TEST_ASSERT_EQUAL_INT(LM_NOT_FINITE, lm_evaluate_slopes(&problem, &scan, &layout, 0, middle,
                                                          result, slope, workspace, &fault));
  TEST_ASSERT_EQUAL_STRING("derivatives", fault.input);
  close_problem();
}

TEST(test_a_task_stops_at_every_evaluation) {
  lm_task task;
  int kind;
  open_problem(limits);
  for (kind = LM_TASK_SCREEN; kind <= LM_TASK_VERIFY; kind++) {
    int at = 0;
    lm_status status;
    make_task(kind, &task);
    do {
      stop_left = at;
      stop_flag = 0;
      status = lm_run_task(&problem, &task, answer, workspace, &stop_flag);
      TEST_ASSERT_TRUE(status == LM_OK || (status == LM_NOT_CONVERGED && stop_flag));
      at += 1 + at / 8;
    } while (stop_flag);
    TEST_ASSERT_EQUAL_INT(LM_OK, status);
    /* those that look at the start, and with one grade round it both ways, are the shortest */
    TEST_ASSERT_GREATER_THAN_INT(
        kind == LM_TASK_EVALUATE || kind == LM_TASK_ROUND || kind == LM_TASK_CONFIRM ? 1 : 3, at);
  }
  close_problem();
}

TEST(test_an_explanation_continues_past_every_refusal) {
  double relax[LM_LIMIT_COUNT];
  int at = 0;
  open_problem("limit lost_motion_max_arcmin 0.01\n");
  do {
    double unit[LM_FREE_MAX] = {0.5, 0.5};
    lm_status status;
    watch(EVALUATE_POINT | EVALUATE_SLOPES, at);
    status = lm_explain_infeasible(&problem, 0, unit, 2000, relax, workspace, NULL);
    TEST_ASSERT_EQUAL_INT(model_failed && at == 0 ? LM_OUT_OF_RANGE : LM_OK, status);
    at += 1 + at / 8;
  } while (model_failed);
  TEST_ASSERT_GREATER_THAN_INT(3, at);
  {
    /* without the certificate the limits are those of the search */
    static const double start[LM_FREE_MAX] = {0.5, 0.5};
    double unit[LM_FREE_MAX] = {0.5, 0.5};
    double whole[LM_LIMIT_COUNT];
    int refused = 0;
    watch(CHECKS, 0);
    TEST_ASSERT_EQUAL_INT(LM_OK,
                          lm_explain_infeasible(&problem, 0, unit, 2000, relax, workspace, NULL));
    TEST_ASSERT_TRUE(model_failed);
    TEST_ASSERT_TRUE(relax[LM_LIMIT_FIGURE] > 0);
    watch(0, -1);
    /* without memory there is no answer, or NLopt did not need it and the answer is the same */
    memcpy(unit, start, sizeof unit);
    TEST_ASSERT_EQUAL_INT(LM_OK,
                          lm_explain_infeasible(&problem, 0, unit, 2000, whole, workspace, NULL));
    for (at = 0, failed = 1; failed; at++) {
      lm_status status;
      memcpy(unit, start, sizeof unit);
      failed = 0;
      left = at;
      status = lm_explain_infeasible(&problem, 0, unit, 2000, relax, workspace, NULL);
      left = -1;
      TEST_ASSERT_TRUE(status == LM_OK || (failed && status == LM_TOO_SMALL));
      refused += status == LM_TOO_SMALL;
      TEST_ASSERT_TRUE(status != LM_OK || memcmp(relax, whole, sizeof whole) == 0);
    }
    TEST_ASSERT_GREATER_THAN_INT(0, refused);
    TEST_ASSERT_GREATER_THAN_INT(1, at);
  }
  /* the last point of the solver is refused: the answer states its start */
  for (at = 0; at < 40; at++) {
    double unit[LM_FREE_MAX] = {0.1 * (at % 10), 1 - 0.1 * (at % 10)};
    watch(EVALUATE_POINT, 0);
    TEST_ASSERT_EQUAL_INT(LM_OK,
                          lm_explain_infeasible(&problem, 0, unit, 8 * at, relax, workspace, NULL));
    TEST_ASSERT_TRUE(relax[LM_LIMIT_FIGURE] > 0);
  }
  close_problem();
}

static int rows_of_front(void) {
  char path[128];
  FILE *file;
  int rows = 0;
  int c;
  snprintf(path, sizeof path, "%s/front.csv", folder);
  file = fopen(path, "r");
  TEST_ASSERT_NOT_NULL(file);
  while ((c = getc(file)) != EOF) {
    rows += c == '\n';
  }
  fclose(file);
  return rows;
}

/* A design of the front that is refused when it is written has no row; a best one that is refused
 * has no certificate. */
TEST(test_refusals_at_the_end_of_a_run_are_reported) {
  char note[LM_NOTE_MAX];
  lm_run *run = NULL;
  volatile int stop = 0;
  int rows;
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, lm_open_run("spec", spec, folder, 0, &run, note));
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, lm_work_run(run, 1, NULL, NULL, &stop, note));
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, lm_finish_run(run, LM_EXIT_DONE, note));
  rows = rows_of_front();
  lm_close_run(run); /* continued, it knows no results and evaluates the front */
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, lm_open_run("spec", spec, folder, 1, &run, note));
  watch(EVALUATE_POINT, 0);
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, lm_finish_run(run, LM_EXIT_DONE, note));
  TEST_ASSERT_EQUAL_INT(rows - 1, rows_of_front());
  watch(POINT_DRIVE, 0);
  TEST_ASSERT_EQUAL_INT(LM_EXIT_FAILED, lm_finish_run(run, LM_EXIT_DONE, note));
  TEST_ASSERT_NOT_NULL(strstr(note, "results cannot be written"));
  lm_close_run(run);
}

TEST(test_limits_that_cannot_be_explained_are_distinguished) {
  char text[2048];
  char note[LM_NOTE_MAX];
  lm_run *run = NULL;
  volatile int stop = 0;
  snprintf(text, sizeof text, "%slimit lost_motion_max_arcmin 0.01\n", spec);
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, lm_open_run("spec", text, folder, 0, &run, note));
  TEST_ASSERT_EQUAL_INT(LM_EXIT_DONE, lm_work_run(run, 1, NULL, NULL, &stop, note));
  watch(EVALUATE_SLOPES, 0);
  TEST_ASSERT_EQUAL_INT(LM_EXIT_FAILED, lm_finish_run(run, LM_EXIT_DONE, note));
  TEST_ASSERT_NOT_NULL(strstr(note, "no design exists in these ranges"));
  watch(0, -1);
  TEST_ASSERT_EQUAL_INT(LM_EXIT_FAILED, lm_finish_run(run, LM_EXIT_DONE, note));
  TEST_ASSERT_NOT_NULL(strstr(note, "lost_motion_max_arcmin by"));
  shell("rm infeasible.json && mkdir infeasible.json.part");
  TEST_ASSERT_EQUAL_INT(LM_EXIT_FAILED, lm_finish_run(run, LM_EXIT_DONE, note));
  TEST_ASSERT_NOT_NULL(strstr(note, "results cannot be written"));
  shell("rmdir infeasible.json.part && mkdir infeasible.json");
  TEST_ASSERT_EQUAL_INT(LM_EXIT_FAILED, lm_finish_run(run, LM_EXIT_DONE, note));
  TEST_ASSERT_NOT_NULL(strstr(note, "results cannot be written"));
  shell("rmdir infeasible.json && mkdir nearest.csv.part");
  TEST_ASSERT_EQUAL_INT(LM_EXIT_FAILED, lm_finish_run(run, LM_EXIT_DONE, note));
  TEST_ASSERT_NOT_NULL(strstr(note, "results cannot be written"));
  lm_close_run(run);
}

/* If the number of cores is unknown it is one; a larger number than the limit is reduced to it. */
TEST(test_a_pool_has_as_many_workers_as_the_machine_cores) {
  static const long said[] = {-1, LM_WORKERS_MAX + 1};
  int i;
  for (i = 0; i < 2; i++) {
    lm_pool *pool;
    cores = said[i];
    pool = lm_open_pool(0);
    TEST_ASSERT_NOT_NULL(pool);
    lm_close_pool(pool);
  }
}
