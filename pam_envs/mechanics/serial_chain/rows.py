"""Row indices of a serial chain in parameters and scratch.

Parameters, from the row ``chain`` of ``fixed``: the gravity vector, then one block of
``LINK_ROWS`` for each joint with its link. Scratch, from the row ``base`` of ``work``, for a chain
of ``n`` joints:

    n      torques without acceleration (bias)
    n      right-hand side, then solution
    n * n  mass matrix, lower triangle, row by row
    (n + 1) * BLOCK_ROWS   frame behind each joint, the base's first
"""

from __future__ import annotations

from pam_envs.kernels.build import kernel

TURN_X, TURN_Y, TURN_Z, LENGTH, MASS, CENTRE, ACROSS, ALONG = range(8)
"""Joint axis in the frame before the joint; length [m]; mass [kg]; centre of mass from the joint
[m]; moments of inertia about it, across and along the link [kg m2]."""
LINK_ROWS = 8
GRAVITY_ROWS = 3

FRAME, POINT, AXIS, LEVER, SPIN, TURNING, PUSH, FORCE, MOMENT = 0, 9, 12, 15, 18, 21, 24, 27, 30
"""Columns of the frame (x, y, z; z along the link), its far end, the joint's axis, the velocity
that a turn about it gives a point of the body in the base's origin; angular velocity and
acceleration, acceleration of the far end; force and moment about the origin."""
WEIGHT, MOMENTS, INERTIA = 33, 34, 37
"""Mass, first moments and inertia (xx, yy, zz, xy, xz, yz) about the origin of all that follows."""
BLOCK_ROWS = 43
DIRECTION = FRAME + 6


@kernel
def block(base: int, stages: int, k: int) -> int:
    """Return the first row of the frame behind joint ``k - 1``; 0 is the base."""
    return base + stages * (stages + 2) + k * BLOCK_ROWS


@kernel
def mass_row(base: int, stages: int, i: int, k: int) -> int:
    """Return the row of an entry of the mass matrix, ``k <= i``."""
    return base + 2 * stages + stages * i + k


def parameter_rows(stages: int) -> int:
    """Return how many rows of parameters a chain has."""
    return GRAVITY_ROWS + LINK_ROWS * stages


def work_rows(stages: int) -> int:
    """Return how many rows of scratch a chain takes."""
    return stages * (stages + 2) + (stages + 1) * BLOCK_ROWS


def tip_row(stages: int) -> int:
    """Return the row, from ``base``, of the tip's position; see :func:`pointing_row`."""
    return block(0, stages, stages) + POINT


def pointing_row(stages: int) -> int:
    """Return the row, from ``base``, of the direction in which the last link points."""
    return block(0, stages, stages) + DIRECTION
