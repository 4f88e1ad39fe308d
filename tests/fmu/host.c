/* A host of FMI 2.0 in four threads, for the sanitizers: each runs an instance of its own, saves,
 * serializes and restores its state, makes calls that are refused, and frees everything. All must
 * get the same numbers, each in its own instance. */
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2.h"

fmi2Component fmi2Instantiate(fmi2String, fmi2Type, fmi2String, fmi2String,
                              const fmi2CallbackFunctions *, fmi2Boolean, fmi2Boolean);
void fmi2FreeInstance(fmi2Component);
fmi2Status fmi2SetupExperiment(fmi2Component, fmi2Boolean, fmi2Real, fmi2Real, fmi2Boolean,
                               fmi2Real);
fmi2Status fmi2EnterInitializationMode(fmi2Component);
fmi2Status fmi2ExitInitializationMode(fmi2Component);
fmi2Status fmi2Terminate(fmi2Component);
fmi2Status fmi2Reset(fmi2Component);
fmi2Status fmi2GetReal(fmi2Component, const fmi2ValueReference[], size_t, fmi2Real[]);
fmi2Status fmi2SetReal(fmi2Component, const fmi2ValueReference[], size_t, const fmi2Real[]);
fmi2Status fmi2DoStep(fmi2Component, fmi2Real, fmi2Real, fmi2Boolean);
fmi2Status fmi2GetFMUstate(fmi2Component, fmi2FMUstate *);
fmi2Status fmi2SetFMUstate(fmi2Component, fmi2FMUstate);
fmi2Status fmi2FreeFMUstate(fmi2Component, fmi2FMUstate *);
fmi2Status fmi2SerializedFMUstateSize(fmi2Component, fmi2FMUstate, size_t *);
fmi2Status fmi2SerializeFMUstate(fmi2Component, fmi2FMUstate, fmi2Byte[], size_t);
fmi2Status fmi2DeSerializeFMUstate(fmi2Component, const fmi2Byte[], size_t, fmi2FMUstate *);
fmi2Status fmi2GetDirectionalDerivative(fmi2Component, const fmi2ValueReference[], size_t,
                                        const fmi2ValueReference[], size_t, const fmi2Real[],
                                        fmi2Real[]);

enum { THREADS = 4, STEPS = 3000, LOST_MOTION = 10, TORQUE = 0, INPUT_ANGLE = 1, OUTPUT_ANGLE = 2 };

static void ignore(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                   fmi2String category, fmi2String message, ...) {
  (void)environment;
  (void)name;
  (void)status;
  (void)category;
  (void)message;
}

/* Oscillating inputs; those that this FMU does not have are refused, which is correct. */
static void set_inputs(fmi2Component c, int k) {
  const fmi2ValueReference reference[] = {TORQUE, INPUT_ANGLE, OUTPUT_ANGLE};
  double wave = (double)(k % 400) / 200.0 - 1.0;
  double swing = wave < 0 ? 2 * wave + 1 : 1 - 2 * wave;
  double value[3];
  int i;
  value[0] = 60.0 * swing * (double)(k % 1300) / 1300.0;
  value[1] = 0.01 * k;
  value[2] = 0.0001 * k + 1e-3 * swing;
  for (i = 0; i < 3; ++i) {
    (void)fmi2SetReal(c, &reference[i], 1, &value[i]);
  }
}

static double go(fmi2Component c, int from, int to) {
  const fmi2ValueReference lost = LOST_MOTION;
  double sum = 0;
  int k;
  for (k = from; k < to; ++k) {
    double found = 0;
    set_inputs(c, k);
    if (fmi2DoStep(c, 1e-3 * k, 1e-3, fmi2True) != fmi2OK ||
        fmi2GetReal(c, &lost, 1, &found) != fmi2OK) {
      return -1e9;
    }
    sum += found * (k % 7 + 1);
  }
  return sum;
}

