"""Replay of a recording, and single steps, for every plant: the readings of its sensors.

The module ``rollout`` beside a plant declares its inputs (``channels_of``), its sensors
(``readings_of``) and its loop (``loop_of``).
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.plants.core.plant import Plant
from pam_envs.plants.core.rollout import BEGIN, call, drives_of, run


def drives_for(plant: Plant, channels: Mapping[str, ArrayLike]) -> Array:
    """Return the given channels and the defaults of the others, shape (channels, T, 1)."""
    defaults = plant.module("rollout").channels_of(plant)
    unknown = set(channels) - set(defaults)
    if unknown:
        raise ValueError(
            f"{min(unknown)!r} is not an input of the plant {plant.family}; the inputs are: "
            + ", ".join(defaults)
        )
    return drives_of([channels.get(name, usual) for name, usual in defaults.items()])


def replay_plant(
    plant: Plant,
    channels: Mapping[str, ArrayLike],
    *,
    period: float | None = None,
    substeps: int | None = None,
    fresh: ArrayLike = (0,),
) -> dict[str, Array]:
    """Replay recorded inputs of a plant, plain or with effects.

    Parameters
    ----------
    plant : Plant
    channels : mapping
        Inputs, by the names of the family's ``channels_of``: each a number or shape (T,).
    period, substeps : float, int, optional
        Sampling period [s] and sub-steps of the integrator in it; default: the plant's.
    fresh : array_like of int
        Samples at which the plant restarts.

    Returns
    -------
    dict
        Reading of each sensor at the beginning of each period, shape (T,), without noise and
        quantisation.

    Raises
    ------
    ValueError
        If a channel is unknown.
    """
    family, drives = plant.module("rollout"), drives_for(plant, channels)
    flags = np.zeros(drives.shape[1], np.int64)
    flags[np.asarray(fresh, int)] = BEGIN
    made = run(
        family.loop_of(plant, True, readings=True), plant, plant.parameter_rows()[None], drives,
        flags=flags, substeps=substeps, period=period, before=True, lanes=1,
    )  # fmt: skip
    return {name: made[k, :, 0] for k, name in enumerate(family.readings_of(plant))}


class Stepper:
    """Any plant, plain or with effects, stepped one control period at a time."""

    def __init__(self, plant: Plant) -> None:
        self.plant = plant
        family = plant.module("rollout")
        self._names = tuple(family.readings_of(plant))
        self._loop = family.loop_of(plant, True, readings=True)
        self._fixed = plant.parameter_rows()[None, :, None]
        self._table = plant.hysteresis_tables()[:1]
        self.reset()

    def reset(self) -> None:
        """Restart: the next step begins from rest under its inputs."""
        self._state, self._periods = self._loop.state(1, 1), 0

    def step(self, **channels: float) -> dict[str, float]:
        """Hold the given channels for one period; return each sensor's undisturbed reading."""
        outputs = np.empty((len(self._loop.outputs), 1, 1))
        flags = np.array([BEGIN if self._periods == 0 else 0])
        call(
            self._loop, self.plant, self._state, self._fixed, drives_for(self.plant, channels),
            flags, outputs, table=self._table, begun=self._periods,
        )  # fmt: skip
        self._periods += 1
        return {name: float(outputs[k, 0, 0]) for k, name in enumerate(self._names)}
