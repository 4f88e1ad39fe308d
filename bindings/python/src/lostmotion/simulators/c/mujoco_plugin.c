/* A drive as an engine plugin of MuJoCo: the torque of its lost motion, between two hinges in
 * series.
 *
 * The hinge with the actuator is the input, in angles of the output: input angle = ratio * qpos. A
 * second hinge on the same axis, which simulators/mujoco.py puts behind it, is the lost motion. The
 * plugin finds the torque T at which the model gives that lost motion, and applies -T to it. Where
 * the lost motion depends on the input angle (kinematic error), the input gets the reaction by the
 * energy, the derivative of the complementary energy
 *
 *     reaction = integral from 0 to T of d(lost motion)/d(qpos of the input) dT
 *
 * Stability. T is that of the beginning of the step; after the step h the lost motion has increased
 * by h v', where v' is the new velocity. A spring of a stiffness up to K stores, in such a step, at
 * most T h v' + K (h v')^2 / 2, the force removes T h v' from the motion: a damping of d = h K / 2
 * removes the difference h v' d v', which would otherwise be created. MuJoCo's integrators have
 * joint damping at the new velocity (Euler, implicit, implicitfast), so with that damping on the
 * second hinge no step of any length creates energy. Without it a force of the beginning of the
 * step is unstable at 2 ms: 6e4 N*m/rad between a rotor and a link of 0.1 kg*m^2 each swing at 174
 * Hz, unstable from 1.8 ms on. Not RK4, which has no implicit damping.
 *
 * The friction's memory lies in mjData.plugin_state: it is copied, saved and reset with the rest,
 * and advances once per step.
 */
#include <mujoco/mujoco.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "lostmotion.h"

/* Tolerance of the lost motion in the search for the torque: 1e-13 rad at 6e4 N*m/rad are
 * 6e-9 N*m. */
#define CLOSE_RAD 1e-13

/* Steps of the search. Between two knots the model is a straight line, which a secant solves
 * exactly: 3 to 6 steps. Halving the range of torques 64 times reaches a double's rounding. */
#define SEARCH_STEPS 96

/* Least step of the input in a difference, rad: of 1e-4 rad of kinematic error that leaves
 * 1e-14. */
#define DIFFERENCE_RAD 1e-5

enum { KNOTS = LM_CURVE_POINTS_MAX, PLAYS = LM_PLAYS_MAX, NUMBERS = 64 };

/* The history, which mjData stores as plain numbers. */
typedef struct history {
  lm_memory memory;
  double slope_Nm_per_rad; /* last result, the start of the next search */
} history;

/* Data of the plugin for one drive in one mjData. */
typedef struct drive {
  lm_parameters parameters;
  double ratio;
  double temperature_C;
  double cycles;
  double stiffness_Nm_per_rad; /* the greatest, which determines the damping */
  int input_qpos;
  int input_dof;
  int lost_qpos;
  int lost_dof;
  int turns;     /* the lost motion depends on the input angle */
  history trial; /* the history with this step */
} drive;

/* mjData stores the history as its own numbers. */
typedef char
    history_is_doubles[sizeof(mjtNum) == sizeof(double) && sizeof(history) % 8 == 0 ? 1 : -1];

static drive *drive_of(const mjData *d, int instance) {
  return (drive *)d->plugin_data[instance];
}

/* Numbers of a key, at most NUMBERS, and their number; -1 if the text contains anything else. */
static int read_numbers(const mjModel *m, int instance, const char *key, double *number) {
  const char *text = mj_getPluginConfig(m, instance, key);
  int count = 0;
  while (text && text[strspn(text, " ")] != '\0') {
    char *end;
    if (count == NUMBERS) {
      return -1;
    }
    number[count] = strtod(text, &end);
    if (end == text) {
      return -1;
    }
    ++count;
    text = end;
  }
  return count;
}

static double read_number(const mjModel *m, int instance, const char *key) {
  double number[NUMBERS];
  return read_numbers(m, instance, key, number) > 0 ? number[0] : 0;
}

