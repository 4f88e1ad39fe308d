/* A joint for tests of the compensator that shares no formula with the library: a differential
 * equation in the twist of the gear, integrated in double precision.
 *
 *     twist = output angle - motor angle / ratio
 *     gear:   T = k1 s + k3 s^3 + F + c twist'        s = twist less ripple, beyond the dead zone
 *     ripple: an eccentric of 20 %, twice a turn of the motor
 *     F' = kb twist' (1 - |F / Fc| (1 + sgn(F twist')) / 2)              Bouc-Wen
 *     motor:  LuGre or Dahl friction, torque limit;   output: gravity arm, inertia, outside torque
 *
 * The dead zone opens with temperature. Motor quantities are those of the output side. With the
 * motor held the output of the joint that plant_start makes swings at 25 Hz. */
#ifndef LOSTMOTION_TESTS_PLANT_H
#define LOSTMOTION_TESTS_PLANT_H

#define PLANT_RATIO 100.0
#define PLANT_GRAVITY_NM 35.0 /* with the arm level; it hangs at angle 0 */
#define PLANT_ARM_KGM2 1.0
#define PLANT_ROTOR_KGM2 0.6
#define PLANT_COULOMB_NM 3.0 /* of the motor, on the output side */
#define PLANT_VISCOUS_NMS 3.0
#define PLANT_RATED_NM 40.0
#define PLANT_STEP_S 2.5e-5

/* Components of the joint; plant_start uses the numbers above and those of plant.c. */
typedef struct plant_make {
  double dead_rad; /* half the dead zone at 20 degrees C */
  double stiffness_Nm_per_rad, cubic_Nm_per_rad3, damping_Nms;
  double slip_Nm, stick_Nm_per_rad; /* friction of the gear when it slips and when it sticks */
  double arm_kgm2, rotor_kgm2;
  double coulomb_Nm, stribeck_Nm, viscous_Nms; /* of the motor */
  double counts;     /* of the motor's encoder over a turn of the output */
  double ripple_rad; /* of the gear's ratio: amplitude, twice a turn of the motor */
  double ratio;
  double dahl_Nm_per_rad; /* the motor's friction where it sticks, if it is Dahl's; 0: LuGre's */
} plant_make;

typedef struct plant {
  plant_make make;
  double motor_rad, motor_rad_s;
  double twist_rad, twist_rad_s;
  double bristle_rad; /* LuGre */
  double dahl_Nm;
  double friction_Nm; /* Bouc-Wen */
  double shaft_Nm;    /* torque of the gear */
  double gravity_Nm;  /* of this load, the arm level */
  double temperature_C;
  double outside_Nm; /* on the output */
  int braked;        /* the motor is held */
} plant;

/* At rest, arm hanging, gear not wound up. */
void plant_start(plant *joint);

/* One PLANT_STEP_S with a torque of the motor. */
void plant_step(plant *joint, double motor_Nm);

double plant_output(const plant *joint);

/* Counts of the motor's encoder, as an angle of the output side, rad. */
double plant_motor_encoder(const plant *joint);

/* The gear on a bench, motor locked, wound slowly to a torque in steps of turn_rad; returns the
 * twist. */
double plant_bench(plant *joint, double torque_Nm, double turn_rad);

#define PLANT_TURN_RAD 2e-8

#endif
