/* lostmotion-optimizer SPEC RUN [--resume] [--workers N] [--progress json|bar|none]
 *
 * Searches by a spec (spec.h) and writes into the folder RUN: best.toml, front.csv,
 * combinations.csv, certificate.json (or infeasible.json), history.csv, journal.bin.
 * Exit status: 0 done; 1 nothing feasible, or the work failed; 2 bad input or usage; 130
 * interrupted, with the best so far written.
 */
#define _POSIX_C_SOURCE 200809L
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "journal.h"
#include "output.h"
#include "pool.h"
#include "spec.h"

#define PATH_MAX_CHARACTERS 4096

typedef enum show { SHOW_BAR, SHOW_JSON, SHOW_NONE } show;

typedef struct program {
  const char *spec_path;
  const char *run;
  int resume;
  int workers;
  show progress;
  lm_problem problem;
  lm_search *search;
  lm_journal *journal;
  FILE *history;
  int written; /* tasks of the last row of the history */
  int failed;  /* the journal could not be written */
  double started;
  double shown;
} program;

static volatile int interrupted;

static void interrupt(int signal_number) {
  (void)signal_number;
  interrupted = 1;
}

static double seconds_now(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int usage(const char *what) {
  fprintf(stderr,
          "lostmotion-optimizer: %s\nusage: lostmotion-optimizer SPEC RUN [--resume] [--workers N] "
          "[--progress json|bar|none]\n",
          what);
  return 2;
}

static int read_arguments(int count, char **argument, program *p) {
  int i;
  p->progress = isatty(2) ? SHOW_BAR : SHOW_NONE;
  for (i = 1; i < count; i++) {
    const char *next = i + 1 < count ? argument[i + 1] : "";
    if (strcmp(argument[i], "--resume") == 0) {
      p->resume = 1;
    } else if (strcmp(argument[i], "--workers") == 0) {
      char *end;
      p->workers = (int)strtol(next, &end, 10);
      if (*next == '\0' || *end != '\0' || p->workers < 1 || p->workers > LM_WORKERS_MAX) {
        return usage("--workers needs a number from 1 to 256");
      }
      i++;
    } else if (strcmp(argument[i], "--progress") == 0) {
      if (strcmp(next, "json") != 0 && strcmp(next, "bar") != 0 && strcmp(next, "none") != 0) {
        return usage("--progress needs json, bar or none");
      }
      p->progress = next[0] == 'j' ? SHOW_JSON : next[0] == 'b' ? SHOW_BAR : SHOW_NONE;
      i++;
    } else if (argument[i][0] == '-') {
      return usage("unknown option");
    } else if (p->spec_path == NULL) {
      p->spec_path = argument[i];
    } else if (p->run == NULL) {
      p->run = argument[i];
    } else {
      return usage("too many arguments");
    }
  }
  return p->run == NULL ? usage("a spec and a folder are needed") : 0;
}

/* The whole file as text, to be freed; null: errno. */
static char *read_text(const char *path) {
  FILE *file = fopen(path, "rb");
  char *text = NULL;
  size_t length = 0;
  if (file == NULL) {
    return NULL;
  }
  for (;;) {
    char *longer = (char *)realloc(text, length + 65536 + 1);
    size_t got;
    if (longer == NULL) {
      free(text);
      text = NULL;
      break;
    }
    text = longer;
    got = fread(text + length, 1, 65536, file);
    length += got;
    text[length] = '\0';
    if (got == 0) {
      break;
    }
  }
  fclose(file);
  return text;
}

static void join(char path[PATH_MAX_CHARACTERS], const program *p, const char *name) {
  snprintf(path, PATH_MAX_CHARACTERS, "%s/%s", p->run, name);
}

/* Files appear whole: written beside and renamed. */
static FILE *begin_file(const program *p, const char *name) {
  char path[PATH_MAX_CHARACTERS];
  char part[80];
  snprintf(part, sizeof part, "%s.part", name);
  join(path, p, part);
  return fopen(path, "w");
}

static int end_file(const program *p, const char *name, FILE *file) {
  char path[PATH_MAX_CHARACTERS];
  char from[PATH_MAX_CHARACTERS];
  char part[80];
  const int failed = ferror(file);
  snprintf(part, sizeof part, "%s.part", name);
  join(from, p, part);
  join(path, p, name);
  return fclose(file) == 0 && !failed && rename(from, path) == 0;
}

/* --- progress -----------------------------------------------------------------------------------
 */

static double seconds_left(const lm_progress *progress, double seconds) {
  if (progress->evaluations < progress->budget / 50) {
    return -1;
  }
  if (progress->evaluations >= progress->budget) {
    return 0;
  }
  return seconds * (progress->budget - progress->evaluations) / progress->evaluations;
}

static void show_progress(program *p, int last) {
  const double now = seconds_now();
  lm_progress progress;
  if (!last && now - p->shown < 0.2) {
    return;
  }
  p->shown = now;
  lm_read_progress(p->search, &progress);
  if (p->progress == SHOW_JSON) {
    lm_write_progress(stdout, &progress, now - p->started,
                      seconds_left(&progress, now - p->started));
    fflush(stdout);
  } else if (p->progress == SHOW_BAR) {
    const int done =
        progress.budget > 0 ? 20 * (progress.evaluations / 20) / (progress.budget / 20 + 1) : 0;
    fprintf(stderr, "\r[%-20.*s] %d of %d", done < 20 ? done : 20, "####################",
            progress.evaluations, progress.budget);
    if (progress.has_best) {
      fprintf(stderr, "  best %.5g", progress.best_value);
    }
    fprintf(stderr, "  feasible %.0f %%  %.0f s left   ", 100 * progress.feasible_share,
            seconds_left(&progress, now - p->started));
    fprintf(stderr, last ? "\n" : "");
    fflush(stderr);
  }
}

/* --- the search ---------------------------------------------------------------------------------
 */

static void take(program *p, const lm_answer *answer) {
  lm_progress progress;
  (void)lm_accept_answer(p->search, answer);
  lm_read_progress(p->search, &progress);
  /* One row a batch: within it the order of the answers is a matter of time. */
  if (p->history != NULL && progress.tasks_done != p->written) {
    p->written = progress.tasks_done;
    fprintf(p->history, "%d,%d,%s%.17g,%d\n", progress.tasks_done, progress.evaluations,
            progress.has_best ? "" : "nan", progress.has_best ? progress.best_value : 0.0,
            progress.front_size);
  }
}

static void take_new(void *context, const lm_answer *answer) {
  program *p = (program *)context;
  if (lm_append_answer(p->journal, answer) != LM_OK) {
    p->failed = 1;
    interrupted = 1;
    return;
  }
  take(p, answer);
  show_progress(p, 0);
}

static void take_old(void *context, const lm_answer *answer) {
  take((program *)context, answer);
}

static int skip(void *context, int id) {
  return lm_is_answered(((program *)context)->search, id);
}

static int open_journal(program *p, const char *spec) {
  char path[PATH_MAX_CHARACTERS];
  lm_journal_report report;
  lm_status status;
  join(path, p, "journal.bin");
  if (!p->resume) {
    if (access(path, F_OK) == 0) {
      fprintf(stderr,
              "lostmotion-optimizer: %s: a search is already here; --resume goes on with it\n",
              path);
      return 2;
    }
    if (lm_create_journal(path, spec, &p->journal) != LM_OK) {
      fprintf(stderr, "lostmotion-optimizer: %s: %s\n", path, strerror(errno));
      return 1;
    }
    return 0;
  }
  errno = 0;
  status = lm_resume_journal(path, spec, take_old, p, &p->journal, &report);
  if (status != LM_OK) {
    fprintf(stderr, "lostmotion-optimizer: %s: %s\n", path,
            status == LM_INCONSISTENT ? "the journal is of another spec; found another text than "
                                        "SPEC, expected the same"
            : errno != 0              ? strerror(errno)
                                      : "no journal of this build of the program");
    return 2;
  }
  if (report.torn) {
    fprintf(stderr,
            "lostmotion-optimizer: the journal's last record was torn; its task is done "
            "again\n");
  }
  return 0;
}

/* Returns an exit status. */
static int run_search(program *p) {
  lm_pool *pool = lm_open_pool(p->workers);
  const lm_task *tasks;
  lm_status status = pool == NULL ? LM_TOO_SMALL : LM_OK;
  int count;
  while (status == LM_OK && (count = lm_next_tasks(p->search, &tasks)) > 0) {
    status = lm_run_tasks(pool, &p->problem, tasks, count, skip, take_new, p, &interrupted);
  }
  lm_close_pool(pool);
  show_progress(p, 1);
  if (p->failed) {
    fprintf(stderr, "lostmotion-optimizer: the journal cannot be written: %s\n", strerror(errno));
    return 1;
  }
  if (interrupted) {
    return 130;
  }
  if (status != LM_OK) {
    fprintf(stderr, "lostmotion-optimizer: %s\n", lm_status_sentence(status));
  }
  return status == LM_OK ? 0 : 1;
}

/* --- results ------------------------------------------------------------------------------------
 */

static int write_best(program *p, const lm_found *best, lm_workspace *workspace) {
  lm_certificate *certificate = (lm_certificate *)malloc(sizeof *certificate);
  FILE *file;
  int result = 1;
  if (certificate != NULL && lm_certify(&p->problem, best->combination, best->unit, certificate,
                                        workspace, NULL) == LM_OK) {
    file = begin_file(p, "best.toml");
    if (file != NULL) {
      lm_write_drive(file, &p->problem, &certificate->drive, "best of the search");
      result = !end_file(p, "best.toml", file);
    }
    file = begin_file(p, "certificate.json");
    if (file != NULL) {
      lm_write_certificate(file, &p->problem, best->combination, certificate);
      result |= !end_file(p, "certificate.json", file);
    }
    if (!certificate->holds && best->settled) {
      fprintf(stderr,
              "lostmotion-optimizer: the best design does not hold on the fine check; see "
              "certificate.json\n");
    }
  }
  free(certificate);
  return result;
}

/* Why there is no design. */
static int write_infeasible(program *p, lm_workspace *workspace) {
  double unit[LM_FREE_MAX] = {0};
  double relax[LM_LIMIT_COUNT];
  double violation;
  int combination;
  FILE *file;
  int i;
  if (!lm_read_nearest(p->search, &combination, unit, &violation) ||
      lm_explain_infeasible(&p->problem, combination, unit, 4000, relax, workspace, NULL) !=
          LM_OK) {
    fprintf(stderr,
            "lostmotion-optimizer: no design exists in these ranges: every combination is "
            "pruned or refused; see combinations.csv\n");
    return 1;
  }
  fprintf(stderr, "lostmotion-optimizer: no feasible design; relax");
  for (i = 0; i < LM_LIMIT_COUNT; i++) {
    if (relax[i] > LM_FEASIBLE) {
      fprintf(stderr, " %s by %.4g", lm_limit_name(i), relax[i]);
    }
  }
  fprintf(stderr, "; units in infeasible.json\n");
  file = begin_file(p, "infeasible.json");
  if (file != NULL) {
    lm_write_relaxation(file, relax);
    (void)end_file(p, "infeasible.json", file);
  }
  return 1;
}

static int write_results(program *p, int exit_status) {
  lm_workspace *workspace = lm_create_workspace();
  lm_found best;
  FILE *file;
  int failed = workspace == NULL;
  if (failed) {
    return 1;
  }
  file = begin_file(p, "combinations.csv");
  failed |= file == NULL;
  if (file != NULL) {
    lm_write_combinations(file, &p->problem, p->search);
    failed |= !end_file(p, "combinations.csv", file);
  }
  file = begin_file(p, "front.csv");
  failed |= file == NULL;
  if (file != NULL) {
    lm_write_front(file, &p->problem, p->search, workspace);
    failed |= !end_file(p, "front.csv", file);
  }
  if (lm_read_best(p->search, &best)) {
    failed |= write_best(p, &best, workspace);
  } else if (exit_status == 0) {
    exit_status = write_infeasible(p, workspace);
  }
  lm_free_workspace(workspace);
  if (failed) {
    fprintf(stderr, "lostmotion-optimizer: %s: results cannot be written: %s\n", p->run,
            strerror(errno));
  }
  return exit_status != 0 ? exit_status : failed;
}

int main(int count, char **argument) {
  static program p;
  lm_spec_error error;
  struct sigaction action;
  char *spec;
  int status = read_arguments(count, argument, &p);
  if (status != 0) {
    return status;
  }
  spec = read_text(p.spec_path);
  if (spec == NULL) {
    fprintf(stderr, "lostmotion-optimizer: %s: %s\n", p.spec_path, strerror(errno));
    return 2;
  }
  if (lm_read_spec(spec, &p.problem, &error) != LM_OK) {
    fprintf(stderr, "lostmotion-optimizer: %s: line %d: %s\n", p.spec_path, error.line, error.text);
    free(spec);
    return 2;
  }
  if (mkdir(p.run, 0777) != 0 && errno != EEXIST) {
    fprintf(stderr, "lostmotion-optimizer: %s: %s\n", p.run, strerror(errno));
    free(spec);
    return 2;
  }
  memset(&action, 0, sizeof action);
  action.sa_handler = interrupt;
  sigaction(SIGINT, &action, NULL);
  sigaction(SIGTERM, &action, NULL);
  p.started = seconds_now();
  p.search = lm_open_search(&p.problem);
  p.history = begin_file(&p, "history.csv");
  if (p.history != NULL) {
    fprintf(p.history, "tasks,evaluations,best,front\n");
  }
  status = p.search == NULL ? 1 : open_journal(&p, spec);
  if (status == 0) {
    status = run_search(&p);
    status = write_results(&p, status);
  }
  if (p.history != NULL) {
    (void)end_file(&p, "history.csv", p.history);
  }
  lm_close_journal(p.journal);
  lm_close_search(p.search);
  free(spec);
  return status;
}
