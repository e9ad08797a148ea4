"""Replay of a recording by the single muscle, many parameter sets side by side.

The step is the sampling period of the recording, load and temperature change with time, the valve
may be shut, the muscle may restart, and the outputs are the readings of the sensors at the
beginning of each period.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pam_envs.arrays import Array
from pam_envs.muscle.effective_area import MAP_SIZES
from pam_envs.plants.core.rollout import BEGIN, REZERO, drives_of, run
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.rollout import loop_of

CHANNELS = ("contraction", "pressure")
LONGEST_STEP = 0.0201
"""Longest sub-step [s] of a replay: errors of some micrometres, below the noise of a sensor."""


@dataclass(frozen=True)
class Inputs:
    """Inputs of a plant, sample by sample.

    Attributes
    ----------
    period : float
        Sampling period [s].
    command : ndarray, shape (n,)
        Setpoint [Pa] from this sample to the next; below zero: the valve is shut.
    load : ndarray, shape (n,)
        Load [kg].
    kelvin : ndarray, shape (n,)
        Temperature [K].
    fresh : ndarray of bool, shape (n,)
        Samples at which the muscle restarts from rest, including the first.
    start_pressure : ndarray, shape (n,)
        Pressure [Pa] at which it starts there.
    rezeroed : ndarray of bool, shape (n,)
        Samples at which the position sensor was zeroed again, at rest without pressure.
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
    def drives(self) -> Array:
        """The channels that drive a muscle, shape (5, n, 1)."""
        held = np.maximum(0.0, self.command)
        return drives_of([self.command, self.load, self.kelvin, self.start_pressure, held])

    @property
    def flags(self) -> NDArray[np.int64]:
        """Flags of the samples: restart, or zero the sensor."""
        return np.where(self.fresh, BEGIN, np.where(self.rezeroed, REZERO, 0)).astype(np.int64)


TILE = 16
"""Plants that a tile advances together: fewer than in a batch, since few are replayed at a time."""
COSTLY = (
    (
        "regulator.slew_bend",
        "regulator.slew_ratio",
        "regulator.dead_band",
        "regulator.overlap",
        "regulator.exhaust_ratio",
        "regulator.exhaust_rate",
        "regulator.leak",
        "regulator.supply_pressure",
        "regulator.pilot_lag",
        "regulator.rate_lag",
        "regulator.speed_2",
        "regulator.speed_6",
        "regulator.speed_20",
        "regulator.speed_60",
        "regulator.integral",
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
    ("hysteresis.yield_width",),
    ("muscle.yield_force",),
    tuple(f"muscle.{name}" for name in MAP_SIZES),
    ("muscle.viscosity_per_pressure",),
    ("mass.stick", "muscle.viscosity", "muscle.viscosity_relaxing"),
)
"""Parameters of the effects that a tile works out only where one of them is on."""


@lru_cache(maxsize=1)
def _places() -> list[tuple[list[int], Array]]:
    return [
        ([R.place(n) for n in names], np.array([SingleMuscle.neutral.get(n, 0.0) for n in names]))
        for names in COSTLY
    ]


def replay_rows(plant: SingleMuscle, columns: Array, inputs: Inputs) -> Array:
    """Replay a recording of T samples with many parameter sets of one kind of plant.

    ``columns``, shape (n, n_parameters), are as of :meth:`SingleMuscle.parameter_rows`; the plant
    gives hysteresis kind and Everett map.

    Returns
    -------
    array, shape (2, T, n)
        Contraction [m] and pressure [Pa] as the sensors would show them, free of noise.
    """
    loop = loop_of(plant, True, readings=True)
    substeps = max(1, int(np.ceil(inputs.period / inputs.longest_step)))
    outputs = np.empty((len(columns), len(CHANNELS), len(inputs.command)))
    for chosen in alike(columns):
        made = run(
            loop, plant, columns[chosen], inputs.drives, flags=inputs.flags, substeps=substeps,
            period=inputs.period, before=True, lanes=TILE, parallel=True,
        )  # fmt: skip
        outputs[chosen] = made[: len(CHANNELS)].transpose(2, 0, 1)
    return outputs.transpose(1, 2, 0)  # plants apart in memory: residuals are read one by one


def alike(columns: Array) -> list[NDArray[np.int64]]:
    """Return groups of columns to replay together, in order.

    A tile computes for all its lanes what one of them needs. Columns with the same effects are
    therefore grouped, and those with finer steps form a group of their own.
    """
    active = np.array([(columns[:, at] != off).any(axis=1) for at, off in _places()])
    order = np.lexsort(active[:-1])
    fine = active[-1][order]
    return [group for group in (order[~fine], order[fine]) if len(group)]


def replay(plant: SingleMuscle, inputs: Inputs) -> dict[str, Array]:
    """Replay a recording with one plant; see :func:`replay_rows`."""
    outputs = replay_rows(plant, plant.parameter_rows()[None, :], inputs)
    return {name: outputs[i, :, 0] for i, name in enumerate(CHANNELS)}
