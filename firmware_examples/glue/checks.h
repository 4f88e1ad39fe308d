/* Common parts of main.c and the checks of each drive. */
#ifndef GLUE_CHECKS_H
#define GLUE_CHECKS_H

#define CLOSE_RAD 2e-5f

/* Whether two angles are the same within the example's own limit. */
static inline int is_close(float a, float b) {
  return a - b < CLOSE_RAD && b - a < CLOSE_RAD;
}

int check_cia402(void);

#endif
