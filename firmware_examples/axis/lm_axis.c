#include "lm_axis.h"

float lm_axis_reported(const lm_axis *a, float motor_rad) {
  return motor_rad - a->correction.correction_rad + a->zero_rad;
}

static void forget_standstill(lm_axis *a) {
  a->standstill.ticks = 0;
  a->stood_s = 0;
}

lm_status lm_axis_power_up(lm_axis *a, const lm_parameters *parameters, lm_saved *kept,
                           const lm_conditions *at, float motor_rad, lm_fault *fault) {
  const lm_status status = lm_start_compensator(&a->compensator, parameters, at->torque_Nm, fault);
  if (status == LM_OK && kept) {
    /* A history that was never saved, or belongs to other parameters, is refused: the memory
     * remains unknown. */
    (void)lm_restore_compensator(&a->compensator, kept, 0);
    kept->format = 0;
  }
  a->correction = lm_settle_compensator(&a->compensator, at);
  a->state = status == LM_OK ? LM_AXIS_OPEN : LM_AXIS_OFF;
  forget_standstill(a);
  a->rang = 0;
  a->zero_rad = 0;
  a->command_rad = lm_axis_reported(a, motor_rad);
  return status;
}

/* With the loop open the correction moves nothing. What looks like ringing then is the load that
 * swings against the brake. */
static void judge_ringing(lm_axis *a) {
  const int rings = (a->correction.status & LM_STATE_RINGING) != 0;
  if (a->state == LM_AXIS_CLOSED) {
    a->rang = rings;
  } else if (rings && !a->rang) {
    lm_axis_set_mode(a, LM_MODE_RESET);
    lm_axis_set_mode(a, LM_MODE_RUN);
  }
}

float lm_axis_tick(lm_axis *a, const lm_conditions *at, float motor_rad, float wish_rad) {
  a->correction = lm_step_compensator(&a->compensator, at);
  a->stood_s = lm_find_standstill(&a->compensator, &a->standstill);
  judge_ringing(a);
  if (a->state != LM_AXIS_CLOSED) {
    a->command_rad = lm_axis_reported(a, motor_rad);
    return motor_rad; /* no position error */
  }
  a->command_rad = wish_rad;
  return wish_rad - a->zero_rad + a->correction.correction_rad;
}

static int stands(const lm_axis *a) {
  return a->state == LM_AXIS_OPEN && a->stood_s >= LM_AXIS_STAND_S;
}

int lm_axis_close(lm_axis *a) {
  if (!stands(a)) {
    return 1;
  }
  a->state = LM_AXIS_CLOSED;
  return 0;
}

void lm_axis_open(lm_axis *a) {
  if (a->state == LM_AXIS_CLOSED) {
    a->state = LM_AXIS_OPEN;
    forget_standstill(a);
  }
}

void lm_axis_set_mode(lm_axis *a, lm_mode mode) {
  lm_set_mode(&a->compensator, mode);
  forget_standstill(a);
}

lm_status lm_axis_change(lm_axis *a, const lm_parameters *parameters, lm_fault *fault) {
  forget_standstill(a);
  return lm_change_parameters(&a->compensator, parameters, fault);
}

float lm_axis_reference(lm_axis *a, float motor_rad, float angle_rad) {
  const float shift_rad = angle_rad - lm_axis_reported(a, motor_rad);
  const float late_rad = a->correction.correction_rad + a->correction.lost_motion_rad;
  if (a->state == LM_AXIS_OFF) {
    return -1;
  }
  a->zero_rad += shift_rad;
  a->command_rad += shift_rad;
  return (late_rad < 0 ? -late_rad : late_rad) + lm_bound_uncertainty(&a->compensator);
}

int lm_axis_power_down(lm_axis *a, lm_saved *kept) {
  if (!stands(a)) {
    return 1;
  }
  lm_save_compensator(&a->compensator, kept);
  a->state = LM_AXIS_OFF;
  return 0;
}
