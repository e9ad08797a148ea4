"""A cell: one controller in one scenario, over all its seeds. What is computed and kept as one."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from benchmarks import controllers, metrics, provenance, rollout
from benchmarks.canonical import arrays_digest, digest
from benchmarks.controllers import Entrant
from benchmarks.scenarios import Scenario, ScenarioSet

PROBED_STEPS = 250
"""Steps of the episode on which the use of the preview is measured."""
PLANTS = Path(__file__).parent / "scenarios" / "plants"
"""Plants that scenario files name."""


@dataclass(frozen=True)
class Cell:
    """One controller in one scenario.

    Attributes
    ----------
    entrant : Entrant
    track : ScenarioSet
        The file that the scenario is from.
    scenario : Scenario
    probe : bool
        Whether the use of the preview is measured here.
    """

    entrant: Entrant
    track: ScenarioSet
    scenario: Scenario
    probe: bool = False

    @property
    def key(self) -> str:
        """Digest of all that the result depends on: the name under which it is kept."""
        grid = ("grid", "per_reference", "title")
        return digest(
            {
                "controller": [self.entrant.source, self.entrant.name, self.entrant.kind],
                "track": {k: v for k, v in self.track.content.items() if k not in grid},
                "scenario": [self.scenario.name, self.scenario.kwargs, self.scenario.rests],
                "probe": self.probe,
                "packages": provenance.packages(),
                "sources": provenance.sources(self.entrant.source.partition(".")[0]),
            }
        )[:32]


def cells_of(entrant: Entrant, track: ScenarioSet) -> list[Cell]:
    """Return the cells of one row, in the order of the scenario file."""
    scenarios = track.scenarios()
    probed = next((s.name for s in scenarios if not s.rests), scenarios[0].name)
    return [Cell(entrant, track, s, s.name == probed) for s in scenarios]


def make_env(env: str, kwargs: Mapping[str, Any]) -> Any:
    """Return the single environment of a scenario; a plant is the name of a file in ``PLANTS``."""
    import pam_envs  # noqa: F401  registers the ids

    given = dict(kwargs)
    if isinstance(given.get("plant"), str):
        given["plant"] = PLANTS / given["plant"]
    return gym.make(env, disable_env_checker=True, **given)


def model_for(cell: Cell, env: Any) -> Any:
    """Return the plant that the controller is told: the environment's, or the scenario's model."""
    if not cell.scenario.model:
        return env.unwrapped.plant
    other = make_env(cell.track.env, {**cell.scenario.kwargs, **cell.scenario.model})
    plant = other.unwrapped.plant
    other.close()
    return plant


def compute(cell: Cell, recorded: Mapping[int, NDArray[Any]] | None = None) -> dict[str, Any]:
    """Run the cell's episodes and return its record.

    Parameters
    ----------
    cell : Cell
    recorded : mapping from seed to (n, n_act) array, optional
        Actions to replay in place of asking the controller.
    """
    env = make_env(cell.track.env, cell.scenario.kwargs)
    model = model_for(cell, env)
    controller = controllers.make(cell.entrant, model, env)
    record: dict[str, Any] = {
        "schema": 1,
        "controller": cell.entrant.name,
        "track": cell.track.name,
        "scenario": cell.scenario.name,
        "controller_digest": controllers.parameters_digest(controller),
        "plant_digest": env.unwrapped.plant.digest(),
        "model_digest": model.digest(),
        "episodes": [],
    }
    spent, actions = [], {}
    for seed in cell.track.seeds:
        answering = controller if recorded is None else rollout.Replay(recorded[seed])
        episode = rollout.run(env, answering, seed)
        record["episodes"].append(episode_record(cell, seed, episode))
        spent.append(episode.seconds)
        actions[str(seed)] = pack(episode.actions)
        if cell.probe and "preview_used" not in record and recorded is None:
            record["preview_used"] = _preview_seconds(cell, env, controller, episode)
    env.close()
    if cell.entrant.kind == "learned":
        record["actions"] = actions
    micro = 1e6 * np.concatenate(spent)
    record["volatile"] = {
        **provenance.occasion(),
        "predict_us": {
            "median": float(np.median(micro)) if len(micro) else None,
            "p99": float(np.percentile(micro, 99)) if len(micro) else None,
        },
    }
    return record


def _preview_seconds(cell: Cell, env: Any, controller: Any, episode: rollout.Episode) -> float:
    part = rollout.Episode(**{**vars(episode), "observations": episode.observations[:PROBED_STEPS]})
    used = rollout.preview_used(part, controller, env.unwrapped.signals)
    stride = cell.scenario.kwargs.get("preview_stride", 4)
    return round(used * stride * episode.period, 9)


def episode_record(cell: Cell, seed: int, episode: rollout.Episode) -> dict[str, Any]:
    """Return the scores of an episode; one that did not end by its time gets the worst case."""
    content = cell.track.content
    signals = {**episode.signals}
    signals["sensed"] = signals.get(content["sensed"], np.zeros(0))
    try:
        scores = metrics.score(
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
    except (ValueError, IndexError, KeyError):
        if not episode.failed:
            raise
        scores = {}
    if episode.failed:
        scores = metrics.worst_of(scores, content["worst_case"])
    if not cell.scenario.rests:
        scores["steady_state_error"] = float("nan")
    saturated = signals.get("saturated", np.zeros(0))
    return {
        "scenario": cell.scenario.name,
        "seed": seed,
        "steps": len(episode.actions),
        "failed": episode.failed,
        "failure": episode.failure,
        "saturated": float(np.mean(saturated)) if len(saturated) else 0.0,
        "scores": scores,
        "trajectory": arrays_digest([episode.actions, *episode.signals.values()]),
    }


def pack(actions: NDArray[Any]) -> dict[str, Any]:
    """Return actions as text that JSON holds, to the last bit."""
    exact = np.ascontiguousarray(actions)
    text = base64.b85encode(zlib.compress(exact.tobytes(), 9)).decode()
    return {"dtype": exact.dtype.str, "shape": list(exact.shape), "data": text}


def unpack(packed: Mapping[str, Any]) -> NDArray[Any]:
    """Return the actions that :func:`pack` wrote."""
    raw = zlib.decompress(base64.b85decode(packed["data"]))
    return np.frombuffer(raw, np.dtype(packed["dtype"])).reshape(packed["shape"]).copy()
