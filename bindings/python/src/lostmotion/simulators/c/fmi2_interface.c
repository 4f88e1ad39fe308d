/* The functions of FMI 2.0 for co-simulation. */
#include "fmi2.h"
#include "fmu.h"

#if defined(FMI2_FUNCTION_PREFIX) /* of a source FMU that is linked statically */
#define FMI2_JOIN(a, b) a##b
#define FMI2_EXPAND(a, b) FMI2_JOIN(a, b)
#define FMI2(name) FMI2_EXPAND(FMI2_FUNCTION_PREFIX, name)
#else
#define FMI2(name) name
#endif
#if defined(_WIN32)
#define FMI2_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define FMI2_EXPORT __attribute__((visibility("default")))
#else
#define FMI2_EXPORT
#endif
#define FMI2_STATUS FMI2_EXPORT fmi2Status

static fmi2Status fmi2_status(int done) {
  return done ? fmi2OK : fmi2Error;
}

static void fmi2_log(const fmu_instance *instance, const char *message) {
  const fmi2CallbackFunctions *callbacks = (const fmi2CallbackFunctions *)instance->callbacks;
  callbacks->logger(callbacks->componentEnvironment, instance->name, fmi2Error, "logStatusError",
                    "%s", message);
}

FMI2_EXPORT const char *FMI2(fmi2GetTypesPlatform)(void);
FMI2_EXPORT const char *FMI2(fmi2GetTypesPlatform)(void) {
  return "default";
}

FMI2_EXPORT const char *FMI2(fmi2GetVersion)(void);
FMI2_EXPORT const char *FMI2(fmi2GetVersion)(void) {
  return "2.0";
}

FMI2_STATUS FMI2(fmi2SetDebugLogging)(fmi2Component c, fmi2Boolean on, size_t count,
                                      const fmi2String category[]);
FMI2_STATUS FMI2(fmi2SetDebugLogging)(fmi2Component c, fmi2Boolean on, size_t count,
                                      const fmi2String category[]) {
  (void)on; /* errors are always logged, nothing else is */
  (void)count;
  (void)category;
  return fmi2_status(c != 0);
}

FMI2_EXPORT fmi2Component FMI2(fmi2Instantiate)(fmi2String name, fmi2Type type, fmi2String guid,
                                                fmi2String resources,
                                                const fmi2CallbackFunctions *callbacks,
                                                fmi2Boolean visible, fmi2Boolean logging);
FMI2_EXPORT fmi2Component FMI2(fmi2Instantiate)(fmi2String name, fmi2Type type, fmi2String guid,
                                                fmi2String resources,
                                                const fmi2CallbackFunctions *callbacks,
                                                fmi2Boolean visible, fmi2Boolean logging) {
  fmu_instance *instance;
  (void)resources;
  (void)visible;
  (void)logging;
  instance = fmu_new(name);
  if (!instance) {
    return 0;
  }
  instance->callbacks = callbacks;
  instance->log = callbacks && callbacks->logger ? fmi2_log : 0;
  if (type != fmi2CoSimulation || !guid || strcmp(guid, FMU_TOKEN) != 0) {
    (void)fmu_refuse(instance, "instantiate: this FMU is for co-simulation, GUID " FMU_TOKEN, 0);
    fmu_free(instance);
    return 0;
  }
  return instance;
}

FMI2_EXPORT void FMI2(fmi2FreeInstance)(fmi2Component c);
FMI2_EXPORT void FMI2(fmi2FreeInstance)(fmi2Component c) {
  fmu_free((fmu_instance *)c);
}

FMI2_STATUS FMI2(fmi2SetupExperiment)(fmi2Component c, fmi2Boolean tolerance_stated,
                                      fmi2Real tolerance, fmi2Real start_s, fmi2Boolean end_stated,
                                      fmi2Real end_s);
FMI2_STATUS FMI2(fmi2SetupExperiment)(fmi2Component c, fmi2Boolean tolerance_stated,
                                      fmi2Real tolerance, fmi2Real start_s, fmi2Boolean end_stated,
                                      fmi2Real end_s) {
  (void)tolerance_stated;
  (void)tolerance;
  (void)end_stated;
  (void)end_s;
  ((fmu_instance *)c)->state.value[OUT_TIME] = start_s;
  return fmi2OK;
}

FMI2_STATUS FMI2(fmi2EnterInitializationMode)(fmi2Component c);
FMI2_STATUS FMI2(fmi2EnterInitializationMode)(fmi2Component c) {
  ((fmu_instance *)c)->state.phase = FMU_INITIALISING;
  return fmi2OK;
}

