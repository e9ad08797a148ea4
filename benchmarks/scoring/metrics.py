"""Metrics as pure functions of recorded signals.

All arrays have one entry per control period and are in SI. The headline compares the true output
with the external reference; what a sensor saw is scored beside it and never instead of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.scoring import elbow as metrics_elbow
from benchmarks.scoring import joint as metrics_joint
from benchmarks.scoring import knee as metrics_knee
from benchmarks.scoring.errors import rms

Array = NDArray[np.float64]

METRICS: dict[str, str] = {
    "rms_error": "m",
    "p95_error": "m",
    "max_error": "m",
    "steady_state_error": "m",
    "sensed_rms_error": "m",
    "pressure_travel": "Pa/s",
    "air_use": "kg/s",
    "constraint_cost": "1",
}
"""The scored quantities and their units, the usual headline first. Less is better for all."""

HEADLINE = "rms_error"
GROUPS: dict[str, dict[str, str]] = {
    "range": metrics_knee.RANGE,
    "gait": metrics_knee.GAIT,
    "elbow": metrics_elbow.ELBOW,
    "joint": metrics_joint.JOINT,
    "chain": metrics_joint.CHAIN,
}
"""Additional groups of metrics by the names in scenario files."""

COST_RATIO = 1.1
"""Largest ratio of effort or constraint cost to the paper controller's, of a better controller."""
COST_FLOOR = {"constraint_cost": 1e-3}
"""Costs that count as none: a thousandth of a scale at all times."""
COSTS = {
    "emg_ratio": "EMG ratio",
    "pressure_travel": "pressure travel",
    "air_use": "air",
    "constraint_cost": "constraint cost",
}
"""Metrics that count as the costs of a lower error, where a track has them."""


def of_track(content: Mapping[str, Any]) -> dict[str, str]:
    """Return the metrics and units of a track from the content of its scenario file."""
    unit = content.get("unit", "m")
    units = METRICS | {name: unit for name, own in METRICS.items() if own == "m"}
    for group in content.get("metrics") or ():
        units = units | GROUPS[group]
    return units


def headline_of(content: Mapping[str, Any]) -> str:
    """Return the metric that ranks the rows of a track, from the content of its scenario file."""
    return str(content.get("headline", HEADLINE))


def percentile_95(error: Array) -> float:
    """Return the value that 95 % of the errors' sizes do not exceed, shape (n,)."""
    return float(np.percentile(np.abs(error), 95.0))


def settled(reference: Array, hold: int) -> NDArray[np.bool_]:
    """Return the mask of samples at which a reference has rested for ``hold`` samples, shape (n,).

    Parameters
    ----------
    reference : (n,) array
    hold : int
        Samples that must have passed since the last change.
    """
    n = len(reference)
    moved = np.zeros(n, bool)
    moved[0] = True
    moved[1:] = np.abs(np.diff(reference)) > 1e-12
    last = np.maximum.accumulate(np.where(moved, np.arange(n), 0))
    return np.asarray(np.arange(n) - last >= hold)


def steady_state_error(error: Array, reference: Array, hold: int) -> float:
    """Return the mean size of the error where the reference has rested, NaN if it never does.

    Parameters
    ----------
    error, reference : (n,) array
    hold : int
        Samples that the reference must have rested before the error counts as steady.
    """
    still = settled(reference, hold)
    return float(np.mean(np.abs(error[still]))) if still.any() else float("nan")


def constraint_cost(costs: Mapping[str, Array], scales: Mapping[str, float]) -> float:
    """Return the mean over time of all excesses over soft limits, each divided by its scale.

    1 means: one scale (say 1 mm) over one soft limit, all the time.

    Parameters
    ----------
    costs : mapping of (n,) array
        Excess over each soft limit.
    scales : mapping of float
        Unit of each, in the same SI unit.
    """
    return float(sum(np.mean(costs[name]) / scales[name] for name in scales))


def score(
    signals: Mapping[str, Array],
    period: float,
    settle_seconds: float,
    hold_seconds: float,
    cost_scales: Mapping[str, float],
    gate: Sequence[str] = (),
    groups: Sequence[str] = (),
    activity: str = "",
    half_range: float | None = None,
    tool_length: float | None = None,
) -> dict[str, float]:
    """Return every metric of one finished episode.

    Parameters
    ----------
    signals : mapping of (n,) array
        Recorded ``info`` of the steps 1 to n by its keys, and what the sensor gave as ``sensed``.
    period : float [s]
        Control period.
    settle_seconds : float [s]
        Start of the scored window. The constraint cost is of the whole episode.
    hold_seconds : float [s]
        How long the reference must have rested for a steady-state error.
    cost_scales : mapping of float
        Scale of each soft-limit cost.
    gate : sequence of str
        Signals that are all 1 where the output is tracked; everywhere if none is given.
    groups : sequence of str
        Of ``GROUPS``.
    activity : str
        Of a gait.
    half_range : float, optional
        What an error in percent refers to; half of what the reference went through if not given.
    tool_length : float, optional
        Of a chain's tool, see ``metrics_joint`` [m].

    Raises
    ------
    ValueError
        If nothing is left after the settling window, or of what is tracked.
    """
    time = np.asarray(signals["time"])
    window = time > settle_seconds + 0.5 * period
    if not window.any():
        raise ValueError(
            f"the episode ends at {time[-1]:g} s, inside the settling window of "
            f"{settle_seconds:g} s; lengthen the episode or shorten the window"
        )
    tracked = window.copy()
    for name in gate:
        tracked &= np.asarray(signals[name]) > 0.5
    reference = np.asarray(signals["reference"])[tracked]
    error = np.asarray(signals["output"])[tracked] - reference
    sensed = np.asarray(signals["sensed"])[tracked] - reference
    if not len(error):
        raise ValueError(
            f"{' and '.join(gate)} are never 1 together: lengthen the episode or choose"
            " another gate"
        )
    seconds, hold = float(window.sum()) * period, round(hold_seconds / period)
    path = metrics_joint.way(signals)[tracked] if "chain" in groups else reference
    scores = {
        "rms_error": rms(error),
        "p95_error": percentile_95(error),
        "max_error": float(np.abs(error).max()),
        "steady_state_error": steady_state_error(error, path, hold),
        "sensed_rms_error": rms(sensed),
        "pressure_travel": float(np.sum(signals["effort/pressure_travel"][window])) / seconds,
        "air_use": float(np.sum(signals["effort/air"][window])) / seconds,
        "constraint_cost": constraint_cost(signals, cost_scales),
    }
    if "range" in groups:
        scores |= metrics_knee.of_range(signals, window, tracked, half_range)
    if "gait" in groups:
        scores |= metrics_knee.of_gait(signals, window, tracked, period, activity)
    if "elbow" in groups:
        scores |= metrics_elbow.of_elbow(signals, window, period)
    if "joint" in groups:
        scores |= metrics_joint.of_joint(signals, window)
    if "chain" in groups:
        if tool_length is None:
            raise ValueError("a chain's score needs tool_length [m] in its scenario file")
        scores |= metrics_joint.of_chain(signals, window, tool_length)
    return scores


def worst_of(scores: Mapping[str, float], worst: Mapping[str, float]) -> dict[str, float]:
    """Return the scores of an episode that a limit ended: the worst case, or worse if it was.

    Parameters
    ----------
    scores : mapping of float
        What could be measured until the end (may be empty or NaN).
    worst : mapping of float
        The stated worst-case value of each metric.
    """
    measured = {name: scores.get(name, float("nan")) for name in worst}
    return {name: float(np.fmax(value, measured[name])) for name, value in worst.items()}
