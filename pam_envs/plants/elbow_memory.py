"""The memory of the elbow's bundles: friction driven by their contraction.

The threads of the braid slide as the length changes, and press on each other in proportion to the
force. An operator of slope 1 follows the travel of the pulley (the contraction of bundle b; that
of bundle a is its mirror image, so that one operator serves both). What it lags behind makes the
force of each bundle

    P = X [(L_n - C) (C_max - C) - s],    s = loop L_n C_max lag / (2 largest lag)

with the lag of that bundle's own contraction. ``loop`` is the largest difference of the forces
while the bundle is stretched and let go, over its force at nominal length, at any one pressure:
so is the paper's 7.5 % read. It was reported of loops that overload the muscles beyond their
nominal length; shorter ones are said to have less.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.hysteresis.preisach import Preisach
from pam_envs.parameters import parameter
from pam_envs.plants.joint_memory import ELEMENTS
from pam_envs.plants.memory import Kind

SMALLEST, LARGEST = 6e-4, 9e-3
"""Thresholds of the preset's plays [m]: 0.15 % and 2.3 % of the nominal length."""
WIDEST, LEVELS = 0.06, 121
"""Travel [m] on either side of the middle that a Preisach memory spans, and levels of its map."""


@dataclass(frozen=True)
class ElbowMemory:
    """Thread-on-thread friction of both bundles.

    ``operator`` turns travel [m] into the travel that is felt: a :class:`PlayOperator` of total
    slope 1, a :class:`Preisach` operator with a virgin start, or None.
    """

    operator: PlayOperator | Preisach | None = None
    loop: float = parameter(
        0.075,
        "1",
        0.0,
        0.4,
        "published",
        "7.5 % between loading and unloading: seed 001, section 2",
        neutral=0.0,
        spread=(0.045, 0.12),
    )

    @property
    def kind(self) -> Kind:
        """Which operator this is."""
        if self.operator is None:
            return "none"
        return "preisach" if isinstance(self.operator, Preisach) else "maxwell_slip"

    @cached_property
    def largest_lag(self) -> float:
        """How far [m] the operator lags behind after a long way in one direction."""
        if isinstance(self.operator, PlayOperator):
            return float(np.dot(self.operator.weights, self.operator.thresholds))
        if isinstance(self.operator, Preisach):
            return self.operator.high - 0.5 * float(self.operator.table[-1][0])
        return 1.0


def travel_plays() -> PlayOperator:
    """Return the preset: plays of equal weight, evenly spread on a logarithmic scale."""
    thresholds = np.geomspace(SMALLEST, LARGEST, ELEMENTS)
    return PlayOperator(tuple(thresholds), (0.1,) * ELEMENTS, 0.2)


@lru_cache(maxsize=4)
def elbow_memory(kind: Kind) -> ElbowMemory:
    """Return the preset memory of a kind; both operators have the same loops.

    Raises
    ------
    ValueError
        If there is no such kind.
    """
    if kind == "none":
        return ElbowMemory()
    if kind == "maxwell_slip":
        return ElbowMemory(travel_plays())
    if kind == "preisach":
        wide = Preisach.from_play(travel_plays(), -WIDEST, WIDEST, LEVELS, start="virgin")
        return ElbowMemory(wide)
    raise ValueError(f"hysteresis = {kind!r}; choose 'maxwell_slip', 'preisach' or 'none'")
