#include "drive.h"

#include <string.h>

#include "runtime/as_written.h"

#ifndef DRIVE_EFFECTS
#define DRIVE_EFFECTS 0 /* 1: thermal_gap active; 2: creep as well */
#endif
#ifndef DRIVE_ENVELOPE
#define DRIVE_ENVELOPE 0 /* 1: the operators follow an envelope */
#endif

lm_real draw_number(uint32_t *seed, lm_real low, lm_real high) {
  *seed = *seed * 1664525u + 1013904223u;
  return low + (high - low) * ((lm_real)(*seed >> 8) * LM_REAL(5.9604644775390625e-8)); /* 2^-24 */
}

#if LM_PROFILE == LM_PROFILE_GAP
#define INSIDE 0
#else
#define INSIDE 2
#endif

static int make_plays(lm_parameters *parameters) {
  lm_play play[LM_PLAYS_MAX];
  int32_t i;
  for (i = 0; i < LM_PLAYS_MAX; ++i) {
#if LM_PROFILE == LM_PROFILE_GAP
    play[i].radius_Nm = LM_REAL(1.5e-4); /* rad: half the gap */
    play[i].widening = 0;
    play[i].weight = 1;
#else
    int inside = i >= LM_PLAYS_MAX - INSIDE;
    play[i].radius_Nm = LM_REAL(0.5) + LM_REAL(1.4) * (lm_real)i;
    /* A fit has an envelope; a data sheet has bands that widen. */
    play[i].widening = DRIVE_ENVELOPE ? 0 : play[i].radius_Nm / 80;
    play[i].weight = inside ? LM_REAL(0.05) : LM_REAL(1.6e-5) / LM_PLAYS_MAX;
#endif
  }
  return lm_build_play_bank(&parameters->plays, play, LM_PLAYS_MAX, LM_PLAYS_MAX - INSIDE, 0) !=
         LM_OK;
}

#if LM_PROFILE != LM_PROFILE_GAP
/* Knots at irregular distances, stiffer with load: K1, K2, K3 of the catalogue and a soft
 * beginning. */
#define KNOTS 33
static int make_curve(lm_parameters *parameters) {
  lm_real torque_Nm[KNOTS];
  lm_real angle_rad[KNOTS];
  int i;
  for (i = 0; i < KNOTS; ++i) {
    lm_real side = (lm_real)(i - KNOTS / 2) / (KNOTS / 2);
    lm_real size = side < 0 ? -side : side;
    lm_real torque = 80 * size * (LM_REAL(0.25) + LM_REAL(0.75) * size);
    lm_real angle = torque / 29e3f;
    angle += (torque < 25 ? torque : 25) * LM_REAL(5.5172e-6);
    angle += (torque < 7 ? torque : 7) * LM_REAL(2.25e-5);
    angle += (torque < 1 ? torque : 1) * LM_REAL(5e-5);
    torque_Nm[i] = side < 0 ? -torque : torque;
    angle_rad[i] = side < 0 ? -angle : angle;
  }
  return lm_build_curve(&parameters->curve, torque_Nm, angle_rad, KNOTS, 0) != LM_OK;
}
#endif

#if DRIVE_EFFECTS > 0
/* The most frequent effects of temperature and time: the gap opens, the flexspline creeps. */
static void use_effects(lm_parameters *parameters) {
  parameters->effect[0].effect = &lm_effect_thermal_gap;
  parameters->effect[0].value[0] = LM_REAL(5e-6);
  parameters->effect[0].value[1] = LM_REAL(0.01);
  parameters->effect[0].value[2] = LM_REAL(0.4);
#if DRIVE_EFFECTS > 1
  parameters->effect[1].effect = &lm_effect_creep;
  parameters->effect[1].value[0] = LM_REAL(0.01);
  parameters->effect[1].value[1] = 1;
#endif
  parameters->effect_count = DRIVE_EFFECTS;
  parameters->valid.temperature_C[0] = 10;
  parameters->valid.temperature_C[1] = 50;
}
#endif

int make_drive(lm_parameters *parameters) {
  int failed;
  memset(parameters, 0, sizeof *parameters);
  parameters->format = LM_PARAMETERS_LAYOUT;
  parameters->torque_limit_Nm = 120;
  parameters->limits.period_s = LM_REAL(1e-4);
  parameters->limits.correction_rad = LM_REAL(0.005);
  parameters->limits.velocity_rad_s = LM_REAL(0.05);
  parameters->limits.acceleration_rad_s2 = 20;
  parameters->limits.jerk_rad_s3 = LM_REAL(4e4);
  parameters->limits.response_per_s = 400;
  parameters->watch.window_s = 1;
  parameters->watch.fade_s = 2;
  parameters->watch.noise_rad = LM_REAL(1e-5);
  parameters->watch.misfit_rad = LM_REAL(1e-4);
  failed = make_plays(parameters);
#if LM_PROFILE != LM_PROFILE_GAP
  failed |= make_curve(parameters);
#endif
#if DRIVE_ENVELOPE
  failed |= lm_set_envelope(&parameters->plays, 6, 20, 0) != LM_OK;
#endif
#if DRIVE_EFFECTS > 0
  use_effects(parameters);
#endif
  return failed || lm_check_parameters(parameters, 0) != LM_OK;
}
