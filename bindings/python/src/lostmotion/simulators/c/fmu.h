/* Common part of an FMU between the functions of FMI (fmi2_interface.c, fmi3_interface.c) and the
 * model (drive.c, compensator.c).
 *
 * Before this file lostmotion.h and fmu_data.h are included, which `lostmotion export` writes for
 * one drive:
 *
 *     FMU_KIND                  what the FMU is: one of the three below
 *     FMU_TOKEN                 GUID or instantiation token of the description
 *     FMU_KNOTS, FMU_PLAYS, FMU_OUTSIDE, FMU_EFFECTS   sizes of the drive
 *     FMU_PARAMETERS            numbers in fmu_parameter_start, in the order of fmu_place
 *     fmu_effect, fmu_value_count   effects at work
 *     fmu_access                what may be done with each variable
 *     fmu_unit                  usual size of each input
 *
 * A value reference is an index of fmu_state.value: inputs, outputs, parameters.
 *
 * No globals that are written; an instance is one block of memory. Instances may run in different
 * threads at once.
 */
#ifndef FMU_H
#define FMU_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FMU_TORQUE_IN 1   /* torque and input angle in, output angle out */
#define FMU_ANGLES_IN 2   /* both angles in, torque out */
#define FMU_COMPENSATOR 3 /* the controller's compensator */

/* Inputs, one for each condition, in the order of the LM_NEEDS_ bits. FMI passes the elapsed time
 * with each step: its place is that of the mode. */
#define FMU_INPUT(field, ...) IN_##field,
enum { LM_CONDITION_LIST(FMU_INPUT, FMU_INPUT, FMU_INPUT, FMU_INPUT) FMU_INPUTS };
#define IN_MODE IN_elapsed_s

enum {
  OUT_LOST_MOTION = FMU_INPUTS,
  OUT_RATE,
  OUT_OUTPUT_ANGLE,
  OUT_TORQUE,
  OUT_STIFFNESS,
  OUT_STATUS,
  OUT_CORRECTION,
  OUT_VELOCITY,
  OUT_ACCELERATION,
  OUT_TIME,
  FMU_FIRST_PARAMETER,
  FMU_VALUES = FMU_FIRST_PARAMETER + FMU_PARAMETERS
};

/* Where parameters begin, counted from the first. */
enum {
  AT_RATIO,
  AT_TORQUE_LIMIT,
  AT_ENVELOPE,
  AT_KNEE,
  AT_LIMITS,
  AT_WATCH = AT_LIMITS + 6,
  AT_VALID = AT_WATCH + 6,
  AT_KNOT_TORQUE = AT_VALID + 7,
  AT_KNOT_ANGLE = AT_KNOT_TORQUE + FMU_KNOTS,
  AT_RADIUS = AT_KNOT_ANGLE + FMU_KNOTS,
  AT_WIDENING = AT_RADIUS + FMU_PLAYS,
  AT_WEIGHT = AT_WIDENING + FMU_PLAYS,
  AT_EFFECTS = AT_WEIGHT + FMU_PLAYS
};

/* Permitted access to a variable (fmu_access). */
enum { FMU_NONE, FMU_REAL, FMU_INTEGER, FMU_SETTABLE = 4 };

typedef struct fmu_state {
  double value[FMU_VALUES];
  double applied[FMU_PARAMETERS]; /* parameters from which the model was built */
  double elapsed_s;               /* of the last step */
  int32_t tuned;                  /* a parameter has been set since */
  int32_t phase;
#if FMU_KIND == FMU_COMPENSATOR
  lm_compensator compensator; /* its pointer is that of the instance */
#else
  lm_memory memory;
  int32_t direction; /* of the last change of torque, 1 or -1 */
  int32_t unused;
#endif
} fmu_state;

/* Phases of an instance. */
enum { FMU_INSTANTIATED, FMU_INITIALISING, FMU_RUNNING, FMU_ENDED };

typedef struct fmu_instance {
  fmu_state state;
  lm_parameters parameters[2]; /* the one in use, and room for the next */
  int32_t used;
  char *name;
  const void *callbacks; /* the FMI version's own */
  void *environment;
  void (*log)(const struct fmu_instance *instance, const char *message);
} fmu_instance;

/* The model's side. A function that can fail returns 0 after logging the reason. */
static int fmu_start(fmu_instance *instance);
static int fmu_step(fmu_instance *instance, double step_s);
static int fmu_adopt(fmu_instance *instance, const lm_parameters *parameters);
static int fmu_derive(const fmu_instance *instance, const double *seed, double *derivative);

