#include "run.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "decimal.h"
#include "journal.h"
#include "output.h"
#include "platform.h"
#include "pool.h"
#include "spec.h"
#include "stop.h"

#define PATH_MAX_CHARACTERS 4096
#define HOOK_SECONDS 0.2

struct lm_run {
  char folder[PATH_MAX_CHARACTERS - 80]; /* room for the names of the files */
  lm_problem problem;
  lm_search *search;
  lm_journal *journal;
  FILE *history;
  int written; /* tasks of the last row of the history */
  int failed;  /* errno of the journal */
  lm_run_hook hook;
  void *context;
  double hooked; /* seconds, when the hook was called */
  volatile int *stop;
  lm_pool *pool;      /* of the work, whose results the front has; null before it */
  lm_measured *front; /* null until it is measured */
  int front_count;
};

static int say(char note[LM_NOTE_MAX], int status, const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(note, LM_NOTE_MAX, format, arguments);
  va_end(arguments);
  return status;
}

static void join(char path[PATH_MAX_CHARACTERS], const lm_run *run, const char *name) {
  snprintf(path, PATH_MAX_CHARACTERS, "%s/%s", run->folder, name);
}

/* Files are written under a temporary name and renamed. A temporary file of a killed search is
 * removed; a link in its place is not followed. */
static FILE *begin_file(const lm_run *run, const char *name) {
  char path[PATH_MAX_CHARACTERS];
  char part[80];
  snprintf(part, sizeof part, "%s.part", name);
  join(path, run, part);
  (void)lm_remove_file(path);
  return lm_open_file(path, LM_FILE_CREATE);
}

/* 1: the file is complete and in its place; otherwise it is removed. */
static int end_file(const lm_run *run, const char *name, FILE *file, int whole) {
  char path[PATH_MAX_CHARACTERS];
  char from[PATH_MAX_CHARACTERS];
  char part[80];
  int failed = !whole || ferror(file);
  snprintf(part, sizeof part, "%s.part", name);
  join(from, run, part);
  join(path, run, name);
  failed |= fclose(file);
  if (failed || !lm_replace_file(from, path)) {
    const int why = errno;
    (void)lm_remove_file(from);
    errno = why;
    return 0;
  }
  return 1;
}

const lm_problem *lm_run_problem(const lm_run *run) {
  return &run->problem;
}

lm_search *lm_run_search(lm_run *run) {
  return run->search;
}

/* --- answers ---------------------------------------------------------------------------------- */

static lm_status take(lm_run *run, const lm_answer *answer) {
  const lm_status status = lm_accept_answer(run->search, answer);
  char text[LM_DECIMAL_MAX];
  lm_progress progress;
  lm_read_progress(run->search, &progress);
  /* One row per batch: within a batch the order of the answers depends on timing. */
  if (progress.tasks_done != run->written) {
    run->written = progress.tasks_done;
    fprintf(run->history, "%d,%d,", progress.tasks_done, progress.evaluations);
    if (progress.has_best) {
      fputs(lm_write_decimal(text, progress.best_value, LM_DECIMAL_EXACT), run->history);
    }
    fprintf(run->history, ",%d\n", progress.front_size);
  }
  return status;
}

static lm_status take_old(void *context, const lm_answer *answer) {
  return take((lm_run *)context, answer);
}

lm_status lm_take_answer(lm_run *run, const lm_answer *answer) {
  if (run == NULL || answer == NULL) {
    return LM_NULL;
  }
  if (lm_append_answer(run->journal, answer) != LM_OK) {
    run->failed = errno;
    return LM_CORRUPT;
  }
  return take(run, answer);
}

/* --- begin ------------------------------------------------------------------------------------ */

/* Refuse a folder in which the results would replace the spec or, without a journal, files that no
 * search wrote there. */
static int check_results(const lm_run *run, const char *spec_name, int resume,
                         char note[LM_NOTE_MAX]) {
  static const char *const names[] = LM_RESULT_NAMES;
  char path[PATH_MAX_CHARACTERS];
  int begun;
  size_t i;
  join(path, run, "journal.bin");
  begun = resume || lm_exists(path);
  for (i = 0; i < sizeof names / sizeof names[0]; i++) {
    join(path, run, names[i]);
    if (lm_is_same_file(path, spec_name)) {
      return say(note, LM_EXIT_BAD_INPUT,
                 "%s: found the spec under the name of a result, expected another folder", path);
    }
    if (!begun && lm_exists(path)) {
      return say(note, LM_EXIT_BAD_INPUT,
                 "%s: found a file that no search in this folder wrote, expected another folder",
                 path);
    }
  }
  return LM_EXIT_DONE;
}

