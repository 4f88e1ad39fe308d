#include "known_gaps.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "platform.h"
#include "search_state.h"

/* The drive up to its tolerances. */
#define GEOMETRY_SIZE offsetof(lm_drive, tolerance_count)

typedef struct known_gap {
  unsigned char geometry[GEOMETRY_SIZE];
  lm_smallest_gap smallest;
} known_gap;

struct lm_known_gaps {
  lm_lock *lock;
  int count;
  int next;                      /* the oldest is replaced */
  known_gap gap[LM_ARCHIVE_MAX]; /* a geometry for each design of a front */
};

lm_known_gaps *lm_create_known_gaps(void) {
  lm_known_gaps *known = (lm_known_gaps *)malloc(sizeof *known);
  if (known != NULL) {
    known->count = 0;
    known->next = 0;
    known->lock = lm_create_lock();
    if (known->lock == NULL) {
      free(known);
      known = NULL;
    }
  }
  return known;
}

void lm_free_known_gaps(lm_known_gaps *known) {
  if (known != NULL) {
    lm_free_lock(known->lock);
    free(known);
  }
}

static int recall(lm_known_gaps *known, const lm_drive *drive, lm_smallest_gap *smallest) {
  int i;
  lm_acquire(known->lock);
  for (i = 0; i < known->count && memcmp(known->gap[i].geometry, drive, GEOMETRY_SIZE) != 0; i++) {
  }
  if (i < known->count) {
    *smallest = known->gap[i].smallest;
  }
  i = i < known->count;
  lm_release(known->lock);
  return i;
}

static void keep(lm_known_gaps *known, const lm_drive *drive, const lm_smallest_gap *smallest) {
  known_gap *gap;
  lm_acquire(known->lock);
  gap = &known->gap[known->next];
  memcpy(gap->geometry, drive, GEOMETRY_SIZE);
  gap->smallest = *smallest;
  known->next = (known->next + 1) % LM_ARCHIVE_MAX;
  known->count += known->count < LM_ARCHIVE_MAX;
  lm_release(known->lock);
}

lm_status lm_find_known_gap(lm_known_gaps *known, const lm_drive *drive, lm_mesh meshes[],
                            lm_smallest_gap *smallest) {
  lm_status status;
  if (known != NULL && recall(known, drive, smallest)) {
    return LM_OK;
  }
  status = lm_find_face_gap(drive, LM_CERTAIN_NODES, LM_CERTAIN_STEPS, meshes, smallest, NULL);
  if (known != NULL && status == LM_OK) {
    keep(known, drive, smallest);
  }
  return status;
}
