"""Nominal elbow orthosis: friction of the bundles, and pressures for torque and stiffness.

Friction inside the bundles depends on their contraction, and thus on the sensed angle. A nominal
hysteresis of the angle gives the additional pull in one direction and the loss in the other.

chakarov2018 finds the pressures by an optimisation. Torque and stiffness are linear in both
pressures, so that two linear equations give them exactly. For references out of reach the torque
has priority, and the stiffness is as near as possible (:mod:`pam_envs.mechanics`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from baselines.core.controller import Array
from baselines.elbow.view import ElbowView
from pam_envs.hysteresis.protocol import Rows, RowsState, operator_of
from pam_envs.mechanics.allocation import allocate
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis

Shares = tuple[Array, Array]


@dataclass(frozen=True)
class ElbowFriction:
    """Friction of a nominal orthosis."""

    plant: ElbowOrthosis
    hysteresis: Rows

    def losses(self, view: ElbowView, state: RowsState) -> tuple[Shares, RowsState]:
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


def pressures_for(
    plant: ElbowOrthosis,
    angle: Array,
    torque: Array,
    stiffness: Array,
    friction: tuple[Array | float, Array | float] = (0.0, 0.0),
    limits: tuple[Array, Array] | None = None,
) -> tuple[Array, Array]:
    """Return the pressures [Pa] of bundles a and b of a nominal orthosis, shape (n_env,).

    References and angle are in SI; ``losses`` are the friction losses of the bundles' shapes [m^2].
    The limits are the lowest and highest pressures [Pa], shapes (2, n_env); default: the whole
    range.
    """
    full = plant.full_pressure
    phi_a, phi_b, psi_a, psi_b = (np.ravel(x) for x in plant.geometry(angle))
    low, high = limits or (np.zeros((2, len(angle))), np.full((2, len(angle)), full))
    shapes = (phi_a - friction[0], phi_b - friction[1], psi_a, psi_b)
    (low_a, low_b), (high_a, high_b) = plant.coefficients(*low), plant.coefficients(*high)
    columns = (torque, stiffness, *shapes, low_a, high_a, low_b, high_b)
    found = [
        allocate(q, s, plant.pulley.radius, *rest)
        for q, s, *rest in zip(*(x.tolist() for x in columns), strict=True)
    ]
    a, b = plant.pressures_of(*np.array(found).T)
    return np.clip(a, low[0], high[0]), np.clip(b, low[1], high[1])