static fmi2Component start(void) {
  static const fmi2CallbackFunctions callbacks = {ignore, calloc, free, 0, 0};
  fmi2Component c =
      fmi2Instantiate("drive", fmi2CoSimulation, FMU_TOKEN, "", &callbacks, fmi2False, fmi2False);
  if (c) {
    (void)fmi2SetupExperiment(c, fmi2False, 0, 0, fmi2False, 0);
    (void)fmi2EnterInitializationMode(c);
    (void)fmi2ExitInitializationMode(c);
  }
  return c;
}

static void *run(void *result) {
  static const fmi2CallbackFunctions callbacks = {ignore, calloc, free, 0, 0};
  const fmi2ValueReference lost = LOST_MOTION;
  const fmi2ValueReference torque = TORQUE;
  const fmi2ValueReference nowhere = 1000000;
  const double one = 1;
  double derivative = 0;
  double first;
  fmi2FMUstate state = 0;
  fmi2FMUstate copy = 0;
  fmi2Byte *bytes;
  size_t size = 0;
  fmi2Component c = start();
  fmi2Component other = start();
  if (!c || !other) {
    return result;
  }
  (void)go(c, 0, STEPS / 2);
  (void)fmi2GetFMUstate(c, &state);
  (void)fmi2SerializedFMUstateSize(c, state, &size);
  bytes = (fmi2Byte *)malloc(size);
  if (!bytes) {
    return result;
  }
  (void)fmi2SerializeFMUstate(c, state, bytes, size);
  first = go(c, STEPS / 2, STEPS);
  (void)fmi2SetFMUstate(c, state);
  if (go(c, STEPS / 2, STEPS) != first) {
    first = -2e9;
  }
  (void)fmi2DeSerializeFMUstate(other, bytes, size, &copy);
  (void)fmi2SetFMUstate(other, copy);
  (void)fmi2FreeFMUstate(other, &copy);
  if (go(other, STEPS / 2, STEPS) != first) {
    first = -3e9;
  }
  /* refused, and nothing leaks of them */
  bytes[size / 2] ^= 1;
  if (fmi2DeSerializeFMUstate(c, bytes, size, &copy) == fmi2OK ||
      fmi2DeSerializeFMUstate(c, bytes, size - 1, &copy) == fmi2OK ||
      fmi2SetReal(c, &nowhere, 1, &one) == fmi2OK || fmi2SetReal(c, &lost, 1, &one) == fmi2OK ||
      fmi2DoStep(c, 0, -1.0, fmi2True) == fmi2OK || fmi2SetFMUstate(c, 0) == fmi2OK ||
      fmi2Instantiate("x", fmi2CoSimulation, "another", "", &callbacks, 0, 0) ||
      fmi2Instantiate("x", fmi2ModelExchange, FMU_TOKEN, "", &callbacks, 0, 0)) {
    first = -4e9;
  }
  (void)fmi2GetDirectionalDerivative(c, &lost, 1, &torque, 1, &one, &derivative);
  (void)fmi2FreeFMUstate(c, &state);
  free(bytes);
  (void)fmi2Reset(c);
  (void)fmi2EnterInitializationMode(c);
  (void)fmi2ExitInitializationMode(c);
  (void)go(c, 0, STEPS / 2);
  if (go(c, STEPS / 2, STEPS) != first) {
    first = -5e9;
  }
  (void)fmi2Terminate(c);
  fmi2FreeInstance(c);
  fmi2FreeInstance(other);
  fmi2FreeInstance(0);
  *(double *)result = first;
  return result;
}

int main(void) {
  pthread_t thread[THREADS];
  double result[THREADS];
  int i;
  for (i = 0; i < THREADS; ++i) {
    result[i] = -6e9;
    if (pthread_create(&thread[i], 0, run, &result[i]) != 0) {
      return 2;
    }
  }
  for (i = 0; i < THREADS; ++i) {
    (void)pthread_join(thread[i], 0);
  }
  for (i = 0; i < THREADS; ++i) {
    if (result[i] != result[0] || result[i] < -1e8) {
      printf("thread %d: %g, thread 0: %g\n", i, result[i], result[0]);
      return 1;
    }
  }
  printf("%d threads agree\n", (int)THREADS);
  return 0;
}
