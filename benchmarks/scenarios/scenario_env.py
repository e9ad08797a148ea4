"""Environments and nominal models of a scenario.

A scenario names only a registered environment and plants of this checkout, since its file may be
third-party; ``gymnasium.make`` would import the module before a colon.
"""

import hashlib
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from benchmarks.scenarios.scenario import Scenario
from pam_envs.envs.core.step import MEMBER

PLANTS = Path(__file__).parent / "plants"
"""Folder of the plants that scenario files name."""
_ID = re.compile(r"[A-Za-z0-9_]+/[A-Za-z0-9_]+-v[0-9]+")
_PLANT = re.compile(r"[A-Za-z0-9_]+\.yaml")


def make_env(env: str, kwargs: Mapping[str, Any]) -> Any:
    """Return the single environment of a scenario; a plant is the name of a file in ``PLANTS``."""
    return gym.make(_checked(env), disable_env_checker=True, **_arguments(kwargs))


def make_batch(env: str, kwargs: Mapping[str, Any], rows: int) -> Any:
    """Return the batched environment of a scenario; see :func:`make_env`."""
    mode = "vector_entry_point"
    return gym.make_vec(_checked(env), rows, vectorization_mode=mode, **_arguments(kwargs))


def _checked(env: str) -> str:
    import pam_envs  # noqa: F401  registers the ids

    if not _ID.fullmatch(env) or env not in gym.registry:
        raise ValueError(
            f"{env!r} is no environment of this package; give one like PAM/NAME-v0, or register "
            "its family with pam_envs.register_family"
        )
    return env


def _arguments(kwargs: Mapping[str, Any]) -> dict[str, Any]:
    """Return a scenario's arguments with the file of its plant in place of the file's name."""
    given = dict(kwargs)
    if isinstance(given.get("plant"), str):
        given["plant"] = plant_file(given["plant"])
    return given


def plant_file(name: str) -> Path:
    """Return the file of a plant that a scenario names; refuse a name that may hold a folder."""
    if not _PLANT.fullmatch(name):
        raise ValueError(f"plant {name!r} is not the mere name of a file, like arm.yaml")
    return PLANTS / name


def plant_digests(scenario: Scenario) -> dict[str, str]:
    """Return the SHA-256 of the plant files that a scenario and its model name."""
    named = (given.get("plant") for given in (scenario.kwargs, scenario.model))
    files = {name: plant_file(name) for name in named if isinstance(name, str)}
    return {name: hashlib.sha256(file.read_bytes()).hexdigest() for name, file in files.items()}


def drawn_plant(env: Any) -> Any:
    """Return the plant of the present episode of a single environment, with drawn parameters.

    Raises
    ------
    ValueError
        If the plant with these parameters is another one than that of the environment.
    """
    base = env.unwrapped
    state, setup = base.get_state(), base.setup
    column = state["fixed"][0, :, 0]
    member = setup.plant.members()[int(state["counts"][0, MEMBER, 0])]
    own = member.parameter_rows()
    values = {
        name: float(value)
        for name, value, usual in zip(member.names, column, own, strict=False)
        if value != usual
    }
    plant = member.replace(values)
    if not np.array_equal(plant.parameter_rows(), column):
        raise ValueError(
            f"{type(plant).__name__}: the drawn parameters {', '.join(values)} do not make the "
            "plant of the episode; a parameter is derived from another one"
        )
    return plant


def model_of(env_id: str, scenario: Scenario, env: Any) -> Any:
    """Return the nominal model of controllers: the environment's plant, or the scenario's model."""
    if not scenario.model:
        return env.unwrapped.plant
    other = make_env(env_id, {**scenario.kwargs, **scenario.model})
    plant = other.unwrapped.plant
    other.close()
    return plant
