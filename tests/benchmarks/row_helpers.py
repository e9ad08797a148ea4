"""Rows of a tiny track for tests: a classical controller, and a trained one with its audit."""

from __future__ import annotations

import subprocess
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bench_fakes
import pytest
import yaml

from benchmarks.identity import artefacts, audit
from benchmarks.identity.artefacts import uncommitted
from benchmarks.runs import controllers, provenance
from benchmarks.runs.controllers import find
from benchmarks.runs.runner import Options, run
from benchmarks.scenarios import scenario as scenarios
from benchmarks.scenarios.scenario import ScenarioSet
from tests.benchmarks.conftest import CONTENT

GAINS = (0.02, 0.05)
TINY: dict[str, Any] = {
    **CONTENT,
    "name": "tiny",
    "seeds": 2,
    "settle_seconds": 0.2,
    "hold_seconds": 0.1,
    "kwargs": {"episode_seconds": 0.6},
}


def git(folder: Path, *arguments: str) -> None:
    """Run git in a folder, under a name of its own."""
    who = ["-c", "user.name=tests", "-c", "user.email=tests@example.org"]
    subprocess.run(["git", "-C", str(folder), *who, *arguments], check=True, capture_output=True)


def commit(folder: Path) -> None:
    """Commit all that is in a folder."""
    git(folder, "add", "--all")
    git(folder, "commit", "--quiet", "--allow-empty", "--message", "as it is")


@contextmanager
def place(folder: Path) -> Iterator[Path]:
    """Make a folder a checkout of policies, scenarios and rounds, which the harness then uses."""
    (folder / "tiny.yaml").write_text(yaml.safe_dump(TINY))
    bench_fakes.write_policies(folder / "policies", *GAINS)
    bench_fakes.write_knobs(folder / "policies")
    git(folder, "init", "--quiet")
    commit(folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(controllers, "SOURCES", (("bench_fakes", "bench_fakes", "classical"),))
        patch.setattr(bench_fakes, "POLICIES", folder / "policies")
        patch.setattr(artefacts, "TUNED", folder / "policies" / "tuned.yaml")
        patch.setattr(scenarios, "FOLDER", folder)
        patch.setattr(audit, "FILE", folder / "rounds.json")
        # the checkout that is tested may hold what is not committed yet
        patch.setattr(provenance, "changed", lambda: [])
        patch.setattr(artefacts, "uncommitted", lambda files: uncommitted(outside(files)))
        yield folder


def outside(files: Iterable[Path]) -> list[Path]:
    """Return files that are not of the checkout that is tested."""
    return [file for file in files if not file.is_relative_to(controllers.ROOT)]


def tiny(folder: Path) -> ScenarioSet:
    """Return the tiny track."""
    return scenarios.load(folder / "tiny.yaml")


def draw(folder: Path, *names: str) -> audit.Round:
    """Draw a round of the tiny track for controllers."""
    return audit.draw(tiny(folder), [find(name) for name in names])


def run_row(folder: Path, name: str, **changes: Any) -> Path:
    """Run a controller and return the path of its row."""
    given = {"jobs": 1, "out": folder / "out", "cells": folder / "cells", **changes}
    report = run([(find(name), tiny(folder))], Options(**given))
    assert not report.missing
    return report.rows[0]
