#include "story.h"

#include <string.h>

#include "../joint/params.h" /* lostmotion export joint.toml -o params.h */
#include "lm_axis.h"

#define LOAD_NM (-12.0f) /* weight of the arm */
#define PUSH_NM (-5.0f)  /* external push while the brake is on */
#define SWING_NM 10.0f   /* of the arm against the brake, at 20 Hz */
#define SLIP_RAD 1e-6f   /* of the brake, a tick */
#define FAST_RAD 0.0005f /* a tick */
#define STILL_RAD 2e-6f  /* 0.4 arcsec */
#define ARRIVED_RAD 2e-5f
#define NEAR_RAD 9e-5f /* below LM_FOLLOW_NEAR_RAD */
#define TURN_RAD 6.28318531f

#define PERIOD_S 5e-4f  /* of the parameters */
#define STAND_TICKS 501 /* LM_AXIS_STAND is 448 */
#define BEAR_TICKS 1120 /* the same at RESPONSE_PER_S */
#define CREEP_TICKS 2000
#define CREEP_NM 0.06f /* in that time: of 60 N m in LM_AXIS_CREEP_S */
#define FEED_TICKS 200
#define WATCH_TICKS 1000
#define STEP_NM 0.31f /* in a tick: 60 N m times LM_AXIS_FAST_RAD_S */

/* A motor current: what it adds to the torque of the command, what friction at rest can hide of
 * that, its filter at a tenth of the resonance, and the response for this resonance. */
#define PAYLOAD_NM 20.0f
#define HIDDEN_NM 19.2f
#define OUTLIER_A 100.0f /* 1 A is 1 N m at the output */
#define JUMP_NM 0.05f    /* a tick */
#define RESONANCE_HZ 20.0f
#define RESPONSE_PER_S (2.5f * RESONANCE_HZ)

/* The motor follows at once while the loop is closed; the gear winds up. */
typedef struct joint {
  lm_axis drive;
  lm_memory gear;
  float motor_rad, twist_rad, wish_rad;
  int apart; /* the drive does not follow */
} joint;

static float output(const joint *j) {
  return j->motor_rad + j->twist_rad;
}

static float size(float value) {
  return value < 0 ? -value : value;
}

static float not_a_number(void) {
  volatile float none = 0;
  return none / none;
}

static lm_conditions conditions(float torque_Nm) {
  lm_conditions at = LM_CONDITIONS_UNKNOWN; /* the parameters of this joint need the torque only */
  at.torque_Nm = torque_Nm;
  return at;
}

static void run(joint *j, int ticks, float torque_Nm, float rate_rad) {
  const float from_rad = j->wish_rad;
  const lm_conditions at = conditions(torque_Nm);
  int k;
  for (k = 1; k <= ticks; ++k) {
    j->wish_rad = from_rad + rate_rad * (float)k;
    j->motor_rad = lm_axis_tick(&j->drive, &at, j->motor_rad, j->wish_rad,
                                !j->apart && j->drive.state >= LM_AXIS_PAUSED);
    j->twist_rad = lm_step_model(&joint_parameters, &j->gear, &at);
    if (j->drive.state != LM_AXIS_CLOSED) {
      j->wish_rad = j->drive.command_rad;
    }
  }
}

/* Runs until the planner moves the axis; how far the output moves until then and in the ticks after
 * it, or 1 if it does not come to that. */
static float join(joint *j) {
  float before_rad = output(j);
  int ticks = 0;
  while (j->drive.state != LM_AXIS_CLOSED) {
    run(j, 1, LOAD_NM, 0);
    if (++ticks > 3 * STAND_TICKS) {
      return 1;
    }
  }
  run(j, 200, LOAD_NM, 0);
  return size(output(j) - before_rad);
}

/* Closes the loop once the load stands. */
static float close_loop(joint *j) {
  int ticks = 0;
  while (lm_axis_close(&j->drive)) {
    run(j, 1, LOAD_NM, 0);
    if (++ticks > 2 * STAND_TICKS) {
      return 1;
    }
  }
  return join(j);
}

/* The axis is paused, the change was made: how far the output moves until the planner has it again,
 * or 1 if that is before the correction stands. */
static float resume(joint *j) {
  float before_rad = output(j);
  run(j, 400, LOAD_NM, 0);
  if (j->drive.state != LM_AXIS_PAUSED || j->drive.correction.velocity_rad_s != 0) {
    return 1;
  }
  (void)join(j);
  return size(output(j) - before_rad);
}

/* From the torque of the command to a current with an unknown payload, the axis paused: friction
 * hides the payload until the filter has nearly settled. How far the motor moves after it. */
static float take_current(joint *j) {
  static lm_parameters slower; /* in use until the next change has been made */
  static const lm_motor motor = {1, 1, 1, 0, HIDDEN_NM, 0, 1}; /* HIDDEN_NM at the output */
  float before_rad = 0;
  float before_Nm = LOAD_NM;
  int closed_ticks = 0;
  int ticks = 0;
  slower = joint_parameters;
  slower.limits.response_per_s = RESPONSE_PER_S;
  if (lm_axis_change(&j->drive, &slower, 0) != LM_OK) {
    return 1;
  }
  for (ticks = 0; ticks < BEAR_TICKS + 4 * STAND_TICKS && closed_ticks < 4 * STAND_TICKS; ++ticks) {
    const int begins = ticks > BEAR_TICKS - 10 && ticks < BEAR_TICKS + 10;
    const float current_A = PAYLOAD_NM - LOAD_NM + (begins ? OUTLIER_A : 0);
    const float torque_Nm = lm_axis_use_current(&j->drive, &motor, LOAD_NM, current_A, 0, 0, 1);
    if ((ticks < BEAR_TICKS - 10 && j->drive.source != LM_AXIS_COMMAND) ||
        (ticks > BEAR_TICKS + 10 && j->drive.source != LM_AXIS_CURRENT) ||
        size(torque_Nm - before_Nm) > JUMP_NM) {
      return 1;
    }
    before_Nm = torque_Nm;
    run(j, 1, torque_Nm, 0);
    if (closed_ticks == 0) {
      before_rad = j->motor_rad;
    }
    closed_ticks += j->drive.state == LM_AXIS_CLOSED;
  }
  if (closed_ticks == 0 || size(before_Nm - LOAD_NM + PAYLOAD_NM - HIDDEN_NM) > JUMP_NM) {
    return 1;
  }
  before_rad = size(j->motor_rad - before_rad);
  /* The brake closes and opens again: the current is not used until the axis is paused. */
  for (ticks = 0; ticks < 2 * BEAR_TICKS; ++ticks) {
    const float torque_Nm =
        lm_axis_use_current(&j->drive, &motor, LOAD_NM, 0, 0, 0, ticks >= BEAR_TICKS / 2);
    if (size(torque_Nm - before_Nm) > 1e-5f || j->drive.source != LM_AXIS_COMMAND) {
      return 1;
    }
  }
  if (!j->drive.source_waits || lm_axis_change(&j->drive, &joint_parameters, 0) != LM_OK) {
    return 1;
  }
  j->drive.source_waits = 0;
  return resume(j) < 1 ? before_rad : 1;
}

