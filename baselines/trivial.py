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
    """Index of the next draw of each row, shape (n_env,)."""

    draw: NDArray[np.uint64]


@dataclass(frozen=True)
class Random(RowController):
    """Uniformly distributed actions, drawn in each control period.

    Draw ``k`` of row ``i`` is a function of seed, signal, ``i`` and ``k`` alone: the same calls
    give the same actions, and row ``i`` of a batch does not depend on the others.
    """

    write: Writer
    signals: Sequence[Signal]
    seed: int

    def initial_state(self, observation: ArrayLike) -> RandomState:
        """Return the state before the first draw."""
        return RandomState(np.zeros(row_count(observation), np.uint64))

    def respond(self, observation: ArrayLike, state: RandomState) -> Prediction:
        """Return the action of the next draw, and the state after it."""
        row, values = np.arange(len(state.draw), dtype=np.uint64), []
        for k, signal in enumerate(self.signals):
            seed = np.uint64((self.seed * len(self.signals) + k) % 2**32)
            share = _uniform(seed, row, state.draw)
            values.append(signal.low + (signal.high - signal.low) * share)
        return self.write(np.array(values), observation), RandomState(state.draw + np.uint64(1))


def _uniform(seed: np.uint64, row: NDArray[np.uint64], draw: NDArray[np.uint64]) -> Array:
    """Return numbers in [0, 1): finaliser of SplitMix64 on a counter (steele2014)."""
    with np.errstate(over="ignore"):
        z = (seed << np.uint64(32)) + (row << np.uint64(20)) + draw + np.uint64(1)
        z = z * np.uint64(0x9E3779B97F4A7C15)
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        z = z ^ (z >> np.uint64(31))
    return np.asarray((z >> np.uint64(11)) * 2.0**-53)


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
    return Random(*_signals(spec, joints), spec.seed)


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
