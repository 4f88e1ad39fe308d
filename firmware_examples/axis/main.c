#include "story.h"

int main(void) {
  float most_rad;
  return axis_story(&most_rad);
}
