"""The commit of a result: with a mark where any code is not as it was committed."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.identity.source_code import needed
from benchmarks.runs import provenance
from tests.benchmarks.row_helpers import commit, git

CODE = ("pam_envs", "sweeps", "baselines", "agents", "benchmarks", "benchmarks/scenarios")


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    for folder in (*CODE, "benchmarks/results", "benchmarks/site", "docs"):
        (tmp_path / folder).mkdir(exist_ok=True)
        (tmp_path / folder / "page.txt").write_text("as it was")
    (tmp_path / "benchmarks/rounds.json").write_text("{}")
    git(tmp_path, "init", "--quiet")
    commit(tmp_path)
    return tmp_path


@pytest.mark.parametrize("folder", CODE)
@pytest.mark.parametrize("name", ["page.txt", "new.py"])
def test_all_code_and_scenarios_count(folder: str, name: str, checkout: Path) -> None:
    assert provenance.changed(checkout) == []
    (checkout / folder / name).write_text("another")
    assert provenance.changed(checkout) == [f"{folder}/{name}"]


def test_what_a_run_writes_does_not(checkout: Path) -> None:
    places = ("results/a--b.json", "site/index.html", "rounds.json", "LEADERBOARD.md")
    for place in (*(f"benchmarks/{place}" for place in places), "docs/page.txt"):
        (checkout / place).write_text("another")
    assert provenance.changed(checkout) == []


def test_the_commit_has_a_mark_then(monkeypatch: pytest.MonkeyPatch) -> None:
    found = provenance.commit.__wrapped__
    monkeypatch.setattr(provenance, "git", lambda *_: "c" * 40)
    monkeypatch.setattr(provenance, "changed", lambda: ["pam_envs/kernels/build.py"])
    assert found() == "c" * 40 + "+"
    monkeypatch.setattr(provenance, "changed", lambda: [])
    assert found() == "c" * 40


def test_every_page_of_metrics_counts() -> None:
    pages = {path.name for path in provenance.HERE.glob("metrics*.py")}
    assert pages < set(provenance.SCORING)
    assert all((provenance.HERE / name).is_file() for name in provenance.SCORING)


def test_all_that_a_cell_is_computed_by_counts() -> None:
    kept_beside = {"__init__.py", "audit.py", "provenance.py", "store.py", "tasks.py"}
    used = needed([provenance.HERE / "cells.py"], provenance.ROOT)
    assert {path.name for path in used} - kept_beside == set(provenance.SCORING)
