/* The model on the controller: torque history and conditions in, lost motion out.
 *
 *     T      = clip(torque + torque effects)
 *     T_e, h = plays(T, memory)                 friction in parallel and in series
 *     angle  = backbone(T_e) + h + angle effects
 *
 * Effects that sit in the mesh, beside its friction, see T_e (wound_Nm); those in line with it, on
 * the input or at the output, see T (torque_Nm).
 *
 * Sign: a positive external torque on the output gives a positive lost motion,
 * lost_motion = output_angle - input_angle / ratio.
 *
 * In the gap profile the model is one play driven by the commanded output angle, of the radius of
 * half the dead band, and with a weight that makes it the half gap:
 *
 *     angle = weight (z - output_angle),   |z - output_angle| <= radius,   weight radius = half gap
 *
 * After a reversal the correction goes from one side of the gap to the other while the command
 * moves by the dead band, 2 radius; a motion to and fro within the dead band changes it in
 * proportion. A dead band below the command's own unrest (dither, noise of a hand wheel) makes the
 * correction cross the gap with it; a wide one leaves up to the whole gap for as long as the motion
 * after a reversal stays within it. The angle continues over turns: one that is wrapped looks like
 * a reversal. A float angle of 100 rad moves in steps of 1.6 arcsec, which the weight enlarges.
 * lm_shift_angle takes turns off.
 *
 * lm_evaluate_model is pure: it reads one memory and writes another; committing is copying the
 * struct. lm_step_model does both at once. Nothing here is static; any number of memories may share
 * one set of parameters.
 *
 * Parameters must have passed lm_check_parameters. Conditions need not make sense: a torque that is
 * not finite counts as the torque before it, torque effects included, angles that are NaN or beyond
 * LM_ANGLE_MAX_RAD and other conditions that are NaN or beyond 1e12 as not known, an elapsed time
 * below 0 as 0; torque is clipped at the limit of the parameters, temperature, cycles and input
 * velocity at the ranges that were fitted (lm_validity). The result is finite as long as user
 * effects are. Conditions that no effect at work declares (LM_NEEDS_) are not read.
 *
 * Cost: constant but for the effects at work, which add their own.
 */
#ifndef LOSTMOTION_MODEL_H
#define LOSTMOTION_MODEL_H

#include <stdint.h>

#include "lostmotion/effects.h"
#include "lostmotion/parameters.h"
#include "lostmotion/play.h"

LM_BEGIN_DECLS

/* All that the model remembers of one drive. A plain struct: copy it, store it, compare it. */
typedef struct lm_memory {
  lm_play_memory plays;
#if LM_EFFECTS_MAX > 0
  lm_real width_scale; /* largest factor on the friction bands since the start */
#endif
#if LM_EFFECT_MEMORY_MAX > 0
  lm_real effect[LM_EFFECT_MEMORY_MAX];
#endif
} lm_memory;

/* The memory of a drive that has rested at a torque [N*m] (the gap profile: at a commanded angle):
 * every play in the middle of its band, every effect's memory zero. Parameters whose operators
 * follow an envelope want lm_settle_model after it where the torque is not 0 (lm_center_plays). */
void lm_start_model(lm_memory *memory, lm_real torque_Nm) LM_SIZED(lm_start_model);

/* Makes any memory fit the parameters: operators pulled into their bands, what is not finite put to
 * rest. For a memory that was restored, or carried over from other parameters. */
void lm_settle_model(const lm_parameters *parameters, lm_memory *memory);

/* Lost motion [rad] at the conditions, after the history in `memory`, which then includes them. The
 * hot path. */
lm_real lm_step_model(const lm_parameters *parameters, lm_memory *memory, const lm_conditions *at);

/* The same without committing: `memory` stays as it was, the history with this moment goes to
 * `trial`. To accept, copy: memory = trial. */
lm_real lm_evaluate_model(const lm_parameters *parameters, const lm_memory *memory,
                          lm_memory *trial, const lm_conditions *at);

#if LM_PROFILE != LM_PROFILE_GAP
/* The inverse: the torque [N*m] at which lm_evaluate_model would give `angle_rad`, all other
 * conditions as in `at`. The memory is left alone. Bisection of a fixed number of steps between
 * +-torque limit, and a straight line in the end.
 *
 * The torque comes back within
 *     2^-23 limit + 8 e (angle + sum c limit) / ((1 - r sum w) s - r sum c)
 * of what went in, with s the least slope, r the envelope's greatest (1 without one) and e the
 * rounding 6e-8 (in double 2^-52 and 1.2e-16), where the model rises strictly; effects at work must
 * keep it rising.
 * Errors: LM_NULL, LM_NOT_FINITE ("angle_rad"), LM_OUT_OF_RANGE: no torque within the limit gives
 * that angle (the fault states which angles there are). */
lm_status lm_invert_model(const lm_parameters *parameters, const lm_memory *memory,
                          const lm_conditions *at, lm_real angle_rad, lm_real *torque_Nm,
                          lm_fault *fault);
#endif

/* A whole recording; the memory, settled, carries the history in and out. Columns of the recording
 * that are null count as not measured, elastic_rad and wound_Nm are not read. Writes
 * angle_rad[count], the bits of lm_step_model sample by sample. For the desktop: effects run over
 * blocks of samples, on some kB of stack. */
void lm_run_model(const lm_parameters *parameters, lm_memory *memory, const lm_recording *recording,
                  lm_real *angle_rad);

LM_END_DECLS

#endif
