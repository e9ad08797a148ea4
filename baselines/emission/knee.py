"""Knee controllers as kernels: PI of the tension, feedforward, and feedback by LTR."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from baselines.emission.book import (
    COLUMNS,
    DATA,
    FAMILY,
    INPUT,
    NUMBERS,
    OUTPUT,
    STATE,
    STEPS,
    Design,
    limits_of,
    read,
    row_sum,
    write,
)
from baselines.emission.pid import N_PID, N_PID_STATE, gains_of, pid_begin, pid_update
from baselines.knee.feedforward import Forward, KneeForward
from baselines.knee.ltr import KneeLtr
from baselines.knee.nominal import SHORTEST_STRETCH, KneeObserver, SetPointLimits
from baselines.knee.pid import TensionView
from baselines.knee.published import NOMINAL_PRESSURE
from baselines.linear.bumpless import ROUNDING, Bumpless
from baselines.linear.pid import Pid
from pam_envs.arrays import Array
from pam_envs.hysteresis.modified_maxwell_slip import (
    ModifiedMaxwellSlip,
    pressure_step,
    stiffness_step,
)
from pam_envs.kernels.arithmetic import sine_and_cosine
from pam_envs.kernels.build import array_at, kernel

BREAKS, STIFFNESSES, SPRING, WEIGHTS, HELD, SLIPS, WORK, SYSTEMS = range(FAMILY, FAMILY + 8)
"""Arrays: hysteresis, weights of the preview, slip positions before and for trials, scratch, linear
systems."""
(
    ARM, FITTINGS, WIRE, RELAXED, SHORTEST, FIXED_LENGTH, GAIT, STIFFNESS, ASSIST, KIND, PREVIEW,
    FULL, PER_OUTPUT, PER_STIFFNESS, SEGMENT, STEP, FEEDBACK, COMPENSATED, FIRST, SECOND, ACTION,
    GAINS, READER,
) = (*range(21), 24, 24 + N_PID)  # fmt: skip
"""Numbers of the design: lever, muscle, environment, feedforward, feedback, action, PI, signals."""
KINDS = ("nominal", "line", "inverse", "none")
NOTHING, PI, LTR = range(3)
TENSION, ANGLE, SET_POINT, REFERENCE, STANCE, PATH = range(6)
"""Signals, then the previews of the reference and of the reference angle."""
AGREEMENT = (
    "equal to those of the Python controller within one unit in the last place of their float32, "
    "most of them bit for bit (the Python controller takes sine and cosine from a library)"
)
N, M, A, MATRICES = 0, 1, 2, 6
"""Head of a linear system in ``SYSTEMS``: orders of controller and model, sign of the static gain,
limits of the command; the matrices follow."""
LOW, HIGH, DIRECT = 3, 4, 5


@kernel
def stretch_of(angle: float, data: Any) -> float:
    """Return the muscle's length above its shortest [m]."""
    sine, _ = sine_and_cosine(0.5 * angle)
    length = 2.0 * data[ARM] * sine - data[FITTINGS]
    if data[FIXED_LENGTH] > 0.0:
        length = data[FIXED_LENGTH]
    return max(SHORTEST_STRETCH, length - data[SHORTEST])  # type: ignore[no-any-return]


@kernel
def free_tension(angle: float, data: Any) -> float:
    """Return the tension [N] of zero torque on the knee, at least 0."""
    _, cosine = sine_and_cosine(0.5 * angle)
    torque = data[WIRE] * (data[RELAXED] - angle)
    return max(0.0, torque / (data[ARM] * cosine))  # type: ignore[no-any-return]


@kernel
def forward_pressure(
    tension: float, stretch: float, data: Any, breaks: Any, stiffnesses: Any, spring: Any,
    held: Any, slips: Any,
) -> float:  # fmt: skip
    """Return the feedforward's pressure [Pa] for a tension [N]."""
    if data[KIND] == 0.0:
        return NOMINAL_PRESSURE
    stiffness = max(0.0, tension) / stretch
    if data[KIND] == 1.0:
        return min(stiffness * data[PER_STIFFNESS], data[FULL])  # type: ignore[no-any-return]
    for k in range(len(breaks)):
        slips[k][0] = held[k][0]
    found = pressure_step(
        stiffness / data[PER_OUTPUT], slips, 0, breaks, stiffnesses, spring, data[SEGMENT], 1.0
    )
    return min(max(found, 0.0), data[FULL])