static int open_journal(lm_run *run, const char *spec, int resume, char note[LM_NOTE_MAX]) {
  char path[PATH_MAX_CHARACTERS];
  lm_journal_report report;
  lm_status status;
  int made;
  join(path, run, "journal.bin");
  errno = 0;
  if (!resume) {
    made = lm_make_folder(run->folder);
    if ((!made && errno != EEXIST) || lm_create_journal(path, spec, &run->journal) != LM_OK) {
      if (errno == EEXIST) {
        return say(note, LM_EXIT_BAD_INPUT,
                   "%s: found an existing search, expected --resume to continue it, or "
                   "another folder",
                   path);
      }
      (void)say(note, 0, "%s: found %s, expected a folder to write to", run->folder,
                strerror(errno));
      if (made) {
        (void)lm_remove_folder(run->folder);
      }
      return LM_EXIT_BAD_INPUT;
    }
    return LM_EXIT_DONE;
  }
  status = lm_resume_journal(path, spec, take_old, run, &run->journal, &report);
  if (status == LM_INCONSISTENT) {
    return say(note, LM_EXIT_BAD_INPUT,
               "%s: found the journal of another spec, expected the spec that started it; "
               "start_from in [search] starts a new search from its designs, in another folder",
               path);
  }
  if (status == LM_OUT_OF_RANGE) {
    return say(note, LM_EXIT_BAD_INPUT,
               "%s: found an answer that no task of this search has (number %d), expected the "
               "journal that this search wrote",
               path, report.answers + 1);
  }
  if (status != LM_OK && errno == EBUSY) {
    return say(note, LM_EXIT_BAD_INPUT,
               "%s: found a running search, expected a finished search, or another folder", path);
  }
  if (status != LM_OK) {
    return say(note, LM_EXIT_BAD_INPUT, "%s: found %s, expected the journal of a search", path,
               errno != 0 ? strerror(errno) : "no journal of this build of the program");
  }
  if (report.behind > 0) {
    return say(
        note, LM_EXIT_DONE,
        "%s: damaged after %d answers; %d complete ones after the damage, and the tasks that "
        "follow, are repeated; the damaged file is kept with %s appended to its name",
        path, report.answers, report.behind, LM_JOURNAL_DAMAGED);
  }
  if (report.torn) {
    return say(note, LM_EXIT_DONE,
               "%s: incomplete after %d answers; the tasks that follow are repeated", path,
               report.answers);
  }
  return LM_EXIT_DONE;
}

int lm_open_run(const char *spec_name, const char *spec, const char *folder, int resume,
                lm_run **run, char note[LM_NOTE_MAX]) {
  lm_run *r = (lm_run *)calloc(1, sizeof *r);
  lm_spec_error error;
  int status = LM_EXIT_DONE;
  *run = NULL;
  note[0] = '\0';
  if (r == NULL) {
    return say(note, LM_EXIT_FAILED, "not enough memory");
  }
  if (strlen(folder) >= sizeof r->folder) {
    status = say(note, LM_EXIT_BAD_INPUT, "found a path of %zu characters, expected less than %zu",
                 strlen(folder), sizeof r->folder);
  } else if (lm_read_spec(spec, &r->problem, &error) != LM_OK) {
    status = say(note, LM_EXIT_BAD_INPUT, "%s: line %d: %s", spec_name, error.line, error.text);
  } else {
    strcpy(r->folder, folder);
    r->search = lm_open_search(&r->problem);
    r->history = lm_open_scratch();
    if (r->search == NULL) {
      status = say(note, LM_EXIT_FAILED, "not enough memory");
    } else if (r->history == NULL) {
      status = say(note, LM_EXIT_FAILED, "no temporary file: %s", strerror(errno));
    } else {
      fprintf(r->history, "tasks,evaluations,best,front\n");
      status = check_results(r, spec_name, resume, note);
      if (status == LM_EXIT_DONE) {
        status = open_journal(r, spec, resume, note);
      }
    }
  }
  if (status != LM_EXIT_DONE) {
    lm_close_run(r);
    return status;
  }
  *run = r;
  return LM_EXIT_DONE;
}

void lm_close_run(lm_run *run) {
  if (run != NULL) {
    if (run->history != NULL) {
      fclose(run->history);
    }
    free(run->front);
    lm_close_pool(run->pool);
    lm_close_journal(run->journal);
    lm_close_search(run->search);
    free(run);
  }
}

/* --- work ------------------------------------------------------------------------------------- */

