"""A plant is added as one folder, an effect in the file of its component."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pam_envs

ROWS = """
from pam_envs.plants.core.muscle_path import DELAYED, PATH_STATE
from pam_envs.plants.core.rows import dotted, each, layout, path_effects
from pam_envs.plants.core.sensors import sensor_rows

globals().update(
    layout(
        each("pressure set_point force") | {"delay": DELAYED.end},
        dotted(
            regulator="max_pressure dead_time time_constant slew_rate",
            muscle="area",
            pressure="noise resolution bias",
        ),
        path_effects("muscle", sensors=("pressure",)),
        {"effective": 1, "path": PATH_STATE.end, "sensors": sensor_rows(1)},
    )
)
"""
PLANT = """
from dataclasses import dataclass, field
from typing import ClassVar

from isometric import rows as K
from pam_envs.muscle.force_map import ForceMap
from pam_envs.plants.antagonistic_joint.hysteresis import JointHysteresis
from pam_envs.plants.core.plant import Plant
from pam_envs.pneumatics.regulator import JointRegulator
from pam_envs.sensing.sensor import GaugeSensor


@dataclass(frozen=True)
class Isometric(Plant, rows=K):
    family: ClassVar[str] = "isometric"

    regulator: JointRegulator = field(default_factory=JointRegulator)
    hysteresis: JointHysteresis = field(default_factory=JointHysteresis)
    muscle: ForceMap = field(default_factory=ForceMap)
    pressure: GaugeSensor = field(default_factory=GaugeSensor)
"""
ROLLOUT = """
from isometric import rows as K
from pam_envs.hysteresis import protocol
from pam_envs.kernels.build import LANES, kernel
from pam_envs.plants.core.muscle_path import begin_delay, begin_path, follow_set_point, path_step
from pam_envs.plants.core.rollout import loop_for, simulate_plants
from pam_envs.plants.core.rows import signal_rows
from pam_envs.plants.core.sensors import begin_sensors, effect_kernels, read_sensors
from pam_envs.plants.core.rollout import drives_of

OUTPUTS = signal_rows(K, "pressure force")
EFFECTS_AT, EFFECTIVE = 0, K.PRESSURE


@kernel
def drive(rows, fixed, drives, t, column, j):
    rows[K.SET_POINT][j] = drives[0][t][column]


@kernel
def regulate(rows, fixed, counts, i, substeps, period, work):
    follow_set_point(
        rows, fixed, K.DELAY, K.REGULATOR_MAX_PRESSURE, rows[K.PRESSURE], rows[K.SET_POINT],
        counts[K.STEP], i, substeps, period,
    )


@kernel
def regulate_extended(rows, fixed, counts, i, substeps, period, work):
    path_step(
        rows, fixed, EFFECTS_AT + K.STATE.path, K.EFFECT.path, K.DELAY,
        K.REGULATOR_MAX_PRESSURE, K.EFFECT.warm, rows[K.PRESSURE], rows[K.SET_POINT],
        rows[EFFECTIVE], work[0], counts[K.STEP], i, substeps, period,
    )


@kernel
def begin_muscle(rows, fixed, j):
    rows[K.PRESSURE][j] = 0.0


@kernel
def begin_muscle_extended(rows, fixed, j):
    rows[EFFECTIVE][j] = begin_path(
        rows, fixed, j, EFFECTS_AT + K.STATE.path, K.EFFECT.path, K.EFFECT.warm, 0.0
    )


@kernel
def begin(rows, fixed, counts, table, extra, drives, t, first, elements, work):
    for j in range(LANES):
        rows[K.PRESSURE][j] = 0.0
        begin_delay(rows, j, K.DELAY, 0.0)
        begin_muscle(rows, fixed, j)
        begin_sensors(rows, fixed, j)


@kernel
def advance(rows, fixed, counts, table, hysteresis, elements, substeps, period, work):
    for i in range(substeps):
        regulate(rows, fixed, counts, i, substeps, period, work)
    for j in range(LANES):
        rows[K.FORCE][j] = fixed[K.MUSCLE_AREA][j] * rows[EFFECTIVE][j]
    read_sensors(rows, fixed, counts[K.STEP], period)


def replacements(effects):
    if effects is None:
        return protocol.kernels("none")
    shown = effect_kernels(effects, K, [K.PRESSURE], [K.EFFECT.pressure], [6e5])
    return shown | {"regulate": regulate_extended, "begin_muscle": begin_muscle_extended}


def channels_of(plant):
    return {"set_point": 0.0}


def readings_of(plant):
    return {"pressure": K.PRESSURE_BIAS}


def loop_of(plant, extended=False, readings=False):
    kernels = {"plant_drive": drive, "plant_begin": begin, "advance": advance}
    return loop_for(
        "isometric", plant, K, kernels, replacements, OUTPUTS.values(), 1, extended=extended,
        readings=readings_of(plant) if readings else None,
    )


def simulate(plant, set_points):
    drives = drives_of([set_points])
    return simulate_plants(loop_of, plant, ["substeps"], drives, OUTPUTS, single=True)
"""
AT_REST = """
import numpy as np

from pam_envs.plants.core.linearise import Equilibrium


def at_rest(plant, pressure=2e5):
    return Equilibrium(
        lambda state, command: (command - state) / plant.regulator.time_constant,
        lambda state: plant.muscle.area * state,
        np.array([pressure]),
        np.array([pressure]),
        np.array([10.0, 10.0]),
        (("pressure",), ("set_point",), ("force",)),
    )
"""
USE_PLANT = """
import math

import numpy as np
import pytest
from isometric.plant import Isometric
from isometric.rollout import simulate
from pam_envs.plants.core.replay import Stepper, replay_plant

