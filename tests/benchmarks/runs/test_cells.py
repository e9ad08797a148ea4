"""Cells: dependence of their keys, admissible environments, and groups."""

import dataclasses
import shutil

import numpy as np
import pytest

from benchmarks.identity import audit
from benchmarks.identity.hashing import canonical_text
from benchmarks.runs import cells, provenance, rollout
from benchmarks.runs.controllers import find
from benchmarks.scenarios import scenario as scenarios
from benchmarks.scenarios import scenario_env as making
from sweeps import worker


def test_key_of_a_cell_depends_on_plant_files_and_processor(tmp_path, monkeypatch):
    shutil.copytree(making.PLANTS, tmp_path / "plants")
    monkeypatch.setattr(making, "PLANTS", tmp_path / "plants")
    track = scenarios.available()["joint_reduced"]
    scenario = track.scenarios()[0]
    cell = cells.Cell(find("zero"), track, scenario, seeds=(1,))
    keys = {cell.key}
    plant = making.plant_file(scenario.kwargs["plant"])
    plant.write_text(plant.read_text() + "# another\n")
    keys.add(cell.key)
    monkeypatch.setattr(provenance, "cpu", lambda: "another")
    keys.add(cell.key)
    model = dataclasses.replace(scenario, model={"plant": "knee_rig_measured.yaml"})
    keys.add(dataclasses.replace(cell, scenario=model).key)
    assert len(keys) == 4


@pytest.mark.parametrize("env", ["os:PAM/MusclePositioning-v0", "CartPole-v1", "PAM/../X-v0"])
def test_only_environments_of_this_package_are_made(env):
    with pytest.raises(ValueError, match="is no environment of this package"):
        making.make_env(env, {})


@pytest.mark.parametrize("plant", ["/etc/passwd", "../positioning_nominal.yaml", "a/b.yaml"])
def test_only_plants_of_the_folder_of_plants_are_read(plant):
    with pytest.raises(ValueError, match="is not the mere name of a file"):
        making.make_env("PAM/AntagonisticJoint-v0", {"plant": plant})


@pytest.mark.parametrize(
    ("track", "controller"),
    [
        ("positioning_nominal", "inverse_pid"),  # rows of several loads
        ("knee_walk_nominal", "ppo_knee_walk"),  # a network
        ("manipulator_nominal", "joint_mfc_mu_ahead"),  # weights of many arms at once
    ],
)
def test_record_does_not_depend_on_the_cells_of_its_group(track, controller):
    chosen, entrant = scenarios.available()[track], find(controller)
    first = cells.cells_of(entrant, chosen)[0]
    audited = dataclasses.replace(first, split=cells.AUDIT, seeds=(910_001, 910_002), probe=False)
    (group,) = cells.grouped([first, audited])
    together = cells.compute(group)
    assert [*together] == [first.key, audited.key]
    for cell in (first, audited):
        alone = cells.compute(cells.Group((cell,)))[cell.key]
        assert alone.pop("volatile").keys() == together[cell.key].pop("volatile").keys()
        assert canonical_text(alone) == canonical_text(together[cell.key])
        assert [e["seed"] for e in alone["episodes"]] == list(cell.seeds)


def test_group_is_of_one_policy_in_one_track(track):
    entrant, scenario = find("low"), track.scenarios()[0]
    plain = cells.Cell(entrant, track, scenario, seeds=(1,))
    beside = dataclasses.replace(plain, scenario=track.scenarios()[1])
    other = [
        dataclasses.replace(plain, training_seed=3),
        dataclasses.replace(plain, entrant=find("middle")),
    ]
    audited = [dataclasses.replace(c, split=cells.AUDIT, seeds=(2,)) for c in (plain, *other)]
    made = cells.grouped([plain, *other, beside, *audited])
    own, *rest = [group.cells for group in made]
    assert own == (plain, beside, audited[0])
    assert rest == [*zip(other, audited[1:], strict=True)]


def test_scenarios_of_one_controller_are_rows_of_one_batch(monkeypatch):
    track, sizes = scenarios.available()["joint_nominal"], []
    (group,) = cells.grouped(cells.cells_of(find("joint_pid"), track))
    run_all = rollout.run_all

    def noted(parts, controller):
        sizes.append([len(part.seeds) for part in parts])
        return run_all(parts, controller)

    monkeypatch.setattr(rollout, "run_all", noted)
    records = cells.compute(group)
    assert [*records] == [cell.key for cell in group.cells]
    names = [record["scenario"] for record in records.values()]
    assert names == [scenario.name for scenario in track.scenarios()]
    plants = {record["model_digest"] for record in records.values()}
    assert len(sizes) == len(plants) < len(names)
    assert sum(map(len, sizes)) == len(names)


def test_stored_scores_have_nine_digits():
    track = scenarios.available()["joint_nominal"]
    first = cells.cells_of(find("joint_pid"), track)[0]
    (record,) = cells.compute(cells.Group((first,))).values()
    for episode in record["episodes"]:
        for value in episode["scores"].values():
            assert np.isnan(value) or value == float(f"{value:.9g}")


def test_informed_controller_has_the_first_seeds_and_a_group_for_each_scenario():
    track = scenarios.available()["joint_randomised"]
    entrant = find("joint_inverse_ahead_informed")
    found = audit.find(find("joint_inverse_ahead"), track)
    assert found is not None
    made = cells.cells_of(entrant, track, found)
    assert {cell.split for cell in made} == {cells.PUBLIC, cells.AUDIT}
    for cell in made:
        whole = (track.seeds if cell.split == cells.PUBLIC else found.seeds)[cell.scenario.name]
        assert cell.seeds == whole[: cells.INFORMED_SEEDS[cell.split]] != whole
    assert len(cells.grouped(made)) == len(track.scenarios())


def test_cancelled_cell_is_stopped(track, monkeypatch):
    scenario = track.scenarios()[0]
    cell = cells.Cell(find("low"), track, scenario, seeds=track.seeds[scenario.name])
    asked = iter([False])
    monkeypatch.setattr(rollout, "is_needed", lambda: next(asked))
    with pytest.raises(RuntimeError, match="cancelled"):
        cells.compute(cells.Group((cell,)))
    assert worker.is_needed()  # always true outside of a cluster
