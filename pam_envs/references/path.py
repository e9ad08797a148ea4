"""Paths of a tool: position and direction over time.

A path is given by the joint angles of its two ends, between which each joint moves in a straight
line; its poses are those of the arm on this line. So every path is feasible, and a plan can be
compared with known joint angles. fluidic_muscles prints neither the path of its example nor its
angles. Between the ends chosen here the smallest angles peak at 37.12 degrees and the weighted ones
at 27.77; along a straight line of tip and direction at 39.0 and 28.2 degrees.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.kernels.build import kernel
from pam_envs.kernels.random import seed_words, uniform

POINTS = 41  # poses of a path (fluidic_muscles's example)
STREAM = 40  # random stream of drawn paths (one draw number an angle)
MOST_TRIES = 1000


@dataclass(frozen=True)
class PathEnds:
    """Joint angles [degrees] at both ends of a path, one entry a joint."""

    name: str
    start_degrees: tuple[float, ...]
    end_degrees: tuple[float, ...]
    source: str
    # chosen so that the angles peak as published: then these peaks are inputs, no evidence
    calibrated: bool

    def angles(self, points: int = POINTS) -> Array:
        """Return the joint angles [rad] of the path, shape (points, n)."""
        return joint_line(np.deg2rad(self.start_degrees), np.deg2rad(self.end_degrees), points)


_OURS = "assumed: drawn so that unweighted and weighted angles peak as stated for this path"
PATHS = (
    PathEnds(
        "path_1",
        (-1.21, 0.89, 12.33, -1.26, 4.02, 6.03),
        (0.3, -3.64, 27.76, -22.21, -1.25, 21.02),
        _OURS,
        True,
    ),
    PathEnds(
        "path_2",
        (-14.39, 12.43, -9.41, 8.2, 27.97, -7.99),
        (-20.95, 21.65, -18.55, -28.0, -7.08, 11.57),
        _OURS,
        True,
    ),
    PathEnds(
        "path_3",
        (-5.65, 7.18, -12.57, -10.03, -12.03, 7.89),
        (-10.53, 12.52, -26.49, -26.45, -25.94, 21.0),
        "the example worked out for fluidic_muscles, section 2",
        False,
    ),
)
"""Three paths of the six-joint arm (axes x-y-x-y-x-y, links of 0.25 m, +-30 degrees)."""


def joint_line(start: ArrayLike, end: ArrayLike, points: int = POINTS) -> Array:
    """Return angles from start to end [rad] (points, n); ValueError if the ends do not fit."""
    first, last = np.asarray(start, float), np.asarray(end, float)
    if first.ndim != 1 or first.shape != last.shape:
        raise ValueError(
            f"ends of shapes {first.shape} and {last.shape} do not fit; give one angle a joint"
        )
    if points < 2:
        raise ValueError(f"points = {points} is too few; a path has 2 or more")
    share = np.linspace(0.0, 1.0, points)[:, None]
    return np.asarray(first + share * (last - first))


def draw_ends(seed: int, number: int, stages: int, limit: float) -> tuple[Array, Array]:
    """Return the ends of ``number`` random paths: joint angles [rad], shapes (number, stages).

    Path ``i`` of a seed is the same however many are drawn. An end uses up to 0.9 of ``limit``
    [rad], the joints turn by 0.8 of it or more on the way, all together, and the arm is nowhere
    almost straight: there it could move either way.
    """
    key_a, key_b = seed_words(seed)
    starts, ends = np.empty((number, stages)), np.empty((number, stages))
    for i in range(number):
        for attempt in range(MOST_TRIES):
            first = 2 * stages * (i * MOST_TRIES + attempt)
            shares = [uniform(key_a, key_b, STREAM, first + k) for k in range(2 * stages)]
            ends_of_one = 0.9 * limit * (2.0 * np.array(shares).reshape(2, stages) - 1.0)
            starts[i], ends[i] = ends_of_one
            if _usable(joint_line(*ends_of_one), limit):
                break
    return starts, ends


def _usable(line: Array, limit: float) -> bool:
    """Return whether a path is long enough and nowhere almost straight."""
    bent, way = np.sum(line**2, axis=1), np.sum((line[-1] - line[0]) ** 2)
    return bool(way > (0.8 * limit) ** 2 and np.min(bent) > (0.6 * limit) ** 2)


@kernel
def least_jerk(share: float) -> float:
    """Return the minimum-jerk share of the way at a share of the time."""
    u = max(0.0, min(1.0, share))
    return u * u * u * (10.0 + u * (6.0 * u - 15.0))


@kernel
def along(time: float, rest: float, move: float) -> float:
    """Return the share of the path, 0 to 1, at a time [s]: rest, there, rest, back, repeated.

    ``rest`` and ``move`` are the durations of a rest at an end and of the way between the ends [s].
    """
    turns = time / (2.0 * (rest + move))
    since = (turns - float(int(turns))) * 2.0 * (rest + move)
    if since >= rest + move:
        return 1.0 - least_jerk((since - rest - move - rest) / move)
    return least_jerk((since - rest) / move)
