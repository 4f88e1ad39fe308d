/* The position loop of a drive around the plant: cascade on the motor encoder, feed-forward, one of
 * four compensations, and the source of the torque for the library. */
#ifndef LOSTMOTION_TESTS_PLANT_LOOP_H
#define LOSTMOTION_TESTS_PLANT_LOOP_H

#include <stdint.h>

#include "joints.h"
#include "lostmotion/runtime.h"

#define SENSOR_NOISE_NM 0.1 /* rms */

typedef enum method { METHOD_NONE, METHOD_CONSTANT, METHOD_TABLE, METHOD_LIBRARY } method;

typedef enum torque_source {
  FROM_MODEL,      /* gravity and inertia of the command, gravity 2 % off */
  FROM_SENSOR,     /* that of the model, plus the slowly filtered difference measured by a sensor
  (torque.h) */
  FROM_RAW_SENSOR, /* unfiltered, with its noise */
  FROM_CURRENT,    /* estimated, filtered and held (torque.h) */
  FROM_RAW_CURRENT /* torque of the motor */
} torque_source;

typedef struct command {
  double angle_rad, velocity_rad_s, acceleration_rad_s2;
} command;

/* Known values of the joint, and their errors. */
typedef struct knowledge {
  const joint_kind *kind;
  const lm_parameters *parameters;
  const double *table_rad; /* true mean curve, to 1.5 times the rated torque in steps of 1/40 */
  double half_width_rad;   /* of the constant width */
  double gravity_share;    /* of the true gravity */
  double torque_factor;    /* on the stated values of library and table */
  double temperature_off_K;
  int output_loop;    /* the position loop closes on an encoder at the output */
  double ratio_share; /* the host's ratio over that of the gear */
  double error_Nm;    /* largest error of the torque as declared to the library; 0: not declared */
} knowledge;

typedef struct loop {
  method how;
  torque_source source;
  knowledge known;
  plant_make make;
  double period_s;
  lm_compensator compensator;
  lm_correction now;
  double correction_rad, correction_rad_s, correction_rad_s2;
  double side;
  double last_rad, speed_rad_s, wish_rad_s, sum_Nm, motor_Nm;
  double beyond_Nm, current_Nm, bound_Nm;
  float believed_Nm;
  uint32_t noise;
  uint32_t seen; /* status bits that were ever set */
  int64_t ticks, watch_ticks;
  int64_t first_fade; /* tick of the first LM_STATE_FADED, or -1 */
} loop;

/* Power-up with the loop open. Exits if the parameters are refused. */
void loop_start(loop *l, method how, torque_source source, const knowledge *known, double rate_Hz,
                const plant *joint);

/* Output angle as reported by the drive. */
double loop_reported(const loop *l, const plant *joint);

/* One tick; `closed` 0: the motor is braked or off, the compensation runs on. Returns the motor's
 * torque. */
double loop_tick(loop *l, const plant *joint, const command *wish, int closed);

/* Power-down and power-up: the history of the library is stored in lm_saved. */
void loop_power_cycle(loop *l, const plant *joint, const command *wish);

#endif
