/* Sources of the torque.
 *
 * The model needs the external torque on the output shaft, positive in the direction of a positive
 * output angle. Three sources: a sensor, the motor current (lm_estimate_torque), or only the
 * commanded motion (lm_guess_torque). All functions are pure, except for one state variable of
 * lm_guess_torque and lm_hold_torque that the caller owns.
 *
 * Do not use a sensor signal directly: the correction moves the motor, the motor winds the joint
 * up, the sensor measures this, and the loop oscillates at the joint's resonance (the loop of
 * firmware_examples/joint does so without a filter and with a filter of 10 Hz or more). Take the
 * torque from the command and add the filtered difference to the sensor:
 *
 *     beyond += share (sensed - commanded - beyond)       skip samples that are not finite
 *     torque  = commanded + beyond                        commanded: gravity minus inertia times
 *                                                         the acceleration of the commanded output;
 *                                                         0 where it is not known
 *     share   = 1 - exp(-2 pi f T)                        f: a tenth of the lowest resonance or
 *                                                         less; T: period. 2 pi f T is close for
 *                                                         a small f T
 *
 * beyond starts at the torque in use minus commanded, so that the torque does not jump when its
 * source changes. firmware_examples/axis does all of this (lm_axis_use_sensor,
 * lm_axis_use_current).
 *
 * A measured torque (sensor or current) also closes a loop through any body in contact with the
 * output: the correction removes the compliance of the joint, which made the contact soft. With a
 * joint of stiffness K on a stop of stiffness S, and a model whose compliance is r times that of
 * the drive, the loop gain is r S / (S + K). At r = 1 the joint acts like a rigid one; from r = 1 +
 * K / S on the contact force grows until it reaches a limit: the torque or correction limit of the
 * parameters, or the motor's torque. If the output may touch a stop, a workpiece or a person, take
 * the torque from the command or set LM_MODE_HOLD in contact, and set correction_rad no larger than
 * free motion needs.
 *
 * Torque from the motor current closes a loop as well: the correction moves the motor, which
 * changes its current, hence the torque estimate and the correction. With a current filter between
 * about 5 and 80 Hz that loop can oscillate at a resonance of the joint (in firmware_examples/joint
 * from 10 to 80 Hz). At standstill the unknown sign of the motor's friction causes noise as large
 * as that friction. Therefore:
 *   - filter the estimate at a tenth of the lowest resonance or below (2 Hz in that joint, whose
 *     resonance lies at 20 to 30 Hz);
 *   - give lm_estimate_torque the measured velocity of the motor shaft, and its commanded
 *     acceleration, correction included (differences of encoder counts are too noisy);
 *   - pass beyond (above) through lm_hold_torque before it is added to the torque of the command,
 *     so that friction of unknown sign at standstill causes no motion. Its uncertainty is
 *     lm_bound_torque through the same filter: the bound falls to zero as soon as the motor moves,
 *     the filtered estimate is right only later. This filter starts at the bound at speed 0, beyond
 *     as above, *believed_Nm at beyond;
 *   - do not use the estimate while a brake holds the motor, nor in the first second after: its
 *     current is zero and the gear still bears the load. Take the torque of the command (gravity at
 *     the commanded angle, which is the reported one while the loop is open) or, if it is not
 *     known, keep that from before;
 *   - or take the torque from the command: gravity, inertia and lm_guess_torque.
 *
 * If the correction rings nevertheless, this is detected and the correction is slowed
 * (compensator.h). Its size then depends on lm_declare_torque_error: for a current, at least
 * lm_bound_torque of the largest load at speed 0.
 */
#ifndef LOSTMOTION_TORQUE_H
#define LOSTMOTION_TORQUE_H

#include "lostmotion/real.h"
#include "lostmotion/status.h"

LM_BEGIN_DECLS

