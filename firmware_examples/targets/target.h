/* Functions of every target of the examples and measurements: text output, and an exit code. */
#ifndef TARGET_H
#define TARGET_H

#include <stdint.h>

void target_print(const char *text);
void target_exit(int code);

/* A number in decimal, an unsigned word in eight hexadecimal digits. */
void target_print_number(int32_t number);
void target_print_hex(uint32_t word);

/* Stack of a call: paint the memory below the stack pointer, call, and find the depth to which the
 * paint was overwritten. Inline, so that the painting itself has no frame. Zero on targets with an
 * operating system. */
#define TARGET_PAINT 0xA5A5A5A5u
#define TARGET_PAINTED_WORDS 256

#if defined(__arm__) && !defined(__linux__)
#define TARGET_READ_SP "mov %0, sp"
#elif defined(__riscv)
#define TARGET_READ_SP "mv %0, sp"
#endif

#if defined(TARGET_READ_SP)
static inline __attribute__((always_inline)) volatile uint32_t *target_paint_stack(void) {
  volatile uint32_t *sp;
  int i;
  __asm__ volatile(TARGET_READ_SP : "=r"(sp));
  for (i = 1; i <= TARGET_PAINTED_WORDS; ++i) {
    sp[-i] = TARGET_PAINT;
  }
  return sp;
}

static inline __attribute__((always_inline)) int32_t
target_used_stack(const volatile uint32_t *sp) {
  int i = TARGET_PAINTED_WORDS;
  while (i > 0 && sp[-i] == TARGET_PAINT) {
    --i;
  }
  return 4 * i;
}
#else
static inline volatile uint32_t *target_paint_stack(void) {
  return 0;
}

static inline int32_t target_used_stack(const volatile uint32_t *sp) {
  (void)sp;
  return 0;
}
#endif

/* Program, given by the example: its result is the exit code. */
int main(void);

#endif
