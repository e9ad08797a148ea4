"""Rollouts of the antagonistic joint, parameter sets side by side, and its rests."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.kernels.build import COMPILED, LANES, kernel
from pam_envs.plants.antagonistic_joint import rows as K
from pam_envs.plants.antagonistic_joint.pair import advance, feed_forward
from pam_envs.plants.antagonistic_joint.step import (
    N_WORK,
    begin_filled,
    begin_lane,
    replacements,
)
from pam_envs.plants.core.plant import Plant
from pam_envs.plants.core.rollout import (
    BEGIN,
    REST,
    Loop,
    drives_of,
    first_of,
    loop_for,
    plants_of,
    simulate_plants,
    start_hysteresis,
)
from pam_envs.plants.core.rows import signal_rows

if TYPE_CHECKING:
    from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint

OUTPUTS = signal_rows(
    K,
    "angle velocity pressure_a pressure_b force_a force_b contraction_a contraction_b lag_a lag_b "
    "torque stiffness slack air set_point_a set_point_b",
)
"""Every signal of a record (SI) and its row of state."""
MAKE = ("hysteresis.kind", "dynamics", "substeps")
COMMANDED, STRESSED, DISTURBED, LOADED, FILLED_A, FILLED_B, DIRECT = range(7)
"""Input channels of a record; ``DIRECT`` above 0 means that pressures are given, ``FROM_THEM`` that
the joint also begins at rest at them."""
FROM_THEM = 2.0


@kernel
def drive(rows: Any, fixed: Any, drives: Any, t: int, column: int, j: int) -> None:
    """Write the inputs of one lane in one control period."""
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
        if drives[DIRECT][t][min(first + j, len(drives[0][0]) - 1)] == FROM_THEM:
            begin_filled(rows, fixed, counts, table, K.END, elements, j)
        else:
            begin_lane(rows, fixed, counts, table, K.END, elements, j, angle, stress)


@kernel
def come_to_rest(
    rows: Any, fixed: Any, counts: Any, table: Any, extra: Any, elements: int, work: Any
) -> None:
    """Bring a tile to rest under its command, from where it rests."""
    for j in range(LANES):
        angle, stress = rows[K.COMMAND][j], rows[K.PRESTRESS][j]
        begin_lane(rows, fixed, counts, table, K.END, elements, j, angle, stress)


def channels_of(plant: AntagonisticJoint) -> dict[str, float]:
    """Return the inputs of the joint, with defaults; ``direct`` above 0: pressures are given."""
    # direct = 2: the joint also begins at rest at the given pressures
    names = ("command", "prestress", "disturbance", "payload", "pressure_a", "pressure_b", "direct")
    return dict.fromkeys(names, 0.0) | {"prestress": plant.prestress}


def outputs_of(plant: AntagonisticJoint) -> tuple[str, ...]:
    """Return the names of the outputs, in the order of the loop."""
    return tuple(OUTPUTS)


def readings_of(plant: AntagonisticJoint) -> dict[str, int]:
    """Return the row of each sensor's bias, by name."""
    gauges = dict.fromkeys(("pressure_a", "pressure_b"), K.PRESSURE_BIAS)
    return {"angle": K.ANGLE_BIAS} | gauges


def loop_of(plant: AntagonisticJoint, extended: bool = False, readings: bool = False) -> Loop:
    """Return the loop of a variant of the joint; ``readings``: of its sensors alone."""
    make = plant.hysteresis.kind, plant.dynamics
    kernels = {
        "plant_drive": drive,
        "plant_begin": begin,
        "plant_rest": come_to_rest,
        "advance": advance,
    }
    return loop_for(
        f"joint_{make[0]}_{make[1]}", plant, K, kernels, partial(replacements, *make),
        OUTPUTS.values(), N_WORK, extended=extended, operators=2,
        readings=readings_of(plant) if readings else None,
    )  # fmt: skip


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
    """Simulate one joint, or several of one variant, from rest under the first command, noise-free.

    Parameters
    ----------
    plants : AntagonisticJoint or sequence of them
        Of one make and hysteresis, and with the same sub-steps; a hysteresis map is the first's.
    commands : array_like, shape (T,) or (T, n)
        Setpoints [rad] of the feedforward, one a control period.
    prestress, disturbance, payload : array_like
        Co-contraction [N] (default: the first plant's), torque [N m] and mass at the link's end
        [kg]; a number or as ``commands``.
    pressures : tuple of array_like, optional
        Setpoints [Pa] of both muscles instead of the feedforward's, each as ``commands``.
    quasi_static : bool
        Whether each command is held until rest (from which the next one starts) instead of for a
        control period; commands only.
    compiled : bool
        Whether kernels run as machine code.

    Returns
    -------
    dict
        Each signal of ``OUTPUTS``, shape (T,) for one plant and (T, n) for several.
    """
    first = first_of(plants_of(plants))
    stress = first.prestress if prestress is None else prestress
    given = (0.0, 0.0) if pressures is None else pressures
    direct = 0.0 if pressures is None else 1.0
    channels = [commands, stress, disturbance, payload, *given, direct]
    drives = drives_of(channels)
    flags = np.full(drives.shape[1], REST if quasi_static else 0)
    flags[0] |= BEGIN
    single = isinstance(plants, Plant) and all(np.ndim(d) < 2 for d in channels)
    return simulate_plants(
        loop_of, plants, MAKE, drives, OUTPUTS, single=single, flags=flags, compiled=compiled
    )