/* A torque by a sensor or by the current of a motor without friction. */
static float measure(joint *j, int by_current, float sensed_Nm) {
  static const lm_motor smooth = {1, 1, 1, 0, 0, 0, 1};
  return by_current ? lm_axis_use_current(&j->drive, &smooth, LOAD_NM, -sensed_Nm, 0, 0, 1)
                    : lm_axis_use_sensor(&j->drive, LOAD_NM, sensed_Nm);
}

/* A measurement that is lost and returns moves nothing: after LM_AXIS_STAND its value of before
 * stays, until the axis is paused. */
static int lose_measurement(joint *j, int by_current) {
  const float none = not_a_number();
  float before_rad = 0;
  float torque_Nm = 0;
  int k;
  if (lm_axis_pause(&j->drive)) {
    return 1;
  }
  for (k = 0; by_current && k < BEAR_TICKS; ++k) {
    run(j, 1, measure(j, 1, LOAD_NM + 2.0f), 0);
  }
  for (k = 0; k < 4 * STAND_TICKS; ++k) {
    const int lost = k >= 2 * STAND_TICKS && k < 3 * STAND_TICKS;
    const float sensed_Nm = lost ? none : LOAD_NM + (k < 3 * STAND_TICKS ? 2.0f : -3.0f);
    torque_Nm = measure(j, by_current, sensed_Nm);
    run(j, 1, torque_Nm, 0);
    if (k == 3 * STAND_TICKS - 1 && !j->drive.source_waits) {
      return 1; /* no alarm */
    }
    if (k == 2 * STAND_TICKS) {
      before_rad = j->motor_rad;
      if (j->drive.state != LM_AXIS_CLOSED || j->drive.source_waits ||
          size(torque_Nm - LOAD_NM - 2.0f) > 0.01f) {
        return 1;
      }
    }
  }
  if (!j->drive.source_waits || size(j->motor_rad - before_rad) > STILL_RAD) {
    return 1;
  }
  /* Paused, it is used again, and the loop does not close while it is lost. */
  if (lm_axis_pause(&j->drive)) {
    return 1;
  }
  for (k = 0; k < STAND_TICKS; ++k) {
    const float sensed_Nm = k % 3 == 1 ? none : k % 3 == 2 ? LM_UNKNOWN : LOAD_NM;
    run(j, 1, measure(j, by_current, sensed_Nm), 0);
  }
  if (j->drive.state != LM_AXIS_PAUSED || j->drive.waits == LM_AXIS_READY) {
    return 1;
  }
  for (k = 0; k < 2 * STAND_TICKS; ++k) {
    run(j, 1, measure(j, by_current, LOAD_NM), 0);
  }
  return j->drive.state != LM_AXIS_CLOSED || size(j->drive.torque_Nm - LOAD_NM) > 0.01f;
}

/* At rest the current of a motor whose friction is greater than stated wanders: nothing moves, as
 * long as the motor does not. A motor that has moved bears another load. */
static int wander(joint *j) {
  const lm_conditions at = conditions(LOAD_NM);
  float before_rad;
  float torque_Nm = 0;
  int k;
  run(j, 400, LOAD_NM, FAST_RAD);
  run(j, 100, LOAD_NM, 0);
  before_rad = j->motor_rad;
  for (k = 0; k < 8 * STAND_TICKS; ++k) {
    const float off_Nm = (k / STAND_TICKS) % 2 ? 7.0f : -7.0f;
    torque_Nm = measure(j, 1, LOAD_NM + off_Nm);
    run(j, 1, torque_Nm, 0);
    if (k > STAND_TICKS && size(j->motor_rad - before_rad) > STILL_RAD) {
      return 1;
    }
    before_rad = j->motor_rad;
  }
  for (k = 0; k < 3 * STAND_TICKS; ++k) {
    const float yields_rad = k < 10 ? 2 * LM_AXIS_STILL_RAD : 0;
    torque_Nm = measure(j, 1, LOAD_NM - 2.0f);
    j->motor_rad = lm_axis_tick(&j->drive, &at, j->motor_rad - yields_rad, j->wish_rad, 1);
  }
  if (j->drive.state != LM_AXIS_CLOSED || size(torque_Nm - LOAD_NM + 2.0f) > 0.01f ||
      lm_axis_pause(&j->drive)) {
    return 1;
  }
  for (k = 0; k < 3 * STAND_TICKS; ++k) {
    run(j, 1, measure(j, 1, LOAD_NM), 0);
  }
  return 0;
}

/* The planner goes further than an angle may: the axis is paused where it can be started. Missed
 * ticks in motion pause it, too. */
static int go_far(joint *j) {
  static lm_axis started = {.ratio = 1};
  lm_conditions at = conditions(LOAD_NM);
  const float turns_rad = 30 - j->motor_rad;
  int k;
  lm_axis_turn(&j->drive, turns_rad);
  j->motor_rad += turns_rad;
  j->wish_rad = j->drive.command_rad;
  for (k = 0; k < 8000 && j->drive.waits != LM_AXIS_WAITS_ANGLE; ++k) {
    run(j, 1, LOAD_NM, FAST_RAD);
  }
  if (j->drive.state != LM_AXIS_PAUSED || j->motor_rad < 30.5f ||
      lm_axis_power_up(&started, &joint_parameters, 0, &at, j->motor_rad, 0) != LM_OK ||
      join(j) > STILL_RAD) {
    return 1;
  }
  run(j, 400, LOAD_NM, -FAST_RAD); /* and comes back */
  if (j->drive.state != LM_AXIS_CLOSED) {
    return 1;
  }
  run(j, 400, LOAD_NM, 0);
  lm_axis_turn(&j->drive, -turns_rad);
  j->motor_rad -= turns_rad;
  j->wish_rad = j->drive.command_rad;
  for (k = 0; k < 2; ++k) { /* up to 1 / response_per_s: not seen */
    run(j, 20, LOAD_NM, FAST_RAD);
    j->wish_rad += FAST_RAD;
    at.elapsed_s = (k ? 1.1f : 0.9f) / joint_parameters.limits.response_per_s;
    j->motor_rad = lm_axis_tick(&j->drive, &at, j->motor_rad, j->wish_rad, 1);
    if ((j->drive.state == LM_AXIS_PAUSED) != k) {
      return 1;
    }
  }
  j->wish_rad = j->drive.command_rad;
  return join(j) > STILL_RAD;
}

