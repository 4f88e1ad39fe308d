#include "lostmotion/torsion_chain.h"

#include "elastic_ranges.h"
#include "real_math.h"
#include "refuse.h"

#define RATIO_MIN LM_REAL(1e-3)
#define RATIO_MAX LM_REAL(1e5)

lm_status lm_check_torsion_elements(const lm_torsion_element *elements, int count,
                                    lm_fault *fault) {
  lm_status status = check_chain(fault, "torsion_chain", elements, count);
  int i = 0;
  for (i = 0; status == LM_OK && i < count; ++i) {
    const bound bounds[] = {
        {"torsion_chain.stiffness_Nm_per_rad", elements[i].stiffness_Nm_per_rad, STIFFNESS_MIN,
         STIFFNESS_MAX},
        {"torsion_chain.ratio", real_fabs(elements[i].ratio), RATIO_MIN, RATIO_MAX},
    };
    status = check_bounds(fault, bounds, COUNT_OF(bounds));
  }
  return status;
}

static lm_status put_element(lm_real stiffness_Nm_per_rad, lm_real ratio,
                             lm_torsion_element *element, lm_fault *fault) {
  lm_status status = LM_OK;
  lm_torsion_element made;
  made.stiffness_Nm_per_rad = stiffness_Nm_per_rad;
  made.ratio = ratio;
  if (element == 0) {
    return refuse(fault, LM_NULL, "element");
  }
  status = lm_check_torsion_elements(&made, 1, fault);
  if (status == LM_OK) {
    *element = made;
  }
  return status;
}

lm_status lm_make_shaft_torsion(lm_real outer_diameter_mm, lm_real bore_mm, lm_real length_mm,
                                lm_real shear_modulus_MPa, lm_real ratio,
                                lm_torsion_element *element, lm_fault *fault) {
  const bound bounds[] = {
      {"outer_diameter_mm", outer_diameter_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"bore_mm", bore_mm, LM_REAL(0), LENGTH_MAX_MM},
      {"length_mm", length_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"shear_modulus_MPa", shear_modulus_MPa, LM_REAL(1), MODULUS_MAX_MPA},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  lm_real inertia = LM_REAL(0);
  if (status != LM_OK) {
    return status;
  }
  if (!(bore_mm < outer_diameter_mm)) {
    return refuse_contradiction(fault, "bore_mm", bore_mm, LM_REAL(0), outer_diameter_mm);
  }
  /* D^4 - d^4 factored, so that a thin tube keeps its digits. */
  inertia = LM_PI / LM_REAL(32) * (outer_diameter_mm - bore_mm) * (outer_diameter_mm + bore_mm) *
            (outer_diameter_mm * outer_diameter_mm + bore_mm * bore_mm);
  return put_element(shear_modulus_MPa * inertia / (length_mm * NMM_PER_NM), ratio, element, fault);
}

lm_status lm_make_shell_torsion(lm_real mean_radius_mm, lm_real wall_mm, lm_real length_mm,
                                lm_real shear_modulus_MPa, lm_torsion_element *element,
                                lm_fault *fault) {
  const bound bounds[] = {
      {"mean_radius_mm", mean_radius_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"wall_mm", wall_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"length_mm", length_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"shear_modulus_MPa", shear_modulus_MPa, LM_REAL(1), MODULUS_MAX_MPA},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  lm_real inertia = LM_REAL(0);
  if (status != LM_OK) {
    return status;
  }
  if (!(wall_mm < LM_REAL(2) * mean_radius_mm)) {
    return refuse_contradiction(fault, "wall_mm", wall_mm, LENGTH_MIN_MM,
                                LM_REAL(2) * mean_radius_mm);
  }
  /* pi/2 (r_o^4 - r_i^4) with r_o,i = r +- s/2. */
  inertia = LM_REAL(2) * LM_PI * mean_radius_mm * wall_mm *
            (mean_radius_mm * mean_radius_mm + wall_mm * wall_mm / LM_REAL(4));
  return put_element(shear_modulus_MPa * inertia / (length_mm * NMM_PER_NM), LM_REAL(1), element,
                     fault);
}

lm_status lm_make_diaphragm_torsion(lm_real hub_radius_mm, lm_real outer_radius_mm,
                                    lm_real thickness_mm, lm_real shear_modulus_MPa,
                                    lm_torsion_element *element, lm_fault *fault) {
  const bound bounds[] = {
      {"hub_radius_mm", hub_radius_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"outer_radius_mm", outer_radius_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"thickness_mm", thickness_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"shear_modulus_MPa", shear_modulus_MPa, LM_REAL(1), MODULUS_MAX_MPA},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  lm_real ratio = LM_REAL(0);
  lm_real twist = LM_REAL(0);
  if (status != LM_OK) {
    return status;
  }
  if (!(hub_radius_mm < outer_radius_mm)) {
    return refuse_contradiction(fault, "hub_radius_mm", hub_radius_mm, LENGTH_MIN_MM,
                                outer_radius_mm);
  }
  /* a^-2 - r^-2 = (1 - q) (1 + q) / a^2 with q = a / r. Shear stress T / (2 pi rho^2 h): its twist
   * d(v / rho) = tau / (G rho) d rho integrates to T (a^-2 - r^-2) / (4 pi G h). */
  ratio = hub_radius_mm / outer_radius_mm;
  twist = (outer_radius_mm - hub_radius_mm) / outer_radius_mm * (LM_REAL(1) + ratio);
  return put_element(LM_REAL(4) * LM_PI * shear_modulus_MPa * thickness_mm * hub_radius_mm *
                         hub_radius_mm / (twist * NMM_PER_NM),
                     LM_REAL(1), element, fault);
}

lm_status lm_make_input_lock(lm_real stiffness_Nm_per_rad, lm_real ratio,
                             lm_torsion_element *element, lm_fault *fault) {
  return put_element(stiffness_Nm_per_rad, ratio, element, fault);
}

lm_status lm_sum_torsion(lm_real torque_Nm, const lm_torsion_element *elements, int count,
                         lm_real *angle_rad, lm_real *compliance_rad_per_Nm, lm_fault *fault) {
  lm_status status = check_range(fault, "torque_Nm", torque_Nm, -TORQUE_MAX_NM, TORQUE_MAX_NM);
  lm_real compliance = LM_REAL(0);
  int i = 0;
  if (status == LM_OK) {
    status = lm_check_torsion_elements(elements, count, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  if (angle_rad == 0 || compliance_rad_per_Nm == 0) {
    return refuse(fault, LM_NULL, "angle_rad or compliance_rad_per_Nm");
  }
  for (i = 0; i < count; ++i) {
    compliance +=
        LM_REAL(1) / (elements[i].stiffness_Nm_per_rad * elements[i].ratio * elements[i].ratio);
  }
  *angle_rad = torque_Nm * compliance;
  *compliance_rad_per_Nm = compliance;
  return LM_OK;
}
