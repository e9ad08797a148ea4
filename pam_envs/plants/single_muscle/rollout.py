"""Whole records: the plant driven by given set-points, many parameter sets side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.build import COMPILED, LANES, build, kernel, prange, scratch, tile_view
from pam_envs.plants.core.tiles import in_tiles
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.hysteresis_kernels import hysteresis_kernels
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.rows import N_COUNTS, N_PARAMETERS
from pam_envs.plants.single_muscle.step import N_WORK, advance, rest_contraction

OUTPUTS = ("contraction", "velocity", "pressure", "drive")
N_ROWS = 0
remember: Any = None  # placeholders, filled in for each hysteresis


@kernel
def run(
    all_rows: Any,
    all_fixed: Any,
    all_counts: Any,
    table: Any,
    set_points: Any,
    outputs: Any,
    elements: int,
    substeps: int,
    period: float,
) -> None:
    """Run tiles of plants from rest at no pressure through ``len(set_points)`` control periods."""
    for tile in prange(len(all_rows)):
        rows = tile_view(all_rows, tile, N_ROWS, LANES)
        fixed = tile_view(all_fixed, tile, N_PARAMETERS, LANES)
        counts = tile_view(all_counts, tile, N_COUNTS, LANES)
        work = scratch(N_WORK, LANES)
        start = tile * LANES
        lanes = min(LANES, len(outputs[0][0]) - start)
        for j in range(LANES):
            rows[R.LOAD][j] = fixed[R.NOMINAL_LOAD][j]
            rows[R.REST][j] = rest_contraction(fixed, j, 0.0, rows[R.LOAD][j])
            rows[R.CONTRACTION][j] = rows[R.REST][j]
            counts[R.STACK_COUNT][j] = 1
        x, rest = rows[R.CONTRACTION], rows[R.REST]
        for step in range(len(set_points)):
            columns = len(set_points[step])
            for j in range(LANES):
                counts[R.STEP][j] = step
                rows[R.SET_POINT][j] = set_points[step][min(start + j, columns - 1)]
            advance(rows, fixed, counts, table, R.END, elements, substeps, period, work)
            for j in range(lanes):
                outputs[0][step][start + j] = x[j] - rest[j]
                outputs[1][step][start + j] = rows[R.VELOCITY][j]
                outputs[2][step][start + j] = rows[R.PRESSURE][j]
                outputs[3][step][start + j] = rows[R.DRIVE][j]


@lru_cache(maxsize=8)
def _runner(kind: str) -> Callable[..., Any]:
    return build(
        run,
        f"rollout_{kind}",
        **hysteresis_kernels(kind),
        N_ROWS=R.END + state_rows(kind),
    )


def simulate_rows(
    plant: SingleMuscle, parameters: NDArray[np.float64], set_points: ArrayLike
) -> NDArray[np.float64]:
    """Simulate many parameter sets of one kind of plant from rest at no pressure.

    Parameters
    ----------
    plant : SingleMuscle
        Gives the hysteresis's kind, the Everett map and the sub-steps.
    parameters : array, shape (n, n_parameters)
        Columns as :meth:`SingleMuscle.parameter_rows` lays them out.
    set_points : array_like, shape (T,) or (T, n)
        Set-points [Pa], one a control period.

    Returns
    -------
    array, shape (4, T, n)
        Contraction [m], velocity [m/s], pressure [Pa] and effective pressure [Pa] at the end of
        each control period, free of noise.
    """
    kind, n = plant.hysteresis.kind, len(parameters)
    commands = np.asarray(set_points, np.float64)
    commands = np.ascontiguousarray(commands.reshape(len(commands), -1))
    fixed = in_tiles(parameters, n, LANES)
    rows = np.zeros((len(fixed), R.END + state_rows(kind), LANES))
    counts = np.zeros((len(fixed), N_COUNTS, LANES), np.int64)
    outputs = np.empty((len(OUTPUTS), len(commands), n))
    arrays: list[Any] = [rows, fixed, counts, plant.hysteresis_tables()[:1], commands, outputs]
    if not COMPILED:
        arrays = [a.tolist() for a in arrays]
    _runner(kind)(*arrays, plant.elements, plant.substeps, plant.control_period)
    return outputs if COMPILED else np.array(arrays[-1])


def simulate(
    plants: SingleMuscle | Sequence[SingleMuscle], set_points: ArrayLike
) -> dict[str, NDArray[np.float64]]:
    """Simulate one plant, or several with the same hysteresis and sub-steps, from rest.

    Returns
    -------
    dict
        ``contraction``, ``velocity``, ``pressure`` and ``drive``, shape (T,) for one plant and
        (T, n) for several; see :func:`simulate_rows`.
    """
    several = [plants] if isinstance(plants, SingleMuscle) else list(plants)
    first = several[0]
    if any(
        p.hysteresis.kind != first.hysteresis.kind or p.substeps != first.substeps for p in several
    ):
        raise ValueError(
            "plants that are simulated together need the same hysteresis and sub-steps"
        )
    outputs = simulate_rows(first, np.array([p.parameter_rows() for p in several]), set_points)
    if isinstance(plants, SingleMuscle):
        outputs = outputs[:, :, 0]
    return dict(zip(OUTPUTS, outputs, strict=True))
