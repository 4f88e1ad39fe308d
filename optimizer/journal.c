#include "journal.h"

#include <errno.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "lostmotion/parameters.h"
#include "platform.h"
#include "spec.h"

/* The number is incremented if the layout changes, if the search plans other tasks for the same
 * answers, or if the same design gets other figures. */
#define MAGIC "lostmotion journal 9\n"
#define RECORD UINT32_C(0x4c4d414e)

struct lm_journal {
  FILE *file;
  time_t synced; /* second of the last flush to the disk */
};

typedef struct header {
  char magic[24];
  uint64_t spec_hash;
  uint32_t spec_length;
  uint32_t answer_size; /* layout of this build */
} header;

typedef struct record_head {
  uint32_t mark;
  uint32_t length;
  uint32_t crc; /* of the bytes that follow */
} record_head;

static void fill_header(header *h, const char *spec) {
  memset(h, 0, sizeof *h);
  memcpy(h->magic, MAGIC, sizeof MAGIC);
  h->spec_hash = lm_hash_text(spec);
  h->spec_length = (uint32_t)strlen(spec);
  h->answer_size = (uint32_t)sizeof(lm_answer);
}

/* To the system, which keeps it if the program is killed; to the disk once a second, because all
 * threads wait for a disk that takes milliseconds. Work that is lost in a power failure is
 * repeated. */
static lm_status keep(lm_journal *journal) {
  const time_t now = time(NULL);
  if (now == journal->synced) {
    return fflush(journal->file) == 0 ? LM_OK : LM_CORRUPT;
  }
  journal->synced = now;
  return lm_sync_file(journal->file) ? LM_OK : LM_CORRUPT;
}

static lm_status wrap(FILE *file, lm_journal **journal) {
  *journal = (lm_journal *)malloc(sizeof **journal);
  if (*journal == NULL) {
    fclose(file);
    return LM_TOO_SMALL;
  }
  (*journal)->file = file;
  (*journal)->synced = 0;
  return LM_OK;
}

lm_status lm_create_journal(const char *path, const char *spec, lm_journal **journal) {
  header h;
  lm_status status = LM_CORRUPT;
  FILE *file;
  if (path == NULL || spec == NULL || journal == NULL) {
    return LM_NULL;
  }
  file = lm_open_file(path, LM_FILE_CREATE); /* only one of two simultaneous starts gets it */
  if (file == NULL) {
    return LM_CORRUPT;
  }
  fill_header(&h, spec);
  if (lm_lock_file(file) && fwrite(&h, sizeof h, 1, file) == 1 &&
      fwrite(spec, 1, h.spec_length, file) == h.spec_length && lm_sync_file(file)) {
    status = wrap(file, journal);
  } else {
    fclose(file);
  }
  if (status != LM_OK) {
    const int why = errno;
    (void)lm_remove_file(path); /* a part of a header would look like a started search */
    errno = why;
  }
  return status;
}

/* Unused entries of solution[] are not stored. */
static size_t answer_length(const lm_answer *answer) {
  return offsetof(lm_answer, solution) +
         (size_t)(answer->solution_count + answer->member_count) * sizeof answer->solution[0];
}

/* The next complete record; 0 at the end or at an incomplete one. */
static int read_record(FILE *file, lm_answer *answer) {
  record_head head;
  memset(answer, 0, sizeof *answer);
  return fread(&head, sizeof head, 1, file) == 1 && head.mark == RECORD &&
         head.length >= offsetof(lm_answer, solution) && head.length <= sizeof *answer &&
         fread(answer, 1, head.length, file) == head.length &&
         lm_find_crc(0, answer, head.length) == head.crc && answer->solution_count >= 0 &&
         answer->solution_count <= LM_SOLUTION_MAX && answer->member_count >= 0 &&
         answer->member_count <= LM_PARENT_MAX && answer_length(answer) == head.length;
}

/* Read the header; the file position is then after it. */
static lm_status check_header(FILE *file, const char *spec) {
  header found;
  header wanted;
  fill_header(&wanted, spec);
  if (fread(&found, sizeof found, 1, file) != 1 ||
      memcmp(found.magic, wanted.magic, sizeof wanted.magic) != 0 ||
      found.answer_size != wanted.answer_size) {
    return LM_CORRUPT;
  }
  if (found.spec_hash != wanted.spec_hash || found.spec_length != wanted.spec_length) {
    return LM_INCONSISTENT;
  }
  return fseek(file, (long)found.spec_length, SEEK_CUR) == 0 ? LM_OK : LM_CORRUPT;
}

