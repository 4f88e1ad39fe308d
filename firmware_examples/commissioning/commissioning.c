#include "commissioning.h"

#include "sine.h"

#define PI 3.14159265f

/* Times of the stages. */
#define STAND_S 1.0f
#define MOVE_S 1.0f
#define SETTLE_S 0.5f
#define MEASURE_S 0.3f
#define BACK_S 0.3f /* in which the correction of an aborted run returns to zero */
#define SHAKE_CYCLES 5
#define SHAKE_RAMP_CYCLES 2
#define SWEEP_TONES 24
#define SWEEP_STEP 1.08f /* from tone to tone: the width of a resonance of Q 12 */
#define SWEEP_FIRST 2.0f /* first tone over ringing_Hz, which is a fifth of the resonance */
#define SWEEP_CYCLES 8
#define SWEEP_RAMP_CYCLES 4
#define SWEEP_RAD_S2 0.5f
#define SWEEP_RAD 1e-4f

/* Thresholds of the checks. Each is half-way, in its own measure, between a sound axis and the
 * mildest fault to be detected. */
#define PERIOD_SHARE 0.02f     /* mean; crystals are within 1e-4, a wrong divider is off by 2 */
#define PERIOD_ONE 0.5f        /* any one tick, as LM_STATE_PERIOD_WRONG */
#define NOISE_SHARE (1.0f / 3) /* of the acceleration limit, as lostmotion export allows */
#define STUCK_SHARE 0.5f       /* 1 is sound, 0 is not */
#define INPUT_SHARE 0.02f      /* of the travel: more than the error of any position loop at rest */
#define OUTPUT_LOOP_SHARE 0.5f /* 0: the motor follows the command; 1: the output does */
#define OUTPUT_STUCK_SHARE 0.1f
#define TORQUE_STUCK_SHARE 0.02f /* model over measured */
#define TORQUE_LEAST 0.25f       /* the same: at light load a data sheet is wrong by up to 3 */
#define TORQUE_MOST 2.0f
#define SENSED_LEAST 0.5f /* measured over commanded: an inertia may be wrong by a third */
#define SENSED_MOST 2.0f
#define VELOCITY_LEAST 0.5f
#define VELOCITY_MOST 1.5f
#define LATE_TANGENT 0.7f   /* of the phase: 35 degrees */
#define HEADROOM_SHARE 0.5f /* of the swing of the lost motion that may remain uncorrected */
#define PATH_LEAST 0.5f
#define PATH_MOST 1.5f
#define LOOP_GAIN 0.7f /* of the loop through the torque; it rings at 1 */
#define RUSH_SHARE 0.5f
#define RUSH_AFTER_S 0.5f   /* after that any position loop has followed */
#define RUSH_MOST_S 1.0f    /* for a fifth of the correction: slower, it lags behind any motion */
#define FRICTION_MOST 1.5f  /* of the stated one: with the wrong sign the true one adds to it */
#define PACE_SHARE 0.25f    /* of the bound: without the velocity the motor may lag by all of it */
#define FEED_LEAST 0.1f     /* of the error of the loop: less may be that of friction */
#define FEED_MOST 2.0f      /* beyond it the error is larger than without */
#define SEEN_FRICTIONS 2.0f /* of the motor: less cannot be separated from it in the current */
#define SEEN_NOISES 4.0f    /* a swing of this multiple of noise_rad is separated from noise */

enum { STAND, TRAVEL, PACE, SHAKE, PATH, SWEEP, RUSH, OVER };

static float size(float value) {
  return value < 0 ? -value : value;
}

static float least(float a, float b) {
  return a < b ? a : b;
}

/* Whether low <= value <= high; NaN is not. */
static int within(float value, float low, float high) {
  return value >= low && value <= high;
}

/* Whether a value was stated (not LM_UNKNOWN). */
static int known(float value) {
  return within(value, -1e12f, 1e12f);
}

static int32_t ticks_of(const commissioning *run, float seconds) {
  return (int32_t)(seconds / run->set.parameters->limits.period_s + 0.5f);
}

static void begin(commissioning *run, int32_t stage) {
  int i;
  run->stage = stage;
  run->tick = 0;
  run->part = 0;
  for (i = 0; i < COMMISSIONING_SUMS; ++i) {
    run->sum[i] = 0;
  }
}

static void next_part(commissioning *run) {
  int32_t part = run->part + 1;
  begin(run, run->stage);
  run->part = part;
}

static void end(commissioning *run, commissioning_finding finding) {
  begin(run, OVER);
  run->finding = finding;
  run->back_rad = run->correction_rad;
}

static void give_up(commissioning *run, commissioning_finding finding) {
  end(run, finding);
  run->stop = 1;
}

commissioning_settings commissioning_suggest(const lm_parameters *parameters, float ratio) {
  commissioning_settings set;
  set.parameters = parameters;
  set.headroom.correction_rad = parameters->limits.correction_rad;
  set.headroom.velocity_rad_s = parameters->limits.velocity_rad_s;
  set.headroom.acceleration_rad_s2 = parameters->limits.acceleration_rad_s2;
  set.headroom.jerk_rad_s3 = parameters->limits.jerk_rad_s3;
  set.ratio = ratio;
  set.travel_rad = 0.05f;
  set.shake_rad = 0.02f;
  set.shake_Hz = 2.5f;
  set.path_rad = parameters->limits.correction_rad / 5;
  set.friction_Nm = 0;
  set.torque_bound_Nm = parameters->torque_limit_Nm / 2;
  set.follow_bound_rad = set.travel_rad / 5;
  set.output_loop = 0;
  return set;
}

