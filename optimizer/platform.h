/* Operating system functions for the search, implemented by platform_posix.c and
 * platform_windows.c; all other code is independent of the system.
 *
 * Paths are UTF-8 of any length that the system accepts, with / (on Windows also \) between the
 * parts. Files are opened as bytes: a line ends with \n on every system. Functions that fail set
 * errno.
 */
#ifndef LOSTMOTION_OPTIMIZER_PLATFORM_H
#define LOSTMOTION_OPTIMIZER_PLATFORM_H

#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

/* --- files --- */

typedef enum lm_file_mode {
  LM_FILE_READ,    /* an existing file */
  LM_FILE_UPDATE,  /* an existing file, to read and write */
  LM_FILE_REPLACE, /* an empty file, even if one exists */
  LM_FILE_CREATE   /* a new file; EEXIST if one exists, also for a link */
} lm_file_mode;

/* Null: errno. Others may read, rename and delete the file meanwhile. */
FILE *lm_open_file(const char *path, lm_file_mode mode);

/* An empty file without a name, to read and write; it is deleted on closing. Null: errno. */
FILE *lm_open_scratch(void);

/* 1: a file on a disk; 0: a folder, pipe or device. */
int lm_is_regular(FILE *file);

/* Lock the file until it is closed or this process ends. 0: another process has it (errno EBUSY).
 * If the file system has no locks, the file counts as locked. POSIX
 * refuses the lock to other processes only; Windows also to another opening by this one. */
int lm_lock_file(FILE *file);

/* The following functions return 1, or 0 with errno. */

/* Flush all written data to the disk. */
int lm_sync_file(FILE *file);

/* Cut the file at a length, and continue writing there. */
int lm_cut_file(FILE *file, long length);

/* Rename a file; an existing file of the new name is replaced atomically. */
int lm_replace_file(const char *from, const char *to);

int lm_remove_file(const char *path);   /* a link itself */
int lm_make_folder(const char *path);   /* EEXIST: the name exists */
int lm_remove_folder(const char *path); /* an empty one */

/* 1: the name exists; a link counts, with or without a target. */
int lm_exists(const char *path);

/* 1: both are names of one file. */
int lm_is_same_file(const char *a, const char *b);

/* --- time, processor, terminal --- */

/* Time since a fixed moment of the process. */
double lm_seconds_now(void);

/* At least 1. */
int lm_count_cores(void);

int lm_is_terminal(FILE *file);

/* The program's arguments as UTF-8, and a terminal that shows UTF-8. Null: out of memory. */
char **lm_take_arguments(int *count, char **argument);

/* Set *stop when the user or the system requests termination: SIGINT and SIGTERM; on Windows
 * Ctrl-C, Ctrl-Break and the closing of the window. No write is cut short by it. */
void lm_watch_interrupts(volatile int *stop);

/* --- threads --- */

typedef struct lm_lock lm_lock;

/* Null: out of memory. */
lm_lock *lm_create_lock(void);
void lm_acquire(lm_lock *lock);
void lm_release(lm_lock *lock);
void lm_free_lock(lm_lock *lock); /* may be null */

typedef struct lm_thread lm_thread;

/* Null: none could be started. */
lm_thread *lm_start_thread(void (*work)(void *data), void *data);
void lm_join_thread(lm_thread *thread);

#ifdef __cplusplus
}
#endif

#endif
