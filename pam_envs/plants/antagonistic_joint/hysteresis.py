"""Hysteresis of the muscles of a joint: friction driven by their contraction.

The threads of the braid slide on each other as the length changes, not as the pressure does. An
operator of slope 1 follows the contraction; its lag, times a friction stiffness that
grows with the pressure pressing the threads together, is the friction force:

    F = F(p, e) - width (base + rate p) (e - operator(e))

With plays, the lag is a sum of Maxwell-slip elements. The contraction is counted from that of the
straight joint, at which a virgin hysteresis is at rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from pam_envs.hysteresis.friction_effects import DriveEffects
from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.hysteresis.protocol import preset
from pam_envs.parameters import assumed
from pam_envs.plants.core.plant import OperatorComponent

WIDEST = 0.22
"""Contraction on either side of the straight joint's that a Preisach hysteresis spans."""
LEVELS = 89
"""Of its map: cells of half a per cent."""
PLAYS = 8
"""Plays of the preset."""
ANGLES = 0.62
"""Angle [rad] that the reduced plant's hysteresis spans on either side."""
ANGLE_LEVELS = 63

_SIZE = "half-gap of the joint's loop 10 % of an amplitude of 15 to 20 degrees"
_SHARE = "friction in proportion to the pressure but for a rest of the empty muscle"


@dataclass(frozen=True)
class JointHysteresis(DriveEffects, OperatorComponent):
    """Thread-on-thread friction of the muscles.

    ``operator`` turns contraction into the contraction that the friction follows (of the reduced
    plant: the commanded angle [rad] into the angle at rest), with slope 1 and a virgin start.
    """

    width: float = assumed(
        1.0, "1", 0.0, 2.0, "friction over that of the preset", neutral=0.0, spread=(0.6, 1.4)
    )
    base: float = assumed(100.0, "N", 0.0, 1e5, _SHARE)
    rate: float = assumed(1.7e-3, "N/Pa", 0.0, 1.0, _SIZE)


def contraction_plays() -> PlayOperator:
    """Return the preset: eight plays, thresholds 0.3 % to 4.5 % of contraction, of equal weight.

    Evenly spread on a logarithmic scale, so that loops of any amplitude look alike.
    """
    thresholds = np.geomspace(3e-3, 4.5e-2, PLAYS)
    return PlayOperator(tuple(thresholds), (0.1,) * PLAYS, 0.2)


def angle_plays() -> PlayOperator:
    """Return the reduced plant's preset, identified on loops of the plant with muscles."""
    return PlayOperator(ANGLE_THRESHOLDS, ANGLE_WEIGHTS, 1.0 - sum(ANGLE_WEIGHTS))


ANGLE_THRESHOLDS = (0.02, 0.04, 0.08, 0.12, 0.16, 0.2)
ANGLE_WEIGHTS = (0.052, 0.0721, 0.105, 0.0207, 0.0809, 0.033)


@lru_cache(maxsize=8)
def joint_hysteresis(kind: str, reduced: bool = False) -> JointHysteresis:
    """Return the preset hysteresis of a kind; all operators have the same loops.

    Raises
    ------
    ValueError
        If there is no such kind.
    """
    plays = angle_plays() if reduced else contraction_plays()
    high, levels = (ANGLES, ANGLE_LEVELS) if reduced else (WIDEST, LEVELS)
    return JointHysteresis(preset(kind, plays, -high, high, levels, "virgin"))
