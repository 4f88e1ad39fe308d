/* commission sheet SEED               the catalogue sheet of an axis, as a drive file
 * commission sound SEED=BLOB ...      runs the commissioning routine on these axes: each is sound
 * commission faults SEED=BLOB ...     the same axes with each fault in turn: each has to be named
 *
 * Seed 0 is the nominal plant; any other seed draws the joint, its load, pose, encoders and
 * position loop, and the errors of their known values. BLOB: output of `lostmotion export` for the
 * sheet. Exit status 1 if a sound axis is refused, or a fault is not found or is reported as
 * another one. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "blob.h"
#include "commissioning/commissioning.h"
#include "draw.h"
#include "plant.h"

#define ARCMIN (3.14159265358979323846 / 10800)
#define RING_RAD 4e-5   /* peak to peak: 8 arcsec */
#define MOVED_RAD 0.052 /* permitted motion of a sound axis: travel, wind-up, correction */
#define END_S 60.0
#define FILTER_RAD_S 600.0
#define REVERSAL_RAD_S 0.01

static double clip(double value, double most) {
  return value > most ? most : value < -most ? -most : value;
}

/* An axis: the joint, its surroundings and its drive. */
typedef struct axis {
  plant_make make;
  double ratio, rated_Nm, gravity_Nm, pose_rad;
  double output_noise_rad, torque_noise_Nm, period_s;
  double gravity_known, friction_known, sheet_off; /* factors on the known values */
  double position_gain, speed_gain, integral;
  int has_output, has_sensor, has_current;
} axis;

static axis make_axis(unsigned seed) {
  plant joint;
  axis a;
  plant_start(&joint);
  a.make = joint.make;
  a.ratio = PLANT_RATIO;
  a.rated_Nm = PLANT_RATED_NM;
  a.gravity_Nm = PLANT_GRAVITY_NM;
  a.pose_rad = 0.6;
  a.output_noise_rad = 7e-6;
  a.torque_noise_Nm = 0.1;
  a.period_s = 1e-3;
  a.gravity_known = 0.98;
  a.friction_known = 1;
  a.sheet_off = 1;
  a.position_gain = 40;
  a.integral = 15;
  a.has_output = 1;
  a.has_sensor = 0;
  state = 0x9e3779b97f4a7c15u * (seed + 1);
  if (seed > 0) {
    static const double periods[] = {5e-4, 1e-3, 2e-3};
    double stiffness = 1e4 * pow(4, draw(0, 1));
    a.make.stiffness_Nm_per_rad = stiffness;
    a.make.cubic_Nm_per_rad3 = draw(1e9, 4e9);
    a.make.dead_rad = draw(2e-5, 1.2e-4);
    a.make.slip_Nm = draw(0.5, 2);
    a.make.stick_Nm_per_rad = draw(0.3, 0.8) * stiffness;
    a.make.arm_kgm2 = draw(0.4, 2) * stiffness / 2e4;
    a.make.rotor_kgm2 = draw(0.3, 1);
    a.make.damping_Nms = sqrt(stiffness * a.make.arm_kgm2) / draw(5, 15);
    a.make.coulomb_Nm = draw(1, 5);
    a.make.stribeck_Nm = a.make.coulomb_Nm * draw(1, 1.4);
    a.make.viscous_Nms = draw(1, 5);
    a.ratio = floor(draw(30, 161)) * (draw(0, 1) < 0.5 ? -1 : 1);
    a.make.counts = pow(2, floor(draw(fabs(a.ratio) < 60 ? 16 : 14, 20))) * fabs(a.ratio);
    a.rated_Nm = 40 * stiffness / 2e4;
    a.gravity_Nm = draw(0, 1) < 0.2 ? 0 : draw(0, 0.9) * a.rated_Nm;
    a.pose_rad = draw(-1.2, 1.2);
    a.output_noise_rad = draw(2e-6, 9e-6);
    a.torque_noise_Nm = draw(0.02, 0.2);
    a.period_s = periods[(int)draw(0, 3)];
    a.gravity_known = draw(0.9, 1.1);
    a.friction_known = draw(0.7, 1.2);
    a.sheet_off = draw(0.8, 1.25);
    a.position_gain = draw(20, 50);
    a.integral = draw(8, 20);
    a.has_output = draw(0, 1) < 0.75;
    a.has_sensor = draw(0, 1) < 0.4;
  }
  a.has_current = !a.has_sensor && seed % 2 == 1;
  a.speed_gain = 250 * a.make.rotor_kgm2;
  return a;
}

