"""Rollouts of the elbow orthosis, driven by given commands and motions of the wearer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.build import COMPILED, LANES, kernel
from pam_envs.plants.core.rollout import Loop, biased_output, run
from pam_envs.plants.core.tiles import drives_of, first_of
from pam_envs.plants.elbow_orthosis import rows as K
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis
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
START = len(DRIVEN)
"""First of the two channels with the pressures of the beginning."""

Array = NDArray[np.float64]


@kernel
def drive(rows: Any, fixed: Any, drives: Any, t: int, column: int, j: int) -> None:
    """Write what drives one lane."""
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


@kernel
def advance_elbow(
    rows: Any, fixed: Any, counts: Any, table: Any, extra: Any, elements: int, substeps: int,
    period: float, work: Any,
) -> None:  # fmt: skip
    """Advance a tile by one control period."""
    advance(rows, fixed, counts, table, K.END, elements, substeps, period, work)


def channels_of(plant: ElbowOrthosis) -> dict[str, float]:
    """Return what drives the orthosis, with defaults; ``start`` are the pressures at rest."""
    motion = ("intent", "intent_rate", "intent_acceleration")
    names = ("command_a", "command_b", *motion, "disturbance", "start_a", "start_b")
    return dict.fromkeys(names, 0.0) | {"intent": 1.0}


def readings_of(plant: ElbowOrthosis) -> dict[str, tuple[int, int]]:
    """Return the sensors by name, each with its place among the readings and its bias' row."""
    biases = (K.ANGLE_BIAS, K.PRESSURE_BIAS, K.PRESSURE_BIAS)
    names = ("angle", "pressure_a", "pressure_b")
    return {name: (k, bias) for k, (name, bias) in enumerate(zip(names, biases, strict=True))}


def loop_of(plant: ElbowOrthosis, extended: bool = False, readings: bool = False) -> Loop:
    """Return the loop of a make of the orthosis; ``readings``: of its sensors alone."""
    kind, valves = plant.hysteresis.kind, plant.valves
    effects = K.END + state_rows(kind)
    kernels: dict[str, Any] = {
        "plant_drive": drive,
        "plant_begin": begin,
        "plant_advance": advance_elbow,
    }
    outputs: tuple[int, ...] = tuple(OUTPUTS.values())
    if readings:
        read = readings_of(plant).values()
        kernels["BIAS_ROWS"] = tuple(bias for _, bias in read)
        kernels["plant_output"] = biased_output
        outputs = tuple(effects + K.STATE.sensors + place for place, _ in read)
    return Loop(
        f"elbow_{kind}_{valves}"
        + ("_extended" if extended else "")
        + ("_readings" if readings else ""),
        kernels | replacements(kind, valves, effects if extended else None),
        outputs,
        rows=effects + (K.STATE.end if extended else 0),
        parameters=K.N_PARAMETERS,
        counts=K.N_COUNTS,
        work=N_WORK,
        extra=np.zeros((1, 1)),
    )


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
    """Simulate one orthosis, or several of one make, from rest.

    Parameters
    ----------
    plants : ElbowOrthosis or sequence of them
        Of one hysteresis, of one make of valves, and with the same sub-steps. A hysteresis map
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
    compiled : bool
        Whether kernels run as machine code; plain Python gives the same bits.

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
    channels = (command[..., 0], command[..., 1], *motion, disturbance)
    start = [np.broadcast_to(np.asarray(s, float), command.shape[:-1]) for s in pressures]
    drives = drives_of([*channels, *start])
    n = len(several) if len(several) > 1 else drives.shape[2]
    loop = loop_of(first, any(plant.extended for plant in several))
    columns = [plant.parameter_rows() for plant in several]
    made = run(loop, first, columns, drives, plants=n, compiled=compiled)
    single = made.shape[2] == 1 and command.ndim == 2 and isinstance(plants, ElbowOrthosis)
    return {name: made[k, :, 0] if single else made[k] for k, name in enumerate(OUTPUTS)}
