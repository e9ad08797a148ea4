"""Identity of a controller: policy files, knobs, and actions for the observations of a task."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from benchmarks.identity import behaviour, tasks
from benchmarks.identity.hashing import digest
from benchmarks.runs import controllers
from benchmarks.runs.controllers import Entrant
from benchmarks.scenarios.scenario import ScenarioSet


@dataclass(frozen=True)
class Artefact:
    """Behaviour of a controller in a track."""

    # name, sha256, bytes and training_seed of each policy file
    files: tuple[Mapping[str, Any], ...]
    knobs: Mapping[str, float]
    # actions in each setting of the task, (n, n_actions) in action ranges: for a residual policy
    # those of the controller that it corrects, for a policy alone none
    answers: tuple[behaviour.Array, ...]

    def record(self) -> dict[str, Any]:
        """Return the identity and its digest in JSON's types."""
        parts = {
            "files": [[file["training_seed"], file["sha256"]] for file in self.files],
            "knobs": dict(self.knobs),
            "answers": [behaviour.pack(answers) for answers in self.answers],
        }
        return {"digest": digest(parts), **parts}

    def changes(self, record: Mapping[str, Any]) -> list[str]:
        """Return a sentence for every difference from a recorded identity."""
        own = self.record()
        if record["digest"] == own["digest"]:
            return []
        found = [] if own["files"] == record["files"] else ["policy files changed"]
        for knob in {**record["knobs"], **own["knobs"]}:
            pair = (record["knobs"].get(knob), own["knobs"].get(knob))
            found += [] if pair[0] == pair[1] else [f"knob {knob} changed: {pair[0]} to {pair[1]}"]
        old = [behaviour.unpack(packed) for packed in record["answers"]]
        if len(old) != len(self.answers):
            return [*found, "number of nominal models changed"]
        pairs = zip(old, self.answers, strict=True)
        most = max((behaviour.difference(*pair) for pair in pairs), default=0.0)
        if most > behaviour.TOLERANCE:
            found.append(f"answers changed by {most:.2g} of the action range")
        return found


def located(path: Path) -> Path:
    """Return the path of a policy file in this checkout."""
    return (controllers.ROOT / path).resolve()


def file_record(path: Path, training_seed: int) -> dict[str, Any]:
    """Return name, digest and size of a policy file."""
    data = located(path).read_bytes()
    return {
        "name": path.name,
        "sha256": hashlib.sha256(data).hexdigest(),
        "bytes": len(data),
        "training_seed": training_seed,
    }


def of(entrant: Entrant, track: ScenarioSet) -> Artefact:
    """Return the artefact of a controller in a track, without running one of its episodes."""
    files = tuple(file_record(path, seed) for seed, path in entrant.files)
    hashes = tuple(file["sha256"] for file in files)
    return Artefact(files, dict(entrant.knobs), _answers(entrant, track, hashes))


@lru_cache(maxsize=1024)
def _answers(
    entrant: Entrant, track: ScenarioSet, hashes: tuple[str, ...]
) -> tuple[behaviour.Array, ...]:
    """Return the actions in each setting, computed once for the same policy files."""
    if entrant.kind == "learned":
        return ()
    found = []
    for setting in tasks.of(track).settings:
        seed = entrant.training_seeds[0]
        made: Any = controllers.make(entrant, setting.model, setting.env, training_seed=seed)
        answering = made.controller if entrant.kind == "residual" else made
        given = (setting.observations, setting.env.action_space)
        found.append(behaviour.of_controller(answering, *given))
    return tuple(found)
