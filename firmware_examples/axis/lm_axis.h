/* One axis: command, torque and correction of a position loop on the motor's encoder, with a brake
 * on the motor. lm_drive.h enables the drive and releases the brake. The page "Integration" has the
 * sequence; each function states what it refuses.
 *
 * The host sets `ratio` (and output_loop) of a zeroed struct once; power-up keeps them. motor_rad,
 * setpoint, velocity and torque for the loop are those of the motor; wish, command, zero and
 * reported angle those of the output.
 * motor_rad is a float, at the output within +-LM_AXIS_ANGLE_MAX_RAD: subtract a fixed origin from
 * the encoder's counts as integers, then convert. NaN: not measured, too old. The motor's velocity
 * comes from differences of counts, not of motor_rad.
 *
 * A position loop on an encoder at the output (output_loop): motor_rad and the setpoint are those
 * of this encoder; velocity and torque remain those of the motor. */
#ifndef LM_AXIS_H
#define LM_AXIS_H

#include "lm_follow.h"

/* Standstill of the correction before it matters that nothing moves, in units of
 * 1 / response_per_s: seven time constants of the filter of lm_axis_use_sensor and
 * lm_axis_use_current (1.1 s if exported for a resonance of 10 Hz, 0.45 s for 25 Hz). A slower
 * filter of your own: more. */
#define LM_AXIS_STAND 28.0f

/* Motion of the braked motor in that time, at the output: more than an encoder's noise. */
#define LM_AXIS_STILL_RAD 1e-4f

/* 5 turns of the output: one step of binary32 is 2e-6 rad (0.4 arcsec) there. */
#define LM_AXIS_ANGLE_MAX_RAD 32.0f

/* A motor that is further from the setpoint is not held there: more than a position loop yields.
 * Behind a setpoint that moves, or has just stopped, a motor may be further away by the way in the
 * time of LM_AXIS_STAND. */
#define LM_AXIS_APART_RAD 0.01f

/* The torque limit of the parameters in this time: so fast the feed-forward ends before another
 * mode, and the integrator of the position loop (integral time 0.15 s) takes over the load with an
 * error of some arcsec. */
#define LM_AXIS_FEED_S 50.0f

/* The same in LM_AXIS_CLOSED for a torque in use that differs from its new value although the load
 * has not changed, and for what a measurement adds to the feed-forward: a few arcsec a second at
 * most. */
#define LM_AXIS_CREEP_S 1000.0f

/* An axis is slower: a greater change of gravity in a tick, at the torque limit, is a payload, and
 * the torque of the command changes no faster. */
#define LM_AXIS_FAST_RAD_S 10.0f

typedef enum lm_axis_state {
  LM_AXIS_OFF = 0, /* not started */
  LM_AXIS_OPEN,    /* position loop open, brake on: the setpoint is the measured angle */
  LM_AXIS_PAUSED,  /* the setpoint stays; command_rad follows the correction */
  LM_AXIS_CLOSED   /* position loop closed on planner and correction */
} lm_axis_state;

/* Why the axis does not continue, and what a call refused. */
typedef enum lm_axis_wait {
  LM_AXIS_READY = 0,
  LM_AXIS_WAITS_START,     /* LM_AXIS_OFF */
  LM_AXIS_WAITS_LOOP,      /* the loop is open, or, for power-down, closed */
  LM_AXIS_WAITS_CONDITION, /* a condition or the measured torque is missing or not finite */
  LM_AXIS_WAITS_MOTOR,     /* the motor moves behind the brake, is not at setpoint_rad (a drive that
                              follows stated so), or its angle is not valid */
  LM_AXIS_WAITS_STAND,     /* the correction has not stood for LM_AXIS_STAND */
  LM_AXIS_WAITS_SOURCE,    /* the drive has not followed for LM_AXIS_STAND, for a current, or the
                              measured torque is not in use */
  LM_AXIS_WAITS_DRIVE,     /* the drive does not follow, and for nothing else */
  LM_AXIS_WAITS_PLANNER,   /* to close: the planner is not at command_rad; to pause: it moves */
  LM_AXIS_WAITS_ANGLE,     /* the planner went further than LM_AXIS_ANGLE_MAX_RAD */
  LM_AXIS_WAITS_COMMAND,   /* lm_drive.h: no command, or it has expired or ended by a trip */
  LM_AXIS_WAITS_PARTED,    /* lm_drive.h: the same, the motor was parted from the setpoint */
  LM_AXIS_WAITS_COMMISSION /* not commissioned with these parameters */
} lm_axis_wait;

