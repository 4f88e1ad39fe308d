#include "loop.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define POSITION_GAIN 40.0    /* 1/s */
#define VELOCITY_GAIN 150.0   /* N*m*s/rad: 40 Hz with this rotor */
#define INTEGRAL_RATE 15.0    /* 1/s */
#define SPEED_FILTER 600.0    /* 1/s: 95 Hz */
#define TORQUE_MAX 90.0       /* N*m on the output side */
#define SLOW_FILTER 12.6      /* 1/s: 2 Hz, a tenth of the resonance (torque.h) */
#define SENSOR_NOISE_NM 0.1   /* rms */
#define OUTPUT_NOISE_RAD 7e-6 /* rms, of the encoder at the output: 1.5 arcsec */
#define WATCH_S 0.01
#define ZERO_OFFSET_RAD 0.3 /* between the two encoders */
#define FRICTION_REVERSAL_RAD_S 0.01

static double clip(double value, double most) {
  return value > most ? most : value < -most ? -most : value;
}

/* Irwin and Hall's sum of twelve, unit variance. */
static double gauss(uint32_t *seed) {
  double sum = -6;
  int i;
  for (i = 0; i < 12; ++i) {
    *seed = *seed * 1664525u + 1013904223u;
    sum += (double)(*seed >> 8) / 16777216.0;
  }
  return sum;
}

static double table(const double *rad, double torque_Nm) {
  double at = clip(torque_Nm, 59.999) + 60;
  int i = (int)at;
  return rad[i] + (at - i) * (rad[i + 1] - rad[i]);
}

static double modelled(const loop *l, const command *wish) {
  return -l->known.gravity_share * PLANT_GRAVITY_NM * sin(wish->angle_rad) -
         PLANT_ARM_KGM2 * wish->acceleration_rad_s2;
}

static double slow(const loop *l, double *state, double value) {
  *state += (1 - exp(-SLOW_FILTER * l->period_s)) * (value - *state);
  return *state;
}

static double told_torque(loop *l, const plant *joint, const command *wish, double model_Nm) {
  static const lm_motor motor = {0.1f, 100, 1, (float)(PLANT_ROTOR_KGM2 * 1e-4), 0.03f, 3e-4f, 3};
  double sensed_Nm = joint->shaft_Nm + SENSOR_NOISE_NM * gauss(&l->noise);
  double turning_Nm;
  switch (l->source) {
    case FROM_SENSOR:
      (void)slow(l, &l->beyond_Nm, sensed_Nm - model_Nm);
      return model_Nm + l->beyond_Nm;
    case FROM_RAW_SENSOR:
      return sensed_Nm;
    case FROM_CURRENT:
      turning_Nm = (double)lm_estimate_torque(&motor, (float)(l->motor_Nm / 10),
                                              (float)(100 * l->speed_rad_s),
                                              (float)(100 * wish->acceleration_rad_s2));
      (void)slow(l, &l->current_Nm, turning_Nm - model_Nm);
      return model_Nm +
             (double)lm_hold_torque(&l->believed_Nm, (float)l->current_Nm,
                                    lm_bound_torque(&motor, (float)(100 * l->speed_rad_s)));
    case FROM_RAW_CURRENT:
      return -l->motor_Nm + PLANT_COULOMB_NM * clip(l->speed_rad_s / FRICTION_REVERSAL_RAD_S, 1);
    case FROM_MODEL:
    default:
      return model_Nm;
  }
}

static lm_conditions conditions(const loop *l, const plant *joint, double torque_Nm,
                                const command *wish) {
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  at.torque_Nm = (float)torque_Nm;
  at.output_angle_rad = (float)wish->angle_rad; /* the gap profile's only input */
  at.input_angle_rad = (float)(PLANT_RATIO * plant_motor_encoder(joint));
  at.temperature_C = (float)(joint->temperature_C + l->known.temperature_off_K);
  return at;
}

/* Trapezoid towards a target under the limits of the parameters. */
static void ramp(loop *l, double target_rad) {
  const lm_limits *limits = &l->known.parameters->limits;
  double most = (double)limits->acceleration_rad_s2 * l->period_s;
  double left = target_rad - l->correction_rad;
  double wish = sqrt(2 * (double)limits->acceleration_rad_s2 * fabs(left));
  wish = fmin(fmin(wish, fabs(left) / l->period_s), (double)limits->velocity_rad_s);
  l->correction_rad_s += clip(copysign(wish, left) - l->correction_rad_s, most);
  l->correction_rad += l->correction_rad_s * l->period_s;
}

static void take(loop *l, lm_correction now) {
  l->now = now;
  l->correction_rad = (double)now.correction_rad;
  l->correction_rad_s = (double)now.velocity_rad_s;
  l->correction_rad_s2 = (double)now.acceleration_rad_s2;
  l->seen |= now.status;
  if ((now.status & LM_STATE_FADED) && l->first_fade < 0) {
    l->first_fade = l->ticks;
  }
}

