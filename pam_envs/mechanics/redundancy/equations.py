"""Optimality conditions of a redundant chain: the equations of one Newton iteration.

fluidic_muscles, (2.2) to (2.12), with two corrections: the second derivative of the Lagrangian
holds the curvature of the constraint, ``sum_i lambda_i d2 g_i / dq2``, which the text leaves to the
reader, and the upper right block is ``dF_1 / d lambda = J_g'`` and not (2.9)'s ``dF_2 / d lambda``:

    [ d2 f + sum_i lambda_i d2 g_i   J_g' ] [ dq       ]     [ df       ]
    [ J_g                            0    ] [ lambda + ] = - [ g(q) - x ]

The five equations of a pose are the three of its position and, of its direction, the two components
across the desired one. All rows have one lane: ``LANES = 1``.
"""

from __future__ import annotations

import math
from typing import Any

from pam_envs.kernels.arithmetic import log_of_fraction
from pam_envs.kernels.build import kernel, routine
from pam_envs.mechanics.serial_chain.kinematics import N_STAGES, cross, place_chain
from pam_envs.mechanics.serial_chain.rows import AXIS, DIRECTION, LEVER, POINT, block

TASK = 5
"""Degrees of freedom of a pose."""


@kernel
def across(dx: float, dy: float, dz: float) -> tuple[float, float, float]:
    """Return a unit vector across another one."""
    if abs(dx) <= abs(dy) and abs(dx) <= abs(dz):
        tx, ty, tz = cross(dx, dy, dz, 1.0, 0.0, 0.0)
    elif abs(dy) <= abs(dz):
        tx, ty, tz = cross(dx, dy, dz, 0.0, 1.0, 0.0)
    else:
        tx, ty, tz = cross(dx, dy, dz, 0.0, 0.0, 1.0)
    size = math.sqrt(tx * tx + ty * ty + tz * tz)
    return tx / size, ty / size, tz / size


@kernel
def slope_and_curvature(angle: float, limit: float, weighted: bool) -> tuple[float, float]:
    """Return both derivatives of the weight (2.1) of one joint, or of the square of its angle.

    ``4 q^2 - ln(1 - z)`` with ``z = (q / limit)^2``: curvature ``8 + (2 / limit^2) (1 + z) /
    (1 - z)^2``.
    """
    if not weighted:
        return 2.0 * angle, 2.0
    share = angle / limit
    rest = 1.0 - share * share
    slope = 8.0 * angle + 2.0 * share / (limit * rest)
    return slope, 8.0 + 2.0 * (1.0 + share * share) / (limit * limit * rest * rest)


@kernel
def weight_of(q: Any, limit: float, weighted: bool) -> float:
    """Return the weight (2.1) of all joints, or the sum of the squares of their angles."""
    total = 0.0
    for k in range(N_STAGES):
        angle = q[k][0]
        if weighted:
            share = angle / limit
            total = total + 4.0 * angle * angle - log_of_fraction(1.0 - share * share)
        else:
            total = total + angle * angle
    return total


@kernel
def column(work: Any, k: int) -> tuple[float, float, float, float, float, float]:
    """Return the rates of tip and direction per rate of joint ``k``."""
    at, end = block(0, N_STAGES, k + 1), block(0, N_STAGES, N_STAGES)
    ax, ay, az = work[at + AXIS][0], work[at + AXIS + 1][0], work[at + AXIS + 2][0]
    px, py, pz = work[end + POINT][0], work[end + POINT + 1][0], work[end + POINT + 2][0]
    dx, dy, dz = (
        work[end + DIRECTION][0],
        work[end + DIRECTION + 1][0],
        work[end + DIRECTION + 2][0],
    )
    vx, vy, vz = cross(ax, ay, az, px, py, pz)
    wx, wy, wz = cross(ax, ay, az, dx, dy, dz)
    lever = at + LEVER
    return vx + work[lever][0], vy + work[lever + 1][0], vz + work[lever + 2][0], wx, wy, wz


