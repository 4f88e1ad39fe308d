/* lostmotion-optimizer SPEC RUN [--resume] [--workers N] [--progress json|bar|none]
 *
 * Searches by a spec (spec.h) and writes into the folder RUN: best.toml, front.csv,
 * combinations.csv, certificate.json (or infeasible.json), history.csv, journal.bin.
 * Exit status: 0 done; 1 nothing feasible, or the work failed; 2 bad input or usage; 130
 * interrupted, with the best so far written.
 */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "output.h"
#include "platform.h"
#include "pool.h"
#include "run.h"

#define SPEC_MAX (1 << 20) /* bytes */

typedef enum show { SHOW_BAR, SHOW_JSON, SHOW_NONE } show;

typedef struct program {
  const char *spec_path;
  const char *folder;
  int resume;
  int workers;
  show progress;
  lm_run *run;
  double started;
} program;

static volatile int interrupted;

static int usage(const char *what) {
  fprintf(stderr,
          "lostmotion-optimizer: %s\nusage: lostmotion-optimizer SPEC RUN [--resume] [--workers N] "
          "[--progress json|bar|none]\n",
          what);
  return 2;
}

static int read_arguments(int count, char **argument, program *p) {
  int i;
  p->progress = lm_is_terminal(stderr) ? SHOW_BAR : SHOW_NONE;
  for (i = 1; i < count; i++) {
    const char *next = i + 1 < count ? argument[i + 1] : "";
    if (strcmp(argument[i], "--resume") == 0) {
      p->resume = 1;
    } else if (strcmp(argument[i], "--workers") == 0) {
      char *end;
      const long workers = strtol(next, &end, 10);
      if (*next == '\0' || *end != '\0' || workers < 1 || workers > LM_WORKERS_MAX) {
        return usage("--workers needs a number from 1 to 256");
      }
      p->workers = (int)workers;
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
    } else if (p->folder == NULL) {
      p->folder = argument[i];
    } else {
      return usage("too many arguments");
    }
  }
  return p->folder == NULL ? usage("a spec and a folder are needed") : 0;
}

/* The complete file as text; null: *why states the reason. */
static const char *read_text(const char *path, const char **why) {
  static char text[SPEC_MAX + 1];
  FILE *file = lm_open_file(path, LM_FILE_READ);
  size_t length;
  int failed;
  if (file == NULL) {
    *why = strerror(errno);
    return NULL;
  }
  length = fread(text, 1, sizeof text, file);
  failed = ferror(file);
  *why = failed ? strerror(errno) : "found more than 1 MiB, expected a spec";
  (void)fclose(file);
  if (failed || length > SPEC_MAX) {
    return NULL;
  }
  text[length] = '\0';
  return text;
}

/* --- progress --------------------------------------------------------------------------------- */

static double seconds_left(const lm_progress *progress, double seconds) {
  if (progress->work_done < progress->work_total / 50) {
    return -1;
  }
  return seconds * (progress->work_total - progress->work_done) / progress->work_done;
}

static void show_bar(const lm_progress *progress, double left) {
  const int done = (int)(20 * progress->work_done / (progress->work_total + 1));
  fprintf(stderr, "\r[%-20.*s] %d of %d", done < 20 ? done : 20, "####################",
          progress->evaluations, progress->budget);
  if (progress->has_best) {
    fprintf(stderr, "  best %.5g", progress->best_value);
  }
  fprintf(stderr, "  feasible %.0f %%", 100 * progress->feasible_share);
  if (left >= 0) {
    fprintf(stderr, "  %.0f s left   ", left);
  }
  fflush(stderr);
}

static void show_progress(void *context) {
  const program *p = (const program *)context;
  const double seconds = lm_seconds_now() - p->started;
  lm_progress progress;
  lm_read_progress(lm_run_search(p->run), &progress);
  if (p->progress == SHOW_JSON) {
    lm_write_progress(stdout, &progress, seconds, seconds_left(&progress, seconds));
    fflush(stdout);
  } else if (p->progress == SHOW_BAR) {
    show_bar(&progress, seconds_left(&progress, seconds));
  }
}

static void tell(const char *note) {
  if (note[0] != '\0') {
    fprintf(stderr, "lostmotion-optimizer: %s\n", note);
  }
}

int main(int count, char **argument) {
  program p;
  char note[LM_NOTE_MAX];
  const char *spec;
  const char *why;
  int status;
  memset(&p, 0, sizeof p);
  argument = lm_take_arguments(&count, argument);
  status = read_arguments(count, argument, &p);
  if (status != LM_EXIT_DONE) {
    return status;
  }
  spec = read_text(p.spec_path, &why);
  if (spec == NULL) {
    fprintf(stderr, "lostmotion-optimizer: %s: %s\n", p.spec_path, why);
    return LM_EXIT_BAD_INPUT;
  }
  lm_watch_interrupts(&interrupted);
  status = lm_open_run(p.spec_path, spec, p.folder, p.resume, &p.run, note);
  tell(note);
  if (status == LM_EXIT_DONE) {
    p.started = lm_seconds_now();
    status = lm_work_run(p.run, p.workers, show_progress, &p, &interrupted, note);
    if (p.progress == SHOW_BAR) {
      fprintf(stderr, "\n");
    }
    tell(note);
    status = lm_finish_run(p.run, status, note);
    tell(note);
  }
  lm_close_run(p.run);
  return status;
}
