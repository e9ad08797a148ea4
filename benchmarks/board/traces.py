"""A few signals of an episode, thinned and rounded: what the page draws of a row."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from benchmarks.scenarios.scenario import ScenarioSet

Array = NDArray[np.float64]
Signals = Mapping[str, Array]

POINTS = 400
"""Most samples that are kept of a signal."""
_STEPS = 65_534
_NOTHING = -32_768


def chosen(track: ScenarioSet) -> tuple[str, ...]:
    """Return the scenarios that are drawn: the first whose reference moves, the first that rests.

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
    """Return what is drawn of an episode: reference, output, pressures and the plant's loop.

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
    """Return the reference, NaN where the output is not asked to follow it."""
    reference = np.array(signals["reference"], float)
    for gate in content.get("gate") or ():
        reference[np.asarray(signals[gate]) < 0.5] = np.nan
    return reference


def _pressures(signals: Signals) -> tuple[str, ...]:
    """Return the names of one muscle's pressure, or of an antagonistic pair's (a chain's first)."""
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
    """Return pressure (or the difference of a pair's) and what it moves."""
    up = np.asarray(signals.get("state/angle_0", signals["output"]), float)
    if not pressures:
        return np.asarray(signals["reference"], float), up
    first = np.asarray(signals[pressures[0]], float)
    return (first if len(pressures) == 1 else first - np.asarray(signals[pressures[1]])), up


def _loop_names(signals: Signals, pressures: Sequence[str]) -> list[str]:
    across = {0: "reference", 1: "pressure", 2: "pressure difference"}[len(pressures)]
    return [across, "angle of joint 1" if "state/angle_0" in signals else "output"]


def pack(values: ArrayLike) -> dict[str, Any]:
    """Return a signal as whole numbers of a grid over its range, in text; NaN has its own.

    Parameters
    ----------
    values : (n,) array

    Returns
    -------
    dict
        ``low`` and ``high`` of the range, and ``data``: little-endian 16-bit numbers, base64.
    """
    given = np.asarray(values, float)
    known = np.isfinite(given)
    low, high = (float(f(given[known])) if known.any() else 0.0 for f in (np.min, np.max))
    span = high - low if high > low else 1.0
    numbers = np.full(len(given), _NOTHING, "<i2")
    numbers[known] = np.rint((given[known] - low) / span * _STEPS).astype(int) - _STEPS // 2
    return {"low": low, "high": high, "data": base64.b64encode(numbers.tobytes()).decode()}


def unpack(packed: Mapping[str, Any]) -> Array:
    """Return the signal that :func:`pack` wrote, to within its grid."""
    numbers = np.frombuffer(base64.b64decode(packed["data"]), "<i2").astype(int)
    span = packed["high"] - packed["low"] or 1.0
    values = packed["low"] + (numbers + _STEPS // 2) * span / _STEPS
    return np.where(numbers == _NOTHING, np.nan, values)
