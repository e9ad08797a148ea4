"""Levenberg-Marquardt fits of the static models, vectorised over hundreds of lanes.

Every lane is a fit of its own: another start, held-out part or bootstrap sample, so that the normal
equations of all lanes are solved at once (:mod:`pam_envs.diagnosis.fit.least_squares` tries several
dampings of few fits instead). A model with a term also starts from the optimum without it and must
not fit worse; this is checked, since a failed optimiser must not count as evidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pam_envs.diagnosis.arrays import Array
from pam_envs.diagnosis.static.cells import Cells
from pam_envs.diagnosis.static.models import Number, Term, Values, lags_of, numbers_of, predict

MOST_WEIGHT = 0.98
"""Largest sum of the play weights: the muscle follows a reversal a little."""
ROUNDS = 60
STEP = 0.02
"""Step of finite differences over the meaningful size of a parameter."""
GOOD = 1e-7
"""Relative decrease of the sum of squares below which two steps end a lane."""


@dataclass(frozen=True)
class Fit:
    """Fitted lanes of one model.

    Attributes
    ----------
    terms : tuple of Term
        Terms that extend the base.
    theta : ndarray, shape (L, n)
        Parameters in relative units.
    cost : ndarray, shape (L,)
        Weighted sums of squares in relative units.
    """

    terms: tuple[Term, ...]
    theta: Array
    cost: Array

    @property
    def numbers(self) -> tuple[Number, ...]:
        """Parameters in the order of ``theta``."""
        return numbers_of(self.terms)

    def first(self, n: int) -> Fit:
        """Return the first ``n`` lanes."""
        return Fit(self.terms, self.theta[:n], self.cost[:n])

    def predict(self, cells: Cells) -> Array:
        """Return the contractions in relative units, shape (L, C)."""
        return predict(cells, _named(self.numbers, self.theta))


def _named(numbers: Sequence[Number], theta: Array) -> Values:
    return {number.name: theta[:, [i]] for i, number in enumerate(numbers)}


def _allowed(numbers: Sequence[Number], theta: Array) -> Array:
    """Return parameters clipped to their bounds, and play weights to the bound of their sum."""
    held = np.clip(theta, [n.low for n in numbers], [n.high for n in numbers])
    plays = [i for i, n in enumerate(numbers) if n.name.startswith("weight")]
    total = held[:, plays].sum(axis=1, keepdims=True)
    held[:, plays] *= np.minimum(1.0, MOST_WEIGHT / np.maximum(total, 1e-12))
    return np.asarray(held)


def jacobian(cells: Cells, numbers: Sequence[Number], theta: Array, at: Array) -> Array:
    """Return derivatives of the predictions ``at`` by each parameter over its size, (L, C, n)."""
    (lanes, n), size = theta.shape, np.array([number.size for number in numbers])
    inside = theta + STEP * size <= np.array([number.high for number in numbers])
    change = np.where(inside, STEP, -STEP)
    moved = (theta[:, None, :] + (change * size)[:, None, :] * np.eye(n)).reshape(lanes * n, n)
    start = np.repeat(at, n, axis=0)
    found = predict(cells, _named(numbers, moved), start, _moved_lags(cells, numbers, theta, moved))
    slopes = (found.reshape(lanes, n, -1) - at[:, None, :]) / change[..., None]
    return np.asarray(slopes.transpose(0, 2, 1))


def _moved_lags(cells: Cells, numbers: Sequence[Number], theta: Array, moved: Array) -> Array:
    """Return the play lags of perturbed parameters, of which only "bend" changes them."""
    if "bend" not in [number.name for number in numbers]:
        return cells.lags
    lanes, n = theta.shape
    lags = np.repeat(lags_of(cells, _named(numbers, theta)), n, axis=1)
    own = [number.name for number in numbers].index("bend") + n * np.arange(lanes)
    lags[:, own] = lags_of(cells, _named(numbers, moved[own]))
    return lags


def _steps(slopes: Array, miss: Array, damping: Array, shut: NDArray[np.bool_]) -> Array:
    """Return damped Gauss-Newton steps with active bounds held."""
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
    """Fit every lane from its starting values by the Levenberg-Marquardt method.

    Parameters
    ----------
    cells : Cells
        Cells of the table.
    numbers : sequence of Number
        Parameters.
    theta : ndarray, shape (L, n)
        Starting values.
    data, weight : ndarray, shape (L, C)
        Data, and the square root of the weight of each cell.
    good : float
        Tolerance, see :data:`GOOD`.

    Returns
    -------
    theta : ndarray, shape (L, n)
        Fitted parameters.
    cost : ndarray, shape (L,)
        Sums of squares, never above those of the start.
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
    """Fit a model to the data of each lane, with the best of several starts.

    Parameters
    ----------
    cells : Cells
        Cells of the table.
    terms : sequence of Term
        Terms that extend the base.
    data, weight : ndarray, shape (L, C)
        Data, and the square root of the weight of each cell.
    starts : sequence of ndarray, shape (n,) or (L, n)
        Starting values.
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
    """Return starting values of the base: soft and stiff springs, little and much friction."""
    middle = np.array([n.neutral for n in numbers_of(())])
    made = [middle]
    for force, length, friction in ((0.05, 0.1, 0.5), (0.4, 0.3, 1.0), (0.2, 0.05, 0.3)):
        other = middle.copy()
        other[:2], other[4:] = (force, length), middle[4:] * friction
        made.append(other)
    return made


def widened(parent: Fit, terms: Sequence[Term]) -> Array:
    """Return the parent's parameters for a model with more terms, whose parameters are neutral."""
    known = dict(zip([n.name for n in parent.numbers], parent.theta.T, strict=True))
    lanes = len(parent.theta)
    columns = [known.get(n.name, np.full(lanes, n.neutral)) for n in numbers_of(terms)]
    return np.stack(columns, axis=1)


def extend(
    cells: Cells, parents: Sequence[Fit], terms: Sequence[Term], data: Array, weight: Array
) -> Fit:
    """Fit a model from the optima of its parents, with new parameters at and off neutral.

    Raises
    ------
    RuntimeError
        If the fit is worse than that of a parent: the optimiser failed.
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
    """Raise RuntimeError if a model fits worse than one that it contains."""
    for parent in parents:
        worse = child.cost > parent.cost * (1.0 + 1e-6) + 1e-15
        if worse.any():
            raise RuntimeError(
                f"the model with {[t.form for t in child.terms]} fits worse "
                f"({child.cost[worse][0]:.6g}) than its part with {[t.form for t in parent.terms]} "
                f"({parent.cost[worse][0]:.6g}); fit it from more starts"
            )
