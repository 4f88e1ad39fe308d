/* plant bench JOINT       a recording of the gear on a bench, as CSV
 * plant run JOINT KHZ=BLOB ... [WORD]
 *                         every case, or those whose names contain WORD: without compensation,
 *                         with a constant width, with the table of the true mean curve, and with
 *                         the library, whose parameters for a loop of KHZ are in BLOB
 * plant duty BLOB HOURS   number of fades by the watch in HOURS of ordinary duty, and the seconds
 *                         until it fades at a wrong sign, with another drive, and with a drive that
 *                         already compensates
 *
 * Errors are those of the output, arcsec rms over the scored time; with a wrong ratio, of the lost
 * motion at the output. Exit status 1 if the library is
 * worse than no compensation, rings or, on the standard joint, is more than a tenth worse than the
 * best of the others in a case that is not marked as known. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "blob.h"
#include "duty.h"
#include "loop.h"

#define PI 3.14159265358979323846
#define ARCSEC (PI / 648000)
#define STEPS 10 /* of a motion at most */
#define BRAKE_S 1.0
#define RING_RAD (8 * ARCSEC) /* of an output at rest, peak to peak: not ringing */
#define CLOSE (1.1)           /* within 10 % of the best */

typedef struct step {
  double seconds, to_rad;
} step;

typedef struct scenario {
  const char *name;
  step steps[STEPS];
  double from_s;                /* scored from here */
  double unrest_rad, unrest_Hz; /* a sine on the command, from from_s on */
  double brake_s; /* emergency stop with brake: one second, an outside push meanwhile */
  double cycle_s; /* power is off and on again, braked */
  double hold_s;  /* homing: mode HOLD for one second */
  double outside; /* torque on the output from from_s on, share of the rated one */
} scenario;

static const scenario move_dwell = {
    "move and dwell",
    {{1, 0.8}, {3, 0.8}, {0.8, 0.2}, {2, 0.2}, {1, -0.7}, {3, -0.7}},
    0,
    0,
    0,
    0,
    0,
    0,
    0};
static const scenario hover = {"hover", {{1, 0.7}, {7, 0.7}}, 1.5, 3e-4, 1.3, 0, 0, 0, 0};
static const scenario jog = {"jog",
                             {{1, 0.5},
                              {0.3, 0.502},
                              {0.3, 0.502},
                              {0.3, 0.504},
                              {0.3, 0.504},
                              {0.3, 0.500},
                              {0.3, 0.500},
                              {0.3, 0.496},
                              {2, 0.496}},
                             1,
                             0,
                             0,
                             0,
                             0,
                             0,
                             0};
static const scenario reversals = {
    "reversals", {{1, 0.3}, {1, -0.3}, {1, 0.3}, {1, -0.3}, {1, 0.3}, {1, 0}}, 1, 0, 0, 0, 0, 0, 0};
static const scenario crossing = {
    "gravity crossing zero", {{0.6, -0.3}, {6, 0.3}, {6, -0.3}, {2, -0.3}}, 0.6, 0, 0, 0, 0, 0, 0};
static const scenario rest_at_zero = {
    "rest at zero load", {{0.5, 0.2}, {0.6, 0.0}, {5, 0.0}}, 1.1, 0, 0, 0, 0, 0, 0};
static const scenario dither = {
    "dither at zero load", {{0.5, 0.1}, {0.5, 0}, {6, 0}}, 1.2, 1e-4, 3, 0, 0, 0, 0};
static const scenario saturation = {
    "saturation", {{1, 1.2}, {4, 1.2}, {1, 0.2}, {2, 0.2}}, 0, 0, 0, 0, 0, 0, -0.625};
static const scenario braking = {"emergency stop and brake",
                                 {{1, 0.8}, {1, 0.4}, {2.5, 0.4}, {1, 0.6}, {2, 0.6}},
                                 0,
                                 0,
                                 0,
                                 1.4,
                                 0,
                                 0,
                                 0};
