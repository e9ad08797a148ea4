"""Constant and random actions in every environment: the lower bound of any comparison."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from baselines.core.controller import Array, Prediction, RowController, encode_actions, row_count
from baselines.core.entry import Entry
from baselines.core.environments import ELBOW, KNEE, POSITIONING
from baselines.knee.published import NOMINAL_PRESSURE
from pam_envs.parameters import Signal, Signals


@dataclass(frozen=True)
class Constant(RowController):
    """Constant action.

    Attributes
    ----------
    signals : sequence of Signal
        All signals of the action.
    values : sequence of float
        In SI; clipped to the ranges of the signals.
    """

    signals: Sequence[Signal]
    values: Sequence[float]

    def initial_state(self, observation: ArrayLike) -> None:
        """Return no state."""

    def respond(self, observation: ArrayLike, state: Any) -> Prediction:
        """See :class:`~baselines.core.controller.RowController`."""
        values = np.repeat(np.array(self.values)[:, None], row_count(observation), axis=1)
        return encode_actions(self.signals, values, observation), None


class RandomState(NamedTuple):
    """Index of the next draw of each row, shape (n_env,)."""

    draw: NDArray[np.uint64]


@dataclass(frozen=True)
class Random(RowController):
    """Uniformly distributed actions, drawn in each control period.

    Draw ``k`` of row ``i`` is a function of seed, signal, ``i`` and ``k`` alone: the same calls
    give the same actions, and row ``i`` of a batch does not depend on the others.

    Attributes
    ----------
    signals : sequence of Signal
        Signals to draw.
    seed : int
    """

    signals: Sequence[Signal]
    seed: int = 0

    def initial_state(self, observation: ArrayLike) -> RandomState:
        """Return the state before the first draw."""
        return RandomState(np.zeros(row_count(observation), np.uint64))

    def respond(self, observation: ArrayLike, state: RandomState) -> Prediction:
        """Return the action of the next draw, and the state after it."""
        values, after = self.draw(state)
        return encode_actions(self.signals, values, observation), after

    def draw(self, state: RandomState) -> tuple[Array, RandomState]:
        """Return SI values, shape (n_signals, n_env), and the next state."""
        row, values = np.arange(len(state.draw), dtype=np.uint64), []
        for k, signal in enumerate(self.signals):
            seed = np.uint64((self.seed * len(self.signals) + k) % 2**32)
            share = _uniform(seed, row, state.draw)
            values.append(signal.low + (signal.high - signal.low) * share)
        return np.array(values), RandomState(state.draw + np.uint64(1))


def _uniform(seed: np.uint64, row: NDArray[np.uint64], draw: NDArray[np.uint64]) -> Array:
    """Return numbers in [0, 1): finaliser of SplitMix64 on a counter (steele2014)."""
    with np.errstate(over="ignore"):
        z = (seed << np.uint64(32)) + (row << np.uint64(20)) + draw + np.uint64(1)
        z = z * np.uint64(0x9E3779B97F4A7C15)
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        z = z ^ (z >> np.uint64(31))
    return np.asarray((z >> np.uint64(11)) * 2.0**-53)


def make_zero(_plant: Any, _signals: Signals, action_signals: Signals) -> Constant:
    """Return the controller with pressures of 0 Pa, and on/off exhausts open."""
    return Constant(tuple(action_signals), tuple(s.low for s in action_signals))


def make_constant_pressure(_plant: Any, _signals: Signals, action_signals: Signals) -> Constant:
    """Return the controller with the nominal pressure of the knee orthosis."""
    return Constant((action_signals["pressure_set_point"],), (NOMINAL_PRESSURE,))


def make_random(_plant: Any, _signals: Signals, action_signals: Signals, seed: int = 0) -> Random:
    """Return the controller that draws all signals of the action."""
    return Random(tuple(action_signals), seed)


ENTRIES = {
    "zero": Entry("constant pressure of 0", "nothing", make_zero, envs=(*POSITIONING, *KNEE)),
    "random": Entry(
        "uniformly distributed set-points, seeded",
        "nothing",
        make_random,
        envs=(*POSITIONING, *KNEE),
        seeded=True,
    ),
    "knee_hold": Entry(
        "constant nominal pressure of 2 bar", "nothing", make_constant_pressure, envs=KNEE
    ),
    "elbow_limp": Entry(
        "constant pressure of 0; on/off exhaust valves open", "nothing", make_zero, envs=ELBOW
    ),
    "elbow_random": Entry(
        "uniformly distributed commands, seeded", "nothing", make_random, envs=ELBOW, seeded=True
    ),
}
