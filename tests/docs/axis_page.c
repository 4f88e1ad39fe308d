/* Runs the code of the page "Integration" on a simulated joint with a brake: what the page declares
 * as the reader's, and a usual sequence. KIND: 0 own loop, 1 own brake, 2 CiA 402. The exit code is
 * the number of the check that fails. */
#include "host.h"
#include "params.h"
#if KIND == 2
#include "cia402.h"
#endif

#define PERIOD_S (1e-9f * PERIOD_NS)
#define WEIGHT_NM (-12.0f)
#define STIFFNESS 2e4f /* of the position loop, N m/rad at the output */
#define INTEGRAL_S 0.15f
#define TRUE_ZERO_RAD 0.4f
#define LAG 0.2f       /* of the position loop, a tick */
#define FALL_RAD 3e-5f /* a tick, without brake and loop */
#define OPENS_S 0.06f  /* brake */
#define CLOSES_S 0.12f
#define REPORTS_TICKS (KIND == 0 ? 200 : 4) /* after an order */
#define STILL_RAD \
  (KIND == 0 ? 2e-4f : 1.5e-5f)               /* 3 arcsec; what friction hides of a load of 4 N m */
#define JUMP_RAD 5e-5f                        /* from tick to tick, beyond the plan */
#define MODEL_RAD (KIND == 0 ? 3e-4f : 1e-4f) /* friction hides a part of the load from a current */
#define ACCELERATES_NM 1.6f
#define RAMP_RAD 1e-4f /* a tick, of a drive that stops by itself */
#define RATE_RAD_S 0.6f
#define RATE_OFF_RAD 1e-5f /* a tick: its acceleration */

extern void tick(void);
extern int power_down(void);
extern float home(float latched_rad, float angle_rad);
extern int payload(float kg);
extern int torque_differs(void);
extern commissioning_finding commission(void);

int run, homed, same_load = 1;
static int ever_ordered; /* the loop of kind A has been enabled */
lm_axis_kept stored;
static plan planned;
static float planned_rad_s;
static float target_rad, setpoint_rad, feed_Nm;
static float motor_over_ratio_rad = 0.2f, twist_rad, load_Nm = WEIGHT_NM, last_motor_rad;
static float released_s, braked_s = 1, on_s, jump_rad;
static float integral_Nm, followed_rad; /* of the drive: it follows without lag */
static int on, tripped, ordered, release_ordered;
static lm_memory gear;

static unsigned drawn = 1;
static int lost, quits, halted, frozen;
static float fed_times = 1;   /* wrong sign or scale of the torque feed-forward */
static float follows = 1;     /* -1: the position loop has the wrong sign */
float payload_kg = 1;         /* times WEIGHT_NM */
static float sensed_sign = 1; /* of the sensor, the current */
static float rate_off_rad;    /* the velocity feed-forward is not that of the setpoint, a tick */

static unsigned draw(unsigned below) {
  drawn = drawn * 1664525u + 1013904223u;
  return (drawn >> 8) % below;
}

static float size(float value) {
  return value < 0 ? -value : value;
}

/* Reading of the motor's encoder. */
static float reading_rad(void) {
  static float last_rad;
  last_rad = frozen ? last_rad : motor_over_ratio_rad;
  return last_rad;
}

static float cosine(float x) { /* of a small angle */
  return 1 - x * x / 2 + x * x * x * x / 24;
}

float gravity_Nm(float angle_rad) {
  return payload_kg * WEIGHT_NM * cosine(angle_rad);
}

float elapsed_s(void) {
  return PERIOD_S;
}

void store(void) {
}

