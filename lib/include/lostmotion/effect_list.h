/* The only list of the library's effects, in alphabetical order.
 *
 * effects.h declares and counts lm_effect_<name>; effects_table.c makes the table. An effect is a
 * file lib/runtime/effects/<name>.c, which contains everything about it, and a row here.
 */
#ifndef LOSTMOTION_EFFECT_LIST_H
#define LOSTMOTION_EFFECT_LIST_H

#define LM_EFFECT_LIST(EFFECT)    \
  EFFECT(asymmetric_stiffness)    \
  EFFECT(axial_shift)             \
  EFFECT(creep)                   \
  EFFECT(free_play)               \
  EFFECT(inertia)                 \
  EFFECT(input_coupling_play)     \
  EFFECT(input_lock_compliance)   \
  EFFECT(kinematic_error)         \
  EFFECT(kinematic_sideband)      \
  EFFECT(load_dependent_friction) \
  EFFECT(lobe_eccentricity)       \
  EFFECT(output_eccentricity)     \
  EFFECT(output_tilt)             \
  EFFECT(ratcheting)              \
  EFFECT(rate_dependent_friction) \
  EFFECT(sensor_lag)              \
  EFFECT(soft_windup)             \
  EFFECT(stiffening)              \
  EFFECT(stiffness_modulation)    \
  EFFECT(stribeck_friction)       \
  EFFECT(thermal_drift)           \
  EFFECT(thermal_friction)        \
  EFFECT(thermal_gap)             \
  EFFECT(thermal_stiffness)       \
  EFFECT(torque_offset)           \
  EFFECT(torque_scale)            \
  EFFECT(viscous_friction)        \
  EFFECT(wear)

#endif
