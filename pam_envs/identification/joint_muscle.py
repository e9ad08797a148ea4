"""One muscle of a joint under a constant load, the counterexample of the symmetry test.

The hysteresis of two equal antagonists is symmetric. That of a single muscle is not: its friction
grows with its pressure, and its contraction saturates as it rises.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from pam_envs.arrays import Array
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint

LOWEST, HIGHEST = -0.1, 0.4  # contractions between which a muscle rests


@dataclass(frozen=True)
class HangingMuscle:
    """A muscle of a joint with its hysteresis, which lifts a load [N]."""

    plant: AntagonisticJoint
    load: float = 100.0

    def __post_init__(self) -> None:
        """Refuse a plant that has no muscles with a hysteresis."""
        if self.plant.dynamics != "muscles" or self.plant.hysteresis.operator is None:
            raise ValueError(
                f"dynamics = {self.plant.dynamics!r} with hysteresis "
                f"{self.plant.hysteresis.kind!r} has no muscle with hysteresis; take "
                "AntagonisticJoint.paper() or .measured()"
            )

    def rest_contractions(self, pressures: ArrayLike) -> Array:
        """Return the contractions [1] at rest after pressures [Pa], (T,), from the virgin state."""
        held, operator = self.plant.hysteresis, self.plant.hysteresis.model
        middle = float(self.plant.lever.contraction(0.0, self.plant.muscle.rest_length)[0])
        state, made = operator.initial_state(), []
        for pressure in np.asarray(pressures, float):
            given = (pressure, middle, state)
            x = float(brentq(self._spare, LOWEST, HIGHEST, given, xtol=1e-13))
            state = held.friction(x - middle, pressure, state)[1]
            made.append(x)
        return np.array(made)

    def _spare(self, x: float, pressure: float, middle: float, state: Any) -> float:
        """Return the force of the muscle in excess of its load [N]."""
        friction, _ = self.plant.hysteresis.friction(x - middle, pressure, state)
        return float(self.plant.muscle.law(pressure, x)) - float(friction) - self.load