plant = Isometric().replace({"regulator.time_constant": 0.05}).with_lag_alone()
made = simulate(plant, np.full(40, 2e5))
assert made["pressure"][4] == pytest.approx(2e5 * (1.0 - math.exp(-1.0)))
assert np.allclose(made["force"], plant.muscle.area * made["pressure"])
wide = simulate(plant.replace({"muscle.area": 2.0 * plant.muscle.area}), np.full(40, 2e5))
assert np.allclose(wide["force"], 2.0 * made["force"])

leaky = plant.replace({"regulator.leak": 0.5, "pressure.bias": 1e3})
assert leaky.extended and not plant.extended and "regulator.leak" in plant.neutral
command = np.concatenate([np.full(60, 2e5), np.full(30, -1.0)])
shut = simulate(leaky, command)["pressure"]
assert shut[89] == pytest.approx(shut[59] * math.exp(-0.15), rel=1e-6)
shown = replay_plant(leaky, {"set_point": command})["pressure"]
assert np.allclose(shown[1:], shut[:-1] + 1e3)
stepper = Stepper(leaky)
assert [stepper.step(set_point=p)["pressure"] for p in command[:5]] == list(shown[1:6])

leaky.to_yaml("leaky.yaml")
read = Isometric.from_yaml("leaky.yaml")
assert read == leaky and read.digest() == leaky.digest() != plant.digest()
with pytest.raises(ValueError, match="muscle.area"):
    plant.replace({"muscle.area": -1.0})

model = plant.linearise(pressure=1e5)
assert model.poles()[0].real == pytest.approx(-20.0, rel=1e-6)
assert model.dcgain() == pytest.approx(plant.muscle.area, rel=1e-6)
"""
USE_EFFECT = """
import gymnasium as gym
import numpy as np
import pam_envs
from pam_envs.plants import AntagonisticJoint, KneeOrthosis, SingleMuscle
from pam_envs.plants.core.replay import replay_plant

PLANTS = {
    "PAM/MusclePositioning-v0": (SingleMuscle.mas10("none"), "set_point"),
    "PAM/KneeTension-v0": (KneeOrthosis.no_load("none"), "set_point"),
    "PAM/AntagonisticJoint-v0": (AntagonisticJoint.paper("none"), "pressure_a"),
}
for name, (plant, channel) in PLANTS.items():
    print(plant.digest())
    channels = {channel: np.linspace(1e5, 3e5, 20)} | ({"direct": 1.0} if "Joint" in name else {})
    bent = plant.replace({"pressure.cube": 0.5})
    assert bent.extended and not plant.extended
    key = "pressure_a" if "Joint" in name else "pressure"
    plain, shown = (replay_plant(p, channels)[key] for p in (plant, bent))
    off = (shown - plain)[-8:] / plain[-8:] ** 3
    assert plain[-1] > 5e4, plain
    assert off[0] > 0.0 and np.allclose(off / off[0], 1.0), off

    bent.to_yaml("bent.yaml")
    assert "pressure.cube" in open("bent.yaml").read()
    assert type(plant).from_yaml("bent.yaml") == bent

    seen = []
    for draw in ((0.0, 0.0), (0.3, 0.5)):
        env = gym.make(name, plant=plant, randomize={"pressure.cube": draw}, episode_seconds=1.0)
        env.reset(seed=3)
        for _ in range(8):
            info = env.step(np.ones(env.action_space.shape, np.float32))[4]
        seen.append(info["sensor/" + key])
    assert seen[1] > 1.001 * seen[0]
"""


def run(code: str, *paths: Path, folder: Path) -> str:
    """Run code uncompiled with folders first on the path; return what it prints."""
    where = os.pathsep.join(map(str, paths))
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=folder, text=True, capture_output=True, check=False,
        env=os.environ | {"PYTHONPATH": where, "PAM_ENVS_COMPILE": "0"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_plant_is_added_as_one_folder(tmp_path: Path) -> None:
    folder = tmp_path / "isometric"
    folder.mkdir()
    files = {"__init__": "", "rows": ROWS, "plant": PLANT, "rollout": ROLLOUT, "at_rest": AT_REST}
    for name, text in files.items():
        (folder / f"{name}.py").write_text(text)
    run(USE_PLANT, tmp_path, Path(pam_envs.__file__).parents[1], folder=tmp_path)


def test_effect_is_added_in_the_file_of_its_component(tmp_path: Path) -> None:
    package = Path(pam_envs.__file__).parent
    shutil.copytree(
        package, tmp_path / "pam_envs", ignore=shutil.ignore_patterns("__pycache__", "diagnosis")
    )
    sensor = tmp_path / "pam_envs/sensing/sensor.py"
    text = sensor.read_text()
    for old, new in (
        ('        ("bow",),\n', '        ("bow",),\n        ("cube",),\n'),
        ("    bow: float", '    cube: float = effect("1", -1.0, 1.0, "a toy")\n    bow: float'),
        (
            "        shown[j] = value[j]\n",
            "        share = fixed[effects + SENSOR.cube][j]\n"
            "        shown[j] = value[j] + cubic(value[j], full[j], share)\n",
        ),
    ):
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    text += "\n\n@kernel\ndef cubic(x, full, share):\n    return share * x * (x / full) ** 2\n"
    sensor.write_text(text)
    lines = run(USE_EFFECT, tmp_path, folder=tmp_path).split()
    from pam_envs.plants import AntagonisticJoint, KneeOrthosis, SingleMuscle

    plants = (
        SingleMuscle.mas10("none"), KneeOrthosis.no_load("none"), AntagonisticJoint.paper("none"),
    )  # fmt: skip
    assert lines == [plant.digest() for plant in plants]  # plants without it stay the same
