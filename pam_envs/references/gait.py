"""Strides as smooth periodic curves: knee, shank, ground force, centre of pressure, ankle.

A curve is a periodic cubic B-spline over the phase (0 to 1, in turns; 0 is heel contact), so that
value, rate and acceleration are continuous and a force that is zero in swing is exactly zero. One
table holds all curves of an activity, ``table[k][signal]``: coefficient ``k - 1`` of each curve,
with three rows more than the ``n`` knots so that no index wraps.

Level walking is measured (one subject, a stride of 1.224 s); both stairs are synthetic, drawn
through a few knots (``data/PROVENANCE.md``).
"""

import csv
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.kernels.build import kernel

ACTIVITIES = ("walk", "stairs_up", "stairs_down")
SIGNALS = ("knee", "shank", "ground_z", "ground_x", "cop", "ankle")
KNEE, SHANK, GROUND_Z, GROUND_X, COP, ANKLE = range(len(SIGNALS))
"""Knee flexion [rad], lean of the shank (knee ahead of the ankle) [rad], vertical and horizontal
ground force over body weight, centre of pressure ahead of the ankle [m], dorsiflexion [rad]."""

NATURAL_STRIDE = 1.224  # duration [s] of the measured stride; ground forces are those of this pace
PAPER_STRIDE = 5.0  # duration [s] of the stride of yeh2010

FOLDER = Path(__file__).resolve().parent.parent / "data"


@lru_cache(maxsize=8)
def _table(activity: str) -> NDArray[np.float64]:
    if activity not in ACTIVITIES:
        raise ValueError(f"activity = {activity!r}; choose one of {', '.join(ACTIVITIES)}")
    with open(FOLDER / f"gait_{activity}.csv", encoding="utf-8", newline="") as file:
        rows = [[float(row[name]) for name in SIGNALS] for row in csv.DictReader(file)]
    n = len(rows)
    table = np.array([rows[(k - 1) % n] for k in range(n + 3)])
    table.setflags(write=False)
    return table


def gait_table(activity: str) -> NDArray[np.float64]:
    """Return the curves of an activity, shape (n + 3, 6); raise ValueError if unknown."""
    return _table(activity).copy()


def gait_curves(
    activity: str, phase: ArrayLike, derivative: int = 0
) -> dict[str, NDArray[np.float64]]:
    """Return every curve of an activity, or a derivative of it (per turn), at phases (...).

    ``activity`` is one of :data:`ACTIVITIES`; of a phase [turns] only its fraction counts.
    """
    table = _table(activity)
    n = len(table) - 3
    share = np.mod(np.asarray(phase, float), 1.0) * n
    cell = np.minimum(share.astype(int), n - 1)
    weights = np.stack(basis(share - cell, n)[derivative])
    values = sum(weights[i][..., None] * table[cell + i] for i in range(4))
    return {name: np.asarray(values)[..., i] for i, name in enumerate(SIGNALS)}


@kernel
def basis(u: Any, n: Any) -> Any:
    """Return the four weights of value, rate and acceleration (per turn) at ``u`` in its cell."""
    v, n2 = 1.0 - u, n * n
    value = (
        v * v * v / 6.0,
        (4.0 + u * u * (3.0 * u - 6.0)) / 6.0,
        (4.0 + v * v * (3.0 * v - 6.0)) / 6.0,
        u * u * u / 6.0,
    )
    rate = (
        -0.5 * v * v * n,
        0.5 * u * (3.0 * u - 4.0) * n,
        -0.5 * v * (3.0 * v - 4.0) * n,
        0.5 * u * u * n,
    )
    return value, rate, (v * n2, (3.0 * u - 2.0) * n2, (3.0 * v - 2.0) * n2, u * n2)


@kernel
def fraction_of_turn(turns: float) -> float:
    """Return the fraction of a phase above -1."""
    ahead = turns + 1.0 if turns < 0.0 else turns
    return ahead - float(int(ahead))


@kernel
def shared_load(own: float, other: float, quick: float) -> float:
    """Return the vertical force of one leg over body weight, at another pace than the natural one.

    The force of both legs fluctuates about the body weight by the acceleration of the centre of
    mass, whose path does not depend on the pace: the fluctuation grows with the square of the pace
    ``quick`` over the natural one. The leg keeps its share. ``own`` and ``other`` are the forces of
    both legs at natural pace, of which one is above 0.
    """
    both = own + other
    return own * ((1.0 + quick * quick * (both - 1.0)) / both)


@kernel
def vertical_load(table: Any, phase: float, quick: float) -> float:
    """Return the vertical force over body weight at a phase in [0, 1) of a pace."""
    own = curve(table, GROUND_Z, phase)
    return shared_load(own, curve(table, GROUND_Z, fraction_of_turn(phase + 0.5)), quick)


@kernel
def curve(table: Any, signal: int, phase: float) -> float:
    """Return a curve at a phase in [0, 1)."""
    return curve_and_rates(table, signal, phase)[0]


@kernel
def curve_and_rates(table: Any, signal: int, phase: float) -> tuple[float, float, float]:
    """Return a curve, its rate per turn and its acceleration per turn squared."""
    n = len(table) - 3
    share = phase * n
    k = min(int(share), n - 1)
    value, rate, acceleration = basis(share - k, n)
    a, b = table[k][signal], table[k + 1][signal]
    c, d = table[k + 2][signal], table[k + 3][signal]
    return (
        value[0] * a + value[1] * b + value[2] * c + value[3] * d,
        rate[0] * a + rate[1] * b + rate[2] * c + rate[3] * d,
        acceleration[0] * a + acceleration[1] * b + acceleration[2] * c + acceleration[3] * d,
    )