static const scenario cycling = {"power cycle under load",
                                 {{1, 0.8}, {1, 0.8}, {1.5, 0.8}, {1, 0.3}, {2, 0.3}},
                                 0,
                                 0,
                                 0,
                                 0,
                                 2.1,
                                 0,
                                 0};
static const scenario homing = {
    "homing, correction held", {{1, 0.6}, {2, 0.65}, {1, 0.6}, {1, 0.6}}, 0, 0, 0, 0, 0, 1.2, 0};

/* At most 0.56 rad/s: a ripple of up to 18 Hz. */
static const scenario sweep = {
    "sweep", {{1, 0.3}, {2, -0.3}, {2, 0.3}, {1, 0.3}}, 0.5, 0, 0, 0, 0, 0, 0};
#define RIPPLE_RAD (25 * ARCSEC)

typedef struct trial {
  const scenario *what;
  const char *wrong; /* the fault, or none */
  torque_source source;
  double gravity_share, torque_factor, temperature_off_K, temperature_C;
  int output_loop;
  int known_worse; /* than the best of the others: listed with its reason in the documentation */
  double told; /* largest error of the torque as declared to the library, in units of the sensor's
  noise or of 1.3 times the motor's friction at rest; 0: not declared */
  double ripple_rad;  /* of the gear, known to 10 % in the parameters */
  double ratio_share; /* ratio of the host over that of the gear */
} trial;

