"""Whole records of the redundant manipulator."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.kernels.build import COMPILED, build, kernel, scratch
from pam_envs.mechanics.serial_chain.kinematics import N_STAGES
from pam_envs.plants.antagonistic_joint.pair import command
from pam_envs.plants.redundant_manipulator import rows as M
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from pam_envs.plants.redundant_manipulator.step import (
    advance,
    begin_lane,
    hysteresis_rows,
    replacements,
    start_hysteresis,
    work_rows,
)

JOINT_OUTPUTS = {
    "angle": M.ANGLE,
    "velocity": M.VELOCITY,
    "torque": M.TORQUE,
    "stiffness": M.STIFFNESS,
}
MUSCLE_OUTPUTS = {
    "pressure": M.PRESSURE,
    "set_point": M.SET_POINT,
    "force": M.FORCE,
    "contraction": M.CONTRACTION,
    "lag": M.LAG,
}
"""Signals of a record (SI) and the first of their rows."""
_JOINT_ROWS = tuple(JOINT_OUTPUTS.values())
_MUSCLE_ROWS = tuple(MUSCLE_OUTPUTS.values())
ARM_WORK = 0  # a placeholder, filled in for each length of the chain

Array = NDArray[np.float64]


@kernel
def order(rows: Any, fixed: Any, commands: Any, stress: float, shove: Any, mass: Any) -> None:
    """Write what drives the arm in one control period."""
    rows[M.PAYLOAD][0] = mass[0]
    for k in range(N_STAGES):
        rows[M.DISTURBANCE + k][0] = shove[k]
        command(
            rows, fixed, 0, commands[k], stress, M.COMMAND + k, M.PRESTRESS + k,
            M.SET_POINT + 2 * k,
        )  # fmt: skip


@kernel
def run_arm(
    rows: Any, fixed: Any, counts: Any, table: Any, commands: Any, shoves: Any, masses: Any,
    joints: Any, muscles: Any, stress: float, elements: int, substeps: int, period: float,
) -> None:  # fmt: skip
    """Run one arm from rest under the first commands through all control periods."""
    work = scratch(ARM_WORK, 1)
    start_hysteresis(rows, counts, M.END, 0)
    order(rows, fixed, commands[0], stress, shoves[0], masses[0])
    begin_lane(rows, fixed, counts, table, M.END, elements, 0, work)
    for step in range(len(commands)):
        order(rows, fixed, commands[step], stress, shoves[step], masses[step])
        counts[M.STEP][0] = step
        advance(rows, fixed, counts, table, M.END, elements, substeps, period, work)
        for s in range(len(_JOINT_ROWS)):
            for k in range(N_STAGES):
                joints[s][step][k] = rows[_JOINT_ROWS[s] + k][0]
        for s in range(len(_MUSCLE_ROWS)):
            for m in range(2 * N_STAGES):
                muscles[s][step][m] = rows[_MUSCLE_ROWS[s] + m][0]


@lru_cache(maxsize=12)
def _runner(kind: str, stages: int) -> Callable[..., Any]:
    names = replacements(kind, stages) | {"ARM_WORK": work_rows(stages), "LANES": 1}
    return build(run_arm, f"run_arm_{kind}_{stages}", **names)


def simulate_manipulator(
    plant: RedundantManipulator,
    commands: ArrayLike,
    *,
    prestress: float | None = None,
    disturbance: ArrayLike = 0.0,
    payload: ArrayLike = 0.0,
) -> dict[str, Array]:
    """Simulate an arm from rest under the first commands.

    Parameters
    ----------
    plant : RedundantManipulator
        The arm, of n joints.
    commands : array_like, shape (T, n)
        Set-points [rad] of the feed-forward, one row a control period.
    prestress : float, optional
        Co-contraction [N] of every joint. Default: the plant's.
    disturbance : array_like, shape () or (n,) or (T, n)
        Torques at the joints [N m].
    payload : array_like, shape () or (T,)
        Mass at the tip [kg].

    Returns
    -------
    dict
        Each signal of ``JOINT_OUTPUTS``, shape (T, n), and of ``MUSCLE_OUTPUTS``, shape (T, 2 n),
        at the end of each control period, free of noise.
    """
    given = np.ascontiguousarray(np.atleast_2d(np.asarray(commands, np.float64)))
    n, periods, kind = plant.stages, len(given), plant.hysteresis.kind
    if given.shape[1] != n:
        raise ValueError(f"commands have {given.shape[1]} columns for {n} joints; give one a joint")
    masses = np.broadcast_to(np.asarray(payload, float), (periods,))[:, None]
    arrays = [
        np.zeros((M.END + hysteresis_rows(kind, n), 1)),
        plant.parameter_rows()[:, None],
        np.zeros((M.N_COUNTS, 1), np.int64),
        plant.hysteresis_tables()[:1],
        given,
        np.array(np.broadcast_to(np.asarray(disturbance, float), (periods, n))),
        np.array(masses),
        np.empty((len(JOINT_OUTPUTS), periods, n)),
        np.empty((len(MUSCLE_OUTPUTS), periods, 2 * n)),
    ]
    lists = arrays if COMPILED else [a.tolist() for a in arrays]
    stress = plant.prestress if prestress is None else prestress
    numbers = (float(stress), plant.elements, plant.substeps, plant.control_period)
    _runner(kind, n)(*lists, *numbers)
    joints, muscles = np.asarray(lists[-2]), np.asarray(lists[-1])
    made = {name: joints[s] for s, name in enumerate(JOINT_OUTPUTS)}
    return made | {name: muscles[s] for s, name in enumerate(MUSCLE_OUTPUTS)}