/* A trapezoidal planner. */
plan planner_tick(void) {
  const float go_rad = target_rad - planned.position;
  const float step_rad_s = 2 * PERIOD_S;
  const float stop_rad = planned_rad_s * planned_rad_s / 4 + size(planned_rad_s) * PERIOD_S;
  float wanted = go_rad > 0 ? RATE_RAD_S : -RATE_RAD_S;
  if (halted) {
    halted = 0;
    return planned;
  }
  if (size(go_rad) <= stop_rad) {
    wanted = 0;
  }
  if (size(go_rad) < 1e-6f) {
    planned_rad_s = 0;
    planned.acceleration = 0;
    return planned;
  }
  wanted = wanted == 0 ? (go_rad > 0 ? 0.002f : -0.002f) : wanted;
  planned.acceleration = wanted > planned_rad_s ? 2 : -2;
  if (size(wanted - planned_rad_s) < step_rad_s) {
    planned.acceleration = 0;
    planned_rad_s = wanted;
  }
  planned_rad_s += planned.acceleration * PERIOD_S;
  planned.position +=
      size(planned_rad_s) * PERIOD_S > size(go_rad) ? go_rad : planned_rad_s * PERIOD_S;
  return planned;
}

void planner_restart(float command_rad) {
  planned.position = command_rad;
  planned_rad_s = 0;
  planned.acceleration = 0;
  target_rad = command_rad;
}

void planner_halt(void) {
  const float step_rad_s = 2 * PERIOD_S;
  planned_rad_s = planned_rad_s > step_rad_s    ? planned_rad_s - step_rad_s
                  : planned_rad_s < -step_rad_s ? planned_rad_s + step_rad_s
                                                : 0;
  planned.position += planned_rad_s * PERIOD_S;
  target_rad = planned.position;
  halted = 1;
}

void planner_shift(float by_rad) {
  planned.position += by_rad;
  target_rad += by_rad;
}

#if KIND == 0
int loop_on, loop_fault;
static float velocity_rad_s;
static float turning_sign = 1;          /* of its measurement */
static float rate_rad_s, rate_sign = 1; /* fed forward */

float motor_rad(void) {
  return lost ? LM_UNKNOWN : reading_rad() * RATIO;
}

float motor_rad_s(void) {
  return turning_sign * velocity_rad_s * RATIO;
}

/* Inverse of the estimate. */
float motor_A(void) {
  static const lm_motor motor = {0.11f, RATIO, 0.75f, 6e-5f, 0.04f, 1e-4f, 1.0f};
  const float motor_rad_s2 = a->guides ? RATIO * test.out.acceleration_rad_s2 : 0;
  const int bears = on && braked_s == 0;
  float low = -20;
  float high = 20;
  int k;
  for (k = 0; k < 30; ++k) {
    const float middle = (low + high) / 2;
    const float torque_Nm =
        lm_estimate_torque(&motor, middle, velocity_rad_s * RATIO, motor_rad_s2);
    if ((torque_Nm < (bears ? load_Nm : 0)) == (RATIO < 0)) {
      low = middle;
    } else {
      high = middle;
    }
  }
  return sensed_sign * low;
}

void enable_loop(int order) {
  ordered = order;
  ever_ordered = ever_ordered || order;
}

void release_brake(int order) {
  release_ordered = order;
}

void position_loop(float at_rad, float feed_rad_s, float torque_Nm) {
  const float step_rad = at_rad / RATIO - setpoint_rad;
  const float off_rad = size(step_rad - feed_rad_s / RATIO * PERIOD_S);
  rate_off_rad =
      on && a->state == LM_AXIS_CLOSED && off_rad > rate_off_rad ? off_rad : rate_off_rad;
  setpoint_rad = at_rad / RATIO;
  rate_rad_s = rate_sign * feed_rad_s / RATIO;
  feed_Nm = fed_times * torque_Nm * RATIO;
}

static void report(void) {
  loop_on = on;
  loop_fault = tripped && !quits;
  velocity_rad_s = (motor_over_ratio_rad - last_motor_rad) / PERIOD_S;
}

static lm_status power_on(void) {
  extern lm_status power_up(float, lm_fault *);
  return power_up(motor_rad(), 0);
}
#elif KIND == 1
struct inputs {
  int fresh, operates, position_mode, tripped;
  float motor_rad;
};
struct inputs in;

float sensor_Nm(void) {
  return sensed_sign * load_Nm;
}

void send(int enable, float at_rad, float torque_Nm) {
  ordered = enable;
  release_ordered = on;
  setpoint_rad = at_rad / RATIO;
  feed_Nm = fed_times * torque_Nm * RATIO;
}