/* The torque becomes known while the drive bears the load: what is fed forward creeps to it. */
static int feed_steps(joint *j, float torque_Nm) {
  const float before_Nm = lm_axis_feed(&j->drive);
  float fed_Nm = before_Nm;
  int k;
  for (k = 0; k <= FEED_TICKS; ++k) {
    j->drive.lost_ticks = k == 0; /* lost bus: later it would be a step */
    (void)lm_axis_use_command(&j->drive, torque_Nm);
    if ((k == 0 && size(lm_axis_feed(&j->drive) - before_Nm) > 0) ||
        size(lm_axis_feed(&j->drive) - fed_Nm) > 1.1f * CREEP_NM / CREEP_TICKS) {
      return 1;
    }
    fed_Nm = lm_axis_feed(&j->drive);
  }
  return size(fed_Nm - before_Nm) < 0.9f * CREEP_NM * FEED_TICKS / CREEP_TICKS;
}

/* Gravity that is not known yet, or no more, is the last one; known, it may step. */
static int weigh(joint *j) {
  const float before_Nm = lm_axis_use_command(&j->drive, lm_axis_gravity(&j->drive, LOAD_NM, 1));
  return size(lm_axis_gravity(&j->drive, -LOAD_NM, 0) - LOAD_NM) > 0 ||
         size(lm_axis_use_command(&j->drive, lm_axis_gravity(&j->drive, -LOAD_NM, 1)) - before_Nm) >
             JUMP_NM ||
         size(lm_axis_use_command(&j->drive, lm_axis_gravity(&j->drive, LOAD_NM, 1)) - before_Nm) >
             JUMP_NM;
}

/* Gravity jumps with the zero: the torque does not, until the axis is paused. */
static int shift_gravity(joint *j) {
  float before_Nm;
  float after_Nm = 0;
  int k;
  j->drive.beyond_Nm = 0; /* nothing was measured */
  before_Nm = lm_axis_use_command(&j->drive, lm_axis_gravity(&j->drive, LOAD_NM, 1));
  run(j, 1, before_Nm, 0);
  if (lm_axis_reference(&j->drive, j->motor_rad, j->drive.command_rad + 0.3f) >= 0) {
    return 1; /* the zero was known: a wrong unit */
  }
  j->drive.homed = 0;
  (void)lm_axis_reference(&j->drive, j->motor_rad, j->drive.command_rad + 0.3f);
  for (k = 0; k < 4; ++k) { /* the planner, and gravity that is computed from it, follow later */
    const float gravity_Nm = k < 3 ? LOAD_NM : LOAD_NM - 4.0f;
    after_Nm = lm_axis_use_command(&j->drive, lm_axis_gravity(&j->drive, gravity_Nm, 1));
    if (size(after_Nm - before_Nm) > JUMP_NM / 10) {
      return 1;
    }
    j->wish_rad += k == 3 ? 0.3f : 0;
    run(j, 1, after_Nm, 0);
  }
  run(j, 50, after_Nm, 0);
  for (k = 0; k < CREEP_TICKS; ++k) {
    after_Nm = lm_axis_use_command(&j->drive, LOAD_NM - 4.0f);
  }
  if (size(after_Nm - before_Nm + CREEP_NM) > 0.1f * CREEP_NM || lm_axis_pause(&j->drive)) {
    return 1;
  }
  if (feed_steps(j, LOAD_NM - 4.0f) || size(j->drive.torque_Nm - LOAD_NM + 4.0f) > 0) {
    return 1;
  }
  (void)lm_axis_use_command(&j->drive, lm_axis_gravity(&j->drive, LOAD_NM, 1));
  j->drive.homed = 0;
  return join(j) > STILL_RAD;
}

/* A planner that never shifts with the zero: once it rests it begins at the command, and nothing
 * has moved. */
static int forget_shift(joint *j) {
  const lm_conditions at = conditions(LOAD_NM);
  const float before_rad = j->motor_rad;
  const float stays_rad = j->wish_rad;
  int paused = 0;
  int k;
  (void)lm_axis_reference(&j->drive, j->motor_rad, j->drive.command_rad + 0.3f);
  for (k = 0; k < 3 * STAND_TICKS && !paused; ++k) {
    (void)lm_axis_tick(&j->drive, &at, j->motor_rad, stays_rad, 1);
    paused = j->drive.state == LM_AXIS_PAUSED;
  }
  j->wish_rad = j->drive.command_rad;
  if (!paused || join(j) > STILL_RAD) {
    return 1;
  }
  return size(j->motor_rad - before_rad) > STILL_RAD ||
         size(j->wish_rad - stays_rad - 0.3f) > ARRIVED_RAD;
}

/* Whether the watch fades the correction out within 20 load cycles; the axis stays as it is. */
static int fades(const joint *j, float twist_sign) {
  static joint c;
  int k;
  c = *j;
  for (k = 0; k < 20 * 4 * WATCH_TICKS; ++k) {
    const float load_Nm = (float)(k % (2 * WATCH_TICKS)) * 60 / WATCH_TICKS;
    const float torque_Nm = LOAD_NM + (load_Nm < 60 ? load_Nm : 120 - load_Nm);
    run(&c, 1, torque_Nm, 0);
    if (k % 3 == 0) { /* not in every tick */
      lm_axis_watch(&c.drive, c.motor_rad + twist_sign * c.twist_rad + 0.3f);
    }
  }
  return (c.drive.correction.status & LM_STATE_FADED) != 0;
}

/* The planner at rest within NEAR_RAD of the command, by beside_rad when the axis is closed. */
static int follow_softly(joint *j, float beside_rad) {
  const lm_conditions at = conditions(LOAD_NM);
  int k;
  for (k = 0; k < 3 * STAND_TICKS; ++k) {
    const float before_rad = j->motor_rad;
    if (j->drive.state != LM_AXIS_CLOSED) {
      j->wish_rad = j->drive.command_rad + beside_rad;
    }
    j->motor_rad = lm_axis_tick(&j->drive, &at, j->motor_rad, j->wish_rad, 1);
    if (size(j->motor_rad - before_rad) > STILL_RAD) {
      return 1;
    }
  }
  return j->drive.state != LM_AXIS_CLOSED || size(j->drive.command_rad - j->wish_rad) > 0 ||
         size(lm_axis_reported(&j->drive, j->motor_rad) - j->wish_rad) > STILL_RAD;
}

/* The planner does not begin at the command, moves when a change is requested, or shifts three
 * ticks after the zero: no jump. */
