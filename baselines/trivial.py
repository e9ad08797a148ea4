"""Constant and random actions in every environment: the lower bound of any comparison."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from baselines.core.controller import Prediction, RowController, encode_actions, row_count
from baselines.core.entry import ELBOW, JOINT, KNEE, POSITIONING, Entry, Spec
from baselines.joint.base import make_joint_signal_map
from baselines.knee.published import NOMINAL_PRESSURE
from pam_envs.arrays import Array
from pam_envs.parameters import Signal

Writer = Callable[[Array, ArrayLike], NDArray[np.float32]]
"""From SI values, shape (n_signals, n_env), and the observation to the action."""


@dataclass(frozen=True)
class Constant(RowController):
    """Constant SI values, clipped to the ranges of the signals."""

    write: Writer
    values: Sequence[float]

    def respond(self, observation: ArrayLike, state: Any) -> Prediction:
        """Return the action and no state."""
        values = np.repeat(np.array(self.values)[:, None], row_count(observation), axis=1)
        return self.write(values, observation), None


class RandomState(NamedTuple):
    """Digest of the first observation, and index of the next draw, shapes (n_env,)."""

    episode: NDArray[np.uint64]
    draw: NDArray[np.uint64]


@dataclass(frozen=True)
class Random(RowController):
    """Uniformly distributed actions, drawn in each control period.

    A draw is a function of seed, signal, number and the first observation of its episode alone,
    without previewed samples: the same episodes get the same actions, and a row of a batch is the
    single episode. ``columns`` are those of the observation that count.
    """

    write: Writer
    signals: Sequence[Signal]
    columns: NDArray[np.int64]
    seed: int

    def initial_state(self, observation: ArrayLike) -> RandomState:
        """Return the state before the first draw."""
        seen = np.asarray(observation, np.float32)[..., self.columns].reshape(-1, len(self.columns))
        episode = np.zeros(len(seen), np.uint64)
        for bits in np.ascontiguousarray(seen.T).view(np.uint32):
            episode = _mixed(episode, bits)
        return RandomState(episode, np.zeros_like(episode))

    def respond(self, observation: ArrayLike, state: RandomState) -> Prediction:
        """Return the action of the next draw, and the state after it."""
        values = []
        for k, signal in enumerate(self.signals):
            seed = np.uint64((self.seed * len(self.signals) + k) % 2**32)
            bits = _mixed(_mixed(state.episode, seed), state.draw)
            share = (bits >> np.uint64(11)) * 2.0**-53
            values.append(signal.low + (signal.high - signal.low) * share)
        after = state._replace(draw=state.draw + np.uint64(1))
        return self.write(np.array(values), observation), after


def _mixed(
    start: NDArray[np.uint64], number: NDArray[np.unsignedinteger[Any]] | np.uint64
) -> NDArray[np.uint64]:
    """Return a digest of two numbers: draw ``number`` of SplitMix64 from a start (steele2014)."""
    with np.errstate(over="ignore"):
        z = start + (number + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        return np.asarray(z ^ (z >> np.uint64(31)))


def _signals(spec: Spec[Any], joints: bool) -> tuple[Writer, tuple[Signal, ...]]:
    """Return all signals, or the setpoints of joints alone: a co-contraction is kept."""
    if not joints:
        return partial(encode_actions, tuple(spec.actions)), tuple(spec.actions)
    angles = make_joint_signal_map(spec.signals, spec.actions)
    return (lambda values, observation: angles.write(values.T, observation)), angles.actions


def make_constant(spec: Spec[Any], value: float = -math.inf, joints: bool = False) -> Constant:
    """Return the controller with a value of all signals, by default their lowest."""
    write, signals = _signals(spec, joints)
    return Constant(write, (value,) * len(signals))


def make_random(spec: Spec[Any], joints: bool = False) -> Random:
    """Return the controller that draws all signals, or the setpoints of joints."""
    columns = [signal.index for signal in spec.signals if signal.ahead == 0.0]
    return Random(*_signals(spec, joints), np.array(columns), spec.seed)


TRIVIAL = partial(Entry, knowledge="nothing")
ENTRIES = {
    "zero": TRIVIAL("constant pressure of 0", make=make_constant, envs=(*POSITIONING, *KNEE)),
    "random": TRIVIAL(
        "uniformly distributed set-points, seeded",
        make=make_random,
        envs=(*POSITIONING, *KNEE),
        seeded=True,
    ),
    "knee_hold": TRIVIAL(
        "constant nominal pressure of 2 bar",
        make=partial(make_constant, value=NOMINAL_PRESSURE),
        envs=KNEE,
    ),
    "elbow_limp": TRIVIAL(
        "constant pressure of 0; on/off exhaust valves open", make=make_constant, envs=ELBOW
    ),
    "elbow_random": TRIVIAL(
        "uniformly distributed commands, seeded", make=make_random, envs=ELBOW, seeded=True
    ),
    "joint_straight": TRIVIAL(
        "set-points of 0", make=partial(make_constant, value=0.0, joints=True), envs=JOINT
    ),
    "joint_random": TRIVIAL(
        "uniformly distributed set-points, seeded",
        make=partial(make_random, joints=True),
        envs=JOINT,
        seeded=True,
    ),
}