static void report(void) {
  in.fresh = !lost;
  in.operates = on;
  in.position_mode = 1;
  in.tripped = tripped && !quits;
  in.motor_rad = reading_rad() * RATIO;
}

static lm_status power_on(void) {
  extern lm_status power_up(float, lm_fault *);
  report();
  return power_up(in.motor_rad, 0);
}
#else
#define RAD (131072.0f * RATIO / 6.28318531f)
cia402_input in;
cia402_output out;
static uint16_t status = CIA402_SWITCH_ON_DISABLED;

static void report(void) {
  ordered = out.controlword == CIA402_ENABLE;
  release_ordered = on;
  setpoint_rad = (float)(out.target_position + out.position_offset) / RAD;
  feed_Nm = fed_times * (float)out.torque_offset / 1000 * 0.64f * RATIO;
  status = tripped && !quits                    ? CIA402_FAULT
           : on                                 ? CIA402_OPERATION_ENABLED | CIA402_FOLLOWS
           : out.controlword == CIA402_SHUTDOWN ? CIA402_READY
           : out.controlword >= CIA402_SWITCH_ON && out.controlword < 16
               ? CIA402_SWITCHED_ON
               : CIA402_SWITCH_ON_DISABLED;
  in.statusword = status;
  in.position_actual = (int32_t)(reading_rad() * RAD);
  in.valid = !lost;
  in.mode = CIA402_CSP;
}

static lm_status power_on(void) {
  extern lm_status power_up(lm_fault *);
  out.controlword = 0;
  report();
  return power_up(0);
}
#endif

/* The drive, its brake and the arm. */
static void move(void) {
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  const float before_rad = motor_over_ratio_rad;
  on_s = ordered && !tripped ? on_s + PERIOD_S : 0;
  if (ordered || KIND == 0) {
    on = on_s > REPORTS_TICKS * PERIOD_S || (on && on_s > 0);
  } else {
    on = on && braked_s < CLOSES_S;
  }
  on = on && !tripped;
  integral_Nm = on && braked_s < CLOSES_S ? integral_Nm : 0;
  released_s = release_ordered && (KIND == 0 || (on && ordered)) ? released_s + PERIOD_S : 0;
  braked_s = released_s > OPENS_S ? 0 : braked_s + PERIOD_S;
  if (braked_s < CLOSES_S && on && d->own_stop && !ordered && KIND == 1) {
    motor_over_ratio_rad += RAMP_RAD; /* by itself */
  } else if (braked_s < CLOSES_S && on) {
    const float yields_rad = (load_Nm + feed_Nm + integral_Nm) / STIFFNESS;
    integral_Nm += (setpoint_rad - motor_over_ratio_rad) * STIFFNESS * PERIOD_S / INTEGRAL_S;
#if KIND == 0
    motor_over_ratio_rad += rate_rad_s * PERIOD_S;
#else
    motor_over_ratio_rad += setpoint_rad - followed_rad;
#endif
    motor_over_ratio_rad +=
        (ordered ? follows : 1) * LAG * (setpoint_rad + yields_rad - motor_over_ratio_rad);
  } else if (braked_s < CLOSES_S) {
    motor_over_ratio_rad -= FALL_RAD;
  }
  last_motor_rad = before_rad;
  followed_rad = on ? setpoint_rad : motor_over_ratio_rad;
  load_Nm = payload_kg * WEIGHT_NM * cosine(motor_over_ratio_rad + TRUE_ZERO_RAD);
  load_Nm -= a->guides ? INERTIA * test.out.acceleration_rad_s2 : 0;
  at.torque_Nm = load_Nm;
  twist_rad = lm_step_model(&joint_parameters, &gear, &at);
}

static float output(void) {
  return motor_over_ratio_rad + twist_rad;
}