static int confuse_planner(joint *j) {
  const lm_conditions at = conditions(LOAD_NM);
  float before_rad = j->motor_rad;
  float wish_rad;
  int k;
  if (lm_axis_pause(&j->drive)) {
    return 1;
  }
  for (k = 0; k < STAND_TICKS; ++k) {
    j->motor_rad = lm_axis_tick(&j->drive, &at, j->motor_rad, 0, 1);
  }
  if (size(j->motor_rad - before_rad) > 0 || j->drive.waits != LM_AXIS_WAITS_PLANNER) {
    return 1;
  }
  (void)join(j);
  run(j, 10, LOAD_NM, FAST_RAD);
  before_rad = j->motor_rad;
  wish_rad = j->wish_rad;
  if (!lm_axis_pause(&j->drive) || !lm_axis_set_mode(&j->drive, LM_MODE_RESET) ||
      !lm_axis_headroom(&j->drive, 0) ||
      lm_axis_change(&j->drive, &joint_parameters, 0) != LM_INCONSISTENT) {
    return 1;
  }
  (void)lm_axis_reference(&j->drive, j->motor_rad, j->drive.command_rad + 0.7f);
  for (k = 1; k <= 10; ++k) {
    wish_rad += FAST_RAD + (k == 4 ? 0.7f : 0);
    j->motor_rad = lm_axis_tick(&j->drive, &at, j->motor_rad, wish_rad, 1);
    if (size(j->motor_rad - before_rad - FAST_RAD * (float)k) > ARRIVED_RAD ||
        size(j->drive.moved_rad - FAST_RAD) > STILL_RAD) {
      return 1;
    }
  }
  j->wish_rad = wish_rad;
  run(j, 10, LOAD_NM, 0);
  (void)lm_axis_reference(&j->drive, j->motor_rad, j->drive.command_rad - 0.7f);
  j->wish_rad = j->drive.command_rad;
  run(j, 400, LOAD_NM, -FAST_RAD * 20 / 400);
  if (size(j->drive.follow.late_rad) > 0) {
    return 1;
  }
  /* A small shift that the planner makes or does not make, a planner that begins beside the
   * command: no step, and in the end the axis is where the planner is. A turn of the origin is
   * none. */
  for (k = 0; k < 4; ++k) {
    const float beside_rad = k % 2 ? NEAR_RAD : -NEAR_RAD;
    if (k < 2) {
      (void)lm_axis_reference(&j->drive, j->motor_rad, j->drive.command_rad + beside_rad);
      j->wish_rad += k == 0 ? beside_rad : 0;
    } else if (lm_axis_pause(&j->drive)) {
      return 1;
    }
    if (follow_softly(j, k < 2 ? 0 : beside_rad)) {
      return 1;
    }
  }
  for (k = 0; k < 2; ++k) {
    const float turn_rad = k % 2 == 0 ? TURN_RAD : -TURN_RAD;
    before_rad = j->motor_rad + turn_rad;
    if (k == 1 && lm_axis_pause(&j->drive)) {
      return 1;
    }
    lm_axis_turn(&j->drive, turn_rad);
    j->motor_rad += turn_rad;
    j->wish_rad = j->drive.command_rad;
    run(j, 10, LOAD_NM, 0);
    if ((k == 0 && lm_axis_pause(&j->drive)) || join(j) > STILL_RAD ||
        size(j->motor_rad - before_rad) > STILL_RAD) {
      return 1;
    }
  }
  return 0;
}

/* A planner whose interpolator makes a ramp of the shift: the axis stops, and is not displaced. */
static int ramp_shift(joint *j) {
  const float shift_rad = 0.05f;
  float before_rad;
  int k;
  run(j, 20, LOAD_NM, 0.3f * FAST_RAD);
  before_rad = j->motor_rad;
  (void)lm_axis_reference(&j->drive, j->motor_rad, j->drive.command_rad + shift_rad);
  for (k = 0; k < 8; ++k) {
    run(j, 1, LOAD_NM, 0.3f * FAST_RAD + (k < 4 ? shift_rad / 4 : 0));
  }
  return size(j->motor_rad - before_rad) > FAST_RAD || j->drive.state != LM_AXIS_PAUSED ||
         join(j) > STILL_RAD || size(j->drive.follow.late_rad) > 0;
}

/* A payload that a sensor has measured enters the torque of the command: not counted twice. Put
 * down behind the brake, it is not counted at all. */
static int change_payload(joint *j) {
  const float payload_Nm = -6.0f;
  float before_rad;
  int k;
  if (lm_axis_pause(&j->drive)) {
    return 1;
  }
  for (k = 0; k < 4 * STAND_TICKS; ++k) {
    run(j, 1, lm_axis_use_sensor(&j->drive, LOAD_NM, LOAD_NM + payload_Nm), 0);
  }
  before_rad = j->motor_rad;
  (void)lm_axis_gravity(&j->drive, LOAD_NM + payload_Nm, 1);
  for (k = 0; k < STAND_TICKS; ++k) {
    run(j, 1, lm_axis_use_sensor(&j->drive, LOAD_NM + payload_Nm, LOAD_NM + payload_Nm), 0);
    if (size(j->drive.torque_Nm - LOAD_NM - payload_Nm) > JUMP_NM) {
      return 1;
    }
  }
  if (j->drive.state != LM_AXIS_CLOSED || size(j->motor_rad - before_rad) > STILL_RAD) {
    return 1;
  }
  if (lm_axis_pause(&j->drive)) {
    return 1;
  }
  for (k = 0; k < STAND_TICKS; ++k) { /* a second one */
    (void)lm_axis_use_sensor(&j->drive, LOAD_NM + payload_Nm, LOAD_NM + 2 * payload_Nm);
  }
  (void)lm_axis_use_command(&j->drive, LOAD_NM + payload_Nm); /* the sensor is lost */
  /* computed, after it was measured */
  (void)lm_axis_gravity(&j->drive, LOAD_NM + 2 * payload_Nm, 1);
  (void)lm_axis_use_command(&j->drive, LOAD_NM + 2 * payload_Nm);
  if (size(j->drive.torque_Nm - LOAD_NM - 2 * payload_Nm) > JUMP_NM) {
    return 1;
  }
  for (k = 0; k < STAND_TICKS; ++k) { /* a third one is measured, and not computed */
    (void)lm_axis_use_sensor(&j->drive, LOAD_NM + 2 * payload_Nm, LOAD_NM + 3 * payload_Nm);
  }
  (void)lm_axis_use_command(&j->drive, LOAD_NM + 2 * payload_Nm);
  /* The command has all of it: what was measured counts no more. */
  (void)lm_axis_gravity(&j->drive, LOAD_NM + 2.5f * payload_Nm, 1);
  (void)lm_axis_use_command(&j->drive, LOAD_NM + 2.5f * payload_Nm);
  if (size(j->drive.torque_Nm - LOAD_NM - 2.5f * payload_Nm) > 0) {
    return 1;
  }
  (void)lm_axis_gravity(&j->drive, LOAD_NM, 1); /* put down again, and measured by nothing */
  (void)lm_axis_use_command(&j->drive, LOAD_NM);
  before_rad = lm_axis_feed(&j->drive);
  lm_axis_open(&j->drive);
  run(j, 1, lm_axis_use_command(&j->drive, LOAD_NM), 0);
  if (size(j->drive.torque_Nm - LOAD_NM) > 1e-5f ||
      size(lm_axis_feed(&j->drive) - before_rad) > CREEP_NM) {
    return 1; /* the drive may still stop with it */
  }
  return close_loop(j) > STILL_RAD ||
         size(lm_axis_feed(&j->drive) + LOAD_NM) > 1e-5f; /* what it bears when the brake opens */
}

