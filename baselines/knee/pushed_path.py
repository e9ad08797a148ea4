"""Best rate-limited path of the pressure, with the deviation of the knee that it causes.

The best path of :mod:`baselines.predictive.rate_limited` takes the angle as given. On a leg the
brace pushes the knee off the wearer's path, and the stretch of the muscle, hence its tension, is
that of the pushed knee. The deviation ``d`` at the nodes is linear in the torques of the brace
(:mod:`baselines.knee.wearer`), and these in pressure and deviation:

    d = M (tau - tau_0),   tau = tau* + G (p - p*) + D d

where ``p*`` is the pressure that gives the desired tension at the angle predicted with the torques
``tau_0``, and ``tau*`` the torque then. An error of the tension, as a pressure, is
``e = p - p* - C d``. The least sum of squares of ``e`` within the rate limit is approximated
by accelerated proximal gradient steps (beck2009), each of which is a best rate-limited path with
diagonal weights towards pressures between 0 and the highest one.

This path uses the knee as a second actuator where the rate limit is in the way: before heel contact
it lets the knee flex, so that the leg, which then bears weight and straightens, lowers the tension
faster than the valve could.
"""

from typing import Any, NamedTuple

import numpy as np

from baselines.predictive.rate_limited import descend_row
from pam_envs.arrays import Array
from pam_envs.kernels.build import entry, kernel

ITERATIONS = 6
"""Gradient steps per control period. The torques of their result are those that the next period
starts from, so that the first periods of an episode are less exact."""


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
    start: Array, path: Array, weight: Array, reach: Array, push: Push, response: Array, most: float
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
        Deviation at a node over the torque at another [rad/(N m)]; 0 at nodes before that
        of the torque.
    most : float
        Highest pressure [Pa].
    """
    made, deviation = np.empty_like(path), np.empty_like(path)
    nodes = path.shape[1]
    matrices, rows = np.empty((3, nodes, nodes)), np.empty((8, nodes))
    given = (np.ascontiguousarray(part) for part in (start, path, weight, reach))
    model = (np.ascontiguousarray(part) for part in (*push, response))
    scratch = (matrices, rows, np.empty((3, 2 * nodes + 2)))
    arguments: tuple[Any, ...] = (*given, *model, most, ITERATIONS, *scratch, made, deviation)
    push_rows(*arguments)
    return made, deviation


@entry
def push_rows(
    start: Any, path: Any, weight: Any, reach: Any, excess: Any, per_pressure: Any, per_angle: Any,
    pressure_per_angle: Any, response: Any, most: float, iterations: int, matrices: Any, rows: Any,
    work: Any, made: Any, deviation: Any,
) -> None:  # fmt: skip
    """Write best paths and deviations; matrices, rows and ``work`` are scratch.

    All matrices but the Hessian are lower triangular: no torque moves the knee before it acts.
    """
    loop, closed, hessian = matrices[0], matrices[1], matrices[2]
    shift, slope, metric, ahead, old, aim, new, gradient = (
        rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6], rows[7],
    )  # fmt: skip
    nodes = path.shape[1]
    for i in range(len(start)):
        close(response[i], per_angle[i], closed)
        for k in range(nodes):
            shift[k], slope[k] = 0.0, 0.0
            for j in range(k + 1):
                shift[k] += closed[k][j] * excess[i][j]
                closed[k][j] *= per_pressure[i][j]
                loop[k][j] = -pressure_per_angle[i][k] * closed[k][j]
                hessian[k][j], hessian[j][k] = 0.0, 0.0
            loop[k][k] += 1.0
        for m in range(nodes):
            off = weight[i][m] * pressure_per_angle[i][m] * shift[m]
            for k in range(m + 1):
                slope[k] += loop[m][k] * off
                heavy = weight[i][m] * loop[m][k]
                for j in range(m + 1):
                    hessian[k][j] += heavy * loop[m][j]
        for k in range(nodes):
            metric[k] = 0.0
            for j in range(nodes):
                metric[k] += abs(hessian[k][j])
            aim[k] = path[i][k] - excess[i][k] / per_pressure[i][k]
            aim[k] = max(0.0, min(most, aim[k]))
        descend_row(start[i], aim, weight[i], reach[i], old, work)
        for k in range(nodes):
            ahead[k] = old[k]
        speed = 1.0
        for _ in range(iterations):
            for k in range(nodes):
                gradient[k] = -slope[k]
            for j in range(nodes):
                off = ahead[j] - path[i][j]
                for k in range(nodes):
                    gradient[k] += hessian[j][k] * off
            for k in range(nodes):
                aim[k] = max(0.0, min(most, ahead[k] - gradient[k] / metric[k]))
            descend_row(start[i], aim, metric, reach[i], new, work)
            after = 0.5 + (0.25 + speed * speed) ** 0.5
            for k in range(nodes):
                ahead[k] = new[k] + (speed - 1.0) / after * (new[k] - old[k])
                old[k] = new[k]
            speed = after
        for k in range(nodes):
            made[i][k] = old[k]
            deviation[i][k] = shift[k]
            for j in range(k + 1):
                deviation[i][k] += closed[k][j] * (old[j] - path[i][j])


@kernel
def close(response: Any, gain: Any, closed: Any) -> None:
    """Solve ``closed = response (1 + diag(gain) closed)`` for ``closed``, lower triangular."""
    nodes = len(response)
    for k in range(nodes):
        for j in range(nodes):
            closed[k][j] = response[k][j] if j <= k else 0.0
        for m in range(k):
            share = response[k][m] * gain[m]
            for j in range(m + 1):
                closed[k][j] += share * closed[m][j]
        share = 1.0 - response[k][k] * gain[k]
        for j in range(k + 1):
            closed[k][j] /= share
