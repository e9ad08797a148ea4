"""Allocation of torque and stiffness to two pressures: exact solution within limits, torque first.

chakarov2018 finds the pressures by an optimisation. Torque and stiffness are linear in both
pressures, so that two linear equations give them exactly; references out of reach keep the torque
first, and the stiffness as near as possible (:mod:`pam_envs.mechanics`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from baselines.core.controller import Array
from pam_envs.mechanics.allocation import allocate
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis


@dataclass(frozen=True)
class Allocation:
    """The pressures of a nominal orthosis.

    Attributes
    ----------
    plant : ElbowOrthosis
        Nominal plant.
    """

    plant: ElbowOrthosis

    def pressures(
        self,
        angle: Array,
        torque: Array,
        stiffness: Array,
        friction: tuple[Array | float, Array | float] = (0.0, 0.0),
        limits: tuple[Array, Array] | None = None,
    ) -> tuple[Array, Array]:
        """Return the pressures [Pa] of bundles a and b, shape (n_env,).

        Parameters
        ----------
        angle : ndarray, shape (n_env,)
            Of the elbow [rad].
        torque, stiffness : ndarray, shape (n_env,)
            References [N m], [N m/rad].
        friction : tuple of ndarray
            Losses of the shapes of bundles a and b [m^2].
        limits : tuple of ndarray, shapes (2, n_env), optional
            Lowest and highest pressures [Pa] of bundles a and b. Default: the whole range.
        """
        plant, full = self.plant, self.plant.full_pressure
        phi_a, phi_b, psi_a, psi_b = (np.ravel(x) for x in plant.geometry(angle))
        low, high = limits or (np.zeros((2, len(angle))), np.full((2, len(angle)), full))
        shapes = (phi_a - friction[0], phi_b - friction[1], psi_a, psi_b)
        (low_a, low_b), (high_a, high_b) = plant.coefficients(*low), plant.coefficients(*high)
        columns = (torque, stiffness, *shapes, low_a, high_a, low_b, high_b)
        radius = plant.pulley.radius
        found = [
            allocate(q, s, radius, *rest)
            for q, s, *rest in zip(*(x.tolist() for x in columns), strict=True)
        ]
        a, b = plant.pressures_of(*np.array(found).T)
        return np.clip(a, low[0], high[0]), np.clip(b, low[1], high[1])
