/* A machine with an operating system: the host, or another one under qemu-user. */
#include <stdio.h>
#include <stdlib.h>

#include "target.h"

void target_print(const char *text) {
  fputs(text, stdout);
}

void target_exit(int code) {
  exit(code);
}
