"""Rollouts of the redundant manipulator."""

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.kernels.build import COMPILED, LANES, kernel
from pam_envs.mechanics.serial_chain.kernels import N_STAGES, parameter_rows
from pam_envs.plants.antagonistic_joint.pair import advance, command
from pam_envs.plants.antagonistic_joint.rollout import FROM_THEM
from pam_envs.plants.core.rollout import Loop, drives_of, loop_for, run, start_hysteresis
from pam_envs.plants.core.rows import signal_rows
from pam_envs.plants.redundant_manipulator import rows as M
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from pam_envs.plants.redundant_manipulator.step import (
    begin_filled,
    begin_lane,
    replacements,
    work_rows,
)

JOINT_OUTPUTS = signal_rows(M, "angle velocity torque stiffness")
MUSCLE_OUTPUTS = signal_rows(M, "pressure set_point force contraction lag")
"""Signals of a record (SI) and the first of their rows."""


@kernel
def drive(rows: Any, fixed: Any, drives: Any, t: int, column: int, j: int) -> None:
    """Write the inputs of one lane, in the order of :func:`channels_of`."""
    rows[M.PAYLOAD][j] = drives[0][t][column]
    for k in range(N_STAGES):
        rows[M.DISTURBANCE + k][j] = drives[2 + N_STAGES + k][t][column]
        command(
            rows, fixed, j, drives[2 + k][t][column], drives[1][t][column], M.COMMAND + k,
            M.PRESTRESS + k, M.SET_POINT + 2 * k,
        )  # fmt: skip
    if drives[2 + 4 * N_STAGES][t][column] > 0.0:
        for m in range(2 * N_STAGES):
            rows[M.SET_POINT + m][j] = drives[2 + 2 * N_STAGES + m][t][column]


@kernel
def begin(
    rows: Any, fixed: Any, counts: Any, table: Any, extra: Any, drives: Any, t: int, first: int,
    elements: int, work: Any,
) -> None:  # fmt: skip
    """Bring a tile to rest under its commands, or pressures, from a straight virgin state."""
    for j in range(LANES):
        start_hysteresis(rows, counts, M.END, j)
        if drives[2 + 4 * N_STAGES][t][min(first + j, len(drives[0][0]) - 1)] == FROM_THEM:
            for k in range(N_STAGES):
                rows[M.COMMAND + k][j] = 0.0
            begin_filled(rows, fixed, counts, table, M.END, elements, j, work)
        else:
            begin_lane(rows, fixed, counts, table, M.END, elements, j, work)


def channels_of(plant: RedundantManipulator) -> dict[str, float]:
    """Return the inputs of the arm, with defaults; ``direct`` above 0: pressures are given."""
    # direct = 2: the arm also begins at rest at the given pressures
    joints, muscles = range(plant.stages), range(2 * plant.stages)
    commands = [*(f"command_{k}" for k in joints), *(f"disturbance_{k}" for k in joints)]
    names = (*commands, *(f"pressure_{m}" for m in muscles), "direct")
    return {"payload": 0.0, "prestress": plant.prestress} | dict.fromkeys(names, 0.0)


def outputs_of(plant: RedundantManipulator) -> tuple[str, ...]:
    """Return the names of the outputs, in the order of the loop."""
    joints = [f"{name}_{k}" for name in JOINT_OUTPUTS for k in range(plant.stages)]
    return (*joints, *(f"{name}_{m}" for name in MUSCLE_OUTPUTS for m in range(2 * plant.stages)))


def readings_of(plant: RedundantManipulator) -> dict[str, int]:
    """Return the row of each sensor's bias, by name."""
    angles = {f"angle_{k}": M.ANGLE_BIAS for k in range(plant.stages)}
    pressures = {f"pressure_{m}": M.PRESSURE_BIAS for m in range(2 * plant.stages)}
    return angles | pressures


def loop_of(plant: RedundantManipulator, extended: bool = False, readings: bool = False) -> Loop:
    """Return the loop of a variant of the arm; ``readings``: of its sensors alone."""
    make = plant.hysteresis.kind, plant.stages
    kernels = {"plant_drive": drive, "plant_begin": begin, "advance": advance}
    joints = [row + k for row in JOINT_OUTPUTS.values() for k in range(plant.stages)]
    muscles = [row + m for row in MUSCLE_OUTPUTS.values() for m in range(2 * plant.stages)]
    return loop_for(
        f"arm_{make[0]}_{make[1]}", plant, M, kernels, partial(replacements, *make),
        [*joints, *muscles], work_rows(plant.stages), extended=extended,
        operators=2 * plant.stages, parameters=M.CHAIN + parameter_rows(plant.stages),
        readings=readings_of(plant) if readings else None,
    )  # fmt: skip


def simulate_manipulator(
    plant: RedundantManipulator,
    commands: ArrayLike,
    *,
    prestress: float | None = None,
    disturbance: ArrayLike = 0.0,
    payload: ArrayLike = 0.0,
    compiled: bool = COMPILED,
) -> dict[str, Array]:
    """Simulate an arm of n joints from rest under the first commands.

    Parameters
    ----------
    commands : array_like, shape (T, n)
        Setpoints [rad] of the feedforward, one row a control period.
    prestress : float, optional
        Co-contraction [N] of every joint. Default: the plant's.
    disturbance : array_like, shape () or (n,) or (T, n)
        Torques at the joints [N m].
    payload : array_like, shape () or (T,)
        Mass at the tip [kg].
    compiled : bool
        Whether kernels run as machine code; plain Python gives the same bits.

    Returns
    -------
    dict
        Each signal of ``JOINT_OUTPUTS``, shape (T, n), and of ``MUSCLE_OUTPUTS``, shape (T, 2 n),
        at the end of each control period, free of noise.
    """
    given, n = np.atleast_2d(np.asarray(commands, np.float64)), plant.stages
    if given.shape[1] != n:
        raise ValueError(f"commands have {given.shape[1]} columns for {n} joints; give one a joint")
    periods = len(given)
    stress = plant.prestress if prestress is None else prestress
    shoves = np.broadcast_to(np.asarray(disturbance, float), (periods, n))
    masses = np.broadcast_to(np.asarray(payload, float), (periods,))
    unused = [0.0] * (2 * n + 1)  # pressures, and whether they are given
    drives = drives_of([masses, stress, *given.T, *shoves.T, *unused])
    loop = loop_of(plant, plant.extended)
    made = run(loop, plant, plant.parameter_rows()[None], drives, lanes=1, compiled=compiled)
    split = len(JOINT_OUTPUTS) * n
    joints = made[:split, :, 0].reshape(len(JOINT_OUTPUTS), n, periods).transpose(0, 2, 1)
    muscles = made[split:, :, 0].reshape(len(MUSCLE_OUTPUTS), 2 * n, periods).transpose(0, 2, 1)
    found = {name: joints[s] for s, name in enumerate(JOINT_OUTPUTS)}
    return found | {name: muscles[s] for s, name in enumerate(MUSCLE_OUTPUTS)}
