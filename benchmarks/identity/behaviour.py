"""Behaviour under fixed inputs: trajectories of environments and actions of controllers.

The fixed actions are computed from integers and the environments' steps are bit-exact on every
processor, so that the hash of a trajectory is portable. The design of a controller may use
iterations that round differently; its actions are compared within a tolerance.
"""

import base64
import zlib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from baselines.core.controller import RowController
from baselines.core.recorded_answers import answers
from benchmarks.identity.hashing import arrays_digest
from benchmarks.runs import rollout
from benchmarks.scoring.metrics import scores_of

SEED = 1
HOLD = 25  # control periods for which an action is held
SHARE = 0.6  # largest action in half ranges: no scenario of the board ends early under it
LEVELS = 5
PERIODS = 12
"""Number of observations, from the start of each part of a trajectory, given to controllers."""
SCALES = (1.0, 0.25, 1.0, 0.25)
"""Parts of a trajectory, and the factor of their distance from its first observation.

With small errors fewer actions are saturated, where they would carry no information.
"""
TOLERANCE = 1e-6  # largest difference of two actions, in action ranges, that counts as rounding
FLIPPED = 0.01  # share of actions that may differ: a setpoint is rounded to the valve's resolution
DIGITS = 10  # significant digits of a score; sums of numpy may differ beyond them

Array = NDArray[np.float32]
Sequences = tuple[Array, ...]


class FixedActions:
    """Controller of levels held for a quarter of a second, independent of the observation."""

    def __init__(self, space: Any) -> None:
        self.middle = (space.high + space.low) / 2
        self.half = (space.high - space.low) / 2

    def predict(self, observation: Any, state: Any = None, *_: Any) -> tuple[Array, int]:
        """Return the action of the present control period, and the number of the next one."""
        period = 0 if state is None else state
        action = self.middle + SHARE * self.half * self._levels(period // HOLD)
        return action.astype(np.float32), period + 1

    def model_output(self, state: int) -> Array:
        """Return the levels as the model output that some metrics require."""
        return self._levels(state // HOLD)

    def _levels(self, number: int) -> Any:
        channels = np.arange(len(self.middle)) * (1 + number % 2)
        steps = (3 * number + 2 * channels + number**2) % (2 * LEVELS + 1)
        return (steps - LEVELS) / LEVELS


@dataclass(frozen=True)
class Behaviour:
    """Behaviour of a scenario under fixed actions."""

    trajectory: str  # hash of observations and physical signals, without reward terms
    # metrics of that episode, and of the same one as a failed one, to ten digits
    scores: Mapping[str, str]
    observations: Sequences  # consecutive ones from the start of each part


def of_environment(env: Any, content: Mapping[str, Any], rests: bool) -> Behaviour:
    """Return the behaviour of an environment in one episode, scored by its scenario file."""
    episode = rollout.run(env, FixedActions(env.action_space), SEED)
    signals = [v for name, v in episode.signals.items() if not name.startswith(("reward", "model"))]
    found = scores_of(episode, content, rests)
    failed = scores_of(episode, content, rests, failed=True)
    scores = {name: f"{found[name]:.{DIGITS}g} {failed[name]:.{DIGITS}g}" for name in found}
    return Behaviour(
        arrays_digest([episode.observations, *signals]), scores, _sequences(episode.observations)
    )


def _sequences(observations: Any) -> Sequences:
    """Return the observations for controllers, computed by operations that round equally."""
    parts = np.array_split(observations.astype(np.float32), len(SCALES))
    first = parts[0][:1]
    scaled = zip(SCALES, parts, strict=True)
    return tuple(first + np.float32(scale) * (part[:PERIODS] - first) for scale, part in scaled)


def of_controller(controller: Any, observations: Sequences, space: Any) -> Array:
    """Return actions (n, n_actions) in action ranges; fewer rows where the controller fails."""
    found = [np.zeros((0, *space.shape))]
    for given in _each(controller, observations):
        found.append((given.astype(np.float64) - space.low) / (space.high - space.low))
    return np.concatenate(found).astype(np.float32)


def _each(controller: Any, observations: Sequences) -> Iterator[Array]:
    """Yield the actions for each sequence until one fails; at once by rows where that works."""
    if isinstance(controller, RowController) and len({len(part) for part in observations}) == 1:
        with suppress(Exception):
            yield from answers(controller, np.stack(observations, axis=1)).swapaxes(0, 1)
            return
    with suppress(Exception):
        for sequence in observations:
            yield answers(controller, sequence)


def difference(first: Array, second: Array) -> float:
    """Return the largest difference of actions in action ranges, except ``FLIPPED`` of them.

    It is infinite for different shapes.
    """
    if first.shape != second.shape or not np.array_equal(np.isnan(first), np.isnan(second)):
        return float("inf")
    apart = np.sort(np.abs(first - second)[~np.isnan(first)])
    kept = len(apart) - int(FLIPPED * len(apart))
    return float(apart[kept - 1]) if kept else 0.0


def pack(given: Array) -> dict[str, Any]:
    """Return actions in JSON's types, to the last bit."""
    data = zlib.compress(given.astype("<f4").tobytes(), 9)
    return {"shape": list(given.shape), "data": base64.b85encode(data).decode()}


def unpack(packed: Mapping[str, Any]) -> Array:
    """Return the actions written by :func:`pack`."""
    data = zlib.decompress(base64.b85decode(packed["data"]))
    return np.frombuffer(data, "<f4").reshape(packed["shape"])