static void ticks(int n) {
  for (; n > 0; --n) {
    const float before_rad = output();
    const float fed_Nm = feed_Nm;
    const int was_on = on;
    float step_rad;
    report();
    tick();
    move();
    step_rad = size(output() - before_rad) - size(planned_rad_s) * PERIOD_S;
    step_rad = was_on && on && size(feed_Nm - fed_Nm) > 3 * ACCELERATES_NM ? 1 : step_rad;
    jump_rad = step_rad > jump_rad ? step_rad : jump_rad;
  }
}

static int seconds(float s) {
  jump_rad = 0;
  ticks((int)(s / PERIOD_S));
  return jump_rad > JUMP_RAD;
}

/* How far the output is after some seconds, or 1 if it has jumped. */
static float moved(float s) {
  const float before_rad = output();
  return seconds(s) ? 1 : size(output() - before_rad);
}

/* The axis that holds without a known gravity yields to its load. */
static int start(void) {
  float before_rad;
  load_Nm = WEIGHT_NM * cosine(motor_over_ratio_rad + TRUE_ZERO_RAD);
  lm_start_model(&gear, load_Nm);
  lm_settle_model(&joint_parameters, &gear);
  move();
  if (KIND == 0) {
    const float closing_s = d->closing_s;
    d->closing_s = 0;
    if (power_on() != LM_INCONSISTENT) {
      return 24;
    }
    d->closing_s = closing_s;
  }
  stored.zero_rad = TRUE_ZERO_RAD;
  if (home(0, 0) >= 0 || homed || size(stored.zero_rad - TRUE_ZERO_RAD) > 0) {
    return 35; /* off: the stored zero stays */
  }
  stored.zero_rad = 0;
  power_on();
  run = 1;
  if (moved(2) > STILL_RAD || on) {
    return 1; /* by a command of before the power-up */
  }
  run = 0;
  ticks(2);
  run = 1;
  if (moved(2) > STILL_RAD || on || ever_ordered || d->wait != LM_AXIS_WAITS_COMMISSION) {
    return 31; /* not commissioned */
  }
  a->commissioned = 1; /* as on a bench */
  run = 0;
  ticks(2);
  run = 1;
  before_rad = output();
  (void)seconds(6);
  return size(output() - before_rad) > 1.1f * size(WEIGHT_NM) / STIFFNESS ||
                 a->state != LM_AXIS_CLOSED
             ? 2
             : 0;
}

static int travel(void) {
  const float before_rad = output();
  target_rad = planned.position + 0.3f;
  if (seconds(2) || size(output() - before_rad - 0.3f) > 8e-4f) {
    return 3;
  }
  /* Homed in motion, gravity begins. */
  target_rad = planned.position - 0.2f;
  if (seconds(0.2f) || home(motor_over_ratio_rad * RATIO, output() + TRUE_ZERO_RAD) < 0 ||
      seconds(3)) {
    return 4;
  }
  (void)lm_axis_pause(a);
  if (seconds(12) || a->state != LM_AXIS_CLOSED) {
    return 5;
  }
  /* With gravity the zero is right. */
  if (home(motor_over_ratio_rad * RATIO, output() + TRUE_ZERO_RAD) < 0) {
    return 5;
  }
  ticks(2);
  target_rad = planned.position - 0.1f;
  if (seconds(2) || size(output() + TRUE_ZERO_RAD - target_rad) > MODEL_RAD) {
    return 6;
  }
  return 0;
}

/* Declared, a payload is in the torque of the model at once, without a motion for it. */
static int carry(void) {
  float wanted_Nm;
  target_rad = planned.position + 0.1f;
  ticks(100);
  if (payload(1.5f) || payload_kg != 1) {
    return 30; /* in motion */
  }
  (void)seconds(2);
  if (torque_differs() || !payload(1.5f)) {
    return 30;
  }
  wanted_Nm = gravity_Nm(a->command_rad);
  (void)seconds(3);
  if (a->state != LM_AXIS_CLOSED || (KIND == 2 && size(a->torque_Nm - wanted_Nm) > 0.1f)) {
    return 30;
  }
  sensed_sign = -1;
  (void)seconds(1);
  if (KIND != 0 && torque_differs() != (KIND == 1)) {
    return 30; /* at rest friction may hide it from a current */
  }
  sensed_sign = 1;
  (void)payload(1);
  (void)seconds(6);
  return torque_differs() ? 30 : 0;
}

