/* Commissioning: small test motions of one axis that check, before the correction is switched on
 * for the first time, what the compensator assumes (signs, ratio, torque, period, headroom) and
 * report the first fault.
 *
 * The host's position loop runs as it will later, on the motor's encoder, with the correction
 * wired in (or on the encoder at the output, with its rates fed forward: output_loop). The routine
 * replaces the motion planner and the compensator: each tick it receives the host's measurements
 * and returns a command and a correction. The compensator runs in parallel with the host's
 * conditions; its output is not used.
 *
 *     stage      motion                                     what is checked
 *     stand      none, 1 s                                  period, noise and range of the torque,
 *                                                           its sign and scale if it is measured
 *     travel     +travel, back, -travel, back               ratio, encoders, which encoder the loop
 *                                                           closes on; of a current: the velocity,
 *                                                           and whether friction cancels between
 *                                                           the directions (its sign)
 *     pace       a small sine without and with the velocity sign of the velocity that is fed
 *                that is fed forward                        forward
 *     shake      sine of shake_rad at shake_Hz              sign, scale and delay of the torque,
 *                                                           headroom
 *                the same with the torque of the command    sign and scale of the torque feed-forward
 *                fed forward, if it is stated
 *     path       correction of path_rad and back            sign of the correction, added once,
 *                                                           subtracted from the reported angle;
 *                                                           output_loop: neither
 *     sweep      correction of at most 0.5 rad/s2 through   loop from the correction through the
 *                the resonance                              torque back to the correction
 *     rush       a fifth of the largest correction at the   whether the drive follows the
 *                limits of velocity and acceleration        correction at its limits; not where
 *                                                           output_loop is set
 *
 * Bounds: the command stays within travel_rad of the initial position, the correction within a
 * fifth of limits.correction_rad and the limits of the parameters. If the reported angle deviates
 * from the command by more than follow_bound_rad, or the torque from its value at standstill by
 * more than torque_bound_Nm, or an input is not finite, `stop` is set: the host makes an emergency
 * stop (brake), and the correction returns to zero. Otherwise the run ends with the axis at rest
 * in its initial position and zero correction.
 *
 * Requirements: an axis at rest, free to move by travel_rad in both directions, with its usual
 * load. Without an output encoder (LM_UNKNOWN) the ratio and the encoder of the loop are not
 * checked, and the torque only if it is measured: against that of the command, or against
 * motor_torque_Nm; `unchecked` reports this. Both encoders
 * must be latched simultaneously: at the velocity of the shake, a difference of 0.1 ms looks like
 * a delayed torque.
 *
 * C99, no heap, no libm; one struct that the caller owns. Not for the gap profile, which has no
 * torque.
 */
#ifndef COMMISSIONING_H
#define COMMISSIONING_H

#include "lostmotion/runtime.h"

typedef enum commissioning_finding {
  COMMISSIONING_RUNNING = 0,
  COMMISSIONING_NO_FAULT = 1,
  COMMISSIONING_SETTINGS = 2,
  COMMISSIONING_PARAMETERS = 3,
  COMMISSIONING_INPUT = 4,
  COMMISSIONING_CONDITION = 5,
  COMMISSIONING_RANGE = 6,
  COMMISSIONING_PERIOD = 7,
  COMMISSIONING_TORQUE_NOISE = 8,
  COMMISSIONING_FOLLOW = 9,
  COMMISSIONING_TORQUE_BOUND = 10,
  COMMISSIONING_STUCK = 11,
  COMMISSIONING_INPUT_SIGN = 12,
  COMMISSIONING_INPUT_SCALE = 13,
  COMMISSIONING_OUTPUT_STUCK = 14,
  COMMISSIONING_RATIO_SIGN = 15,
  COMMISSIONING_RATIO = 16,
  COMMISSIONING_OUTPUT_LOOP = 17,
  COMMISSIONING_MOTOR_LOOP = 18,
  COMMISSIONING_TORQUE_STUCK = 19,
  COMMISSIONING_TORQUE_SIGN = 20,
  COMMISSIONING_TORQUE_LATE = 21,
  COMMISSIONING_TORQUE_SCALE = 22,
  COMMISSIONING_HEADROOM_SIZE = 23,
  COMMISSIONING_HEADROOM_RATE = 24,
  COMMISSIONING_CORRECTION_MISSING = 25,
  COMMISSIONING_CORRECTION_SIGN = 26,
  COMMISSIONING_CORRECTION_SCALE = 27,
  COMMISSIONING_CORRECTION_ADDED = 28,
  COMMISSIONING_REPORTED = 29,
  COMMISSIONING_TORQUE_LOOP = 30,
  COMMISSIONING_DRIVE_LIMIT = 31,
  COMMISSIONING_ABORTED = 32,
  COMMISSIONING_FEED_SIGN = 33,
  COMMISSIONING_FEED_SCALE = 34,
  COMMISSIONING_VELOCITY = 35,
  COMMISSIONING_FRICTION = 36,
  COMMISSIONING_PACE = 37,
  COMMISSIONING_BRAKE = 38, /* lm_commission.h */
  COMMISSIONING_FINDINGS    /* number of findings */
} commissioning_finding;

/* What could not be checked, as bits: commissioning_unchecked states them. */
#define COMMISSIONING_UNCHECKED_OUTPUT 1u
#define COMMISSIONING_UNCHECKED_TORQUE 2u
#define COMMISSIONING_UNCHECKED_LOOP 4u
#define COMMISSIONING_UNCHECKED_TOOTH 8u
#define COMMISSIONING_UNCHECKED_RATES 16u
#define COMMISSIONING_UNCHECKED_FEED 32u
#define COMMISSIONING_UNCHECKED_BITS 6 /* number of them */

