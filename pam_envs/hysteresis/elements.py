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

from pam_envs.kernels.build import entry, kernel

Array = NDArray[np.float64]


@kernel
def play(x: float, threshold: float, w: float) -> float:
    """Return where a play stands after its input has come to ``x`` from one side.

    Parameters
    ----------
    x : float
        Input, in any unit.
    threshold : float
        Half the dead width, in the unit of the input, not negative.
    w : float
        Where the play stood before.

    Returns
    -------
    float
        Where the play stands now; at most ``threshold`` away from ``x``.
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
    """Return where plays stand after inputs (...), from positions (..., n)."""
    # the comparisons of the kernel, spelt out, so that even the sign of a zero is the same
    w = np.asarray(state, dtype=float)
    r = np.asarray(thresholds)
    upper, lower = x[..., None] + r, x[..., None] - r
    inner = np.where(w < upper, w, upper)
    return np.where(inner > lower, inner, lower)