static int stop(void) {
  target_rad = planned.position + 3;
  (void)seconds(0.2f);
  if (KIND == 2) { /* its quick stop is at once here */
    target_rad = planned.position + 0.1f;
    if (seconds(1)) {
      return 7;
    }
  }
  run = 0;
  if (seconds(2) || on || d->enable || a->state != LM_AXIS_OPEN) {
    return 7;
  }
  run = 1;
  if (moved(3) > STILL_RAD || a->state != LM_AXIS_CLOSED) {
    return 8;
  }
  target_rad = planned.position + 0.1f; /* first it goes there */
  ticks(100);
  d->standstill = 1;
  ticks(1);
  if (a->state != LM_AXIS_CLOSED || seconds(1) || a->state != LM_AXIS_PAUSED) {
    return 19;
  }
  d->standstill = 0;
  if (moved(3) > STILL_RAD || a->state != LM_AXIS_CLOSED) {
    return 19;
  }
  if (commission() != COMMISSIONING_ABORTED || (!test.on && !test.out.finding)) {
    return 10; /* closed */
  }
  /* An encoder without which the loop of the host cannot hold: for a moment, and for longer. */
  lost = 1;
  ticks(3);
  lost = 0;
  ticks(10);
  if (a->state != LM_AXIS_CLOSED) {
    return 25;
  }
  lost = 1;
  ticks(10);
  lost = 0;
  if (d->enable == (KIND == 0) || d->release == (KIND == 0) || a->state == LM_AXIS_CLOSED) {
    return 25;
  }
  run = KIND != 0;
  (void)seconds(2);
  run = 1;
  (void)seconds(3);
  /* Safe torque off in motion: the brake stops it; it is not enabled by itself. */
  target_rad = planned.position + 0.2f;
  (void)seconds(0.3f);
  tripped = 1;
  ticks(20);
  tripped = 0;
  (void)seconds(0.3f);
  if (moved(3) > STILL_RAD || on || d->wait != LM_AXIS_WAITS_COMMAND) {
    return 9;
  }
  return 0;
}

static int commission_it(void) {
#if KIND == 0
  const float closing_s = d->closing_s;
#endif
  float before_rad;
  int k;
  int sentences = 0;
  uint32_t bits;
  run = 0;
  payload_kg = KIND == 0 ? 1.5f : 1; /* more than friction hides from a current */
  ticks(2);
  if (commission() != COMMISSIONING_RUNNING || seconds(6) || test.on ||
      test.out.finding != COMMISSIONING_ABORTED) {
    return 10; /* expired */
  }
  (void)commission();
  run = 1;
  (void)seconds(8);
  run = 0; /* in motion */
  (void)seconds(2);
  if (test.out.finding != COMMISSIONING_ABORTED) {
    return 36;
  }
  if (commission() != COMMISSIONING_RUNNING) {
    return 10;
  }
  run = 1;
  (void)seconds(2);
  if (size(feed_Nm) > 0) {
    return 26; /* of unknown sign */
  }
  (void)seconds(58);
  if (test.out.finding != COMMISSIONING_NO_FAULT || on || test.on || a->state != LM_AXIS_OPEN ||
      ((test.run.unchecked & COMMISSIONING_UNCHECKED_TORQUE) != 0) != (KIND == 2) ||
      (test.run.unchecked & COMMISSIONING_UNCHECKED_FEED)) {
    return 20 + (int)test.out.finding;
  }
  run = 0;
  ticks(2);
  bits = test.run.unchecked;
  while (commissioning_unchecked(&bits)) {
    ++sentences;
  }
  /* No encoder at the output; its drive derives the velocity; the torque. */
  if (sentences != KIND + 1 || bits) {
    return 29;
  }
  if (KIND != 2) { /* a measured torque with the wrong sign, without an encoder at the output */
    sensed_sign = -1;
    (void)commission();
    run = 1;
    (void)seconds(30);
    sensed_sign = 1;
    if (test.out.finding != COMMISSIONING_TORQUE_SIGN) {
      return 27;
    }
    run = 0;
  }
#if KIND == 0
  ticks(2);
  turning_sign = -1;
  (void)commission();
  run = 1;
  (void)seconds(30);
  turning_sign = 1;
  if (test.out.finding != COMMISSIONING_VELOCITY) {
    return 32;
  }
  run = 0;
  (void)seconds(2);
  rate_sign = -1;
  (void)commission();
  run = 1;
  (void)seconds(30);
  rate_sign = 1;
  if (test.out.finding != COMMISSIONING_PACE) {
    return 33;
  }
  run = 0;
  (void)seconds(2);
  d->closing_s = 0.01f; /* the loop ends before the brake has closed */
  (void)commission();
  run = 1;
  (void)seconds(60);
  d->closing_s = closing_s;
  if (test.out.finding != COMMISSIONING_BRAKE || a->commissioned) {
    return 34;
  }
  run = 0;
#endif
  if (a->commissioned != (KIND == 2)) {
    return 31; /* by the last one */
  }
  payload_kg = 1;
  (void)seconds(2);
  for (k = 0; k < 3; ++k) { /* 6: within the bound of the error of the loop */
    static const float times[] = {-1, 100, 6};
    fed_times = times[k];
    (void)commission();
    run = 1;
    before_rad = motor_over_ratio_rad;
    (void)seconds(30);
    run = 0;
    fed_times = 1;
    (void)seconds(2);
    if (test.out.finding != (k ? COMMISSIONING_FEED_SCALE : COMMISSIONING_FEED_SIGN) ||
        size(motor_over_ratio_rad - before_rad) > 4 * LM_AXIS_APART_RAD) {
      return 58 + k;
    }
  }
  return 0;
}

