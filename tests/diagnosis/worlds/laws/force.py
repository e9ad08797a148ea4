"""Static force laws F(p, eps) of a muscle [N], with p in bar and eps as contraction by length."""

import math

import numpy as np
from numba import njit

from .braids import (
    barrel_force,
    braid_force,
    bundle_force,
    capped_force,
    chain_force,
    locking_force,
    ogden_force,
    rubber_force,
)
from .elements import curve, lock
from .fitted import (
    element_force,
    hyperbolic_force,
    logistic_force,
    map_force,
    spring_force,
    table_force,
    tangent_force,
)

LAWS = (
    "exponential",
    "polynomial",
    "sine",
    "map",
    "bundle",
    "braid",
    "tangent",
    "sarosi",
    "logistic",
    "rational",
    "locking",
    "rubber",
    "capped",
    "drawn",
    "hyperbolic",
    "table",
    "ogden",
    "chain",
    "barrel",
    "spring",
    "three_element",
)


@njit(cache=True)
def force(
    kind: int,
    q: np.ndarray,
    table: np.ndarray,
    pressure: float,
    strain: float,
    load: float,
    work: np.ndarray,
) -> float:
    """Return the force of the muscle [N]; `load` [N] shifts the laws fitted to isotonic data."""
    if kind == 0:
        r = strain / q[4]
        passive = q[1] * (math.exp(-q[2] * r) - 1.0)
        return q[0] * (passive + pressure / 6.2 * math.exp(-q[3] * r * r))
    if kind == 1:
        p = pressure - q[6] * load
        active = (q[0] * p + q[1] * p * p) * (1.0 - q[2] * strain + q[3] * strain**2)
        return active + lock(strain, q[4], q[5]) - q[7] * strain**3
    if kind == 2:
        angle = min(max(1.5707963267948966 * strain / q[1], -1.4), 1.4)
        sine = math.sin(angle) + 0.17 * (1.5707963267948966 * strain / q[1] - angle)
        active = q[0] * (pressure / 6.0 * (1.0 - sine) - q[2] * sine)
        return active + lock(strain, q[3], q[4])
    if kind == 3:
        return map_force(table, pressure, strain, work)
    if kind == 4:
        return bundle_force(q, pressure, strain)
    if kind == 5:
        return braid_force(q, pressure, strain)
    if kind == 6:
        return tangent_force(q, pressure, strain, load)
    if kind == 7:
        k = 100.0 * strain / q[1]
        passive = (-9.219 * pressure + 203.7) * math.exp(-0.34221 * k)
        return q[0] * (passive - 3.2256 * pressure * k + 109.204 * pressure - 203.7) - q[2] * k
    if kind == 8:
        return logistic_force(q, pressure, strain, load)
    if kind == 10:
        return locking_force(q, pressure, strain)
    if kind == 11:
        return rubber_force(q, pressure, strain)
    if kind == 12:
        return capped_force(q, pressure, strain)
    if kind == 13:
        taut = pressure - curve(q, 0, 9, 0.04, strain)
        return taut * curve(q, 9, 6, 0.08, strain) + lock(strain, q[15], 0.01)
    if kind == 14:
        return hyperbolic_force(q, pressure, strain)
    if kind == 15:
        return table_force(q, table, pressure, strain)
    if kind == 16:
        return ogden_force(q, pressure, strain)
    if kind == 17:
        return chain_force(q, pressure, strain)
    if kind == 18:
        return barrel_force(q, pressure, strain, work)
    if kind == 19:
        return spring_force(q, pressure, strain)
    if kind == 20:
        return element_force(q, pressure, strain)
    r = strain / q[1]
    active = pressure / 6.0 * max(1.0 - r, 0.0) ** q[2] / max(1.0 + q[3] * r, 0.5)
    passive = q[4] * r / max(1.0 + q[5] * r, 0.5)
    return q[0] * (active - passive) + lock(strain, q[6], q[7])


@njit(cache=True)
def balance(kind: int, q: np.ndarray, table: np.ndarray, pressure: float, load: float) -> float:
    """Return the strain at which the law carries a load [N], by bisection."""
    work = np.zeros((2, 4))
    low, high = -0.15, 0.4
    for _ in range(60):
        middle = 0.5 * (low + high)
        if force(kind, q, table, pressure, middle, load, work) > load:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
