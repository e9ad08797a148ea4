"""Exported models, one environment of each family; ``python -m benchmarks export`` has all."""

from typing import Any, NamedTuple

import gymnasium as gym
import pytest

from benchmarks.exported import drive, expected
from pam_envs.arrays import Array
from pam_envs.export.command import model_of
from pam_envs.export.model import Model
from pam_envs.kernels.build import COMPILED

FAMILIES = (
    "PAM/MusclePositioning-v0",
    "PAM/AntagonisticJoint-v0",
    "PAM/ElbowOrthosis-v0",
    "PAM/KneeTension-v0",
    "PAM/KneeWalk-v0",
    "PAM/RedundantManipulator-v0",
)
SMALL = FAMILIES[0]
if not COMPILED:
    collect_ignore_glob = ["test_*.py"]


class Case(NamedTuple):
    """A model, random actions, and the outputs of Python."""

    model: Model
    actions: Array
    reference: Array


@pytest.fixture(scope="session", params=FAMILIES)
def case(request: pytest.FixtureRequest) -> Case:
    """Return each environment."""
    return _case(request.param)


@pytest.fixture(scope="session")
def small() -> Case:
    """Return the smallest environment."""
    return _case(SMALL)


_CASES: dict[str, Case] = {}


def _case(name: str) -> Case:
    if name not in _CASES:
        env: Any = gym.make(name).unwrapped
        actions = drive(env)
        _CASES[name] = Case(model_of(name), actions, expected(env, actions))
    return _CASES[name]
