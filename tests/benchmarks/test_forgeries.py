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

from benchmarks.__main__ import main
from benchmarks.identity import audit, tasks, verified, verify
from benchmarks.identity.hashing import digest, plain
from benchmarks.runs import cells, provenance, replay, rows, traces
from benchmarks.runs.controllers import available
from benchmarks.runs.store import read_json, read_record, write_json, write_record
from benchmarks.scoring import metrics
from benchmarks.scoring.metrics import of_track
from pam_envs.envs.positioning import env as muscle_positioning
from pam_envs.pneumatics.regulator import Regulator
from tests.benchmarks.row_helpers import draw, place, run_row

Row = dict[str, Any]
DRAWN, SALT = "5a" * 16, "4f" * 16
"""Salt of the round, and one that was not drawn."""


@pytest.fixture(scope="module")
def board(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    with place(tmp_path_factory.mktemp("board")) as folder:
        with pytest.MonkeyPatch.context() as patch:  # how near is near depends on the episodes
            patch.setattr(audit.secrets, "token_hex", lambda _: DRAWN)
            draw(folder, "trained", "inverse", "tuned")
        run_row(folder, "trained")
        run_row(folder, "tuned")
        run_row(folder, "integral")
        run_row(folder, "raises")
        yield folder


def verdict_of(board: Path, name: str, compare: str = "bits") -> verify.Verdict:
    return verify.verify(rows.path_of(f"tiny--{name}", board / "out"), compare=compare)


@pytest.fixture
def forged(board: Path) -> Iterator[Callable[..., verify.Verdict]]:
    """Return what alters a row, seals it anew and verifies it; the row is put back afterwards."""
    kept: dict[Path, bytes] = {}

    def alter(
        name: str, change: Callable[[Row], None], compare: str = "bits", loads: bool = True
    ) -> verify.Verdict:
        path = rows.path_of(f"tiny--{name}", board / "out")
        path.write_bytes(kept.setdefault(path, path.read_bytes()))
        row = read_record(path)
        before = copy.deepcopy(row)
        change(row)
        assert row != before
        write_record(path, row)
        if loads:  # sealed anew: the checksum does not tell
            assert rows.load(path)
        return verdict_of(board, name, compare)

    yield alter
    for path, content in kept.items():
        path.write_bytes(content)


@pytest.mark.parametrize("name", ["trained", "tuned", "integral", "raises"])
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


def test_another_controller_under_the_name(board: Path) -> None:
    path = rows.path_of("tiny--low", board / "out")
    row = read_record(rows.path_of("tiny--integral", board / "out"))
    row["controller"]["name"], row["row"] = "low", "tiny--low"
    write_record(path, row)
    verdict = verdict_of(board, "low")
    path.unlink()
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
    tell(verdict, "scenarios: the content is not that of tiny.yaml, version 1")
    assert len(verdict.drifted) == 1  # and it was not run


@pytest.mark.parametrize("honest", [False, True])
def test_environment_and_code_that_a_row_names_are_not_run(
    honest: bool, forged: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A row can have digests that fit what it says: none of it is looked up to be run."""
    module, mark = tmp_path / "stranger.py", tmp_path / "ran"
    module.write_text(f"open({str(mark)!r}, 'w')")
    monkeypatch.syspath_prepend(tmp_path)

    def change(row: Row) -> None:
        said = row["scenarios"]
        said["content"]["env"] = "stranger:PAM/MusclePositioning-v0"
        said["content"]["kwargs"]["episode_seconds"] = 1e9
        if honest:
            said["digest"] = digest(said["content"])

    tell(forged("integral", change), "the content is not that of tiny.yaml")
    assert not mark.exists()


def test_names_with_a_path_are_not_read(forged: Any) -> None:
    def change(row: Row) -> None:
        row["row"] = "../../../escaped"

    tell(forged("integral", change, loads=False), "file, row, track and controller have to agree")


def test_a_row_that_lacks_something_is_told_what(forged: Any) -> None:
    def whole(row: Row) -> None:
        del row["env"]

    def within(row: Row) -> None:
        del row["episodes"][0]["split"]

    tell(forged("integral", whole, loads=False), "a row without env, env.id, env.version")
    tell(forged("integral", within), "cannot be run again: there is no 'split'")


# And what an audit rests on.


def test_a_salt_of_ones_own(forged: Any, board: Path) -> None:
    def change(row: Row) -> None:
        row["audit"]["salt"] = SALT

    verdict = forged("trained", change)
    tell(verdict, f"audit.salt: '{SALT}' recorded, ")


@pytest.mark.parametrize("what", ["round", "entry", "commit", "drawn"])
def test_an_audit_of_another_round(what: str, forged: Any) -> None:
    def change(row: Row) -> None:
        row["audit"][what] = 2 if what in ("round", "entry") else "0" * 40

    tell(forged("trained", change), f"audit.{what}: ")


def test_audit_seeds_of_ones_own(forged: Any) -> None:
    def change(row: Row) -> None:
        name = next(iter(row["audit"]["seeds"]))
        row["audit"]["seeds"][name][0] += 1

    tell(forged("trained", change), "audit.seeds.")


def test_an_audit_that_was_left_out(forged: Any) -> None:
    def change(row: Row) -> None:
        row["audit"] = None
        row["episodes"] = rows.episodes_of(row)

    verdict = forged("trained", change)
    tell(verdict, "audit: left out, though round 1 was drawn on 20")
    tell(verdict, "episodes: 60 missing, the first: audit")


def test_an_audit_whose_salt_nobody_drew(board: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(audit, "FILE", board / "none.json")
    verdict = verdict_of(board, "trained")
    tell(verdict, "not in the last round of tiny; run `python -m benchmarks audit tiny`")


def test_a_label_that_says_less_than_the_controller_knows(forged: Any) -> None:
    def change(row: Row) -> None:
        row["controller"]["knowledge"] = "nothing"

    tell(forged("integral", change), "controller.knowledge: 'nothing' recorded, 'true model' now")


def test_a_row_edited_by_hand_and_one_that_is_none(board: Path, tmp_path: Path) -> None:
    path = rows.path_of("tiny--integral", tmp_path)
    row = read_json(rows.path_of("tiny--integral", board / "out"))
    row["failures"] = 0.5
    write_json(path, row)
    tell(verify.verify(path), "file: the checksum does not match")
    path.write_text("no row")
    tell(verify.verify(path), "cannot be read")
    write_record(path, {**row, "schema": 1})
    tell(verify.verify(path), "run it again: python -m benchmarks run --track tiny")


# On another machine last digits differ. Whoever verifies may allow for that; the row may not.


@pytest.fixture
def elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another processor, on which controllers round otherwise."""
    monkeypatch.setattr(provenance, "cpu", lambda: "another")
    for kind in (bench_fakes.Trained, bench_fakes.Inverse):
        monkeypatch.setattr(kind, "predict", rounding(kind.predict))


def rounding(predict: Callable[..., Any]) -> Callable[..., Any]:
    """Return what answers a little otherwise."""

    def rounded(self: Any, *arguments: Any, **named: Any) -> Any:
        action, state = predict(self, *arguments, **named)
        return action * (1.0 + 2e-7), state

    return rounded


@pytest.mark.parametrize("name", ["trained", "integral"])
def test_elsewhere_a_row_is_compared_nearly_where_that_is_asked_for(
    name: str, board: Path, elsewhere: None, forged: Any
) -> None:
    verdict = verdict_of(board, name)
    assert not verdict.holds
    assert any("`verify --compare elsewhere` allows for that" in note for note in verdict.notes)
    verdict = verdict_of(board, name, compare="elsewhere")
    assert verdict.holds, verdict.drifted
    assert verdict.mode == "elsewhere"
    assert any("scores to 1 %" in note for note in verdict.notes)
    either = verdict_of(board, name, compare="either")
    assert (either.holds, either.mode) == (True, "elsewhere")
    assert any(" fields differ in bits, the first: " in note for note in either.notes)


def test_a_comparison_is_one_of_three(board: Path) -> None:
    with pytest.raises(ValueError, match="compare: 'nearly' is none of bits, elsewhere, either"):
        verdict_of(board, "integral", compare="nearly")


@pytest.mark.parametrize("name", ["trained", "integral"])
def test_on_the_same_machine_either_is_to_the_last_bit(name: str, board: Path, forged: Any) -> None:
    verdict = verdict_of(board, name, compare="either")
    assert (verdict.holds, verdict.mode) == (True, "bits")

    def change(row: Row) -> None:
        row["episodes"][0]["scores"]["rms_error"] *= 1.0 - 1e-12

    verdict = forged(name, change, compare="either")
    assert verdict.mode == "bits"
    tell(verdict, "episodes[0].scores.rms_error")


def scored_as(value: float, patch: pytest.MonkeyPatch) -> None:
    """Let a metric have a value in all episodes."""
    score = metrics.score

    def told(*arguments: Any, **named: Any) -> dict[str, float]:
        return {**score(*arguments, **named), "p95_error": value}

    patch.setattr(metrics, "score", told)


def test_elsewhere_a_metric_that_does_not_apply_is_no_drift(
    board: Path, elsewhere: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its means are NaN, and so is their gap."""
    scored_as(float("nan"), monkeypatch)
    path = run_row(board, "trained", out=board / "none", cells=board / "none applies")
    assert read_record(path)["audit"]["gap"]["p95_error"] is None
    verdict = verify.verify(path, compare="elsewhere")
    assert verdict.holds, verdict.drifted


@pytest.mark.parametrize(("again", "holds"), [(5.1e-16, True), (5e-16 + 1e-9, False)])
def test_elsewhere_next_to_nothing_may_be_another_nothing(
    again: float, holds: bool, board: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scored_as(5e-16, monkeypatch)
    path = run_row(board, "trained", out=board / "tiny", cells=board / "next to nothing")
    scored_as(again, monkeypatch)
    verdict = verify.verify(path, compare="elsewhere")
    assert verdict.holds is holds, verdict.drifted
    assert holds or all("replayed" in line for line in verdict.drifted)


class Modelled:
    """Says what its model does, from its own state."""

    def predict(self, observation: Any, state: Any = None, *_: Any) -> tuple[Any, Any]:
        return observation, 1 if state is None else state + 1

    def model_output(self, state: Any) -> float:
        return 10.0 * state


def test_a_model_to_follow_is_asked_for_where_actions_are_played_again() -> None:
    actions, span = np.zeros((3, 1)), np.ones(1)
    asked = replay.Questioned(Modelled(), actions, span)
    state, said = None, []
    for start in (True, False, False):
        _, state = asked.predict(np.zeros(1), state, start)
        said.append(asked.model_output(state))
    assert said == [10.0, 20.0, 30.0]
    assert not hasattr(replay.Questioned(bench_fakes.Trained, actions, span), "model_output")


def test_elsewhere_a_controller_that_is_designed_there_may_have_other_last_digits(
    board: Path, elsewhere: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    make = bench_fakes.make_controller

    def designed(name: str, *arguments: Any, **named: Any) -> Any:
        made = make(name, *arguments, **named)
        return dataclasses.replace(made, gain=made.gain * (1.0 + 1e-9))

    monkeypatch.setattr(bench_fakes, "make_controller", designed)
    verdict = verdict_of(board, "integral", compare="elsewhere")
    assert verdict.holds, verdict.drifted
    assert any("otherwise here: controller.artefact.digest, " in note for note in verdict.notes)


@pytest.fixture
def turned(board: Path) -> Iterator[Row]:
    """A knob is turned a little after the round, and the row run with it as it is."""
    try:
        bench_fakes.write_knobs(board / "policies", tuned={"gain": 0.020000001})
        yield read_record(run_row(board, "tuned", out=board / "turned", cells=board / "anew"))
    finally:
        bench_fakes.write_knobs(board / "policies")


def resealed(board: Path, row: Row) -> verify.Verdict:
    path = rows.path_of("tiny--tuned", board / "turned")
    write_record(path, row)
    return verify.verify(path, compare="elsewhere")


PARTS = {
    "digest": "controller.artefact.digest, of its own parts: ",
    "artefact": "controller.artefact.knobs.gain: 0.02 recorded, 0.020000001 now",
    "numbers": "controller.artefact.code[0]: ",
}


@pytest.mark.parametrize("kept", PARTS)
def test_elsewhere_a_knob_that_was_turned_after_the_round_is_found(
    kept: str, board: Path, turned: Row
) -> None:
    """Scores, means and episodes are those of the round, whose artefact the row says it is."""
    assert turned["audit"] is None  # honest, it is outside of the round
    old = read_record(rows.path_of("tiny--tuned", board / "out"))
    row = copy.deepcopy(old)
    if kept != "numbers":
        for part in ("digest", "parameters"):
            row["controller"][part] = turned["controller"][part]
    if kept == "digest":
        row["controller"]["artefact"] = turned["controller"]["artefact"] | {
            "digest": old["controller"]["artefact"]["digest"]
        }
    verdict = resealed(board, row)
    tell(verdict, PARTS[kept])
    tell(verdict, "has another tuned.yaml")


def test_a_knob_of_another_controller_changes_nothing(board: Path) -> None:
    try:
        bench_fakes.write_knobs(board / "policies", other={"lead": 1.5}, more={"lead": 1.1})
        verdict = verdict_of(board, "tuned", compare="elsewhere")
    finally:
        bench_fakes.write_knobs(board / "policies")
    assert verdict.holds, verdict.drifted


def test_a_row_that_says_that_it_is_from_elsewhere_gains_nothing(forged: Any) -> None:
    """Episodes made equal around their mean: no mean tells, and every interval is narrower."""

    def change(row: Row) -> None:
        row["made_with"]["cpu"] = "anything"
        flatten(row)

    for asked in ("bits", "elsewhere", "either"):
        verdict = forged("trained", change, compare=asked)
        assert verdict.mode == ("bits" if asked == "bits" else "elsewhere")
        tell(verdict, "].scores.rms_error: ")
        tell(verdict, "aggregate.rms_error")


def flatten(row: Row) -> None:
    """Set scores to their means, but of the episodes whose actions are kept, and sum up anew."""
    for split in ("public", "audit"):
        for scenario in row["plants"]:
            chosen = [
                e
                for e in rows.episodes_of(row, split)
                if e["scenario"] == scenario and (split == "audit" or e["training_seed"] == 1)
            ]
            for metric in ("rms_error", "p95_error"):
                mean = float(np.mean(rows.scores_of(chosen, metric)))
                for episode in chosen:
                    episode["scores"][metric] = mean * (1 - 9e-4)
    wanted = of_track(row["scenarios"]["content"])
    row["aggregate"] = plain(rows.aggregate(rows.episodes_of(row), wanted))
    scores = rows.aggregate(rows.episodes_of(row, "audit"), wanted)
    row["audit"]["aggregate"] = plain(scores)
    row["audit"]["gap"] = plain(rows.gap(scores, row["aggregate"]))


def test_elsewhere_one_training_seed_cannot_be_made_better(elsewhere: None, forged: Any) -> None:
    """Within what an episode may differ, but all of one seed's."""

    def change(row: Row) -> None:
        for episode in row["episodes"]:
            if episode["training_seed"] == 1:
                episode["scores"]["rms_error"] *= 1.0 - 5e-3

    verdict = forged("trained", change, compare="elsewhere")
    tell(verdict, "audit mean of rms_error, training seed 1: ")
    tell(verdict, "public mean of rms_error, training seed 1: ")


KINDS = {
    "episode": "].scores.rms_error",
    "replayed": "replayed maxwell_slip_steps, seed ",
    "interval": "aggregate.rms_error.low",
    "iqm": "audit.aggregate.rms_error.iqm",
    "mean": "audit.aggregate.rms_error.mean",
    "gap": "audit.gap.rms_error",
    "by": "by.reference.steps",
    "failed": "episodes[67].failure",
    "dropped": "episodes: 1 missing",
    "picture": "traces[0].signals.output: another curve now",
    "actions": "replayed",
    "summary": "controller.summary",
}


@pytest.mark.parametrize("kind", KINDS)
def test_elsewhere_a_forged_policy_is_found(kind: str, elsewhere: None, forged: Any) -> None:
    def change(row: Row) -> None:
        public, unseen = row["aggregate"]["rms_error"], row["audit"]["aggregate"]["rms_error"]
        if kind == "episode":
            row["episodes"][-1]["scores"]["rms_error"] *= 0.98
        if kind == "replayed":
            row["episodes"][0]["scores"]["rms_error"] *= 1.0 - 1e-6
        if kind == "interval":
            public["low"] *= 1.002
        if kind == "iqm":
            unseen["iqm"] *= 0.99
        if kind == "mean":
            unseen["mean"] *= 1.0 - 1e-6
        if kind == "gap":
            row["audit"]["gap"]["rms_error"] = 0.0
        if kind == "by":
            row["by"]["reference"]["steps"] *= 0.99
        if kind == "failed":
            row["episodes"][-1]["failure"] = "the weather"
        if kind == "dropped":
            row["episodes"].pop()
        if kind == "picture":
            drawn = row["traces"][0]["signals"]
            drawn["output"] = traces.pack(traces.unpack(drawn["output"]) * 0.99)
        if kind == "actions":
            packed = row["actions"][next(iter(row["actions"]))]
            ((seed, actions),) = packed.items()
            moved = cells.unpack(actions)
            moved[20:] += 1e-5
            packed[seed] = cells.pack(moved)
        if kind == "summary":
            row["controller"]["summary"] = "another"

    tell(forged("trained", change, compare="elsewhere"), KINDS[kind])


def test_elsewhere_a_policy_that_answers_otherwise_is_found(
    board: Path, elsewhere: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    predict = bench_fakes.Trained.predict

    def other(self: Any, *arguments: Any, **named: Any) -> Any:
        action, state = predict(self, *arguments, **named)
        return action + 0.01, state

    monkeypatch.setattr(bench_fakes.Trained, "predict", other)
    tell(verdict_of(board, "trained", compare="elsewhere"), "the policy answers otherwise by 0.005")


def test_the_command_says_which_row_drifted_and_notes_which_held(
    board: Path, forged: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    honest, other = (
        str(rows.path_of(f"tiny--{name}", board / "out")) for name in ("integral", "raises")
    )
    assert main(["verify", honest, other, "--jobs", "1"]) == 0
    assert "tiny--integral: holds" in capsys.readouterr().out
    found = verified.read(board / "out")
    assert set(found) == {"tiny--integral", "tiny--raises"}
    row = rows.load(Path(honest))
    entry = verified.of(row, found, available())
    assert entry is not None
    assert entry["mode"] == "bits"
    assert entry["commit"] == provenance.commit()
    assert entry["sources"] == row["made_with"]["sources"]
    assert entry["older"] is False
    assert verified.of({**row, "checksum": "another"}, found, available()) is None
    forged("raises", lambda row: row["episodes"].pop())
    assert main(["verify", honest, other, "--compare", "elsewhere", "--jobs", "1"]) == 1
    said = capsys.readouterr().out
    assert "tiny--integral: holds nearly, as of another machine\n" in said
    assert "2 rows: 1 holds nearly, as of another machine; 1 DRIFTED\n" in said
    assert "tiny--raises: DRIFTED\n  episodes: 1 missing, the first: public, " in said
    assert "run the row again: python -m benchmarks run --track tiny --controller raises" in said
    found = verified.read(board / "out")
    assert {name: entry["mode"] for name, entry in found.items()} == {"tiny--integral": "bits"}
    for command in ("verify", "cite"):
        assert main([command, "tiny--nobody"]) == 2
        assert "there is no row 'tiny--nobody'" in capsys.readouterr().err


def test_what_held_to_the_last_bit_stays_noted_so(tmp_path: Path) -> None:
    path = rows.path_of("a--b", tmp_path)

    def noted(checksum: str, mode: str, **sources: str) -> str | None:
        verified.note(path, checksum, mode, sources)
        entry = verified.read(tmp_path).get("a--b")
        return entry and entry["mode"]

    assert noted("1", "elsewhere", code="x") == "elsewhere"
    assert noted("1", "bits", code="x") == "bits"
    assert noted("1", "elsewhere", code="x") == "bits"
    assert noted("1", "elsewhere", code="y") == "elsewhere"  # of other code it says nothing
    assert noted("1", "bits", code="y") == "bits"
    assert noted("2", "elsewhere", code="y") == "elsewhere"
    assert noted("", "elsewhere", code="y") is None


def test_the_command_notes_nothing_where_code_is_not_committed(
    board: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path, noted = str(rows.path_of("tiny--integral", board / "out")), board / "out" / verified.FILE
    assert main(["verify", path, "--jobs", "1"]) == 0
    before = noted.read_bytes()
    assert json.loads(before)["tiny--integral"]["mode"] == "bits"
    monkeypatch.setattr(provenance, "changed", lambda: ["pam_envs/kernels/build.py"])
    assert main(["verify", path, "--compare", "elsewhere", "--jobs", "1"]) == 2
    said = capsys.readouterr()
    assert "tiny--integral: holds" in said.out
    assert said.err == (
        "error: not noted in verified.json, since pam_envs/kernels/build.py is not as in the last "
        "commit: commit or stash it and verify again\n"
    )
    assert noted.read_bytes() == before


def test_outside_of_a_checkout_nothing_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent() -> list[str]:
        raise FileNotFoundError("git")

    monkeypatch.setattr(provenance, "changed", absent)
    assert verified.refusal() == ""
