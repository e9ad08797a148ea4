"""Branch selection for hysteresis curves, as in a programmable logic controller.

Controllers with one curve for inflation and one for deflation must know the direction of motion.
The reference alone determines it: the branch changes when the reference has reversed by more than a
dead band from the extremum since the last change. A held reference keeps its branch, a step selects
the right one at once, and a slow ramp does after the dead band; sensor noise has no influence.

Limitation: after a small reversal, wider than the dead band, the curve jumps from one branch of the
*major* loop to the other, though the muscle has only entered a narrow inner loop. The set-point
then jumps by up to the width of the major loop (1 bar), up to 3 mm of contraction. Only a state of
all extrema resolves inner loops (:mod:`baselines.positioning.inverse`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from baselines.core.controller import Array

DEAD_BAND = 5e-5
"""Default dead band [m]: 0.05 mm, below the repeatability of the tables."""


class Branch(NamedTuple):
    """Direction, and extremum of the reference since the last change, shapes (n_env,)."""

    inflating: NDArray[np.bool_]
    extremum: Array


def first_branch(reference: Array, contraction: Array) -> Branch:
    """Return the branch at an episode's start: from the contraction towards the reference.

    Parameters
    ----------
    reference, contraction : ndarray, shape (n_env,)
        [m].
    """
    return Branch(reference >= contraction, reference)


def next_branch(branch: Branch, reference: Array, dead_band: float = DEAD_BAND) -> Branch:
    """Return the branch for the next reference.

    Parameters
    ----------
    branch : Branch
        Of the last control period; not changed.
    reference : ndarray, shape (n_env,)
        [m].
    dead_band : float
        Reversal [m] of the reference at which the branch changes.
    """
    back = np.where(branch.inflating, branch.extremum - reference, reference - branch.extremum)
    turned = back > dead_band
    extremum = np.where(turned | (back < 0.0), reference, branch.extremum)
    return Branch(branch.inflating ^ turned, extremum)
