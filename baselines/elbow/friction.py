"""The bundles' friction as a nominal hysteresis tells it from the angle.

Friction inside the bundles is driven by their contraction, and so by the angle, which is sensed: a
hysteresis that follows it says by how much the bundles pull more on one way and less on the other.
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
        Nothing lags and nothing is taken if it is none.
    """

    plant: ElbowOrthosis
    hysteresis: Rows

    def initial(self, rows: int) -> HysteresisState:
        """Return the hysteresis of bundles that were never moved."""
        return self.hysteresis.initial(rows)

    def taken(self, view: ElbowView, state: HysteresisState) -> tuple[Shares, HysteresisState]:
        """Return what friction takes of both bundles' shapes [m^2], and the hysteresis after it."""
        travel = self.plant.pulley.travel(view.angle)
        follows, after = self.hysteresis.forward(travel, state)
        return self.plant.friction(travel - follows), after

    def torque(self, view: ElbowView, taken: Shares) -> Array:
        """Return the torque [N m] that friction adds at the pressures as sensed."""
        factor_a, factor_b = self.plant.coefficients(*view.pressure)
        return self.plant.pulley.torque(-factor_a * taken[0], -factor_b * taken[1])


def make_elbow_friction(plant: ElbowOrthosis, known: bool) -> ElbowFriction:
    """Return the friction of a nominal plant, or none if it is not ``known``."""
    return ElbowFriction(plant, operator_of(plant.hysteresis.operator if known else None).rows())