typedef enum lm_axis_source { LM_AXIS_COMMAND = 0, LM_AXIS_SENSOR, LM_AXIS_CURRENT } lm_axis_source;

typedef struct lm_axis {
  float ratio;     /* signed: motor turns per output turn */
  int output_loop; /* 1: position loop on an encoder at the output: only the rates are used */
  lm_axis_state state;
  lm_axis_wait waits; /* LM_AXIS_OPEN: for lm_axis_close; LM_AXIS_PAUSED: for LM_AXIS_CLOSED */
  lm_compensator compensator;
  lm_correction correction; /* of this tick, with the status and the rates for a feed-forward, which
                               are 0 unless LM_AXIS_CLOSED */
  int commissioned; /* with these parameters: otherwise the axis closes for a commissioning only. 1
                         after power-up: taken as commissioned */
  float setpoint_rad; /* last one, at the output */
  float command_rad;  /* commanded output angle; the reported one unless LM_AXIS_CLOSED */
  float moved_rad;    /* change of the command in this tick, for lm_guess_torque */
  float torque_Nm;    /* external, in use */
  float zero_rad;     /* reported angle at motor_rad 0 and correction 0: store it */
  lm_follow follow;   /* of the planner, with period and LM_AXIS_STAND in seconds */
  lm_mode mode;
  lm_standstill standstill;
  float stood_s;
  float stood_at_rad; /* of the motor, with the loop open */
  float motor_rad;    /* last one, at the output */
  float fast_rad_s;   /* recent rate of setpoint or open motor */
  float seen_rad;     /* setpoint at which the angle of the motor changed last */
  int far;            /* the planner went further than an angle may */
  int parted; /* the motor is not held at the setpoint, or its angle does not change with it */
  int still;  /* planner and motor rest: a current tells nothing of the load */
  float still_s;
  float still_at_rad; /* of the motor, from the setpoint */
  int rang;           /* LM_STATE_RINGING was set while the loop was closed */
  int begun;          /* first tick */
  int unseen;         /* a load acted that torque_Nm did not contain: until LM_AXIS_CLOSED the
                         history is unknown */
  int lost_ticks;     /* without an angle of the motor */
  int input_missing;
  lm_conditions last;  /* used */
  int condition_waits; /* a condition was lost: the last one is used, until the axis is paused */
  int missing_ticks;
  int frozen;
  int guided; /* lm_axis_guide was called since the last tick */
  int unfed;  /* the loop was closed for it */
  int guides; /* it moves the axis */
  float guide_rad;
  float guide_rad_s; /* of the test: velocity that is fed forward for it */
  float guide_Nm;    /* of the test: change of the torque, fed forward instead */
  float guided_rad;  /* of the tick before, or LM_UNKNOWN */
  lm_correction guide;
  int holds;    /* lm_axis_hold: the next angle of the motor is the setpoint, as after a lost bus */
  int at_motor; /* the setpoint is the angle of the motor of this tick */
  int alone;    /* the correction moves, the joint does not */
  uint32_t moving_state; /* bits that move it */
  lm_axis_source source; /* of the torque */
  int source_waits;      /* another one was requested in this tick */
  int source_lost;       /* because the measurement was lost */
  float jump_Nm;         /* of gravity in this tick, and the load does not */
  float command_Nm;      /* of the command, within limit_Nm */
  float sensed_Nm;       /* measured, the same; LM_UNKNOWN: not in use */
  float limit_Nm;        /* torque limit of the parameters */
  int clipped;           /* a torque was beyond it since the last tick */
  float beyond_Nm;       /* what the measurement adds to the torque of the command */
  float off_Nm; /* jump of the torque of the command that the torque in use has still to make */
  float creep_Nm_s;
  float gravity_Nm;  /* last known one */
  int homed;         /* of lm_axis_gravity */
  float unwatched_s; /* in LM_AXIS_CLOSED since lm_axis_watch */
  float late_s;      /* for which the planner has not shifted with the zero */
  float step_Nm;     /* of gravity, that no motion makes */
  int unfeeds;       /* lm_drive: the feed-forward ends: another mode may ignore it */
  float fed_Nm;      /* torque_Nm, as far as it is fed forward */
  float believed_Nm; /* of beyond_Nm: friction hides the rest */
  float bound_Nm;
  float motor_rad_s; /* of lm_axis_use_current */
  float share;       /* of the filter in a tick */
  float lost_s;
  float borne_s; /* for which the motor has borne the load */
} lm_axis;

