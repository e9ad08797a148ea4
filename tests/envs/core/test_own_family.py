"""Third-party family of environments: one folder and one scenario file."""

import dataclasses
import importlib
import os
import shutil
import subprocess
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import pam_envs
from benchmarks.__main__ import run
from benchmarks.runs import controllers, rows, runner
from benchmarks.scenarios import scenario
from pam_envs.envs.rendering.scene import view_of
from pam_envs.kernels.build import COMPILED
from tests.envs.cases import check_rows

HERE = Path(__file__).parent
ROOT = HERE.parents[2]
ID = "Own/SpringMuscle-v0"
pytestmark = pytest.mark.skipif(COMPILED, reason="machine code of a toy takes half a minute")


@pytest.fixture(autouse=True)
def family(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Copy the folder and the scenario file to a temporary folder, and register the family."""
    shutil.copytree(HERE / "spring_muscle", tmp_path / "spring_muscle")
    shutil.copy(HERE / "spring_muscle.yaml", tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    assert pam_envs.register_family(importlib.import_module("spring_muscle")) == (ID,)
    monkeypatch.setattr(scenario, "_ADDED", {})
    yield tmp_path
    del gym.registry[ID]
    for name in [n for n in sys.modules if n.partition(".")[0] == "spring_muscle"]:
        del sys.modules[name]


def test_users_environment_passes_the_checkers() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gym.make(ID, render_mode="rgb_array").unwrapped)


def test_rows_of_a_batch_equal_single_environments() -> None:
    arguments = {"episode_seconds": 0.2, "randomize": True}
    batch = gym.make_vec(ID, 5, vectorization_mode="vector_entry_point", **arguments)
    singles = [gym.make(ID, **arguments) for _ in range(5)]
    assert check_rows(batch, dict(enumerate(singles)), 30, 3) > 0


def test_users_view_draws_the_environment_under_its_demonstrator() -> None:
    pytest.importorskip("pygame")
    env = gym.make(ID, render_mode="rgb_array")
    observation, _ = env.reset(seed=1)
    first, policy = env.render(), view_of(env.unwrapped).demonstrator(env.unwrapped)
    for _ in range(100):
        observation, *_, info = env.step(policy(observation))
    assert abs(info["output"] - info["reference"]) < 0.003
    assert np.mean(first != env.render()) > 0.005


def test_harness_scores_its_scenario_file(
    family: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    zero = dataclasses.replace(controllers.find("zero"), envs=())
    monkeypatch.setattr(controllers, "available", lambda: {"zero": zero})
    out, cells = tmp_path / "rows", tmp_path / "cells"
    out.mkdir()
    track = (str(family / "spring_muscle.yaml"),)
    options = runner.Options(jobs=1, out=out, cells=cells)
    assert run(controller=("zero",), track=track, options=options) == 0
    (path,) = rows.files(out)
    row = rows.load(path)
    assert {e["scenario"] for e in row["episodes"]} == {"steps", "sines"}
    assert all(not e["failed"] and e["scores"]["rms_error"] > 0.004 for e in row["episodes"])


def test_other_processes_register_it_by_an_environment_variable(family: Path) -> None:
    code = f"import gymnasium, pam_envs; print(gymnasium.spec({ID!r}).entry_point)"
    variables = {"PAM_ENVS_FAMILIES": "spring_muscle", "PYTHONPATH": f"{family}:{ROOT}"}
    command = [sys.executable, "-c", code]
    env = {**os.environ, **variables}
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "spring_muscle.env:SpringMuscleEnv", done.stderr


def test_package_without_environments_is_refused() -> None:
    with pytest.raises(ValueError, match="declares no ENVIRONMENTS"):
        pam_envs.register_family("pam_envs.envs.core")
