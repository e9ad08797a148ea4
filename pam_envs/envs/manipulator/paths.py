"""Reference paths of a manipulator's tool, with planned joint angles."""

from functools import lru_cache
from typing import Any

import numpy as np

from pam_envs.arrays import Array
from pam_envs.envs.core.setup import check_choice
from pam_envs.envs.manipulator.layout import N_POSE
from pam_envs.kernels.build import interpreted
from pam_envs.mechanics.redundancy.resolution import UnreachablePose, resolve
from pam_envs.mechanics.serial_chain.chain import SerialChain
from pam_envs.mechanics.serial_chain.kernels import place_chain, pointing_row, tip_row, work_rows
from pam_envs.plants.antagonistic_joint.statics import bearable_payload
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from pam_envs.references.path import PATHS, draw_ends, joint_line

NAMES = tuple(path.name for path in PATHS)
REFERENCES = (*NAMES, "paths", "drawn")
"""A preset; one of the presets, drawn each episode; one of a pool of random paths."""
DRAWN, DRAW_SEED = 16, 2
"""Number of paths in the pool, and their seed."""
TRIED, LEAP = 48, 5.0
"""Candidates for the pool; largest step of a joint in a continuous plan, in even steps."""
PRESET_JOINTS = len(PATHS[0].start_degrees)
LONGEST = 10_000
"""Largest number of poses of a given path."""
USUAL_PAYLOAD = 0.03
"""Payload [kg] that every drawn path allows."""


def paths_for(plant: RedundantManipulator, reference: Any, weighted: bool) -> dict[str, Array]:
    """Return all paths from which episodes draw, by name, shape (6 + n, points) each.

    Poses, x, y, z [m] and the direction [1], then planned angles [rad], none beyond
    ``plant.angle_range``; ``weighted`` with the weight of Eq. (2.1).
    """
    chain, limit = plant.nominal_chain, plant.angle_range[1]
    if not isinstance(reference, str):
        return {"reference": planned(chain, _given(reference), limit, weighted)}
    check_choice("reference", reference, REFERENCES)
    if reference == "drawn":
        return _drawn(plant, weighted)
    if plant.stages != PRESET_JOINTS:
        raise ValueError(
            f"reference = {reference!r} is for an arm of {PRESET_JOINTS} joints and this one "
            f"has {plant.stages}; take reference = 'drawn', or give poses"
        )
    names = NAMES if reference == "paths" else (reference,)
    return {name: _preset(chain, limit, name, weighted) for name in names}


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


@lru_cache(maxsize=64)
def _preset(chain: SerialChain, limit: float, name: str, weighted: bool) -> Array:
    line = PATHS[NAMES.index(name)].angles()
    try:
        return planned(chain, poses_of(chain, line), limit, weighted)
    except UnreachablePose as error:
        hint = (
            f"; reference {name!r} is not for this arm: take 'drawn', whose paths are made for it, "
            "or give poses"
        )
        raise UnreachablePose(
            error.index, error.pose, error.distance, error.turn, limit, hint
        ) from error


def _drawn(plant: RedundantManipulator, weighted: bool) -> dict[str, Array]:
    """Return the first drawn paths with continuous plans that allow the usual payload."""
    chain, limit = plant.nominal_chain, plant.angle_range[1]
    kept: dict[str, Array] = {}
    for i in range(TRIED):
        found = _drawn_path(chain, limit, i)
        if found is None:
            continue
        if bearable_payload(plant, found[N_POSE:].T) < USUAL_PAYLOAD:
            continue
        if not weighted:
            found = planned(chain, found[:N_POSE].T, limit, weighted)
        kept[f"drawn path {i}"] = found
        if len(kept) == DRAWN:
            return kept
    raise ValueError(
        f"of {TRIED} paths drawn within {np.degrees(limit):.1f} degrees a joint only {len(kept)} "
        f"have a continuous plan that allows {USUAL_PAYLOAD:g} kg, and {DRAWN} are needed; take "
        "lighter links, or give poses"
    )


@lru_cache(maxsize=128)
def _drawn_path(chain: SerialChain, limit: float, i: int) -> Array | None:
    """Return path ``i`` of those drawn, or None if its plan is not continuous."""
    first, last = (ends[i] for ends in _ends(DRAW_SEED, TRIED, chain.stages, limit))
    line = joint_line(first, last)
    found = planned(chain, poses_of(chain, line), limit, True)
    even = np.abs(last - first).max() / (len(line) - 1)
    return found if np.abs(np.diff(found[N_POSE:])).max() <= LEAP * even else None


_ends = lru_cache(maxsize=16)(draw_ends)


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