static const trial trials[] = {
    {&move_dwell, "", FROM_MODEL, 0.98, 1, 0, 20, 0, 1, 0, 0, 1},
    {&hover, "", FROM_MODEL, 0.98, 1, 0, 20, 0, 0, 0, 0, 1},
    {&jog, "", FROM_MODEL, 0.98, 1, 0, 20, 0, 0, 0, 0, 1},
    {&reversals, "", FROM_MODEL, 0.98, 1, 0, 20, 0, 0, 0, 0, 1},
    {&crossing, "", FROM_MODEL, 0.98, 1, 0, 20, 0, 0, 0, 0, 1},
    {&rest_at_zero, "", FROM_MODEL, 0.98, 1, 0, 20, 0, 0, 0, 0, 1},
    {&dither, "", FROM_MODEL, 0.98, 1, 0, 20, 0, 0, 0, 0, 1},
    {&saturation, "", FROM_MODEL, 0.98, 1, 0, 20, 0, 0, 0, 0, 1},
    {&saturation, "", FROM_SENSOR, 0.98, 1, 0, 20, 0, 0, 0, 0, 1},
    {&braking, "", FROM_MODEL, 0.98, 1, 0, 20, 0, 0, 0, 0, 1},
    {&cycling, "", FROM_MODEL, 0.98, 1, 0, 20, 0, 1, 0, 0, 1},
    {&homing, "", FROM_MODEL, 0.98, 1, 0, 20, 0, 0, 0, 0, 1},
    {&move_dwell, "sensor", FROM_SENSOR, 0.98, 1, 0, 20, 0, 1, 0, 0, 1},
    {&crossing, "sensor", FROM_SENSOR, 0.98, 1, 0, 20, 0, 0, 0, 0, 1},
    {&move_dwell, "raw sensor", FROM_RAW_SENSOR, 0.98, 1, 0, 20, 0, 1, 0, 0, 1},
    {&crossing, "raw sensor", FROM_RAW_SENSOR, 0.98, 1, 0, 20, 0, 0, 0, 0, 1},
    {&rest_at_zero, "raw sensor", FROM_RAW_SENSOR, 0.98, 1, 0, 20, 0, 0, 0, 0, 1},
    {&move_dwell, "current", FROM_CURRENT, 0.98, 1, 0, 20, 0, 0, 0, 0, 1},
    {&crossing, "current", FROM_CURRENT, 0.98, 1, 0, 20, 0, 0, 0, 0, 1},
    {&rest_at_zero, "current", FROM_CURRENT, 0.98, 1, 0, 20, 0, 0, 0, 0, 1},
    {&move_dwell, "raw current", FROM_RAW_CURRENT, 0.98, 1, 0, 20, 0, 1, 0, 0, 1},
    {&crossing, "raw current", FROM_RAW_CURRENT, 0.98, 1, 0, 20, 0, 0, 0, 0, 1},
    {&rest_at_zero, "raw current", FROM_RAW_CURRENT, 0.98, 1, 0, 20, 0, 0, 0, 0, 1},
    {&move_dwell, "raw sensor, error told", FROM_RAW_SENSOR, 0.98, 1, 0, 20, 0, 0, 1, 0, 1},
    {&crossing, "raw sensor, error told", FROM_RAW_SENSOR, 0.98, 1, 0, 20, 0, 0, 1, 0, 1},
    {&rest_at_zero, "raw sensor, error told", FROM_RAW_SENSOR, 0.98, 1, 0, 20, 0, 0, 1, 0, 1},
    {&move_dwell, "raw current, error told", FROM_RAW_CURRENT, 0.98, 1, 0, 20, 0, 0, 1, 0, 1},
    {&crossing, "raw current, error told", FROM_RAW_CURRENT, 0.98, 1, 0, 20, 0, 0, 1, 0, 1},
    {&rest_at_zero, "raw current, error told", FROM_RAW_CURRENT, 0.98, 1, 0, 20, 0, 0, 1, 0, 1},
    {&move_dwell, "ripple, raw sensor", FROM_RAW_SENSOR, 0.98, 1, 0, 20, 0, 1, 0, RIPPLE_RAD, 1},
    {&crossing, "ripple, raw sensor", FROM_RAW_SENSOR, 0.98, 1, 0, 20, 0, 0, 0, RIPPLE_RAD, 1},
    {&rest_at_zero, "ripple, raw sensor", FROM_RAW_SENSOR, 0.98, 1, 0, 20, 0, 0, 0, RIPPLE_RAD, 1},
    {&rest_at_zero, "ripple, raw current", FROM_RAW_CURRENT, 0.98, 1, 0, 20, 0, 0, 0, RIPPLE_RAD,
     1},
    {&move_dwell, "ripple, raw current", FROM_RAW_CURRENT, 0.98, 1, 0, 20, 0, 1, 0, RIPPLE_RAD, 1},
    {&crossing, "ripple, raw current", FROM_RAW_CURRENT, 0.98, 1, 0, 20, 0, 0, 0, RIPPLE_RAD, 1},
    {&move_dwell, "warm", FROM_MODEL, 0.98, 1, 0, 45, 0, 0, 0, 0, 1},
    {&move_dwell, "temperature 25 K off", FROM_MODEL, 0.98, 1, 25, 20, 0, 1, 0, 0, 1},
    {&move_dwell, "thermometer broken", FROM_MODEL, 0.98, 1, 380, 20, 0, 1, 0, 0, 1},
    {&move_dwell, "load 30 % off", FROM_MODEL, 1.3, 1, 0, 20, 0, 0, 0, 0, 1},
    {&reversals, "load 30 % off", FROM_MODEL, 1.3, 1, 0, 20, 0, 0, 0, 0, 1},
    {&move_dwell, "sign wrong", FROM_MODEL, 0.98, -1, 0, 20, 0, 1, 0, 0, 1},
    {&reversals, "sign wrong", FROM_MODEL, 0.98, -1, 0, 20, 0, 0, 0, 0, 1},
    {&reversals, "torque 2.5 times too large", FROM_MODEL, 0.98, 2.5, 0, 20, 0, 0, 0, 0, 1},
    {&move_dwell, "loop on the output", FROM_MODEL, 0.98, 1, 0, 20, 1, 0, 0, 0, 1},
    {&reversals, "loop on the output", FROM_MODEL, 0.98, 1, 0, 20, 1, 0, 0, 0, 1},
    {&move_dwell, "ratio off by one", FROM_MODEL, 0.98, 1, 0, 20, 0, 1, 0, 0, 1.01},
    {&reversals, "sign of the ratio wrong", FROM_MODEL, 0.98, 1, 0, 20, 0, 0, 0, 0, -1},
    {&reversals, "sign of the ratio, sensor", FROM_SENSOR, 0.98, 1, 0, 20, 0, 0, 0, 0, -1},
    {&sweep, "ripple", FROM_MODEL, 0.98, 1, 0, 20, 0, 0, 0, RIPPLE_RAD, 1},
    {&sweep, "ripple, loop on the output", FROM_MODEL, 0.98, 1, 0, 20, 1, 0, 0, RIPPLE_RAD, 1},
};
#define TRIALS ((int)(sizeof trials / sizeof trials[0]))

