"""Friction of the bundles from the sensed angle by a nominal hysteresis.

Friction inside the bundles is driven by their contraction, and so by the angle: a hysteresis driven
by it gives the additional pull in one direction and the loss in the other.
"""

from __future__ import annotations

from dataclasses import dataclass

from baselines.core.controller import Array
from baselines.elbow.view import ElbowView
from baselines.positioning.nominal import HysteresisState
from pam_envs.hysteresis.protocol import Rows, operator_of
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis

Shares = tuple[Array, Array]


@dataclass(frozen=True)
class ElbowFriction:
    """Friction of a nominal orthosis.

    Attributes
    ----------
    plant : ElbowOrthosis
    hysteresis : Rows
        :class:`NoHysteresis` for no friction.
    """

    plant: ElbowOrthosis
    hysteresis: Rows

    def initial(self, rows: int) -> HysteresisState:
        """Return the hysteresis state of bundles that never moved."""
        return self.hysteresis.initial(rows)

    def losses(self, view: ElbowView, state: HysteresisState) -> tuple[Shares, HysteresisState]:
        """Return the losses of both bundles' shapes [m^2], and the next hysteresis state."""
        travel = self.plant.pulley.travel(view.angle)
        follows, after = self.hysteresis.forward(travel, state)
        return self.plant.friction(travel - follows), after

    def torque(self, view: ElbowView, losses: Shares) -> Array:
        """Return the torque [N m] of friction at the sensed pressures."""
        factor_a, factor_b = self.plant.coefficients(*view.pressure)
        return self.plant.pulley.torque(-factor_a * losses[0], -factor_b * losses[1])


def make_elbow_friction(plant: ElbowOrthosis, known: bool) -> ElbowFriction:
    """Return the friction of a nominal plant, or none if it is not ``known``."""
    return ElbowFriction(plant, operator_of(plant.hysteresis.operator if known else None).rows())
