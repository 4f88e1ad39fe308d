/* The limits of the correction under any sequence of headroom, modes and changes of parameters, by
 * finite differences of the correction alone.
 *
 *     limiter_differences STEPS [SEED]
 *
 * Random sets of parameters (limits over six decades, any response), random headroom, random
 * targets. In all cases, differences of the correction over a tick stay within the limits of the
 * active set; while LM_STATE_HEADROOM_SHORT is set, within the widest limits that were stated since
 * it was last clear. Prints the counts; exit status 1 at the first violation. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../plant/draw.h"
#include "lostmotion/compensator.h"

#define SETS 8
#define PERIOD_S LM_REAL(1e-3)

typedef struct bounds {
  double position, velocity, acceleration, jerk;
} bounds;

static double draw_size(double low, double high) {
  return exp(draw(log(low), log(high)));
}

static void make_set(lm_parameters *p) {
  static const lm_real torque_Nm[] = {-100, 0, 100};
  static const lm_real angle_rad[] = {LM_REAL(-5e-3), 0, LM_REAL(5e-3)};
  memset(p, 0, sizeof *p);
  p->format = LM_PARAMETERS_LAYOUT;
  p->torque_limit_Nm = 100;
  p->limits.period_s = PERIOD_S;
  p->limits.correction_rad = LM_REAL(draw_size(1e-4, 1e-2));
  p->limits.velocity_rad_s = LM_REAL(draw_size(1e-3, 1));
  p->limits.acceleration_rad_s2 = LM_REAL(draw_size(1e-2, 1e2));
  p->limits.jerk_rad_s3 = LM_REAL(draw_size(1e0, 1e5));
  p->limits.response_per_s = LM_REAL(draw_size(1, 62.5));
  p->watch.window_s = 1;
  p->watch.fade_s = 1;
  p->watch.noise_rad = LM_REAL(1e-5);
  p->watch.misfit_rad = LM_REAL(1e-4);
  p->watch.ringing_Hz = draw(0, 1) < 0.5 ? 0 : 10;
  if (lm_build_curve(&p->curve, torque_Nm, angle_rad, 3, 0) != LM_OK ||
      lm_build_play_bank(&p->plays, 0, 0, 0, 0) != LM_OK || lm_check_parameters(p, 0) != LM_OK) {
    fprintf(stderr, "a set was refused\n");
    exit(1);
  }
}

static bounds limits_of(const lm_parameters *p) {
  bounds b;
  b.position = (double)p->limits.correction_rad;
  b.velocity = (double)p->limits.velocity_rad_s;
  b.acceleration = (double)p->limits.acceleration_rad_s2;
  b.jerk = (double)p->limits.jerk_rad_s3;
  return b;
}

static bounds wider(bounds a, bounds b) {
  a.position = fmax(a.position, b.position);
  a.velocity = fmax(a.velocity, b.velocity);
  a.acceleration = fmax(a.acceleration, b.acceleration);
  a.jerk = fmax(a.jerk, b.jerk);
  return a;
}

int main(int count, char **word) {
  static lm_parameters set[SETS];
  lm_compensator c;
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  long long steps = count > 1 ? atoll(word[1]) : 1000000;
  long long k;
  long long changes = 0;
  long long shorts = 0;
  double x[4] = {0, 0, 0, 0};
  double torque_Nm = 0;
  double T = (double)PERIOD_S;
  bounds most;
  int i;
  state = count > 2 ? strtoull(word[2], 0, 10) : 88172645463325252u;
  for (i = 0; i < SETS; ++i) {
    make_set(&set[i]);
  }
  if (lm_start_compensator(&c, &set[0], 0, 0) != LM_OK) {
    return 1;
  }
  most = limits_of(&set[0]);
  for (k = 0; k < steps; ++k) {
    lm_correction now;
    double rate[3];
    double slack;
    if (draw(0, 1) < 0.01) { /* few and then many in a row */
      int burst = draw(0, 1) < 0.2 ? 5 : 1;
      for (i = 0; i < burst; ++i) {
        lm_headroom room;
        double kind = draw(0, 1);
        if (kind < 0.4) {
          int to = (int)draw(0, SETS);
          lm_parameters *next = &set[to];
          if (next != c.parameters && draw(0, 1) < 0.3) {
            make_set(next);
          }
          if (lm_change_parameters(&c, next, 0) != LM_OK) {
            return 1;
          }
          most = wider(most, limits_of(next));
          changes += 1;
        } else if (kind < 0.7) {
          room.correction_rad = LM_REAL(draw(0, 1) < 0.2 ? 0 : draw_size(1e-5, 1e-2));
          room.velocity_rad_s = LM_REAL(draw(0, 1) < 0.2 ? 0 : draw_size(1e-4, 1));
          room.acceleration_rad_s2 = LM_REAL(draw(0, 1) < 0.2 ? 0 : draw_size(1e-3, 1e2));
          room.jerk_rad_s3 = LM_REAL(draw(0, 1) < 0.2 ? 0 : draw_size(1e-1, 1e5));
          lm_set_headroom(&c, draw(0, 1) < 0.2 ? 0 : &room);
        } else if (kind < 0.95) {
          lm_set_mode(&c, (lm_mode)(int)draw(0, 3));
        } else {
          lm_declare_torque_error(&c, LM_REAL(draw(-1, 20)));
        }
      }
    }
    if (draw(0, 1) < 0.01) {
      torque_Nm = draw(-120, 120);
    } else if (draw(0, 1) < 0.3) {
      torque_Nm += draw(-1, 1) * draw_size(1e-3, 3);
    }
    at.torque_Nm = LM_REAL(torque_Nm);
    now = lm_step_compensator(&c, &at);
    x[3] = x[2];
    x[2] = x[1];
    x[1] = x[0];
    x[0] = (double)now.correction_rad;
    rate[0] = (x[0] - x[1]) / T;
    rate[1] = (x[0] - 2 * x[1] + x[2]) / (T * T);
    rate[2] = (x[0] - 3 * x[1] + 3 * x[2] - x[3]) / (T * T * T);
    /* Rounding of the correction: half a unit of its last digit for each value. */
    slack = (LM_REAL_BITS == 64 ? 2.3e-16 : 1.2e-7) * most.position;
    if (fabs(x[0]) > most.position * 1.0001 || fabs(rate[0]) > most.velocity * 1.0001 + slack / T ||
        fabs(rate[1]) > most.acceleration * 1.0001 + 2 * slack / (T * T) ||
        fabs(rate[2]) > most.jerk * 1.001 + 4 * slack / (T * T * T) ||
        fabs(rate[0] - (double)now.velocity_rad_s) > 1e-5 * most.velocity + slack / T) {
      printf(
          "step %lld: position %g of %g, velocity %g (told %g) of %g, acceleration %g of %g, "
          "jerk %g of %g, status %x\n",
          k, x[0], most.position, rate[0], (double)now.velocity_rad_s, most.velocity, rate[1],
          most.acceleration, rate[2], most.jerk, (unsigned)now.status);
      return 1;
    }
    if (now.status & LM_STATE_HEADROOM_SHORT) {
      shorts += 1;
    } else {
      most = limits_of(c.parameters);
    }
  }
  printf("%lld steps, %lld changes of parameters, %lld steps under earlier limits: none exceeded\n",
         steps, changes, shorts);
  return 0;
}
