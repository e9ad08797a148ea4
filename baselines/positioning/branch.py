"""Which branch of the loop to use, as a programmable logic controller decides it.

The controllers that work with one curve for inflation and one for deflation must know which way
the muscle goes. They look at the reference alone: the branch changes when the reference has gone
back by more than a dead band from the furthest point of its present run, and that furthest point
is remembered. A held reference therefore keeps its branch, a step chooses the right one at once,
and a slow ramp does after the dead band; sensor noise plays no part.

What this logic cannot do: after a small reversal, wider than the dead band, it jumps from one
branch of the *major* loop to the other, though the muscle has only entered a narrow inner loop.
The set-point then jumps by up to the width of the major loop (1 bar), which is up to 3 mm. Only a
hysteresis of the extrema can tell how far the muscle has crossed (see
``baselines.positioning.inverse``).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from baselines.core.controller import Array

DEAD_BAND = 5e-5
"""Default dead band [m]: 0.05 mm, below the repeatability of the tables."""


class Branch(NamedTuple):
    """Direction and furthest reference of the present run, shapes (n_env,)."""

    inflating: NDArray[np.bool_]
    furthest: Array


def first_branch(reference: Array, contraction: Array) -> Branch:
    """Return the branch at an episode's start: towards the reference from where the muscle is.

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
        How far [m] the reference must go back before the branch changes.
    """
    back = np.where(branch.inflating, branch.furthest - reference, reference - branch.furthest)
    turned = back > dead_band
    furthest = np.where(turned | (back < 0.0), reference, branch.furthest)
    return Branch(branch.inflating ^ turned, furthest)
