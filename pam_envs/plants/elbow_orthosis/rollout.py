"""Whole records of the elbow orthosis, parameter sets side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.build import COMPILED, LANES, build, kernel, prange, scratch, tile_view
from pam_envs.plants.core.tiles import drives_of, first_of, in_tiles
from pam_envs.plants.elbow_orthosis import rows as K
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis
from pam_envs.plants.elbow_orthosis.rows import N_COUNTS, N_PARAMETERS
from pam_envs.plants.elbow_orthosis.step import (
    N_WORK,
    advance,
    begin_lane,
    replacements,
    start_hysteresis,
)

OUTPUTS = {
    "angle": K.ANGLE,
    "velocity": K.VELOCITY,
    "pressure_a": K.PRESSURE_A,
    "pressure_b": K.PRESSURE_B,
    "force_a": K.FORCE_A,
    "force_b": K.FORCE_B,
    "contraction_a": K.CONTRACTION_A,
    "contraction_b": K.CONTRACTION_B,
    "lag": K.LAG,
    "torque": K.TORQUE,
    "stiffness": K.STIFFNESS,
    "felt": K.FELT,
    "wearer": K.WEARER,
    "slack": K.SLACK,
    "air_a": K.AIR_A,
    "air_b": K.AIR_B,
    "used": K.USED,
    "switches": K.SWITCHES,
}
"""Every signal of a record (SI) and its row of state."""
DRIVEN = (K.COMMAND_A, K.COMMAND_B, K.INTENT, K.INTENT_RATE, K.INTENT_ACCELERATION, K.DISTURBANCE)
"""Rows that drive a record, in the order of its channels."""
_ROWS = tuple(OUTPUTS.values())
WIDTH = LANES if COMPILED else 1
"""Plants that one tile holds; plain Python gains nothing from lanes."""
N_ROWS = 0  # a placeholder, filled in for each hysteresis

Array = NDArray[np.float64]


@kernel
def run_elbow(
    all_rows: Any, all_fixed: Any, all_counts: Any, table: Any, drives: Any, start: Any,
    outputs: Any, elements: int, substeps: int, period: float,
) -> None:  # fmt: skip
    """Run tiles of plants from rest at the pressures ``start`` through all control periods."""
    for tile in prange(len(all_rows)):
        rows = tile_view(all_rows, tile, N_ROWS, LANES)
        fixed = tile_view(all_fixed, tile, N_PARAMETERS, LANES)
        counts = tile_view(all_counts, tile, N_COUNTS, LANES)
        work = scratch(N_WORK, LANES)
        first = tile * LANES
        lanes = min(LANES, len(outputs[0][0]) - first)
        last = len(drives[0][0]) - 1
        for j in range(LANES):
            column = min(first + j, last)
            rows[K.INTENT][j] = drives[2][0][column]
            rows[K.DISTURBANCE][j] = drives[5][0][column]
            start_hysteresis(rows, counts, K.END, j)
            begin_lane(
                rows, fixed, counts, table, K.END, elements, j, start[0][column], start[1][column]
            )
        for step in range(len(drives[0])):
            for j in range(LANES):
                counts[K.STEP][j] = step
                for k in range(len(DRIVEN)):
                    rows[DRIVEN[k]][j] = drives[k][step][min(first + j, last)]
            advance(rows, fixed, counts, table, K.END, elements, substeps, period, work)
            for k in range(len(_ROWS)):
                for j in range(lanes):
                    outputs[k][step][first + j] = rows[_ROWS[k]][j]


@lru_cache(maxsize=12)
def _runner(kind: str, valves: str) -> Callable[..., Any]:
    return build(run_elbow, f"run_elbow_{kind}_{valves}", **kernel_names(kind, valves))


def kernel_names(kind: str, valves: str, lanes: int = WIDTH) -> dict[str, Any]:
    """Return what takes the place of the placeholders of :func:`run_elbow`."""
    sizes = {"N_ROWS": K.END + state_rows(kind), "LANES": lanes}
    return replacements(kind, valves) | sizes


def arrays_for(
    plants: Sequence[ElbowOrthosis],
    drives: Sequence[ArrayLike],
    start: Sequence[ArrayLike],
    lanes: int = WIDTH,
) -> list[Any]:
    """Return the arrays that :func:`run_elbow` takes, the outputs last, shape (signals, T, n)."""
    filled = drives_of(drives)
    _, periods, columns = filled.shape
    n = len(plants) if len(plants) > 1 else columns
    fixed = in_tiles([plant.parameter_rows() for plant in plants], n, lanes)
    return [
        np.zeros((len(fixed), K.END + state_rows(plants[0].hysteresis.kind), lanes)),
        fixed,
        np.zeros((len(fixed), N_COUNTS, lanes), np.int64),
        plants[0].hysteresis_tables()[:1],
        filled,
        np.array([np.broadcast_to(np.asarray(s, float), (columns,)) for s in start]),
        np.empty((len(OUTPUTS), periods, n)),
    ]


def _check_shapes(plants: Sequence[ElbowOrthosis], command: Array, motion: Sequence[Any]) -> None:
    """Refuse commands and intentions that are not of as many periods and plants."""
    if command.ndim not in (2, 3) or command.shape[-1] != 2 or not command.size:
        raise ValueError(
            f"commands have shape {command.shape}; give (T, 2) or (T, n, 2), one or more periods "
            "and two bundles"
        )
    if not np.isfinite(command).all():
        raise ValueError("commands are not finite throughout; give numbers")
    columns = command.shape[1] if command.ndim == 3 else 1
    if len(plants) > 1 and columns not in (1, len(plants)):
        raise ValueError(f"commands are for {columns} plants and {len(plants)} are given")
    for part in map(np.asarray, motion):
        if part.ndim > 2 or (part.ndim and len(part) not in (1, len(command))):
            raise ValueError(
                f"intent has shape {part.shape} and the commands {len(command)} periods; give a "
                "number or one row for each period"
            )
        if part.ndim == 2 and part.shape[1] not in (1, columns, len(plants)):
            raise ValueError(f"intent has shape {part.shape}; give a column for each plant")


def simulate_elbow(
    plants: ElbowOrthosis | Sequence[ElbowOrthosis],
    commands: ArrayLike,
    *,
    intent: ArrayLike | tuple[ArrayLike, ArrayLike, ArrayLike] = 1.0,
    disturbance: ArrayLike = 0.0,
    pressures: tuple[ArrayLike, ArrayLike] | None = None,
) -> dict[str, Array]:
    """Simulate one orthosis, or several of one make, from rest.

    Parameters
    ----------
    plants : ElbowOrthosis or sequence of them
        Of one hysteresis, of one make of valves, and with the same sub-steps. A hysteresis's map
        is the first's.
    commands : array_like, shape (T, 2) or (T, n, 2)
        For bundles a and b, one a control period: set-points [Pa]; of on/off valves pulse widths
        [s], filling above 0, looked at where a cycle begins.
    intent : array_like or tuple of three
        Where the wearer intends to be at the end of each period [rad]: a constant angle, or angle,
        rate [rad/s] and acceleration [rad/s2], each (T,) or (T, n). The first is where he begins.
    disturbance : array_like
        Torque on the forearm [N m]; a number, (T,) or (T, n).
    pressures : tuple of array_like, optional
        Pressures [Pa] of bundles a and b at the start. Default: the first set-points; of on/off
        valves 0.

    Returns
    -------
    dict
        Each signal of ``OUTPUTS`` at the end of each control period, free of noise, shape (T,) for
        one plant and (T, n) for several.

    Raises
    ------
    ValueError
        If the plants are not of one make, or a shape or a value does not fit.
    """
    several = [plants] if isinstance(plants, ElbowOrthosis) else list(plants)
    first = first_of(several, "hysteresis.kind", "valves", "substeps")
    command = np.asarray(commands, np.float64)
    motion = intent if isinstance(intent, tuple) else (intent, 0.0, 0.0)
    _check_shapes(several, command, motion)
    if pressures is None:
        pulsed = first.valves == "on_off"
        pressures = (0.0, 0.0) if pulsed else (command[0, ..., 0], command[0, ..., 1])
    drives = (command[..., 0], command[..., 1], *motion, disturbance)
    arrays = arrays_for(several, drives, pressures)
    if not COMPILED:
        arrays = [a.tolist() for a in arrays]
    run = _runner(first.hysteresis.kind, first.valves)
    run(*arrays, first.elements, first.substeps, first.control_period)
    made = np.asarray(arrays[-1])
    single = made.shape[2] == 1 and command.ndim == 2 and isinstance(plants, ElbowOrthosis)
    return {name: made[k, :, 0] if single else made[k] for k, name in enumerate(OUTPUTS)}