static void watch(loop *l, const plant *joint) {
  if (++l->watch_ticks >= (int64_t)(WATCH_S / l->period_s + 0.5)) {
    double output_rad = plant_output(joint) + OUTPUT_NOISE_RAD * gauss(&l->noise);
    l->watch_ticks = 0;
    lm_watch_output(&l->compensator,
                    (float)(output_rad - plant_motor_encoder(joint) + ZERO_OFFSET_RAD),
                    (float)WATCH_S);
  }
}

static void compensate(loop *l, const plant *joint, const command *wish, double model_Nm) {
  double told_Nm = told_torque(l, joint, wish, model_Nm) * l->known.torque_factor;
  if (l->how == METHOD_LIBRARY) {
    lm_conditions at = conditions(l, joint, told_Nm, wish);
    take(l, lm_step_compensator(&l->compensator, &at));
    watch(l, joint);
  } else if (l->how == METHOD_TABLE) {
    ramp(l, -table(l->known.table_rad, told_Nm));
  } else if (l->how == METHOD_CONSTANT) {
    l->side = wish->velocity_rad_s > 0 ? 1 : wish->velocity_rad_s < 0 ? -1 : l->side;
    ramp(l, l->side * l->known.half_width_rad);
  }
}

static void begin(loop *l, const plant *joint, const command *wish, const lm_saved *saved) {
  double torque_Nm = l->known.torque_factor * modelled(l, wish);
  lm_fault fault;
  lm_conditions at;
  if (lm_start_compensator(&l->compensator, l->known.parameters, (float)torque_Nm, &fault) !=
          LM_OK ||
      (saved && lm_restore_compensator(&l->compensator, saved, &fault) != LM_OK)) {
    fprintf(stderr, "%s: %s\n", fault.input, lm_status_sentence(fault.status));
    exit(2);
  }
  if (l->known.error_Nm > 0) {
    lm_declare_torque_error(&l->compensator, (float)l->known.error_Nm);
  }
#if LM_PROFILE == LM_PROFILE_GAP
  torque_Nm = 0;
#endif
  at = conditions(l, joint, torque_Nm, wish);
  take(l, lm_settle_compensator(&l->compensator, &at));
}

void loop_start(loop *l, method how, torque_source source, const knowledge *known, double rate_Hz,
                const plant *joint) {
  command rest = {0, 0, 0};
  memset(l, 0, sizeof *l);
  l->how = how;
  l->source = source;
  l->known = *known;
  l->period_s = 1 / rate_Hz;
  l->noise = 1;
  l->first_fade = -1;
  l->last_rad = plant_motor_encoder(joint);
  rest.angle_rad = l->last_rad;
  if (how == METHOD_LIBRARY) {
    begin(l, joint, &rest, 0);
  }
}

void loop_power_cycle(loop *l, const plant *joint, const command *wish) {
  if (l->how == METHOD_LIBRARY) {
    lm_saved saved;
    lm_save_compensator(&l->compensator, &saved);
    begin(l, joint, wish, &saved);
  }
}

double loop_reported(const loop *l, const plant *joint) {
  return l->known.output_loop ? plant_output(joint)
                              : plant_motor_encoder(joint) - l->correction_rad;
}

double loop_tick(loop *l, const plant *joint, const command *wish, int closed) {
  double measured_rad = plant_motor_encoder(joint);
  double model_Nm = modelled(l, wish);
  double share = 1 - exp(-SPEED_FILTER * l->period_s);
  double error_rad;
  double feed_rad_s;
  double push_Nm;
  l->ticks += 1;
  l->speed_rad_s += share * ((measured_rad - l->last_rad) / l->period_s - l->speed_rad_s);
  l->last_rad = measured_rad;
  compensate(l, joint, wish, model_Nm);
  if (!closed) {
    l->sum_Nm = 0;
    l->motor_Nm = 0;
    l->wish_rad_s = 0;
    return 0;
  }
  /* Where the loop closes on the output, the correction is a feed-forward of the motor alone. */
  error_rad = l->known.output_loop ? wish->angle_rad - plant_output(joint)
                                   : wish->angle_rad + l->correction_rad - measured_rad;
  feed_rad_s = wish->velocity_rad_s + l->correction_rad_s;
  /* Commanded and measured speed pass the same filter, so that a steady motion leaves no error. */
  l->wish_rad_s += share * (feed_rad_s - l->wish_rad_s);
  push_Nm = VELOCITY_GAIN * (l->wish_rad_s + POSITION_GAIN * error_rad - l->speed_rad_s);
  l->sum_Nm = clip(l->sum_Nm + INTEGRAL_RATE * push_Nm * l->period_s, TORQUE_MAX);
  push_Nm += l->sum_Nm - model_Nm +
             PLANT_ROTOR_KGM2 * (wish->acceleration_rad_s2 + l->correction_rad_s2) +
             PLANT_VISCOUS_NMS * feed_rad_s +
             PLANT_COULOMB_NM * clip(feed_rad_s / FRICTION_REVERSAL_RAD_S, 1);
  l->motor_Nm = clip(push_Nm, TORQUE_MAX);
  return l->motor_Nm;
}
