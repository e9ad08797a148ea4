"""Static force laws F(p, eps) of a muscle [N], with p in bar and eps as contraction by length."""

import math

import numpy as np
from numba import njit

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
)
MAP_SHAPE = (14, 16)
"""Knots of a drawn map over pressure and strain."""
MAP_PRESSURE = (-1.2, 0.75)
"""First knot and spacing of the pressure axis [bar]."""
MAP_STRAIN = (-0.11, 0.033)
"""First knot and spacing of the strain axis [-]."""


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
def _spline(u: float, out: np.ndarray) -> None:
    out[0] = (1.0 - u) ** 3 / 6.0
    out[1] = (3.0 * u**3 - 6.0 * u**2 + 4.0) / 6.0
    out[2] = (-3.0 * u**3 + 3.0 * u**2 + 3.0 * u + 1.0) / 6.0
    out[3] = u**3 / 6.0


@njit(cache=True)
def _map(table: np.ndarray, pressure: float, strain: float, work: np.ndarray) -> float:
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
def _bundle(q: np.ndarray, pressure: float, strain: float) -> float:
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
def _braid(q: np.ndarray, pressure: float, strain: float) -> float:
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
def _tangent(q: np.ndarray, pressure: float, strain: float, load: float) -> float:
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
def _logistic(q: np.ndarray, pressure: float, strain: float, load: float) -> float:
    """Stiffness about a strain that is an S-curve of pressure, shifted by the load."""
    y = (pressure - q[1] - q[3] * load) / q[2]
    rest = 1.0 / (1.0 + math.exp(q[1] / q[2]))
    aim = q[0] * (1.0 / (1.0 + math.exp(-y)) - rest) - q[6] * load
    return load + (q[4] + q[5] * max(pressure, 0.0)) * (aim - strain)


@njit(cache=True)
def _softplus(value: float, width: float) -> float:
    """Positive part of a number, rounded over a width."""
    y = value / width
    return value if y > 30.0 else width * math.log1p(math.exp(y))


@njit(cache=True)
def _locking(q: np.ndarray, pressure: float, strain: float) -> float:
    """Straight lines in strain with a kink where the strands of the braid touch."""
    free = q[0] * pressure * (1.0 - strain / q[1]) - q[2] * strain
    jam = q[4] * (1.0 + q[5] * max(pressure, 0.0) / 6.0)
    return free - jam * _softplus(strain - q[3], q[6]) + lock(strain, q[7], q[8])


@njit(cache=True)
def _rubber(q: np.ndarray, pressure: float, strain: float) -> float:
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
def _capped(q: np.ndarray, pressure: float, strain: float) -> float:
    """Cylinder whose ends round off while it contracts, and a bladder slack at low pressure."""
    taut = pressure * abs(pressure) / (abs(pressure) + q[4])
    share = 1.0 - q[2] * (1.0 - math.exp(-max(strain, -0.1) / q[3]))
    x = 1.0 - strain / (q[1] * share)
    active = q[0] * taut * (0.62 * x + 0.38 * x * abs(x)) * share
    return active - q[5] * strain - q[6] * strain**3 + lock(strain, q[7], q[8])


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


@njit(cache=True)
def _hyperbolic(q: np.ndarray, pressure: float, strain: float) -> float:
    """Hyperbola of force and contraction, in series with an elastic tendon."""
    reach = q[0] * q[1] + q[2] * signed_power(pressure, q[3])
    b = strain + q[1] + q[0] * q[4]
    root = max(b * b - 4.0 * q[4] * (q[0] * (strain + q[1]) - reach), 0.0)
    return (math.sqrt(root) - b) / (2.0 * q[4]) + lock(strain, q[5], q[6])


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
        return _map(table, pressure, strain, work)
    if kind == 4:
        return _bundle(q, pressure, strain)
    if kind == 5:
        return _braid(q, pressure, strain)
    if kind == 6:
        return _tangent(q, pressure, strain, load)
    if kind == 7:
        k = 100.0 * strain / q[1]
        passive = (-9.219 * pressure + 203.7) * math.exp(-0.34221 * k)
        return q[0] * (passive - 3.2256 * pressure * k + 109.204 * pressure - 203.7) - q[2] * k
    if kind == 8:
        return _logistic(q, pressure, strain, load)
    if kind == 10:
        return _locking(q, pressure, strain)
    if kind == 11:
        return _rubber(q, pressure, strain)
    if kind == 12:
        return _capped(q, pressure, strain)
    if kind == 13:
        taut = pressure - curve(q, 0, 9, 0.04, strain)
        return taut * curve(q, 9, 6, 0.08, strain) + lock(strain, q[15], 0.01)
    if kind == 14:
        return _hyperbolic(q, pressure, strain)
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
