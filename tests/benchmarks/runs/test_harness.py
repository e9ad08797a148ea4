"""Runs: rows, checkpoints of cells, and files that survive a kill."""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.board import leaderboard
from benchmarks.runs import rows
from benchmarks.runs.controllers import find
from benchmarks.runs.runner import Options, Report, run
from benchmarks.runs.store import (
    comparable,
    read_record,
    seal,
    write_record,
)
from benchmarks.scenarios.scenario import ScenarioSet
from benchmarks.scoring import metrics

ROOT = Path(__file__).resolve().parents[3]
NAMES = ("low", "middle", "integral")


def options(folder: Path, **changes: Any) -> Options:
    return Options(**{"jobs": 1, "out": folder / "out", "cells": folder / "cells", **changes})


def score(track: ScenarioSet, folder: Path, *names: str, **changes: Any) -> Report:
    return run([(find(n), track) for n in names or NAMES], options(folder, **changes))


def lasting(path: Path) -> dict[str, Any]:
    return comparable(read_record(path))


def test_rows_do_not_depend_on_checkpoint_and_processes(track, folder):
    first = score(track, folder)
    assert not first.missing
    assert first.computed == len(NAMES) * 2
    row = lasting(first.rows[0])
    assert row["scenarios"]["digest"] == track.digest
    assert row["seeds"] == {name: list(seeds) for name, seeds in track.seeds.items()}
    assert len(row["episodes"]) == 6
    before = {p.name: lasting(p) for p in first.rows}
    again = score(track, folder)
    assert (again.computed, again.found) == (0, first.computed)
    parallel = score(track, folder / "other", jobs=2)
    assert {p.name: lasting(p) for p in parallel.rows} == before


def test_refused_action_is_scored_at_the_worst_case(track, folder):
    (path,) = score(track, folder, "refused").rows
    row = lasting(path)
    assert [episode["failed"] for episode in row["episodes"]] == [True] * 6
    worst = track.content["worst_case"]["rms_error"]
    assert rows.scores_of(row["episodes"], "rms_error") == pytest.approx(worst)
    text = leaderboard.files([rows.load(path)])["leaderboard/MusclePositioning.md"]
    assert "6 of 6" in text


def test_corrupt_cell_is_set_aside_and_computed_again(track, folder):
    (path,) = score(track, folder, "low").rows
    before = lasting(path)
    cells = sorted((folder / "cells").glob("*.json"))
    cells[0].write_text(cells[0].read_text()[:200])
    content = json.loads(cells[1].read_text())
    content["episodes"] = []
    cells[1].write_text(json.dumps(content))
    report = score(track, folder, "low")
    assert report.computed == 2
    assert len(report.quarantined) == 2
    assert lasting(report.rows[0]) == before


def test_interrupted_write_leaves_the_old_file_and_is_swept(tmp_path, monkeypatch):
    path = tmp_path / "record.json"
    write_record(path, {"k": 1})
    for call in ("fsync", "replace"):
        with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
            patch.setattr(os, call, interrupt)
            write_record(path, {"k": 2})
        assert read_record(path)["k"] == 1


def interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def test_metrics_of_known_episodes():
    t = 0.01 * np.arange(1000)
    error = 2e-3 * np.sin(2 * np.pi * t)
    assert metrics.rms(error) == pytest.approx(2e-3 / np.sqrt(2), rel=1e-3)
    assert metrics.percentile_95(error) == pytest.approx(2e-3 * np.sin(0.475 * np.pi), rel=1e-2)
    assert seal({"a": 1.0})["checksum"] != seal({"a": 1.0000001})["checksum"]