/* "name value value; name value" */
static int read_effects(const mjModel *m, int instance, lm_parameters *parameters) {
  const char *text = mj_getPluginConfig(m, instance, "effects");
  while (text && *text) {
    lm_effect_use *use = &parameters->effect[parameters->effect_count];
    size_t length;
    int i;
    text += strspn(text, " ;");
    length = strcspn(text, " ;");
    if (length == 0) {
      break;
    }
    if (parameters->effect_count >= LM_EFFECTS_MAX) {
      return 0;
    }
    use->effect = lm_find_effect(lm_effects, LM_EFFECT_COUNT, lm_find_crc(0, text, length));
    if (!use->effect) {
      return 0;
    }
    text += length;
    for (i = 0; i < use->effect->value_count; ++i) {
      char *end;
      use->value[i] = strtod(text, &end);
      text = end;
    }
    ++parameters->effect_count;
  }
  return 1;
}

static int read_parameters(const mjModel *m, int instance, lm_parameters *made) {
  double torque_Nm[NUMBERS];
  double angle_rad[NUMBERS];
  double radius_Nm[NUMBERS];
  double widening[NUMBERS];
  double weight[NUMBERS];
  lm_play play[NUMBERS];
  lm_fault fault;
  int knots = read_numbers(m, instance, "knots_torque_Nm", torque_Nm);
  int plays = read_numbers(m, instance, "play_radius_Nm", radius_Nm);
  int i;
  if (knots < 0 || plays < 0 || read_numbers(m, instance, "knots_angle_rad", angle_rad) != knots ||
      read_numbers(m, instance, "play_widening", widening) != plays ||
      read_numbers(m, instance, "play_weight", weight) != plays) {
    return 0;
  }
  for (i = 0; i < plays; ++i) {
    play[i].radius_Nm = radius_Nm[i];
    play[i].widening = widening[i];
    play[i].weight = weight[i];
  }
  memset(made, 0, sizeof *made);
  made->format = (uint32_t)LM_PARAMETERS_LAYOUT;
  made->torque_limit_Nm = read_number(m, instance, "torque_limit_Nm");
  /* Values that only a compensator reads: any that pass the check. */
  made->limits.period_s = made->limits.correction_rad = made->limits.response_per_s = 0.01;
  made->limits.velocity_rad_s = made->limits.acceleration_rad_s2 = made->limits.jerk_rad_s3 = 1;
  made->watch.window_s = made->watch.fade_s = 1;
  return read_effects(m, instance, made) &&
         lm_build_curve(&made->curve, torque_Nm, angle_rad, knots, &fault) == LM_OK &&
         lm_build_play_bank(&made->plays, play, plays, (int)read_number(m, instance, "outside"),
                            &fault) == LM_OK &&
         lm_set_envelope(&made->plays, read_number(m, instance, "envelope_Nm"),
                         read_number(m, instance, "knee_Nm"), &fault) == LM_OK &&
         lm_check_parameters(made, &fault) == LM_OK;
}

static int find_joint(const mjModel *m, int instance, const char *key) {
  const char *name = mj_getPluginConfig(m, instance, key);
  int joint = name ? mj_name2id(m, mjOBJ_JOINT, name) : -1;
  return joint >= 0 && m->jnt_type[joint] == mjJNT_HINGE ? joint : -1;
}

static int count_state(const mjModel *m, int instance) {
  (void)m;
  (void)instance;
  return (int)(sizeof(history) / sizeof(mjtNum));
}