FMI2_STATUS FMI2(fmi2ExitInitializationMode)(fmi2Component c);
FMI2_STATUS FMI2(fmi2ExitInitializationMode)(fmi2Component c) {
  fmu_instance *instance = (fmu_instance *)c;
  if (!fmu_initialise(instance)) {
    return fmi2Error;
  }
  instance->state.phase = FMU_RUNNING;
  return fmi2OK;
}

FMI2_STATUS FMI2(fmi2Terminate)(fmi2Component c);
FMI2_STATUS FMI2(fmi2Terminate)(fmi2Component c) {
  ((fmu_instance *)c)->state.phase = FMU_ENDED;
  return fmi2OK;
}

FMI2_STATUS FMI2(fmi2Reset)(fmi2Component c);
FMI2_STATUS FMI2(fmi2Reset)(fmi2Component c) {
  fmu_reset((fmu_instance *)c);
  return fmi2OK;
}

/* Get and set of a type of FMI whose variables are FMU_REAL or FMU_INTEGER. */
#define FMI2_VARIABLES(Type, type)                                                       \
  FMI2_STATUS FMI2(fmi2Get##Type)(fmi2Component c, const fmi2ValueReference reference[], \
                                  size_t count, fmi2##Type value[]);                     \
  FMI2_STATUS FMI2(fmi2Get##Type)(fmi2Component c, const fmi2ValueReference reference[], \
                                  size_t count, fmi2##Type value[]) {                    \
    size_t i;                                                                            \
    for (i = 0; i < count; ++i) {                                                        \
      double found;                                                                      \
      if (!fmu_get((fmu_instance *)c, reference[i], type, &found)) {                     \
        return fmi2Error;                                                                \
      }                                                                                  \
      value[i] = (fmi2##Type)found;                                                      \
    }                                                                                    \
    return fmi2OK;                                                                       \
  }                                                                                      \
  FMI2_STATUS FMI2(fmi2Set##Type)(fmi2Component c, const fmi2ValueReference reference[], \
                                  size_t count, const fmi2##Type value[]);               \
  FMI2_STATUS FMI2(fmi2Set##Type)(fmi2Component c, const fmi2ValueReference reference[], \
                                  size_t count, const fmi2##Type value[]) {              \
    size_t i;                                                                            \
    for (i = 0; i < count; ++i) {                                                        \
      if (!fmu_set((fmu_instance *)c, reference[i], type, (double)value[i])) {           \
        return fmi2Error;                                                                \
      }                                                                                  \
    }                                                                                    \
    return fmi2OK;                                                                       \
  }
FMI2_VARIABLES(Real, FMU_REAL)
FMI2_VARIABLES(Integer, FMU_INTEGER)

/* Types of which this FMU has no variables. */
#define FMI2_NO_VARIABLES(Type)                                                          \
  FMI2_STATUS FMI2(fmi2Get##Type)(fmi2Component c, const fmi2ValueReference reference[], \
                                  size_t count, fmi2##Type value[]);                     \
  FMI2_STATUS FMI2(fmi2Get##Type)(fmi2Component c, const fmi2ValueReference reference[], \
                                  size_t count, fmi2##Type value[]) {                    \
    (void)c;                                                                             \
    (void)reference;                                                                     \
    (void)value;                                                                         \
    return fmi2_status(count == 0);                                                      \
  }                                                                                      \
  FMI2_STATUS FMI2(fmi2Set##Type)(fmi2Component c, const fmi2ValueReference reference[], \
                                  size_t count, const fmi2##Type value[]);               \
  FMI2_STATUS FMI2(fmi2Set##Type)(fmi2Component c, const fmi2ValueReference reference[], \
                                  size_t count, const fmi2##Type value[]) {              \
    (void)c;                                                                             \
    (void)reference;                                                                     \
    (void)value;                                                                         \
    return fmi2_status(count == 0);                                                      \
  }
FMI2_NO_VARIABLES(Boolean)
FMI2_NO_VARIABLES(String)

FMI2_STATUS FMI2(fmi2GetFMUstate)(fmi2Component c, fmi2FMUstate *state);
FMI2_STATUS FMI2(fmi2GetFMUstate)(fmi2Component c, fmi2FMUstate *state) {
  *state = fmu_keep((const fmu_instance *)c, (fmu_state *)*state);
  return fmi2_status(*state != 0);
}

FMI2_STATUS FMI2(fmi2SetFMUstate)(fmi2Component c, fmi2FMUstate state);
FMI2_STATUS FMI2(fmi2SetFMUstate)(fmi2Component c, fmi2FMUstate state) {
  return fmi2_status(fmu_put_back((fmu_instance *)c, (const fmu_state *)state));
}

FMI2_STATUS FMI2(fmi2FreeFMUstate)(fmi2Component c, fmi2FMUstate *state);
FMI2_STATUS FMI2(fmi2FreeFMUstate)(fmi2Component c, fmi2FMUstate *state) {
  (void)c;
  if (state) {
    free(*state);
    *state = 0;
  }
  return fmi2OK;
}

FMI2_STATUS FMI2(fmi2SerializedFMUstateSize)(fmi2Component c, fmi2FMUstate state, size_t *size);
FMI2_STATUS FMI2(fmi2SerializedFMUstateSize)(fmi2Component c, fmi2FMUstate state, size_t *size) {
  (void)c;
  (void)state;
  *size = FMU_STATE_BYTES;
  return fmi2OK;
}

FMI2_STATUS FMI2(fmi2SerializeFMUstate)(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[],
                                        size_t size);
FMI2_STATUS FMI2(fmi2SerializeFMUstate)(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[],
                                        size_t size) {
  return fmi2_status(
      fmu_write_state((const fmu_instance *)c, (const fmu_state *)state, bytes, size));
}

FMI2_STATUS FMI2(fmi2DeSerializeFMUstate)(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                          fmi2FMUstate *state);
FMI2_STATUS FMI2(fmi2DeSerializeFMUstate)(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                          fmi2FMUstate *state) {
  *state = fmu_read_state((const fmu_instance *)c, bytes, size);
  return fmi2_status(*state != 0);
}

FMI2_STATUS FMI2(fmi2GetDirectionalDerivative)(fmi2Component c, const fmi2ValueReference unknown[],
                                               size_t unknowns, const fmi2ValueReference known[],
                                               size_t knowns, const fmi2Real seed[],
                                               fmi2Real sensitivity[]);
FMI2_STATUS FMI2(fmi2GetDirectionalDerivative)(fmi2Component c, const fmi2ValueReference unknown[],
                                               size_t unknowns, const fmi2ValueReference known[],
                                               size_t knowns, const fmi2Real seed[],
                                               fmi2Real sensitivity[]) {
  return fmi2_status(fmu_directional((const fmu_instance *)c, unknown, unknowns, known, knowns,
                                     seed, sensitivity));
}

FMI2_STATUS FMI2(fmi2SetRealInputDerivatives)(fmi2Component c, const fmi2ValueReference reference[],
                                              size_t count, const fmi2Integer order[],
                                              const fmi2Real value[]);
FMI2_STATUS FMI2(fmi2SetRealInputDerivatives)(fmi2Component c, const fmi2ValueReference reference[],
                                              size_t count, const fmi2Integer order[],
                                              const fmi2Real value[]) {
  (void)c; /* canInterpolateInputs is false */
  (void)reference;
  (void)order;
  (void)value;
  return fmi2_status(count == 0);
}

FMI2_STATUS FMI2(fmi2GetRealOutputDerivatives)(fmi2Component c,
                                               const fmi2ValueReference reference[], size_t count,
                                               const fmi2Integer order[], fmi2Real value[]);
FMI2_STATUS FMI2(fmi2GetRealOutputDerivatives)(fmi2Component c,
                                               const fmi2ValueReference reference[], size_t count,
                                               const fmi2Integer order[], fmi2Real value[]) {
  (void)c; /* maxOutputDerivativeOrder is 0 */
  (void)reference;
  (void)order;
  (void)value;
  return fmi2_status(count == 0);
}

FMI2_STATUS FMI2(fmi2DoStep)(fmi2Component c, fmi2Real time_s, fmi2Real step_s, fmi2Boolean final);
FMI2_STATUS FMI2(fmi2DoStep)(fmi2Component c, fmi2Real time_s, fmi2Real step_s, fmi2Boolean final) {
  (void) final;
  return fmi2_status(fmu_advance((fmu_instance *)c, time_s, step_s));
}

FMI2_STATUS FMI2(fmi2CancelStep)(fmi2Component c);
FMI2_STATUS FMI2(fmi2CancelStep)(fmi2Component c) {
  (void)c; /* a step never continues after doStep */
  return fmi2Error;
}

/* No step is ever pending, so none has a status. */
#define FMI2_NO_STATUS(name, type)                                                  \
  FMI2_STATUS FMI2(name)(fmi2Component c, const fmi2StatusKind kind, type *value);  \
  FMI2_STATUS FMI2(name)(fmi2Component c, const fmi2StatusKind kind, type *value) { \
    (void)c;                                                                        \
    (void)kind;                                                                     \
    (void)value;                                                                    \
    return fmi2Discard;                                                             \
  }
FMI2_NO_STATUS(fmi2GetStatus, fmi2Status)
FMI2_NO_STATUS(fmi2GetRealStatus, fmi2Real)
FMI2_NO_STATUS(fmi2GetIntegerStatus, fmi2Integer)
FMI2_NO_STATUS(fmi2GetBooleanStatus, fmi2Boolean)
FMI2_NO_STATUS(fmi2GetStringStatus, fmi2String)
