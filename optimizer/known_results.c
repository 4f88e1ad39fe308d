#include "known_results.h"

#include <stddef.h>
#include <string.h>

#include "search_state.h"
#include "workspace.h"

/* The drive up to its tolerances. */
#define GEOMETRY_SIZE offsetof(lm_drive, tolerance_count)

/* A geometry for each design of a front; the designs of the front of the search and those of the
 * verified one. */
#define GAPS LM_ARCHIVE_MAX
#define POINTS (2 * LM_ARCHIVE_MAX)

typedef struct point {
  int combination;
  double unit[LM_FREE_MAX];
} point;

int lm_open_known_results(lm_known_results *known) {
  known->gaps = lm_create_memo(GEOMETRY_SIZE, sizeof(lm_smallest_gap), GAPS);
  known->points = lm_create_memo(sizeof(point), LM_RESULT_MAX * sizeof(double), POINTS);
  return known->gaps != NULL && known->points != NULL;
}

void lm_close_known_results(lm_known_results *known) {
  lm_free_memo(known->gaps);
  lm_free_memo(known->points);
}

lm_status lm_find_known_gap(const lm_known_results *known, const lm_drive *drive, lm_mesh meshes[],
                            lm_smallest_gap *smallest) {
  lm_status status;
  if (lm_recall(known->gaps, drive, smallest)) {
    return LM_OK;
  }
  status = lm_find_face_gap(drive, LM_CERTAIN_NODES, LM_CERTAIN_STEPS, meshes, smallest, NULL);
  if (status == LM_OK) {
    lm_memorise(known->gaps, drive, smallest);
  }
  return status;
}

static point point_of(const lm_problem *problem, int combination, const double unit[]) {
  point key;
  memset(&key, 0, sizeof key);
  key.combination = combination;
  memcpy(key.unit, unit, (size_t)problem->range_count * sizeof unit[0]);
  return key;
}

void lm_keep_result(const lm_known_results *known, const lm_problem *problem, int combination,
                    const double unit[], const double result[]) {
  const point key = point_of(problem, combination, unit);
  lm_memorise(known->points, &key, result);
}

lm_status lm_find_known_result(const lm_problem *problem, const lm_scan *scan,
                               const lm_layout *layout, int combination, const double unit[],
                               double result[], lm_workspace *workspace) {
  const point key = point_of(problem, combination, unit);
  lm_status status;
  if (lm_recall(workspace->known.points, &key, result)) {
    return LM_OK;
  }
  status = lm_evaluate_point(problem, scan, layout, combination, unit, result, workspace, NULL);
  if (status == LM_OK) {
    lm_memorise(workspace->known.points, &key, result);
  }
  return status;
}
