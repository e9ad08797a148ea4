"""Rows: their entries, refused ones, and those that are not compared."""

import copy
import json
import re
from collections.abc import Callable
from typing import Any

import bench_fakes
import gymnasium as gym
import pytest

from benchmarks.board import accessors
from benchmarks.identity import artefacts, tasks
from benchmarks.runs import cells, rows
from benchmarks.runs.cells import cells_of
from benchmarks.runs.controllers import BY_RULE, available, find
from benchmarks.runs.store import write_record
from benchmarks.scenarios import scenario as scenarios
from benchmarks.scenarios.scenario import ScenarioSet
from benchmarks.scoring import statistics
from tests.benchmarks.row_helpers import place, run_row, tiny

HEX = re.compile(r"[0-9a-f]{64}")


@pytest.fixture(scope="module")
def board(tmp_path_factory):
    with place(tmp_path_factory.mktemp("rows")) as folder:
        yield folder


@pytest.fixture(scope="module")
def trained(board):
    return rows.load(run_row(board, "trained"))


@pytest.fixture(scope="module")
def classical(board):
    return rows.load(run_row(board, "integral"))


def test_row_names_environment_task_and_artefact(classical, board):
    assert classical["schema"] == rows.SCHEMA
    assert classical["env"]["id"] == "PAM/MusclePositioning-v0"
    assert classical["env"]["version"] == 0
    assert classical["task"] == tasks.of(tiny(board)).identity.digest
    artefact = classical["controller"]["artefact"]
    assert HEX.fullmatch(artefact["digest"])
    assert (artefact["files"], artefact["knobs"]) == ([], {})
    assert classical["controller"]["training"] is None
    assert classical["controller"]["tuning"]["trials"] == 0
    assert classical["audit"] is None
    assert classical["controller"]["author"] == ""


def test_every_training_seed_is_run_in_every_episode(trained, board):
    keys = [(e["split"], e["training_seed"], e["scenario"], e["seed"]) for e in trained["episodes"]]
    seeds = tiny(board).seeds
    expected = [
        ("public", run, name, seed) for run in (0, 1) for name, own in seeds.items() for seed in own
    ]
    assert keys == expected
    assert trained["training_seeds"] == [0, 1]
    files = trained["controller"]["artefact"]["files"]
    assert [(file["name"], file["training_seed"]) for file in files] == [
        ("trained.s0.json", 0),
        ("trained.s1.json", 1),
    ]
    commands = [run["command"] for run in trained["controller"]["training"]]
    assert commands == ["train --seed 0", "train --seed 1"]
    assert trained["controller"]["tuning"] == {"trials": 0, "how": BY_RULE}
    of_runs = [
        [e["trajectory"] for e in trained["episodes"] if e["training_seed"] == run]
        for run in (0, 1)
    ]
    assert not set(of_runs[0]) & set(of_runs[1])


def test_interval_includes_the_scatter_of_training_seeds(trained):
    seen = accessors.interval(trained, "rms_error")
    values = rows.scores_of(rows.episodes_of(trained), "rms_error")
    strata = [episode["scenario"] for episode in rows.episodes_of(trained)]
    blind = statistics.of_table(values[None], strata)
    assert seen.value == pytest.approx(blind.value) == pytest.approx(values.mean())
    assert (seen.low, seen.high) != (blind.low, blind.high)


@pytest.mark.parametrize(
    ("name", "claimed", "found"),
    [("low", "nothing", "nothing"), ("integral", "nominal model", "true model")],
)
def test_knowledge_follows_from_the_model(name, claimed, found, board):
    about = rows.load(run_row(board, name))["controller"]
    assert (about["claimed"], about["knowledge"]) == (claimed, found)


def test_policy_knows_the_plant_of_its_training(board, trained):
    assert trained["controller"]["knowledge"] == "nominal model"
    (plant,) = set(trained["plants"].values())
    bench_fakes.write_policies(board / "policies", 0.02, 0.05, plant=plant)
    again = rows.load(run_row(board, "trained", out=board / "same plant"))
    bench_fakes.write_policies(board / "policies", 0.02, 0.05)
    assert again["controller"]["knowledge"] == "true model"
    assert again["episodes"] == trained["episodes"]


def test_entry_without_policies_is_no_controller(board, monkeypatch, tmp_path):
    assert "trained" in available()
    monkeypatch.setattr(bench_fakes, "POLICIES", tmp_path)
    assert "trained" not in available()


def of_version(row: dict[str, Any], number: int) -> dict[str, Any]:
    """Return a row as if it were of another version of its environment."""
    text = json.dumps(row).replace("Positioning-v0", f"Positioning-v{number}")
    row = json.loads(text)
    row["scenarios"]["digest"] = ScenarioSet(row["scenarios"]["content"]).digest
    return {**row, "row": f"tiny--v{number}", "controller": {**row["controller"], "name": "v1"}}


