"""A row that was altered does not verify, whatever its checksum says."""

from __future__ import annotations

import copy
import dataclasses
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import bench_fakes
import numpy as np
import pytest

from benchmarks import audit, cells, provenance, rows, scenarios, tasks, verify
from benchmarks.__main__ import main
from benchmarks.controllers import find
from benchmarks.store import read_record, write_record
from pam_envs.envs import muscle_positioning
from pam_envs.pneumatics.regulator import Regulator
from tests.benchmarks.row_helpers import place, run_row, tiny

Row = dict[str, Any]
SALT = "4f" * 16


@pytest.fixture(scope="module")
def board(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    with place(tmp_path_factory.mktemp("board")) as folder:
        audit.draw(find("trained"), tiny(folder))
        run_row(folder, "trained")
        run_row(folder, "integral")
        run_row(folder, "raises")
        yield folder


def verdict_of(board: Path, name: str) -> verify.Verdict:
    return verify.verify(board / "out" / f"tiny--{name}.json", folder=board)


@pytest.fixture
def forged(board: Path) -> Iterator[Callable[..., verify.Verdict]]:
    """Return what alters a row, seals it anew and verifies it; the row is put back afterwards."""
    kept: dict[Path, bytes] = {}

    def alter(name: str, change: Callable[[Row], None]) -> verify.Verdict:
        path = board / "out" / f"tiny--{name}.json"
        kept[path] = path.read_bytes()
        row = read_record(path)
        before = copy.deepcopy(row)
        change(row)
        assert row != before
        write_record(path, row)
        assert rows.load(path)  # sealed anew: the checksum does not tell
        return verdict_of(board, name)

    yield alter
    for path, content in kept.items():
        path.write_bytes(content)


@pytest.mark.parametrize("name", ["trained", "integral", "raises"])
def test_an_honest_row_holds(name: str, board: Path) -> None:
    verdict = verdict_of(board, name)
    assert verdict.holds, verdict.drifted
    assert not [note for note in verdict.notes if "commit" not in note]


def tell(verdict: verify.Verdict, words: str) -> None:
    assert not verdict.holds
    assert any(words in line for line in verdict.drifted), verdict.drifted


# The first of five: an altered number.


ALTERED = [
    *(("trained", place) for place in ("aggregate", "audit", "by", "episode", "gap", "cost")),
    *(("integral", place) for place in ("aggregate", "by", "episode")),
]


@pytest.mark.parametrize(("name", "place"), ALTERED)
def test_an_altered_number(name: str, place: str, forged: Any) -> None:
    def change(row: Row) -> None:
        parts = {
            "aggregate": lambda: (row["aggregate"]["rms_error"], "mean"),
            "audit": lambda: (row["audit"]["aggregate"]["rms_error"], "low"),
            "by": lambda: (row["by"]["reference"], "steps"),
            "episode": lambda: (row["episodes"][-1]["scores"], "rms_error"),
            "gap": lambda: (row["audit"]["gap"], "rms_error"),
            "cost": lambda: (row["controller"]["training"][0], "steps"),
        }
        record, key = parts[place]()
        record[key] *= 1.0 - 1e-12 if isinstance(record[key], float) else 2

    verdict = forged(name, change)
    assert len(verdict.drifted) == 1
    assert "recorded" in verdict.drifted[0]


# The second: a swapped artefact.


def test_a_swapped_policy(board: Path) -> None:
    try:
        bench_fakes.write_policies(board / "policies", 0.02, 0.0500001)
        verdict = verdict_of(board, "trained")
    finally:
        bench_fakes.write_policies(board / "policies", 0.02, 0.05)
    tell(verdict, "controller.artefact.files[1].sha256")
    tell(verdict, "controller.artefact.digest")


def test_a_policy_whose_digest_was_swapped_in_the_row(forged: Any) -> None:
    def change(row: Row) -> None:
        row["controller"]["artefact"]["files"][0]["sha256"] = "0" * 64
        row["controller"]["artefact"]["digest"] = "0" * 64

    tell(forged("trained", change), "controller.artefact.digest")


def test_another_controller_under_the_name(forged: Any) -> None:
    verdict = forged("integral", lambda row: row["controller"].update(name="low"))
    tell(verdict, "row: 'tiny--integral' recorded, 'tiny--low' now")
    tell(verdict, "controller.artefact.digest")


def test_a_classical_controller_with_another_constant(
    board: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make = bench_fakes.make_controller

    def other(name: str, *arguments: Any, **named: Any) -> Any:
        return dataclasses.replace(make(name, *arguments, **named), gain=0.0200001)

    monkeypatch.setattr(bench_fakes, "make_controller", other)
    tell(verdict_of(board, "integral"), "controller.artefact.digest")


# The third: an edited constant of the environment.


def test_an_edited_constant_of_the_plant(board: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = cells.make_env

    def softer(env: str, kwargs: Any) -> Any:
        plant = made(env, kwargs).unwrapped.plant
        return made(env, {**kwargs, "plant": plant.replace({"regulator.time_constant": 0.0123})})

    assert "time_constant" in {field.name for field in dataclasses.fields(Regulator)}
    for module in (cells, tasks):
        monkeypatch.setattr(module, "make_env", softer)
    verdict = verdict_of(board, "integral")
    tell(verdict, "plants.")
    tell(verdict, "env.digest")
    tell(verdict, "task")


def test_an_edited_constant_that_no_digest_holds(
    board: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    low, high = muscle_positioning.REFERENCE_RANGE
    monkeypatch.setattr(muscle_positioning, "REFERENCE_RANGE", (low, high * (1.0 - 1e-6)))
    verdict = verdict_of(board, "integral")
    assert not [line for line in verdict.drifted if line.startswith(("plants", "task"))]
    tell(verdict, "trajectory")


def test_plants_that_were_edited_in_the_row(forged: Any) -> None:
    def change(row: Row) -> None:
        row["plants"] = {name: "0" * 16 for name in row["plants"]}

    tell(forged("integral", change), "plants.")


# The fourth: a failing episode that was dropped.


def test_a_dropped_failing_episode(forged: Any) -> None:
    def change(row: Row) -> None:
        assert row["episodes"].pop()["failed"]
        row["failures"] -= 1

    tell(forged("raises", change), "episodes: 1 missing, the first: public, ")


def test_a_failing_episode_that_another_one_replaces(forged: Any) -> None:
    def change(row: Row) -> None:
        row["episodes"][-1] = copy.deepcopy(row["episodes"][0])

    verdict = forged("trained", change)
    tell(verdict, "episodes: 1 missing, the first: audit, ")
    tell(verdict, "episodes: 1 not to be there, the first: public, ")


def test_a_failure_that_was_declared_none(forged: Any) -> None:
    tell(forged("raises", lambda row: row["episodes"][0].update(failed=False)), "failed: False")


# The fifth: another version.


def test_another_version_of_the_environment(forged: Any) -> None:
    def change(row: Row) -> None:
        text = json.dumps(row).replace("Positioning-v0", "Positioning-v1")
        row.update(json.loads(text.replace('"version": 0', '"version": 1')))

    verdict = forged("integral", change)
    tell(verdict, "MusclePositioning-v1, and this checkout has PAM/MusclePositioning-v0")


def test_a_version_edited_beside_the_scenarios(forged: Any) -> None:
    tell(forged("integral", lambda row: row["env"].update(version=1)), "env.version: 1 recorded")


def test_scenarios_of_another_version(forged: Any) -> None:
    def change(row: Row) -> None:
        row["scenarios"]["content"]["settle_seconds"] = 0.25

    verdict = forged("integral", change)
    tell(verdict, "scenarios.digest")
    tell(verdict, "is not that of tiny.yaml, version 1")


# And what an audit rests on.


def test_a_salt_of_ones_own(forged: Any, board: Path) -> None:
    def change(row: Row) -> None:
        row["audit"]["salt"] = SALT

    verdict = forged("trained", change)
    tell(verdict, "audit.salt: 4f4f4f4f4f4f recorded, ")
    tell(verdict, "audit.seeds: not those of task, artefact and salt")


def test_audit_seeds_of_ones_own(forged: Any) -> None:
    def change(row: Row) -> None:
        name = next(iter(row["audit"]["seeds"]))
        row["audit"]["seeds"][name][0] += 1

    tell(forged("trained", change), "audit.seeds: not those")


def test_an_audit_that_was_left_out(forged: Any) -> None:
    def change(row: Row) -> None:
        row["audit"] = None
        row["episodes"] = rows.episodes_of(row)

    verdict = forged("trained", change)
    tell(verdict, "audit: left out, though a salt was drawn on 20")
    tell(verdict, "episodes: 60 missing, the first: audit")


def test_an_audit_whose_salt_nobody_drew(board: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(audit, "FILE", board / "none.json")
    tell(verdict_of(board, "trained"), "audit: no salt was drawn for this task and artefact")


def test_a_label_that_says_less_than_the_controller_knows(forged: Any) -> None:
    def change(row: Row) -> None:
        row["controller"]["knowledge"] = "nothing"

    tell(forged("integral", change), "controller.knowledge: 'nothing' recorded, 'true model' now")


def test_a_row_edited_by_hand_and_one_that_is_none(board: Path, tmp_path: Path) -> None:
    path = tmp_path / "tiny--integral.json"
    row = json.loads((board / "out" / path.name).read_bytes())
    row["row"] = "better"
    path.write_text(json.dumps(row))
    tell(verify.verify(path, folder=board), "file: the checksum does not match")
    path.write_text("no row")
    tell(verify.verify(path, folder=board), "cannot be read")
    write_record(path, {**row, "schema": 1})
    tell(verify.verify(path, folder=board), "run it again: python -m benchmarks run --track tiny")


# On another machine a policy answers a little otherwise.


@pytest.fixture
def elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another processor, on which policies round otherwise."""
    monkeypatch.setattr(provenance, "cpu", lambda: "another")
    predict = bench_fakes.Trained.predict

    def rounded(self: Any, *arguments: Any, **named: Any) -> Any:
        action, state = predict(self, *arguments, **named)
        return action * (1.0 + 2e-7), state

    monkeypatch.setattr(bench_fakes.Trained, "predict", rounded)


def test_elsewhere_a_policy_is_verified_by_its_actions(
    board: Path, elsewhere: None, forged: Any
) -> None:
    verdict = verdict_of(board, "trained")
    assert verdict.holds, verdict.drifted
    assert any("recorded actions replayed" in note for note in verdict.notes)


KINDS = ("episode", "effort", "mean", "gap", "failed", "actions", "summary")


@pytest.mark.parametrize("kind", KINDS)
def test_elsewhere_a_forged_policy_is_found(
    kind: str, board: Path, elsewhere: None, forged: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def change(row: Row) -> None:
        if kind == "episode":
            row["episodes"][0]["scores"]["rms_error"] *= 1.0 - 1e-6
        if kind == "effort":  # of a training seed whose actions are not kept
            for episode in row["episodes"]:
                if episode["training_seed"] == 1 and episode["split"] == "public":
                    episode["scores"]["air_use"] *= 0.9
            mean = np.mean(rows.scores_of(rows.episodes_of(row), "air_use"))
            row["aggregate"]["air_use"]["mean"] = float(mean)
        if kind == "gap":
            row["audit"]["gap"]["rms_error"] = 0.0
        if kind == "failed":
            row["episodes"][-1]["failure"] = "the weather"
        if kind == "mean":
            row["audit"]["aggregate"]["rms_error"]["mean"] *= 1.0 - 1e-6
        if kind == "actions":
            name = next(iter(row["actions"]))
            moved = cells.unpack(row["actions"][name]["1"])
            moved[20:] += 1e-5
            row["actions"][name]["1"] = cells.pack(moved)
        if kind == "summary":
            row["controller"]["summary"] = "another"

    words = {
        "episode": "replayed maxwell_slip_steps, seed 1, rms_error",
        "effort": "aggregate.air_use.mean",
        "mean": "audit.aggregate.rms_error.mean",
        "gap": "audit.gap.rms_error",
        "failed": "episodes[67].failure",
        "actions": "replayed",
        "summary": "controller.summary",
    }
    tell(forged("trained", change), words[kind])


def test_elsewhere_a_policy_that_answers_otherwise_is_found(
    board: Path, elsewhere: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    predict = bench_fakes.Trained.predict

    def other(self: Any, *arguments: Any, **named: Any) -> Any:
        action, state = predict(self, *arguments, **named)
        return action + 0.01, state

    monkeypatch.setattr(bench_fakes.Trained, "predict", other)
    tell(verdict_of(board, "trained"), "the policy answers otherwise by 0.005")


def test_the_command_says_which_row_drifted(
    board: Path, forged: Any, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    files = {"tiny": tiny(board)}
    monkeypatch.setattr(scenarios, "available", lambda folder=None: files)
    honest, other = (str(board / "out" / f"tiny--{name}.json") for name in ("integral", "raises"))
    assert main(["verify", honest, "--jobs", "1"]) == 0
    assert "tiny--integral: holds" in capsys.readouterr().out
    forged("raises", lambda row: row["episodes"].pop())
    assert main(["verify", honest, other, "--jobs", "1"]) == 1
    said = capsys.readouterr().out
    assert "tiny--integral: holds" in said
    assert "tiny--raises: DRIFTED\n  episodes: 1 missing, the first: public, " in said
