"""Pulley between two antagonistic bundles (chakarov2018, Eqs. 8 to 10).

    C_a = r (q_max - q),    C_b = r (q - q_min),    Q = r (P_b - P_a)

Bundle b raises the angle, bundle a lowers it. Each has its nominal length at one end of the
range, where it is longest; beyond, stiff springs represent the mechanical stops.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.kernels.build import kernel
from pam_envs.parameters import assumed, published


@dataclass(frozen=True)
class Pulley:
    """Pulley of the elbow; the angle is its flexion, 0 with the forearm straight."""

    radius: float = published(0.0315, "m", 5e-3, 0.2, "chakarov2018, section 3")
    lowest: float = assumed(0.0, "rad", -1.0, 1.0, "the stroke begins with the forearm straight")
    highest: float = published(math.radians(120.0), "rad", 0.1, 3.0, "chakarov2018, section 3")
    stop_stiffness: float = assumed(300.0, "N m/rad", 10.0, 1e5, "4 degrees of give at 20 N m")

    @property
    def middle(self) -> float:
        """Middle of the range [rad]."""
        return 0.5 * (self.lowest + self.highest)

    @property
    def stroke(self) -> float:
        """Sum of both contractions [m], Eq. (10)."""
        return self.radius * (self.highest - self.lowest)

    def contractions(self, angle: ArrayLike) -> tuple[Array, Array]:
        """Return the contractions [m] of bundles a and b at an angle [rad]."""
        q = np.asarray(angle, float)
        return self.radius * (self.highest - q), self.radius * (q - self.lowest)

    def torque(self, force_a: ArrayLike, force_b: ArrayLike) -> Array:
        """Return the flexing torque [N m] of two forces [N], Eq. (23)."""
        return np.asarray(self.radius * (np.asarray(force_b, float) - np.asarray(force_a, float)))

    def travel(self, angle: ArrayLike) -> Array:
        """Return how far bundle b is contracted [m] beyond the middle of the range."""
        return np.asarray(self.radius * (np.asarray(angle, float) - self.middle))


@kernel
def contraction_of(
    angle: float, sign: float, radius: float, lowest: float, highest: float
) -> float:
    """Return the contraction [m] of bundle a (``sign`` -1) or b (1) at an angle [rad]."""
    if sign < 0.0:
        return radius * (highest - angle)
    return radius * (angle - lowest)


@kernel
def stop_torque(
    angle: float, lowest: float, highest: float, stiffness: float
) -> tuple[float, float]:
    """Return the torque [N m] of the stops and minus its slope [N m/rad]."""
    over, under = max(0.0, angle - highest), max(0.0, lowest - angle)
    return stiffness * (under - over), stiffness if over + under > 0.0 else 0.0
