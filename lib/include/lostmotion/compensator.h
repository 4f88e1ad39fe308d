/* The compensator: what to add to the commanded output angle so that the output arrives.
 *
 *     correction = -lost motion, limited in position, velocity, acceleration and jerk
 *
 * Once a tick: fill lm_conditions with what is known, call lm_step_compensator, add
 * `correction_rad` to the commanded output angle (or subtract it from the output angle that is
 * computed from the input encoder; command and feedback then agree), and feed `velocity_rad_s`
 * forward. Everything else is optional.
 *
 * Rules it keeps:
 *   - The memory of the load follows the torque, never the command: a stop, an abort or a move that
 *     is planned again loses nothing.
 *   - Every change of the correction, also of mode or parameters, obeys the limits. Acceleration
 *     and jerk never exceed min(limits, headroom) in size; velocity and position stay within theirs
 *     and come back to them, at those rates, where the host narrows the headroom below where they
 *     are. (Where jerk / (8 response) is less than the acceleration limit it takes its place, and
 *     acceleration / (2 response) likewise for velocity: the price for not overshooting.)
 *   - A motion under way ends under the limits that it was made under. Where headroom or new
 *     parameters are too narrow for it (it needs an acceleration a = max(|acceleration|,
 *     2 response |velocity|) and a jerk of 8 response a), they count as that much, with the
 *     response that it was made with, until it fits them; LM_STATE_HEADROOM_SHORT says so. Until
 *     then position, velocity, acceleration and jerk, as differences of the correction from tick
 *     to tick, exceed neither the old limits nor the new ones, whichever are wider.
 *   - While nothing binds, a target that moves at a steady rate is followed without lag.
 *   - No input, NaN and infinity included, makes an output that is not finite or out of bounds. An
 *     instance that is null, zeroed or whose start was refused corrects nothing
 *     (LM_STATE_NOT_STARTED).
 *
 * The order of things:
 *   power-up      lm_start_compensator, lm_restore_compensator where a history was saved
 *   settle        lm_settle_compensator with the conditions as they are, the position loop still
 *                 open: the correction is where it belongs, and nothing has moved
 *   close         the command begins at the reported output angle: measured less correction
 *   run           lm_step_compensator every tick
 *   brake, stop   step on every tick with the torque that the gear bears: the memory must see it.
 *                 To close again: the command begins at the reported output angle
 *   home          LM_MODE_HOLD; a reference is taken of the reported angle, at a correction that
 *                 is at rest (LM_STATE_SETTLED). While LM_STATE_MEMORY_UNKNOWN is set it may be
 *                 off by lm_bound_uncertainty
 *   power-down    brake, step on until the load stands, lm_save_compensator
 *
 * What else it asks of the host:
 *   - A call in every period_s of the parameters.
 *   - Signs as in units: a positive torque turns the output in the direction of a positive output
 *     angle, and ratio is signed. A wrong sign of torque, or of the correction where it is added,
 *     doubles the error; the watch finds the first, a commissioning run both.
 *   - A measured torque closes a loop, by the joint's resonance and by whatever the output touches:
 *     torque.h states how to feed it in, `lostmotion export --resonance-Hz` how fast the correction
 *     may be. Noise of the torque reaches the feed-forward, the acceleration with an rms of up to
 *     64 response^2 (and never 6 response / period_s) times the torsion curve's slope times
 *     that of the torque.
 *   - The position loop closes on the motor's encoder. One that closes on an encoder at the output
 *     corrects the lost motion by itself: with the correction added it stands off by all of it.
 *     There the model serves as a feed-forward of what the loop is too slow for: the motor's way
 *     across the lost motion as the load turns round, and a ripple that effects such as
 *     kinematic_error know. Add velocity_rad_s to the velocity that the motor is commanded and
 *     acceleration_rad_s2 to its acceleration, and nothing to the position
 *     (firmware_examples/output_loop).
 *
 * Ringing. A torque that is measured and not filtered can make the correction a limit cycle, at the
 * joint's resonance. Where the correction swings to and fro by more than 4 noise_rad, six times
 * running, each swing shorter than half a period of ringing_Hz, that is ringing (LM_STATE_RINGING).
 * (Effects such as kinematic_error swing it without the torque, which closes no loop. With effects
 * that need more than torque, temperature and time, the torque has to swing instead, filtered as
 * the correction is, by as much as winds the torsion curve as far.) From then on the correction
 * follows its target through a filter at a tenth of ringing_Hz, which is too slow to ring, and the
 * target is as far nearer to zero as the torque may be wrong. How far that is the host declares
 * (lm_declare_torque_error): the friction of a motor at rest hides in its current what a sensor
 * shows. Where nothing was declared the correction goes to zero, and the axis is as without. It
 * follows fast again, and wholly, after lm_set_mode to another mode and back, lm_change_parameters
 * or a start. The gap profile takes no torque, and never rings.
 *
 * One instance is one struct of the caller's, a few hundred bytes at most; nothing is static. Not
 * reentrant for one instance: call its functions from one context, or hold the tick off meanwhile.
 * A slower task may ask lm_bound_uncertainty and lm_save_compensator of a copy of the struct that
 * was made with the tick held off; what the former finds known has to be declared to the original.
 */
