"""Hysteresis of the muscles of a joint: friction driven by their contraction.

The threads of the braid slide on each other as the length changes. An operator of slope 1 follows
the contraction; its lag, times a stiffness, is the friction force. The pressure presses the threads
together, in one of two ways:

    length:    F = F(p, e) - width (base + rate p0) lag(e),   limits in proportion to base + rate p
    pressure:  F = F(p, e) - width (base + rate p) lag(e)

Both slip at a force in proportion to ``base + rate p``. In the first, elements of constant
stiffness slip at a distance that grows with pressure, which is passive; ``p0`` is
``REFERENCE_PRESSURE``. In the second the pressure changes the force of friction that is stuck, and
so creates or destroys energy. That force also opposes a change of the command, which reduces the
joint's gain after a turn; the presets driven by length have stiffer elements that slip at a smaller
force, so that both forms have the same loops and the same gain after a turn. With plays, the lag is
a sum of Maxwell-slip elements. The contraction is counted from that of the straight joint, at which
a virgin hysteresis is at rest.
"""

from dataclasses import dataclass, replace
from functools import lru_cache, reduce
from operator import add
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.hysteresis.friction_effects import DriveEffects
from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.hysteresis.protocol import HysteresisModel, model_of, preset
from pam_envs.hysteresis.slip import SlipModel
from pam_envs.parameters import assumed
from pam_envs.plants.core.plant import OperatorComponent

WIDEST = 0.22
"""Contraction on either side of the straight joint's that a Preisach hysteresis spans."""
LEVELS = 89
"""Of its map: cells of half a per cent."""
PLAYS = 8
"""Plays of the preset."""
REFERENCE_PRESSURE = 3e5
"""Pressure [Pa] at which friction of either drive is the same."""
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

    def slip(self, pressure: ArrayLike) -> NDArray[np.float64]:
        """Return the slip force at pressures [Pa] over that at ``REFERENCE_PRESSURE``."""
        full = self.base + self.rate * REFERENCE_PRESSURE
        return np.asarray((self.base + self.rate * np.asarray(pressure, float)) / full)

    def stiffness(self, pressure: ArrayLike) -> NDArray[np.float64]:
        """Return the friction over the lag [N] at pressures [Pa]."""
        full = self.width * (self.base + self.rate * REFERENCE_PRESSURE)
        grown = np.ones(np.shape(pressure)) if self.drive == "length" else self.slip(pressure)
        return np.asarray(full * grown)

    def at_pressure(self, pressure: float) -> HysteresisModel:
        """Return the operator at a constant pressure [Pa]."""
        model = self.model
        return model.limited(float(self.slip(pressure))) if isinstance(model, SlipModel) else model

    def friction(
        self, contraction: ArrayLike, pressure: ArrayLike, state: Any
    ) -> tuple[NDArray[np.float64], Any]:
        """Return the friction [N] at contractions beyond the straight joint's, and the state after.

        ``pressure`` [Pa] has the shape of the contractions, or broadcasts with it.
        """
        x, model = np.asarray(contraction, float), self.model
        if isinstance(model, SlipModel):
            lag, after = model.lag(x, state, self.slip(pressure))
        else:
            output, after = model.step(x, state)
            lag = x - output
        return np.asarray(self.stiffness(pressure) * lag), after


STIFFER = 1.55
"""Stiffness of the elements driven by length over that of those driven by pressure, at
``REFERENCE_PRESSURE``: the joint's gain after a turn is then 35 % less than the nominal one, and
half-gaps of its loops 10 % of amplitudes of 15 and 20 degrees."""


def contraction_plays(drive: str = "pressure") -> PlayOperator:
    """Return the preset: eight plays of equal weight.

    Evenly spread on a logarithmic scale, so that loops of any amplitude look alike: thresholds of
    0.3 % to 4.5 % of contraction, 0.063 % to 3.36 % driven by length.
    """
    low, high = (6.3e-4, 3.36e-2) if drive == "length" else (3e-3, 4.5e-2)
    thresholds = np.geomspace(low, high, PLAYS)
    return PlayOperator(tuple(thresholds), (0.1,) * PLAYS, 0.2)


def angle_plays() -> PlayOperator:
    """Return the reduced plant's preset, identified on loops of the plant with muscles."""
    total = reduce(add, ANGLE_WEIGHTS)  # sum() rounds differently from Python 3.12 on
    return PlayOperator(ANGLE_THRESHOLDS, ANGLE_WEIGHTS, 1.0 - total)


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
    drive = model_of(kind).drive
    plays = angle_plays() if reduced else contraction_plays(drive)
    high, levels = (ANGLES, ANGLE_LEVELS) if reduced else (WIDEST, LEVELS)
    made = JointHysteresis(preset(kind, plays, -high, high, levels, "virgin"))
    if drive == "pressure":
        return made
    return replace(made, base=STIFFER * made.base, rate=STIFFER * made.rate)
