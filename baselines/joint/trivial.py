"""Controllers of joints that know nothing: the floor of any comparison."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Answer
from baselines.joint.view import JointSignalMap, make_joint_signal_map
from baselines.positioning.trivial import Random, RandomState
from pam_envs.parameters import Signals


@dataclass(frozen=True)
class Straight:
    """Set-points of 0 always."""

    signals: JointSignalMap

    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> Answer:
        """Return 0, and no state; see :class:`~baselines.core.controller.Controller`."""
        angle = self.signals.read(observation).angle
        return self.signals.write(np.zeros_like(angle), observation), None


@dataclass(frozen=True)
class JointRandom:
    """Set-points drawn evenly from the whole range, each joint with a seed of its own.

    Attributes
    ----------
    signals : JointSignalMap
    draws : tuple of Random
        One for each joint.
    """

    signals: JointSignalMap
    draws: tuple[Random, ...]

    def predict(
        self,
        observation: ArrayLike,
        state: tuple[RandomState, ...] | None = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> Answer:
        """Return the next draws; see :class:`~baselines.core.controller.Controller`."""
        rows = np.atleast_2d(np.asarray(observation))
        found, states = [], []
        for k, draw in enumerate(self.draws):
            action, after = draw.predict(rows, state and state[k], episode_start)
            found.append(draw.action_signal.decode(self._placed(action, k)))
            states.append(after)
        return self.signals.write(np.array(found).T, observation), tuple(states)

    def _placed(self, action: Any, joint: int) -> Any:
        """Return an action of one number where its signal looks for it."""
        whole = np.zeros((len(action), self.draws[joint].action_signal.index + 1))
        whole[:, -1] = action[:, 0]
        return whole


def make_straight(plant: Any, signals: Signals, action_signals: Signals) -> Straight:
    """Return the controller; it does not look at the plant."""
    return Straight(make_joint_signal_map(signals, action_signals))


def make_joint_random(
    plant: Any, signals: Signals, action_signals: Signals, seed: int = 0
) -> JointRandom:
    """Return the controller; it does not look at the plant."""
    made = make_joint_signal_map(signals, action_signals)
    draws = tuple(Random(s, seed * len(made.actions) + k) for k, s in enumerate(made.actions))
    return JointRandom(made, draws)
