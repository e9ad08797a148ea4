"""Static laws of the geometry of braid and tube, and of their energy."""

import math

import numpy as np
from numba import njit

from .elements import lock, softplus


@njit(cache=True)
def bundle_force(q: np.ndarray, pressure: float, strain: float) -> float:
    """Eight strands of unequal slack, none of which can push."""
    share = pressure / 6.0
    total = 0.0
    for i in range(8):
        r = (strain + q[8 + i]) / q[1]
        active = share * max(1.0 - r, 0.0) ** q[2]
        y = (active - q[3] * (1.0 - math.exp(-6.0 * r))) / q[6]
        total += q[6] * (y if y > 30.0 else math.log1p(math.exp(y)))
    return q[0] * total / 8.0 + lock(strain, q[4], q[5])


@njit(cache=True)
def braid_force(q: np.ndarray, pressure: float, strain: float) -> float:
    """Braid angle with end effect, and a neo-Hookean bladder that follows the braid."""
    cos2 = q[1]
    sin2 = 1.0 - cos2
    ends = 1.0 + q[2] * math.exp(-max(pressure, 0.0) / q[3])
    stretch = 1.0 - ends * strain
    gas = q[0] * pressure * (3.0 * cos2 * stretch**2 - 1.0) / sin2
    x = max(1.0 - strain, 0.5)
    radius2 = max((1.0 - x * x * cos2) / sin2, 0.05)
    slope = -2.0 * x * cos2 / sin2
    bladder = 2.0 * x + slope
    bladder -= (2.0 * x * radius2 + x * x * slope) / (x * x * radius2) ** 2
    return gas + 0.5 * q[4] * bladder + lock(strain, q[5], q[6])


@njit(cache=True)
def locking_force(q: np.ndarray, pressure: float, strain: float) -> float:
    """Straight lines in strain with a kink where the strands of the braid touch."""
    free = q[0] * pressure * (1.0 - strain / q[1]) - q[2] * strain
    jam = q[4] * (1.0 + q[5] * max(pressure, 0.0) / 6.0)
    return free - jam * softplus(strain - q[3], q[6]) + lock(strain, q[7], q[8])


@njit(cache=True)
def rubber_force(q: np.ndarray, pressure: float, strain: float) -> float:
    """Energy of the gas, of a Mooney-Rivlin bladder and of threads that stretch with pressure."""
    cos2 = q[1]
    sin2 = 1.0 - cos2
    thread = 1.0 + max(pressure, -2.0) / q[4]
    x = max(1.0 - q[5] * strain, 0.5)  # axial stretch between the fittings
    gas = q[0] * pressure * (3.0 * cos2 * x * x - thread * thread) / sin2
    ring = max((thread * thread - x * x * cos2) / sin2, 0.05)  # squared hoop stretch
    slope = -2.0 * x * cos2 / sin2
    wall = 2.0 * x * ring + x * x * slope
    first = 2.0 * x + slope - wall / (x * x * ring) ** 2
    second = wall - 2.0 / x**3 - slope / ring**2
    return gas + q[2] * first + q[3] * second + lock(strain, q[6], q[7])


@njit(cache=True)
def capped_force(q: np.ndarray, pressure: float, strain: float) -> float:
    """Cylinder whose ends round off while it contracts, and a bladder slack at low pressure."""
    taut = pressure * abs(pressure) / (abs(pressure) + q[4])
    share = 1.0 - q[2] * (1.0 - math.exp(-max(strain, -0.1) / q[3]))
    x = 1.0 - strain / (q[1] * share)
    active = q[0] * taut * (0.62 * x + 0.38 * x * abs(x)) * share
    return active - q[5] * strain - q[6] * strain**3 + lock(strain, q[7], q[8])
