#include "plant.h"

#include <math.h>
#include <string.h>

#define DEAD_RAD 6e-5        /* half the dead zone at 20 degrees C */
#define DEAD_RAD_PER_K 3e-6  /* by which it opens */
#define STIFFNESS 2e4        /* N*m/rad */
#define CUBIC 2e9            /* N*m/rad^3 */
#define DAMPING 12.0         /* N*m*s/rad */
#define BOUC_WEN_NM 1.2      /* friction of the gear when it slips */
#define BOUC_WEN_SLOPE 1.2e4 /* N*m/rad when it sticks */
#define STRIBECK_NM 3.8      /* LuGre */
#define STRIBECK_RAD_S 0.01
#define BRISTLE_STIFFNESS 1.5e5 /* N*m/rad */
#define BRISTLE_DAMPING 300.0   /* N*m*s/rad */
#define ENCODER_COUNTS 16384.0  /* of one motor turn */
#define PI 3.14159265358979323846

void plant_start(plant *joint) {
  static const plant_make make = {
      DEAD_RAD,
      STIFFNESS,
      CUBIC,
      DAMPING,
      BOUC_WEN_NM,
      BOUC_WEN_SLOPE,
      PLANT_ARM_KGM2,
      PLANT_ROTOR_KGM2,
      PLANT_COULOMB_NM,
      STRIBECK_NM,
      PLANT_VISCOUS_NMS,
      ENCODER_COUNTS * PLANT_RATIO,
      0,
      PLANT_RATIO,
      0,
  };
  memset(joint, 0, sizeof *joint);
  joint->make = make;
  joint->gravity_Nm = PLANT_GRAVITY_NM;
  joint->temperature_C = 20;
}

double plant_output(const plant *joint) {
  return joint->motor_rad + joint->twist_rad;
}

double plant_motor_encoder(const plant *joint) {
  double count_rad = 2 * PI / joint->make.counts;
  return floor(joint->motor_rad / count_rad) * count_rad;
}

/* Angle of an eccentric as seen from its centre: a sine with a fifth of the second harmonic. */
static double ripple(const plant *joint) {
  double phase = 2 * joint->make.ratio * joint->motor_rad;
  return joint->make.ripple_rad > 0 ? joint->make.ripple_rad * sin(phase) / (1 + 0.2 * cos(phase))
                                    : 0;
}

static double spring(const plant *joint) {
  double twist_rad = joint->twist_rad - ripple(joint);
  double dead = fmax(joint->make.dead_rad + DEAD_RAD_PER_K * (joint->temperature_C - 20), 0);
  double beyond = fmax(fabs(twist_rad) - dead, 0);
  return copysign(joint->make.stiffness_Nm_per_rad * beyond +
                      joint->make.cubic_Nm_per_rad3 * beyond * beyond * beyond,
                  twist_rad);
}

static void rub(plant *joint, double turned_rad) {
  double share = joint->friction_Nm / joint->make.slip_Nm;
  double resists = share * turned_rad > 0 ? fabs(share) : 0;
  joint->friction_Nm += joint->make.stick_Nm_per_rad * turned_rad * (1 - resists);
}

/* Dahl, backward in time: stable at any speed. */
static double dahl(plant *joint) {
  double turned_Nm = joint->make.dahl_Nm_per_rad * joint->motor_rad_s * PLANT_STEP_S;
  joint->dahl_Nm = (joint->dahl_Nm + turned_Nm) / (1 + fabs(turned_Nm) / joint->make.coulomb_Nm);
  return joint->dahl_Nm;
}

static double lugre(plant *joint) {
  double v = joint->motor_rad_s;
  double ratio = v / STRIBECK_RAD_S;
  double g = joint->make.coulomb_Nm +
             (joint->make.stribeck_Nm - joint->make.coulomb_Nm) * exp(-ratio * ratio);
  double before = joint->bristle_rad;
  /* Backward in time: stable at any speed. */
  joint->bristle_rad =
      (before + v * PLANT_STEP_S) / (1 + BRISTLE_STIFFNESS * fabs(v) / g * PLANT_STEP_S);
  return BRISTLE_STIFFNESS * joint->bristle_rad +
         BRISTLE_DAMPING * exp(-ratio * ratio) * (joint->bristle_rad - before) / PLANT_STEP_S;
}

static double motor_friction(plant *joint) {
  return (joint->make.dahl_Nm_per_rad > 0 ? dahl(joint) : lugre(joint)) +
         joint->make.viscous_Nms * joint->motor_rad_s;
}

void plant_step(plant *joint, double motor_Nm) {
  double output_rad_s = joint->motor_rad_s + joint->twist_rad_s;
  double load_Nm;
  joint->shaft_Nm =
      spring(joint) + joint->friction_Nm + joint->make.damping_Nms * joint->twist_rad_s;
  if (joint->braked) {
    joint->motor_rad_s = 0;
    joint->bristle_rad = 0;
    joint->dahl_Nm = 0;
  } else {
    double turning_Nm = motor_Nm + joint->shaft_Nm - motor_friction(joint);
    joint->motor_rad_s += turning_Nm / joint->make.rotor_kgm2 * PLANT_STEP_S;
    joint->motor_rad += joint->motor_rad_s * PLANT_STEP_S;
  }
  load_Nm = joint->outside_Nm - joint->gravity_Nm * sin(plant_output(joint)) - joint->shaft_Nm;
  output_rad_s += load_Nm / joint->make.arm_kgm2 * PLANT_STEP_S;
  joint->twist_rad_s = output_rad_s - joint->motor_rad_s;
  joint->twist_rad += joint->twist_rad_s * PLANT_STEP_S;
  rub(joint, joint->twist_rad_s * PLANT_STEP_S);
}

/* Newton's method would need the slope of the friction; a thousand small steps do not. */
double plant_bench(plant *joint, double torque_Nm, double turn_rad) {
  int rising = spring(joint) + joint->friction_Nm < torque_Nm;
  while ((spring(joint) + joint->friction_Nm < torque_Nm) == rising) {
    double turned_rad = rising ? turn_rad : -turn_rad;
    joint->twist_rad += turned_rad;
    rub(joint, turned_rad);
  }
  return joint->twist_rad;
}