/* A motor with its gear. Friction values refer to the motor side. */
typedef struct lm_motor {
  lm_real torque_constant_Nm_per_A; /* signed; not zero */
  lm_real ratio;                    /* signed; not zero */
  lm_real efficiency;               /* of the gear, 0 < efficiency <= 1 */
  lm_real rotor_inertia_kg_m2;      /* rotor, coupling and wave generator, >= 0 */
  lm_real coulomb_Nm;               /* while it turns, at the usual temperature, >= 0 */
  lm_real viscous_Nm_s;             /* >= 0 */
  lm_real standstill_rad_s; /* below this speed friction and efficiency are faded out, > 0 */
} lm_motor;

/* Checks a motor: each value must be within its range above, at least 1e-9 in magnitude where it
 * must not be zero, and at most 1e9. Call it once; the functions below do not check again. Errors:
 * LM_NULL; LM_NOT_FINITE, LM_OUT_OF_RANGE with the name of the field (for signed values the fault
 * states the magnitude). */
lm_status lm_check_motor(const lm_motor *motor, lm_fault *fault);

/* External torque on the output [N*m] from the motor's current [A], and velocity [rad/s] and
 * acceleration [rad/s^2] of the motor shaft.
 *
 *     rotor    = k i - J a - friction(v)            torque into the gear, motor side
 *     external = -rotor * ratio * efficiency        where power flows to the load
 *              = -rotor * ratio / efficiency        where the load drives the motor
 *
 * Quasi-static on the output: the load torque equals the torque of the gear. At standstill the
 * factor is 1: the direction of friction is unknown there, and the torque is uncertain by
 * lm_bound_torque. Inputs that are not finite give a result that is not
 * finite, which the compensator refuses. */
lm_real lm_estimate_torque(const lm_motor *motor, lm_real current_A, lm_real velocity_rad_s,
                           lm_real acceleration_rad_s2);

/* Largest error [N*m, at the output, either sign] of lm_estimate_torque from the unknown direction
 * of friction, when it has returned torque_Nm at this speed of the motor shaft [rad/s]: at
 * standstill
 *
 *     (coulomb_Nm * |ratio| + |torque_Nm| * (1 - efficiency)) / efficiency
 *
 * falling to zero at standstill_rad_s. A velocity that is NaN counts as standstill. */
lm_real lm_bound_torque(const lm_motor *motor, lm_real torque_Nm, lm_real velocity_rad_s);

/* Returns the torque for the model when it is known only to +-uncertainty [N*m]: *believed_Nm
 * (state; starts at the torque in use before, or at the first torque) is clipped to torque +-
 * uncertainty. Noise within the uncertainty, and friction of unknown sign, therefore do not move
 * the correction. With an uncertainty of zero the result is the torque. A torque that is not finite
 * leaves *believed_Nm unchanged; an uncertainty that is negative or NaN counts as zero. */
lm_real lm_hold_torque(lm_real *believed_Nm, lm_real torque_Nm, lm_real uncertainty_Nm);

/* Load model for use without a torque measurement: a load that resists motion, and a bias such as
 * gravity. */
typedef struct lm_load_guess {
  lm_real friction_Nm;          /* torque with which the load resists motion, >= 0 */
  lm_real stiffness_Nm_per_rad; /* rate at which it builds up after a reversal; friction / stiffness
                                   is the reversal dead band, > 0 */
} lm_load_guess;

/* Estimates the external torque on the output [N*m] from the command. *resisting_Nm (state, starts
 * at 0) is the resistance of the load: it opposes the commanded output angle with the given
 * stiffness and saturates at +-friction, so that noise and small motions within the dead band do
 * not reverse it. moved_rad: change of the commanded output angle, without correction, since the
 * previous call (a shift of the zero by homing is no motion). bias_Nm: other known torque (gravity;
 * 0 if none). Inputs that are not finite leave the state unchanged. */
lm_real lm_guess_torque(const lm_load_guess *guess, lm_real *resisting_Nm, lm_real moved_rad,
                        lm_real bias_Nm);

LM_END_DECLS

#endif
