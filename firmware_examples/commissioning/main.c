/* The commissioning routine on a minimal simulated axis: the motor follows its command immediately,
 * the gear winds up according to the parameters, the level arm loads it with 20 N m. Runs it on the
 * axis as it is, then with three faults in the host. The exit code is the number of the run whose
 * finding differs from the expected one. */
#include "commissioning.h"

#include "../joint/params.h"
#include "sine.h"

#define RATIO 100.0f
#define GRAVITY_NM 20.0f
#define INERTIA_KGM2 1.0f
#define POSE_RAD 0.4f
#define MOST_TICKS 200000

typedef struct mistakes {
  float torque_sign, correction_sign, ratio;
} mistakes;

static commissioning run;
static lm_memory gear;

static float load_Nm(const commissioning_output *wish) {
  return -GRAVITY_NM * sine(wish->command_rad) - INERTIA_KGM2 * wish->acceleration_rad_s2;
}

static commissioning_finding try_axis(mistakes wrong) {
  commissioning_settings set = commissioning_suggest(&joint_parameters, wrong.ratio);
  commissioning_output out = {POSE_RAD, 0, 0, {0, 0, 0, 0, 0}, 0, COMMISSIONING_RUNNING, 0};
  int tick;
  lm_start_model(&gear, load_Nm(&out));
  lm_settle_model(&joint_parameters, &gear);
  (void)commissioning_start(&run, &set);
  for (tick = 0; tick < MOST_TICKS && out.finding == COMMISSIONING_RUNNING; ++tick) {
    commissioning_input now;
    lm_conditions at = LM_CONDITIONS_UNKNOWN;
    float torque_Nm = load_Nm(&out);
    /* The loop: command and correction to the motor. */
    float motor_rad = out.command_rad + wrong.correction_sign * out.correction.correction_rad;
    at.torque_Nm = torque_Nm;
    now.elapsed_s = JOINT_PARAMETERS_PERIOD_S;
    now.input_angle_rad = wrong.ratio * motor_rad;
    now.output_angle_rad =
        now.input_angle_rad / RATIO + lm_step_model(&joint_parameters, &gear, &at);
    now.reported_rad = motor_rad - out.correction.correction_rad;
    now.motor_torque_Nm = LM_UNKNOWN; /* no torque from the motor current */
    now.sensed_Nm = wrong.torque_sign * torque_Nm;
    now.motor_rad_s = LM_UNKNOWN;
    now.commanded_Nm = torque_Nm;
    now.conditions = at;
    now.conditions.torque_Nm = wrong.torque_sign * torque_Nm;
    out = commissioning_step(&run, &now);
  }
  return out.finding;
}

int main(void) {
  static const mistakes tried[] = {{1, 1, 100}, {-1, 1, 100}, {1, -1, 100}, {1, 1, 101}};
  static const commissioning_finding expected[] = {
      COMMISSIONING_NO_FAULT, COMMISSIONING_TORQUE_SIGN, COMMISSIONING_CORRECTION_SIGN,
      COMMISSIONING_RATIO};
  int i;
  for (i = 0; i < 4; ++i) {
    if (try_axis(tried[i]) != expected[i]) {
      return i + 1;
    }
  }
  return 0;
}
