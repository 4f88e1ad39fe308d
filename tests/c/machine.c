#if defined(_WIN32)
#define WIN32_LEAN_AND_MEAN
#else
#define _XOPEN_SOURCE 700 /* nftw */
#if defined(__APPLE__)
#define _DARWIN_C_SOURCE /* mkdtemp */
#endif
#endif
#include "machine.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#include <windows.h>
#else
#include <fcntl.h>
#include <ftw.h>
#include <signal.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>
#endif

#define WORDS_MAX 32

int run_program(const char *program, const char *words, const char *out, const char *err) {
  process *p = start_program(program, words, out, err);
  return p == NULL ? -1 : wait_for_program(p);
}

#if defined(_WIN32)

int make_own_folder(char name[OWN_FOLDER_MAX], const char *stem) {
  static int made;
  (void)snprintf(name, OWN_FOLDER_MAX, "%s_%ld_%d", stem, process_number(), made++);
  return CreateDirectoryA(name, NULL) != 0;
}

int remove_tree(const char *path, int keep_itself) {
  char inside[MAX_PATH];
  WIN32_FIND_DATAA found;
  HANDLE search;
  int done = 1;
  (void)snprintf(inside, sizeof inside, "%s/*", path);
  search = FindFirstFileA(inside, &found);
  if (search == INVALID_HANDLE_VALUE) {
    return 0;
  }
  do {
    if (strcmp(found.cFileName, ".") != 0 && strcmp(found.cFileName, "..") != 0) {
      (void)snprintf(inside, sizeof inside, "%s/%s", path, found.cFileName);
      if ((found.dwFileAttributes & FILE_ATTRIBUTE_DIRECTORY) != 0) {
        done &= remove_tree(inside, 0);
      } else {
        done &= DeleteFileA(inside) != 0;
      }
    }
  } while (FindNextFileA(search, &found));
  (void)FindClose(search);
  return done && (keep_itself || RemoveDirectoryA(path));
}

long process_number(void) {
  return (long)GetCurrentProcessId();
}

int set_length(const char *path, long length) {
  const HANDLE file = CreateFileA(path, GENERIC_WRITE, FILE_SHARE_READ | FILE_SHARE_WRITE, NULL,
                                  OPEN_EXISTING, FILE_ATTRIBUTE_NORMAL, NULL);
  int done;
  if (file == INVALID_HANDLE_VALUE) {
    return 0;
  }
  done = SetFilePointer(file, length, NULL, FILE_BEGIN) != INVALID_SET_FILE_POINTER &&
         SetEndOfFile(file);
  (void)CloseHandle(file);
  return done;
}

struct process {
  PROCESS_INFORMATION about;
};

/* Wine 8 sends no event to another group of processes. */
static int is_wine(void) {
  return GetProcAddress(GetModuleHandleA("ntdll.dll"), "wine_get_version") != NULL;
}

static HANDLE open_for_child(const char *path) {
  SECURITY_ATTRIBUTES inherited;
  memset(&inherited, 0, sizeof inherited);
  inherited.nLength = sizeof inherited;
  inherited.bInheritHandle = TRUE;
  return CreateFileA(path, GENERIC_WRITE, FILE_SHARE_READ | FILE_SHARE_DELETE, &inherited,
                     CREATE_ALWAYS, FILE_ATTRIBUTE_NORMAL, NULL);
}

process *start_program(const char *program, const char *words, const char *out, const char *err) {
  process *p = (process *)calloc(1, sizeof *p);
  STARTUPINFOA start;
  char command[2048];
  BOOL started;
  if (p == NULL) {
    return NULL;
  }
  (void)snprintf(command, sizeof command, "\"%s\" %s", program, words);
  memset(&start, 0, sizeof start);
  start.cb = sizeof start;
  start.dwFlags = STARTF_USESTDHANDLES;
  start.hStdOutput = open_for_child(out);
  start.hStdError = open_for_child(err);
  /* Its own process group: an interrupt does not reach the tests. */
  started = CreateProcessA(NULL, command, NULL, NULL, TRUE,
                           is_wine() ? 0 : CREATE_NEW_PROCESS_GROUP, NULL, NULL, &start, &p->about);
  (void)CloseHandle(start.hStdOutput);
  (void)CloseHandle(start.hStdError);
  if (!started) {
    free(p);
    p = NULL;
  }
  return p;
}