static int has_sense(const commissioning_settings *set) {
  const lm_limits *limits = &set->parameters->limits;
  return within(size(set->ratio), 1, 1000) && within(set->travel_rad, 1e-3f, 1) &&
         within(set->shake_rad, 1e-5f, set->travel_rad) && within(set->shake_Hz, 0.2f, 10) &&
         set->friction_Nm >= 0 &&
         within(set->path_rad, 10 * set->parameters->watch.noise_rad,
                1.001f * limits->correction_rad / 5) &&
         set->headroom.velocity_rad_s > 0 && set->headroom.acceleration_rad_s2 > 0 &&
         set->torque_bound_Nm > 0 && set->follow_bound_rad > 0 && limits->period_s <= 0.01f;
}

commissioning_finding commissioning_start(commissioning *run,
                                          const commissioning_settings *settings) {
  run->set = *settings;
  run->unchecked = 0;
  run->found = 0;
  run->stop = 0;
  run->turned_rad = 0;
  run->work_J = 0;
  run->started = 0;
  run->fed = 0;
  run->sensed = 0;
  run->correction_rad = 0;
  run->command_rad = 0;
  run->finding = COMMISSIONING_RUNNING;
  begin(run, STAND);
  if (lm_check_parameters(settings->parameters, 0) != LM_OK) {
    end(run, COMMISSIONING_PARAMETERS);
  } else if (!has_sense(settings)) {
    end(run, COMMISSIONING_SETTINGS);
  }
  return run->finding;
}

void commissioning_abort(commissioning *run) {
  if (run->finding == COMMISSIONING_RUNNING) {
    give_up(run, COMMISSIONING_ABORTED);
  }
}

/* --- motions --- */

/* From 0 to 1 in a unit of time, at rest at both ends: position, velocity, acceleration. The
 * largest velocity is 1.875, the largest acceleration 5.7735. */
typedef struct way {
  float place, speed, change;
} way;

static way go(float u) {
  way at = {0, 0, 0};
  if (u >= 1) {
    at.place = 1;
  } else if (u > 0) {
    at.place = u * u * u * (10 + u * (6 * u - 15));
    at.speed = 30 * u * u * (1 - u) * (1 - u);
    at.change = 60 * u * (1 - u) * (1 - 2 * u);
  }
  return at;
}

static void command(commissioning_output *out, float from_rad, float to_rad, float time_s,
                    float in_s) {
  way at = go(time_s / in_s);
  float by_rad = to_rad - from_rad;
  out->command_rad = from_rad + by_rad * at.place;
  out->velocity_rad_s = by_rad * at.speed / in_s;
  out->acceleration_rad_s2 = by_rad * at.change / (in_s * in_s);
}

static void correct(commissioning_output *out, float from_rad, float to_rad, float time_s,
                    float in_s) {
  way at = go(time_s / in_s);
  float by_rad = to_rad - from_rad;
  out->correction.correction_rad = from_rad + by_rad * at.place;
  out->correction.velocity_rad_s = by_rad * at.speed / in_s;
  out->correction.acceleration_rad_s2 = by_rad * at.change / (in_s * in_s);
}

/* A sine that grows over some cycles, continues for others and fades again; ends at rest. */
typedef struct tone {
  int32_t cycle; /* ticks */
  int32_t ramp, whole, length;
  float rate_per_s;
} tone;

static tone make_tone(const commissioning *run, float frequency_Hz, int32_t ramp, int32_t cycles) {
  tone t;
  float period_s = run->set.parameters->limits.period_s;
  t.cycle = ticks_of(run, 1 / frequency_Hz);
  t.cycle = t.cycle < 4 ? 4 : t.cycle;
  t.ramp = ramp * t.cycle;
  t.whole = cycles * t.cycle;
  t.length = 2 * t.ramp + t.whole;
  t.rate_per_s = 2 * PI / ((float)t.cycle * period_s);
  return t;
}

static float phase_of(const tone *t, int32_t tick) {
  return 2 * PI * (float)(tick % t->cycle) / (float)t->cycle;
}

/* Position, velocity and acceleration of the tone of amplitude 1, including the derivatives of its
 * envelope. */
static way sound(const tone *t, float period_s, int32_t tick) {
  float phase = phase_of(t, tick);
  float s = sine(phase);
  float c = sine(phase + PI / 2);
  float ramp_s = (float)t->ramp * period_s;
  int32_t left = t->length - tick;
  int rising = tick < t->ramp;
  way e = go(rising ? (float)tick / (float)t->ramp : (float)left / (float)t->ramp);
  float slope = (rising ? e.speed : -e.speed) / ramp_s;
  float bend = e.change / (ramp_s * ramp_s);
  way at;
  at.place = e.place * s;
  at.speed = e.place * t->rate_per_s * c + slope * s;
  at.change = (bend - e.place * t->rate_per_s * t->rate_per_s) * s + 2 * slope * t->rate_per_s * c;
  return at;
}

static int is_whole(const tone *t, int32_t tick) {
  return tick >= t->ramp && tick < t->ramp + t->whole;
}

/* Adds a sample to the sine and cosine parts sum[2 k], sum[2 k + 1] of a signal. */
static void listen(commissioning *run, int k, const tone *t, float value) {
  float phase = phase_of(t, run->tick);
  run->sum[2 * k] += value * sine(phase) * 2 / (float)t->whole;
  run->sum[2 * k + 1] += value * sine(phase + PI / 2) * 2 / (float)t->whole;
}

static float amplitude_of(const float part[2]) {
  return square_root(part[0] * part[0] + part[1] * part[1]);
}

static float amplitude(const commissioning *run, int k) {
  return amplitude_of(&run->sum[2 * k]);
}

/* --- measurements of the host, relative to the initial position --- */

static float motor_rad(const commissioning *run, const commissioning_input *now) {
  return (now->input_angle_rad - run->input_start_rad) / run->set.ratio;
}

static float output_rad(const commissioning *run, const commissioning_input *now) {
  return now->output_angle_rad - run->output_start_rad;
}

static float noise_rad(const commissioning *run) {
  return run->set.parameters->watch.noise_rad;
}

/* --- stages: each tick, and the check at the end --- */