/* What lm_drive_power_down saves, for memory that survives. beyond_Nm: what a measurement added to
 * the torque of the command. Set history.format to 0 if the load changed meanwhile. zero_rad and
 * commissioned stay at power-up: the zero of an absolute encoder, which the host writes after every
 * homing, too; commissioned holds for the parameters of this fingerprint. */
typedef struct lm_axis_kept {
  lm_saved history;
  int commissioned;
  uint32_t fingerprint;
  float beyond_Nm;
  float gravity_Nm;
  float zero_rad;
  int unseen;
} lm_axis_kept;

/* Power-up, the loop open, the brake on. at: the conditions, with the torque of the command:
 * gravity at motor_rad / ratio + the zero, or LM_UNKNOWN: that of the power-down. kept: of the last
 * power-down (all 0: none), or null. Its history is used up: write *kept back to its memory before
 * the loop closes, so that a later reset does not restore it again. Errors: those of
 * lm_start_compensator; LM_OUT_OF_RANGE ("ratio": 0 or not finite; "motor_rad", "zero_rad" of kept:
 * not finite or beyond LM_AXIS_ANGLE_MAX_RAD at the output). Then the axis is off, and the setpoint
 * 0 means nothing. A measured torque: then lm_declare_torque_error. */
lm_status lm_axis_power_up(lm_axis *a, const lm_parameters *parameters, lm_axis_kept *kept,
                           const lm_conditions *at, float motor_rad, lm_fault *fault);

/* The torque for lm_conditions: one of the three in every tick, before lm_axis_tick, in all states.
 * commanded_Nm: gravity at command_rad minus inertia times the planner's acceleration of the output
 * (compensator.h: signs); 0 if unknown. They filter at a tenth of the resonance for which the
 * parameters were exported. A torque beyond torque_limit_Nm is clipped (LM_STATE_TORQUE_CLIPPED),
 * and that of the command changes by at most LM_AXIS_FAST_RAD_S times that limit a second in
 * LM_AXIS_CLOSED: one wrong acceleration is no blow. The torque does not jump when its source or
 * the zero changes: the command keeps the last difference to a measurement, until power-up without
 * the history or another payload. A jump of gravity (lm_axis_gravity) is made in LM_AXIS_PAUSED,
 * and creeps in LM_AXIS_CLOSED (LM_AXIS_CREEP_S).
 *
 * sensed_Nm: minus the torque of the gear on the link, which a sensor between them measures. Not
 * filtered; between two samples the last one. If it is not finite for the time of LM_AXIS_STAND,
 * the torque of the command plus the last difference is used until the axis is paused or open:
 * raise an alarm while source_lost is set. The axis does not close without it: to continue, call
 * lm_axis_use_command instead. */
float lm_axis_use_command(lm_axis *a, float commanded_Nm);
float lm_axis_use_sensor(lm_axis *a, float commanded_Nm, float sensed_Nm);

/* motor: its ratio is that of the axis, whatever it states. motor_rad_s: velocity of the motor
 * shaft, from counts; acceleration_rad_s2: of the planner, at the output. follows: of lm_drive. The
 * current is used once the drive has followed, and so borne the load, for the time of
 * LM_AXIS_STAND; until then the torque of the command plus the last difference. In LM_AXIS_CLOSED, while planner and motor rest, a change of the current is friction,
 * whatever lm_motor states, and changes nothing; a motor that has moved by LM_AXIS_STILL_RAD from
 * the setpoint has to rest for LM_AXIS_STAND again. A current or a velocity that is not finite: as
 * a lost sensor. */
