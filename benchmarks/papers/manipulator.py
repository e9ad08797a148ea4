"""Figures of the manipulator's path planning (fluidic_muscles, section 2).

The paper shows two plans of one path; its only number is the limit of 30 degrees. The expected
values were computed by an independent program for three paths. The ends of one path are known; the
other two paths were chosen to have the expected peaks, which are therefore inputs and not judged.
Freely drawn paths show the effect of the weight without any fit.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from baselines.manipulator.redundancy import Comparison, compare
from benchmarks.papers.published import BEFORE, Figure, Group
from pam_envs.envs.manipulator.paths import LEAP
from pam_envs.mechanics.redundancy.resolution import LIMIT
from pam_envs.mechanics.serial_chain.chain import SerialChain
from pam_envs.references.path import PATHS, POINTS, PathEnds, draw_ends, joint_line

Array = NDArray[np.float64]

SOURCE = "fluidic_muscles, section 2"
KNOWN, OURS = "predicted; ends known", "calibrated: ends drawn for these peaks"
UNWEIGHTED = {"path_1": 34.2, "path_2": 33.2, "path_3": 37.12}
WEIGHTED = {"path_1": 27.6, "path_2": 26.2, "path_3": 27.77}
"""Largest angle of a joint [degrees] in each plan."""
MOST_ITERATIONS = 16.0
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


def peaks() -> Iterator[Figure]:
    """Largest angle of a joint on each path, without and with the weight (2.1)."""
    for path in PATHS:
        both = plans(path)
        text = f"{OURS if path.calibrated else KNOWN}; straight line of the joints; {BEFORE}"
        for name, expected, plan, least, most in (
            ("unweighted", UNWEIGHTED, both.unweighted, 33.0, None),
            ("weighted", WEIGHTED, both.weighted, None, 30.0),
        ):
            yield Figure(
                f"{path.name}, {name}: largest angle",
                float(np.rad2deg(plan.peak)),
                "deg",
                SOURCE,
                tolerance=0.005,
                note=text,
                expected=expected[path.name],
                given=path.calibrated,
                at_least=least,
                at_most=most,
            )


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


def drawn_lines() -> Iterator[Figure]:
    """Share of freely drawn paths on which joints exceed their limit or the plan changes branch."""
    found = held_out()
    text = f"of {found.paths} freely drawn paths, none left out"
    leap = f"{text}; most do so along a hundred times as many poses: the branch of solutions ends"
    for name, share, words, most in (
        ("unweighted: past 30 degrees", found.crossed, text, None),
        ("weighted: past 30 degrees", found.crossed_weighted, text, 0.0),
        ("unweighted: the plan leaps", found.leapt, leap, None),
        ("weighted: the plan leaps", found.leapt_weighted, leap, None),
    ):
        yield Figure(f"drawn paths, {name}", 100.0 * share, "%", SOURCE, note=words, at_most=most)
    name = "drawn paths, weighted: largest median of iterations"
    yield Figure(name, found.iterations, "1", SOURCE, note=text, at_most=MOST_ITERATIONS)


def other_reading() -> Iterator[Figure]:
    """Largest angles of path_3 if its ends were those of a straight line of tip and direction."""
    path = PATHS[-1]
    both = compare(arm(), straight_poses(path), start=path.angles()[0])
    text = "reported: the other reading of the two ends; it misses the figures"
    for name, expected, plan in (
        ("unweighted", UNWEIGHTED, both.unweighted),
        ("weighted", WEIGHTED, both.weighted),
    ):
        title, peak = f"path_3 as a straight line of the tip, {name}", float(np.rad2deg(plan.peak))
        yield Figure(title, peak, "deg", SOURCE, note=text, expected=expected[path.name])


def prices() -> Iterator[Figure]:
    """Increase of ``q'q`` due to the weight, at the end of each path."""
    for path in PATHS:
        yield Figure(
            f"{path.name}: growth of q'q",
            100.0 * (plans(path).price - 1.0),
            "%",
            SOURCE,
            note=f"{OURS if path.calibrated else KNOWN}; {BEFORE}: 25 to 34 %",
            at_least=25.0,
            at_most=34.0,
            given=path.calibrated,
        )


def newton() -> Iterator[Figure]:
    """Newton's method on the weighted plans: iterations and remaining errors."""
    for path in PATHS:
        plan, desired = plans(path).weighted, arm().pose(path.angles())
        name, number = f"{path.name}: median iterations", float(np.median(plan.iterations))
        text = "warm start, change below 1e-10 rad"
        yield Figure(name, number, "1", SOURCE, note=text, at_most=MOST_ITERATIONS)
        name = f"{path.name}: largest error of a pose"
        off = float(np.max(np.abs(arm().pose(plan.angles) - desired)))
        yield Figure(name, off, "m", SOURCE, at_most=1e-12)


GROUPS: tuple[Group, ...] = (peaks, drawn_lines, other_reading, prices, newton)
