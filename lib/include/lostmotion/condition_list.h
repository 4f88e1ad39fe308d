/* The conditions that a host measures and that effects use: the only list of them.
 *
 * effects.h makes the fields of lm_conditions and lm_recording from these rows, model.c and
 * recording.c the code that reads them; Python takes names, order and bits from the structs. A new
 * condition is a row and its bit here; a FITTED one also needs its range in lm_validity
 * (parameters.h).
 *
 * A row: the field, its bit without LM_NEEDS_, and how the model reads it.
 *   STEP(field, NEED, unknown)        passed with each step: torque, time since the previous step
 *   BOUNDED(field, NEED, most)        beyond +-most it counts as unknown
 *   FITTED(field, NEED, usual, uses)  limited to the fitted range; if unknown, `usual`. `uses`: the
 *                                     LM_USES_ bit of effects that do not require it, or 0
 *   COMMON(field, NEED, usual, uses)  the same, for what most effects need: read outside the path
 *                                     of the rare ones
 *
 *   torque_Nm         external torque on the output shaft; sources: torque.h
 *   input_angle_rad   of the wave generator, wrapped to one turn: beyond LM_ANGLE_MAX_RAD (254
 *                     turns) it counts as unknown, and periodic effects have their value at angle
 *                     zero
 *   output_angle_rad  of the output shaft, wrapped or not; same limit. Gap profile: the only input
 *                     of the model, as commanded and never wrapped (model.h; lm_shift_angle for
 *                     endless rotation)
 *   cycles            load cycles so far
 *   elapsed_s         since the previous sample. The compensator replaces 0 or less by the period
 *                     of its parameters. Code that calls the model directly must set it if creep or
 *                     sensor_lag is active: at 0, creep does not advance and the lagged torque does
 *                     not change
 */
#ifndef LOSTMOTION_CONDITION_LIST_H
#define LOSTMOTION_CONDITION_LIST_H

#include "lostmotion/real.h"

#define LM_REFERENCE_TEMPERATURE_C LM_REAL(20) /* where thermal effects are zero */
#define LM_ANGLE_MAX_RAD LM_REAL(1600) /* input and output angle: a quarter of LM_TURN_MAX_RAD */

/* Value of a condition that the host does not know. A finite number, so that every compiler accepts
 * it; no sensor returns it. */
#define LM_UNKNOWN LM_REAL(3e38)

/* Largest meaningful value of a condition: products with the values of an effect stay in the range
 * of float. */
#define LM_CONDITION_MAX LM_REAL(1e12)

/* Bits of `covariates`, in the order of the rows: the conditions that an effect requires. The model
 * passes these; all others are zero, the temperature is the reference temperature. */
#define LM_NEEDS_TORQUE 1u
#define LM_NEEDS_INPUT_ANGLE 2u
#define LM_NEEDS_OUTPUT_ANGLE 4u
#define LM_NEEDS_INPUT_VELOCITY 8u
#define LM_NEEDS_OUTPUT_ACCELERATION 16u
#define LM_NEEDS_TEMPERATURE 32u
#define LM_NEEDS_CYCLES 64u
#define LM_NEEDS_TILT_MOMENT 128u
#define LM_NEEDS_AXIAL_FORCE 256u
#define LM_NEEDS_TIME 512u
#define LM_USES_INPUT_VELOCITY 1024u /* used if known, not required */

#define LM_CONDITION_LIST(STEP, BOUNDED, FITTED, COMMON)                     \
  STEP(torque_Nm, TORQUE, LM_UNKNOWN)                                        \
  BOUNDED(input_angle_rad, INPUT_ANGLE, LM_ANGLE_MAX_RAD)                    \
  BOUNDED(output_angle_rad, OUTPUT_ANGLE, LM_ANGLE_MAX_RAD)                  \
  FITTED(input_velocity_rad_s, INPUT_VELOCITY, 0, LM_USES_INPUT_VELOCITY)    \
  BOUNDED(output_acceleration_rad_s2, OUTPUT_ACCELERATION, LM_CONDITION_MAX) \
  COMMON(temperature_C, TEMPERATURE, LM_REFERENCE_TEMPERATURE_C, 0u)         \
  FITTED(cycles, CYCLES, 0, 0u)                                              \
  BOUNDED(tilt_moment_Nm, TILT_MOMENT, LM_CONDITION_MAX)                     \
  BOUNDED(axial_force_N, AXIAL_FORCE, LM_CONDITION_MAX)                      \
  STEP(elapsed_s, TIME, 0)

#endif
