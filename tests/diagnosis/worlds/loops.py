"""Hysteresis operators: one step of a normalised loop of half width 1."""

import math

import numpy as np
from numba import njit

LOOPS = (
    "stops",
    "bouc_wen",
    "dahl",
    "lugre",
    "preisach",
    "skewed_play",
    "tanh_play",
    "dead_zone_play",
    "rate_weak",
    "slip_lag",
    "duhem",
    "elastoplastic",
    "ridge_play",
    "relaxing",
    "back_stress",
)
SIZE = 12
"""Elements of an operator, and columns of its constants (thresholds, shares, others)."""


SIDES = SIZE // 2
"""First of the second half of the states, for operators with two states in each element."""


@njit(cache=True)
def _ridge(op: np.ndarray, x: float) -> float:
    """Ramp between two levels, as wide as two distances of its neighbours."""
    return min(max(x + op[2, 1] - op[2, 0], 0.0), 2.0 * (op[2, 1] - op[2, 0]))


@njit(cache=True)
def start_loop(kind: int, op: np.ndarray, z: np.ndarray, u: float, memory: float) -> None:
    """Set the state at input `u`; `memory` (0 to 1) is what an earlier descent left."""
    for i in range(SIZE):
        z[i] = u + memory * op[0, i] if 4 <= kind < 8 else -memory
    if kind == 9:
        z[SIDES:] = 0.0  # all elements stick
    if kind == 12:
        for i in range(SIZE):
            z[i] = _ridge(op, u + memory * op[0, i] - op[2, i])
    if kind == 14:
        z[0], z[1] = u + memory * op[0, 0], -memory * (1.0 - op[2, 0])


@njit(cache=True)
def _bent(u: float, reach: float, centre: float) -> float:
    """Envelope that saturates at both ends, 0 at 0."""
    return reach * (math.tanh((u - centre) / reach) + math.tanh(centre / reach))


@njit(cache=True)
def _kinked(u: float, others: np.ndarray) -> float:
    """Superpose five dead zones on an input."""
    total = u
    for i in range(5):
        total += others[i] * max(u - others[5 + i], 0.0)
    return total


@njit(cache=True)
def _tanh_play(op: np.ndarray, z: np.ndarray, u: float, scale: float) -> float:
    """Plays between envelopes that saturate differently for rising and falling input."""
    up, down, centre = op[2, 0], op[2, 1], op[2, 2]
    middle = 0.5 * (_bent(u, up, centre) + _bent(u, down, centre))
    total = 0.0
    for i in range(SIZE):
        if op[1, i] > 0.0:
            reach = op[0, i] * scale
            low, high = _bent(u - reach, up, centre), _bent(u + reach, down, centre)
            z[i] = min(max(z[i], low), high)
            total += op[1, i] * (middle - z[i])
    return total


@njit(cache=True)
def _rate_weak(op: np.ndarray, z: np.ndarray, du: float, v: float, scale: float) -> float:
    """Bristles whose bound changes with the logarithm of the rate."""
    bound = scale * (1.0 + op[2, 0] * math.asinh(abs(v) / op[2, 1]))
    total = 0.0
    for i in range(SIZE):
        if op[1, i] > 0.0:
            z[i] = (z[i] + du / op[0, i]) / (1.0 + abs(du) / (op[0, i] * bound))
            total += op[1, i] * z[i]
    return total


@njit(cache=True)
def _slip_lag(op: np.ndarray, z: np.ndarray, du: float, v: float, scale: float) -> float:
    """Maxwell-slip elements whose force, once they slide, lags behind its bound.

    An element slides until the motion reverses; the bound at rest is a little above that in motion.
    """
    bound = scale * (1.0 + op[2, 1] * math.exp(-((v / op[2, 2]) ** 2)))
    elapsed = du / v if abs(v) > 1e-9 else 0.0
    share = 1.0 - math.exp(-op[2, 0] * elapsed)
    total = 0.0
    for i in range(SIDES):
        if op[1, i] > 0.0:
            if du * z[SIDES + i] < 0.0:
                z[SIDES + i] = 0.0
            if z[SIDES + i] == 0.0:
                z[i] += du / op[0, i]
                if abs(z[i]) >= bound:
                    z[i] = math.copysign(bound, z[i])
                    z[SIDES + i] = z[i]
            else:
                z[i] += share * (math.copysign(bound, z[SIDES + i]) - z[i])
            total += op[1, i] * z[i]
    return total


@njit(cache=True)
def _elastoplastic(op: np.ndarray, z: np.ndarray, du: float, scale: float) -> float:
    """Bristle that is purely elastic below a share of its bound, and slides gradually above."""
    size = abs(z[0]) / scale
    slide = 0.0
    if du * z[0] > 0.0 and size > op[2, 0]:
        middle, width = 0.5 * (1.0 + op[2, 0]), 1.0 - op[2, 0]
        slide = 0.5 + 0.5 * math.sin(math.pi * min(max((size - middle) / width, -0.5), 0.5))
    z[0] += du / op[0, 0] * (1.0 - slide * size)
    z[0] = min(max(z[0], -scale), scale)
    return z[0]