static int init(const mjModel *m, mjData *d, int instance) {
  int input = find_joint(m, instance, "input_joint");
  int lost = find_joint(m, instance, "lost_motion_joint");
  drive *made = (drive *)calloc(1, sizeof *made);
  int i;
  if (!made) {
    return -1;
  }
  made->ratio = read_number(m, instance, "ratio");
  made->stiffness_Nm_per_rad = read_number(m, instance, "stiffness_max_Nm_per_rad");
  if (input < 0 || lost < 0 || made->ratio == 0 || !(made->stiffness_Nm_per_rad > 0) ||
      !read_parameters(m, instance, &made->parameters)) {
    free(made);
    mju_warning("lostmotion.drive: expected the configuration that lostmotion's put_drives writes");
    return -1;
  }
  made->temperature_C = read_number(m, instance, "temperature_C");
  made->cycles = read_number(m, instance, "cycles");
  made->input_qpos = m->jnt_qposadr[input];
  made->input_dof = m->jnt_dofadr[input];
  made->lost_qpos = m->jnt_qposadr[lost];
  made->lost_dof = m->jnt_dofadr[lost];
  for (i = 0; i < made->parameters.effect_count; ++i) {
    made->turns |= (made->parameters.effect[i].effect->covariates & LM_NEEDS_INPUT_ANGLE) != 0;
  }
  d->plugin_data[instance] = (uintptr_t)made;
  return 0;
}

static void destroy(mjData *d, int instance) {
  free(drive_of(d, instance));
  d->plugin_data[instance] = 0;
}

static void copy(mjData *to, const mjModel *m, const mjData *from, int instance) {
  (void)m;
  if (drive_of(to, instance) && drive_of(from, instance)) {
    *drive_of(to, instance) = *drive_of(from, instance);
  }
}

static void reset(const mjModel *m, mjtNum *state, void *data, int instance) {
  drive *one = (drive *)data;
  history start;
  (void)m;
  (void)instance;
  lm_start_model(&start.memory, 0);
  start.slope_Nm_per_rad = one ? one->stiffness_Nm_per_rad : 0;
  memcpy(state, &start, sizeof start);
  if (one) {
    one->trial = start;
  }
}

static double lost_motion(drive *one, const lm_memory *before, lm_conditions *at,
                          double torque_Nm) {
  at->torque_Nm = torque_Nm;
  return lm_evaluate_model(&one->parameters, before, &one->trial.memory, at);
}

/* The torque at which the model gives a lost motion: secants within a shrinking range. Writes the
 * history at this torque to one->trial. Beyond the torque limit the result is the limit. */
static double find_torque(drive *one, const history *from, lm_conditions *at, double lost_rad) {
  const lm_memory *before = &from->memory;
  double low_Nm = -one->parameters.torque_limit_Nm;
  double high_Nm = one->parameters.torque_limit_Nm;
  double torque_Nm = before->plays.torque_Nm;
  double slope = from->slope_Nm_per_rad;
  double before_Nm = 0;
  double before_rad = 0;
  int step;
  for (step = 0; step < SEARCH_STEPS; ++step) {
    double miss_rad = lost_rad - lost_motion(one, before, at, torque_Nm);
    double next_Nm;
    if (miss_rad <= CLOSE_RAD && miss_rad >= -CLOSE_RAD) {
      break;
    }
    if (miss_rad > 0) {
      low_Nm = torque_Nm;
    } else {
      high_Nm = torque_Nm;
    }
    if (step > 0 && before_rad != miss_rad && before_Nm != torque_Nm) {
      double secant = (torque_Nm - before_Nm) / (before_rad - miss_rad);
      slope = secant > 0 && secant < 1e15 ? secant : slope;
    }
    before_Nm = torque_Nm;
    before_rad = miss_rad;
    next_Nm = torque_Nm + slope * miss_rad;
    /* Outside the range, or slow convergence: the middle of the range. */
    if (!(next_Nm > low_Nm && next_Nm < high_Nm) || step % 8 == 7) {
      next_Nm = low_Nm + (high_Nm - low_Nm) * 0.5;
    }
    if (next_Nm == torque_Nm) {
      break;
    }
    torque_Nm = next_Nm;
  }
  if (step == SEARCH_STEPS) {
    (void)lost_motion(one, before, at, torque_Nm);
  }
  one->trial.slope_Nm_per_rad = slope;
  return torque_Nm;
}

/* Reaction on the input by Simpson's rule over the torque, exact if the dependence on the input
 * angle is a polynomial in the torque up to the third power. The difference spans the motion of the
 * input in this step, so that the energy is that of the coming motion. */
