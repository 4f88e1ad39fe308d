#include "joints.h"

#include <string.h>

#define ARCSEC (3.14159265358979323846 / 648000)

static const joint_kind kinds[JOINTS] = {
    {"standard",
     {.ratio = PLANT_RATIO}, /* that of plant_start */
     PLANT_RATED_NM,
     PLANT_GRAVITY_NM,
     0.5 * ARCSEC,
     25,
     40,
     150, /* 40 Hz with its rotor */
     15,
     600, /* 95 Hz */
     90},
    {"soft", /* a long arm, Dahl friction, an encoder of 12 bits */
     {1.2e-4, 1.6e4, 1e9, 20, 2.0, 8e3, 2.8, 1.5, 4, 4, 5, 4096 * 160.0, 0, 160, 1.2e5},
     60,
     45,
     4 * ARCSEC, /* two counts */
     12,
     20,
     180, /* 19 Hz */
     8,
     400,
     130},
    {"stiff", /* a wrist, Dahl friction, an encoder of 17 bits */
     {3e-5, 4.3e4, 4e9, 10, 0.6, 3e4, 0.3, 0.15, 1.5, 1.5, 1, 131072 * 50.0, 0, 50, 1.5e5},
     25,
     15,
     0.5 * ARCSEC,
     60,
     60,
     75, /* 80 Hz */
     25,
     1200,
     60},
};

const joint_kind *joint_of(int number) {
  return &kinds[number];
}

const joint_kind *find_joint(const char *name) {
  int i;
  for (i = 0; i < JOINTS; ++i) {
    if (strcmp(kinds[i].name, name) == 0) {
      return &kinds[i];
    }
  }
  return 0;
}

void start_joint(plant *joint, const joint_kind *kind) {
  plant_start(joint);
  joint->gravity_Nm = kind->gravity_Nm;
  if (kind != kinds) {
    joint->make = kind->make;
  }
}
