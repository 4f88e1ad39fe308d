/* For Frama-C Eva (prove.sh): no alarm means no undefined behaviour for any input: no index
 * out of bounds, no overflow, no conversion of a number that does not fit, no read of
 * uninitialised memory. Three entry points:
 *
 *     prove_step         what runs per tick and beside it, with parameters anywhere in the ranges
 *                        that the check accepts and inputs of any bits, NaN and infinity included
 *     prove_check        the check on parameters of any content at all, and the blob reader on any
 *                        bytes of any length up to BLOB_BYTES
 *     prove_elementary   sine and kin on any number
 *     prove_effects      every effect on what the model hands it, sine and kin with any result */
#include <string.h>

#include "__fc_builtin.h"
#include "lostmotion/runtime.h"

#define HUGE_NUMBER 3.0e38f

/* For prove_effects: no more than that they return. */
/*@ assigns \result \from angle_rad; */
float lm_sine(float angle_rad);
/*@ assigns \result \from angle_rad; */
float lm_cosine(float angle_rad);
/*@ assigns \result \from angle_rad; */
lm_sine_cosine lm_sine_and_cosine(float angle_rad);
/*@ assigns \result \from x; */
float lm_exponential(float x);
/*@ assigns \result \from x; */
float lm_logarithm(float x);
/*@ assigns \result \from x; */
float lm_hyperbolic_tangent(float x);
/*@ assigns \result \from x; */
float lm_relaxation(float x);
/*@ assigns \result \from x, exponent; */
float lm_power(float x, float exponent);

static lm_parameters parameters;
static lm_parameters other;
static lm_compensator compensator;
static lm_memory memory;

/* Any float at all, NaN and infinity among them. */
static float any(void) {
  float zero = 0.0f;
  float finite = Frama_C_float_interval(-HUGE_NUMBER, HUGE_NUMBER);
  return Frama_C_nondet(0, 1) ? finite : (Frama_C_nondet(0, 1) ? zero / zero : 1.0f / zero);
}

/* Any parameters that the check could accept: every field anywhere in its range. */
static void any_parameters(lm_parameters *p) {
  int i;
  memset(p, 0, sizeof *p);
  p->format = LM_PARAMETERS_LAYOUT;
  p->fingerprint = (uint32_t)Frama_C_interval(0, 0x7FFFFFFF);
  p->torque_limit_Nm = Frama_C_float_interval(1e-9f, 1e6f);
  p->limits.period_s = Frama_C_float_interval(1e-6f, 1.0f);
  p->limits.correction_rad = Frama_C_float_interval(1e-9f, 1.0f);
  p->limits.velocity_rad_s = Frama_C_float_interval(1e-9f, 1e9f);
  p->limits.acceleration_rad_s2 = Frama_C_float_interval(1e-9f, 1e9f);
  p->limits.jerk_rad_s3 = Frama_C_float_interval(1e-9f, 1e9f);
  p->limits.response_per_s = Frama_C_float_interval(1e-3f, 1e5f);
  p->watch.window_s = Frama_C_float_interval(1e-6f, 1e6f);
  p->watch.fade_s = Frama_C_float_interval(1e-6f, 1e6f);
  p->watch.noise_rad = Frama_C_float_interval(0.0f, 1.0f);
  p->watch.misfit_rad = Frama_C_float_interval(0.0f, 1.0f);
  p->plays.count = Frama_C_interval(0, LM_PLAYS_MAX);
  p->plays.outside_count = Frama_C_interval(0, LM_PLAYS_MAX);
  p->plays.widens = Frama_C_interval(0, 1);
  p->plays.outside_rad_per_Nm = Frama_C_float_interval(0.0f, 8.0f);
  p->plays.inside_share = Frama_C_float_interval(0.0f, 1.0f);
  p->plays.envelope_Nm = Frama_C_float_interval(0.0f, LM_ENVELOPE ? LM_PLAY_RADIUS_MAX_NM : 0.0f);
  p->plays.knee_Nm = Frama_C_float_interval(LM_PLAY_KNEE_MIN_NM, LM_PLAY_RADIUS_MAX_NM);
  for (i = 0; i < LM_PLAYS_MAX; ++i) {
    p->plays.slot[i].radius_Nm = Frama_C_float_interval(0.0f, 1e6f);
    p->plays.slot[i].edge_slope[0] = Frama_C_float_interval(0.0f, 1.0f);
    p->plays.slot[i].edge_slope[1] = Frama_C_float_interval(1.0f, 2.0f);
    p->plays.slot[i].weight = Frama_C_float_interval(0.0f, 1.0f);
  }
  p->curve.count = Frama_C_interval(2, LM_CURVE_POINTS_MAX);
  for (i = 0; i < LM_CURVE_STORE; ++i) {
    p->curve.torque_Nm[i] = Frama_C_float_interval(-1e9f, 1e9f);
    p->curve.angle_rad[i] = Frama_C_float_interval(-1e3f, 1e3f);
    p->curve.slope_rad_per_Nm[i] = Frama_C_float_interval(0.0f, 1e3f);
  }
}

#define ANY(field, ...) at.field = any();

