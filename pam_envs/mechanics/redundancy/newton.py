"""Newton's method on the Lagrangian of a redundant chain, pose after pose of a path.

The equations of an iteration are fluidic_muscles, (2.2) to (2.12), with two corrections: the second
derivative of the Lagrangian holds the curvature of the constraint, ``sum_i lambda_i d2 g_i / dq2``,
which the text leaves to the reader, and the upper right block is ``dF_1 / d lambda = J_g'`` and not
(2.9)'s ``dF_2 / d lambda``:

    [ d2 f + sum_i lambda_i d2 g_i   J_g' ] [ dq       ]     [ df       ]
    [ J_g                            0    ] [ lambda + ] = - [ g(q) - x ]

The five equations of a pose are the three of its position and, of its direction, the two components
across the desired one. All rows have one lane: ``LANES = 1``.

The pose is not a linear function of the angles, so the problem is not convex (fluidic_muscles says
it is): the method needs a start nearby, steps that stay between the limits, and an arm that is not
straight, where the Jacobian loses rank. Each pose starts from the solution of the one before; at
the beginning of a path, and where that fails, bent poses are tried.
"""

import math
from typing import Any

from pam_envs.kernels.arithmetic import log_of_fraction
from pam_envs.kernels.build import kernel, routine
from pam_envs.mechanics.serial_chain.kernels import (
    AXIS,
    DIRECTION,
    GRAVITY_ROWS,
    LEVER,
    LINK_ROWS,
    N_STAGES,
    POINT,
    block,
    cross,
    place_chain,
    vector,
)

TASK = 5
"""Degrees of freedom of a pose."""
MOST_ITERATIONS = 150
TOLERANCE = 1e-10
"""Largest change of an angle [rad] in the last iteration."""
CLOSE = 1e-9
"""Largest error of position [m] and direction [1] that counts as reached."""
LONGEST_STEP = 0.5
"""Largest change of an angle [rad] in an iteration."""
KEPT = 0.9
"""Largest share of the way to a limit in an iteration."""
STARTS = 16
"""Bent poses from which a search begins; as many again, bent less, where those fail."""
BEND, STRAIGHT = 0.35, 1e-3
"""Angle [rad] of the bent poses, and below which all joints count as straight."""
WARM = 0.05
"""Change of an angle [rad] below which the constraint's curvature is used after a cold start."""
MOST_HALVINGS = 12
LOST = 1e6
"""Change of an angle [rad] from which an iteration has failed."""
MUCH = 1e7
"""Weight of the constraint in the test of convexity."""
SMALLEST_PIVOT = 1e-13
SMALLEST_ROOM = 1e-9
"""Least distance from a limit, as a share of it."""


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
    ax, ay, az = vector(work, at + AXIS, 0)
    px, py, pz = vector(work, end + POINT, 0)
    dx, dy, dz = vector(work, end + DIRECTION, 0)
    vx, vy, vz = cross(ax, ay, az, px, py, pz)
    wx, wy, wz = cross(ax, ay, az, dx, dy, dz)
    lever = at + LEVER
    return vx + work[lever][0], vy + work[lever + 1][0], vz + work[lever + 2][0], wx, wy, wz


@kernel
def sides(pose: Any) -> tuple[float, float, float, float, float, float]:
    """Return two unit vectors across the desired direction."""
    sx, sy, sz = across(pose[3], pose[4], pose[5])
    tx, ty, tz = cross(pose[3], pose[4], pose[5], sx, sy, sz)
    return sx, sy, sz, tx, ty, tz


@kernel
def errors_of(work: Any, pose: Any) -> tuple[float, float, float, float, float]:
    """Return the errors of position [m] and of direction, across the desired one."""
    end = block(0, N_STAGES, N_STAGES)
    dx, dy, dz = vector(work, end + DIRECTION, 0)
    sx, sy, sz, tx, ty, tz = sides(pose)
    return (
        work[end + POINT][0] - pose[0],
        work[end + POINT + 1][0] - pose[1],
        work[end + POINT + 2][0] - pose[2],
        sx * dx + sy * dy + sz * dz,
        tx * dx + ty * dy + tz * dz,
    )


@routine
def set_equations(
    q: Any, fixed: Any, work: Any, system: Any, pose: Any, limit: float, weighted: bool
) -> float:
    """Write the equations of an iteration without the constraint's curvature.

    The matrix is ``system[row][column]``, its last column the right-hand side. Returns the
    largest error of the pose, at least 1 where it points the other way.
    """
    n, last = N_STAGES, N_STAGES + TASK
    place_chain(q, fixed, work, 0, 0, 0)
    sx, sy, sz, tx, ty, tz = sides(pose)
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
    dx, dy, dz = vector(work, block(0, n, n) + DIRECTION, 0)
    largest = 0.0 if dx * pose[3] + dy * pose[4] + dz * pose[5] > 0.0 else 1.0
    errors = errors_of(work, pose)
    for r in range(TASK):
        system[n + r][last] = -errors[r]
        largest = max(largest, abs(errors[r]))
    return largest


