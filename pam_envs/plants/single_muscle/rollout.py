"""Rollouts of the single muscle, driven by given setpoints, many parameter sets side by side."""

import dataclasses
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.build import LANES, kernel
from pam_envs.kernels.motion import fill_ring, oscillator_wide
from pam_envs.plants.core.rollout import Loop, drives_of, first_of, loop_for, plants_of, run
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.effects import (
    EFFECTS_AT,
    begin_friction_of_length,
    begin_plays,
    replacements,
    rest_extended,
    settled,
)
from pam_envs.plants.single_muscle.hysteresis_kernels import hysteresis_kernels
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.step import (
    N_WORK,
    advance,
    begin_rest,
    rest_contraction,
    slide_to_rest,
    true_position,
)

OUTPUTS = ("contraction", "velocity", "pressure", "drive")
COMMAND, LOAD, KELVIN, START_PRESSURE, HELD = range(5)
"""Channels that drive a muscle: setpoint [Pa], below zero with the valve shut; load [kg];
temperature [K]; and, where it restarts, its pressure and the setpoint before [Pa]."""
N_ROWS = 0  # a placeholder


@kernel
def drive(rows: Any, fixed: Any, drives: Any, t: int, column: int, j: int) -> None:
    """Write setpoint and load of one lane."""
    rows[R.SET_POINT][j] = drives[COMMAND][t][column]
    rows[R.LOAD][j] = drives[LOAD][t][column]


@kernel
def drive_extended(rows: Any, fixed: Any, drives: Any, t: int, column: int, j: int) -> None:
    """Write setpoint, load and temperature of one lane."""
    rows[R.SET_POINT][j] = drives[COMMAND][t][column]
    rows[R.LOAD][j] = drives[LOAD][t][column]
    rows[EFFECTS_AT + R.STATE.kelvin][j] = drives[KELVIN][t][column]


@kernel
def begin(
    rows: Any, fixed: Any, counts: Any, table: Any, extra: Any, drives: Any, t: int, first: int,
    elements: int, work: Any,
) -> None:  # fmt: skip
    """Begin a tile at rest at no pressure."""
    for j in range(LANES):
        rows[R.REST][j] = rest_contraction(fixed, j, 0.0, rows[R.LOAD][j])
        counts[R.STACK_COUNT][j] = 1
        begin_rest(rows, fixed, counts, table, R.END, elements, j)


@kernel
def begin_extended(
    rows: Any, fixed: Any, counts: Any, table: Any, extra: Any, drives: Any, t: int, first: int,
    elements: int, work: Any,
) -> None:  # fmt: skip
    """Begin a tile at rest, at a pressure reached from none."""
    last = len(drives[0][0]) - 1
    for k in range(N_ROWS):
        for j in range(LANES):
            keep = 0.0
            if k == R.LOAD:
                keep = rows[R.LOAD][j]
            rows[k][j] = keep
    for j in range(LANES):
        counts[R.STACK_COUNT][j] = 1
        rows[R.REST][j] = rest_extended(fixed, j, 0.0, rows[R.LOAD][j])
        begin_rest(rows, fixed, counts, table, R.END, elements, j)
        begin_plays(rows, fixed, R.END, elements, j)
    settled(rows, fixed, counts, table, R.END, 0, LANES, elements, work)
    for j in range(LANES):
        rows[R.PRESSURE][j] = drives[START_PRESSURE][t][min(first + j, last)]
    settled(rows, fixed, counts, table, R.END, 0, LANES, elements, work)
    for j in range(LANES):
        slide_to_rest(rows, fixed, counts, table, R.END, elements, j)
        begin_friction_of_length(rows, fixed, j)
        fill_ring(rows, R.HISTORY, j, drives[HELD][t][min(first + j, last)])


@kernel
def rezero(rows: Any, fixed: Any) -> None:
    """Zero the position sensors of a tile at rest without pressure."""
    for j in range(LANES):
        rows[R.REST][j] = rest_extended(fixed, j, 0.0, rows[R.LOAD][j])


@kernel
def output(rows: Any, fixed: Any, k: int, j: int) -> float:
    """Return an output of lane ``j``: the contraction, or a row of the state."""
    return true_position(rows, j) if k == 0 else rows[OUTPUT_ROWS[k]][j]  # type: ignore[no-any-return]


OUTPUT_ROWS: tuple[int, ...] = ()  # a placeholder


