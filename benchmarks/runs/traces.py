"""Trajectories of a few episodes, thinned and rounded, for the pictures of a row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from benchmarks.scenarios.scenario import ScenarioSet

Array = NDArray[np.float64]
Signals = Mapping[str, Array]

POINTS = 400
"""Samples of a signal at most."""
GRID = 2_000
"""Steps of the grid over a signal's range; a picture is at most 220 pixels high."""


def chosen(track: ScenarioSet) -> tuple[str, ...]:
    """Return the drawn scenarios: the first with a moving reference and the first that rests.

    Parameters
    ----------
    track : ScenarioSet
    """
    scenarios = track.scenarios()
    moving = [scenario.name for scenario in scenarios if not scenario.rests]
    resting = [scenario.name for scenario in scenarios if scenario.rests]
    return (*moving[:1], *resting[:1])


def of_episode(
    scenario: str,
    seed: int,
    signals: Signals,
    content: Mapping[str, Any],
    training_seed: int | None = None,
) -> dict[str, Any]:
    """Return the pictures' data of an episode: reference, output, pressures, hysteresis loop.

    Parameters
    ----------
    scenario : str
    seed : int
    signals : mapping of (n,) array
        Recorded ``info``, SI.
    content : mapping
        Of the scenario file.
    training_seed : int, optional

    Returns
    -------
    dict
        ``signals`` packed by :func:`pack`; ``pressures`` and ``loop`` (across, up) name them.
    """
    pressures = _pressures(signals)
    across, up = _loop(signals, pressures)
    drawn = {"output": np.asarray(signals["output"]), "reference": _tracked(signals, content)}
    drawn |= {name: np.asarray(signals[name]) for name in pressures}
    drawn |= {"loop/across": across, "loop/up": up}
    every = max(1, -(-len(signals["time"]) // POINTS))
    return {
        "scenario": scenario,
        "seed": int(seed),
        "training_seed": training_seed,
        "start": float(signals["time"][0]) if len(signals["time"]) else 0.0,
        "step": float(np.diff(signals["time"][:2])[0]) * every if len(signals["time"]) > 1 else 0.0,
        "pressures": list(pressures),
        "loop": _loop_names(signals, pressures),
        "signals": {name: pack(values[::every]) for name, values in drawn.items()},
    }


def _tracked(signals: Signals, content: Mapping[str, Any]) -> Array:
    """Return the reference, NaN where it does not apply."""
    reference = np.array(signals["reference"], float)
    for gate in content.get("gate") or ():
        reference[np.asarray(signals[gate]) < 0.5] = np.nan
    return reference


def _pressures(signals: Signals) -> tuple[str, ...]:
    """Return the names of one muscle's pressure, or of a pair's (of a chain, the first pair's)."""
    for names in _PRESSURES:
        if all(name in signals for name in names):
            return names
    return ()


_PRESSURES: tuple[tuple[str, ...], ...] = (
    ("state/pressure",),
    ("state/pressure_a", "state/pressure_b"),
    ("state/pressure_0a", "state/pressure_0b"),
)


def _loop(signals: Signals, pressures: Sequence[str]) -> tuple[Array, Array]:
    """Return the pressure, or the difference of a pair's, and the output that it moves."""
    up = np.asarray(signals.get("state/angle_0", signals["output"]), float)
    if not pressures:
        return np.asarray(signals["reference"], float), up
    first = np.asarray(signals[pressures[0]], float)
    return (first if len(pressures) == 1 else first - np.asarray(signals[pressures[1]])), up


def _loop_names(signals: Signals, pressures: Sequence[str]) -> list[str]:
    across = {0: "reference", 1: "pressure", 2: "pressure difference"}[len(pressures)]
    return [across, "angle of joint 1" if "state/angle_0" in signals else "output"]


def pack(values: ArrayLike) -> dict[str, Any]:
    """Return a signal as differences of whole numbers on a grid over its range.

    Parameters
    ----------
    values : (n,) array
        NaN where the signal has a gap.

    Returns
    -------
    dict
        ``low`` and ``high`` of the range, and ``steps``: of each sample the change since the last
        known one in units of the grid, 1 / :data:`GRID` of the range; ``None`` in a gap.
    """
    given = np.asarray(values, float)
    known = np.isfinite(given)
    low, high = (float(f(given[known])) if known.any() else 0.0 for f in (np.min, np.max))
    span = high - low if high > low else 1.0
    places = np.rint((given[known] - low) / span * GRID).astype(int)
    steps = np.full(len(given), None, object)
    steps[known] = np.diff(places, prepend=0)
    return {"low": low, "high": high, "steps": steps.tolist()}


def unpack(packed: Mapping[str, Any]) -> Array:
    """Return the signal that :func:`pack` wrote, to within half a step of its grid."""
    steps = np.array(packed["steps"], float)
    known = np.isfinite(steps)
    steps[known] = np.cumsum(steps[known])
    span = packed["high"] - packed["low"] or 1.0
    return np.asarray(packed["low"] + steps * span / GRID)
