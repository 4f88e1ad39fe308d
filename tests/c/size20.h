/* A size 20 drive of ratio 100 for the runtime's tests: catalogue torsion curve (Harmonic Drive,
 * ratio above 50: T1 7, T2 25 N*m, K 16, 25, 29e3 N*m/rad) and the four operators of test set S20
 * of the model specification, section 6. */
#ifndef LOSTMOTION_TESTS_SIZE20_H
#define LOSTMOTION_TESTS_SIZE20_H

#include <string.h>

#include "draw.h"
#include "lostmotion/parameters.h"

static const lm_real size20_torque_Nm[] = {-40, -25, -7, 7, 25, 40};
static const lm_real size20_angle_rad[] = {LM_REAL(-7.0 / 16e3 - 18.0 / 25e3 - 15.0 / 29e3),
                                           LM_REAL(-7.0 / 16e3 - 18.0 / 25e3),
                                           LM_REAL(-7.0 / 16e3),
                                           LM_REAL(7.0 / 16e3),
                                           LM_REAL(7.0 / 16e3 + 18.0 / 25e3),
                                           LM_REAL(7.0 / 16e3 + 18.0 / 25e3 + 15.0 / 29e3)};
static const lm_play size20_play[] = {
    {LM_REAL(0.5), LM_REAL(0.5 / 80), LM_REAL(1.5852218e-6 * 1.5)},
    {LM_REAL(2.0), LM_REAL(2.0 / 80), LM_REAL(1.5852218e-6 * 3.0)},
    {LM_REAL(5.0), LM_REAL(5.0 / 80), LM_REAL(1.5852218e-6 * 5.0)},
    {LM_REAL(10.0), LM_REAL(10.0 / 80), LM_REAL(1.5852218e-6 * 6.0)},
};

static lm_parameters size20(void) {
  lm_parameters p;
  memset(&p, 0, sizeof p);
  p.format = LM_PARAMETERS_LAYOUT;
  p.torque_limit_Nm = 80;
  p.limits.period_s = LM_REAL(1e-3);
  p.limits.correction_rad = LM_REAL(0.004);
  p.limits.velocity_rad_s = LM_REAL(0.1);
  p.limits.acceleration_rad_s2 = 10;
  p.limits.jerk_rad_s3 = LM_REAL(5e3);
  p.limits.response_per_s = 60;
  p.watch.window_s = 1;
  p.watch.fade_s = 2;
  p.watch.noise_rad = LM_REAL(1e-5);
  p.watch.misfit_rad = LM_REAL(2e-4);
  (void)lm_build_curve(&p.curve, size20_torque_Nm, size20_angle_rad, 6, 0);
  (void)lm_build_play_bank(&p.plays, size20_play, 4, 4, 0);
  return p;
}

/* Friction in parallel with the spring instead: shares 0.1 each. */
static void put_friction_inside(lm_parameters *p) {
  lm_play play[4];
  int i;
  for (i = 0; i < 4; ++i) {
    play[i] = size20_play[i];
    play[i].weight = LM_REAL(0.1);
  }
  (void)lm_build_play_bank(&p->plays, play, 4, 0, 0);
}

/* Operators that follow an envelope of the torque: 1.5 times as wide near zero torque. */
static void follow_envelope(lm_parameters *p) {
  (void)lm_set_envelope(&p->plays, 6, 12, 0);
}

/* Appends an effect; one or two values, the rest zero. */
static void add_effect(lm_parameters *p, const lm_effect *effect, lm_real first, lm_real second) {
  lm_effect_use *use = &p->effect[p->effect_count++];
  use->effect = effect;
  use->value[0] = first;
  use->value[1] = second;
}

#endif
