/* The joints with which the compensator is tested: they have one equation (plant.h) and otherwise
 * differ as much as joints of robots do. */
#ifndef LOSTMOTION_TESTS_PLANT_JOINTS_H
#define LOSTMOTION_TESTS_PLANT_JOINTS_H

#include "plant.h"

typedef struct joint_kind {
  const char *name;
  plant_make make;
  double rated_Nm, gravity_Nm; /* arm level */
  /* Difference of two runs that should be equal: the position of a loop at rest within a count of
   * its encoder is random. */
  double tolerance_rad;
  double resonance_Hz; /* as the host knows it, motor held */
  /* the position loop */
  double position_gain_per_s, velocity_gain_Nms, integral_per_s, speed_filter_per_s, torque_max_Nm;
} joint_kind;

enum { JOINTS = 3 };

/* 0: the joint of plant_start. */
const joint_kind *joint_of(int number);

/* Null if there is none of that name. */
const joint_kind *find_joint(const char *name);

/* At rest, arm hanging, gear not wound up. */
void start_joint(plant *joint, const joint_kind *kind);

#endif
