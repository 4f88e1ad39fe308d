/* Start-up of a Cortex-M under QEMU: vector table, FPU, variables, semihosting. */
#include "target.h"

extern uint32_t stack_top[];
extern uint32_t data_start[];
extern uint32_t data_end[];
extern const uint32_t data_image[];
extern uint32_t bss_start[];
extern uint32_t bss_end[];

void start(void);
void fault(void);

/* Semihosting operations (ARM "Semihosting for AArch32 and AArch64", release 2023). */
#define SYS_WRITE0 0x04
#define SYS_EXIT_EXTENDED 0x20
#define APPLICATION_EXIT 0x20026u
#define FAULT_EXIT_CODE 99

static int semihost(int operation, const void *argument) {
  register int r0 __asm__("r0") = operation;
  register const void *r1 __asm__("r1") = argument;
  __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

void target_print(const char *text) {
  semihost(SYS_WRITE0, text);
}

void target_exit(int code) {
  uint32_t block[2];
  block[0] = APPLICATION_EXIT;
  block[1] = (uint32_t)code;
  semihost(SYS_EXIT_EXTENDED, block);
  for (;;) {
  }
}

__attribute__((used)) void start(void) {
  const uint32_t *from = data_image;
  uint32_t *to;
  for (to = data_start; to < data_end; ++to) {
    *to = *from++;
  }
  for (to = bss_start; to < bss_end; ++to) {
    *to = 0;
  }
#if defined(__ARM_FP)
  *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20; /* CPACR: coprocessors 10 and 11, the FPU */
  __asm__ volatile("dsb\n isb");
#endif
  target_exit(main());
}

/* Without this a fault would hang the emulator until its time limit. */
__attribute__((used)) void fault(void) {
  target_print("fault\n");
  target_exit(FAULT_EXIT_CODE);
}

__attribute__((section(".vectors"), used)) static void *const vectors[16] = {
    stack_top,     (void *)start, (void *)fault, (void *)fault, (void *)fault, (void *)fault,
    (void *)fault, (void *)fault, (void *)fault, (void *)fault, (void *)fault, (void *)fault,
    (void *)fault, (void *)fault, (void *)fault, (void *)fault};