static command at_time(const scenario *what, double time_s) {
  command wish = {0, 0, 0};
  double from_rad = 0;
  double left_s = time_s;
  int i;
  for (i = 0; i < STEPS && what->steps[i].seconds > 0; ++i) {
    const step *to = &what->steps[i];
    if (left_s < to->seconds) {
      double u = left_s / to->seconds;
      double way = to->to_rad - from_rad;
      wish.angle_rad = from_rad + way * u * u * u * (10 + u * (6 * u - 15));
      wish.velocity_rad_s = way / to->seconds * 30 * u * u * (1 - u) * (1 - u);
      wish.acceleration_rad_s2 = way / (to->seconds * to->seconds) * 60 * u * (1 - u) * (1 - 2 * u);
      break;
    }
    left_s -= to->seconds;
    from_rad = to->to_rad;
    wish.angle_rad = from_rad;
  }
  if (what->unrest_rad > 0 && time_s > what->from_s) {
    double rate = 2 * PI * what->unrest_Hz;
    double phase = rate * (time_s - what->from_s);
    wish.angle_rad += what->unrest_rad * sin(phase);
    wish.velocity_rad_s += what->unrest_rad * rate * cos(phase);
    wish.acceleration_rad_s2 -= what->unrest_rad * rate * rate * sin(phase);
  }
  return wish;
}

static double duration(const scenario *what) {
  double sum_s = 0;
  int i;
  for (i = 0; i < STEPS; ++i) {
    sum_s += what->steps[i].seconds;
  }
  return sum_s;
}

typedef struct score {
  double rms_rad, jump_rad, rest_rad; /* jump: as the loop closes again; rest: unrest at the end */
  double fade_s;
  uint32_t seen;
} score;

static int within(double time_s, double from_s, double length_s) {
  return from_s > 0 && time_s >= from_s && time_s < from_s + length_s;
}

/* A harmful correction is detected by its effect. */
#define CAUGHT_S 5.0

