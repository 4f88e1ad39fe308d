/* The answers of a search on disk, so that it can be killed at any moment and continue.
 *
 * One file: a header with the text of the spec, then one record per answer. A record is written
 * completely and passed to the system before the search uses its answer, and flushed to the disk
 * within a second of work: a killed search loses nothing, and after a power failure the tasks of
 * the last second are repeated. An incomplete record at the end is dropped and its task repeated. A
 * damaged record with complete ones after it (a bad disk) ends the journal as well, because the
 * following tasks were planned from its answer; the file is first copied to its name with
 * LM_JOURNAL_DAMAGED appended. Repeated tasks give the same answers. The byte layout is that of
 * this machine: a journal can be read only by the build that wrote it.
 *
 * One process owns a journal from opening to closing it, or until the process ends in any way. It
 * must not open it a second time meanwhile: POSIX refuses the lock only to other processes, and the
 * first closing releases it. A file system without locks gives no protection.
 */
#ifndef LOSTMOTION_OPTIMIZER_JOURNAL_H
#define LOSTMOTION_OPTIMIZER_JOURNAL_H

#include "run_task.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct lm_journal lm_journal;

#define LM_JOURNAL_DAMAGED ".damaged"

/* Begin a journal if there is no file. LM_NULL; LM_CORRUPT (there is a file: errno EEXIST; cannot
 * be written: errno) and LM_TOO_SMALL leave no file. */
lm_status lm_create_journal(const char *path, const char *spec, lm_journal **journal);

typedef struct lm_journal_report {
  int answers; /* read */
  int torn;    /* 1: the end of the file was an incomplete record and was cut off */
  int behind;  /* complete records that were cut off with it: the file was damaged in the middle */
} lm_journal_report;

/* Takes an answer of a journal; LM_OK: continue. */
typedef lm_status (*lm_journal_sink)(void *context, const lm_answer *answer);

/* Continue a journal: every answer is passed to the sink in the order of the file; then the journal
 * is open for further answers. LM_NULL; LM_CORRUPT: no such file (errno), another process has it
 * (errno EBUSY), not a journal, written by another build, or damaged and impossible to copy
 * (errno); LM_INCONSISTENT: of another spec; LM_OUT_OF_RANGE: the sink refused the answer number
 * report->answers + 1. Then the file is unchanged. */
lm_status lm_resume_journal(const char *path, const char *spec, lm_journal_sink sink, void *context,
                            lm_journal **journal, lm_journal_report *report);

/* Add an answer. LM_NULL, LM_CORRUPT (errno: disk full and so on; the next resume cuts off the
 * incomplete record). */
lm_status lm_append_answer(lm_journal *journal, const lm_answer *answer);

void lm_close_journal(lm_journal *journal);

#ifdef __cplusplus
}
#endif

#endif
