#include <stdio.h>
#include <stdlib.h>

#include "sdkconfig.h"

#include "../../../axis/story.h"

void app_main(void) {
  float most_rad;
  const int failed = axis_story(&most_rad);
  if (failed) {
    printf("the axis failed at step %d\n", failed);
  } else {
    printf("the axis ran; closing moved it by %.2f arcsec at most\n", (double)most_rad * 206264.8);
  }
#ifdef CONFIG_IDF_TARGET_LINUX
  fflush(stdout);
  exit(failed); /* on a chip the task ends here and the scheduler continues */
#endif
}
