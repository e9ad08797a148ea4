"""The commit of a result, with a mark for changed code."""

import subprocess
from pathlib import Path

import pytest

from benchmarks.runs import provenance

CODE = ("pam_envs", "sweeps", "baselines", "agents", "benchmarks", "benchmarks/scenarios")


def git(folder: Path, *arguments: str) -> None:
    """Run git in a folder, under a name of its own."""
    who = ["-c", "user.name=tests", "-c", "user.email=tests@example.org"]
    subprocess.run(["git", "-C", str(folder), *who, *arguments], check=True, capture_output=True)


@pytest.fixture
def checkout(tmp_path):
    written = (f"benchmarks/{name}" for name in ("results", "leaderboard", "site"))
    for folder in (*CODE, *written, "docs"):
        (tmp_path / folder).mkdir(exist_ok=True)
        (tmp_path / folder / "page.txt").write_text("as it was")
    (tmp_path / "benchmarks/rounds.json").write_text("{}")
    git(tmp_path, "init", "--quiet")
    git(tmp_path, "add", "--all")
    git(tmp_path, "commit", "--quiet", "--message", "as it is")
    return tmp_path


@pytest.mark.parametrize("folder", CODE)
@pytest.mark.parametrize("name", ["page.txt", "new.py"])
def test_changed_code_and_scenarios_are_listed(folder, name, checkout):
    assert provenance.changed(checkout) == []
    (checkout / folder / name).write_text("another")
    assert provenance.changed(checkout) == [f"{folder}/{name}"]


def test_files_that_a_run_writes_are_not_listed(checkout):
    places = (
        "results/b.json.xz",
        "leaderboard/a.md",
        "site/a.html",
        "rounds.json",
        "LEADERBOARD.md",
    )
    for place in (*(f"benchmarks/{place}" for place in places), "docs/page.txt"):
        (checkout / place).write_text("another")
    assert provenance.changed(checkout) == []


def test_commit_of_changed_code_has_a_mark(monkeypatch):
    found = provenance.commit.__wrapped__
    monkeypatch.setattr(provenance, "git", lambda *_: "c" * 40)
    monkeypatch.setattr(provenance, "changed", lambda: ["pam_envs/kernels/build.py"])
    assert found() == "c" * 40 + "+"
    monkeypatch.setattr(provenance, "changed", lambda: [])
    assert found() == "c" * 40
