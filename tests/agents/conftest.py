"""Briefly trained models for the tests of learning, which are skipped without torch."""

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

NEEDED = ("torch", "stable_baselines3", "sb3_contrib", "onnx", "onnxruntime")
collect_ignore_glob = [] if all(map(find_spec, NEEDED)) else ["test_*.py"]


@pytest.fixture(scope="session")
def short_run(tmp_path_factory):
    """Return what gives a model of a kind after a moment of training, and its folder."""
    from short_runs import kind, trained

    made: dict[str, tuple[Any, Path]] = {}

    def run(name: str) -> tuple[Any, Path]:
        if name not in made:
            folder = tmp_path_factory.mktemp(name)
            made[name] = trained(folder, kind(name)), folder
        return made[name]

    return run


@pytest.fixture(scope="session")
def ppo(short_run):
    """Return the preset's network after a moment of training, and its folder."""
    return short_run("ppo")


@pytest.fixture(scope="session")
def normalized_ppo(tmp_path_factory):
    """Return a plain network with a normalised observation, and its folder."""
    from short_runs import tiny, trained

    folder = tmp_path_factory.mktemp("normalized")
    network = {"hidden": [16, 16], "activation": "elu"}
    config = tiny(network=network, normalize={"observation": True, "reward": True})
    return trained(folder, config), folder


@pytest.fixture(scope="session")
def sac(short_run):
    """Return SAC after a moment of training, and its folder."""
    return short_run("sac")