static void fmu_say(const fmu_instance *instance, const char *message) {
  if (instance->log) {
    instance->log(instance, message);
  }
}

static int fmu_refuse(const fmu_instance *instance, const char *what, const lm_fault *fault) {
  char text[256];
  if (fault && fault->low < fault->high) {
    (void)snprintf(text, sizeof text, "%s: %s: %g; expected %g to %g", what, fault->input,
                   (double)fault->found, (double)fault->low, (double)fault->high);
  } else if (fault) {
    (void)snprintf(text, sizeof text, "%s: %s: %g; %s", what, fault->input, (double)fault->found,
                   lm_status_sentence(fault->status));
  } else {
    (void)snprintf(text, sizeof text, "%s", what);
  }
  fmu_say(instance, text);
  return 0;
}

/* A double in the model's precision; values beyond float are beyond every range anyway. */
static lm_real fmu_real(double value) {
#if LM_REAL_BITS == 32
  const double largest = 3.4028234663852886e38;
  if (value > largest || value < -largest) {
    return value > 0 ? (lm_real)largest : -(lm_real)largest;
  }
#endif
  return (lm_real)value;
}

static void fmu_copy_reals(lm_real *to, const double *from, int32_t count) {
  int32_t i;
  for (i = 0; i < count; ++i) {
    to[i] = fmu_real(from[i]);
  }
}

/* Parameters from their numbers, checked as on a controller. */
static int fmu_build(const fmu_instance *instance, const double *number, lm_parameters *made) {
  lm_real torque_Nm[FMU_KNOTS];
  lm_real angle_rad[FMU_KNOTS];
  lm_real group[7];
  lm_play play[FMU_PLAYS + 1];
  lm_fault fault;
  lm_status status;
  int32_t i;
  int32_t j;
  int32_t at = AT_EFFECTS;
  memset(made, 0, sizeof *made);
  memset(&fault, 0, sizeof fault);
  made->format = (uint32_t)LM_PARAMETERS_LAYOUT;
  made->torque_limit_Nm = fmu_real(number[AT_TORQUE_LIMIT]);
  fmu_copy_reals(group, &number[AT_LIMITS], 6);
  made->limits.period_s = group[0];
  made->limits.correction_rad = group[1];
  made->limits.velocity_rad_s = group[2];
  made->limits.acceleration_rad_s2 = group[3];
  made->limits.jerk_rad_s3 = group[4];
  made->limits.response_per_s = group[5];
  fmu_copy_reals(group, &number[AT_WATCH], 6);
  made->watch.window_s = group[0];
  made->watch.fade_s = group[1];
  made->watch.noise_rad = group[2];
  made->watch.misfit_rad = group[3];
  made->watch.creep_rad_s = group[4];
  made->watch.ringing_Hz = group[5];
  fmu_copy_reals(group, &number[AT_VALID], 7);
  made->valid.torque_Nm = group[0];
  for (i = 0; i < 2; ++i) {
    made->valid.temperature_C[i] = group[1 + i];
    made->valid.cycles[i] = group[3 + i];
    made->valid.input_velocity_rad_s[i] = group[5 + i];
  }
  made->effect_count = FMU_EFFECTS;
  for (i = 0; i < FMU_EFFECTS; ++i) {
    made->effect[i].effect = fmu_effect[i];
    for (j = 0; j < fmu_effect[i]->value_count; ++j) {
      made->effect[i].value[j] = fmu_real(number[at++]);
    }
  }
  fmu_copy_reals(torque_Nm, &number[AT_KNOT_TORQUE], FMU_KNOTS);
  fmu_copy_reals(angle_rad, &number[AT_KNOT_ANGLE], FMU_KNOTS);
  for (i = 0; i < FMU_PLAYS; ++i) {
    play[i].radius_Nm = fmu_real(number[AT_RADIUS + i]);
    play[i].widening = fmu_real(number[AT_WIDENING + i]);
    play[i].weight = fmu_real(number[AT_WEIGHT + i]);
  }
  status = lm_build_curve(&made->curve, torque_Nm, angle_rad, FMU_KNOTS, &fault);
  if (status == LM_OK) {
    status = lm_build_play_bank(&made->plays, play, FMU_PLAYS, FMU_OUTSIDE, &fault);
  }
  if (status == LM_OK) {
    status = lm_set_envelope(&made->plays, fmu_real(number[AT_ENVELOPE]), fmu_real(number[AT_KNEE]),
                             &fault);
  }
  if (status == LM_OK) {
    status = lm_check_parameters(made, &fault);
  }
  if (status == LM_OK && !(number[AT_RATIO] != 0 && number[AT_RATIO] - number[AT_RATIO] == 0)) {
    fault.status = LM_OUT_OF_RANGE;
    fault.input = "ratio";
    fault.found = fmu_real(number[AT_RATIO]);
    fault.low = fault.high = 0;
    status = LM_OUT_OF_RANGE;
  }
  return status == LM_OK ? 1 : fmu_refuse(instance, "parameters", &fault);
}

