/* One golden log through model, compensator and every effect, and the hash of all result bits. The
 * program fails unless it is the same on every target, compiler and profile. */
#include <string.h>

#include "drive.h"
#include "runtime/as_written.h"
#include "target.h"

#define SAMPLES 24000
#define EFFECT_SAMPLES 400

/* FNV-1a of the four bytes of a float, least significant first. */
static void add_bits(uint32_t *hash, lm_real value) {
  uint32_t bits;
  int i;
  memcpy(&bits, &value, sizeof bits);
  for (i = 0; i < 4; ++i) {
    *hash = (*hash ^ (bits >> (8 * i) & 0xFFu)) * 16777619u;
  }
}
#define FNV_START 2166136261u

/* The log: torque that varies slowly, reverses, rests, jumps, exceeds the limit and is NaN. */
static lm_real next_torque(uint32_t *seed, lm_real before) {
  lm_real zero = 0;
  uint32_t kind = *seed >> 24;
  if (kind < 4) {
    return kind == 0 ? zero / zero : kind == 1 ? LM_REAL(1e9) : kind == 2 ? -before : zero;
  }
  if (kind < 24) {
    return draw_number(seed, -90, 90);
  }
  if (kind < 96) {
    return before;
  }
  return before + draw_number(seed, -2, 2);
}

static void next_conditions(uint32_t *seed, lm_conditions *at) {
  at->torque_Nm = next_torque(seed, at->torque_Nm);
  if (at->torque_Nm != at->torque_Nm) {
    at->torque_Nm = 0;
  }
  at->input_angle_rad = draw_number(seed, -7, 7);
  at->output_angle_rad = draw_number(seed, -3, 3);
  at->input_velocity_rad_s = draw_number(seed, -100, 100);
  at->output_acceleration_rad_s2 = draw_number(seed, -10, 10);
  at->temperature_C = draw_number(seed, -20, 80);
  at->cycles = draw_number(seed, 0, LM_REAL(1e7));
  at->tilt_moment_Nm = draw_number(seed, -20, 20);
  at->axial_force_N = draw_number(seed, -100, 100);
  at->elapsed_s = LM_REAL(1e-4);
  at->elastic_rad = draw_number(seed, LM_REAL(-2e-3), LM_REAL(2e-3));
  at->wound_Nm = LM_REAL(0.9) * at->torque_Nm;
}

static lm_parameters parameters;
static lm_compensator compensator;

static uint32_t hash_compensator(void) {
  uint32_t hash = FNV_START;
  uint32_t seed = 20;
  lm_conditions at;
  int32_t k;
  memset(&at, 0, sizeof at);
  if (lm_start_compensator(&compensator, &parameters, 0, 0) != LM_OK) {
    return 0;
  }
  for (k = 0; k < SAMPLES; ++k) {
    lm_correction now;
    lm_real torque_Nm = next_torque(&seed, at.torque_Nm);
    next_conditions(&seed, &at);
    at.torque_Nm = torque_Nm;
    lm_set_mode(&compensator, (k & 2047) < 1900 ? LM_MODE_RUN : LM_MODE_HOLD);
    now = lm_step_compensator(&compensator, &at);
    at.torque_Nm = (torque_Nm == torque_Nm) ? torque_Nm : 0;
    add_bits(&hash, now.correction_rad);
    add_bits(&hash, now.velocity_rad_s);
    add_bits(&hash, now.acceleration_rad_s2);
    add_bits(&hash, now.lost_motion_rad);
    hash = (hash ^ now.status) * 16777619u;
    if ((k & 63) == 0) {
      lm_watch_output(&compensator, LM_REAL(1.1) * now.lost_motion_rad, LM_REAL(0.0064));
      add_bits(&hash, lm_bound_uncertainty(&compensator));
    }
  }
  return hash;
}

