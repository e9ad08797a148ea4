"""Figures of the manipulator's path planning (fluidic_muscles, section 2).

The paper shows two plans of one path; its only number is the limit of 30 degrees. The expected
values were computed by an independent program for three paths. The ends of one path are known; the
other two paths were chosen to have the expected peaks, which are therefore inputs and not judged.
Freely drawn paths show the effect of the weight without any fit.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from baselines.manipulator.redundancy import Comparison, compare
from benchmarks.papers.published import Group, Values
from pam_envs.arrays import Array
from pam_envs.envs.manipulator.paths import LEAP
from pam_envs.mechanics.redundancy.resolution import LIMIT
from pam_envs.mechanics.serial_chain.chain import SerialChain
from pam_envs.references.path import PATHS, POINTS, PathEnds, draw_ends, joint_line

KNOWN, OURS = "predicted; ends known", "calibrated: ends drawn for these peaks"
UNWEIGHTED = {"path_1": 34.2, "path_2": 33.2, "path_3": 37.12}
WEIGHTED = {"path_1": 27.6, "path_2": 26.2, "path_3": 27.77}
"""Largest angle of a joint [degrees] in each plan."""
HELD_OUT = 500
"""Freely drawn paths."""


@lru_cache(maxsize=1)
def arm() -> SerialChain:
    """Return the six-joint arm: axes x-y-x-y-x-y, links of 0.25 m."""
    return SerialChain.uniform()


@lru_cache(maxsize=8)
def plans(path: PathEnds) -> Comparison:
    """Return both plans of a path, started from its first angles."""
    line = path.angles()
    return compare(arm(), arm().pose(line), start=line[0])


def straight_poses(path: PathEnds) -> Array:
    """Return the poses of a straight line of the tip between the ends of a path, shape (41, 6).

    The direction turns at a constant rate in the plane of the directions at both ends.
    """
    first, last = arm().pose(path.angles()[[0, -1]])
    share = np.linspace(0.0, 1.0, POINTS)[:, None]
    whole = np.arccos(first[3:] @ last[3:])
    turned = np.sin((1.0 - share) * whole) * first[3:] + np.sin(share * whole) * last[3:]
    return np.hstack([first[:3] + share * (last[:3] - first[:3]), turned / np.sin(whole)])


def peaks() -> Values:
    """Largest angle of a joint on each path, without and with the weight (2.1)."""
    for path in PATHS:
        both = plans(path)
        for name, expected, plan in (
            ("unweighted", UNWEIGHTED, both.unweighted),
            ("weighted", WEIGHTED, both.weighted),
        ):
            known = _about(path) | {"expected": expected[path.name]}
            yield f"{{path}}, {name}: largest angle", float(np.rad2deg(plan.peak)), known


def _about(path: PathEnds) -> dict[str, Any]:
    """Return name and origin of a path; a calibrated one is an input."""
    origin = OURS if path.calibrated else KNOWN
    return {"path": path.name, "origin": origin, "given": path.calibrated}


@dataclass(frozen=True)
class HeldOut:
    """Statistics of freely drawn paths, as shares of all.

    On a ``crossed`` path a joint exceeds 30 degrees, on a ``leapt`` one the plan jumps between
    solution branches; ``iterations`` is the largest of the medians of the weighted plans.
    """

    paths: int
    crossed: float
    crossed_weighted: float
    leapt: float
    leapt_weighted: float
    iterations: float


@lru_cache(maxsize=4)
def held_out(number: int = HELD_OUT, seed: int = 0) -> HeldOut:
    """Return the statistics of freely drawn paths with both ends within 27 degrees a joint.

    Short and nearly straight paths are not drawn; no drawn path is excluded.
    """
    counts, most = np.zeros(4), 0.0
    for first, last in zip(*draw_ends(seed, number, arm().stages, LIMIT), strict=True):
        line = joint_line(first, last)
        both = compare(arm(), arm().pose(line), start=line[0])
        leap = LEAP * float(np.max(np.abs(last - first))) / (POINTS - 1)
        pair = (both.unweighted, both.weighted)
        counts += [not plan.within_limits for plan in pair] + [p.longest_step > leap for p in pair]
        most = max(most, float(np.median(both.weighted.iterations)))
    crossed, crossed_weighted, leapt, leapt_weighted = (counts / number).tolist()
    return HeldOut(number, crossed, crossed_weighted, leapt, leapt_weighted, most)


def drawn_lines() -> Values:
    """Share of freely drawn paths on which joints exceed their limit or the plan changes branch."""
    found = held_out()
    of = {"paths": found.paths}
    yield "drawn paths, unweighted: past 30 degrees", 100.0 * found.crossed, of
    yield "drawn paths, weighted: past 30 degrees", 100.0 * found.crossed_weighted, of
    yield "drawn paths, unweighted: the plan leaps", 100.0 * found.leapt, of
    yield "drawn paths, weighted: the plan leaps", 100.0 * found.leapt_weighted, of
    yield "drawn paths, weighted: largest median of iterations", found.iterations, of


def other_reading() -> Values:
    """Largest angles of path_3 if its ends were those of a straight line of tip and direction."""
    path = PATHS[-1]
    both = compare(arm(), straight_poses(path), start=path.angles()[0])
    name = "path_3 as a straight line of the tip"
    yield f"{name}, unweighted", float(np.rad2deg(both.unweighted.peak))
    yield f"{name}, weighted", float(np.rad2deg(both.weighted.peak))


def prices() -> Values:
    """Increase of ``q'q`` due to the weight, at the end of each path."""
    for path in PATHS:
        yield "{path}: growth of q'q", 100.0 * (plans(path).price - 1.0), _about(path)


