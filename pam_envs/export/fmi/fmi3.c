/* FMI 3.0 for co-simulation of an exported model. */
#include "component.h"

typedef uint32_t reference;
typedef enum { OK, WARNING, DISCARD, ERROR, FATAL } status;
typedef void (*log_message)(void *environment, status, const char *category, const char *message);

typedef struct {
    component state;
    void *environment;
    log_message log;
    bool logging;
} instance;

static status said(instance *i, const char *problem) {
    if (!problem)
        return OK;
    if (i->log && i->logging)
        i->log(i->environment, ERROR, "logStatusError", problem);
    return ERROR;
}

#include "instance.h"

EXPORT const char *fmi3GetVersion(void) {
    return "3.0";
}

EXPORT status fmi3SetDebugLogging(instance *i, bool on, size_t n, const char *const names[]) {
    (void)n;
    (void)names;
    i->logging = on;
    return OK;
}

EXPORT instance *fmi3InstantiateCoSimulation(
    const char *name, const char *token, const char *resources, bool visible, bool logging,
    bool event_mode, bool early_return, const reference required[], size_t n, void *environment,
    log_message log, void *update) {
    instance *i = instantiated(token);
    (void)name, (void)resources, (void)visible, (void)event_mode, (void)early_return;
    (void)required, (void)n, (void)update;
    if (i) {
        i->environment = environment;
        i->log = log;
        i->logging = logging;
    } else if (log)
        log(environment, ERROR, "logStatusError", "the token is that of another model");
    return i;
}

EXPORT void *fmi3InstantiateModelExchange(
    const char *name, const char *token, const char *resources, bool visible, bool logging,
    void *environment, log_message log) {
    (void)name, (void)token, (void)resources, (void)visible, (void)logging;
    (void)environment, (void)log;
    return 0;
}

EXPORT void *fmi3InstantiateScheduledExecution(
    const char *name, const char *token, const char *resources, bool visible, bool logging,
    void *environment, log_message log, void *clock, void *lock, void *unlock) {
    (void)name, (void)token, (void)resources, (void)visible, (void)logging;
    (void)environment, (void)log, (void)clock, (void)lock, (void)unlock;
    return 0;
}

EXPORT void fmi3FreeInstance(instance *i) {
    free(i);
}

EXPORT status fmi3EnterInitializationMode(
    instance *i, bool tolerance_defined, double tolerance, double start, bool stop_defined,
    double stop) {
    (void)tolerance_defined, (void)tolerance, (void)stop_defined, (void)stop;
    i->state.time = start;
    return OK;
}

EXPORT status fmi3ExitInitializationMode(instance *i) {
    return finish_initialisation(i);
}

EXPORT status fmi3EnterConfigurationMode(instance *i) {
    return said(i, "the model has no structural parameters");
}

EXPORT status fmi3ExitConfigurationMode(instance *i) {
    return said(i, "the model has no structural parameters");
}

EXPORT status fmi3EnterEventMode(instance *i) {
    return said(i, "the model has no event mode");
}

EXPORT status fmi3EnterStepMode(instance *i) {
    return accepted(i);
}

EXPORT status fmi3Terminate(instance *i) {
    return accepted(i);
}

EXPORT status fmi3Reset(instance *i) {
    return start_again(i);
}

EXPORT status fmi3GetFloat64(
    instance *i, const reference at[], size_t n, double values[], size_t n_values) {
    (void)n_values;
    return get_reals(i, at, n, values);
}

EXPORT status fmi3SetFloat64(
    instance *i, const reference at[], size_t n, const double values[], size_t n_values) {
    (void)n_values;
    return set_reals(i, at, n, values);
}

EXPORT status fmi3GetBoolean(
    instance *i, const reference at[], size_t n, bool values[], size_t n_values) {
    (void)n_values;
    for (size_t k = 0; k < n; k++)
        if (get_flag(i, at[k], values + k) != OK)
            return ERROR;
    return OK;
}

EXPORT status fmi3GetInt64(
    instance *i, const reference at[], size_t n, int64_t values[], size_t n_values) {
    (void)n_values;
    for (size_t k = 0; k < n; k++)
        if (get_whole(i, at[k], values + k) != OK)
            return ERROR;
    return OK;
}

EXPORT status fmi3SetInt64(
    instance *i, const reference at[], size_t n, const int64_t values[], size_t n_values) {
    (void)n_values;
    for (size_t k = 0; k < n; k++)
        if (set_whole(i, at[k], values[k]) != OK)
            return ERROR;
    return OK;
}

