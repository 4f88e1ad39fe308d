/* axis BLOB: lm_axis.h and lm_drive.h with the soft joint. BLOB: output of `lostmotion export` for
 * it at 1 kHz.
 *
 * Histories: the axis is homed after a load that the torque did not contain.
 * The gear is wound by a torque before the power-up; the zero, hence gravity, is unknown until the
 * first homing, or a sensor measures its first value. Then a load cycle, a stop that is commanded,
 * and one that is not, in motion. What lm_axis_reference returns has to cover the true error of the
 * zero, to be small after the load cycle and the commanded stop, and to move nothing. With a torque
 * from the motor current, whose friction is stated too large, gravity that is known since the first
 * homing is right as far as friction may hide the load; after a motion the declared error of the
 * torque covers that of the zero.
 *
 * Turns: a whole turn that is subtracted in motion moves nothing. Output: a loop on an encoder at
 * the output as on the page, with a smaller error in motion by the rates. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "blob.h"
#include "joints.h"
#include "lm_drive.h"

#define ARCSEC (3.14159265358979323846 / 648000)
#define PERIOD_S 1e-3
#define MODEL_RAD (8 * ARCSEC) /* of the fitted model with a known history: 3 arcsec */
#define POSE_RAD 0.8
#define MOVE_S 5.0
#define TURN_RAD 6.28318530717958648
#define REVERSAL_RAD_S 0.01
#define STANDSTILL_RAD_S 0.02
#define SENSOR_NM 0.05
#define FRICTION_KNOWN 1.7
#define RATIO (-100.0)

typedef struct host {
  plant joint;
  const joint_kind *kind;
  lm_axis axis;
  lm_drive drive;
  lm_axis_source source;
  lm_motor motor; /* as stated, 1 N m / A */
  double motor_Nm;
  int homed, run, fault;
  int on_output, without_rates;         /* the loop closes on the output */
  double turned_rad;                    /* of motor / ratio */
  double wish_rad, acceleration_rad_s2; /* planner */
  double from_rad, to_rad, moving_s;
  double last_rad, speed_rad_s, wish_rad_s, sum_Nm;
  uint32_t noise;
} host;

static double clip(double value, double most) {
  return value > most ? most : value < -most ? -most : value;
}

/* That closes the loop, at the output. */
static double encoder(const host *h) {
  return (h->on_output ? plant_output(&h->joint) : plant_motor_encoder(&h->joint)) + h->turned_rad;
}

/* Its reading per angle of the output. */
static double turns(const host *h) {
  return h->on_output ? 1 : RATIO;
}

static double position_loop(host *h, double setpoint_rad) {
  const joint_kind *kind = h->kind;
  const double measured_rad = plant_motor_encoder(&h->joint);
  const double rate_rad_s = h->without_rates ? (double)h->axis.moved_rad / PERIOD_S
                                             : (double)lm_axis_rate(&h->axis) / RATIO;
  const double share = 1 - exp(-kind->speed_filter_per_s * PERIOD_S);
  double push_Nm;
  h->speed_rad_s += share * ((measured_rad - h->last_rad) / PERIOD_S - h->speed_rad_s);
  h->last_rad = measured_rad;
  h->wish_rad_s += share * (rate_rad_s - h->wish_rad_s);
  if (!h->drive.enable) {
    h->sum_Nm = 0;
    return 0;
  }
  push_Nm =
      kind->velocity_gain_Nms *
      (h->wish_rad_s + kind->position_gain_per_s * (setpoint_rad - encoder(h)) - h->speed_rad_s);
  h->sum_Nm = clip(h->sum_Nm + kind->integral_per_s * push_Nm * PERIOD_S, kind->torque_max_Nm);
  push_Nm += h->joint.make.coulomb_Nm * clip(rate_rad_s / REVERSAL_RAD_S, 1) +
             h->joint.make.viscous_Nms * rate_rad_s +
             h->joint.make.rotor_kgm2 * h->acceleration_rad_s2;
  return clip(push_Nm + h->sum_Nm + (double)lm_axis_feed(&h->axis) * RATIO, kind->torque_max_Nm);
}

