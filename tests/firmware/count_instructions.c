/* QEMU plugin: instructions executed from the entry of one function to the entry of another.
 * Arguments begin=ADDRESS,end=ADDRESS,next=ADDRESS. Prints "windows N least N most N" when the
 * guest ends, once for each section between calls of the third function.
 *
 * The prototypes are QEMU's plugin interface, version 1; distributions do not include its
 * header. */
#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PUBLIC __attribute__((visibility("default")))

typedef uint64_t qemu_plugin_id_t;
typedef struct {
  const char *target_name;
  struct {
    int min, cur;
  } version;
  bool system_emulation;
} qemu_info_t;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
void qemu_plugin_register_vcpu_tb_trans_cb(qemu_plugin_id_t,
                                           void (*)(qemu_plugin_id_t, struct qemu_plugin_tb *));
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *);
struct qemu_plugin_insn *qemu_plugin_tb_get_insn(const struct qemu_plugin_tb *, size_t);
uint64_t qemu_plugin_insn_vaddr(const struct qemu_plugin_insn *);
void qemu_plugin_register_vcpu_insn_exec_cb(struct qemu_plugin_insn *, void (*)(unsigned, void *),
                                            int, void *);
void qemu_plugin_register_atexit_cb(qemu_plugin_id_t, void (*)(qemu_plugin_id_t, void *), void *);

PUBLIC int qemu_plugin_version = 1;

#define PARTS 16

static uint64_t executed, opened_at, begin, end, next;
static struct {
  uint64_t windows, least, most;
} part[PARTS + 1]; /* 0: before the first division */
static unsigned parts;
static bool open_window;

static void on_instruction(unsigned cpu, void *address_of) {
  uint64_t address = (uint64_t)(uintptr_t)address_of;
  (void)cpu;
  if (address == begin) {
    opened_at = executed;
    open_window = true;
  } else if (address == end && open_window) {
    uint64_t length = executed - opened_at;
    open_window = false;
    if (part[parts].windows == 0 || length < part[parts].least) {
      part[parts].least = length;
    }
    part[parts].most = length > part[parts].most ? length : part[parts].most;
    ++part[parts].windows;
  } else if (address == next && parts < PARTS) {
    ++parts;
  }
  ++executed;
}

static void on_translation(qemu_plugin_id_t id, struct qemu_plugin_tb *block) {
  size_t count = qemu_plugin_tb_n_insns(block);
  size_t i;
  (void)id;
  for (i = 0; i < count; ++i) {
    struct qemu_plugin_insn *instruction = qemu_plugin_tb_get_insn(block, i);
    qemu_plugin_register_vcpu_insn_exec_cb(instruction, on_instruction, 0,
                                           (void *)(uintptr_t)qemu_plugin_insn_vaddr(instruction));
  }
}

static void on_end(qemu_plugin_id_t id, void *unused) {
  unsigned i;
  (void)id;
  (void)unused;
  for (i = 1; i <= parts; ++i) {
    fprintf(stderr, "windows %" PRIu64 " least %" PRIu64 " most %" PRIu64 "\n", part[i].windows,
            part[i].least, part[i].most);
  }
}

PUBLIC int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t *info, int argc,
                               char **argv) {
  int i;
  (void)info;
  for (i = 0; i < argc; ++i) {
    if (strncmp(argv[i], "begin=", 6) == 0) {
      begin = strtoull(argv[i] + 6, NULL, 0);
    } else if (strncmp(argv[i], "end=", 4) == 0) {
      end = strtoull(argv[i] + 4, NULL, 0);
    } else if (strncmp(argv[i], "next=", 5) == 0) {
      next = strtoull(argv[i] + 5, NULL, 0);
    }
  }
  qemu_plugin_register_vcpu_tb_trans_cb(id, on_translation);
  qemu_plugin_register_atexit_cb(id, on_end, NULL);
  return 0;
}
