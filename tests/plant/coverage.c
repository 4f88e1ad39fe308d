/* coverage BLOB
 *
 * Share of each kind of fault that the checks of the runtime find: the table of the safety note.
 * Every single flipped bit, and random damage, of parameters and of a saved history; every input
 * that is NaN or infinite; skipped ticks; misuse in ordinary duty (duty.h); and flipped bits in a
 * running instance, which are not checked. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "duty.h"
#include "lostmotion/runtime.h"

#define RANDOM_DAMAGE 100000
#define SEEDS 50
#define FLIPS 4000
#define FLIP_TICKS 500

static uint64_t state = 88172645463325252u;

static uint32_t draw(uint32_t below) {
  state ^= state << 13;
  state ^= state >> 7;
  state ^= state << 17;
  return (uint32_t)((state >> 32) % below);
}

static void row(const char *what, long found, long of) {
  printf("| %s | %ld of %ld |\n", what, found, of);
}

/* Up to 8 bits, or a burst of up to 32 bits, each of which changes with a probability of
 * one half. */
static void damage(uint8_t *bytes, size_t length) {
  uint32_t k;
  if (draw(2)) {
    for (k = 2 + draw(7); k > 0; --k) {
      uint32_t at = draw((uint32_t)length * 8);
      bytes[at / 8] ^= (uint8_t)(1u << at % 8);
    }
  } else {
    uint32_t from = draw((uint32_t)length * 8 - 32);
    for (k = 0; k < 32; ++k) {
      bytes[(from + k) / 8] ^= (uint8_t)(draw(2) << (from + k) % 8);
    }
  }
}

static void damaged_parameters(const uint8_t *good, size_t length) {
  static lm_parameters parameters;
  static uint8_t bytes[LM_BLOB_BYTES_MAX];
  long found = 0;
  long tried = 0;
  size_t i;
  for (i = 0; i < 8 * length; ++i) {
    memcpy(bytes, good, length);
    bytes[i / 8] ^= (uint8_t)(1u << i % 8);
    found += lm_load_parameters(&parameters, bytes, length, lm_effects, LM_EFFECT_COUNT, 0) != 0;
  }
  row("parameters, one bit flipped", found, (long)(8 * length));
  for (found = 0, i = 0; i < length; ++i) {
    found += lm_load_parameters(&parameters, good, i, lm_effects, LM_EFFECT_COUNT, 0) != 0;
  }
  row("parameters, cut short", found, (long)length);
  for (found = 0; tried < RANDOM_DAMAGE; ++tried) {
    memcpy(bytes, good, length);
    damage(bytes, length);
    found += memcmp(bytes, good, length) == 0 ||
             lm_load_parameters(&parameters, bytes, length, lm_effects, LM_EFFECT_COUNT, 0) != 0;
  }
  row("parameters, several bits or a burst of 32", found, tried);
}

static void start(lm_compensator *c, const lm_parameters *parameters) {
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  at.torque_Nm = 5;
  at.temperature_C = 20;
  if (lm_start_compensator(c, parameters, at.torque_Nm, 0) != LM_OK) {
    exit(2);
  }
  (void)lm_settle_compensator(c, &at);
}

static void damaged_history(const lm_parameters *parameters) {
  lm_compensator c;
  lm_saved good;
  long found = 0;
  long tried = 0;
  size_t i;
  start(&c, parameters);
  lm_save_compensator(&c, &good);
  for (i = 0; i < 8 * sizeof good; ++i) {
    lm_saved bad = good;
    ((uint8_t *)&bad)[i / 8] ^= (uint8_t)(1u << i % 8);
    found += lm_restore_compensator(&c, &bad, 0) != LM_OK;
  }
  row("saved history, one bit flipped", found, (long)(8 * sizeof good));
  for (found = 0; tried < RANDOM_DAMAGE; ++tried) {
    lm_saved bad = good;
    damage((uint8_t *)&bad, sizeof bad);
    found += memcmp(&bad, &good, sizeof bad) == 0 || lm_restore_compensator(&c, &bad, 0) != LM_OK;
  }
  row("saved history, several bits or a burst of 32", found, tried);
}

static int is_within(const lm_parameters *p, const lm_correction *now) {
  return fabsf(now->correction_rad) <= p->limits.correction_rad &&
         fabsf(now->velocity_rad_s) <= 1.001f * p->limits.velocity_rad_s;
}

