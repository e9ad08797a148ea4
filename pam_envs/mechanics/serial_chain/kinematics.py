"""Kinematics of a serial chain: frames, joint axes and tip, for lanes side by side.

Each joint turns about a fixed axis of the frame before it; its link is along the z of the frame
behind it. All quantities are in the base's frame, and motions are screws about the base's origin: a
turn about joint ``k`` moves the point of a body in the origin with ``point_k x axis_k``. So no
vector has to be turned from frame to frame.
"""

from __future__ import annotations

from typing import Any

from pam_envs.kernels.arithmetic import sine_and_cosine
from pam_envs.kernels.build import LANES, kernel
from pam_envs.mechanics.serial_chain.rows import (
    AXIS,
    DIRECTION,
    FRAME,
    GRAVITY_ROWS,
    LENGTH,
    LEVER,
    LINK_ROWS,
    POINT,
    TURN_X,
    TURN_Y,
    TURN_Z,
    block,
)

N_STAGES = 6
"""Joints of the chain: a placeholder, replaced where a kernel is built for another number."""


@kernel
def cross(
    ax: float, ay: float, az: float, bx: float, by: float, bz: float
) -> tuple[float, float, float]:
    """Return the cross product of two vectors."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@kernel
def turned(
    vx: float, vy: float, vz: float, ax: float, ay: float, az: float, along: float,
    sine: float, cosine: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Return a vector turned about an axis; ``along`` is its component along the axis."""
    cx, cy, cz = cross(ax, ay, az, vx, vy, vz)
    rest = (1.0 - cosine) * along
    return (
        cosine * vx + sine * cx + rest * ax,
        cosine * vy + sine * cy + rest * ay,
        cosine * vz + sine * cz + rest * az,
    )


@kernel
def place_base(work: Any, base: int) -> None:
    """Write the frame of the base."""
    at = block(base, N_STAGES, 0)
    for j in range(LANES):
        for r in range(12):
            work[at + FRAME + r][j] = 0.0
        work[at + FRAME][j] = work[at + FRAME + 4][j] = work[at + FRAME + 8][j] = 1.0


@kernel
def place_link(work: Any, fixed: Any, link: int, at: int, was: int, angle: Any, j: int) -> None:
    """Write frame, end and joint axis of one link behind the frame ``was``."""
    sine, cosine = sine_and_cosine(angle[j])
    tx, ty, tz = fixed[link + TURN_X][j], fixed[link + TURN_Y][j], fixed[link + TURN_Z][j]
    ux, uy, uz = work[was + FRAME][j], work[was + FRAME + 1][j], work[was + FRAME + 2][j]
    vx, vy, vz = work[was + FRAME + 3][j], work[was + FRAME + 4][j], work[was + FRAME + 5][j]
    wx, wy, wz = (
        work[was + DIRECTION][j],
        work[was + DIRECTION + 1][j],
        work[was + DIRECTION + 2][j],
    )
    ax = tx * ux + ty * vx + tz * wx
    ay = tx * uy + ty * vy + tz * wy
    az = tx * uz + ty * vz + tz * wz
    ux, uy, uz = turned(ux, uy, uz, ax, ay, az, tx, sine, cosine)
    vx, vy, vz = turned(vx, vy, vz, ax, ay, az, ty, sine, cosine)
    wx, wy, wz = turned(wx, wy, wz, ax, ay, az, tz, sine, cosine)
    px, py, pz = work[was + POINT][j], work[was + POINT + 1][j], work[was + POINT + 2][j]
    lx, ly, lz = cross(px, py, pz, ax, ay, az)
    length = fixed[link + LENGTH][j]
    work[at + FRAME][j], work[at + FRAME + 1][j], work[at + FRAME + 2][j] = ux, uy, uz
    work[at + FRAME + 3][j], work[at + FRAME + 4][j], work[at + FRAME + 5][j] = vx, vy, vz
    work[at + DIRECTION][j], work[at + DIRECTION + 1][j], work[at + DIRECTION + 2][j] = wx, wy, wz
    work[at + POINT][j] = px + length * wx
    work[at + POINT + 1][j] = py + length * wy
    work[at + POINT + 2][j] = pz + length * wz
    work[at + AXIS][j], work[at + AXIS + 1][j], work[at + AXIS + 2][j] = ax, ay, az
    work[at + LEVER][j], work[at + LEVER + 1][j], work[at + LEVER + 2][j] = lx, ly, lz


@kernel
def place_chain(rows: Any, fixed: Any, work: Any, angle: int, chain: int, base: int) -> None:
    """Write the frames, ends and joint axes of all links.

    ``angle`` is the first row of the joint angles [rad], ``chain`` and ``base`` the first rows of
    the chain's parameters and of its scratch (``rows``).
    """
    place_base(work, base)
    for k in range(N_STAGES):
        link = chain + GRAVITY_ROWS + LINK_ROWS * k
        was, at = block(base, N_STAGES, k), block(base, N_STAGES, k + 1)
        for j in range(LANES):
            place_link(work, fixed, link, at, was, rows[angle + k], j)
