#include "loop.h"

#include "sine.h"

/* Values of the drive as identified at commissioning; those of the plant differ by a few
 * percent. */
#define RAD_PER_COUNT (6.28318531f / ((float)PLANT_RATIO * PLANT_ENCODER_COUNTS))
#define ROTOR_INERTIA 0.62f
#define ROTOR_FRICTION 2.4f
#define ROTOR_VISCOUS 3.0f
#define ROTOR_REVERSAL_RAD_S 0.02f /* friction feed-forward: ramp through zero speed */
#define BEARING_FRICTION 1.55f
#define BEARING_STIFFNESS 7.5e3f
#define BEARING_VISCOUS 0.6f
#define TORQUE_CONSTANT 0.1f /* N*m/A */
#define LOAD_KNOWN 0.98f     /* known over true gravity and inertia */

#define POSITION_GAIN 160.0f /* 1/s */
#define VELOCITY_GAIN 220.0f /* N*m*s/rad */
#define INTEGRAL_RATE 60.0f  /* 1/s */
/* Share of a new sample, 2 Hz: the correction moves the motor, which changes its current and the
 * reading of the torque sensor. Without a filter far below the joint's resonance this loop
 * oscillates. */
#define CURRENT_FILTER 0.006f
#define SENSOR_FILTER 0.006f
#define SPEED_FILTER 0.3f /* share of a new sample */
#define TORQUE_MAX 80.0f  /* N*m, referred to the output */

/* Limits of the ramp of the constant width; those of the library in params.h are equal. */
#define RAMP_VELOCITY 0.05f
#define RAMP_ACCELERATION 20.0f

static float clip(float value, float most) {
  return value > most ? most : value < -most ? -most : value;
}

/* A float holds every count within a turn and a quarter of the output; for a joint that goes
 * further, whole turns are subtracted first. */
static float measure(int32_t counts) {
  return (float)counts * RAD_PER_COUNT;
}

static float gravity_torque(const loop *joint, const motion *command) {
  return -joint->load.gravity_Nm * sine(command->angle_rad);
}

int loop_start(loop *joint, method how, torque_source source, const lm_parameters *parameters,
               plant_load load, float constant_half_rad, int32_t counts, const motion *now) {
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  joint->how = how;
  joint->source = source;
  joint->load.gravity_Nm = load.gravity_Nm * LOAD_KNOWN;
  joint->load.inertia_kgm2 = load.inertia_kgm2 * LOAD_KNOWN;
  joint->bearing.friction_Nm = BEARING_FRICTION;
  joint->bearing.stiffness_Nm_per_rad = BEARING_STIFFNESS;
  joint->resisting_Nm = 0;
  joint->last_angle_rad = now->angle_rad;
  joint->constant.half_rad = constant_half_rad;
  joint->constant.correction_rad = 0;
  joint->constant.velocity_rad_s = 0;
  joint->constant.side = 0;
  joint->angle_rad = measure(counts);
  joint->due_rad = joint->angle_rad;
  joint->due_off_rad = 0;
  joint->off_rad = 0;
  joint->error_rad = 0;
  joint->speed_error_rad_s = 0;
  joint->speed_rad_s = 0;
  joint->change_rad_s2 = 0;
  joint->current_Nm = 0;
  joint->bound_Nm = 0;
  joint->believed_Nm = 0;
  joint->beyond_Nm = 0;
  joint->motor_Nm = 0;
  joint->sum_Nm = 0;
  joint->correction.correction_rad = 0;
  joint->correction.velocity_rad_s = 0;
  joint->correction.acceleration_rad_s2 = 0;
  joint->correction.lost_motion_rad = 0;
  joint->correction.status = 0;
  at.torque_Nm = gravity_torque(joint, now);
  if (lm_start_compensator(&joint->compensator, parameters, at.torque_Nm, 0) != LM_OK) {
    return 1;
  }
  /* Settled before the loop closes; the command begins at the reported angle. */
  if (how == METHOD_MODEL) {
    joint->correction = lm_settle_compensator(&joint->compensator, &at);
    joint->due_off_rad = joint->correction.correction_rad;
    joint->off_rad = joint->due_off_rad;
  }
  return 0;
}

/* Torque on the output for the commanded motion. */
static float command_torque(loop *joint, const motion *command) {
  float bias_Nm = gravity_torque(joint, command) -
                  joint->load.inertia_kgm2 * command->acceleration_rad_s2 -
                  BEARING_VISCOUS * command->velocity_rad_s;
  float moved_rad = command->angle_rad - joint->last_angle_rad;
  joint->last_angle_rad = command->angle_rad;
  return lm_guess_torque(&joint->bearing, &joint->resisting_Nm, moved_rad, bias_Nm);
}