static void call_hook(lm_run *run, int last) {
  const double now = lm_seconds_now();
  if (run->hook != NULL && (last || now - run->hooked >= HOOK_SECONDS)) {
    run->hooked = now;
    run->hook(run->context);
  }
}

static void take_new(void *context, const lm_answer *answer) {
  lm_run *run = (lm_run *)context;
  if (lm_take_answer(run, answer) != LM_OK) {
    lm_stop(run->stop);
    return;
  }
  call_hook(run, 0);
}

static int skip(void *context, int id) {
  return lm_is_answered(((lm_run *)context)->search, id);
}

int lm_work_run(lm_run *run, int workers, lm_run_hook hook, void *context, volatile int *stop,
                char note[LM_NOTE_MAX]) {
  const lm_task *tasks;
  lm_status status;
  int count;
  note[0] = '\0';
  lm_close_pool(run->pool);
  run->pool = lm_open_pool(workers);
  status = run->pool == NULL ? LM_TOO_SMALL : LM_OK;
  run->hook = hook;
  run->context = context;
  run->stop = stop;
  while (status == LM_OK && (count = lm_next_tasks(run->search, &tasks)) > 0) {
    status = lm_run_tasks(run->pool, &run->problem, tasks, count, skip, take_new, run, stop);
  }
  call_hook(run, 1);
  if (run->failed) {
    return say(note, LM_EXIT_FAILED, "%s: the journal cannot be written: %s", run->folder,
               strerror(run->failed));
  }
  if (lm_is_stopped(stop)) {
    return LM_EXIT_STOPPED;
  }
  return status == LM_OK ? LM_EXIT_DONE
                         : say(note, LM_EXIT_FAILED, "%s", lm_status_sentence(status));
}

/* --- results ---------------------------------------------------------------------------------- */

/* The functions below return 1 when a file could not be written. */

static int write_best(lm_run *run, const lm_solution *best, int finished, lm_workspace *workspace,
                      char note[LM_NOTE_MAX]) {
  lm_certificate *certificate = (lm_certificate *)malloc(sizeof *certificate);
  int failed = 1;
  FILE *file;
  if (certificate != NULL && lm_certify(&run->problem, best->combination, best->unit, certificate,
                                        workspace, NULL) == LM_OK) {
    file = begin_file(run, "best.toml");
    failed = file == NULL;
    if (file != NULL) {
      lm_write_drive(file, &certificate->drive, "best of the search");
      failed |= !end_file(run, "best.toml", file, 1);
    }
    file = begin_file(run, "certificate.json");
    failed |= file == NULL;
    if (file != NULL) {
      lm_write_certificate(file, &run->problem, best->combination, certificate);
      failed |= !end_file(run, "certificate.json", file, 1);
    }
    if (!certificate->holds && finished) {
      (void)say(note, 0, "the best design does not hold on the fine check; see certificate.json");
    }
  }
  free(certificate);
  return failed;
}

/* Four digits, rounded up: a limit that is relaxed by the reported amount holds. */
static double round_up(double value) {
  const double unit = pow(10, floor(log10(value)) - 3);
  return ceil(value / unit - 1e-9) * unit;
}

/* Limits that a spec states, or the others. */
static void say_relaxed(char note[LM_NOTE_MAX], const double relax[], double module_mm,
                        int set_by_spec, const char *begin) {
  char text[LM_DECIMAL_MAX];
  int limits = 0;
  int i;
  for (i = 0; i < LM_LIMIT_COUNT; i++) {
    if (relax[i] > LM_RESERVE && lm_is_set_by_spec(i) == set_by_spec) {
      const size_t length = strlen(note);
      const char *unit;
      const double by = lm_stated_relaxation(i, relax[i], module_mm, &unit);
      snprintf(note + length, LM_NOTE_MAX - length, "%s %s by %s", limits > 0 ? "," : begin,
               lm_limit_name(i), lm_write_decimal(text, round_up(by), 4));
      limits++;
    }
  }
}

/* Report why there is no design, and the nearest point. Return 1 if a file cannot be written.
 */
