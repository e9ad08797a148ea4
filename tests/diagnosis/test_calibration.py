"""Calibration of a base plant: from two files to a plant file."""

from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import pam_envs  # noqa: F401 (registers)
from pam_envs.__main__ import main
from pam_envs.constants import BAR, GRAVITY, MM
from pam_envs.data import example
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.calibration import BasePlant, Errors, _bounds, calibrate, nearest
from pam_envs.diagnosis.fit.least_squares import Free
from pam_envs.diagnosis.fit.similarity import Similarity
from pam_envs.diagnosis.fit.single_muscle import inputs_of
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.single_muscle.families import base_plant
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.replay import replay_rows
from tests.diagnosis.conftest import needs_kernels
from tests.diagnosis.families import family_rigs, joint_rig

PERIOD = 0.02
TRUE = {
    "regulator.dead_time": 0.06,
    "regulator.time_constant": 0.07,
    "mass.load": 0.0,
}
# family, diameter [m], rest length [m], largest pressure [Pa], loads [kg]
THIN = ("mckibben", 0.003, 0.1, 1.5e5, (0.001, 0.08))
SOFT = ("mckibben", 0.02, 0.2, 1e4, (0.02, 0.1))
STRONG = ("festo_dmsp", 0.04, 0.6, 1.7e6, (20.0, 60.0, 100.0))  # two loads leave its law open


def experiments(seed: int) -> tuple[np.ndarray, list[str]]:
    """Return a command over its range, and the labels of its experiments."""
    random = np.random.default_rng(seed)
    time = PERIOD * np.arange(500)
    parts = {
        "rest": np.zeros(150),
        "staircase": np.repeat(np.r_[np.linspace(0.2, 1.0, 5), np.linspace(0.8, 0.1, 4)], 80),
        "sine": 0.5 - 0.45 * np.cos(2.0 * np.pi * time / 5.0),
        "steps": np.repeat([0.1, 0.9, 0.1, 0.6, 0.2, 0.8], 60),
        "random": np.repeat(random.uniform(0.05, 0.95, 10), 50),
    }
    labels = [f"{name}_{seed}" for name, values in parts.items() for _ in values]
    return np.concatenate([*parts.values()]), labels


def made(family, diameter, length, full, loads) -> tuple[SingleMuscle, Recording, Rig]:
    """Return a muscle that differs from its family, and its recording with noise."""
    plant = base_plant(family, length, diameter, max_pressure=full)
    plant = plant.replace(
        {**TRUE, "regulator.slew_rate": full, "muscle.area": 1.25 * plant.muscle.area}
    )
    pieces = [experiments(k) for k in range(len(loads))]
    command = full * np.concatenate([values for values, _ in pieces])
    labels = [label for _, names in pieces for label in names]
    load = GRAVITY * np.repeat(loads, [len(values) for values, _ in pieces])
    time = np.concatenate([PERIOD * np.arange(len(values)) for values, _ in pieces])
    rig = Rig(rest_length=length, diameter=diameter, max_pressure=full, settled=True)
    given = dict(load=load, segment=labels)
    blank = Recording.from_arrays(time, command, contraction=np.arange(len(time)), **given)
    x, p = replay_rows(plant, plant.parameter_rows()[None], inputs_of(blank, rig))[:, :, 0]
    random = np.random.default_rng(9)
    x = x + random.normal(0.0, 2e-3 * np.ptp(x), len(x))
    p = p + random.normal(0.0, 1.5e-3 * full, len(p))
    return plant, Recording.from_arrays(time, command, contraction=x, pressure=p, **given), rig


@needs_kernels
@pytest.mark.parametrize("case", [THIN, SOFT, STRONG], ids=["thin", "soft", "strong"])
def test_muscle_of_any_size_is_calibrated_to_its_noise(case, tmp_path):
    true, recording, rig = made(*case)
    found = calibrate(recording, rig, progress=False)
    for channel, errors in found.errors.items():
        assert errors.held_out < 1.25 * errors.floor, channel
        assert errors.before > 5.0 * errors.after, channel
    regulator = found.plant.regulator
    assert regulator.dead_time == pytest.approx(0.06, abs=0.003)
    assert regulator.time_constant == pytest.approx(0.07, abs=0.003)
    assert regulator.slew_rate == pytest.approx(case[3], rel=0.02)
    assert found.at_bound == ()
    found.write(tmp_path / "plant.yaml")
    plant = SingleMuscle.from_yaml(tmp_path / "plant.yaml")
    assert plant == found.plant
    assert plant.muscle.rest_length == case[2] and plant.muscle.diameter == case[1]
    assert plant.mass.load == pytest.approx(np.median(recording.load) / GRAVITY)
    drive = np.linspace(0.3, 0.9, 4) * case[3]
    stroke = np.ptp(recording.contraction)
    for load in case[4]:
        np.testing.assert_allclose(
            plant.contraction_at(drive, load), true.contraction_at(drive, load), atol=0.08 * stroke
        )
    env = gym.make(
        "PAM/MusclePositioning-v0", plant=str(tmp_path / "plant.yaml"), load=plant.mass.load
    )
    env.reset(seed=1)
    assert np.isfinite(env.step(env.action_space.sample())[0]).all()
    summary = found.summary()
    assert f"regulator: dead time {1e3 * regulator.dead_time:.3g} ms" in summary
    assert f"from the family {found.family}" in summary


