"""Gravity feedforward: change of the set-points that compensates the weight of links and payload.

From the nominal plant: the torque of the weight at the reference angles, and the set-point at which
the muscles exert that torque there. In a manipulator the torque depends on the angles of all
joints. Reference angles are used instead of sensed ones, which would be a feedback.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from baselines.core.controller import Array

ANGLES, TORQUES = 61, 81
"""Size of the table of shifts."""
LARGEST_TORQUE = 8.0
"""End of the table [N m]; torques are clipped to it."""


@dataclass(frozen=True)
class Gravity:
    """Gravity feedforward, or none.

    Attributes
    ----------
    plant : AntagonisticJoint, RedundantManipulator or None
        Nominal plant; None for no feedforward.
    """

    plant: Any = None

    def shift(self, angles: Array, payload: Array) -> Array:
        """Return the shift [rad] at angles (n_env, n_joints) with payloads [kg], (n_env,)."""
        if self.plant is None:
            return np.zeros_like(angles)
        low, high = self.plant.angle_range
        along = (np.clip(angles, low, high) - low) / (high - low) * (ANGLES - 1)
        torque = np.clip(self._torque(angles, payload), -LARGEST_TORQUE, LARGEST_TORQUE)
        across = (torque / LARGEST_TORQUE + 1.0) * 0.5 * (TORQUES - 1)
        return _between(self._table, along, across)

    def _torque(self, angles: Array, payload: Array) -> Array:
        """Return the torques [N m] that hold links and payload, shape (n_env, n_joints)."""
        if self.plant.stages == 1:
            return np.asarray(self.plant.weight_torque(angles, payload[:, None]), float)
        return np.asarray(self.plant.chain.gravity_torque(angles, payload), float)

    @cached_property
    def _table(self) -> Array:
        """Shifts [rad] by angle and torque."""
        low, high = self.plant.angle_range
        angle = np.linspace(low, high, ANGLES)[:, None]
        torque = np.linspace(-LARGEST_TORQUE, LARGEST_TORQUE, TORQUES)[None, :]
        return self.plant.shift_for(angle, self.plant.prestress, torque, high)


def _between(table: Array, along: Array, across: Array) -> Array:
    """Return a table's values by bilinear interpolation."""
    i = np.minimum(along.astype(int), table.shape[0] - 2)
    j = np.minimum(across.astype(int), table.shape[1] - 2)
    s, t = along - i, across - j
    lower = table[i, j] + s * (table[i + 1, j] - table[i, j])
    upper = table[i, j + 1] + s * (table[i + 1, j + 1] - table[i, j + 1])
    return np.asarray(lower + t * (upper - lower))
