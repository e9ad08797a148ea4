"""Speed of planning the joint angles of an arm."""

from __future__ import annotations

import numpy as np

from benchmarks.speed.rates import Measurement, interleaved, median

FLOOR, AIM = 2000.0, 20000.0
"""Poses per CPU second."""
REPEATS = 5
"""Repetitions of each path, there and back."""


def planning(rounds: int) -> list[Measurement]:
    """Joint angles for the poses of the arm's three paths, there and back."""
    from pam_envs.mechanics.redundancy.resolution import resolve
    from pam_envs.mechanics.serial_chain.chain import SerialChain
    from pam_envs.references.path import PATHS

    arm = SerialChain.uniform()
    lines = [np.vstack([path.angles(), path.angles()[::-1]] * REPEATS) for path in PATHS]
    paths = [(arm.pose(line), line[0]) for line in lines]

    def chunk() -> int:
        for poses, start in paths:
            resolve(arm, poses, start=start)
        return sum(len(poses) for poses, _ in paths)

    rate = median(interleaved({"poses": chunk}, rounds)["poses"])
    title = "weighted joint angles of an arm of six, poses per CPU second"
    return [Measurement("planning", title, rate, "1/s", FLOOR, AIM)]
