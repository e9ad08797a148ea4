"""Least squares of the static models, many fits side by side.

Every lane is a fit of its own: another start, another repeat or load left out, another resampled
data set. A fit of a model with a term also starts from the optimum of the model without it, so it
can never end worse; that is checked, since a stuck optimiser must not pass for evidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pam_envs.diagnosis.static.cells import Cells
from pam_envs.diagnosis.static.models import Number, Term, Values, lags_of, numbers_of, predict

Array = NDArray[np.float64]

MOST_WEIGHT = 0.98
"""The plays together carry at most so much of the slope: the muscle follows a turn a little."""
ROUNDS = 60
STEP = 0.02
"""Step of a difference, over the parameter's meaningful size."""
GOOD = 1e-7
"""A lane is done when two steps lower its sum of squares by a smaller part."""


@dataclass(frozen=True)
class Fit:
    """Fitted lanes of one model.

    Attributes
    ----------
    terms : tuple of Term
        What the base was extended by.
    theta : ndarray, shape (L, n)
        Parameters, relative.
    cost : ndarray, shape (L,)
        Weighted sums of squares, relative.
    """

    terms: tuple[Term, ...]
    theta: Array
    cost: Array

    @property
    def numbers(self) -> tuple[Number, ...]:
        """The parameters, in the order of ``theta``."""
        return numbers_of(self.terms)

    def first(self, n: int) -> Fit:
        """Return the first ``n`` lanes."""
        return Fit(self.terms, self.theta[:n], self.cost[:n])

    def predict(self, cells: Cells) -> Array:
        """Return the contractions, shape (L, C), relative."""
        return predict(cells, _named(self.numbers, self.theta))


def _named(numbers: Sequence[Number], theta: Array) -> Values:
    return {number.name: theta[:, [i]] for i, number in enumerate(numbers)}


def _allowed(numbers: Sequence[Number], theta: Array) -> Array:
    """Return parameters moved into their bounds, the plays' weights below their sum's."""
    held = np.clip(theta, [n.low for n in numbers], [n.high for n in numbers])
    plays = [i for i, n in enumerate(numbers) if n.name.startswith("weight")]
    total = held[:, plays].sum(axis=1, keepdims=True)
    held[:, plays] *= np.minimum(1.0, MOST_WEIGHT / np.maximum(total, 1e-12))
    return np.asarray(held)


def jacobian(cells: Cells, numbers: Sequence[Number], theta: Array, at: Array) -> Array:
    """Return the derivatives of the predictions ``at`` by each parameter, (L, C, n), over sizes."""
    (lanes, n), size = theta.shape, np.array([number.size for number in numbers])
    inside = theta + STEP * size <= np.array([number.high for number in numbers])
    change = np.where(inside, STEP, -STEP)
    moved = (theta[:, None, :] + (change * size)[:, None, :] * np.eye(n)).reshape(lanes * n, n)
    start = np.repeat(at, n, axis=0)
    found = predict(cells, _named(numbers, moved), start, _moved_lags(cells, numbers, theta, moved))
    slopes = (found.reshape(lanes, n, -1) - at[:, None, :]) / change[..., None]
    return np.asarray(slopes.transpose(0, 2, 1))


def _moved_lags(cells: Cells, numbers: Sequence[Number], theta: Array, moved: Array) -> Array:
    """Return the plays' lags for parameters moved one by one: all but one move leave them alone."""
    if "bend" not in [number.name for number in numbers]:
        return cells.lags
    lanes, n = theta.shape
    lags = np.repeat(lags_of(cells, _named(numbers, theta)), n, axis=1)
    own = [number.name for number in numbers].index("bend") + n * np.arange(lanes)
    lags[:, own] = lags_of(cells, _named(numbers, moved[own]))
    return lags


def _steps(slopes: Array, miss: Array, damping: Array, shut: NDArray[np.bool_]) -> Array:
    """Return damped Gauss-Newton steps, parameters at a bound that they press on held."""
    slopes = np.where(shut[:, None, :], 0.0, slopes)
    normal = np.einsum("lci,lcj->lij", slopes, slopes)
    n = normal.shape[-1]
    diagonal = np.einsum("lii->li", normal)
    normal[:, range(n), range(n)] += damping[:, None] * diagonal + 1e-12 + shut
    return np.asarray(-np.linalg.solve(normal, np.einsum("lci,lc->li", slopes, miss)[..., None]))[
        ..., 0
    ]


