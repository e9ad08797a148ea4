"""A user's strict mypy accepts the types of the installed package, and uses them."""

import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

pytest.importorskip("mypy")
pytestmark = pytest.mark.xdist_group("user_types")  # one cache of mypy
ROOT = Path(__file__).parents[1]
GOOD = """
from typing import Any

import gymnasium as gym
import numpy as np

import pam_envs
from pam_envs.agents.settings.presets import Config, preset
from pam_envs.baselines.core.catalogue import make_controller
from pam_envs.data.rig_file import Rig
from pam_envs.parameters import Signals
from pam_envs.plants import SingleMuscle
from pam_envs.rig.simulated import SimulatedClock
from pam_envs.wrappers import Cost

slow: SingleMuscle = SingleMuscle.mas10("maxwell_slip").replace({"regulator.time_constant": 0.1})
slow.to_yaml("slow.yaml")
env: gym.Env[Any, Any] = Cost(gym.make("PAM/MusclePositioning-v0", plant=slow))
observation, info = env.reset(seed=7)


def rms(signals: Signals, observations: list[np.ndarray[Any, np.dtype[np.float32]]]) -> float:
    read = signals.decode(np.array(observations), "contraction")
    return float(np.sqrt(np.mean(np.square(read))))


settings: Config = preset("PAM/KneeTension-v0", "ppo")
rig: Rig = Rig.from_yaml("rig.yaml")
clock = SimulatedClock()
version: str = pam_envs.__version__
controller = make_controller("inverse_pid", slow, Signals([]), Signals([]))
"""
BAD = """
from pam_envs.parameters import Signals
from pam_envs.plants import SingleMuscle

length: str = SingleMuscle.mas10("maxwell_slip").control_period
Signals([]).decode([0.0], 3)
"""


@pytest.fixture(scope="module")
def answers(tmp_path_factory) -> list[str]:
    """Install the wheel into an empty environment; return mypy's lines about both modules."""
    builders = pytest.importorskip("hatchling.builders.wheel")
    folder = tmp_path_factory.mktemp("user")
    (wheel,) = builders.WheelBuilder(str(ROOT)).build(directory=str(folder), versions=["standard"])
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder / "venv"], check=True)
    python = folder / "venv/bin/python"
    command = [python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"]
    there = Path(subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip())
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(there)
    (there / "others.pth").write_text(sysconfig.get_path("purelib"))  # the dependencies

    for name, source in (("good.py", GOOD), ("bad.py", BAD)):
        (folder / name).write_text(source)
    arguments = ["--strict", "--python-executable", str(python), "good.py", "bad.py"]
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--config-file", "", *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert not done.stderr, done.stderr
    return done.stdout.splitlines()


def test_strict_mypy_accepts_a_module_that_uses_the_package(answers):
    assert [line for line in answers if not line.startswith(("bad.py:", "Found "))] == []


def test_strict_mypy_reports_a_wrong_use(answers):
    said = [line.partition(": error: ")[0] for line in answers if line.startswith("bad.py:")]
    assert said[:2] == ["bad.py:5", "bad.py:6"], answers
