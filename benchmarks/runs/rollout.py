"""Episodes, recorded as physical signals from ``info``: one, or several as rows of a batch."""

import re
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.runs.controllers import ROOT, Controller
from pam_envs.arrays import Array
from sweeps.worker import is_needed

LONGEST = 300  # largest number of characters of a message in a row

REPLAYED = 50  # steps of an episode that are repeated with a single row after a run in a batch

Watch = Callable[[Any], None]


@dataclass(frozen=True)
class Episode:
    """Record of one episode of n steps."""

    # every entry of info, SI, and the outputs of the model that the controller follows, if it has
    # one: model/0, model/1, ...
    signals: Mapping[str, Array]
    observations: NDArray[Any]
    actions: NDArray[Any]
    # computation times of single actions; not of all steps if episodes ran as rows of a batch
    seconds: Array
    period: float
    failure: str  # reason of an early end, or message of the controller's error; empty otherwise

    @property
    def failed(self) -> bool:
        """True if a limit, a refused action or an error ended the episode."""
        return bool(self.failure)


def run(env: Any, controller: Controller, seed: int, watch: Watch | None = None) -> Episode:
    """Run one episode and record it, without any wrapping, filtering or scaling.

    ``watch`` is called with the environment after the reset and after each step (for a video). An
    error of the controller ends the episode as failed; an error that the environment raises for a
    valid action is a defect of this package, and is raised.
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
        said = dict(info.items())  # reads faster
        infos.append(tuple([said[key] for key in keys]))
        models.append(followed)
        observation, over = after, terminated or truncated
        if terminated:
            failure = _ended(info["time"])
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


@dataclass(frozen=True)
class Part:
    """Episodes of one environment among those of a batch."""

    make: Callable[[int], Any]  # makes the batched environment of a number of rows
    env: Any  # the same environment alone
    seeds: Sequence[int]


def run_all(parts: Sequence[Part], controller: Controller) -> list[list[Episode]]:
    """Run an episode for each seed of each part, as rows of one batch if that gives the same bits.

    A row of a batch is the single environment to the last bit, and a row of a controller should be.
    This is checked: the first answers in the first row of each part, and in the last row of all,
    are computed again, alone. If one differs, each episode is a batch of its own. If the controller
    takes no batch, or raises an error, the episodes are run one by one. A cancelled run raises
    RuntimeError.
    """
    alone = [replace(part, seeds=[seed]) for part in parts for seed in part.seeds]
    try:
        _check_needed()
        return _rows(parts, controller)
    except _NotAsRows:
        pass
    made: list[Episode] = []
    try:
        for part in alone:
            _check_needed()
            made += _rows([part], controller)[0]
    except _NotAsRows:  # the single run reports the error
        made = []
        for part in alone:
            _check_needed()
            made.append(run(part.env, controller, part.seeds[0]))
    episodes = iter(made)
    return [[next(episodes) for _ in part.seeds] for part in parts]


def _check_needed() -> None:
    if not is_needed():
        raise RuntimeError("cancelled: no run needs this result any more")


class _NotAsRows(Exception):
    """The controller does not accept batches, or its rows differ from single episodes."""


@contextmanager
def _batch_refused() -> Iterator[None]:
    """Treat any error of a controller as a refusal of batches."""
    try:
        yield
    except Exception as error:
        raise _NotAsRows from error


def _rows(parts: Sequence[Part], controller: Controller) -> list[list[Episode]]:
    """Return the episodes as rows of a batch; raise where they differ from single ones."""
    batches = [part.make(len(part.seeds)) for part in parts]
    episodes = _run_rows(batches, [list(part.seeds) for part in parts], controller)
    for batch in batches:
        batch.close()
    seconds: list[Array] = []
    repeated = [own[0] for own in episodes]
    if len(episodes[-1]) > 1:
        repeated.append(episodes[-1][-1])
    for episode in repeated:
        with _batch_refused():
            alone, spent = _timed(controller, episode.observations[:REPLAYED])
        together = episode.actions[:REPLAYED]
        if alone.dtype != together.dtype or not np.array_equal(alone, together, equal_nan=True):
            raise _NotAsRows
        seconds.append(spent)
    times = np.concatenate(seconds)
    return [[replace(episode, seconds=times) for episode in own] for own in episodes]


def _run_rows(
    batches: Sequence[Any], seeds: Sequence[list[int]], controller: Controller
) -> list[list[Episode]]:
    """Step until every row has ended once; return the first episode of each, without times.

    The batches are rows of one controller. A batch whose rows have all ended is no longer stepped;
    its rows stay at the first observation of another episode.
    """
    runs = [_BatchRun(*of_part) for of_part in zip(batches, seeds, strict=True)]
    model_output = getattr(controller, "model_output", None)
    ends = np.cumsum([len(own) for own in seeds])
    state = None
    while any(run.running.any() for run in runs):
        observation = np.concatenate([run.observation for run in runs])
        start = np.concatenate([run.start for run in runs])
        with _batch_refused():
            action, state = controller.predict(observation, state, start, True)
            followed = np.reshape(model_output(state) if model_output else [], (ends[-1], -1))
            if np.shape(action)[:1] != (ends[-1],):
                raise _NotAsRows
        split = zip(np.split(action, ends[:-1]), np.split(followed, ends[:-1]), strict=True)
        for run, (own, outputs) in zip(runs, split, strict=True):
            if run.running.any():
                run.step(own, outputs)
            else:
                run.start[:] = False  # the controller has begun that episode
    return [run.episodes() for run in runs]


class _BatchRun:
    """First episodes of the rows of a batched environment, while they run."""

    def __init__(self, batch: Any, seeds: list[int]) -> None:
        self.batch, count = batch, len(seeds)
        self.observation, report = batch.reset(seed=seeds)
        self.keys = tuple(report)
        self.start, self.running = np.ones(count, bool), np.ones(count, bool)
        self._lengths, self._failures = np.zeros(count, np.int64), [""] * count
        self._steps: list[tuple[Array, Array, NDArray[Any], NDArray[Any]]] = []

    def step(self, action: NDArray[Any], outputs: Array) -> None:
        """Record a step with the controller's action and its model's outputs."""
        if not _acceptable(action, self.batch):
            raise _NotAsRows
        after, _, terminated, truncated, report = self.batch.step(action)
        over = terminated | truncated
        table = np.array([report[key] for key in self.keys])
        if over.any():  # for a row that has ended, the last observation of that episode
            table[:, over] = np.array([report["final_info"][key][over] for key in self.keys])
        self._steps.append((table, outputs, self.observation, action))
        self._lengths[self.running] += 1
        for row in np.flatnonzero(self.running & terminated):
            self._failures[row] = _ended(table[self.keys.index("time"), row])
        self.running &= ~over
        self.observation = after
        self.start = over if self.running.any() else np.ones_like(over)

    def episodes(self) -> list[Episode]:
        """Return the episodes, without times."""
        signals, followed, seen, given = map(np.array, zip(*self._steps, strict=True))
        return [
            Episode(
                signals=_named(self.keys, signals[:n, :, row], followed[:n, row]),
                observations=seen[:n, row].copy(),
                actions=given[:n, row].copy(),
                seconds=np.zeros(0),
                period=float(self.batch.control_period),
                failure=self._failures[row],
            )
            for row, n in enumerate(self._lengths)
        ]


def _ended(seconds: float) -> str:
    return f"a limit ended the episode at {seconds:g} s"


def _acceptable(action: Any, env: Any) -> bool:
    """Return whether an environment must accept an action: finite numbers of the right shape."""
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
    """Return the preview horizon that a controller uses [s], measured by its actions.

    The controller gets the observations of one of its episodes again, with the last samples
    replaced by the present reference. The first replacement that changes an action marks the last
    sample in use. The preview of a signal ``reference`` is ``reference_1``, ...
    """
    ahead = _previewed({signal.name: signal.index for signal in signals})
    if not ahead or not len(episode.observations):
        return 0.0
    seconds = {signal.index: signal.ahead for signal in signals}
    plain, _ = _timed(controller, episode.observations)
    for first in range(len(ahead), 0, -1):
        masked = episode.observations.copy()
        for number in range(first, len(ahead) + 1):
            for column, present in ahead[number]:
                masked[:, column] = masked[:, present]
        pairs = zip(plain, _answers(controller, masked), strict=True)
        if not all(np.array_equal(a, b, equal_nan=True) for a, (b, _) in pairs):
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


def _timed(controller: Controller, observations: NDArray[Any]) -> tuple[NDArray[Any], Array]:
    """Return a controller's actions for an episode's observations, and their times [s]."""
    answers, seconds = zip(*_answers(controller, observations), strict=True)
    return np.array(answers), np.array(seconds)


def _answers(controller: Controller, observations: NDArray[Any]) -> Iterator[tuple[Any, float]]:
    """Yield the actions of a controller for an episode's observations, and their times [s]."""
    state, clock = None, time.perf_counter
    for i, observation in enumerate(observations):
        begin = clock()
        action, state = controller.predict(observation, state, i == 0, True)
        yield action, clock() - begin
