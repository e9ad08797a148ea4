"""Kinematics and dynamics of a serial chain as kernels, for lanes side by side.

Each joint turns about a fixed axis of the frame before it; its link is along the z of the frame
behind it. All quantities are in the base's frame, and motions are screws about the base's origin: a
turn about joint ``k`` moves the point of a body in the origin with ``point_k x axis_k``. So no
vector has to be turned from frame to frame.

    M(q) qdd + bias(q, qd) = joint torques

Recursive: the bias by Newton and Euler from the base outwards and back, the mass matrix by
composite bodies (R. Featherstone, Rigid Body Dynamics Algorithms, 2008). Each link is a body of
revolution about its own direction; the payload is a point at the tip. Gravity is an acceleration of
the base.

Parameters, from the row ``chain`` of ``fixed``: the gravity vector, then one block of
``LINK_ROWS`` for each joint with its link. Scratch, from the row ``base`` of ``work``, for a chain
of ``n`` joints:

    n      torques without acceleration (bias)
    n      right-hand side, then solution
    n * n  mass matrix, lower triangle, row by row
    (n + 1) * BLOCK_ROWS   frame behind each joint, the base's first
"""

from typing import Any

from pam_envs.kernels.arithmetic import sine_and_cosine
from pam_envs.kernels.build import LANES, entry, kernel

N_STAGES = 6
"""Joints of the chain: a placeholder, replaced where a kernel is built for another number."""
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
CARRIED = INERTIA + 6 - FORCE
"""Rows, from ``FORCE``, of the wrench and inertia at a joint."""


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


@kernel
def vector(work: Any, row: int, j: int) -> tuple[float, float, float]:
    """Return three rows of one lane."""
    return work[row][j], work[row + 1][j], work[row + 2][j]


@kernel
def write(work: Any, row: int, j: int, x: float, y: float, z: float) -> None:
    """Write a vector into three rows of one lane."""
    work[row][j], work[row + 1][j], work[row + 2][j] = x, y, z


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
        place_origin(work, at, j)


@kernel
def place_origin(work: Any, at: int, j: int) -> None:
    """Write the base's frame into the block at a row."""
    for r in range(12):
        work[at + FRAME + r][j] = 0.0
    work[at + FRAME][j] = work[at + FRAME + 4][j] = work[at + FRAME + 8][j] = 1.0


@kernel
def place_link(work: Any, fixed: Any, link: int, at: int, was: int, angle: Any, j: int) -> None:
    """Write frame, end and joint axis of one link behind the frame ``was``."""
    sine, cosine = sine_and_cosine(angle[j])
    tx, ty, tz = vector(fixed, link + TURN_X, j)
    ux, uy, uz = vector(work, was + FRAME, j)
    vx, vy, vz = vector(work, was + FRAME + 3, j)
    wx, wy, wz = vector(work, was + DIRECTION, j)
    ax = tx * ux + ty * vx + tz * wx
    ay = tx * uy + ty * vy + tz * wy
    az = tx * uz + ty * vz + tz * wz
    ux, uy, uz = turned(ux, uy, uz, ax, ay, az, tx, sine, cosine)
    vx, vy, vz = turned(vx, vy, vz, ax, ay, az, ty, sine, cosine)
    wx, wy, wz = turned(wx, wy, wz, ax, ay, az, tz, sine, cosine)
    px, py, pz = vector(work, was + POINT, j)
    lx, ly, lz = cross(px, py, pz, ax, ay, az)
    length = fixed[link + LENGTH][j]
    write(work, at + FRAME, j, ux, uy, uz)
    write(work, at + FRAME + 3, j, vx, vy, vz)
    write(work, at + DIRECTION, j, wx, wy, wz)
    write(work, at + POINT, j, px + length * wx, py + length * wy, pz + length * wz)
    write(work, at + AXIS, j, ax, ay, az)
    write(work, at + LEVER, j, lx, ly, lz)


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
    ax, ay, az = vector(work, at + AXIS, j)
    dx, dy, dz = vector(work, at + DIRECTION, j)
    ox, oy, oz = vector(work, was + SPIN, j)
    gx, gy, gz = cross(ox, oy, oz, v * ax, v * ay, v * az)
    tx, ty, tz = vector(work, was + TURNING, j)
    gx, gy, gz = gx + tx, gy + ty, gz + tz
    ox, oy, oz = ox + v * ax, oy + v * ay, oz + v * az
    ex, ey, ez = cross(ox, oy, oz, dx, dy, dz)
    hx, hy, hz = cross(ox, oy, oz, ex, ey, ez)
    kx, ky, kz = cross(gx, gy, gz, dx, dy, dz)
    kx, ky, kz = kx + hx, ky + hy, kz + hz  # acceleration of a point one metre along the link
    length, mass, centre = fixed[link + LENGTH][j], fixed[link + MASS][j], fixed[link + CENTRE][j]
    bx, by, bz = vector(work, was + PUSH, j)
    fx, fy, fz = mass * (bx + centre * kx), mass * (by + centre * ky), mass * (bz + centre * kz)
    short = centre - length
    px, py, pz = vector(work, at + POINT, j)
    cx, cy, cz = px + short * dx, py + short * dy, pz + short * dz
    across = fixed[link + ACROSS][j]
    excess = fixed[link + ALONG][j] - across
    along = excess * (dx * gx + dy * gy + dz * gz)
    spin = excess * (dx * ox + dy * oy + dz * oz)
    mx, my, mz = cross(cx, cy, cz, fx, fy, fz)
    write(work, at + SPIN, j, ox, oy, oz)
    write(work, at + TURNING, j, gx, gy, gz)
    write(work, at + PUSH, j, bx + length * kx, by + length * ky, bz + length * kz)
    write(work, at + FORCE, j, fx, fy, fz)
    work[at + MOMENT][j] = mx + across * gx + along * dx + spin * ex
    work[at + MOMENT + 1][j] = my + across * gy + along * dy + spin * ey
    work[at + MOMENT + 2][j] = mz + across * gz + along * dz + spin * ez
    hx, hy, hz = mass * cx, mass * cy, mass * cz
    work[at + WEIGHT][j] = mass
    write(work, at + MOMENTS, j, hx, hy, hz)
    work[at + INERTIA][j] = across + excess * dx * dx + hy * cy + hz * cz
    work[at + INERTIA + 1][j] = across + excess * dy * dy + hx * cx + hz * cz
    work[at + INERTIA + 2][j] = across + excess * dz * dz + hx * cx + hy * cy
    work[at + INERTIA + 3][j] = excess * dx * dy - hx * cy
    work[at + INERTIA + 4][j] = excess * dx * dz - hx * cz
    work[at + INERTIA + 5][j] = excess * dy * dz - hy * cz


