/* Runs each scenario of the joint three times: without compensation, with a constant width, with
 * the library. Prints the error of the output; the exit code is 0 if the library's error is at most
 * a tenth of that without compensation and a third of that with a constant width, and in hovering
 * no larger than without. Then runs the cases in which the library helps less, or not at all.
 *
 * JOINT_HINDSIGHT=1 also compares with the best of several constant widths for each scenario, which
 * is unknown in practice. JOINT_TRIALS=2 shortens the run on slowly emulated processors. */
#include "loop.h"
#include "params.h"
#include "sine.h"
#include "table.h"
#include "target.h"

#ifndef JOINT_HINDSIGHT
#define JOINT_HINDSIGHT 0
#endif

#define RAD_TO_ARCSEC 206264.81f
#define STEPS_PER_TICK 4     /* TICK_S / PLANT_STEP_S */
#define LEANED_RAD 8e-4f     /* motion of the load before power-up */
#define FULL_SWING_NM 40.0f  /* rated torque */
#define GAUGE_TORQUE_NM 1.6f /* 4 % of it, where catalogues state lost motion */
#define GAUGE_STEP_NM 0.05f
#define SETTLED_RAD 1e-4f /* reported and commanded angle at the end of a scenario */

typedef enum bar { BAR_TENTH_AND_THIRD, BAR_NO_WORSE, BAR_NONE } bar;

typedef struct trial {
  const char *name;
  int scenario;
  bar least;
  torque_source source;
  float heavier;  /* relative to the value that the controller knows */
  int from_start; /* scored from power-up on, with the history unknown */
} trial;

static const trial trials[] = {
    {"reversals", 0, BAR_TENTH_AND_THIRD, TORQUE_FROM_COMMAND, 1, 0},
    {"hovering", 6, BAR_NO_WORSE, TORQUE_FROM_COMMAND, 1, 0},
    {"circle, lifting axis", 1, BAR_TENTH_AND_THIRD, TORQUE_FROM_COMMAND, 1, 0},
    {"circle, level axis", 2, BAR_TENTH_AND_THIRD, TORQUE_FROM_COMMAND, 1, 0},
    {"gravity sweep", 3, BAR_TENTH_AND_THIRD, TORQUE_FROM_COMMAND, 1, 0},
    {"small jogs", 4, BAR_TENTH_AND_THIRD, TORQUE_FROM_COMMAND, 1, 0},
    {"stop and go", 5, BAR_TENTH_AND_THIRD, TORQUE_FROM_COMMAND, 1, 0},
    {"hovering after a hard stop", 7, BAR_NONE, TORQUE_FROM_COMMAND, 1, 0},
    {"reversals, from power-up on", 0, BAR_NONE, TORQUE_FROM_COMMAND, 1, 1},
    {"reversals, load 20 % heavier", 0, BAR_NONE, TORQUE_FROM_COMMAND, 1.2f, 0},
    {"reversals, bearing unknown", 0, BAR_NONE, TORQUE_WITHOUT_FRICTION, 1, 0},
    {"reversals, torque by current", 0, BAR_NONE, TORQUE_FROM_CURRENT, 1, 0},
    {"sweep, torque by current", 3, BAR_NONE, TORQUE_FROM_CURRENT, 1, 0},
    {"hovering, torque by current", 6, BAR_NO_WORSE, TORQUE_FROM_CURRENT, 1, 0},
    {"reversals, torque by sensor", 0, BAR_NONE, TORQUE_FROM_SENSOR, 1, 0},
    {"sweep, load 20 % heavier", 3, BAR_NONE, TORQUE_FROM_COMMAND, 1.2f, 0},
    {"  with a torque sensor", 3, BAR_NONE, TORQUE_FROM_SENSOR, 1.2f, 0},
};

#ifndef JOINT_TRIALS
#define JOINT_TRIALS ((int)(sizeof trials / sizeof trials[0]))
#endif

static plant joint;
static loop control;

