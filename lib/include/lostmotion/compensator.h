/* The compensator: the correction that is added to the commanded output angle.
 *
 *     correction = -lost motion, limited in position, velocity, acceleration and jerk
 *
 * In every tick: fill lm_conditions with the known conditions, call lm_step_compensator, and add
 * `correction_rad` once, to the commanded output angle before the position loop. The output angle
 * that is reported to everything above the loop is the motor's angle / ratio minus the correction.
 * The rates are for a feed-forward that comes from the planner; a drive that derives its
 * feed-forward from the setpoint has them already. Everything else is optional.
 *
 * Guarantees:
 *   - The load memory follows the torque, not the command. Stopping, aborting or replanning a move
 *     loses no history.
 *   - Every change of the correction obeys the limits, including changes of mode and parameters.
 *     Acceleration and jerk never exceed min(limits, headroom). Velocity and position stay within
 *     their limits. If the host narrows the headroom below the present values, they return to it at
 *     the permitted acceleration and jerk. (If jerk / (8 response) is less than the acceleration
 *     limit, it is used instead; likewise acceleration / (2 response) for velocity. This prevents
 *     overshoot.)
 *   - A motion under way ends under the limits that applied when it started. It needs an
 *     acceleration a = max(|acceleration|, 2 response |velocity|) and a jerk of 8 response a. If
 *     new headroom or parameters allow less, these values and the previous response apply until
 *     the motion fits the new limits; LM_STATE_HEADROOM_SHORT is set. Until then position,
 *     velocity, acceleration and jerk, computed as differences of the correction from tick to
 *     tick, exceed neither the old nor the new limits, whichever are wider.
 *   - While no limit is active, a target that moves at a constant rate is followed without lag.
 *   - No input, including NaN and infinity, produces an output that is not finite or out of bounds.
 *     An instance that is null, zeroed or whose start was refused returns a correction of zero
 *     (LM_STATE_NOT_STARTED).
 *
 * The sequence of operation (power-up, closing, braking, homing, power-down) is on the page
 * "Integration"; firmware_examples/axis implements it.
 *
 * Requirements on the host:
 *   - One call in every period_s of the parameters.
 *   - Signs: a positive torque turns the output in the direction of a positive output angle, and
 *     ratio is signed. A wrong sign of the torque, or of the correction where it is added, doubles
 *     the error. The watch detects the first; a commissioning run detects both.
 *   - A measured torque closes a loop through the joint's resonance and through everything that the
 *     output touches. torque.h describes how to use it; `lostmotion export --resonance-Hz` sets how
 *     fast the correction may be. Torque noise reaches the feed-forward: the rms of the
 *     acceleration is up to 64 response^2 (and never more than 6 response / period_s) times the
 *     slope of the torsion curve times the rms of the torque noise.
 *   - The position loop closes on the motor encoder. A loop that closes on an output encoder
 *     corrects the lost motion by itself; an added correction would shift the output by its full
 *     amount. In that case use the model as a feed-forward for motions above the bandwidth of the
 *     loop: the motor's travel across the lost motion at a load reversal, and the ripple of effects
 *     such as kinematic_error. Add velocity_rad_s times ratio to the commanded motor velocity and
 *     acceleration_rad_s2 times ratio to its acceleration, and add nothing to the position
 *     (firmware_examples/output_loop). Both are rates of the output.
 *
 * Ringing. A measured, unfiltered torque can drive the correction into a limit cycle at the joint's
 * resonance. Ringing is detected (LM_STATE_RINGING) when the correction reverses six times in
 * succession by more than 4 noise_rad, each time within less than half a period of ringing_Hz.
 * (Effects such as kinematic_error oscillate independently of the torque and close no loop. With
 * effects that need inputs other than torque, temperature and time, reversals of the filtered
 * torque are counted instead, if they change the torsion curve by that angle.) After detection the
 * correction is reduced by the effect of the torque error, so that the output is no worse than
 * uncompensated for any true torque. It grows through a low-pass filter at a tenth of
 * ringing_Hz, too slow to ring, and does not move for changes of the torque within that error. The
 * host declares the error with lm_declare_torque_error: at standstill the friction of a motor can
 * hide a load that a torque sensor would measure. If no error was declared, the correction goes to
 * zero and the axis is uncompensated. Full, fast correction returns only at the host's request:
 * after LM_MODE_RESET, after lm_change_parameters or after a start. A load that swings against a
 * closed brake looks the same: if the bit appears while the loop is open, clear it before closing.
 * The gap profile takes no torque and never rings.
 *
 * One instance is one struct that the caller owns, a few hundred bytes at most; nothing is static.
 * Not reentrant for one instance: call its functions from one context, or block the tick meanwhile.
 * A slower task may call lm_bound_uncertainty and lm_save_compensator on a copy of the struct that
 * was made while the tick was blocked. If lm_bound_uncertainty on the copy clears
 * LM_STATE_MEMORY_UNKNOWN, call lm_declare_memory_known on the original.
 */
