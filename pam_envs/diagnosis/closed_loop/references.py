"""References of the closed-loop comparison: fixed shapes, scaled to the stroke.

The steepest ramp covers the stroke in about 0.75 s, so that a regulator of usual slew rate can
follow it and a slow one cannot.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.diagnosis.arrays import Array
from pam_envs.diagnosis.closed_loop.plant_inverse import PREVIEW
from pam_envs.plants.core.stepper import PERIOD

DURATION = 24.0  # duration of each reference [s]
LOW, HIGH = 0.15, 0.85  # range of the references over the stroke
SEED = 20_030_113


def smooth_path(
    t: NDArray[Any], times: NDArray[Any], levels: NDArray[Any], ramps: NDArray[Any]
) -> Array:
    """Return a smooth path that reaches each level within a ramp that starts at its time."""
    path = np.full(len(t), levels[0])
    for i in range(1, len(levels)):
        s = np.clip((t - times[i]) / ramps[i], 0.0, 1.0)
        path += (levels[i] - levels[i - 1]) * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    return path


def fixed_references(top: float, period: float = PERIOD) -> dict[str, Array]:
    """Return the references [m]: sines, a staircase with holds, random ramps and holds."""
    t = np.arange(round(DURATION / period) + PREVIEW) * period
    turns = np.array([0.08, 0.21, 0.47, 0.83])
    sizes, phases = np.array([0.4, 0.3, 0.2, 0.1]), np.array([0.0, 1.1, 2.9, 4.6])
    sines = (sizes * np.sin(2.0 * np.pi * turns * t[:, None] + phases)).sum(axis=1)
    stairs = np.array([0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 0.75, 0.5, 0.25, 0.0, 0.5])
    times = np.concatenate([[0.0], 0.2 + 2.2 * np.arange(10)])
    rng = np.random.default_rng(SEED)
    count = round(DURATION / 1.5) + 1
    levels, paces = rng.uniform(0.0, 1.0, count), rng.uniform(1.0, 1.8, count)
    ramps = np.maximum(0.3, paces * np.abs(np.diff(levels, prepend=levels[0])))
    shares = {
        "sines": 0.5 + 0.5 * sines,
        "staircase": smooth_path(t, times, stairs, np.full(11, 0.5)),
        "ramps": smooth_path(t, 1.5 * np.arange(count), levels, ramps),
    }
    rise = smooth_path(t, np.zeros(2), np.array([0.0, 1.0]), np.full(2, 1.5))
    return {k: top * rise * (LOW + (HIGH - LOW) * v) for k, v in shares.items()}
