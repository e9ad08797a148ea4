"""Recording of a data set in the format of Minari: episodes, drawn parameters, splits."""

import dataclasses
import json
import os
import tempfile
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import minari  # type: ignore[import-untyped]
import numpy as np
from minari import namespace as namespaces
from minari.data_collector.episode_buffer import (  # type: ignore[import-untyped]
    EpisodeBuffer,
)

import pam_envs
from agents.settings.seeds import dataset as episode_seeds
from benchmarks.datasets.behaviours import KINDS, Behaviour
from benchmarks.datasets.croissant import describe
from pam_envs.arrays import Array
from pam_envs.envs.core.step import MEMBER
from pam_envs.kernels.build import LANES
from sweeps.progress import Start

ROWS = 64
"""Episodes that are simulated together."""
INSIDE = 0.8
"""Share of the drawn plants in the box of training and validation; the others are the test."""
SPLITS = ("train", "validation", "test")
LOCATION = "MINARI_DATASETS_PATH"


@dataclass(frozen=True)
class Job:
    """A data set to record."""

    env: str
    kind: str
    arguments: Mapping[str, Any]  # of the environment, which is in SI units
    steps: int  # at least, in whole episodes
    noise: float  # standard deviation, in units of half the action's range

    @property
    def id(self) -> str:
        """Identifier of Minari, for example ``PAM/KneeWalk/expert-v0``."""
        name, _, version = self.env.rpartition("-")
        return f"{name}/{self.kind}-{version}"

    def settings(self, behaviour: Behaviour) -> dict[str, Any]:
        """Return what determines the data, with the version of the package."""
        return {
            **dataclasses.asdict(self),
            "behaviour": behaviour.name,
            "pam_envs": pam_envs.__version__,
        }


@dataclass(frozen=True)
class Drawn:
    """Parameters of a plant that an episode has drawn, with their ranges; SI."""

    values: dict[str, float]
    ranges: dict[str, tuple[float, float]]

    def split(self, episode: int) -> str:
        """Return the split of an episode.

        The plants of training and validation are in a box around the centre of the declared
        ranges, which holds the share ``INSIDE`` of all plants; those of the test are outside.
        """
        side = INSIDE ** (1.0 / max(len(self.values), 1))
        for name, value in self.values.items():
            low, high = self.ranges[name]
            if abs(2.0 * (value - low) / (high - low) - 1.0) > side:
                return "test"
        return "validation" if episode % 10 == 9 else "train"

    def label(self, episode: int) -> dict[str, Any]:
        """Return the metadata of an episode: split and drawn parameters."""
        values = {f"parameters/{name}": value for name, value in self.values.items()}
        return {"split": self.split(episode), **values}


def drawn_parameters(env: Any, rows: int) -> list[Drawn]:
    """Return the drawn parameters of the present episodes of a batch, one entry a row."""
    base = env.unwrapped
    state, names = base.get_state(), list(base.plant.names)
    if not base.setup.drawn:
        return [Drawn({}, {})] * rows
    low, high = base.setup.parameter_limits(state["counts"][:, MEMBER])
    made = []
    for tile, lane in (divmod(row, LANES) for row in range(rows)):
        ends = np.stack([low[tile, : len(names), lane], high[tile, : len(names), lane]], axis=1)
        chosen = [k for k, (least, most) in enumerate(ends) if least < most]
        values = {names[k]: float(state["fixed"][tile, k, lane]) for k in chosen}
        ranges = {names[k]: (float(ends[k, 0]), float(ends[k, 1])) for k in chosen}
        made.append(Drawn(values, ranges))
    return made


def rollout(
    env: Any, behaviour: Behaviour, kind: str, seeds: Sequence[int]
) -> tuple[list[EpisodeBuffer], list[Drawn]]:
    """Return one episode for each seed, simulated together, and the parameters that they drew."""
    base, count = env.unwrapped, len(seeds)
    steps, actions = base.setup.episode_steps, len(base.action_signals)
    generators = [np.random.default_rng([seed, KINDS.index(kind)]) for seed in seeds]
    plans = np.stack([behaviour.plan(random, steps, actions) for random in generators], axis=1)
    space = env.single_action_space
    middle, half = (space.high + space.low) / 2.0, (space.high - space.low) / 2.0
    observation, info = env.reset(seed=list(seeds))
    drawn = drawn_parameters(env, count)
    keys = [key for key in info if key in ("output", "reference") or key.startswith("state/")]
    columns: tuple[list[Any], ...] = ([observation], [], [], [], [], [_table(info, keys)])
    state, start, lengths = None, np.ones(count, bool), np.zeros(count, np.int64)
    running = np.ones(count, bool)
    for step in range(steps):
        action = middle + half * plans[step]
        if behaviour.controller is not None:
            asked, state = behaviour.controller.predict(observation, state, start)
            action = asked + half * plans[step]
        action = np.clip(action, space.low, space.high).astype(np.float32)
        observation, reward, terminated, truncated, info = env.step(action)
        start = terminated | truncated
        last, table = observation, _table(info, keys)
        if start.any():
            final = info["final_info"]
            last, table = observation.copy(), np.where(start, _table(final, keys), table)
            last[start] = np.stack(list(info["final_obs"][start]))
        values = (last, action, reward, terminated, truncated, table)
        for column, value in zip(columns, values, strict=True):
            column.append(value)
        lengths += running
        running &= ~start
        if not running.any():
            break
    whole = tuple(map(np.array, columns))
    numbers = lengths.tolist()
    return [_episode(whole, keys, row, n, seeds[row]) for row, n in enumerate(numbers)], drawn


