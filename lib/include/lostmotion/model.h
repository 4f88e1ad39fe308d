/* The model on the controller: torque history and conditions in, lost motion out.
 *
 *     T      = clip(torque + torque effects)
 *     s      = 1 + compliance effects
 *     T'     = T + (s - 1) U(T_f) / U'(T_f)     with the envelope U of play.h, T_f = T + the
 *                                               T_e - T of the step before; T' = T if all
 *                                               operators are in series
 *     T_e, h = T + operators(T', memory)        friction in parallel and in series
 *     angle  = s curve(T_e) + h + angle effects
 *
 * Effects in the mesh, where friction acts in parallel, use T_e (wound_Nm); effects in line with
 * the mesh, on the input or at the output, use T (torque_Nm).
 *
 * Sign: a positive external torque on the output gives a positive lost motion,
 * lost_motion = output_angle - input_angle / ratio.
 *
 * In the gap profile the model is one play operator driven by the commanded output angle. Its
 * radius is half the dead band, its weight scales the radius to half the gap:
 *
 *     angle = weight (z - output_angle),   |z - output_angle| <= radius,   weight radius = half gap
 *
 * After a reversal the correction crosses the gap while the command moves by the dead band,
 * 2 radius; an oscillation within the dead band changes it in proportion. If the dead band is
 * smaller than the jitter of the command (dither, noise of a handwheel), the correction crosses the
 * gap with every jitter; if it is wide, up to the whole gap remains uncorrected while the motion
 * after a reversal stays within it. The angle is continuous over several turns: a wrapped angle
 * looks like a reversal. A float angle of 100 rad has a resolution of 1.6 arcsec, which the weight
 * multiplies; lm_shift_angle subtracts whole turns.
 *
 * lm_evaluate_model is pure: it reads one memory and writes another; to commit, copy the struct.
 * lm_step_model does both at once. Nothing here is static; any number of memories may share one set
 * of parameters.
 *
 * Parameters must have passed lm_check_parameters. Conditions may have any value. A torque that is
 * not finite is replaced by the previous torque, including its torque effects. Angles that are NaN
 * or beyond LM_ANGLE_MAX_RAD, and other conditions that are NaN or beyond 1e12, are treated as
 * unknown; an elapsed time below 0 is treated as 0. Torque is clipped at the limit of the
 * parameters; temperature, cycles and input velocity are clipped at the fitted ranges
 * (lm_validity). The result is finite as long as user effects are. Conditions that no active effect
 * declares (LM_NEEDS_) are not read.
 *
 * Cost: constant, plus the cost of the active effects.
 */
#ifndef LOSTMOTION_MODEL_H
#define LOSTMOTION_MODEL_H

#include <stdint.h>

#include "lostmotion/effects.h"
#include "lostmotion/parameters.h"
#include "lostmotion/play.h"

LM_BEGIN_DECLS

/* The complete state of the model of one drive. A plain struct: it can be copied, stored and
 * compared. */
typedef struct lm_memory {
  lm_play_memory plays;
#if LM_EFFECTS_MAX > 0
  lm_real width_scale; /* largest factor on the friction bands since the start */
#endif
#if LM_EFFECT_MEMORY_MAX > 0
  lm_real effect[LM_EFFECT_MEMORY_MAX];
#endif
} lm_memory;

/* The conditions that the active effects of checked parameters need, as LM_NEEDS_ bits of
 * condition_list.h, and the torque (gap profile: the output angle). For parameters that come as a
 * blob: set these fields of lm_conditions in every tick. LM_NEEDS_TIME: the compensator uses the
 * period where elapsed_s is not set. LM_USES_INPUT_VELOCITY: not required. Null: 0. */
uint32_t lm_find_needs(const lm_parameters *parameters);

/* Sets the memory of a drive that has been at rest at a torque [N*m] (gap profile: at a commanded
 * angle): every operator in the middle of its band, the memory of every effect zero. If the
 * operators follow an envelope and the torque is not 0, call lm_settle_model afterwards
 * (lm_center_plays). */
void lm_start_model(lm_memory *memory, lm_real torque_Nm) LM_SIZED(lm_start_model);

/* Makes any memory valid for the parameters: operators are moved into their bands, values that are
 * not finite are reset. For a memory that was restored or comes from other parameters. */
void lm_settle_model(const lm_parameters *parameters, lm_memory *memory);

/* Returns the lost motion [rad] at the conditions, after the history in `memory`, and adds the
 * conditions to it. This is the function of the control loop. */
lm_real lm_step_model(const lm_parameters *parameters, lm_memory *memory, const lm_conditions *at);

/* The same without committing: `memory` is not changed; the history including these conditions is
 * written to `trial`. To accept it, copy: memory = trial. */
lm_real lm_evaluate_model(const lm_parameters *parameters, const lm_memory *memory,
                          lm_memory *trial, const lm_conditions *at);

#if LM_PROFILE != LM_PROFILE_GAP
/* The inverse: the torque [N*m] at which lm_evaluate_model would give `angle_rad`, all other
 * conditions as in `at`. The memory is not changed. Bisection with a fixed number of steps between
 * +-torque limit, then linear interpolation.
 *
 * The torque found differs by at most
 *     2^-23 limit + 8 e (angle + sum c limit) / ((1 - r sum w) s - r sum c)
 * from the exact one, with s the least slope, r the greatest slope of the envelope (1 without one)
 * and e = 6e-8 the rounding (in double 2^-52 and 1.2e-16). The model, including the active effects,
 * must rise strictly with the torque. Errors: LM_NULL, LM_NOT_FINITE ("angle_rad"),
 * LM_OUT_OF_RANGE: no torque within the limit gives that angle (the fault states the range of
 * angles). */
lm_status lm_invert_model(const lm_parameters *parameters, const lm_memory *memory,
                          const lm_conditions *at, lm_real angle_rad, lm_real *torque_Nm,
                          lm_fault *fault);
#endif

/* Runs the model over a whole recording; the settled memory carries the history in and out. Null
 * columns count as not measured; elastic_rad and wound_Nm are not read. Writes angle_rad[count],
 * bit for bit the results of lm_step_model sample by sample. For the desktop: effects run over
 * blocks of samples and use some kB of stack. */
void lm_run_model(const lm_parameters *parameters, lm_memory *memory, const lm_recording *recording,
                  lm_real *angle_rad);

LM_END_DECLS

#endif