/* Twist of the spring beyond the dead zone. */
static double wound(const axis *a, double torque_Nm) {
  double s = 0;
  int i;
  for (i = 0; i < 50; ++i) {
    double k = a->make.stiffness_Nm_per_rad;
    double c = a->make.cubic_Nm_per_rad3;
    s -= (k * s + c * s * s * s - torque_Nm) / (k + 3 * c * s * s);
  }
  return s;
}

static void print_sheet(const axis *a) {
  double t1 = 0.2 * a->rated_Nm;
  double t2 = 0.6 * a->rated_Nm;
  double k1 = t1 / (wound(a, t1) + a->make.dead_rad) * a->sheet_off;
  double k2 = (t2 - t1) / (wound(a, t2) - wound(a, t1)) * a->sheet_off;
  double k3 = (a->rated_Nm - t2) / (wound(a, a->rated_Nm) - wound(a, t2)) * a->sheet_off;
  double loop = 2 * a->make.slip_Nm / a->make.stiffness_Nm_per_rad;
  printf("[drive]\nname = \"axis\"\nratio = %.0f\nrated_torque_Nm = %.6g\n", a->ratio, a->rated_Nm);
  printf("[catalogue]\nT1_Nm = %.6g\nT2_Nm = %.6g\n", t1, t2);
  printf("K1_Nm_per_rad = %.6g\nK2_Nm_per_rad = %.6g\nK3_Nm_per_rad = %.6g\n", k1, k2, k3);
  printf("hysteresis_arcmin = %.4f\nlost_motion_arcmin = %.4f\n", loop / ARCMIN,
         (loop + 2 * (a->make.dead_rad + wound(a, 0.04 * a->rated_Nm))) / ARCMIN);
  printf("# period_us = %.0f\n", a->period_s * 1e6);
}

/* A fault of the host, and the required finding of the routine. */
typedef enum fault {
  NOTHING,
  DAMAGED_PARAMETERS,
  LOST_SAMPLE,
  PERIOD_DOUBLE,
  PERIOD_JITTER,
  TORQUE_MILLI,
  TORQUE_NOISY,
  MOTOR_OFF,
  STATED_RATIO,
  STATED_SIGN,
  OUTPUT_DEAD,
  OUTPUT_SIGN,
  RATIO_TOOTH,
  RATIO_STAGE,
  OUTPUT_LOOP,
  COMPENSATES,
  TORQUE_SIGN,
  TORQUE_FIVEFOLD,
  TORQUE_TENTH,
  TORQUE_FROZEN,
  TORQUE_SLOW,
  NO_ROOM,
  SLOW_ROOM,
  NOT_ADDED,
  WRONG_SIGN,
  ADDED_TWICE,
  NOT_REPORTED,
  RAW_SENSOR,
  SLOW_OFFSET,
  COLLISION,
  HOST_ENDS,
  OUTPUT_SOUND,
  OUTPUT_ADDED,
  OUTPUT_REPORTED,
  OUTPUT_TORQUE_SIGN,
  OUTPUT_MISTAKEN,
  SENSOR_SIGN,
  SENSOR_SCALE,
  FED_SIGN,
  FED_SCALE,
  FED_RATIO,
  CURRENT_SIGN,
  SPEED_SIGN,
  SPEED_OUTPUT,
  PACE_SIGN,
  OUTPUT_PACE,
  FAULTS
} fault;

