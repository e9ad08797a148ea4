"""Shipped example: a recording with a hidden effect, its diagnosis, its sealed truth."""

import json
import shutil

import numpy as np
import pytest

from benchmarks.diagnosis.example import write
from pam_envs.__main__ import main
from pam_envs.data import example
from pam_envs.data.recording.recording import load_recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.causes import by_name
from tests.diagnosis.conftest import needs_kernels

KILOBYTE = 1000


def test_recording_is_small_complete_and_sound():
    path, rig = example.recording_and_rig()
    assert path.stat().st_size < 300 * KILOBYTE
    recording = load_recording(path, Rig.from_yaml(rig))
    assert recording.period == pytest.approx(0.02)
    assert 100.0 < recording.time[-1] < 150.0
    assert recording.valve_closed.any() and len(np.unique(recording.load)) > 2
    assert recording.pressure is not None and recording.temperature is not None


def test_truth_is_unreadable_until_it_is_opened(capsys):
    text = (example.FOLDER / example.TRUTH).read_text()
    truth = example.reveal()
    (name,) = truth["names"]
    for word in (name, by_name(name).title, truth["world"]):
        assert word not in text
    assert main(["reveal", "example"]) == 0
    assert capsys.readouterr().out.startswith(f"{name}: {by_name(name).title}")


@pytest.mark.parametrize("file", [example.RECORDING, example.TRUTH])
def test_changed_example_is_refused(file, tmp_path):
    for name in (example.RECORDING, example.TRUTH):
        shutil.copy(example.FOLDER / name, tmp_path)
    path = tmp_path / file
    if file == example.TRUTH:
        content = json.loads(path.read_text())
        content["truth_sha256"] = content["truth_sha256"][::-1]
        path.write_text(json.dumps(content))
    else:
        path.write_bytes(path.read_bytes() + b"0")
    with pytest.raises(ValueError, match="install the package again"):
        example.reveal(tmp_path)


@needs_kernels
def test_command_makes_the_shipped_files(tmp_path):
    write(tmp_path)
    one, two = (load_recording(folder / example.RECORDING) for folder in (example.FOLDER, tmp_path))
    for column, grain in (("contraction", 1e-6), ("pressure", 100.0), ("command", 1e-3)):
        assert np.abs(getattr(one, column) - getattr(two, column)).max() < 1.01 * grain
    rigs = [Rig.from_yaml(folder / example.RIG) for folder in (example.FOLDER, tmp_path)]
    assert rigs[0] == rigs[1]
    truths = [example.reveal(folder) for folder in (example.FOLDER, tmp_path)]
    assert truths[0]["names"] == truths[1]["names"]
    assert truths[0]["rms_mm"] == pytest.approx(truths[1]["rms_mm"], rel=1e-3)


@needs_kernels
def test_diagnosis_of_the_example_names_the_hidden_effect(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["diagnose", "example", "--quiet"]) == 0
    report = json.loads((tmp_path / "diagnosis/report.json").read_text())
    assert capsys.readouterr().out.startswith(f"{report['verdict']}: ")
    assert report["verdict"] in ("named", "ambiguous")
    assert set(example.reveal()["names"]) <= {cause["name"] for cause in report["causes"]}
    assert (tmp_path / "diagnosis/plant.yaml").exists()
