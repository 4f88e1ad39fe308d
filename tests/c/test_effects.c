#include "lostmotion/effects.h"

#include <math.h>
#include <string.h>

#include "draw.h"
#include "test.h"

#define OF_EFFECT (LM_REAL_BITS == 64 ? 1e-14 : 2e-6) /* relative rounding of a whole effect */

static lm_fault fault;
static lm_conditions at;
static lm_real memory[16];

void setUp(void) {
  memset(&at, 0, sizeof at);
  memset(memory, 0, sizeof memory);
  at.temperature_C = LM_REFERENCE_TEMPERATURE_C;
  seed = 1;
}

/* A torque without any friction. */
static void load(lm_real torque_Nm) {
  at.torque_Nm = torque_Nm;
  at.wound_Nm = torque_Nm;
}

static void draw_conditions(void) {
  load(draw(-50, 50));
  at.input_angle_rad = draw(-3, 3);
  at.output_angle_rad = draw(-3, 3);
  at.input_velocity_rad_s = draw(-100, 100);
  at.temperature_C = draw(-20, 80);
  at.cycles = draw(0, LM_REAL(1e7));
  at.tilt_moment_Nm = draw(-20, 20);
  at.axial_force_N = draw(-100, 100);
  at.output_acceleration_rad_s2 = draw(-10, 10);
  at.elapsed_s = draw(0, 1);
  at.elastic_rad = draw(LM_REAL(-1e-3), LM_REAL(1e-3));
}

static void assert_near(double expected, lm_real found) {
  double difference = fabs((double)found - expected);
  TEST_ASSERT_TRUE(difference <= OF_EFFECT * (fabs(expected) + 1e-5));
}

static double run(const lm_effect *effect, const lm_real *value) {
  TEST_ASSERT_EQUAL(LM_OK, lm_check_effect(effect, value, &fault));
  return (double)effect->run(value, memory, &at);
}