/* Number of complete records after a position without a record. */
static int count_behind(FILE *file, long from, lm_answer *answer) {
  uint32_t window = 0;
  int count = 0;
  int byte;
  (void)fseek(file, from, SEEK_SET);
  while ((byte = fgetc(file)) != EOF) {
    /* The mark in the byte order of this machine; its bytes differ from each other. */
    memmove(&window, (char *)&window + 1, sizeof window - 1);
    ((unsigned char *)&window)[sizeof window - 1] = (unsigned char)byte;
    if (window == RECORD) {
      const long behind = ftell(file);
      (void)fseek(file, behind - (long)sizeof window, SEEK_SET);
      if (read_record(file, answer)) {
        count++;
      } else {
        (void)fseek(file, behind, SEEK_SET);
      }
      window = 0;
    }
  }
  return count;
}

/* Copy the file unchanged to its name with DAMAGED appended. */
static lm_status set_aside(FILE *file, const char *path) {
  const size_t length = strlen(path);
  char *name = (char *)malloc(length + sizeof LM_JOURNAL_DAMAGED);
  lm_status status = LM_CORRUPT;
  FILE *copy = NULL;
  if (name != NULL) {
    memcpy(name, path, length);
    memcpy(name + length, LM_JOURNAL_DAMAGED, sizeof LM_JOURNAL_DAMAGED);
    copy = lm_open_file(name, LM_FILE_REPLACE);
  }
  if (copy != NULL) {
    int byte;
    rewind(file);
    while ((byte = fgetc(file)) != EOF && fputc(byte, copy) != EOF) {
    }
    status = byte == EOF && lm_sync_file(copy) ? LM_OK : LM_CORRUPT;
    status = fclose(copy) == 0 ? status : LM_CORRUPT;
  }
  free(name);
  return status;
}

lm_status lm_resume_journal(const char *path, const char *spec, lm_journal_sink sink, void *context,
                            lm_journal **journal, lm_journal_report *report) {
  lm_answer *answer;
  lm_status status;
  FILE *file;
  long whole;
  long end;
  if (path == NULL || spec == NULL || sink == NULL || journal == NULL || report == NULL) {
    return LM_NULL;
  }
  memset(report, 0, sizeof *report);
  file = lm_open_file(path, LM_FILE_UPDATE);
  if (file == NULL) {
    return LM_CORRUPT;
  }
  if (!lm_is_regular(file)) { /* opening a pipe would block */
    fclose(file);
    errno = 0;
    return LM_CORRUPT;
  }
  if (!lm_lock_file(file)) {
    fclose(file);
    errno = EBUSY;
    return LM_CORRUPT;
  }
  answer = (lm_answer *)malloc(sizeof *answer);
  status = answer == NULL ? LM_TOO_SMALL : check_header(file, spec);
  if (status == LM_OK) {
    whole = ftell(file);
    while (status == LM_OK && read_record(file, answer)) {
      status = sink(context, answer) == LM_OK ? LM_OK : LM_OUT_OF_RANGE;
      report->answers += status == LM_OK;
      whole = ftell(file);
    }
    if (status == LM_OK) {
      status = fseek(file, 0, SEEK_END) == 0 ? LM_OK : LM_CORRUPT;
      end = ftell(file);
      report->torn = end != whole;
    }
    if (report->torn) {
      report->behind = count_behind(file, whole, answer);
      status = report->behind > 0 ? set_aside(file, path) : LM_OK;
    }
    if (status == LM_OK) {
      status = lm_cut_file(file, whole) ? LM_OK : LM_CORRUPT;
    }
  }
  free(answer);
  if (status != LM_OK) {
    fclose(file);
    return status;
  }
  return wrap(file, journal);
}

lm_status lm_append_answer(lm_journal *journal, const lm_answer *answer) {
  record_head head;
  if (journal == NULL || answer == NULL) {
    return LM_NULL;
  }
  head.mark = RECORD;
  head.length = (uint32_t)answer_length(answer);
  head.crc = lm_find_crc(0, answer, head.length);
  if (fwrite(&head, sizeof head, 1, journal->file) != 1 ||
      fwrite(answer, 1, head.length, journal->file) != head.length) {
    return LM_CORRUPT;
  }
  return keep(journal);
}

void lm_close_journal(lm_journal *journal) {
  if (journal != NULL) {
    fclose(journal->file);
    free(journal);
  }
}
