"""Episodes, recorded as physical signals from ``info``: one, or several as rows of a batch."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.runs.controllers import ROOT, Controller
from sweeps.worker import is_needed

LONGEST = 300
"""Characters of a message that a row keeps."""

REPLAYED = 100
"""Steps of an episode that a controller is asked for again, alone, after it ran in a batch."""

Array = NDArray[np.float64]
Watch = Callable[[Any], None]


@dataclass(frozen=True)
class Episode:
    """Record of one episode of n steps.

    Attributes
    ----------
    signals : mapping of (n,) array
        Every entry of ``info``, SI; and ``model/0``, ``model/1``, ... where the controller has a
        model to follow: the outputs of that model.
    observations : (n, n_obs) array
        Inputs of the controller.
    actions : (n, n_act) array
        Its outputs.
    seconds : (m,) array
        Times that answers to one observation took [s], not of all steps where episodes ran as
        rows of a batch.
    period : float
        Control period [s].
    failure : str
        Reason of an early end, the message of the error if a controller raised one; empty
        otherwise.
    """

    signals: Mapping[str, Array]
    observations: NDArray[Any]
    actions: NDArray[Any]
    seconds: Array
    period: float
    failure: str

    @property
    def failed(self) -> bool:
        """True if a limit, a refused action or an error ended the episode."""
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
    model_output = getattr(controller, "model_output", None)
    over = False
    if watch:
        watch(env)
    while not over:
        try:
            begin = clock()
            action, state = controller.predict(observation, state, start, True)
            spent = clock() - begin
            followed = np.ravel(model_output(state)).tolist() if model_output else []
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
        signals=_named(keys, table, np.array(models, np.float64)),
        observations=np.array(observations),
        actions=np.array(actions),
        seconds=np.array(seconds),
        period=float(env.unwrapped.control_period),
        failure=failure,
    )


def _named(keys: Sequence[str], table: Array, models: Array) -> dict[str, Array]:
    """Return the columns of ``info`` and of a model's output, by name."""
    return {
        **{key: np.ascontiguousarray(table[:, i]) for i, key in enumerate(keys)},
        **{f"model/{k}": one.copy() for k, one in enumerate(models.T)},
    }


# --- several at once ---------------------------------------------------------------------------


def run_all(
    make: Callable[[int], Any], env: Any, controller: Controller, seeds: Sequence[int]
) -> list[Episode]:
    """Run an episode for each seed, as rows of a batch where that gives the same bits.

    A row of a batch is the single environment to the last bit, and a row of a controller should be.
    This is checked: the first answers in the first and the last row are computed again, alone.
    If one differs, each episode is a batch of its own. If the controller takes no batch, or raises
    an error, the episodes are run one by one.

    Parameters
    ----------
    make : callable
        From a number of rows to the batched environment.
    env : gymnasium.Env
        The same environment alone.
    controller : Controller
    seeds : sequence of int
        Of the environment's resets.

    Raises
    ------
    RuntimeError
        If the run was cancelled.
    Exception
        Whatever the environment raises of an action that it has to take; see :func:`run`.
    """
    for groups in ([list(seeds)], [[seed] for seed in seeds]):
        made: list[Episode] = []
        for group in groups:
            _still_wanted()
            try:
                made += _rows(make(len(group)), controller, group)
            except _NotAsRows:  # the single run reports the error
                break
        else:
            return made
    episodes = []
    for seed in seeds:
        _still_wanted()
        episodes.append(run(env, controller, seed))
    return episodes


def _still_wanted() -> None:
    if not is_needed():
        raise RuntimeError("nobody waits for it any more")


class _NotAsRows(Exception):
    """The controller takes no batch, or its rows differ from single episodes."""


def _rows(batch: Any, controller: Controller, seeds: Sequence[int]) -> list[Episode]:
    """Return the episodes as rows of a batch; raise where they differ from single ones."""
    course = _run_rows(batch, controller, seeds)
    batch.close()
    seconds: list[Array] = []
    for row in sorted({0, len(seeds) - 1}):
        first = min(REPLAYED, int(course.lengths[row]))
        with _asked():
            alone, spent = _timed(controller, course.observations[:first, row])
        together = course.actions[:first, row]
        if alone.dtype != together.dtype or not np.array_equal(alone, together, equal_nan=True):
            raise _NotAsRows
        seconds.append(spent)
    spent = np.concatenate(seconds)
    period = float(batch.control_period)
    return [course.episode(row, spent, period) for row in range(len(seeds))]


