#include "lostmotion/effects.h"

#include "runtime/effects/closed_share.h"

enum { PLAY_RAD, RATIO, TAKEUP_NM, VALUES };

/* Play of the coupling between motor and wave generator, seen through the ratio. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  return value[PLAY_RAD] / (2 * value[RATIO]) * closed_share(at->torque_Nm, value[TAKEUP_NM]);
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {"input_coupling_play",
                                    "play of the Oldham coupling in the generator",
                                    "play / (2 ratio) sat(torque/takeup)",
                                    "9 arcsec in all at the output (900 at the input)",
                                    "free_play, wear, thermal_gap",
                                    "read the input angle behind the coupling",
                                    {{"play_rad", LM_VALUE_LINEAR, LM_REAL(0.004)},
                                     {"ratio", LM_VALUE_GIVEN, LM_REAL(100)},
                                     {"takeup_Nm", LM_VALUE_SHAPE, LM_REAL(0.4)}}};
#endif

const lm_effect lm_effect_input_coupling_play = {
    0x43d3d289u,
    LM_EFFECT_ANGLE,
    VALUES,
    0,
    LM_NEEDS_TORQUE,
    run,
    {{LM_REAL(-0.5), LM_REAL(0.5)}, {LM_REAL(1), LM_REAL(1000)}, {LM_REAL(1e-3), LM_REAL(1e4)}},
    LM_EFFECT_CARD(card)};