/* Time for a fifth of the largest correction within the limits and the headroom. */
static float rush_seconds(const commissioning *run) {
  const lm_limits *limits = &run->set.parameters->limits;
  const lm_headroom *room = &run->set.headroom;
  float rad = limits->correction_rad / 5;
  float by_speed_s = 1.875f * rad / least(limits->velocity_rad_s, room->velocity_rad_s);
  float change_rad_s2 = least(limits->acceleration_rad_s2, room->acceleration_rad_s2);
  float by_change_s = square_root(5.7735f * rad / change_rad_s2);
  return by_speed_s > by_change_s ? by_speed_s : by_change_s;
}

/* A load that the model and a measurement see. */
static int is_seen(const commissioning *run, float torque_Nm) {
  return torque_Nm > SEEN_FRICTIONS * run->set.friction_Nm &&
         torque_Nm * lm_find_greatest_slope(&run->set.parameters->curve) >
             SEEN_NOISES * noise_rad(run);
}

/* The torque as measured over that of the command. At rest its sign is certain where friction cannot
 * hide the load; its scale where it hides little. */
static commissioning_finding judge_sensed(commissioning *run, float commanded_Nm, float share) {
  const int seen = is_seen(run, commanded_Nm);
  if (!run->has_sensed || !(seen || (run->stage == STAND && run->set.friction_Nm > 0 &&
                                     commanded_Nm > run->set.friction_Nm))) {
    return COMMISSIONING_RUNNING;
  }
  run->sensed = 1;
  run->found = share;
  return seen && size(share) < TORQUE_STUCK_SHARE            ? COMMISSIONING_TORQUE_STUCK
         : share < 0                                         ? COMMISSIONING_TORQUE_SIGN
         : seen && !within(share, SENSED_LEAST, SENSED_MOST) ? COMMISSIONING_TORQUE_SCALE
                                                             : COMMISSIONING_RUNNING;
}

static void judge_standstill(commissioning *run) {
  const lm_limits *limits = &run->set.parameters->limits;
  float n = (float)run->tick;
  float mean_s = run->sum[0] / n;
  float mean_rad = run->sum[3] / n;
  float unrest_rad2 = run->sum[4] / n - mean_rad * mean_rad;
  float unrest_rad_s2 = square_root(run->sum[2] / n);
  float most_rad = least(limits->correction_rad, run->set.headroom.correction_rad);
  float torque_Nm = run->set.parameters->valid.torque_Nm;
  commissioning_finding finding;
  float side;
  run->torque_start_Nm = run->sum[5] / n;
  run->found = mean_s;
  if (size(mean_s / limits->period_s - 1) > PERIOD_SHARE ||
      run->sum[1] > PERIOD_ONE * limits->period_s) {
    end(run, COMMISSIONING_PERIOD);
    return;
  }
  finding =
      judge_sensed(run, size(run->commanded_start_Nm), run->sum[6] / n / run->commanded_start_Nm);
  if (finding != COMMISSIONING_RUNNING) {
    end(run, finding);
    return;
  }
  run->found = unrest_rad_s2;
  if (unrest_rad_s2 > NOISE_SHARE * limits->acceleration_rad_s2 ||
      unrest_rad2 > noise_rad(run) * noise_rad(run)) {
    end(run, COMMISSIONING_TORQUE_NOISE);
    return;
  }
  /* The largest correction that the fitted range of torque requires. */
  torque_Nm = torque_Nm > 0 ? torque_Nm : run->set.parameters->torque_limit_Nm;
  for (side = -1; side < 2; side += 2) {
    lm_memory memory;
    lm_conditions at = LM_CONDITIONS_UNKNOWN;
    at.torque_Nm = side * torque_Nm;
    run->found = size(lm_evaluate_model(run->set.parameters, &run->shadow.memory, &memory, &at));
    if (run->found > most_rad) {
      end(run, COMMISSIONING_HEADROOM_SIZE);
      return;
    }
  }
  run->found = rush_seconds(run);
  if (run->found > RUSH_MOST_S) {
    end(run, COMMISSIONING_HEADROOM_RATE);
    return;
  }
  begin(run, TRAVEL);
}

static void stand(commissioning *run, const commissioning_input *now, const lm_correction *shadow) {
  const lm_limits *limits = &run->set.parameters->limits;
  float off_s = size(now->elapsed_s - limits->period_s);
  float moved_rad = shadow->correction_rad - run->stood_rad;
  run->sum[0] += now->elapsed_s;
  run->sum[1] = off_s > run->sum[1] ? off_s : run->sum[1];
  run->sum[2] += shadow->acceleration_rad_s2 * shadow->acceleration_rad_s2;
  run->sum[3] += moved_rad;
  run->sum[4] += moved_rad * moved_rad;
  run->sum[5] += now->conditions.torque_Nm;
  run->sum[6] += run->has_sensed ? now->sensed_Nm : 0;
  run->tick += 1;
  if (shadow->status & LM_STATE_CONDITION_MISSING) {
    give_up(run, COMMISSIONING_CONDITION);
  } else if (shadow->status & (LM_STATE_TORQUE_CLIPPED | LM_STATE_EXTRAPOLATED)) {
    give_up(run, COMMISSIONING_RANGE);
  } else if (run->tick >= ticks_of(run, STAND_S)) {
    judge_standstill(run);
  }
}

/* Part of four values at the stops that varies with the load: without their mean, and without the
 * part that, like friction, changes sign with the direction of approach. */
static void leave_load(float value[COMMISSIONING_STOPS]) {
  static const float direction[COMMISSIONING_STOPS] = {1, -1, -1, 1};
  float mean = 0;
  float turned = 0;
  int i;
  for (i = 0; i < COMMISSIONING_STOPS; ++i) {
    mean += value[i] / COMMISSIONING_STOPS;
    turned += value[i] * direction[i] / COMMISSIONING_STOPS;
  }
  for (i = 0; i < COMMISSIONING_STOPS; ++i) {
    value[i] -= mean + turned * direction[i];
  }
}

