"""Whole records of the antagonistic joint, parameter sets side by side, and its rests."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.build import COMPILED, LANES, build, kernel, prange, scratch, tile_view
from pam_envs.plants.antagonistic_joint import rows as K
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.antagonistic_joint.rows import N_COUNTS, N_PARAMETERS
from pam_envs.plants.antagonistic_joint.step import (
    N_WORK,
    advance,
    begin_lane,
    feed_forward,
    replacements,
    start_hysteresis,
)
from pam_envs.plants.core.tiles import drives_of, first_of, in_tiles

OUTPUTS = {
    "angle": K.ANGLE,
    "velocity": K.VELOCITY,
    "pressure_a": K.PRESSURE_A,
    "pressure_b": K.PRESSURE_B,
    "force_a": K.FORCE_A,
    "force_b": K.FORCE_B,
    "contraction_a": K.CONTRACTION_A,
    "contraction_b": K.CONTRACTION_B,
    "lag_a": K.LAG_A,
    "lag_b": K.LAG_B,
    "torque": K.TORQUE,
    "stiffness": K.STIFFNESS,
    "slack": K.SLACK,
    "air": K.AIR,
    "set_point_a": K.SET_POINT_A,
    "set_point_b": K.SET_POINT_B,
}
"""Every signal of a record (SI) and its row of state."""
COMMANDED, STRESSED, DISTURBED, LOADED, FILLED_A, FILLED_B, DIRECT = range(7)
"""Channels of what drives a record; ``DIRECT`` above 0 says that pressures are given."""
_ROWS = tuple(OUTPUTS.values())
WIDTH = LANES if COMPILED else 1
"""Plants that one tile holds; plain Python gains nothing from lanes."""
N_ROWS = 0  # a placeholder, filled in for each hysteresis

Array = NDArray[np.float64]


@kernel
def drive(rows: Any, fixed: Any, drives: Any, step: int, column: int, j: int) -> None:
    """Write what drives one lane in one control period."""
    rows[K.COMMAND][j] = drives[COMMANDED][step][column]
    rows[K.PRESTRESS][j] = drives[STRESSED][step][column]
    rows[K.DISTURBANCE][j] = drives[DISTURBED][step][column]
    rows[K.PAYLOAD][j] = drives[LOADED][step][column]
    p_a, p_b, _ = feed_forward(fixed, j, rows[K.COMMAND][j], rows[K.PRESTRESS][j])
    if drives[DIRECT][step][column] > 0.0:
        p_a, p_b = drives[FILLED_A][step][column], drives[FILLED_B][step][column]
    rows[K.SET_POINT_A][j], rows[K.SET_POINT_B][j] = p_a, p_b


@kernel
def run_joint(
    all_rows: Any, all_fixed: Any, all_counts: Any, table: Any, drives: Any, outputs: Any,
    elements: int, substeps: int, period: float, quasi_static: int,
) -> None:  # fmt: skip
    """Run tiles of joints from rest under the first command through all control periods.

    With ``quasi_static`` each command is held until rest, and only rests are gone through.
    """
    for tile in prange(len(all_rows)):
        rows = tile_view(all_rows, tile, N_ROWS, LANES)
        fixed = tile_view(all_fixed, tile, N_PARAMETERS, LANES)
        counts = tile_view(all_counts, tile, N_COUNTS, LANES)
        work = scratch(N_WORK, LANES)
        start = tile * LANES
        lanes = min(LANES, len(outputs[0][0]) - start)
        last = len(drives[0][0]) - 1
        for j in range(LANES):
            start_hysteresis(rows, counts, K.END, j)
            drive(rows, fixed, drives, 0, min(start + j, last), j)
            angle, stress = rows[K.COMMAND][j], rows[K.PRESTRESS][j]
            begin_lane(rows, fixed, counts, table, K.END, elements, j, angle, stress)
        for step in range(len(drives[0])):
            for j in range(LANES):
                drive(rows, fixed, drives, step, min(start + j, last), j)
                counts[K.STEP][j] = step
            if quasi_static > 0:
                for j in range(LANES):
                    angle, stress = rows[K.COMMAND][j], rows[K.PRESTRESS][j]
                    begin_lane(rows, fixed, counts, table, K.END, elements, j, angle, stress)
            else:
                advance(rows, fixed, counts, table, K.END, elements, substeps, period, work)
            for k in range(len(_ROWS)):
                for j in range(lanes):
                    outputs[k][step][start + j] = rows[_ROWS[k]][j]


@lru_cache(maxsize=18)
def _runner(kind: str, dynamics: str) -> Callable[..., Any]:
    return build(run_joint, f"run_joint_{kind}_{dynamics}", **kernel_names(kind, dynamics))


def kernel_names(kind: str, dynamics: str, lanes: int = WIDTH) -> dict[str, Any]:
    """Return what takes the place of the placeholders of :func:`run_joint`."""
    sizes = {"N_ROWS": K.END + 2 * state_rows(kind), "LANES": lanes}
    return replacements(kind, dynamics) | sizes


def arrays_for(
    plants: Sequence[AntagonisticJoint], drives: Sequence[ArrayLike], lanes: int = WIDTH
) -> list[Any]:
    """Return the arrays that :func:`run_joint` takes, the outputs last, shape (signals, T, n)."""
    filled = drives_of(drives)
    _, periods, columns = filled.shape
    n = len(plants) if len(plants) > 1 else columns
    fixed = in_tiles([plant.parameter_rows() for plant in plants], n, lanes)
    return [
        np.zeros((len(fixed), K.END + 2 * state_rows(plants[0].hysteresis.kind), lanes)),
        fixed,
        np.zeros((len(fixed), N_COUNTS, lanes), np.int64),
        plants[0].hysteresis_tables()[:1],
        filled,
        np.empty((len(OUTPUTS), periods, n)),
    ]


def simulate_joint(
    plants: AntagonisticJoint | Sequence[AntagonisticJoint],
    commands: ArrayLike = 0.0,
    *,
    prestress: ArrayLike | None = None,
    disturbance: ArrayLike = 0.0,
    payload: ArrayLike = 0.0,
    pressures: tuple[ArrayLike, ArrayLike] | None = None,
    quasi_static: bool = False,
) -> dict[str, Array]:
    """Simulate one joint, or several of one make, from rest under the first command.

    Parameters
    ----------
    plants : AntagonisticJoint or sequence of them
        Of one hysteresis, of one make, and with the same sub-steps. A hysteresis's map is the
        first's.
    commands : array_like, shape (T,) or (T, n)
        Set-points [rad] of the feed-forward, one a control period.
    prestress : array_like, optional
        Co-contraction [N]; a number or as ``commands``. Default: the first plant's.
    disturbance, payload : array_like
        Torque [N m] and mass at the link's end [kg]; a number or as ``commands``.
    pressures : tuple of array_like, optional
        Set-points [Pa] of both muscles in the place of the feed-forward's, each as ``commands``.
    quasi_static : bool
        Whether each command is held until rest (from which the next one starts) instead of for a
        control period; commands only.

    Returns
    -------
    dict
        Each signal of ``OUTPUTS`` at the end of each control period, free of noise, shape (T,) for
        one plant and (T, n) for several.
    """
    several = [plants] if isinstance(plants, AntagonisticJoint) else list(plants)
    first = first_of(several, "hysteresis.kind", "dynamics", "substeps")
    stress = first.prestress if prestress is None else prestress
    given = (0.0, 0.0) if pressures is None else pressures
    direct = 0.0 if pressures is None else 1.0
    drives = [commands, stress, disturbance, payload, *given, direct]
    arrays = arrays_for(several, drives)
    if not COMPILED:
        arrays = [a.tolist() for a in arrays]
    run = _runner(first.hysteresis.kind, first.dynamics)
    run(*arrays, first.elements, first.substeps, first.control_period, int(quasi_static))
    made = np.asarray(arrays[-1])
    single = isinstance(plants, AntagonisticJoint) and all(np.ndim(d) < 2 for d in drives)
    return {name: made[k, :, 0] if single else made[k] for k, name in enumerate(OUTPUTS)}


def rest_angles(
    plant: AntagonisticJoint, commands: ArrayLike, prestress: float | None = None
) -> Array:
    """Return the angle at rest [rad] after each of a series of set-points [rad], shape (T,).

    From the straight virgin state, without gravity and load.
    """
    series = np.concatenate([[0.0], np.asarray(commands, float)])
    floating = plant.replace({"link.gravity": 0.0})
    made = simulate_joint(floating, series, prestress=prestress, quasi_static=True)
    return made["angle"][1:]
