"""Rollouts of the knee orthosis, driven by given set-points, parameter sets side by side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.build import COMPILED, LANES, kernel
from pam_envs.plants.core.rollout import Loop, biased_output, run
from pam_envs.plants.core.tiles import drives_of, first_of
from pam_envs.plants.knee_orthosis import rows as K
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.knee_orthosis.step import (
    N_WORK,
    advance,
    begin_lane,
    replacements,
    start_hysteresis,
)

OUTPUTS = {
    "angle": K.ANGLE,
    "velocity": K.VELOCITY,
    "pressure": K.PRESSURE,
    "stiffness": K.STIFFNESS,
    "tension": K.TENSION,
    "length": K.LENGTH,
    "torque": K.TORQUE,
    "air": K.AIR,
    "phase": K.PHASE,
    "knee": K.KNEE,
    "knee_rate": K.KNEE_RATE,
    "knee_acceleration": K.KNEE_ACCELERATION,
    "deviation": K.DEVIATION,
    "deviation_rate": K.DEVIATION_RATE,
    "shank": K.SHANK,
    "ankle": K.ANKLE,
    "ground_z": K.GROUND_Z,
    "ground_x": K.GROUND_X,
    "cop": K.COP,
    "demand": K.DEMAND,
    "estimate": K.ESTIMATE,
    "heel": K.HEEL,
    "stance": K.STANCE,
    "hold": K.HOLD,
    "hold_rate": K.HOLD_RATE,
    "quads": K.QUADS,
    "quads_free": K.QUADS_FREE,
    "flexors": K.FLEXORS,
    "flexors_free": K.FLEXORS_FREE,
}
"""Every signal of a record (SI) and its row of state."""
MAKE = ("hysteresis.kind", "mounting", "dynamics", "activity")


@kernel
def drive(rows: Any, fixed: Any, drives: Any, t: int, column: int, j: int) -> None:
    """Write the set-point [Pa] of one lane."""
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
    """Return what drives the orthosis, with defaults: set-point, and phase and pressure at rest."""
    return {"set_point": 0.0, "phase": 0.0, "pressure": 0.0}


def readings_of(plant: KneeOrthosis) -> dict[str, tuple[int, int]]:
    """Return the sensors by name, each with its place among the readings and its bias' row."""
    biases = (K.TENSION_BIAS, K.ANGLE_BIAS, K.PRESSURE_BIAS, K.HEEL_BIAS, K.GROUND_BIAS)
    several = (*biases, K.COP_BIAS, K.ANKLE_BIAS)
    return {name: (k, bias) for k, (name, bias) in enumerate(zip(K.SENSORS, several, strict=True))}


def loop_of(plant: KneeOrthosis, extended: bool = False, readings: bool = False) -> Loop:
    """Return the loop of a make of the orthosis; ``readings``: of its sensors alone."""
    kind, mounting, dynamics = plant.hysteresis.kind, plant.mounting, plant.dynamics
    effects = K.END + state_rows(kind)
    kernels: dict[str, Any] = {
        "plant_drive": drive,
        "plant_begin": begin,
        "plant_advance": advance_knee,
    }
    outputs: tuple[int, ...] = tuple(OUTPUTS.values())
    if readings:
        read = readings_of(plant).values()
        kernels["BIAS_ROWS"] = tuple(bias for _, bias in read)
        kernels["plant_output"] = biased_output
        outputs = tuple(effects + K.STATE.sensors + place for place, _ in read)
    return Loop(
        f"knee_{kind}_{mounting}_{dynamics}"
        + ("_extended" if extended else "")
        + ("_readings" if readings else ""),
        kernels | replacements(kind, mounting, dynamics, effects if extended else None),
        outputs,
        rows=effects + (K.STATE.end if extended else 0),
        parameters=K.N_PARAMETERS,
        counts=K.N_COUNTS,
        work=N_WORK,
        extra=plant.gait_table(),
    )


def simulate_knee(
    plants: KneeOrthosis | Sequence[KneeOrthosis],
    set_points: ArrayLike,
    *,
    phase: float = 0.0,
    pressure: float = 0.0,
    compiled: bool = COMPILED,
) -> dict[str, NDArray[np.float64]]:
    """Simulate one plant, or several of one make, from rest.

    Parameters
    ----------
    plants : KneeOrthosis or sequence of them
        Of one hysteresis, mounting, regulator, activity, and with the same sub-steps. A
        hysteresis operator is that of the first.
    set_points : array_like, shape (T,) or (T, n)
        Set-points [Pa], one a control period.
    phase : float
        Phase of the stride at the start, in turns.
    pressure : float
        Pressure [Pa] of the rest, reached by inflation from none.
    compiled : bool
        Whether kernels run as machine code; plain Python gives the same bits.

    Returns
    -------
    dict
        Each signal of ``OUTPUTS`` at the end of each control period, free of noise, shape (T,) for
        one plant and (T, n) for several.
    """
    several = [plants] if isinstance(plants, KneeOrthosis) else list(plants)
    first = first_of(several, *MAKE, "substeps")
    commands = np.asarray(set_points, np.float64)
    n = len(several) if len(several) > 1 else commands.reshape(len(commands), -1).shape[1]
    loop = loop_of(first, any(plant.extended for plant in several))
    columns = [plant.parameter_rows() for plant in several]
    drives = drives_of([commands, phase, pressure])
    made = run(loop, first, columns, drives, plants=n, compiled=compiled)
    single = isinstance(plants, KneeOrthosis) and commands.ndim == 1
    return {name: made[k, :, 0] if single else made[k] for k, name in enumerate(OUTPUTS)}