def improve(
    cells: Cells,
    numbers: Sequence[Number],
    theta: Array,
    data: Array,
    weight: Array,
    good: float = GOOD,
) -> tuple[Array, Array]:
    """Lead every lane downhill to its nearest optimum.

    Parameters
    ----------
    cells : Cells
        Where to predict.
    numbers : sequence of Number
        The parameters.
    theta : ndarray, shape (L, n)
        Where to start.
    data, weight : ndarray, shape (L, C)
        What to fit, and the root of how much each cell counts.
    good : float
        See :data:`GOOD`.

    Returns
    -------
    theta : ndarray, shape (L, n)
    cost : ndarray, shape (L,)
        Never above that of the start.
    """
    sizes = np.array([n.size for n in numbers])
    low, high = np.array([n.low for n in numbers]), np.array([n.high for n in numbers])
    theta = _allowed(numbers, theta)
    made = predict(cells, _named(numbers, theta))
    cost = np.square(weight * (made - data)).sum(axis=1)
    damping, quiet = np.full(len(theta), 1e-3), np.zeros(len(theta), int)
    for _ in range(ROUNDS):
        go = np.flatnonzero((quiet < 2) & (damping < 1e8))
        if not go.size:
            break
        slopes = jacobian(cells, numbers, theta[go], made[go]) * weight[go][..., None]
        miss = weight[go] * (made[go] - data[go])
        pull = np.einsum("lci,lc->li", slopes, miss)
        shut = ((theta[go] <= low) & (pull > 0)) | ((theta[go] >= high) & (pull < 0))
        tried = _allowed(numbers, theta[go] + sizes * _steps(slopes, miss, damping[go], shut))
        found = predict(cells, _named(numbers, tried), made[go])
        after = np.square(weight[go] * (found - data[go])).sum(axis=1)
        better = after < cost[go]
        small = (cost[go] - after) < good * cost[go] + 1e-18
        quiet[go] = np.where(better & ~small, 0, np.where(better, quiet[go] + 1, quiet[go]))
        damping[go] *= np.where(better, 0.2, 8.0)
        damping[go] = np.maximum(damping[go], 1e-9)
        won = go[better]
        theta[won], made[won], cost[won] = tried[better], found[better], after[better]
    return theta, cost


def fit(
    cells: Cells,
    terms: Sequence[Term],
    data: Array,
    weight: Array,
    starts: Sequence[Array],
) -> Fit:
    """Fit a model to each lane's data, keeping the best of several starts.

    Parameters
    ----------
    cells : Cells
        Where to predict.
    terms : sequence of Term
        What the base is extended by.
    data, weight : ndarray, shape (L, C)
        What to fit, and the root of how much each cell counts.
    starts : sequence of ndarray, shape (n,) or (L, n)
        Where to start each lane.
    """
    numbers, lanes = numbers_of(terms), len(data)
    begin = np.concatenate([np.broadcast_to(s, (lanes, len(numbers))) for s in starts])
    times = len(starts)
    theta, cost = improve(
        cells, numbers, begin, np.tile(data, (times, 1)), np.tile(weight, (times, 1))
    )
    cost, theta = cost.reshape(times, lanes), theta.reshape(times, lanes, -1)
    best, lane = np.argmin(cost, axis=0), np.arange(lanes)
    return Fit(tuple(terms), theta[best, lane], cost[best, lane])


def base_starts() -> list[Array]:
    """Return starts of the base: soft and stiff beginnings, little and much friction."""
    middle = np.array([n.neutral for n in numbers_of(())])
    made = [middle]
    for force, length, friction in ((0.05, 0.1, 0.5), (0.4, 0.3, 1.0), (0.2, 0.05, 0.3)):
        other = middle.copy()
        other[:2], other[4:] = (force, length), middle[4:] * friction
        made.append(other)
    return made


def widened(parent: Fit, terms: Sequence[Term]) -> Array:
    """Return the parent's parameters in the order of a model with more terms, the new neutral."""
    known = dict(zip([n.name for n in parent.numbers], parent.theta.T, strict=True))
    lanes = len(parent.theta)
    columns = [known.get(n.name, np.full(lanes, n.neutral)) for n in numbers_of(terms)]
    return np.stack(columns, axis=1)


def extend(
    cells: Cells, parents: Sequence[Fit], terms: Sequence[Term], data: Array, weight: Array
) -> Fit:
    """Fit a model starting from all its parents' optima, with what is new at and off neutral.

    Raises
    ------
    RuntimeError
        If the fit is worse than a parent's: the optimiser failed, and nothing may be concluded.
    """
    starts = []
    for parent in parents:
        start = widened(parent, terms)
        old = {n.name for n in parent.numbers}
        starts.append(start)
        for sign in (1.0, -1.0):
            moved = start.copy()
            for i, number in enumerate(numbers_of(terms)):
                if number.name not in old:
                    moved[:, i] += sign * number.size
            starts.append(moved)
    made = fit(cells, terms, data, weight, starts)
    check_nested(parents, made)
    return made


def check_nested(parents: Sequence[Fit], child: Fit) -> None:
    """Raise if a model fits worse than one that it contains."""
    for parent in parents:
        worse = child.cost > parent.cost * (1.0 + 1e-6) + 1e-15
        if worse.any():
            raise RuntimeError(
                f"the model with {[t.form for t in child.terms]} fits worse "
                f"({child.cost[worse][0]:.6g}) than its part with {[t.form for t in parent.terms]} "
                f"({parent.cost[worse][0]:.6g}); fit it from more starts"
            )
