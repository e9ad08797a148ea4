"""Feedback of the joints' angles: linear controllers that know their limits.

Beside every controller runs a model of the motion on the difference between the command that was
applied and the controller's own. So the controller sees the angle that its own command would have
given: it does not wind up at a limit, and it begins an episode at the command that it meets.
(The compensator of :mod:`baselines.linear.bumpless` without a gain of its own.)

The PI of fluidic_muscles (section 4) puts its zero on one of the two poles ``p`` of the nominal
plant ``K p^2 / (s + p)^2``, so that the loop is ``K_p K p^2 / (s (s + p))``, and takes the gain
for a damping ``D``: ``K_p K = 1 / (4 D^2)``, ``K_i = p K_p``. At ``D = 1/sqrt(2)`` and 23 rad/s
they are
0.5 and 11.5 1/s. The slow PI cancels the pole too, with the crossover that is asked of the
disturbance loop, ``K_i K = 4 rad/s`` (in proportion to ``p`` where it is another).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Array
from baselines.joint.bank import Bank
from baselines.joint.model import POLE, JointModel
from baselines.linear.systems import LinearSystem

DAMPING = 1.0 / math.sqrt(2.0)
SLOW = 4.0
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
    proportional = SLOW / (POLE * gain)
    return PiGains(proportional, proportional * pole)


def pi_system(gains: PiGains) -> LinearSystem:
    """Return ``K_p + K_i / s``."""
    return LinearSystem(
        np.zeros((1, 1)), np.ones(1), np.array([gains.integral]), gains.proportional
    )


class LoopState(NamedTuple):
    """Hysteresis models of the controllers and of the models beside them, (n_env, n_joints, k)."""

    controller: Array
    model: Array


@dataclass(frozen=True)
class JointLoop:
    """A controller with an integral part for every joint.

    Attributes
    ----------
    controller : Bank
        From wanted less measured angle to command, [rad].
    motion : Bank
        From command to angle.
    """

    controller: Bank
    motion: Bank

    def start(self, command: Array) -> LoopState:
        """Return the state that holds commands [rad], (n_env, n_joints), without any error."""
        held = self.controller.holding(command)
        return LoopState(held, self.motion.rest(np.zeros_like(command)))

    def output(
        self, wanted: Array, measured: Array, state: LoopState, low: ArrayLike, high: ArrayLike
    ) -> Array:
        """Return the commands [rad] between limits, all of shape (n_env, n_joints)."""
        made = self.controller.output(self._error(wanted, measured, state), state.controller)
        return np.minimum(np.maximum(made, low), high)

    def advance(
        self, wanted: Array, measured: Array, applied: Array, state: LoopState
    ) -> LoopState:
        """Return the state after a period in which commands [rad] acted in place of its own."""
        error = self._error(wanted, measured, state)
        difference = applied - self.controller.output(error, state.controller)
        return LoopState(
            self.controller.advance(error, state.controller),
            self.motion.advance(difference, state.model),
        )

    def _error(self, wanted: Array, measured: Array, state: LoopState) -> Array:
        spared = self.motion.output(np.zeros_like(measured), state.model)
        return np.asarray(wanted - measured + spared)


def make_loop(model: JointModel, controller: Callable[[float], LinearSystem]) -> JointLoop:
    """Return a controller as loops on the nominal model, made discrete by the bilinear rule.

    Parameters
    ----------
    model : JointModel
    controller : callable
        From a joint's pole [rad/s] to its controller.
    """
    made = [controller(pole).discrete(model.period) for pole in model.poles]
    return JointLoop(Bank.of(made), model.motion)
