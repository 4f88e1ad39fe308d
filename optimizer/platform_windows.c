#if defined(_WIN32)
#if !defined(_WIN32_WINNT)
#define _WIN32_WINNT 0x0601 /* Windows 7: GetActiveProcessorCount */
#endif
#define WIN32_LEAN_AND_MEAN
#endif

#include "platform.h"

#if defined(_WIN32)
#include <windows.h>
/* after windows.h, whose types they use */
#include <errno.h>
#include <fcntl.h>
#include <fenv.h>
#include <io.h>
#include <process.h>
#include <shellapi.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <wchar.h>

#include "stop.h"

static void set_errno(DWORD error) {
  switch (error) {
    case ERROR_FILE_NOT_FOUND:
    case ERROR_PATH_NOT_FOUND:
    case ERROR_INVALID_NAME:
    case ERROR_BAD_PATHNAME:
    case ERROR_INVALID_DRIVE:
    case ERROR_BAD_NETPATH:
    case ERROR_BAD_NET_NAME:
      errno = ENOENT;
      break;
    case ERROR_ACCESS_DENIED:
    case ERROR_SHARING_VIOLATION:
    case ERROR_LOCK_VIOLATION:
    case ERROR_WRITE_PROTECT:
      errno = EACCES;
      break;
    case ERROR_FILE_EXISTS:
    case ERROR_ALREADY_EXISTS:
      errno = EEXIST;
      break;
    case ERROR_DISK_FULL:
    case ERROR_HANDLE_DISK_FULL:
      errno = ENOSPC;
      break;
    case ERROR_DIR_NOT_EMPTY:
      errno = ENOTEMPTY;
      break;
    case ERROR_DIRECTORY:
      errno = ENOTDIR;
      break;
    case ERROR_FILENAME_EXCED_RANGE:
      errno = ENAMETOOLONG;
      break;
    case ERROR_NOT_ENOUGH_MEMORY:
    case ERROR_OUTOFMEMORY:
      errno = ENOMEM;
      break;
    case ERROR_TOO_MANY_OPEN_FILES:
      errno = EMFILE;
      break;
    default:
      errno = EIO;
  }
}

/* 1, or 0 with errno. */
static int succeed(BOOL done) {
  if (!done) {
    set_errno(GetLastError());
  }
  return done != 0;
}

/* --- paths --- */

/* Least length of a path that needs the prefix that removes the limit: MAX_PATH minus the 12
 * characters that CreateDirectory reserves for a file name. */
#define LONG_PATH (MAX_PATH - 12)

/* All paths pass here: UTF-8 to an absolute path of Windows. Null: errno. */
static wchar_t *open_path(const char *path) {
  static const wchar_t local[] = L"\\\\?\\";
  static const wchar_t network[] = L"\\\\?\\UNC\\"; /* in place of two backslashes */
  const int length = MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path, -1, NULL, 0);
  wchar_t *given = length > 0 ? (wchar_t *)malloc((size_t)length * sizeof *given) : NULL;
  wchar_t *full = NULL;
  DWORD room = 0;
  if (length > 0 && given != NULL) {
    (void)MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path, -1, given, length);
    room = GetFullPathNameW(given, 0, NULL, NULL); /* with the end; 0 for an empty path */
  }
  if (room > 0) {
    full = (wchar_t *)malloc(((size_t)room + sizeof network / sizeof *network) * sizeof *full);
  }
  if (full != NULL) {
    const DWORD found = GetFullPathNameW(given, room, full, NULL);
    if (found == 0 || found >= room) { /* the working folder has changed in between */
      free(full);
      full = NULL;
    } else if (found >= LONG_PATH && wcsncmp(full, L"\\\\?\\", 4) != 0 &&
               wcsncmp(full, L"\\\\.\\", 4) != 0) {
      const int is_network = full[0] == L'\\' && full[1] == L'\\';
      const wchar_t *prefix = is_network ? network : local;
      const size_t skip = is_network ? 2 : 0;
      memmove(full + wcslen(prefix), full + skip, ((size_t)found + 1 - skip) * sizeof *full);
      memcpy(full, prefix, wcslen(prefix) * sizeof *full);
    }
  }
  if (full == NULL) {
    errno = length <= 0 ? EILSEQ : given == NULL || room > 0 ? ENOMEM : ENOENT;
  }
  free(given);
  return full;
}

