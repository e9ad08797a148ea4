"""End to end: from two files to verdict, extended plant and gain."""

import dataclasses
import json

import gymnasium as gym
import numpy as np
import pytest

import pam_envs  # noqa: F401 (registers)
from pam_envs.__main__ import main
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis import diagnose
from pam_envs.diagnosis.audit.audit import undecidable
from pam_envs.diagnosis.causes import catalogue
from pam_envs.diagnosis.decide.isolability import ALIKE
from pam_envs.diagnosis.diagnosis import fit_failures_explained
from pam_envs.plants.core.plant import UnstableParameters
from tests.diagnosis import hidden
from tests.diagnosis.conftest import needs_kernels, recorded

pytestmark = [needs_kernels, pytest.mark.xdist_group("diagnosis")]  # one diagnosis for all


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("rig")


@pytest.fixture(scope="module")
def files(folder):
    """Recording and rig file of a rig with a temperature effect."""
    return recorded(folder, "temperature", 3.0, hidden.campaign_standard(2))


@pytest.fixture(scope="module")
def found(files):
    recording, rig = files
    return diagnose(recording, rig=rig, progress=False)


def test_hidden_cause_is_named_and_error_decreases(found):
    assert (found.verdict, found.causes) == ("named", ("temperature",))
    before, after = (found.report[k]["contraction"] for k in ("error_before", "error_after"))
    assert after["value"] < 0.7 * before["value"]
    assert after["interval"][0] < after["value"] < after["interval"][1] < before["interval"][0]
    assert found.plant.muscle.temperature_gain != 0.0 == found.base.muscle.temperature_gain
    assert "temperature" in found.text


def test_extended_plant_is_adequate(files, found):
    recording, rig = files
    again = diagnose(recording, found.plant, rig=rig, progress=False, closed_loop=False)
    assert (again.verdict, again.causes) == ("adequate", ())
    assert "temperature" in {entry["name"] for entry in again.report["not_testable"]}
    assert any(entry["name"] == "muscle.temperature_gain" for entry in again.report["calibration"])


def test_command_line_writes_the_same_report(folder, found, tmp_path, capsys):
    call = ["diagnose", str(folder / "recording.csv"), "--rig", str(folder / "rig.yaml")]
    call += ["--out", str(tmp_path)]
    assert main([*call, "--quiet"]) == 0
    assert found.text in " ".join(capsys.readouterr().out.split())
    found.write(tmp_path / "again")
    for name in ("report.json", "plant.yaml", "report.html"):
        assert (tmp_path / name).stat().st_size > 500
    one, two = (json.loads((p / "report.json").read_text()) for p in (tmp_path, tmp_path / "again"))
    assert one.pop("runtime_s") > 0.0 < two.pop("runtime_s")
    for report in (one, two):
        report["provenance"].pop("recording", None)
    assert one == two
    assert (tmp_path / "plant.yaml").read_bytes() == (tmp_path / "again/plant.yaml").read_bytes()
    env = gym.make("PAM/MusclePositioning-v0", plant=str(tmp_path / "plant.yaml"))
    env.reset(seed=1)
    assert np.isfinite(env.step(env.action_space.sample())[0]).all()


def test_without_pressure_valve_causes_are_isolable_or_not_testable(files):
    recording, rig = files
    columns = {k: getattr(recording, k) for k in ("contraction", "load", "temperature")}
    labels = [recording.segments[k] for k in recording.segment]
    blind = Recording.from_arrays(
        recording.time,
        recording.command,
        segment=labels,
        valve_closed=rig.valve_closed,
        **columns,
    )
    result = diagnose(blind, rig=rig, progress=False, closed_loop=False)
    assert "temperature" in result.causes
    assert "pressure" not in result.report["error_after"]
    assert any("there is no column pressure_bar" in w for w in result.report["warnings"])
    valve = {cause.name for cause in catalogue() if cause.in_valve}
    listed = {entry["name"]: entry["reason"] for entry in result.report["not_testable"]}
    found = result.report["isolability"]
    assert valve <= {*listed, *found["names"]}
    assert not valve & set(result.causes)
    for name in valve - set(listed):
        k = found["names"].index(name)
        others = [c for i, c in enumerate(found["cosine"][k]) if i != k]
        assert max(others) < ALIKE
    shut = dataclasses.replace(blind, valve_closed=np.zeros(len(blind.time), bool))
    bare = dataclasses.replace(rig, valve_closed=())
    assert "valve was never shut" in undecidable(shut, bare)["leak"]


def test_causes_are_given_by_name(files):
    recording, rig = files
    one = diagnose(recording, rig=rig, causes=["temperature"], progress=False, closed_loop=False)
    assert (one.verdict, one.causes) == ("named", ("temperature",))
    with pytest.raises(ValueError, match="did you mean 'temperature'"):
        diagnose(recording, rig=rig, causes=["temprature"], progress=False)


def test_impossible_data_give_an_error_with_remedy(files):
    recording, _ = files
    metres = dataclasses.replace(recording, contraction=1e-3 * recording.contraction)
    with pytest.raises(ValueError, match="looks like metres: multiply by 1000"):
        diagnose(metres, rig=Rig(), progress=False)
    with (
        pytest.raises(ValueError, match=r"check the units of contraction_mm.*RIG.yaml"),
        fit_failures_explained(),
    ):
        raise UnstableParameters("too fast for 4 sub-steps")
