/* Where the torque comes from.
 *
 * The model needs the external torque on the output shaft, positive in the direction of a positive
 * output angle. Three sources: a sensor, the motor current (lm_estimate_torque), or nothing but the
 * commanded motion (lm_guess_torque). Everything here is pure but for the one number of memory that
 * lm_guess_torque and lm_hold_torque carry.
 *
 * A sensor does not go straight in: the correction moves the motor, the motor winds the joint up,
 * the sensor sees that, and at the joint's resonance the circle oscillates (that of
 * firmware_examples/joint does with no filter, and with one of 10 Hz or more). So the command gives
 * the torque, and the sensor, slowly, what the command does not know of it:
 *
 *     beyond += share (sensed - commanded - beyond)       a filter as for the current, below;
 *     torque  = commanded + beyond                        a sample that is NaN leaves it alone
 *
 * Torque that is measured, by a sensor or by the current, closes a loop through what the output
 * presses on: the correction takes the joint's compliance away, which softened the contact. With a
 * joint of stiffness K on a stop of stiffness S, and a model whose compliance is r times the
 * drive's, each correction makes r S / (S + K) of itself again. At r = 1 the joint presses like a
 * rigid one; from r = 1 + K / S on it presses harder and harder until a limit ends it: the
 * parameters' torque or correction, or the motor's. Where the output may meet a stop, a workpiece
 * or a person, take the torque from the command, or set LM_MODE_HOLD in contact; and state no
 * larger correction_rad than the load of free motion needs.
 *
 * Torque from the motor current closes a loop: the correction moves the motor, what moves the motor
 * shows in its current, the current makes the torque, and the torque the correction. With a filter
 * on the current between about 5 and 80 Hz that loop can oscillate at a resonance of the joint (the
 * one in firmware_examples/joint does from 10 to 80 Hz), and at standstill the unknown sign of the
 * motor's friction makes noise of the size of that friction. Therefore:
 *   - filter the estimate at a tenth of the lowest resonance or below (2 Hz in that joint, whose
 *     resonance lies at 20 to 30 Hz);
 *   - give lm_estimate_torque the motor's own velocity and acceleration, correction included;
 *   - pass the estimate through lm_hold_torque with lm_bound_torque, so that what is not known at
 *     standstill moves nothing;
 *   - or take the torque from the command: gravity, inertia and lm_guess_torque.
 *
 * A correction that rings all the same is found and slowed (compensator.h). How far it then goes
 * follows from lm_declare_torque_error: of a current, at least lm_bound_torque at speed 0.
 */
#ifndef LOSTMOTION_TORQUE_H
#define LOSTMOTION_TORQUE_H

#include "lostmotion/real.h"
#include "lostmotion/status.h"

LM_BEGIN_DECLS

/* A motor with its gear. Friction numbers are on the motor's side. */
typedef struct lm_motor {
  lm_real torque_constant_Nm_per_A; /* signed; not zero */
  lm_real ratio;                    /* signed; not zero */
  lm_real efficiency;               /* of the gear, 0 < efficiency <= 1 */
  lm_real rotor_inertia_kg_m2;      /* rotor, coupling and wave generator, >= 0 */
  lm_real coulomb_Nm;               /* >= 0 */
  lm_real viscous_Nm_s;             /* >= 0 */
  lm_real standstill_rad_s; /* below this speed friction and efficiency are blended out, > 0 */
} lm_motor;

/* Accepts a motor or states which number has no meaning: each must be within its range above, in
 * size at least 1e-9 where it must not be zero, and at most 1e9. Once, before the functions below,
 * which trust it. Errors: LM_NULL; LM_NOT_FINITE, LM_OUT_OF_RANGE with the field's name (of a
 * signed number the fault tells the size). */
lm_status lm_check_motor(const lm_motor *motor, lm_fault *fault);

/* External torque on the output [N*m] from the motor's current [A], velocity [rad/s] and
 * acceleration [rad/s^2].
 *
 *     rotor    = k i - J a - friction(v)            what reaches the gear, motor side
 *     external = -rotor * ratio * efficiency        where power flows to the load
 *              = -rotor * ratio / efficiency        where the load drives the motor
 *
 * Quasi-static on the output: what the gear delivers, the load takes. At standstill the factor is
 * 1: which way the friction points is not known there, and the torque is uncertain by coulomb_Nm *
 * ratio and by the efficiency. Not finite in, not finite out: the compensator refuses it. */
lm_real lm_estimate_torque(const lm_motor *motor, lm_real current_A, lm_real velocity_rad_s,
                           lm_real acceleration_rad_s2);

/* By how much [N*m, at the output, either way] lm_estimate_torque may be wrong because the motor's
 * friction may point either way at this speed [rad/s]: coulomb_Nm * |ratio| at standstill, falling
 * to nothing at standstill_rad_s. NaN counts as standstill. */
lm_real lm_bound_torque(const lm_motor *motor, lm_real velocity_rad_s);

/* The torque to tell the model where it is known to +-uncertainty [N*m] only: *believed_Nm (memory,
 * starts at 0) moves to the nearest torque that is possible, and not at all while it is possible
 * itself. So noise within the uncertainty, and a friction of unknown sign, move no correction.
 * Where the uncertainty is zero it is the torque. Not finite: *believed_Nm stays; an uncertainty
 * that is negative or NaN counts as zero. */
lm_real lm_hold_torque(lm_real *believed_Nm, lm_real torque_Nm, lm_real uncertainty_Nm);

/* What is known when only the command is: a load that resists motion, and a bias such as gravity.
 */
typedef struct lm_load_guess {
  lm_real friction_Nm;          /* torque with which the load resists, >= 0 */
  lm_real stiffness_Nm_per_rad; /* how soon after a reversal it does so; friction / stiffness is the
                                 * reversal dead band, > 0 */
} lm_load_guess;

/* External torque on the output [N*m] guessed from the command. *resisting_Nm (memory, starts at 0)
 * is the load's resistance: it moves against the commanded output angle with the given stiffness
 * and saturates at +-friction, so that noise and hovering below the dead band do not flip it.
 * moved_rad: by how much the commanded output angle, without correction, has moved since the call
 * before.
 * bias_Nm: what the host knows besides (gravity, 0 if nothing). Not finite: the memory stays. */
lm_real lm_guess_torque(const lm_load_guess *guess, lm_real *resisting_Nm, lm_real moved_rad,
                        lm_real bias_Nm);

LM_END_DECLS

#endif