@kernel
def multipliers_of_direction(multipliers: Any, pose: Any) -> tuple[float, float, float]:
    """Return the multipliers of the direction as a vector across the desired one."""
    sx, sy, sz = across(pose[3], pose[4], pose[5])
    tx, ty, tz = cross(pose[3], pose[4], pose[5], sx, sy, sz)
    s, t = multipliers[3], multipliers[4]
    return s * sx + t * tx, s * sy + t * ty, s * sz + t * tz


@kernel
def errors_of(work: Any, pose: Any) -> tuple[float, float, float, float, float]:
    """Return the errors of position [m] and of direction, across the desired one."""
    end = block(0, N_STAGES, N_STAGES)
    dx, dy, dz = (
        work[end + DIRECTION][0],
        work[end + DIRECTION + 1][0],
        work[end + DIRECTION + 2][0],
    )
    sx, sy, sz = across(pose[3], pose[4], pose[5])
    tx, ty, tz = cross(pose[3], pose[4], pose[5], sx, sy, sz)
    return (
        work[end + POINT][0] - pose[0],
        work[end + POINT + 1][0] - pose[1],
        work[end + POINT + 2][0] - pose[2],
        sx * dx + sy * dy + sz * dz,
        tx * dx + ty * dy + tz * dz,
    )


@kernel
def largest_error(work: Any, pose: Any) -> float:
    """Return the largest error of a pose; it is at least 1 where it points the other way."""
    end = block(0, N_STAGES, N_STAGES) + DIRECTION
    ahead = work[end][0] * pose[3] + work[end + 1][0] * pose[4] + work[end + 2][0] * pose[5]
    largest = 0.0 if ahead > 0.0 else 1.0
    for error in errors_of(work, pose):
        largest = max(largest, abs(error))
    return largest


@routine
def set_equations(
    q: Any, fixed: Any, work: Any, system: Any, pose: Any, limit: float, weighted: bool
) -> float:
    """Write the equations of an iteration without the constraint's curvature.

    The matrix is ``system[row][column]``, its last column the right-hand side. Returns the error of
    the pose.
    """
    n, last = N_STAGES, N_STAGES + TASK
    place_chain(q, fixed, work, 0, 0, 0)
    sx, sy, sz = across(pose[3], pose[4], pose[5])
    tx, ty, tz = cross(pose[3], pose[4], pose[5], sx, sy, sz)
    for i in range(last):
        for k in range(last + 1):
            system[i][k] = 0.0
    for k in range(n):
        vx, vy, vz, wx, wy, wz = column(work, k)
        slope, curvature = slope_and_curvature(q[k][0], limit, weighted)
        system[k][k], system[k][last] = curvature, -slope
        values = (vx, vy, vz, sx * wx + sy * wy + sz * wz, tx * wx + ty * wy + tz * wz)
        for r in range(TASK):
            system[n + r][k] = system[k][n + r] = values[r]
    errors = errors_of(work, pose)
    for r in range(TASK):
        system[n + r][last] = -errors[r]
    return largest_error(work, pose)


@routine
def set_curvature(multipliers: Any, work: Any, system: Any, pose: Any) -> None:
    """Add the constraint's curvature to the equations."""
    mx, my, mz = multipliers_of_direction(multipliers, pose)
    lx, ly, lz = multipliers[0], multipliers[1], multipliers[2]
    for k in range(N_STAGES):
        vx, vy, vz, wx, wy, wz = column(work, k)
        cx, cy, cz = cross(vx, vy, vz, lx, ly, lz)
        ux, uy, uz = cross(wx, wy, wz, mx, my, mz)
        cx, cy, cz = cx + ux, cy + uy, cz + uz
        for i in range(k + 1):
            on = block(0, N_STAGES, i + 1) + AXIS
            value = work[on][0] * cx + work[on + 1][0] * cy + work[on + 2][0] * cz
            system[k][i] = system[k][i] + value
            if i < k:
                system[i][k] = system[k][i]


@routine
def merit(
    q: Any, fixed: Any, work: Any, pose: Any, limit: float, weighted: bool, penalty: float
) -> float:
    """Return the weight of all joints and a penalty on the errors of the pose."""
    place_chain(q, fixed, work, 0, 0, 0)
    total = weight_of(q, limit, weighted)
    for error in errors_of(work, pose):
        total = total + penalty * abs(error)
    return total
