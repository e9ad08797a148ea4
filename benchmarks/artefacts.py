"""What a row is the score of: policy files, or the code and the numbers of a controller."""

from __future__ import annotations

import hashlib
import importlib
import inspect
import json
import subprocess
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from benchmarks import controllers
from benchmarks.canonical import classes_in, digest
from benchmarks.controllers import Entrant
from benchmarks.making import make_env, model_of
from benchmarks.scenarios import ScenarioSet
from benchmarks.source_code import code_digest, needed

RESIDUAL = "residual"
BASELINES = "baselines"
"""Package of what residual controllers correct."""


@dataclass(frozen=True)
class Artefact:
    """A controller as files.

    Attributes
    ----------
    digest : str
        SHA-256 of the policy files, of all numbers that the controllers hold, and of their code
        where they are more than policy files.
    files : tuple of mapping
        Name, sha256, bytes and training_seed of each policy file.
    """

    digest: str
    files: tuple[Mapping[str, Any], ...]

    def record(self) -> dict[str, Any]:
        """Return the artefact as a row holds it."""
        return {"digest": self.digest, "files": [dict(file) for file in self.files]}


def located(path: Path) -> Path:
    """Return where a policy file lies in this checkout."""
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


def combine(entrant: Entrant, parameters: Iterable[str], code: Iterable[str]) -> Artefact:
    """Return the artefact from the digests of the controllers that were built.

    Parameters
    ----------
    entrant : Entrant
    parameters : iterable of str
        Digests of what the controllers hold.
    code : iterable of str
        Digests of their code, empty for what is all policy file.
    """
    files = tuple(file_record(path, seed) for seed, path in entrant.files)
    said = {
        "files": [[file["training_seed"], file["sha256"]] for file in files],
        "parameters": sorted(set(parameters)),
        "code": sorted(set(code)),
    }
    return Artefact(digest(said), files)


_known: dict[str, Artefact] = {}


def of(entrant: Entrant, track: ScenarioSet, task: str = "") -> Artefact:
    """Return the artefact of a controller in a track, without running it.

    Parameters
    ----------
    entrant : Entrant
    track : ScenarioSet
    task : str, optional
        Digest of the task; given, controllers that were built before in this process are not
        built again.
    """
    files = [file_record(path, seed) for seed, path in entrant.files]
    key = digest([entrant.source, entrant.name, files, task])
    if not task or key not in _known:
        _known[key] = _built(entrant, track)
    return _known[key]


def _built(entrant: Entrant, track: ScenarioSet) -> Artefact:
    built: dict[Any, tuple[str, str]] = {}
    for scenario in track.scenarios():
        env = make_env(track.env, scenario.kwargs)
        model = model_of(track.env, scenario, env)
        base = env.unwrapped
        told = (model.digest(), *base.signals, *base.action_signals)
        for seed in entrant.training_seeds:
            if (seed, *told) not in built:
                made = controllers.make(entrant, model, env, training_seed=seed)
                numbers = controllers.parameters_digest(made)
                built[(seed, *told)] = numbers, controller_code(entrant, made)
        env.close()
    numbers, code = zip(*built.values(), strict=True)
    return combine(entrant, numbers, code)


def controller_code(entrant: Entrant, controller: Any) -> str:
    """Return a digest of the code of a controller, empty for one that is all policy file."""
    files, root = code_files(entrant, controller)
    return _code_digest(files, root) if files else ""


def code_files(entrant: Entrant, controller: Any) -> tuple[frozenset[Path], Path]:
    """Return the files of a controller's own classes, and the folder of their package.

    Of a residual controller those of the one that it corrects; of a learned one none.
    """
    if entrant.files and entrant.kind != RESIDUAL:
        return frozenset(), controllers.ROOT
    package = BASELINES if entrant.kind == RESIDUAL else entrant.source.partition(".")[0]
    place = Path(inspect.getfile(importlib.import_module(package))).resolve()
    root = place.parent.parent if place.name == "__init__.py" else place.parent
    modules = {kind.__module__ for kind in classes_in(controller)}
    own = {name for name in modules if name.partition(".")[0] == package}
    if not own and entrant.kind != RESIDUAL:
        own = {entrant.source}
    files = (Path(inspect.getfile(importlib.import_module(name))).resolve() for name in own)
    return frozenset(files), root


@lru_cache(maxsize=256)
def _code_digest(files: frozenset[Path], root: Path) -> str:
    return code_digest(needed(files, root), root)


def files_of(entrant: Entrant, track: ScenarioSet) -> set[Path]:
    """Return every file that the artefact is: policies, and code with what lists it."""
    found = {located(path) for _, path in entrant.files}
    if not found:
        found.add(Path(inspect.getfile(importlib.import_module(entrant.source))).resolve())
    for scenario in track.scenarios():
        env = make_env(track.env, scenario.kwargs)
        model = model_of(track.env, scenario, env)
        made = controllers.make(entrant, model, env, training_seed=entrant.training_seeds[0])
        files, root = code_files(entrant, made)
        found |= needed(files, root)
        env.close()
    return found


def uncommitted(files: Iterable[Path]) -> list[Path]:
    """Return the files whose bytes are not those of the checkout's last commit.

    Raises
    ------
    ValueError
        If one is not in a git checkout, or there is no git.
    """
    return [file for file in sorted(files) if committed_bytes(file) != file.read_bytes()]


def committed_bytes(file: Path) -> bytes | None:
    """Return a file as it is in the last commit, ``None`` if it is not there.

    Raises
    ------
    ValueError
        If it is not in a git checkout, or there is no git.
    """
    try:
        top = _git(file.parent, "rev-parse", "--show-toplevel").decode().strip()
    except (OSError, subprocess.SubprocessError) as error:
        raise ValueError(
            f"{file} is not in a git checkout: an audit needs to know that the artefact was "
            "committed before the salt was drawn; clone the repository and commit it there"
        ) from error
    name = file.resolve().relative_to(Path(top).resolve()).as_posix()
    try:
        return _git(file.parent, "cat-file", "blob", f"HEAD:{name}")
    except subprocess.CalledProcessError:
        return None


def _git(folder: Path, *arguments: str) -> bytes:
    command = ["git", "-C", str(folder), *arguments]
    return subprocess.run(command, check=True, capture_output=True, timeout=20).stdout


def training_of(entrant: Entrant) -> list[dict[str, Any]] | None:
    """Return the training of each policy file as the card beside it says, ``None`` without any."""
    if not entrant.files:
        return None
    return [{"training_seed": seed, **_training(path)} for seed, path in entrant.files]


def _training(policy: Path) -> dict[str, Any]:
    card = located(policy).with_suffix(".json")
    if not card.is_file():
        return {}
    said = json.loads(card.read_text(encoding="utf-8"))
    known = {key: said[key] for key in ("command", "steps") if key in said}
    return known | dict(said.get("training") or {})
