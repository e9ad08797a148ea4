"""Verification finds altered rows, whatever their checksum, and void rows by behaviour."""

import copy
import dataclasses
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bench_fakes
import numpy as np
import pytest

from benchmarks.__main__ import main
from benchmarks.identity import audit
from benchmarks.runs import cells, provenance, rows, traces, verified, verify
from benchmarks.runs.store import read_json, read_record, write_json, write_record
from benchmarks.scenarios.scenario import ScenarioSet
from benchmarks.scoring import metrics
from pam_envs.envs.positioning import env as muscle_positioning
from sweeps import engine
from tests.benchmarks.row_helpers import draw, place, run_row

Row = dict[str, Any]
Change = Callable[[Row], object]
DRAWN, SALT = "5a" * 16, "4f" * 16
"""Salt of the round, and one that was not drawn."""


@pytest.fixture(scope="module")
def board(tmp_path_factory):
    with place(tmp_path_factory.mktemp("board")) as folder:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(audit.secrets, "token_hex", lambda _: DRAWN)
            draw(folder, "trained", "inverse", "tuned")
        for name in ("trained", "tuned", "integral", "raises"):
            run_row(folder, name)
        yield folder


def path_of(board: Path, name: str) -> Path:
    return rows.path_of(f"tiny--{name}", board / "out")


def verdict_of(board: Path, name: str) -> verify.Verdict:
    return verify.verify(path_of(board, name))


def test_rows_are_verified_side_by_side(board, tmp_path):
    paths = [path_of(board, name) for name in ("tuned", "integral", "trained")]
    missing = tmp_path / "tiny--none.json"
    found = dict(verify.verify_all([*paths, missing], engine.Cluster(1)))
    assert [*found] == [missing, *paths]
    assert [found[path].holds for path in paths] == [True] * 3
    assert_drifted(found[missing], "cannot be read")


def test_each_file_of_a_row_has_a_verdict(board, tmp_path):
    path = path_of(board, "tuned")
    copied = tmp_path / path.parent.name / path.name
    copied.parent.mkdir()
    shutil.copy(path, copied)
    paths = [path, copied, path]
    found = [*verify.verify_all(paths, engine.Cluster())]
    assert [other for other, _ in found] == paths
    assert all(verdict.holds for _, verdict in found)


def test_row_whose_cells_fail_is_not_reproduced(board, monkeypatch):
    def fails(group):
        raise RuntimeError("no room")

    monkeypatch.setattr(cells, "compute", fails)
    assert_drifted(verdict_of(board, "tuned"), "cannot be run again: RuntimeError: no room")


@pytest.fixture
def forged(board):
    """Return a function that alters a row, renews its checksum, verifies it and restores it."""
    kept: dict[Path, bytes] = {}

    def alter(name: str, change: Change, loads: bool = True) -> verify.Verdict:
        path = path_of(board, name)
        path.write_bytes(kept.setdefault(path, path.read_bytes()))
        row = read_record(path)
        before = copy.deepcopy(row)
        change(row)
        assert row != before
        write_record(path, row)
        if loads:  # the new checksum fits
            assert rows.load(path)
        return verdict_of(board, name)

    yield alter
    for path, content in kept.items():
        path.write_bytes(content)


def assert_drifted(verdict: verify.Verdict, words: str) -> None:
    assert not verdict.holds
    assert any(words in line for line in verdict.drifted), verdict.drifted


@pytest.mark.parametrize("name", ["trained", "tuned", "integral", "raises"])
def test_honest_row_is_reproduced_to_the_last_bit(name, board):
    verdict = verdict_of(board, name)
    assert (verdict.drifted, verdict.mode) == ([], "bits")
    assert not [note for note in verdict.notes if "commit" not in note]
    assert verify.void(rows.load(path_of(board, name))) == []


def at(row: Any, path: str) -> tuple[Any, Any]:
    """Return the container and the key of an entry: ``audit.seeds.steps``, ``episodes.-1``."""
    *outer, last = (int(p) if p.lstrip("-").isdigit() else p for p in path.split("."))
    for key in outer:
        row = row[key]
    return row, last


def put(path: str, value: Any) -> Change:
    """Return a change of one entry: to a value, or by a function of its present one."""

    def change(row: Row) -> None:
        record, key = at(row, path)
        record[key] = value(record[key]) if callable(value) else value

    return change


def without_audit(row: Row) -> None:
    row["audit"] = None
    row["episodes"] = rows.episodes_of(row)