static const struct {
  const char *name;
  commissioning_finding finding;
  int needs_output;
} faults[FAULTS] = {
    {"nothing", COMMISSIONING_NO_FAULT, 0},
    {"parameters damaged", COMMISSIONING_PARAMETERS, 0},
    {"a sample of the motor's encoder lost", COMMISSIONING_INPUT, 0},
    {"called at half the rate", COMMISSIONING_PERIOD, 0},
    {"a tick left out now and then", COMMISSIONING_PERIOD, 0},
    {"torque in mN m", COMMISSIONING_RANGE, 0},
    {"torque of 5 % noise", COMMISSIONING_TORQUE_NOISE, 0},
    {"brake on", COMMISSIONING_STUCK, 0},
    {"ratio of the loop another than stated", COMMISSIONING_INPUT_SCALE, 0},
    {"ratio stated with the other sign", COMMISSIONING_INPUT_SIGN, 0},
    {"output encoder dead", COMMISSIONING_OUTPUT_STUCK, 1},
    {"output encoder counts backward", COMMISSIONING_RATIO_SIGN, 1},
    {"ratio off by one", COMMISSIONING_RATIO, 1},
    {"ratio off by a gear stage of 2", COMMISSIONING_RATIO, 1},
    {"loop closed on the output", COMMISSIONING_OUTPUT_LOOP, 1},
    {"drive compensates already", COMMISSIONING_OUTPUT_LOOP, 1},
    {"torque with the wrong sign", COMMISSIONING_TORQUE_SIGN, 0},
    {"torque five times too large", COMMISSIONING_TORQUE_SCALE, 0},
    {"torque a tenth of what it is", COMMISSIONING_TORQUE_SCALE, 0},
    {"torque frozen", COMMISSIONING_TORQUE_STUCK, 0},
    {"torque through a filter of 0.5 Hz", COMMISSIONING_TORQUE_LATE, 0},
    {"headroom for a tenth of the correction", COMMISSIONING_HEADROOM_SIZE, 0},
    {"headroom for a hundredth of the velocity", COMMISSIONING_HEADROOM_RATE, 0},
    {"correction not added", COMMISSIONING_CORRECTION_MISSING, 0},
    {"correction added with the wrong sign", COMMISSIONING_CORRECTION_SIGN, 0},
    {"correction added twice", COMMISSIONING_CORRECTION_SCALE, 0},
    {"correction not subtracted from the reported angle", COMMISSIONING_REPORTED, 0},
    {"raw torque sensor", COMMISSIONING_TORQUE_LOOP, 0},
    {"drive ramps its offset slowly", COMMISSIONING_DRIVE_LIMIT, 0},
    {"arm runs against a stop", COMMISSIONING_TORQUE_BOUND, 0},
    {"the host ends it with a correction on", COMMISSIONING_ABORTED, 0},
    {"loop on the output as stated", COMMISSIONING_NO_FAULT, 1},
    {"the same, correction added to its position", COMMISSIONING_CORRECTION_ADDED, 1},
    {"the same, correction subtracted from the reported angle", COMMISSIONING_REPORTED, 1},
    {"the same, torque with the wrong sign", COMMISSIONING_TORQUE_SIGN, 1},
    {"loop on the motor, stated as on the output", COMMISSIONING_MOTOR_LOOP, 1},
    {"torque sensor with the wrong sign, no output encoder", COMMISSIONING_TORQUE_SIGN, 0},
    {"torque sensor 2.5 times too large, no output encoder", COMMISSIONING_TORQUE_SCALE, 0},
    {"torque fed forward with the wrong sign", COMMISSIONING_FEED_SIGN, 0},
    {"torque fed forward +-20 to 1000 times", COMMISSIONING_FEED_SCALE, 0},
    {"torque of the output fed to the motor", COMMISSIONING_FEED_SCALE, 0},
    {"motor current with the wrong sign", COMMISSIONING_FRICTION, 0},
    {"its velocity with the wrong sign", COMMISSIONING_VELOCITY, 0},
    {"its velocity that of the output", COMMISSIONING_VELOCITY, 0},
    {"velocity fed forward with the wrong sign", COMMISSIONING_PACE, 0},
    {"loop on the output, the same", COMMISSIONING_PACE, 1},
};