float lm_axis_use_current(lm_axis *a, const lm_motor *motor, float commanded_Nm, float current_A,
                          float motor_rad_s, float acceleration_rad_s2, int follows);

/* Gravity for the torque of the command, in every tick. homed 0: the zero is not known, and so
 * gravity_Nm is not; the last one is used, also that of the power-down. A step that no motion makes
 * (payload, zero, another axis that is homed) makes no jump of the torque in use: a sensor has it
 * from the measurement, the command alone forgets what a measurement had added, and of a current
 * gravity corrects what friction may have hidden. */
float lm_axis_gravity(lm_axis *a, float gravity_Nm, int homed);

/* Velocity feed-forward, of the motor: that of command and correction in LM_AXIS_CLOSED, otherwise
 * 0. */
float lm_axis_rate(const lm_axis *a);

/* Torque feed-forward, of the motor: against the load, within torque_limit_Nm at the output. After
 * lm_axis_close it changes with the torque of the command alone: fed forward, a measurement would
 * close a loop that oscillates. What is measured or becomes known is already borne by the
 * integrator, and it creeps there. 0 if the loop was closed for a test, except in its small motion
 * that finds the sign. */
float lm_axis_feed(const lm_axis *a);

/* Once in every period, in all states; after an overrun not twice; elapsed_s of the first one is
 * ignored. wish_rad: the output angle that the planner requests, a new one in every tick:
 * interpolate a slower planner. While the state is not LM_AXIS_CLOSED the planner is at rest at
 * command_rad, within LM_FOLLOW_NEAR_RAD. In LM_AXIS_CLOSED the axis is paused by a wish that
 * steps (follow.step_rad_s), or is missing (not finite) for more than LM_FOLLOW_LOST_TICKS; by an
 * elapsed_s above 1 / response_per_s (missed ticks); and before motor_rad leaves
 * +-LM_AXIS_ANGLE_MAX_RAD, where the axis could not be started: lm_axis_turn.
 * Returns the setpoint of the position loop.
 *
 * follows: of lm_drive: 1 while the drive reports that it follows the setpoint, and the brake
 * has opened. With 0, or motor_rad not finite for more than LM_FOLLOW_LOST_TICKS (lost
 * bus), LM_AXIS_CLOSED becomes LM_AXIS_PAUSED: the setpoint stays at once, also in motion. After a
 * bus that was lost for LM_AXIS_STAND it is the angle of the motor: the drive has stopped there.
 * LM_AXIS_PAUSED lasts until it is 1 and the angle is there. */
float lm_axis_tick(lm_axis *a, const lm_conditions *at, float motor_rad, float wish_rad,
                   int follows);

/* A test instead of the planner (commissioning): call it before every tick. The axis then stays in
 * LM_AXIS_PAUSED. Returns 1 once it could be closed: from then on its setpoint is command_rad
 * (without the zero) + correction, with the rates of both. If the drive no longer follows, the call
 * is missing, or the sum steps by LM_AXIS_APART_RAD, the setpoint stays. Until it returns 1:
 * command_rad LM_UNKNOWN, correction null. */
int lm_axis_guide(lm_axis *a, float command_rad, const lm_correction *correction);

/* From LM_AXIS_CLOSED to LM_AXIS_PAUSED, for whatever moves the correction although the load does
 * not: an input angle that becomes known. Make the change between this call and the next tick.
 * lm_axis_tick goes back to LM_AXIS_CLOSED by itself, not while follows is 0. Refused until the
 * planner has been at rest for LM_FOLLOW_REST_S, and with the loop open. */
lm_axis_wait lm_axis_pause(lm_axis *a);

/* Another mode, headroom (null: none), other parameters. LM_AXIS_CLOSED is paused first, except for
 * LM_MODE_HOLD, so that nothing moves: refused while the planner moves (LM_INCONSISTENT,
 * "wish_rad"). Otherwise the results of lm_change_parameters; parameters of another fingerprint are
 * not commissioned. LM_MODE_RESET and in the same tick LM_MODE_RUN end the ringing. */
