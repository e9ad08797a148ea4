/* One instance of an exported model, for the interfaces FMI 2.0 and FMI 3.0.
 *
 * The generated fmi_model.h names the model: MODEL (its type), MODEL_init and so on, the numbers of
 * its variables, and the bounds of its parameters. Value references: 1 + k is input k, OUTPUT + k
 * output k, PARAMETER + k parameter k; SEED is the seed; 0 is the time.
 */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include "fmi_model.h"

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

enum { INPUT = 1, OUTPUT = 10000, PARAMETER = 20000, SEED = 30000 };

typedef struct {
    MODEL model;
    double inputs[INPUTS];
    double time;
    int64_t seed;
    bool begun; /* whether the episode has been started with these parameters, seed and inputs */
    bool running; /* whether the initialisation is over */
} component;

static void restart(component *c) {
    static const double starts[] = INPUT_STARTS;
    memset(c, 0, sizeof *c);
    memcpy(c->inputs, starts, sizeof starts);
    MODEL_init(&c->model);
}

static void begin(component *c) {
    if (c->begun)
        return;
#if EPISODIC
    MODEL_reset(&c->model, (uint64_t)c->seed);
#else
    MODEL_reset(&c->model, c->inputs);
#endif
    c->begun = true;
}

static bool get_real(component *c, uint32_t reference, double *value) {
    if (reference == 0)
        *value = c->time;
    else if (reference - INPUT < INPUTS)
        *value = c->inputs[reference - INPUT];
    else if (reference - OUTPUT < OUTPUTS) {
        begin(c);
        *value = MODEL_output(&c->model, (int)(reference - OUTPUT));
    } else if (reference - PARAMETER < PARAMETERS)
        *value = *MODEL_parameter(&c->model, (int)(reference - PARAMETER));
    else
        return false;
    return true;
}

/* Return why a value is refused, or null. */
static const char *set_real(component *c, uint32_t reference, double value) {
    static const double low[] = PARAMETER_LOW, high[] = PARAMETER_HIGH;
    if (!isfinite(value))
        return "a value is not finite; give a number within the bounds of modelDescription.xml";
    if (reference - INPUT < INPUTS) {
        c->inputs[reference - INPUT] = value;
        if (!c->running)
            c->begun = false;
        return 0;
    }
    if (reference - PARAMETER < PARAMETERS) {
        int k = (int)(reference - PARAMETER);
        if (c->running)
            return "parameters can be set only before the end of the initialisation";
        if (value < low[k] || value > high[k])
            return "a parameter is outside its bounds, which modelDescription.xml gives";
        *MODEL_parameter(&c->model, k) = value;
        c->begun = false;
        return 0;
    }
    return "there is no input or parameter with this value reference";
}

static const char *set_seed(component *c, int64_t seed) {
    if (seed < 0)
        return "the seed is negative; give a whole number from 0";
    if (c->running)
        return "the seed can be set only before the end of the initialisation";
    c->seed = seed;
    c->begun = false;
    return 0;
}

/* Advance by whole control periods; return why that is impossible, or null. */
static const char *advance(component *c, double step) {
    double periods = floor(step / PERIOD + 0.5);
    if (periods < 1.0 || fabs(periods * PERIOD - step) > 1e-6 * PERIOD)
        return "the step is not a whole number of control periods (fixedInternalStepSize)";
    begin(c);
    for (double k = 0.0; k < periods; k += 1.0)
        MODEL_step(&c->model, c->inputs);
    c->time += periods * PERIOD;
    return 0;
}
