/* A search in a folder: journal, history and results.
 *
 *   status = lm_open_run("spec", text, "RUN", 0, &run, note);
 *   status = lm_work_run(run, 2, NULL, NULL, &stop, note);      0 done, 1 failed, 130 stopped
 *   status = lm_finish_run(run, status, note);                  writes the results
 *   lm_close_run(run);
 *
 * Instead of lm_work_run, the tasks of lm_run_search() may be run anywhere else and their answers
 * passed to lm_take_answer. Files of the folder: best.toml, front.csv, combinations.csv,
 * certificate.json (or infeasible.json and nearest.csv), history.csv, journal.bin. All except the
 * journal appear complete or not at all, and have the same bytes however the work was divided or
 * interrupted.
 *
 * Exit statuses are those of the commands: 0 done; 1 the work failed; 2 bad input; 130 stopped.
 * note[] receives one line without a line end, or nothing.
 */
#ifndef LOSTMOTION_OPTIMIZER_RUN_H
#define LOSTMOTION_OPTIMIZER_RUN_H

#include "output.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LM_NOTE_MAX 1024

/* Files that the search and the Python package write into the folder besides the journal. */
#define LM_RESULT_NAMES                                                      \
  {"best.toml",       "front.csv",   "combinations.csv", "certificate.json", \
   "infeasible.json", "nearest.csv", "history.csv",      "report.html"}

#define LM_EXIT_DONE 0
#define LM_EXIT_FAILED 1
#define LM_EXIT_BAD_INPUT 2
#define LM_EXIT_STOPPED 130

typedef struct lm_run lm_run;

/* Begin a search in a folder, which is created, or continue the one in it. The spec is a text of
 * spec.h; its name is for messages, and if it is that of a file, no result replaces this file. No
 * result replaces a file that existed before the search. On anything but 0 nothing was written and
 * *run is null. With 0 the note may state that the end of the journal was incomplete, or that it
 * was damaged. */
int lm_open_run(const char *spec_name, const char *spec, const char *folder, int resume,
                lm_run **run, char note[LM_NOTE_MAX]);

const lm_problem *lm_run_problem(const lm_run *run);
lm_search *lm_run_search(lm_run *run);

/* Write an answer to the journal and the history and pass it to the search. LM_CORRUPT: the journal
 * cannot be written (errno); others as lm_accept_answer. */
lm_status lm_take_answer(lm_run *run, const lm_answer *answer);

/* Called about five times a second and once at the end, while no answer is being taken. */
typedef void (*lm_run_hook)(void *context);

/* Run all tasks with the threads of this machine (workers 0: as many as it has cores). hook and
 * context may be null. *stop ends the work soon after it is set; the run itself sets it when the
 * journal cannot be written. */
int lm_work_run(lm_run *run, int workers, lm_run_hook hook, void *context, volatile int *stop,
                char note[LM_NOTE_MAX]);

/* Write the results. Takes the exit status of the work and returns that of the search: 1, with the
 * limits to relax, if the work succeeded without a feasible design. */
int lm_finish_run(lm_run *run, int status, char note[LM_NOTE_MAX]);

/* The front with figures and margins, after lm_finish_run; null, and no design, before it. */
const lm_measured *lm_run_front(const lm_run *run, int *count);

void lm_close_run(lm_run *run);

#ifdef __cplusplus
}
#endif

#endif
