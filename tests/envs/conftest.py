"""Tests of environments with common machine code run in one process, which compiles it once."""

import gymnasium as gym
import pytest

import pam_envs  # noqa: F401 (registers)


@pytest.hookimpl(tryfirst=True)  # before xdist reads the groups
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Group tests with the id of an environment among their arguments by its module."""
    for item in items:
        name = str(getattr(getattr(item, "callspec", None), "params", {}).get("name", ""))
        if name in gym.registry:
            module = str(gym.spec(name).entry_point).partition(":")[0]
            item.add_marker(pytest.mark.xdist_group(module))