static lm_conditions any_conditions(void) {
  lm_conditions at;
  LM_CONDITION_LIST(ANY, ANY, ANY, ANY)
  at.elastic_rad = any();
  at.wound_Nm = any();
  return at;
}

#define LEAVE(field, ...)
#define WITHIN(field, ...) at.field = Frama_C_float_interval(-1e12f, 1e12f);

/* Every effect by itself, values in bounds, conditions as the model hands them on. Sine and kin are
 * taken as proved for any bits (prove_elementary, esbmc_elementary.c): Eva loses what ties a step of
 * a lag to its length, and would then keep a NaN in their comparisons. */
void prove_effects(void) {
  int i;
  for (i = 0; i < LM_EFFECT_COUNT; ++i) {
    const lm_effect *effect = lm_effects[i];
    float value[LM_EFFECT_VALUES_MAX];
    float own[8];
    lm_conditions at;
    int k;
    for (k = 0; k < LM_EFFECT_VALUES_MAX; ++k) {
      value[k] = Frama_C_float_interval(effect->bound[k][0], effect->bound[k][1]);
    }
    for (k = 0; k < 8; ++k) {
      own[k] = Frama_C_float_interval(-1e6f, 1e6f);
    }
    at.torque_Nm = Frama_C_float_interval(-1e6f, 1e6f);
    LM_CONDITION_LIST(LEAVE, WITHIN, WITHIN, WITHIN)
    at.elapsed_s = Frama_C_float_interval(0.0f, 1e6f);
    at.elastic_rad = Frama_C_float_interval(-1e3f, 1e3f);
    at.wound_Nm = Frama_C_float_interval(-1e6f, 1e6f);
    (void)effect->run(value, own, &at);
  }
}

void prove_step(void) {
  lm_fault fault;
  static lm_saved saved; /* in memory that survives power-down, with any content */
  lm_headroom room;
  lm_conditions at;
  lm_standstill standstill = {0, 0, 0};
  float torque_Nm;
  int i;
  any_parameters(&parameters);
  any_parameters(&other);
  (void)lm_find_needs(&parameters);
  /* What a refused start leaves alone; Eva may carry that case along. */
  memset(&compensator, 0, sizeof compensator);
  compensator.parameters = &parameters;
  if (lm_start_compensator(&compensator, &parameters, any(), &fault) != LM_OK) {
    return;
  }
  for (i = 0; i < 3; ++i) {
    at = any_conditions();
    (void)lm_step_compensator(&compensator, &at);
    lm_watch_output(&compensator, any(), any());
    (void)lm_bound_uncertainty(&compensator);
    lm_declare_memory_unknown(&compensator);
    (void)lm_find_standstill(&compensator, &standstill);
    lm_set_mode(&compensator, (lm_mode)Frama_C_interval(0, 2));
    room.correction_rad = any();
    room.velocity_rad_s = any();
    room.acceleration_rad_s2 = any();
    room.jerk_rad_s3 = any();
    lm_set_headroom(&compensator, Frama_C_nondet(0, 1) ? &room : 0);
  }
  lm_save_compensator(&compensator, &saved);
  saved.memory.plays.torque_Nm = any();
  saved.memory.plays.z_Nm[0] = any();
  saved.crc = lm_find_crc(0, &saved, offsetof(lm_saved, crc));
  (void)lm_restore_compensator(&compensator, &saved, &fault);
  lm_start_model(&memory, any());
  lm_settle_model(&parameters, &memory);
  (void)lm_invert_model(&parameters, &memory, &at, any(), &torque_Nm, &fault);
  /* Last, because with two sets of parameters in sight Eva no longer knows which one it reads. */
  (void)lm_change_parameters(&compensator, &other, &fault);
}

#define BLOB_BYTES 96

void prove_check(void) {
  static lm_parameters anything;
  static uint8_t blob[BLOB_BYTES];
  lm_fault fault;
  uint8_t *bytes = (uint8_t *)&anything;
  unsigned i;
  for (i = 0; i < sizeof anything; ++i) {
    bytes[i] = (uint8_t)Frama_C_interval(0, 255);
  }
  (void)lm_check_parameters(&anything, &fault);
  for (i = 0; i < sizeof blob; ++i) {
    blob[i] = (uint8_t)Frama_C_interval(0, 255);
  }
  (void)lm_load_parameters(&other, blob, (size_t)Frama_C_interval(0, BLOB_BYTES), 0, 0, &fault);
}

static void run_elementary(float x) {
  (void)lm_sine(x);
  (void)lm_cosine(x);
  (void)lm_sine_and_cosine(x);
  (void)lm_exponential(x);
  (void)lm_logarithm(x);
  (void)lm_hyperbolic_tangent(x);
  (void)lm_relaxation(x);
  (void)lm_power(x, Frama_C_float_interval(-10.0f, 10.0f));
}

/* Without NaN: Frama-C 25 keeps a NaN in the branch that a comparison with it cannot take. That no
 * NaN reaches a conversion is proved in esbmc_elementary.c instead. */
void prove_elementary(void) {
  float zero = 0.0f;
  run_elementary(Frama_C_float_interval(-HUGE_NUMBER, HUGE_NUMBER));
  run_elementary(1.0f / zero);
  run_elementary(-1.0f / zero);
}