#define ASSERT_RUNS_TO(expected, effect, value) \
  assert_near(expected, (lm_real)run(&lm_effect_##effect, value))

/* CRC-32, bit by bit, of the name: the id that binary parameters carry. */
static uint32_t crc_of(const char *text) {
  uint32_t crc = 0xFFFFFFFFu;
  for (; *text; ++text) {
    int bit;
    crc ^= (uint8_t)*text;
    for (bit = 0; bit < 8; ++bit) {
      crc = (crc & 1u) ? (crc >> 1) ^ 0xEDB88320u : crc >> 1;
    }
  }
  return ~crc;
}

TEST(every_effect_has_a_card_that_is_whole) {
  int i;
  int k;
  for (i = 0; i < LM_EFFECT_COUNT; ++i) {
    const lm_effect *effect = lm_effects[i];
    const lm_effect_card *card = effect->card;
    lm_real typical[LM_EFFECT_VALUES_MAX] = {0};
    TEST_ASSERT_NOT_NULL(card);
    TEST_ASSERT_EQUAL_HEX32(crc_of(card->name), effect->id);
    TEST_ASSERT_TRUE(i == 0 || strcmp(lm_effects[i - 1]->card->name, card->name) < 0);
    TEST_ASSERT_TRUE(strlen(card->mechanism) > 0 && strlen(card->equation) > 0);
    TEST_ASSERT_TRUE(strlen(card->typical_size) > 0 && strlen(card->experiment) > 0);
    TEST_ASSERT_TRUE(strlen(card->confused_with) > 0);
    TEST_ASSERT_TRUE(effect->value_count >= 1 && effect->value_count <= LM_EFFECT_VALUES_MAX);
    TEST_ASSERT_TRUE(effect->covariates != 0);
    for (k = 0; k < LM_EFFECT_VALUES_MAX; ++k) {
      TEST_ASSERT_TRUE((k < effect->value_count) == (card->value[k].name != NULL));
      if (k < effect->value_count) {
        typical[k] = card->value[k].typical;
        TEST_ASSERT_TRUE(effect->bound[k][0] < effect->bound[k][1]);
      }
    }
    TEST_ASSERT_EQUAL(LM_OK, lm_check_effect(effect, typical, &fault));
  }
}

/* Every scale states its reference; start values precede the zeros; only an effect that jumps by a
 * given value and stays has such a value. */
TEST(every_value_states_how_it_is_fitted) {
  int i;
  int k;
  int s;
  for (i = 0; i < LM_EFFECT_COUNT; ++i) {
    const lm_effect *effect = lm_effects[i];
    int given = 0;
    for (k = 0; k < effect->value_count; ++k) {
      const lm_effect_value *value = &effect->card->value[k];
      TEST_ASSERT_TRUE((value->scale == LM_SCALE_RATIO || value->scale == LM_SCALE_TOOTH_ANGLE) <=
                       (value->role == LM_VALUE_GIVEN));
      TEST_ASSERT_TRUE((value->role == LM_VALUE_GIVEN) <= (value->scale != LM_SCALE_NONE));
      TEST_ASSERT_TRUE((value->traits & LM_VALUE_SIGN_OF_FIRST) == 0 || k > 0);
      for (s = 1; s < LM_STARTS_MAX; ++s) {
        TEST_ASSERT_TRUE(value->start[s] == 0 || value->start[s] > value->start[s - 1]);
        TEST_ASSERT_TRUE(value->start[s] == 0 || value->start[s - 1] > 0);
      }
      given += value->role == LM_VALUE_GIVEN;
    }
    TEST_ASSERT_TRUE(!effect->card->steps || given == 1);
    TEST_ASSERT_TRUE(effect->card->told_by == 0 || effect->card->absorbed);
  }
}

/* Confounded effects are named as effects of the library, never the effect itself. */
TEST(twins_are_other_effects) {
  int i;
  for (i = 0; i < LM_EFFECT_COUNT; ++i) {
    const char *name = lm_effects[i]->card->name;
    char twins[200];
    char *twin;
    strncpy(twins, lm_effects[i]->card->confused_with, sizeof twins - 1);
    twins[sizeof twins - 1] = '\0';
    for (twin = strtok(twins, ", "); twin; twin = strtok(NULL, ", ")) {
      TEST_ASSERT_NOT_NULL_MESSAGE(lm_find_effect(lm_effects, LM_EFFECT_COUNT, crc_of(twin)), twin);
      TEST_ASSERT_TRUE(strcmp(twin, name) != 0);
    }
  }
}

/* What an effect returns where it does nothing: a width is a factor. */
static lm_real nothing_of(const lm_effect *effect) {
  return LM_REAL(effect->kind == LM_EFFECT_WIDTH);
}

/* With all linear values zero an effect is off under all conditions. */
TEST(without_amplitude_an_effect_is_nothing) {
  int i;
  int k;
  int trial;
  for (i = 0; i < LM_EFFECT_COUNT; ++i) {
    const lm_effect *effect = lm_effects[i];
    lm_real value[LM_EFFECT_VALUES_MAX];
    int linear = 0;
    for (k = 0; k < effect->value_count; ++k) {
      int is_linear = effect->card->value[k].role == LM_VALUE_LINEAR;
      linear += is_linear;
      value[k] = is_linear ? 0 : effect->card->value[k].typical;
    }
    memset(memory, 0, sizeof memory);
    for (trial = 0; linear > 0 && trial < 50; ++trial) {
      draw_conditions();
      if (effect != &lm_effect_lobe_eccentricity) {
        TEST_ASSERT_TRUE(effect->run(value, memory, &at) == nothing_of(effect));
      }
    }
  }
}

/* Linear means linear: twice every linear value is twice the result. */
TEST(linear_values_are_linear) {
  int i;
  int k;
  for (i = 0; i < LM_EFFECT_COUNT; ++i) {
    const lm_effect *effect = lm_effects[i];
    lm_real once[LM_EFFECT_VALUES_MAX];
    lm_real twice[LM_EFFECT_VALUES_MAX];
    lm_real other[16] = {0};
    int linear = 0;
    int trial;
    for (k = 0; k < effect->value_count; ++k) {
      int is_linear = effect->card->value[k].role == LM_VALUE_LINEAR;
      linear += is_linear;
      once[k] = effect->card->value[k].typical;
      twice[k] = is_linear ? 2 * once[k] : once[k];
    }
    if (linear == 0 || effect == &lm_effect_lobe_eccentricity) {
      continue;
    }
    memset(memory, 0, sizeof memory);
    for (trial = 0; trial < 20; ++trial) {
      draw_conditions();
      lm_real single = effect->run(once, memory, &at) - nothing_of(effect);
      lm_real both = effect->run(twice, other, &at) - nothing_of(effect);
      TEST_ASSERT_TRUE(2 * single == both ||
                       fabs((double)(2 * single - both)) < OF_EFFECT * (double)nothing_of(effect));
    }
  }
}

/* The equations of the cards, computed independently with libm. Conditions are those of a size 20
 * drive of ratio 100. */
TEST(the_periodic_effects_follow_their_equations) {
  static const lm_real four[] = {LM_REAL(3e-5), LM_REAL(-2e-5), LM_REAL(1e-5), LM_REAL(5e-6)};
  double w;
  for (w = -6; w < 6; w += 0.37) {
    double o = 0.3 * w + 0.1;
    at.input_angle_rad = LM_REAL(w);
    at.output_angle_rad = LM_REAL(o);
    at.elastic_rad = LM_REAL(-8e-4);
    load(-20);
    w = (double)at.input_angle_rad;
    o = (double)at.output_angle_rad;
    ASSERT_RUNS_TO(3e-5 * cos(2 * w) - 2e-5 * sin(2 * w) + 1e-5 * cos(4 * w) + 5e-6 * sin(4 * w),
                   kinematic_error, four);
    ASSERT_RUNS_TO(3e-5 * cos(2 * w + 2 * o) - 2e-5 * sin(2 * w + 2 * o) +
                       1e-5 * cos(2 * w - 2 * o) + 5e-6 * sin(2 * w - 2 * o),
                   kinematic_sideband, four);
    ASSERT_RUNS_TO(3e-5 * cos(2 * w) - 2e-5 * sin(2 * w), stiffness_modulation, four);
    ASSERT_RUNS_TO(3e-5 * cos(o) - 2e-5 * sin(o), output_eccentricity, four);
  }
}

/* Torque of a lobe whose teeth come into contact over an angle of g, N m. */
static double carried_by_a_lobe(double angle, double g, double compliance) {
  /* sqrt(angle^2 + g^2) - g */
  double pressed = angle * angle / (sqrt(angle * angle + g * g) + g);
  double size = pressed / (2 * compliance);
  return angle < 0 ? -size : size;
}

/* The angle at which two lobes, one leading and one lagging by runout, carry a torque: by
 * bisection. */
static double angle_of_two_lobes(double torque, double runout, double g, double compliance) {
  double low = -1;
  double high = 1;
  int i;
  for (i = 0; i < 100; ++i) {
    double middle = (low + high) / 2;
    double carried = carried_by_a_lobe(middle + runout, g, compliance) +
                     carried_by_a_lobe(middle - runout, g, compliance);
    *(carried < torque ? &low : &high) = middle;
  }
  return low;
}

TEST(the_lobes_share_the_torque) {
  static const double torques[] = {-40, -5, -0.6, -0.01, 0, 0.003, 0.2, 1, 3, 12, 80};
  static const double takeups[] = {0.05, 2, 60};
  double w;
  int i;
  int k;
  for (w = -3; w < 3; w += 0.37) {
    for (i = 0; i < (int)(sizeof torques / sizeof *torques); ++i) {
      for (k = 0; k < (int)(sizeof takeups / sizeof *takeups); ++k) {
        lm_real lobes[] = {LM_REAL(1e-5),  LM_REAL(2e-5), LM_REAL(8e-5),
                           LM_REAL(-3e-5), LM_REAL(1e-5), LM_REAL(takeups[k])};
        double takeup = (double)lobes[5];
        double torque = (double)LM_REAL(torques[i]);
        double angle = (double)LM_REAL(w);
        double runout = 8e-5 * cos(angle) - 3e-5 * sin(angle);
        at.input_angle_rad = LM_REAL(w);
        load(LM_REAL(torques[i]));
        double equal = angle_of_two_lobes(torque, 0, 1e-5 * takeup, 1e-5);
        double unequal = angle_of_two_lobes(torque, runout, 1e-5 * takeup, 1e-5);
        double expected = 1e-5 * cos(angle) + 2e-5 * sin(angle) + unequal - equal;
        double found = run(&lm_effect_lobe_eccentricity, lobes);
        TEST_ASSERT_TRUE(fabs(found - expected) <= OF_EFFECT * (fabs(equal) + 1e-4));
      }
    }
  }
}

TEST(the_gaps_close_within_their_torque) {
  static const lm_real gap[] = {LM_REAL(2e-5), LM_REAL(0.5)};
  static const lm_real coupling[] = {LM_REAL(0.0044), 100, LM_REAL(0.5), 2, LM_REAL(0.1)};
  static const lm_real thermal[] = {LM_REAL(5e-6), LM_REAL(3e-5), LM_REAL(0.5)};
  static const lm_real wear[] = {LM_REAL(7e-5), LM_REAL(0.5), LM_REAL(0.5)};
  load(LM_REAL(0.25));
  ASSERT_RUNS_TO(1e-5, free_play, gap);
  load(-9);
  ASSERT_RUNS_TO(-2e-5, free_play, gap);
  /* Catalogue: 900 arcsec at the input of a size 20 drive of ratio 100 are +-4.5 at the output. */
  ASSERT_RUNS_TO(-0.0044 / 200, input_coupling_play, coupling);
  /* The drag of rotation determines the coupling's side as long as the load does not exceed it. */
  load(1);
  ASSERT_RUNS_TO(0.0044 / 200, input_coupling_play, coupling);
  at.input_velocity_rad_s = 60;
  ASSERT_RUNS_TO(-0.0044 / 200, input_coupling_play, coupling);
  load(LM_REAL(2.25));
  ASSERT_RUNS_TO(0.0044 / 400, input_coupling_play, coupling);
  at.input_velocity_rad_s = -60;
  load(-1);
  ASSERT_RUNS_TO(0.0044 / 200, input_coupling_play, coupling);
  at.input_velocity_rad_s = 0;
  load(-9);
  at.temperature_C = 30;
  ASSERT_RUNS_TO(-5e-5, thermal_gap, thermal);
  at.temperature_C = 0;
  ASSERT_RUNS_TO(3e-5, thermal_gap, thermal); /* closed completely, not -1e-4 */
  at.cycles = LM_REAL(4e6);
  ASSERT_RUNS_TO(-7e-5 * 2, wear, wear);
  at.cycles = 0;
  ASSERT_RUNS_TO(0, wear, wear);
  at.axial_force_N = 100;
  ASSERT_RUNS_TO(-2e-5 * 100, axial_shift, gap);
}

TEST(the_temperature_acts_on_stiffness_zero_and_friction) {
  static const lm_real rate[] = {LM_REAL(0.005)};
  at.temperature_C = 60;
  at.elastic_rad = LM_REAL(1e-3);
  ASSERT_RUNS_TO(0.005 * 40, thermal_stiffness, rate);
  ASSERT_RUNS_TO(exp(-0.2), thermal_friction, rate);
  {
    static const lm_real drift[] = {LM_REAL(2e-6)};
    ASSERT_RUNS_TO(8e-5, thermal_drift, drift);
  }
  at.temperature_C = LM_REFERENCE_TEMPERATURE_C;
  ASSERT_RUNS_TO(1, thermal_friction, rate);
}

TEST(the_wind_ups_follow_their_equations) {
  static const lm_real soft[] = {LM_REAL(5e-5), 2};
  static const lm_real stiff[] = {LM_REAL(1e-5), 5, LM_REAL(2e-5), 40};
  static const lm_real share[] = {LM_REAL(0.02)};
  static const lm_real lock[] = {1, 100};
  double t;
  for (t = -60; t <= 60; t += 7.3) {
    double size = fabs(t);
    double expected = 1e-5 * (pow(1 + size / 5, 2.0 / 3.0) - 1) - 2e-5 * pow(size / 40, 3);
    load(LM_REAL(t));
    at.elastic_rad = LM_REAL(t / 20e3);
    ASSERT_RUNS_TO(5e-5 * tanh(t / 2), soft_windup, soft);
    ASSERT_RUNS_TO(t < 0 ? -expected : expected, stiffening, stiff);
    ASSERT_RUNS_TO(0.02 * size / 20e3, asymmetric_stiffness, share);
    ASSERT_RUNS_TO(0.02, torque_offset, share);
    ASSERT_RUNS_TO(0.02 * t, torque_scale, share);
    ASSERT_RUNS_TO(t / 1e4, input_lock_compliance, lock);
  }
}

TEST(speed_moment_and_acceleration_act) {
  static const lm_real stribeck[] = {LM_REAL(0.5), LM_REAL(0.4), 5, LM_REAL(0.1)};
  static const lm_real one[] = {LM_REAL(1e-6)};
  double v;
  for (v = -20; v <= 20; v += 1.01) {
    double sign = v / 0.1 > 1 ? 1 : v / 0.1 < -1 ? -1 : v / 0.1;
    at.input_velocity_rad_s = LM_REAL(v);
    at.tilt_moment_Nm = LM_REAL(v);
    at.output_acceleration_rad_s2 = LM_REAL(v);
    ASSERT_RUNS_TO(-sign * (0.5 + 0.4 * exp(-v * v / 25)), stribeck_friction, stribeck);
    ASSERT_RUNS_TO(-1e-6 * v, viscous_friction, one);
    ASSERT_RUNS_TO(1e-6 * v, output_tilt, one);
    ASSERT_RUNS_TO(-1e-6 * v, inertia, one);
  }
}

/* Share ln(1 + t/onset) under constant load, within the stated 0.031 of the elastic angle, at a
 * controller's tick as at a slow logger's; and recovery without load. */
TEST(creep_follows_the_logarithm_and_returns) {
  static const lm_real value[] = {LM_REAL(0.01), 2};
  static const double tick_s[] = {1e-3, 0.5};
  int k;
  for (k = 0; k < 2; ++k) {
    double t = 0;
    double after;
    lm_real crept = 0;
    memset(memory, 0, sizeof memory);
    at.elastic_rad = LM_REAL(1e-3);
    at.elapsed_s = LM_REAL(tick_s[k]);
    while (t < 400) {
      crept = lm_effect_creep.run(value, memory, &at);
      t += tick_s[k];
      if (t > 4) {
        double error = (double)crept / (0.01 * 1e-3) - log(1 + t / 2);
        TEST_ASSERT_TRUE(fabs(error) < 0.06); /* 0.031, and a batch or a tick of delay */
      }
    }
    at.elastic_rad = 0;
    for (after = 0; after < 4000; after += 0.5) {
      at.elapsed_s = LM_REAL(0.5);
      TEST_ASSERT_TRUE(lm_effect_creep.run(value, memory, &at) <= crept);
    }
    TEST_ASSERT_TRUE(lm_effect_creep.run(value, memory, &at) < LM_REAL(0.1) * crept);
  }
}

TEST(load_dependent_friction_makes_a_bow_tie) {
  static const lm_real value[] = {LM_REAL(1e-6), LM_REAL(0.2)};
  lm_real up;
  lm_real t;
  for (t = 0; t <= 40; t += 1) {
    load(t);
    up = lm_effect_load_dependent_friction.run(value, memory, &at);
    assert_near(-0.2e-6 * (double)t, up);
  }
  for (t = 40; t >= 0; t -= 1) {
    load(t);
    up = lm_effect_load_dependent_friction.run(value, memory, &at);
  }
  TEST_ASSERT_TRUE(up == 0);
  load(20);
  lm_effect_load_dependent_friction.run(value, memory, &at);
  load(10);
  assert_near(0.2e-6 * 10, lm_effect_load_dependent_friction.run(value, memory, &at));
}

/* Gaps and springs in the mesh are wound by the torque minus its friction; the input side
 * is in line with the mesh, and teeth slip over at the torque that the whole mesh carries. */
TEST(effects_in_the_mesh_see_what_friction_leaves) {
  static const lm_effect *const mesh[] = {
      &lm_effect_axial_shift, &lm_effect_free_play,  &lm_effect_load_dependent_friction,
      &lm_effect_soft_windup, &lm_effect_stiffening, &lm_effect_lobe_eccentricity,
      &lm_effect_thermal_gap, &lm_effect_wear};
  int i;
  for (i = 0; i < LM_EFFECT_COUNT; ++i) {
    const lm_effect *effect = lm_effects[i];
    lm_real typical[LM_EFFECT_VALUES_MAX];
    lm_real other[16] = {0};
    int in_mesh = 0;
    int k;
    for (k = 0; k < (int)(sizeof mesh / sizeof mesh[0]); ++k) {
      in_mesh |= mesh[k] == effect;
    }
    for (k = 0; k < effect->value_count; ++k) {
      typical[k] = effect->card->value[k].typical;
    }
    memset(memory, 0, sizeof memory);
    at.temperature_C = 30;
    at.axial_force_N = 10;
    at.cycles = LM_REAL(1e6);
    load(LM_REAL(0.1));
    if (effect == &lm_effect_ratcheting) {
      load(300);
    }
    {
      lm_real all = effect->run(typical, memory, &at);
      at.wound_Nm = LM_REAL(0.05);
      TEST_ASSERT_EQUAL_MESSAGE(in_mesh, effect->run(typical, other, &at) != all,
                                effect->card->name);
    }
  }
}

/* A ramp of rate r lags by r * lag; the mirror image is ahead by as much. */
TEST(sensor_lag_shifts_a_ramp) {
  static const lm_real late[] = {LM_REAL(0.005)};
  static const lm_real early[] = {LM_REAL(-0.005)};
  static const lm_real none[] = {0};
  lm_real other[3] = {0};
  lm_real behind = 0;
  lm_real ahead = 0;
  int i;
  at.torque_Nm = LM_REAL(3e-4);
  at.elapsed_s = 0;
  TEST_ASSERT_TRUE(lm_effect_sensor_lag.run(late, memory, &at) == 0);
  TEST_ASSERT_TRUE(lm_effect_sensor_lag.run(early, other, &at) == 0);
  for (i = 1; i < 2000; ++i) {
    at.torque_Nm = LM_REAL(3e-4) + LM_REAL(1e-3) * LM_REAL(1e-4) * LM_REAL(i);
    at.elapsed_s = LM_REAL(1e-4);
    behind = lm_effect_sensor_lag.run(late, memory, &at);
    ahead = lm_effect_sensor_lag.run(early, other, &at);
  }
  assert_near(-5e-6, behind);
  TEST_ASSERT_TRUE(ahead == -behind);
  memset(memory, 0, sizeof memory);
  TEST_ASSERT_TRUE(lm_effect_sensor_lag.run(none, memory, &at) == 0);
  at.elapsed_s = 0;
  TEST_ASSERT_TRUE(lm_effect_sensor_lag.run(none, memory, &at) == 0);
}

/* A lag of a hundredth of a sample is represented as accurately as one of a hundred samples. */
TEST(a_lag_below_one_sample_is_seen_in_full) {
  static const lm_real lag_s[] = {LM_REAL(1e-5), LM_REAL(1e-3), LM_REAL(0.1)};
  int k;
  for (k = 0; k < 3; ++k) {
    lm_real behind = 0;
    int i;
    memset(memory, 0, sizeof memory);
    at.elapsed_s = LM_REAL(0.0078125); /* 2^-7, and torques that a float holds too */
    for (i = 0; i < 4000; ++i) {
      at.torque_Nm = LM_REAL(0.0009765625) * LM_REAL(i);
      behind = lm_effect_sensor_lag.run(&lag_s[k], memory, &at);
    }
    TEST_ASSERT_TRUE(fabs((double)(behind / lag_s[k]) + 0.125) <
                     (LM_REAL_BITS == 64 ? 1e-12 : 1e-6));
  }
}

/* A jump in zero time lags completely, and then decays with the lag's time constant. */
TEST(a_jump_fades_with_the_lag) {
  static const lm_real lag_s[] = {LM_REAL(0.02)};
  at.elapsed_s = LM_REAL(0.01);
  (void)lm_effect_sensor_lag.run(lag_s, memory, &at);
  at.torque_Nm = LM_REAL(1e-3);
  at.elapsed_s = 0;
  assert_near(-1e-3, lm_effect_sensor_lag.run(lag_s, memory, &at));
  at.elapsed_s = LM_REAL(0.01);
  assert_near(-1e-3 * exp(-0.5), lm_effect_sensor_lag.run(lag_s, memory, &at));
}

/* At rest the friction is whole; at the Stribeck speed it falls by 1 - 1/e of the share, in either
 * direction, whatever the torque is; and noise of single samples within the memory does not
 * matter. */
TEST(friction_falls_with_the_speed_of_winding_up) {
  static const lm_real value[] = {LM_REAL(0.25), LM_REAL(0.000244140625) /* 2^-12 */,
                                  LM_REAL(0.05)};
  const lm_effect *effect = &lm_effect_rate_dependent_friction;
  lm_real noisy[16] = {0};
  lm_real factor = 0;
  int side;
  int i;
  for (side = -1; side <= 1; ++side) {
    memset(memory, 0, sizeof memory);
    at.elapsed_s = LM_REAL(0.0078125); /* 2^-7 */
    for (i = 0; i < 400; ++i) {
      at.torque_Nm = LM_REAL(i % 7);
      at.elastic_rad = LM_REAL(1.9073486328125e-6) * LM_REAL(i * side); /* 2^-19 */
      factor = effect->run(value, memory, &at);
      TEST_ASSERT_TRUE(i > 0 || factor == 1);
    }
    assert_near(side ? 1 - 0.25 * (1 - exp(-1)) : 1, factor);
  }
  for (i = 0; i < 400; ++i) {
    at.elastic_rad = LM_REAL(6e-8) * LM_REAL(i % 2);
    factor = effect->run(value, noisy, &at);
    TEST_ASSERT_TRUE(factor > LM_REAL(0.999));
  }
}

TEST(ratcheting_counts_every_peak_once_and_stays) {
  static const lm_real value[] = {240, LM_REAL(0.0311)};
  static const lm_real torque_Nm[] = {0, 239, 241, 260, 235, 241, 0, -300, -250, 0, 250};
  static const int teeth[] = {0, 0, 1, 1, 1, 1, 1, 0, 0, 0, 1};
  int i;
  for (i = 0; i < 11; ++i) {
    load(torque_Nm[i]);
    assert_near(0.0311 * teeth[i], lm_effect_ratcheting.run(value, memory, &at));
  }
}

/* A header and a blob store binary32, and a build of binary64 reads it. */
TEST(a_bound_rounded_to_binary32_is_within) {
  size_t i;
  for (i = 0; i < LM_EFFECT_COUNT; ++i) {
    lm_real value[LM_EFFECT_VALUES_MAX];
    int32_t k;
    int side;
    for (side = 0; side < 2; ++side) {
      for (k = 0; k < lm_effects[i]->value_count; ++k) {
        value[k] = LM_REAL((float)lm_effects[i]->bound[k][side]);
      }
      TEST_ASSERT_EQUAL_MESSAGE(LM_OK, lm_check_effect(lm_effects[i], value, &fault), fault.input);
    }
  }
}

TEST(values_out_of_bounds_are_refused_by_name) {
  lm_real value[] = {LM_REAL(2e-5), 0};
  lm_real zero = 0;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_check_effect(&lm_effect_free_play, value, &fault));
  TEST_ASSERT_EQUAL_STRING("takeup_Nm", fault.input);
  TEST_ASSERT_TRUE(fault.low == LM_REAL(1e-3));
  value[0] = zero / zero;
  TEST_ASSERT_EQUAL(LM_NOT_FINITE, lm_check_effect(&lm_effect_free_play, value, &fault));
  TEST_ASSERT_EQUAL_STRING("gap_rad", fault.input);
  TEST_ASSERT_EQUAL(LM_NULL, lm_check_effect(NULL, value, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_check_effect(&lm_effect_free_play, NULL, &fault));
  TEST_ASSERT_NULL(lm_find_effect(lm_effects, LM_EFFECT_COUNT, 1));
}

/* A user's own effect: a constant of the user's, without a card. */
static lm_real own_run(const lm_real *value, lm_real *own, const lm_conditions *now) {
  own[0] += value[0] * now->torque_Nm;
  return own[0];
}
static const lm_effect own_effect = {7u,      LM_EFFECT_ANGLE, 1,   1, LM_NEEDS_TORQUE,
                                     own_run, {{-1, 1}},       NULL};

TEST(a_users_own_effect_runs_like_the_librarys) {
  static const lm_real torque_Nm[] = {1, 2, 3};
  const lm_effect *table[] = {&lm_effect_wear, &own_effect};
  lm_recording recording;
  lm_real value[] = {LM_REAL(0.5)};
  lm_real result[3];
  memset(&recording, 0, sizeof recording);
  recording.count = 3;
  recording.torque_Nm = torque_Nm;
  TEST_ASSERT_TRUE(lm_find_effect(table, 2, 7u) == &own_effect);
  lm_run_effect(&own_effect, value, memory, &recording, result);
  TEST_ASSERT_TRUE(result[0] == LM_REAL(0.5) && result[2] == 3);
  value[0] = 2;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_check_effect(&own_effect, value, &fault));
  TEST_ASSERT_EQUAL_STRING("value", fault.input);
}

TEST(columns_that_are_missing_are_not_known) {
  static const lm_real column[] = {1, 2};
  lm_recording recording;
  lm_conditions moment;
  memset(&recording, 0, sizeof recording);
  recording.count = 2;
  moment = lm_read_conditions(&recording, 1);
  TEST_ASSERT_TRUE(moment.torque_Nm == 0 && moment.elapsed_s == 0);
  TEST_ASSERT_TRUE(moment.temperature_C == LM_REFERENCE_TEMPERATURE_C);
  recording.temperature_C = column;
  recording.cycles = column;
  moment = lm_read_conditions(&recording, 1);
  TEST_ASSERT_TRUE(moment.temperature_C == 2 && moment.cycles == 2);
  recording.torque_Nm = column;
  TEST_ASSERT_TRUE(lm_read_conditions(&recording, 1).wound_Nm == 2);
  recording.wound_Nm = column;
  TEST_ASSERT_TRUE(lm_read_conditions(&recording, 0).wound_Nm == 1);
}

TEST(unknown_conditions_switch_the_effects_off) {
  static const lm_recording nothing_measured = {0};
  const lm_conditions unknown = lm_read_conditions(&nothing_measured, 0);
  int i;
  for (i = 0; i < LM_EFFECT_COUNT; ++i) {
    const lm_effect *effect = lm_effects[i];
    lm_real typical[LM_EFFECT_VALUES_MAX];
    int k;
    for (k = 0; k < effect->value_count; ++k) {
      typical[k] = effect->card->value[k].typical;
    }
    memset(memory, 0, sizeof memory);
    /* An effect of an angle keeps its value at zero: no angle means that there is none. */
    if (!(effect->covariates & (LM_NEEDS_INPUT_ANGLE | LM_NEEDS_OUTPUT_ANGLE)) &&
        effect != &lm_effect_torque_offset) {
      TEST_ASSERT_TRUE(effect->run(typical, memory, &unknown) == nothing_of(effect));
    }
  }
}
