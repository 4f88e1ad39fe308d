/* The conditions that a host measures and that effects use: the only list of them.
 *
 * effects.h makes the fields of lm_conditions and lm_recording from these rows, model.c and
 * recording.c the code that reads them; Python takes names, order and bits from the structs, and
 * all else from the cards. A new condition is a bit, a row and a card in this file; a FITTED one
 * also needs its range in lm_validity (parameters.h), which changes the binary form.
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
 *                     of its parameters. Code that calls the model directly must set it if creep,
 *                     sensor_lag or rate_dependent_friction is active: at 0, creep does not
 *                     advance, the lagged torque and the speed of winding up do not change
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

#define LM_CONDITION_TURNS 1u  /* effects are drawn over it even if they need the torque too */
#define LM_CONDITION_SMOOTH 2u /* parts of the baseline model may depend on it smoothly */

/* A card for each condition: the fields of lm_condition_card (effects.h) in their order. An effect
 * belongs to the group of the first card here whose condition it needs. Ranges in the unit of the
 * field, for a joint of size 20 with a rated torque of 40 N*m, for which the typical values of the
 * effects are stated. */
#define LM_CONDITION_CARD_LIST(CARD)                                                               \
  CARD(temperature_C, "temperature", "of the drive", "Temperature", 0, 60, 0, 60,                  \
       LM_REAL(-273.15), LM_REAL(1e4), LM_CONDITION_SMOOTH)                                        \
  CARD(cycles, "cycles", "load cycles so far", "Wear", 0, LM_REAL(1e6), 0, LM_REAL(1e6), 0,        \
       LM_REAL(1e15), LM_CONDITION_SMOOTH)                                                         \
  CARD(elapsed_s, "elapsed time", "since the previous sample", "Time", 0, 0, 0, 0, 0, 0, 0u)       \
  CARD(input_velocity_rad_s, "speed", "velocity of the wave generator", "Speed and acceleration",  \
       -30, 30, 0, 30, 0, 0, LM_CONDITION_TURNS | LM_CONDITION_SMOOTH)                             \
  CARD(tilt_moment_Nm, "tilt_moment", "on the output bearing", "Moments and forces on the output", \
       -50, 50, 0, 50, LM_REAL(-1e6), LM_REAL(1e6), LM_CONDITION_SMOOTH)                           \
  CARD(axial_force_N, "axial_force", "on the output bearing", "Moments and forces on the output",  \
       -500, 500, -500, 500, LM_REAL(-1e9), LM_REAL(1e9), LM_CONDITION_SMOOTH)                     \
  CARD(output_acceleration_rad_s2, "acceleration", "of the output shaft",                          \
       "Speed and acceleration", -20, 20, 0, 20, 0, 0, LM_CONDITION_TURNS)                         \
  CARD(input_angle_rad, "input_angle", "angle of the wave generator",                              \
       "Angles of wave generator and output", -LM_PI, LM_PI, 0, LM_PI / 2, LM_REAL(-1e9),          \
       LM_REAL(1e9), LM_CONDITION_TURNS)                                                           \
  CARD(output_angle_rad, "output_angle", "angle of the output shaft; whole turns do not matter",   \
       "Angles of wave generator and output", -LM_PI, LM_PI, 0, LM_PI / 2, LM_REAL(-1e9),          \
       LM_REAL(1e9), LM_CONDITION_TURNS)                                                           \
  CARD(                                                                                            \
      torque_Nm, "torque",                                                                         \
      "external torque on the output shaft, positive in the direction of a positive output angle", \
      "Load", -40, 40, -40, 40, LM_REAL(-1e6), LM_REAL(1e6), 0u)

#endif
