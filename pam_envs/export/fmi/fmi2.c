/* FMI 2.0 for co-simulation of an exported model. */
#include "component.h"

typedef unsigned int reference;
typedef enum { OK, WARNING, DISCARD, ERROR, FATAL, PENDING } status;
typedef void (*logger)(
    void *environment, const char *name, status, const char *category, const char *message, ...);
typedef struct {
    logger log;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void *finished;
    void *environment;
} callbacks;

typedef struct {
    component state;
    const callbacks *functions;
    int logging;
} instance;

static status said(instance *i, const char *problem) {
    if (!problem)
        return OK;
    if (i->functions && i->functions->log && i->logging)
        i->functions->log(i->functions->environment, MODEL_NAME, ERROR, "error", problem);
    return ERROR;
}

#include "instance.h"

EXPORT const char *fmi2GetTypesPlatform(void) {
    return "default";
}

EXPORT const char *fmi2GetVersion(void) {
    return "2.0";
}

EXPORT status fmi2SetDebugLogging(instance *i, int on, size_t n, const char *const names[]) {
    (void)n, (void)names;
    i->logging = on;
    return OK;
}

EXPORT instance *fmi2Instantiate(
    const char *name, int kind, const char *token, const char *resources,
    const callbacks *functions, int visible, int logging) {
    instance *i = kind == 1 ? instantiated(token) : 0;
    (void)name, (void)resources, (void)visible;
    if (i) {
        i->functions = functions;
        i->logging = logging;
    }
    return i;
}

EXPORT void fmi2FreeInstance(instance *i) {
    free(i);
}

EXPORT status fmi2SetupExperiment(
    instance *i, int tolerance_defined, double tolerance, double start, int stop_defined,
    double stop) {
    (void)tolerance_defined, (void)tolerance, (void)stop_defined, (void)stop;
    i->state.time = start;
    return OK;
}

EXPORT status fmi2EnterInitializationMode(instance *i) {
    return accepted(i);
}

EXPORT status fmi2ExitInitializationMode(instance *i) {
    return finish_initialisation(i);
}

EXPORT status fmi2Terminate(instance *i) {
    return accepted(i);
}

EXPORT status fmi2Reset(instance *i) {
    return start_again(i);
}

EXPORT status fmi2GetReal(instance *i, const reference at[], size_t n, double values[]) {
    return get_reals(i, at, n, values);
}

EXPORT status fmi2SetReal(instance *i, const reference at[], size_t n, const double values[]) {
    return set_reals(i, at, n, values);
}

EXPORT status fmi2GetBoolean(instance *i, const reference at[], size_t n, int values[]) {
    bool flag;
    for (size_t k = 0; k < n; k++) {
        if (get_flag(i, at[k], &flag) != OK)
            return ERROR;
        values[k] = flag;
    }
    return OK;
}

EXPORT status fmi2GetInteger(instance *i, const reference at[], size_t n, int values[]) {
    int64_t value;
    for (size_t k = 0; k < n; k++) {
        if (get_whole(i, at[k], &value) != OK)
            return ERROR;
        values[k] = (int)value;
    }
    return OK;
}

EXPORT status fmi2SetInteger(instance *i, const reference at[], size_t n, const int values[]) {
    for (size_t k = 0; k < n; k++)
        if (set_whole(i, at[k], values[k]) != OK)
            return ERROR;
    return OK;
}

EXPORT status fmi2SetBoolean(instance *i, const reference at[], size_t n, const int values[]) {
    (void)at, (void)values;
    return without(i, n, "the model has no Boolean that can be set");
}

EXPORT status fmi2GetString(instance *i, const reference at[], size_t n, const char *values[]) {
    (void)at, (void)values;
    return without(i, n, "the model has no String");
}

EXPORT status fmi2SetString(
    instance *i, const reference at[], size_t n, const char *const values[]) {
    (void)at, (void)values;
    return without(i, n, "the model has no String");
}

EXPORT status fmi2GetFMUstate(instance *i, void **saved) {
    return copy_state(i, saved);
}

EXPORT status fmi2SetFMUstate(instance *i, void *saved) {
    return restore_state(i, saved);
}

EXPORT status fmi2FreeFMUstate(instance *i, void **saved) {
    (void)i;
    return free_state(saved);
}

EXPORT status fmi2SerializedFMUstateSize(instance *i, void *saved, size_t *size) {
    (void)saved;
    *size = sizeof i->state;
    return OK;
}

EXPORT status fmi2SerializeFMUstate(instance *i, void *saved, char data[], size_t size) {
    return write_state(i, saved, data, size);
}

EXPORT status fmi2DeSerializeFMUstate(
    instance *i, const char data[], size_t size, void **saved) {
    return read_state(i, data, size, saved);
}

EXPORT status fmi2GetDirectionalDerivative(
    instance *i, const reference of[], size_t n, const reference by[], size_t m,
    const double seed[], double values[]) {
    (void)of, (void)n, (void)by, (void)m, (void)seed, (void)values;
    return said(i, "the model has no directional derivatives");
}

EXPORT status fmi2SetRealInputDerivatives(
    instance *i, const reference at[], size_t n, const int order[], const double values[]) {
    (void)at, (void)order, (void)values;
    return without(i, n, "inputs are held for a control period");
}

EXPORT status fmi2GetRealOutputDerivatives(
    instance *i, const reference at[], size_t n, const int order[], double values[]) {
    (void)at, (void)order, (void)values;
    return without(i, n, "the model has no derivatives of outputs");
}

EXPORT status fmi2DoStep(instance *i, double now, double step, int no_set_state) {
    (void)now, (void)no_set_state;
    return said(i, advance(&i->state, step));
}

EXPORT status fmi2CancelStep(instance *i) {
    return said(i, "steps end before the function returns");
}

EXPORT status fmi2GetStatus(instance *i, int kind, status *value) {
    (void)i, (void)kind, (void)value;
    return DISCARD;
}

EXPORT status fmi2GetRealStatus(instance *i, int kind, double *value) {
    (void)kind;
    *value = i->state.time;
    return OK;
}

EXPORT status fmi2GetIntegerStatus(instance *i, int kind, int *value) {
    (void)i, (void)kind, (void)value;
    return DISCARD;
}

EXPORT status fmi2GetBooleanStatus(instance *i, int kind, int *value) {
    (void)i, (void)kind, (void)value;
    return DISCARD;
}

EXPORT status fmi2GetStringStatus(instance *i, int kind, const char **value) {
    (void)i, (void)kind, (void)value;
    return DISCARD;
}
