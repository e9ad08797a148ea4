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
    instance *i;
    (void)name, (void)resources, (void)visible;
    if (kind != 1 || !token || strcmp(token, TOKEN) != 0)
        return 0;
    i = malloc(sizeof *i);
    if (!i)
        return 0;
    i->functions = functions;
    i->logging = logging;
    restart(&i->state);
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
    (void)i;
    return OK;
}

EXPORT status fmi2ExitInitializationMode(instance *i) {
    begin(&i->state);
    i->state.running = true;
    return OK;
}

EXPORT status fmi2Terminate(instance *i) {
    (void)i;
    return OK;
}

EXPORT status fmi2Reset(instance *i) {
    restart(&i->state);
    return OK;
}

EXPORT status fmi2GetReal(instance *i, const reference at[], size_t n, double values[]) {
    for (size_t k = 0; k < n; k++)
        if (!get_real(&i->state, at[k], values + k))
            return said(i, "there is no Real with this value reference");
    return OK;
}

EXPORT status fmi2SetReal(instance *i, const reference at[], size_t n, const double values[]) {
    for (size_t k = 0; k < n; k++)
        if (said(i, set_real(&i->state, at[k], values[k])) != OK)
            return ERROR;
    return OK;
}

EXPORT status fmi2GetBoolean(instance *i, const reference at[], size_t n, int values[]) {
    double value;
    for (size_t k = 0; k < n; k++) {
        if (!get_real(&i->state, at[k], &value))
            return said(i, "there is no Boolean with this value reference");
        values[k] = value != 0.0;
    }
    return OK;
}

EXPORT status fmi2GetInteger(instance *i, const reference at[], size_t n, int values[]) {
    for (size_t k = 0; k < n; k++) {
        if (at[k] != SEED)
            return said(i, "there is no Integer with this value reference");
        values[k] = (int)i->state.seed;
    }
    return OK;
}

EXPORT status fmi2SetInteger(instance *i, const reference at[], size_t n, const int values[]) {
    for (size_t k = 0; k < n; k++) {
        if (at[k] != SEED)
            return said(i, "there is no Integer with this value reference");
        if (said(i, set_seed(&i->state, values[k])) != OK)
            return ERROR;
    }
    return OK;
}

EXPORT status fmi2SetBoolean(instance *i, const reference at[], size_t n, const int values[]) {
    (void)at, (void)values;
    return n ? said(i, "the model has no Boolean that can be set") : OK;
}

EXPORT status fmi2GetString(instance *i, const reference at[], size_t n, const char *values[]) {
    (void)at, (void)values;
    return n ? said(i, "the model has no String") : OK;
}

EXPORT status fmi2SetString(
    instance *i, const reference at[], size_t n, const char *const values[]) {
    (void)at, (void)values;
    return n ? said(i, "the model has no String") : OK;
}

EXPORT status fmi2GetFMUstate(instance *i, void **saved) {
    if (!*saved)
        *saved = malloc(sizeof i->state);
    if (!*saved)
        return said(i, "there is no memory for the state");
    memcpy(*saved, &i->state, sizeof i->state);
    return OK;
}

EXPORT status fmi2SetFMUstate(instance *i, void *saved) {
    memcpy(&i->state, saved, sizeof i->state);
    return OK;
}

EXPORT status fmi2FreeFMUstate(instance *i, void **saved) {
    (void)i;
    free(*saved);
    *saved = 0;
    return OK;
}

EXPORT status fmi2SerializedFMUstateSize(instance *i, void *saved, size_t *size) {
    (void)saved;
    *size = sizeof i->state;
    return OK;
}

EXPORT status fmi2SerializeFMUstate(instance *i, void *saved, char data[], size_t size) {
    if (size < sizeof i->state)
        return said(i, "the buffer is shorter than the state");
    memcpy(data, saved, sizeof i->state);
    return OK;
}

EXPORT status fmi2DeSerializeFMUstate(
    instance *i, const char data[], size_t size, void **saved) {
    if (size != sizeof i->state)
        return said(i, "the data are not a state of this model");
    *saved = malloc(size);
    if (!*saved)
        return said(i, "there is no memory for the state");
    memcpy(*saved, data, size);
    return OK;
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
    return n ? said(i, "inputs are held for a control period") : OK;
}

EXPORT status fmi2GetRealOutputDerivatives(
    instance *i, const reference at[], size_t n, const int order[], double values[]) {
    (void)at, (void)order, (void)values;
    return n ? said(i, "the model has no derivatives of outputs") : OK;
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