FITTED = {
    "ELBOW": ("regulator.dead_time", "bundle_a.pressure_each", "bundle_b.pressure_each"),
    "KNEE": ("regulator.dead_time", "muscle.gain"),
    "HELD": ("regulator.dead_time", "muscle.gain"),
    "ARM": ("regulator.dead_time",),
}


def area_over_mass(arm):
    """Return the area of an arm's muscles over its masses: alone, none shows without a force."""
    return arm.muscle.area / arm.arm.mass_factor


@needs_kernels
@pytest.mark.parametrize("family", FITTED)
def test_other_plants_are_calibrated_to_their_noise(family, tmp_path):
    rig = getattr(family_rigs, family)
    found = calibrate(rig.recorded(), rig.sheet, rig.start, progress=False)
    assert set(found.errors) == set(rig.outputs)
    some = 2.0 if family == "ARM" else 1.25  # few samples of the arm's slow directions
    for channel, errors in found.errors.items():
        assert errors.held_out < some * errors.floor, channel
    assert max(e.before / e.after for e in found.errors.values()) > 5.0
    for name in FITTED[family]:
        assert found.plant.value(name) == pytest.approx(rig.truth().value(name), rel=0.03), name
    if family == "ARM":
        ratios = [area_over_mass(plant) for plant in (found.plant, rig.truth())]
        assert ratios[0] == pytest.approx(ratios[1], rel=0.03)
    found.write(tmp_path / "plant.yaml")
    assert type(found.plant).from_yaml(tmp_path / "plant.yaml") == found.plant
    assert found.summary().startswith(f"{rig.plant.family}\nRMS error")
    assert "regulator: dead time" in found.summary()


@needs_kernels
def test_joint_without_commands_is_calibrated_but_for_its_regulator():
    whole = joint_rig.recorded()
    blind = Recording.of_channels(
        whole.time,
        {"payload": whole.inputs["payload"]},
        whole.outputs,
        plant=joint_rig.SHEET.plant,
        segment=[whole.segments[k] for k in whole.segment],
    )
    found = calibrate(blind, joint_rig.SHEET, progress=False)
    errors = found.errors["angle"]
    assert errors.held_out < 2.0 * errors.floor < errors.before
    assert "regulator: dead time" not in found.summary()
    assert any("the regulator is not fitted" in text for text in found.warnings)
    default = AntagonisticJoint.paper().regulator
    assert found.plant.regulator.time_constant == default.time_constant


@needs_kernels
def test_command_line_writes_the_plant(tmp_path, capsys):
    recording, rig = example.recording_and_rig()
    call = ["calibrate", str(recording), "--rig", str(rig), "--out", str(tmp_path / "p.yaml")]
    assert main([*call, "--quiet"]) == 0
    said = capsys.readouterr().out
    assert "contraction [mm]" in said and "held out" in said
    plant = SingleMuscle.from_yaml(tmp_path / "p.yaml")
    assert plant.provenance["muscle.area"][1].startswith("pam-envs calibrate, recording ")
    assert plant.muscle.rest_length == pytest.approx(0.14334)


def test_declared_family_is_taken_and_the_nearest_found():
    _, recording, rig = made("mckibben", 0.01, 0.2, 6e5, (1.0,))
    family, plant = nearest(recording, rig)
    assert family == "mckibben"
    named = Rig(rest_length=0.2, diameter=0.01, family="festo_mas", braid_angle=0.3)
    family, plant = nearest(recording, named)
    assert family == "festo_mas" and plant.muscle.braid_angle == 0.3


