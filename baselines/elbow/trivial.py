"""Controllers of the elbow that know nothing, or next to nothing: the floor of any comparison."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Answer
from baselines.elbow.valves import PressureLoop, make_pressure_loop
from baselines.elbow.view import ElbowSignalMap, make_elbow_signal_map
from baselines.positioning.trivial import RandomEach, random_each
from pam_envs.parameters import Signals
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis


@dataclass(frozen=True)
class Limp:
    """The lowest commands always: no pressure, or the exhausts kept open.

    Attributes
    ----------
    signals : ElbowSignalMap
    """

    signals: ElbowSignalMap

    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> Answer:
        """Return the commands, and no state; see :class:`~baselines.core.controller.Controller`."""
        rows = 1 if np.ndim(observation) == 1 else len(np.asarray(observation))
        lowest = np.array([signal.low for signal in self.signals.actions])
        return self.signals.write(np.repeat(lowest[:, None], rows, axis=1), observation), None


@dataclass(frozen=True)
class Held:
    """The same two pressures always.

    Attributes
    ----------
    signals : ElbowSignalMap
    loop : PressureLoop
    pressure : float
        Of both bundles [Pa].
    """

    signals: ElbowSignalMap
    loop: PressureLoop
    pressure: float

    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> Answer:
        """Return the commands, and no state; see :class:`~baselines.core.controller.Controller`."""
        view = self.signals.read(observation)
        wanted = np.full_like(view.pressure, self.pressure)
        return self.signals.write(self.loop.commands(view, wanted), observation), None


def make_limp(plant: ElbowOrthosis, signals: Signals, action_signals: Signals) -> Limp:
    """Return the controller; it looks at no more of the plant than its control period."""
    return Limp(make_elbow_signal_map(signals, action_signals, plant.control_period))


def make_held(
    plant: ElbowOrthosis, signals: Signals, action_signals: Signals, share: float = 0.5
) -> Held:
    """Return the controller that holds ``share`` of the largest pressure in both bundles."""
    return Held(
        make_elbow_signal_map(signals, action_signals, plant.control_period),
        make_pressure_loop(plant),
        share * plant.full_pressure,
    )


def make_elbow_random(
    plant: ElbowOrthosis, signals: Signals, action_signals: Signals, seed: int = 0
) -> RandomEach:
    """Return the controller; it does not look at the plant."""
    return random_each(action_signals, seed)
