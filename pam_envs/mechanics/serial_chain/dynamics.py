"""Dynamics of a serial chain: mass matrix, bias torques, and the solution of ``M x = b``.

    M(q) qdd + bias(q, qd) = joint torques

Recursive: the bias by Newton and Euler from the base outwards and back, the mass matrix by
composite bodies (R. Featherstone, Rigid Body Dynamics Algorithms, 2008), both as screws about the
base's origin. Each link is a body of revolution about its own direction; the payload is a point at
the tip. Gravity is an acceleration of the base.
"""

from __future__ import annotations

from typing import Any

from pam_envs.kernels.build import LANES, kernel
from pam_envs.mechanics.serial_chain.kinematics import N_STAGES, cross, place_chain
from pam_envs.mechanics.serial_chain.rows import (
    ACROSS,
    ALONG,
    AXIS,
    CENTRE,
    DIRECTION,
    FORCE,
    GRAVITY_ROWS,
    INERTIA,
    LENGTH,
    LEVER,
    LINK_ROWS,
    MASS,
    MOMENT,
    MOMENTS,
    POINT,
    PUSH,
    SPIN,
    TURNING,
    WEIGHT,
    block,
    mass_row,
)

__all__ = ["chain_solve", "chain_terms", "place_chain"]

CARRIED = INERTIA + 6 - FORCE
"""Rows, from ``FORCE``, of the wrench and inertia at a joint."""


@kernel
def start_base(work: Any, fixed: Any, chain: int, base: int) -> None:
    """Start the base at rest, accelerated upwards by gravity."""
    at = block(base, N_STAGES, 0)
    for j in range(LANES):
        for r in range(6):
            work[at + SPIN + r][j] = 0.0
        for r in range(3):
            work[at + PUSH + r][j] = -fixed[chain + r][j]


@kernel
def move_link(work: Any, fixed: Any, link: int, at: int, was: int, rate: Any, j: int) -> None:
    """Write motion without joint acceleration of one link, its wrench and its inertia."""
    v = rate[j]
    ax, ay, az = work[at + AXIS][j], work[at + AXIS + 1][j], work[at + AXIS + 2][j]
    dx, dy, dz = work[at + DIRECTION][j], work[at + DIRECTION + 1][j], work[at + DIRECTION + 2][j]
    ox, oy, oz = work[was + SPIN][j], work[was + SPIN + 1][j], work[was + SPIN + 2][j]
    gx, gy, gz = cross(ox, oy, oz, v * ax, v * ay, v * az)
    gx = gx + work[was + TURNING][j]
    gy = gy + work[was + TURNING + 1][j]
    gz = gz + work[was + TURNING + 2][j]
    ox, oy, oz = ox + v * ax, oy + v * ay, oz + v * az
    ex, ey, ez = cross(ox, oy, oz, dx, dy, dz)
    hx, hy, hz = cross(ox, oy, oz, ex, ey, ez)
    kx, ky, kz = cross(gx, gy, gz, dx, dy, dz)
    kx, ky, kz = kx + hx, ky + hy, kz + hz  # acceleration of a point one metre along the link
    length, mass, centre = fixed[link + LENGTH][j], fixed[link + MASS][j], fixed[link + CENTRE][j]
    bx, by, bz = work[was + PUSH][j], work[was + PUSH + 1][j], work[was + PUSH + 2][j]
    fx, fy, fz = mass * (bx + centre * kx), mass * (by + centre * ky), mass * (bz + centre * kz)
    short = centre - length
    cx = work[at + POINT][j] + short * dx
    cy = work[at + POINT + 1][j] + short * dy
    cz = work[at + POINT + 2][j] + short * dz
    across = fixed[link + ACROSS][j]
    excess = fixed[link + ALONG][j] - across
    along = excess * (dx * gx + dy * gy + dz * gz)
    spin = excess * (dx * ox + dy * oy + dz * oz)
    mx, my, mz = cross(cx, cy, cz, fx, fy, fz)
    work[at + SPIN][j], work[at + SPIN + 1][j], work[at + SPIN + 2][j] = ox, oy, oz
    work[at + TURNING][j], work[at + TURNING + 1][j], work[at + TURNING + 2][j] = gx, gy, gz
    work[at + PUSH][j] = bx + length * kx
    work[at + PUSH + 1][j] = by + length * ky
    work[at + PUSH + 2][j] = bz + length * kz
    work[at + FORCE][j], work[at + FORCE + 1][j], work[at + FORCE + 2][j] = fx, fy, fz
    work[at + MOMENT][j] = mx + across * gx + along * dx + spin * ex
    work[at + MOMENT + 1][j] = my + across * gy + along * dy + spin * ey
    work[at + MOMENT + 2][j] = mz + across * gz + along * dz + spin * ez
    write_inertia(work, at, j, mass, cx, cy, cz, across, excess)


