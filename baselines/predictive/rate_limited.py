"""Best rate-limited path towards a previewed one: the optimisation behind the predictive inverses.

A pressure that changes by at most ``rate`` a period follows a path ``p*`` such that

    sum_k w_k (p_k - p*_k)^2,   |p_k - p_(k-1)| <= rate (t_k - t_(k-1))

is least over nodes ``t_1 < t_2 < ...``. Where ``p*`` changes faster than the pressure can, the best
path starts early enough to halve the error: anticipation follows from the rate limit, without a
rule of its own.

The problem is solved exactly by dynamic programming (bertsekas2017), backwards in time. The slope
of the cost to go, as a function of the pressure, increases and is piecewise linear. One node adds a
line to it; the choice of the increment moves the part below its root down by the largest increment,
and the part above the root up by it. The root of the first node, within reach of the present
pressure, is the next one.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.kernels.build import entry, kernel


def best_path(start: ArrayLike, path: ArrayLike, weight: ArrayLike, reach: ArrayLike) -> Array:
    """Return the best path at the nodes, shape (n_env, n_nodes).

    Parameters
    ----------
    start : array_like, shape (n_env,)
        Present value [unit of the path].
    path, weight : array_like, shape (n_env, n_nodes)
        Desired values [any unit], and weights of the squared errors, above 0.
    reach : array_like, shape (n_nodes,) or (n_env, n_nodes)
        Largest change [unit of the path] from the node before, above 0.
    """
    desired = np.ascontiguousarray(path, float)
    n, nodes = desired.shape
    made, knots = np.empty((n, nodes)), np.empty((3, 2 * nodes + 2))
    steps = np.broadcast_to(np.asarray(reach, float), desired.shape)
    given = (np.ascontiguousarray(part, float) for part in (start, weight, steps))
    first, weights, steps = given
    descend(first, desired, weights, steps, made, knots)
    return made


@entry
def descend(start: Any, path: Any, weight: Any, reach: Any, made: Any, work: Any) -> None:
    """Write the best path of every row; ``work`` is that of :func:`descend_row`."""
    for i in range(len(start)):
        descend_row(start[i], path[i], weight[i], reach[i], made[i], work)


@kernel
def descend_row(start: float, path: Any, weight: Any, reach: Any, made: Any, work: Any) -> None:
    """Write the best path of a row; ``work`` holds knots, slopes at them, and roots."""
    knots, slopes, roots = work[0], work[1], work[2]
    nodes = len(roots) // 2 - 1
    low, high, wide = path[0], path[0], 1.0
    for k in range(nodes):
        wide += reach[k]
        low, high = min(low, path[k]), max(high, path[k])
    knots[0], knots[1] = low - wide, high + wide
    slopes[0], slopes[1] = 0.0, 0.0
    count = 2
    for back in range(nodes):
        k = nodes - 1 - back
        for j in range(count):
            slopes[j] += weight[k] * (knots[j] - path[k])
        right = 1
        while right < count - 1 and slopes[right] < 0.0:
            right += 1
        rise = slopes[right] - slopes[right - 1]
        share = -slopes[right - 1] / rise if rise > 0.0 else 0.5
        share = max(0.0, min(1.0, share))
        root = knots[right - 1] + share * (knots[right] - knots[right - 1])
        roots[k] = root
        for j in range(count - right):  # from the right end, to make place for two knots
            m = count - 1 - j
            knots[m + 2], slopes[m + 2] = knots[m] + reach[k], slopes[m]
        for j in range(right):
            knots[j] -= reach[k]
        knots[right], slopes[right] = root - reach[k], 0.0
        knots[right + 1], slopes[right + 1] = root + reach[k], 0.0
        count += 2
    now = start
    for k in range(nodes):
        now = max(now - reach[k], min(now + reach[k], roots[k]))
        made[k] = now
