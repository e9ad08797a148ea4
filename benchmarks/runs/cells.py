"""A cell: one controller in one scenario, over its public or its audit seeds. It is kept as one.

What is computed as one is a group: the cells of one policy in one scenario, whose episodes run as
rows of one batch. A record does not depend on the group that its cell was computed in.
"""

from __future__ import annotations

import base64
import math
import zlib
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.identity import artefacts, trainings
from benchmarks.identity.audit import Audit
from benchmarks.identity.hashing import arrays_digest, digest
from benchmarks.runs import controllers, knowledge, provenance, rollout, traces
from benchmarks.runs.controllers import Entrant
from benchmarks.scenarios.scenario import Scenario, ScenarioSet
from benchmarks.scenarios.scenario_env import make_batch, make_env, model_of, plant_digests
from benchmarks.scoring import metrics

SCHEMA = 2
PUBLIC, AUDIT = "public", "audit"
PROBED_STEPS = 250
"""Steps of the episode on which the use of the preview is measured."""
MOST_ACTIONS = 10_000_000
"""Numbers that the recorded actions of an episode may be."""


@dataclass(frozen=True)
class Cell:
    """One controller in one scenario.

    Attributes
    ----------
    entrant : Entrant
    track : ScenarioSet
        The file that the scenario is from.
    scenario : Scenario
    training_seed : int, optional
        Which policy of a learned controller.
    split : {"public", "audit"}
    seeds : tuple of int
    probe : bool
        Whether the use of the preview and of the model is measured here.
    """

    entrant: Entrant
    track: ScenarioSet
    scenario: Scenario
    training_seed: int | None = None
    split: str = PUBLIC
    seeds: tuple[int, ...] = ()
    probe: bool = False

    @property
    def key(self) -> str:
        """Digest of all that the result depends on: the name under which it is kept."""
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
                "sources": sources(self.entrant),
            }
        )[:32]

    @property
    def first(self) -> bool:
        """Whether actions and pictures of this cell are kept: of one training seed, public."""
        return self.split == PUBLIC and self.training_seed == self.entrant.training_seeds[0]

    @property
    def drawn(self) -> bool:
        """Whether a picture is kept."""
        return self.first and self.scenario.name in traces.chosen(self.track)

    def _policy(self) -> dict[str, Any] | None:
        files = dict(self.entrant.files)
        seed = self.training_seed
        return artefacts.file_record(files[seed], seed) if seed is not None else None


def sources(entrant: Entrant) -> dict[str, str]:
    """Return digests of the code that a controller's scores depend on."""
    found = provenance.sources(entrant.source.partition(".")[0], bool(entrant.files))
    if entrant.kind == artefacts.RESIDUAL:
        return provenance.sources(artefacts.BASELINES) | found
    return found


def cells_of(entrant: Entrant, track: ScenarioSet, found: Audit | None = None) -> list[Cell]:
    """Return the cells of a row, public ones first, by training seed and scenario.

    Parameters
    ----------
    entrant : Entrant
    track : ScenarioSet
    found : Audit, optional
        Whose episodes are run as well.
    """
    scenarios, public = track.scenarios(), track.seeds
    probed = next((s.name for s in scenarios if not s.rests), scenarios[0].name)
    runs = [(seed, s) for seed in entrant.training_seeds for s in scenarios]
    first = (entrant.training_seeds[0], probed)
    cells = [
        Cell(entrant, track, s, seed, PUBLIC, public[s.name], (seed, s.name) == first)
        for seed, s in runs
    ]
    if found is not None:
        cells += [Cell(entrant, track, s, seed, AUDIT, found.seeds[s.name]) for seed, s in runs]
    return cells


@dataclass(frozen=True)
class Group:
    """Cells that differ in their seeds alone.

    Attributes
    ----------
    cells : tuple of Cell
        One or more.
    """

    cells: tuple[Cell, ...]

    @property
    def key(self) -> str:
        """Digest of all that the records depend on: no cell is in two groups."""
        return self.cells[0].key


def grouped(cells: Iterable[Cell]) -> list[Group]:
    """Return cells in groups, in the order of their first ones."""
    found: dict[Any, list[Cell]] = defaultdict(list)
    for cell in cells:
        found[cell.entrant, cell.track, cell.scenario.name, cell.training_seed].append(cell)
    return [Group(tuple(members)) for members in found.values()]


def compute(group: Group) -> dict[str, dict[str, Any]]:
    """Run the episodes of a group and return each cell's record by its key."""
    first = group.cells[0]
    entrant, track = first.entrant, first.track
    env = make_env(track.env, first.scenario.kwargs)
    model = model_of(track.env, first.scenario, env)
    controller = _controller(first, model, env)
    said: dict[str, Any] = {
        "schema": SCHEMA,
        "env": track.env,
        "controller": entrant.name,
        "track": track.name,
        "scenario": first.scenario.name,
        "training_seed": first.training_seed,
        "controller_digest": controllers.parameters_digest(controller),
        "code_digest": artefacts.controller_code(entrant, controller),
        "plant_digest": env.unwrapped.plant.digest(),
        "model_digest": model.digest(),
        "knows_plant": knowledge.knows_plant(entrant, controller, model, env),
        "trained_on_plant": knowledge.trained_on_plant(controller, model, env),
    }
    if entrant.files:
        said["card"] = trainings.card_record(controller)
    episodes = iter(episodes_of(group, env, controller))
    records = {}
    for cell in group.cells:
        record = {**said, "split": cell.split}
        if cell.probe and entrant.knowledge in knowledge.IGNORANT:
            record["uses_model"] = knowledge.uses_model(entrant, model, env, cell.training_seed)
        own = [next(episodes) for _ in cell.seeds]
        numbered = zip(cell.seeds, own, strict=True)
        record["episodes"] = [episode_record(cell, seed, episode) for seed, episode in numbered]
        if cell.first:
            record |= _kept(cell, env, controller, cell.seeds[0], own[0])
        spent = np.concatenate([episode.seconds for episode in own])
        record["volatile"] = {**provenance.occasion(), "predict_us": _times(spent)}
        records[cell.key] = record
    env.close()
    return records