/* The drive around the joint: cascade on the motor encoder, feed-forward. */
typedef struct host {
  const axis *a;
  fault wrong;
  double known_ratio; /* that the loop uses */
  double fed_times;   /* what the drive makes of the torque that is fed forward */
  double last_rad, speed_rad_s, wish_rad_s, sum_Nm, motor_Nm;
  double beyond_Nm, late_Nm, frozen_Nm, offset_rad, off_rad;
  double sensed_Nm, model_Nm;
  int64_t tick;
} host;

/* The position loop closes on the output, and that is stated. */
static int is_output_loop(fault wrong) {
  return wrong == OUTPUT_SOUND || wrong == OUTPUT_ADDED || wrong == OUTPUT_REPORTED ||
         wrong == OUTPUT_TORQUE_SIGN || wrong == OUTPUT_PACE;
}

/* Motor angle of the host, referred to the output. */
static double host_angle(const host *h, const plant *joint) {
  return plant_motor_encoder(joint) * h->a->ratio / h->known_ratio;
}

static double host_torque(host *h, const plant *joint, const commissioning_output *wish) {
  const axis *a = h->a;
  double model_Nm = -a->gravity_known * a->gravity_Nm * sin((double)wish->command_rad) -
                    a->make.arm_kgm2 * (double)wish->acceleration_rad_s2;
  double sensed_Nm = joint->shaft_Nm + a->torque_noise_Nm * gauss();
  double told_Nm = model_Nm;
  double slow_rad_s = 0.1 * sqrt(a->make.stiffness_Nm_per_rad / a->make.arm_kgm2);
  sensed_Nm *= h->wrong == SENSOR_SIGN ? -1 : h->wrong == SENSOR_SCALE ? 2.5 : 1;
  h->sensed_Nm = sensed_Nm;
  h->model_Nm = model_Nm;
  h->beyond_Nm += (1 - exp(-slow_rad_s * a->period_s)) * (sensed_Nm - model_Nm - h->beyond_Nm);
  told_Nm += a->has_sensor ? h->beyond_Nm : 0;
  if (h->tick == 0) {
    h->late_Nm = told_Nm;
    h->frozen_Nm = told_Nm;
  }
  h->late_Nm += (1 - exp(-3.14 * a->period_s)) * (told_Nm - h->late_Nm);
  switch (h->wrong) {
    case TORQUE_MILLI:
      return 1000 * sensed_Nm;
    case TORQUE_NOISY:
      return told_Nm + 0.05 * a->rated_Nm * gauss();
    case TORQUE_SIGN:
    case OUTPUT_TORQUE_SIGN:
      return -told_Nm;
    case TORQUE_FIVEFOLD:
      return 5 * told_Nm;
    case TORQUE_TENTH:
      return 0.1 * told_Nm;
    case TORQUE_FROZEN:
      return h->frozen_Nm;
    case TORQUE_SLOW:
      return h->late_Nm;
    case RAW_SENSOR:
      return sensed_Nm;
    default:
      return told_Nm;
  }
}

/* As the host knows it, 1 N m / A. */
static lm_motor find_motor(const axis *a) {
  const double ratio = fabs(a->ratio);
  lm_motor motor;
  motor.torque_constant_Nm_per_A = 1;
  motor.ratio = (float)a->ratio;
  motor.efficiency = 1;
  motor.rotor_inertia_kg_m2 = (float)(a->friction_known * a->make.rotor_kgm2 / (ratio * ratio));
  motor.coulomb_Nm = (float)(a->friction_known * a->make.coulomb_Nm / ratio);
  motor.viscous_Nm_s = (float)(a->friction_known * a->make.viscous_Nms / (ratio * ratio));
  motor.standstill_rad_s = (float)(REVERSAL_RAD_S * ratio);
  return motor;
}

