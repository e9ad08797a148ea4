"""Controllers of the elbow that know nothing, or next to nothing: the floor of any comparison."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from baselines.controller import Answer
from baselines.elbow_valves import PressureLoop, make_pressure_loop
from baselines.elbow_view import ElbowEyes, make_elbow_eyes
from baselines.trivial import Random, RandomState
from pam_envs.parameters import Signals
from pam_envs.plants.elbow_orthosis import ElbowOrthosis


@dataclass(frozen=True)
class Limp:
    """The lowest commands always: no pressure, or the exhausts kept open.

    Attributes
    ----------
    eyes : ElbowEyes
    """

    eyes: ElbowEyes

    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> Answer:
        """Return the commands, and no state; see :class:`~baselines.controller.Controller`."""
        rows = 1 if np.ndim(observation) == 1 else len(np.asarray(observation))
        lowest = np.array([signal.low for signal in self.eyes.actions])
        return self.eyes.act(np.repeat(lowest[:, None], rows, axis=1), observation), None


@dataclass(frozen=True)
class Held:
    """The same two pressures always.

    Attributes
    ----------
    eyes : ElbowEyes
    loop : PressureLoop
    pressure : float
        Of both bundles [Pa].
    """

    eyes: ElbowEyes
    loop: PressureLoop
    pressure: float

    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> Answer:
        """Return the commands, and no state; see :class:`~baselines.controller.Controller`."""
        view = self.eyes.look(observation)
        wanted = np.full_like(view.pressure, self.pressure)
        return self.eyes.act(self.loop.commands(view, wanted), observation), None


@dataclass(frozen=True)
class ElbowRandom:
    """Commands drawn evenly from the whole range, each bundle with a seed of its own.

    Attributes
    ----------
    eyes : ElbowEyes
    draws : tuple of Random
        One for each bundle.
    """

    eyes: ElbowEyes
    draws: tuple[Random, ...]

    def predict(
        self,
        observation: ArrayLike,
        state: tuple[RandomState, ...] | None = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> Answer:
        """Return the next draws; see :class:`~baselines.controller.Controller`."""
        rows = np.atleast_2d(np.asarray(observation))
        found, states = [], []
        for k, draw in enumerate(self.draws):
            action, after = draw.predict(rows, state and state[k], episode_start)
            gain, offset = draw.action_signal.scale
            found.append((action[:, 0].astype(float) - offset) / gain)
            states.append(after)
        return self.eyes.act(np.array(found), observation), tuple(states)


def make_limp(plant: ElbowOrthosis, signals: Signals, action_signals: Signals) -> Limp:
    """Return the controller; it looks at no more of the plant than its control period."""
    return Limp(make_elbow_eyes(signals, action_signals, plant.control_period))


def make_held(
    plant: ElbowOrthosis, signals: Signals, action_signals: Signals, share: float = 0.5
) -> Held:
    """Return the controller that holds ``share`` of the largest pressure in both bundles."""
    return Held(
        make_elbow_eyes(signals, action_signals, plant.control_period),
        make_pressure_loop(plant),
        share * plant.full_pressure,
    )


def make_elbow_random(
    plant: ElbowOrthosis, signals: Signals, action_signals: Signals, seed: int = 0
) -> ElbowRandom:
    """Return the controller; it looks at no more of the plant than its control period."""
    eyes = make_elbow_eyes(signals, action_signals, plant.control_period)
    return ElbowRandom(eyes, tuple(Random(s, 2 * seed + k) for k, s in enumerate(eyes.actions)))
