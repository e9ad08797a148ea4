"""Modules imported by use of the library (import-linter checks the layers)."""

import json
import os
import subprocess
import sys

import pytest

HEAVY = (
    *("torch", "stable_baselines3", "matplotlib", "pygame", "imageio", "onnxruntime"),
    *("joblib", "dask", "distributed", "rich"),
)
"""Packages that only learning, drawing and benchmarks need."""

OURS = ("sweeps", "baselines", "agents", "benchmarks", "tests")
"""Packages that are not in the wheel."""

IMPORT = "import pam_envs"
EPISODE = """
import gymnasium as gym
import pam_envs
env = gym.make("PAM/MusclePositioning-v0")
env.reset(seed=1)
observation, *_ = env.step(env.action_space.sample())
assert env.observation_space.contains(observation)
"""
BATCH = """
import gymnasium as gym
import pam_envs
envs = gym.make_vec(
    "PAM/MusclePositioning-v0", num_envs=3, vectorization_mode="vector_entry_point"
)
envs.reset(seed=1)
observations, *_ = envs.step(envs.action_space.sample())
assert observations.shape[0] == 3
"""


def imported(program: str) -> set[str]:
    """Return the top-level packages that a fresh interpreter holds after a program."""
    script = f"{program}\nimport json, sys\nprint(json.dumps(sorted(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", script],
        capture_output=True,
        text=True,
        check=False,
        env={name: value for name, value in os.environ.items() if name != "PAM_ENVS_COMPILE"},
    )
    assert done.returncode == 0, done.stderr
    return {name.partition(".")[0] for name in json.loads(done.stdout.splitlines()[-1])}


@pytest.mark.parametrize("program", [IMPORT, EPISODE, BATCH], ids=["import", "episode", "batch"])
def test_library_use_imports_no_learning_or_drawing_packages(program):
    loaded = imported(program)
    assert "pam_envs" in loaded
    assert not loaded & {*HEAVY, *OURS}


def test_importing_the_library_does_not_load_the_compiler():
    assert not imported(IMPORT) & {"numba", "llvmlite", "scipy"}
