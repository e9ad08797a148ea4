"""A recording driven through the plant: many parameter sets, and what came from outside.

Unlike :mod:`pam_envs.plants.single_muscle.rollout` the step is the recording's sampling period,
the load and the temperature change with time, the valve may be shut, the muscle may start anew,
and what comes out is what the sensors would have shown.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.build import (
    COMPILED,
    LANES,
    build,
    kernel,
    prange,
    routine,
    scratch,
    threads,
    tile_view,
)
from pam_envs.kernels.history import N_HISTORY
from pam_envs.kernels.motion import oscillator_wide
from pam_envs.plants.core.tiles import in_tiles
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.effects import (
    advance_extended,
    begin_effects,
    replacements,
    rest_extended,
    settled,
)
from pam_envs.plants.single_muscle.plant import NEUTRAL, SingleMuscle
from pam_envs.plants.single_muscle.rows import N_COUNTS, N_PARAMETERS
from pam_envs.plants.single_muscle.step import N_WORK

CHANNELS = ("contraction", "pressure")
LONGEST_STEP = 0.0201
"""Longest sub-step [s] of a replay: errors of some micrometres, below the noise of a sensor."""
N_ROWS = 0
EFFECTS_AT = 0
COMMAND, LOAD, KELVIN, FRESH, START_PRESSURE = range(5)

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Inputs:
    """What acts on a plant from outside, sample by sample.

    Attributes
    ----------
    period : float
        Sampling period [s].
    command : ndarray, shape (n,)
        Set-point [Pa] from this sample to the next; below zero: the valve is shut.
    load : ndarray, shape (n,)
        Load [kg].
    kelvin : ndarray, shape (n,)
        Temperature [K].
    fresh : ndarray of bool, shape (n,)
        Where the muscle starts anew from rest, the first sample among them.
    start_pressure : ndarray, shape (n,)
        Pressure [Pa] at which it starts there.
    rezeroed : ndarray of bool, shape (n,)
        Where the position sensor was zeroed again, at rest without pressure.
    longest_step : float
        Longest sub-step [s].
    """

    period: float
    command: Array
    load: Array
    kelvin: Array
    fresh: NDArray[np.bool_]
    start_pressure: Array
    rezeroed: NDArray[np.bool_]
    longest_step: float = LONGEST_STEP

    @property
    def table(self) -> Array:
        """The inputs as the kernel reads them, shape (5, n)."""
        fresh = self.fresh.astype(float) + 2.0 * (self.rezeroed & ~self.fresh)
        rows = [self.command, self.load, self.kelvin, fresh, self.start_pressure]
        return np.ascontiguousarray(np.stack(rows), dtype=np.float64)


@routine
def begin(
    rows: Any, fixed: Any, counts: Any, table: Any, pressure: float, elements: int, work: Any
) -> None:
    """Start every lane of a tile from rest, at a pressure reached from none."""
    for k in range(N_ROWS):
        for j in range(LANES):
            keep = 0.0
            if k == R.LOAD:
                keep = rows[R.LOAD][j]
            rows[k][j] = keep
    for j in range(LANES):
        counts[R.STACK_COUNT][j] = 1
        rows[R.REST][j] = rest_extended(fixed, j, 0.0, rows[R.LOAD][j])
    settled(rows, fixed, counts, table, R.END, 0, LANES, elements, work)
    for j in range(LANES):
        rows[R.PRESSURE][j] = pressure
    settled(rows, fixed, counts, table, R.END, 0, LANES, elements, work)
    for j in range(LANES):
        rows[R.CONTRACTION][j] = rest_extended(fixed, j, rows[R.DRIVE][j], rows[R.LOAD][j])
        begin_effects(rows, fixed, j)


@kernel
def run_replay(
    all_rows: Any,
    all_fixed: Any,
    all_counts: Any,
    table: Any,
    inputs: Any,
    outputs: Any,
    elements: int,
    substeps: int,
    period: float,
) -> None:
    """Replay tiles of plants; ``outputs[channel][sample][lane]``."""
    samples = len(inputs[0])
    for tile in prange(len(all_rows)):
        rows = tile_view(all_rows, tile, N_ROWS, LANES)
        fixed = tile_view(all_fixed, tile, N_PARAMETERS, LANES)
        counts = tile_view(all_counts, tile, N_COUNTS, LANES)
        work = scratch(N_WORK, LANES)
        start = tile * LANES
        lanes = min(LANES, len(outputs[0][0]) - start)
        for t in range(samples):
            for j in range(LANES):
                rows[R.LOAD][j] = inputs[LOAD][t]
                counts[R.STEP][j] = t
            if inputs[FRESH][t] == 1.0:
                begin(rows, fixed, counts, table, inputs[START_PRESSURE][t], elements, work)
                hold = inputs[COMMAND][t]
                for k in range(N_HISTORY):
                    for j in range(LANES):
                        rows[R.HISTORY + k][j] = max(0.0, hold)
            if inputs[FRESH][t] == 2.0:
                for j in range(LANES):
                    rows[R.REST][j] = rest_extended(fixed, j, 0.0, rows[R.LOAD][j])
            seen_x, seen_p = (
                rows[EFFECTS_AT + R.STATE.position_reading],
                rows[EFFECTS_AT + R.STATE.pressure_reading],
            )
            bias_x, bias_p = fixed[R.POSITION_BIAS], fixed[R.PRESSURE_BIAS]
            for j in range(lanes):
                outputs[0][t][start + j] = seen_x[j] + bias_x[j]
                outputs[1][t][start + j] = seen_p[j] + bias_p[j]
            for j in range(LANES):
                rows[R.SET_POINT][j] = inputs[COMMAND][t]
                rows[EFFECTS_AT + R.STATE.kelvin][j] = inputs[KELVIN][t]
            advance_extended(rows, fixed, counts, table, R.END, elements, substeps, period, work)


TILE = 16
"""Plants that a tile advances together: fewer than in a batch, since few are replayed at a time."""
COSTLY = (
    (
        "regulator.slew_bend",
        "regulator.dead_band",
        "regulator.overlap",
        "regulator.exhaust_ratio",
        "regulator.exhaust_rate",
        "regulator.leak",
        "regulator.supply_pressure",
    ),
    (
        "hysteresis.shape",
        "hysteresis.pressure_slope",
        "hysteresis.pressure_bend",
        "hysteresis.first_width",
        "hysteresis.first_loss",
        "muscle.temperature_gain",
    ),
    ("regulator.ring_share", "regulator.ring_flow"),
    ("mass.ring_share",),
    tuple(f"muscle.creep_{k}" for k in (1, 2, 3, 4)),
    tuple(f"hysteresis.creep_{k}" for k in (1, 2, 3, 4)),
    tuple(f"muscle.strand_{k}" for k in (1, 2, 3, 4)),
    ("mass.stick", "muscle.viscosity"),
)
"""Parameters of the effects that a tile works out only where one of them is on."""


@lru_cache(maxsize=1)
def _places() -> list[tuple[list[int], Array]]:
    return [
        ([R.place(n) for n in names], np.array([NEUTRAL.get(n, 0.0) for n in names]))
        for names in COSTLY
    ]


@lru_cache(maxsize=8)
def _runner(kind: str, parallel: bool) -> Callable[..., Any]:
    first = R.END + state_rows(kind)
    return build(
        run_replay,
        f"replay_{kind}",
        parallel,
        oscillator=oscillator_wide,
        LANES=TILE,
        N_ROWS=first + R.N_EFFECTS,
        **replacements(kind, first),
    )


def replay_rows(plant: SingleMuscle, columns: Array, inputs: Inputs) -> Array:
    """Replay a recording with many parameter sets of one kind of plant.

    Parameters
    ----------
    plant : SingleMuscle
        Gives the hysteresis's kind and Everett map.
    columns : array, shape (n, n_parameters)
        As :meth:`SingleMuscle.parameter_rows` lays them out.
    inputs : Inputs
        T samples.

    Returns
    -------
    array, shape (2, T, n)
        Contraction [m] and pressure [Pa] as the sensors would show them, free of noise.
    """
    table = inputs.table
    outputs = np.empty((len(columns), len(CHANNELS), len(inputs.command)))
    for chosen in alike(columns):
        outputs[chosen] = _replay_tiles(plant, columns[chosen], inputs, table).transpose(2, 0, 1)
    return outputs.transpose(1, 2, 0)  # plants apart in memory: residuals are read one by one


def alike(columns: Array) -> list[NDArray[np.int64]]:
    """Return groups of columns to replay together, and in which order.

    A tile does for all its lanes what one of them needs: those with the same effects go side by
    side, and what takes finer steps goes by itself.
    """
    active = np.array([(columns[:, at] != off).any(axis=1) for at, off in _places()])
    order = np.lexsort(active[:-1])
    fine = active[-1][order]
    return [group for group in (order[~fine], order[fine]) if len(group)]


def _replay_tiles(plant: SingleMuscle, columns: Array, inputs: Inputs, table: Array) -> Array:
    kind, n = plant.hysteresis.kind, len(columns)
    fixed = in_tiles(columns, n, TILE)
    tiles = len(fixed)
    rows = np.zeros((tiles, R.END + state_rows(kind) + R.N_EFFECTS, TILE))
    counts = np.zeros((tiles, N_COUNTS, TILE), np.int64)
    outputs = np.empty((len(CHANNELS), len(inputs.command), n))
    substeps = max(1, int(np.ceil(inputs.period / inputs.longest_step)))
    arrays: list[Any] = [rows, fixed, counts, plant.hysteresis_tables()[:1], table, outputs]
    if not COMPILED:
        arrays = [a.tolist() for a in arrays]
    _runner(kind, tiles > 1 and threads() > 1)(*arrays, plant.elements, substeps, inputs.period)
    return outputs if COMPILED else np.array(arrays[-1])


def replay(plant: SingleMuscle, inputs: Inputs) -> dict[str, Array]:
    """Replay a recording with one plant; see :func:`replay_rows`."""
    outputs = replay_rows(plant, plant.parameter_rows()[None, :], inputs)
    return {name: outputs[i, :, 0] for i, name in enumerate(CHANNELS)}