static void wrong_inputs(const lm_parameters *parameters) {
  static const float wrong[] = {NAN, INFINITY, -INFINITY};
  lm_compensator c;
  long torque = 0;
  long period = 0;
  long harmless = 0;
  int i;
  start(&c, parameters);
  for (i = 0; i < 3000; ++i) {
    lm_conditions at = LM_CONDITIONS_UNKNOWN;
    lm_correction now;
    at.temperature_C = 20;
    at.torque_Nm = wrong[i % 3];
    now = lm_step_compensator(&c, &at);
    torque += (now.status & LM_STATE_INPUT_REFUSED) != 0;
    harmless += is_within(parameters, &now);
    at.torque_Nm = 5;
    at.temperature_C = wrong[i % 3];
    now = lm_step_compensator(&c, &at);
    harmless += is_within(parameters, &now);
    at.temperature_C = 20;
    at.elapsed_s = (float)(2 + i % 50) * parameters->limits.period_s; /* ticks left out */
    now = lm_step_compensator(&c, &at);
    period += (now.status & LM_STATE_PERIOD_WRONG) != 0;
  }
  row("torque NaN or infinite, reported by a bit", torque, 3000);
  row("torque or temperature NaN or infinite, correction stays in its limits", harmless, 6000);
  row("ticks skipped, `elapsed_s` set", period, 3000);
}

static void misused(const lm_parameters *parameters) {
  static const misuse wrong[] = {{-1, 0}, {2.5, 0}, {1, 1}};
  static const char *const names[] = {"sign of the torque wrong", "torque 2.5 times too large",
                                      "drive compensates already"};
  int i;
  for (i = 0; i < 3; ++i) {
    long found = 0;
    double most_s = 0;
    char what[120];
    unsigned seed;
    for (seed = 1; seed <= SEEDS; ++seed) {
      double first_s = 0;
      found += run_duty(parameters, 1, wrong[i], 1, seed, &first_s) == 1;
      most_s = fmax(most_s, first_s);
    }
    snprintf(what, sizeof what,
             "%s, watch during ordinary duty: faded out within %.0f s of lost motion", names[i],
             10 * ceil(most_s / 10));
    row(what, found, SEEDS);
  }
}

/* The memory of a running instance is not checked; its limiter bounds the effect. */
static void flipped_bits(const lm_parameters *parameters) {
  long within = 0;
  long back = 0;
  long tried;
  for (tried = 0; tried < FLIPS; ++tried) {
    lm_compensator c;
    lm_compensator good;
    lm_correction now = {0, 0, 0, 0, 0};
    lm_correction right = {0, 0, 0, 0, 0};
    /* Except the pointer to the parameters, which is the first member. */
    uint32_t at = draw((uint32_t)(sizeof c - sizeof(void *)) * 8) + (uint32_t)sizeof(void *) * 8;
    int bounded = 1;
    int i;
    start(&c, parameters);
    good = c;
    ((uint8_t *)&c)[at / 8] ^= (uint8_t)(1u << at % 8);
    for (i = 0; i < FLIP_TICKS; ++i) {
      lm_conditions what = LM_CONDITIONS_UNKNOWN;
      what.temperature_C = 20;
      what.torque_Nm = 5 + 30 * sinf(0.01f * (float)i);
      now = lm_step_compensator(&c, &what);
      right = lm_step_compensator(&good, &what);
      bounded = bounded && fabsf(now.correction_rad) <= parameters->limits.correction_rad;
    }
    within += bounded;
    back += fabsf(now.correction_rad - right.correction_rad) < parameters->watch.noise_rad;
  }
  row("a bit flipped in a running instance, correction stays within `correction_rad`", within,
      FLIPS);
  /* In steps of 5 %, because the drawn bits depend on the layout of the struct. */
  printf("| the same, correction valid again after half a second of motion | at least %ld %% |\n",
         back * 20 / FLIPS * 5);
}

int main(int count, char **word) {
  static lm_parameters parameters;
  static uint8_t bytes[LM_BLOB_BYTES_MAX];
  FILE *from = count == 2 ? fopen(word[1], "rb") : 0;
  size_t length;
  if (!from) {
    fprintf(stderr, "coverage BLOB\n");
    return 2;
  }
  length = fread(bytes, 1, sizeof bytes, from);
  fclose(from);
  if (lm_load_parameters(&parameters, bytes, length, lm_effects, LM_EFFECT_COUNT, 0) != LM_OK) {
    fprintf(stderr, "%s: refused\n", word[1]);
    return 2;
  }
  damaged_parameters(bytes, length);
  damaged_history(&parameters);
  wrong_inputs(&parameters);
  misused(&parameters);
  flipped_bits(&parameters);
  return 0;
}
