/* The simulated joint: motor, reducer, load, encoders. It is independent of the library.
 *
 * The reducer is angle-driven, like a real one: its torque follows from the rotation of the output
 * relative to the motor and from its history.
 *
 *     torque = spring(x) + sum F_i + damping x'      x = output angle - motor angle / ratio
 *     F_i    = clip(F_i + k_i dx, -limit_i, limit_i) Maxwell elements: spring and slider
 *     spring: soft while the radial gap closes, then a hardening cubic
 *
 * The library uses the inverse model, torque-driven, with play operators and straight lines. It
 * does not use the numbers below; its parameters are fitted to measurements of a test bench.
 *
 * Single precision throughout, no libm, semi-implicit Euler steps of PLANT_STEP_S.
 */
#ifndef JOINT_PLANT_H
#define JOINT_PLANT_H

#include <stdint.h>

#define PLANT_RATIO 100
#define PLANT_ENCODER_COUNTS 131072 /* of one motor turn: 17 bits */
#define PLANT_STEP_S 1.25e-4f
#define PLANT_SLIPS 6

typedef struct plant_load {
  float gravity_Nm;   /* weight times lever, with the arm level */
  float inertia_kgm2; /* of the arm with payload */
} plant_load;

typedef struct plant {
  plant_load load;
  float motor_rad; /* motor angle over the ratio */
  float motor_rad_s;
  float twist_rad; /* x: a separate state, because a difference of the angles would lose its digits
                    */
  float output_rad_s;
  float slip_Nm[PLANT_SLIPS];
  float bearing_Nm; /* friction of the output bearing and seals */
  float rotor_Nm;   /* friction of rotor and wave generator, referred to the output */
  float reducer_Nm; /* torque of the reducer */
} plant;

/* At rest, arm hanging, reducer not wound up. */
void plant_start(plant *joint, plant_load load);

/* An external load winds the reducer up by twist_rad and is released slowly: the same position with
 * another history. */
void plant_disturb(plant *joint, float twist_rad);

/* One step with the motor's torque [N*m, referred to the output]. */
void plant_step(plant *joint, float motor_Nm);

/* One step with the motor locked and a torque [N*m] on the arm: the test bench. */
void plant_step_locked(plant *joint, float external_Nm);

/* Sensors of the controller: the motor encoder and, if present, the torque sensor between reducer
 * and arm. */
int32_t plant_read_encoder(const plant *joint);
float plant_read_torque(const plant *joint);

/* True output angle, only for the scores. */
float plant_output(const plant *joint);

#endif
