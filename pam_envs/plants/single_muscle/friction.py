"""Friction driven by length as a hysteresis from pressure to effective pressure, at one load.

At rest under a constant load the friction elements act like a pressure that is missing: the
effective pressure is the one at which the law without friction has the same contraction. So that
controllers, figures and linear models that invert a hysteresis of the pressure serve both drives.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.constants import GRAVITY
from pam_envs.hysteresis.protocol import HysteresisModel
from pam_envs.hysteresis.slip import SlipModel

if TYPE_CHECKING:
    from pam_envs.plants.single_muscle.plant import SingleMuscle

Array = NDArray[np.float64]

LOWEST, HIGHEST = -0.3, 0.6
"""Strains between which a rest is looked for."""
BISECTIONS = 56
REPEATS = 12
"""Fixed-point steps for the limit's dependence on pressure; each gains about two digits."""


@dataclass(frozen=True)
class LoadedFriction(HysteresisModel):
    """Friction of a muscle at rest under a load [kg]: pressures in, effective pressures out [Pa].

    The state holds the sliders' strains, shape (..., n).
    """

    plant: SingleMuscle
    load: float

    @cached_property
    def _model(self) -> SlipModel:
        model = self.plant.hysteresis.operator
        assert isinstance(model, SlipModel)
        return model

    def _strain(self, shape: tuple[int, ...], pulls: Callable[[Array], Array]) -> Array:
        """Return the strains at which forces [N] that fall with strain carry the load."""
        low, high = np.full(shape, LOWEST), np.full(shape, HIGHEST)
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            up = pulls(middle) > self.load * GRAVITY
            low, high = np.where(up, middle, low), np.where(up, high, middle)
        return np.asarray(0.5 * (low + high))

    def _friction(self, strain: Array, pressure: Array, state: ArrayLike) -> tuple[Array, Array]:
        """Return the friction [N] and the state after motion straight to a strain."""
        held = self.plant.hysteresis
        lag, after = self._model.lag(strain, state, held.limit(pressure, self.load))
        return held.friction * lag, after

    def initial_state(self, batch_shape: tuple[int, ...] = ()) -> Array:
        """Return the sliders at the strain of rest without pressure, free of force."""
        rest = self._strain((), lambda e: self.plant.muscle.tension(0.0, e))
        return np.full((*batch_shape, self._model.elements), float(rest))

    def step(self, x: ArrayLike, state: Any) -> tuple[Array, Array]:
        """Return the effective pressures at pressures, shape (...), and the state after."""
        p, muscle = np.asarray(x, float), self.plant.muscle
        shape = np.broadcast_shapes(p.shape, np.shape(state)[:-1])
        strain = self._strain(
            shape, lambda e: muscle.tension(p, e) - self._friction(e, p, state)[0]
        )
        return muscle.drive(self.load * GRAVITY, strain), self._friction(strain, p, state)[1]

    def inverse_step(self, y: ArrayLike, state: Any) -> tuple[Array, Array]:
        """Return the pressures that give effective pressures, and the state after."""
        drive, muscle = np.asarray(y, float), self.plant.muscle
        shape = np.broadcast_shapes(drive.shape, np.shape(state)[:-1])
        strain = self._strain(shape, lambda e: muscle.tension(drive, e))
        pressure = np.broadcast_to(drive, shape)
        for _ in range(REPEATS):
            friction, after = self._friction(strain, pressure, state)
            pressure = drive + friction / muscle.area_at(strain)
        return np.asarray(pressure), after
