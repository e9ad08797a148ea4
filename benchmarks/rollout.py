"""One episode, recorded as physical signals from ``info``."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.controllers import ROOT, Controller

LONGEST = 300
"""Characters of a message that a row keeps."""

Array = NDArray[np.float64]
Watch = Callable[[Any], None]


@dataclass(frozen=True)
class Episode:
    """What was recorded of one episode of n steps.

    Attributes
    ----------
    signals : mapping of (n,) array
        Every entry of ``info``, SI; and ``model/0``, ``model/1``, ... where the controller has a
        model to follow: what it says that each output of the model is then.
    observations : (n, n_obs) array
        What the controller was given at each step.
    actions : (n, n_act) array
        What it answered.
    seconds : (n,) array
        Time that each answer took [s].
    period : float
        Control period [s].
    failure : str
        Why the episode ended before its time, in the words of the error where a controller raised
        one; empty if it did not.
    """

    signals: Mapping[str, Array]
    observations: NDArray[Any]
    actions: NDArray[Any]
    seconds: Array
    period: float
    failure: str

    @property
    def failed(self) -> bool:
        """Whether a limit, a refused action or an error ended the episode."""
        return bool(self.failure)


def run(env: Any, controller: Controller, seed: int, watch: Watch | None = None) -> Episode:
    """Run one episode and record it; nothing is wrapped, filtered or scaled on the way.

    Parameters
    ----------
    env : gymnasium.Env
        With the package's named signals and ``info``.
    controller : Controller
    seed : int
        Of the environment's reset.
    watch : callable, optional
        Called with the environment after the reset and after each step (for a video).

    Raises
    ------
    Exception
        Whatever the environment raises of an action that it has to take: an error of the project's
        own, and no result. What the controller raises is one.
    """
    observation, first = env.reset(seed=seed)
    keys = tuple(first)
    infos: list[tuple[float, ...]] = []
    observations, actions, seconds, models = [], [], [], []
    state, start, failure, clock = None, True, "", time.perf_counter
    told = getattr(controller, "model_output", None)
    over = False
    if watch:
        watch(env)
    while not over:
        try:
            begin = clock()
            action, state = controller.predict(observation, state, start, True)
            spent = clock() - begin
            followed = np.ravel(told(state)).tolist() if told else []
        except Exception as error:
            failure = _sentence(error)
            break
        try:
            after, _, terminated, truncated, info = env.step(action)
        except Exception as error:
            if _acceptable(action, env):
                raise
            failure = _sentence(error)
            break
        start = False
        observations.append(observation)
        actions.append(action)
        seconds.append(spent)
        infos.append(tuple([info[key] for key in keys]))
        models.append(followed)
        observation, over = after, terminated or truncated
        if terminated:
            failure = f"a limit ended the episode at {info['time']:g} s"
        if watch:
            watch(env)
    table = np.array(infos, np.float64).reshape(-1, len(keys))
    return Episode(
        signals={
            **{key: np.ascontiguousarray(table[:, i]) for i, key in enumerate(keys)},
            **{f"model/{k}": one.copy() for k, one in enumerate(np.array(models, np.float64).T)},
        },
        observations=np.array(observations),
        actions=np.array(actions),
        seconds=np.array(seconds),
        period=float(env.unwrapped.control_period),
        failure=failure,
    )


def _acceptable(action: Any, env: Any) -> bool:
    """Return whether an environment has to take an action: numbers of the right shape."""
    try:
        given = np.asarray(action, np.float64)
    except (TypeError, ValueError):
        return False
    return given.shape == env.action_space.shape and bool(np.isfinite(given).all())


def _sentence(error: Exception) -> str:
    """Return kind and message of an error, without what differs from run to run."""
    text = f"{type(error).__name__}: {error}".replace(f"{ROOT}/", "")
    text = re.sub(r"0x[0-9a-fA-F]{6,}", "0x...", " ".join(text.split()))
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."


def preview_used(episode: Episode, controller: Controller, signals: Any) -> int:
    """Return how many preview samples a controller reads, measured on what it does.

    The episode's observations are shown to it again with the last samples replaced by the
    present reference. The first replacement that changes an action marks the last sample in use.

    Parameters
    ----------
    episode : Episode
        An episode of this controller.
    controller : Controller
    signals : Signals
        Of the observation; the preview of a signal ``reference`` is ``reference_1``, ...
    """
    ahead = _previewed({signal.name: signal.index for signal in signals})
    if not ahead or not len(episode.observations):
        return 0
    plain = _answers(controller, episode.observations)
    for first in range(len(ahead), 0, -1):
        masked = episode.observations.copy()
        for number in range(first, len(ahead) + 1):
            for column, present in ahead[number]:
                masked[:, column] = masked[:, present]
        if not np.array_equal(_answers(controller, masked), plain, equal_nan=True):
            return first
    return 0


def _previewed(index: Mapping[str, int]) -> dict[int, list[tuple[int, int]]]:
    """Return the columns of each preview sample, 1, 2, ..., with those of the present value."""
    found: dict[int, list[tuple[int, int]]] = {}
    for name, column in index.items():
        base, _, number = name.rpartition("_")
        if number.isdigit() and base in index:
            found.setdefault(int(number), []).append((column, index[base]))
    return found


def _answers(controller: Controller, observations: NDArray[Any]) -> NDArray[Any]:
    answers, state = [], None
    for i, observation in enumerate(observations):
        action, state = controller.predict(observation, state, i == 0, True)
        answers.append(action)
    return np.array(answers)
