/* The functions of FMI 3.0 for co-simulation; those of other kinds of FMUs are refused. */
#include "fmi3.h"
#include "fmu.h"

#if defined(FMI3_FUNCTION_PREFIX) /* of a source FMU that is linked statically */
#define FMI3_JOIN(a, b) a##b
#define FMI3_EXPAND(a, b) FMI3_JOIN(a, b)
#define FMI3(name) FMI3_EXPAND(FMI3_FUNCTION_PREFIX, name)
#else
#define FMI3(name) name
#endif
#if defined(_WIN32)
#define FMI3_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define FMI3_EXPORT __attribute__((visibility("default")))
#else
#define FMI3_EXPORT
#endif

/* A function of the interface: declared, then defined. */
#define FMI3_FUNCTION(type, name, arguments) \
  FMI3_EXPORT type FMI3(name) arguments;     \
  FMI3_EXPORT type FMI3(name) arguments

/* A function that a co-simulation FMU of this kind does not have. */
#define FMI3_REFUSED(name, arguments)          \
  FMI3_FUNCTION(fmi3Status, name, arguments) { \
    return fmi3Error;                          \
  }

#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter" /* of the functions that are refused */
#endif

static fmi3Status fmi3_status(int done) {
  return done ? fmi3OK : fmi3Error;
}

static void fmi3_log(const fmu_instance *instance, const char *message) {
  fmi3LogMessageCallback *const *say = (fmi3LogMessageCallback *const *)&instance->callbacks;
  (*say)(instance->environment, fmi3Error, "logStatusError", message);
}

FMI3_FUNCTION(const char *, fmi3GetVersion, (void)) {
  return "3.0";
}

FMI3_FUNCTION(fmi3Status, fmi3SetDebugLogging,
              (fmi3Instance c, fmi3Boolean on, size_t count, const fmi3String category[])) {
  return fmi3_status(c != 0); /* errors are always logged, nothing else is */
}

FMI3_FUNCTION(fmi3Instance, fmi3InstantiateCoSimulation,
              (fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
               fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early_return,
               const fmi3ValueReference intermediate[], size_t intermediates,
               fmi3InstanceEnvironment environment, fmi3LogMessageCallback *log,
               fmi3IntermediateUpdateCallback *update)) {
  fmu_instance *instance = fmu_new(name);
  if (!instance) {
    return 0;
  }
  memcpy(&instance->callbacks, &log, sizeof instance->callbacks);
  instance->environment = environment;
  instance->log = log ? fmi3_log : 0;
  if (!token || strcmp(token, FMU_TOKEN) != 0) {
    (void)fmu_refuse(instance, "instantiate: the instantiation token is " FMU_TOKEN, 0);
    fmu_free(instance);
    return 0;
  }
  return instance;
}

FMI3_FUNCTION(fmi3Instance, fmi3InstantiateModelExchange,
              (fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
               fmi3Boolean logging, fmi3InstanceEnvironment environment,
               fmi3LogMessageCallback *log)) {
  return 0;
}

FMI3_FUNCTION(fmi3Instance, fmi3InstantiateScheduledExecution,
              (fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
               fmi3Boolean logging, fmi3InstanceEnvironment environment,
               fmi3LogMessageCallback *log, fmi3ClockUpdateCallback *clock,
               fmi3LockPreemptionCallback *lock, fmi3UnlockPreemptionCallback *unlock)) {
  return 0;
}

FMI3_FUNCTION(void, fmi3FreeInstance, (fmi3Instance c)) {
  fmu_free((fmu_instance *)c);
}

FMI3_FUNCTION(fmi3Status, fmi3EnterInitializationMode,
              (fmi3Instance c, fmi3Boolean tolerance_stated, fmi3Float64 tolerance,
               fmi3Float64 start_s, fmi3Boolean end_stated, fmi3Float64 end_s)) {
  ((fmu_instance *)c)->state.value[OUT_TIME] = start_s;
  ((fmu_instance *)c)->state.phase = FMU_INITIALISING;
  return fmi3OK;
}

