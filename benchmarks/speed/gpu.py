"""Batches on a GPU: bits compared with the processor, registers, steps per second."""

import time
from collections.abc import Sequence
from itertools import product
from typing import Any

import gymnasium as gym
import numpy as np

from benchmarks.speed.rates import Chunk, Measurement, Missing, interleaved, median
from pam_envs.__main__ import env_ids
from pam_envs.envs.core.lanes import PARTS, LaneKernel
from pam_envs.envs.device.vector_env import DTYPES

ENVS = ("PAM/MusclePositioning-v0", "PAM/KneeWalk-v0", "PAM/RedundantManipulator-v0")
SIZES = (4_096, 16_384, 65_536, 262_144, 1_048_576)
CALLS = 4_000_000
"""Steps of a timed chunk, at least 20 of each environment."""
TARGETS = {("float64", 262_144): 2e8, ("float32", 262_144): 1e9}
"""Required steps per second of the first environment, by type and number of environments."""
PUBLISHED = {
    "MuJoCo Warp, humanoid, 8,192 worlds, steps per second": (
        2_729_192.0,
        "float32, GPU not named; benchmarks/README.md of google-deepmind/mujoco_warp, 2026",
    ),
    "Brax, MuJoCo's ant, one accelerator: 'millions of simulation steps per second'": (
        None,
        "float32; arXiv:2106.13281, section 1",
    ),
}
"""Figures of other simulators, of other systems: rigid bodies with contacts."""


def gpu(rounds: int, device: str = "cuda", sizes: Sequence[int] = SIZES) -> list[Measurement]:
    """Batches on a GPU: bits, registers, steps per second, published figures beside them."""
    results = []
    for name in env_ids():
        try:
            bits = differing_values(name, device, 4096, 300)
        except (gym.error.DependencyNotInstalled, RuntimeError) as error:
            raise Missing(str(error)) from error
        title = f"{name[4:-3]}, N = 4,096, 300 steps, values that differ from the CPU's"
        results.append(Measurement("gpu", title, bits, "", 0.0, better="less"))
    for name in ENVS:
        for dtype in DTYPES:
            results += registers(name, device, dtype)
    for name in ENVS:
        for dtype, size in product(DTYPES, sizes):
            value = rate(name, device, size, rounds, dtype)
            floor = TARGETS.get((dtype, size)) if name == ENVS[0] else None
            title = f"{name[4:-3]}, {dtype}, N = {size:,}, env-steps per second"
            results.append(Measurement("gpu", title, value, "1/s", floor))
    results += [
        Measurement("gpu", title, value, "1/s", note=note)
        for title, (value, note) in PUBLISHED.items()
    ]
    return results


def differing_values(name: str, device: str, number: int, steps: int) -> int:
    """Return how many values of observations, rewards, flags and info differ from the CPU's."""
    ours: Any = gym.make_vec(name, number, device=device, episode_seconds=1.0)
    theirs: Any = gym.make_vec(name, number, episode_seconds=1.0)
    ours.reset(seed=0)
    theirs.reset(seed=0)
    generator, differing = np.random.default_rng(0), 0
    for _ in range(steps):
        actions = generator.uniform(-1.0, 1.0, theirs.action_space.shape)
        ours.step(actions)
        observation, reward, terminated, truncated, info = theirs.step(actions)
        report = np.array([reward, *(info[key] for key in theirs.setup.info_keys)])
        pairs = (
            (ours.values("observations")[0], observation),
            (ours.values("report")[0], report),
            (ours.values("flags")[:2], np.array([terminated, truncated], np.int8)),
        )
        differing += sum(_differing(a, b) for a, b in pairs)
    return differing


def _differing(a: np.ndarray, b: np.ndarray) -> int:
    """Return in how many values two arrays differ, to the bit."""
    word = f"u{a.itemsize}"
    return int((np.ascontiguousarray(a).view(word) != np.ascontiguousarray(b).view(word)).sum())


def registers(name: str, device: str, dtype: str) -> list[Measurement]:
    """Return registers and bytes of local memory of a thread, as the driver compiled the PTX."""
    envs: Any = gym.make_vec(name, 1, device=device, dtype=dtype)
    results = []
    for part in PARTS:
        found = envs.device.compiled(LaneKernel(envs.setup.kernels, part, dtype)).attributes
        title = f"{name[4:-3]}, {dtype}, {part}"
        results += [
            Measurement("gpu", f"{title}, registers of a thread", found.num_regs, ""),
            Measurement("gpu", f"{title}, local memory of a thread", found.local_size_bytes, "B"),
        ]
    return results


def rate(name: str, device: str, number: int, rounds: int, dtype: str = "float64") -> float:
    """Return steps per second of wall time, with actions on the device and without ``info``."""
    envs: Any = gym.make_vec(name, number, device=device, dtype=dtype, info=False)
    return median(interleaved({"": _stepping(envs)}, min(rounds, 5), time.perf_counter)[""])


def _stepping(envs: Any) -> Chunk:
    """Return a chunk that steps a batch and waits for its last step."""
    generator = np.random.default_rng(0)
    drawn = generator.uniform(-1.0, 1.0, (4, *envs.action_space.shape)).astype(envs.dtype)
    actions = [envs.device.upload(values) for values in drawn]
    envs.reset(seed=0)
    calls = max(20, CALLS // envs.num_envs)

    def chunk() -> int:
        for i in range(calls):
            envs.step(actions[i & 3])
        envs.device.synchronise()
        return calls * int(envs.num_envs)

    return chunk
