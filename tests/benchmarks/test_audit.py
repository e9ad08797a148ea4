"""Audit seeds: drawn once, after the artefact, and of no use to whoever tries many variants."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path

import bench_fakes
import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks import artefacts, audit, rows, scenarios
from benchmarks.__main__ import main
from benchmarks.canonical import digest
from benchmarks.controllers import find
from tests.benchmarks.row_helpers import commit, git, place, run_row, tiny


@pytest.fixture
def board(tmp_path: Path) -> Iterator[Path]:
    with place(tmp_path) as folder:
        yield folder


def test_seeds_follow_from_task_artefact_salt_scenario_and_number() -> None:
    text = b"task|artefact|salt|steps|3"
    first = int.from_bytes(hashlib.sha256(text).digest()[:8], "big")
    assert audit.seed_of("task", "artefact", "salt", "steps", 3) == first >> 11 < 2**53
    parts = ["task", "artefact", "salt", "steps"]
    found = {audit.seed_of(*parts, 0)}
    for k in range(4):
        changed = parts.copy()
        changed[k] += "_"
        found.add(audit.seed_of(*changed, 0))
    assert len(found) == 5


@pytest.mark.parametrize(("scenarios", "each"), [(1, 30), (2, 15), (8, 4), (30, 2), (40, 2)])
def test_there_are_thirty_audit_episodes_and_two_of_each_scenario(
    scenarios: int, each: int
) -> None:
    seeds = audit.seeds_of("t", "a", "s", [f"{k}" for k in range(scenarios)])
    assert {len(found) for found in seeds.values()} == {each}
    assert sum(map(len, seeds.values())) >= 30
    assert len({seed for found in seeds.values() for seed in found}) == scenarios * each


def test_a_salt_is_drawn_once_and_makes_the_row_an_audited_one(board: Path) -> None:
    entrant, track = find("trained"), tiny(board)
    reported = rows.load(run_row(board, "trained"))
    assert reported["audit"] is None
    drawn = audit.draw(entrant, track)
    assert audit.draw(entrant, track) == drawn
    assert len(audit.entries()) == 1
    row = rows.load(run_row(board, "trained"))
    assert row["audit"]["salt"] == drawn.salt
    assert {name: tuple(found) for name, found in row["audit"]["seeds"].items()} == drawn.seeds
    episodes = rows.episodes_of(row, "audit")
    assert len(episodes) == 2 * 30
    for run in (0, 1):  # the same seeds for every training seed
        seeds = [(e["scenario"], e["seed"]) for e in episodes if e["training_seed"] == run]
        assert seeds == [(name, seed) for name, found in drawn.seeds.items() for seed in found]
    assert row["aggregate"] == reported["aggregate"]
    scores, split = rows.published(row)
    assert split == "audit"
    assert scores["rms_error"]["mean"] == pytest.approx(
        rows.scores_of(episodes, "rms_error").mean()
    )
    gap = scores["rms_error"]["mean"] - row["aggregate"]["rms_error"]["mean"]
    assert row["audit"]["gap"]["rms_error"] == gap != 0.0


def test_the_command_draws_runs_and_tells(
    board: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(scenarios, "available", lambda: {"tiny": tiny(board)})
    folders = ["--out", str(board / "out"), "--cells", str(board / "cells"), "--jobs", "1"]
    assert main(["audit", "tiny--trained", *folders]) == 0
    (entry,) = audit.entries()
    said = capsys.readouterr().out
    assert f"tiny--trained: salt {entry['salt']} of {entry['drawn']}" in said
    assert "; audit " in said
    assert rows.load(board / "out" / "tiny--trained.json")["audit"]["salt"] == entry["salt"]
    for name, words in (("short--trained", "no track"), ("tiny--none", "no controller named")):
        assert main(["audit", name, *folders]) == 2
        assert words in capsys.readouterr().err
    assert audit.entries() == [entry]


def test_a_changed_artefact_has_no_salt_and_needs_another(board: Path) -> None:
    entrant, track = find("trained"), tiny(board)
    before = audit.draw(entrant, track)
    bench_fakes.write_policies(board / "policies", 0.02, 0.06)
    assert audit.find(entrant, track) is None
    with pytest.raises(ValueError, match=r"not as in the last commit: trained\.s1\.json; commit"):
        audit.draw(entrant, track)
    commit(board)
    after = audit.draw(entrant, track)
    assert after.draw == 2
    assert after.salt != before.salt
    assert not set(after.seeds.values()) & set(before.seeds.values())


def test_what_git_does_not_know_gets_no_salt(board: Path) -> None:
    bench_fakes.write_policies(board / "policies", 0.02, 0.05, 0.08)
    with pytest.raises(ValueError, match=r"trained\.s2\.json"):
        audit.draw(find("trained"), tiny(board))
    git(board, "add", "--all")  # known, and not committed
    with pytest.raises(ValueError, match=r"trained\.s2\.json"):
        audit.draw(find("trained"), tiny(board))
    assert audit.entries() == []


def test_outside_of_a_checkout_there_is_no_salt(
    board: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere = tmp_path_factory.mktemp("no checkout")
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(elsewhere.parent))
    bench_fakes.write_policies(elsewhere, 0.02)
    monkeypatch.setattr(bench_fakes, "POLICIES", elsewhere)
    with pytest.raises(ValueError, match="not in a git checkout"):
        audit.draw(find("trained"), tiny(board))


def test_the_files_of_a_classical_controller_are_its_code(board: Path) -> None:
    entrant, track = find("integral"), tiny(board)
    assert artefacts.files_of(entrant, track) == {Path(bench_fakes.__file__).resolve()}
    integral, inverse = (artefacts.of(find(name), track) for name in ("integral", "inverse"))
    assert integral.digest != inverse.digest
    assert integral == artefacts.of(entrant, track)


def test_salts_are_only_ever_added(board: Path) -> None:
    track = tiny(board)
    audit.draw(find("trained"), track)
    audit.check_only_added()
    commit(board)
    kept = json.loads(audit.FILE.read_text())
    for changed in ([], [{**kept["salts"][0], "salt": "0" * 32}]):
        audit.FILE.write_text(json.dumps({"salts": changed}))
        with pytest.raises(ValueError, match="were changed; restore it from git"):
            audit.check_only_added()
    bench_fakes.write_policies(board / "policies", 0.07)
    commit_policies_only(board)
    with pytest.raises(ValueError, match="were changed"):
        audit.draw(find("trained"), track)
    audit.FILE.write_text(json.dumps({"salts": kept["salts"] * 2}))
    with pytest.raises(ValueError, match="has two salts"):
        audit.entries()


def commit_policies_only(folder: Path) -> None:
    """Commit the policies and nothing else."""
    git(folder, "add", "policies")
    git(folder, "commit", "--quiet", "--message", "policies")


# A task of one number: a table of answers, given blindly, to what a seed draws. None can do better
# than by its size, but on known seeds one of a thousand does.
VARIANTS, STEPS, SIZE = 1000, 12, 0.5
PUBLIC = range(101, 106)
TASK = digest("a tiny task")
SCENARIOS = ("calm", "windy")
DRAWN = np.random.default_rng(3).normal(size=(9973, STEPS))


def disturbances(scenario: str, seeds: tuple[int, ...]) -> NDArray[np.float64]:
    """Return what the seeds of a scenario draw, shape (seeds, steps)."""
    return DRAWN[[(seed + len(scenario)) % len(DRAWN) for seed in seeds]]


def score(table: NDArray[np.float64], seeds: dict[str, tuple[int, ...]]) -> float:
    """Return the mean RMS over scenarios and seeds of what a table of answers leaves."""
    left = [disturbances(name, found) + table for name, found in seeds.items()]
    return float(np.mean([np.sqrt(np.mean(part**2, axis=-1)).mean() for part in left]))


def variants() -> NDArray[np.float64]:
    """Return a thousand artefacts that are equally good, shape (variants, steps)."""
    drawn = np.random.default_rng(7).normal(size=(VARIANTS, STEPS))
    return SIZE * drawn / np.sqrt(np.mean(drawn**2, axis=-1, keepdims=True))


def ground(tables: NDArray[np.float64], known: list[dict[str, tuple[int, ...]]]) -> int:
    """Return the variant with the lowest score on the seeds that its maker can know."""
    return int(np.argmin([score(table, seeds) for table, seeds in zip(tables, known, strict=True)]))


def audit_seeds(table: NDArray[np.float64], salt: str) -> dict[str, tuple[int, ...]]:
    return audit.seeds_of(TASK, digest(table), salt, SCENARIOS)


def test_grinding_a_thousand_variants_gains_nothing() -> None:
    tables = variants()
    public = dict.fromkeys(SCENARIOS, tuple(PUBLIC))
    best = ground(tables, [public] * VARIANTS)
    claimed = score(tables[best], public)
    level = np.mean([score(table, public) for table in tables])
    assert claimed < 0.93 * level  # on the public seeds it pays

    # each salt gives every variant audit seeds of its own
    salts = [f"{k:032x}" for k in range(40)]
    audited = [score(tables[best], audit_seeds(tables[best], salt)) for salt in salts]
    others = [score(table, audit_seeds(table, salts[0])) for table in tables]
    scatter = np.std(audited) / np.sqrt(len(salts)) + np.std(others) / np.sqrt(VARIANTS)
    assert abs(np.mean(audited) - np.mean(others)) < 3.0 * scatter
    assert np.mean(audited) - claimed > 0.8 * (np.mean(others) - claimed) > 0.0
    assert min(audited) > claimed


def test_without_a_salt_to_come_grinding_would_pay() -> None:
    tables, guess, drawn = variants(), "", "5" * 32
    best = ground(tables, [audit_seeds(table, guess) for table in tables])
    known = score(tables[best], audit_seeds(tables[best], guess))
    blind = score(tables[best], audit_seeds(tables[best], drawn))
    level = np.mean([score(table, audit_seeds(table, drawn)) for table in tables])
    assert known < 0.9 * level
    assert abs(blind - level) < 3.0 * np.std(
        [score(table, audit_seeds(table, drawn)) for table in tables]
    )
    assert blind > known


def test_tracks_have_names_that_a_seed_can_be_derived_from() -> None:
    tracks = scenarios.available().values()
    assert not [s.name for track in tracks for s in track.scenarios() if "|" in s.name]