FMI3_FUNCTION(fmi3Status, fmi3ExitInitializationMode, (fmi3Instance c)) {
  fmu_instance *instance = (fmu_instance *)c;
  if (!fmu_initialise(instance)) {
    return fmi3Error;
  }
  instance->state.phase = FMU_RUNNING;
  return fmi3OK;
}

FMI3_FUNCTION(fmi3Status, fmi3Terminate, (fmi3Instance c)) {
  ((fmu_instance *)c)->state.phase = FMU_ENDED;
  return fmi3OK;
}

FMI3_FUNCTION(fmi3Status, fmi3Reset, (fmi3Instance c)) {
  fmu_reset((fmu_instance *)c);
  return fmi3OK;
}

/* Get and set of a type of FMI whose variables are FMU_REAL or FMU_INTEGER. */
#define FMI3_VARIABLES(Type, type)                                                                \
  FMI3_FUNCTION(fmi3Status, fmi3Get##Type,                                                        \
                (fmi3Instance c, const fmi3ValueReference reference[], size_t count,              \
                 fmi3##Type value[], size_t values)) {                                            \
    size_t i;                                                                                     \
    for (i = 0; i < count; ++i) {                                                                 \
      double found;                                                                               \
      if (values != count || !fmu_get((fmu_instance *)c, reference[i], type, &found)) {           \
        return fmi3Error;                                                                         \
      }                                                                                           \
      value[i] = (fmi3##Type)found;                                                               \
    }                                                                                             \
    return fmi3OK;                                                                                \
  }                                                                                               \
  FMI3_FUNCTION(fmi3Status, fmi3Set##Type,                                                        \
                (fmi3Instance c, const fmi3ValueReference reference[], size_t count,              \
                 const fmi3##Type value[], size_t values)) {                                      \
    size_t i;                                                                                     \
    for (i = 0; i < count; ++i) {                                                                 \
      if (values != count || !fmu_set((fmu_instance *)c, reference[i], type, (double)value[i])) { \
        return fmi3Error;                                                                         \
      }                                                                                           \
    }                                                                                             \
    return fmi3OK;                                                                                \
  }
FMI3_VARIABLES(Float64, FMU_REAL)
FMI3_VARIABLES(UInt32, FMU_INTEGER)

/* Types of which this FMU has no variables. */
#define FMI3_NO_VARIABLES(Type)                                                      \
  FMI3_FUNCTION(fmi3Status, fmi3Get##Type,                                           \
                (fmi3Instance c, const fmi3ValueReference reference[], size_t count, \
                 fmi3##Type value[], size_t values)) {                               \
    return fmi3_status(count == 0);                                                  \
  }                                                                                  \
  FMI3_FUNCTION(fmi3Status, fmi3Set##Type,                                           \
                (fmi3Instance c, const fmi3ValueReference reference[], size_t count, \
                 const fmi3##Type value[], size_t values)) {                         \
    return fmi3_status(count == 0);                                                  \
  }
FMI3_NO_VARIABLES(Float32)
FMI3_NO_VARIABLES(Int8)
FMI3_NO_VARIABLES(UInt8)
FMI3_NO_VARIABLES(Int16)
FMI3_NO_VARIABLES(UInt16)
FMI3_NO_VARIABLES(Int32)
FMI3_NO_VARIABLES(Int64)
FMI3_NO_VARIABLES(UInt64)
FMI3_NO_VARIABLES(Boolean)
FMI3_NO_VARIABLES(String)

FMI3_FUNCTION(fmi3Status, fmi3GetBinary,
              (fmi3Instance c, const fmi3ValueReference reference[], size_t count, size_t size[],
               fmi3Binary value[], size_t values)) {
  return fmi3_status(count == 0);
}

FMI3_FUNCTION(fmi3Status, fmi3SetBinary,
              (fmi3Instance c, const fmi3ValueReference reference[], size_t count,
               const size_t size[], const fmi3Binary value[], size_t values)) {
  return fmi3_status(count == 0);
}

FMI3_FUNCTION(fmi3Status, fmi3GetClock,
              (fmi3Instance c, const fmi3ValueReference reference[], size_t count,
               fmi3Clock value[])) {
  return fmi3_status(count == 0);
}

FMI3_FUNCTION(fmi3Status, fmi3SetClock,
              (fmi3Instance c, const fmi3ValueReference reference[], size_t count,
               const fmi3Clock value[])) {
  return fmi3_status(count == 0);
}

FMI3_FUNCTION(fmi3Status, fmi3GetFMUState, (fmi3Instance c, fmi3FMUState *state)) {
  *state = fmu_keep((const fmu_instance *)c, (fmu_state *)*state);
  return fmi3_status(*state != 0);
}

FMI3_FUNCTION(fmi3Status, fmi3SetFMUState, (fmi3Instance c, fmi3FMUState state)) {
  return fmi3_status(fmu_put_back((fmu_instance *)c, (const fmu_state *)state));
}

FMI3_FUNCTION(fmi3Status, fmi3FreeFMUState, (fmi3Instance c, fmi3FMUState *state)) {
  if (state) {
    free(*state);
    *state = 0;
  }
  return fmi3OK;
}

FMI3_FUNCTION(fmi3Status, fmi3SerializedFMUStateSize,
              (fmi3Instance c, fmi3FMUState state, size_t *size)) {
  *size = FMU_STATE_BYTES;
  return fmi3OK;
}

FMI3_FUNCTION(fmi3Status, fmi3SerializeFMUState,
              (fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size)) {
  return fmi3_status(
      fmu_write_state((const fmu_instance *)c, (const fmu_state *)state, bytes, size));
}

FMI3_FUNCTION(fmi3Status, fmi3DeserializeFMUState,
              (fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)) {
  *state = fmu_read_state((const fmu_instance *)c, bytes, size);
  return fmi3_status(*state != 0);
}

FMI3_FUNCTION(fmi3Status, fmi3GetDirectionalDerivative,
              (fmi3Instance c, const fmi3ValueReference unknown[], size_t unknowns,
               const fmi3ValueReference known[], size_t knowns, const fmi3Float64 seed[],
               size_t seeds, fmi3Float64 sensitivity[], size_t sensitivities)) {
  return fmi3_status(seeds == knowns && sensitivities == unknowns &&
                     fmu_directional((const fmu_instance *)c, unknown, unknowns, known, knowns,
                                     seed, sensitivity));
}

FMI3_FUNCTION(fmi3Status, fmi3DoStep,
              (fmi3Instance c, fmi3Float64 time_s, fmi3Float64 step_s, fmi3Boolean final,
               fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early,
               fmi3Float64 *last_s)) {
  *event = false;
  *terminate = false;
  *early = false;
  *last_s = time_s;
  if (!fmu_advance((fmu_instance *)c, time_s, step_s)) {
    return fmi3Error;
  }
  *last_s = time_s + step_s;
  return fmi3OK;
}

FMI3_REFUSED(fmi3EnterEventMode, (fmi3Instance c))
FMI3_REFUSED(fmi3EnterStepMode, (fmi3Instance c))
FMI3_REFUSED(fmi3EnterConfigurationMode, (fmi3Instance c))
FMI3_REFUSED(fmi3ExitConfigurationMode, (fmi3Instance c))
FMI3_REFUSED(fmi3GetNumberOfVariableDependencies,
             (fmi3Instance c, fmi3ValueReference reference, size_t *count))
FMI3_REFUSED(fmi3GetVariableDependencies,
             (fmi3Instance c, fmi3ValueReference dependent, size_t dependent_element[],
              fmi3ValueReference independent[], size_t independent_element[],
              fmi3DependencyKind kind[], size_t count))
FMI3_REFUSED(fmi3GetAdjointDerivative,
             (fmi3Instance c, const fmi3ValueReference unknown[], size_t unknowns,
              const fmi3ValueReference known[], size_t knowns, const fmi3Float64 seed[],
              size_t seeds, fmi3Float64 sensitivity[], size_t sensitivities))
FMI3_REFUSED(fmi3GetIntervalDecimal,
             (fmi3Instance c, const fmi3ValueReference reference[], size_t count,
              fmi3Float64 interval[], fmi3IntervalQualifier qualifier[]))
FMI3_REFUSED(fmi3GetIntervalFraction,
             (fmi3Instance c, const fmi3ValueReference reference[], size_t count,
              fmi3UInt64 counter[], fmi3UInt64 resolution[], fmi3IntervalQualifier qualifier[]))
FMI3_REFUSED(fmi3GetShiftDecimal, (fmi3Instance c, const fmi3ValueReference reference[],
                                   size_t count, fmi3Float64 shift[]))
FMI3_REFUSED(fmi3GetShiftFraction, (fmi3Instance c, const fmi3ValueReference reference[],
                                    size_t count, fmi3UInt64 counter[], fmi3UInt64 resolution[]))
FMI3_REFUSED(fmi3SetIntervalDecimal, (fmi3Instance c, const fmi3ValueReference reference[],
                                      size_t count, const fmi3Float64 interval[]))
FMI3_REFUSED(fmi3SetIntervalFraction,
             (fmi3Instance c, const fmi3ValueReference reference[], size_t count,
              const fmi3UInt64 counter[], const fmi3UInt64 resolution[]))
FMI3_REFUSED(fmi3SetShiftDecimal, (fmi3Instance c, const fmi3ValueReference reference[],
                                   size_t count, const fmi3Float64 shift[]))
FMI3_REFUSED(fmi3SetShiftFraction,
             (fmi3Instance c, const fmi3ValueReference reference[], size_t count,
              const fmi3UInt64 counter[], const fmi3UInt64 resolution[]))
FMI3_REFUSED(fmi3EvaluateDiscreteStates, (fmi3Instance c))
FMI3_REFUSED(fmi3UpdateDiscreteStates,
             (fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals,
              fmi3Boolean *values, fmi3Boolean *next_event, fmi3Float64 *next_event_s))
FMI3_REFUSED(fmi3EnterContinuousTimeMode, (fmi3Instance c))
FMI3_REFUSED(fmi3CompletedIntegratorStep,
             (fmi3Instance c, fmi3Boolean final, fmi3Boolean *event, fmi3Boolean *terminate))
FMI3_REFUSED(fmi3SetTime, (fmi3Instance c, fmi3Float64 time_s))
FMI3_REFUSED(fmi3SetContinuousStates, (fmi3Instance c, const fmi3Float64 state[], size_t count))
FMI3_REFUSED(fmi3GetContinuousStateDerivatives,
             (fmi3Instance c, fmi3Float64 derivative[], size_t count))
FMI3_REFUSED(fmi3GetEventIndicators, (fmi3Instance c, fmi3Float64 indicator[], size_t count))
FMI3_REFUSED(fmi3GetContinuousStates, (fmi3Instance c, fmi3Float64 state[], size_t count))
FMI3_REFUSED(fmi3GetNominalsOfContinuousStates,
             (fmi3Instance c, fmi3Float64 nominal[], size_t count))
FMI3_REFUSED(fmi3GetNumberOfEventIndicators, (fmi3Instance c, size_t *count))
FMI3_REFUSED(fmi3GetNumberOfContinuousStates, (fmi3Instance c, size_t *count))
FMI3_REFUSED(fmi3GetOutputDerivatives,
             (fmi3Instance c, const fmi3ValueReference reference[], size_t count,
              const fmi3Int32 order[], fmi3Float64 value[], size_t values))
FMI3_REFUSED(fmi3ActivateModelPartition,
             (fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time_s))