/* Opened while the drive still follows, under a load that it yields to: it does not let it fall. A
 * planner that moves past the command does not begin there. */
static int open_early(joint *j) {
  const lm_conditions at = conditions(LOAD_NM);
  const float before_rad = j->motor_rad;
  int k;
  lm_axis_open(&j->drive);
  for (k = 0; k < STAND_TICKS; ++k) {
    j->motor_rad = lm_axis_tick(&j->drive, &at, j->motor_rad, 0, 1) - ARRIVED_RAD;
  }
  j->motor_rad += ARRIVED_RAD;
  /* A drive that is said to follow, and has moved the axis in another mode. */
  for (k = 0; k < 2 * STAND_TICKS; ++k) {
    (void)lm_axis_tick(&j->drive, &at, j->motor_rad + (k < STAND_TICKS ? 0.4f : 0), 0, 1);
    if (k == STAND_TICKS - 1 && lm_axis_close(&j->drive) != LM_AXIS_WAITS_MOTOR) {
      return 1;
    }
  }
  if (size(j->motor_rad - before_rad) > STILL_RAD || close_loop(j) > STILL_RAD ||
      lm_axis_pause(&j->drive)) {
    return 1;
  }
  run(j, 2 * STAND_TICKS, LM_UNKNOWN, 0);
  j->apart = 1;
  run(j, 2 * STAND_TICKS, LOAD_NM, 0);
  j->apart = 0;
  for (k = -20; k < 20; ++k) {
    const float passing_rad = j->drive.command_rad + 0.5f * NEAR_RAD * (float)k;
    j->motor_rad = lm_axis_tick(&j->drive, &at, j->motor_rad, passing_rad, 1);
  }
  return j->drive.state != LM_AXIS_PAUSED || join(j) > STILL_RAD;
}

/* The wish steps, or is missing for some ticks and continues, while the axis moves: no jump,
 * whatever the planner does; after it the planner begins at the command. */
static int lose_wish(joint *j, int ticks, float step_rad) {
  const lm_conditions at = conditions(LOAD_NM);
  const float none = not_a_number();
  float before_rad;
  float last_rad;
  int k;
  run(j, 20, LOAD_NM, FAST_RAD);
  last_rad = j->motor_rad;
  for (k = 0; k < 40; ++k) {
    before_rad = j->motor_rad;
    j->wish_rad += FAST_RAD + (k == ticks ? step_rad : 0);
    j->motor_rad = lm_axis_tick(&j->drive, &at, j->motor_rad, k < ticks ? none : j->wish_rad, 1);
    if (size(j->motor_rad - before_rad) > FAST_RAD + ARRIVED_RAD) {
      return 1;
    }
  }
  last_rad = size(j->motor_rad - last_rad);
  if (ticks <= LM_FOLLOW_LOST_TICKS && step_rad == 0) { /* not seen */
    return j->drive.state != LM_AXIS_CLOSED || size(last_rad - 40 * FAST_RAD) > ARRIVED_RAD;
  }
  run(j, 1, LOAD_NM, 0);
  return j->drive.state != LM_AXIS_PAUSED || join(j) > STILL_RAD;
}

/* The motor is elsewhere after its angle was lost: the planner does not begin. */
static int come_back_elsewhere(joint *j) {
  const float away_rad = 0.2f;
  const lm_conditions at = conditions(LOAD_NM);
  int k;
  run(j, 50, LOAD_NM, 0);
  for (k = 0; k < 2 * STAND_TICKS; ++k) {
    (void)lm_axis_tick(&j->drive, &at, k < 10 ? not_a_number() : j->motor_rad + away_rad,
                       j->drive.command_rad, 1);
  }
  if (j->drive.state != LM_AXIS_PAUSED || j->drive.waits != LM_AXIS_WAITS_MOTOR) {
    return 1;
  }
  return join(j) > STILL_RAD;
}

/* A thermometer that is lost, and returns with another temperature. */
static int lose_thermometer(joint *j) {
  lm_conditions at = conditions(LOAD_NM);
  float before_C = 0;
  int k;
  at.temperature_C = 20;
  if (lm_axis_pause(&j->drive)) {
    return 1;
  }
  (void)lm_axis_tick(&j->drive, &at, j->motor_rad, j->wish_rad, 1);
  if (size(j->drive.follow.temperature_C - 20) > 0 || join(j) > STILL_RAD) {
    return 1;
  }
  for (k = 0; k < 4000; ++k) {
    before_C = j->drive.follow.temperature_C;
    at.temperature_C = k < 1000 ? not_a_number() : k < 2000 ? LM_UNKNOWN : 45;
    (void)lm_axis_tick(&j->drive, &at, j->motor_rad, j->wish_rad, 1);
    if (!(size(j->drive.follow.temperature_C - before_C) <=
          1.01f * LM_FOLLOW_WARMING_K_S * PERIOD_S)) {
      return 1;
    }
  }
  return j->drive.state != LM_AXIS_CLOSED || size(before_C - 20.1f) > 0.01f;
}

/* A condition that is lost and returns with another value: the axis is still. */
static int lose_condition(joint *j) {
  lm_conditions at = conditions(LOAD_NM);
  int k;
  if (lm_axis_pause(&j->drive)) {
    return 1;
  }
  at.tilt_moment_Nm = 3;
  (void)lm_axis_tick(&j->drive, &at, j->motor_rad, j->wish_rad, 1);
  j->drive.last.tilt_moment_Nm = 3;
  j->drive.state = LM_AXIS_CLOSED;
  for (k = 0; k < 40; ++k) {
    at.tilt_moment_Nm = k < 20 ? LM_UNKNOWN : 5;
    (void)lm_axis_tick(&j->drive, &at, j->motor_rad, j->wish_rad, 1);
    if (size(j->drive.last.tilt_moment_Nm - 3) > 0 || !j->drive.condition_waits) {
      return 1;
    }
  }
  if (lm_axis_pause(&j->drive)) {
    return 1;
  }
  (void)lm_axis_tick(&j->drive, &at, j->motor_rad, j->wish_rad, 1);
  if (size(j->drive.last.tilt_moment_Nm - 5) > 0 || j->drive.condition_waits) {
    return 1;
  }
  return join(j) > STILL_RAD;
}

/* An incremental encoder with another origin after each power-up: the index of the motor gives the
 * zero, whatever the correction is. */
static int find_index(joint *j) {
  const float origin_rad = 0.7f;
  const float latched_rad = 0.4f;
  const float index_rad = latched_rad + j->drive.zero_rad;
  lm_axis axis = j->drive;
  int k;
  for (k = 1; k <= 2; ++k) { /* starts */
    (void)lm_axis_index(&axis, latched_rad - origin_rad * (float)k, index_rad);
    if (size(axis.zero_rad - j->drive.zero_rad - origin_rad * (float)k) > STILL_RAD) {
      return 1;
    }
  }
  return 0;
}

