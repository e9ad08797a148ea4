"""Environments, muscles and controllers of another installed distribution."""

import importlib
import shutil
import subprocess
import sys
from pathlib import Path

import gymnasium as gym
import pytest

import pam_envs
from baselines.core import catalogue
from baselines.trivial import ENTRIES
from pam_envs.plants import SingleMuscle

HERE = Path(__file__).parent
DECLARED = """
[pam_envs.environments]
spring_muscle = spring_muscle
broken = not_there
[pam_envs.muscles]
heavy = other_lab:heavy
light = other_lab:LIGHT
[pam_envs.controllers]
other_lab = other_lab
"""
MODULE = """
import dataclasses
from baselines.trivial import ENTRIES as KNOWN
from pam_envs.plants import SingleMuscle

LIGHT = SingleMuscle.mas10(mass__moving_mass=0.2)

def heavy():
    return SingleMuscle.mas10(mass__moving_mass=0.4)

ENTRIES = {"other_hold": next(iter(KNOWN.values()))}
"""


@pytest.fixture
def distribution(tmp_path, monkeypatch):
    """Install a distribution with three kinds of entry points, one of them broken."""
    shutil.copytree(HERE / "envs/core/spring_muscle", tmp_path / "spring_muscle")
    (tmp_path / "other_lab.py").write_text(MODULE)
    info = tmp_path / "other_lab-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: other-lab\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(DECLARED)
    monkeypatch.syspath_prepend(tmp_path)
    importlib.invalidate_caches()
    yield tmp_path
    gym.registry.pop("Own/SpringMuscle-v0", None)
    for name in [n for n in sys.modules if n.partition(".")[0] in ("spring_muscle", "other_lab")]:
        del sys.modules[name]


def test_environment_of_another_distribution_is_registered(distribution):
    with pytest.warns(RuntimeWarning, match=r"broken = 'not_there' .* is left out: ModuleNotFound"):
        pam_envs.register_all()
    assert "Own/SpringMuscle-v0" in gym.registry


def test_muscle_of_another_distribution_is_selected_by_name(distribution):
    moving = {
        name: gym.make("PAM/MusclePositioning-v0", plant=name).unwrapped.plant.mass.moving_mass
        for name in ("heavy", "light")
    }
    assert moving == {"heavy": 0.4, "light": 0.2}
    with pytest.raises(ValueError, match="not a SingleMuscle"):
        gym.make("PAM/AntagonisticJoint-v0", plant="heavy")


def test_plant_file_is_read_where_no_muscle_has_its_name(distribution, tmp_path):
    SingleMuscle.mas10(mass__moving_mass=0.3).to_yaml(tmp_path / "rig.yaml")
    env = gym.make("PAM/MusclePositioning-v0", plant=str(tmp_path / "rig.yaml"))
    assert env.unwrapped.plant.mass.moving_mass == 0.3


def test_controller_of_another_distribution_is_in_the_catalogue(distribution):
    assert ENTRIES
    program = "import baselines.core.catalogue as c; print('other_hold' in c.CONTROLLERS)"
    made = subprocess.run(
        [sys.executable, "-c", program],
        env={"PYTHONPATH": f"{distribution}:{HERE.parent}", "PATH": ""},
        capture_output=True,
        text=True,
        check=True,
    )
    assert made.stdout == "True\n", made.stderr
    assert "other_hold" not in catalogue.CONTROLLERS