@njit(cache=True)
def _relaxing(op: np.ndarray, z: np.ndarray, du: float, v: float, scale: float) -> float:
    """Stops beside a weak dashpot: a small share of the force relaxes after every motion."""
    total = 0.0
    for i in range(SIDES):
        if op[1, i] > 0.0:
            z[i] = min(max(z[i] + du / op[0, i], -scale), scale)
            total += op[1, i] * z[i]
    elapsed = du / v if abs(v) > 1e-12 else 0.0
    z[SIDES] += (total - z[SIDES]) * elapsed / (elapsed + op[2, 1])
    return total - op[2, 0] * z[SIDES]


@njit(cache=True)
def _back_stress(op: np.ndarray, z: np.ndarray, u: float, scale: float) -> float:
    """Elastic-plastic element with a yield surface that moves towards a limit.

    Its states are plastic input and back stress; yield and limit of the back stress add up to 1.
    """
    reach, own = op[0, 0], op[2, 0] * scale
    limit = scale - own
    stress = (u - z[0]) / reach
    over = abs(stress - z[1]) - own
    if over > 0.0:
        side = 1.0 if stress > z[1] else -1.0
        harden = max(limit - side * z[1], 0.0) / op[2, 1]
        flowed = over / (1.0 / reach + harden)
        z[0] += side * flowed
        z[1] += side * harden * flowed
        stress = (u - z[0]) / reach
    return stress


@njit(cache=True)
def loop_step(
    kind: int, op: np.ndarray, z: np.ndarray, u: float, du: float, v: float, scale: float
) -> float:
    """Return the loop's output after the input moved by `du` to `u`.

    `v` is the input's rate, `scale` widens the loop.
    """
    if kind == 0:
        total = 0.0
        for i in range(SIZE):
            if op[1, i] > 0.0:
                z[i] = min(max(z[i] + du / op[0, i], -scale), scale)
                total += op[1, i] * z[i]
        return total
    if kind == 1:
        relative = z[0] / scale
        bend = abs(relative) ** op[2, 0]
        side = 1.0 if du * relative > 0.0 else -1.0
        lean = 1.0 + op[2, 2] * (1.0 if du > 0.0 else -1.0)
        z[0] += du / op[0, 0] * (1.0 - lean * bend * (op[2, 1] + (1.0 - op[2, 1]) * side))
        z[0] = min(max(z[0], -scale), scale)
        return z[0]
    if kind == 2:
        side = 1.0 if du > 0.0 else -1.0
        z[0] += du / op[0, 0] * max(1.0 - side * z[0] / scale, 0.0) ** op[2, 0]
        z[0] = min(max(z[0], -scale), scale)
        return z[0]
    if kind == 3:
        bound = scale * (1.0 + op[2, 0] * math.exp(-((v / op[2, 1]) ** 2)))
        z[0] = (z[0] + du / op[0, 0]) / (1.0 + abs(du) / (op[0, 0] * bound))
        return z[0]
    if kind == 6:
        return _tanh_play(op, z, u, scale)
    if kind == 8:
        return _rate_weak(op, z, du, v, scale)
    if kind == 9:
        return _slip_lag(op, z, du, v, scale)
    if kind == 10:
        tilt = op[2, 1] if du > 0.0 else op[2, 2]
        reach = op[0, 0] * (1.0 if du > 0.0 else op[2, 0]) * max(1.0 + tilt * (u / 3.0 - 1.0), 0.5)
        z[0] += (du - abs(du) * z[0] / scale) / reach
        z[0] = min(max(z[0], -scale), scale)
        return z[0]
    if kind == 11:
        return _elastoplastic(op, z, du, scale)
    if kind == 13:
        return _relaxing(op, z, du, v, scale)
    if kind == 14:
        return _back_stress(op, z, u, scale)
    total = 0.0
    for i in range(SIZE):
        if op[1, i] > 0.0:
            up = down = op[0, i] * scale
            if kind == 12:
                low, high = _ridge(op, u - up - op[2, i]), _ridge(op, u + up - op[2, i])
                z[i] = min(max(z[i], low), high)
                total += op[1, i] * (0.5 * (low + high) - z[i])
                continue
            if kind == 5:
                up *= 1.0 + op[2, 0] * (u / 3.0 - 1.0)
                down *= 1.0 + op[2, 1] * (u / 3.0 - 1.0)
            z[i] = min(max(z[i], u - up), u + down)
            bent = 0.0
            if kind == 4:
                bent = op[2, i] * 1.9098593171 * math.sin(0.5235987756 * z[i])
            total += op[1, i] * (u - z[i] - bent)
    if kind == 7:
        half = op[2, 10]
        return (_kinked(u, op[2]) - _kinked(u - half * total, op[2])) / half
    return total
