"""Bounds of tracks: episodes of the oracle, scored as those of a controller, and their file.

The episodes are the first public ones of each scenario, so that they are paired with those of every
row. An oracle has no row: it is not in the catalogue, and it is never ranked.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock

from baselines.core.catalogue import make_controller
from benchmarks.bounds.oracle import Oracle, targets_of
from benchmarks.identity import tasks
from benchmarks.runs import rollout
from benchmarks.runs.rollout import Episode
from benchmarks.runs.rows import RESULTS
from benchmarks.runs.store import read_record, write_record
from benchmarks.scenarios.scenario import Scenario, ScenarioSet
from benchmarks.scenarios.scenario_env import make_batch, make_env, model_of
from benchmarks.scoring.metrics import COSTS, headline_of, headlines_of, of_track, scores_of, shown
from pam_envs.arrays import Array

EPISODES = 2
"""Episodes of each scenario: an interval needs the scatter within one."""
HORIZON = 100
"""Control periods: dead time, a travel of 0.5 s at the rate limit, and the swing before it."""
FILE = "oracle.json.xz"
"""Beside the rows: the bounds of each track."""
SCHEMA = 1


@dataclass(frozen=True)
class Bound:
    """Episode of the oracle: its scores [SI], the headline first among them, and its costs."""

    scenario: str
    seed: int
    failed: bool
    scores: Mapping[str, float]


@dataclass(frozen=True)
class Bounds:
    """Bounds of a track.

    Attributes
    ----------
    task : str
        Digest of the task; with another one the bounds are void.
    horizon : int
        Control periods that the oracle predicts.
    episodes : sequence of Bound
        Those of all scenarios.
    start : str
        Controller whose actions are a candidate of every search; empty for none. A later change of
        that controller does not void the bounds.
    """

    task: str
    horizon: int
    episodes: Sequence[Bound]
    start: str = ""


def bounds_of(
    track: ScenarioSet,
    episodes: int = EPISODES,
    horizon: int = HORIZON,
    start: str = "",
    advance: Callable[[], None] = lambda: None,
) -> Bounds:
    """Return the bounds of a track on the first public episodes of every scenario.

    ``start`` is the name of a controller of the catalogue; its actions in the same episodes are a
    candidate of every search.
    """
    most = track.content["seeds"]
    if not 1 <= episodes <= most:
        raise ValueError(
            f"episodes = {episodes} must be from 1 to {most}, the public episodes of a scenario of "
            f"{track.name}"
        )
    found = []
    for scenario in track.scenarios():
        seeds = track.seeds[scenario.name][:episodes]
        played = play(track, scenario, seeds, horizon, start)
        for seed, episode in zip(seeds, played, strict=True):
            scores = scores_of(episode, track.content, scenario.rests)
            kept = {name: scores[name] for name in metrics_of(track.content)}
            found.append(Bound(scenario.name, seed, episode.failed, kept))
        advance()
    return Bounds(tasks.of(track).identity.digest, horizon, tuple(found), start)


def metrics_of(content: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the stored metrics of a track: its headlines and its costs."""
    beside = (metric for metric, _, _ in headlines_of(content))
    costs = (metric for metric in COSTS if metric in of_track(content))
    return tuple(dict.fromkeys((headline_of(content), *beside, *costs)))


def play(
    track: ScenarioSet, scenario: Scenario, seeds: tuple[int, ...], horizon: int, start: str = ""
) -> list[Episode]:
    """Return the episodes of the oracle as rows of a batch."""
    env, content = make_batch(track.env, scenario.kwargs, len(seeds)), track.content
    observation, _ = env.reset(seed=list(seeds))
    oracle = Oracle(
        env,
        1.0 / shown(content)[1],
        targets_of(content),
        tuple(content.get("gate") or ()),
        float(content["settle_seconds"]),
        horizon,
        _actions_of(start, track, scenario, seeds) if start else None,
    )
    oracle.start(_held(env, observation))
    infos, actions = [], []
    running, ended = np.ones(len(seeds), bool), np.zeros(len(seeds), bool)
    lengths = np.zeros(len(seeds), int)
    while running.any():
        action = oracle.act()
        _, _, terminated, truncated, info = env.step(action)
        over = terminated | truncated
        if over.any():
            info = {k: np.where(over, info["final_info"][k], info[k]) for k in oracle.keys}
        infos.append(np.array([info[key] for key in oracle.keys]))
        actions.append(action)
        lengths[running] += 1
        ended |= running & terminated
        running &= ~over
    table, given = np.array(infos), np.array(actions)
    env.close()
    return [
        Episode(
            signals={key: table[:n, k, row] for k, key in enumerate(oracle.keys)},
            observations=np.zeros((n, 0)),
            actions=given[:n, row],
            seconds=np.zeros(0),
            period=float(env.control_period),
            failure="a limit ended the episode" if ended[row] else "",
        )
        for row, n in enumerate(lengths.tolist())
    ]


