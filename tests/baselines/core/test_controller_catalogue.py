"""Catalogue: names, plants, and controllers added from outside the package."""

import os
import subprocess
import sys
from dataclasses import replace

import pytest

from baselines.core import catalogue
from baselines.core.catalogue import CONTROLLERS, PUBLISHED, load, make_controller, register
from baselines.core.checks import check_controller
from benchmarks.runs import controllers as benchmarked
from pam_envs import citations
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from tests.baselines.conftest import built, make_env, observations_of, rollout

TOY = '''
from dataclasses import dataclass

import numpy as np

from baselines.core.controller import Reader, encode_action, reader, reset_rows
from baselines.core.entry import Entry
from pam_envs.parameters import Signal


@dataclass(frozen=True)
class Integrator:
    """Integral control of the contraction."""

    reader: Reader
    action_signal: Signal
    gain: float

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        contraction, set_point, reference = self.reader.rows(observation)
        state = reset_rows(state, episode_start, len(contraction), lambda: (set_point,))
        command = state[0] + self.gain * (reference - contraction)
        return encode_action(self.action_signal, command, observation), (command,)


def make(spec):
    signals = reader(spec.signals, ["contraction", "set_point", "reference"])
    return Integrator(signals, spec.actions["pressure_set_point"], 2e6 * spec.knob("gain"))


ENTRIES = {
    "toy_integrator": Entry("integral", "nothing", make, feedback=True, knobs={"gain": (0.5, 2.0)})
}
'''


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "toy.py").write_text(TOY)
    for catalogued in (CONTROLLERS, PUBLISHED):
        monkeypatch.setitem(catalogued, "toy_integrator", None)  # restores the absence afterwards
        del catalogued["toy_integrator"]
    return tmp_path


def printed(program: str, **variables: str) -> str:
    """Return what a program prints in a process of its own."""
    command, env = [sys.executable, "-c", program], {**os.environ, **variables}
    return subprocess.run(command, env=env, capture_output=True, text=True, check=True).stdout[:-1]


def test_third_party_controller_enters_catalogue_checks_and_benchmark(folder):
    assert load(folder) == ["toy_integrator"]
    env = make_env(load=2.55, reference="staircase", episode_seconds=3.0)
    toy = built("toy_integrator", env)
    check_controller(toy, observations_of(env, steps=8, rows=3), env.action_signals)
    record = rollout(env, toy)
    assert abs(record["output"] - record["reference"]).mean() < abs(record["reference"]).mean()
    nominal = (env.plant, env.signals, env.action_signals)
    assert make_controller("toy_integrator", *nominal, knobs={"gain": 2.0}).gain == 4e6
    assert benchmarked.find("toy_integrator").runs_in("PAM/MusclePositioning-v0")
    with pytest.raises(ValueError, match="'toy_integrator' is registered already"):
        load(folder)


def test_environment_variable_names_folders_of_controllers(folder):
    program = "import baselines.core.catalogue as c; print('toy_integrator' in c.CONTROLLERS)"
    assert printed(program, **{catalogue.VARIABLE: str(folder)}) == "True"


def test_catalogue_is_imported_without_python_control_and_cvxpy():
    program = "import sys, baselines.core.catalogue; print({'control', 'cvxpy'} & set(sys.modules))"
    assert printed(program) == "set()"


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda folder: load(folder / "none"), "no Python file with ENTRIES"),
        (lambda _: register("pid", PUBLISHED["pid"]), "'pid' is registered already"),
        (lambda _: built("pdi", make_env()), "did you mean 'pid'"),
        (lambda _: built("knee_pid", make_env()), "knee_pid is for a KneeOrthosis"),
        (lambda _: built("elbow_pid", make_env()), "elbow_pid is for a ElbowOrthosis"),
        (lambda _: built("joint_pi", make_env()), "AntagonisticJoint or RedundantManipulator"),
        (
            lambda _: built("joint_inverse_kinematics", make_env(), AntagonisticJoint.paper()),
            "is for a RedundantManipulator",
        ),
    ],
)
def test_wrong_name_folder_or_plant_is_refused(make, message, tmp_path):
    with pytest.raises(ValueError, match=message):
        make(tmp_path)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_citation_consists_of_keys_of_references(name):
    for key in filter(None, CONTROLLERS[name].citation.split("; ")):
        assert key in citations.entries()


def test_missing_package_of_a_design_names_the_extra(monkeypatch):
    def make(spec):
        raise ModuleNotFoundError("No module named 'slycot'", name="slycot")

    monkeypatch.setitem(CONTROLLERS, "pid", replace(CONTROLLERS["pid"], make=make))
    with pytest.raises(ModuleNotFoundError, match=r"pid needs slycot.*\[synthesis\]"):
        built("pid", make_env("PAM/MusclePositioning-v0"))