def _table(info: Mapping[str, Any], keys: Sequence[str]) -> Array:
    return np.array([info[key] for key in keys])


def _episode(
    whole: tuple[Any, ...], keys: Sequence[str], row: int, steps: int, seed: int
) -> EpisodeBuffer:
    """Return one row of a batch as an episode."""
    seen, given, rewards, terminations, truncations, infos = whole
    values = infos[: steps + 1, :, row].astype(np.float32)
    return EpisodeBuffer(
        seed=int(seed),
        observations=seen[: steps + 1, row].copy(),
        actions=given[:steps, row].copy(),
        rewards=rewards[:steps, row].copy(),
        terminations=terminations[:steps, row].copy(),
        truncations=truncations[:steps, row].copy(),
        infos={key: values[:, k].copy() for k, key in enumerate(keys)},
    )


@contextmanager
def location(folder: Path) -> Iterator[None]:
    """Let Minari write below a folder."""
    before = os.environ.get(LOCATION)
    os.environ[LOCATION] = str(folder.resolve())
    try:
        yield
    finally:
        del os.environ[LOCATION]
        if before is not None:
            os.environ[LOCATION] = before


def record(job: Job, behaviour: Behaviour, out: Path, start: Start) -> Path:
    """Write a data set below ``out`` and return its folder; an existing one is kept.

    Raises
    ------
    ValueError
        If the folder holds data of other settings.
    """
    folder, settings = out / job.id, json.loads(json.dumps(job.settings(behaviour)))
    if folder.exists():
        if metadata_of(folder).get("settings") != settings:
            raise ValueError(
                f"{folder} holds data of other settings; remove it, or give another --out"
            )
        return folder
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=out, prefix=".partial-") as partial:
        with location(Path(partial)):
            _write(job, behaviour, settings, start)
        made = Path(partial) / job.id
        text = json.dumps(describe(made, metadata_of(made)), indent=1, sort_keys=True)
        (made / "croissant.json").write_text(f"{text}\n", encoding="utf-8")
        with location(out):
            namespace = str(Path(job.id).parent)
            if namespace not in namespaces.list_local_namespaces():
                namespaces.create_namespace(namespace)
        os.rename(made, folder)
    return folder


def _write(job: Job, behaviour: Behaviour, settings: dict[str, Any], start: Start) -> None:
    """Simulate the episodes and write them with their metadata."""
    env = gym.make(job.env, **job.arguments)
    base: Any = env.unwrapped
    count = -(-job.steps // base.setup.episode_steps)
    rows = -(-count // -(-count // ROWS))  # equal batches
    batch = gym.make_vec(job.env, rows, vectorization_mode="vector_entry_point", **job.arguments)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # asks for addresses of code and author
        empty = minari.create_dataset_from_buffers(
            job.id,
            [],
            env=env,
            algorithm_name=behaviour.name,
            author="The pam-envs authors",
            description=f"{job.env}: {job.kind} data, SI units",
            requirements=[f"pam-envs=={pam_envs.__version__}"],
        )
    storage, advance, done = empty.storage, start(count), 0
    scores: list[tuple[float, ...]] = []
    while storage.total_steps < job.steps:
        seeds = episode_seeds(KINDS.index(job.kind), done, rows)
        episodes, drawn = rollout(batch, behaviour, job.kind, seeds)
        storage.update_episodes(episodes)
        labels = [one.label(done + k) for k, one in enumerate(drawn)]
        storage.update_episode_metadata(labels, range(done, done + rows))
        scores += map(_score, episodes)
        done += rows
        advance(rows)
    returns, squares, instants, failures = np.sum(scores, axis=0).tolist()
    storage.update_metadata(
        {
            "settings": settings,
            "signals": [dataclasses.asdict(signal) for signal in base.signals],
            "action_signals": [dataclasses.asdict(signal) for signal in base.action_signals],
            "parameter_ranges": drawn[0].ranges,
            "scores": {
                "return": returns / done,
                "rms": (squares / instants) ** 0.5,
                "failures": int(failures),
            },
        }
    )
    env.close()
    batch.close()


def _score(episode: EpisodeBuffer) -> tuple[float, ...]:
    """Return return, sum of squared errors, number of instants and failures of an episode."""
    infos: Any = episode.infos
    error = np.asarray(infos["output"][1:] - infos["reference"][1:], np.float64)
    failed = float(np.asarray(episode.terminations)[-1])
    return float(np.sum(episode.rewards)), float(error @ error), float(len(error)), failed


def metadata_of(folder: Path) -> dict[str, Any]:
    """Return the metadata of a data set."""
    text = (folder / "data" / "metadata.json").read_text(encoding="utf-8")
    found: dict[str, Any] = json.loads(text)
    return found
