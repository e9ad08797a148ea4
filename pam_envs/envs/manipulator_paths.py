"""The paths that a manipulator's tool follows, with the joint angles that are planned for them."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.envs.manipulator_layout import N_POSE
from pam_envs.envs.setup import check_choice
from pam_envs.kernels import interpreted
from pam_envs.mechanics.redundancy import resolve
from pam_envs.mechanics.serial_chain import SerialChain
from pam_envs.mechanics.serial_chain_kinematics import place_chain
from pam_envs.mechanics.serial_chain_rows import pointing_row, tip_row, work_rows
from pam_envs.references.path import PATHS, draw_ends, joint_line

Array = NDArray[np.float64]

NAMES = tuple(path.name for path in PATHS)
REFERENCES = (*NAMES, "paths", "drawn")
"""One of the presets; an episode draws one of them; it draws one of a pool of random ones."""
DRAWN, DRAW_SEED = 16, 2
"""How many paths the pool has, and their seed."""
TRIED, LEAP = 40, 5.0
"""How many are drawn for it; a plan leaps where a joint moves by more than so many even steps."""
PRESET_JOINTS = len(PATHS[0].start_degrees)
LONGEST = 10_000
"""Most poses of a given path."""


def paths_for(chain: SerialChain, limit: float, reference: Any, weighted: bool) -> Array:
    """Return poses and planned angles of all paths that episodes draw from.

    Parameters
    ----------
    chain : SerialChain
        The arm.
    limit : float
        Largest planned angle of a joint [rad].
    reference : str or array_like, shape (k, 6)
        As given by the user.
    weighted : bool
        Whether angles are planned with the weight of Eq. (2.1).

    Returns
    -------
    ndarray, shape (paths * (6 + n), points)
        Of each path x, y, z [m], the direction [1], and the planned angles [rad].

    Raises
    ------
    UnreachablePose
        If there are no joint angles for a pose.
    ValueError
        If the reference is none.
    """
    if isinstance(reference, str):
        check_choice("reference", reference, REFERENCES)
        return _named(chain, limit, reference, weighted)
    return planned(chain, _given(reference), limit, weighted)


def _given(reference: Any) -> Array:
    """Return the poses that a user gave, shape (k, 6)."""
    try:
        poses = np.array(reference, np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"reference = {str(reference)[:60]!r} must be one of {', '.join(REFERENCES)}, or poses"
        ) from error
    fits = poses.ndim == 2 and poses.shape[1] == N_POSE and 2 <= len(poses) <= LONGEST
    if not fits or not np.isfinite(poses).all():
        raise ValueError(
            f"reference has shape {poses.shape}; give from 2 to {LONGEST} finite poses, each x, y, "
            "z [m] and a unit vector"
        )
    return poses


@lru_cache(maxsize=32)
def _named(chain: SerialChain, limit: float, reference: str, weighted: bool) -> Array:
    if reference == "drawn":
        return _drawn(chain, limit, weighted)
    if chain.stages != PRESET_JOINTS:
        raise ValueError(
            f"reference = {reference!r} is for an arm of {PRESET_JOINTS} joints and this one "
            f"has {chain.stages}; take reference = 'drawn', or give poses"
        )
    lines = [path.angles() for path in PATHS if reference in (path.name, "paths")]
    return np.concatenate(
        [planned(chain, poses_of(chain, line), limit, weighted) for line in lines]
    )


def _drawn(chain: SerialChain, limit: float, weighted: bool) -> Array:
    """Return the first of the paths drawn whose plan does not leap, where its minimum vanishes."""
    kept: list[Array] = []
    for first, last in zip(*draw_ends(DRAW_SEED, TRIED, chain.stages, limit), strict=True):
        line = joint_line(first, last)
        found = planned(chain, poses_of(chain, line), limit, weighted)
        even = np.abs(last - first).max() / (len(line) - 1)
        if np.abs(np.diff(found[N_POSE:])).max() <= LEAP * even:
            kept.append(found)
        if len(kept) == DRAWN:
            return np.concatenate(kept)
    raise ValueError(
        f"of {TRIED} paths drawn within {np.degrees(limit):.1f} degrees a joint only {len(kept)} "
        f"have a plan without a leap and {DRAWN} are needed; give poses, or weighted=False"
    )


def planned(chain: SerialChain, poses: Array, limit: float, weighted: bool) -> Array:
    """Return poses (k, 6) with the planned angles below them, shape (6 + n, k)."""
    angles = resolve(chain, poses, limit, weighted).angles
    return np.ascontiguousarray(np.hstack([poses, angles]).T)


def poses_of(chain: SerialChain, angles: Array) -> Array:
    """Return the poses (k, 6) of joint angles (k, n) [rad], the same bits on every machine."""
    n = chain.stages
    place = interpreted(place_chain, {"N_STAGES": n, "LANES": 1})
    fixed = chain.rows()[:, None].tolist()
    tip, pointing, poses = tip_row(n), pointing_row(n), []
    for line in angles.tolist():
        work = np.zeros((work_rows(n), 1)).tolist()
        place([[angle] for angle in line], fixed, work, 0, 0, 0)
        rows = (*work[tip : tip + 3], *work[pointing : pointing + 3])
        poses.append([row[0] for row in rows])
    return np.array(poses)
