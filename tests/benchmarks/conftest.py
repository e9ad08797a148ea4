"""A short track and the fake controllers."""

import board_fakes
import pytest
import yaml

from benchmarks.board import leaderboard
from benchmarks.identity import artefacts, audit, tasks
from benchmarks.runs import controllers, rows
from benchmarks.scenarios import scenario as scenarios

CONTENT = board_fakes.CONTENT | {
    "name": "short",
    "grid": {"hysteresis": ["maxwell_slip"], "reference": ["steps", "sines"]},
}


@pytest.fixture(scope="session")
def committed():
    """The rows of this checkout, as the board shows them."""
    return leaderboard.load(rows.RESULTS)


@pytest.fixture(autouse=True)
def anew():
    """Clear the identities of tracks and controllers: tests change what they are built from."""
    tasks.of.cache_clear()
    artefacts._answers.cache_clear()
    yield


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The only scenario file is ``short``, and the only controllers are the fake ones."""
    (tmp_path / "short.yaml").write_text(yaml.safe_dump(CONTENT))
    monkeypatch.setattr(controllers, "SOURCES", ("bench_fakes",))
    monkeypatch.setattr(scenarios, "FOLDER", tmp_path)
    monkeypatch.setattr(audit, "FILE", tmp_path / "rounds.json")
    return tmp_path


@pytest.fixture
def track(folder):
    """The short track."""
    return scenarios.load(folder / "short.yaml")
