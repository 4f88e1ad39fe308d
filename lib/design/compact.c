#include "lostmotion/torsion_curve.h"
#include "real_math.h"
#include "refuse.h"

/* Largest distance of the samples between two knots from their chord, and where. */
static lm_real worst_between(const lm_real torque[], const lm_real angle[], int from, int to,
                             int *where) {
  const lm_real slope = (angle[to] - angle[from]) / (torque[to] - torque[from]);
  lm_real worst = LM_REAL(0);
  int i;
  *where = from;
  for (i = from + 1; i < to; i++) {
    const lm_real error = real_fabs(angle[from] + slope * (torque[i] - torque[from]) - angle[i]);
    if (error > worst) {
      worst = error;
      *where = i;
    }
  }
  return worst;
}

/* Put `sample` among the first `count` rising knots, behind place `after`. */
static void insert_knot(int chosen[], int count, int after, int sample) {
  int i;
  for (i = count; i > after + 1; i--) {
    chosen[i] = chosen[i - 1];
  }
  chosen[after + 1] = sample;
}

static lm_status check_samples(const lm_real torque_Nm[], const lm_real angle_rad[], int count,
                               lm_fault *fault) {
  int i;
  for (i = 0; i < count; i++) {
    if (!real_isfinite(torque_Nm[i])) {
      return refuse(fault, LM_NOT_FINITE, "torque_Nm");
    }
    if (!real_isfinite(angle_rad[i])) {
      return refuse(fault, LM_NOT_FINITE, "angle_rad");
    }
    if (i > 0 && !(torque_Nm[i] > torque_Nm[i - 1])) {
      return refuse(fault, LM_NOT_MONOTONE, "torque_Nm");
    }
    if (i > 0 && !(angle_rad[i] >= angle_rad[i - 1])) {
      return refuse(fault, LM_NOT_MONOTONE, "angle_rad");
    }
  }
  return LM_OK;
}

lm_status lm_choose_knots(const lm_real torque_Nm[], const lm_real angle_rad[], int count,
                          int knots, int chosen[], lm_real *largest_error_rad, lm_fault *fault) {
  lm_status status;
  lm_real largest = LM_REAL(0);
  int used = 2;
  int i;
  if (torque_Nm == 0 || angle_rad == 0 || chosen == 0 || largest_error_rad == 0) {
    return refuse(fault, LM_NULL, "torque_Nm, angle_rad, chosen, largest_error_rad");
  }
  status = check_range(fault, "knots", LM_REAL(knots), LM_REAL(2), LM_REAL(count));
  if (status == LM_OK) {
    status = check_samples(torque_Nm, angle_rad, count, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  chosen[0] = 0;
  chosen[1] = count - 1;
  for (i = 1; i < count - 1 && knots > 2; i++) {
    if (torque_Nm[i] == LM_REAL(0)) {
      insert_knot(chosen, used, 0, i);
      used++;
    }
  }
  for (;;) {
    lm_real worst = LM_REAL(-1);
    int after = 0;
    int sample = 0;
    largest = LM_REAL(0);
    for (i = 0; i < used - 1; i++) {
      int where;
      const lm_real error = worst_between(torque_Nm, angle_rad, chosen[i], chosen[i + 1], &where);
      largest = error > largest ? error : largest;
      if (chosen[i + 1] - chosen[i] > 1 && error > worst) {
        worst = error;
        after = i;
        sample = where > chosen[i] ? where : chosen[i] + 1;
      }
    }
    if (used == knots) {
      break;
    }
    insert_knot(chosen, used, after, sample);
    used++;
  }
  *largest_error_rad = largest;
  return LM_OK;
}