/* Root mean square of output - command [arcsec], or -1 if the loop has an error. */
static float run(const trial *what, method how, float half_rad) {
  const scenario *motions = &scenarios[what->scenario];
  plant_load load = motions->load;
  int32_t ticks = scenario_ticks(motions);
  int32_t unscored = what->from_start ? 0 : unscored_ticks(motions);
  int32_t tick;
  motion now = scenario_at(motions, 0);
  float motor_Nm = 0;
  float sum = 0;
  float reported_rad;
  load.gravity_Nm *= what->heavier;
  load.inertia_kgm2 *= what->heavier;
  plant_start(&joint, load);
  plant_disturb(&joint, LEANED_RAD);
  if (loop_start(&control, how, what->source, &joint_parameters, motions->load, half_rad,
                 plant_read_encoder(&joint), &now)) {
    return -1;
  }
  for (tick = 0; tick < ticks; ++tick) {
    motion next = scenario_at(motions, tick + 1);
    float error = (plant_output(&joint) - now.angle_rad) * RAD_TO_ARCSEC;
    float next_Nm =
        loop_tick(&control, plant_read_encoder(&joint), plant_read_torque(&joint), &next);
    int step;
    for (step = 0; step < STEPS_PER_TICK; ++step) {
      plant_step(&joint, motor_Nm);
    }
    motor_Nm = next_Nm; /* computed in this tick, acts in the next */
    now = next;
    if (tick >= unscored) {
      sum += error * error;
    }
  }
  /* The angle reported to the planner must not contain the correction. */
  reported_rad = loop_position(&control) - now.angle_rad;
  if (!(reported_rad < SETTLED_RAD && reported_rad > -SETTLED_RAD)) {
    return -1;
  }
  return square_root(sum / (float)(ticks - unscored));
}

static float load_slowly(lm_memory *memory, float *torque_Nm, float to_Nm) {
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  float angle_rad;
  do {
    float left_Nm = to_Nm - *torque_Nm;
    *torque_Nm = left_Nm > GAUGE_STEP_NM    ? *torque_Nm + GAUGE_STEP_NM
                 : left_Nm < -GAUGE_STEP_NM ? *torque_Nm - GAUGE_STEP_NM
                                            : to_Nm;
    at.torque_Nm = *torque_Nm;
    angle_rad = lm_step_model(&joint_parameters, memory, &at);
  } while (*torque_Nm != to_Nm);
  return angle_rad;
}

/* Half the width that a dial gauge would show under 4 % of the rated torque in one direction and
 * then the other, after full swings. */
static float gauge_half_width(void) {
  static lm_memory memory;
  float torque_Nm = 0;
  float up_rad;
  lm_start_model(&memory, 0);
  lm_settle_model(&joint_parameters, &memory);
  load_slowly(&memory, &torque_Nm, FULL_SWING_NM);
  load_slowly(&memory, &torque_Nm, -FULL_SWING_NM);
  up_rad = load_slowly(&memory, &torque_Nm, GAUGE_TORQUE_NM);
  return 0.5f * (up_rad - load_slowly(&memory, &torque_Nm, -GAUGE_TORQUE_NM));
}

static int passes(bar which, float model, float none, float constant) {
  if (which == BAR_TENTH_AND_THIRD) {
    return model <= 0.1f * none && model <= constant / 3;
  }
  return which == BAR_NONE || model <= none;
}

static int compare(const trial *what, float half_rad) {
  float none = run(what, METHOD_NONE, 0);
  float constant = run(what, METHOD_CONSTANT, half_rad);
  float model = run(what, METHOD_MODEL, 0);
  int good = none >= 0 && constant >= 0 && model >= 0 && passes(what->least, model, none, constant);
  print_left(what->name, 30);
  print_right(none, 1, 8);
  print_right(constant, 1, 10);
  print_right(model, 1, 10);
  print_right(model / none, 3, 10);
  print_right(model / constant, 3, 10);
#if JOINT_HINDSIGHT
  {
    static const float widths[] = {0, 0.25f, 0.5f, 0.75f, 1.25f, 1.5f, 2, 3, 4};
    float best = constant;
    unsigned i;
    for (i = 0; i < sizeof widths / sizeof widths[0]; ++i) {
      float tried = run(what, METHOD_CONSTANT, widths[i] * half_rad);
      best = tried < best ? tried : best;
    }
    good = good && passes(what->least, model, none, best);
    print_right(best, 1, 10);
    print_right(model / best, 3, 10);
  }
#endif
  target_print(good ? "\n" : "  MISSED\n");
  return good;
}

int main(void) {
  float half_rad = gauge_half_width();
  int good = 1;
  int i;
  target_print("rms error of the output in arcsec; constant width +-");
  print_right(half_rad * RAD_TO_ARCSEC, 1, 0);
  target_print("\n");
  print_left("", 30);
  target_print("    none  constant   library   to none  to const.");
  target_print(JOINT_HINDSIGHT ? "  best con.   to best\n" : "\n");
  for (i = 0; i < JOINT_TRIALS; ++i) {
    if (trials[i].least == BAR_NONE && trials[i - 1].least != BAR_NONE) {
      target_print("cases in which it helps less, without a criterion:\n");
    }
    good = compare(&trials[i], half_rad) && good;
  }
  target_print(good ? "all criteria are met\n" : "a criterion is not met\n");
  return !good;
}