typedef struct commissioning_settings {
  const lm_parameters *parameters;
  lm_headroom headroom;   /* available for the correction during the host's fastest motion */
  float ratio;            /* signed: motor turns per output turn, 1 to 1000 in magnitude */
  float travel_rad;       /* of the output, 1e-3 to 1 */
  float shake_rad;        /* at most travel_rad */
  float shake_Hz;         /* 0.2 to 10, below the bandwidth of the position loop */
  float path_rad;         /* at most a fifth of limits.correction_rad, at least 10 noise_rad */
  float friction_Nm;      /* of the motor, referred to the output, >= 0; a torque from its current
                           * below twice this value may be friction */
  float torque_bound_Nm;  /* > 0 */
  float follow_bound_rad; /* > 0 */
  int32_t output_loop;    /* 1: the position loop closes on the encoder at the output, and only the
                           * rates of the correction are fed forward (needs that encoder); 0 */
} commissioning_settings;

/* Measurements of the host in this tick. LM_UNKNOWN: not measured, where permitted. */
typedef struct commissioning_input {
  float elapsed_s;        /* since the previous tick, by a clock independent of the tick */
  float input_angle_rad;  /* motor's encoder, not divided by the ratio, not wrapped */
  float output_angle_rad; /* encoder at the output, not wrapped; LM_UNKNOWN */
  float reported_rad;     /* output angle that the host reports: input / ratio - correction;
                           * output_loop: that of the encoder at the output */
  float motor_torque_Nm;  /* external torque from the motor current (lm_estimate_torque); LM_UNKNOWN
                           * if there is none, or if it is conditions.torque_Nm */
  float sensed_Nm;    /* external torque as measured, before a filter; LM_UNKNOWN: it is computed */
  float motor_rad_s;  /* of the motor shaft, from which a current's sensed_Nm was computed;
                         LM_UNKNOWN: it is no current */
  float commanded_Nm; /* gravity minus inertia times the acceleration of the command; LM_UNKNOWN */
  lm_conditions conditions; /* as the host passes them to the compensator */
} commissioning_input;

/* Outputs for the host in this tick. */
typedef struct commissioning_output {
  float command_rad;    /* output angle, absolute as reported_rad */
  float velocity_rad_s; /* to be fed forward */
  float acceleration_rad_s2;
  lm_correction correction;      /* instead of the compensator's: angle, velocity, acceleration */
  int32_t stop;                  /* 1: stop as in an emergency, brake */
  commissioning_finding finding; /* other than COMMISSIONING_RUNNING: the run has ended */
  float feed_Nm; /* change of the external torque, to be fed forward against: the second shake */
} commissioning_output;

#define COMMISSIONING_STOPS 4 /* of the travel */
#define COMMISSIONING_SUMS 14

/* One run. The fields are for debuggers. */
typedef struct commissioning {
  commissioning_settings set;
  lm_compensator shadow;
  commissioning_finding finding;
  uint32_t unchecked; /* COMMISSIONING_UNCHECKED_ bits */
  float found;        /* value checked last: a ratio, a gain, seconds */
  int32_t stage;
  int32_t tick; /* of the stage */
  int32_t part; /* of the stage */
  int32_t stop;
  int32_t has_output;
  int32_t has_sensed;
  int32_t sensed; /* and compared with that of the command */
  int32_t started;
  int32_t fed;        /* second shake */
  float unfed_rad[2]; /* error of the loop in the first one; in the first part of PACE */
  float start_rad, input_start_rad, output_start_rad;
  int32_t by_current;
  float turned_rad; /* integral of the velocity over the travel, forth and back */
  float work_J;     /* of sensed_Nm in it */
  float torque_start_Nm, motor_start_Nm, sensed_start_Nm, commanded_start_Nm;
  float stood_rad; /* correction of the parallel compensator at the initial position */
  float command_rad, correction_rad; /* as returned last; the command relative to start_rad */
  float back_rad;                    /* correction at an abort */
  float sum[COMMISSIONING_SUMS];
  float at_command[COMMISSIONING_STOPS];
  float at_input[COMMISSIONING_STOPS];
  float at_output[COMMISSIONING_STOPS];
  float at_model[COMMISSIONING_STOPS];
} commissioning;

/* Settings for an axis: travel 0.05 rad, shake 0.02 rad at 2.5 Hz, path a fifth of the largest
 * correction, no friction, bounds of half the torque limit and a fifth of the travel. Headroom: the
 * parameters'. */
commissioning_settings commissioning_suggest(const lm_parameters *parameters, float ratio);

/* Call before the first tick. Returns the finding for rejected settings or parameters; the first
 * tick returns it too. */
commissioning_finding commissioning_start(commissioning *run,
                                          const commissioning_settings *settings);

/* Call every tick until it returns a finding; further calls return it again, with the axis at
 * rest. */
commissioning_output commissioning_step(commissioning *run, const commissioning_input *now);

/* Stops the run: from the next step on `stop` is set and the finding is COMMISSIONING_ABORTED. */
void commissioning_abort(commissioning *run);

/* One sentence: the fault and what to check. */
const char *commissioning_sentence(commissioning_finding finding);

/* Removes one of the bits and returns a sentence: what was not checked, and how to check it. Null
 * once none is left. */
const char *commissioning_unchecked(uint32_t *bits);

#endif
