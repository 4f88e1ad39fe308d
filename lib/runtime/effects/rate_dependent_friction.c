#include "runtime/effects/first_order_lag.h"

enum { SHARE, STRIBECK_RAD_PER_S, MEMORY_S, VALUES };

/* Friction of contacts falls with the speed of sliding (Stribeck). Contacts in parallel with the
 * spring slide as the drive winds up: at one rate of the torque they slide faster where the drive
 * is soft. At rest the friction bands have their full width. Friction has a memory: it follows the
 * speed while the contacts slide on (Armstrong-Helouvry et al. 1994), here that of the torsion curve
 * with a first-order lag, by default the time for 10 arc seconds at the typical Stribeck speed. So
 * noise of single samples does not determine it either. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  lm_real lag_s = value[MEMORY_S];
  lm_real speed_rad_per_s = lag_behind(memory, at->elastic_rad, at->elapsed_s, lag_s) / lag_s;
  lm_real fast = speed_rad_per_s / value[STRIBECK_RAD_PER_S];
  return 1 - value[SHARE] * (1 - lm_exponential(-fast * fast));
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "rate_dependent_friction",
    "friction of the hysteresis falls with the speed of winding up",
    "every friction band times 1 - share (1 - exp(-(windup_speed/stribeck)^2))",
    "loops 10 to 20 % narrower in fast loading",
    "sensor_lag, load_dependent_friction, creep",
    "loops of one amplitude at three rates",
    {{"share", LM_VALUE_LINEAR, LM_REAL(0.1), LM_VALUE_AS_USUAL},
     {"stribeck_rad_per_s",
      LM_VALUE_SHAPE,
      LM_REAL(2e-4),
      LM_SCALE_RATED_WINDUP,
      {LM_REAL(0.03), LM_REAL(0.1), LM_REAL(0.3), 0},
      0u,
      "Stribeck speed of winding up"},
     {"memory_s",
      LM_VALUE_FIXED,
      LM_REAL(0.25),
      LM_SCALE_NONE,
      {LM_REAL(0.25), 0, 0, 0},
      0u,
      "time in which friction follows the speed"}},
    LM_CARD_AS_USUAL};
#endif

const lm_effect lm_effect_rate_dependent_friction = {
    0x3432e2d8u,
    LM_EFFECT_WIDTH,
    VALUES,
    LAG_MEMORY,
    LM_NEEDS_TORQUE | LM_NEEDS_TIME,
    run,
    {{0, LM_REAL(0.5)}, {LM_REAL(1e-8), LM_REAL(10)}, {LM_REAL(1e-3), LM_REAL(10)}},
    LM_EFFECT_CARD(card)};