/* If the loop closes on the output, or the drive already compensates, the motor deviates from its
 * command by the lost motion, and the output does not. */
static void judge_loop(commissioning *run) {
  float lost_rad[COMMISSIONING_STOPS];
  float off_rad[COMMISSIONING_STOPS];
  float power = 0;
  float shared = 0;
  int i;
  for (i = 0; i < COMMISSIONING_STOPS; ++i) {
    lost_rad[i] = run->at_output[i] - run->at_input[i];
    off_rad[i] = run->at_command[i] - run->at_input[i];
  }
  leave_load(lost_rad);
  leave_load(off_rad);
  for (i = 0; i < COMMISSIONING_STOPS; ++i) {
    power += lost_rad[i] * lost_rad[i];
    shared += lost_rad[i] * off_rad[i];
  }
  if (power < SEEN_NOISES * SEEN_NOISES * noise_rad(run) * noise_rad(run)) {
    run->unchecked |= COMMISSIONING_UNCHECKED_LOOP;
  } else {
    run->found = shared / power;
    if ((run->found > OUTPUT_LOOP_SHARE) != (run->set.output_loop != 0)) {
      end(run, run->set.output_loop ? COMMISSIONING_MOTOR_LOOP : COMMISSIONING_OUTPUT_LOOP);
      return;
    }
  }
  begin(run, PACE);
}

static void judge_ratio(commissioning *run) {
  float input_rad = run->at_input[0] - run->at_input[2];
  float out_rad = run->at_output[0] - run->at_output[2];
  float tooth_rad = size(input_rad / run->set.ratio); /* an error of 1 in the ratio */
  float lost_rad = 2 * size(run->at_model[0] - run->at_model[2]) + SEEN_NOISES * noise_rad(run);
  float limit_rad = tooth_rad / 2;
  if (limit_rad < lost_rad) {
    run->unchecked |= COMMISSIONING_UNCHECKED_TOOTH;
    limit_rad = lost_rad;
  }
  run->found = out_rad == 0 ? 0 : run->set.ratio * input_rad / out_rad;
  if (size(out_rad) < OUTPUT_STUCK_SHARE * size(input_rad)) {
    end(run, COMMISSIONING_OUTPUT_STUCK);
  } else if (out_rad * input_rad < 0) {
    end(run, COMMISSIONING_RATIO_SIGN);
  } else if (size(out_rad - input_rad) > limit_rad) {
    end(run, COMMISSIONING_RATIO);
  } else {
    judge_loop(run);
  }
}

/* A torque from a current: its velocity is that of the motor, and its work over the travel, which
 * ends where it began, is what its friction is stated wrong by. */
static commissioning_finding judge_current(commissioning *run) {
  const float way_rad = COMMISSIONING_STOPS * run->set.travel_rad;
  const float turned = run->turned_rad / way_rad;
  const float friction_Nm = size(run->work_J) / way_rad;
  run->found = turned;
  if (!within(turned, VELOCITY_LEAST, VELOCITY_MOST)) {
    return COMMISSIONING_VELOCITY;
  }
  run->found = run->set.friction_Nm > 0 ? friction_Nm / run->set.friction_Nm : 0;
  return run->found > FRICTION_MOST ? COMMISSIONING_FRICTION : COMMISSIONING_RUNNING;
}

static void judge_travel(commissioning *run) {
  float wish_rad = run->at_command[0] - run->at_command[2];
  float share = (run->at_input[0] - run->at_input[2]) / wish_rad;
  float close = INPUT_SHARE + 0.5f / size(run->set.ratio);
  run->found = share;
  if (size(share) < STUCK_SHARE) {
    end(run, COMMISSIONING_STUCK);
  } else if (share < 0) {
    end(run, COMMISSIONING_INPUT_SIGN);
  } else if (size(share - 1) > close) {
    end(run, COMMISSIONING_INPUT_SCALE);
  } else if (run->by_current && judge_current(run) != COMMISSIONING_RUNNING) {
    end(run, judge_current(run));
  } else if (run->has_output) {
    judge_ratio(run);
  } else {
    run->unchecked |= COMMISSIONING_UNCHECKED_OUTPUT;
    begin(run, PACE);
  }
}

static void travel(commissioning *run, const commissioning_input *now, const lm_correction *shadow,
                   commissioning_output *out) {
  static const float stop[COMMISSIONING_STOPS + 1] = {0, 1, 0, -1, 0};
  float time_s = (float)run->tick * run->set.parameters->limits.period_s;
  int32_t from = ticks_of(run, MOVE_S + SETTLE_S);
  int32_t n = ticks_of(run, MEASURE_S);
  int32_t i = run->part;
  command(out, run->set.travel_rad * stop[i], run->set.travel_rad * stop[i + 1], time_s, MOVE_S);
  if (run->by_current) {
    run->turned_rad += now->motor_rad_s / run->set.ratio * (stop[i + 1] - stop[i]) *
                       run->set.parameters->limits.period_s;
    run->work_J += now->sensed_Nm * out->velocity_rad_s * run->set.parameters->limits.period_s;
  }
  if (run->tick >= from) {
    run->sum[0] += motor_rad(run, now) / (float)n;
    run->sum[1] += (run->has_output ? output_rad(run, now) : 0) / (float)n;
    run->sum[2] += shadow->lost_motion_rad / (float)n;
  }
  run->tick += 1;
  if (run->tick >= from + n) {
    run->at_command[i] = run->set.travel_rad * stop[i + 1];
    run->at_input[i] = run->sum[0];
    run->at_output[i] = run->sum[1];
    run->at_model[i] = run->sum[2];
    next_part(run);
    if (run->part == COMMISSIONING_STOPS) {
      judge_travel(run);
    }
  }
}

