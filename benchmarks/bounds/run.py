"""Bounds of tracks: episodes of the oracle, scored as those of a controller."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from agents.settings.seeds import tuning
from benchmarks.bounds.oracle import PLAIN, TARGETS, Oracle
from benchmarks.runs.rollout import Episode
from benchmarks.scenarios.scenario import Scenario, ScenarioSet
from benchmarks.scenarios.scenario_env import make_batch
from benchmarks.scoring.metrics import headline_of, scores_of, shown
from pam_envs.arrays import Array

HORIZON = 60
"""Control periods: dead time, and a travel of 0.5 s at the rate limit."""


@dataclass(frozen=True)
class Bound:
    """Headlines of the oracle in one scenario [SI], one an episode."""

    scenario: str
    seeds: tuple[int, ...]
    errors: tuple[float, ...]


def bounds_of(
    track: ScenarioSet,
    episodes: int = 4,
    horizon: int = HORIZON,
    advance: Callable[[], None] = lambda: None,
) -> list[Bound]:
    """Return the bounds of every scenario of a track, on tuning seeds."""
    headline = headline_of(track.content)
    found = []
    for k, scenario in enumerate(track.scenarios()):
        seeds = tuple(tuning(episodes * (k + 1))[-episodes:])
        made = play(track, scenario, seeds, horizon)
        errors = (scores_of(e, track.content, scenario.rests)[headline] for e in made)
        found.append(Bound(scenario.name, seeds, tuple(errors)))
        advance()
    return found


def play(
    track: ScenarioSet, scenario: Scenario, seeds: tuple[int, ...], horizon: int
) -> list[Episode]:
    """Return the episodes of the oracle as rows of a batch."""
    env, content = make_batch(track.env, scenario.kwargs, len(seeds)), track.content
    observation, _ = env.reset(seed=list(seeds))
    oracle = Oracle(
        env,
        1.0 / shown(content)[1],
        TARGETS.get(headline_of(content), PLAIN),
        tuple(content.get("gate") or ()),
        horizon,
    )
    oracle.start(_held(env, observation))
    infos, actions, over = [], [], np.zeros(len(seeds), bool)
    ended = np.zeros(len(seeds), bool)
    while not over.all():
        action = oracle.act()
        _, _, terminated, truncated, info = env.step(action)
        over = terminated | truncated
        ended |= terminated
        if over.any():
            info = {k: np.where(over, info["final_info"][k], info[k]) for k in oracle.keys}
        infos.append(np.array([info[key] for key in oracle.keys]))
        actions.append(action)
        if ended.any():
            break
    table, given = np.array(infos), np.array(actions)
    env.close()
    return [
        Episode(
            signals={key: table[:, k, row] for k, key in enumerate(oracle.keys)},
            observations=np.zeros((len(given), 0)),
            actions=given[:, row],
            seconds=np.zeros(0),
            period=float(env.control_period),
            failure="a limit ended the episode" if ended[row] else "",
        )
        for row in range(len(seeds))
    ]


def _held(env: object, observation: Array) -> Array:
    """Return the actions that hold the setpoints of the start, 0 where they are not observed."""
    signals = env.signals  # type: ignore[attr-defined]
    actions = env.action_signals  # type: ignore[attr-defined]
    made = np.zeros((len(observation), len(actions)))
    seen = [name for name in signals.names() if name.split("_", 2)[:2] == ["set", "point"]]
    for action, name in zip(actions, seen, strict=False):
        made[:, action.index] = action.encode(signals.decode(observation, name))
    return made


def table(track: ScenarioSet, found: list[Bound]) -> str:
    """Return the bounds as text, in the unit of the track."""
    unit, factor = shown(track.content)
    every = [error for bound in found for error in bound.errors]
    lines = [
        f"{track.name}: {factor * float(np.mean(every)):.3g} {unit} over {len(every)} episodes"
    ]
    for bound in found:
        lines.append(f"  {bound.scenario}: {factor * float(np.mean(bound.errors)):.3g} {unit}")
    return "\n".join(lines)
