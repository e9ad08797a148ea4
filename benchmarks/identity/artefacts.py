"""What a row is the score of: policy files, or the code and the numbers of a controller."""

from __future__ import annotations

import hashlib
import importlib
import inspect
import subprocess
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from benchmarks.identity import tasks
from benchmarks.identity.hashing import classes_in, digest
from benchmarks.identity.source_code import code_digest, needed
from benchmarks.runs import controllers, provenance
from benchmarks.runs.controllers import Entrant
from benchmarks.scenarios.scenario import ScenarioSet

RESIDUAL = "residual"
BASELINES = "baselines"
"""Package of what residual controllers correct."""
TUNED = controllers.ROOT / BASELINES / "tuned.yaml"
"""Knobs that searches found."""


@dataclass(frozen=True)
class Artefact:
    """A controller as files.

    Attributes
    ----------
    digest : str
        SHA-256 of the policy files, of all numbers that the controllers hold, and of their code.
    code : tuple of str
        Digests of the code with the knobs, which are the same on every machine.
    knobs : mapping of float
        What a search found for a controller, as it stands in ``baselines/core/tuned.yaml``.
    files : tuple of mapping
        Name, sha256, bytes and training_seed of each policy file.
    """

    digest: str
    code: tuple[str, ...]
    files: tuple[Mapping[str, Any], ...]
    knobs: Mapping[str, float]

    def record(self) -> dict[str, Any]:
        """Return the artefact as a row holds it."""
        return {
            "digest": self.digest,
            "code": list(self.code),
            "files": [dict(file) for file in self.files],
            "knobs": dict(self.knobs),
        }


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
        Digests of their code.
    """
    files = tuple(file_record(path, seed) for seed, path in entrant.files)
    said = tuple(sorted(set(code)))
    return Artefact(digest_of(files, parameters, said), said, files, dict(entrant.knobs))


def digest_of(
    files: Iterable[Mapping[str, Any]], parameters: Iterable[str], code: Iterable[str]
) -> str:
    """Return the digest of an artefact from what a row says of it; see :func:`combine`."""
    said = {
        "files": [[file["training_seed"], file["sha256"]] for file in files],
        "parameters": sorted(set(parameters)),
        "code": sorted(set(code)),
    }
    return digest(said)


def of(entrant: Entrant, track: ScenarioSet) -> Artefact:
    """Return the artefact of a controller in a track, without running it."""
    return _built(entrant, track, _bytes_of(entrant))[0]


def files_of(entrant: Entrant, track: ScenarioSet) -> frozenset[Path]:
    """Return every file that the artefact is: policies, knobs, and code with what lists it."""
    return _built(entrant, track, _bytes_of(entrant))[1]


def _bytes_of(entrant: Entrant) -> tuple[str, ...]:
    return tuple(file_record(path, seed)["sha256"] for seed, path in entrant.files)


@lru_cache(maxsize=1024)
def _built(
    entrant: Entrant, track: ScenarioSet, policies: tuple[str, ...]
) -> tuple[Artefact, frozenset[Path]]:
    """Build a controller for each plant and set of signals, once in a process."""
    listing = _page(entrant.source)
    found = {listing, *(located(path) for _, path in entrant.files)}
    found |= {TUNED} if entrant.knobs else set()
    numbers, code = [], []
    for model, env in tasks.built(track).told:
        for seed in entrant.training_seeds:
            made = controllers.make(entrant, model, env, training_seed=seed)
            numbers.append(controllers.parameters_digest(made))
            code.append(controller_code(entrant, made))
            found = found.union(*(_needed(*part) for part in code_files(entrant, made)))
    return combine(entrant, numbers, code), frozenset(found)


def controller_code(entrant: Entrant, controller: Any) -> str:
    """Return a digest of the code of a controller, and of its knobs to the last digit."""
    code = [_code_digest(*part) for part in code_files(entrant, controller)]
    return digest({"code": code, "knobs": dict(entrant.knobs)})


def code_files(entrant: Entrant, controller: Any) -> list[tuple[frozenset[Path], Path]]:
    """Return the files of a controller's own classes by packages, each with the package's place.

    What answers for a policy is its catalogue's package: the file is only read by it. A residual
    controller is of the package of the one that it corrects, too.
    """
    modules = {kind.__module__ for kind in classes_in(controller)}
    package = entrant.source.partition(".")[0]
    own = _within(modules, package)
    if entrant.files or not own:
        own.add(entrant.source)
    parts = [_part(own, package)]
    if entrant.kind == RESIDUAL:
        parts.append(_part(_within(modules, BASELINES), BASELINES))
    return parts


def _within(modules: Iterable[str], package: str) -> set[str]:
    return {name for name in modules if name.partition(".")[0] == package}


def _part(modules: Iterable[str], package: str) -> tuple[frozenset[Path], Path]:
    """Return the files of modules, and the folder that their package lies in."""
    place = _page(package)
    root = place.parent.parent if place.name == "__init__.py" else place.parent
    return frozenset(map(_page, modules)), root


def _page(module: str) -> Path:
    return Path(inspect.getfile(importlib.import_module(module))).resolve()


@lru_cache(maxsize=256)
def _needed(files: frozenset[Path], root: Path) -> frozenset[Path]:
    return frozenset(needed(files, root))


@lru_cache(maxsize=256)
def _code_digest(files: frozenset[Path], root: Path) -> str:
    return code_digest(_needed(files, root), root)


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
        top = top_of(file.parent)
    except (OSError, subprocess.SubprocessError) as error:
        raise ValueError(
            f"{file} is not in a git checkout: an audit needs to know that the artefact was "
            "committed before the salt was drawn; clone the repository and commit it there"
        ) from error
    return bytes_at("HEAD", file, top)


def top_of(folder: Path) -> Path:
    """Return the top of the git checkout that a folder is in."""
    return Path(provenance.git("rev-parse", "--show-toplevel", folder=folder)).resolve()


def bytes_at(commit: str, file: Path, top: Path) -> bytes | None:
    """Return a file of a checkout as it is in a commit, ``None`` if it is not there."""
    name = file.resolve().relative_to(top).as_posix()
    try:
        return provenance.git_bytes("cat-file", "blob", f"{commit}:{name}", folder=top)
    except subprocess.CalledProcessError:
        return None