/* The velocity that is fed forward makes the loop follow better than without it, if at all. */
static void judge_pace(commissioning *run) {
  const float before_rad[2] = {run->unfed_rad[0], run->unfed_rad[1]};
  const float by_rad[2] = {run->sum[0] - before_rad[0], run->sum[1] - before_rad[1]};
  const float error_rad2 = before_rad[0] * before_rad[0] + before_rad[1] * before_rad[1];
  const float moved_rad = amplitude_of(by_rad);
  run->found =
      error_rad2 > 0 ? -(by_rad[0] * before_rad[0] + by_rad[1] * before_rad[1]) / error_rad2 : 0;
  if (!(moved_rad > SEEN_NOISES * noise_rad(run) && size(run->found) > FEED_LEAST)) {
    run->unchecked |= COMMISSIONING_UNCHECKED_RATES;
    begin(run, SHAKE);
  } else if (!within(run->found, 0, FEED_MOST)) {
    end(run, COMMISSIONING_PACE);
  } else {
    begin(run, SHAKE);
  }
}

/* First without the velocity: so small that the bound holds even if the motor does not follow. */
static void pace(commissioning *run, const commissioning_input *now, commissioning_output *out) {
  const float rad = PACE_SHARE * run->set.follow_bound_rad;
  tone t = make_tone(run, run->set.shake_Hz, SHAKE_RAMP_CYCLES, SHAKE_CYCLES);
  way at = sound(&t, run->set.parameters->limits.period_s, run->tick);
  out->command_rad = rad * at.place;
  out->velocity_rad_s = run->part ? rad * at.speed : 0;
  out->acceleration_rad_s2 = rad * at.change;
  if (is_whole(&t, run->tick)) {
    listen(run, 0, &t, now->reported_rad - run->start_rad - run->command_rad);
  }
  run->tick += 1;
  if (run->tick > t.length + ticks_of(run, SETTLE_S)) {
    if (run->part == 0) {
      run->unfed_rad[0] = run->sum[0];
      run->unfed_rad[1] = run->sum[1];
      next_part(run);
    } else {
      judge_pace(run);
    }
  }
}

/* Signal k relative to signal 0, as the parts in phase and delayed by a quarter period. */
static commissioning_finding judge_torque(commissioning *run, int k) {
  const float *a = &run->sum[0];
  const float *b = &run->sum[2 * k];
  float power = a[0] * a[0] + a[1] * a[1];
  float in_phase = (a[0] * b[0] + a[1] * b[1]) / power;
  float late = (a[1] * b[0] - a[0] * b[1]) / power;
  float gain = square_root(in_phase * in_phase + late * late);
  run->found = gain;
  if (gain < TORQUE_STUCK_SHARE) {
    return COMMISSIONING_TORQUE_STUCK;
  }
  if (in_phase < 0) {
    return COMMISSIONING_TORQUE_SIGN;
  }
  if (size(late) > LATE_TANGENT * in_phase) {
    return COMMISSIONING_TORQUE_LATE;
  }
  return within(gain, TORQUE_LEAST, TORQUE_MOST) ? COMMISSIONING_RUNNING
                                                 : COMMISSIONING_TORQUE_SCALE;
}

/* Signal 0 is the measured lost motion or, without an output encoder, the torque from the motor
 * current; 1 the lost motion of the model; 2 the torque passed to the model; 3 the error of the
 * correction; 4 the torque of the command, 5 the same as measured. */
static void judge_shake(commissioning *run) {
  commissioning_finding finding;
  float seen_rad = SEEN_NOISES * noise_rad(run);
  float model_rad = amplitude(run, 1);
  float missed_rad = amplitude(run, 3);
  const float *a = &run->sum[8];
  const float *b = &run->sum[10];
  const float commanded_Nm = amplitude(run, 4);
  const int seen = run->has_output ? amplitude(run, 0) > seen_rad : is_seen(run, amplitude(run, 0));
  /* In phase: friction is not. */
  finding =
      judge_sensed(run, commanded_Nm, (a[0] * b[0] + a[1] * b[1]) / (commanded_Nm * commanded_Nm));
  if (finding != COMMISSIONING_RUNNING) {
    /* its sign or scale: the checks below would name an effect of it */
  } else if (seen) {
    finding = judge_torque(run, run->has_output ? 1 : 2);
  } else if (run->has_output && model_rad > 2 * seen_rad) {
    run->found = model_rad / amplitude(run, 0);
    finding = COMMISSIONING_TORQUE_SCALE;
  } else if (!run->sensed) {
    run->unchecked |= COMMISSIONING_UNCHECKED_TORQUE;
  } else {
    /* measured, and as commanded */
  }
  if (finding == COMMISSIONING_RUNNING && run->part) { /* it rang and no longer follows */
    finding = COMMISSIONING_TORQUE_NOISE;
  }
  if (finding == COMMISSIONING_RUNNING && model_rad > seen_rad &&
      missed_rad > HEADROOM_SHARE * model_rad) {
    run->found = missed_rad / model_rad;
    finding = COMMISSIONING_HEADROOM_RATE;
  }
  if (finding != COMMISSIONING_RUNNING) {
    end(run, finding);
  } else if (known(run->commanded_start_Nm)) {
    run->unfed_rad[0] = run->sum[12];
    run->unfed_rad[1] = run->sum[13];
    run->fed = 1;
    begin(run, SHAKE);
  } else {
    run->unchecked |= COMMISSIONING_UNCHECKED_FEED;
    begin(run, PATH);
  }
}

/* A torque that is fed forward moves the motor in its direction: in phase, or up to a quarter of a
 * period earlier where an integrator takes it over. The right one is about the load that made the
 * error of the loop. */