#ifndef LOSTMOTION_COMPENSATOR_H
#define LOSTMOTION_COMPENSATOR_H

#include <stdint.h>

#include "lostmotion/model.h"
#include "lostmotion/parameters.h"
#include "lostmotion/state.h"

LM_BEGIN_DECLS

/* What the correction does. The memory follows the load in every mode. */
typedef enum lm_mode {
  LM_MODE_RUN = 0,  /* follows the model */
  LM_MODE_HOLD = 1, /* continues to the last target and rests there: homing, probing, system
                     * identification. To stop at once: a headroom of zero */
  LM_MODE_RESET = 2 /* goes to zero and stays there */
} lm_mode;

/* What the host has left for the correction. A headroom that is negative or NaN counts as zero;
 * infinity leaves the limit to the parameters. */
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
  lm_real lost_motion_rad;     /* what the model says now, not limited, not faded */
  uint32_t status;             /* LM_STATE_ bits */
} lm_correction;

/* One instance. The fields are for debuggers, not for the host. */
typedef struct lm_compensator {
  const lm_parameters *parameters; /* null: not started */
  lm_memory memory;
  lm_real lost_motion_rad; /* the model's last finite answer */
  /* limiter */
  lm_real target_rad;
  lm_real correction_rad;
  lm_real velocity_rad_s;
  lm_real acceleration_rad_s2;
  /* bounds in force: the parameters' limits narrowed by the headroom */
  lm_real correction_max_rad;
  lm_real
      correction_end_rad; /* never passed: the limit, or an earlier one until it stands within */
  lm_real velocity_max_rad_s;
  lm_real acceleration_max_rad_s2;
  lm_real jerk_step_rad_s2; /* change of the acceleration in one tick */
  lm_headroom room;         /* as it was set */
  /* rates of the limiter's stages */
  lm_real lead_ticks;         /* 1 / (response * period) */
  lm_real velocity_per_s;     /* position to velocity: response */
  lm_real acceleration_per_s; /* velocity to acceleration: 4 response */
  lm_real jerk_share;         /* acceleration to jerk within one tick: 16 response * period */
  /* what the step compares with */
  lm_real usual_Nm;      /* torque within the fitted range and the limit */
  lm_real settled_rad_s; /* slower counts as resting */
  /* range of the load since a start with unknown memory */
  lm_real lowest_Nm;
  lm_real highest_Nm;
  /* watch */
  lm_real gain; /* 0 to 1 */
  lm_real mean_measured_rad;
  lm_real mean_residual_rad;
  lm_real power_measured_rad2;
  lm_real power_residual_rad2;
  lm_real power_model_rad2; /* of the model's swing about its mean */
  lm_real level_rad2;       /* of the model itself */
  lm_real watched_rad;      /* the model at the last call */
  lm_real doubt_s;          /* for how long the correction has done harm */
  /* ringing */
  lm_real swing_rad;       /* a longer one counts */
  uint32_t swing_ticks;    /* and takes less than this where it is fast; 0: none does */
  lm_real turn_rad;        /* where the correction last turned round */
  uint32_t ticks;          /* since then */
  lm_real slow_rad;        /* the target while it rings, filtered */
  lm_real unsure_rad;      /* what the target may be wrong by, */
  lm_real torque_error_Nm; /* where the torque is by this, as declared */
  int8_t turns;            /* swings to and fro in a row; its sign is the direction of the last */
  uint8_t watching;        /* the watch has seen its first sample */
  uint8_t zero_shared;     /* the measured lost motion has the model's zero */
  uint32_t standing;       /* status bits that last */
#if LM_EFFECTS_MAX > 0
  uint32_t needs;   /* LM_NEEDS_ bits of the effects at work */
  lm_real heard_Nm; /* the torque, as late as the correction is behind its target */
  lm_real turn_Nm;  /* as far as that got since it last turned round */
  lm_real swing_Nm; /* coming back by this is a turn */
#endif
} lm_compensator;

