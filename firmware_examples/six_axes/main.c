/* Six axes of a robot, each with the parameters of its blob.
 *
 * Blobs are checked: lm_load_parameters rejects a blob that is damaged, of another version or
 * larger than the sizes of this build. It cannot check that the parameters belong to the joint:
 * compare the fingerprint for that. An axis whose blob is rejected is not started, corrects nothing
 * and reports LM_STATE_NOT_STARTED; its loop is not closed.
 *
 * Prints the RAM of six axes; the exit code is the number of the check that failed. */
#include "lostmotion/runtime.h"

#include "blobs.h"
#include "target.h"

#define AXES 6
#define TICKS 2000

typedef struct axis {
  lm_parameters parameters; /* in RAM: they were loaded */
  lm_compensator compensator;
} axis;

typedef struct place {
  const uint8_t *blob;
  uint32_t length;
  uint32_t fingerprint; /* of the joint that was assembled here */
  float load_Nm;
} place;

static axis robot[AXES];
static lm_correction now[AXES];

static const place places[AXES] = {
    {base_blob, sizeof base_blob, BASE_FINGERPRINT, 10},
    {shoulder_blob, sizeof shoulder_blob, SHOULDER_FINGERPRINT, -60},
    {elbow_blob, sizeof elbow_blob, ELBOW_FINGERPRINT, -25},
    {forearm_blob, sizeof forearm_blob, FOREARM_FINGERPRINT, 4},
    {wrist_blob, sizeof wrist_blob, WRIST_FINGERPRINT, -5},
    {flange_blob, sizeof flange_blob, FLANGE_FINGERPRINT, 1},
};

/* Load, compare, start, settle: the position loop of this axis is open. */
static lm_status power_up(axis *a, const place *at, const uint8_t *blob, lm_correction *correction,
                          lm_fault *fault) {
  lm_conditions conditions = LM_CONDITIONS_UNKNOWN;
  lm_status status = lm_load_parameters(&a->parameters, blob, at->length, 0, 0, fault);
  if (status == LM_OK && a->parameters.fingerprint != at->fingerprint) {
    fault->status = LM_INCONSISTENT;
    fault->input = "fingerprint"; /* the parameters of another joint */
    status = LM_INCONSISTENT;
  }
  if (status == LM_OK) {
    status = lm_start_compensator(&a->compensator, &a->parameters, at->load_Nm, fault);
  }
  conditions.torque_Nm = at->load_Nm;
  *correction = lm_settle_compensator(&a->compensator, &conditions);
  return status;
}

static void tick(float share) {
  int i;
  for (i = 0; i < AXES; ++i) {
    lm_conditions conditions = LM_CONDITIONS_UNKNOWN;
    conditions.torque_Nm = share * places[i].load_Nm;
    now[i] = lm_step_compensator(&robot[i].compensator, &conditions);
  }
}

/* Parameters of a neighbour, and a damaged byte: refused, and the axis corrects nothing. */
static int check_refusals(void) {
  static axis spare;
  static uint8_t damaged[sizeof elbow_blob];
  lm_correction correction;
  lm_fault fault;
  uint32_t i;
  place wrong = places[2];
  wrong.fingerprint = FOREARM_FINGERPRINT;
  if (power_up(&spare, &wrong, elbow_blob, &correction, &fault) != LM_INCONSISTENT ||
      !(correction.status & LM_STATE_NOT_STARTED)) {
    return 1;
  }
  for (i = 0; i < sizeof elbow_blob; ++i) {
    damaged[i] = elbow_blob[i];
  }
  damaged[100] ^= 4;
  if (power_up(&spare, &places[2], damaged, &correction, &fault) != LM_CORRUPT ||
      !(correction.status & LM_STATE_NOT_STARTED) || correction.correction_rad < 0 ||
      correction.correction_rad > 0) {
    return 2;
  }
  return 0;
}

int main(void) {
  lm_fault fault;
  int i;
  int k;
  int failed = check_refusals();
  if (failed) {
    return failed;
  }
  for (i = 0; i < AXES; ++i) {
    if (power_up(&robot[i], &places[i], places[i].blob, &now[i], &fault) != LM_OK) {
      return 10 + i;
    }
  }
  for (k = 0; k < TICKS; ++k) { /* every load falls to zero and returns */
    float share = 2.0f * (float)k / TICKS - 1;
    tick(share < 0 ? -share : share);
  }
  for (k = 0; k < TICKS; ++k) { /* and stays */
    tick(1);
  }
  for (i = 0; i < AXES; ++i) { /* for a load against the motion the motor goes further */
    if (now[i].correction_rad * places[i].load_Nm >= 0 || !(now[i].status & LM_STATE_SETTLED)) {
      return 20 + i;
    }
  }
  target_print("RAM of six axes, bytes: ");
  target_print_number((int32_t)sizeof robot);
  target_print("\n");
  return 0;
}
