"""Functions that several static laws share."""

import math

import numpy as np
from numba import njit


@njit(cache=True)
def lock(strain: float, stiffness: float, width: float) -> float:
    """Force of braid and tube [N]: stiff below zero strain, saturating above."""
    y = -strain / width
    soft = y if y > 30.0 else math.log1p(math.exp(y))
    return stiffness * width * (soft - 0.6931471805599453)


@njit(cache=True)
def signed_power(value: float, exponent: float) -> float:
    """Odd power of a number of either sign."""
    return math.copysign(abs(value) ** exponent, value)


@njit(cache=True)
def softplus(value: float, width: float) -> float:
    """Positive part of a number, rounded over a width."""
    y = value / width
    return value if y > 30.0 else width * math.log1p(math.exp(y))


@njit(cache=True)
def curve(q: np.ndarray, at: int, count: int, step: float, strain: float) -> float:
    """Cubic B-spline of `count` knots from place `at` on, straight beyond -0.02 and 0.22."""
    b = (strain + 0.02) / step
    inside = min(max(b, 0.0), count - 3.0 - 1e-9)
    i = int(inside)
    u = inside - i
    a0, a1, a2, a3 = q[at + i], q[at + i + 1], q[at + i + 2], q[at + i + 3]
    value = (1.0 - u) ** 3 * a0 + (3.0 * u**3 - 6.0 * u**2 + 4.0) * a1
    value += (-3.0 * u**3 + 3.0 * u**2 + 3.0 * u + 1.0) * a2 + u**3 * a3
    slope = (2.0 * u - u * u - 1.0) * a0 + (3.0 * u * u - 4.0 * u) * a1
    slope += (1.0 + 2.0 * u - 3.0 * u * u) * a2 + u * u * a3
    return value / 6.0 + 0.5 * slope * (b - inside)
