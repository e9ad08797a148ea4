"""Scalar kernels of plays and stops, for use inside other kernels, and their loops over time.

A play is written in its absolute form ``max(x - r, min(x + r, w))``. Its state is then always one
of three exact numbers, so that a closed excursion of the input returns it to the last bit; the
incremental form ``clip(s + dx, -r, r)`` collects rounding errors.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.hysteresis.protocol import ELEMENTS
from pam_envs.kernels.build import entry, kernel

Array = NDArray[np.float64]

LINEAR, THRESHOLD, WEIGHT = 1, 2, 2 + ELEMENTS
"""Rows of a play operator's numbers, counted from the slope."""


@kernel
def play(x: float, threshold: float, w: float) -> float:
    """Return the position of a play after its input has moved monotonically to ``x``.

    Parameters
    ----------
    x : float
        Input, in any unit.
    threshold : float
        Half the dead width, in the unit of the input, not negative.
    w : float
        Position before.

    Returns
    -------
    float
        Position after; at most ``threshold`` away from ``x``.
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
def simulate_plays(
    x: Array, state: Array, thresholds: Array, weights: Array, linear: float, y: Array
) -> None:
    """Run plays over a record, (T,), from the rows ``state``; write the outputs to ``y``."""
    for t in range(len(x)):
        y[t] = play_step(x[t], state, 0, thresholds, weights, linear)


@entry
def simulate_slips(
    x: Array, state: Array, breaks: Array, stiffnesses: Array, spring: float, y: Array
) -> None:
    """Run elasto-slip elements over a record, (T,), from the rows ``state``; write to ``y``."""
    for t in range(len(x)):
        y[t] = slip_step(x[t], state, 0, breaks, stiffnesses, spring)


def move_plays(x: Array, thresholds: Sequence[float], state: ArrayLike) -> Array:
    """Return the positions of plays after inputs (...), from positions (..., n)."""
    # the comparisons of the kernel, spelt out, so that even the sign of a zero is the same
    w = np.asarray(state, dtype=float)
    r = np.asarray(thresholds)
    upper, lower = x[..., None] + r, x[..., None] - r
    inner = np.where(w < upper, w, upper)
    return np.where(inner > lower, inner, lower)
