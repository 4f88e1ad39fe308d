#include "lostmotion/effects.h"

#include "runtime/effects/closed_share.h"

enum { GAP_RAD, EXPONENT, TAKEUP_NM, VALUES };

/* Teeth become thinner with use: a gap that grows as a power of the load cycles, at a decreasing
 * rate during running-in and in proportion after that (Archard). */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  lm_real worn = lm_power(at->cycles * LM_REAL(1e-6), value[EXPONENT]);
  return value[GAP_RAD] * worn * closed_share(at->wound_Nm, value[TAKEUP_NM]);
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "wear",
    "teeth thin with use",
    "gap (cycles / 1e6)^exponent sat(torque/takeup)",
    "8 to 25 arcsec for 1 to 3 um",
    "free_play, input_coupling_play, thermal_gap",
    "the history of the drive; wear does not change with temperature",
    {{"gap_rad", LM_VALUE_LINEAR, LM_REAL(7e-5), LM_VALUE_AS_USUAL},
     {"exponent",
      LM_VALUE_SHAPE,
      LM_REAL(0.5),
      LM_SCALE_NONE,
      {LM_REAL(0.5), LM_REAL(1), 0, 0},
      LM_VALUE_BETWEEN_RUNS,
      0},
     TAKEUP_VALUE(LM_REAL(0.4))},
    LM_CARD_AS_USUAL};
#endif

const lm_effect lm_effect_wear = {
    0x5b5d0404u,
    LM_EFFECT_ANGLE,
    VALUES,
    0,
    LM_NEEDS_TORQUE | LM_NEEDS_CYCLES,
    run,
    {{LM_REAL(-0.05), LM_REAL(0.05)}, {LM_REAL(0.2), LM_REAL(1)}, {LM_REAL(1e-3), LM_REAL(1e4)}},
    LM_EFFECT_CARD(card)};
