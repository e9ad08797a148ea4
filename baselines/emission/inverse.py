"""Inverse of the identified muscle as a kernel, with or without the PID beside it.

Friction driven by length alone: the kernels of the plant's own hysteresis are those of the
controller. Where the Python controller calls ``exp`` of a library, the kernel has the series of
:func:`~pam_envs.kernels.arithmetic.decay`; the setpoints differ by some 1e-8 of their range, and
the actions, in float32, rarely by their last bit.
"""

from typing import Any

import numpy as np

from baselines.core.controller import LOAD_DIGITS
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
    scaled,
    write,
)
from baselines.emission.pid import N_PID, N_PID_STATE, gains_of, pid_begin, pid_update
from baselines.linear.pid import Gains
from baselines.positioning.inverse import Inverse, InversePid
from baselines.positioning.nominal import CURVE_POINTS
from pam_envs.constants import GRAVITY
from pam_envs.hysteresis.elements import play
from pam_envs.hysteresis.slip import SlipModel
from pam_envs.kernels.arithmetic import clip, decay, round_to_integer
from pam_envs.kernels.build import array_at, kernel
from pam_envs.plants.single_muscle.friction import (
    law_numbers,
    pressure_needed,
    strain_of_rest,
)

LAW, THRESHOLDS, CURVES, AIMS, DUE, WORK = range(FAMILY, FAMILY + 6)
"""Arrays: static law, friction elements, targets, scratch."""
(
    REST_LENGTH, FRICTION, PER_PRESSURE, PER_LOAD, LOW, PER, FULL, SLEW, LAG, PERIOD, LAG_GAIN,
    WHOLE, PART, WITH_PID, GAINS,
) = range(15)  # fmt: skip
"""Numbers of the design; the PID's, those of the action and of the signals follow."""
ACTION = GAINS + N_PID
READER = ACTION + 4
PRESSURE, DRIVE, LOAD, REST, PID, SLIDERS = 0, 1, 2, 3, 4, 4 + N_PID_STATE
"""Rows of the state; the nominal contractions of the last periods follow the sliders."""
EXPLAINING = 14
"""Bisections for the history that explains a first measurement."""
PER_KILOGRAM = 10.0**LOAD_DIGITS
AGREEMENT = (
    "equal to those of the Python controller within one unit in the last place of their float32, "
    "most of them bit for bit (the Python controller takes exp from a library)"
)


@kernel
def passive(strain: float, law: Any) -> float:
    """Return the force [N] with which tube and braid resist contraction."""
    e2 = strain * strain
    return (  # type: ignore[no-any-return]
        law[2, 0] * (1.0 - decay(strain / law[3, 0]))
        + law[4, 0] * strain
        + law[7, 0] * e2
        + law[5, 0] * (e2 * strain)
        + law[8, 0] * (e2 * e2)
    )


@kernel
def area_at(strain: float, law: Any) -> float:
    """Return the effective area [m2]."""
    return law[0, 0] * (1.0 - law[1, 0] * strain - law[6, 0] * (strain * strain))  # type: ignore[no-any-return]


@kernel
def drive_of(weight: float, strain: float, law: Any) -> float:
    """Return the effective pressure [Pa] that carries a weight [N] at a strain."""
    return (weight + passive(strain, law)) / area_at(strain, law)


@kernel
def limit_at(pressure: float, load: float, data: Any) -> float:
    """Return the factor on the slip forces."""
    return max(0.0, 1.0 + data[PER_PRESSURE] * pressure + data[PER_LOAD] * load)  # type: ignore[no-any-return]


@kernel
def free_rest(
    drive: float, weight: float, data: Any, law: Any, thresholds: Any, curves: Any, sliders: Any
) -> float:
    """Return the strain at rest without friction."""
    return strain_of_rest(  # type: ignore[no-any-return]
        drive, weight, 1.0, law, 0.0, 1.0, thresholds, curves, data[LOW], data[PER], sliders
    )


@kernel
def unloaded_strain(weight: float, law: Any) -> float:
    """Return the strain at rest without pressure, by bisection."""
    low, high = -0.3, 0.6
    for _ in range(60):
        middle = 0.5 * (low + high)
        if -passive(middle, law) > weight:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@kernel
def rest_at(
    pressure: float, load: float, data: Any, law: Any, thresholds: Any, curves: Any, sliders: Any
) -> float:
    """Return the strain at rest under a pressure [Pa], with friction on the way there."""
    limit = limit_at(pressure, load, data)
    return strain_of_rest(  # type: ignore[no-any-return]
        pressure, load * GRAVITY, 1.0, law, data[FRICTION], limit, thresholds, curves, data[LOW],
        data[PER], sliders,
    )  # fmt: skip


