"""Every registered environment, and keyword arguments that reach its branches."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np

import pam_envs  # noqa: F401 (registers)

IDS = sorted(name for name in gym.registry if name.startswith("PAM/"))

VARIANTS: dict[str, dict[str, Any]] = {
    "default": {},
    "preisach": {"hysteresis": "preisach"},
    "none": {"hysteresis": "none", "normalize": False},
    "random": {"randomize": True, "load": None, "reference": "mixed", "load_disturbance": 1.0},
    "preisach_random": {"hysteresis": "preisach", "randomize": True, "reference": "staircase"},
}


def actions_for(space: gym.spaces.Box, steps: int, seed: int = 0) -> np.ndarray:
    """Return held random actions, shape (steps, n)."""
    random = np.random.default_rng(seed)
    held = random.uniform(space.low, space.high, (-(-steps // 5), *space.shape))
    return np.repeat(held, 5, axis=0)[:steps].astype(np.float32)


def trajectory(env: gym.Env, seed: int, steps: int = 60) -> list[str]:
    """Return everything that a fixed drive of an environment gives, to the last bit."""
    observation, info = env.reset(seed=seed)
    lines = [observation.tobytes().hex(), str([v.hex() for v in info.values()])]
    for action in actions_for(env.action_space, steps, seed):
        observation, reward, terminated, truncated, info = env.step(action)
        values = [float(v).hex() for v in (reward, *info.values())]
        lines.append(f"{observation.tobytes().hex()} {values} {terminated} {truncated}")
        if terminated or truncated:
            observation, info = env.reset()
            lines.append(observation.tobytes().hex())
    return lines