/* While the drive does not follow, nothing moves, also under a push, and the planner does not
 * begin. */
static int wait_for_drive(joint *j) {
  const float before_rad = j->motor_rad;
  j->apart = 1;
  run(j, STAND_TICKS, LOAD_NM, 0);
  if (j->drive.state != LM_AXIS_PAUSED || j->drive.waits != LM_AXIS_WAITS_DRIVE) {
    return 1;
  }
  run(j, STAND_TICKS, LOAD_NM + PUSH_NM, 0);
  run(j, 1, LOAD_NM, 0);
  if (size(j->motor_rad - before_rad) > 0 || j->drive.state != LM_AXIS_PAUSED) {
    return 1;
  }
  j->apart = 0;
  return join(j) > STILL_RAD;
}

/* What is not finite does not reach the drive: torque, velocity, angles. */
static int pass_on_finite(joint *j) {
  const float none = not_a_number();
  const float torque_Nm = lm_axis_use_command(&j->drive, LOAD_NM);
  const float feed_Nm = j->drive.torque_Nm;
  const float setpoint_rad = j->drive.setpoint_rad;
  (void)lm_axis_use_command(&j->drive, none);
  (void)lm_axis_use_sensor(&j->drive, none, LOAD_NM);
  if (!(size(j->drive.torque_Nm - torque_Nm) <= 0 && size(j->drive.torque_Nm - feed_Nm) <= 0)) {
    return 1;
  }
  run(j, 1, lm_axis_use_command(&j->drive, LOAD_NM), 0);
  run(j, 20, LOAD_NM, FAST_RAD);
  if (!(size(lm_axis_rate(&j->drive) - FAST_RAD / PERIOD_S) < 0.01f)) {
    return 1;
  }
  run(j, 20, LOAD_NM, -FAST_RAD);
  run(j, 200, LOAD_NM, 0);
  if (lm_axis_pause(&j->drive)) {
    return 1;
  }
  lm_axis_turn(&j->drive, none);
  run(j, 1, LOAD_NM, 0);
  if (!(size(j->drive.setpoint_rad - setpoint_rad) < ARRIVED_RAD) ||
      size(lm_axis_rate(&j->drive)) > 0) {
    return 1;
  }
  return join(j) > STILL_RAD;
}

/* A finite torque may be a wrong one, of the command in one tick, of a sensor for longer: what is
 * fed forward hardly changes, and a sensor does not change it at all. */
static int exaggerate(joint *j) {
  const float wrong_Nm = 1e30f;
  float fed_Nm = 0;
  int k;
  if (lm_axis_pause(&j->drive)) {
    return 1;
  }
  for (k = 0; k < 3 * STAND_TICKS; ++k) {
    run(j, 1, lm_axis_use_sensor(&j->drive, LOAD_NM, LOAD_NM), 0);
    fed_Nm = lm_axis_feed(&j->drive);
  }
  for (k = 0; k < 200; ++k) {
    const float commanded_Nm = k == 150 ? wrong_Nm : LOAD_NM;
    const float sensed_Nm = k < 100 ? -wrong_Nm : LOAD_NM;
    const float torque_Nm = lm_axis_use_sensor(&j->drive, commanded_Nm, sensed_Nm);
    const float most_Nm = k == 150 ? STEP_NM : CREEP_NM;
    run(j, 1, torque_Nm, 0);
    if (j->drive.state != LM_AXIS_CLOSED ||
        !(size(torque_Nm) <= joint_parameters.torque_limit_Nm) ||
        !(size(lm_axis_feed(&j->drive) - fed_Nm) <= most_Nm) ||
        ((j->drive.correction.status & LM_STATE_TORQUE_CLIPPED) != 0) != (k < 100 || k == 150)) {
      return 1;
    }
  }
  if (lm_axis_pause(&j->drive)) {
    return 1;
  }
  (void)lm_axis_use_command(&j->drive, LOAD_NM);
  j->drive.beyond_Nm = 0;
  run(j, STAND_TICKS, LOAD_NM, 0);
  return join(j) > STILL_RAD;
}

/* Angles and torque are lost in motion, and return: no jump, although the planner went on; and none
 * after a long time, in which the drive has stopped elsewhere. */
static int lose_bus(joint *j) {
  const lm_conditions none = conditions(LM_UNKNOWN);
  float before_rad;
  int k;
  run(j, 10, LOAD_NM, FAST_RAD);
  before_rad = j->motor_rad;
  for (k = 1; k <= 40; ++k) {
    const float wish_rad = j->wish_rad + FAST_RAD * (float)k;
    const float setpoint_rad = lm_axis_tick(&j->drive, &none, not_a_number(), wish_rad, 1);
    if (k <= LM_FOLLOW_LOST_TICKS) { /* not seen by the axis */
      before_rad += FAST_RAD;
    } else if (j->drive.state != LM_AXIS_PAUSED || j->drive.waits != LM_AXIS_WAITS_MOTOR) {
      return 1;
    }
    if (size(setpoint_rad - before_rad) > ARRIVED_RAD) {
      return 1;
    }
  }
  run(j, 10, LOAD_NM, 0);
  if (j->drive.state != LM_AXIS_PAUSED || join(j) > ARRIVED_RAD ||
      size(j->motor_rad - before_rad) > ARRIVED_RAD) {
    return 1;
  }
  for (k = 0; k < STAND_TICKS; ++k) {
    (void)lm_axis_tick(&j->drive, &none, not_a_number(), j->wish_rad, 1);
  }
  j->motor_rad += FAST_RAD;
  before_rad = j->motor_rad;
  run(j, 1, LOAD_NM, 0);
  return join(j) > STILL_RAD || size(j->motor_rad - before_rad) > STILL_RAD;
}

/* A planner with half the rate of the tick, or one wish that is no number, is not at rest: nothing
 * is held in motion. */
static int plan_slowly(joint *j) {
  const lm_conditions at = conditions(LOAD_NM);
  int k;
  for (k = 0; k < 20; ++k) {
    j->wish_rad += k % 2 ? 0 : FAST_RAD;
    j->motor_rad =
        lm_axis_tick(&j->drive, &at, j->motor_rad, k == 17 ? not_a_number() : j->wish_rad, 1);
    if (!lm_axis_pause(&j->drive)) {
      return 1;
    }
  }
  for (k = 0; k < 200; ++k) { /* the last digit of an interpolator */
    run(j, 1, LOAD_NM, k % 2 ? 1e-6f : -1e-6f);
  }
  return j->drive.state != LM_AXIS_CLOSED || lm_axis_pause(&j->drive) || join(j) > STILL_RAD;
}