/* Starts an instance at a torque [N*m] (the gap profile: commanded angle, rad), correction zero,
 * mode RUN, history unknown: operators in the middle of their bands, the bound on what that may be
 * wrong by is lm_bound_uncertainty. A torque that is not finite counts as 0, one beyond the limit
 * as the limit. Parameters are checked here, read at every step from then on, and stay the
 * caller's. Errors: LM_NULL and those of lm_check_parameters; then the instance is not started. */
lm_status lm_start_compensator(lm_compensator *compensator, const lm_parameters *parameters,
                               lm_real torque_Nm, lm_fault *fault) LM_SIZED(lm_start_compensator);

/* A step after which the correction is at its target at once and rests there, whatever the limits
 * of velocity and acceleration. For an open position loop alone: after a start, or where the drive
 * was off and not stepped. Modes HOLD and RESET: their targets. */
lm_correction lm_settle_compensator(lm_compensator *compensator, const lm_conditions *at);

/* One tick: the model steps, the correction moves. An elapsed_s that is not above 0 counts as the
 * parameters' period_s; another one is the effects' time alone, the correction moves by the period
 * in every tick, and one that is more than half the period off is reported: LM_STATE_PERIOD_WRONG.
 * `at` null: nothing is known. */
lm_correction lm_step_compensator(lm_compensator *compensator, const lm_conditions *at);

/* From the next step on, until it is called again (every tick, if the host likes): the rest, for
 * the correction. Never lifts the parameters' limits. Null: those alone. All zero brings the
 * correction to rest in a few times 1 / response. */
void lm_set_headroom(lm_compensator *compensator, const lm_headroom *headroom);

/* From the next step on. A value outside the enumeration counts as LM_MODE_RESET. A mode other than
 * the one before ends LM_STATE_RINGING. */
void lm_set_mode(lm_compensator *compensator, lm_mode mode);

/* Declares the history known: the load has rested at zero since the drive was assembled, or the
 * host has just driven a full cycle. */
void lm_declare_memory_known(lm_compensator *compensator);

/* How far [rad] the lost motion of torsion curve and friction may be off, either way, because the
 * history before the start is unknown: every play may have stood anywhere in its band. Shrinks as
 * the load moves and is zero, for good, once the load has swept widely enough; the call that finds
 * it so clears LM_STATE_MEMORY_UNKNOWN. Bands that temperature widened count with their widest
 * since the start. Slow work: a few times a second is plenty. */
lm_real lm_bound_uncertainty(lm_compensator *compensator);

/* New parameters without a step in the correction: it moves to the new target within the limits.
 * Operators keep their place as far as the new bands allow. Where any band is another than before,
 * the history is unknown again (LM_STATE_MEMORY_UNKNOWN), each play anywhere in its new band. The
 * headroom is that of the new parameters until it is set again. The old ones are read once more:
 * new ones go to a struct of their own. Slow work, as lm_check_parameters is.
 * Errors: LM_NULL (also where the instance is not started); those of lm_check_parameters;
 * LM_INCONSISTENT ("period_s": the tick of a running loop is what it is; start afresh). Then
 * nothing has changed. */
