/* The joints that the compensator is tried on: of one equation (plant.h), and otherwise as unlike
 * as robots' joints are. */
#ifndef LOSTMOTION_TESTS_PLANT_JOINTS_H
#define LOSTMOTION_TESTS_PLANT_JOINTS_H

#include "plant.h"

typedef struct joint_kind {
  const char *name;
  plant_make make;
  double rated_Nm, gravity_Nm; /* arm level */
  /* By how much two runs differ that should not: where a loop at rest stands within its encoder's
   * counts is chance. */
  double tolerance_rad;
  double resonance_Hz; /* as the host knows it, motor held */
  /* the position loop */
  double position_gain_per_s, velocity_gain_Nms, integral_per_s, speed_filter_per_s, torque_max_Nm;
} joint_kind;

enum { JOINTS = 3 };

/* 0: the joint of plant_start. */
const joint_kind *joint_of(int number);

/* Null where there is none of that name. */
const joint_kind *find_joint(const char *name);

/* At rest, arm hanging, nothing wound up. */
void start_joint(plant *joint, const joint_kind *kind);

#endif