def renew_digest(row: Row) -> None:
    row["scenarios"]["digest"] = ScenarioSet(row["scenarios"]["content"]).digest


def a_hair_less(value: float) -> float:
    return value * (1.0 - 1e-12)


def repeat_first_episode(row: Row) -> None:
    row["episodes"][-1] = copy.deepcopy(row["episodes"][0])


RMS, ZEROS = "episodes.-1.scores.rms_error", "0" * 64
FORGERIES: dict[str, tuple[str, Change, str]] = {
    "score": ("integral", put(RMS, a_hair_less), "episodes[3].scores.rms_error"),
    "audit score": ("trained", put(RMS, a_hair_less), "].scores.rms_error"),
    "knowledge": (
        "integral",
        put("controller.knowledge", "nothing"),
        "controller.knowledge: 'nothing' recorded, 'true model' now",
    ),
    "policy hash": (
        "trained",
        put("controller.artefact.files.0.sha256", ZEROS),
        "controller.artefact.files[0].sha256",
    ),
    "plants": ("integral", put("plants", lambda found: dict.fromkeys(found, "0" * 16)), "plants."),
    "dropped failure": (
        "raises",
        lambda row: row["episodes"].pop(),
        "episodes: 1 missing, the first: public, ",
    ),
    "repeated episode": (
        "trained",
        repeat_first_episode,
        "episodes: 1 missing, the first: audit, ",
    ),
    "salt": ("trained", put("audit.salt", SALT), f"audit.salt: '{SALT}' recorded, "),
    "no audit": ("trained", without_audit, "audit: left out, though round 1 was drawn on 20"),
    "picture": (
        "trained",
        put("traces.0.signals.output", lambda curve: traces.pack(0.99 * traces.unpack(curve))),
        "traces[0].signals.output: another curve now",
    ),
}


@pytest.mark.parametrize("what", FORGERIES)
def test_forged_entry_is_detected(what, forged):
    name, change, words = FORGERIES[what]
    assert_drifted(forged(name, change), words)


def test_row_of_another_commit_may_differ_by_rounding(forged):
    def change(row: Row) -> None:
        row["made_with"]["commit"] = ZEROS[:40]
        put(RMS, a_hair_less)(row)

    verdict = forged("integral", change)
    assert verdict.holds
    assert verdict.mode == "elsewhere"


@pytest.mark.parametrize(("steps", "holds"), [(1, True), (3, False)])
def test_plotted_curves_may_differ_by_the_step_of_their_grid(steps, holds, forged):
    def shift(curve: Row) -> Row:
        values = traces.unpack(curve)
        values[1] += steps / traces.GRID * (curve["high"] - curve["low"])
        return traces.pack(values)

    verdict = forged("integral", put("traces.0.signals.output", shift))
    assert verdict.holds is holds
    assert verdict.mode == "bits"


def test_changed_description_is_a_note(forged):
    verdict = forged("integral", put("controller.summary", "another"))
    assert verdict.holds
    assert any(note.startswith("description.summary: 'another'") for note in verdict.notes)


def test_swapped_policy_is_detected(board):
    try:
        bench_fakes.write_policies(board / "policies", 0.02, 0.0500001)
        verdict = verdict_of(board, "trained")
        why = verify.void(rows.load(path_of(board, "trained")))
    finally:
        bench_fakes.write_policies(board / "policies", 0.02, 0.05)
    assert_drifted(verdict, "controller.artefact.files[1].sha256")
    assert_drifted(verdict, "of the last round of tiny (policy files changed); run `python -m")
    assert why == ["policy files changed"]


def test_changed_knob_voids_exactly_the_rows_of_its_controller(board):
    try:
        bench_fakes.write_knobs(board / "policies", tuned={"gain": 0.020000001}, other={"lead": 2})
        why = {n: verify.void(rows.load(path_of(board, n))) for n in ("tuned", "integral")}
        verdict = verdict_of(board, "tuned")
    finally:
        bench_fakes.write_knobs(board / "policies")
    assert why == {"tuned": ["knob gain changed: 0.02 to 0.020000001"], "integral": []}
    assert_drifted(verdict, "knob gain changed")


def test_row_of_another_controller_is_detected(board):
    path = path_of(board, "low")
    row = read_record(path_of(board, "integral"))
    row["controller"]["name"], row["row"] = "low", "tiny--low"
    write_record(path, row)
    verdict = verdict_of(board, "low")
    path.unlink()
    assert_drifted(verdict, "controller.artefact.digest")