@routine
def set_curvature(multipliers: Any, work: Any, system: Any, pose: Any) -> None:
    """Add the constraint's curvature to the equations."""
    sx, sy, sz, tx, ty, tz = sides(pose)
    s, t = multipliers[3], multipliers[4]
    mx, my, mz = s * sx + t * tx, s * sy + t * ty, s * sz + t * tz
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


@routine
def solve_equations(system: Any, size: int) -> None:
    """Solve in place, by elimination with row exchange; the last column becomes the solution."""
    for k in range(size):
        best = k
        for i in range(k + 1, size):
            if abs(system[i][k]) > abs(system[best][k]):
                best = i
        if best != k:
            for c in range(k, size + 1):
                system[k][c], system[best][c] = system[best][c], system[k][c]
        pivot = system[k][k]
        if abs(pivot) < SMALLEST_PIVOT:
            pivot = SMALLEST_PIVOT
        for i in range(k + 1, size):
            factor = system[i][k] / pivot
            if factor != 0.0:
                for c in range(k + 1, size + 1):
                    system[i][c] = system[i][c] - factor * system[k][c]
        system[k][k] = pivot
    for n in range(size):
        k = size - 1 - n
        total = system[k][size]
        for c in range(k + 1, size):
            total = total - system[k][c] * system[c][size]
        system[k][size] = total / system[k][k]


@kernel
def share_of_step(q: Any, system: Any, limit: float, weighted: bool) -> tuple[float, float]:
    """Return the admissible share of a step, and its largest change of an angle [rad]."""
    last, share, largest = N_STAGES + TASK, 1.0, 0.0
    for k in range(N_STAGES):
        change = system[k][last]
        largest = max(largest, abs(change))
        if weighted:
            gap = limit - q[k][0] if change > 0.0 else limit + q[k][0]
            if abs(change) > KEPT * gap:
                share = min(share, KEPT * gap / abs(change))
    if largest > LONGEST_STEP:
        share = min(share, LONGEST_STEP / largest)
    return share, largest


@kernel
def change_angles(q: Any, system: Any, share: float) -> None:
    """Add a share of the step to the angles."""
    for k in range(N_STAGES):
        q[k][0] = q[k][0] + share * system[k][N_STAGES + TASK]


@routine
def shortened(
    q: Any, fixed: Any, work: Any, system: Any, pose: Any, limit: float, weighted: bool,
    share: float,
) -> float:  # fmt: skip
    """Apply the share of the step that lowers weight and errors together; return it."""
    penalty = 1.0
    for r in range(TASK):
        penalty = max(penalty, 2.0 * abs(system[N_STAGES + r][N_STAGES + TASK]))
    before = merit(q, fixed, work, pose, limit, weighted, penalty)
    change_angles(q, system, share)
    for _ in range(MOST_HALVINGS):
        if merit(q, fixed, work, pose, limit, weighted, penalty) < before:
            break
        change_angles(q, system, -0.5 * share)
        share = 0.5 * share
    return share


@routine
def bends_upwards(system: Any, trial: Any) -> bool:
    """Return whether the Lagrangian is convex along all directions that keep the pose.

    It is if its second derivative plus much of ``J_g' J_g`` has positive pivots (Debreu's lemma).
    """
    for i in range(N_STAGES):
        for k in range(i + 1):
            total = 0.0
            for r in range(TASK):
                total = total + system[N_STAGES + r][i] * system[N_STAGES + r][k]
            trial[i][k] = system[i][k] + MUCH * total
    for k in range(N_STAGES):
        if not trial[k][k] > 0.0:
            return False
        for i in range(k + 1, N_STAGES):
            factor = trial[i][k] / trial[k][k]
            for c in range(k + 1, i + 1):
                trial[i][c] = trial[i][c] - factor * trial[c][k]
    return True


@routine
def iterate(
    q: Any, multipliers: Any, fixed: Any, work: Any, system: Any, trial: Any, pose: Any,
    limit: float, weighted: bool, warm: bool,
) -> int:  # fmt: skip
    """Converge to the nearby minimum for a pose; return the iterations, or 0 without success.

    Where the Lagrangian is not convex, and after a cold start until the steps are small, the
    constraint's curvature is left out and the step shortened until weight and errors decrease: so
    it converges to a minimum, and not to a saddle.
    """
    near, last = warm, N_STAGES + TASK
    for iteration in range(MOST_ITERATIONS):
        error = set_equations(q, fixed, work, system, pose, limit, weighted)
        curved = near
        if near:
            set_curvature(multipliers, work, system, pose)
            curved = bends_upwards(system, trial)
            if not curved:
                error = set_equations(q, fixed, work, system, pose, limit, weighted)
        solve_equations(system, last)
        share, largest = share_of_step(q, system, limit, weighted)
        if not largest < LOST:
            return 0
        if curved:
            change_angles(q, system, share)
        else:
            share = shortened(q, fixed, work, system, pose, limit, weighted, share)
        if weighted and room_of(q, limit) < SMALLEST_ROOM * limit:
            return 0
        for r in range(TASK):
            old = multipliers[r]
            multipliers[r] = old + share * (system[N_STAGES + r][last] - old)
        if curved and largest < TOLERANCE and error < CLOSE:
            return iteration + 1
        near = near or (largest < WARM and error < WARM)
    return 0


