/* The gap profile against a constant width with the same ramp, on a table that turns about a
 * vertical axis: no load but friction, so that every reversal crosses the gap of the drive.
 *
 *     plant_gap            prints one table; exit status 1 if the gap profile with its default dead
 *     band is worse than the constant width
 *
 * The parameters are those of `lostmotion export --profile gap` for the lost motion of the plant.
 * Friction of the output, an outside torque of the plant, takes the gap up at each reversal. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "loop.h"

#define ARCSEC (3.14159265358979323846 / 648000)
#define STEPS 10
#define BEARING_NM 2.0        /* friction of the output, which loads the gear */
#define BEARING_SLOPE 2e4     /* N*m/rad before it slips */
#define CORRECTION_SHARE 1.25 /* limits as export makes them (export.py) */
#define CROSSING_S 0.05
#define DEAD_SHARE 0.05
#define NOISE_RAD ARCSEC /* a little more than a step of the motor's encoder */

typedef struct step {
  double seconds, to_gaps, to_rad; /* target: in gaps of the drive, and in radians */
} step;

typedef struct scenario {
  const char *name;
  step steps[STEPS];
  double from_s, unrest_gaps, unrest_Hz;
} scenario;

static const scenario scenarios[] = {
    {"reversals",
     {{1, 0, 0.3}, {1, 0, -0.3}, {1, 0, 0.3}, {1, 0, -0.3}, {1, 0, 0.3}, {1, 0, 0}},
     1,
     0,
     0},
    {"reversal of a quarter of the gap",
     {{1, 0, 0.3}, {0.2, -0.25, 0.3}, {2, -0.25, 0.3}},
     1,
     0,
     0},
    {"reversal of half the gap", {{1, 0, 0.3}, {0.2, -0.5, 0.3}, {2, -0.5, 0.3}}, 1, 0, 0},
    {"reversal of three quarters", {{1, 0, 0.3}, {0.2, -0.75, 0.3}, {2, -0.75, 0.3}}, 1, 0, 0},
    {"reversal of the gap", {{1, 0, 0.3}, {0.2, -1, 0.3}, {2, -1, 0.3}}, 1, 0, 0},
    {"jog",
     {{1, 0, 0.3},
      {0.2, 1, 0.3},
      {0.4, 1, 0.3},
      {0.2, 3, 0.3},
      {0.4, 3, 0.3},
      {0.2, 2, 0.3},
      {0.4, 2, 0.3},
      {0.2, 0, 0.3},
      {1, 0, 0.3}},
     1,
     0,
     0},
    {"dither of a tenth of the gap", {{1, 0, 0.3}, {6, 0, 0.3}}, 1.2, 0.05, 3},
    {"slow waves", {{1, 0, 0.1}, {8, 0, 0.1}}, 1, 20, 0.5},
};
#define SCENARIOS ((int)(sizeof scenarios / sizeof scenarios[0]))

static double gap_rad;

static command at_time(const scenario *what, double time_s) {
  command wish = {0, 0, 0};
  double from_rad = 0;
  double left_s = time_s;
  int i;
  for (i = 0; i < STEPS && what->steps[i].seconds > 0; ++i) {
    const step *to = &what->steps[i];
    double to_rad = to->to_rad + to->to_gaps * gap_rad;
    wish.angle_rad = to_rad;
    if (left_s < to->seconds) {
      double u = left_s / to->seconds;
      double way = to_rad - from_rad;
      wish.angle_rad = from_rad + way * u * u * u * (10 + u * (6 * u - 15));
      wish.velocity_rad_s = way / to->seconds * 30 * u * u * (1 - u) * (1 - u);
      wish.acceleration_rad_s2 = way / (to->seconds * to->seconds) * 60 * u * (1 - u) * (1 - 2 * u);
      break;
    }
    left_s -= to->seconds;
    from_rad = to_rad;
  }
  if (what->unrest_gaps > 0 && time_s > what->from_s) {
    double rate = 2 * 3.14159265358979323846 * what->unrest_Hz;
    double phase = rate * (time_s - what->from_s);
    double size_rad = what->unrest_gaps * gap_rad;
    wish.angle_rad += size_rad * (1 - cos(phase));
    wish.velocity_rad_s += size_rad * rate * sin(phase);
    wish.acceleration_rad_s2 += size_rad * rate * rate * cos(phase);
  }
  return wish;
}