def test_parameter_at_its_bound_is_told_with_value_bounds_and_remedy():
    plant = base_plant("festo_dmsp", 0.2, 0.08)
    frees = [
        Free("muscle.area", 0, 1e-7, 0.2, 1.0, log=True),
        Free("muscle.stiffness", 1, 0.0, 1e6, 100.0),
        Free("muscle.strand_1", 2, 0.0, 500.0, 1.0),
        Free("hysteresis.weight[0]", 3, 0.0, 1.0, 0.1),
    ]
    rounded = float(np.exp(np.log(0.2)))  # a bound after the rounding of a logarithm
    values = {"muscle.area": rounded, "muscle.stiffness": 9e5}
    values |= {"muscle.strand_1": 0.0, "hysteresis.weight[0]": 0.0}
    larger = Similarity(1.0 / 64.0, 1.0).inverse
    units = dict(zip(values, ("m2", "N/m", "N", "1"), strict=True))
    said = dict(_bounds(plant, frees, values, units, larger))
    assert set(said) == {"muscle.area", "muscle.strand_1"}
    assert said["muscle.strand_1"] == ""  # an effect that is off
    assert said["muscle.area"].startswith(
        "muscle.area = 12.8 m2 is at a bound of [6.4e-06, 12.8] m2"
    )
    assert "check the sizes in RIG.yaml" in said["muscle.area"]
    errors = {"contraction": Errors(1e-3, 1e-4, 2e-4, 1e-4, "holds", "mm", 1e-3)}
    text = BasePlant(plant, "", errors, (), (said["muscle.area"],), ("w",), ("x",)).summary()
    assert "at a bound: muscle.area = 12.8 m2" in text
    assert "at 0, not shown by the recording: x" in text
    assert "1       0.1       0.2       0.1  (noise: holds)" in text


def files(folder: Path, rig: str, *lines: str) -> list[str]:
    (folder / "rig.yaml").write_text(rig)
    (folder / "data.csv").write_text("\n".join(lines) + "\n")
    return ["calibrate", str(folder / "data.csv"), "--rig", str(folder / "rig.yaml")]


SIZED = "plant: single_muscle\nmuscle: {rest_length_mm: 200, diameter_mm: 10}\n"
HEAD = "time_s,pressure_command_bar,pressure_bar,contraction_mm"
ROWS = [
    f"{PERIOD * k:.2f},{3 + 2 * np.sin(k / 9):.4f},{3 + 2 * np.sin(k / 9 - 0.2):.4f},"
    f"{9 + 5 * np.sin(k / 9 - 0.3):.4f}"
    for k in range(400)
]
READINGS = ["load_kg,pressure_bar,direction,contraction_mm", "1,0,up,0", "1,1,up,2", "1,0,down,1"]
PRESSURES = [HEAD.rpartition(",")[0], *(row.rpartition(",")[0] for row in ROWS)]


@pytest.mark.parametrize(
    ("rig", "lines", "said"),
    [
        ("plant: single_muscle\n", [HEAD, *ROWS], "a calibration needs muscle.rest_length_mm; add"),
        (
            "plant: knee_orthosis\n",
            ["pressure_bar,contraction_mm,force_N", *(f"{p},{x},9" for p in "123" for x in "123")],
            "'knee_orthosis' is not calibrated to a table of forces; give a recording in time",
        ),
        (SIZED, READINGS, "is a table of settled readings, which shows no force"),
        (SIZED, PRESSURES, "has no column contraction_mm, which the muscle is calibrated to"),
        (
            SIZED.replace("10}", "10, family: pleated}"),
            [HEAD, *ROWS],
            "muscle.family is 'pleated'; choose one of festo_mas, festo_dmsp, mckibben",
        ),
    ],
)
def test_what_cannot_be_calibrated_is_refused_with_a_remedy(tmp_path, capsys, rig, lines, said):
    out = tmp_path / "plant.yaml"
    assert main([*files(tmp_path, rig, *lines), "--out", str(out), "--quiet"]) == 2
    assert said in capsys.readouterr().err
    assert not out.exists()


def test_plant_file_must_not_be_a_folder(tmp_path, capsys):
    assert main([*files(tmp_path, SIZED, HEAD, *ROWS), "--out", str(tmp_path), "--quiet"]) == 2
    assert "is a folder; give the name of the plant file" in capsys.readouterr().err


def test_table_of_forces_gives_the_static_law(tmp_path, capsys):
    muscle = base_plant("festo_dmsp", 0.2, 0.02).muscle
    lines = ["pressure_bar,contraction_mm,force_N"]
    for bar in (1, 2, 4, 6):
        for mm in range(0, 36, 5):
            force = max(0.0, float(muscle.tension(bar * BAR, mm * MM / 0.2)))
            lines.append(f"{bar},{mm},{force:.2f}")
    out = tmp_path / "plant.yaml"
    rig = SIZED.replace("diameter_mm: 10", "diameter_mm: 20")
    assert main([*files(tmp_path, rig, *lines), "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "force: RMS 0.00" in said
    assert "friction, regulator and moving mass are those of the family" in said
    plant = SingleMuscle.from_yaml(out)
    assert plant.regulator.max_pressure == 6e5
    np.testing.assert_allclose(
        plant.muscle.tension(3e5, np.linspace(0, 0.15, 5)),
        muscle.tension(3e5, np.linspace(0, 0.15, 5)),
        rtol=1e-2,
        atol=1.0,
    )
    assert plant.provenance["muscle.area"] == ("identified", "pam-envs calibrate, data.csv")
