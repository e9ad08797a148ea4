"""Static laws fitted to measured forces or contractions."""

import math

import numpy as np
from numba import njit

from .elements import lock, signed_power, softplus

MAP_SHAPE = (14, 16)
"""Knots of a drawn map over pressure and strain."""
MAP_PRESSURE = (-1.2, 0.75)
"""First knot and spacing of the pressure axis [bar]."""
MAP_STRAIN = (-0.11, 0.033)
"""First knot and spacing of the strain axis [-]."""


@njit(cache=True)
def _spline(u: float, out: np.ndarray) -> None:
    out[0] = (1.0 - u) ** 3 / 6.0
    out[1] = (3.0 * u**3 - 6.0 * u**2 + 4.0) / 6.0
    out[2] = (-3.0 * u**3 + 3.0 * u**2 + 3.0 * u + 1.0) / 6.0
    out[3] = u**3 / 6.0


@njit(cache=True)
def map_force(table: np.ndarray, pressure: float, strain: float, work: np.ndarray) -> float:
    """Cubic B-spline surface, continued linearly in strain beyond its edges."""
    a = (pressure - MAP_PRESSURE[0]) / MAP_PRESSURE[1] - 1.0
    b = (strain - MAP_STRAIN[0]) / MAP_STRAIN[1] - 1.0
    last_a, last_b = table.shape[0] - 3.0 - 1e-9, table.shape[1] - 3.0 - 1e-9
    a = min(max(a, 0.0), last_a)
    inside = min(max(b, 0.0), last_b)
    i, j = int(a), int(inside)
    _spline(a - i, work[0])
    _spline(inside - j, work[1])
    total = 0.0
    for m in range(4):
        for n in range(4):
            total += work[0, m] * work[1, n] * table[i + m, j + n]
    beyond = (b - inside) * MAP_STRAIN[1]
    return total - 1500.0 * beyond


@njit(cache=True)
def tangent_force(q: np.ndarray, pressure: float, strain: float, load: float) -> float:
    """Tangent law of the pressure needed, solved for the force about the load."""
    room = max(q[4] - q[5] * load, 0.05)
    angle = q[2] * (strain / room - q[3])
    bent = min(max(angle, -1.25), 1.3)
    tangent = math.tan(bent)
    steep = 1.0 + tangent * tangent
    needed = q[0] + q[1] * (tangent + steep * (angle - bent)) + q[6] * load
    slope = q[6] + q[1] * steep * q[2] * max(strain, 0.0) * q[5] / room**2
    return load + (pressure - needed) / slope


@njit(cache=True)
def logistic_force(q: np.ndarray, pressure: float, strain: float, load: float) -> float:
    """Stiffness about a strain that is an S-curve of pressure, shifted by the load."""
    y = (pressure - q[1] - q[3] * load) / q[2]
    rest = 1.0 / (1.0 + math.exp(q[1] / q[2]))
    aim = q[0] * (1.0 / (1.0 + math.exp(-y)) - rest) - q[6] * load
    return load + (q[4] + q[5] * max(pressure, 0.0)) * (aim - strain)


@njit(cache=True)
def hyperbolic_force(q: np.ndarray, pressure: float, strain: float) -> float:
    """Hyperbola of force and contraction, in series with an elastic tendon."""
    reach = q[0] * q[1] + q[2] * signed_power(pressure, q[3])
    b = strain + q[1] + q[0] * q[4]
    root = max(b * b - 4.0 * q[4] * (q[0] * (strain + q[1]) - reach), 0.0)
    return (math.sqrt(root) - b) / (2.0 * q[4]) + lock(strain, q[5], q[6])


@njit(cache=True)
def table_force(q: np.ndarray, table: np.ndarray, pressure: float, strain: float) -> float:
    """Measured table: straight between its uneven knots, and on beyond its edges.

    The first row of `table` holds the strains, the first column the pressures; `q` begins with
    stiffness and width of the stop at zero strain, and with the numbers of pressures and strains.
    """
    i, j = 1, 1
    while i < int(q[2]) - 1 and pressure > table[i + 1, 0]:
        i += 1
    while j < int(q[3]) - 1 and strain > table[0, j + 1]:
        j += 1
    a = (pressure - table[i, 0]) / (table[i + 1, 0] - table[i, 0])
    b = (strain - table[0, j]) / (table[0, j + 1] - table[0, j])
    low = (1.0 - b) * table[i, j] + b * table[i, j + 1]
    high = (1.0 - b) * table[i + 1, j] + b * table[i + 1, j + 1]
    return (1.0 - a) * low + a * high + lock(strain, q[0], q[1])


@njit(cache=True)
def spring_force(q: np.ndarray, pressure: float, strain: float) -> float:
    """Spring stretched from the contraction without load, stiffer with pressure and stretch."""
    raised = signed_power(pressure, q[1])
    free = q[0] * raised / (abs(raised) + q[2] ** q[1])
    stretch = free - strain
    stiffness = q[3] + max(pressure, 0.0) * (q[4] + q[5] * stretch) + q[6] * stretch * stretch
    return stiffness * stretch + lock(strain, q[7], q[8])


@njit(cache=True)
def element_force(q: np.ndarray, pressure: float, strain: float) -> float:
    """Contractile force beside a spring whose stiffness falls and then rises with pressure."""
    knee = softplus(pressure - q[3], q[4]) - softplus(-q[3], q[4])
    stiffness = q[1] - q[2] * pressure + (q[2] + q[5]) * knee
    return q[0] * pressure - max(stiffness, 0.2 * q[1]) * strain + lock(strain, q[6], q[7])