/* Torque for the model, which may differ from the feed-forward. */
static float model_torque(loop *joint, float command_Nm, float sensed_Nm) {
  static const lm_motor motor = {
      TORQUE_CONSTANT,
      (float)PLANT_RATIO,
      1.0f,
      ROTOR_INERTIA / ((float)PLANT_RATIO * PLANT_RATIO),
      ROTOR_FRICTION / (float)PLANT_RATIO,
      ROTOR_VISCOUS / ((float)PLANT_RATIO * PLANT_RATIO),
      ROTOR_REVERSAL_RAD_S * (float)PLANT_RATIO,
  };
  if (joint->source == TORQUE_WITHOUT_FRICTION) {
    return command_Nm - joint->resisting_Nm;
  }
  if (joint->source == TORQUE_FROM_CURRENT) {
    float now_Nm = lm_estimate_torque(
        &motor, joint->motor_Nm / ((float)PLANT_RATIO * TORQUE_CONSTANT),
        joint->speed_rad_s * (float)PLANT_RATIO, joint->change_rad_s2 * (float)PLANT_RATIO);
    float bound_Nm = lm_bound_torque(&motor, now_Nm, joint->speed_rad_s * (float)PLANT_RATIO);
    joint->current_Nm += CURRENT_FILTER * (now_Nm - joint->current_Nm);
    joint->bound_Nm += CURRENT_FILTER * (bound_Nm - joint->bound_Nm);
    return lm_hold_torque(&joint->believed_Nm, joint->current_Nm, joint->bound_Nm);
  }
  if (joint->source == TORQUE_FROM_SENSOR) {
    float change_Nm = SENSOR_FILTER * (sensed_Nm - command_Nm - joint->beyond_Nm);
    /* A missing sample (NaN) would remain in the filter forever. */
    joint->beyond_Nm += change_Nm - change_Nm == 0 ? change_Nm : 0;
    return command_Nm + joint->beyond_Nm;
  }
  return command_Nm;
}

/* A width by the sign of the commanded velocity, kept at standstill, reached along a trapezoid. */
static void follow_constant(constant_width *c, float velocity_rad_s) {
  float left;
  float wish;
  float change = RAMP_ACCELERATION * TICK_S;
  c->side = velocity_rad_s > 0 ? 1.0f : velocity_rad_s < 0 ? -1.0f : c->side;
  left = c->side * c->half_rad - c->correction_rad;
  wish = square_root(2 * RAMP_ACCELERATION * (left < 0 ? -left : left));
  /* In the last tick only the remaining distance. */
  wish = clip(wish, (left < 0 ? -left : left) / TICK_S);
  wish = clip(left < 0 ? -wish : wish, RAMP_VELOCITY);
  c->velocity_rad_s += clip(wish - c->velocity_rad_s, change);
  c->correction_rad += c->velocity_rad_s * TICK_S;
}

static void compensate(loop *joint, float torque_Nm, const motion *command) {
  if (joint->how == METHOD_MODEL) {
    lm_conditions at = LM_CONDITIONS_UNKNOWN;
    at.torque_Nm = torque_Nm;
    at.elapsed_s = TICK_S;
    joint->correction = lm_step_compensator(&joint->compensator, &at);
  } else if (joint->how == METHOD_CONSTANT) {
    follow_constant(&joint->constant, command->velocity_rad_s);
    joint->correction.correction_rad = joint->constant.correction_rad;
    joint->correction.velocity_rad_s = joint->constant.velocity_rad_s;
  }
}

float loop_tick(loop *joint, int32_t counts, float sensed_Nm, const motion *next) {
  float torque_Nm = command_torque(joint, next);
  float angle_rad = measure(counts);
  float error_rad;
  float wish_rad_s;
  float velocity_rad_s;
  float motor_Nm;
  joint->change_rad_s2 = -joint->speed_rad_s * (1 / TICK_S);
  joint->speed_rad_s = (angle_rad - joint->angle_rad) * (1 / TICK_S);
  joint->change_rad_s2 += joint->speed_rad_s * (1 / TICK_S);
  joint->angle_rad = angle_rad;
  joint->off_rad = joint->due_off_rad;
  /* Command and encoder pass the same filter, so that a steady motion leaves no error. */
  error_rad = joint->due_rad - angle_rad;
  joint->speed_error_rad_s +=
      SPEED_FILTER * ((error_rad - joint->error_rad) * (1 / TICK_S) - joint->speed_error_rad_s);
  joint->error_rad = error_rad;
  wish_rad_s = POSITION_GAIN * error_rad + joint->speed_error_rad_s;
  joint->sum_Nm =
      clip(joint->sum_Nm + INTEGRAL_RATE * TICK_S * VELOCITY_GAIN * wish_rad_s, TORQUE_MAX);

  compensate(joint, model_torque(joint, torque_Nm, sensed_Nm), next);
  joint->due_off_rad = joint->correction.correction_rad;
  joint->due_rad = next->angle_rad + joint->due_off_rad;
  velocity_rad_s = next->velocity_rad_s + joint->correction.velocity_rad_s;
  motor_Nm = ROTOR_INERTIA * (next->acceleration_rad_s2 + joint->correction.acceleration_rad_s2) +
             ROTOR_FRICTION * clip(velocity_rad_s / ROTOR_REVERSAL_RAD_S, 1) +
             ROTOR_VISCOUS * velocity_rad_s - torque_Nm;
  joint->motor_Nm = clip(motor_Nm + VELOCITY_GAIN * wish_rad_s + joint->sum_Nm, TORQUE_MAX);
  return joint->motor_Nm;
}

float loop_position(const loop *joint) {
  return joint->angle_rad - joint->off_rad;
}