/* The first tick may be late, the second one not. */
static int start_late(void) {
  static lm_axis axis = {.ratio = 1};
  lm_conditions at = conditions(LOAD_NM);
  int k;
  if (lm_axis_power_up(&axis, &joint_parameters, 0, &at, 0, 0) != LM_OK) {
    return 1;
  }
  at.elapsed_s = 100 * PERIOD_S;
  for (k = 0; k < 2; ++k) {
    (void)lm_axis_tick(&axis, &at, 0, 0, 0);
    if (((axis.correction.status & LM_STATE_PERIOD_WRONG) != 0) != (k == 1)) {
      return 1;
    }
  }
  return 0;
}

/* An angle that is no number, or too large for a float. */
static int refuse_angles(void) {
  static lm_axis axis; /* without a ratio */
  const lm_conditions at = conditions(LOAD_NM);
  const float none = not_a_number();
  lm_axis_kept wrong;
  lm_fault fault;
  int k;
  memset(&wrong, 0, sizeof wrong);
  wrong.zero_rad = none;
  if (lm_axis_power_up(&axis, &joint_parameters, 0, &at, 0, &fault) != LM_OUT_OF_RANGE ||
      fault.input[0] != 'r') {
    return 1;
  }
  axis.ratio = 1;
  if (lm_axis_power_up(&axis, &joint_parameters, 0, &at, none, &fault) != LM_OUT_OF_RANGE ||
      size(lm_axis_tick(&axis, &at, none, 0, 1)) > 0 ||
      lm_axis_power_up(&axis, &joint_parameters, 0, &at, 257, &fault) != LM_OUT_OF_RANGE ||
      fault.input[0] != 'm' ||
      lm_axis_power_up(&axis, &joint_parameters, &wrong, &at, 0, &fault) != LM_OUT_OF_RANGE ||
      axis.state != LM_AXIS_OFF || lm_axis_close(&axis) != LM_AXIS_WAITS_START ||
      lm_axis_power_up(&axis, &joint_parameters, 0, &at, 0, &fault) != LM_OK) {
    return 1;
  }
  for (k = 0; k < STAND_TICKS; ++k) {
    (void)lm_axis_tick(&axis, &at, 40, 0, 1);
  }
  axis.commissioned = 1;
  if (lm_axis_close(&axis) != LM_AXIS_WAITS_MOTOR) {
    return 1;
  }
  /* Another mode after the tick: not yet. */
  for (k = 0; k < STAND_TICKS; ++k) {
    (void)lm_axis_tick(&axis, &at, 0, 0, 1);
  }
  (void)lm_axis_set_mode(&axis, LM_MODE_RESET);
  return lm_axis_close(&axis) != LM_AXIS_WAITS_STAND;
}

static void turn_load(joint *j, float from_Nm, float to_Nm) {
  const float by_Nm = to_Nm > from_Nm ? 0.05f : -0.05f;
  float torque_Nm;
  for (torque_Nm = from_Nm; (to_Nm - torque_Nm) * by_Nm > 0; torque_Nm += by_Nm) {
    run(j, 1, torque_Nm, 0);
  }
}

/* After it the history is known. */
static void cycle_load(joint *j) {
  turn_load(j, LOAD_NM, 50);
  turn_load(j, 50, -50);
  turn_load(j, -50, LOAD_NM);
  run(j, 400, LOAD_NM, 0);
}

