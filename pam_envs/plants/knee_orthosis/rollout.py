"""Rollouts of the knee orthosis, driven by given setpoints, parameter sets side by side."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.kernels.build import COMPILED, LANES, kernel
from pam_envs.plants.core.rollout import (
    Loop,
    drives_of,
    loop_for,
    simulate_plants,
    start_hysteresis,
)
from pam_envs.plants.core.rows import signal_rows
from pam_envs.plants.knee_orthosis import rows as K
from pam_envs.plants.knee_orthosis.motion import N_WORK
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.knee_orthosis.step import advance, begin_lane, replacements

OUTPUTS = signal_rows(
    K,
    "angle velocity pressure stiffness tension length torque air phase knee knee_rate "
    "knee_acceleration deviation deviation_rate shank ankle ground_z ground_x cop demand estimate "
    "heel stance hold hold_rate quads quads_free flexors flexors_free",
)
"""Every signal of a record (SI) and its row of state."""
MAKE = ("hysteresis.kind", "mounting", "dynamics", "activity", "substeps")


@kernel
def drive(rows: Any, fixed: Any, drives: Any, t: int, column: int, j: int) -> None:
    """Write the setpoint [Pa] of one lane."""
    rows[K.SET_POINT][j] = drives[0][t][column]


@kernel
def begin(
    rows: Any, fixed: Any, counts: Any, table: Any, extra: Any, drives: Any, t: int, first: int,
    elements: int, work: Any,
) -> None:  # fmt: skip
    """Bring a tile to rest; channels 1 and 2 are the phase [turns] and the pressure [Pa]."""
    last = len(drives[0][0]) - 1
    for j in range(LANES):
        column = min(first + j, last)
        phase, pressure = drives[1][t][column], drives[2][t][column]
        start_hysteresis(rows, counts, K.END, j)
        begin_lane(rows, fixed, counts, table, extra, K.END, elements, j, phase, pressure)


@kernel
def advance_knee(
    rows: Any, fixed: Any, counts: Any, table: Any, extra: Any, elements: int, substeps: int,
    period: float, work: Any,
) -> None:  # fmt: skip
    """Advance a tile by one control period; ``extra`` is the table of the gait."""
    advance(rows, fixed, counts, table, extra, K.END, elements, substeps, period, work)


def channels_of(plant: KneeOrthosis) -> dict[str, float]:
    """Return the inputs of the orthosis, with defaults: setpoint; phase and pressure at rest."""
    return {"set_point": 0.0, "phase": 0.0, "pressure": 0.0}


def outputs_of(plant: KneeOrthosis) -> tuple[str, ...]:
    """Return the names of the outputs, in the order of the loop."""
    return tuple(OUTPUTS)


def readings_of(plant: KneeOrthosis) -> dict[str, int]:
    """Return the row of each sensor's bias, by name."""
    return {name: K.place(f"{name}.bias") for name in K.SENSORS}


def loop_of(plant: KneeOrthosis, extended: bool = False, readings: bool = False) -> Loop:
    """Return the loop of a variant of the orthosis; ``readings``: of its sensors alone."""
    make = plant.hysteresis.kind, plant.mounting, plant.dynamics
    kernels = {"plant_drive": drive, "plant_begin": begin, "plant_advance": advance_knee}
    return loop_for(
        "knee_" + "_".join(make), plant, K, kernels, partial(replacements, *make),
        OUTPUTS.values(), N_WORK, extended=extended, extra=plant.gait_table(),
        readings=readings_of(plant) if readings else None,
    )  # fmt: skip


def simulate_knee(
    plants: KneeOrthosis | Sequence[KneeOrthosis],
    set_points: ArrayLike,
    *,
    phase: float = 0.0,
    pressure: float = 0.0,
    compiled: bool = COMPILED,
) -> dict[str, NDArray[np.float64]]:
    """Simulate one plant, or several of one variant, from rest, free of noise.

    Parameters
    ----------
    plants : KneeOrthosis or sequence of them
        Of one hysteresis, mounting, regulator, activity, and with the same sub-steps; a hysteresis
        operator is that of the first.
    set_points : array_like, shape (T,) or (T, n)
        Setpoints [Pa], one a control period.
    phase : float
        Phase of the stride at the start [turns].
    pressure : float
        Pressure [Pa] of the rest, reached by inflation from none.
    compiled : bool
        Whether kernels run as machine code.

    Returns
    -------
    dict
        Each signal of ``OUTPUTS``, shape (T,) for one plant and (T, n) for several.
    """
    commands = np.asarray(set_points, np.float64)
    single = isinstance(plants, KneeOrthosis) and commands.ndim == 1
    drives = drives_of([commands, phase, pressure])
    return simulate_plants(loop_of, plants, MAKE, drives, OUTPUTS, single=single, compiled=compiled)
