#include "loop.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SLOW_SHARE 0.08       /* of the resonance, of a tenth at most (torque.h) */
#define OUTPUT_NOISE_RAD 7e-6 /* rms, of the encoder at the output: 1.5 arcsec */
#define WATCH_S 0.01
#define ZERO_OFFSET_RAD 0.3 /* between the two encoders */
#define FRICTION_REVERSAL_RAD_S 0.01
#define PI 3.14159265358979323846

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

/* Angle of the motor, referred to the output by the host's ratio. */
static double host_angle(const loop *l, const plant *joint) {
  return plant_motor_encoder(joint) / l->known.ratio_share;
}

static double table(const loop *l, double torque_Nm) {
  const double *rad = l->known.table_rad;
  double at = clip(40 * torque_Nm / l->known.kind->rated_Nm, 59.999) + 60;
  int i = (int)at;
  return rad[i] + (at - i) * (rad[i + 1] - rad[i]);
}

static double modelled(const loop *l, const command *wish) {
  return -l->known.gravity_share * l->known.kind->gravity_Nm * sin(wish->angle_rad) -
         l->make.arm_kgm2 * wish->acceleration_rad_s2;
}

static double slow(const loop *l, double *state, double value) {
  double per_s = 2 * PI * SLOW_SHARE * l->known.kind->resonance_Hz;
  *state += (1 - exp(-per_s * l->period_s)) * (value - *state);
  return *state;
}

static double told_torque(loop *l, const plant *joint, const command *wish, double model_Nm) {
  const double ratio = l->make.ratio;
  const lm_motor motor = {0.1f,
                          (float)ratio,
                          1,
                          (float)(l->make.rotor_kgm2 / (ratio * ratio)),
                          (float)(l->make.coulomb_Nm / ratio),
                          (float)(l->make.viscous_Nms / (ratio * ratio)),
                          (float)(3 * FRICTION_REVERSAL_RAD_S * ratio)};
  double sensed_Nm = joint->shaft_Nm + SENSOR_NOISE_NM * gauss(&l->noise);
  double turning_Nm;
  switch (l->source) {
    case FROM_SENSOR:
      (void)slow(l, &l->beyond_Nm, sensed_Nm - model_Nm);
      return model_Nm + l->beyond_Nm;
    case FROM_RAW_SENSOR:
      return sensed_Nm;
    case FROM_CURRENT:
      turning_Nm = (double)lm_estimate_torque(&motor, (float)(l->motor_Nm / ratio / 0.1),
                                              (float)(ratio * l->speed_rad_s),
                                              (float)(ratio * wish->acceleration_rad_s2));
      (void)slow(l, &l->current_Nm, turning_Nm - model_Nm);
      (void)slow(
          l, &l->bound_Nm,
          (double)lm_bound_torque(&motor, (float)turning_Nm, (float)(ratio * l->speed_rad_s)));
      return model_Nm +
             (double)lm_hold_torque(&l->believed_Nm, (float)l->current_Nm, (float)l->bound_Nm);
    case FROM_RAW_CURRENT:
      return -l->motor_Nm + l->make.coulomb_Nm * clip(l->speed_rad_s / FRICTION_REVERSAL_RAD_S, 1);
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
  at.input_angle_rad = (float)(l->make.ratio * plant_motor_encoder(joint));
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
    lm_watch_output(&l->compensator, (float)(output_rad - host_angle(l, joint) + ZERO_OFFSET_RAD),
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
    ramp(l, -table(l, told_Nm));
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
  l->make = joint->make;
  l->period_s = 1 / rate_Hz;
  l->noise = 1;
  l->first_fade = -1;
  l->bound_Nm = joint->make.coulomb_Nm; /* lm_bound_torque at speed 0 */
  l->last_rad = host_angle(l, joint);
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
  return l->known.output_loop ? plant_output(joint) : host_angle(l, joint) - l->correction_rad;
}

double loop_tick(loop *l, const plant *joint, const command *wish, int closed) {
  const joint_kind *kind = l->known.kind;
  double measured_rad = host_angle(l, joint);
  double model_Nm = modelled(l, wish);
  double share = 1 - exp(-kind->speed_filter_per_s * l->period_s);
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
  /* If the loop closes on the output, the correction is only a feed-forward of the motor. */
  error_rad = l->known.output_loop ? wish->angle_rad - plant_output(joint)
                                   : wish->angle_rad + l->correction_rad - measured_rad;
  feed_rad_s = wish->velocity_rad_s + l->correction_rad_s;
  /* Commanded and measured speed pass the same filter, so that a steady motion leaves no error. */
  l->wish_rad_s += share * (feed_rad_s - l->wish_rad_s);
  push_Nm = kind->velocity_gain_Nms *
            (l->wish_rad_s + kind->position_gain_per_s * error_rad - l->speed_rad_s);
  l->sum_Nm = clip(l->sum_Nm + kind->integral_per_s * push_Nm * l->period_s, kind->torque_max_Nm);
  push_Nm += l->sum_Nm - model_Nm +
             l->make.rotor_kgm2 * (wish->acceleration_rad_s2 + l->correction_rad_s2) +
             l->make.viscous_Nms * feed_rad_s +
             l->make.coulomb_Nm * clip(feed_rad_s / FRICTION_REVERSAL_RAD_S, 1);
  l->motor_Nm = clip(push_Nm, kind->torque_max_Nm);
  return l->motor_Nm / l->known.ratio_share;
}