@kernel
def advance_hysteresis(
    pressure: float, data: Any, breaks: Any, stiffnesses: Any, spring: Any, held: Any
) -> None:
    """Move the slip positions to a pressure [Pa]."""
    if data[KIND] == 2.0:
        stiffness_step(pressure, held, 0, breaks, stiffnesses, spring, data[SEGMENT], 1.0)


@kernel
def dot(values: Any, at: int, state: Any, s: int, n: int, work: Any) -> float:
    """Return the scalar product of a row of a matrix and a state, summed as numpy does."""
    for k in range(n):
        work[0][k] = values[at + k] * state[s + k]
    return row_sum(work[0], 0, n)  # type: ignore[no-any-return]


@kernel
def system_output(
    y: Any, at: int, n: int, d: float, u: float, state: Any, s: int, work: Any
) -> float:
    """Return the output of a linear system; ``b`` follows ``a``, ``c`` follows ``b``."""
    return dot(y, at + n * n + n, state, s, n, work) + d * u  # type: ignore[no-any-return]


@kernel
def system_advance(y: Any, at: int, n: int, u: float, state: Any, s: int, work: Any) -> None:
    """Advance a linear system by one period."""
    for i in range(n):
        work[1][i] = dot(y, at + n * i, state, s, n, work) + u * y[at + n * n + i]
    for i in range(n):
        state[s + i] = work[1][i]


@kernel
def loop_error(
    y: Any, at: int, reference: float, measured: float, compensated: float, state: Any, s: int,
    work: Any,
) -> float:  # fmt: skip
    """Return the error that a controller sees, with the output of its compensator."""
    n, m = int(y[at + N]), int(y[at + M])
    error = reference - measured
    if compensated > 0.0:
        model = at + MATRICES + n * n + 2 * n
        error = error + system_output(y, model, m, 0.0, 0.0, state, s + n, work)
    return error


@kernel
def loop_output(
    y: Any, at: int, reference: float, measured: float, low: float, high: float, compensated: float,
    state: Any, s: int, work: Any,
) -> float:  # fmt: skip
    """Return the command of a controller in charge (``Bumpless.output``)."""
    n, m = int(y[at + N]), int(y[at + M])
    error = loop_error(y, at, reference, measured, compensated, state, s, work)
    command = system_output(y, at + MATRICES, n, y[at + DIRECT], error, state, s, work)
    if compensated > 0.0:
        feedback = at + MATRICES + n * n + 2 * n + m * m + 2 * m
        command = command + dot(y, feedback, state, s + n, m, work)
    return min(max(command, low), high)


@kernel
def loop_advance(
    y: Any, at: int, reference: float, measured: float, applied: float, in_charge: bool,
    compensated: float, state: Any, s: int, work: Any,
) -> None:  # fmt: skip
    """Advance a controller with the command that was applied (``Bumpless.advance``)."""
    n, m = int(y[at + N]), int(y[at + M])
    error = loop_error(y, at, reference, measured, compensated, state, s, work)
    own = system_output(y, at + MATRICES, n, y[at + DIRECT], error, state, s, work)
    difference = applied - own
    if compensated > 0.0:
        system_advance(y, at + MATRICES + n * n + 2 * n, m, difference, state, s + n, work)
    else:
        further = in_charge and y[at + A] * difference * error < 0.0
        if further and abs(difference) > ROUNDING * (y[at + HIGH] - y[at + LOW]):
            error = 0.0
    system_advance(y, at + MATRICES, n, error, state, s, work)


@kernel
def hold(y: Any, at: int, command: float, state: Any, s: int) -> None:
    """Write the state that holds a command while the error is 0."""
    n, m = int(y[at + N]), int(y[at + M])
    mode = at + MATRICES + n * n + 2 * n + m * m + 3 * m
    for k in range(n):
        state[s + k] = command * y[mode + k]
    for k in range(m):
        state[s + n + k] = 0.0


