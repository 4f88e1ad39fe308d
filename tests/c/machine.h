/* Functions of the operating system that only the tests need: temporary folders and other
 * processes. */
#ifndef LOSTMOTION_TESTS_MACHINE_H
#define LOSTMOTION_TESTS_MACHINE_H

/* Room for the name of a folder that make_own_folder makes. */
#define OWN_FOLDER_MAX 64

/* Make a new folder in the working folder, so that simultaneous runs do not interfere; 1: made. */
int make_own_folder(char name[OWN_FOLDER_MAX], const char *stem);

/* Remove a folder with its contents; with keep_itself only the contents. 1: done. */
int remove_tree(const char *path, int keep_itself);

/* Number of this process. */
long process_number(void);

/* Set the length of a file, filled with zeros. 1: done. */
int set_length(const char *path, long length);

typedef struct process process;

/* Start a program with words that need no quoting; its output goes to the files. Null: it could not
 * be started. */
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
