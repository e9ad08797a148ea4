"""Plants stepped set-point by set-point, with copies that look ahead.

A controller is run against a plant one control period at a time, and a controller that carries a
plant inside asks it what would come of many set-points. The step is that of
:mod:`pam_envs.plants.single_muscle.replay`: the extended plant, one sub-step a period. Plants
start at rest, without pressure and without a past.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.build import COMPILED, LANES, build, kernel, prange, scratch, tile_view
from pam_envs.kernels.motion import oscillator_wide
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.effects import advance_extended, replacements
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.replay import begin
from pam_envs.plants.single_muscle.rows import N_COUNTS, N_PARAMETERS
from pam_envs.plants.single_muscle.step import N_WORK

PERIOD = 0.01
"""Control period [s] unless another is given."""
LONGEST_PERIOD = 0.0101
"""Longest one [s]: it is one sub-step, whose errors stay below the noise of a good sensor."""
READING, PRESSURE, POSITION = range(3)
N_ROWS = 0  # placeholders, filled in for each hysteresis
EFFECTS_AT = 0

Array = NDArray[np.float64]


@kernel
def begin_lanes(
    all_rows: Any, all_fixed: Any, all_counts: Any, table: Any, loads: Any, elements: int
) -> None:
    """Bring tiles of plants to rest without pressure; ``loads[0]`` is the load [kg]."""
    for tile in prange(len(all_rows)):
        rows = tile_view(all_rows, tile, N_ROWS, LANES)
        fixed = tile_view(all_fixed, tile, N_PARAMETERS, LANES)
        counts = tile_view(all_counts, tile, N_COUNTS, LANES)
        work = scratch(N_WORK, LANES)
        for j in range(LANES):
            rows[R.LOAD][j] = loads[0]
        begin(rows, fixed, counts, table, 0.0, elements, work)


@kernel
def run_lanes(
    all_rows: Any,
    all_fixed: Any,
    all_counts: Any,
    table: Any,
    set_points: Any,
    outputs: Any,
    elements: int,
    period: float,
) -> None:
    """Advance tiles through ``set_points[t][lane]``; ``outputs[channel][t][lane]``."""
    for tile in prange(len(all_rows)):
        rows = tile_view(all_rows, tile, N_ROWS, LANES)
        fixed = tile_view(all_fixed, tile, N_PARAMETERS, LANES)
        counts = tile_view(all_counts, tile, N_COUNTS, LANES)
        work = scratch(N_WORK, LANES)
        start = tile * LANES
        lanes = min(LANES, len(outputs[0][0]) - start)
        seen_x, seen_p = (
            rows[EFFECTS_AT + R.STATE.position_reading],
            rows[EFFECTS_AT + R.STATE.pressure_reading],
        )
        true_x = rows[EFFECTS_AT + R.STATE.position]
        for t in range(len(set_points)):
            for j in range(LANES):
                rows[R.SET_POINT][j] = set_points[t][start + min(j, lanes - 1)]
            advance_extended(rows, fixed, counts, table, R.END, elements, 1, period, work)
            for j in range(LANES):
                counts[R.STEP][j] = counts[R.STEP][j] + 1
            for j in range(lanes):
                outputs[0][t][start + j] = seen_x[j] + fixed[R.POSITION_BIAS][j]
                outputs[1][t][start + j] = seen_p[j] + fixed[R.PRESSURE_BIAS][j]
                outputs[2][t][start + j] = true_x[j]


@lru_cache(maxsize=8)
def _built(function: Callable[..., Any], kind: str) -> Callable[..., Any]:
    first = R.END + state_rows(kind)
    return build(
        function,
        f"{function.__name__}_{kind}",
        oscillator=oscillator_wide,
        N_ROWS=first + R.N_EFFECTS,
        **replacements(kind, first),
    )


def _call(function: Callable[..., Any], arrays: Sequence[Array], *rest: Any) -> None:
    """Call a kernel that changes arrays in place."""
    if COMPILED:
        function(*arrays, *rest)
        return
    lists = [a.tolist() for a in arrays]
    function(*lists, *rest)
    for array, values in zip(arrays, lists, strict=True):
        array[...] = values


def _tiled(columns: Array) -> Array:
    """Return parameter columns, shape (n, n_parameters), as tiles; the last one fills up."""
    n = len(columns)
    tiles = -(-n // LANES)
    filled = columns[np.minimum(np.arange(tiles * LANES), n - 1)]
    return np.ascontiguousarray(filled.T.reshape(-1, tiles, LANES).transpose(1, 0, 2))


class PlantBatch:
    """Plants with one kind of hysteresis side by side, each with set-points of its own.

    Parameters
    ----------
    plants : sequence of SingleMuscle
        One a lane. A Preisach hysteresis is that of the first.
    load_kg : float
        Load [kg].
    kelvin : float, optional
        Temperature [K]; default: ``muscle.temperature`` of each plant.
    period : float
        Control period [s], at most ``LONGEST_PERIOD``.

    Attributes
    ----------
    position : ndarray, shape (n,)
        True contraction [m].
    """

    def __init__(
        self,
        plants: Sequence[SingleMuscle],
        load_kg: float,
        kelvin: float | None = None,
        period: float = PERIOD,
    ) -> None:
        if not 0.0 < period <= LONGEST_PERIOD:
            raise ValueError(
                f"period = {period!r} s; plants are stepped with periods above 0 up to "
                f"{LONGEST_PERIOD:g} s: hold a set-point for several of them"
            )
        kinds = {(plant.hysteresis.kind, plant.elements) for plant in plants}
        if len(kinds) != 1:
            raise ValueError(f"plants that are stepped together need one hysteresis, got {kinds}")
        self.plants = tuple(plants)
        self.period = period
        self._kind, self._elements = kinds.pop()
        columns = np.array([plant.parameter_rows() for plant in plants])
        if kelvin is not None:
            columns[:, R.place("muscle.temperature")] = kelvin
        self._fixed = _tiled(columns)
        self._loads = np.array([load_kg])
        self._table = plants[0].hysteresis_tables()[:1]
        tiles = len(self._fixed)
        self._rows = np.zeros((tiles, R.END + state_rows(self._kind) + R.N_EFFECTS, LANES))
        self._counts = np.zeros((tiles, N_COUNTS, LANES), np.int64)
        self.position = np.zeros(len(plants))
        self.reset()

    def __len__(self) -> int:
        """Return the number of plants."""
        return len(self.plants)

    def reset(self) -> None:
        """Bring every plant to rest without pressure."""
        self._rows[:] = 0.0
        self._counts[:] = 0
        _call(_built(begin_lanes, self._kind), [*self._state, self._loads], self._elements)
        self.position = np.zeros(len(self))

    @property
    def _state(self) -> list[Any]:
        return [self._rows, self._fixed, self._counts, self._table]

    def run(self, set_points: ArrayLike) -> Array:
        """Advance every plant through several control periods.

        Parameters
        ----------
        set_points : array_like, shape (T, n)
            Set-points [Pa].

        Returns
        -------
        ndarray, shape (3, T, n)
            Contraction [m] and pressure [Pa] as the sensors show them, free of noise, and the
            true contraction [m], each at the end of its period.
        """
        given = np.ascontiguousarray(set_points, dtype=np.float64)
        outputs = np.empty((3, *given.shape))
        _call(
            _built(run_lanes, self._kind),
            [*self._state, given, outputs],
            self._elements,
            self.period,
        )
        self.position = outputs[POSITION, -1]
        return outputs

    def step(self, set_points: ArrayLike) -> tuple[Array, Array]:
        """Advance every plant by one period; return contractions [m] and pressures [Pa] read."""
        seen = self.run(np.asarray(set_points, float)[None, :])
        return seen[READING, 0], seen[PRESSURE, 0]

    def take(self, other: PlantBatch) -> None:
        """Put every plant of this tile into the state of the first of another batch."""
        self._rows[:] = other._rows[0, :, :1]
        self._counts[:] = other._counts[0, :, :1]


class PlantStepper:
    """One plant, stepped set-point by set-point.

    Parameters
    ----------
    plant : SingleMuscle
        Extended or not.
    load_kg : float
        Load [kg].
    noise_seed : int, optional
        Seed of the sensors' noise; without one they are free of noise and steps.
    kelvin : float, optional
        Temperature [K]; default: ``muscle.temperature`` of each plant.
    period : float
        Control period [s].

    Attributes
    ----------
    position : float
        True contraction [m].
    max_pressure : float
        Largest set-point [Pa] of its regulator.
    noise : float
        RMS noise [m] of its position sensor.
    """

    def __init__(
        self,
        plant: SingleMuscle,
        load_kg: float,
        noise_seed: int | None = None,
        kelvin: float | None = None,
        period: float = PERIOD,
    ) -> None:
        self.plant = plant
        self.period = period
        self.max_pressure = plant.regulator.max_pressure
        self.noise = plant.position.noise
        self._where = (load_kg, kelvin, period)
        self._one = PlantBatch([plant], *self._where)
        self._copies = PlantBatch([plant] * LANES, *self._where)
        self.reset(noise_seed)

    def reset(self, seed: int | None = None) -> None:
        """Bring the plant to rest without pressure and start the noise anew."""
        self._one.reset()
        self._noise = None if seed is None else np.random.default_rng(seed)

    @property
    def position(self) -> float:
        """Return the true contraction [m]."""
        return float(self._one.position[0])

    def step(self, set_point: float) -> tuple[float, float]:
        """Hold a set-point [Pa] for one period; return contraction [m] and pressure [Pa] read."""
        seen = self._one.run([[set_point]])
        x, p = float(seen[READING, 0, 0]), float(seen[PRESSURE, 0, 0])
        if self._noise is None:
            return x, p
        return self._read(x, self.plant.position), self._read(p, self.plant.pressure)

    def _read(self, value: float, sensor: Any) -> float:
        assert self._noise is not None
        value += sensor.noise * float(self._noise.standard_normal())
        if sensor.resolution <= 0.0:
            return value
        return float(sensor.resolution * round(value / sensor.resolution))

    def try_ahead(self, set_points: ArrayLike, periods: int) -> Array:
        """Return where copies of the plant would be; the plant itself stays as it is.

        Parameters
        ----------
        set_points : array_like, shape (m,) or (periods, m)
            Set-points [Pa] of at most ``LANES`` copies, held or one a period.
        periods : int
            How far to look.

        Returns
        -------
        ndarray, shape (periods, m)
            True contraction [m] at the end of each period.
        """
        given = np.asarray(set_points, float)
        plans = np.empty((periods, LANES))
        plans[:, : given.shape[-1]] = given
        plans[:, given.shape[-1] :] = given[..., -1:]
        self._copies.take(self._one)
        return np.asarray(self._copies.run(plans)[POSITION, :, : given.shape[-1]])

    def batch(self, n: int) -> PlantBatch:
        """Return ``n`` copies of the plant, at rest and free of noise."""
        return PlantBatch([self.plant] * n, *self._where)
