/* The status bits: what one step of the model and of the compensator has found.
 *
 * A bit without "lasts" tells of the step that returned it alone. What the host does about each of
 * them is a table in the documentation, "Integration". */
#ifndef LOSTMOTION_STATE_H
#define LOSTMOTION_STATE_H

#define LM_STATE_TORQUE_CLIPPED 1u /* torque beyond the parameters' limit: clipped */
#define LM_STATE_INPUT_REFUSED                                                                     \
  2u                                      /* an input was not finite or, where an effect needs it, \
                                           * beyond its range: replaced (model.h) */
#define LM_STATE_POSITION_LIMITED 4u      /* the target lies beyond the position limit */
#define LM_STATE_VELOCITY_LIMITED 8u      /* the velocity limit binds */
#define LM_STATE_ACCELERATION_LIMITED 16u /* the acceleration limit binds */
#define LM_STATE_JERK_LIMITED 32u         /* the jerk limit binds */
#define LM_STATE_MEMORY_UNKNOWN 64u /* lasts: the load has not yet wiped out the start state */
#define LM_STATE_HOLDING 128u       /* lasts: mode HOLD */
#define LM_STATE_RESETTING 256u     /* lasts: mode RESET */
#define LM_STATE_FADED 512u   /* lasts: the watch has faded the correction, wholly or in part */
#define LM_STATE_MISFIT 1024u /* lasts: the watch finds that the model does not fit */
#define LM_STATE_MODEL_REFUSED 2048u /* the model gave no finite angle (a user's effect) */
#define LM_STATE_WATCH_REFUSED 4096u /* lasts: the last call of lm_watch_output was ignored */
#define LM_STATE_HEADROOM_SHORT                                                                 \
  8192u                              /* lasts: the motion under way does not yet fit the limits \
                                      * and the headroom stated last; it ends under those that  \
                                      * it was made under */
#define LM_STATE_SETTLED 16384u      /* the correction rests where it is to go */
#define LM_STATE_EXTRAPOLATED 32768u /* torque or a condition outside the range that was fitted */
#define LM_STATE_CONDITION_MISSING 65536u /* a condition that the model needs was not told */
#define LM_STATE_NOT_STARTED 131072u /* no instance, or none that was started: correction zero */
#define LM_STATE_RINGING 262144u /* lasts: the correction rang; it follows slowly from then on */
#define LM_STATE_PERIOD_WRONG 524288u /* the elapsed_s told is not the period of the parameters */

#endif
