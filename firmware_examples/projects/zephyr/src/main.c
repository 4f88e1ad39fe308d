#include <zephyr/sys/printk.h>

#include "../../../axis/story.h"

int main(void) {
  float most_rad;
  const int failed = axis_story(&most_rad);
  if (failed) {
    printk("the axis failed at step %d\n", failed);
  } else {
    printk("the axis ran; closing moved it by %d mas at most\n", (int)(most_rad * 206264806.0f));
  }
  return failed;
}