#ifndef LOSTMOTION_COMPENSATOR_H
#define LOSTMOTION_COMPENSATOR_H

#include <stdint.h>

#include "lostmotion/model.h"
#include "lostmotion/parameters.h"
#include "lostmotion/state.h"

LM_BEGIN_DECLS

/* How the correction moves. The load memory is updated in every mode. */
typedef enum lm_mode {
  LM_MODE_RUN = 0,  /* follows the model */
  LM_MODE_HOLD = 1, /* moves to the last target and stays there: contact, probing, system
                       identification. To stop at once, set a headroom of zero */
  LM_MODE_RESET = 2 /* goes to zero and stays there */
} lm_mode;

/* Margins of the axis that the correction may use. Negative or NaN counts as zero; with infinity
 * the limit of the parameters applies. */
typedef struct lm_headroom {
  lm_real correction_rad;
  lm_real velocity_rad_s;
  lm_real acceleration_rad_s2;
  lm_real jerk_rad_s3;
} lm_headroom;

typedef struct lm_correction {
  lm_real correction_rad;      /* to add to the commanded output angle */
  lm_real velocity_rad_s;      /* its rate, for feed-forward */
  lm_real acceleration_rad_s2; /* its acceleration, for feed-forward */
  lm_real lost_motion_rad;     /* present output of the model, neither limited nor faded */
  uint32_t status;             /* LM_STATE_ bits */
} lm_correction;

/* One instance. The fields are for debuggers, not for the host. */
typedef struct lm_compensator {
  const lm_parameters *parameters; /* null: not started */
  lm_memory memory;
  lm_real lost_motion_rad; /* last finite output of the model */
  /* limiter */
  lm_real target_rad;
  lm_real correction_rad;
  lm_real velocity_rad_s;
  lm_real acceleration_rad_s2;
  /* bounds in force: the parameters' limits narrowed by the headroom */
  lm_real correction_max_rad;
  lm_real correction_end_rad; /* never exceeded: the limit, or the previous one until the correction
                                 is within the new */
  lm_real velocity_max_rad_s;
  lm_real acceleration_max_rad_s2;
  lm_real jerk_step_rad_s2; /* change of the acceleration in one tick */
  lm_headroom room;         /* as set by the host */
  /* rates of the limiter's stages */
  lm_real lead_ticks;         /* 1 / (response * period) */
  lm_real velocity_per_s;     /* position to velocity: response */
  lm_real acceleration_per_s; /* velocity to acceleration: 4 response */
  lm_real jerk_share;         /* acceleration to jerk within one tick: 16 response * period */
  /* thresholds of the step */
  lm_real usual_Nm;      /* torque within the fitted range and the limit */
  lm_real settled_rad_s; /* below this speed the correction is at rest */
  /* load range since the history was unknown */
  lm_real lowest_Nm;
  lm_real highest_Nm;
  /* watch */
  lm_real gain; /* 0 to 1 */
  lm_real mean_measured_rad;
  lm_real mean_residual_rad;
  lm_real power_measured_rad2;
  lm_real power_residual_rad2;
  lm_real power_model_rad2; /* of the model, about its mean */
  lm_real level_rad2;       /* of the model, about zero */
  lm_real watched_rad;      /* output of the model at the last call */
  lm_real doubt_s;          /* time for which the correction has increased the error */
  /* ringing */
  lm_real swing_rad;       /* a larger reversal counts */
  lm_real swing_ticks;     /* a reversal after fewer ticks is fast; 0: never */
  lm_real turn_rad;        /* correction at its last reversal */
  uint32_t ticks;          /* since that reversal */
  lm_real slow_rad;        /* filtered target while it rings */
  lm_real unsure_rad;      /* error of the target, */
  lm_real torque_error_Nm; /* for this declared error of the torque */
  int8_t turns;            /* successive reversals; the sign is the direction of the last */
  uint8_t zero_shared;     /* measured lost motion and model share their zero */
  uint16_t watched;        /* number of samples of the watch, up to its maximum */
  uint32_t standing;       /* latched status bits */
#if LM_EFFECTS_MAX > 0
  uint32_t needs;   /* LM_NEEDS_ bits of the active effects */
  lm_real heard_Nm; /* torque, delayed like the correction behind its target */
  lm_real turn_Nm;  /* extreme of that since its last reversal */
  lm_real swing_Nm; /* a return by this much is a reversal */
#endif
} lm_compensator;

