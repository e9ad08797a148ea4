"""Rollouts of the antagonistic joint, parameter sets side by side, and its rests."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.build import COMPILED, LANES, kernel
from pam_envs.plants.antagonistic_joint import rows as K
from pam_envs.plants.antagonistic_joint.step import (
    N_WORK,
    advance,
    begin_lane,
    feed_forward,
    replacements,
    start_hysteresis,
)
from pam_envs.plants.core.plant import Plant
from pam_envs.plants.core.rollout import BEGIN, REST, Loop, biased_output, run
from pam_envs.plants.core.tiles import drives_of, first_of

if TYPE_CHECKING:
    from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint

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

Array = NDArray[np.float64]


@kernel
def drive(rows: Any, fixed: Any, drives: Any, t: int, column: int, j: int) -> None:
    """Write what drives one lane in one control period."""
    rows[K.COMMAND][j] = drives[COMMANDED][t][column]
    rows[K.PRESTRESS][j] = drives[STRESSED][t][column]
    rows[K.DISTURBANCE][j] = drives[DISTURBED][t][column]
    rows[K.PAYLOAD][j] = drives[LOADED][t][column]
    p_a, p_b, _ = feed_forward(fixed, j, rows[K.COMMAND][j], rows[K.PRESTRESS][j])
    if drives[DIRECT][t][column] > 0.0:
        p_a, p_b = drives[FILLED_A][t][column], drives[FILLED_B][t][column]
    rows[K.SET_POINT_A][j], rows[K.SET_POINT_B][j] = p_a, p_b


@kernel
def begin(
    rows: Any, fixed: Any, counts: Any, table: Any, extra: Any, drives: Any, t: int, first: int,
    elements: int, work: Any,
) -> None:  # fmt: skip
    """Bring a tile to rest under its command, from a straight virgin state."""
    for j in range(LANES):
        start_hysteresis(rows, counts, K.END, j)
        angle, stress = rows[K.COMMAND][j], rows[K.PRESTRESS][j]
        begin_lane(rows, fixed, counts, table, K.END, elements, j, angle, stress)


@kernel
def come_to_rest(
    rows: Any, fixed: Any, counts: Any, table: Any, extra: Any, elements: int, work: Any
) -> None:
    """Bring a tile to rest under its command, from where it rests."""
    for j in range(LANES):
        angle, stress = rows[K.COMMAND][j], rows[K.PRESTRESS][j]
        begin_lane(rows, fixed, counts, table, K.END, elements, j, angle, stress)


@kernel
def advance_joint(
    rows: Any, fixed: Any, counts: Any, table: Any, extra: Any, elements: int, substeps: int,
    period: float, work: Any,
) -> None:  # fmt: skip
    """Advance a tile by one control period."""
    advance(rows, fixed, counts, table, K.END, elements, substeps, period, work)


def channels_of(plant: AntagonisticJoint) -> dict[str, float]:
    """Return what drives the joint, with defaults; ``direct`` above 0: pressures are given."""
    names = ("command", "prestress", "disturbance", "payload", "pressure_a", "pressure_b", "direct")
    return dict.fromkeys(names, 0.0) | {"prestress": plant.prestress}


def readings_of(plant: AntagonisticJoint) -> dict[str, tuple[int, int]]:
    """Return the sensors by name, each with its place among the readings and its bias' row."""
    biases = (K.ANGLE_BIAS, K.PRESSURE_BIAS, K.PRESSURE_BIAS)
    names = ("angle", "pressure_a", "pressure_b")
    return {name: (k, bias) for k, (name, bias) in enumerate(zip(names, biases, strict=True))}


def loop_of(plant: AntagonisticJoint, extended: bool = False, readings: bool = False) -> Loop:
    """Return the loop of a make of the joint; ``readings``: of its sensors alone."""
    kind, dynamics = plant.hysteresis.kind, plant.dynamics
    effects = K.END + 2 * state_rows(kind)
    kernels: dict[str, Any] = {
        "plant_drive": drive,
        "plant_begin": begin,
        "plant_rest": come_to_rest,
        "plant_advance": advance_joint,
    }
    outputs: tuple[int, ...] = tuple(OUTPUTS.values())
    if readings:
        read = readings_of(plant).values()
        kernels["BIAS_ROWS"] = tuple(bias for _, bias in read)
        kernels["plant_output"] = biased_output
        outputs = tuple(effects + K.STATE.sensors + place for place, _ in read)
    return Loop(
        f"joint_{kind}_{dynamics}"
        + ("_extended" if extended else "")
        + ("_readings" if readings else ""),
        kernels | replacements(kind, dynamics, effects if extended else None),
        outputs,
        rows=effects + (K.STATE.end if extended else 0),
        parameters=K.N_PARAMETERS,
        counts=K.N_COUNTS,
        work=N_WORK,
        extra=np.zeros((1, 1)),
    )


def simulate_joint(
    plants: AntagonisticJoint | Sequence[AntagonisticJoint],
    commands: ArrayLike = 0.0,
    *,
    prestress: ArrayLike | None = None,
    disturbance: ArrayLike = 0.0,
    payload: ArrayLike = 0.0,
    pressures: tuple[ArrayLike, ArrayLike] | None = None,
    quasi_static: bool = False,
    compiled: bool = COMPILED,
) -> dict[str, Array]:
    """Simulate one joint, or several of one make, from rest under the first command.

    Parameters
    ----------
    plants : AntagonisticJoint or sequence of them
        Of one hysteresis, of one make, and with the same sub-steps. A hysteresis map is the
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
    compiled : bool
        Whether kernels run as machine code; plain Python gives the same bits.

    Returns
    -------
    dict
        Each signal of ``OUTPUTS`` at the end of each control period, free of noise, shape (T,) for
        one plant and (T, n) for several.
    """
    several = [plants] if isinstance(plants, Plant) else list(plants)
    first = first_of(several, "hysteresis.kind", "dynamics", "substeps")
    stress = first.prestress if prestress is None else prestress
    given = (0.0, 0.0) if pressures is None else pressures
    direct = 0.0 if pressures is None else 1.0
    channels = [commands, stress, disturbance, payload, *given, direct]
    drives = drives_of(channels)
    flags = np.full(drives.shape[1], REST if quasi_static else 0)
    flags[0] |= BEGIN
    loop = loop_of(first, any(plant.extended for plant in several))
    columns = [plant.parameter_rows() for plant in several]
    n = len(several) if len(several) > 1 else drives.shape[2]
    made = run(loop, first, columns, drives, plants=n, flags=flags, compiled=compiled)
    single = isinstance(plants, Plant) and all(np.ndim(d) < 2 for d in channels)
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
