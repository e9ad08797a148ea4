"""Linear feedback of the joints' angles, with a model of the motion against windup.

Beside every controller runs a model of the motion on the difference between the applied command
and the controller's own (:mod:`baselines.linear.bumpless` with gains of 0): the controller sees the
angle that its own command would have given. It does not wind up at a limit, and an episode starts
from the command at hand.

The PI of fluidic_muscles (section 4) puts its zero on one of the two poles ``p`` of the nominal
plant ``K p^2 / (s + p)^2``, so that the loop is ``K_p K p^2 / (s (s + p))``, and takes the gain
for a damping ``D``: ``K_p K = 1 / (4 D^2)``, ``K_i = p K_p``. At ``D = 1/sqrt(2)`` and 23 rad/s
they are 0.5 and 11.5 1/s. The slow PI cancels the pole too, with the crossover required of the
disturbance loop, ``K_i K = 4 rad/s`` (in proportion to ``p`` for other poles).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from baselines.joint.model import POLE, JointModel
from baselines.linear.bumpless import Bumpless, BumplessGains
from baselines.linear.systems import DiscreteSystem, discrete, state_space

if TYPE_CHECKING:
    from control import StateSpace

DAMPING = 1.0 / math.sqrt(2.0)
SLOW_CROSSOVER = 4.0
"""Crossover of the slow PI [rad/s] at poles of 23 rad/s."""


class PiGains(NamedTuple):
    """Gains of a PI: proportional [1] and integral [1/s]."""

    proportional: float
    integral: float


def pole_cancelling(gain: float = 1.0, pole: float = POLE, damping: float = DAMPING) -> PiGains:
    """Return the gains that cancel a pole and give a damping; see this module's page.

    Parameters
    ----------
    gain : float
        ``K`` of the nominal plant.
    pole : float
        [rad/s].
    damping : float
    """
    proportional = 1.0 / (4.0 * damping**2 * gain)
    return PiGains(proportional, proportional * pole)


def slow_gains(gain: float = 1.0, pole: float = POLE) -> PiGains:
    """Return the gains of the slow PI; see this module's page."""
    proportional = SLOW_CROSSOVER / (POLE * gain)
    return PiGains(proportional, proportional * pole)


def pi_system(gains: PiGains) -> StateSpace:
    """Return ``K_p + K_i / s``."""
    return state_space([[0.0]], [1.0], [gains.integral], gains.proportional)


def make_loop(model: JointModel, controller: Callable[[float], StateSpace]) -> Bumpless:
    """Return a controller as loops on the nominal model of each joint.

    Parameters
    ----------
    model : JointModel
    controller : callable
        From a joint's pole [rad/s] to its controller in continuous time.
    """
    loops = [discrete(controller(pole), model.period) for pole in model.poles]
    gains = BumplessGains(np.zeros_like(model.motion.b))
    return Bumpless(DiscreteSystem.stacked(loops), model.motion, gains, model.low, model.high)
