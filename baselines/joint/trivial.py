"""Zero and random set-points of joints: the lower bound of any comparison."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Prediction, RowController
from baselines.core.entry import Entry
from baselines.core.environments import JOINT
from baselines.joint.view import JointSignalMap, make_joint_signal_map
from baselines.trivial import Random, RandomState
from pam_envs.parameters import Signals


@dataclass(frozen=True)
class ZeroAngle(RowController):
    """Set-points of 0; a co-contraction is kept."""

    signals: JointSignalMap

    def initial_state(self, observation: ArrayLike) -> None:
        """Return no state."""

    def respond(self, observation: ArrayLike, state: Any) -> Prediction:
        """See :class:`~baselines.core.controller.RowController`."""
        angle = self.signals.read(observation).angle
        return self.signals.write(np.zeros_like(angle), observation), None


@dataclass(frozen=True)
class JointRandom(RowController):
    """Uniformly distributed set-points; a co-contraction is kept.

    Attributes
    ----------
    signals : JointSignalMap
    random : Random
    """

    signals: JointSignalMap
    random: Random

    def initial_state(self, observation: ArrayLike) -> RandomState:
        """Return the state before the first draw."""
        return self.random.initial_state(observation)

    def respond(self, observation: ArrayLike, state: RandomState) -> Prediction:
        """Return the action of the next draw, and the state after it."""
        values, after = self.random.draw(state)
        return self.signals.write(values.T, observation), after


def make_zero_angle(_plant: Any, signals: Signals, action_signals: Signals) -> ZeroAngle:
    """Return the controller of zero set-points."""
    return ZeroAngle(make_joint_signal_map(signals, action_signals))


def make_joint_random(
    _plant: Any, signals: Signals, action_signals: Signals, seed: int = 0
) -> JointRandom:
    """Return the controller of random set-points."""
    signal_map = make_joint_signal_map(signals, action_signals)
    return JointRandom(signal_map, Random(signal_map.actions, seed))


ENTRIES = {
    "joint_straight": Entry("set-points of 0", "nothing", make_zero_angle, envs=JOINT),
    "joint_random": Entry(
        "uniformly distributed set-points, seeded",
        "nothing",
        make_joint_random,
        envs=JOINT,
        seeded=True,
    ),
}
