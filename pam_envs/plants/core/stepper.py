"""Single muscles stepped setpoint by setpoint, with copies that predict.

The step is that of a replay: the extended plant, one sub-step a period. Plants start at rest,
without pressure and in the virgin state.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.kernels.build import LANES
from pam_envs.plants.core.rollout import BEGIN, call, drives_of, in_tiles
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.rollout import loop_of

PERIOD = 0.01
"""Control period [s] unless another is given."""
LONGEST_PERIOD = 0.0101
"""Longest one [s]: it is one sub-step, whose errors stay below the noise of a good sensor."""
READING, PRESSURE, POSITION = range(3)


class PlantBatch:
    """Plants with one kind of hysteresis side by side, each with setpoints of its own.

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
                f"{LONGEST_PERIOD:g} s: hold a setpoint for several of them"
            )
        kinds = {(plant.hysteresis.kind, plant.elements) for plant in plants}
        if len(kinds) != 1:
            raise ValueError(f"plants that are stepped together need one hysteresis, got {kinds}")
        self.plants = tuple(plants)
        self.period = period
        columns = np.array([plant.parameter_rows() for plant in plants])
        if kelvin is not None:
            columns[:, R.place("muscle.temperature")] = kelvin
        self._kelvin = columns[:, R.place("muscle.temperature")]
        self._fixed = in_tiles(columns, len(plants), LANES)
        self._load = load_kg
        self._table = plants[0].hysteresis_tables()[:1]
        self._loop = loop_of(plants[0], True, readings=True)
        self.reset()

    def __len__(self) -> int:
        """Return the number of plants."""
        return len(self.plants)

    def reset(self) -> None:
        """Bring every plant to rest without pressure."""
        self._state = self._loop.state(len(self._fixed), LANES)
        self._periods = 0
        self.position = np.zeros(len(self))

    def run(self, set_points: ArrayLike) -> Array:
        """Advance every plant through the control periods of setpoints [Pa], shape (T, n).

        Returns contraction [m] and pressure [Pa] as the sensors show them, free of noise, and the
        true contraction [m], each at the end of its period: shape (3, T, n).
        """
        given = np.asarray(set_points, np.float64)
        outputs = np.empty((3, *given.shape))
        drives = drives_of([given, self._load, self._kelvin[None], 0.0, 0.0])
        flags = np.zeros(len(given), np.int64)
        flags[0] = BEGIN if self._periods == 0 else 0
        call(
            self._loop, self.plants[0], self._state, self._fixed, drives, flags, outputs, 1,
            self.period, table=self._table, begun=self._periods,
        )  # fmt: skip
        self._periods += len(given)
        self.position = outputs[POSITION, -1]
        return outputs

    def step(self, set_points: ArrayLike) -> tuple[Array, Array]:
        """Advance every plant by one period; return contractions [m] and pressures [Pa] read."""
        seen = self.run(np.asarray(set_points, float)[None, :])
        return seen[READING, 0], seen[PRESSURE, 0]

    def take(self, other: PlantBatch) -> None:
        """Put every plant of this tile into the state of the first of another batch."""
        for mine, its in zip(self._state, other._state, strict=True):
            mine[:] = its[0, :, :1]
        self._periods = other._periods


class PlantStepper:
    """One plant, stepped setpoint by setpoint, with copies that predict.

    Parameters as of :class:`PlantBatch`; ``noise_seed`` is that of the sensors' noise, without
    which they are free of noise and steps. ``position`` is the true contraction [m],
    ``max_pressure`` the largest setpoint [Pa], ``noise`` the RMS noise [m] of the position sensor.
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
        """Hold a setpoint [Pa] for one period; return contraction [m] and pressure [Pa] read."""
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
        """Return the positions [m] predicted by copies of the plant, which itself does not move.

        ``set_points`` [Pa] are of at most ``LANES`` copies, held, shape (m,), or one a period,
        (periods, m); the true contraction at the end of each period has the shape (periods, m).
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
