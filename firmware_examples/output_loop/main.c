/* A position loop on the output encoder with a velocity loop on the motor.
 *
 * The encoder measures the lost motion, and the loop corrects it within its bandwidth. It is too
 * slow when the load reverses and the motor must cross the lost motion. The model predicts the
 * required motor velocity before the encoder measures an error. The rate of the correction is
 * added to the commanded motor velocity and its acceleration to the commanded acceleration;
 * nothing is added to the position.
 *
 * Runs the joint of ../joint without and with the rate, and with a typical mistake: the correction
 * added to the commanded position, which makes the output deviate by the whole correction. The
 * exit code is 0 if the rate reduces the error and the mistake increases it. */
#include "../joint/motion.h"
#include "../joint/params.h"
#include "../joint/sine.h"
#include "target.h"

#define POSITION_GAIN 60.0f  /* 1/s: limited by the compliance between motor and output encoder */
#define VELOCITY_GAIN 220.0f /* N*m*s/rad */
#define INTEGRAL_RATE 30.0f  /* 1/s */
#define ROTOR_INERTIA 0.62f  /* as identified at commissioning; differs from the plant */
#define ROTOR_FRICTION 2.4f
#define ROTOR_VISCOUS 3.0f
#define ROTOR_REVERSAL_RAD_S 0.02f
#define LOAD_KNOWN 0.98f
#define TORQUE_MAX 80.0f
#define OUTPUT_COUNTS 16777216.0f /* of a turn: 24 bits */
#define RAD_PER_COUNT (6.28318531f / ((float)PLANT_RATIO * PLANT_ENCODER_COUNTS))
#define RAD_TO_ARCSEC 206264.81f
#define STEPS_PER_TICK 4

typedef enum use { WITHOUT, RATE, POSITION } use;

static const lm_load_guess bearing = {1.55f, 7.5e3f};

static float clip(float value, float most) {
  return value > most ? most : value < -most ? -most : value;
}

static float read_output(const plant *joint) {
  const float step_rad = 6.28318531f / OUTPUT_COUNTS;
  return (float)(int32_t)(plant_output(joint) / step_rad) * step_rad;
}

typedef struct drive {
  lm_compensator compensator;
  lm_correction correction;
  float resisting_Nm;
  motion due; /* command and motor velocity of the previous tick */
  float due_rad_s, before_rad_s;
  float motor_rad, sum_Nm;
} drive;

/* One tick: the motor's torque. */
static float control(drive *d, const plant *joint, const plant_load *load, const motion *next,
                     use how) {
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  float motor_rad = (float)plant_read_encoder(joint) * RAD_PER_COUNT;
  float speed_rad_s = (motor_rad - d->motor_rad) / TICK_S;
  float load_Nm = -LOAD_KNOWN * (load->gravity_Nm * sine(next->angle_rad) +
                                 load->inertia_kgm2 * next->acceleration_rad_s2);
  /* The measurements belong to the command of the previous tick. */
  float error_rad = d->due.angle_rad - read_output(joint);
  float due_rad_s = d->due_rad_s;
  float feed_rad_s = next->velocity_rad_s;
  float feed_rad_s2 = next->acceleration_rad_s2;
  float wish_rad_s;
  float push_Nm;
  load_Nm =
      lm_guess_torque(&bearing, &d->resisting_Nm, next->angle_rad - d->due.angle_rad, load_Nm);
  d->motor_rad = motor_rad;
  at.torque_Nm = load_Nm;
  d->correction = lm_step_compensator(&d->compensator, &at);
  if (how == RATE) { /* the motor crosses the lost motion at the rate of the model */
    feed_rad_s += d->correction.velocity_rad_s;
    feed_rad_s2 += d->correction.acceleration_rad_s2;
  } else if (how == POSITION) { /* the mistake */
    error_rad += d->correction.correction_rad;
  }
  /* The mean speed over a tick is that at its middle. */
  wish_rad_s = 0.5f * (due_rad_s + d->before_rad_s) + POSITION_GAIN * error_rad - speed_rad_s;
  d->before_rad_s = due_rad_s;
  d->due_rad_s = feed_rad_s;
  d->due = *next;
  d->sum_Nm = clip(d->sum_Nm + INTEGRAL_RATE * TICK_S * VELOCITY_GAIN * wish_rad_s, TORQUE_MAX);
  push_Nm = VELOCITY_GAIN * wish_rad_s + d->sum_Nm - load_Nm + ROTOR_INERTIA * feed_rad_s2 +
            ROTOR_VISCOUS * feed_rad_s +
            ROTOR_FRICTION * clip(feed_rad_s / ROTOR_REVERSAL_RAD_S, 1);
  return clip(push_Nm, TORQUE_MAX);
}

/* Root mean square of output - command [arcsec], or -1 if the parameters are refused. */
static float run(const scenario *what, use how) {
  static plant joint;
  static drive d;
  int32_t ticks = scenario_ticks(what);
  int32_t from = unscored_ticks(what);
  int32_t tick;
  motion now = scenario_at(what, 0);
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  float sum = 0;
  plant_start(&joint, what->load);
  at.torque_Nm = -LOAD_KNOWN * what->load.gravity_Nm * sine(now.angle_rad);
  d.resisting_Nm = 0;
  d.motor_rad = (float)plant_read_encoder(&joint) * RAD_PER_COUNT;
  d.due = now;
  d.due_rad_s = 0;
  d.before_rad_s = 0;
  d.sum_Nm = 0;
  if (lm_start_compensator(&d.compensator, &joint_parameters, at.torque_Nm, 0) != LM_OK) {
    return -1;
  }
  d.correction = lm_settle_compensator(&d.compensator, &at);
  for (tick = 0; tick < ticks; ++tick) {
    float error = (plant_output(&joint) - now.angle_rad) * RAD_TO_ARCSEC;
    float motor_Nm;
    int step;
    sum += tick >= from ? error * error : 0;
    now = scenario_at(what, tick + 1);
    motor_Nm = control(&d, &joint, &what->load, &now, how);
    for (step = 0; step < STEPS_PER_TICK; ++step) {
      plant_step(&joint, motor_Nm);
    }
  }
  return square_root(sum / (float)(ticks - from));
}

static void print_tenths(float arcsec) {
  int32_t tenths = (int32_t)(arcsec * 10 + 0.5f);
  target_print(" ");
  target_print_number(tenths / 10);
  target_print(".");
  target_print_number(tenths % 10);
}

int main(void) {
  static const int tried[] = {0, 3, 4};
  int failed = 0;
  int i;
  target_print(
      "error of the output, arcsec rms: without, rate fed forward, added to the position\n");
  for (i = 0; i < 3; ++i) {
    const scenario *what = &scenarios[tried[i]];
    float without = run(what, WITHOUT);
    float rate = run(what, RATE);
    float position = run(what, POSITION);
    target_print(what->name);
    print_tenths(without);
    print_tenths(rate);
    print_tenths(position);
    target_print("\n");
    failed |= !(rate >= 0 && rate < without && position > 3 * without);
  }
  return failed;
}
