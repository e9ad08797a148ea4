"""Energy that a plant gives out on closed cycles of pressure and position.

A muscle is passive if it gives out no more mechanical work on a closed cycle than its gas takes in:

    net work = cycle integral of force dx  -  cycle integral of p dV <= 0

with the gas volume of the force law by virtual work, ``dV/dx = dF/dp``. Without friction the net
work is 0. Friction can only lower it, unless its model creates energy.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from pam_envs.arrays import Array

if TYPE_CHECKING:
    from pam_envs.plants.core.plant import Plant


@dataclass(frozen=True)
class ImposedMuscles:
    """Muscles of a plant whose pressures and position are imposed, many cycles side by side.

    Attributes
    ----------
    force : callable
        From pressures, shape (m, n) [Pa], position, shape (n,), and the hysteresis state to the
        generalised force, (n,), that does work on the position, and the state after.
    law : callable
        From pressures and position to that force without hysteresis.
    state : object
        Of the hysteresis, for n cycles.
    """

    force: Callable[[Array, Array, Any], tuple[Array, Any]]
    law: Callable[[Array, Array], Array]
    state: Any


@dataclass(frozen=True)
class Cycles:
    """Energies [J] of closed cycles, shape (n,).

    ``net`` is what a cycle gives out in excess of what its gas takes in, ``stroke`` the largest
    work of the force without hysteresis between two points of the cycle.
    """

    net: Array
    stroke: Array

    @property
    def worst(self) -> float:
        """Largest net work over its stroke's; at most 0, but for rounding, if passive."""
        return float(np.max(self.net / self.stroke))


def cycle_work(plant: Plant, corners: Sequence[Array], steps: int = 60) -> Cycles:
    """Return the energies of closed cycles through corners, after one cycle that settles them.

    Parameters
    ----------
    corners : sequence of array
        Pressures [Pa] of the m muscles, shape (m, k, n), and positions, shape (k, n): contraction
        [m] of a single muscle, angle [rad] of a joint, length [m] of an orthosis' muscle. Between
        corners, and from the last to the first, both go straight.
    steps : int
        Steps between corners.
    """
    pressures, positions = (np.asarray(values, float) for values in corners)
    p, x = _path(pressures, steps), _path(positions, steps)
    muscles: ImposedMuscles = plant.imposed_muscles(x.shape[-1])
    smooth = np.array([muscles.law(p[:, t], x[t]) for t in range(len(x))])
    gas = np.zeros(x.shape)
    for m in range(len(p)):  # laws are linear in pressure
        raised = p.copy()
        raised[m] += 1.0
        grown = np.array([muscles.law(raised[:, t], x[t]) for t in range(len(x))]) - smooth
        gas = gas + p[m] * grown
    state, forces = muscles.state, np.empty(x.shape)
    for _ in range(3):  # the loops are closed in the second cycle, and found in the third
        for t in range(len(x)):
            forces[t], state = muscles.force(p[:, t], x[t], state)
    work = np.cumsum(_steps(smooth, x), axis=0)
    stroke = work.max(axis=0) - work.min(axis=0)
    return Cycles(_steps(forces - gas, x).sum(axis=0), stroke)


def _path(corners: Array, steps: int) -> Array:
    """Return the points of straight lines between corners (..., k, n), the first corner last."""
    share = np.arange(1, steps + 1)[:, None] / steps
    ahead = np.roll(corners, -1, axis=-2)
    legs = corners[..., None, :] + share * (ahead - corners)[..., None, :]
    return np.asarray(legs.reshape(*corners.shape[:-2], -1, corners.shape[-1]))


def _steps(forces: Array, positions: Array) -> Array:
    """Return the work of every step of a closed cycle, by the trapezium rule, shape (T, n)."""
    moved = positions - np.roll(positions, 1, axis=0)
    return np.asarray(0.5 * (forces + np.roll(forces, 1, axis=0)) * moved)
