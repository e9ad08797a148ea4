"""Environments and nominal models of a scenario."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium as gym

from benchmarks.scenarios import Scenario

PLANTS = Path(__file__).parent / "scenarios" / "plants"
"""Plants that scenario files name."""


def make_env(env: str, kwargs: Mapping[str, Any]) -> Any:
    """Return the single environment of a scenario; a plant is the name of a file in ``PLANTS``."""
    import pam_envs  # noqa: F401  registers the ids

    given = dict(kwargs)
    if isinstance(given.get("plant"), str):
        given["plant"] = PLANTS / given["plant"]
    return gym.make(env, disable_env_checker=True, **given)


def model_of(env_id: str, scenario: Scenario, env: Any) -> Any:
    """Return the plant that a controller is told: the environment's, or the scenario's model."""
    if not scenario.model:
        return env.unwrapped.plant
    other = make_env(env_id, {**scenario.kwargs, **scenario.model})
    plant = other.unwrapped.plant
    other.close()
    return plant
