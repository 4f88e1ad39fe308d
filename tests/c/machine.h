/* What the tests need of the operating system beyond what the optimizer itself does: folders of
 * their own, and other processes. */
#ifndef LOSTMOTION_TESTS_MACHINE_H
#define LOSTMOTION_TESTS_MACHINE_H

/* Room for the name of a folder that make_own_folder makes. */
#define OWN_FOLDER_MAX 64

/* A new folder in the working folder, so that two runs at once leave each other alone; 1: made. */
int make_own_folder(char name[OWN_FOLDER_MAX], const char *stem);

/* Remove a folder and all in it; with keep_itself, all in it. 1: done. */
int remove_tree(const char *path, int keep_itself);

/* Number of this process. */
long process_number(void);

/* 1: the file has this length now, zeros behind what it had. */
int set_length(const char *path, long length);

typedef struct process process;

/* Start a program with words that need no quoting; what it says goes to the files. Null: it could
 * not be started. */
process *start_program(const char *program, const char *words, const char *out, const char *err);

/* Ask it to end, as Ctrl-C does; 0: on Windows, without a console, it cannot be asked. */
int interrupt_program(process *p);

/* End it at once. */
void kill_program(process *p);

/* Its exit status; -1: it was killed. */
int wait_for_program(process *p);

int run_program(const char *program, const char *words, const char *out, const char *err);

void wait_ms(int milliseconds);

#endif