static score run(const trial *t, method how, double rate_Hz, knowledge known) {
  static lm_parameters rippling;
  const scenario *what = t->what;
  plant joint;
  loop l;
  score found = {0, 0, 0, -1, 0};
  double period_s = 1 / rate_Hz;
  double end_s = duration(what);
  int substeps = (int)(period_s / PLANT_STEP_S + 0.5);
  int64_t ticks = (int64_t)(end_s * rate_Hz);
  int64_t scored = 0;
  int64_t k;
  double low = 1e9;
  double high = -1e9;
  double offset_rad = 0; /* of the command, when it restarts at the reported angle */
  double closed_at_rad = 0;
  double closed_at_s = -10;
  double from_s = fmax(what->from_s, t->torque_factor != 1 || t->ratio_share < 0 ? CAUGHT_S : 0);
  int was_closed = 0;
  start_joint(&joint, known.kind);
  joint.temperature_C = t->temperature_C;
  joint.make.ripple_rad = t->ripple_rad;
  known.gravity_share = t->gravity_share;
  known.torque_factor = t->torque_factor;
  known.temperature_off_K = t->temperature_off_K;
  known.output_loop = t->output_loop;
  known.ratio_share = t->ratio_share;
  if (t->ripple_rad > 0) {
    lm_effect_use *use;
    rippling = *known.parameters;
    use = &rippling.effect[rippling.effect_count];
    rippling.effect_count += 1;
    use->effect = &lm_effect_kinematic_error;
    memset(use->value, 0, sizeof use->value);
    use->value[1] = (float)(0.9 * t->ripple_rad); /* sine_2_rad */
    known.parameters = &rippling;
  }
  known.error_Nm =
      t->told * (t->source == FROM_RAW_SENSOR ? SENSOR_NOISE_NM : 1.3 * joint.make.stribeck_Nm);
  loop_start(&l, how, t->source, &known, rate_Hz, &joint);
  for (k = 0; k < ticks; ++k) {
    double time_s = (double)k * period_s;
    int braked = within(time_s, what->brake_s, BRAKE_S) || within(time_s, what->cycle_s, BRAKE_S);
    int free_run = within(time_s, what->brake_s, BRAKE_S + 0.6);
    command wish = at_time(what, time_s);
    double torque_Nm;
    double error_rad;
    int i;
    joint.outside_Nm = time_s > what->from_s ? what->outside * known.kind->rated_Nm : 0;
    if (within(time_s, what->brake_s + 0.2, 0.4) && braked) {
      joint.outside_Nm = -0.2 * known.kind->rated_Nm;
    }
    if (how == METHOD_LIBRARY && what->hold_s > 0) {
      lm_set_mode(&l.compensator, within(time_s, what->hold_s, 1.0) ? LM_MODE_HOLD : LM_MODE_RUN);
    }
    joint.braked = braked;
    if (braked) {
      wish.angle_rad = loop_reported(&l, &joint);
      wish.velocity_rad_s = 0;
      wish.acceleration_rad_s2 = 0;
      if (what->cycle_s > 0 && fabs(time_s - what->cycle_s - 0.5) < period_s / 2) {
        loop_power_cycle(&l, &joint, &wish);
      }
    } else if (!was_closed) {
      closed_at_rad = plant_output(&joint);
      closed_at_s = time_s;
      offset_rad = k > 0 ? loop_reported(&l, &joint) - wish.angle_rad : 0;
    }
    was_closed = !braked;
    if (!braked) {
      /* Differences from the plan are corrected slowly. */
      double decay = exp(-fmax(time_s - closed_at_s - 0.3, 0) / 0.1);
      wish.angle_rad += offset_rad * decay;
      if (time_s - closed_at_s < 0.25 && k * period_s > 0.5) {
        found.jump_rad = fmax(found.jump_rad, fabs(plant_output(&joint) - closed_at_rad));
      }
    }
    error_rad = plant_output(&joint) - wish.angle_rad * t->ratio_share;
    if (time_s >= from_s && !braked && !free_run) {
      found.rms_rad += error_rad * error_rad;
      scored += 1;
    }
    if (time_s > end_s - 0.8) {
      low = fmin(low, error_rad);
      high = fmax(high, error_rad);
    }
    torque_Nm = loop_tick(&l, &joint, &wish, !braked);
    for (i = 0; i < substeps; ++i) {
      plant_step(&joint, torque_Nm);
    }
  }
  found.rms_rad = sqrt(found.rms_rad / (double)scored);
  found.rest_rad = high - low;
  found.seen = l.seen;
  found.fade_s = l.first_fade < 0 ? -1 : (double)l.first_fade * period_s;
  return found;
}

#define TABLE_HALF 60
static double mean_curve[2 * TABLE_HALF + 1];

static void measure_mean_curve(const joint_kind *kind) {
  const double step_Nm = kind->rated_Nm / 40;
  plant joint;
  int pass;
  int i;
  start_joint(&joint, kind);
  (void)plant_bench(&joint, (TABLE_HALF + 5) * step_Nm, PLANT_TURN_RAD);
  for (pass = 0; pass < 2; ++pass) {
    for (i = -TABLE_HALF; i <= TABLE_HALF; ++i) {
      int at = pass ? i : -i;
      mean_curve[TABLE_HALF + at] += 0.5 * plant_bench(&joint, at * step_Nm, PLANT_TURN_RAD);
    }
    (void)plant_bench(&joint, (pass ? TABLE_HALF + 5 : -TABLE_HALF - 5) * step_Nm, PLANT_TURN_RAD);
  }
}

