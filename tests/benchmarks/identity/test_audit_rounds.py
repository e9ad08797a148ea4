"""Audit rounds: one salt per track, drawn after all artefacts; no gain from selecting variants."""

import dataclasses
import hashlib
import json
import subprocess
from pathlib import Path

import bench_fakes
import pytest
from filelock import FileLock, Timeout

from baselines.core import tuned
from benchmarks.__main__ import main
from benchmarks.identity import audit, hashing, tasks
from benchmarks.runs import controllers, rows
from benchmarks.runs.controllers import find
from benchmarks.runs.store import comparable, read_record
from benchmarks.runs.verify import verify
from benchmarks.scenarios import scenario as scenarios
from benchmarks.scoring import metrics
from tests.benchmarks.row_helpers import draw, place, run_row, tiny


@pytest.fixture
def board(tmp_path):
    with place(tmp_path) as folder:
        yield folder


def a_round(**changes: object) -> audit.Round:
    """Return a round of two controllers."""
    given = {
        "track": "tiny",
        "number": 1,
        "task": {"digest": "task"},
        "entrants": {"low": {"digest": "a"}, "high": {"digest": "b"}},
        "frozen": "frozen",
        "salt": "salt",
        "drawn": "2026-01-01",
        "commit": "c" * 40,
    }
    return audit.Round(**{**given, **changes})


def test_changed_round_is_found_even_if_it_is_committed(tmp_path, monkeypatch):
    file = tmp_path / "rounds.json"
    monkeypatch.setattr(audit, "FILE", file)

    def commit(*rounds: audit.Round) -> None:
        file.write_text(json.dumps({"rounds": [dataclasses.asdict(entry) for entry in rounds]}))
        author = ("-c", "user.name=test", "-c", "user.email=test@example.org")
        for command in (["init", "-q"], ["add", "."], [*author, "commit", "-qm", "rounds"]):
            subprocess.run(["git", "-C", str(tmp_path), *command], check=True)

    first, second = a_round(), a_round(number=2, salt="later")
    commit(first)
    commit(first, second)
    assert audit.altered() == []
    for wrong in (a_round(salt="chosen"), a_round(frozen="other"), a_round(drawn="2026-01-02")):
        commit(wrong, second)
        (said,) = audit.altered()
        assert said.startswith("round 1 of tiny is not that of commit ")
    commit(first)
    assert any(said.startswith("round 2 of tiny") for said in audit.altered())


def test_seeds_follow_from_frozen_identity_salt_scenario_and_number():
    first = int.from_bytes(hashlib.sha256(b"frozen|salt|steps|3").digest()[:8], "big")
    assert a_round().seeds(["steps", "sines"])["steps"][3] == first >> 11 < 2**53
    found = {a_round().seeds(["steps"])["steps"][0], a_round().seeds(["sines"])["sines"][0]}
    changed = ({"frozen": "other"}, {"salt": "other"})
    found |= {a_round(**change).seeds(["steps"])["steps"][0] for change in changed}
    assert len(found) == 4


@pytest.mark.parametrize(("scenarios", "each"), [(1, 30), (2, 15), (8, 4), (30, 2), (40, 2)])
def test_there_are_thirty_audit_episodes_and_two_of_each_scenario(scenarios, each):
    seeds = a_round().seeds([f"{k}" for k in range(scenarios)])
    assert {len(found) for found in seeds.values()} == {each}
    assert sum(map(len, seeds.values())) >= 30
    assert len({seed for found in seeds.values() for seed in found}) == scenarios * each


def test_round_is_drawn_once_and_all_of_it_run_the_same_episodes(board):
    reported = rows.load(run_row(board, "trained"))
    assert reported["audit"] is None
    assert not audit.in_last_round(reported)
    drawn = draw(board, "trained", "integral")
    assert draw(board, "trained", "integral") == drawn == audit.last("tiny")
    assert audit.rounds() == [drawn]
    assert drawn.number == 1
    assert drawn.task["digest"] == tasks.of(tiny(board)).identity.digest
    seeds = drawn.seeds([scenario.name for scenario in tiny(board).scenarios()])
    expected = [(name, seed) for name, own in seeds.items() for seed in own]
    for name, runs in (("trained", (0, 1)), ("integral", (None,))):
        row = rows.load(run_row(board, name))
        assert audit.in_last_round(row)
        same = {"salt": drawn.salt, "drawn": drawn.drawn, "commit": drawn.commit}
        assert row["audit"].items() >= {"round": 1, "entry": 1, **same}.items()
        assert {k: tuple(own) for k, own in row["audit"]["seeds"].items()} == seeds
        episodes = rows.episodes_of(row, "audit")
        for run in runs:
            mine = [(e["scenario"], e["seed"]) for e in episodes if e["training_seed"] == run]
            assert mine == expected


def test_frozen_identity_is_of_task_and_all_artefacts(board):
    one, both = draw(board, "low"), draw(board, "low", "middle")
    assert one.frozen != both.frozen
    assert one.entrants["low"] == both.entrants["low"]
    assert {"digest", "answers", "knobs", "files"} == set(one.entrants["low"])


