"""PID of one signal as a kernel: that of the muscle, and that of the knee's tension."""

from typing import Any

from baselines.emission.book import (
    COLUMNS,
    DATA,
    INPUT,
    NUMBERS,
    OUTPUT,
    STATE,
    STEPS,
    Design,
    limits_of,
    read,
    scaled,
    write,
)
from baselines.linear.pid import Gains, Pid
from baselines.positioning.pid import MuscleView
from pam_envs.kernels.build import array_at, kernel

(PROPORTIONAL, INTEGRAL, DERIVATIVE, FILTER, TRACKING, PERIOD, N_PID) = range(7)
"""Numbers of a PID in a design."""
N_PID_STATE = 3
"""Integral, last measurement, slope."""
EXACT = "equal to those of the Python controller to the last bit"
REACH = N_PID
READER, ACTION = REACH + 1, REACH + 9
"""Numbers of the muscle's PID: those above, the reach, four signals, the action."""


@kernel
def pid_update(
    data: Any, at: int, state: Any, s: int, error: float, measured: float, low: float, high: float
) -> float:
    """Return the output of a PID and write its next state; see :mod:`baselines.linear.pid`."""
    period = data[at + PERIOD]
    pole = data[at + FILTER] / (data[at + FILTER] + period)
    slope = pole * state[s + 2] + (1.0 - pole) * (measured - state[s + 1]) / period
    unlimited = data[at + PROPORTIONAL] * error + state[s] - data[at + DERIVATIVE] * slope
    output = min(max(unlimited, low), high)
    back = (output - unlimited) * min(1.0, period / data[at + TRACKING])
    integral = state[s] + data[at + INTEGRAL] * period * error + back
    state[s] = min(max(integral, low), high)
    state[s + 1] = measured
    state[s + 2] = slope
    return output  # type: ignore[no-any-return]


@kernel
def pid_begin(state: Any, s: int, output: float, measured: float) -> None:
    """Write the state that gives ``output`` while the error is 0."""
    state[s] = output
    state[s + 1] = measured
    state[s + 2] = 0.0


@kernel
def muscle_pid_by_address(book: Any, mode: int) -> None:
    """Compute the action of the muscle's PID from an observation."""
    inputs, outputs = array_at(book, INPUT, 1, 0), array_at(book, OUTPUT, 1, 2)
    state, data = array_at(book, STATE, 1, 0), array_at(book, DATA, 1, 0)
    columns, numbers = array_at(book, COLUMNS, 1, 1), array_at(book, NUMBERS, 1, 1)
    contraction = read(inputs, columns, data, READER, 0, 0, 4)
    pressure = read(inputs, columns, data, READER, 1, 0, 4)
    set_point = read(inputs, columns, data, READER, 2, 0, 4)
    reference = read(inputs, columns, data, READER, 3, 0, 4)
    if mode & 1:
        pid_begin(state, 0, set_point, contraction)
    low = max(pressure - data[REACH], data[ACTION + 2])
    high = min(pressure + data[REACH], data[ACTION + 3])
    output = pid_update(data, 0, state, 0, reference - contraction, contraction, low, high)
    write(outputs, 0, output, data, ACTION)
    numbers[STEPS] = numbers[STEPS] + 1


def gains_of(gains: Gains, period: float) -> list[float]:
    """Return the numbers of a PID."""
    return [
        gains.proportional, gains.integral, gains.derivative, gains.filter_time,
        gains.tracking_time, period,
    ]  # fmt: skip


def muscle_pid(controller: Pid) -> Design:
    """Return the design of the muscle's PID."""
    view = controller.view
    assert isinstance(view, MuscleView)
    numbers = [
        *gains_of(controller.gains, controller.period),
        view.reach,
        *scaled(view.reader),
        *limits_of(controller.action_signal),
    ]
    columns, state = view.reader.columns, N_PID_STATE
    return Design("muscle_pid", muscle_pid_by_address, state, numbers, columns, {}, EXACT)
