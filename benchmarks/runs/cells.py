"""Cells of the checkpoint: one controller in one scenario, over its public or its audit seeds.

The cells of one policy in one track form a group. The episodes of scenarios that share a controller
are the rows of one batch. The record of a cell does not depend on its
group.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from benchmarks.identity import artefacts, trainings
from benchmarks.identity.audit import Audit
from benchmarks.identity.hashing import arrays_digest, digest
from benchmarks.runs import controllers, knowledge, provenance, rollout, traces
from benchmarks.runs.controllers import Controller, Entrant
from benchmarks.runs.rollout import Episode
from benchmarks.scenarios.scenario import Scenario, ScenarioSet
from benchmarks.scenarios.scenario_env import (
    drawn_plant,
    make_batch,
    make_env,
    model_of,
    plant_digests,
)
from benchmarks.scoring.metrics import scores_of

SCHEMA = 3
PUBLIC, AUDIT = "public", "audit"
INFORMED_SEEDS = {PUBLIC: 1, AUDIT: 3}
"""Seeds per scenario of a controller that is designed from the plant of each episode."""
DIGITS = 9  # significant digits of a stored score; the digest of a trajectory uses all bits
PROBED_STEPS = 250  # number of steps of the episode that measures the use of the preview


@dataclass(frozen=True)
class Cell:
    """One controller in one scenario."""

    entrant: Entrant
    track: ScenarioSet
    scenario: Scenario
    training_seed: int | None = None  # chooses the policy of a learned controller
    split: str = PUBLIC
    seeds: tuple[int, ...] = ()
    probe: bool = False  # whether the use of the preview is measured

    @property
    def key(self) -> str:
        """Digest of all inputs of the result; it is the name of the record."""
        grid = ("grid", "per_reference", "title", "seeds")
        return digest(
            {
                "schema": SCHEMA,
                "controller": [self.entrant.source, self.entrant.name, self.entrant.kind],
                "knowledge": self.entrant.knowledge,
                "policy": self._policy(),
                "track": {k: v for k, v in self.track.content.items() if k not in grid},
                "scenario": [self.scenario.name, self.scenario.kwargs, self.scenario.rests],
                "plants": plant_digests(self.scenario),
                "episodes": [self.split, self.training_seed, self.seeds, self.probe, self.drawn],
                "packages": provenance.packages(),
                "cpu": provenance.cpu(),
                "sources": provenance.sources(),
            }
        )[:32]

    @property
    def drawn(self) -> bool:
        """True if a picture is kept, that is for the first training seed on public episodes."""
        first = self.split == PUBLIC and self.training_seed == self.entrant.training_seeds[0]
        return first and self.scenario.name in traces.chosen(self.track)

    def _policy(self) -> dict[str, Any] | None:
        files = dict(self.entrant.files)
        seed = self.training_seed
        return artefacts.file_record(files[seed], seed) if seed is not None else None


def cells_of(entrant: Entrant, track: ScenarioSet, found: Audit | None = None) -> list[Cell]:
    """Return the cells of a row by training seed and scenario, public ones first, then audit.

    A controller that is designed from the plant of each episode has the first of the seeds only.
    """
    scenarios, public = track.scenarios(), track.seeds
    most = INFORMED_SEEDS if knowledge.is_informed(entrant) else dict[str, int]()
    kept, audited = most.get(PUBLIC), most.get(AUDIT)
    probed = next((s.name for s in scenarios if not s.rests), scenarios[0].name)
    runs = [(seed, s) for seed in entrant.training_seeds for s in scenarios]
    first = (entrant.training_seeds[0], probed)
    cells = [
        Cell(entrant, track, s, seed, PUBLIC, public[s.name][:kept], (seed, s.name) == first)
        for seed, s in runs
    ]
    if found is not None:
        cells += [
            Cell(entrant, track, s, seed, AUDIT, found.seeds[s.name][:audited]) for seed, s in runs
        ]
    return cells


@dataclass(frozen=True)
class Group:
    """One or more cells of a policy in a track."""

    cells: tuple[Cell, ...]

    @property
    def key(self) -> str:
        """Digest of all inputs of the records; no cell is in two groups."""
        return self.cells[0].key


def grouped(cells: Iterable[Cell]) -> list[Group]:
    """Return cells in groups, ordered by their first cells.

    A controller that is designed from the plant of each episode has a group for each scenario.
    """
    found: dict[Any, list[Cell]] = defaultdict(list)
    for cell in cells:
        part = cell.scenario.name if knowledge.is_informed(cell.entrant) else None
        found[cell.entrant, cell.track, part, cell.training_seed].append(cell)
    return [Group(tuple(members)) for members in found.values()]


@dataclass(frozen=True)
class Scene:
    """Environment and nominal model of cells in one scenario."""

    cells: tuple[Cell, ...]
    env: Any
    model: Any

    @property
    def seeds(self) -> tuple[int, ...]:
        """Seeds of all cells."""
        return tuple(seed for cell in self.cells for seed in cell.seeds)

    @property
    def design(self) -> tuple[Any, ...]:
        """Inputs of the design of a controller."""
        base = self.env.unwrapped
        return self.model.digest(), base.signals, base.action_signals


def scenes_of(cells: Iterable[Cell]) -> list[Scene]:
    """Return the scenes of cells, ordered by their first cells."""
    found: dict[str, list[Cell]] = defaultdict(list)
    for cell in cells:
        found[cell.scenario.name].append(cell)
    scenes = []
    for members in found.values():
        track, scenario = members[0].track, members[0].scenario
        env = make_env(track.env, scenario.kwargs)
        scenes.append(Scene(tuple(members), env, model_of(track.env, scenario, env)))
    return scenes


Design = Callable[[Scene], Controller]


def run_scenes(
    scenes: Sequence[Scene], design: Design
) -> Iterator[tuple[Scene, Controller, list[Episode]]]:
    """Yield each scene with its controller and its episodes.

    Scenes with the same nominal model and signals are rows of one batch under one controller.
    """
    alike: dict[Any, list[Scene]] = defaultdict(list)
    for scene in scenes:
        alike[scene.design].append(scene)
    for members in alike.values():
        controller = design(members[0])
        parts = [
            rollout.Part(
                partial(make_batch, scene.cells[0].track.env, scene.cells[0].scenario.kwargs),
                scene.env,
                scene.seeds,
            )
            for scene in members
        ]
        for scene, episodes in zip(members, rollout.run_all(parts, controller), strict=True):
            yield scene, controller, episodes


def compute(group: Group) -> dict[str, dict[str, Any]]:
    """Run the episodes of a group and return each cell's record by its key."""
    first = group.cells[0]
    entrant, seed = first.entrant, first.training_seed
    scenes = scenes_of(group.cells)

    def design(scene: Scene) -> Controller:
        return controllers.make(entrant, scene.model, scene.env, training_seed=seed)

    if knowledge.is_informed(entrant) and scenes[0].env.unwrapped.setup.drawn:
        (scene,) = scenes
        made = iter([(scene, design(scene), informed_episodes(scene))])
    else:
        made = run_scenes(scenes, design)
    records: dict[str, dict[str, Any]] = {}
    for scene, controller, episodes in made:
        records |= _records(scene, controller, episodes)
    for scene in scenes:
        scene.env.close()
    return {cell.key: records[cell.key] for cell in group.cells}


