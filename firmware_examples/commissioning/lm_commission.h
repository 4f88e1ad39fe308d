/* The commissioning routine on an axis of lm_axis.h: it moves the axis instead of the planner. */
#ifndef LM_COMMISSION_H
#define LM_COMMISSION_H

#include "commissioning.h"
#include "lm_axis.h"

typedef struct lm_commission {
  commissioning run;
  commissioning_output out; /* instead of the planner: velocity, acceleration, finding */
  int begun;
} lm_commission;

/* In every tick, before lm_axis_tick, with the torque for it in at. motor_rad: not divided by the
 * ratio; output_rad: encoder at the output, or LM_UNKNOWN. Nothing moves until the axis could be
 * closed. Any result but COMMISSIONING_RUNNING: the run has ended, brake. */
commissioning_finding lm_commission_step(lm_commission *c, lm_axis *a, const lm_conditions *at,
                                         float motor_rad, float output_rad);

#endif
