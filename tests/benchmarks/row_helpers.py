"""Rows of a tiny track for tests: a classical controller, and a trained one with its audit."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bench_fakes
import pytest
import yaml

from benchmarks.identity import audit
from benchmarks.runs import controllers
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


def furnish(folder: Path) -> None:
    """Write a scenario, policies and tuned settings into a folder."""
    (folder / "tiny.yaml").write_text(yaml.safe_dump(TINY))
    bench_fakes.write_policies(folder / "policies", *GAINS)
    bench_fakes.write_knobs(folder / "policies")


@contextmanager
def place(folder: Path) -> Iterator[Path]:
    """Make a folder of policies, scenarios and rounds, which the harness then uses."""
    if not (folder / "tiny.yaml").exists():
        furnish(folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(controllers, "SOURCES", ("bench_fakes",))
        patch.setattr(bench_fakes, "POLICIES", folder / "policies")
        patch.setattr(scenarios, "FOLDER", folder)
        patch.setattr(audit, "FILE", folder / "rounds.json")
        yield folder


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
