"""A short track and the fake controllers."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import board_fakes
import pytest
import yaml

from benchmarks.identity import artefacts, audit, tasks
from benchmarks.runs import controllers
from benchmarks.scenarios import scenario as scenarios

CONTENT = board_fakes.CONTENT | {
    "name": "short",
    "grid": {"hysteresis": ["maxwell_slip"], "reference": ["steps", "sines"]},
}


@pytest.fixture(autouse=True)
def anew() -> Iterator[None]:
    """Clear the identities of tracks and controllers: tests change what they are built from."""
    tasks.of.cache_clear()
    artefacts._answers.cache_clear()
    yield


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The only scenario file is ``short``, and the only controllers are the fake ones."""
    (tmp_path / "short.yaml").write_text(yaml.safe_dump(CONTENT))
    monkeypatch.setattr(controllers, "SOURCES", ("bench_fakes",))
    monkeypatch.setattr(scenarios, "FOLDER", tmp_path)
    monkeypatch.setattr(audit, "FILE", tmp_path / "rounds.json")
    return tmp_path


@pytest.fixture
def track(folder: Path) -> scenarios.ScenarioSet:
    """The short track."""
    return scenarios.load(folder / "short.yaml")