def newton() -> Values:
    """Newton's method on the weighted plans: iterations and remaining errors."""
    for path in PATHS:
        plan, desired = plans(path).weighted, arm().pose(path.angles())
        name = {"path": path.name}
        yield "{path}: median iterations", float(np.median(plan.iterations)), name
        off = float(np.max(np.abs(arm().pose(plan.angles) - desired)))
        yield "{path}: largest error of a pose", off, name
    yield from _conditions()


def _conditions() -> Values:
    """Yield the conditions of the last pose of path_3, and the rank of the system as printed."""
    path = PATHS[-1]
    both = plans(path)
    q = both.weighted.angles[-1]
    slope = np.zeros(6)
    for k in range(6):
        h = 1e-6 * np.eye(6)[k]
        slope[k] = (weight(q + h) - weight(q - h)) / 2e-6
    constraint = numeric_jacobian(q)
    free = np.linalg.svd(constraint)[2][5:]
    left = float(np.abs(free @ slope).max() / np.abs(slope).max())
    yield "path_3: slope of the cost along the free direction", left
    yield "redundant degrees of freedom", float(6 - np.linalg.matrix_rank(constraint))
    apart = float(np.rad2deg(np.abs(q - both.unweighted.angles[-1]).max()))
    yield "path_3: joint angles of the two plans apart, same pose", apart
    for what, corner in (("as printed", np.zeros((6, 5))), ("corrected", constraint.T)):
        system = np.block([[np.eye(6), corner], [constraint, np.zeros((5, 5))]])
        rank = float(np.linalg.matrix_rank(system))
        yield f"rank of the system of 11, (2.9) {what}", rank
    yield "largest angle of (2.1) at 30 degrees", LIMIT


def weight(q: Array) -> float:
    """Return the cost (2.1) at joint angles [rad]."""
    return float(np.sum(4.0 * q**2 - np.log(1.0 - (q / LIMIT) ** 2)))


def numeric_jacobian(q: Array) -> Array:
    """Return the derivative of the five constrained coordinates of the pose, shape (5, 6)."""
    steps = 1e-6 * np.eye(6)
    found = np.array([(arm().pose(q + h) - arm().pose(q - h)) / 2e-6 for h in steps]).T
    across = np.linalg.svd(arm().pose(q)[3:][None])[2][1:]
    return np.vstack([found[:3], across @ found[3:]])


GROUPS: tuple[Group, ...] = (peaks, drawn_lines, other_reading, prices, newton)