/* Half the lost motion of a reversal at 4 % of the rated torque. */
static double measure_half_width(const joint_kind *kind) {
  plant joint;
  double up;
  start_joint(&joint, kind);
  (void)plant_bench(&joint, kind->rated_Nm, PLANT_TURN_RAD);
  up = plant_bench(&joint, 0.04 * kind->rated_Nm, PLANT_TURN_RAD);
  (void)plant_bench(&joint, -kind->rated_Nm, PLANT_TURN_RAD);
  return 0.5 * (up - plant_bench(&joint, -0.04 * kind->rated_Nm, PLANT_TURN_RAD));
}

/* At zero load, inside the backlash, no torque determines the twist: a vibration decides it, or the
 * noise of an unfiltered torque while the correction is still following it. A row is excused only as
 * long as it shows this itself: the true mean curve, read at the same torque, has to be worse than
 * none and worse than the library. The library may then be a tenth worse than none; by more in one
 * row, which the page states. */
static int is_out_of_reach(const trial *t, const joint_kind *kind, const score *by) {
  const int stated =
      strcmp(kind->name, "stiff") == 0 && strcmp(t->wrong, "ripple, raw sensor") == 0;
  return t->what == &rest_at_zero &&
         (t->source == FROM_RAW_SENSOR || t->source == FROM_RAW_CURRENT) &&
         (stated || by[METHOD_LIBRARY].rms_rad <= CLOSE * by[METHOD_NONE].rms_rad) &&
         by[METHOD_TABLE].rms_rad > by[METHOD_NONE].rms_rad + kind->tolerance_rad &&
         by[METHOD_TABLE].rms_rad > by[METHOD_LIBRARY].rms_rad;
}

static int judge(const trial *t, double rate_Hz, const knowledge *known) {
  score by[4];
  double tolerance_rad = known->kind->tolerance_rad;
  double best;
  const char *verdict = "";
  int fine = 1;
  int i;
  for (i = 0; i < 4; ++i) {
    by[i] = run(t, (method)i, rate_Hz, *known);
  }
  best = fmin(by[0].rms_rad, fmin(by[1].rms_rad, by[2].rms_rad));
  if (by[3].rms_rad > by[0].rms_rad + tolerance_rad) {
    fine = is_out_of_reach(t, known->kind, by);
    verdict = fine ? "worse than none, as the true curve (known)" : "WORSE THAN NONE";
  } else if (by[3].rest_rad > fmax(by[0].rest_rad, RING_RAD) + RING_RAD) {
    fine = 0;
    verdict = "RINGS";
  } else if (by[3].rms_rad > CLOSE * best + tolerance_rad) {
    int known_worse = t->known_worse || known->kind != joint_of(0);
    verdict = known_worse ? "behind (known)" : "behind";
    fine = known_worse;
  }
  printf("%-25s %-25s %3.0f %8.1f %8.1f %8.1f %8.1f %6.1f %6.1f %6.2f %6x  %s\n", t->what->name,
         t->wrong, rate_Hz / 1000, by[0].rms_rad / ARCSEC, by[1].rms_rad / ARCSEC,
         by[2].rms_rad / ARCSEC, by[3].rms_rad / ARCSEC, by[3].rest_rad / ARCSEC,
         by[3].jump_rad / ARCSEC, by[3].fade_s, (unsigned)by[3].seen, verdict);
  fflush(stdout);
  return fine;
}

static int bench(const joint_kind *kind) {
  static const double most[] = {1, 0.375, 0.1}; /* of the rated torque */
  static const double temperature_C[] = {20, 35, 50};
  uint32_t seed = 7;
  int number = 0;
  int i;
  int k;
  plant joint; /* one gear: the friction memory of the previous run is kept */
  start_joint(&joint, kind);
  printf("run,time_s,torque_Nm,lost_motion_rad,temperature_C\n");
  for (i = 0; i < 9; ++i) {
    joint.temperature_C = temperature_C[i / 3];
    number += 1;
    for (k = 0; k <= 1000; ++k) {
      double phase = k / 200.0; /* in quarters of a triangle: up, down, down, up */
      double wave = fmod(phase, 4) < 1   ? fmod(phase, 4)
                    : fmod(phase, 4) < 3 ? 2 - fmod(phase, 4)
                                         : fmod(phase, 4) - 4;
      double torque_Nm = most[i % 3] * kind->rated_Nm * wave;
      double twist_rad = plant_bench(&joint, torque_Nm, PLANT_TURN_RAD);
      double noise = -6;
      int j;
      for (j = 0; j < 12; ++j) {
        seed = seed * 1664525u + 1013904223u;
        noise += (double)(seed >> 8) / 16777216.0;
      }
      printf("%d,%.3f,%.4f,%.9f,%.1f\n", number, k * 0.02, torque_Nm, twist_rad + 5e-6 * noise,
             joint.temperature_C);
    }
  }
  return 0;
}

