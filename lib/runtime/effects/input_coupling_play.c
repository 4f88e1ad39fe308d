#include "lostmotion/effects.h"

#include "runtime/effects/closed_share.h"

enum { PLAY_RAD, RATIO, TAKEUP_NM, DRAG_NM, BLEND_RAD_S, VALUES };

/* Play of the coupling between motor and wave generator, seen through the ratio. The coupling
 * carries the torque of the load and the drag of the wave generator: with the load against the
 * rotation, or at rest, its side is that of the load. The drag has the sign of the ratio: if that
 * is negative, turning the input forward moves the coupling to its other side. */
static lm_real run(const lm_real *value, lm_real *memory, const lm_conditions *at) {
  (void)memory;
  lm_real drag_Nm = value[DRAG_NM] * closed_share(at->input_velocity_rad_s, value[BLEND_RAD_S]);
  return value[PLAY_RAD] / (2 * value[RATIO]) *
         closed_share(at->torque_Nm - drag_Nm, value[TAKEUP_NM]);
}

#if LM_EFFECT_CARDS
static const lm_effect_card card = {
    "input_coupling_play",
    "play of the Oldham coupling in the wave generator",
    "play / (2 ratio) sat((torque - drag sat(input_velocity/blend))/takeup)",
    "9 arcsec in all at the output (900 at the input)",
    "free_play, wear, thermal_gap",
    "read the input angle behind the coupling; turn both ways at little load",
    {{"play_rad", LM_VALUE_LINEAR, LM_REAL(0.004), LM_VALUE_AS_USUAL},
     {"ratio", LM_VALUE_GIVEN, LM_REAL(100), LM_SCALE_RATIO, {0, 0, 0, 0}, 0u, 0},
     TAKEUP_VALUE(LM_REAL(0.4)),
     {"drag_Nm",
      LM_VALUE_SHAPE,
      LM_REAL(0.4),
      LM_SCALE_RATED_TORQUE,
      {LM_REAL(0.005), LM_REAL(0.02), 0, 0},
      LM_VALUE_SIGN_OF_RATIO,
      0},
     {"blend_rad_s",
      LM_VALUE_FIXED,
      LM_REAL(0.1),
      LM_SCALE_LARGEST_SPEED,
      {LM_REAL(0.02), 0, 0, 0},
      0u,
      "blending speed of the input"}},
    "absorbed by the torsion curve of the baseline",
    LM_NEEDS_INPUT_VELOCITY,
    0};
#endif

const lm_effect lm_effect_input_coupling_play = {0x43d3d289u,
                                                 LM_EFFECT_ANGLE,
                                                 VALUES,
                                                 0,
                                                 LM_NEEDS_TORQUE | LM_USES_INPUT_VELOCITY,
                                                 run,
                                                 {{LM_REAL(0), LM_REAL(0.5)},
                                                  {LM_REAL(1), LM_REAL(1000)},
                                                  {LM_REAL(1e-3), LM_REAL(1e4)},
                                                  {LM_REAL(-1e4), LM_REAL(1e4)},
                                                  {LM_REAL(1e-4), LM_REAL(1e3)}},
                                                 LM_EFFECT_CARD(card)};
