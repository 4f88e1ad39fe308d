#include "duty.h"

#include <math.h>

#include "draw.h"
#include "plant.h"

#define SAMPLE_S 0.01
#define TURN_RAD 5e-7         /* of the quasi-static gear: 0.1 arcsec */
#define MEASURED_NOISE 1e-5   /* rms, rad: 2 arcsec */
#define TORQUE_NOISE_NM 0.3   /* rms */
#define GRAVITY_OFF 0.05      /* of the load as it is known, rms over tasks */
#define TEMPERATURE_OFF_K 3.0 /* rms */

/* A task: move to a position, then rest, hover or jog there. */
typedef struct task {
  double from_rad, to_rad, move_s, stay_s, unrest_rad, unrest_rad_s, jog_rad, gravity_share;
} task;

static task next_task(double from_rad) {
  task t = {0, 0, 0, 0, 0, 0, 0, 1};
  double kind = draw(0, 1);
  t.from_rad = from_rad;
  t.to_rad = kind < 0.15 ? draw(-0.02, 0.02) : draw(-1.1, 1.1);
  t.move_s = draw(0.4, 2.5);
  t.stay_s = kind < 0.1 ? draw(10, 60) : draw(0.2, 5);
  if (kind > 0.6) {
    t.unrest_rad = kind > 0.8 ? draw(5e-5, 2e-3) : 0;
    t.unrest_rad_s = draw(2, 15);
    t.jog_rad = kind > 0.8 ? 0 : draw(-0.01, 0.01);
  }
  t.gravity_share = 1 + GRAVITY_OFF * gauss();
  return t;
}

static void angle_at(const task *t, double time_s, double *angle_rad, double *change_rad_s2) {
  double u = time_s / t->move_s;
  double way = t->to_rad - t->from_rad;
  double after_s = time_s - t->move_s;
  if (u < 1) {
    *angle_rad = t->from_rad + way * u * u * u * (10 + u * (6 * u - 15));
    *change_rad_s2 = way / (t->move_s * t->move_s) * 60 * u * (1 - u) * (1 - 2 * u);
    return;
  }
  *angle_rad = t->to_rad + t->unrest_rad * sin(t->unrest_rad_s * after_s) +
               t->jog_rad * floor(after_s) * (fmod(floor(after_s), 2) * 2 - 1);
  *change_rad_s2 =
      -t->unrest_rad * t->unrest_rad_s * t->unrest_rad_s * sin(t->unrest_rad_s * after_s);
}

long run_duty(const lm_parameters *parameters, double hours, misuse wrong, int until_caught,
              unsigned seed, double *first_s) {
  plant joint;
  lm_compensator c;
  lm_conditions at = LM_CONDITIONS_UNKNOWN;
  task now;
  double time_s = 0;
  double off_K = 0;
  double zero_rad = 0.3;
  double began_s = until_caught ? -1 : 0;
  long fades = 0;
  int was_faded = 0;
  int64_t samples = (int64_t)(hours * 3600 / SAMPLE_S);
  int64_t k;
  state = 0x9E3779B97F4A7C15u * (seed + 1u);
  *first_s = -1;
  plant_start(&joint);
  joint.temperature_C = 30;
  now = next_task(0);
  if (lm_start_compensator(&c, parameters, 0, 0) != LM_OK) {
    return -1;
  }
  for (k = 0; k < samples; ++k) {
    double angle_rad;
    double change_rad_s2;
    double torque_Nm;
    double known_Nm;
    double twist_rad;
    uint32_t status;
    if (time_s > now.move_s + now.stay_s) {
      angle_at(&now, time_s, &angle_rad, &change_rad_s2);
      now = next_task(angle_rad);
      time_s = 0;
      off_K = TEMPERATURE_OFF_K * gauss();
      zero_rad += 2e-6 * gauss(); /* the encoders drift apart */
    }
    joint.temperature_C += 0.003 * gauss() - 1e-5 * (joint.temperature_C - 30);
    angle_at(&now, time_s, &angle_rad, &change_rad_s2);
    torque_Nm = -PLANT_GRAVITY_NM * sin(angle_rad) - PLANT_ARM_KGM2 * change_rad_s2;
    known_Nm = -now.gravity_share * PLANT_GRAVITY_NM * sin(angle_rad) -
               PLANT_ARM_KGM2 * change_rad_s2 + TORQUE_NOISE_NM * gauss();
    twist_rad = plant_bench(&joint, torque_Nm, TURN_RAD);
    if (began_s < 0 && fabs(twist_rad) > 2 * (double)parameters->watch.misfit_rad) {
      began_s = (double)k * SAMPLE_S;
    }
    at.torque_Nm = (float)(wrong.torque_factor * known_Nm);
    at.temperature_C = (float)(joint.temperature_C + off_K);
    (void)lm_step_compensator(&c, &at);
    lm_watch_output(
        &c, (float)((wrong.compensated ? 0 : twist_rad) + zero_rad + MEASURED_NOISE * gauss()),
        (float)SAMPLE_S);
    status = c.standing & LM_STATE_FADED;
    if (status && !was_faded) {
      fades += 1;
      if (*first_s < 0) {
        *first_s = began_s < 0 ? 0 : (double)k * SAMPLE_S - began_s;
      }
      if (until_caught) {
        return fades;
      }
    }
    was_faded = status != 0;
    time_s += SAMPLE_S;
  }
  return fades;
}
