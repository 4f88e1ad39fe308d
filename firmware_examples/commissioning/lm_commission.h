/* The commissioning routine on an axis of lm_axis.h: it moves the axis instead of the planner. */
#ifndef LM_COMMISSION_H
#define LM_COMMISSION_H

#include "commissioning.h"
#include "lm_drive.h"

typedef struct lm_commission {
  commissioning run;
  commissioning_output out; /* instead of the planner: velocity, acceleration; finding */
  int on;
  int begun;
  float waited_s;
  int stops; /* no fault was found: the brake closes */
  float stopped_rad, stopped_s;
} lm_commission;

/* With run 0 and the axis open: a run begins with the next closing. Without run 1 within
 * LM_DRIVE_ENABLING_S the request has expired. Torque is fed forward only in its second shake.
 * settings: null for those of commissioning_suggest with the parameters and the ratio of the axis.
 * Returns the finding for rejected settings or parameters, or COMMISSIONING_ABORTED in another
 * state of the axis: then nothing begins. */
commissioning_finding lm_commission_start(lm_commission *c, lm_axis *a, lm_drive *d,
                                          const commissioning_settings *settings);

/* In every tick, before lm_axis_tick, with the torque for it in at. motor_rad: encoder of the motor;
 * output_rad: that at the output, or LM_UNKNOWN. After the run, also after a fault, the axis brakes:
 * as run 0 in lm_drive.h, after a following error as a trip. out.finding states the result, without
 * a fault once the motor has stood behind its brake.
 * COMMISSIONING_NO_FAULT sets `commissioned` of the axis, a run that has begun clears it. */
void lm_commission_step(lm_commission *c, lm_axis *a, lm_drive *d, const lm_conditions *at,
                        float motor_rad, float output_rad);

#endif
