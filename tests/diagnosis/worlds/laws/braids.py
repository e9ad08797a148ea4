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


@njit(cache=True)
def _ogden_slope(q: np.ndarray, x: float, outer2: float, slope: float, ratio: float) -> float:
    """Slope of the two-term Ogden energy over the axial stretch, at one radius of the wall.

    `ratio` is the squared outer radius over that of the point, both unloaded.
    """
    hoop = math.sqrt(max(ratio * outer2 - (ratio - 1.0) / x, 0.05))
    bend = (ratio * slope + (ratio - 1.0) / x**2) / (2.0 * hoop)
    total = 0.0
    for i in range(2):
        power = q[4 + i]
        term = x ** (power - 1.0) + hoop ** (power - 1.0) * bend
        term -= (x * hoop) ** (-power - 1.0) * (hoop + x * bend)
        total += q[2 + i] * term
    return total


@njit(cache=True)
def ogden_force(q: np.ndarray, pressure: float, strain: float) -> float:
    """Gas in a braid around a thick wall of Ogden rubber, whose inside strains most."""
    cos2 = q[1]
    sin2 = 1.0 - cos2
    x = max(1.0 - q[8] * strain, 0.5)
    gas = q[0] * pressure * (3.0 * cos2 * x * x - 1.0) / sin2
    outer2 = max((1.0 - x * x * cos2) / sin2, 0.05)
    slope = -2.0 * x * cos2 / sin2
    wall = _ogden_slope(q, x, outer2, slope, q[6]) + _ogden_slope(q, x, outer2, slope, q[7])
    return gas + 0.5 * wall + lock(strain, q[9], q[10])


@njit(cache=True)
def chain_force(q: np.ndarray, pressure: float, strain: float) -> float:
    """Three lengths of braid in series: other angles, areas and rubber, the same force.

    The constants of each are gas, squared-stretch factor, rubber and share of the length. Newton
    steps find the force at which the contractions add up.
    """
    p = max(pressure, -1.0)
    x2 = (1.0 - strain) ** 2
    total = 0.0
    for i in range(0, 12, 4):
        gas, factor = q[i] * p, q[i + 1]
        total += q[i + 3] * (gas * (factor * x2 - factor / 3.0 - 1.0) + q[i + 2] * (x2 - 1.0))
    for _ in range(6):
        error, slope = -strain, 0.0
        for i in range(0, 12, 4):
            steep = q[i] * p * q[i + 1] + q[i + 2]
            square = (total + q[i] * p * (q[i + 1] / 3.0 + 1.0) + q[i + 2]) / steep
            root = math.sqrt(max(square, 0.04))
            stretch = root + (square - root * root) / (2.0 * root)
            error += q[i + 3] * (1.0 - stretch)
            slope -= q[i + 3] / (2.0 * root * steep)
        total -= error / slope
    return total + lock(strain, q[12], q[13])


@njit(cache=True)
def _barrel_sums(q: np.ndarray, radius: float, out: np.ndarray) -> None:
    """Integrate along half a barrel: mean cosine, its slope over the radius, and the volume's.

    Radii are relative to the largest that the threads allow; `radius` is that of the middle.
    """
    ends = math.sqrt(1.0 - q[1])
    out[0] = out[1] = out[2] = 0.0
    for i in range(8):
        rest = max(1.0 - (i + 0.5) / 8.0 / q[2], 0.0)
        grown = 1.0 - rest * rest
        r = ends + (radius - ends) * grown
        cosine = math.sqrt(max(1.0 - r * r, 0.02))
        out[0] += cosine / 8.0
        out[1] -= r * grown / cosine / 8.0
        out[2] += (2.0 * cosine - r * r / cosine) * r * grown / 8.0


@njit(cache=True)
def barrel_force(q: np.ndarray, pressure: float, strain: float, work: np.ndarray) -> float:
    """Virtual work of a short barrel: each ring between the clamped ends has its own angle."""
    cosine, ends = math.sqrt(q[1]), math.sqrt(1.0 - q[1])
    aim = (1.0 - strain) * cosine
    sums = work[0]
    radius = math.sqrt(max(1.0 - aim * aim, 0.01))
    for _ in range(8):
        _barrel_sums(q, radius, sums)
        radius = min(max(radius - (sums[0] - aim) / sums[1], 0.1), 0.95)
    _barrel_sums(q, radius, sums)
    gas = -q[0] * pressure / (1.0 - q[1]) * sums[2] / sums[1]
    hoop = radius / ends - 1.0
    wall = q[3] * hoop * (1.0 + q[4] * hoop * hoop) * cosine / (ends * sums[1])
    return gas + wall + lock(strain, q[5], q[6])
