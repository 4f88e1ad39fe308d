/* Status bits of one step of the model and of the compensator.
 *
 * A bit without "lasts" refers only to the step that returned it. The page "Integration" of the
 * documentation states what the host should do about each bit. */
#ifndef LOSTMOTION_STATE_H
#define LOSTMOTION_STATE_H

#define LM_STATE_TORQUE_CLIPPED 1u        /* torque above the limit of the parameters: clipped */
#define LM_STATE_INPUT_REFUSED 2u         /* not finite, or needed and too large: see model.h */
#define LM_STATE_POSITION_LIMITED 4u      /* the target is beyond the position limit */
#define LM_STATE_VELOCITY_LIMITED 8u      /* the velocity limit is active */
#define LM_STATE_ACCELERATION_LIMITED 16u /* the acceleration limit is active */
#define LM_STATE_JERK_LIMITED 32u         /* the jerk limit is active */
#define LM_STATE_MEMORY_UNKNOWN 64u /* lasts: an unknown state of the friction still matters */
#define LM_STATE_HOLDING 128u       /* lasts: mode HOLD */
#define LM_STATE_RESETTING 256u     /* lasts: mode RESET */
#define LM_STATE_FADED 512u         /* lasts: the watch has faded the correction, fully or partly */
#define LM_STATE_MISFIT 1024u       /* lasts: the residual found by the watch exceeds misfit_rad */
#define LM_STATE_MODEL_REFUSED 2048u      /* the model returned no finite angle (user effect) */
#define LM_STATE_WATCH_REFUSED 4096u      /* lasts: the last call of lm_watch_output was ignored */
#define LM_STATE_HEADROOM_SHORT 8192u     /* lasts: the motion exceeds the new limits or headroom */
#define LM_STATE_SETTLED 16384u           /* at its target in this step; see lm_find_standstill */
#define LM_STATE_EXTRAPOLATED 32768u      /* torque or a condition outside the fitted range */
#define LM_STATE_CONDITION_MISSING 65536u /* a condition that the model needs is unknown */
#define LM_STATE_NOT_STARTED 131072u      /* instance null or not started: correction zero */
#define LM_STATE_RINGING 262144u      /* lasts: ringing detected; the correction follows slowly */
#define LM_STATE_PERIOD_WRONG 524288u /* elapsed_s differs from the period of the parameters */

#endif
