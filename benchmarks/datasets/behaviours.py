"""Behaviours that generate data: open-loop signals, and controllers with exploration noise."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.arrays import Array
from pam_envs.parameters import Signals

KINDS = ("random", "classical", "medium", "expert", "excitation")
"""Kinds of data sets: independent uniform actions, a published controller, a policy after a tenth
of its training, the policy after the whole training, and signals for identification."""
CLASSICAL = {
    "PAM/MusclePositioning-v0": "inverse_pid",
    "PAM/KneeTension-v0": "knee_inverse_ahead_ltr",
    "PAM/KneeStiffness-v0": "knee_inverse_ahead_ltr",
    "PAM/KneeWalk-v0": "knee_inverse",
    "PAM/KneeStairsUp-v0": "knee_inverse",
    "PAM/KneeStairsDown-v0": "knee_inverse",
    "PAM/ElbowOrthosis-v0": "elbow_allocation_early",
    "PAM/AntagonisticJoint-v0": "joint_mfc_mu_ahead",
    "PAM/RedundantManipulator-v0": "joint_mfc_mu_ahead",
}
"""Published controller of each environment."""
HOLDS = (0.05, 2.0)
"""Shortest and longest time [s] between two levels of the excitation."""
SINES = np.geomspace(0.1, 5.0, 10)
"""Frequencies [Hz] of a multisine of the excitation."""
RANGE = 0.9
"""Share of the action's range that the excitation covers."""
Plan = Callable[[np.random.Generator, int, int], Array]
"""Signal of an episode in units of half the action's range, shape (steps, n_actions)."""


def uniform(random: np.random.Generator, steps: int, actions: int) -> Array:
    """Return independent, uniformly distributed actions."""
    return random.uniform(-1.0, 1.0, (steps, actions))


def noise(deviation: float) -> Plan:
    """Return Gaussian noise for every second episode, in units of half the action's range."""

    def plan(random: np.random.Generator, steps: int, actions: int) -> Array:
        drawn = random.normal(0.0, deviation, (steps, actions))
        return drawn if random.random() < 0.5 else np.zeros_like(drawn)

    return plan


def excitation(period: float) -> Plan:
    """Return the excitation for identification at a control period [s].

    Each action has one of three forms: steps between random levels, ramps between them, or a
    multisine with random phases.
    """

    def plan(random: np.random.Generator, steps: int, actions: int) -> Array:
        times = period * np.arange(steps, dtype=np.float64)
        return np.stack([_excitation(random, times) for _ in range(actions)], axis=1)

    return plan


def _excitation(random: np.random.Generator, times: Array) -> Array:
    """Return one signal of the excitation, shape (steps,)."""
    form = random.integers(3)
    if form == 2:
        phases = random.uniform(0.0, 2.0 * np.pi, len(SINES))
        waves = np.sin(2.0 * np.pi * np.outer(times, SINES) + phases) / np.sqrt(SINES)
        total: Array = waves.sum(axis=1)
        return RANGE * total / np.abs(total).max()
    most = int(times[-1] / HOLDS[0]) + 2
    shortest, longest = HOLDS
    holds = shortest * (longest / shortest) ** random.uniform(0.0, 1.0, most)
    changes = np.concatenate([[0.0], np.cumsum(holds)])
    levels = random.uniform(-RANGE, RANGE, len(changes))
    if form == 1:
        return np.interp(times, changes, levels)
    return levels[np.searchsorted(changes, times, side="right") - 1]


@dataclass(frozen=True)
class InUnits:
    """Controller of normalised signals, used with observations and actions in SI units."""

    controller: Any
    signals: Signals  # normalised
    action_signals: Signals  # normalised

    def predict(self, observation: NDArray[Any], state: Any, start: Any) -> tuple[Array, Any]:
        """Return the action, and the controller's next state."""
        values = {name: observation[..., k] for k, name in enumerate(self.signals.names())}
        action, state = self.controller.predict(self.signals.encode(values), state, start)
        inside = np.clip(np.asarray(action, np.float64), -1.0, 1.0)
        decoded = [self.action_signals.decode(inside, name) for name in self.action_signals.names()]
        return np.stack(decoded, axis=-1), state


@dataclass(frozen=True)
class Behaviour:
    """Generator of actions: a signal, added to the action of a controller if there is one."""

    name: str  # of the controller or the form of the signal
    plan: Plan
    controller: InUnits | None = None
