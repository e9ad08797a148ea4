"""Replay and single steps of every plant: readings equal those of its rollout."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.core.replay import Stepper, replay_plant
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.knee_orthosis.rollout import simulate_knee
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from pam_envs.plants.single_muscle.plant import SingleMuscle

RAMP = np.linspace(0.0, 1.0, 20)
CASES: dict[str, tuple[Any, dict[str, Any], str]] = {
    "single_muscle": (SingleMuscle.mas10("none"), {"set_point": 3e5 * RAMP}, "contraction"),
    "knee_orthosis": (KneeOrthosis.no_load("none"), {"set_point": 3e5 * RAMP}, "angle"),
    "antagonistic_joint": (AntagonisticJoint.paper("none"), {"command": 0.2 * RAMP}, "angle"),
    "elbow_orthosis": (
        ElbowOrthosis.paper("none"),
        {"command_a": 1e5, "command_b": 2e5 + 2e5 * RAMP, "start_a": 1e5, "start_b": 2e5},
        "angle",
    ),
    "redundant_manipulator": (
        RedundantManipulator.paper("none"),
        {f"command_{k}": 0.1 * RAMP for k in range(6)},
        "angle_0",
    ),
}
EVERY = pytest.mark.parametrize("name", CASES)


@EVERY
def test_bias_and_drift_of_a_sensor_show_in_the_replay(name: str) -> None:
    plant, channels, key = CASES[name]
    sensor = "position" if name == "single_muscle" else "angle"
    off = plant.replace({f"{sensor}.bias": 0.01, f"{sensor}.drift": 0.001})
    plain, shown = (replay_plant(p, channels)[key] for p in (plant, off))
    assert np.allclose(shown - plain, 0.01 + 1e-5 * np.arange(20), rtol=1e-3)
    assert plain[-1] != plain[0]


@EVERY
def test_steps_give_the_readings_of_the_replay(name: str) -> None:
    plant, channels, _ = CASES[name]
    plant = plant.replace({"regulator.leak": 0.5})
    replayed, stepper = replay_plant(plant, channels), Stepper(plant)
    for k in range(19):
        now = {n: float(np.broadcast_to(v, 20)[k]) for n, v in channels.items()}
        read = stepper.step(**now)
        for sensor, values in replayed.items():
            assert read[sensor] == values[k + 1], sensor


@EVERY
def test_unknown_channel_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match="there are"):
        replay_plant(CASES[name][0], {"wind": 1.0})


def test_replay_of_the_knee_follows_its_rollout() -> None:
    plant, channels, _ = CASES["knee_orthosis"]
    made = simulate_knee(plant, channels["set_point"])
    shown = replay_plant(plant, channels)
    assert np.allclose(shown["angle"][1:], made["angle"][:-1], atol=1e-9)
    assert np.allclose(shown["tension"][1:], made["tension"][:-1], atol=1e-6)