/* Parameters that were set since the last step become active; if they contradict each other, the
 * previous ones remain active. */
static int fmu_tune(fmu_instance *instance) {
  fmu_state *state = &instance->state;
  lm_parameters *next = &instance->parameters[1 - instance->used];
  if (!state->tuned) {
    return 1;
  }
  if (!fmu_build(instance, &state->value[FMU_FIRST_PARAMETER], next) ||
      !fmu_adopt(instance, next)) {
    return 0;
  }
  instance->used = 1 - instance->used;
  memcpy(state->applied, &state->value[FMU_FIRST_PARAMETER], sizeof state->applied);
  state->tuned = 0;
  return 1;
}

#define FMU_AT_ZERO(field, ...)
#define FMU_AT_USUAL(field, need, usual, uses) state->value[IN_##field] = (double)(usual);

static void fmu_reset(fmu_instance *instance) {
  fmu_state *state = &instance->state;
  memset(state, 0, sizeof *state);
  LM_CONDITION_LIST(FMU_AT_ZERO, FMU_AT_ZERO, FMU_AT_USUAL, FMU_AT_USUAL)
  memcpy(&state->value[FMU_FIRST_PARAMETER], fmu_parameter_start, sizeof state->applied);
  memcpy(state->applied, fmu_parameter_start, sizeof state->applied);
}

/* The first build of the model, and the outputs at the inputs of the start. */
static int fmu_initialise(fmu_instance *instance) {
  fmu_state *state = &instance->state;
  instance->used = 0;
  if (!fmu_build(instance, &state->value[FMU_FIRST_PARAMETER], &instance->parameters[0])) {
    return 0;
  }
  memcpy(state->applied, &state->value[FMU_FIRST_PARAMETER], sizeof state->applied);
  state->tuned = 0;
  return fmu_start(instance);
}

static void fmu_free(fmu_instance *instance) {
  if (instance) {
    free(instance->name);
    free(instance);
  }
}

static fmu_instance *fmu_new(const char *name) {
  fmu_instance *instance = (fmu_instance *)calloc(1, sizeof *instance);
  size_t length = name ? strlen(name) : 0;
  if (!instance) {
    return 0;
  }
  instance->name = (char *)calloc(length + 1, 1);
  if (!instance->name) {
    fmu_free(instance);
    return 0;
  }
  if (length > 0) {
    memcpy(instance->name, name, length);
  }
  fmu_reset(instance);
  return instance;
}

/* Reads or writes variables of a type; 0 if one has another type. */
static int fmu_get(fmu_instance *instance, uint32_t reference, uint32_t type, double *value) {
  fmu_state *state = &instance->state;
  if (reference >= FMU_VALUES || (fmu_access[reference] & 3u) != type) {
    return fmu_refuse(instance, "no variable of this type has this value reference", 0);
  }
  /* In initialization mode outputs follow the inputs that were set. */
  if (state->phase == FMU_INITIALISING && !(fmu_access[reference] & FMU_SETTABLE) &&
      !fmu_initialise(instance)) {
    return 0;
  }
  *value = state->value[reference];
  return 1;
}

static int fmu_set(fmu_instance *instance, uint32_t reference, uint32_t type, double value) {
  fmu_state *state = &instance->state;
  if (reference >= FMU_VALUES || fmu_access[reference] != (type | FMU_SETTABLE)) {
    return fmu_refuse(instance, "no variable of this type that can be set has this value reference",
                      0);
  }
  state->value[reference] = value;
  if (reference >= FMU_FIRST_PARAMETER) {
    state->tuned = 1;
  }
  return 1;
}

static int fmu_advance(fmu_instance *instance, double time_s, double step_s) {
  if (instance->state.phase != FMU_RUNNING) {
    return fmu_refuse(instance, "doStep before the end of the initialization, or after the end", 0);
  }
  if (!(step_s >= 0 && step_s - step_s == 0)) {
    return fmu_refuse(instance, "communication step size: expected a finite number from 0", 0);
  }
  if (!fmu_tune(instance)) {
    return 0;
  }
  instance->state.elapsed_s = step_s;
  instance->state.value[OUT_TIME] = time_s + step_s;
  return fmu_step(instance, step_s);
}

