"""Whole records of the knee orthosis, driven by given set-points, parameter sets side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.build import COMPILED, LANES, build, kernel, prange, scratch, tile_view
from pam_envs.plants.core.tiles import first_of, in_tiles
from pam_envs.plants.knee_orthosis import rows as K
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.knee_orthosis.rows import N_COUNTS, N_PARAMETERS
from pam_envs.plants.knee_orthosis.step import (
    N_WORK,
    advance,
    begin_lane,
    replacements,
    start_hysteresis,
)

OUTPUTS = {
    "angle": K.ANGLE,
    "velocity": K.VELOCITY,
    "pressure": K.PRESSURE,
    "stiffness": K.STIFFNESS,
    "tension": K.TENSION,
    "length": K.LENGTH,
    "torque": K.TORQUE,
    "air": K.AIR,
    "phase": K.PHASE,
    "knee": K.KNEE,
    "knee_rate": K.KNEE_RATE,
    "knee_acceleration": K.KNEE_ACCELERATION,
    "deviation": K.DEVIATION,
    "deviation_rate": K.DEVIATION_RATE,
    "shank": K.SHANK,
    "ankle": K.ANKLE,
    "ground_z": K.GROUND_Z,
    "ground_x": K.GROUND_X,
    "cop": K.COP,
    "demand": K.DEMAND,
    "estimate": K.ESTIMATE,
    "heel": K.HEEL,
    "stance": K.STANCE,
    "hold": K.HOLD,
    "hold_rate": K.HOLD_RATE,
    "quads": K.QUADS,
    "quads_free": K.QUADS_FREE,
    "flexors": K.FLEXORS,
    "flexors_free": K.FLEXORS_FREE,
}
"""Every signal of a record (SI) and its row of state."""
_ROWS = tuple(OUTPUTS.values())
WIDTH = LANES if COMPILED else 1
"""Plants that one tile holds; plain Python gains nothing from lanes."""
N_ROWS = 0  # a placeholder, filled in for each hysteresis


@kernel
def run_knee(
    all_rows: Any, all_fixed: Any, all_counts: Any, table: Any, gait: Any, set_points: Any,
    outputs: Any, elements: int, substeps: int, period: float, phase: float, pressure: float,
) -> None:  # fmt: skip
    """Run tiles of plants from rest through ``len(set_points)`` control periods."""
    for tile in prange(len(all_rows)):
        rows = tile_view(all_rows, tile, N_ROWS, LANES)
        fixed = tile_view(all_fixed, tile, N_PARAMETERS, LANES)
        counts = tile_view(all_counts, tile, N_COUNTS, LANES)
        work = scratch(N_WORK, LANES)
        start = tile * LANES
        lanes = min(LANES, len(outputs[0][0]) - start)
        for j in range(LANES):
            start_hysteresis(rows, counts, K.END, j)
            begin_lane(rows, fixed, counts, table, gait, K.END, elements, j, phase, pressure)
        for step in range(len(set_points)):
            columns = len(set_points[step])
            for j in range(LANES):
                counts[K.STEP][j] = step
                rows[K.SET_POINT][j] = set_points[step][min(start + j, columns - 1)]
            advance(rows, fixed, counts, table, gait, K.END, elements, substeps, period, work)
            for k in range(len(_ROWS)):
                for j in range(lanes):
                    outputs[k][step][start + j] = rows[_ROWS[k]][j]


@lru_cache(maxsize=18)
def _runner(kind: str, mounting: str, dynamics: str) -> Callable[..., Any]:
    name = f"run_knee_{kind}_{mounting}_{dynamics}"
    return build(run_knee, name, **kernel_names(kind, mounting, dynamics))


def kernel_names(kind: str, mounting: str, dynamics: str, lanes: int = WIDTH) -> dict[str, Any]:
    """Return what takes the place of the placeholders of :func:`run_knee`."""
    sizes = {"N_ROWS": K.END + state_rows(kind), "LANES": lanes}
    return replacements(kind, mounting, dynamics) | sizes


def arrays_for(
    plants: Sequence[KneeOrthosis], set_points: ArrayLike, lanes: int = WIDTH
) -> list[Any]:
    """Return the arrays that :func:`run_knee` takes, the outputs last, shape (signals, T, n)."""
    commands = np.asarray(set_points, np.float64)
    commands = np.ascontiguousarray(commands.reshape(len(commands), -1))
    n = len(plants) if len(plants) > 1 else commands.shape[1]
    fixed = in_tiles([plant.parameter_rows() for plant in plants], n, lanes)
    return [
        np.zeros((len(fixed), K.END + state_rows(plants[0].hysteresis.kind), lanes)),
        fixed,
        np.zeros((len(fixed), N_COUNTS, lanes), np.int64),
        plants[0].hysteresis_tables()[:1],
        plants[0].gait_table(),
        commands,
        np.empty((len(OUTPUTS), len(commands), n)),
    ]


def simulate_knee(
    plants: KneeOrthosis | Sequence[KneeOrthosis],
    set_points: ArrayLike,
    *,
    phase: float = 0.0,
    pressure: float = 0.0,
) -> dict[str, NDArray[np.float64]]:
    """Simulate one plant, or several of one make, from rest.

    Parameters
    ----------
    plants : KneeOrthosis or sequence of them
        Of one hysteresis, mounting, regulator, activity, and with the same sub-steps. A
        hysteresis's operator is that of the first.
    set_points : array_like, shape (T,) or (T, n)
        Set-points [Pa], one a control period.
    phase : float
        Phase of the stride at the start, in turns.
    pressure : float
        Pressure [Pa] of the rest, reached by inflation from none.

    Returns
    -------
    dict
        Each signal of ``OUTPUTS`` at the end of each control period, free of noise, shape (T,) for
        one plant and (T, n) for several.
    """
    several = [plants] if isinstance(plants, KneeOrthosis) else list(plants)
    words = ("hysteresis.kind", "mounting", "dynamics", "activity", "substeps")
    first = first_of(several, *words)
    arrays = arrays_for(several, set_points)
    if not COMPILED:
        arrays = [a.tolist() for a in arrays]
    run = _runner(first.hysteresis.kind, first.mounting, first.dynamics)
    numbers = (first.substeps, first.control_period, float(phase), float(pressure))
    run(*arrays, first.elements, *numbers)
    made = np.asarray(arrays[-1])
    single = isinstance(plants, KneeOrthosis) and np.ndim(set_points) == 1
    return {name: made[k, :, 0] if single else made[k] for k, name in enumerate(OUTPUTS)}