/* The torque from the current, and the velocity for it. */
static void sense_current(const host *h, const lm_motor *motor, const commissioning_output *wish,
                          commissioning_input *now) {
  const double ratio = h->a->ratio;
  const float sign = h->wrong == CURRENT_SIGN ? -1 : 1;
  now->motor_rad_s = (float)(h->speed_rad_s * ratio);
  now->motor_rad_s *= h->wrong == SPEED_SIGN ? -1 : h->wrong == SPEED_OUTPUT ? 1 / (float)ratio : 1;
  now->sensed_Nm = lm_estimate_torque(
      motor, sign * (float)(h->motor_Nm / ratio), now->motor_rad_s,
      (float)(ratio * (double)(wish->acceleration_rad_s2 + wish->correction.acceleration_rad_s2)));
}

/* Torque of the motor, N m, referred to the output by the true ratio. */
static double host_push(host *h, const plant *joint, const commissioning_output *wish,
                        double correction_rad) {
  const axis *a = h->a;
  double measured_rad = host_angle(h, joint);
  double share = 1 - exp(-FILTER_RAD_S * a->period_s);
  double feed_rad_s = (double)wish->velocity_rad_s;
  double feed_rad_s2 = (double)wish->acceleration_rad_s2;
  double error_rad = (double)wish->command_rad + correction_rad - measured_rad;
  double push_Nm;
  if (h->wrong != NOT_ADDED && h->wrong != SLOW_OFFSET) {
    double times = h->wrong == WRONG_SIGN ? -1 : h->wrong == ADDED_TWICE ? 2 : 1;
    feed_rad_s += times * (double)wish->correction.velocity_rad_s;
    feed_rad_s2 += times * (double)wish->correction.acceleration_rad_s2;
  }
  if (h->wrong == OUTPUT_LOOP || is_output_loop(h->wrong)) {
    error_rad = (double)wish->command_rad + correction_rad - plant_output(joint);
  } else if (h->wrong == COMPENSATES) {
    h->off_rad += (1 - exp(-20 * a->period_s)) * (joint->twist_rad - h->off_rad);
    error_rad -= h->off_rad;
  }
  feed_rad_s *= h->wrong == PACE_SIGN || h->wrong == OUTPUT_PACE ? -1 : 1;
  h->speed_rad_s += share * ((measured_rad - h->last_rad) / a->period_s - h->speed_rad_s);
  h->last_rad = measured_rad;
  h->wish_rad_s += share * (feed_rad_s - h->wish_rad_s);
  push_Nm = a->speed_gain * (h->wish_rad_s + a->position_gain * error_rad - h->speed_rad_s);
  h->sum_Nm = clip(h->sum_Nm + a->integral * push_Nm * a->period_s, 2 * a->rated_Nm);
  push_Nm += h->sum_Nm - h->fed_times * (double)wish->feed_Nm +
             a->friction_known * a->make.rotor_kgm2 * feed_rad_s2 +
             a->friction_known * (a->make.viscous_Nms * feed_rad_s +
                                  a->make.coulomb_Nm * clip(feed_rad_s / REVERSAL_RAD_S, 1));
  return clip(push_Nm, 2.5 * a->rated_Nm) * a->ratio / h->known_ratio;
}

/* True motion and load of the axis, compared with the bounds in the header. */
typedef struct outcome {
  commissioning_finding finding;
  uint32_t unchecked;
  double found, moved_rad, change_Nm, left_rad, seconds;
} outcome;

