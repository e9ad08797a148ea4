"""Rollouts of the elbow orthosis, driven by given commands and motions of the wearer."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.kernels.build import COMPILED, LANES, kernel
from pam_envs.plants.core.rollout import (
    Loop,
    drives_of,
    first_of,
    loop_for,
    plants_of,
    simulate_plants,
)
from pam_envs.plants.core.rows import signal_rows
from pam_envs.plants.elbow_orthosis import rows as K
from pam_envs.plants.elbow_orthosis.bundles import N_WORK
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis
from pam_envs.plants.elbow_orthosis.step import (
    advance,
    begin_lane,
    operators,
    replacements,
    start_hysteresis,
)

OUTPUTS = (
    signal_rows(
        K, "angle velocity pressure_a pressure_b force_a force_b contraction_a contraction_b"
    )
    | {"lag": K.LAG_A}
    | signal_rows(K, "torque stiffness felt wearer slack air_a air_b used switches")
)
"""Every signal of a record (SI) and its row of state."""
MAKE = ("hysteresis.kind", "valves", "substeps")
DRIVEN = (K.COMMAND_A, K.COMMAND_B, K.INTENT, K.INTENT_RATE, K.INTENT_ACCELERATION, K.DISTURBANCE)
"""Rows that drive a record, in the order of its channels."""
START = len(DRIVEN)
"""First of the two channels with the pressures of the beginning."""


@kernel
def drive(rows: Any, fixed: Any, drives: Any, t: int, column: int, j: int) -> None:
    """Write the inputs of one lane."""
    for k in range(len(DRIVEN)):
        rows[DRIVEN[k]][j] = drives[k][t][column]


@kernel
def begin(
    rows: Any, fixed: Any, counts: Any, table: Any, extra: Any, drives: Any, t: int, first: int,
    elements: int, work: Any,
) -> None:  # fmt: skip
    """Bring a tile to rest at its pressures, held by wearers who intend an angle."""
    last = len(drives[0][0]) - 1
    for j in range(LANES):
        column = min(first + j, last)
        start_hysteresis(rows, counts, K.END, j)
        begin_lane(
            rows, fixed, counts, table, K.END, elements, j, drives[START][t][column],
            drives[START + 1][t][column],
        )  # fmt: skip


def channels_of(plant: ElbowOrthosis) -> dict[str, float]:
    """Return the inputs of the orthosis, with defaults; ``start`` are the pressures at rest."""
    motion = ("intent", "intent_rate", "intent_acceleration")
    names = ("command_a", "command_b", *motion, "disturbance", "start_a", "start_b")
    return dict.fromkeys(names, 0.0) | {"intent": 1.0}


def outputs_of(plant: ElbowOrthosis) -> tuple[str, ...]:
    """Return the names of the outputs, in the order of the loop."""
    return tuple(OUTPUTS)


def readings_of(plant: ElbowOrthosis) -> dict[str, int]:
    """Return the row of each sensor's bias, by name."""
    gauges = dict.fromkeys(("pressure_a", "pressure_b"), K.PRESSURE_BIAS)
    return {"angle": K.ANGLE_BIAS} | gauges


def loop_of(plant: ElbowOrthosis, extended: bool = False, readings: bool = False) -> Loop:
    """Return the loop of a variant of the orthosis; ``readings``: of its sensors alone."""
    make = plant.hysteresis.kind, plant.valves
    kernels = {"plant_drive": drive, "plant_begin": begin, "advance": advance}
    return loop_for(
        f"elbow_{make[0]}_{make[1]}", plant, K, kernels, partial(replacements, *make),
        OUTPUTS.values(), N_WORK, extended=extended, operators=operators(make[0]),
        readings=readings_of(plant) if readings else None,
    )  # fmt: skip


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
    compiled: bool = COMPILED,
) -> dict[str, Array]:
    """Simulate one orthosis, or several of one variant, from rest, free of noise.

    Parameters
    ----------
    plants : ElbowOrthosis or sequence of them
        Of one hysteresis, of one kind of valves, and with the same sub-steps; a hysteresis map is
        the first's.
    commands : array_like, shape (T, 2) or (T, n, 2)
        For bundles a and b, one a control period: setpoints [Pa]; of on/off valves pulse widths
        [s], filling above 0, read where a cycle begins.
    intent : array_like or tuple of three
        Intended pose of the wearer at the end of each period [rad]: a constant angle, or angle,
        rate [rad/s] and acceleration [rad/s2], each (T,) or (T, n). The first is the start.
    disturbance : array_like
        Torque on the forearm [N m]; a number, (T,) or (T, n).
    pressures : tuple of array_like, optional
        Pressures [Pa] of bundles a and b at the start; default: the first setpoints, or 0 with
        on/off valves.
    compiled : bool
        Whether kernels run as machine code.

    Returns
    -------
    dict
        Each signal of ``OUTPUTS``, shape (T,) for one plant and (T, n) for several.

    Raises
    ------
    ValueError
        If the plants are not of one variant, or a shape or a value does not fit.
    """
    several = plants_of(plants)
    first, command = first_of(several), np.asarray(commands, np.float64)
    motion = intent if isinstance(intent, tuple) else (intent, 0.0, 0.0)
    _check_shapes(several, command, motion)
    if pressures is None:
        pulsed = first.valves == "on_off"
        pressures = (0.0, 0.0) if pulsed else (command[0, ..., 0], command[0, ..., 1])
    channels = (command[..., 0], command[..., 1], *motion, disturbance)
    start = [np.broadcast_to(np.asarray(s, float), command.shape[:-1]) for s in pressures]
    drives = drives_of([*channels, *start])
    single = isinstance(plants, ElbowOrthosis) and command.ndim == 2 and drives.shape[2] == 1
    return simulate_plants(loop_of, plants, MAKE, drives, OUTPUTS, single=single, compiled=compiled)
