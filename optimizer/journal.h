/* The answers of a search on disk, so that it can be killed at any moment and continue.
 *
 * One file: a header with the spec's text, then one record an answer. A record is written whole
 * and handed to the system before the search builds on it, and brought to the disk within a second
 * of work: a killed search has lost nothing, and after a power cut the tasks of the last second are
 * done again. A torn record at the end is dropped and its task done again. A damaged record with
 * whole ones behind it (a bad disk) ends the journal as well, since what follows was planned on its
 * answer; the file is first kept as it was, beside the journal, with LM_JOURNAL_DAMAGED behind its
 * name. Tasks done again give the same answers. Bytes of this machine's layout: a journal is for
 * the build that wrote it.
 *
 * One process has a journal from its opening to its closing, or to its own end, however that comes.
 * It must not open it once more meanwhile: POSIX refuses the lock to other processes only, and the
 * first closing ends it. A file system without locks has none.
 */
#ifndef LOSTMOTION_OPTIMIZER_JOURNAL_H
#define LOSTMOTION_OPTIMIZER_JOURNAL_H

#include "run_task.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct lm_journal lm_journal;

#define LM_JOURNAL_DAMAGED ".damaged"

/* Begin a journal where no file is. LM_NULL; LM_CORRUPT (there is one: errno EEXIST; cannot be
 * written: errno) and LM_TOO_SMALL leave none of their own. */
lm_status lm_create_journal(const char *path, const char *spec, lm_journal **journal);

typedef struct lm_journal_report {
  int answers; /* read */
  int torn;    /* 1: the end of the file was no whole record and has been cut off */
  int behind;  /* whole records that were cut off with it: the file was damaged in its midst */
} lm_journal_report;

/* Takes an answer of a journal; LM_OK: continue. */
typedef lm_status (*lm_journal_sink)(void *context, const lm_answer *answer);

/* Go on with a journal: every answer goes to the sink in the order of the file, then the journal
 * stands open for more. LM_NULL; LM_CORRUPT: no such file (errno), another process has it (errno
 * EBUSY), no journal, of another build, or damaged and not to be kept (errno); LM_INCONSISTENT: of
 * another spec; LM_OUT_OF_RANGE: the sink refused the answer number report->answers + 1. Then the
 * file stays as it was. */
lm_status lm_resume_journal(const char *path, const char *spec, lm_journal_sink sink, void *context,
                            lm_journal **journal, lm_journal_report *report);

/* Add an answer. LM_NULL, LM_CORRUPT (errno: disk full and so on; what was
 * written of it is cut off by the next resume). */
lm_status lm_append_answer(lm_journal *journal, const lm_answer *answer);

void lm_close_journal(lm_journal *journal);

#ifdef __cplusplus
}
#endif

#endif