/* d unknown / d known in the direction of the seeds, at the end of the last step. */
static int fmu_directional(const fmu_instance *instance, const uint32_t *unknown, size_t unknowns,
                           const uint32_t *known, size_t knowns, const double *seed,
                           double *sensitivity) {
  double direction[FMU_INPUTS] = {0};
  double derivative[FMU_FIRST_PARAMETER] = {0};
  size_t i;
  if (instance->state.phase != FMU_RUNNING && instance->state.phase != FMU_INITIALISING) {
    return fmu_refuse(instance, "no directional derivative before the initialization", 0);
  }
  for (i = 0; i < knowns; ++i) {
    if (known[i] >= FMU_INPUTS || fmu_access[known[i]] != (FMU_REAL | FMU_SETTABLE)) {
      return fmu_refuse(instance, "directional derivative: a known must be a real input", 0);
    }
    direction[known[i]] += seed[i];
  }
  for (i = 0; i < unknowns; ++i) {
    if (unknown[i] < FMU_INPUTS || unknown[i] >= OUT_TIME || fmu_access[unknown[i]] != FMU_REAL) {
      return fmu_refuse(instance, "directional derivative: an unknown must be a real output", 0);
    }
  }
  if (!fmu_derive(instance, direction, derivative)) {
    return 0;
  }
  for (i = 0; i < unknowns; ++i) {
    sensitivity[i] = derivative[unknown[i]];
  }
  return 1;
}

/* --- states, in memory and as bytes --- */

static fmu_state *fmu_keep(const fmu_instance *instance, fmu_state *kept) {
  fmu_state *copy = kept ? kept : (fmu_state *)malloc(sizeof *copy);
  if (copy) {
    memcpy(copy, &instance->state, sizeof *copy);
#if FMU_KIND == FMU_COMPENSATOR
    copy->compensator.parameters = 0;
#endif
  }
  return copy;
}

static int fmu_put_back(fmu_instance *instance, const fmu_state *kept) {
  int32_t next = 1 - instance->used;
  if (!kept) {
    return fmu_refuse(instance, "no state was given", 0);
  }
  if (kept->phase >= FMU_RUNNING &&
      !fmu_build(instance, kept->applied, &instance->parameters[next])) {
    return 0;
  }
  memcpy(&instance->state, kept, sizeof *kept);
  instance->used = next;
#if FMU_KIND == FMU_COMPENSATOR
  instance->state.compensator.parameters =
      kept->phase >= FMU_RUNNING ? &instance->parameters[next] : 0;
#endif
  return 1;
}

/* Header of the bytes of a state, which shows that they are from this FMU and undamaged. */
typedef struct fmu_seal {
  uint32_t token;
  uint32_t crc;
} fmu_seal;

#define FMU_STATE_BYTES (sizeof(fmu_seal) + sizeof(fmu_state))

static fmu_seal fmu_make_seal(const fmu_state *kept) {
  fmu_seal seal;
  seal.token = lm_find_crc(0, FMU_TOKEN, sizeof FMU_TOKEN);
  seal.crc = lm_find_crc(0, kept, sizeof *kept);
  return seal;
}

static int fmu_write_state(const fmu_instance *instance, const fmu_state *kept, void *bytes,
                           size_t size) {
  fmu_seal seal;
  if (!kept || !bytes || size < FMU_STATE_BYTES) {
    return fmu_refuse(instance, "serialized state: no state, or too few bytes for it", 0);
  }
  seal = fmu_make_seal(kept);
  memcpy(bytes, &seal, sizeof seal);
  memcpy((char *)bytes + sizeof seal, kept, sizeof *kept);
  return 1;
}

static fmu_state *fmu_read_state(const fmu_instance *instance, const void *bytes, size_t size) {
  fmu_state *kept;
  fmu_seal found;
  fmu_seal expected;
  if (!bytes || size != FMU_STATE_BYTES) {
    (void)fmu_refuse(instance, "serialized state: of another length, from another FMU", 0);
    return 0;
  }
  kept = (fmu_state *)malloc(sizeof *kept);
  if (!kept) {
    return 0;
  }
  memcpy(&found, bytes, sizeof found);
  memcpy(kept, (const char *)bytes + sizeof found, sizeof *kept);
  expected = fmu_make_seal(kept);
  if (found.token != expected.token || found.crc != expected.crc) {
    (void)fmu_refuse(instance, "serialized state: damaged, or from another FMU", 0);
    free(kept);
    return 0;
  }
  return kept;
}

#endif
