/* Start-up of a RISC-V (machine mode) under QEMU `virt`: stack, FPU, variables, semihosting. */
#include "target.h"

extern uint32_t bss_start[];
extern uint32_t bss_end[];

void start(void);
void run(void);
void fault(void);

#define SYS_WRITE0 0x04
#define SYS_EXIT_EXTENDED 0x20
#define APPLICATION_EXIT 0x20026u
#define FAULT_EXIT_CODE 99

/* The three instructions must be 32 bits wide and lie in one page (RISC-V semihosting, 0.4). */
static long semihost(long operation, const void *argument) {
  register long a0 __asm__("a0") = operation;
  register const void *a1 __asm__("a1") = argument;
  __asm__ volatile(
      ".option push\n .option norvc\n .balign 16\n"
      "slli x0, x0, 0x1f\n ebreak\n srai x0, x0, 7\n .option pop"
      : "+r"(a0)
      : "r"(a1)
      : "memory");
  return a0;
}

void target_print(const char *text) {
  semihost(SYS_WRITE0, text);
}

void target_exit(int code) {
  uintptr_t block[2];
  block[0] = APPLICATION_EXIT;
  block[1] = (uintptr_t)code;
  semihost(SYS_EXIT_EXTENDED, block);
  for (;;) {
  }
}

__attribute__((used)) void run(void) {
  uint32_t *to;
  for (to = bss_start; to < bss_end; ++to) {
    *to = 0;
  }
  target_exit(main());
}

__attribute__((used, aligned(4))) void fault(void) {
  target_print("fault\n");
  target_exit(FAULT_EXIT_CODE);
}

__attribute__((section(".start"), naked, used)) void start(void) {
  __asm__ volatile(
      ".option push\n .option norelax\n la gp, __global_pointer$\n .option pop\n"
      "la sp, stack_top\n"
      "la t0, fault\n csrw mtvec, t0\n"
#if defined(__riscv_flen)
      "li t0, 0x2000\n csrs mstatus, t0\n csrwi fcsr, 0\n"
#endif
      "call run\n");
}