/* A position loop that drives the motor away from a setpoint that stands, in a commissioning and
 * later; an encoder whose reading stays in motion: the drive is disabled, the brake closes. */
static int part(int kind) {
  float before_rad;
  run = 0;
  (void)seconds(2);
  if (kind == 0) {
    (void)commission();
  }
  run = 1;
  if (kind > 0) {
    a->commissioned = 1;
    (void)seconds(4);
  }
  before_rad = motor_over_ratio_rad;
  if (kind < 2) {
    follows = -1;
  } else {
    target_rad = planned.position + 0.3f;
    ticks(400); /* it moves */
    frozen = 1;
    before_rad = motor_over_ratio_rad;
  }
  motor_over_ratio_rad += kind < 2 ? 1e-6f : 0;
  (void)seconds(4);
  follows = 1;
  frozen = 0;
  if (d->enable || on ||
      size(motor_over_ratio_rad - before_rad) > (kind < 2 ? 0.2f : 4 * LM_AXIS_APART_RAD) ||
      (kind > 0 ? d->wait != LM_AXIS_WAITS_PARTED : test.out.finding != COMMISSIONING_FOLLOW)) {
    return 70 + kind;
  }
  run = 0;
  (void)seconds(2);
  return 0;
}

static int restart(int knows_zero) {
  int k;
  run = 0;
  homed = knows_zero;
  ticks(2);
  for (k = 0; k < 8000 && !power_down(); ++k) {
    ticks(1);
  }
  if (k == 8000 || a->state != LM_AXIS_OFF || stored.history.format == 0) {
    return 11;
  }
  run = 1;
  power_on();
  (void)seconds(2);
  if (stored.history.format != 0 || on) {
    return 12;
  }
  run = 0;
  ticks(2);
  run = 1;
  if (moved(4) > STILL_RAD || a->state != LM_AXIS_CLOSED) {
    return 13;
  }
  return size(a->command_rad - output() - TRUE_ZERO_RAD) > MODEL_RAD ? 14 : 0;
}

/* Whatever the host, the drive and the planner do in any order: the setpoint of a drive that moves
 * the arm changes by the plan and the correction alone, the drive begins at the motor's angle, the
 * arm is held while nothing has tripped. */
