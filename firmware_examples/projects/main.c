/* The program of the projects for CMake and make: a usual sequence of an axis (../axis/story.c). */
#include <stdio.h>

#include "../axis/story.h"

int main(void) {
  float most_rad;
  const int failed = axis_story(&most_rad);
  if (failed) {
    printf("the axis failed at step %d\n", failed);
  } else {
    printf("the axis ran; closing moved it by %.2f arcsec at most\n", (double)most_rad * 206264.8);
  }
  return failed;
}
