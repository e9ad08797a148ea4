"""A short track and the fake controllers."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from benchmarks import artefacts, audit, controllers, scenarios, tasks

CONTENT = {
    "schema": 1,
    "name": "short",
    "version": 1,
    "title": "A short track",
    "env": "PAM/MusclePositioning-v0",
    "seeds": 3,
    "settle_seconds": 0.5,
    "hold_seconds": 0.3,
    "sensed": "sensor/contraction",
    "rests": ["steps"],
    "cost_scales": {"cost/contraction": 0.001, "cost/pressure": 1.0e5},
    "worst_case": {
        "rms_error": 0.025,
        "p95_error": 0.025,
        "max_error": 0.025,
        "steady_state_error": 0.025,
        "sensed_rms_error": 0.025,
        "pressure_travel": 1.2e6,
        "air_use": 5.0e-5,
        "constraint_cost": 10.0,
    },
    "kwargs": {"episode_seconds": 2.0},
    "grid": {"hysteresis": ["maxwell_slip"], "reference": ["steps", "sines"]},
}


@pytest.fixture(autouse=True)
def anew() -> Iterator[None]:
    """Forget what was built of tracks and controllers: tests change what they are built from."""
    for kept in (tasks.built, tasks.metrics_digest, artefacts._built):
        kept.cache_clear()
    yield


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The only scenario file is ``short``, and the only controllers are the fake ones."""
    (tmp_path / "short.yaml").write_text(yaml.safe_dump(CONTENT))
    monkeypatch.setattr(controllers, "SOURCES", (("bench_fakes", "bench_fakes", "classical"),))
    monkeypatch.setattr(scenarios, "FOLDER", tmp_path)
    monkeypatch.setattr(audit, "FILE", tmp_path / "rounds.json")
    return tmp_path


@pytest.fixture
def track(folder: Path) -> scenarios.ScenarioSet:
    """The short track."""
    return scenarios.load(folder / "short.yaml")
