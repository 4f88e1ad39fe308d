#include "axis.h"

static lm_conditions conditions(float torque_Nm) {
  lm_conditions at = LM_CONDITIONS_UNKNOWN; /* fill in here what the effects need */
  at.torque_Nm = torque_Nm;
  return at;
}

float axis_reported(const axis *a, float motor_rad) {
  return motor_rad - a->correction.correction_rad + a->zero_rad;
}

lm_status axis_power_up(axis *a, const lm_parameters *parameters, const lm_saved *kept,
                        float torque_Nm, float motor_rad, lm_fault *fault) {
  lm_conditions at = conditions(torque_Nm);
  lm_status status = lm_start_compensator(&a->compensator, parameters, torque_Nm, fault);
  a->state = AXIS_OPEN;
  a->zero_rad = 0;
  if (status == LM_OK && kept) {
    (void)lm_restore_compensator(&a->compensator, kept, 0);
  }
  a->correction = lm_settle_compensator(&a->compensator, &at);
  a->command_rad = axis_reported(a, motor_rad);
  return status;
}

int axis_close(axis *a) {
  if (a->state == AXIS_OFF || (a->correction.status & LM_STATE_NOT_STARTED)) {
    return 1;
  }
  lm_set_mode(&a->compensator, LM_MODE_RUN);
  a->state = AXIS_CLOSED;
  return 0;
}

void axis_brake(axis *a) {
  lm_set_mode(&a->compensator, LM_MODE_RUN);
  a->state = AXIS_BRAKED;
}

void axis_home(axis *a) {
  if (a->state == AXIS_CLOSED) {
    lm_set_mode(&a->compensator, LM_MODE_HOLD);
    a->state = AXIS_HOMING;
  }
}

int axis_reference(axis *a, float motor_rad, float angle_rad) {
  const uint32_t status = a->correction.status;
  if (a->state != AXIS_HOMING || !(status & LM_STATE_SETTLED) ||
      lm_bound_uncertainty(&a->compensator) > 0) {
    return 1;
  }
  a->zero_rad += angle_rad - axis_reported(a, motor_rad);
  a->command_rad = angle_rad;
  return axis_close(a);
}

float axis_tick(axis *a, float torque_Nm, float motor_rad, float wish_rad) {
  lm_conditions at = conditions(torque_Nm);
  a->correction = lm_step_compensator(&a->compensator, &at);
  if (a->state != AXIS_CLOSED && a->state != AXIS_HOMING) {
    a->command_rad = axis_reported(a, motor_rad);
    return motor_rad; /* braked or off: no position error */
  }
  a->command_rad = wish_rad;
  return wish_rad - a->zero_rad + a->correction.correction_rad;
}

void axis_power_down(axis *a, lm_saved *kept) {
  lm_save_compensator(&a->compensator, kept);
  a->state = AXIS_OFF;
}
