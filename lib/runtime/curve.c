#include "lostmotion/curve.h"

#include "runtime/curve_kernel.h"
#include "runtime/number.h"
#include "runtime/plain_symbol.h"

static lm_status check_knots(const lm_real *torque_Nm, const lm_real *angle_rad, int32_t count,
                             lm_fault *fault) {
  int32_t i;
  for (i = 0; i < count; ++i) {
    lm_status status = lm_check_range(fault, "torque_Nm", torque_Nm[i], -LM_CURVE_TORQUE_MAX_NM,
                                      LM_CURVE_TORQUE_MAX_NM);
    if (status == LM_OK) {
      status = lm_check_range(fault, "angle_rad", angle_rad[i], -LM_CURVE_ANGLE_MAX_RAD,
                              LM_CURVE_ANGLE_MAX_RAD);
    }
    if (status != LM_OK) {
      return status;
    }
  }
  for (i = 1; i < count; ++i) {
    if (!(torque_Nm[i] > torque_Nm[i - 1])) {
      return lm_refuse(fault, LM_NOT_MONOTONE, "torque_Nm", torque_Nm[i], torque_Nm[i - 1], 0);
    }
    if (!(angle_rad[i] >= angle_rad[i - 1])) {
      return lm_refuse(fault, LM_NOT_MONOTONE, "angle_rad", angle_rad[i], angle_rad[i - 1], 0);
    }
    if (!((angle_rad[i] - angle_rad[i - 1]) <=
          LM_CURVE_SLOPE_MAX * (torque_Nm[i] - torque_Nm[i - 1]))) {
      return lm_refuse(fault, LM_OUT_OF_RANGE, "slope_rad_per_Nm",
                       (angle_rad[i] - angle_rad[i - 1]) / (torque_Nm[i] - torque_Nm[i - 1]), 0,
                       LM_CURVE_SLOPE_MAX);
    }
  }
  return LM_OK;
}

static lm_status check_count(int32_t count, lm_fault *fault) {
  if (count < 2 || count > LM_CURVE_POINTS_MAX) {
    return lm_refuse(fault, LM_OUT_OF_RANGE, "count", LM_REAL(count), 2,
                     LM_REAL(LM_CURVE_POINTS_MAX));
  }
  return LM_OK;
}

lm_status lm_build_curve(lm_curve *curve, const lm_real *torque_Nm, const lm_real *angle_rad,
                         int32_t count, lm_fault *fault) {
  lm_status status;
  int32_t i;
  if (!curve || !torque_Nm || !angle_rad) {
    return lm_refuse(fault, LM_NULL, "curve", 0, 0, 0);
  }
  status = check_count(count, fault);
  if (status != LM_OK) {
    return status;
  }
  status = check_knots(torque_Nm, angle_rad, count, fault);
  if (status != LM_OK) {
    return status;
  }
  curve->count = count;
  for (i = 0; i < LM_CURVE_STORE; ++i) {
    int32_t knot = (i < count) ? i : count - 1;
    int32_t segment = (i < count - 1) ? i : count - 2;
    curve->torque_Nm[i] = torque_Nm[knot];
    curve->angle_rad[i] = angle_rad[knot];
    curve->slope_rad_per_Nm[i] = (angle_rad[segment + 1] - angle_rad[segment]) /
                                 (torque_Nm[segment + 1] - torque_Nm[segment]);
  }
  return LM_OK;
}
PLAIN_SYMBOL(lm_build_curve, LM_SIZES_TEXT)

lm_status lm_check_curve(const lm_curve *curve, lm_fault *fault) {
  lm_status status;
  int32_t i;
  if (!curve) {
    return lm_refuse(fault, LM_NULL, "curve", 0, 0, 0);
  }
  status = check_count(curve->count, fault);
  if (status != LM_OK) {
    return status;
  }
  status = check_knots(curve->torque_Nm, curve->angle_rad, curve->count, fault);
  if (status != LM_OK) {
    return status;
  }
  for (i = 0; i < LM_CURVE_STORE; ++i) {
    int32_t last = curve->count - 1;
    int32_t segment = (i < last) ? i : last - 1;
    lm_real slope = (curve->angle_rad[segment + 1] - curve->angle_rad[segment]) /
                    (curve->torque_Nm[segment + 1] - curve->torque_Nm[segment]);
    lm_real found = curve->slope_rad_per_Nm[i];
    if (i > last && (curve->torque_Nm[i] != curve->torque_Nm[last] ||
                     curve->angle_rad[i] != curve->angle_rad[last])) {
      return lm_refuse(fault, LM_INCONSISTENT, "padding", LM_REAL(i), 0, 0);
    }
    if (!(absolute(found - slope) <= LM_CURVE_SLOPE_TOLERANCE * slope)) {
      return lm_refuse(fault, LM_INCONSISTENT, "slope_rad_per_Nm", found, slope, slope);
    }
  }
  return LM_OK;
}

lm_real lm_evaluate_curve(const lm_curve *curve, lm_real torque_Nm) {
  return evaluate_curve(curve, torque_Nm);
}

lm_real lm_evaluate_curve_slope(const lm_curve *curve, lm_real torque_Nm) {
  return curve->slope_rad_per_Nm[find_segment(curve, curve->torque_Nm, torque_Nm)];
}

lm_real lm_invert_curve(const lm_curve *curve, lm_real angle_rad) {
  int32_t at = find_segment(curve, curve->angle_rad, angle_rad);
  lm_real slope = curve->slope_rad_per_Nm[at];
  lm_real beyond_rad = angle_rad - curve->angle_rad[at];
  /* The search ends above every flat piece, so a flat segment is left only at the two ends. */
  if (!(slope > 0)) {
    return curve->torque_Nm[at];
  }
  return curve->torque_Nm[at] + beyond_rad / slope;
}

lm_real lm_find_least_slope(const lm_curve *curve) {
  lm_real slope = curve->slope_rad_per_Nm[0];
  int32_t i;
  for (i = 1; i < LM_CURVE_STORE; ++i) {
    slope = least(slope, curve->slope_rad_per_Nm[i]);
  }
  return slope;
}

lm_real lm_find_greatest_slope(const lm_curve *curve) {
  lm_real slope = curve->slope_rad_per_Nm[0];
  int32_t i;
  for (i = 1; i < LM_CURVE_STORE; ++i) {
    slope = greatest(slope, curve->slope_rad_per_Nm[i]);
  }
  return slope;
}