@kernel
def add(work: Any, row: int, j: int, x: float, y: float, z: float) -> None:
    """Add a vector to three rows of one lane."""
    ax, ay, az = vector(work, row, j)
    write(work, row, j, ax + x, ay + y, az + z)


@kernel
def add_payload(work: Any, base: int, payload: Any) -> None:
    """Add a point at the tip to the load of the last link."""
    at = block(base, N_STAGES, N_STAGES)
    for j in range(LANES):
        m = payload[j]
        px, py, pz = vector(work, at + POINT, j)
        bx, by, bz = vector(work, at + PUSH, j)
        fx, fy, fz = m * bx, m * by, m * bz
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
        ax, ay, az = vector(work, at + AXIS, j)
        vx, vy, vz = vector(work, at + LEVER, j)
        fx, fy, fz = vector(work, at + FORCE, j)
        nx, ny, nz = vector(work, at + MOMENT, j)
        work[base + k][j] = ax * nx + ay * ny + az * nz + vx * fx + vy * fy + vz * fz
        m = work[at + WEIGHT][j]
        hx, hy, hz = vector(work, at + MOMENTS, j)
        xx, yy, zz = vector(work, at + INERTIA, j)
        xy, xz, yz = vector(work, at + INERTIA + 3, j)
        lx, ly, lz = cross(ax, ay, az, hx, hy, hz)
        tx, ty, tz = cross(hx, hy, hz, vx, vy, vz)
        write(work, at + SPIN, j, lx + m * vx, ly + m * vy, lz + m * vz)
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


@entry
def gravity_rows(angles: Any, payload: Any, chain: Any, work: Any, torques: Any) -> None:
    """Write the torques [N m] that hold the chain at angles [rad], both of shape (rows, n).

    ``payload``, shape (rows,), is in kg; ``chain`` has the parameters in a column, and ``work``
    the scratch of the frames, shape ((n + 1) * BLOCK_ROWS, 1).
    """
    n = angles.shape[1]
    gx, gy, gz = vector(chain, 0, 0)
    for r in range(len(angles)):
        place_origin(work, 0, 0)
        for k in range(n):
            link, was = GRAVITY_ROWS + LINK_ROWS * k, BLOCK_ROWS * k
            place_link(work, chain, link, was + BLOCK_ROWS, was, angles[r][k : k + 1], 0)
        mass = payload[r]
        mx, my, mz = vector(work, BLOCK_ROWS * n + POINT, 0)
        mx, my, mz = mass * mx, mass * my, mass * mz  # moments of all that follows
        for back in range(n):
            k = n - 1 - back
            link, was = GRAVITY_ROWS + LINK_ROWS * k, BLOCK_ROWS * k
            own, centre = chain[link + MASS][0], chain[link + CENTRE][0]
            px, py, pz = vector(work, was + POINT, 0)
            wx, wy, wz = vector(work, was + BLOCK_ROWS + DIRECTION, 0)
            ax, ay, az = vector(work, was + BLOCK_ROWS + AXIS, 0)
            mass = mass + own
            mx = mx + own * (px + centre * wx)
            my = my + own * (py + centre * wy)
            mz = mz + own * (pz + centre * wz)
            tx, ty, tz = cross(ax, ay, az, mx - mass * px, my - mass * py, mz - mass * pz)
            torques[r][k] = -(tx * gx + ty * gy + tz * gz)
