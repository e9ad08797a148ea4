"""Plants, environments and rollouts for the controllers' tests."""

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import pam_envs  # noqa: F401  registers the ids
from baselines.core.catalogue import make_controller
from baselines.core.controller import Controller
from baselines.core.entry import Spec
from pam_envs.plants.single_muscle.plant import SingleMuscle

HOLD = 90
"""Control periods for which each level of the staircase is held."""
SECONDS = 13 * HOLD / 100
ID = "PAM/MusclePositioning-v0"
QUIET = {
    "position.noise": 0.0,
    "position.resolution": 0.0,
    "pressure.noise": 0.0,
    "pressure.resolution": 0.0,
}
PROMPT = {"regulator.dead_time": 0.0, "regulator.time_constant": 0.002, "regulator.slew_rate": 1e9}


def quiet(hysteresis: str, **changes: float) -> SingleMuscle:
    """Return the stock muscle with ideal sensors and a regulator without delay."""
    plant = SingleMuscle.mas10(hysteresis)
    return plant.replace(
        {**QUIET, **PROMPT, **{k.replace("__", "."): v for k, v in changes.items()}}
    )


def make_env(env: str = ID, **arguments: Any) -> Any:
    return gym.make(env, disable_env_checker=True, **arguments).unwrapped


def spec_of(env: Any) -> Spec[Any]:
    return Spec(env.plant, env.signals, env.action_signals)


def built(name: str, env: Any, plant: Any = None, seed: int = 0, **knobs: float) -> Any:
    model = env.plant if plant is None else plant
    return make_controller(name, model, env.signals, env.action_signals, seed, knobs)


def last_state(env: Any, controller: Controller, seed: int = 1) -> tuple[Any, dict[str, Any]]:
    """Return the controller's state and the info at the end of an episode."""
    observation, info = env.reset(seed=seed)
    state, over = None, False
    while not over:
        action, state = controller.predict(observation, state, state is None)
        observation, _, _, over, info = env.step(action)
    return state, info


def rollout(env: Any, controller: Controller) -> dict[str, np.ndarray]:
    """Return the recorded info of one whole episode, and the first action's command [SI]."""
    observation, _ = env.reset(seed=1)
    state, over, rows = None, False, []
    while not over:
        action, state = controller.predict(observation, state, state is None)
        observation, _, terminated, over, info = env.step(action)
        assert not terminated
        signal = next(iter(env.action_signals))
        rows.append({**info, "command": signal.decode(action)})
    return {key: np.array([row[key] for row in rows]) for key in rows[0]}


def rms(error: np.ndarray) -> float:
    return float(np.sqrt(np.mean(error**2)))


def observations_of(env: Any, steps: int = 40, rows: int = 4) -> np.ndarray:
    """Return observations of shape (steps, rows, n_obs): rows with other loads and references."""
    seen = []
    for row in range(rows):
        seen.append([env.reset(seed=row)[0]])
        for k in range(steps - 1):
            action = np.sin(0.3 * k + row + np.arange(len(env.action_signals))).astype("f4")
            seen[-1].append(env.step(action)[0])
    return np.array(seen).swapaxes(0, 1)


@pytest.fixture
def staircase():
    """Held levels [m], up, part of the way down, up again and down: inner loops included."""
    levels = [2, 4, 7, 10, 12, 9, 11, 6, 8, 7, 3, 5, 4]
    return np.repeat(np.array(levels) * 1e-3, HOLD)


@pytest.fixture
def settled():
    """Errors [m] late on each level of the staircase, before a preview shows the next one."""

    def errors(record: dict[str, np.ndarray]) -> np.ndarray:
        ends = np.arange(HOLD - 25, len(record["output"]), HOLD)
        return np.asarray(np.abs(record["output"] - record["reference"])[ends])

    return errors
