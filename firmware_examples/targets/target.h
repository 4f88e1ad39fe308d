/* What every target of the examples and measurements offers: text out, and an exit code. */
#ifndef TARGET_H
#define TARGET_H

#include <stdint.h>

void target_print(const char *text);
void target_exit(int code);

/* A number in decimal, an unsigned word in eight hexadecimal digits. */
void target_print_number(int32_t number);
void target_print_hex(uint32_t word);

/* Fills the unused stack with a pattern; later says how many bytes have been used since. Zero on
 * targets that cannot tell. */
void target_paint_stack(void);
uint32_t target_used_stack(void);

/* Program, given by the example: its result is the exit code. */
int main(void);

#endif
