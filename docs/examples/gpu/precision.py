"""Measure the error of float32 in a batch on a device: the same seeds and actions in float64."""

import argparse
import re
from collections import Counter
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

import pam_envs  # noqa: F401  registers the environments
from pam_envs.envs.core.lanes import PARTS, LaneKernel

OUTPUTS = {
    "PAM/MusclePositioning-v0": ("contraction", "m"),
    "PAM/AntagonisticJoint-v0": ("angle", "rad"),
    "PAM/KneeTension-v0": ("tension", "N"),
    "PAM/KneeWalk-v0": ("tension", "N"),
    "PAM/ElbowOrthosis-v0": ("angle", "rad"),
    "PAM/RedundantManipulator-v0": ("angle_0", "rad"),
}
"""Controlled quantity of each environment and its unit; of the elbow orthosis, whose torque has no
sensor, the angle."""
OPERATION = re.compile(r"\b(?:add|sub|mul|div|rcp|sqrt|fma)\.[\w.]*(f32|f64)\b")
"""Arithmetic in PTX."""


class Comparison:
    """Differences between a batch in float32 and one in float64."""

    def __init__(self, name: str, device: str, number: int, seconds: float) -> None:
        self.output = OUTPUTS[name][0]
        self.both: list[Any] = [
            gym.make_vec(name, number, device=device, dtype=t, episode_seconds=seconds)
            for t in ("float32", "float64")
        ]
        self.resets, self.differing_resets = 0, 0
        self.errors: dict[str, list[NDArray[Any]]] = {"output": [], "reading": [], "reward": []}
        self.noise: list[NDArray[Any]] = []

    def run(self, steps: int, seed: int = 0) -> None:
        """Reset both batches and apply the same drawn actions."""
        generator = np.random.default_rng(seed)
        for envs in self.both:
            envs.reset(seed=seed)
        for _ in range(steps):
            actions = generator.uniform(-1.0, 1.0, self.both[0].action_space.shape)
            for envs in self.both:
                envs.step(actions)
            self._compare()

    def _compare(self) -> None:
        flags, exact_flags = (envs.values("flags") for envs in self.both)
        self.resets += int(exact_flags[2].sum())
        self.differing_resets += int((flags != exact_flags).any(axis=0).sum())
        single, exact = (self._values(envs) for envs in self.both)
        for key, found in self.errors.items():
            found.append(single[key] - exact[key])
        self.noise.append(exact["reading"] - exact["output"])

    def _values(self, envs: Any) -> dict[str, NDArray[Any]]:
        report, keys = envs.values("report")[0].astype(float), envs.setup.info_keys
        return {
            "output": report[1 + keys.index(f"state/{self.output}")],
            "reading": report[1 + keys.index(f"sensor/{self.output}")],
            "reward": report[0],
        }

    def rms(self, key: str) -> float:
        """Return the RMS error of "output", "reading" or "reward"."""
        return float(np.sqrt(np.mean(np.square(self.errors[key]))))

    def largest(self, key: str) -> float:
        """Return the largest error."""
        return float(np.abs(self.errors[key]).max())

    def sensor_noise(self) -> float:
        """Return the standard deviation of the reading's error, with resolution, of float64."""
        return float(np.std(self.noise))


def ptx_of(name: str, dtype: str, part: str) -> str:
    """Return the PTX of the step or the restart of an environment."""
    kernels = gym.make(name).unwrapped.setup.kernels  # type: ignore[attr-defined]
    return LaneKernel(kernels, part, dtype).ptx("kernel").decode()


def operations(ptx: str) -> Counter[str]:
    """Count arithmetic operations by their type."""
    return Counter(OPERATION.findall(ptx))


def main() -> None:
    """Print errors, resets and operations of each environment."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("env", nargs="*", default=list(OUTPUTS))
    parser.add_argument("--device", default="cuda")
    parser.add_argument("--num-envs", type=int, default=64)
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--episode-seconds", type=float, default=2.0)
    given = parser.parse_args()
    for name in given.env:
        unit = OUTPUTS[name][1]
        try:
            pair = Comparison(name, given.device, given.num_envs, given.episode_seconds)
        except (gym.error.DependencyNotInstalled, RuntimeError) as error:
            parser.exit(1, f"{error}\n")
        pair.run(given.steps)
        noise = pair.sensor_noise()
        print(f"{name}: {given.steps} steps of {given.num_envs} environments")
        print(f"  sensor noise {noise:.1e} {unit}")
        for key, scale, of in (
            ("output", noise, unit),
            ("reading", noise, unit),
            ("reward", 1, ""),
        ):
            rms, most = pair.rms(key), pair.largest(key)
            shares = f" ({rms / scale:.1e} and {most / scale:.1e} of the noise)" if of else ""
            print(f"  {key}: RMS {rms:.1e} {of}, largest {most:.1e} {of}{shares}")
        print(f"  {pair.resets} resets, {pair.differing_resets} of them differ")
        for part in PARTS:
            found = operations(ptx_of(name, "float32", part))
            total = operations(ptx_of(name, "float64", part)).total()
            print(f"  {part}: {found['f64']} of {found.total()} operations in float64 ({total})")


if __name__ == "__main__":
    main()
