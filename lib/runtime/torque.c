#include "lostmotion/torque.h"

#include "runtime/number.h"

lm_status lm_check_motor(const lm_motor *motor, lm_fault *fault) {
  lm_status status;
  if (!motor) {
    return lm_refuse(fault, LM_NULL, "motor", 0, 0, 0);
  }
  status = lm_check_range(fault, "torque_constant_Nm_per_A",
                          absolute(motor->torque_constant_Nm_per_A), SMALLEST, LARGEST);
  if (status == LM_OK) {
    status = lm_check_range(fault, "ratio", absolute(motor->ratio), SMALLEST, LARGEST);
  }
  if (status == LM_OK) {
    status = lm_check_range(fault, "efficiency", motor->efficiency, SMALLEST, 1);
  }
  if (status == LM_OK) {
    status = lm_check_range(fault, "rotor_inertia_kg_m2", motor->rotor_inertia_kg_m2, 0, LARGEST);
  }
  if (status == LM_OK) {
    status = lm_check_range(fault, "coulomb_Nm", motor->coulomb_Nm, 0, LARGEST);
  }
  if (status == LM_OK) {
    status = lm_check_range(fault, "viscous_Nm_s", motor->viscous_Nm_s, 0, LARGEST);
  }
  if (status == LM_OK) {
    status = lm_check_range(fault, "standstill_rad_s", motor->standstill_rad_s, SMALLEST, LARGEST);
  }
  return status;
}

lm_real lm_estimate_torque(const lm_motor *motor, lm_real current_A, lm_real velocity_rad_s,
                           lm_real acceleration_rad_s2) {
  lm_real moving = clamp(velocity_rad_s / motor->standstill_rad_s, -1, 1);
  lm_real rotor_Nm = motor->torque_constant_Nm_per_A * current_A -
                     motor->rotor_inertia_kg_m2 * acceleration_rad_s2 - motor->coulomb_Nm * moving -
                     motor->viscous_Nm_s * velocity_rad_s;
  /* 1 if the motor drives, -1 if it is driven, in between at standstill. */
  lm_real drives = rotor_Nm >= 0 ? moving : -moving;
  lm_real factor =
      drives >= 0 ? 1 - drives * (1 - motor->efficiency) : 1 - drives * (1 / motor->efficiency - 1);
  return -rotor_Nm * motor->ratio * factor;
}

/* At standstill rotor * ratio is estimated; the torque is (rotor +- coulomb) * ratio, times the
 * efficiency or divided by it. The latter is further away. */
lm_real lm_bound_torque(const lm_motor *motor, lm_real torque_Nm, lm_real velocity_rad_s) {
  lm_real moving = clamp(absolute(velocity_rad_s / motor->standstill_rad_s), 0, 1);
  lm_real hidden_Nm =
      motor->coulomb_Nm * absolute(motor->ratio) + absolute(torque_Nm) * (1 - motor->efficiency);
  return hidden_Nm / motor->efficiency * (1 - moving);
}

lm_real lm_hold_torque(lm_real *believed_Nm, lm_real torque_Nm, lm_real uncertainty_Nm) {
  if (is_finite(torque_Nm)) {
    lm_real unsure_Nm = is_finite(uncertainty_Nm) ? greatest(uncertainty_Nm, 0) : 0;
    *believed_Nm = clamp(*believed_Nm, torque_Nm - unsure_Nm, torque_Nm + unsure_Nm);
  }
  return *believed_Nm;
}

lm_real lm_guess_torque(const lm_load_guess *guess, lm_real *resisting_Nm, lm_real moved_rad,
                        lm_real bias_Nm) {
  if (is_finite(moved_rad)) {
    *resisting_Nm = clamp(*resisting_Nm - guess->stiffness_Nm_per_rad * moved_rad,
                          -guess->friction_Nm, guess->friction_Nm);
  }
  return *resisting_Nm + bias_Nm;
}