@kernel
def knee_by_address(book: Any, mode: int) -> None:
    """Compute the action of a controller of the knee from an observation."""
    inputs, outputs = array_at(book, INPUT, 1, 0), array_at(book, OUTPUT, 1, 2)
    state, data = array_at(book, STATE, 1, 0), array_at(book, DATA, 1, 0)
    columns, numbers = array_at(book, COLUMNS, 1, 1), array_at(book, NUMBERS, 1, 1)
    breaks, stiffnesses = array_at(book, BREAKS, 1, 0), array_at(book, STIFFNESSES, 1, 0)
    spring, weights = array_at(book, SPRING, 1, 0), array_at(book, WEIGHTS, 1, 0)
    held, slips = array_at(book, HELD, 2, 0), array_at(book, SLIPS, 2, 0)
    work, y = array_at(book, WORK, 2, 0), array_at(book, SYSTEMS, 1, 0)
    n = len(columns)
    measured = read(inputs, columns, data, READER, TENSION, 0, n)
    angle = read(inputs, columns, data, READER, ANGLE, 0, n)
    set_point = read(inputs, columns, data, READER, SET_POINT, 0, n)
    reference = read(inputs, columns, data, READER, REFERENCE, 0, n)
    stretch = stretch_of(angle, data)
    if data[STIFFNESS] > 0.0:
        reference = reference * stretch
    stance, path = True, angle
    if data[GAIT] > 0.0:
        stance = read(inputs, columns, data, READER, STANCE, 0, n) > 0.5
        path = read(inputs, columns, data, READER, PATH, 0, n)
    low = max(data[ACTION + 2], set_point - data[STEP])
    high = min(data[ACTION + 3], set_point + data[STEP])
    compensated, first, second = data[COMPENSATED], int(data[FIRST]), int(data[SECOND])
    if data[FEEDBACK] == PI:
        if mode & 1:
            pid_begin(state, 0, set_point, measured)
        error = reference - measured
        command = pid_update(data, GAINS, state, 0, error, measured, low, high)
        write(outputs, 0, command, data, ACTION)
        numbers[STEPS] = numbers[STEPS] + 1
        return
    if mode & 1:
        if data[KIND] == 2.0:
            middle = 0.5 * (len(spring) - 1) * data[SEGMENT]
            for k in range(len(breaks)):
                held[k][0] = min(breaks[k], middle)
            advance_hysteresis(0.0, data, breaks, stiffnesses, spring, held)
            advance_hysteresis(set_point, data, breaks, stiffnesses, spring, held)
        if data[FEEDBACK] == LTR:
            start = 0.0
            if data[KIND] == 0.0:
                start = set_point - NOMINAL_PRESSURE
            hold(y, 0, start, state, 0)
            if data[GAIT] > 0.0:
                hold(y, second, start, state, first)
    wished, free = reference, free_tension(angle, data)
    samples = int(data[PREVIEW])
    if samples > 0:
        for k in range(samples):
            sample = read(inputs, columns, data, READER, PATH + 1 + k, 0, n)
            later = read(inputs, columns, data, READER, PATH + 1 + samples + k, 0, n)
            slack = stretch_of(later, data)
            work[2][k] = weights[k] * (free_tension(later, data) / slack)
            work[3][k] = weights[k] * (sample if data[STIFFNESS] > 0.0 else sample / slack)
        free = row_sum(work[2], 0, samples) * stretch
        wished = row_sum(work[3], 0, samples) * stretch
    if data[FEEDBACK] == NOTHING:
        tension = wished if stance and data[ASSIST] > 0.0 else free
        used = forward_pressure(tension, stretch, data, breaks, stiffnesses, spring, held, slips)
        command = used
    else:
        own = forward_pressure(wished, stretch, data, breaks, stiffnesses, spring, held, slips)
        command = own + loop_output(
            y, 0, reference, measured, low - own, high - own, compensated, state, 0, work
        )
        used = own
        if data[GAIT] > 0.0:
            swing = forward_pressure(free, stretch, data, breaks, stiffnesses, spring, held, slips)
            swung = swing + loop_output(
                y, second, path, angle, low - swing, high - swing, compensated, state, first, work
            )
            if not stance:
                command, used = swung, swing
            loop_advance(
                y, second, path, angle, command - swing, not stance, compensated, state, first, work
            )
        loop_advance(y, 0, reference, measured, command - own, stance, compensated, state, 0, work)
    advance_hysteresis(used, data, breaks, stiffnesses, spring, held)
    write(outputs, 0, command, data, ACTION)
    numbers[STEPS] = numbers[STEPS] + 1


def knee_pid(controller: Pid) -> Design:
    """Return the design of the PI of the tension."""
    view = controller.view
    assert isinstance(view, TensionView) and isinstance(view.within, SetPointLimits)
    return _design(
        view.observer, controller.action_signal, "none", within=view.within,
        gains=gains_of(controller.gains, controller.period),
    )  # fmt: skip