#if LM_PROFILE != LM_PROFILE_GAP
static uint32_t hash_inverse(void) {
  uint32_t hash = FNV_START;
  uint32_t seed = 30;
  lm_memory memory;
  lm_conditions at;
  int32_t k;
  memset(&at, 0, sizeof at);
  lm_start_model(&memory, 0);
  lm_settle_model(&parameters, &memory);
  for (k = 0; k < EFFECT_SAMPLES; ++k) {
    lm_real torque_Nm = 0;
    at.torque_Nm = draw_number(&seed, -60, 60);
    add_bits(&hash, lm_step_model(&parameters, &memory, &at));
    (void)lm_invert_model(&parameters, &memory, &at,
                          draw_number(&seed, LM_REAL(-1e-3), LM_REAL(1e-3)), &torque_Nm, 0);
    add_bits(&hash, torque_Nm);
  }
  return hash;
}

/* Every effect alone, with values spread between their bounds. */
static uint32_t hash_effects(void) {
  uint32_t hash = FNV_START;
  uint32_t seed = 40;
  int32_t i;
  for (i = 0; i < LM_EFFECT_COUNT; ++i) {
    const lm_effect *effect = lm_effects[i];
    lm_real memory[8] = {0};
    lm_real value[LM_EFFECT_VALUES_MAX];
    lm_conditions at;
    int32_t k;
    memset(&at, 0, sizeof at);
    for (k = 0; k < LM_EFFECT_VALUES_MAX; ++k) {
      value[k] = draw_number(&seed, effect->bound[k][0], effect->bound[k][1]);
    }
    for (k = 0; k < EFFECT_SAMPLES; ++k) {
      next_conditions(&seed, &at);
      add_bits(&hash, effect->run(value, memory, &at));
    }
  }
  return hash;
}

#if LM_EFFECTS_MAX > 0
static void use(const lm_effect *effect, lm_real first, lm_real second) {
  lm_effect_use *next = &parameters.effect[parameters.effect_count++];
  next->effect = effect;
  next->value[0] = first;
  next->value[1] = second;
}

/* One of each kind, with memory and without. */
static void use_effects(void) {
  use(&lm_effect_torque_scale, LM_REAL(0.02), 0);
  use(&lm_effect_viscous_friction, LM_REAL(0.01), 0);
  use(&lm_effect_stiffness_modulation, LM_REAL(0.01), LM_REAL(0.01));
  use(&lm_effect_thermal_friction, LM_REAL(0.02), 0);
  use(&lm_effect_creep, LM_REAL(0.01), LM_REAL(0.05));
  use(&lm_effect_kinematic_error, LM_REAL(5e-5), LM_REAL(2e-5));
  use(&lm_effect_load_dependent_friction, LM_REAL(1e-6), LM_REAL(0.15));
  use(&lm_effect_soft_windup, LM_REAL(5e-5), 2);
}
#endif
#endif

static int check(const char *name, uint32_t found, uint32_t expected) {
  target_print(name);
  target_print_hex(found);
  target_print(found == expected ? " ok\n" : " DIFFERS\n");
  return found != expected;
}

int main(void) {
  int failed;
  if (make_drive(&parameters)) {
    return 2;
  }
#if LM_PROFILE == LM_PROFILE_GAP
  failed = check("gap         ", hash_compensator(), 0x24e0b500u);
#else
  failed = check("compensator ", hash_compensator(), 0xf328c299u);
  failed |= check("inverse     ", hash_inverse(), 0x9c68aabbu);
  failed |= check("effects     ", hash_effects(), 0x08ede1c9u);
#if LM_ENVELOPE
  if (lm_set_envelope(&parameters.plays, 6, 20, 0) != LM_OK) {
    return 2;
  }
  failed |= check("in envelope ", hash_compensator() ^ hash_inverse(), 0x77ca469fu);
  if (lm_set_envelope(&parameters.plays, 0, 1, 0) != LM_OK) {
    return 2;
  }
#endif
#if LM_EFFECTS_MAX > 0
  use_effects();
  failed |= check("with effects", hash_compensator(), 0x205897b4u);
#endif
#endif
  return failed;
}
