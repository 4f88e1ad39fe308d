/* Any sequence of calls with any numbers on a checked drive: every result is finite, within the
 * limits, and the same for the same calls. The first byte selects drive and effects. */
#include <stdlib.h>
#include <string.h>

#include "fuzz_input.h"
#include "lostmotion/runtime.h"
#include "tally.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Half of the numbers are arbitrary bits, half have a realistic size. */
static lm_real next_number(fuzz_input *from, lm_real size) {
  uint8_t kind = take_byte(from);
  if (kind & 1u) {
    lm_real any = 0;
    if (from->size >= sizeof any) {
      memcpy(&any, from->data, sizeof any);
      from->data += sizeof any;
      from->size -= sizeof any;
    }
    return any;
  }
  return size * (lm_real)((int)take_byte(from) - 128) / 128;
}

static void require(int holds) {
  if (!holds) {
    abort();
  }
}

static void make_drive(lm_parameters *p, uint8_t choice) {
  static const lm_real torque_Nm[] = {-60, -25, -7, -1, 1, 7, 25, 60};
  static const lm_real angle_rad[] = {LM_REAL(-2.6e-3), LM_REAL(-1.3e-3), LM_REAL(-5e-4),
                                      LM_REAL(-1e-4),   LM_REAL(1e-4),    LM_REAL(5e-4),
                                      LM_REAL(1.3e-3),  LM_REAL(2.6e-3)};
  static const lm_play play[] = {{LM_REAL(0.5), 0, LM_REAL(2e-6)},
                                 {3, LM_REAL(0.05), LM_REAL(4e-6)},
                                 {2, LM_REAL(0.02), LM_REAL(0.1)},
                                 {8, LM_REAL(0.1), LM_REAL(0.2)}};
  int i;
  memset(p, 0, sizeof *p);
  p->format = LM_PARAMETERS_LAYOUT;
  p->torque_limit_Nm = 80;
  p->limits.period_s = LM_REAL(1e-3);
  p->limits.correction_rad = LM_REAL(0.003);
  p->limits.velocity_rad_s = LM_REAL(0.1);
  p->limits.acceleration_rad_s2 = 10;
  p->limits.jerk_rad_s3 = LM_REAL(5e3);
  p->limits.response_per_s = 60;
  p->watch.window_s = 1;
  p->watch.fade_s = 2;
  p->watch.noise_rad = LM_REAL(1e-5);
  p->watch.misfit_rad = LM_REAL(2e-4);
  p->watch.creep_rad_s = LM_REAL(1e-4);
  p->watch.ringing_Hz = choice & 1u ? 10 : 0;
  p->valid.torque_Nm = choice & 2u ? 40 : 0;
  p->valid.temperature_C[0] = choice & 4u ? 10 : 0;
  p->valid.temperature_C[1] = choice & 4u ? 50 : 0;
  require(lm_build_curve(&p->curve, torque_Nm, angle_rad, 8, 0) == LM_OK);
  require(lm_build_play_bank(&p->plays, play, 4, 2, 0) == LM_OK);
  /* Effects by groups, in the order of their kinds; values a hundredth of their way up. */
  for (i = 0; i < 3 * LM_EFFECT_COUNT; ++i) {
    const lm_effect *effect = lm_effects[i % LM_EFFECT_COUNT];
    int used = ((choice >> 1) + (i % LM_EFFECT_COUNT)) % 8 == 0;
    if ((int)effect->kind == i / LM_EFFECT_COUNT && used) {
      lm_effect_use *use = &p->effect[p->effect_count++];
      int k;
      use->effect = effect;
      for (k = 0; k < effect->value_count; ++k) {
        use->value[k] =
            effect->bound[k][0] + (effect->bound[k][1] - effect->bound[k][0]) * LM_REAL(0.51);
      }
    }
  }
  require(lm_check_parameters(p, 0) == LM_OK);
}