static void judge_feed(commissioning *run) {
  const float by_rad[2] = {run->sum[12] - run->unfed_rad[0], run->sum[13] - run->unfed_rad[1]};
  const float *const load_Nm = &run->sum[8];
  const float in_phase = -(load_Nm[0] * by_rad[0] + load_Nm[1] * by_rad[1]);
  const float early = -(load_Nm[0] * by_rad[1] - load_Nm[1] * by_rad[0]);
  const float error_rad = amplitude_of(run->unfed_rad);
  const float moved_rad = amplitude_of(by_rad);
  run->found = error_rad > 0 ? moved_rad / error_rad : 0;
  if (!(moved_rad > SEEN_NOISES * noise_rad(run) && run->found > FEED_LEAST)) {
    run->unchecked |= COMMISSIONING_UNCHECKED_FEED;
    begin(run, PATH);
  } else if (in_phase + early < 0) {
    end(run, COMMISSIONING_FEED_SIGN);
  } else if (run->found > FEED_MOST) {
    end(run, COMMISSIONING_FEED_SCALE);
  } else {
    begin(run, PATH);
  }
}

static void shake(commissioning *run, const commissioning_input *now, const lm_correction *shadow,
                  commissioning_output *out) {
  float period_s = run->set.parameters->limits.period_s;
  tone t = make_tone(run, run->set.shake_Hz, SHAKE_RAMP_CYCLES, SHAKE_CYCLES);
  way at = sound(&t, period_s, run->tick);
  const float commanded_Nm = now->commanded_Nm - run->commanded_start_Nm;
  out->command_rad = run->set.shake_rad * at.place;
  out->velocity_rad_s = run->set.shake_rad * at.speed;
  out->acceleration_rad_s2 = run->set.shake_rad * at.change;
  if (is_whole(&t, run->tick)) {
    float torque_Nm = now->conditions.torque_Nm - run->torque_start_Nm;
    float by_current_Nm =
        known(now->motor_torque_Nm) ? now->motor_torque_Nm - run->motor_start_Nm : 0;
    listen(run, 0, &t,
           run->has_output ? output_rad(run, now) - motor_rad(run, now) : by_current_Nm);
    listen(run, 1, &t, shadow->lost_motion_rad);
    listen(run, 2, &t, torque_Nm);
    run->part |= (shadow->status & LM_STATE_RINGING) != 0;
    listen(run, 3, &t, shadow->correction_rad + shadow->lost_motion_rad); /* missed */
    listen(run, 4, &t, run->has_sensed || run->fed ? commanded_Nm : 0);
    listen(run, 5, &t, run->has_sensed ? now->sensed_Nm - run->sensed_start_Nm : 0);
    listen(run, 6, &t, now->reported_rad - run->start_rad - run->command_rad);
  }
  out->feed_Nm = run->fed ? commanded_Nm : 0;
  run->tick += 1;
  if (run->tick > t.length + ticks_of(run, SETTLE_S) && run->fed) {
    judge_feed(run);
  } else if (run->tick > t.length + ticks_of(run, SETTLE_S)) {
    judge_shake(run);
  }
}

static void judge_path(commissioning *run) {
  float motor = (run->at_input[0] - run->at_input[1]) / run->set.path_rad;
  float reported = (run->at_output[0] - run->at_output[1]) / run->set.path_rad;
  run->found = motor;
  if (run->set.output_loop && size(motor) > PATH_LEAST) {
    end(run, COMMISSIONING_CORRECTION_ADDED);
  } else if (!run->set.output_loop && size(motor) < PATH_LEAST) {
    end(run, COMMISSIONING_CORRECTION_MISSING);
  } else if (!run->set.output_loop && motor < 0) {
    end(run, COMMISSIONING_CORRECTION_SIGN);
  } else if (motor > PATH_MOST) {
    end(run, COMMISSIONING_CORRECTION_SCALE);
  } else if (size(reported) > PATH_LEAST) {
    run->found = reported;
    end(run, COMMISSIONING_REPORTED);
  } else {
    begin(run, SWEEP);
  }
}

static void path(commissioning *run, const commissioning_input *now, commissioning_output *out) {
  float time_s = (float)run->tick * run->set.parameters->limits.period_s;
  int32_t from = ticks_of(run, MOVE_S + SETTLE_S);
  int32_t n = ticks_of(run, MEASURE_S);
  float from_rad = run->part ? run->set.path_rad : 0;
  correct(out, from_rad, run->set.path_rad - from_rad, time_s, MOVE_S);
  if (run->tick >= from) {
    run->sum[0] += motor_rad(run, now) / (float)n;
    run->sum[1] += (now->reported_rad - run->start_rad) / (float)n;
  }
  run->tick += 1;
  if (run->tick >= from + n) {
    run->at_input[run->part] = run->sum[0];
    run->at_output[run->part] = run->sum[1];
    next_part(run);
    if (run->part == 2) {
      judge_path(run);
    }
  }
}

/* Gain of the correction at a swing of the target: three stages of 1, 4 and 16 times the response
 * (compensator.h). */
static float followed_share(float rate_per_s, float response_per_s) {
  float share = 1;
  int i;
  for (i = 0; i < 3; ++i) {
    float ratio = rate_per_s / response_per_s;
    share /= square_root(1 + ratio * ratio);
    response_per_s *= 4;
  }
  return share;
}

static void sweep(commissioning *run, const commissioning_input *now, commissioning_output *out) {
  const lm_parameters *p = run->set.parameters;
  float frequency_Hz =
      p->watch.ringing_Hz > 0 ? p->watch.ringing_Hz : p->limits.response_per_s / (4 * PI);
  float rad;
  tone t;
  way at;
  int32_t i;
  frequency_Hz *= SWEEP_FIRST;
  for (i = 0; i < run->part; ++i) {
    frequency_Hz *= SWEEP_STEP;
  }
  t = make_tone(run, frequency_Hz, SWEEP_RAMP_CYCLES, SWEEP_CYCLES);
  rad = least(SWEEP_RAD, SWEEP_RAD_S2 / (t.rate_per_s * t.rate_per_s));
  at = sound(&t, p->limits.period_s, run->tick);
  out->correction.correction_rad = rad * at.place;
  out->correction.velocity_rad_s = rad * at.speed;
  out->correction.acceleration_rad_s2 = rad * at.change;
  if (is_whole(&t, run->tick)) {
    listen(run, 0, &t, now->conditions.torque_Nm - run->torque_start_Nm);
  }
  run->tick += 1;
  if (run->tick > t.length) {
    run->found = amplitude(run, 0) / rad * lm_find_greatest_slope(&p->curve) *
                 followed_share(t.rate_per_s, p->limits.response_per_s);
    if (run->found > LOOP_GAIN) {
      end(run, COMMISSIONING_TORQUE_LOOP);
      return;
    }
    next_part(run);
    if (run->part == SWEEP_TONES && run->set.output_loop) {
      end(run, COMMISSIONING_NO_FAULT);
    } else if (run->part == SWEEP_TONES) {
      begin(run, RUSH);
    } else {
      /* the next tone */
    }
  }
}