/* --- files --- */

static HANDLE handle_of(FILE *file) {
  return (HANDLE)_get_osfhandle(_fileno(file));
}

/* A C stream for a Windows handle, which the stream owns from here on. */
static FILE *as_file(HANDLE handle, int flags, const char *mode) {
  const int number = _open_osfhandle((intptr_t)handle, flags | _O_BINARY);
  FILE *file = number >= 0 ? _fdopen(number, mode) : NULL;
  if (file == NULL) {
    const int why = errno;
    if (number >= 0) {
      (void)_close(number);
    } else {
      (void)CloseHandle(handle);
    }
    errno = why;
  }
  return file;
}

FILE *lm_open_file(const char *path, lm_file_mode mode) {
  static const struct {
    DWORD access;
    DWORD creation;
    int flags;
    const char *mode;
  } as[] = {{GENERIC_READ, OPEN_EXISTING, _O_RDONLY, "rb"},
            {GENERIC_READ | GENERIC_WRITE, OPEN_EXISTING, _O_RDWR, "r+b"},
            {GENERIC_WRITE, CREATE_ALWAYS, _O_WRONLY, "wb"},
            {GENERIC_WRITE, CREATE_NEW, _O_WRONLY, "wb"}};
  wchar_t *name = open_path(path);
  HANDLE handle;
  if (name == NULL) {
    return NULL;
  }
  handle =
      CreateFileW(name, as[mode].access, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE,
                  NULL, as[mode].creation, FILE_ATTRIBUTE_NORMAL, NULL);
  if (handle == INVALID_HANDLE_VALUE) {
    const DWORD error = GetLastError();
    const DWORD found = GetFileAttributesW(name);
    set_errno(error);
    if (mode != LM_FILE_CREATE && found != INVALID_FILE_ATTRIBUTES &&
        (found & FILE_ATTRIBUTE_DIRECTORY) != 0) {
      errno = EISDIR;
    }
  }
  free(name);
  return handle == INVALID_HANDLE_VALUE ? NULL : as_file(handle, as[mode].flags, as[mode].mode);
}

FILE *lm_open_scratch(void) {
  wchar_t folder[MAX_PATH + 1];
  wchar_t name[MAX_PATH + 1];
  HANDLE handle;
  if (GetTempPathW(MAX_PATH + 1, folder) == 0 || GetTempFileNameW(folder, L"lm", 0, name) == 0) {
    set_errno(GetLastError());
    return NULL;
  }
  handle = CreateFileW(name, GENERIC_READ | GENERIC_WRITE, 0, NULL, CREATE_ALWAYS,
                       FILE_ATTRIBUTE_TEMPORARY | FILE_FLAG_DELETE_ON_CLOSE, NULL);
  if (handle == INVALID_HANDLE_VALUE) {
    set_errno(GetLastError());
    return NULL;
  }
  return as_file(handle, _O_RDWR, "w+b");
}

int lm_is_regular(FILE *file) {
  return GetFileType(handle_of(file)) == FILE_TYPE_DISK;
}

/* Locks are mandatory on Windows: one byte far beyond the end of any file does not prevent
 * reading. */
int lm_lock_file(FILE *file) {
  OVERLAPPED place;
  DWORD error;
  memset(&place, 0, sizeof place);
  place.OffsetHigh = 0x40000000;
  if (LockFileEx(handle_of(file), LOCKFILE_EXCLUSIVE_LOCK | LOCKFILE_FAIL_IMMEDIATELY, 0, 1, 0,
                 &place)) {
    return 1;
  }
  error = GetLastError();
  if (error == ERROR_LOCK_VIOLATION || error == ERROR_IO_PENDING) {
    errno = EBUSY;
    return 0;
  }
  return 1;
}