static void disturb(void) {
  switch (draw(13)) {
    case 0:
      run = 0;
      break;
    case 1:
      tripped = 1;
      quits = (int)draw(2);
      break;
    case 2:
      lost = 1;
      break;
    case 3:
      (void)home(motor_over_ratio_rad * RATIO, output() + TRUE_ZERO_RAD + (float)draw(100) * 1e-3f);
      break;
    case 4:
      (void)lm_axis_pause(a);
      break;
    case 5:
      (void)lm_axis_set_mode(a, draw(2) ? LM_MODE_RUN : LM_MODE_RESET);
      break;
    case 6:
      homed = !homed;
      break;
    case 7:
      (void)commission();
      break;
    case 8:
      a->commissioned = 1;
      break;
    default:
      target_rad = (float)draw(1000) * 1e-3f - 0.5f;
      run = 1;
  }
}

/* A drive that stops with its own ramp, and a command that returns meanwhile: no way back. */
static int stop_itself(void) {
  int k;
  d->own_stop = 1;
  target_rad = planned.position + 0.3f;
  (void)seconds(0.3f);
  run = 0;
  ticks(60);
  run = 1;
  for (k = 0; k < 8000; ++k) {
    const float before_rad = motor_over_ratio_rad;
    ticks(1);
    if (on && ordered && size(motor_over_ratio_rad - before_rad) > JUMP_RAD) {
      return 21;
    }
  }
  d->own_stop = 0;
  return a->state != LM_AXIS_CLOSED ? 22 : 0;
}

static int wander(void) {
  float before_rad = setpoint_rad;
  float held_s = 0;
  float fed_Nm = feed_Nm;
  int moved_before = 0;
  int was_on = on;
  int reported = on;
  int k;
  for (k = 0; k < 400000; ++k) {
    int moves;
    int left;
    if (draw(3000) == 0) {
      disturb();
    }
    run = run || draw(2000) == 0;
    tripped = tripped && draw(100) > 0;
    lost = lost && draw(100) > 0;
    left = !lost && reported && !on; /* by a stop, a fault, or without one */
    reported = lost ? reported : on;
    report();
    tick();
#if KIND == 2
    setpoint_rad = (float)(out.target_position + out.position_offset) / RAD;
    feed_Nm = (float)out.torque_offset / 1000 * 0.64f * RATIO;
#endif
    if (left && a->state >= LM_AXIS_PAUSED) {
      return 18;
    }
    moves = on && ordered && !tripped && braked_s < CLOSES_S;
    if (moves && moved_before &&
        size(setpoint_rad - before_rad) >
            PERIOD_S * (size(planned_rad_s) + joint_parameters.limits.velocity_rad_s +
                        0.4f * (float)test.on)) {
      return 15;
    }
    if (moves && moved_before && size(feed_Nm - fed_Nm) > 3 * ACCELERATES_NM) {
      return 23; /* gravity alone steps by more */
    }
    fed_Nm = feed_Nm;
    moved_before = moves;
    before_rad = setpoint_rad;
    held_s = tripped || lost ? 0 : held_s + PERIOD_S;
    move();
    if (on && !was_on && size(setpoint_rad - motor_over_ratio_rad) > JUMP_RAD) {
      return 16;
    }
    was_on = on;
    if (!on && braked_s < CLOSES_S && held_s > 2 * CLOSES_S) {
      return 17;
    }
  }
  return 0;
}

/* With an argument: a wrong sign in the code of kind A; its loop is never enabled. */
int main(int count, char **word) {
  int failed = start();
  (void)word;
  if (count > 1) {
    return !run || !failed || ever_ordered;
  }
  failed = failed ? failed : travel();
  failed = failed ? failed : carry();
  failed = failed ? failed : stop();
  failed = failed ? failed : commission_it();
  failed = failed ? failed : part(0);
  failed = failed ? failed : part(1);
  failed = failed ? failed : part(2);
  failed = failed ? failed : restart(1);
  failed = failed ? failed : restart(0); /* with the gravity of the power-down */
  failed = failed || KIND != 1 ? failed : stop_itself();
  failed = failed ? failed : rate_off_rad > RATE_OFF_RAD ? 28 : 0;
  return failed ? failed : wander();
}
