"""Levenberg-Marquardt fits of the static models, vectorised over hundreds of lanes.

Every lane is a fit of its own: another start, held-out part or bootstrap sample, so that the normal
equations of all lanes are solved at once (:mod:`pam_envs.diagnosis.fit.least_squares` tries several
dampings of few fits instead). A model with a term also starts from the optimum without it and must
not fit worse; this is checked, since a failed optimiser must not count as evidence.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pam_envs.arrays import Array
from pam_envs.diagnosis.static.cells import Cells
from pam_envs.diagnosis.static.models import Number, Term, lags_of, numbers_of, predict

MOST_WEIGHT = 0.98  # largest sum of the play weights: the muscle follows a reversal a little
ROUNDS = 60
STEP = 0.02  # step of finite differences over the meaningful size of a parameter
GOOD = 1e-7  # relative decrease of the sum of squares below which two steps end a lane


@dataclass(frozen=True)
class Fit:
    """Fitted lanes of one model: relative parameters (L, n), weighted sums of squares (L,)."""

    terms: tuple[Term, ...]
    theta: Array
    cost: Array

    @property
    def numbers(self) -> tuple[Number, ...]:
        """Parameters in the order of ``theta``."""
        return numbers_of(self.terms)

    @property
    def names(self) -> list[str]:
        """Names of the parameters."""
        return [number.name for number in self.numbers]

    def values(self) -> dict[str, Array]:
        """Return the fit to all data (the first lane)."""
        return _named(self.numbers, self.theta[:1])

    def first(self, n: int) -> "Fit":
        """Return the first ``n`` lanes."""
        return Fit(self.terms, self.theta[:n], self.cost[:n])

    def predict(self, cells: Cells) -> Array:
        """Return the contractions in relative units, shape (L, C)."""
        return predict(cells, _named(self.numbers, self.theta))


def _named(numbers: Sequence[Number], theta: Array) -> dict[str, Array]:
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
    names = [number.name for number in numbers]
    if "bend" not in names:
        return cells.lags
    lanes, n = theta.shape
    lags = np.repeat(lags_of(cells, _named(numbers, theta)), n, axis=1)
    own = names.index("bend") + n * np.arange(lanes)
    lags[:, own] = lags_of(cells, _named(numbers, moved[own]))
    return lags


def improve(
    cells: Cells,
    numbers: Sequence[Number],
    theta: Array,
    data: Array,
    weight: Array,
    good: float = GOOD,
) -> tuple[Array, Array]:
    """Fit every lane from starting values (L, n) by the Levenberg-Marquardt method.

    ``data`` and ``weight`` (the square root of the weight of each cell) have the shape (L, C),
    ``good`` is a tolerance as :data:`GOOD`. Returns parameters and sums of squares, which are never
    above those of the start.
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
        slopes = np.where(shut[:, None, :], 0.0, slopes)  # active bounds are held
        normal = np.einsum("lci,lcj->lij", slopes, slopes)
        n, diagonal = len(numbers), np.einsum("lii->li", normal)
        normal[:, range(n), range(n)] += damping[go, None] * diagonal + 1e-12 + shut
        step = -np.linalg.solve(normal, np.einsum("lci,lc->li", slopes, miss)[..., None])[..., 0]
        tried = _allowed(numbers, theta[go] + sizes * step)
        found = predict(cells, _named(numbers, tried), made[go])
        after = np.square(weight[go] * (found - data[go])).sum(axis=1)
        better = after < cost[go]
        small = (cost[go] - after) < good * cost[go] + 1e-18
        quiet[go] = np.where(better & ~small, 0, np.where(better, quiet[go] + 1, quiet[go]))
        damping[go] = np.maximum(damping[go] * np.where(better, 0.2, 8.0), 1e-9)
        won = go[better]
        theta[won], made[won], cost[won] = tried[better], found[better], after[better]
    return theta, cost


def fit(
    cells: Cells, terms: Sequence[Term], data: Array, weight: Array, starts: Sequence[Array]
) -> Fit:
    """Fit a model to the data of each lane (L, C), with the best of several starts (n,), (L, n)."""
    numbers, lanes, times = numbers_of(terms), len(data), len(starts)
    begin = np.concatenate([np.broadcast_to(s, (lanes, len(numbers))) for s in starts])
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
        made.append(np.concatenate([(force, length), middle[2:4], middle[4:] * friction]))
    return made


def extend(
    cells: Cells, parents: Sequence[Fit], terms: Sequence[Term], data: Array, weight: Array
) -> Fit:
    """Fit a model from its parents, new parameters at and off neutral; RuntimeError if worse."""
    starts, numbers = [], numbers_of(terms)
    for parent in parents:
        known = dict(zip(parent.names, parent.theta.T, strict=True))
        fresh = np.array([0.0 if n.name in known else n.size for n in numbers])
        columns = [known.get(n.name, np.full(len(parent.theta), n.neutral)) for n in numbers]
        start = np.stack(columns, axis=1)
        starts += [start, start + fresh, start - fresh]
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