static double find_reaction(drive *one, const history *from, lm_conditions *at, double torque_Nm,
                            double turned_rad) {
  static const double weight[3] = {1.0 / 6, 4.0 / 6, 1.0 / 6};
  const lm_memory *before = &from->memory;
  lm_conditions ahead = *at;
  history reached = one->trial;
  double sum_rad = 0;
  int i;
  if (turned_rad < DIFFERENCE_RAD && turned_rad > -DIFFERENCE_RAD) {
    turned_rad = turned_rad < 0 ? -DIFFERENCE_RAD : DIFFERENCE_RAD;
  }
  ahead.input_angle_rad = at->input_angle_rad + turned_rad;
  for (i = 0; i < 3; ++i) {
    double part_Nm = torque_Nm * 0.5 * i;
    sum_rad += weight[i] *
               (lost_motion(one, before, &ahead, part_Nm) - lost_motion(one, before, at, part_Nm));
  }
  one->trial = reached;
  at->torque_Nm = torque_Nm;
  return torque_Nm * sum_rad / turned_rad * one->ratio;
}

static void compute(const mjModel *m, mjData *d, int instance, int capability) {
  const double turn_rad = 6.283185307179586;
  drive *one = drive_of(d, instance);
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  history before;
  double step_s = m->opt.timestep;
  double input_rad = one->ratio * d->qpos[one->input_qpos];
  double torque_Nm;
  (void)capability;
  if (m->opt.integrator == mjINT_RK4 || (m->opt.disableflags & mjDSBL_EULERDAMP) ||
      2 * m->dof_damping[one->lost_dof] < 0.999 * step_s * one->stiffness_Nm_per_rad) {
    mju_error(
        "lostmotion.drive: at this timestep and integrator the lost motion is not stable: expected "
        "Euler, implicit or implicitfast, and after a change of the timestep set_timestep(model, "
        "s)");
    return;
  }
  memcpy(&before, d->plugin_state + m->plugin_stateadr[instance], sizeof before);
  at.input_angle_rad = input_rad - turn_rad * (double)(long long)(input_rad / turn_rad);
  at.temperature_C = one->temperature_C;
  at.cycles = one->cycles;
  at.elapsed_s = step_s;
  torque_Nm = find_torque(one, &before, &at, d->qpos[one->lost_qpos]);
  d->qfrc_passive[one->lost_dof] -= torque_Nm;
  if (one->turns) {
    d->qfrc_passive[one->input_dof] +=
        find_reaction(one, &before, &at, torque_Nm, step_s * one->ratio * d->qvel[one->input_dof]);
  }
}

static void advance(const mjModel *m, mjData *d, int instance) {
  memcpy(d->plugin_state + m->plugin_stateadr[instance], &drive_of(d, instance)->trial,
         sizeof(history));
}

/* Called when the shared object is loaded. MuJoCo's own macro for it has changed its form. */
__attribute__((constructor)) static void register_plugin(void) {
  static const char *attributes[] = {
      "input_joint",     "lost_motion_joint", "ratio",          "torque_limit_Nm",
      "knots_torque_Nm", "knots_angle_rad",   "play_radius_Nm", "play_widening",
      "play_weight",     "outside",           "envelope_Nm",    "knee_Nm",
      "effects",         "temperature_C",     "cycles",         "stiffness_max_Nm_per_rad",
  };
  mjpPlugin plugin;
  mjp_defaultPlugin(&plugin);
  plugin.name = "lostmotion.drive";
  plugin.nattribute = (int)(sizeof attributes / sizeof *attributes);
  plugin.attributes = attributes;
  plugin.capabilityflags = mjPLUGIN_PASSIVE;
  plugin.nstate = count_state;
  plugin.init = init;
  plugin.destroy = destroy;
  plugin.copy = copy;
  plugin.reset = reset;
  plugin.compute = compute;
  plugin.advance = advance;
  mjp_registerPlugin(&plugin);
}