lm_axis_wait lm_axis_set_mode(lm_axis *a, lm_mode mode);
lm_axis_wait lm_axis_headroom(lm_axis *a, const lm_headroom *headroom);
lm_status lm_axis_change(lm_axis *a, const lm_parameters *parameters, lm_fault *fault);

/* States that the output is now at angle_rad, at rest or in motion. The planner shifts with
 * command_rad; nothing moves, even if it does so some ticks later: add the change of zero_rad to
 * its position, its target and every sample that an interpolator holds; its velocity stays. A wish
 * on the way from the old to the shifted one pauses the axis, also in motion. motor_rad: latched at
 * the switch. Returns by how much the zero may be wrong, rad: by the unknown history, by the torque
 * error, if it was declared (of the command all of its limit, as long as homed is 0), and by the
 * residual of the fit. If that is too much, drive a load cycle, after which the history is known
 * (lm_bound_uncertainty), and home again.
 * If gravity was computed with the zero of before, the torque in use is still that: lm_axis_pause
 * shortens its way to the new value. Returns -1 and changes nothing: off, an angle that is not
 * valid, or a zero that was known (homed 1 of lm_axis_gravity) and shifts by more than
 * LM_AXIS_APART_RAD: a unit, a switch, an encoder is wrong. Another zero on purpose: homed 0
 * in the tick before. A planner that has not shifted once it rests pauses the axis. */
float lm_axis_reference(lm_axis *a, float motor_rad, float angle_rad);

/* The index of an incremental encoder: latched_rad: of the motor there; index_rad: latched_rad /
 * ratio + zero_rad there once the axis is home, a constant of the axis. As lm_axis_reference. */
float lm_axis_index(lm_axis *a, float latched_rad, float index_rad);

/* For an axis that turns without end: whole turns of the output were added to the origin of
 * motor_rad, command and planner (by_rad: -2 pi, for example). Call it before the tick
 * with the new angles. */
void lm_axis_turn(lm_axis *a, float by_rad);

/* lm_watch_output with an encoder at the output, read at the same instant as motor_rad of the last
 * tick, after it, in every tick or less often. Its own zero; not wrapped, but turned as the motor
 * (lm_axis_turn). Nothing while the axis is not LM_AXIS_CLOSED, without the angle of the motor, and
 * in a loop on that encoder, where motor_rad is no motor's. */
void lm_axis_watch(lm_axis *a, float output_rad);

/* Actual output angle. */
float lm_axis_reported(const lm_axis *a, float motor_rad);

/* A load acts, or has acted, that the torque does not contain, such as a collision: from here to
 * LM_AXIS_CLOSED the history is unknown (lm_declare_memory_unknown), and nothing moves. The axis
 * calls it itself after a stop in motion that was not commanded, when a braked motor moves, while a
 * measured torque is lost, and for a torque that becomes known only now. */
void lm_axis_forget(lm_axis *a);

/* Called by lm_drive.c, which knows when. From LM_AXIS_OPEN to LM_AXIS_PAUSED: after a standstill
 * of motor and correction, in the cycle that enables the drive or with the brake on; otherwise the
 * reason; LM_AXIS_WAITS_COMMISSION unless a commissioning (lm_axis_guide) closes it. The setpoint
 * stays from here on. Until the position loop bears the load, it yields by its
 * own error: feed the load forward. */
lm_axis_wait lm_axis_close(lm_axis *a);

/* The same at once, for a drive that was in another mode, with the brake open. */
void lm_axis_hold(lm_axis *a);

/* To LM_AXIS_OPEN: the brake bears the load, or the drive has left its position loop. With
 * `follows` 1 the setpoint stays even there. */
void lm_axis_open(lm_axis *a);

/* Saves the history; the axis is off then. Not LM_AXIS_READY: the loop is closed, or correction and
 * motor have not stood: nothing was saved. */
lm_axis_wait lm_axis_power_down(lm_axis *a, lm_axis_kept *kept);

#endif