/* Starts an instance at a torque [N*m] (gap profile: commanded angle, rad) with correction zero,
 * mode RUN and unknown history: the operators start in the middle of their bands, and
 * lm_bound_uncertainty bounds the resulting error. A torque that is not finite counts as 0, one
 * beyond the limit as the limit. The parameters are checked here and read at every later step; the
 * caller keeps ownership. Errors: LM_NULL and those of lm_check_parameters; then the instance is
 * not started. */
lm_status lm_start_compensator(lm_compensator *compensator, const lm_parameters *parameters,
                               lm_real torque_Nm, lm_fault *fault) LM_SIZED(lm_start_compensator);

/* One step that moves the correction to its target at once, without the limits of velocity and
 * acceleration. Only while the position loop is open: after a start, or if the drive was off and
 * not stepped. In modes HOLD and RESET: to their targets. */
lm_correction lm_settle_compensator(lm_compensator *compensator, const lm_conditions *at);

/* One tick: the model steps, the correction moves. An elapsed_s of 0 or less counts as the period_s
 * of the parameters. Any other value is used by the effects only; the correction always moves by
 * one period. A value that differs from the period by more than half of it sets
 * LM_STATE_PERIOD_WRONG. `at` null: no condition is known. */
lm_correction lm_step_compensator(lm_compensator *compensator, const lm_conditions *at);

/* For the decision to close the loop, to save, or to take a reference at rest: how long the
 * correction has stood. Zero to begin with: `lm_standstill standstill = {0}`; set `ticks`
 * to 0 for every new wait, and when the source of the torque, the mode or the parameters
 * change meanwhile. */
typedef struct lm_standstill {
  lm_real lowest_rad; /* range of the correction since it stands */
  lm_real highest_rad;
  uint32_t ticks; /* since then, this one included; 0: begin again */
} lm_standstill;

/* Seconds for which the correction has stayed within a range of 8 noise_rad and as near to its
 * target (or, at the limit, to that). Call it after every step while you wait. LM_STATE_SETTLED
 * judges a single tick: noise of the torque sets and clears it, and it may be set while a filtered
 * torque still approaches its value. After a standstill of seven time constants of that filter the
 * correction moves by less than noise_rad / 100 more (with the range R and the time constant tau by
 * at most R / (exp(t / tau) - 1) after a time t). lm_hold_torque passes nothing on while its
 * uncertainty hides a change of the torque: seven time constants after the change a thousandth of
 * it may follow. With a filter of a tenth of the resonance for which the parameters were exported
 * they are 28 / response_per_s. A noise of the correction or its target above
 * noise_rad, rms, ends the standstill again and again: filter the torque. Not started: 0.
 * `standstill` must not be null. */
lm_real lm_find_standstill(const lm_compensator *compensator, lm_standstill *standstill);

/* Sets the headroom of the correction from the next step on, until the next call (which may come in
 * every tick). It never widens the limits of the parameters. Null: only those limits. All zero: the
 * correction comes to rest within a few times 1 / response. (A correction_rad of 0 alone moves it
 * to zero.) lm_change_parameters ends the headroom: set it again. */
void lm_set_headroom(lm_compensator *compensator, const lm_headroom *headroom);

/* Sets the mode from the next step on. A value outside the enumeration counts as LM_MODE_RESET.
 * LM_MODE_RESET clears LM_STATE_RINGING, at once; the other modes leave it. */
void lm_set_mode(lm_compensator *compensator, lm_mode mode);

/* Declares the history known: the drive has not been loaded since it was assembled, or the host has
 * just run a full load cycle. */
void lm_declare_memory_known(lm_compensator *compensator);

/* Declares the history up to the last step unknown, as a start does; nothing moves. For a load that
 * the torque did not contain (a stop that was not commanded), and for a torque that becomes known
 * although it has acted all along: call it after every step until it is in use. */
void lm_declare_memory_unknown(lm_compensator *compensator);

/* Largest error [rad, either sign] of the lost motion of torsion curve and friction that the
 * unknown history can cause: at the start, or when it was last declared unknown, every operator may
 * have been anywhere in its band. It shrinks as the load moves, and stays zero once the load has
 * covered a sufficient range; the call that finds this clears LM_STATE_MEMORY_UNKNOWN. Bands
 * widened by temperature count with their largest width since the start. Slow: a few calls a second
 * are enough. */
lm_real lm_bound_uncertainty(lm_compensator *compensator);

/* Changes the parameters without a step in the correction, which moves to the new target within the
 * limits. Operators keep their state as far as the new bands allow. If any band or an effect of the
 * kinds torque and width has changed, the history is unknown again (LM_STATE_MEMORY_UNKNOWN), each
 * operator anywhere in its new band. The limits of the new parameters are the headroom until it is
 * set again. The old parameters are read once more, so the new ones need a separate struct; after
 * the call the old one is free. Slow, like lm_check_parameters. Errors: LM_NULL (also where the
 * instance is not started); those of lm_check_parameters; LM_INCONSISTENT ("period_s": the period
 * of a running loop cannot change; start again). On an error nothing has changed. */