@dataclass(frozen=True)
class _Course:
    """Record of a batch over n steps, until its last row ended.

    Attributes
    ----------
    keys : tuple of str
        Of ``info``.
    infos : (n, n_keys, n_rows) array
    models : (n, n_rows, n_outputs) array
    observations : (n, n_rows, n_obs) array
    actions : (n, n_rows, n_act) array
    lengths : (n_rows,) array
        Steps of each row's first episode.
    failures : list of str
    """

    keys: tuple[str, ...]
    infos: Array
    models: Array
    observations: NDArray[Any]
    actions: NDArray[Any]
    lengths: NDArray[np.int64]
    failures: list[str]

    def episode(self, row: int, seconds: Array, period: float) -> Episode:
        """Return the first episode of a row."""
        n = int(self.lengths[row])
        return Episode(
            signals=_named(self.keys, self.infos[:n, :, row], self.models[:n, row]),
            observations=self.observations[:n, row].copy(),
            actions=self.actions[:n, row].copy(),
            seconds=seconds,
            period=period,
            failure=self.failures[row],
        )


@contextmanager
def _asked() -> Iterator[None]:
    """Treat any error of a controller as a refusal of batches."""
    try:
        yield
    except Exception as error:
        raise _NotAsRows from error


def _run_rows(batch: Any, controller: Controller, seeds: Sequence[int]) -> _Course:
    """Step until every row has ended once."""
    count = len(seeds)
    observation, report = batch.reset(seed=list(seeds))
    keys = tuple(report)
    model_output = getattr(controller, "model_output", None)
    infos, models, observations, actions = [], [], [], []
    state, start, running = None, np.ones(count, bool), np.ones(count, bool)
    lengths, failures = np.zeros(count, np.int64), [""] * count
    while running.any():
        with _asked():
            action, state = controller.predict(observation, state, start, True)
            models.append(np.reshape(model_output(state) if model_output else [], (count, -1)))
        if not _acceptable(action, batch):
            raise _NotAsRows
        after, _, terminated, truncated, report = batch.step(action)
        start = terminated | truncated
        table = np.array([report[key] for key in keys])
        if start.any():  # of a row that has ended, the last of that episode
            table[:, start] = np.array([report["final_info"][key][start] for key in keys])
        infos.append(table)
        observations.append(observation)
        actions.append(action)
        lengths[running] += 1
        for row in np.flatnonzero(running & terminated):
            end = table[keys.index("time"), row]
            failures[row] = f"a limit ended the episode at {end:g} s"
        observation, running = after, running & ~start
    return _Course(
        keys,
        np.array(infos),
        np.array(models),
        np.array(observations),
        np.array(actions),
        lengths,
        failures,
    )


def _acceptable(action: Any, env: Any) -> bool:
    """Return whether an environment has to take an action: numbers of the right shape."""
    try:
        given = np.asarray(action, np.float64)
    except (TypeError, ValueError):
        return False
    return given.shape == env.action_space.shape and bool(np.isfinite(given).all())


def _sentence(error: Exception) -> str:
    """Return kind and message of an error, without addresses and paths."""
    text = f"{type(error).__name__}: {error}".replace(f"{ROOT}/", "")
    text = re.sub(r"0x[0-9a-fA-F]{6,}", "0x...", " ".join(text.split()))
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."


def preview_used(episode: Episode, controller: Controller, signals: Any) -> float:
    """Return the preview horizon that a controller uses [s], measured by its answers.

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
        return 0.0
    seconds = {signal.index: signal.ahead for signal in signals}
    plain = _answers(controller, episode.observations)
    for first in range(len(ahead), 0, -1):
        masked = episode.observations.copy()
        for number in range(first, len(ahead) + 1):
            for column, present in ahead[number]:
                masked[:, column] = masked[:, present]
        if not np.array_equal(_answers(controller, masked), plain, equal_nan=True):
            return round(max(seconds[column] for column, _ in ahead[first]), 9)
    return 0.0


def _previewed(index: Mapping[str, int]) -> dict[int, list[tuple[int, int]]]:
    """Return the columns of each preview sample, 1, 2, ..., with those of the present value."""
    found: dict[int, list[tuple[int, int]]] = {}
    for name, column in index.items():
        base, _, number = name.rpartition("_")
        if number.isdigit() and base in index:
            found.setdefault(int(number), []).append((column, index[base]))
    return found


def _answers(controller: Controller, observations: NDArray[Any]) -> NDArray[Any]:
    return _timed(controller, observations)[0]


def _timed(controller: Controller, observations: NDArray[Any]) -> tuple[NDArray[Any], Array]:
    """Return a controller's answers to an episode's observations, and their times [s]."""
    answers, seconds, state, clock = [], [], None, time.perf_counter
    for i, observation in enumerate(observations):
        begin = clock()
        action, state = controller.predict(observation, state, i == 0, True)
        seconds.append(clock() - begin)
        answers.append(action)
    return np.array(answers), np.array(seconds)
