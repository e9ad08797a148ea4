"""Plays and stops: scalar kernels, loops over time, and the base of the models made of them.

A play is written in its absolute form ``max(x - r, min(x + r, w))``. Its state is then always one
of three exact numbers, so that a closed excursion of the input returns it to the last bit; the
incremental form ``clip(s + dx, -r, r)`` collects rounding errors.
"""

import math
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.hysteresis.checks import series, single_rows
from pam_envs.hysteresis.protocol import ELEMENTS
from pam_envs.kernels.build import entry, kernel

LINEAR, THRESHOLD, WEIGHT = 1, 2, 2 + ELEMENTS
"""Rows of a play operator's numbers, counted from the slope."""


@kernel
def play(x: float, threshold: float, w: float) -> float:
    """Return the position of a play after its input has moved monotonically to ``x``.

    ``threshold`` is half the dead width, not negative, ``w`` the position before, both in the unit
    of the input; the position after is at most ``threshold`` away from ``x``.
    """
    low, high = x - threshold, x + threshold
    if w < low:
        return low
    if w > high:
        return high
    return w


@kernel
def stop(x: float, threshold: float, w: float) -> float:
    """Return the deflection of a stop, ``x - play(x, threshold, w)``, within ``+-threshold``."""
    return x - play(x, threshold, w)


@kernel
def play_step(
    x: float, state: Any, lane: int, thresholds: Any, weights: Any, linear: float
) -> float:
    """Advance the plays in the rows ``state[i][lane]`` and return their weighted sum."""
    y = linear * x
    for i in range(len(thresholds)):
        w = play(x, thresholds[i], state[i][lane])
        state[i][lane] = w
        y = y + weights[i] * w
    return y


@kernel
def slip_step(
    x: float, state: Any, lane: int, break_displacements: Any, stiffnesses: Any, spring: float
) -> float:
    """Advance the slip positions in the rows ``state[i][lane]`` and return the force."""
    force = spring * x
    for i in range(len(break_displacements)):
        w = play(x, break_displacements[i], state[i][lane])
        state[i][lane] = w
        force = force + stiffnesses[i] * (x - w)
    return force


@kernel
def plays_step(
    x: Any, y: Any, rows: Any, fixed: Any, counts: Any, table: Any, elements: int, at: int,
    model: int, count: int, member: int, first: int, last: int,
) -> None:  # fmt: skip
    """Advance the plays of a tile (:class:`~pam_envs.hysteresis.protocol.Kernels`)."""
    linear = fixed[model + LINEAR]
    for j in range(first, last):
        y[j] = linear[j] * x[j]
    for k in range(elements):
        threshold, weight = fixed[model + THRESHOLD + k], fixed[model + WEIGHT + k]
        state = rows[at + k]
        for j in range(first, last):
            w = play(x[j], threshold[j], state[j])
            state[j] = w
            y[j] = y[j] + weight[j] * w


@kernel
def plays_lag(
    rows: Any, fixed: Any, counts: Any, table: Any, state: int, elements: int, x_at: int,
    lag_at: int, operators: int, model: int, count: int, member: int, first: int, last: int,
) -> None:  # fmt: skip
    """Advance the plays and write how far they lag behind, for a total slope of 1."""
    for m in range(operators):
        x, lag = rows[x_at + m], rows[lag_at + m]
        for j in range(first, last):
            lag[j] = 0.0
        for k in range(elements):
            threshold, weight = fixed[model + THRESHOLD + k], fixed[model + WEIGHT + k]
            position = rows[state + m * ELEMENTS + k]
            for j in range(first, last):
                w = play(x[j], threshold[j], position[j])
                position[j] = w
                lag[j] = lag[j] + weight[j] * (x[j] - w)


@kernel
def plays_peek(
    rows: Any, fixed: Any, counts: Any, table: Any, state: int, elements: int, x_at: int,
    lag_at: int, stick_at: int, operators: int, model: int, count: int, member: int, first: int,
    last: int,
) -> None:  # fmt: skip
    """Write the lags at inputs and their slopes, the weight of the plays that do not move."""
    for m in range(operators):
        x, lag, stick = rows[x_at + m], rows[lag_at + m], rows[stick_at + m]
        for j in range(first, last):
            lag[j] = 0.0
            stick[j] = 0.0
        for k in range(elements):
            threshold, weight = fixed[model + THRESHOLD + k], fixed[model + WEIGHT + k]
            position = rows[state + m * ELEMENTS + k]
            for j in range(first, last):
                w = play(x[j], threshold[j], position[j])
                lag[j] = lag[j] + weight[j] * (x[j] - w)
                stick[j] = stick[j] + (weight[j] if w == position[j] else 0.0)


@entry
def simulate_elements(
    x: Array, state: Array, thresholds: Array, gains: Array, line: float, slips: bool, y: Array
) -> None:
    """Run plays, or stops if ``slips``, over a record, (T,), from the rows ``state``."""
    for t in range(len(x)):
        if slips:
            y[t] = slip_step(x[t], state, 0, thresholds, gains, line)
        else:
            y[t] = play_step(x[t], state, 0, thresholds, gains, line)


def move_plays(x: Array, thresholds: Array, state: ArrayLike) -> Array:
    """Return the positions of plays after inputs (...), from positions (..., n)."""
    # the comparisons of the kernel, so that even the sign of a zero is the same
    w = np.asarray(state, dtype=float)
    upper, lower = x[..., None] + thresholds, x[..., None] - thresholds
    inner = np.where(w < upper, w, upper)
    return np.where(inner > lower, inner, lower)


class ParallelElements:
    """A line and plays, or stops, in parallel: the common part of their models.

    The state holds the positions of the plays (the slip positions of the stops), shape (..., n).
    """

    slips: ClassVar[bool] = False
    """True for stops."""

    @property
    def parts(self) -> tuple[Array, Array, float]:
        """Thresholds and gains of the elements, shape (n,) each, and slope of the line."""
        raise NotImplementedError

    @property
    def friction(self) -> float:
        """Sum of the outputs of all elements when all slip."""
        thresholds, gains, _ = self.parts
        return math.fsum(gains * thresholds)

    def initial_state(self, batch_shape: tuple[int, ...] = ()) -> Array:
        """Return the positions of the virgin state, zeros of shape ``(*batch_shape, n)``."""
        return np.zeros((*batch_shape, len(self.parts[0])))

    def step(self, x: ArrayLike, state: ArrayLike) -> tuple[Array, Array]:
        """Return the output and the new state for one sample of every row.

        ``x`` has shape (...), ``state`` and the new state (..., n); the outputs have the bits of
        :meth:`simulate`. The state given is not changed.
        """
        thresholds, gains, line = self.parts
        x = np.asarray(x, dtype=float)
        new = move_plays(x, thresholds, state)
        y = np.asarray(line * x)
        for i, gain in enumerate(gains):
            y = y + gain * (x - new[..., i] if self.slips else new[..., i])
        return y, new

    def simulate(self, x: ArrayLike, state: ArrayLike | None = None) -> tuple[Array, Array]:
        """Return the outputs, shape (T,), for inputs of shape (T,), and the last state, (n,)."""
        values = series(x)
        start = self.initial_state() if state is None else state
        rows = single_rows(start, len(self.parts[0]))
        y = np.empty_like(values)
        simulate_elements(values, rows, *self.parts, self.slips, y)
        return y, rows[:, 0]
