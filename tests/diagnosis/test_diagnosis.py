"""End to end: from two files to verdict, extended plant and gain."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
import yaml

import pam_envs  # noqa: F401 (registers)
from pam_envs.__main__ import main
from pam_envs.data.recording.recording import Recording, load_recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis import Diagnosis, diagnose
from pam_envs.diagnosis.audit.audit import undecidable
from pam_envs.diagnosis.causes import catalogue
from pam_envs.diagnosis.decide.isolability import ALIKE
from pam_envs.diagnosis.diagnosis import fit_failures_explained
from pam_envs.kernels.build import COMPILED
from pam_envs.plants.core.plant import UnstableParameters
from tests.diagnosis import hidden

pytestmark = pytest.mark.skipif(not COMPILED, reason="too many samples for plain Python")


@dataclass(frozen=True)
class Files:
    """Two files of a rig that leaks."""

    recording: Path
    rig: Path

    def load(self) -> tuple[Recording, Rig]:
        rig = Rig.from_yaml(self.rig)
        return load_recording(self.recording, rig), rig


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Files:
    folder = tmp_path_factory.mktemp("rig")
    random = np.random.default_rng(8)
    base, campaign = hidden.draw_base(random), hidden.campaign_standard(2)
    effect = hidden.draw_effect("temperature", random)
    columns = hidden.make_recording(base, [(effect, 3.0)], campaign, noise_seed=4)
    hidden.write_csv(columns, folder / "recording.csv")
    (folder / "rig.yaml").write_text(yaml.safe_dump(hidden.rig_yaml(base, campaign)))
    return Files(folder / "recording.csv", folder / "rig.yaml")


@pytest.fixture(scope="module")
def found(files: Files) -> Diagnosis:
    recording, rig = files.load()
    return diagnose(recording, rig=rig, progress=False)


def test_hidden_cause_is_named_and_error_decreases(found: Diagnosis) -> None:
    assert (found.verdict, found.causes) == ("named", ("temperature",))
    before, after = (found.report[k]["contraction"] for k in ("error_before", "error_after"))
    assert after["value"] < 0.7 * before["value"]
    assert after["interval"][0] < after["value"] < after["interval"][1] < before["interval"][0]
    assert found.plant.muscle.temperature_gain != 0.0 == found.base.muscle.temperature_gain
    assert "temperature" in found.text


def test_extended_plant_is_adequate(files: Files, found: Diagnosis) -> None:
    recording, rig = files.load()
    again = diagnose(recording, found.plant, rig=rig, progress=False, closed_loop=False)
    assert (again.verdict, again.causes) == ("adequate", ())
    assert "temperature" in {entry["name"] for entry in again.report["not_testable"]}
    assert any(entry["name"] == "muscle.temperature_gain" for entry in again.report["calibration"])


def test_command_line_writes_the_same_report(
    files: Files, found: Diagnosis, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    call = ["diagnose", str(files.recording), "--rig", str(files.rig), "--out", str(tmp_path)]
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


def test_without_pressure_valve_causes_are_isolable_or_not_testable(files: Files) -> None:
    recording, rig = files.load()
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


def test_causes_are_given_by_name(files: Files) -> None:
    recording, rig = files.load()
    one = diagnose(recording, rig=rig, causes=["temperature"], progress=False, closed_loop=False)
    assert (one.verdict, one.causes) == ("named", ("temperature",))
    with pytest.raises(ValueError, match="did you mean 'temperature'"):
        diagnose(recording, rig=rig, causes=["temprature"], progress=False)


def test_impossible_data_give_an_error_with_remedy(files: Files) -> None:
    recording, _ = files.load()
    assert recording.contraction is not None
    metres = dataclasses.replace(recording, contraction=1e-3 * recording.contraction)
    with pytest.raises(ValueError, match="looks like metres: multiply by 1000"):
        diagnose(metres, rig=Rig(), progress=False)
    with (
        pytest.raises(ValueError, match=r"check the units of contraction_mm.*RIG.yaml"),
        fit_failures_explained(),
    ):
        raise UnstableParameters("too fast for 4 sub-steps")