def _actions_of(
    controller: str, track: ScenarioSet, scenario: Scenario, seeds: tuple[int, ...]
) -> Array:
    """Return a controller's actions [-1 to 1], shape (n, rows, n_act).

    The last action of a shorter episode is held.
    """
    env = make_env(track.env, scenario.kwargs)
    try:
        model, base = model_of(track.env, scenario, env), env.unwrapped
        made = make_controller(controller, model, base.signals, base.action_signals)
        batches = partial(make_batch, track.env, scenario.kwargs)
        (episodes,) = rollout.run_all([rollout.Part(batches, env, seeds)], made)
    finally:
        env.close()
    for seed, episode in zip(seeds, episodes, strict=True):
        if not len(episode.actions):
            raise ValueError(f"{controller} took no action in episode {seed}: {episode.failure}")
    longest = max(len(episode.actions) for episode in episodes)
    held = [
        np.pad(one.actions, ((0, longest - len(one.actions)), (0, 0)), mode="edge")
        for one in episodes
    ]
    return np.stack(held, axis=1).astype(float)


def _held(env: object, observation: Array) -> Array:
    """Return the actions that hold the setpoints of the start, 0 where they are not observed."""
    signals = env.signals  # type: ignore[attr-defined]
    actions = env.action_signals  # type: ignore[attr-defined]
    made = np.zeros((len(observation), len(actions)))
    seen = [name for name in signals.names() if name.split("_", 2)[:2] == ["set", "point"]]
    for action, name in zip(actions, seen, strict=False):
        made[:, action.index] = action.encode(signals.decode(observation, name))
    return made


def read(folder: Path = RESULTS) -> dict[str, Bounds]:
    """Return the stored bounds beside the rows of a folder, by track; none without the file."""
    path = folder / FILE
    if not path.exists():
        return {}
    record = read_record(path)
    if record.get("schema") != SCHEMA:
        raise ValueError(
            f"{path} is not of schema {SCHEMA}; restore it from git, or remove it and run `python "
            "-m benchmarks bound TRACK --write`"
        )
    return {
        name: Bounds(**one | {"episodes": tuple(Bound(**e) for e in one["episodes"])})
        for name, one in record["tracks"].items()
    }


def write(found: Mapping[str, Bounds], folder: Path = RESULTS) -> Path:
    """Write bounds of tracks into the file beside the rows, in place of older ones."""
    path = folder / FILE
    with FileLock(folder / f".{FILE}.lock"):
        known = {**read(folder), **found}
        tracks = {name: asdict(known[name]) for name in sorted(known)}
        write_record(path, {"schema": SCHEMA, "tracks": tracks})
    return path


def table(track: ScenarioSet, found: Bounds) -> str:
    """Return the bounds as text, in the unit of the track."""
    (unit, factor), headline = shown(track.content), headline_of(track.content)

    def mean(episodes: Iterable[Bound]) -> str:
        return f"{factor * float(np.mean([e.scores[headline] for e in episodes])):.3g} {unit}"

    lines = [f"{track.name}: {mean(found.episodes)} over {len(found.episodes)} episodes"]
    for name in dict.fromkeys(e.scenario for e in found.episodes):
        lines.append(f"  {name}: {mean(e for e in found.episodes if e.scenario == name)}")
    return "\n".join(lines)