/* Equal numbers; -0 equals 0, because the edge of a band at rest may change one into the other. */
static int is_same(const lm_memory *a, const lm_memory *b) {
  lm_real one[sizeof *a / sizeof(lm_real)];
  lm_real two[sizeof *a / sizeof(lm_real)];
  size_t i;
  memcpy(one, a, sizeof one);
  memcpy(two, b, sizeof two);
  for (i = 0; i < sizeof one / sizeof one[0]; ++i) {
    if (!(one[i] == two[i])) {
      return 0;
    }
  }
  return 1;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  static lm_parameters parameters[2];
  static lm_compensator one;
  static lm_compensator two;
  fuzz_input from;
  from.data = data;
  from.size = size;
  make_drive(&parameters[0], take_byte(&from));
  make_drive(&parameters[1], take_byte(&from));
  require(lm_start_compensator(&one, &parameters[0], next_number(&from, 20), 0) == LM_OK);
  two = one;
  while (from.size > 0) {
    lm_conditions at;
    lm_correction now;
    lm_correction again;
    lm_headroom room;
    lm_saved saved;
    lm_mode mode;
    count_one("calls");
    switch (take_byte(&from) & 15u) {
      case 0:
        mode = (lm_mode)(take_byte(&from) & 3u);
        lm_set_mode(&one, mode);
        lm_set_mode(&two, mode);
        break;
      case 1:
        room.correction_rad = next_number(&from, LM_REAL(0.01));
        room.velocity_rad_s = next_number(&from, 1);
        room.acceleration_rad_s2 = next_number(&from, 20);
        room.jerk_rad_s3 = next_number(&from, LM_REAL(1e4));
        lm_set_headroom(&one, &room);
        lm_set_headroom(&two, &room);
        break;
      case 2:
        require(lm_change_parameters(&one, &parameters[take_byte(&from) & 1u], 0) == LM_OK);
        require(lm_change_parameters(&two, one.parameters, 0) == LM_OK);
        break;
      case 3:
        room.correction_rad = next_number(&from, LM_REAL(0.01));
        room.velocity_rad_s = next_number(&from, LM_REAL(0.1));
        lm_watch_output(&one, room.correction_rad, room.velocity_rad_s);
        lm_watch_output(&two, room.correction_rad, room.velocity_rad_s);
        require(one.gain >= 0 && one.gain <= 1);
        break;
      case 4: {
        lm_real bound = lm_bound_uncertainty(&one);
        require(bound >= 0 && bound < 1);
        two.standing = one.standing;
        break;
      }
      case 5:
        lm_save_compensator(&one, &saved);
        require(lm_restore_compensator(&one, &saved, 0) == LM_OK);
        require(is_same(&one.memory, &saved.memory));
        break;
      case 6:
        room.correction_rad = next_number(&from, 50);
        lm_declare_torque_error(&one, room.correction_rad);
        lm_declare_torque_error(&two, room.correction_rad);
        if (room.correction_rad < 0) {
          lm_declare_memory_unknown(&one);
          lm_declare_memory_unknown(&two);
        }
        require(one.unsure_rad >= 0);
        break;
      default:
        at.torque_Nm = next_number(&from, 100);
        at.input_angle_rad = next_number(&from, 7);
        at.output_angle_rad = next_number(&from, 7);
        at.input_velocity_rad_s = next_number(&from, 100);
        at.output_acceleration_rad_s2 = next_number(&from, 10);
        at.temperature_C = next_number(&from, 100);
        at.cycles = next_number(&from, LM_REAL(1e7));
        at.tilt_moment_Nm = next_number(&from, 20);
        at.axial_force_N = next_number(&from, 100);
        at.elapsed_s = next_number(&from, LM_REAL(0.01));
        at.elastic_rad = 0;
        at.wound_Nm = 0;
        if (take_byte(&from) < 8) {
          now = lm_settle_compensator(&one, &at);
          again = lm_settle_compensator(&two, &at);
        } else {
          now = lm_step_compensator(&one, &at);
          again = lm_step_compensator(&two, &at);
        }
        require(memcmp(&now, &again, sizeof now) == 0);
        require(now.correction_rad >= -LM_REAL(0.003) && now.correction_rad <= LM_REAL(0.003));
        require(now.velocity_rad_s - now.velocity_rad_s == 0);
        require(now.acceleration_rad_s2 >= -LM_REAL(10.0001) &&
                now.acceleration_rad_s2 <= LM_REAL(10.0001));
        require(now.lost_motion_rad - now.lost_motion_rad == 0);
        break;
    }
  }
  return 0;
}