/* From rest to rest, with a continuous acceleration. */
static void plan(host *h) {
  const double turn = 2 * 3.14159265358979323846;
  const double way_rad = h->to_rad - h->from_rad;
  const double share = fmin(h->moving_s / MOVE_S, 1);
  h->wish_rad = h->from_rad + way_rad * (share - sin(turn * share) / turn);
  h->acceleration_rad_s2 = way_rad * turn / (MOVE_S * MOVE_S) * sin(turn * share);
  h->moving_s += PERIOD_S;
}

static void rest_at(host *h, double angle_rad) {
  h->from_rad = angle_rad;
  h->to_rad = angle_rad;
  h->moving_s = MOVE_S;
}

static void tick(host *h) {
  lm_axis *a = &h->axis;
  const lm_drive_report report = {.enabled = h->drive.enable, .fault = h->fault};
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  float commanded_Nm;
  int i;
  plan(h);
  lm_drive_step(&h->drive, a, &report, h->run);
  commanded_Nm =
      lm_axis_gravity(a, (float)(-h->kind->gravity_Nm * sin((double)a->command_rad)), h->homed) -
      (float)(h->joint.make.arm_kgm2 * h->acceleration_rad_s2);
  h->noise = h->noise * 1664525u + 1013904223u;
  at.torque_Nm = h->source == LM_AXIS_SENSOR
                     ? lm_axis_use_sensor(a, commanded_Nm,
                                          (float)(h->joint.shaft_Nm +
                                                  SENSOR_NM * ((h->noise >> 8) / 8388608.0 - 1)))
                 : h->source == LM_AXIS_CURRENT
                     ? lm_axis_use_current(a, &h->motor, commanded_Nm, (float)(h->motor_Nm / RATIO),
                                           (float)(h->speed_rad_s * RATIO),
                                           (float)h->acceleration_rad_s2, h->drive.follows)
                     : lm_axis_use_command(a, commanded_Nm);
  at.temperature_C = 20;
  h->motor_Nm = position_loop(h, (double)lm_axis_tick(a, &at, (float)(encoder(h) * turns(h)),
                                                      (float)h->wish_rad, h->drive.follows) /
                                     turns(h));
  if (a->state != LM_AXIS_CLOSED) {
    rest_at(h, (double)a->command_rad);
  }
  h->joint.braked = !h->drive.release;
  for (i = 0; i < (int)(PERIOD_S / PLANT_STEP_S + 0.5); ++i) {
    plant_step(&h->joint, h->motor_Nm);
  }
}

static void wait_for(host *h, double seconds) {
  int k;
  for (k = 0; k < (int)(seconds / PERIOD_S); ++k) {
    tick(h);
  }
}

static int command(host *h, int run) {
  h->run = run;
  wait_for(h, 4);
  return (h->axis.state == LM_AXIS_CLOSED) == run;
}

static void move(host *h, double to_rad, double seconds) {
  h->from_rad = h->wish_rad;
  h->to_rad = to_rad;
  h->moving_s = 0;
  wait_for(h, seconds);
}

/* Homes where the axis is. The plant has no lost motion where motor and output agree: the right
 * zero is 0. */
static int home(host *h, const char *when, int known) {
  const double output_rad = plant_output(&h->joint);
  const double bound_rad =
      (double)lm_axis_reference(&h->axis, (float)(encoder(h) * turns(h)), (float)output_rad);
  const double error_rad = fabs((double)h->axis.zero_rad);
  double moved_rad;
  int fine;
  h->homed = 1;
  rest_at(h, (double)h->axis.command_rad);
  wait_for(h, 0.5);
  moved_rad = fabs(plant_output(&h->joint) - output_rad);
  fine = error_rad <= bound_rad && (!known || bound_rad < MODEL_RAD) &&
         moved_rad < h->kind->tolerance_rad && h->axis.state == LM_AXIS_CLOSED;
  printf("%-28s returned %6.1f, true %6.1f, moved %4.1f arcsec %s\n", when, bound_rad / ARCSEC,
         error_rad / ARCSEC, moved_rad / ARCSEC, fine ? "ok" : "WRONG");
  return fine;
}

