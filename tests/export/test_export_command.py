"""Command line of the export, names and units."""

import re
from pathlib import Path
from typing import Any

import gymnasium as gym
import pytest

from pam_envs.__main__ import env_ids, main
from pam_envs.export.command import PLANTS, model_of
from pam_envs.export.environment import environment_model
from pam_envs.export.plant import plant_model
from pam_envs.export.units import unit_of

DOCS = Path(__file__).resolve().parents[2] / "docs" / "envs"
ROW = re.compile(r"^\| (`[^|]+`) \| ([^|]+) \|", re.MULTILINE)
PURE = {"0 or 1", "0, 1, 2"}


def documented() -> dict[str, dict[str, str]]:
    """Return the unit of each entry of ``info`` by page."""
    pages = {}
    for page in DOCS.glob("*.md"):
        units = {}
        for names, said in ROW.findall(page.read_text().partition("## Info")[2]):
            keys, words = re.findall(r"`([^`]+)`", names), said.strip()
            several = words.split(", ")
            if words in PURE:
                several = ["1"]
            if len(several) == len(keys):
                units |= dict(zip(keys, several, strict=True))
            elif len(several) == 1:
                units |= dict.fromkeys(keys, words if words not in PURE else "1")
        pages[page.stem] = units
    return pages


PAGES = {
    "PAM/MusclePositioning-v0": "muscle_positioning",
    "PAM/AntagonisticJoint-v0": "antagonistic_joint",
    "PAM/ElbowOrthosis-v0": "elbow_orthosis",
    "PAM/KneeTension-v0": "knee_brace",
    "PAM/KneeWalk-v0": "knee_gait",
    "PAM/RedundantManipulator-v0": "redundant_manipulator",
}


@pytest.mark.parametrize("name", PAGES)
def test_units_are_those_of_the_documentation(name: str) -> None:
    env: Any = gym.make(name).unwrapped
    model = environment_model(name, env)
    said = documented()[PAGES[name]]
    shown = {v.name.removeprefix("info."): v.unit for v in model.group("info")}
    common = {"time", "reference", "output"}
    checked = {key: unit for key, unit in shown.items() if key in said and key not in common}
    assert len(checked) > 10
    wrong = {k: (unit, said[k]) for k, unit in checked.items() if unit not in said[k].split(" or ")}
    assert wrong == {}


@pytest.mark.parametrize("family", PLANTS)
def test_every_plant_has_a_model_with_named_variables(family: str) -> None:
    model = model_of(family)
    assert model.name == family
    names = [v.name for v in (*model.inputs, *model.outputs, *model.parameters)]
    assert len(names) == len(set(names))
    assert model.block("output").values.size == len(model.outputs)
    assert all(v.low <= v.start <= v.high for v in model.parameters)


@pytest.mark.parametrize("name", env_ids())
def test_every_environment_has_a_model_with_named_variables(name: str) -> None:
    model = model_of(name)
    assert [v.word for v in model.outputs] == list(dict.fromkeys(v.word for v in model.outputs))
    assert all(v.low <= v.start <= v.high for v in model.parameters)
    assert model.parameters


def test_parameters_of_effects_that_are_off_are_left_out() -> None:
    from pam_envs.plants import SingleMuscle

    plain = SingleMuscle.mas10()
    group = plain.effects[0]
    on = plain.replace({"regulator.leak": 0.01}) if "regulator.leak" in plain.names else None
    names = {v.name for v in plant_model(plain).parameters}
    assert not names & set(group)
    if on is not None:
        assert "regulator.leak" in {v.name for v in plant_model(on).parameters}


def test_parameters_of_other_variants_are_left_out() -> None:
    from pam_envs.plants import SingleMuscle

    names = {
        drive: {v.name for v in plant_model(SingleMuscle.mas10(f"maxwell_slip{drive}")).parameters}
        for drive in ("", "_length")
    }
    assert "hysteresis.stretch" in names[""]
    assert "hysteresis.stretch" not in names["_length"]
    assert "hysteresis.friction" in names["_length"]


def test_environment_in_si_has_units_of_its_signals() -> None:
    model = model_of("MusclePositioning", si=True)
    assert (model.inputs[0].unit, model.inputs[0].high) == ("Pa", 6e5)
    assert model.group("observation")[0].unit == "m"


def test_plant_file_is_exported_as_a_plant(tmp_path: Path) -> None:
    from pam_envs.plants import SingleMuscle

    path = tmp_path / "mine.yaml"
    plant = SingleMuscle.mas10().replace({"mass.damping": 300.0})
    plant.to_yaml(path)
    model = model_of(str(path))
    assert model.facts["plant"].endswith(plant.digest())


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["Muscles"], "no environment or plant named"),
        (["single_muscle", "--air", "flow"], "--air is for environments"),
        (["nothing.yaml"], "cannot be read"),
        (["MusclePositioning", "--target", "c", "--platforms", "x86_64-windows"], "is for FMUs"),
    ],
)
def test_wrong_arguments_are_one_sentence(
    arguments: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", *arguments, "--out", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert len(error.splitlines()) == 1


def test_command_writes_a_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "MusclePositioning", "--target", "c", "--out", str(tmp_path)]) == 0
    folder = tmp_path / "muscle_positioning_c"
    assert {p.name for p in folder.iterdir()} == {
        "README.md", "example.c", "objects", "muscle_positioning.c", "muscle_positioning.h",
    }  # fmt: skip
    assert str(folder) in capsys.readouterr().out


def test_warmup_compiles_the_named_environments(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["warmup", "MusclePositioning", "--no-batch"]) == 0
    (line,) = capsys.readouterr().out.splitlines()
    assert line.startswith("PAM/MusclePositioning-v0, single environment: ")
    assert main(["warmup", "MusclePositionin"]) == 2
    assert "did you mean 'MusclePositioning'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "family", "unit"),
    [
        ("state/pressure_0a", "", "Pa"),
        ("state/velocity_3", "manipulator", "rad/s"),
        ("velocity", "single_muscle", "m/s"),
        ("reward/torque", "", "1"),
        ("state/stiffness", "gait", "N/m"),
        ("unheard_of", "", "1"),
    ],
)
def test_units_by_name(name: str, family: str, unit: str) -> None:
    assert unit_of(name, family) == unit