@kernel
def write_inertia(
    work: Any, at: int, j: int, mass: float, cx: float, cy: float, cz: float, across: float,
    excess: float,
) -> None:  # fmt: skip
    """Write mass, first moments and inertia about the origin of one link."""
    dx, dy, dz = work[at + DIRECTION][j], work[at + DIRECTION + 1][j], work[at + DIRECTION + 2][j]
    hx, hy, hz = mass * cx, mass * cy, mass * cz
    work[at + WEIGHT][j] = mass
    work[at + MOMENTS][j], work[at + MOMENTS + 1][j], work[at + MOMENTS + 2][j] = hx, hy, hz
    work[at + INERTIA][j] = across + excess * dx * dx + hy * cy + hz * cz
    work[at + INERTIA + 1][j] = across + excess * dy * dy + hx * cx + hz * cz
    work[at + INERTIA + 2][j] = across + excess * dz * dz + hx * cx + hy * cy
    work[at + INERTIA + 3][j] = excess * dx * dy - hx * cy
    work[at + INERTIA + 4][j] = excess * dx * dz - hx * cz
    work[at + INERTIA + 5][j] = excess * dy * dz - hy * cz


@kernel
def add(work: Any, row: int, j: int, x: float, y: float, z: float) -> None:
    """Add a vector to three rows of one lane."""
    work[row][j] = work[row][j] + x
    work[row + 1][j] = work[row + 1][j] + y
    work[row + 2][j] = work[row + 2][j] + z


@kernel
def add_payload(work: Any, base: int, payload: Any) -> None:
    """Add a point at the tip to the load of the last link."""
    at = block(base, N_STAGES, N_STAGES)
    for j in range(LANES):
        m = payload[j]
        px, py, pz = work[at + POINT][j], work[at + POINT + 1][j], work[at + POINT + 2][j]
        fx, fy, fz = m * work[at + PUSH][j], m * work[at + PUSH + 1][j], m * work[at + PUSH + 2][j]
        nx, ny, nz = cross(px, py, pz, fx, fy, fz)
        add(work, at + FORCE, j, fx, fy, fz)
        add(work, at + MOMENT, j, nx, ny, nz)
        hx, hy, hz = m * px, m * py, m * pz
        work[at + WEIGHT][j] = work[at + WEIGHT][j] + m
        add(work, at + MOMENTS, j, hx, hy, hz)
        add(work, at + INERTIA, j, hy * py + hz * pz, hx * px + hz * pz, hx * px + hy * py)
        add(work, at + INERTIA + 3, j, -hx * py, -hx * pz, -hy * pz)