@kernel
def forward(
    pressure: float, load: float, data: Any, law: Any, thresholds: Any, curves: Any, sliders: Any
) -> float:
    """Return the effective pressure [Pa] at a pressure [Pa], and move the sliders."""
    strain = rest_at(pressure, load, data, law, thresholds, curves, sliders)
    limit = limit_at(pressure, load, data)
    for k in range(len(thresholds)):
        sliders[k] = play(strain, thresholds[k] * limit, sliders[k])
    return drive_of(load * GRAVITY, strain, law)  # type: ignore[no-any-return]


@kernel
def after_peak(
    peak: float, pressure: float, load: float, rest: float, data: Any, law: Any, thresholds: Any,
    curves: Any, sliders: Any,
) -> float:  # fmt: skip
    """Return the effective pressure [Pa] after a rise to a peak and a fall, and the sliders."""
    for k in range(len(thresholds)):
        sliders[k] = rest
    forward(peak, load, data, law, thresholds, curves, sliders)
    return forward(pressure, load, data, law, thresholds, curves, sliders)  # type: ignore[no-any-return]


@kernel
def held_contraction(
    drive: float, load: float, data: Any, law: Any, thresholds: Any, curves: Any, sliders: Any
) -> float:
    """Return the contraction [m] at rest under an effective pressure [Pa], from a table's points.

    The Python controller interpolates a table of ``CURVE_POINTS``; its two points are solved here.
    """
    weight, cell = load * GRAVITY, data[FULL] / (CURVE_POINTS - 1.0)
    k = clip(float(int(drive / cell)), 0.0, CURVE_POINTS - 2.0)
    at = clip(drive, 0.0, data[FULL])
    none = free_rest(0.0, weight, data, law, thresholds, curves, sliders) * data[REST_LENGTH]
    left = free_rest(k * cell, weight, data, law, thresholds, curves, sliders)
    right = free_rest((k + 1.0) * cell, weight, data, law, thresholds, curves, sliders)
    low, high = left * data[REST_LENGTH] - none, right * data[REST_LENGTH] - none
    return (high - low) / ((k + 1.0) * cell - k * cell) * (at - k * cell) + low  # type: ignore[no-any-return]


@kernel
def begin(
    contraction: float, pressure: float, load: float, data: Any, law: Any, thresholds: Any,
    curves: Any, state: Any,
) -> None:  # fmt: skip
    """Write the state of the simplest history that explains the first measurement."""
    sliders, weight = state[SLIDERS : SLIDERS + len(thresholds)], load * GRAVITY
    unloaded = unloaded_strain(weight, law)
    target = drive_of(weight, contraction / data[REST_LENGTH] + unloaded, law)
    rest = free_rest(0.0, weight, data, law, thresholds, curves, sliders)
    low, high = pressure, data[FULL]
    for _ in range(EXPLAINING):
        middle = 0.5 * (low + high)
        found = after_peak(middle, pressure, load, rest, data, law, thresholds, curves, sliders)
        if found < target:
            low = middle
        else:
            high = middle
    after_peak(low, pressure, load, rest, data, law, thresholds, curves, sliders)
    state[PRESSURE] = pressure
    strain = rest_at(pressure, load, data, law, thresholds, curves, sliders)
    state[DRIVE] = drive_of(weight, strain, law)
    state[LOAD], state[REST] = load, unloaded


@kernel
def targets(
    aims: Any, load: float, data: Any, law: Any, thresholds: Any, curves: Any, state: Any, work: Any
) -> None:
    """Replace contractions in ``work[0]`` by the pressures [Pa] that reach them from this state."""
    sliders, weight = state[SLIDERS : SLIDERS + len(thresholds)], load * GRAVITY
    for a in range(len(aims)):
        strain = work[0][a] / data[REST_LENGTH] + state[REST]
        pressure = drive_of(weight, strain, law)
        if len(thresholds) > 0:
            resting = free_rest(pressure, weight, data, law, thresholds, curves, sliders)
            free = 1.0 + data[PER_LOAD] * load
            pressure, _ = pressure_needed(
                pressure, resting, law, data[FRICTION], free, data[PER_PRESSURE], thresholds,
                curves, data[LOW], data[PER], sliders,
            )  # fmt: skip
        work[0][a] = min(max(pressure, 0.0), data[FULL])


@kernel
def next_pressure(pressure: float, set_point: float, data: Any) -> float:
    """Return the nominal regulator's pressure [Pa] after a control period."""
    gap = set_point - pressure
    size = abs(gap)
    ramp = (size - data[SLEW] * data[LAG]) / data[SLEW]
    ramp = min(max(ramp, 0.0), data[PERIOD])
    left = (size - data[SLEW] * ramp) * decay((data[PERIOD] - ramp) / data[LAG])
    return set_point - (left if gap >= 0.0 else -left)  # type: ignore[no-any-return]