/* A fifth of the largest correction as fast as the limits allow; a drive that follows has covered
 * most of it soon after. */
static void rush(commissioning *run, const commissioning_input *now, commissioning_output *out) {
  const lm_limits *limits = &run->set.parameters->limits;
  const lm_headroom *room = &run->set.headroom;
  float rad = limits->correction_rad / 5;
  float time_s = (float)run->tick * limits->period_s;
  float by_speed_s = 1.875f * rad / least(limits->velocity_rad_s, room->velocity_rad_s);
  float by_change_s =
      square_root(5.7735f * rad / least(limits->acceleration_rad_s2, room->acceleration_rad_s2));
  float in_s = by_speed_s > by_change_s ? by_speed_s : by_change_s;
  int32_t seen = ticks_of(run, in_s + RUSH_AFTER_S);
  in_s += 4 / limits->response_per_s; /* the correction is no faster than its response */
  if (run->tick == 0) {
    run->back_rad = motor_rad(run, now);
  }
  correct(out, run->part ? rad : 0, run->part ? 0 : rad, time_s, in_s);
  if (run->part == 0 && run->tick == seen) {
    run->found = (motor_rad(run, now) - run->back_rad) / rad;
    if (run->found < RUSH_SHARE) {
      run->sum[0] = 1;
    }
  }
  run->tick += 1;
  if (run->tick > seen + ticks_of(run, SETTLE_S)) {
    if (run->part == 0) {
      float lagging = run->sum[0];
      next_part(run);
      run->sum[0] = lagging;
    } else {
      end(run, run->sum[0] > 0 ? COMMISSIONING_DRIVE_LIMIT : COMMISSIONING_NO_FAULT);
    }
  }
}

/* --- every tick --- */

static void take_start(commissioning *run, const commissioning_input *now) {
  run->started = 1;
  run->start_rad = now->reported_rad;
  run->input_start_rad = now->input_angle_rad;
  run->has_output = known(now->output_angle_rad);
  run->output_start_rad = now->output_angle_rad;
  run->torque_start_Nm = now->conditions.torque_Nm;
  run->motor_start_Nm = now->motor_torque_Nm;
  run->has_sensed = known(now->sensed_Nm) && known(now->commanded_Nm);
  run->by_current = run->has_sensed && known(now->motor_rad_s);
  run->sensed_start_Nm = now->sensed_Nm;
  run->commanded_start_Nm = now->commanded_Nm;
  if (run->stage != OVER) {
    (void)lm_start_compensator(&run->shadow, run->set.parameters, now->conditions.torque_Nm, 0);
    lm_set_headroom(&run->shadow, &run->set.headroom);
    run->stood_rad = lm_settle_compensator(&run->shadow, &now->conditions).correction_rad;
  }
}

/* Faults that end a run in any stage. */
static void guard(commissioning *run, const commissioning_input *now) {
  const int feeds = run->fed && run->stage == SHAKE; /* the first shake kept the bounds */
  if (!known(now->input_angle_rad) || !known(now->reported_rad) ||
      !known(now->conditions.torque_Nm) || !known(now->elapsed_s) ||
      ((run->has_output || run->set.output_loop) && !known(now->output_angle_rad)) ||
      (run->has_sensed && !(known(now->sensed_Nm) && known(now->commanded_Nm))) ||
      (run->by_current && !known(now->motor_rad_s))) {
    give_up(run, COMMISSIONING_INPUT);
  } else if (size(now->reported_rad - run->start_rad - run->command_rad) >
             run->set.follow_bound_rad) {
    int stuck = size(motor_rad(run, now)) < (1 - STUCK_SHARE) * size(run->command_rad);
    give_up(run, feeds   ? COMMISSIONING_FEED_SCALE
                 : stuck ? COMMISSIONING_STUCK
                         : COMMISSIONING_FOLLOW);
  } else if (run->stage != STAND &&
             size(now->conditions.torque_Nm - run->torque_start_Nm) > run->set.torque_bound_Nm) {
    run->found = now->conditions.torque_Nm - run->torque_start_Nm;
    give_up(run, feeds ? COMMISSIONING_FEED_SCALE : COMMISSIONING_TORQUE_BOUND);
  } else if (known(now->motor_torque_Nm) &&
             size(now->motor_torque_Nm - run->motor_start_Nm) > run->set.torque_bound_Nm) {
    run->found = now->motor_torque_Nm - run->motor_start_Nm;
    give_up(run, feeds ? COMMISSIONING_FEED_SCALE : COMMISSIONING_TORQUE_BOUND);
  }
}