int axis_story(float *most_rad) {
  static joint j;
  static lm_axis_kept kept;     /* in memory that survives power-down */
  static lm_parameters smaller; /* another set, with half the correction */
  lm_headroom headroom = {0, LM_UNKNOWN, LM_UNKNOWN, LM_UNKNOWN};
  const lm_conditions at = conditions(LOAD_NM);
  float moved_rad;
  float zero_rad;
  float error_rad;
  int k;
  memset(&kept, 0, sizeof kept); /* nothing saved yet */
  j.drive.ratio = 1;
  *most_rad = 0;
  j.motor_rad = 0.2f;
  j.twist_rad = 0;
  lm_start_model(&j.gear, LOAD_NM);
  lm_settle_model(&joint_parameters, &j.gear);
  if (refuse_angles()) {
    return 17;
  }
  /* Power-up, the brake on. */
  if (lm_axis_power_up(&j.drive, &joint_parameters, &kept, &at, j.motor_rad, 0) != LM_OK) {
    return 1;
  }
  /* Never commissioned with these parameters: a commissioning alone closes the loop. Here it is
   * taken as commissioned. */
  run(&j, 2 * STAND_TICKS, LOAD_NM, 0);
  if (lm_axis_close(&j.drive) != LM_AXIS_WAITS_COMMISSION) {
    return 35;
  }
  (void)lm_axis_guide(&j.drive, LM_UNKNOWN, 0);
  run(&j, 1, LOAD_NM, 0);
  if (lm_axis_close(&j.drive) != LM_AXIS_READY) {
    return 35;
  }
  lm_axis_open(&j.drive);
  j.drive.commissioned = 1;
  /* The torque is not known yet: the loop stays open. */
  run(&j, STAND_TICKS, LM_UNKNOWN, 0);
  if (lm_axis_close(&j.drive) != LM_AXIS_WAITS_CONDITION) {
    return 2;
  }
  moved_rad = close_loop(&j);
  *most_rad = moved_rad > *most_rad ? moved_rad : *most_rad;
  if (moved_rad > STILL_RAD) {
    return 2;
  }
  /* First homing, in motion: the load history is unknown, and the stated error of the zero includes
   * this. */
  run(&j, 100, LOAD_NM, FAST_RAD);
  zero_rad = j.wish_rad;
  error_rad = lm_axis_reference(&j.drive, j.motor_rad, 0.5f);
  zero_rad -= j.drive.command_rad;
  j.wish_rad = j.drive.command_rad;
  if (error_rad < STILL_RAD || size(j.drive.command_rad - 0.5f) > ARRIVED_RAD) {
    return 3;
  }
  /* Run: half a radian, with a load cycle. */
  run(&j, 900, LOAD_NM, FAST_RAD);
  cycle_load(&j);
  if (size(output(&j) - zero_rad - j.wish_rad) > ARRIVED_RAD) {
    return 4;
  }
  /* Emergency stop in the middle of a motion, a push under the brake, and resume: refused as long
   * as the correction still follows the load. */
  run(&j, 100, LOAD_NM, -FAST_RAD);
  lm_axis_open(&j.drive);
  run(&j, 200, LOAD_NM + PUSH_NM, 0);
  run(&j, 20, LOAD_NM, 0);
  if (!lm_axis_close(&j.drive) || !lm_axis_power_down(&j.drive, &kept)) {
    return 5;
  }
  /* The brake slips: the loop stays open. */
  for (k = 0; k < STAND_TICKS; ++k) {
    j.motor_rad += SLIP_RAD;
    run(&j, 1, LOAD_NM, 0);
  }
  if (!lm_axis_close(&j.drive)) {
    return 15;
  }
  /* The arm swings against the brake: that is no ringing of the correction. */
  for (k = 0; k < 10; ++k) {
    run(&j, 50, LOAD_NM + SWING_NM, 0);
    run(&j, 50, LOAD_NM - SWING_NM, 0);
  }
  run(&j, 20, LOAD_NM, 0);
  moved_rad = close_loop(&j);
  *most_rad = moved_rad > *most_rad ? moved_rad : *most_rad;
  if (moved_rad > STILL_RAD || (j.drive.correction.status & LM_STATE_RINGING)) {
    return 6;
  }
  /* Home again: the stop was not commanded, and what acted in it was in no torque. After a load
   * cycle the history is known, and nothing moves. */
  if (lm_axis_reference(&j.drive, j.motor_rad, j.drive.command_rad) < STILL_RAD) {
    return 33;
  }
  cycle_load(&j);
  zero_rad = output(&j);
  moved_rad = lm_axis_reference(&j.drive, j.motor_rad, 1.0f); /* without a zero: any gravity */
  j.drive.homed = 1;
  error_rad = lm_axis_reference(&j.drive, j.motor_rad, 1.0f);
  j.drive.homed = 0;
  j.wish_rad = j.drive.command_rad;
  run(&j, 200, LOAD_NM, 0);
  if (moved_rad < 1e-3f || size(error_rad - 3 * joint_parameters.watch.noise_rad) > STILL_RAD ||
      size(output(&j) - zero_rad) > STILL_RAD) {
    return 7;
  }
  run(&j, 1000, LOAD_NM, FAST_RAD); /* to 1.5 rad */
  run(&j, 400, LOAD_NM, 0);
  if (size(output(&j) - zero_rad - 0.5f) > ARRIVED_RAD ||
      size(lm_axis_reported(&j.drive, j.motor_rad) - 1.5f) > ARRIVED_RAD) {
    return 8;
  }
  /* At rest: the correction goes to zero and back, to other parameters and back, to less headroom
   * and back; nothing moves. */
  zero_rad = output(&j);
  smaller = joint_parameters;
  smaller.limits.correction_rad = 0.5f * size(j.drive.correction.correction_rad);
  headroom.correction_rad = smaller.limits.correction_rad;
  for (k = 0; k < 6; ++k) {
    if (k < 2) {
      (void)lm_axis_set_mode(&j.drive, k == 0 ? LM_MODE_RESET : LM_MODE_RUN);
    } else if (k >= 4) {
      (void)lm_axis_headroom(&j.drive, k == 4 ? &headroom : 0);
    } else if (lm_axis_change(&j.drive, k == 2 ? &smaller : &joint_parameters, 0) != LM_OK) {
      return 12;
    }
    moved_rad = resume(&j);
    *most_rad = moved_rad > *most_rad ? moved_rad : *most_rad;
    if (moved_rad > STILL_RAD || size(output(&j) - zero_rad) > STILL_RAD ||
        (size(j.drive.correction.correction_rad) < STILL_RAD) != (k == 0)) {
      return 13;
    }
  }
  /* Other parameters are not commissioned, although nothing else has changed. */
  smaller = joint_parameters;
  smaller.fingerprint ^= 1u;
  if (lm_axis_change(&j.drive, &smaller, 0) != LM_OK) {
    return 12;
  }
  run(&j, 3 * STAND_TICKS, LOAD_NM, 0);
  if (j.drive.state != LM_AXIS_PAUSED || j.drive.waits != LM_AXIS_WAITS_COMMISSION ||
      lm_axis_change(&j.drive, &joint_parameters, 0) != LM_OK || j.drive.commissioned) {
    return 35;
  }
  j.drive.commissioned = 1;
  if (join(&j) > STILL_RAD) {
    return 35;
  }
  moved_rad = take_current(&j);
  *most_rad = moved_rad > *most_rad ? moved_rad : *most_rad;
  if (moved_rad > STILL_RAD) {
    return 16;
  }
  if (lose_measurement(&j, 0) || lose_measurement(&j, 1) || wander(&j) || weigh(&j) ||
      shift_gravity(&j)) {
    return 18;
  }
  if (fades(&j, 1) || !fades(&j, -1)) {
    return 36;
  }
  if (confuse_planner(&j) || forget_shift(&j)) {
    return 19;
  }
  if (wait_for_drive(&j) || plan_slowly(&j) || start_late()) {
    return 20;
  }
  if (pass_on_finite(&j)) {
    return 24;
  }
  if (exaggerate(&j)) {
    return 31;
  }
  if (open_early(&j)) {
    return 25;
  }
  if (lose_wish(&j, LM_FOLLOW_LOST_TICKS, 0) || lose_wish(&j, 20, 0) || lose_wish(&j, 0, 0.2f) ||
      lose_wish(&j, 0, -0.2f)) {
    return 26;
  }
  if (come_back_elsewhere(&j)) {
    return 27;
  }
  if (lose_thermometer(&j)) {
    return 28;
  }
  if (lose_condition(&j)) {
    return 30;
  }
  if (go_far(&j)) {
    return 32;
  }
  if (find_index(&j)) {
    return 29;
  }
  if (lose_bus(&j)) {
    return 21;
  }
  if (ramp_shift(&j)) {
    return 22;
  }
  if (change_payload(&j)) {
    return 23;
  }
  cycle_load(&j);
  if (lm_bound_uncertainty(&j.drive.compensator) > 0) {
    return 34;
  }
  /* Brake, power-down with the history and a payload that a sensor measured, power-up without the
   * sensor: nothing moves, and the history is used up. */
  lm_axis_open(&j.drive);
  for (k = 0; k < 3 * STAND_TICKS; ++k) {
    run(&j, 1, lm_axis_use_sensor(&j.drive, LOAD_NM, LOAD_NM + PUSH_NM), 0);
  }
  if (lm_axis_power_down(&j.drive, &kept) || kept.history.format == 0) {
    return 9;
  }
  error_rad = output(&j);
  j.wish_rad = j.drive.command_rad;
  if (lm_axis_power_up(&j.drive, &joint_parameters, &kept, &at, j.motor_rad, 0) != LM_OK ||
      (j.drive.correction.status & LM_STATE_MEMORY_UNKNOWN) || kept.history.format != 0) {
    return 10;
  }
  zero_rad = j.wish_rad;
  if (!j.drive.commissioned) {
    return 35;
  }
  for (k = 0; k < STAND_TICKS && lm_axis_close(&j.drive); ++k) {
    run(&j, 1, lm_axis_use_command(&j.drive, LOAD_NM), 0);
  }
  for (k = 0; k < STAND_TICKS; ++k) {
    run(&j, 1, lm_axis_use_command(&j.drive, LOAD_NM), 0);
  }
  moved_rad = size(output(&j) - error_rad);
  *most_rad = moved_rad > *most_rad ? moved_rad : *most_rad;
  if (j.drive.state != LM_AXIS_CLOSED || moved_rad > STILL_RAD ||
      size(j.drive.torque_Nm - LOAD_NM - PUSH_NM) > 0.01f) {
    return 11;
  }
  return size(lm_axis_reported(&j.drive, j.motor_rad) - zero_rad) > STILL_RAD ? 14 : 0;
}