@kernel
def inverse_by_address(book: Any, mode: int) -> None:
    """Compute the action of the inverse from an observation."""
    inputs, outputs = array_at(book, INPUT, 1, 0), array_at(book, OUTPUT, 1, 2)
    state, data = array_at(book, STATE, 1, 0), array_at(book, DATA, 1, 0)
    columns, numbers = array_at(book, COLUMNS, 1, 1), array_at(book, NUMBERS, 1, 1)
    law, thresholds = array_at(book, LAW, 2, 0), array_at(book, THRESHOLDS, 1, 0)
    curves, aims = array_at(book, CURVES, 2, 0), array_at(book, AIMS, 2, 0)
    due, work = array_at(book, DUE, 1, 0), array_at(book, WORK, 2, 0)
    n, whole = len(columns), int(data[WHOLE])
    expected = SLIDERS + len(thresholds)
    contraction = read(inputs, columns, data, READER, 0, 0, n)
    load = read(inputs, columns, data, READER, 2, 0, n)
    load = round_to_integer(load * PER_KILOGRAM) / PER_KILOGRAM
    sliders = state[SLIDERS : SLIDERS + len(thresholds)]
    if mode & 1:
        set_point = read(inputs, columns, data, READER, 1, 0, n)
        begin(contraction, set_point, load, data, law, thresholds, curves, state)
        held = held_contraction(state[DRIVE], load, data, law, thresholds, curves, sliders)
        pid_begin(state, PID, 0.0, contraction - held)
        for k in range(whole + 2):
            state[expected + k] = held
    for a in range(len(aims)):
        for k in range(n - 3):
            work[3][k] = aims[a][k] * read(inputs, columns, data, READER, 3 + k, 0, n)
        work[0][a] = row_sum(work[3], 0, n - 3)
    targets(aims, load, data, law, thresholds, curves, state, work)
    target = work[0][0]
    for a in range(len(aims)):
        if abs(work[0][a] - state[PRESSURE]) / data[SLEW] >= due[a]:
            target = work[0][a]
    set_point = state[PRESSURE] + data[LAG_GAIN] * (target - state[PRESSURE])
    set_point = min(max(set_point, data[ACTION + 2]), data[ACTION + 3])
    correction = 0.0
    if data[WITH_PID] > 0.0:
        part = data[PART]
        delayed = (1.0 - part) * state[expected + whole] + part * state[expected + whole + 1]
        error = delayed - contraction
        low, high = data[ACTION + 2] - set_point, data[ACTION + 3] - set_point
        correction = pid_update(data, GAINS, state, PID, error, -error, low, high)
    pressure = next_pressure(state[PRESSURE], set_point, data)
    state[DRIVE] = forward(pressure, load, data, law, thresholds, curves, sliders)
    state[PRESSURE] = pressure
    if data[WITH_PID] > 0.0:
        for k in range(whole + 1, 0, -1):
            state[expected + k] = state[expected + k - 1]
        state[expected] = held_contraction(
            state[DRIVE], load, data, law, thresholds, curves, sliders
        )
    write(outputs, 0, set_point + correction, data, ACTION)
    numbers[STEPS] = numbers[STEPS] + 1


def inverse(
    controller: Inverse, pid: Gains | None = None, delay: tuple[int, float] = (0, 0.0)
) -> Design:
    """Return the design of the inverse, and of the PID beside it.

    Raises
    ------
    ValueError
        If the nominal plant has effects, or a hysteresis that is driven by pressure.
    """
    plant = controller.nominal.plant
    held, model = plant.hysteresis, plant.hysteresis.operator
    if plant.extended or not isinstance(model, SlipModel) or held.stretch != 0.0:
        kind = "none" if model is None else model.kind
        raise ValueError(
            f"the inverse of a plant with hysteresis {kind!r}"
            f"{' and effects' if plant.extended else ''} is not exported; give a nominal plant "
            "without effects, with the hysteresis maxwell_slip_length or preisach_length"
        )
    thresholds, curves, low, per = model.arrays
    law = plant.regulator
    period, n = plant.control_period, len(controller.reader.columns)
    gains = [1.0] * N_PID if pid is None else gains_of(pid, period)
    numbers = [
        plant.muscle.rest_length, held.friction, held.limit_per_pressure, held.limit_per_load, low,
        per, law.max_pressure, law.slew_rate, law.time_constant, period, controller.lag_gain,
        delay[0], delay[1], float(pid is not None), *gains,
        *limits_of(controller.action_signal), *scaled(controller.reader),
    ]  # fmt: skip
    arrays = {
        "law": law_numbers(plant.muscle),
        "thresholds": thresholds,
        "curves": curves,
        "aims": controller.aims,
        "due": controller.due,
        "work": np.zeros((4, max(len(controller.aims), n))),
    }
    state = SLIDERS + len(thresholds) + delay[0] + 2
    columns = controller.reader.columns
    return Design("inverse", inverse_by_address, state, numbers, columns, arrays, AGREEMENT)


def inverse_pid(controller: InversePid) -> Design:
    """Return the design of the inverse with a PID on the deviation from the nominal muscle."""
    return inverse(controller.inverse, controller.gains, controller.delay)