#define NONE(Kind, type)                                                                     \
    EXPORT status fmi3Get##Kind(                                                             \
        instance *i, const reference at[], size_t n, type values[], size_t n_values) {       \
        (void)at, (void)values, (void)n_values;                                              \
        return without(i, n, "the model has no variable of type " #Kind);                 \
    }                                                                                        \
    EXPORT status fmi3Set##Kind(                                                             \
        instance *i, const reference at[], size_t n, const type values[], size_t n_values) { \
        (void)at, (void)values, (void)n_values;                                              \
        return without(i, n, "the model has no variable of type " #Kind);                 \
    }

NONE(Float32, float)
NONE(Int8, int8_t)
NONE(UInt8, uint8_t)
NONE(Int16, int16_t)
NONE(UInt16, uint16_t)
NONE(Int32, int32_t)
NONE(UInt32, uint32_t)
NONE(UInt64, uint64_t)
NONE(String, char *)

EXPORT status fmi3SetBoolean(
    instance *i, const reference at[], size_t n, const bool values[], size_t n_values) {
    (void)at, (void)values, (void)n_values;
    return without(i, n, "the model has no Boolean that can be set");
}

EXPORT status fmi3GetBinary(
    instance *i, const reference at[], size_t n, size_t sizes[], const void *values[], size_t m) {
    (void)at, (void)sizes, (void)values, (void)m;
    return without(i, n, "the model has no variable of type Binary");
}

EXPORT status fmi3SetBinary(
    instance *i, const reference at[], size_t n, const size_t sizes[], const void *const values[],
    size_t m) {
    (void)at, (void)sizes, (void)values, (void)m;
    return without(i, n, "the model has no variable of type Binary");
}

EXPORT status fmi3GetFMUState(instance *i, void **saved) {
    return copy_state(i, saved);
}

EXPORT status fmi3SetFMUState(instance *i, void *saved) {
    return restore_state(i, saved);
}

EXPORT status fmi3FreeFMUState(instance *i, void **saved) {
    (void)i;
    return free_state(saved);
}

EXPORT status fmi3SerializedFMUStateSize(instance *i, void *saved, size_t *size) {
    (void)saved;
    *size = sizeof i->state;
    return OK;
}

EXPORT status fmi3SerializeFMUState(instance *i, void *saved, uint8_t data[], size_t size) {
    return write_state(i, saved, data, size);
}

EXPORT status fmi3DeserializeFMUState(
    instance *i, const uint8_t data[], size_t size, void **saved) {
    return read_state(i, data, size, saved);
}

EXPORT status fmi3DoStep(
    instance *i, double now, double step, bool no_set_state, bool *event, bool *terminate,
    bool *early, double *reached) {
    const char *problem = advance(&i->state, step);
    (void)now, (void)no_set_state;
    *event = *terminate = *early = false;
    *reached = i->state.time;
    return said(i, problem);
}

/* Functions of model exchange, scheduled execution, clocks and derivatives, which an importer looks
 * up by name and does not call. */
#define UNSUPPORTED(name)                                        \
    EXPORT status name(instance *i) {                            \
        return said(i, #name " is not supported by this model"); \
    }

UNSUPPORTED(fmi3ActivateModelPartition)
UNSUPPORTED(fmi3CompletedIntegratorStep)
UNSUPPORTED(fmi3EnterContinuousTimeMode)
UNSUPPORTED(fmi3EvaluateDiscreteStates)
UNSUPPORTED(fmi3GetAdjointDerivative)
UNSUPPORTED(fmi3GetClock)
UNSUPPORTED(fmi3GetContinuousStateDerivatives)
UNSUPPORTED(fmi3GetContinuousStates)
UNSUPPORTED(fmi3GetDirectionalDerivative)
UNSUPPORTED(fmi3GetEventIndicators)
UNSUPPORTED(fmi3GetIntervalDecimal)
UNSUPPORTED(fmi3GetIntervalFraction)
UNSUPPORTED(fmi3GetNominalsOfContinuousStates)
UNSUPPORTED(fmi3GetNumberOfContinuousStates)
UNSUPPORTED(fmi3GetNumberOfEventIndicators)
UNSUPPORTED(fmi3GetNumberOfVariableDependencies)
UNSUPPORTED(fmi3GetOutputDerivatives)
UNSUPPORTED(fmi3GetShiftDecimal)
UNSUPPORTED(fmi3GetShiftFraction)
UNSUPPORTED(fmi3GetVariableDependencies)
UNSUPPORTED(fmi3SetClock)
UNSUPPORTED(fmi3SetContinuousStates)
UNSUPPORTED(fmi3SetIntervalDecimal)
UNSUPPORTED(fmi3SetIntervalFraction)
UNSUPPORTED(fmi3SetShiftDecimal)
UNSUPPORTED(fmi3SetShiftFraction)
UNSUPPORTED(fmi3SetTime)
UNSUPPORTED(fmi3UpdateDiscreteStates)