def test_rows_of_two_versions_are_not_mixed(classical, board, tmp_path):
    write_record(rows.path_of("tiny--integral", tmp_path), classical)
    write_record(rows.path_of("tiny--v1", tmp_path), of_version(classical, 1))
    with pytest.raises(ValueError, match=r"Positioning-v1, and this checkout has .*Positioning-v0"):
        rows.load_all(tmp_path)
    spec = gym.spec("PAM/MusclePositioning-v0")
    gym.register("PAM/MusclePositioning-v1", entry_point=spec.entry_point)
    try:
        with pytest.raises(ValueError, match=r"Positioning-v1 and .*Positioning-v0: their results"):
            rows.load_all(tmp_path)
    finally:
        del gym.envs.registration.registry["PAM/MusclePositioning-v1"]


def test_rows_of_two_tasks_or_one_name_are_not_mixed(classical):
    other = {**copy.deepcopy(classical), "row": "tiny--other"}
    rows.check_together([classical, other])
    with pytest.raises(ValueError, match="tiny--integral is there twice"):
        rows.check_together([classical, classical])
    other["task"] = "0" * 12
    words = r"task 000000000000 and tiny--integral of .*: python -m benchmarks run --track tiny"
    with pytest.raises(ValueError, match=words):
        rows.check_together([classical, other])


def put(outer: str, key: str, value: object) -> Callable[[dict[str, Any]], None]:
    """Return a change of an entry of a row; no value removes it."""

    def change(row: dict[str, Any]) -> None:
        record = row[outer] if outer else row
        if value is None:
            del record[key]
        else:
            record[key] = value

    return change


DISAGREE = "have to agree: run it again"
REFUSED: dict[str, tuple[Callable[[dict[str, Any]], None], str]] = {
    "path in the row's name": (put("", "row", "../../../escaped"), DISAGREE),
    "path in the controller's name": (
        put("controller", "name", "integral/.."),
        "controller.name must match",
    ),
    "another metric": (lambda row: row["episodes"][0]["scores"].update(best=0.0), "other metrics"),
    "another entry": (put("", "comment", "x"), "it must not contain .'comment'. properties"),
    "long text": (put("volatile", "host", "x" * 501), "volatile.host must be shorter"),
    "control characters": (put("volatile", "machine", "\x1b[31m"), "volatile.machine must match"),
    "other commit": (put("made_with", "commit", "my own"), "made_with.commit must match"),
    "other scenario": (lambda row: row["episodes"][0].update(scenario="easy"), "another scenario"),
    "huge number": (lambda row: row["episodes"][0].update(saturated=1e300), "must be smaller"),
    "another file": (put("", "row", "tiny--inverse"), f"holds 'tiny--inverse'.*{DISAGREE}"),
    "former schema": (put("", "schema", 1), "schema 4, but of 1; run it again: .*--track tiny"),
    "no episodes": (
        put("", "episodes", None),
        r"not a row: it must contain \['episodes'\] properties; run it",
    ),
    "no version": (put("env", "version", None), r"not a row: env must contain \['version'\]"),
    "no mapping": (put("", "controller", "inverse"), "not a row: controller must be object"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_row_that_is_incomplete_or_misnamed_is_refused(what, classical, tmp_path):
    row, path = copy.deepcopy(classical), rows.path_of("tiny--integral", tmp_path)
    change, words = REFUSED[what]
    change(row)
    write_record(path, row)
    with pytest.raises(ValueError, match=words):
        rows.load(path)


def test_row_of_an_unknown_track_is_refused(classical, tmp_path, monkeypatch):
    write_record(rows.path_of("tiny--integral", tmp_path), classical)
    monkeypatch.setattr(scenarios, "FOLDER", tmp_path)
    with pytest.raises(ValueError, match="this checkout has no track 'tiny'"):
        rows.load(rows.path_of("tiny--integral", tmp_path))


def test_cells_of_another_version_or_plant_are_not_assembled(board):
    entrant, track = find("low"), tiny(board)
    groups = cells.grouped(cells_of(entrant, track))
    records = [record for group in groups for record in cells.compute(group).values()]
    assert not any(e["failed"] for e in rows.assemble(entrant, track, records)["episodes"])
    for others in (records[:1], records[::-1]):
        with pytest.raises(ValueError, match="the cells are not those of tiny"):
            rows.assemble(entrant, track, others)
    for name in ("env", "plant_digest", "model_digest"):
        with pytest.raises(ValueError, match="is of another environment, plant or model"):
            rows.assemble(entrant, track, [records[0], {**records[1], name: "0"}])


def test_environments_of_a_track_are_built_once(board, monkeypatch):
    made: list[str] = []
    make = tasks.make_env

    def counted(env: str, kwargs: Any) -> Any:
        made.append(env)
        return make(env, kwargs)

    monkeypatch.setattr(tasks, "make_env", counted)
    for name in ("low", "inverse", "trained"):
        assert tasks.of(tiny(board)).identity.digest
        artefacts.of(find(name), tiny(board))
    assert len(made) == len(tiny(board).scenarios())


def test_key_of_a_cell_depends_on_its_policy(board):
    track = tiny(board)
    before = [cell.key for cell in cells_of(find("trained"), track)]
    assert len(set(before)) == len(before) == 4
    bench_fakes.write_policies(board / "policies", 0.02, 0.06)
    after = [cell.key for cell in cells_of(find("trained"), track)]
    bench_fakes.write_policies(board / "policies", 0.02, 0.05)
    assert after[:2] == before[:2]
    assert not set(after[2:]) & set(before)