static outcome run(const axis *a, const lm_parameters *good, fault wrong) {
  static commissioning test;
  lm_parameters parameters = *good;
  commissioning_settings set;
  commissioning_output out = {0, 0, 0, {0, 0, 0, 0, 0}, 0, COMMISSIONING_RUNNING, 0};
  plant joint;
  host h;
  outcome result = {COMMISSIONING_RUNNING, 0, 0, 0, 0, 0, 0};
  int substeps = (int)(a->period_s / PLANT_STEP_S + 0.5);
  int64_t settle = (int64_t)(2 / a->period_s);
  int64_t over = 0;
  double start_rad = 0;
  double start_Nm = 0;
  const lm_motor motor = find_motor(a);
  memset(&h, 0, sizeof h);
  h.a = a;
  h.wrong = wrong;
  h.fed_times = wrong == FED_SIGN    ? -1
                : wrong == FED_SCALE ? (draw(0, 1) < 0.5 ? -1 : 1) * 20 * pow(50, draw(0, 1))
                : wrong == FED_RATIO ? fabs(a->ratio)
                                     : 1;
  h.known_ratio = a->ratio;
  plant_start(&joint);
  joint.make = a->make;
  joint.gravity_Nm = a->gravity_Nm;
  joint.motor_rad = a->pose_rad;
  h.known_ratio += wrong == RATIO_TOOTH ? copysign(1, a->ratio) : 0;
  h.known_ratio *= wrong == RATIO_STAGE ? 2 : 1;
  h.last_rad = host_angle(&h, &joint);
  h.sum_Nm = 0;
  out.command_rad = (float)h.last_rad;
  if (wrong == DAMAGED_PARAMETERS) {
    parameters.limits.velocity_rad_s = -1;
  }
  set = commissioning_suggest(&parameters, (float)h.known_ratio);
  set.friction_Nm = (float)(0.3 * a->make.coulomb_Nm); /* unknown part of it */
  if (a->has_current) {
    set.friction_Nm = lm_bound_torque(&motor, 0, 0);
  }
  set.shake_rad *= a->has_output ? 1.0f : 2.0f;
  set.ratio *= wrong == STATED_RATIO ? 1.25f : wrong == STATED_SIGN ? -1.0f : 1.0f;
  set.output_loop = is_output_loop(wrong) || wrong == OUTPUT_MISTAKEN;
  set.headroom.correction_rad *= wrong == NO_ROOM ? 0.1f : 1.0f;
  set.headroom.velocity_rad_s *= wrong == SLOW_ROOM ? 0.01f : 1.0f;
  (void)commissioning_start(&test, &set);
  for (h.tick = 0; (double)h.tick * a->period_s < END_S && over * a->period_s < 1; ++h.tick) {
    commissioning_input now;
    double correction_rad = (double)out.correction.correction_rad;
    double told_Nm = host_torque(&h, &joint, &out);
    int i;
    now.elapsed_s = (float)a->period_s;
    now.elapsed_s *= wrong == PERIOD_DOUBLE || (wrong == PERIOD_JITTER && h.tick % 97 == 0) ? 2 : 1;
    now.input_angle_rad = (float)(plant_motor_encoder(&joint) * a->ratio);
    now.output_angle_rad = (float)(plant_output(&joint) + a->output_noise_rad * gauss());
    now.output_angle_rad *= wrong == OUTPUT_DEAD ? 0 : wrong == OUTPUT_SIGN ? -1 : 1;
    if (!a->has_output) {
      now.output_angle_rad = LM_UNKNOWN;
    }
    if (wrong == LOST_SAMPLE && h.tick == 3 * settle) {
      now.input_angle_rad = NAN;
    }
    now.reported_rad =
        (float)(host_angle(&h, &joint) - (wrong == NOT_REPORTED ? 0 : correction_rad));
    if (is_output_loop(wrong)) {
      now.reported_rad =
          now.output_angle_rad - (wrong == OUTPUT_REPORTED ? (float)correction_rad : 0);
    }
    now.motor_torque_Nm =
        (float)(-h.motor_Nm +
                a->friction_known * (a->make.coulomb_Nm * clip(h.speed_rad_s / REVERSAL_RAD_S, 1) +
                                     a->make.viscous_Nms * h.speed_rad_s +
                                     a->make.rotor_kgm2 * (double)out.acceleration_rad_s2));
    now.sensed_Nm = a->has_sensor ? (float)h.sensed_Nm : LM_UNKNOWN;
    now.motor_rad_s = LM_UNKNOWN;
    if (a->has_current) {
      sense_current(&h, &motor, &out, &now);
    }
    now.commanded_Nm = (float)h.model_Nm;
    now.conditions = (lm_conditions)LM_CONDITIONS_UNKNOWN;
    now.conditions.torque_Nm = (float)told_Nm;
    if (h.tick < settle) { /* the drive starts, closes its loop and comes to rest */
      start_rad = plant_output(&joint);
      start_Nm = joint.shaft_Nm;
    } else {
      if (wrong == HOST_ENDS && fabs(correction_rad) > 0.9 * (double)set.path_rad) {
        commissioning_abort(&test);
      }
      out = commissioning_step(&test, &now);
      result.moved_rad = fmax(result.moved_rad, fabs(plant_output(&joint) - start_rad));
      result.change_Nm = fmax(result.change_Nm, fabs(joint.shaft_Nm - start_Nm));
    }
    if (out.finding != COMMISSIONING_RUNNING && over++ == 0) {
      result.finding = out.finding;
      result.unchecked = test.unchecked;
      result.found = (double)test.found;
      result.seconds = (double)(h.tick - settle) * a->period_s;
    }
    joint.braked = out.stop || wrong == MOTOR_OFF;
    correction_rad = (double)out.correction.correction_rad;
    if (wrong == SLOW_OFFSET) {
      h.offset_rad += clip(correction_rad - h.offset_rad, 0.7 * (double)set.path_rad * a->period_s);
      correction_rad = h.offset_rad;
    }
    correction_rad *= wrong == NOT_ADDED || (is_output_loop(wrong) && wrong != OUTPUT_ADDED) ? 0
                      : wrong == WRONG_SIGN                                                  ? -1
                      : wrong == ADDED_TWICE                                                 ? 2
                                                                                             : 1;
    h.motor_Nm = joint.braked ? 0 : host_push(&h, &joint, &out, correction_rad);
    for (i = 0; i < substeps; ++i) {
      double into_rad = plant_output(&joint) - (a->pose_rad + 0.01);
      joint.outside_Nm = wrong == COLLISION && into_rad > 0 ? -3e5 * into_rad : 0;
      plant_step(&joint, h.motor_Nm);
    }
  }
  result.left_rad = (double)out.correction.correction_rad;
  return result;
}

