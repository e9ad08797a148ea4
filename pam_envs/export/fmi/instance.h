/* Functions that the interfaces FMI 2.0 and FMI 3.0 have in common.
 *
 * An interface defines before: `status` with OK and ERROR, `reference`, `instance` with a field
 * `state`, a component, and `said`, which logs a problem and returns ERROR, or OK without one.
 */

/* Return a new instance, or null if the token is that of another model. */
static instance *instantiated(const char *token) {
    instance *i;
    if (!token || strcmp(token, TOKEN) != 0)
        return 0;
    i = malloc(sizeof *i);
    if (!i)
        return 0;
    memset(i, 0, sizeof *i);
    restart(&i->state);
    return i;
}

/* Accept a call that needs nothing. */
static status accepted(instance *i) {
    (void)i;
    return OK;
}

static status finish_initialisation(instance *i) {
    begin(&i->state);
    i->state.running = true;
    return OK;
}

static status start_again(instance *i) {
    restart(&i->state);
    return OK;
}

static status get_reals(instance *i, const reference at[], size_t n, double values[]) {
    for (size_t k = 0; k < n; k++)
        if (!get_real(&i->state, at[k], values + k))
            return said(i, "there is no number with this value reference");
    return OK;
}

static status set_reals(instance *i, const reference at[], size_t n, const double values[]) {
    for (size_t k = 0; k < n; k++)
        if (said(i, set_real(&i->state, at[k], values[k])) != OK)
            return ERROR;
    return OK;
}

static status get_flag(instance *i, reference at, bool *flag) {
    double value;
    if (!get_real(&i->state, at, &value))
        return said(i, "there is no Boolean with this value reference");
    *flag = value != 0.0;
    return OK;
}

static status get_whole(instance *i, reference at, int64_t *value) {
    if (at != SEED)
        return said(i, "there is no integer with this value reference");
    *value = i->state.seed;
    return OK;
}

static status set_whole(instance *i, reference at, int64_t value) {
    if (at != SEED)
        return said(i, "there is no integer with this value reference");
    return said(i, set_seed(&i->state, value));
}

/* Refuse `n` variables of a type that the model does not have. */
static status without(instance *i, size_t n, const char *problem) {
    return n ? said(i, problem) : OK;
}

static status copy_state(instance *i, void **saved) {
    if (!*saved)
        *saved = malloc(sizeof i->state);
    if (!*saved)
        return said(i, "there is no memory for the state");
    memcpy(*saved, &i->state, sizeof i->state);
    return OK;
}

static status restore_state(instance *i, const void *saved) {
    memcpy(&i->state, saved, sizeof i->state);
    return OK;
}

static status free_state(void **saved) {
    free(*saved);
    *saved = 0;
    return OK;
}

static status write_state(instance *i, const void *saved, void *data, size_t size) {
    if (size < sizeof i->state)
        return said(i, "the buffer is shorter than the state");
    memcpy(data, saved, sizeof i->state);
    return OK;
}

static status read_state(instance *i, const void *data, size_t size, void **saved) {
    if (size != sizeof i->state)
        return said(i, "the data are not a state of this model");
    *saved = malloc(size);
    if (!*saved)
        return said(i, "there is no memory for the state");
    memcpy(*saved, data, size);
    return OK;
}
