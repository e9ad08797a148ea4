"""Best rate-limited path of the pressure, with the deviation of the knee that it causes.

The best path of :mod:`baselines.predictive.rate_limited` takes the angle as given. On a leg the
brace pushes the knee off the wearer's path, and the stretch of the muscle, hence its tension, is
that of the pushed knee. The deviation ``d`` at the nodes is linear in the torques of the brace
(:mod:`baselines.knee.wearer`), and these in pressure and deviation:

    d = M (tau - tau_0),   tau = tau* + G (p - p*) + D d

where ``p*`` is the pressure that gives the desired tension at the angle predicted with the torques
``tau_0``, and ``tau*`` the torque then. An error of the tension, as a pressure, is
``e = p - p* - C d``. The least sum of squares of ``e`` within the rate limit is found by
accelerated proximal gradient steps (beck2009), each of which is a best rate-limited path with
diagonal weights.

This path uses the knee as a second actuator where the rate limit is in the way: before heel contact
it lets the knee flex, so that the leg, which then bears weight and straightens, lowers the tension
faster than the valve could.
"""

from typing import Any, NamedTuple

import numpy as np

from baselines.predictive.rate_limited import descend_row
from pam_envs.arrays import Array
from pam_envs.kernels.build import entry, kernel

ITERATIONS = 20
"""Gradient steps per control period; the next period starts from their result."""


class Push(NamedTuple):
    """Linear model of the pushed knee at the nodes, each of shape (n_env, n_nodes).

    Attributes
    ----------
    excess : ndarray
        Torque [N m] at the desired tension less that of the predicted angle.
    per_pressure : ndarray
        Torque over pressure [N m/Pa].
    per_angle : ndarray
        Torque over angle at a constant stiffness [N m/rad].
    pressure_per_angle : ndarray
        Change of the desired pressure with the angle [Pa/rad].
    """

    excess: Array
    per_pressure: Array
    per_angle: Array
    pressure_per_angle: Array


def pushed_path(
    start: Array, path: Array, weight: Array, reach: Array, push: Push, response: Array
) -> tuple[Array, Array]:
    """Return the best path [Pa] and the deviations [rad] that it adds, (n_env, n_nodes).

    Parameters
    ----------
    start : ndarray, shape (n_env,)
        Pressure [Pa] before the first node.
    path, weight, reach : ndarray, shape (n_env, n_nodes)
        Desired pressures [Pa], weights of squared errors, largest changes [Pa].
    push : Push
        Torques of the brace.
    response : ndarray, shape (n_env, n_nodes, n_nodes)
        Deviation at a node over the torque at another [rad/(N m)].
    """
    made, deviation = np.empty_like(path), np.empty_like(path)
    nodes = path.shape[1]
    matrices, rows = np.empty((3, nodes, nodes)), np.empty((7, nodes))
    given = (np.ascontiguousarray(part) for part in (start, path, weight, reach))
    model = (np.ascontiguousarray(part) for part in (*push, response))
    scratch = (matrices, rows, np.empty((3, 2 * nodes + 2)))
    arguments: tuple[Any, ...] = (*given, *model, ITERATIONS, *scratch, made, deviation)
    push_rows(*arguments)
    return made, deviation


@entry
def push_rows(
    start: Any, path: Any, weight: Any, reach: Any, excess: Any, per_pressure: Any, per_angle: Any,
    pressure_per_angle: Any, response: Any, iterations: int, matrices: Any, rows: Any, work: Any,
    made: Any, deviation: Any,
) -> None:  # fmt: skip
    """Write best paths and deviations; matrices, rows and ``work`` are scratch."""
    loop, closed, hessian = matrices[0], matrices[1], matrices[2]
    shift, slope, metric, ahead, old, aim, new = (
        rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6],
    )  # fmt: skip
    nodes = path.shape[1]
    for i in range(len(start)):
        for k in range(nodes):
            for j in range(nodes):
                closed[k][j] = response[i][k][j]
                loop[k][j] = (1.0 if j == k else 0.0) - response[i][k][j] * per_angle[i][j]
        solve(loop, closed)
        for k in range(nodes):
            shift[k] = 0.0
            for j in range(nodes):
                shift[k] += closed[k][j] * excess[i][j]
                closed[k][j] *= per_pressure[i][j]
                own = 1.0 if j == k else 0.0
                loop[k][j] = own - pressure_per_angle[i][k] * closed[k][j]
        for k in range(nodes):
            slope[k], metric[k] = 0.0, 0.0
            for m in range(nodes):
                slope[k] += loop[m][k] * weight[i][m] * pressure_per_angle[i][m] * shift[m]
            for j in range(nodes):
                total = 0.0
                for m in range(nodes):
                    total += loop[m][k] * weight[i][m] * loop[m][j]
                hessian[k][j] = total
                metric[k] += abs(total)
            aim[k] = path[i][k] - excess[i][k] / per_pressure[i][k]
        descend_row(start[i], aim, weight[i], reach[i], old, work)
        for k in range(nodes):
            ahead[k] = old[k]
        speed = 1.0
        for _ in range(iterations):
            for k in range(nodes):
                gradient = -slope[k]
                for j in range(nodes):
                    gradient += hessian[k][j] * (ahead[j] - path[i][j])
                aim[k] = ahead[k] - gradient / metric[k]
            descend_row(start[i], aim, metric, reach[i], new, work)
            after = 0.5 + (0.25 + speed * speed) ** 0.5
            for k in range(nodes):
                ahead[k] = new[k] + (speed - 1.0) / after * (new[k] - old[k])
                old[k] = new[k]
            speed = after
        for k in range(nodes):
            made[i][k] = old[k]
            deviation[i][k] = shift[k]
            for j in range(nodes):
                deviation[i][k] += closed[k][j] * (old[j] - path[i][j])


@kernel
def solve(matrix: Any, right: Any) -> None:
    """Overwrite ``right`` by the solution of a system without pivoting, and the matrix."""
    count = len(matrix)
    for c in range(count):
        for r in range(c + 1, count):
            factor = matrix[r][c] / matrix[c][c]
            if factor != 0.0:
                for k in range(c + 1, count):
                    matrix[r][k] -= factor * matrix[c][k]
                for k in range(count):
                    right[r][k] -= factor * right[c][k]
    for back in range(count):
        r = count - 1 - back
        for k in range(count):
            total = right[r][k]
            for c in range(r + 1, count):
                total -= matrix[r][c] * right[c][k]
            right[r][k] = total / matrix[r][r]
