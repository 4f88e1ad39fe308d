#if !defined(_WIN32)
#define _XOPEN_SOURCE 700 /* lockf */
#if defined(__APPLE__)
#define _DARWIN_C_SOURCE /* F_FULLFSYNC, _SC_NPROCESSORS_ONLN */
#endif
#endif

#include "platform.h"

#if !defined(_WIN32)
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "stop.h"

/* --- files --- */

FILE *lm_open_file(const char *path, lm_file_mode mode) {
  /* x: C11's, which every libc of today has */
  static const char *const modes[] = {"rb", "r+b", "wb", "wbx"};
  return fopen(path, modes[mode]);
}

FILE *lm_open_scratch(void) {
  return tmpfile();
}

int lm_is_regular(FILE *file) {
  struct stat found;
  return fstat(fileno(file), &found) == 0 && S_ISREG(found.st_mode);
}

int lm_lock_file(FILE *file) {
  const int before = errno;
  if (lockf(fileno(file), F_TLOCK, 0) == 0) {
    return 1;
  }
  if (errno == EACCES || errno == EAGAIN) {
    errno = EBUSY;
    return 0;
  }
  errno = before;
  return 1;
}

int lm_sync_file(FILE *file) {
  if (fflush(file) != 0) {
    return 0;
  }
#if defined(F_FULLFSYNC) /* macOS: fsync leaves the data in the disk's own cache */
  if (fcntl(fileno(file), F_FULLFSYNC) == 0) {
    return 1;
  }
#endif
  return fsync(fileno(file)) == 0;
}

int lm_cut_file(FILE *file, long length) {
  return fflush(file) == 0 && ftruncate(fileno(file), (off_t)length) == 0 &&
         fseek(file, length, SEEK_SET) == 0;
}

int lm_replace_file(const char *from, const char *to) {
  return rename(from, to) == 0;
}

int lm_remove_file(const char *path) {
  return unlink(path) == 0;
}

int lm_make_folder(const char *path) {
  return mkdir(path, 0777) == 0;
}

int lm_remove_folder(const char *path) {
  return rmdir(path) == 0;
}

int lm_exists(const char *path) {
  struct stat found;
  return lstat(path, &found) == 0;
}

int lm_is_same_file(const char *a, const char *b) {
  struct stat of_a;
  struct stat of_b;
  return stat(a, &of_a) == 0 && stat(b, &of_b) == 0 && of_a.st_dev == of_b.st_dev &&
         of_a.st_ino == of_b.st_ino;
}

/* --- time, processor, terminal --- */

double lm_seconds_now(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

int lm_count_cores(void) {
  const long cores = sysconf(_SC_NPROCESSORS_ONLN);
  return cores < 1 ? 1 : (int)cores;
}

int lm_is_terminal(FILE *file) {
  return isatty(fileno(file));
}

char **lm_take_arguments(int *count, char **argument) {
  (void)count;
  return argument;
}

static volatile int *asked_to_stop;

static void interrupt(int signal_number) {
  (void)signal_number;
  lm_stop(asked_to_stop);
}

void lm_watch_interrupts(volatile int *stop) {
  struct sigaction action;
  asked_to_stop = stop;
  memset(&action, 0, sizeof action);
  action.sa_handler = interrupt;
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, NULL);
  sigaction(SIGTERM, &action, NULL);
}

/* --- threads --- */

struct lm_lock {
  pthread_mutex_t mutex;
};

lm_lock *lm_create_lock(void) {
  lm_lock *lock = (lm_lock *)malloc(sizeof *lock);
  if (lock != NULL) {
    (void)pthread_mutex_init(&lock->mutex, NULL);
  }
  return lock;
}

void lm_acquire(lm_lock *lock) {
  (void)pthread_mutex_lock(&lock->mutex);
}

void lm_release(lm_lock *lock) {
  (void)pthread_mutex_unlock(&lock->mutex);
}

void lm_free_lock(lm_lock *lock) {
  if (lock != NULL) {
    (void)pthread_mutex_destroy(&lock->mutex);
    free(lock);
  }
}

struct lm_thread {
  pthread_t id;
  void (*work)(void *data);
  void *data;
};

static void *begin(void *data) {
  const lm_thread *thread = (const lm_thread *)data;
  thread->work(thread->data);
  return NULL;
}

lm_thread *lm_start_thread(void (*work)(void *data), void *data) {
  lm_thread *thread = (lm_thread *)malloc(sizeof *thread);
  if (thread != NULL) {
    thread->work = work;
    thread->data = data;
    if (pthread_create(&thread->id, NULL, begin, thread) != 0) {
      free(thread);
      thread = NULL;
    }
  }
  return thread;
}

void lm_join_thread(lm_thread *thread) {
  (void)pthread_join(thread->id, NULL);
  free(thread);
}
#endif