def test_changed_environment_voids_rows(board, monkeypatch):
    low, high = muscle_positioning.REFERENCE_RANGE
    monkeypatch.setattr(muscle_positioning, "REFERENCE_RANGE", (low, high * (1.0 - 1e-9)))
    row = rows.load(path_of(board, "trained"))
    assert verify.void(row)[0].startswith("trajectories changed: ")
    assert_drifted(verdict_of(board, "integral"), "task: ")


def test_scenarios_of_another_version_are_not_run(forged):
    def change(row: Row) -> None:
        put("scenarios.content.settle_seconds", 0.25)(row)
        renew_digest(row)

    (line,) = forged("integral", change).drifted
    assert "scenarios: the content is not that of tiny.yaml, version 1" in line


def test_row_of_another_environment_version_is_refused(forged):
    def change(row: Row) -> None:
        text = json.dumps(row).replace("Positioning-v0", "Positioning-v1")
        row.update(json.loads(text.replace('"version": 0', '"version": 1')))
        renew_digest(row)

    words = "MusclePositioning-v1, and this checkout has PAM/MusclePositioning-v0"
    assert_drifted(forged("integral", change), words)


def test_missing_entries_are_named(forged):
    verdict = forged("integral", lambda row: row.pop("env"), loads=False)
    assert_drifted(verdict, "not a row: it must contain ['env'] properties")
    verdict = forged("integral", lambda row: row["episodes"][0].pop("split"), loads=False)
    assert_drifted(verdict, "not a row: episodes[0] must contain ['split'] properties")


def test_audit_without_a_round_is_detected(board, monkeypatch):
    monkeypatch.setattr(audit, "FILE", board / "none.json")
    words = "the last round of tiny (no round was drawn); run `python -m benchmarks audit tiny`"
    assert_drifted(verdict_of(board, "trained"), words)


def test_damaged_file_is_detected(board, tmp_path):
    path = rows.path_of("tiny--integral", tmp_path)
    path.parent.mkdir()
    row = read_json(path_of(board, "integral"))
    row["task"] = ZEROS
    write_json(path, row)
    assert_drifted(verify.verify(path), "file: the checksum does not match")
    path.write_text("no row")
    assert_drifted(verify.verify(path), "cannot be read")
    write_record(path, {**row, "schema": 1})
    assert_drifted(verify.verify(path), "run it again: python -m benchmarks run --track tiny")


# On another processor last digits differ. A row that says so is compared within tolerance.


@pytest.fixture
def elsewhere(monkeypatch):
    """Another processor, on which controllers round otherwise."""
    monkeypatch.setattr(provenance, "cpu", lambda: "another")
    for kind in (bench_fakes.Trained, bench_fakes.Inverse):
        monkeypatch.setattr(kind, "predict", rounding(kind.predict))


def rounding(predict: Callable[..., Any]) -> Callable[..., Any]:
    """Return a method whose first answer of an episode differs in its last digit."""

    def rounded(self: Any, observation: Any, state: Any = None, *others: Any) -> Any:
        action, after = predict(self, observation, state, *others)
        return np.nextafter(action, np.float32(0)) if state is None else action, after

    return rounded


@pytest.mark.parametrize("name", ["trained", "tuned", "integral"])
def test_row_is_reproduced_within_tolerance_on_another_machine(name, board, elsewhere):
    verdict = verdict_of(board, name)
    assert (verdict.drifted, verdict.mode) == ([], "elsewhere")
    assert any(" fields differ in bits, the first: " in note for note in verdict.notes)
    assert verify.void(rows.load(path_of(board, name))) == []  # still in its round


def test_other_design_on_another_machine_is_not_that_of_the_round(board, elsewhere, monkeypatch):
    make = bench_fakes.make_controller

    def designed(name: str, *arguments: Any, **named: Any) -> Any:
        made = make(name, *arguments, **named)
        return dataclasses.replace(made, gain=made.gain * 1.1)

    monkeypatch.setattr(bench_fakes, "make_controller", designed)
    (why,) = verify.void(rows.load(path_of(board, "tuned")))
    assert why.startswith("answers changed by ")
    assert_drifted(verdict_of(board, "tuned"), "audit: task and controller are not those of")