/* Winds the gear behind the brake, then lets it stand. */
static void wind(host *h, double torque_Nm) {
  int k;
  h->joint.braked = 1;
  for (k = 0; k < (int)(4 / PLANT_STEP_S); ++k) {
    const double seconds = k * PLANT_STEP_S;
    h->joint.outside_Nm = torque_Nm * (seconds < 1 ? seconds : seconds < 2 ? 2 - seconds : 0);
    plant_step(&h->joint, 0);
  }
  h->joint.outside_Nm = 0;
}

/* Power-up with the brake on and the zero unknown. */
static int start(host *h, const lm_parameters *parameters, int on_output, double history_Nm) {
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  memset(h, 0, sizeof *h);
  h->kind = find_joint("soft");
  h->on_output = on_output;
  h->drive.opening_s = 0.1f;
  h->drive.closing_s = 0.1f;
  start_joint(&h->joint, h->kind);
  h->joint.motor_rad = POSE_RAD;
  wind(h, history_Nm);
  h->last_rad = plant_motor_encoder(&h->joint);
  at.temperature_C = 20;
  h->axis.ratio = (float)RATIO;
  h->axis.output_loop = on_output;
  if (lm_drive_power_up(&h->drive, &h->axis, parameters, 0, &at, (float)(encoder(h) * turns(h)),
                        0) != LM_OK) {
    return 0;
  }
  h->axis.commissioned = 1;
  h->motor.torque_constant_Nm_per_A = 1;
  h->motor.ratio = (float)RATIO;
  h->motor.efficiency = 1;
  h->motor.rotor_inertia_kg_m2 = (float)(h->joint.make.rotor_kgm2 / (RATIO * RATIO));
  h->motor.coulomb_Nm = (float)(FRICTION_KNOWN * h->joint.make.coulomb_Nm / fabs(RATIO));
  h->motor.viscous_Nm_s = (float)(h->joint.make.viscous_Nms / (RATIO * RATIO));
  h->motor.standstill_rad_s = (float)(STANDSTILL_RAD_S * fabs(RATIO));
  rest_at(h, (double)h->axis.command_rad);
  return 1;
}

static int judge_history(const lm_parameters *parameters, lm_axis_source source,
                         double history_Nm) {
  static const char *const names[] = {"command", "sensor", "current"};
  static host h;
  int fine = start(&h, parameters, 0, history_Nm);
  const int exact = source != LM_AXIS_CURRENT;
  h.source = source;
  printf("%s, history %.0f N m\n", names[source], history_Nm);
  wait_for(&h, 0.1);
  fine = command(&h, 1) && fine;
  if (source != LM_AXIS_SENSOR) { /* gravity becomes known by the first */
    const double bound_rad = (double)lm_axis_reference(&h.axis, (float)(encoder(&h) * turns(&h)),
                                                       (float)plant_output(&h.joint));
    fine = fine && (source != LM_AXIS_COMMAND || fabs((double)h.axis.zero_rad) <= bound_rad);
    h.homed = 1;
    (void)lm_axis_pause(&h.axis);
    wait_for(&h, 4);
  }
  fine = home(&h, "first homing", 0) && fine;
  if (!exact) {
    lm_declare_torque_error(&h.axis.compensator, lm_bound_torque(&h.motor, h.axis.torque_Nm, 0));
  }
  move(&h, -1.2, MOVE_S + 1);
  move(&h, 1.2, MOVE_S + 1);
  move(&h, POSE_RAD, MOVE_S + 1);
  fine = home(&h, "after a load cycle", exact) && fine;
  fine = command(&h, 0) && command(&h, 1) && fine;
  fine = home(&h, "after a stop", exact) && fine;
  move(&h, -POSE_RAD, 0.4 * MOVE_S);
  h.fault = 1;
  h.run = 0;
  wait_for(&h, 2);
  h.fault = 0;
  fine = command(&h, 1) && fine;
  return home(&h, "after a trip in motion", 0) && fine;
}

