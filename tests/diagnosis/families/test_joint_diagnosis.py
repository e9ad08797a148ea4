"""Diagnosis of an antagonistic joint."""

import json

import gymnasium as gym
import numpy as np
import pytest

from pam_envs.data.recording.recording import Recording, RecordingError, load_recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis import diagnose
from pam_envs.diagnosis.audit.noise import noise_floor
from pam_envs.diagnosis.diagnosis import Study
from pam_envs.diagnosis.families.antagonistic_joint import JointKind
from tests.diagnosis.conftest import needs_kernels
from tests.diagnosis.families.joint_rig import (
    PERIOD,
    SHARE,
    SHEET,
    campaign,
    joint,
    readings,
    recorded,
)

HIDDEN = {
    "creep": {"hysteresis__creep_1": 0.01, "hysteresis__creep_2": 0.01},
    "stick_slip": {"link__stick": 0.004},
    "unequal_muscles": {"muscle__imbalance": 0.06},
    "valve_dead_band": {"regulator__dead_band": 6e3},
}
COLUMNS = {
    "set_point_a": ("pressure_command_a_bar", 1e5),
    "set_point_b": ("pressure_command_b_bar", 1e5),
    "payload": ("payload_kg", 1.0),
    "angle": ("angle_deg", np.pi / 180.0),
    "pressure_a": ("pressure_a_bar", 1e5),
    "pressure_b": ("pressure_b_bar", 1e5),
}


def write(path, signals, labels):
    """Write signals in SI as a file with the columns of a joint."""
    names = [COLUMNS[name][0] for name in signals]
    columns = [np.asarray(v) / COLUMNS[name][1] for name, v in signals.items()]
    rows = [
        ",".join([f"{PERIOD * k:.2f}", labels[k], *(f"{column[k]:.9g}" for column in columns)])
        for k in range(len(labels))
    ]
    path.write_text("\n".join([",".join(["time_s", "segment", *names]), *rows]))
    return path


@needs_kernels
@pytest.mark.parametrize("name", HIDDEN)
def test_hidden_effect_is_named_and_explains_the_error(name):
    # creep needs the whole campaign: on the shorter one equally good fits explain 0.85 or 0.91
    share = 1.0 if name == "creep" else SHARE
    found = diagnose(recorded(share, **HIDDEN[name]), rig=SHEET, progress=False)
    assert (found.verdict, found.causes) == ("named", (name,))
    explained = found.report["explained"]
    worst = max(explained, key=lambda c: explained[c]["before"] / explained[c]["floor"])
    assert explained[worst]["share"] > 0.9
    loop, reason = found.report["closed_loop"], found.report["closed_loop_reason"]
    if name == "stick_slip":
        assert (loop, reason) == (None, "a controller cannot compensate stick_slip")
    else:
        assert (loop["controller"], loop["unit"], reason) == ("joint_mfc_mu", "deg", None)


@needs_kernels
def test_joint_without_a_hidden_effect_is_adequate_and_its_plant_goes_into_an_environment(tmp_path):
    inputs, labels = campaign(share=SHARE)
    truth = joint()
    signals = inputs | readings(truth, inputs)
    (tmp_path / "rig.yaml").write_text(
        "plant: antagonistic_joint\n"
        "sensors: {angle_noise_deg: 0.0286, pressure_a_noise_bar: 0.004}\n"
        "history: {settled: true}\n"
    )
    sheet = Rig.from_yaml(tmp_path / "rig.yaml")
    assert sheet.noise == pytest.approx({"angle": 5e-4, "pressure_a": 400.0}, rel=0.01)
    recording = load_recording(write(tmp_path / "recording.csv", signals, labels), sheet)
    found = diagnose(recording, rig=sheet, progress=False)
    assert (found.verdict, found.causes) == ("adequate", ())
    assert found.plant.value("link.mass") == pytest.approx(truth.value("link.mass"), rel=0.1)
    found.write(tmp_path / "found")
    page = (tmp_path / "found/report.html").read_text()
    assert "pressure difference [bar]" in page and "angle [deg]" in page
    report = json.loads((tmp_path / "found/report.json").read_text())
    assert report["noise_floor"]["angle"]["unit"] == "deg"
    env = gym.make("PAM/AntagonisticJoint-v0", plant=str(tmp_path / "found/plant.yaml"))
    assert env.unwrapped.plant.digest() == report["provenance"]["plant_after"]
    env.close()


@needs_kernels
def test_without_commands_the_pressures_drive_the_replay_and_the_valve_is_not_judged():
    inputs, labels = campaign()
    found = readings(joint(), inputs, pressure_a=40.0, pressure_b=40.0)  # noise of inputs moves it
    time = PERIOD * np.arange(len(labels))
    given = {"payload": inputs["payload"]}
    made = Recording.of_channels(time, given, found, plant=SHEET.plant, segment=labels)
    kind = JointKind()
    study = Study.begin(made, SHEET, kind.start(SHEET), noise_floor(made, SHEET), kind)
    left = study.problem.rows(study.base.fit.residual)
    assert np.sqrt(np.mean(left[0] ** 2)) < 1.3  # over the noise
    assert study.plant_of(study.base).regulator == study.start.regulator
    asked = kind.causes(kind.catalogue)
    study.find_testable(asked)
    valve = {"dead_time", "exhaust_asymmetry", "slew_limit", "supply_droop", "valve_dead_band"}
    assert all("no command was recorded" in study.not_testable[name] for name in valve)
    assert {"stick_slip", "creep", "sensor_delay"} <= {c.name for c in study.causes}


def test_a_file_that_lacks_a_pressure_of_a_pair_is_refused_with_the_column(tmp_path):
    inputs, labels = campaign()
    angle = {"angle": np.linspace(0.0, 0.1, len(labels))}
    one = {name: v for name, v in inputs.items() if name != "set_point_b"}
    with pytest.raises(RecordingError, match="needs the column pressure_command_b_bar"):
        load_recording(write(tmp_path / "a.csv", one | angle, labels), SHEET)
    with pytest.raises(RecordingError, match="pressure_a_bar, or commands"):
        load_recording(write(tmp_path / "b.csv", angle, labels), SHEET)
    with pytest.raises(RecordingError, match="at least one output that is not an input"):
        load_recording(write(tmp_path / "c.csv", inputs, labels), SHEET)


def test_every_cause_of_the_joint_moves_a_parameter_of_it():
    kind = JointKind()
    plant = kind.start(SHEET)
    for cause in kind.causes(kind.catalogue):
        for term in (t for form in cause.forms for t in form.terms):
            assert term.name in plant.names, (cause.name, term.name)
    assert {"unequal_muscles", "stick_slip", "creep"} <= {
        c.name for c in kind.causes(kind.catalogue)
    }


def test_a_rig_file_names_unknown_parameters_and_unrecorded_noise():
    inputs, labels = campaign()
    time = PERIOD * np.arange(len(labels))
    wave = {"angle": 0.1 * np.sin(time)}
    made = Recording.of_channels(time, inputs, wave, plant=SHEET.plant, segment=labels)
    sheet = Rig(plant=SHEET.plant, parameters={"link.masses": 1.0}, noise={"torque": 0.1})
    problems = " ".join(JointKind().audit(made, sheet).problems)
    assert "'link.masses'; did you mean 'link.mass'?" in problems
    assert "'torque', which was not recorded" in problems
    with pytest.raises(RecordingError, match="'angel' is no output"):
        Recording.of_channels(time, inputs, {"angel": wave["angle"]}, plant=SHEET.plant)