@kernel
def project(work: Any, base: int, k: int, at: int) -> None:
    """Write bias torque and row ``k`` of the mass matrix, from the load of joint ``k``."""
    for j in range(LANES):
        ax, ay, az = work[at + AXIS][j], work[at + AXIS + 1][j], work[at + AXIS + 2][j]
        vx, vy, vz = work[at + LEVER][j], work[at + LEVER + 1][j], work[at + LEVER + 2][j]
        fx, fy, fz = work[at + FORCE][j], work[at + FORCE + 1][j], work[at + FORCE + 2][j]
        nx, ny, nz = work[at + MOMENT][j], work[at + MOMENT + 1][j], work[at + MOMENT + 2][j]
        work[base + k][j] = ax * nx + ay * ny + az * nz + vx * fx + vy * fy + vz * fz
        m = work[at + WEIGHT][j]
        hx, hy, hz = work[at + MOMENTS][j], work[at + MOMENTS + 1][j], work[at + MOMENTS + 2][j]
        xx, yy, zz = work[at + INERTIA][j], work[at + INERTIA + 1][j], work[at + INERTIA + 2][j]
        xy, xz, yz = work[at + INERTIA + 3][j], work[at + INERTIA + 4][j], work[at + INERTIA + 5][j]
        lx, ly, lz = cross(ax, ay, az, hx, hy, hz)
        tx, ty, tz = cross(hx, hy, hz, vx, vy, vz)
        work[at + SPIN][j] = lx + m * vx
        work[at + SPIN + 1][j] = ly + m * vy
        work[at + SPIN + 2][j] = lz + m * vz
        work[at + TURNING][j] = tx + xx * ax + xy * ay + xz * az
        work[at + TURNING + 1][j] = ty + xy * ax + yy * ay + yz * az
        work[at + TURNING + 2][j] = tz + xz * ax + yz * ay + zz * az
    for i in range(k + 1):
        body, row = block(base, N_STAGES, i + 1), work[mass_row(base, N_STAGES, k, i)]
        for j in range(LANES):
            row[j] = (
                work[body + AXIS][j] * work[at + TURNING][j]
                + work[body + AXIS + 1][j] * work[at + TURNING + 1][j]
                + work[body + AXIS + 2][j] * work[at + TURNING + 2][j]
                + work[body + LEVER][j] * work[at + SPIN][j]
                + work[body + LEVER + 1][j] * work[at + SPIN + 1][j]
                + work[body + LEVER + 2][j] * work[at + SPIN + 2][j]
            )


@kernel
def chain_terms(
    rows: Any, fixed: Any, work: Any, angle: int, velocity: int, payload: int, chain: int, base: int
) -> None:
    """Write bias torques and mass matrix of a chain.

    ``angle``, ``velocity`` and ``payload`` are the first rows of the joint angles [rad] and rates
    [rad/s] and the row of the mass at the tip [kg]; ``chain`` and ``base`` the first rows of the
    chain's parameters and of its scratch (``rows``): the bias [N m] is in ``base + k``, the mass
    matrix [kg m2] in ``mass_row(base, n, i, k)``.
    """
    place_chain(rows, fixed, work, angle, chain, base)
    start_base(work, fixed, chain, base)
    for k in range(N_STAGES):
        link = chain + GRAVITY_ROWS + LINK_ROWS * k
        was, at = block(base, N_STAGES, k), block(base, N_STAGES, k + 1)
        for j in range(LANES):
            move_link(work, fixed, link, at, was, rows[velocity + k], j)
    add_payload(work, base, rows[payload])
    for i in range(N_STAGES):
        k = N_STAGES - 1 - i
        at = block(base, N_STAGES, k + 1)
        project(work, base, k, at)
        at = at + FORCE
        if k > 0:
            before = block(base, N_STAGES, k) + FORCE
            for r in range(CARRIED):
                for j in range(LANES):
                    work[before + r][j] = work[before + r][j] + work[at + r][j]


@kernel
def chain_solve(work: Any, base: int) -> None:
    """Replace the right-hand side in ``base + n + k`` by the solution of ``M x = b``.

    By ``M = L D L'``, which overwrites M.
    """
    right = base + N_STAGES
    for k in range(N_STAGES):
        eliminate(work, base, right, k)
    for n in range(N_STAGES):
        k = N_STAGES - 1 - n
        found, pivot = work[right + k], work[mass_row(base, N_STAGES, k, k)]
        for j in range(LANES):
            found[j] = found[j] * pivot[j]
        for i in range(k):
            row, other = work[mass_row(base, N_STAGES, k, i)], work[right + i]
            for j in range(LANES):
                other[j] = other[j] - row[j] * found[j]


@kernel
def eliminate(work: Any, base: int, right: int, k: int) -> None:
    """Eliminate unknown ``k`` from the equations behind it and invert its pivot."""
    pivot = work[mass_row(base, N_STAGES, k, k)]
    for j in range(LANES):
        pivot[j] = 1.0 / pivot[j]
    for i in range(k + 1, N_STAGES):
        below = work[mass_row(base, N_STAGES, i, k)]
        for c in range(k + 1, i + 1):
            beside, row = work[mass_row(base, N_STAGES, c, k)], work[mass_row(base, N_STAGES, i, c)]
            for j in range(LANES):
                row[j] = row[j] - below[j] * (beside[j] * pivot[j])
        for j in range(LANES):
            work[right + i][j] = work[right + i][j] - below[j] * (pivot[j] * work[right + k][j])