static BOOL WINAPI go_on(DWORD event) {
  (void)event;
  return TRUE;
}

int interrupt_program(process *p) {
  if (is_wine()) {
    return SetConsoleCtrlHandler(go_on, TRUE) && GenerateConsoleCtrlEvent(CTRL_C_EVENT, 0);
  }
  return GenerateConsoleCtrlEvent(CTRL_BREAK_EVENT, p->about.dwProcessId);
}

void kill_program(process *p) {
  (void)TerminateProcess(p->about.hProcess, (UINT)-1);
}

int wait_for_program(process *p) {
  DWORD status = 0;
  (void)WaitForSingleObject(p->about.hProcess, INFINITE);
  (void)GetExitCodeProcess(p->about.hProcess, &status);
  (void)CloseHandle(p->about.hThread);
  (void)CloseHandle(p->about.hProcess);
  free(p);
  return (int)status;
}

void wait_ms(int milliseconds) {
  Sleep((DWORD)milliseconds);
}

#else

int make_own_folder(char name[OWN_FOLDER_MAX], const char *stem) {
  (void)snprintf(name, OWN_FOLDER_MAX, "%s_XXXXXX", stem);
  return mkdtemp(name) != NULL;
}

static int kept_level;

static int remove_one(const char *path, const struct stat *about, int kind, struct FTW *place) {
  (void)about;
  (void)kind;
  return place->level < kept_level ? 0 : remove(path);
}

int remove_tree(const char *path, int keep_itself) {
  kept_level = keep_itself ? 1 : 0;
  return nftw(path, remove_one, 16, FTW_DEPTH | FTW_PHYS) == 0;
}

long process_number(void) {
  return (long)getpid();
}

int set_length(const char *path, long length) {
  return truncate(path, length) == 0;
}

struct process {
  pid_t id;
};

static void redirect(const char *path, int to) {
  const int file = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0666);
  if (file < 0 || dup2(file, to) < 0) {
    _exit(126);
  }
  close(file);
}

process *start_program(const char *program, const char *words, const char *out, const char *err) {
  process *p = (process *)calloc(1, sizeof *p);
  char text[2048];
  char *word[WORDS_MAX + 1];
  int count = 0;
  if (p == NULL) {
    return NULL;
  }
  /* If this program runs in an emulator, the emulator precedes the program. */
  (void)snprintf(text, sizeof text, "%s %s %s", LM_EMULATOR, program, words);
  for (word[0] = strtok(text, " "); word[count] != NULL && count + 1 < WORDS_MAX;) {
    word[++count] = strtok(NULL, " ");
  }
  word[count] = NULL;
  (void)fflush(NULL);
  p->id = fork();
  if (p->id == 0) {
    redirect(out, STDOUT_FILENO);
    redirect(err, STDERR_FILENO);
    (void)execvp(word[0], word);
    _exit(127);
  }
  if (p->id < 0) {
    free(p);
    p = NULL;
  }
  return p;
}

int interrupt_program(process *p) {
  return kill(p->id, SIGINT) == 0;
}

void kill_program(process *p) {
  (void)kill(p->id, SIGKILL);
}

int wait_for_program(process *p) {
  int status = 0;
  const pid_t ended = waitpid(p->id, &status, 0);
  free(p);
  return ended > 0 && WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

void wait_ms(int milliseconds) {
  const struct timespec time = {milliseconds / 1000, milliseconds % 1000 * 1000000L};
  (void)nanosleep(&time, NULL);
}

#endif
