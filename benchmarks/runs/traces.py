"""Trajectories of a few episodes, thinned and rounded, for the pictures of a row."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from benchmarks.scenarios.scenario import ScenarioSet
from pam_envs.arrays import Array

Signals = Mapping[str, Array]

POINTS = 400  # largest number of samples of a signal
GRID = 2_000  # steps of the grid over a signal's range; a picture is at most 220 pixels high


_PRESSURES: tuple[tuple[str, ...], ...] = (
    ("state/pressure",),
    ("state/pressure_a", "state/pressure_b"),
    ("state/pressure_0a", "state/pressure_0b"),
)
"""Pressure signals of one muscle, or of a pair (of a chain, the first pair)."""


def chosen(track: ScenarioSet) -> tuple[str, ...]:
    """Return the drawn scenarios: the first with a moving reference and the first that rests."""
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

    ``signals`` of the result are packed by :func:`pack`; ``pressures`` and ``loop`` (across, up)
    name them.
    """
    pressures = next((n for n in _PRESSURES if all(name in signals for name in n)), ())
    reference = np.array(signals["reference"], float)  # NaN where it does not apply
    for gate in content.get("gate") or ():
        reference[np.asarray(signals[gate]) < 0.5] = np.nan
    read = [np.asarray(signals[name], float) for name in pressures]
    across: tuple[str, Array] = ("reference", np.asarray(signals["reference"], float))
    if read:
        across = ("pressure", read[0])
    if len(read) == 2:
        across = ("pressure difference", read[0] - read[1])
    joint = "state/angle_0" in signals
    drawn = {
        "output": np.asarray(signals["output"]),
        "reference": reference,
        **dict(zip(pressures, read, strict=True)),
        "loop/across": across[1],
        "loop/up": np.asarray(signals["state/angle_0" if joint else "output"], float),
    }
    every = max(1, -(-len(signals["time"]) // POINTS))
    return {
        "scenario": scenario,
        "seed": int(seed),
        "training_seed": training_seed,
        "start": float(signals["time"][0]) if len(signals["time"]) else 0.0,
        "step": float(np.diff(signals["time"][:2])[0]) * every if len(signals["time"]) > 1 else 0.0,
        "pressures": list(pressures),
        "loop": [across[0], "angle of joint 1" if joint else "output"],
        "signals": {name: pack(values[::every]) for name, values in drawn.items()},
    }


def pack(values: ArrayLike) -> dict[str, Any]:
    """Return a signal, NaN in its gaps, as differences of integers on a grid over its range.

    ``steps`` has for each sample the change since the last known one in units of the grid,
    1 / :data:`GRID` of the range; ``None`` in a gap.
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
