#include "plant.h"

#include "sine.h"

/* A component set of size 20, ratio 100: catalogue stiffness 16, 25, 29 kN*m/rad, rated 40 N*m. */
#define GAP_HALF_RAD 1.0e-4f          /* radial gap, as an angle of the output */
#define GAP_STIFFNESS 4.0e3f          /* N*m/rad while it closes: 1 % of the rated torque */
#define SPRING_STIFFNESS 1.5e4f       /* N*m/rad once it is closed */
#define SPRING_CUBIC 3.6e9f           /* N*m/rad^3 */
#define REDUCER_DAMPING 8.0f          /* N*m*s/rad */
#define ROTOR_INERTIA 0.6f            /* kg*m^2, referred to the output: 6e-5 at the motor */
#define ROTOR_FRICTION 2.5f           /* N*m on the output's side */
#define ROTOR_FRICTION_SLOPE 1.2e4f   /* N*m/rad before it slips */
#define ROTOR_VISCOUS 3.0f            /* N*m*s/rad */
#define BEARING_FRICTION 1.6f         /* N*m */
#define BEARING_FRICTION_SLOPE 8.0e3f /* N*m/rad before it slips */
#define BEARING_VISCOUS 0.6f          /* N*m*s/rad */

/* The elements that slip first carry most of the torque. */
static const float slip_stiffness[PLANT_SLIPS] = {1.5e4f, 6.0e3f, 2.6e3f, 1.2e3f, 5.0e2f, 2.0e2f};
static const float slip_limit[PLANT_SLIPS] = {0.27f, 0.23f, 0.19f, 0.17f, 0.14f, 0.11f};

static float clip(float value, float most) {
  return value > most ? most : value < -most ? -most : value;
}

static float spring(float twist_rad) {
  float size = twist_rad < 0 ? -twist_rad : twist_rad;
  float beyond = size - GAP_HALF_RAD;
  float torque = GAP_STIFFNESS * (beyond > 0 ? GAP_HALF_RAD : size);
  if (beyond > 0) {
    torque += beyond * (SPRING_STIFFNESS + SPRING_CUBIC * beyond * beyond);
  }
  return twist_rad < 0 ? -torque : torque;
}

/* Turns the output against the motor and returns the torque with which the reducer resists. */
static float wind(plant *joint, float turned_rad) {
  float torque;
  int i;
  joint->twist_rad += turned_rad;
  torque = spring(joint->twist_rad);
  for (i = 0; i < PLANT_SLIPS; ++i) {
    joint->slip_Nm[i] = clip(joint->slip_Nm[i] + slip_stiffness[i] * turned_rad, slip_limit[i]);
    torque += joint->slip_Nm[i];
  }
  return torque + REDUCER_DAMPING * turned_rad * (1 / PLANT_STEP_S);
}

void plant_start(plant *joint, plant_load load) {
  int i;
  joint->load = load;
  joint->motor_rad = 0;
  joint->motor_rad_s = 0;
  joint->twist_rad = 0;
  joint->output_rad_s = 0;
  for (i = 0; i < PLANT_SLIPS; ++i) {
    joint->slip_Nm[i] = 0;
  }
  joint->bearing_Nm = 0;
  joint->rotor_Nm = 0;
  joint->reducer_Nm = 0;
}

void plant_disturb(plant *joint, float twist_rad) {
  float step_rad = twist_rad / 1000;
  int k;
  for (k = 0; k < 1000; ++k) {
    wind(joint, step_rad);
  }
  for (k = 0; k < 1000; ++k) {
    wind(joint, -step_rad);
  }
}

static void move_output(plant *joint, float torque_Nm) {
  float moved_rad = joint->output_rad_s * PLANT_STEP_S;
  joint->bearing_Nm =
      clip(joint->bearing_Nm + BEARING_FRICTION_SLOPE * moved_rad, BEARING_FRICTION);
  torque_Nm -= joint->bearing_Nm + BEARING_VISCOUS * joint->output_rad_s;
  joint->output_rad_s += torque_Nm * (PLANT_STEP_S / joint->load.inertia_kgm2);
}

void plant_step(plant *joint, float motor_Nm) {
  float reducer_Nm = wind(joint, (joint->output_rad_s - joint->motor_rad_s) * PLANT_STEP_S);
  float moved_rad = joint->motor_rad_s * PLANT_STEP_S;
  joint->reducer_Nm = reducer_Nm;
  joint->motor_rad += moved_rad;
  joint->rotor_Nm = clip(joint->rotor_Nm + ROTOR_FRICTION_SLOPE * moved_rad, ROTOR_FRICTION);
  motor_Nm += reducer_Nm - joint->rotor_Nm - ROTOR_VISCOUS * joint->motor_rad_s;
  joint->motor_rad_s += motor_Nm * (PLANT_STEP_S / ROTOR_INERTIA);
  move_output(joint, -reducer_Nm - joint->load.gravity_Nm * sine(plant_output(joint)));
}

void plant_step_locked(plant *joint, float external_Nm) {
  float reducer_Nm = wind(joint, joint->output_rad_s * PLANT_STEP_S);
  joint->output_rad_s += (external_Nm - reducer_Nm) * (PLANT_STEP_S / joint->load.inertia_kgm2);
}

float plant_read_torque(const plant *joint) {
  return joint->reducer_Nm;
}

int32_t plant_read_encoder(const plant *joint) {
  float counts = joint->motor_rad * (PLANT_RATIO * PLANT_ENCODER_COUNTS / 6.28318531f);
  int32_t whole = (int32_t)counts;
  return (float)whole > counts ? whole - 1 : whole;
}

float plant_output(const plant *joint) {
  return joint->motor_rad + joint->twist_rad;
}