int lm_sync_file(FILE *file) {
  return fflush(file) == 0 && succeed(FlushFileBuffers(handle_of(file)));
}

int lm_cut_file(FILE *file, long length) {
  int why;
  if (fflush(file) != 0) {
    return 0;
  }
  why = _chsize_s(_fileno(file), length);
  if (why != 0) {
    errno = why;
    return 0;
  }
  return fseek(file, length, SEEK_SET) == 0;
}

/* Virus scanners and indexers open a new file briefly; meanwhile it cannot be replaced. */
#define REPLACE_TRIES 20
#define REPLACE_WAIT_MS 50

int lm_replace_file(const char *from, const char *to) {
  wchar_t *old_name = open_path(from);
  wchar_t *new_name = old_name != NULL ? open_path(to) : NULL;
  int done = 0;
  if (new_name != NULL) {
    int tries = 0;
    DWORD error;
    do {
      if (tries > 0) {
        Sleep(REPLACE_WAIT_MS);
      }
      done =
          MoveFileExW(old_name, new_name, MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH) != 0;
      error = GetLastError();
      tries++;
    } while (!done && error == ERROR_SHARING_VIOLATION && tries < REPLACE_TRIES);
    if (!done) {
      set_errno(error);
    }
  }
  free(old_name);
  free(new_name);
  return done;
}

/* with_path: result of a Windows call for one of our paths. */
static int with_path(BOOL(WINAPI *call)(const wchar_t *name), const char *path) {
  wchar_t *name = open_path(path);
  const int done = name != NULL && succeed(call(name));
  free(name);
  return done;
}

static BOOL WINAPI create_folder(const wchar_t *name) {
  return CreateDirectoryW(name, NULL);
}

int lm_remove_file(const char *path) {
  return with_path(DeleteFileW, path);
}

int lm_make_folder(const char *path) {
  return with_path(create_folder, path);
}

int lm_remove_folder(const char *path) {
  return with_path(RemoveDirectoryW, path);
}

int lm_exists(const char *path) {
  wchar_t *name = open_path(path);
  const int found = name != NULL && GetFileAttributesW(name) != INVALID_FILE_ATTRIBUTES;
  free(name);
  return found;
}

static int identify(const char *path, BY_HANDLE_FILE_INFORMATION *about) {
  wchar_t *name = open_path(path);
  int known = 0;
  if (name != NULL) {
    const HANDLE handle =
        CreateFileW(name, 0, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, NULL,
                    OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS, NULL); /* folders as well */
    if (handle != INVALID_HANDLE_VALUE) {
      known = GetFileInformationByHandle(handle, about) != 0;
      (void)CloseHandle(handle);
    }
    free(name);
  }
  return known;
}

int lm_is_same_file(const char *a, const char *b) {
  BY_HANDLE_FILE_INFORMATION of_a;
  BY_HANDLE_FILE_INFORMATION of_b;
  return identify(a, &of_a) && identify(b, &of_b) &&
         of_a.dwVolumeSerialNumber == of_b.dwVolumeSerialNumber &&
         of_a.nFileIndexHigh == of_b.nFileIndexHigh && of_a.nFileIndexLow == of_b.nFileIndexLow;
}

/* --- time, processor, terminal --- */

double lm_seconds_now(void) {
  LARGE_INTEGER ticks;
  LARGE_INTEGER per_second;
  (void)QueryPerformanceCounter(&ticks);
  (void)QueryPerformanceFrequency(&per_second);
  return (double)ticks.QuadPart / (double)per_second.QuadPart;
}

int lm_count_cores(void) {
  const DWORD cores = GetActiveProcessorCount(ALL_PROCESSOR_GROUPS);
  return cores < 1 ? 1 : (int)cores;
}

int lm_is_terminal(FILE *file) {
  return _isatty(_fileno(file));
}

