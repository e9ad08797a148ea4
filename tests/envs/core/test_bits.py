"""Equal bits of one environment, rows of any batch, compiled and uncompiled."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from pam_envs.kernels.build import COMPILED
from tests.envs.cases import CASES, IDS, SHARED, VARIANTS, actions_for, check_rows, trajectory

ROOT = Path(__file__).resolve().parents[3]
EVERY = pytest.mark.parametrize("name", IDS)
SIZES = (1, 2, 7, 64, 256) if COMPILED else (1, 7)
TILED = ["PAM/MusclePositioning-v0", "PAM/KneeStairsDown-v0", "PAM/AntagonisticJoint-v0"]
"""Whose tiles are spread over two cores here: the loop over tiles is the same code for all, and to
compile it takes a minute for each of the others, three for the arm."""
SECONDS, STEPS = (0.3, 70) if COMPILED else (0.1, 21)
"""Of an episode, and how many are taken. Plain Python takes a few hundred times as long."""


def batch(name: str, number: int, **arguments: object) -> gym.vector.VectorEnv:
    return gym.make_vec(name, number, vectorization_mode="vector_entry_point", **arguments)


@pytest.mark.parametrize(("name", "variant"), CASES)
@pytest.mark.parametrize("number", SIZES)
def test_rows_of_a_batch_are_single_environments(name: str, variant: str, number: int) -> None:
    arguments = {"episode_seconds": SECONDS, **VARIANTS[name][variant]}
    envs = batch(name, number, **arguments)
    rows = sorted({0, number // 2, number - 1})
    singles = {i: gym.make(name, **arguments) for i in rows}
    assert check_rows(envs, singles, STEPS, 17) >= len(rows) * 2


@pytest.mark.parametrize("name", TILED)
@pytest.mark.skipif(not COMPILED, reason="compares with the compiled kernels")
def test_two_cores_give_the_same_bits_as_one(name: str) -> None:
    number = 4096
    one = batch(name, number, threads=1, episode_seconds=0.2)
    two = batch(name, number, episode_seconds=0.2)
    assert one._kernel is not two._kernel
    one.reset(seed=3)
    two.reset(seed=3)
    for actions in actions_for(one.action_space, 30, 4):
        a, b = one.step(actions), two.step(actions)
        assert all(np.array_equal(x, y) for x, y in zip(a[:4], b[:4], strict=True))
        assert all(np.array_equal(a[4][k], b[4][k]) for k in a[4] if "final" not in k)


@EVERY
def test_restored_batch_continues_with_equal_bits(name: str) -> None:
    number, seconds, at = (40, 0.2, 25) if COMPILED else (6, 0.05, 6)
    envs = batch(name, number, episode_seconds=seconds)
    drive = actions_for(envs.action_space, 60 if COMPILED else 14, 5)
    envs.reset(seed=0)
    for actions in drive[:at]:
        envs.step(actions)
    state = envs.get_state()
    after = [envs.step(a)[0].tobytes() for a in drive[at:]]
    assert len(set(after)) == len(after)
    envs.set_state(state)
    assert [envs.step(a)[0].tobytes() for a in drive[at:]] == after
    fresh = batch(name, number, episode_seconds=seconds)
    fresh.set_state(state)
    assert [fresh.step(a)[0].tobytes() for a in drive[at:]] == after


@EVERY
def test_masked_reset_changes_no_other_row(name: str) -> None:
    envs, kept = batch(name, 5), batch(name, 5)
    envs.reset(seed=9)
    kept.reset(seed=9)
    drive = actions_for(envs.action_space, 20 if COMPILED else 10, 6)
    half = len(drive) // 2
    for actions in drive[:half]:
        envs.step(actions)
        kept.step(actions)
    mask = np.array([False, True, False, False, True])
    before = envs._last_observation.copy()
    observations, infos = envs.reset(options={"reset_mask": mask})
    assert np.array_equal(observations[~mask], before[~mask])
    assert (infos["time"][mask] == 0.0).all()
    for actions in drive[half:]:
        a, b = envs.step(actions)[0], kept.step(actions)[0]
        assert np.array_equal(a[~mask], b[~mask])
    single = gym.make(name)
    single.reset(seed=9 + 1)
    assert np.array_equal(single.reset()[0], observations[1])
    with pytest.raises(ValueError, match="reset_mask"):
        envs.reset(options={"reset_mask": [True]})


def digest() -> str:
    """Return a hash over the trajectories of every environment and variant."""
    lines = []
    for name, variant in SHARED:
        env = gym.make(name, episode_seconds=0.7, **VARIANTS[name][variant])
        lines.append(f"{name} {variant} {trajectory(env, 23, 90)}")
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


@pytest.mark.parametrize("compile_kernels", ["0", "wait"] if COMPILED else ["0"])
def test_other_processes_and_plain_python_give_the_same_bits(compile_kernels: str) -> None:
    code = "from tests.envs.core.test_bits import digest; print(digest())"
    run = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PAM_ENVS_COMPILE": compile_kernels, "PYTHONPATH": str(ROOT)},
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert run.stdout.strip() == digest()