static double run(const scenario *what, method how, const knowledge *known) {
  const double period_s = (double)known->parameters->limits.period_s;
  plant joint;
  loop l;
  double sum = 0;
  int64_t scored = 0;
  double end_s = 0;
  int64_t k;
  int i;
  for (i = 0; i < STEPS; ++i) {
    end_s += what->steps[i].seconds;
  }
  plant_start(&joint);
  joint.gravity_Nm = 0;
  loop_start(&l, how, FROM_MODEL, known, 1 / period_s, &joint);
  for (k = 0; k < (int64_t)(end_s / period_s); ++k) {
    command wish = at_time(what, (double)k * period_s);
    double error_rad = plant_output(&joint) - wish.angle_rad;
    double torque_Nm;
    if ((double)k * period_s >= what->from_s) {
      sum += error_rad * error_rad;
      scored += 1;
    }
    torque_Nm = loop_tick(&l, &joint, &wish, 1);
    for (i = 0; i < (int)(period_s / PLANT_STEP_S + 0.5); ++i) {
      double moved_rad = (joint.motor_rad_s + joint.twist_rad_s) * PLANT_STEP_S;
      joint.outside_Nm =
          fmax(fmin(joint.outside_Nm - BEARING_SLOPE * moved_rad, BEARING_NM), -BEARING_NM);
      plant_step(&joint, torque_Nm);
    }
  }
  return sqrt(sum / (double)scored);
}

/* The lost motion of a reversal under the friction of the output. */
static double measure_gap(void) {
  plant joint;
  double up_rad;
  plant_start(&joint);
  (void)plant_bench(&joint, PLANT_RATED_NM, PLANT_TURN_RAD);
  up_rad = plant_bench(&joint, BEARING_NM, PLANT_TURN_RAD);
  (void)plant_bench(&joint, -PLANT_RATED_NM, PLANT_TURN_RAD);
  return up_rad - plant_bench(&joint, -BEARING_NM, PLANT_TURN_RAD);
}

static lm_parameters parameters_of(double dead_share, double period_s) {
  lm_parameters p;
  lm_play play;
  memset(&p, 0, sizeof p);
  p.format = LM_PARAMETERS_LAYOUT;
  p.torque_limit_Nm = 10;
  p.limits.period_s = (float)period_s;
  p.limits.correction_rad = (float)(CORRECTION_SHARE * gap_rad);
  p.limits.velocity_rad_s = p.limits.correction_rad / (float)CROSSING_S;
  p.limits.response_per_s = (float)(0.0625 / period_s);
  p.limits.acceleration_rad_s2 = 2 * p.limits.response_per_s * p.limits.velocity_rad_s;
  p.limits.jerk_rad_s3 = 8 * p.limits.response_per_s * p.limits.acceleration_rad_s2;
  p.watch.window_s = 1;
  p.watch.fade_s = 2;
  p.watch.noise_rad = 1e-5f;
  p.watch.misfit_rad = 1e-3f;
  play.radius_Nm = (float)(dead_share * gap_rad / 2);
  play.widening = 0;
  play.weight = (float)(1 / dead_share);
  if (lm_build_play_bank(&p.plays, &play, 1, 1, 0) != LM_OK) {
    printf("the play is refused\n");
  }
  return p;
}

int main(void) {
  static const double shares[] = {1, 0.25, 0.1, 0.05, 0.02};
  knowledge known;
  int fine = 1;
  int i;
  int k;
  memset(&known, 0, sizeof known);
  gap_rad = measure_gap();
  known.kind = joint_of(0);
  known.half_width_rad = gap_rad / 2;
  known.gravity_share = 0;
  known.torque_factor = 1;
  known.ratio_share = 1;
  printf("arcsec rms of the output; gap %.1f arcsec; dead band over the gap:\n", gap_rad / ARCSEC);
  printf("%-38s %8s %8s", "", "none", "constant");
  for (k = 0; k < 5; ++k) {
    printf(" %8.2f", shares[k]);
  }
  printf("\n");
  for (i = 0; i < 2 * SCENARIOS; ++i) {
    const scenario *what = &scenarios[i / 2];
    double period_s = i % 2 ? 1e-4 : 1e-3;
    lm_parameters p = parameters_of(DEAD_SHARE, period_s);
    double none;
    double constant;
    known.parameters = &p;
    none = run(what, METHOD_NONE, &known);
    constant = run(what, METHOD_CONSTANT, &known);
    printf("%-32s %2.0f kHz %8.1f %8.1f", what->name, 1e-3 / period_s, none / ARCSEC,
           constant / ARCSEC);
    for (k = 0; k < 5; ++k) {
      double found;
      p = parameters_of(shares[k], period_s);
      found = run(what, METHOD_LIBRARY, &known);
      printf(" %8.1f", found / ARCSEC);
      if (shares[k] == DEAD_SHARE && found > constant + NOISE_RAD) {
        printf("!");
        fine = 0;
      }
    }
    printf("\n");
  }
  return !fine;
}