static UINT code_page_before;

static void restore_code_page(void) {
  (void)SetConsoleOutputCP(code_page_before);
}

/* The arguments are kept until the program ends. */
char **lm_take_arguments(int *count, char **argument) {
  int words = 0;
  wchar_t **wide = CommandLineToArgvW(GetCommandLineW(), &words);
  char **all = wide != NULL ? (char **)calloc((size_t)words + 1, sizeof *all) : NULL;
  int i;
  (void)argument;
  for (i = 0; all != NULL && i < words; i++) {
    const int length = WideCharToMultiByte(CP_UTF8, 0, wide[i], -1, NULL, 0, NULL, NULL);
    all[i] = (char *)malloc((size_t)(length > 0 ? length : 1));
    if (all[i] == NULL) {
      return NULL;
    }
    all[i][0] = '\0';
    (void)WideCharToMultiByte(CP_UTF8, 0, wide[i], -1, all[i], length, NULL, NULL);
  }
  (void)LocalFree(wide);
  *count = all != NULL ? words : 0;
  (void)_setmode(_fileno(stdout), _O_BINARY);
  (void)_setmode(_fileno(stderr), _O_BINARY);
  code_page_before = GetConsoleOutputCP();
  if (code_page_before != 0 && SetConsoleOutputCP(CP_UTF8)) {
    (void)atexit(restore_code_page);
  }
  return all;
}

static volatile int *asked_to_stop;

/* Called in a separate thread. When the window closes, the process ends when this returns or some
 * seconds later; until then the program can write its results. */
static BOOL WINAPI interrupt(DWORD event) {
  lm_stop(asked_to_stop);
  if (event != CTRL_C_EVENT && event != CTRL_BREAK_EVENT) {
    Sleep(INFINITE);
  }
  return TRUE;
}

void lm_watch_interrupts(volatile int *stop) {
  asked_to_stop = stop;
  (void)SetConsoleCtrlHandler(NULL, FALSE); /* a parent may have had Ctrl-C ignored */
  (void)SetConsoleCtrlHandler(interrupt, TRUE);
}

/* --- threads --- */

struct lm_lock {
  SRWLOCK slim;
};

lm_lock *lm_create_lock(void) {
  lm_lock *lock = (lm_lock *)malloc(sizeof *lock);
  if (lock != NULL) {
    InitializeSRWLock(&lock->slim);
  }
  return lock;
}

void lm_acquire(lm_lock *lock) {
  AcquireSRWLockExclusive(&lock->slim);
}

void lm_release(lm_lock *lock) {
  ReleaseSRWLockExclusive(&lock->slim);
}

void lm_free_lock(lm_lock *lock) {
  free(lock);
}

struct lm_thread {
  HANDLE handle;
  void (*work)(void *data);
  void *data;
  fenv_t rounding; /* of the thread that starts this one */
};

/* Windows starts a thread with the x87 rounding to 53 bits, mingw-w64 a program with 64 bits; the
 * libm of mingw-w64 computes on the x87. No bit of a result may depend on the thread. */
static unsigned __stdcall begin(void *data) {
  const lm_thread *thread = (const lm_thread *)data;
  (void)fesetenv(&thread->rounding);
  thread->work(thread->data);
  return 0;
}

lm_thread *lm_start_thread(void (*work)(void *data), void *data) {
  lm_thread *thread = (lm_thread *)malloc(sizeof *thread);
  if (thread != NULL) {
    uintptr_t handle;
    thread->work = work;
    thread->data = data;
    (void)fegetenv(&thread->rounding);
    handle = _beginthreadex(NULL, 0, begin, thread, 0, NULL);
    thread->handle = (HANDLE)handle;
    if (handle == 0) {
      free(thread);
      thread = NULL;
    }
  }
  return thread;
}

void lm_join_thread(lm_thread *thread) {
  (void)WaitForSingleObject(thread->handle, INFINITE);
  (void)CloseHandle(thread->handle);
  free(thread);
}
#endif
