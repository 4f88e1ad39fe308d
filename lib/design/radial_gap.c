#include "lostmotion/radial_gap.h"

#include "elastic_ranges.h"
#include "real_math.h"
#include "refuse.h"

#define FLANK_ANGLE_MIN LM_REAL(0.01) /* if the tangent is a divisor */

/* Deflection of a ring under two opposite point forces, each side, in F R^3 / (E I):
 * 0.07439. */
#define RING_POINT_LOAD ((LM_PI / LM_REAL(4) - LM_REAL(2) / LM_PI) / LM_REAL(2))

lm_status lm_radial_gap_sum(lm_real generator_gap_mm, lm_real teeth_gap_mm, lm_real *gap_mm,
                            lm_fault *fault) {
  const bound bounds[] = {
      {"generator_gap_mm", generator_gap_mm, LM_REAL(0), DISPLACEMENT_MAX_MM},
      {"teeth_gap_mm", teeth_gap_mm, LM_REAL(0), DISPLACEMENT_MAX_MM},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  if (status != LM_OK) {
    return status;
  }
  if (gap_mm == 0) {
    return refuse(fault, LM_NULL, "gap_mm");
  }
  *gap_mm = generator_gap_mm + teeth_gap_mm;
  return LM_OK;
}

lm_status lm_radial_gap_angle(lm_real gap_mm, lm_real flank_angle_rad, lm_real radius_mm,
                              lm_real *angle_rad, lm_fault *fault) {
  const bound bounds[] = {
      {"gap_mm", gap_mm, LM_REAL(0), DISPLACEMENT_MAX_MM},
      {"flank_angle_rad", flank_angle_rad, LM_REAL(0), FLANK_ANGLE_MAX},
      {"radius_mm", radius_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  if (status != LM_OK) {
    return status;
  }
  if (angle_rad == 0) {
    return refuse(fault, LM_NULL, "angle_rad");
  }
  *angle_rad = gap_mm * real_tan(flank_angle_rad) / radius_mm;
  return LM_OK;
}

lm_status lm_ring_stiffness(lm_real mean_radius_mm, lm_real thickness_mm, lm_real width_mm,
                            lm_real youngs_modulus_MPa, lm_real stiffening,
                            lm_real *stiffness_N_per_mm, lm_fault *fault) {
  const bound bounds[] = {
      {"mean_radius_mm", mean_radius_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"thickness_mm", thickness_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"width_mm", width_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"youngs_modulus_MPa", youngs_modulus_MPa, LM_REAL(1), MODULUS_MAX_MPA},
      {"stiffening", stiffening, LM_REAL(1), LM_REAL(20)},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  lm_real slimness = LM_REAL(0);
  if (status != LM_OK) {
    return status;
  }
  if (stiffness_N_per_mm == 0) {
    return refuse(fault, LM_NULL, "stiffness_N_per_mm");
  }
  slimness = thickness_mm / mean_radius_mm;
  *stiffness_N_per_mm = stiffening * youngs_modulus_MPa * width_mm * slimness * slimness *
                        slimness / (LM_REAL(12) * RING_POINT_LOAD);
  return LM_OK;
}

lm_status lm_gap_closing_torque(lm_real gap_mm, lm_real radius_mm, lm_real ring_stiffness_N_per_mm,
                                lm_real flank_angle_rad, lm_real *torque_Nm, lm_fault *fault) {
  const bound bounds[] = {
      {"gap_mm", gap_mm, LM_REAL(0), DISPLACEMENT_MAX_MM},
      {"radius_mm", radius_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"ring_stiffness_N_per_mm", ring_stiffness_N_per_mm, STIFFNESS_MIN, STIFFNESS_MAX},
      {"flank_angle_rad", flank_angle_rad, FLANK_ANGLE_MIN, FLANK_ANGLE_MAX},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  if (status != LM_OK) {
    return status;
  }
  if (torque_Nm == 0) {
    return refuse(fault, LM_NULL, "torque_Nm");
  }
  *torque_Nm = LM_REAL(2) * radius_mm * ring_stiffness_N_per_mm * gap_mm /
               (real_tan(flank_angle_rad) * NMM_PER_NM);
  return LM_OK;
}

/* Inputs of both forms of (9a). */
static lm_status check_gap_rotation(lm_real torque_Nm, lm_real closing_torque_Nm,
                                    lm_real full_angle_rad, const lm_real *angle_rad,
                                    lm_fault *fault) {
  const bound bounds[] = {
      {"torque_Nm", torque_Nm, -TORQUE_MAX_NM, TORQUE_MAX_NM},
      {"closing_torque_Nm", closing_torque_Nm, LM_REAL(0), TORQUE_MAX_NM},
      {"full_angle_rad", full_angle_rad, LM_REAL(0), LM_REAL(1)},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  if (status == LM_OK && angle_rad == 0) {
    return refuse(fault, LM_NULL, "angle_rad");
  }
  return status;
}

lm_status lm_gap_rotation(lm_real torque_Nm, lm_real closing_torque_Nm, lm_real full_angle_rad,
                          lm_real *angle_rad, lm_fault *fault) {
  const lm_status status =
      check_gap_rotation(torque_Nm, closing_torque_Nm, full_angle_rad, angle_rad, fault);
  if (status != LM_OK) {
    return status;
  }
  if (torque_Nm > closing_torque_Nm) {
    *angle_rad = full_angle_rad;
  } else if (torque_Nm < -closing_torque_Nm) {
    *angle_rad = -full_angle_rad;
  } else if (closing_torque_Nm > LM_REAL(0)) {
    *angle_rad = torque_Nm / closing_torque_Nm * full_angle_rad;
  } else {
    *angle_rad = LM_REAL(0);
  }
  return LM_OK;
}

lm_status lm_gap_rotation_smooth(lm_real torque_Nm, lm_real closing_torque_Nm,
                                 lm_real full_angle_rad, lm_real *angle_rad, lm_fault *fault) {
  /* tanh(20) is 1 to double precision: above it the quotient is not computed. */
  const lm_real saturation = LM_REAL(20);
  const lm_status status =
      check_gap_rotation(torque_Nm, closing_torque_Nm, full_angle_rad, angle_rad, fault);
  if (status != LM_OK) {
    return status;
  }
  if (torque_Nm > saturation * closing_torque_Nm) {
    *angle_rad = full_angle_rad;
  } else if (torque_Nm < -saturation * closing_torque_Nm) {
    *angle_rad = -full_angle_rad;
  } else if (closing_torque_Nm > LM_REAL(0)) {
    /* tanh |x| = (1 - e^-2|x|) / (1 + e^-2|x|): odd to the last bit, no overflow. */
    const lm_real decay = real_exp(LM_REAL(-2) * real_fabs(torque_Nm) / closing_torque_Nm);
    const lm_real rise = full_angle_rad * ((LM_REAL(1) - decay) / (LM_REAL(1) + decay));
    *angle_rad = torque_Nm < LM_REAL(0) ? -rise : rise;
  } else {
    *angle_rad = LM_REAL(0);
  }
  return LM_OK;
}