commissioning_output commissioning_step(commissioning *run, const commissioning_input *now) {
  commissioning_output out = {0, 0, 0, {0, 0, 0, 0, 0}, 0, COMMISSIONING_RUNNING, 0};
  if (!run->started) {
    take_start(run, now);
  }
  if (run->stage != OVER) {
    guard(run, now);
  }
  if (run->stage != OVER) {
    lm_correction shadow = lm_step_compensator(&run->shadow, &now->conditions);
    switch (run->stage) {
      case STAND:
        stand(run, now, &shadow);
        break;
      case TRAVEL:
        travel(run, now, &shadow, &out);
        break;
      case PACE:
        pace(run, now, &out);
        break;
      case SHAKE:
        shake(run, now, &shadow, &out);
        break;
      case PATH:
        path(run, now, &out);
        break;
      case SWEEP:
        sweep(run, now, &out);
        break;
      default:
        rush(run, now, &out);
        break;
    }
  } else {
    if (run->back_rad != 0) {
      float period_s = run->set.parameters->limits.period_s;
      correct(&out, run->back_rad, 0, (float)run->tick * period_s, BACK_S);
      run->tick += run->tick < ticks_of(run, BACK_S);
    }
    /* Braked: the command follows, so that nothing jumps when the loop closes again. */
    out.command_rad = run->stop ? now->reported_rad - run->start_rad : 0;
  }
  run->command_rad = out.command_rad;
  run->correction_rad = out.correction.correction_rad;
  out.command_rad += run->start_rad;
  out.stop = run->stop;
  out.finding = run->finding;
  return out;
}

const char *commissioning_sentence(commissioning_finding finding) {
  static const char *const sentence[COMMISSIONING_FINDINGS] = {
      "The test is running.",
      "No fault was found in what was checked: commissioning_unchecked states the rest.",
      "A setting is outside its range: see commissioning.h.",
      "lm_check_parameters rejects the parameters: export them again.",
      "An angle, the torque or the time is not finite: check the sensors.",
      "A condition that the model needs is missing: fill in lm_conditions.",
      "At rest the torque or a condition is outside the fitted range: check the scale and unit of "
      "the torque and the temperature sensor, or export for a larger range.",
      "The tick is irregular or differs from the period of the parameters: export with "
      "--set period_us=.",
      "The noise of the torque would move the axis at standstill: filter the torque, or export "
      "with --set torque_noise_Nm=.",
      "The reported angle deviated from the command by more than the bound: check the gains and "
      "sign of the loop, and for a collision.",
      "The torque changed by more than the bound: check for a collision and the scale of the "
      "torque.",
      "The motor did not follow the command: check brake, enable signal and encoder.",
      "The motor encoder counts against the command: check the sign of the ratio in these settings "
      "and that of the encoder.",
      "Motor angle / ratio does not reach the commanded travel: the position loop and these "
      "settings have different ratios.",
      "The reading of the output encoder does not change: check the encoder.",
      "The output turns against the command: check the signs of the ratio and of the output "
      "encoder.",
      "The output angle is not motor angle / ratio: check the ratio and the scales of the "
      "encoders.",
      "The motor deviates from its command by the lost motion: the position loop uses the output "
      "encoder, or the drive already compensates.",
      "The output deviates from the command by the lost motion: the position loop uses the motor "
      "encoder; set output_loop to 0.",
      "The torque input does not follow the load: the sensor is stuck or the source is wrong.",
      "The torque has the wrong sign: a positive torque turns the output in its positive "
      "direction.",
      "The torque is delayed: its filter is too slow, or the encoders are not latched together.",
      "The lost motion differs from the model, or the measured torque from that of the command: "
      "check the scale of the torque, inertia and gravity of the command, and whether the "
      "parameters belong to this joint.",
      "The correction at the largest fitted torque exceeds its limit or the headroom.",
      "The headroom of velocity or acceleration is too small: the correction lags.",
      "The correction does not reach the motor: it is not added to the command.",
      "The correction is added with the wrong sign.",
      "The motor moves by more than the correction: it is added twice or in another unit.",
      "The correction moves the output: add only its rates to a position loop on the output "
      "encoder.",
      "The reported angle moves with the correction: subtract the correction from it if the "
      "position loop uses the motor encoder, and do not if it uses the output encoder.",
      "The correction would oscillate through the torque input: filter the torque at a tenth of "
      "the resonance, or compute it from the command.",
      "The drive does not follow the correction at its limits: raise the limits of the drive, or "
      "export lower ones.",
      "The host stopped the run.",
      "The torque that is fed forward pushes the motor the wrong way: check the sign of the torque "
      "input of the loop or drive.",
      "The torque that is fed forward moves the motor too far: check unit, ratio, scale and "
      "sign of this input of the loop or drive (torque of the motor or of the output).",
      "The velocity for the torque from the current is not that of the motor: check its sign and "
      "unit (rad/s of the motor shaft).",
      "The torque from the current differs between the directions of motion by more than the "
      "stated friction: check the sign of the current and of its constant, and friction and "
      "efficiency.",
      "The velocity that is fed forward makes the motor follow worse: check its sign and unit "
      "(rad/s of the motor).",
      "The motor moved when the loop was switched off: the brake does not hold the load, had not "
      "closed yet (closing time), or is not commanded by `release`.",
  };
  return (unsigned)finding < COMMISSIONING_FINDINGS ? sentence[finding] : "unknown";
}

const char *commissioning_unchecked(uint32_t *bits) {
  static const char *const sentence[COMMISSIONING_UNCHECKED_BITS] = {
      "Not checked, no encoder at the output: the ratio, and which encoder the position loop uses.",
      "Not checked: sign and scale of the torque. Measure it, or the motor current, with the axis "
      "homed and loaded by more than friction; with an encoder at the output shake more or faster. "
      "A torque that is only computed: compare it with the current of the drive.",
      "Not checked: which encoder the position loop uses. More travel or load would show it.",
      "Not checked: an error of 1 in the ratio.",
      "Not checked: sign and size of the velocity that is fed forward: the motor follows as well "
      "without it.",
      "Not checked: sign and scale of the torque that is fed forward. It hardly moved the motor: "
      "shake more or faster, state the inertia.",
  };
  int i;
  for (i = 0; i < COMMISSIONING_UNCHECKED_BITS; ++i) {
    if (*bits & (1u << i)) {
      *bits &= ~(1u << i);
      return sentence[i];
    }
  }
  return 0;
}
