/* Commanded motions of the joint: the scenarios, as angle, velocity and acceleration.
 */
#ifndef JOINT_MOTION_H
#define JOINT_MOTION_H

#include <stdint.h>

#include "plant.h"

#define TICK_S 5e-4f /* of the control loop: 2 kHz */

typedef struct motion {
  float angle_rad;
  float velocity_rad_s;
  float acceleration_rad_s2;
} motion;

/* A move that starts and ends at rest without a jump of the acceleration. */
typedef struct move {
  float duration_s;
  float to_rad;
} move;

#define MOVES_MAX 24

typedef struct scenario {
  const char *name;
  plant_load load;
  float hover_rad;  /* amplitude of a small oscillation added to the moves, 0 for none */
  float circle_rad; /* radius of a circle instead of moves, 0 for none */
  float circle_s;   /* duration */
  int circle_turns;
  int cosine; /* the circle's second axis */
  int count;
  int approach; /* moves before the score begins */
  move moves[MOVES_MAX];
} scenario;

extern const scenario scenarios[];
extern const int scenario_count;

/* Total ticks of a scenario. It begins with a swing in both directions, the same for all, and its
 * own approach; neither is scored. */
int32_t scenario_ticks(const scenario *what);
int32_t unscored_ticks(const scenario *what);

motion scenario_at(const scenario *what, int32_t tick);

#endif
