"""Hysteresis operators: one step of a normalised loop of half width 1."""

import math

import numpy as np
from numba import njit

LOOPS = ("stops", "bouc_wen", "dahl", "lugre", "preisach", "skewed_play")
SIZE = 12
"""Elements of an operator, and columns of its constants (thresholds, shares, others)."""


@njit(cache=True)
def start_loop(kind: int, op: np.ndarray, z: np.ndarray, u: float, memory: float) -> None:
    """Set the state at input `u`; `memory` (0 to 1) is what an earlier descent left."""
    for i in range(SIZE):
        z[i] = u + memory * op[0, i] if kind >= 4 else -memory


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
    total = 0.0
    for i in range(SIZE):
        if op[1, i] > 0.0:
            up = down = op[0, i] * scale
            if kind == 5:
                up *= 1.0 + op[2, 0] * (u / 3.0 - 1.0)
                down *= 1.0 + op[2, 1] * (u / 3.0 - 1.0)
            z[i] = min(max(z[i], u - up), u + down)
            bent = 0.0
            if kind == 4:
                bent = op[2, i] * 1.9098593171 * math.sin(0.5235987756 * z[i])
            total += op[1, i] * (u - z[i] - bent)
    return total