lm_status lm_change_parameters(lm_compensator *compensator, const lm_parameters *parameters,
                               lm_fault *fault);

#if LM_PROFILE == LM_PROFILE_GAP
/* For a joint that turns endlessly: takes the commanded angle `by_rad` further, and with it all
 * that was learned of it, without a motion. To be called where the host takes turns off its command
 * (by -2 pi, say): before the step that gets the new angle. The rounding of the two is a motion of
 * some 1e-7 rad. (The other profiles take any turn of both angles: effects.h.)
 * Errors: LM_NULL; LM_NOT_FINITE, LM_OUT_OF_RANGE ("by_rad": the angle would leave the limit of the
 * parameters). Then nothing has changed. */
lm_status lm_shift_angle(lm_compensator *compensator, lm_real by_rad, lm_fault *fault);
#endif

/* Tells the compensator what the lost motion really was at the last step: output_angle -
 * input_angle / ratio [rad], both measured and neither wrapped, any constant offset, `elapsed_s`
 * after the call before. At any rate slower than the tick.
 *
 * Compares, over the watch's window, the power of the measured lost motion with that of what the
 * model leaves of it, both about their means: the offset of the two encoders is not known.
 * Where the first is less than the second by more than misfit_rad^2, the correction does harm: once
 * it has done so for window_s in all, a time that counts up to four times where the harm is that
 * many times misfit_rad^2, it fades out over fade_s. It fades in again when it would have taken
 * half the power away for five times as long. A standing axis tells nothing: while the model's own
 * swing is below 2 noise_rad or below a quarter of its level, the gain stays what it is. So a model
 * that fits is not faded for a small error at rest, and a wrong sign, a wrong drive or a drive that
 * compensates already is found in the first moves.
 *
 * A fade moves a standing axis by at most creep_rad_s; while the model moves, it may add that much
 * again. LM_STATE_MISFIT: the residual's rms is above misfit_rad. That, with a measured lost motion
 * far beyond any correction, is what a wrong sign of the ratio looks like.
 *
 * Not finite, or elapsed_s not positive: ignored, LM_STATE_WATCH_REFUSED until the next call. */
void lm_watch_output(lm_compensator *compensator, lm_real lost_motion_rad, lm_real elapsed_s);

/* Declares that the two encoders share a zero: a lost motion of 0 is measured where the drive is
 * not loaded. From then on lm_watch_output counts powers about zero, so that what stands counts
 * too. */
void lm_declare_shared_zero(lm_compensator *compensator);

/* Declares by how much [N*m] the torque that is told may be wrong, either way, once its noise is
 * averaged out: of a sensor its zero and scale; of a motor current the friction that may hide a
 * load at standstill (lm_bound_torque at speed 0), and what lm_estimate_torque leaves out. Until
 * then, after every start, and where error_Nm is negative or NaN, nothing is known of it. Read
 * where the correction rang (LM_STATE_RINGING), and nowhere else. */
void lm_declare_torque_error(lm_compensator *compensator, lm_real error_Nm);

/* The history in a form that outlives power-down: copy it to non-volatile memory as it is. */
typedef struct lm_saved {
  uint32_t format;      /* of this struct */
  uint32_t fingerprint; /* of the parameters it belongs to */
  lm_memory memory;
  lm_real lowest_Nm;
  lm_real highest_Nm;
  uint32_t unknown; /* LM_STATE_MEMORY_UNKNOWN or 0 */
  uint32_t crc;     /* of all before it */
} lm_saved;

/* An instance that is not started saves what no instance restores. */
void lm_save_compensator(const lm_compensator *compensator, lm_saved *saved);

/* Takes a saved history over; the correction stays where it is and moves within the limits. The
 * load must not have changed its direction unseen since: if it may have, start afresh instead. The
 * time since is not known: what creep had wound up goes back from where it stood.
 * Errors: LM_NULL, also where the instance is not started; LM_CORRUPT ("crc", "format");
 * LM_INCONSISTENT ("fingerprint": saved with other parameters). Then nothing has changed. */
lm_status lm_restore_compensator(lm_compensator *compensator, const lm_saved *saved,
                                 lm_fault *fault);

LM_END_DECLS

#endif