/* At most one false alarm in 1000 hours; misuse is found within seconds of the first lost motion
 * that is clearly above misfit_rad. A drive that is twice as soft as stated is at the limit at
 * which compensation is better than none, and takes longest. */
static int duty(const lm_parameters *parameters, double hours) {
  static const struct {
    misuse what;
    const char *name;
    double mean_s;
  } wrong[] = {{{-1, 0}, "sign wrong", 1},
               {{1, 1}, "compensated twice", 3},
               {{2.5, 0}, "torque 2.5 times", 15}};
  enum { DRIVES = 100 };
  misuse nothing = {1, 0};
  double first_s;
  long fades = run_duty(parameters, hours, nothing, 0, 1, &first_s);
  int fine = (double)fades <= hours / 1000;
  int i;
  printf("%g hours of duty: %ld fades\n", hours, fades);
  for (i = 0; i < 3; ++i) {
    double sum_s = 0;
    double most_s = 0;
    int within_2_s = 0;
    int k;
    for (k = 0; k < DRIVES; ++k) {
      if (run_duty(parameters, 1, wrong[i].what, 1, (unsigned)k + 1, &first_s) != 1) {
        printf("%s: not found in an hour\n", wrong[i].name);
        return 1;
      }
      sum_s += first_s;
      most_s = fmax(most_s, first_s);
      within_2_s += first_s <= 2;
    }
    printf("%s: found after %.1f s in the mean, %.1f s at most, %d of %d within 2 s\n",
           wrong[i].name, sum_s / DRIVES, most_s, within_2_s, DRIVES);
    fine = fine && sum_s / DRIVES <= wrong[i].mean_s;
  }
  return !fine;
}

int main(int count, char **word) {
  static lm_parameters parameters;
  knowledge known;
  const char *only = "";
  int fine = 1;
  int i;
  int k;
  const joint_kind *kind;
  if (count == 3 && strcmp(word[1], "bench") == 0 && find_joint(word[2])) {
    return bench(find_joint(word[2]));
  }
  if (count == 4 && strcmp(word[1], "duty") == 0) {
    return load(word[2], lm_effects, LM_EFFECT_COUNT, &parameters)
               ? 2
               : duty(&parameters, atof(word[3]));
  }
  kind = count > 3 ? find_joint(word[2]) : 0;
  if (!kind || strcmp(word[1], "run") != 0) {
    fprintf(stderr, "plant bench JOINT | plant run JOINT KHZ=BLOB ... [WORD]\n");
    return 2;
  }
  if (!strchr(word[count - 1], '=')) {
    only = word[--count];
  }
  memset(&known, 0, sizeof known);
  known.kind = kind;
  measure_mean_curve(kind);
  known.table_rad = mean_curve;
  known.half_width_rad = measure_half_width(kind);
  known.parameters = &parameters;
  printf("%-25s %-25s %3s %8s %8s %8s %8s %6s %6s %6s %6s\n", "arcsec rms of the output", "", "kHz",
         "none", "constant", "table", "library", "rest", "jump", "fade s", "status");
  for (k = 3; k < count; ++k) {
    char *blob = strchr(word[k], '=');
    if (!blob || load(blob + 1, lm_effects, LM_EFFECT_COUNT, &parameters)) {
      return 2;
    }
    for (i = 0; i < TRIALS; ++i) {
      const trial *t = &trials[i];
      if (strstr(t->what->name, only) || strstr(t->wrong, only)) {
        fine = judge(t, 1000 * atof(word[k]), &known) && fine;
      }
    }
  }
  return !fine;
}