def test_scores_near_zero_may_differ_on_another_machine(board, elsewhere, monkeypatch):
    score = metrics.score
    path = run_row(board, "integral", out=board / "nothing", cells=board / "nothing cells")
    row = read_record(path)
    for value, holds in ((5.1e-16, True), (1e-6, False)):
        monkeypatch.setattr(metrics, "score", lambda *a, **k: {**score(*a, **k), "p95_error": 0.0})
        for episode in row["episodes"]:
            episode["scores"]["p95_error"] = value
        row["made_with"]["cpu"] = "a third"
        write_record(path, row)
        assert any("scores.p95_error" in line for line in verify.verify(path).drifted) is not holds


FOUND_ELSEWHERE: dict[str, tuple[Change, str]] = {
    "episode": (put(RMS, lambda error: 0.999 * error), "].scores.rms_error"),
    "failure": (put("episodes.-1.failure", "the weather"), "].failure"),
    "dropped": (lambda row: row["episodes"].pop(), "episodes: 1 missing"),
    "tuning": (put("controller.tuning.trials", 1), "controller.tuning"),
}


@pytest.mark.parametrize("what", FOUND_ELSEWHERE)
def test_forgery_beyond_rounding_is_detected_on_another_machine(what, forged):
    """A row that falsely says that it was made elsewhere gains nothing."""

    def change(row: Row) -> None:
        row["made_with"]["cpu"] = "anything"
        FOUND_ELSEWHERE[what][0](row)

    verdict = forged("trained", change)
    assert verdict.mode == "elsewhere"
    assert_drifted(verdict, FOUND_ELSEWHERE[what][1])


def test_inapplicable_metric_is_not_drift(board, elsewhere, monkeypatch):
    score = metrics.score
    undefined = {"p95_error": float("nan")}
    monkeypatch.setattr(metrics, "score", lambda *a, **k: score(*a, **k) | undefined)
    path = run_row(board, "integral", out=board / "none", cells=board / "none cells")
    assert verify.verify(path).holds


def test_commands_print_and_record_outcomes(board, forged, capsys, monkeypatch):
    honest, other = (str(path_of(board, name)) for name in ("integral", "raises"))
    assert main(["verify", honest, "--jobs", "1"]) == 0
    assert not verified.read(board / "out")  # rows of another folder than this checkout's
    capsys.readouterr()
    monkeypatch.setattr(rows, "RESULTS", board / "out")
    assert main(["verify", honest, other, "--jobs", "1"]) == 0
    assert "tiny--integral: reproduced\n" in capsys.readouterr().out
    found = verified.read(board / "out")
    assert set(found) == {"tiny--integral", "tiny--raises"}
    row = rows.load(Path(honest))
    entry = verified.of(row, found)
    assert (entry["mode"], entry["commit"]) == ("bits", provenance.commit())
    assert verified.of({**row, "checksum": "another"}, found) is None
    assert main(["void", honest, other]) == 0
    assert "0 of 2 rows are void" in capsys.readouterr().out
    forged("raises", lambda row: row["episodes"].pop())
    assert main(["verify", honest, other, "--jobs", "1"]) == 1
    said = capsys.readouterr().out
    assert "2 rows: 1 reproduced; 1 DRIFTED\n" in said
    assert "tiny--raises: DRIFTED\n  episodes: 1 missing, the first: public, " in said
    assert "run the row again: python -m benchmarks run --track tiny --controller raises" in said
    assert set(verified.read(board / "out")) == {"tiny--integral"}
    for command in ("verify", "void", "cite"):
        assert main([command, "tiny--nobody"]) == 2
        assert "there is no row 'tiny--nobody'" in capsys.readouterr().err


def test_name_with_a_path_is_no_row(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "x").write_text("no row")
    for name in ("../../x", "x", "a/../b--c", "/etc/passwd", "tiny--a--b", ""):
        assert main(["verify", name]) == 2
        assert "is neither a file TRACK/CONTROLLER.json.xz nor a name" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["x"]


def test_bit_exact_verification_is_kept_after_a_tolerant_one(tmp_path):
    path = rows.path_of("a--b", tmp_path)

    def noted(checksum: str, mode: str) -> str | None:
        verified.note(path, checksum, mode)
        entry = verified.read(tmp_path).get("a--b")
        return entry and entry["mode"]

    assert noted("1", "elsewhere") == "elsewhere"
    assert noted("1", "bits") == "bits"
    assert noted("1", "elsewhere") == "bits"
    assert noted("2", "elsewhere") == "elsewhere"
    assert noted("", "elsewhere") is None
