#include "lm_axis.h"

float lm_axis_reported(const lm_axis *a, float motor_rad) {
  return motor_rad - a->correction.correction_rad + a->zero_rad;
}

static int is_finite(float value) {
  return value - value == 0;
}

static void forget_standstill(lm_axis *a) {
  a->standstill.ticks = 0;
  a->stood_s = 0;
}

static void take_parameters(lm_axis *a, const lm_parameters *parameters) {
  a->stand_s = LM_AXIS_STAND / parameters->limits.response_per_s;
  a->rang = 0;
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
  a->state = LM_AXIS_OFF;
  if (status == LM_OK) {
    a->state = LM_AXIS_OPEN;
    take_parameters(a, parameters);
  }
  forget_standstill(a);
  a->stood_at_rad = motor_rad;
  a->mode = LM_MODE_RUN;
  a->zero_rad = 0;
  a->setpoint_rad = motor_rad;
  a->command_rad = lm_axis_reported(a, motor_rad);
  return status;
}

/* With the motor at rest the correction moves nothing. What looks like ringing then is the load
 * that swings against the brake. */
static void judge_ringing(lm_axis *a) {
  const int rings = (a->correction.status & LM_STATE_RINGING) != 0;
  if (a->state == LM_AXIS_CLOSED) {
    a->rang = rings;
  } else if (rings && !a->rang) {
    lm_set_mode(&a->compensator, LM_MODE_RESET);
    lm_set_mode(&a->compensator, a->mode);
    forget_standstill(a);
  }
}

/* The target is not that of the actual load, or the open motor moves. */
#define NOT_TO_CLOSE (LM_STATE_CONDITION_MISSING | LM_STATE_INPUT_REFUSED)
static void judge_standstill(lm_axis *a, float motor_rad) {
  const float moved_rad = motor_rad - a->stood_at_rad;
  const int moves = a->state == LM_AXIS_OPEN &&
                    !(moved_rad < LM_AXIS_STILL_RAD && moved_rad > -LM_AXIS_STILL_RAD);
  a->stood_s = lm_find_standstill(&a->compensator, &a->standstill);
  if (moves || (a->correction.status & NOT_TO_CLOSE)) {
    a->stood_at_rad = motor_rad;
    forget_standstill(a);
  }
}

float lm_axis_tick(lm_axis *a, const lm_conditions *at, float motor_rad, float wish_rad) {
  a->correction = lm_step_compensator(&a->compensator, at);
  judge_standstill(a, motor_rad);
  judge_ringing(a);
  if (a->state == LM_AXIS_CLOSED) {
    if (is_finite(wish_rad)) {
      a->command_rad = wish_rad;
    }
    a->setpoint_rad = a->command_rad - a->zero_rad + a->correction.correction_rad;
    return a->setpoint_rad;
  }
  a->correction.velocity_rad_s = 0; /* the motor does not follow */
  a->correction.acceleration_rad_s2 = 0;
  if (a->state != LM_AXIS_HELD && is_finite(motor_rad)) {
    a->setpoint_rad = motor_rad; /* no position error */
  }
  a->command_rad = lm_axis_reported(a, a->setpoint_rad);
  return a->setpoint_rad;
}

static int stands(const lm_axis *a, lm_axis_state state) {
  return a->state == state && a->stood_s >= a->stand_s;
}

int lm_axis_close(lm_axis *a) {
  if (!stands(a, LM_AXIS_OPEN) && !stands(a, LM_AXIS_HELD)) {
    return 1;
  }
  a->state = LM_AXIS_CLOSED;
  return 0;
}

void lm_axis_hold(lm_axis *a) {
  if (a->state == LM_AXIS_CLOSED) {
    a->state = LM_AXIS_HELD;
  }
  forget_standstill(a);
}

void lm_axis_open(lm_axis *a) {
  if (a->state == LM_AXIS_CLOSED || a->state == LM_AXIS_HELD) {
    a->state = LM_AXIS_OPEN;
    a->stood_at_rad = a->setpoint_rad;
    forget_standstill(a);
  }
}

void lm_axis_set_mode(lm_axis *a, lm_mode mode) {
  lm_set_mode(&a->compensator, mode);
  a->mode = mode;
  a->rang = mode == LM_MODE_RESET ? 0 : a->rang;
  forget_standstill(a);
}

lm_status lm_axis_change(lm_axis *a, const lm_parameters *parameters, lm_fault *fault) {
  const lm_status status = lm_change_parameters(&a->compensator, parameters, fault);
  if (status == LM_OK) {
    take_parameters(a, parameters);
  }
  forget_standstill(a);
  return status;
}

void lm_axis_set_zero(lm_axis *a, float zero_rad) {
  if (is_finite(zero_rad)) {
    a->command_rad += zero_rad - a->zero_rad;
    a->zero_rad = zero_rad;
    forget_standstill(a); /* a torque that is computed from the angle changes */
  }
}

float lm_axis_reference(lm_axis *a, float motor_rad, float angle_rad) {
  const float shift_rad = angle_rad - lm_axis_reported(a, motor_rad);
  const float late_rad = a->correction.correction_rad + a->correction.lost_motion_rad;
  if (a->state == LM_AXIS_OFF || !is_finite(shift_rad)) {
    return -1;
  }
  lm_axis_set_zero(a, a->zero_rad + shift_rad);
  return (late_rad < 0 ? -late_rad : late_rad) + lm_bound_uncertainty(&a->compensator);
}

int lm_axis_power_down(lm_axis *a, lm_saved *kept) {
  if (!stands(a, LM_AXIS_OPEN)) {
    return 1;
  }
  lm_save_compensator(&a->compensator, kept);
  a->state = LM_AXIS_OFF;
  return 0;
}