def test_command_draws_runs_and_prints(board, monkeypatch, capsys):
    names = ("trained", "low")
    chosen = {name: entry for name, entry in bench_fakes.CONTROLLERS.items() if name in names}
    monkeypatch.setattr(bench_fakes, "CONTROLLERS", chosen)
    folders = ["--out", str(board / "out"), "--cells", str(board / "cells"), "--jobs", "1"]
    assert main(["audit", "tiny", *folders]) == 0
    (drawn,) = audit.rounds()
    said = capsys.readouterr().out
    assert f"tiny: round 1, 2 controllers, salt {drawn.salt} of {drawn.drawn}" in said
    assert "; audit " in said
    before = lasting(board / "out")
    assert set(before) == {"tiny--trained", "tiny--low"}
    assert main(["audit", "--all", *folders]) == 0
    assert "0 cells computed" in capsys.readouterr().out
    assert lasting(board / "out") == before
    assert audit.rounds() == [drawn]
    for given in (["short"], [], ["tiny", "--all"]):
        assert main(["audit", *given, *folders]) == 2
    assert "name tracks, or give --all" in capsys.readouterr().err


def lasting(folder: Path) -> dict[str, object]:
    """Return the compared part of the rows of a folder."""
    return {rows.name_of(path): comparable(read_record(path)) for path in rows.files(folder)}


def test_changed_controller_is_self_reported_until_the_next_round(board):
    first = draw(board, "trained", "low")
    old = rows.load(run_row(board, "low"))
    bench_fakes.write_policies(board / "policies", 0.02, 0.06)
    assert audit.find(find("trained"), tiny(board)) is None
    assert first.changes(find("trained"), tiny(board)) == ["policy files changed"]
    assert first.changes(find("middle"), tiny(board)) == ["no entrant of round 1"]
    second = draw(board, "trained", "low")
    assert (first.number, second.number) == (1, 2)
    names = [scenario.name for scenario in tiny(board).scenarios()]
    assert not set(first.seeds(names).values()) & set(second.seeds(names).values())
    entries = [audit.find(find(name), tiny(board)) for name in ("trained", "low")]
    assert [found.entry for found in entries if found] == [2, 1]
    assert not audit.in_last_round(old)  # the same artefact on other episodes
    assert audit.in_last_round(rows.load(run_row(board, "low")))
    assert draw(board, "low").number == 3  # a controller that is gone is a change, too


def test_replaced_round_keeps_digests_and_the_last_one_is_whole(board):
    first = draw(board, "trained", "low")
    bench_fakes.write_policies(board / "policies", 0.02, 0.06)
    second = draw(board, "trained", "low")
    reduced, kept = audit.rounds()
    assert kept == second
    assert dataclasses.replace(reduced, task=first.task, entrants=first.entrants) == first
    assert reduced.task == {"digest": first.task["digest"]}
    assert reduced.entrants == {n: {"digest": e["digest"]} for n, e in first.entrants.items()}
    assert len(audit.FILE.read_text().splitlines()) == 2 + 2  # a line for each


def test_last_rounds_are_of_what_they_froze():
    last = {entry.track: entry for entry in audit.rounds()}.values()
    for entry in last:
        frozen = {"task": entry.task["digest"], "entrants": entry.entrants}
        assert entry.frozen == hashing.digest(frozen), entry.track
    assert audit.text_of(audit.rounds()) == audit.FILE.read_text(encoding="utf-8")


def test_changed_metric_needs_a_round(board, monkeypatch):
    draw(board, "low")
    monkeypatch.setattr(metrics, "percentile_95", lambda error: 0.0)
    tasks.of.cache_clear()
    assert audit.find(find("low"), tiny(board)) is None
    assert draw(board, "low").number == 2


def test_rows_of_an_altered_round_drift(board):
    draw(board, "trained")
    path = run_row(board, "trained")
    assert verify(path).holds
    content = json.loads(audit.FILE.read_text())
    content["rounds"][0]["salt"] = "0" * 32
    audit.FILE.write_text(json.dumps(content))
    assert any(line.startswith("audit.salt: ") for line in verify(path).drifted)


def test_simultaneous_draws_are_serialised(board, monkeypatch):
    lock = audit.FILE.with_name(f".{audit.FILE.name}.lock")
    monkeypatch.setattr(audit, "FileLock", lambda path: FileLock(path, timeout=0.1))
    with FileLock(lock), pytest.raises(Timeout):
        draw(board, "low")
    assert draw(board, "low").number == 1


def test_entrants_have_the_knobs_that_a_search_found():
    found = tuned.read()
    for name, entrant in controllers.available().items():
        assert dict(entrant.knobs) == (found[entrant.tuned].knobs if entrant.tuned else {})
        if entrant.kind == "classical":
            assert entrant.tuned == (name if name in found else "")


def test_damaged_file_of_rounds_is_refused(board):
    draw(board, "trained")
    (kept,) = json.loads(audit.FILE.read_text())["rounds"]
    audit.FILE.write_text(json.dumps({"rounds": [kept, kept]}))
    with pytest.raises(ValueError, match="round 1 of tiny in place of round 2"):
        audit.rounds()
    audit.FILE.write_text(json.dumps({"rounds": [{"salt": "0"}]}))
    with pytest.raises(ValueError, match="not a list of rounds"):
        audit.rounds()


def test_scenario_names_contain_no_separator():
    tracks = scenarios.available().values()
    assert not [s.name for track in tracks for s in track.scenarios() if "|" in s.name]