def _records(
    scene: Scene, controller: Controller, made: Sequence[Episode]
) -> dict[str, dict[str, Any]]:
    """Return the records of a scene's cells by their keys."""
    first, env = scene.cells[0], scene.env
    said: dict[str, Any] = {
        "schema": SCHEMA,
        "env": first.track.env,
        "controller": first.entrant.name,
        "track": first.track.name,
        "scenario": first.scenario.name,
        "training_seed": first.training_seed,
        "plant_digest": env.unwrapped.plant.digest(),
        "model_digest": scene.model.digest(),
        **knowledge.of_plant(first.entrant, controller, scene.model, env),
    }
    if first.entrant.files:
        said["card"] = trainings.card_record(controller)
    episodes, records = iter(made), {}
    for cell in scene.cells:
        record = {**said, "split": cell.split}
        own = [next(episodes) for _ in cell.seeds]
        numbered = zip(cell.seeds, own, strict=True)
        record["episodes"] = [episode_record(cell, seed, episode) for seed, episode in numbered]
        if cell.drawn and len(own[0].actions):
            picture = (cell.scenario.name, cell.seeds[0], own[0].signals, cell.track.content)
            record["traces"] = [traces.of_episode(*picture, cell.training_seed)]
        if cell.probe:
            part = replace(own[0], observations=own[0].observations[:PROBED_STEPS])
            signals = env.unwrapped.signals
            record["preview_used"] = rollout.preview_used(part, controller, signals)
        micro = 1e6 * np.concatenate([episode.seconds for episode in own])
        times = (np.median(micro), np.percentile(micro, 99)) if len(micro) else (None, None)
        record["volatile"] = {
            **provenance.occasion(),
            "predict_us": dict(zip(("median", "p99"), times, strict=True)),
        }
        records[cell.key] = record
    return records


def informed_episodes(scene: Scene) -> list[Episode]:
    """Return the episodes of a controller that is designed from the plant drawn in each."""
    made, env = [], scene.env
    for seed in scene.seeds:
        env.reset(seed=seed)
        controller = controllers.make(scene.cells[0].entrant, drawn_plant(env), env)
        made.append(rollout.run(env, controller, seed))
    return made


def episode_record(cell: Cell, seed: int, episode: Episode) -> dict[str, Any]:
    """Return the scores of an episode; one that did not reach its end gets the worst case."""
    saturated = episode.signals.get("saturated", np.zeros(0))
    scores = scores_of(episode, cell.track.content, cell.scenario.rests)
    return {
        "scenario": cell.scenario.name,
        "seed": seed,
        "training_seed": cell.training_seed,
        "split": cell.split,
        "steps": len(episode.actions),
        "failed": episode.failed,
        "failure": episode.failure,
        "saturated": float(np.mean(saturated)) if len(saturated) else 0.0,
        "scores": {name: float(f"{value:.{DIGITS}g}") for name, value in scores.items()},
        "trajectory": arrays_digest([episode.actions, *episode.signals.values()]),
    }