def channels_of(plant: SingleMuscle) -> dict[str, float]:
    """Return the inputs of the muscle, with defaults (``COMMAND`` to ``HELD``)."""
    names = ("set_point", "load", "temperature", "start_pressure", "held")
    usual = {"load": plant.mass.load, "temperature": plant.muscle.temperature}
    return dict.fromkeys(names, 0.0) | usual


def outputs_of(plant: SingleMuscle) -> tuple[str, ...]:
    """Return the names of the outputs, in the order of the loop."""
    return OUTPUTS


def readings_of(plant: SingleMuscle) -> dict[str, int]:
    """Return the row of each sensor's bias, by name."""
    return {"contraction": R.POSITION_BIAS, "pressure": R.PRESSURE_BIAS}


def _replacements(kind: str, effects: int | None) -> dict[str, Any]:
    kernels = hysteresis_kernels(kind) | {"plant_output": output}
    if effects is None:
        return kernels
    extended = {
        "plant_drive": drive_extended,
        "plant_begin": begin_extended,
        "plant_rezero": rezero,
    }
    return kernels | replacements(kind, effects) | extended


def loop_of(plant: SingleMuscle, extended: bool, readings: bool = False) -> Loop:
    """Return the loop of muscles with a hysteresis.

    ``readings``: the outputs are the readings of both sensors and the true contraction [m], with
    long sub-steps.
    """
    kind = plant.hysteresis.kind
    kernels = {"plant_drive": drive, "plant_begin": begin, "advance": advance}
    loop = loop_for(
        f"muscle_{kind}", plant, R, kernels, partial(_replacements, kind),
        [R.CONTRACTION, R.VELOCITY, R.PRESSURE, R.DRIVE], N_WORK, extended=extended,
        readings=readings_of(plant) if readings else None,
    )  # fmt: skip
    if not readings:
        return loop
    position = R.END + state_rows(kind) + R.STATE.position
    return dataclasses.replace(
        loop,
        kernels=dict(loop.kernels) | {"oscillator": oscillator_wide},
        outputs=(*loop.outputs, position),
    )


def simulate_rows(
    plant: SingleMuscle, parameters: NDArray[np.float64], set_points: ArrayLike
) -> NDArray[np.float64]:
    """Simulate many parameter sets of one kind of plant from rest at no pressure.

    Parameters
    ----------
    plant : SingleMuscle
        Gives the hysteresis kind, the Everett map and the sub-steps.
    parameters : array, shape (n, n_parameters)
        Columns as of :meth:`SingleMuscle.parameter_rows` [SI].
    set_points : array_like, shape (T,) or (T, n)
        Setpoints [Pa], one a control period.

    Returns
    -------
    array, shape (4, T, n)
        Contraction [m], velocity [m/s], pressure [Pa] and effective pressure [Pa] at the end of
        each control period, free of noise.
    """
    columns = np.asarray(parameters, np.float64)
    loads, kelvin = columns[:, R.MASS_LOAD], columns[:, R.place("muscle.temperature")]
    commands = np.asarray(set_points, np.float64)
    drives = drives_of([commands, loads[None], kelvin[None], 0.0, 0.0])
    extended = plant.extended or bool(np.any(effects_on(columns)))
    return run(loop_of(plant, extended), plant, columns, drives)


def effects_on(columns: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which parameter sets, shape (n, n_parameters), have an effect on."""
    places = [R.place(name) for name in SingleMuscle.neutral]
    return np.asarray((columns[:, places] != list(SingleMuscle.neutral.values())).any(axis=1))


def simulate(
    plants: SingleMuscle | Sequence[SingleMuscle], set_points: ArrayLike
) -> dict[str, NDArray[np.float64]]:
    """Simulate one plant, or several with the same hysteresis and sub-steps, from rest.

    Returns
    -------
    dict
        ``contraction``, ``velocity``, ``pressure`` and ``drive``, shape (T,) for one plant and
        (T, n) for several; see :func:`simulate_rows`.
    """
    several = plants_of(plants)
    first = first_of(several, "hysteresis.kind", "substeps")
    outputs = simulate_rows(first, np.array([p.parameter_rows() for p in several]), set_points)
    if isinstance(plants, SingleMuscle):
        outputs = outputs[:, :, 0]
    return dict(zip(OUTPUTS, outputs, strict=True))
