"""Lever between two antagonistic muscles: lengths and lever arms (fluidic_muscles, Eq. 1.1).

    L_A = | (r_u, l_u) + R(phi) (-r_o, l_o) |,    L_B = | (-r_u, l_u) + R(phi) (r_o, l_o) |

less the fittings. A positive angle bends towards muscle A, which shortens. By virtual work

    torque = -F_A dL_A/dphi - F_B dL_B/dphi

With ``r_u = r_o = r`` and ``l_u = l_o = l`` the lengths are
``2 (l cos(phi/2) -+ r sin(phi/2))``. Their sum is not constant: both muscles shorten as the joint
bends, so that equal forces push it further out.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.kernels.build import kernel
from pam_envs.parameters import assumed, derived

_SIZE = "with it +-30 degrees take 0 to 25 % of a muscle of 150 mm (fluidic_muscles, section 2)"
SIDES = (1.0, -1.0)
"""Of muscle A and of muscle B."""


@dataclass(frozen=True)
class AntagonisticLever:
    """Fixing points of the muscles of one stage; ``u`` is the lower plate, ``o`` the upper one."""

    r_u: float = derived(0.0362, "m", 0.005, 0.5, _SIZE)
    r_o: float = derived(0.0362, "m", 0.005, 0.5, _SIZE)
    l_u: float = assumed(0.1, "m", 0.02, 1.0, _SIZE)
    l_o: float = assumed(0.1, "m", 0.02, 1.0, _SIZE)
    fittings: float = derived(0.0619, "m", 0.0, 0.5, _SIZE)

    def length(self, angle: ArrayLike) -> Array:
        """Return the lengths of both muscles [m] at angles (...) [rad], shape (..., 2)."""
        return self._spans(angle)[0] - self.fittings

    def rate(self, angle: ArrayLike) -> Array:
        """Return ``dL/dphi`` [m] of both muscles, shape (..., 2)."""
        return self._spans(angle)[1]

    def curve(self, angle: ArrayLike) -> Array:
        """Return the second derivative of the lengths by the angle [m], shape (..., 2)."""
        return self._spans(angle)[2]

    def contraction(self, angle: ArrayLike, rest_length: float) -> Array:
        """Return the contractions of muscles of a rest length [m], shape (..., 2)."""
        return 1.0 - self.length(angle) / rest_length

    @property
    def toggle(self) -> float:
        """The angle [rad] at which the stretched muscle loses its lever arm."""
        _, even, odd = self._squares()
        return math.atan2(odd, even)

    def _squares(self) -> tuple[float, float, float]:
        return squares(self.r_u, self.r_o, self.l_u, self.l_o)

    def _spans(self, angle: ArrayLike) -> tuple[Array, Array, Array]:
        phi = np.asarray(angle, float)[..., None]
        total, even, odd = self._squares()
        side = np.array(SIDES)
        sine, cosine = np.sin(phi), np.cos(phi)
        span = np.sqrt(total + 2.0 * (even * cosine - side * odd * sine))
        rate = -(even * sine + side * odd * cosine) / span
        curve = (-even * cosine + side * odd * sine - rate * rate) / span
        return span, rate, curve


@kernel
def squares(r_u: float, r_o: float, l_u: float, l_o: float) -> tuple[float, float, float]:
    """Return ``a, b, c`` of the squared distance ``a + 2 (b cos(phi) -+ c sin(phi))`` [m2]."""
    total = r_u * r_u + l_u * l_u + r_o * r_o + l_o * l_o
    return total, l_u * l_o - r_u * r_o, r_u * l_o + l_u * r_o


@kernel
def span(
    sine: float, cosine: float, side: float, total: float, even: float, odd: float
) -> tuple[float, float, float]:
    """Return the distance [m] between the ends of a muscle and its two derivatives by the angle.

    ``side`` is 1 for muscle A and -1 for muscle B; the rest is the result of :func:`squares`.
    """
    length = math.sqrt(total + 2.0 * (even * cosine - side * odd * sine))
    per_length = 1.0 / length
    rate = -(even * sine + side * odd * cosine) * per_length
    return length, rate, (side * odd * sine - even * cosine - rate * rate) * per_length
