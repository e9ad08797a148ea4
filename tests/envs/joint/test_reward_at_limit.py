"""Ending an episode at a limit has a lower return than continuing it."""

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from baselines.core.catalogue import make_controller
from benchmarks.runs.rollout import run
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator

PERIODS = 150
CASES: dict[str, tuple[Any, dict[str, Any]]] = {
    "PAM/AntagonisticJoint-v0": (
        AntagonisticJoint.paper().with_lag_alone(),
        {"reference": "mixed"},
    ),
    "PAM/RedundantManipulator-v0": (
        RedundantManipulator.paper().with_lag_alone(),
        {"reference": "path_2", "path_seconds": 0.6, "rest_seconds": 0.2},
    ),
}
SWING = {"antagonistic_joint": 12, "redundant_manipulator": 25}
"""Periods after which a swing turns that hits the stop."""
EARNED = {f"reward/{term}" for term in ("tracking", "position", "pointing", "effort")}
EVERY = pytest.mark.parametrize("name", CASES)


def make(name: str) -> Any:
    plant, how = CASES[name]
    return gym.make(name, plant=plant, episode_seconds=0.01 * PERIODS, **how).unwrapped


def rewards(env: Any, held: float | None, seed: int = 0) -> tuple[np.ndarray, list[dict]]:
    """Return the rewards under a held action, or swinging between the ends of the range."""
    env.reset(seed=seed)
    given, infos = [], []
    for k in range(PERIODS):
        value = -((-1.0) ** (k // SWING[env.setup.plant.family])) if held is None else held
        action = np.full(env.action_space.shape, value, np.float32)
        _, reward, ended, cut, info = env.step(action)
        given.append(reward)
        infos.append(dict(info))
        if ended or cut:
            break
    return np.array(given), infos


def worth(given: np.ndarray, discount: float) -> float:
    return float(given @ discount ** np.arange(len(given)))


@EVERY
@pytest.mark.parametrize("discount", [1.0, 0.97])
def test_return_of_a_crash_is_below_that_of_no_action_and_of_control(
    name: str, discount: float
) -> None:
    env, plant = make(name), CASES[name][0]
    crash, infos = rewards(env, None)
    assert len(crash) < 100
    assert infos[-1]["margin/angle"] < 0.0
    nothing, _ = rewards(env, 0.0)
    assert len(nothing) == PERIODS
    pid = make_controller("joint_pid", plant, env.signals, env.action_signals)
    signals = run(env, pid, 0).signals
    controlled = sum(signals[key] for key in signals if key.startswith("reward/"))
    assert len(controlled) == PERIODS
    order = [worth(some, discount) for some in (crash, nothing, controlled)]
    assert order == sorted(order)
    assert order[1] < 0.9 * order[2]
    free = [sum(v for k, v in i.items() if k in EARNED) for i in infos]
    if discount == 1.0:
        assert sum(free) > order[1]  # without the term it would have paid


@EVERY
def test_end_at_a_limit_costs_the_worst_reward_of_each_remaining_period(name: str) -> None:
    env = make(name)
    _, infos = rewards(env, None)
    *before, last = infos
    assert all(info["reward/ended"] == 0.0 for info in before)
    left = PERIODS - len(infos) + 1
    worst = -last["reward/ended"] / left
    plant = CASES[name][0]
    if "Joint" in name:
        full = plant.largest_angle + plant.angle_range[1]
        assert worst == pytest.approx(full / 0.01745 + 0.2)
    else:
        assert worst == pytest.approx(2 * 1.5 / 0.02 + 0.5 * 2.0 / 0.03491 + 0.2)
    for held in (-1.0, 1.0, None):
        for info in rewards(env, held, 1)[1]:
            assert -sum(v for k, v in info.items() if k in EARNED) < worst


@EVERY
def test_truncation_costs_nothing(name: str) -> None:
    _, infos = rewards(make(name), 0.0)
    assert len(infos) == PERIODS
    assert infos[-1]["reward/ended"] == 0.0