/* Whether the axis rings with the correction on: after a push it does not come to rest. */
static int rings(const axis *noisy, const lm_parameters *parameters) {
  axis quiet = *noisy;
  const axis *a = &quiet;
  lm_compensator compensator;
  commissioning_output out = {0, 0, 0, {0, 0, 0, 0, 0}, 0, COMMISSIONING_RUNNING, 0};
  plant joint;
  host h;
  double low = 1e9;
  double high = -1e9;
  int substeps = (int)(a->period_s / PLANT_STEP_S + 0.5);
  memset(&h, 0, sizeof h);
  h.a = a;
  h.wrong = RAW_SENSOR;
  h.known_ratio = a->ratio;
  quiet.torque_noise_Nm = 0;
  plant_start(&joint);
  joint.make = a->make;
  joint.gravity_Nm = a->gravity_Nm;
  joint.motor_rad = a->pose_rad;
  h.last_rad = host_angle(&h, &joint);
  (void)lm_start_compensator(&compensator, parameters, 0, 0);
  for (h.tick = 0; (double)h.tick * a->period_s < 7; ++h.tick) {
    double time_s = (double)h.tick * a->period_s;
    lm_conditions at = LM_CONDITIONS_UNKNOWN;
    int i;
    out.command_rad = (float)a->pose_rad;
    at.torque_Nm = (float)host_torque(&h, &joint, &out);
    out.correction = lm_step_compensator(&compensator, &at);
    joint.outside_Nm = time_s > 3 && time_s < 3.1 ? 0.1 * a->rated_Nm : 0;
    h.motor_Nm = host_push(&h, &joint, &out, (double)out.correction.correction_rad);
    for (i = 0; i < substeps; ++i) {
      plant_step(&joint, h.motor_Nm);
    }
    if (time_s > 6) {
      low = fmin(low, plant_output(&joint));
      high = fmax(high, plant_output(&joint));
    }
  }
  return high - low > RING_RAD;
}

