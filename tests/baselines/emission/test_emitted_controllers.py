"""Controllers in C: 1,000 actions compared with Python; refusals."""

import dataclasses
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from baselines.core.catalogue import make_controller
from baselines.emission.catalogue import controller_model
from benchmarks.exported import differing, run_c
from pam_envs.arrays import Array
from pam_envs.export.c import export_c
from pam_envs.export.toolchain import host_platform
from pam_envs.kernels.build import COMPILED

pytestmark = pytest.mark.skipif(not COMPILED, reason="the kernels are compiled")
STEPS = 1000
MUSCLE, WALK, TENSION = "PAM/MusclePositioning-v0", "PAM/KneeWalk-v0", "PAM/KneeTension-v0"
CASES = (
    ("pid", MUSCLE),
    ("inverse_no_preview", MUSCLE),
    ("inverse", MUSCLE),
    ("inverse_pid", MUSCLE),
    ("knee_pid", WALK),
    ("knee_line", WALK),
    ("knee_inverse_ahead", WALK),
    ("knee_ltr", WALK),
    ("knee_inverse_ahead_ltr", WALK),
    ("knee_inverse_ltr_bumpy", WALK),
    ("knee_inverse_ltr", TENSION),
    ("knee_inverse_ltr", "PAM/KneeStiffness-v0"),
)


def closed_loop(controller: Any, env: Any, steps: int = STEPS) -> tuple[Array, Array]:
    """Return observations and actions of an episode, shapes (steps, n)."""
    observation, _ = env.reset(seed=3)
    state, start = None, True
    seen, acted = [], []
    for _ in range(steps):
        action, state = controller.predict(observation, state, start)
        seen.append(observation)
        acted.append(action)
        observation, _, terminated, truncated, _ = env.step(action)
        start = bool(terminated or truncated)
        assert not start or len(seen) == steps
    return np.array(seen, float), np.array(acted, float)


def made(name: str, env_id: str, **arguments: Any) -> tuple[Any, Any]:
    env: Any = gym.make(env_id, episode_seconds=60.0, **arguments).unwrapped
    return make_controller(name, env.plant, env.signals, env.action_signals), env


def in_c(name: str, controller: Any, env: Any, folder: Path, observations: Array) -> Array:
    model = controller_model(name, controller, env.signals, env.action_signals, env.control_period)
    export_c(model, folder, [host_platform()])
    return run_c(model, folder, observations)


@pytest.mark.parametrize(("name", "env_id"), CASES)
def test_thousand_actions_in_c_are_those_of_python(name: str, env_id: str, tmp_path: Path) -> None:
    controller, env = made(name, env_id)
    observations, actions = closed_loop(controller, env)
    found = in_c(name, controller, env, tmp_path, observations)
    spacing = np.spacing(np.maximum(np.abs(actions), 1e-3).astype(np.float32)).astype(float)
    assert np.all(np.abs(found - actions) <= spacing)
    assert np.ptp(actions) > 0.1  # the loop moves
    if name == "pid":
        assert differing(found, actions) == 0


def test_controller_in_si_reads_and_writes_si(tmp_path: Path) -> None:
    controller, env = made("pid", MUSCLE, normalize=False)
    observations, actions = closed_loop(controller, env)
    assert actions.max() > 1e5  # Pa
    assert differing(in_c("pid", controller, env, tmp_path, observations), actions) == 0


def test_hysteresis_with_curves_is_inverted_too(tmp_path: Path) -> None:
    controller, env = made("inverse", MUSCLE, hysteresis="preisach")
    observations, actions = closed_loop(controller, env)
    found = in_c("inverse", controller, env, tmp_path, observations)
    assert np.abs(found - actions).max() <= 1.2e-7


def test_another_plant_gives_another_controller(tmp_path: Path) -> None:
    controller, env = made("inverse", MUSCLE)
    observations, actions = closed_loop(controller, env, 200)
    wrong = env.plant.replace({"muscle.area": 1.02 * env.plant.muscle.area})
    other = make_controller("inverse", wrong, env.signals, env.action_signals)
    assert np.abs(in_c("inverse", other, env, tmp_path, observations) - actions).max() > 1e-3


def test_nominal_plant_with_effects_is_refused() -> None:
    env: Any = gym.make(MUSCLE).unwrapped
    plant = env.plant.replace({"muscle.creep_2": 0.1})
    controller = make_controller("inverse", plant, env.signals, env.action_signals)
    with pytest.raises(ValueError, match="and effects is not exported; give a nominal plant"):
        controller_model("inverse", controller, env.signals, env.action_signals, 0.01)


def test_pressure_driven_hysteresis_is_refused() -> None:
    env: Any = gym.make(MUSCLE, hysteresis="maxwell_slip", hysteresis_drive="pressure").unwrapped
    controller = make_controller("inverse", env.plant, env.signals, env.action_signals)
    with pytest.raises(ValueError, match="hysteresis 'maxwell_slip' is not exported"):
        controller_model("inverse", controller, env.signals, env.action_signals, 0.01)


def test_controller_without_kernel_is_refused() -> None:
    controller, env = made("table", MUSCLE)
    with pytest.raises(ValueError, match=r"table \(TwoBranch\) cannot be exported; these can"):
        controller_model("table", controller, env.signals, env.action_signals, 0.01)


def test_design_is_data_of_one_kernel() -> None:
    kernels = set()
    for name in ("inverse", "inverse_pid"):
        controller, env = made(name, MUSCLE)
        model = controller_model(name, controller, env.signals, env.action_signals, 0.01)
        kernels.add(dataclasses.astuple(model.kernels["kernel"])[0])  # type: ignore[call-overload]
    assert kernels == {"inverse"}
