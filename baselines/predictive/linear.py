"""Linear predictive control with preview, on any linear model in discrete time (rawlings2017).

    z_(k+1) = A z_k + B u_k,   y_k = C z_k
    min  sum_(k=1..N) (y_k - r_k)^2 + weight (u_(k-1) - u_(k-2))^2  +  terminal cost

The change of the input is the decision, the input a state: the last input is held without cost, and
a constant reference is reached without offset if the model is exact. The terminal cost is that of
the infinite horizon with the last reference held (Riccati equation, python-control): without limits
the first input is that of the linear-quadratic regulator, for every horizon.

Limits of the input are kept by projected gradient steps (FISTA, beck2009), each row by itself.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pam_envs.arrays import Array
from pam_envs.kernels.build import entry

STEPS = 60
"""Projected gradient steps; none are needed where no limit is active."""


@dataclass(frozen=True)
class LinearPredictor:
    """Condensed problem over a horizon of N periods.

    The cost of inputs ``u``, shape (N,), is ``u' curve u / 2 + u' force``, and

        force = by_state z + by_last u_(-1) - by_reference r

    Attributes
    ----------
    curve, by_reference : ndarray, shape (N, N)
        Curvature of the cost, and its derivative by the references [units of the model].
    by_state : ndarray, shape (N, n)
        Derivative by the state [units of the model].
    by_last : ndarray, shape (N, 1)
        Derivative by the last input [units of the model].
    """

    curve: Array
    by_state: Array
    by_last: Array
    by_reference: Array

    @cached_property
    def _solution(self) -> Array:
        return np.asarray(np.linalg.inv(self.curve), float)

    @cached_property
    def _rate(self) -> float:
        return 1.0 / float(np.linalg.norm(self.curve, 2))

    def inputs(
        self, state: Array, last: Array, reference: Array, low: Array | float, high: Array | float
    ) -> Array:
        """Return the best inputs, shape (n_env, N).

        Parameters
        ----------
        state : ndarray, shape (n_env, n)
            Present state [units of the model].
        last : ndarray, shape (n_env,)
            Present input [unit of the input].
        reference : ndarray, shape (n_env, N)
            References of the periods 1 to N [unit of the output].
        low, high : float or ndarray, shape (n_env,)
            Limits of the input [unit of the input].
        """
        force = _product(self.by_state, state) + _product(self.by_last, last[:, None])
        force = force - _product(self.by_reference, reference)
        lowest, highest = np.empty((2, len(last)))
        lowest[:], highest[:] = low, high
        found = -_product(self._solution, force)
        least, most = found.min(axis=1), found.max(axis=1)
        limited = np.flatnonzero((least < lowest) | (most > highest))
        if len(limited):
            inputs, work = found[limited], np.empty((3, found.shape[1]))
            ends = (lowest[limited], highest[limited])
            improve_rows(self.curve, force[limited], self._rate, *ends, inputs, work)
            found[limited] = inputs
        return found


@entry
def improve_rows(
    curve: Array, force: Array, rate: float, low: Array, high: Array, inputs: Array, work: Array
) -> None:
    """Lead inputs, shape (rows, N), to the best ones within limits, (rows,), in ``STEPS`` steps.

    ``work`` holds the best inputs so far, those ahead of them, and the slopes of the cost.
    """
    best, ahead, slope, n = work[0], work[1], work[2], len(curve)
    for r in range(len(inputs)):
        for i in range(n):
            best[i] = ahead[i] = min(max(inputs[r, i], low[r]), high[r])
        share = 1.0
        for _ in range(STEPS):
            for i in range(n):
                slope[i] = force[r, i]
            for j in range(n):  # the curvature is symmetric
                for i in range(n):
                    slope[i] = slope[i] + curve[j, i] * ahead[j]
            grown = 0.5 * (1.0 + math.sqrt(1.0 + 4.0 * share * share))
            more = (share - 1.0) / grown
            for i in range(n):
                after = min(max(ahead[i] - rate * slope[i], low[r]), high[r])
                ahead[i] = after + more * (after - best[i])
                best[i] = after
            share = grown
        for i in range(n):
            inputs[r, i] = best[i]


def _product(matrix: Array, rows: Array) -> Array:
    """Return ``matrix @ row`` for every row, in an order that depends on no other row."""
    return np.asarray(np.add.reduce(matrix * rows[:, None, :], axis=2))


def linear_predictor(a: Array, b: Array, c: Array, weight: float, horizon: int) -> LinearPredictor:
    """Return the condensed problem of a model; see the module.

    Parameters
    ----------
    a, b, c : ndarray, shapes (n, n), (n,), (n,)
        Model of one input and one output, which defines the units.
    weight : float
        Weight of a squared change of the input over that of a squared error, above 0.
    horizon : int
        Periods N, at least 1.
    """
    n, steps = len(b), np.arange(horizon)
    powers = [np.eye(n)]
    for _ in range(horizon):
        powers.append(a @ powers[-1])
    pulse = np.array([power @ b for power in powers])  # (N + 1, n)
    lags = steps[:, None] - steps
    ends = np.where((lags >= 0)[..., None], pulse[np.maximum(lags, 0)], 0.0)  # (N, N, n)
    outputs, free = ends @ c, np.array([c @ power for power in powers[1:]])
    changes = np.eye(horizon) - np.eye(horizon, k=-1)
    first = np.eye(horizon)[0]
    curve = outputs.T @ outputs + weight * changes.T @ changes
    by_state, by_reference = outputs.T @ free, outputs.T.copy()
    by_last = -weight * first[:, None]
    # terminal cost in (z - z_r, u - u_r): rest at the last reference
    cost, rest = _infinite_horizon(a, b, c, weight)
    to_end = np.vstack([ends[-1].T, np.eye(horizon)[-1]])  # (n + 1, N)
    from_state = np.vstack([powers[-1], np.zeros(n)])
    curve = curve + to_end.T @ cost @ to_end
    by_state = by_state + to_end.T @ cost @ from_state
    by_reference[:, -1] += to_end.T @ cost @ rest
    return LinearPredictor(curve, by_state, by_last, by_reference)


def _infinite_horizon(a: Array, b: Array, c: Array, weight: float) -> tuple[Array, Array]:
    """Return the cost matrix of the state and input, and their rest for an output of 1."""
    import control

    n = len(b)
    whole = np.block([[a, b[:, None]], [np.zeros((1, n)), np.ones((1, 1))]])
    change = np.append(b, 1.0)[:, None]
    seen = np.append(c, 0.0)[:, None]
    # the output is weighed at the end of a period: a further state-to-output step
    ahead = whole.T @ seen
    moved = change.T @ seen
    cost, _, _ = control.dare(
        whole, change, ahead @ ahead.T, weight + moved @ moved.T, ahead @ moved.T
    )
    gain = float(c @ np.linalg.solve(np.eye(n) - a, b))
    rest = np.append(np.linalg.solve(np.eye(n) - a, b), 1.0) / gain
    return np.asarray(cost), np.asarray(rest)
