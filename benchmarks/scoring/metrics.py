"""Metrics of an episode as pure functions of recorded signals, by the rules of a scenario file.

All arrays have one entry per control period and are in SI. The headline compares the true output
with the external reference; sensed values are scored in addition, never instead.
"""

import importlib
import pkgutil
from collections.abc import Mapping
from typing import Any

import numpy as np

from benchmarks.scoring import groups
from benchmarks.scoring.group import EFFORT, Column, Group, Mask, Record, rms
from pam_envs.arrays import Array

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
"""The common metrics and their units, the usual headline first. Less is better for all."""
HEADLINE = "rms_error"
GROUPS: dict[str, Group] = {
    value.name: value
    for module in pkgutil.iter_modules(groups.__path__, f"{groups.__name__}.")
    for value in vars(importlib.import_module(module.name)).values()
    if isinstance(value, Group)
}
"""Additional groups of metrics by the names in scenario files."""

COST_RATIO = 1.1
"""Largest ratio of effort or constraint cost to the paper controller's for a better controller."""
COST_FLOOR = {"constraint_cost": 1e-3}
"""Costs that count as zero: a thousandth of a scale at all times."""
COSTS = {
    **{metric: name for group in GROUPS.values() for metric, name in group.costs.items()},
    "pressure_travel": "pressure travel",
    "air_use": "air",
    "constraint_cost": "constraint cost",
}
"""Metrics that count as the costs of a lower error, if a track has them."""
_CONSTRAINT: Column = ("constraint_cost", "constraint cost", 1.0)


def groups_of(content: Mapping[str, Any]) -> list[Group]:
    """Return the additional groups of metrics of a track, from the content of its file."""
    return [GROUPS[name] for name in content.get("metrics") or ()]


def of_track(content: Mapping[str, Any]) -> dict[str, str]:
    """Return the metrics and units of a track from the content of its scenario file."""
    unit = content.get("unit", "m")
    units = METRICS | {name: unit for name, own in METRICS.items() if own == "m"}
    for group in groups_of(content):
        units = {**units, **group.units}
    return units


def headline_of(content: Mapping[str, Any]) -> str:
    """Return the metric that ranks the rows of a track, from the content of its scenario file."""
    return str(content.get("headline", HEADLINE))


def headlines_of(content: Mapping[str, Any]) -> tuple[Column, ...]:
    """Return the metrics beside the RMS in a track's first tables, declared by its groups."""
    return tuple(column for group in groups_of(content) for column in group.headline)


def shown(content: Mapping[str, Any]) -> tuple[str, float]:
    """Return the unit in which errors are shown, and its factor from SI; mm by default."""
    how = content.get("shown") or {"unit": "mm", "factor": 1e3}
    return str(how["unit"]), float(how["factor"])


def columns_of(content: Mapping[str, Any]) -> tuple[Column, ...]:
    """Return the columns after the headline: those of the last group, and the constraint cost."""
    unit, factor = shown(content)
    errors: tuple[Column, ...] = (
        ("p95_error", f"p95 [{unit}]", factor),
        ("max_error", f"max [{unit}]", factor),
        ("steady_state_error", f"steady [{unit}]", factor),
        ("sensed_rms_error", f"sensed RMS [{unit}]", factor),
    )
    own = groups_of(content)
    return (*(own[-1].columns(errors) if own else (*errors, *EFFORT)), _CONSTRAINT)


def percentile_95(error: Array) -> float:
    """Return the value that 95 % of the errors' sizes do not exceed, shape (n,)."""
    return float(np.percentile(np.abs(error), 95.0))


def settled(reference: Array, hold: int) -> Mask:
    """Return the mask of samples at which a reference has rested for ``hold`` samples, (n,)."""
    n = len(reference)
    moved = np.zeros(n, bool)
    moved[0] = True
    moved[1:] = np.abs(np.diff(reference)) > 1e-12
    last = np.maximum.accumulate(np.where(moved, np.arange(n), 0))
    return np.asarray(np.arange(n) - last >= hold)


def steady_state_error(error: Array, reference: Array, hold: int) -> float:
    """Return the mean size of the error where the reference has rested, NaN if it never does."""
    still = settled(reference, hold)
    return float(np.mean(np.abs(error[still]))) if still.any() else float("nan")


def constraint_cost(costs: Mapping[str, Array], scales: Mapping[str, float]) -> float:
    """Return the mean over time of all excesses over soft limits, each divided by its scale.

    A value of 1 means one scale (for example 1 mm) above one soft limit at all times.
    """
    return float(sum(np.mean(costs[name]) / scales[name] for name in scales))


def score(
    signals: Mapping[str, Array], period: float, content: Mapping[str, Any]
) -> dict[str, float]:
    """Return every metric of one finished episode.

    ``signals`` are the recorded ``info`` of the steps 1 to n by its keys, shape (n,), SI;
    ``period`` is the control period [s], ``content`` that of the scenario file. The constraint cost
    is of the whole episode, everything else of the time after ``settle_seconds``, where all signals
    of its ``gate`` are 1. A ValueError says that no such samples remain.
    """
    time, settle = np.asarray(signals["time"]), float(content["settle_seconds"])
    window = time > settle + 0.5 * period
    if not window.any():
        raise ValueError(
            f"the episode ends at {time[-1]:g} s, inside the settling window of "
            f"{settle:g} s; lengthen the episode or shorten the window"
        )
    tracked, gate = window.copy(), content.get("gate") or ()
    for name in gate:
        tracked &= np.asarray(signals[name]) > 0.5
    if not tracked.any():
        raise ValueError(
            f"{' and '.join(gate)} are never 1 together: lengthen the episode or choose"
            " another gate"
        )
    reference = np.asarray(signals["reference"])[tracked]
    error = np.asarray(signals["output"])[tracked] - reference
    own, record = groups_of(content), Record(signals, window, tracked, period, content)
    paths = [group.path(signals)[tracked] for group in own if group.path]
    hold = round(float(content["hold_seconds"]) / period)
    scores = {
        "rms_error": rms(error),
        "p95_error": percentile_95(error),
        "max_error": float(np.abs(error).max()),
        "steady_state_error": steady_state_error(error, paths[0] if paths else reference, hold),
        "sensed_rms_error": rms(np.asarray(signals[content["sensed"]])[tracked] - reference),
        "pressure_travel": record.rate("effort/pressure_travel"),
        "air_use": record.rate("effort/air"),
        "constraint_cost": constraint_cost(signals, content["cost_scales"]),
    }
    for group in own:
        scores |= group.score(record)
    return scores


def worst_of(scores: Mapping[str, float], worst: Mapping[str, float]) -> dict[str, float]:
    """Return the scores of an episode that ended early: the worst case, or worse if it was."""
    measured = {name: scores.get(name, float("nan")) for name in worst}
    return {name: float(np.fmax(value, measured[name])) for name, value in worst.items()}


def scores_of(
    episode: Any, content: Mapping[str, Any], rests: bool, failed: bool | None = None
) -> dict[str, float]:
    """Return the scores of an episode; one that did not reach its end gets the worst case.

    A reference that does not rest has no steady-state error (NaN). ``failed`` overrides whether the
    episode counts as failed.
    """
    scores: dict[str, float] = {}
    try:
        if len(episode.actions) or not episode.failed:
            scores = score(episode.signals, episode.period, content)
    except ValueError:
        if not episode.failed:
            raise
    if episode.failed if failed is None else failed:
        scores = worst_of(scores, content["worst_case"])
    if not rests:
        scores["steady_state_error"] = float("nan")
    return scores