def episodes_of(group: Group, env: Any, controller: Any) -> list[rollout.Episode]:
    """Return the episodes of a group, cell by cell; ``env`` is its environment alone."""
    first = group.cells[0]
    batches = partial(make_batch, first.track.env, first.scenario.kwargs)
    seeds = [seed for cell in group.cells for seed in cell.seeds]
    return rollout.run_all(batches, env, controller, seeds)


def _controller(cell: Cell, model: Any, env: Any) -> controllers.Controller:
    return controllers.make(cell.entrant, model, env, training_seed=cell.training_seed)


def _kept(
    cell: Cell, env: Any, controller: Any, seed: int, episode: rollout.Episode
) -> dict[str, Any]:
    """Return what a record keeps of one episode: its actions, its picture, the preview's use."""
    kept: dict[str, Any] = {}
    if cell.entrant.files:
        kept["actions"] = {str(seed): pack(episode.actions)}
    if cell.drawn and len(episode.actions):
        content = cell.track.content
        made = traces.of_episode(
            cell.scenario.name, seed, episode.signals, content, cell.training_seed
        )
        kept["traces"] = [made]
    if cell.probe:
        kept["preview_used"] = _preview_seconds(env, controller, episode)
    return kept


def _times(seconds: NDArray[Any]) -> dict[str, float | None]:
    """Return median and 99th percentile of the time of an answer, in microseconds."""
    if not len(seconds):
        return {"median": None, "p99": None}
    micro = 1e6 * seconds
    return {"median": float(np.median(micro)), "p99": float(np.percentile(micro, 99))}


def _preview_seconds(env: Any, controller: Any, episode: rollout.Episode) -> float:
    part = rollout.Episode(**{**vars(episode), "observations": episode.observations[:PROBED_STEPS]})
    return rollout.preview_used(part, controller, env.unwrapped.signals)


def episode_record(cell: Cell, seed: int, episode: rollout.Episode) -> dict[str, Any]:
    """Return the scores of an episode; one that did not end by its time gets the worst case."""
    content = cell.track.content
    signals = {**episode.signals}
    signals["sensed"] = signals[content["sensed"]]
    scores = _scores(signals, episode, content)
    if episode.failed:
        scores = metrics.worst_of(scores, content["worst_case"])
    if not cell.scenario.rests:
        scores["steady_state_error"] = float("nan")
    saturated = signals.get("saturated", np.zeros(0))
    return {
        "scenario": cell.scenario.name,
        "seed": seed,
        "training_seed": cell.training_seed,
        "split": cell.split,
        "steps": len(episode.actions),
        "failed": episode.failed,
        "failure": episode.failure,
        "saturated": float(np.mean(saturated)) if len(saturated) else 0.0,
        "scores": scores,
        "trajectory": arrays_digest([episode.actions, *episode.signals.values()]),
    }


def _scores(
    signals: Mapping[str, NDArray[Any]], episode: rollout.Episode, content: Mapping[str, Any]
) -> dict[str, float]:
    """Return what can be scored of an episode: nothing, if it failed before there was anything."""
    if episode.failed and not len(episode.actions):
        return {}
    try:
        return metrics.score(
            signals,
            episode.period,
            float(content["settle_seconds"]),
            float(content["hold_seconds"]),
            content["cost_scales"],
            content.get("gate") or (),
            content.get("metrics") or (),
            content.get("activity", ""),
            content.get("half_range"),
            content.get("tool_length"),
        )
    except ValueError:  # nothing left to score after settling
        if not episode.failed:
            raise
        return {}


def pack(actions: NDArray[Any]) -> dict[str, Any]:
    """Return actions as text that JSON holds, to the last bit."""
    exact = np.ascontiguousarray(actions)
    text = base64.b85encode(zlib.compress(exact.tobytes(), 9)).decode()
    return {"dtype": exact.dtype.str, "shape": list(exact.shape), "data": text}


def unpack(packed: Mapping[str, Any]) -> NDArray[Any]:
    """Return the actions that :func:`pack` wrote.

    Raises
    ------
    ValueError
        If they are not of the size that they say, or too many: the text may be a stranger's.
    """
    kind, shape = np.dtype(str(packed["dtype"])), [int(n) for n in packed["shape"]]
    size = math.prod(shape)
    if kind.kind != "f" or min(shape, default=0) < 0 or size > MOST_ACTIONS:
        raise ValueError(f"recorded actions of type {kind} and shape {shape} are none")
    try:
        expected = size * kind.itemsize
        raw = zlib.decompressobj().decompress(base64.b85decode(packed["data"]), expected + 1)
    except zlib.error as error:
        raise ValueError(f"recorded actions are damaged: {error}") from error
    if len(raw) != expected:
        raise ValueError(f"recorded actions are not of shape {shape}; run the row again")
    return np.frombuffer(raw, kind).reshape(shape).copy()