def knee_forward(controller: KneeForward) -> Design:
    """Return the design of a feedforward."""
    forward = controller.forward
    return _design(
        forward.observer, controller.action_signal, forward.kind, forward, assist=controller.assist
    )


def knee_ltr(controller: KneeLtr) -> Design:
    """Return the design of feedback by loop transfer recovery with a feedforward."""
    forward, within = controller.forward, controller.within
    assert isinstance(within, SetPointLimits)
    loops = [loop for loop in (controller.tension, controller.angle) if loop is not None]
    return _design(
        forward.observer, controller.action_signal, forward.kind, forward, within=within,
        loops=loops,
    )  # fmt: skip


def _design(
    observer: KneeObserver, action: Any, kind: str, forward: Forward | None = None, *,
    within: SetPointLimits | None = None, gains: list[float] | None = None,
    loops: Sequence[Bumpless] = (), assist: bool = True,
) -> Design:  # fmt: skip
    nominal, readers = observer.nominal, [observer.reader]
    plant, lever, full = nominal.plant, nominal.plant.lever, nominal.full_pressure
    empty = np.zeros(1)
    breaks, stiffnesses, spring, segment, weights = empty, empty, empty, 0.0, empty
    if kind == "inverse":
        model = plant.hysteresis.scaled
        if not isinstance(model, ModifiedMaxwellSlip):
            found = "none" if model is None else model.kind
            raise ValueError(
                f"the inverse of a knee orthosis with hysteresis {found!r} is not exported; give a "
                f"nominal plant with {ModifiedMaxwellSlip.kind}"
            )
        breaks, stiffnesses, spring, segment = model.arrays
    if forward is not None and forward.tension is not None:
        if forward.angle is None or forward.weights is None:
            raise ValueError(
                "a feedforward with preview is exported for environments with a gait alone; export "
                "the controller without preview"
            )
        readers += [forward.tension, forward.angle]
        weights = forward.weights
    gain, offset, columns = (
        np.concatenate([_six(r, k) if j == 0 else r[k] for j, r in enumerate(readers)])
        for k in (1, 2, 0)
    )
    systems = [_system(loop) for loop in loops]
    state = [len(s.controller.b) + len(s.model.b) for s in loops]
    compensated = bool(loops) and loops[0].compensated
    numbers = [
        lever.arm, lever.fittings, lever.stiffness, lever.relaxed_angle,
        plant.muscle.shortest_length,
        plant.fixture.length if plant.mounting == "rig" else 0.0,
        observer.gait, observer.stiffness, assist, KINDS.index(kind),
        0 if len(readers) == 1 else len(weights), full, nominal.per_output, nominal.per_stiffness,
        segment, 0.0 if within is None else within.step,
        PI if gains else LTR if loops else NOTHING, compensated,
        *((state[0], len(systems[0])) if loops else (0, 0)),
        *limits_of(action), *(gains or [1.0] * N_PID), *gain, *offset,
    ]  # fmt: skip
    size = max([len(weights), *(int(v) for v in state)])
    arrays = {
        "breaks": breaks,
        "stiffnesses": stiffnesses,
        "spring": spring,
        "weights": weights,
        "work_held": np.zeros((len(breaks), 1)),
        "work_slips": np.zeros((len(breaks), 1)),
        "work": np.zeros((4, size)),
        "systems": np.concatenate(systems) if systems else empty,
    }
    count = sum(state) if loops else N_PID_STATE
    return Design("knee", knee_by_address, count, numbers, columns, arrays, AGREEMENT)


def _six(reader: Any, field: int) -> Array:
    """Return a field of the observer's reader, with idle entries for signals of a gait."""
    idle = np.ones(6 - len(reader.columns)) if field == 1 else np.zeros(6 - len(reader.columns))
    return np.concatenate([reader[field], idle])


def _system(loop: Bumpless) -> Array:
    """Return a controller and its compensator as the kernel reads them."""
    c, m, n = loop.controller, loop.model, len(loop.controller.b)
    head = [n, len(m.b), loop.sign, loop.low, loop.high, float(c.d)]
    parts = [
        head, c.a.ravel(), c.b, c.c, m.a.ravel(), m.b, m.c, loop.gains.feedback,
        c.holding_state(1.0),
    ]  # fmt: skip
    return np.concatenate([np.asarray(part, float) for part in parts])