lm_status lm_change_parameters(lm_compensator *compensator, const lm_parameters *parameters,
                               lm_fault *fault);

#if LM_PROFILE == LM_PROFILE_GAP
/* For a joint that turns without end: shifts the commanded angle and the state that depends on it
 * by `by_rad`, without a motion. Call it when the host subtracts turns from its command (by -2 pi,
 * for example), before the step with the new angle. Rounding causes a motion of about 1e-7 rad.
 * (The other profiles accept any number of turns of both angles: effects.h.) Errors: LM_NULL;
 * LM_NOT_FINITE, LM_OUT_OF_RANGE ("by_rad": the angle would exceed the limit of the parameters). On
 * an error nothing has changed. */
lm_status lm_shift_angle(lm_compensator *compensator, lm_real by_rad, lm_fault *fault);
#endif

/* Passes the measured lost motion of the last step to the watch: output_angle - input_angle / ratio
 * [rad], both measured at the same instant and not wrapped, with any constant offset, `elapsed_s`
 * after the previous call. May be called at any rate below that of the tick, while the position
 * loop is closed. (If one encoder is read a time t later, speed times t counts as lost motion.)
 *
 * Over the window of the watch, the mean square of the measured lost motion is compared with that
 * of the residual of the model, both about their means because the offset of the two encoders is
 * unknown. If the second is above misfit_rad^2 and above the first, the correction increases the
 * error. When this has lasted for window_s in total (time counts in proportion to the difference
 * over misfit_rad^2, up to fourfold), the correction fades out over fade_s. It fades in again when
 * it would have halved the mean square for five times as long. An axis at rest gives no
 * information: while the variation of the model is below 2 noise_rad or below a quarter of its
 * level, the gain is kept. Thus a model that fits is not faded because of a small error at rest,
 * and a wrong sign, a wrong drive or a drive that already compensates is detected in the first
 * moves.
 *
 * A fade moves an axis at rest by at most creep_rad_s; while the model moves, it may add as much
 * again. LM_STATE_MISFIT: the rms of the residual is above misfit_rad. Together with a measured
 * lost motion far larger than any correction, it indicates a wrong sign of the ratio.
 *
 * A value that is not finite, or an elapsed_s that is not positive, is ignored and sets
 * LM_STATE_WATCH_REFUSED until the next call. */
void lm_watch_output(lm_compensator *compensator, lm_real lost_motion_rad, lm_real elapsed_s);

/* Declares that the two encoders share their zero: they measure a lost motion of 0 when the drive
 * is not loaded. From then on lm_watch_output takes mean squares about zero, so that a constant
 * error counts too. */
void lm_declare_shared_zero(lm_compensator *compensator);

/* Declares the largest error [N*m, either sign] of the torque input without its noise: for a
 * sensor, its zero and scale; for a motor current, the friction that can hide a load at standstill
 * (lm_bound_torque at speed 0) and what lm_estimate_torque neglects. Before the call, after every
 * start, and if error_Nm is negative or NaN, the error is unknown. Restoring a history and changing
 * parameters keep it. It is used only after ringing was detected (LM_STATE_RINGING). */
void lm_declare_torque_error(lm_compensator *compensator, lm_real error_Nm);

/* The history in a form that can be stored: copy it unchanged to non-volatile memory. */
typedef struct lm_saved {
  uint32_t format;      /* of this struct */
  uint32_t fingerprint; /* of the parameters that it belongs to */
  lm_memory memory;
  lm_real lowest_Nm;
  lm_real highest_Nm;
  uint32_t unknown; /* LM_STATE_MEMORY_UNKNOWN or 0 */
  uint32_t crc;     /* of all before it */
} lm_saved;

/* Saves the history. lm_restore_compensator refuses the history of an instance that was not
 * started. */
void lm_save_compensator(const lm_compensator *compensator, lm_saved *saved);

/* Restores a saved history; the correction keeps its value and then moves within the limits. The
 * load must not have reversed since the history was saved; if it may have, do not restore. The time
 * since then is unknown: creep recovers from its saved value. Errors: LM_NULL, also where the
 * instance is not started; LM_CORRUPT ("crc", "format"); LM_INCONSISTENT ("fingerprint": saved with
 * other parameters). On an error nothing has changed. */
lm_status lm_restore_compensator(lm_compensator *compensator, const lm_saved *saved,
                                 lm_fault *fault);

LM_END_DECLS

#endif