/* As the page has it. */
static void turn(host *h, double by_rad) {
  h->turned_rad += by_rad;
  h->wish_rad += by_rad; /* the planner */
  h->from_rad += by_rad;
  h->to_rad += by_rad;
  lm_axis_turn(&h->axis, (float)by_rad);
}

/* The same motion with and without turns that are subtracted in it. */
static int judge_turns(const lm_parameters *parameters) {
  static host turned, straight;
  double most_rad = 0;
  int fine = start(&turned, parameters, 0, 0) && start(&straight, parameters, 0, 0);
  int k;
  turned.homed = 1;
  straight.homed = 1;
  wait_for(&turned, 0.1);
  wait_for(&straight, 0.1);
  fine = command(&turned, 1) && command(&straight, 1) && fine;
  move(&turned, -POSE_RAD, 0);
  move(&straight, -POSE_RAD, 0);
  for (k = 0; k < (int)(MOVE_S / PERIOD_S); ++k) {
    if (k % 1000 == 500) {
      turn(&turned, k % 2000 < 1000 ? -TURN_RAD : TURN_RAD);
    }
    tick(&turned);
    tick(&straight);
    most_rad = fmax(most_rad, fabs(plant_output(&turned.joint) - plant_output(&straight.joint)));
  }
  fine = fine && turned.axis.state == LM_AXIS_CLOSED && most_rad < turned.kind->tolerance_rad;
  printf("%-28s moved %4.1f arcsec %s\n", "turns in motion", most_rad / ARCSEC,
         fine ? "ok" : "WRONG");
  return fine;
}

/* rms of the error of the output through two reversals of the load. */
static double reverse(const lm_parameters *parameters, int without_rates) {
  static host h;
  double power_rad2 = 0;
  const int ticks = (int)(2 * MOVE_S / PERIOD_S);
  int k;
  if (!start(&h, parameters, 1, 0)) {
    return NAN;
  }
  h.homed = 1;
  h.without_rates = without_rates;
  wait_for(&h, 0.1);
  if (!command(&h, 1)) {
    return NAN;
  }
  for (k = 0; k < ticks; ++k) {
    const double output_rad = plant_output(&h.joint);
    double error_rad;
    if (k % (ticks / 2) == 0) {
      move(&h, k == 0 ? -POSE_RAD : POSE_RAD, 0);
    }
    tick(&h);
    error_rad = output_rad - (double)h.axis.command_rad;
    power_rad2 += error_rad * error_rad / ticks;
  }
  return h.axis.state == LM_AXIS_CLOSED ? sqrt(power_rad2) : NAN;
}

static int judge_output(const lm_parameters *parameters) {
  const double without_rad = reverse(parameters, 1);
  const double with_rad = reverse(parameters, 0);
  const int fine = with_rad < without_rad;
  printf("%-28s without the rates %5.1f, with them %5.1f arcsec rms %s\n", "loop on the output",
         without_rad / ARCSEC, with_rad / ARCSEC, fine ? "ok" : "WRONG");
  return fine;
}

int main(int count, char **word) {
  static const double histories_Nm[] = {-60, -30, 0, 60};
  static const lm_effect *const effects[] = {&lm_effect_thermal_gap};
  static lm_parameters parameters;
  int fine = 1;
  int i;
  if (count != 2 || load(word[1], effects, 1, &parameters)) {
    return 2;
  }
  for (i = 0; i < 12; ++i) {
    fine = judge_history(&parameters, (lm_axis_source)(i % 3), histories_Nm[i / 3]) && fine;
  }
  fine = judge_turns(&parameters) && fine;
  fine = judge_output(&parameters) && fine;
  for (i = LM_AXIS_READY; i <= LM_AXIS_WAITS_COMMISSION; ++i) {
    const lm_drive waits = {.wait = (lm_axis_wait)i};
    fine = strlen(lm_drive_sentence(&waits)) > 0 && fine;
  }
  return !fine;
}
