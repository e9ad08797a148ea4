"""Figures of the manipulator paper on the planning of paths (seed 002, section 2).

The paper shows two plans of one path, without numbers but the limit of 30 degrees. The numbers
here were computed beforehand by another program, for three paths, of which one is known by its
ends. The other two are ours, drawn so that their peaks are those.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from baselines.redundancy import Comparison, compare
from benchmarks.papers import Figure
from pam_envs.mechanics.redundancy import resolve
from pam_envs.mechanics.serial_chain import SerialChain
from pam_envs.references.path import PATHS, POINTS, PathEnds

Array = NDArray[np.float64]

SOURCE = "seed 002, section 2"
BEFORE = "not in the paper: computed beforehand by another program"
KNOWN, OURS = "predicted; ends known", "calibrated; ends drawn for this peak"
UNWEIGHTED = {"path_1": 34.2, "path_2": 33.2, "path_3": 37.12}
WEIGHTED = {"path_1": 27.6, "path_2": 26.2, "path_3": 27.77}
"""Largest angle of a joint [degrees] in each plan."""
MOST_ITERATIONS = 16.0
RATE = 2000.0


@lru_cache(maxsize=1)
def arm() -> SerialChain:
    """Return the six-joint arm: axes x-y-x-y-x-y, links of 0.25 m."""
    return SerialChain.uniform()


@lru_cache(maxsize=8)
def plans(path: PathEnds) -> Comparison:
    """Return both plans of a path, begun from its first angles."""
    line = path.angles()
    return compare(arm(), arm().pose(line), start=line[0])


def straight_poses(path: PathEnds) -> Array:
    """Return poses from end to end of a path on a straight line of the tip, shape (41, 6).

    The direction turns evenly in the plane of both ends' directions.
    """
    first, last = arm().pose(path.angles()[[0, -1]])
    share = np.linspace(0.0, 1.0, POINTS)[:, None]
    whole = np.arccos(first[3:] @ last[3:])
    turned = np.sin((1.0 - share) * whole) * first[3:] + np.sin(share * whole) * last[3:]
    return np.hstack([first[:3] + share * (last[:3] - first[:3]), turned / np.sin(whole)])


def peaks() -> list[Figure]:
    """Largest angle of a joint on each path, without and with the weight (2.1)."""
    figures = []
    for path in PATHS:
        both, kind = plans(path), KNOWN if path.name == "path_3" else OURS
        tolerance = 0.005 if path.name == "path_3" else 0.05
        for name, published, plan in (
            ("unweighted", UNWEIGHTED, both.unweighted),
            ("weighted", WEIGHTED, both.weighted),
        ):
            ours = float(np.rad2deg(plan.peak))
            figures.append(
                Figure(f"{path.name}, {name}: largest angle", SOURCE, "deg", published[path.name],
                       ours, tolerance, f"{kind}; straight line of the joints; {BEFORE}")
            )  # fmt: skip
    return figures


def other_reading() -> list[Figure]:
    """Largest angles of path_3 if its ends were those of a straight line of tip and direction."""
    poses, start = straight_poses(PATHS[-1]), PATHS[-1].angles()[0]
    both = compare(arm(), poses, start=start)
    names = ("unweighted", "weighted")
    text = "reported: the other reading of the two ends; it misses the figures"
    return [
        Figure(f"path_3 as a straight line of the tip, {name}", SOURCE, "deg", published,
               float(np.rad2deg(plan.peak)), None, text)
        for name, published, plan in zip(
            names, (37.12, 27.77), (both.unweighted, both.weighted), strict=True
        )
    ]  # fmt: skip


def prices() -> list[Figure]:
    """Growth of ``q'q`` by the weight, at the end of each path."""
    text = f"{BEFORE}: 25 to 34 %"
    return [
        Figure(f"{path.name}: growth of q'q", SOURCE, "%", 29.5, 100.0 * (plans(path).price - 1.0),
               4.6, text)
        for path in PATHS
    ]  # fmt: skip


def newton() -> list[Figure]:
    """Newton's method on the weighted plans: iterations beyond 16, and errors left."""
    figures = []
    for path in PATHS:
        plan, wanted = plans(path).weighted, arm().pose(path.angles())
        median = float(np.median(plan.iterations))
        text = f"predicted: the median is {median:g}, warm start, change below 1e-10 rad; {BEFORE}"
        off = float(np.max(np.abs(arm().pose(plan.angles) - wanted)))
        figures += [
            Figure(f"{path.name}: median iterations beyond {MOST_ITERATIONS:g}", SOURCE, "1", 0.0,
                   max(0.0, median - MOST_ITERATIONS), 0.0, text),
            Figure(f"{path.name}: largest error of a pose", SOURCE, "m", 0.0, off, 1e-12,
                   f"predicted; {BEFORE}"),
        ]  # fmt: skip
    return figures


def poses_per_second(repeats: int = 20) -> float:
    """Return how many poses one core plans in a second, over all paths there and back."""
    lines = [path.angles() for path in PATHS]
    poses = [arm().pose(np.vstack([line, line[::-1]] * repeats)) for line in lines]
    for path, line in zip(poses, lines, strict=True):
        resolve(arm(), path[:2], start=line[0])
    begin = time.perf_counter()
    for path, line in zip(poses, lines, strict=True):
        resolve(arm(), path, start=line[0])
    return sum(map(len, poses)) / (time.perf_counter() - begin)


def rate() -> list[Figure]:
    """Poses planned in a second on one core."""
    text = "at least 2,000 are wanted; of this machine"
    return [
        Figure("planned poses in a second", SOURCE, "1/s", RATE, poses_per_second(), None, text)
    ]


GROUPS: tuple[Callable[[], list[Figure]], ...] = (peaks, other_reading, prices, newton, rate)