@kernel
def room_of(q: Any, limit: float) -> float:
    """Return the smallest distance of a joint from its limit [rad]."""
    room = limit
    for k in range(N_STAGES):
        room = min(room, limit - abs(q[k][0]))
    return room


@routine
def bend(q: Any, fixed: Any, start: int, limit: float) -> None:
    """Bend the chain one way or in an S, for each axis; ``start`` numbers the ways."""
    size = min(BEND, 0.5 * limit)
    if start >= STARTS:
        size = 0.4 * size
    for axis in range(3):
        count, seen = 0.0, 0.0
        for k in range(N_STAGES):
            count = count + fixed[GRAVITY_ROWS + LINK_ROWS * k + axis][0]
        code = start
        if axis == 1:
            code = start // 4
        sign = 1.0 - 2.0 * (code % 2)
        half = (code // 2) % 2
        for k in range(N_STAGES):
            if fixed[GRAVITY_ROWS + LINK_ROWS * k + axis][0] > 0.5:
                turn = -1.0 if half == 1 and seen >= 0.5 * count else 1.0
                q[k][0] = sign * turn * size * (1.0 + 0.1 * seen)
                seen = seen + 1.0


@routine
def search(
    q: Any, best: Any, multipliers: Any, fixed: Any, work: Any, system: Any, trial: Any,
    pose: Any, limit: float, weighted: bool,
) -> int:  # fmt: skip
    """Find the best optimum from bent poses; return its iterations, or 0 without any."""
    taken, least = 0, 0.0
    for start in range(2 * STARTS):
        if start >= STARTS and taken > 0:
            break
        bend(q, fixed, start, limit)
        for r in range(TASK):
            multipliers[r] = 0.0
        count = iterate(q, multipliers, fixed, work, system, trial, pose, limit, weighted, False)
        if count > 0:
            value = weight_of(q, limit, weighted)
            if taken == 0 or value < least - CLOSE:
                taken, least = count, value
                for k in range(N_STAGES):
                    best[k] = q[k][0]
                for r in range(TASK):
                    best[N_STAGES + r] = multipliers[r]
    if taken > 0:
        for k in range(N_STAGES):
            q[k][0] = best[k]
        for r in range(TASK):
            multipliers[r] = best[N_STAGES + r]
    return taken


@kernel
def nearly_straight(q: Any) -> bool:
    """Return whether all joints are straight, where the Jacobian has lost rank."""
    largest = 0.0
    for k in range(N_STAGES):
        largest = max(largest, abs(q[k][0]))
    return largest < STRAIGHT


@kernel
def resolve_path(
    poses: Any, q: Any, multipliers: Any, fixed: Any, work: Any, system: Any, trial: Any, best: Any,
    limit: float, weighted: bool, known: bool, angles: Any, found: Any, iterations: Any,
) -> int:  # fmt: skip
    """Find the angles for poses one after the other, each from those of the pose before.

    Returns the number of resolved poses, which is also the index of the first unresolved one.

    Parameters
    ----------
    poses : rows, (m, 6)
        Position [m] and direction.
    q, multipliers : rows (n, 1), (5,)
        Initial angles [rad] and multipliers; ``known`` if they are near the first pose.
    fixed, work, system, trial, best : rows
        ``SerialChain.rows()`` in one lane; scratch: ``work_rows(n)`` rows of one lane,
        (n + 5) x (n + 6), n x n, and n + 5.
    limit, weighted : float, bool
        Largest angle [rad]; whether the weight (2.1) is minimised, or the squares of the angles.
    angles, found, iterations : rows (m, n), (m, 5), (m,)
        Receive angles, multipliers and iterations.
    """
    near = known
    for i in range(len(poses)):
        count = 0
        if near and not nearly_straight(q):
            count = iterate(
                q, multipliers, fixed, work, system, trial, poses[i], limit, weighted, True
            )
        if count == 0:
            count = search(
                q, best, multipliers, fixed, work, system, trial, poses[i], limit, weighted
            )
        if count == 0:
            return i
        iterations[i], near = count, True
        for k in range(N_STAGES):
            angles[i][k] = q[k][0]
        for r in range(TASK):
            found[i][r] = multipliers[r]
    return len(poses)