static int explain(lm_run *run, lm_workspace *workspace, char note[LM_NOTE_MAX]) {
  lm_solution nearest;
  double relax[LM_LIMIT_COUNT];
  double value[LM_KEY_COUNT];
  size_t length;
  lm_status status = LM_OUT_OF_RANGE;
  lm_measured measured;
  FILE *file;
  memset(&nearest, 0, sizeof nearest);
  if (lm_read_nearest(run->search, &nearest.combination, nearest.unit, &nearest.violation)) {
    status = lm_explain_infeasible(&run->problem, nearest.combination, nearest.unit, 4000, relax,
                                   workspace, NULL);
  }
  if (status == LM_TOO_SMALL) {
    return say(note, 0, "not enough memory to explain why no design is feasible");
  }
  if (status != LM_OK) {
    (void)say(note, 0,
              "no design exists in these ranges: every combination is pruned or refused; see "
              "combinations.csv");
    return 0;
  }
  lm_point_values(&run->problem, nearest.combination, nearest.unit, value);
  (void)say(note, 0, "no feasible design");
  say_relaxed(note, relax, value[LM_KEY_MODULE_MM], 1, "; relax");
  say_relaxed(note, relax, value[LM_KEY_MODULE_MM], 0, "; beyond what the ranges allow:");
  length = strlen(note);
  snprintf(note + length, LM_NOTE_MAX - length,
           "; units in infeasible.json, the design in nearest.csv");
  file = begin_file(run, "infeasible.json");
  if (file == NULL) {
    return 1;
  }
  lm_write_relaxation(file, relax, value[LM_KEY_MODULE_MM]);
  if (!end_file(run, "infeasible.json", file, 1)) {
    return 1;
  }
  file = begin_file(run, "nearest.csv");
  if (file == NULL) {
    return 1;
  }
  measured.design = nearest;
  lm_measure_design(&run->problem, &measured, workspace);
  lm_write_designs(file, &run->problem, &measured, 1);
  return !end_file(run, "nearest.csv", file, 1);
}

/* The history is collected in a temporary file and appears complete. */
static int write_history(lm_run *run) {
  FILE *file = begin_file(run, "history.csv");
  const int whole = !(fflush(run->history) | ferror(run->history)); /* the disk may be full */
  int c;
  if (file == NULL) {
    return 1;
  }
  rewind(run->history);
  while ((c = getc(run->history)) != EOF) {
    putc(c, file);
  }
  return !end_file(run, "history.csv", file, whole);
}

/* 0: not enough memory. */
static int measure_front(lm_run *run) {
  const int count = lm_read_front(run->search, NULL, 0);
  lm_solution *front = (lm_solution *)malloc((size_t)(count + 1) * sizeof *front);
  lm_measured *measured = (lm_measured *)malloc((size_t)(count + 1) * sizeof *measured);
  int enough;
  int i;
  run->pool = run->pool != NULL ? run->pool : lm_open_pool(0);
  enough = front != NULL && measured != NULL && run->pool != NULL;
  if (enough) {
    (void)lm_read_front(run->search, front, count);
    for (i = 0; i < count; i++) {
      measured[i].design = front[i];
    }
    lm_measure_designs(run->pool, &run->problem, measured, count);
    free(run->front);
    run->front = measured;
    run->front_count = count;
  } else {
    free(measured);
  }
  free(front);
  return enough;
}

const lm_measured *lm_run_front(const lm_run *run, int *count) {
  *count = run->front_count;
  return run->front;
}

int lm_finish_run(lm_run *run, int status, char note[LM_NOTE_MAX]) {
  lm_workspace *workspace = lm_create_workspace();
  int failed;
  lm_solution best;
  FILE *file;
  note[0] = '\0';
  if (status == LM_EXIT_FAILED) { /* no result yet; the journal keeps the designs */
    lm_free_workspace(workspace);
    return status;
  }
  if (workspace == NULL || !measure_front(run)) {
    lm_free_workspace(workspace);
    return say(note, LM_EXIT_FAILED, "not enough memory");
  }
  errno = 0;
  file = begin_file(run, "combinations.csv");
  failed = file == NULL;
  if (file != NULL) {
    lm_write_combinations(file, &run->problem, run->search);
    failed |= !end_file(run, "combinations.csv", file, 1);
  }
  file = begin_file(run, "front.csv");
  failed |= file == NULL;
  if (file != NULL) {
    lm_write_designs(file, &run->problem, run->front, run->front_count);
    failed |= !end_file(run, "front.csv", file, 1);
  }
  failed |= write_history(run);
  if (lm_read_best(run->search, &best)) {
    failed |= write_best(run, &best, status == LM_EXIT_DONE, workspace, note);
  } else if (status == LM_EXIT_DONE) {
    failed |= explain(run, workspace, note);
    status = LM_EXIT_FAILED;
  }
  lm_free_workspace(workspace);
  if (failed) {
    (void)say(note, 0, "%s: results cannot be written: %s", run->folder, strerror(errno));
    status = status != LM_EXIT_DONE ? status : LM_EXIT_FAILED;
  }
  return status;
}
