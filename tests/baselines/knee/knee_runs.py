"""Environments of the knee, controllers for them, and recorded episodes."""

from __future__ import annotations

from functools import cache
from typing import Any

import gymnasium as gym
import numpy as np

import pam_envs  # noqa: F401  registers the ids
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from tests.baselines.conftest import built

PROMPT = {"regulator.time_constant": 2e-3}


def quiet(mounting: str, hysteresis: str = "maxwell_slip", prompt: bool = False) -> KneeOrthosis:
    """Return a plant without noise; ``prompt``: whose regulator hardly lags."""
    made = getattr(KneeOrthosis, mounting)(hysteresis=hysteresis).without_noise()
    return made.replace(PROMPT) if prompt else made


def make_knee(name: str, **arguments: Any) -> Any:
    """Return an environment of the knee."""
    return gym.make(f"PAM/{name}-v0", disable_env_checker=True, **arguments).unwrapped


def run(env: Any, controller: Any, seed: int = 1) -> dict[str, np.ndarray]:
    """Return the recorded info of one episode, and the set-points."""
    observation, _ = env.reset(seed=seed)
    state, over, rows, actions = None, False, [], []
    while not over:
        action, state = controller.predict(observation, state, state is None)
        observation, _, terminated, truncated, info = env.step(action)
        over = terminated or truncated
        rows.append(dict(info))
        actions.append(action)
    record = {key: np.array([row[key] for row in rows]) for key in rows[0]}
    signal = env.action_signals["pressure_set_point"]
    return record | {"set_point": signal.decode(np.array(actions))}


@cache
def walked(name: str, mismatch: float) -> dict[str, np.ndarray]:
    """Return two strides and a bit from heel contact, without noise."""
    plant = quiet("on_leg")
    env = make_knee(
        "KneeWalk", plant=plant, mismatch=mismatch, start="heel_contact", episode_seconds=6.0
    )
    return run(env, built(name, env))
