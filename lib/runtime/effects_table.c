/* All of the library's effects. A file of its own: a program that does not name the table links
 * none of them but those in its parameters, whatever its linker does with unused sections. */
#include "lostmotion/effects.h"

const lm_effect *const lm_effects[LM_EFFECT_COUNT] = {
    &lm_effect_asymmetric_stiffness,
    &lm_effect_axial_shift,
    &lm_effect_creep,
    &lm_effect_free_play,
    &lm_effect_inertia,
    &lm_effect_input_coupling_play,
    &lm_effect_input_lock_compliance,
    &lm_effect_kinematic_error,
    &lm_effect_kinematic_sideband,
    &lm_effect_load_dependent_friction,
    &lm_effect_lobe_eccentricity,
    &lm_effect_output_eccentricity,
    &lm_effect_output_tilt,
    &lm_effect_ratcheting,
    &lm_effect_sensor_lag,
    &lm_effect_soft_windup,
    &lm_effect_stiffening,
    &lm_effect_stiffness_modulation,
    &lm_effect_stribeck_friction,
    &lm_effect_thermal_drift,
    &lm_effect_thermal_friction,
    &lm_effect_thermal_gap,
    &lm_effect_thermal_stiffness,
    &lm_effect_torque_offset,
    &lm_effect_torque_scale,
    &lm_effect_viscous_friction,
    &lm_effect_wear,
};
