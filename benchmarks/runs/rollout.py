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

REPLAYED = 100  # steps of an episode that are repeated with a single row after a run in a batch

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


def run_all(
    make: Callable[[int], Any], env: Any, controller: Controller, seeds: Sequence[int]
) -> list[Episode]:
    """Run an episode for each seed, as rows of a batch if that gives the same bits.

    A row of a batch is the single environment to the last bit, and a row of a controller should be.
    This is checked: the first answers in the first and the last row are computed again, alone.
    If one differs, each episode is a batch of its own. If the controller takes no batch, or raises
    an error, the episodes are run one by one. A cancelled run raises RuntimeError.
    ``make`` makes the batched environment of a number of rows; ``env`` is the same one alone.
    """
    for groups in ([list(seeds)], [[seed] for seed in seeds]):
        made: list[Episode] = []
        for group in groups:
            _check_needed()
            try:
                made += _rows(make(len(group)), controller, group)
            except _NotAsRows:  # the single run reports the error
                break
        else:
            return made
    episodes = []
    for seed in seeds:
        _check_needed()
        episodes.append(run(env, controller, seed))
    return episodes


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


def _rows(batch: Any, controller: Controller, seeds: Sequence[int]) -> list[Episode]:
    """Return the episodes as rows of a batch; raise where they differ from single ones."""
    episodes = _run_rows(batch, controller, seeds)
    batch.close()
    seconds: list[Array] = []
    for row in sorted({0, len(seeds) - 1}):
        with _batch_refused():
            alone, spent = _timed(controller, episodes[row].observations[:REPLAYED])
        together = episodes[row].actions[:REPLAYED]
        if alone.dtype != together.dtype or not np.array_equal(alone, together, equal_nan=True):
            raise _NotAsRows
        seconds.append(spent)
    return [replace(episode, seconds=np.concatenate(seconds)) for episode in episodes]


def _run_rows(batch: Any, controller: Controller, seeds: Sequence[int]) -> list[Episode]:
    """Step until every row has ended once; return the first episode of each, without times."""
    count = len(seeds)
    observation, report = batch.reset(seed=list(seeds))
    keys = tuple(report)
    model_output = getattr(controller, "model_output", None)
    infos, models, observations, actions = [], [], [], []
    state, start, running = None, np.ones(count, bool), np.ones(count, bool)
    lengths, failures = np.zeros(count, np.int64), [""] * count
    while running.any():
        with _batch_refused():
            action, state = controller.predict(observation, state, start, True)
            models.append(np.reshape(model_output(state) if model_output else [], (count, -1)))
        if not _acceptable(action, batch):
            raise _NotAsRows
        after, _, terminated, truncated, report = batch.step(action)
        start = terminated | truncated
        table = np.array([report[key] for key in keys])
        if start.any():  # for a row that has ended, the last observation of that episode
            table[:, start] = np.array([report["final_info"][key][start] for key in keys])
        infos.append(table)
        observations.append(observation)
        actions.append(action)
        lengths[running] += 1
        for row in np.flatnonzero(running & terminated):
            failures[row] = _ended(table[keys.index("time"), row])
        observation, running = after, running & ~start
    signals, followed, seen, given = map(np.array, (infos, models, observations, actions))
    return [
        Episode(
            signals=_named(keys, signals[:n, :, row], followed[:n, row]),
            observations=seen[:n, row].copy(),
            actions=given[:n, row].copy(),
            seconds=np.zeros(0),
            period=float(batch.control_period),
            failure=failures[row],
        )
        for row, n in enumerate(lengths)
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
        if not np.array_equal(_timed(controller, masked)[0], plain, equal_nan=True):
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
    answers, seconds, state, clock = [], [], None, time.perf_counter
    for i, observation in enumerate(observations):
        begin = clock()
        action, state = controller.predict(observation, state, i == 0, True)
        seconds.append(clock() - begin)
        answers.append(action)
    return np.array(answers), np.array(seconds)