static int judge(unsigned seed, const axis *a, const lm_parameters *parameters, fault wrong) {
  outcome got = run(a, parameters, wrong);
  int fine =
      got.left_rad == 0 && (wrong != NOTHING || got.moved_rad < MOVED_RAD) &&
      (got.finding == faults[wrong].finding ||
       /* With a heavy load the bounds are reached first. */
       (wrong == TORQUE_FIVEFOLD &&
        (got.finding == COMMISSIONING_TORQUE_BOUND || got.finding == COMMISSIONING_RANGE)) ||
       /* Without a load only its noise is visible. */
       (wrong == TORQUE_MILLI && got.finding == COMMISSIONING_TORQUE_NOISE) ||
       (wrong == FED_SIGN && got.finding == COMMISSIONING_FEED_SCALE) ||
       (wrong == COLLISION && got.finding == COMMISSIONING_FOLLOW) ||
       (wrong == RAW_SENSOR && (got.finding == COMMISSIONING_TORQUE_NOISE ||
                                (got.finding == COMMISSIONING_NO_FAULT && !rings(a, parameters)))));
  printf("%4u  %-42s %s %-8.3g %4.1f s  moved %6.4f rad, %5.1f Nm, unchecked %u: %s\n", seed,
         faults[wrong].name, fine ? "ok " : "BAD", got.found, got.seconds, got.moved_rad,
         got.change_Nm, (unsigned)got.unchecked, commissioning_sentence(got.finding));
  fflush(stdout);
  return fine;
}

int main(int count, char **word) {
  int fine = 1;
  int k;
  if (count == 3 && strcmp(word[1], "sheet") == 0) {
    axis a = make_axis((unsigned)atoi(word[2]));
    print_sheet(&a);
    return 0;
  }
  if (count < 3 || (strcmp(word[1], "sound") != 0 && strcmp(word[1], "faults") != 0)) {
    fprintf(stderr, "commission sheet SEED | commission sound|faults SEED=BLOB ...\n");
    return 2;
  }
  for (k = 2; k < count; ++k) {
    static lm_parameters parameters;
    unsigned seed = (unsigned)atoi(word[k]);
    axis a = make_axis(seed);
    char *blob = strchr(word[k], '=');
    int wrong;
    if (!blob || load(blob + 1, 0, 0, &parameters)) {
      return 2;
    }
    if (strcmp(word[1], "sound") == 0) {
      fine = judge(seed, &a, &parameters, NOTHING) && fine;
      continue;
    }
    for (wrong = 1; wrong < FAULTS; ++wrong) {
      axis b = a;
      b.has_output = a.has_output || faults[wrong].needs_output;
      if (wrong == SENSOR_SIGN || wrong == SENSOR_SCALE) {
        b.has_output = 0;
        b.has_sensor = 1;
        b.gravity_Nm = 0.3 * a.rated_Nm; /* else its bound may be reached first */
      }
      b.has_current = wrong == CURRENT_SIGN || wrong == SPEED_SIGN || wrong == SPEED_OUTPUT;
      if (b.has_current) {
        b.has_sensor = 0;
        b.gravity_Nm = 0; /* else its sign is found at rest */
      }
      if (wrong == OUTPUT_LOOP || wrong == COMPENSATES ||
          wrong == OUTPUT_MISTAKEN) { /* found if the load changes */
        b.gravity_Nm = 0.9 * a.rated_Nm;
        b.pose_rad = 0.3;
      }
      fine = judge(seed, &b, &parameters, (fault)wrong) && fine;
    }
  }
  return !fine;
}
