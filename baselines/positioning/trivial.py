"""Controllers that know nothing, or next to nothing: the floor of any comparison."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from baselines.core.controller import Answer, Array, Reader, answer, beginning, choose
from pam_envs.parameters import Signal, Signals


@dataclass(frozen=True)
class Constant:
    """The same set-point always; 0 Pa is a muscle that is left alone.

    Attributes
    ----------
    action_signal : Signal
    set_point : float
        Pressure [Pa].
    """

    action_signal: Signal
    set_point: float = 0.0

    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> Answer:
        """Return the set-point and no state, see :class:`~baselines.core.controller.Controller`."""
        rows = 1 if np.ndim(observation) == 1 else len(np.asarray(observation))
        return answer(self.action_signal, np.full(rows, self.set_point), observation), None


class RandomState(NamedTuple):
    """Which draw comes next in each row, shape (n_env,)."""

    draw: NDArray[np.uint64]


@dataclass(frozen=True)
class Random:
    """Set-points drawn evenly from the whole range, anew each control period.

    Draw ``k`` of row ``i`` is a function of seed, ``i`` and ``k`` alone (counted by the state), so
    that the same calls give the same actions, and row ``i`` of a batch does not depend on the
    others.

    Attributes
    ----------
    action_signal : Signal
    seed : int
    """

    action_signal: Signal
    seed: int = 0

    def predict(
        self,
        observation: ArrayLike,
        state: RandomState | None = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> Answer:
        """Return the next draw; see :class:`~baselines.core.controller.Controller`."""
        rows = 1 if np.ndim(observation) == 1 else len(np.asarray(observation))
        row = np.arange(rows, dtype=np.uint64)
        begin = beginning(state, episode_start, rows)
        now = choose(begin, RandomState(np.zeros(rows, np.uint64)), state)
        share = _uniform(np.uint64(self.seed % 2**32), row, now.draw)
        signal = self.action_signal
        value = signal.low + (signal.high - signal.low) * share
        return answer(signal, value, observation), RandomState(now.draw + np.uint64(1))


@dataclass(frozen=True)
class RandomEach:
    """:class:`Random` for actions of several numbers, each with a seed of its own.

    Attributes
    ----------
    draws : tuple of Random
        In the order of the action.
    """

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
        made = [
            draw.predict(rows, state and state[k], episode_start)
            for k, draw in enumerate(self.draws)
        ]
        actions = np.concatenate([action for action, _ in made], axis=1)
        answered = actions if np.ndim(observation) == 2 else actions[0]
        return answered, tuple(after for _, after in made)


def random_each(action_signals: Signals, seed: int = 0) -> RandomEach:
    """Return the controller for all numbers of an action."""
    each = list(action_signals)
    return RandomEach(tuple(Random(s, len(each) * seed + k) for k, s in enumerate(each)))


def _uniform(seed: np.uint64, row: NDArray[np.uint64], draw: NDArray[np.uint64]) -> Array:
    """Return numbers in [0, 1): the finaliser of SplitMix64 on a counter (Steele et al. 2014)."""
    with np.errstate(over="ignore"):
        z = (seed << np.uint64(32)) + (row << np.uint64(20)) + draw + np.uint64(1)
        z = z * np.uint64(0x9E3779B97F4A7C15)
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        z = z ^ (z >> np.uint64(31))
    return np.asarray((z >> np.uint64(11)) * 2.0**-53)


@dataclass(frozen=True)
class Line:
    """``set_point = slope * reference``: one straight line through a table's two end points.

    Attributes
    ----------
    reader : Reader
        Of load and reference.
    action_signal : Signal
    loads : tuple of float
        Loads [kg] of the tables.
    slopes : tuple of float
        Pressure over contraction [Pa/m] at each; the nearest load's is taken.
    offset : float
        Pressure at no contraction [Pa].
    """

    reader: Reader
    action_signal: Signal
    loads: tuple[float, ...]
    slopes: tuple[float, ...]
    offset: float = 0.0

    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> Answer:
        """Return the line's set-point; see :class:`~baselines.core.controller.Controller`."""
        load, reference = self.reader.rows(observation)
        nearest = np.abs(load[:, None] - np.array(self.loads)).argmin(axis=1)
        value = self.offset + np.array(self.slopes)[nearest] * reference
        return answer(self.action_signal, value, observation), None
