"""Comparison of static models on held-out repeats and loads, with block-robust tests.

A held-out repeat tests a fit against noise, a held-out load tests the load law. Model errors of
neighbouring cells are dependent, so that tests and intervals use blocks of cells.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import stats

from pam_envs.arrays import Array
from pam_envs.diagnosis.static.cells import Cells
from pam_envs.diagnosis.static.fit import Fit, base_starts, extend, fit, improve, jacobian
from pam_envs.diagnosis.static.models import Term, predict

Interval = tuple[float, float]

PRESSURE_FOLDS = 6  # number of folds of cells without repeats
DRAWS, REFITS = 2000, 200
"""Bootstrap samples for an interval of an error, and refits for one of a parameter."""
REFIT_GOOD = 1e-5  # tolerance of such a refit, see :func:`improve`


@dataclass(frozen=True)
class Lanes:
    """Data sets of every model, fitted side by side: all data, then each fold left out."""

    kind: str  # "repeats", or "pressures" with one repeat
    data: Array  # means of the training data, (1 + F + G, C)
    weight: Array  # roots of their numbers of readings, (1 + F + G, C)
    target: Array  # held-out readings of the first F folds, (F, C), NaN elsewhere
    loads: int  # number G of loads that are held out in turn, none of fewer than three


def _folds(cells: Cells, root: Array) -> tuple[str, Array, Array, Array]:
    """Return kind, data, weights and targets of the held-out repeats, or cells without repeats."""
    if np.all(cells.counts[cells.used] > 1):
        rows = range(len(cells.readings))
        kept = [np.delete(cells.readings, row, axis=0) for row in rows]
        data = np.array([np.nanmean(k, axis=0) for k in kept])
        weight = np.array([np.sqrt(np.isfinite(k).sum(axis=0)) * cells.used for k in kept])
        return "repeats", data, weight, np.where(cells.used, cells.readings, np.nan)
    place = np.cumsum(cells.used) % PRESSURE_FOLDS
    out = np.array([(place == k) & cells.used for k in range(PRESSURE_FOLDS)])
    data = np.broadcast_to(cells.mean, out.shape)
    return "pressures", data, root * ~out, np.where(out, data, np.nan)


@dataclass(frozen=True)
class Model:
    """A fitted model with its errors on held-out data; the fit has the lanes of :class:`Lanes`."""

    fit: Fit
    residual: Array  # mean reading minus model fitted to all data [mm], (C,), NaN if not used
    held: Array  # mean squared error of each cell on held-out data [mm2], (C,)
    load_errors: Array  # mean reading minus model on a held-out load [mm], (G, C), NaN elsewhere

    @property
    def terms(self) -> tuple[Term, ...]:
        """Terms that extend the base."""
        return self.fit.terms

    @property
    def rms(self) -> float:
        """Root mean square residual over the cells [mm]."""
        return float(np.sqrt(np.nanmean(np.square(self.residual))))

    @property
    def held_out(self) -> float:
        """Root mean square error on held-out data [mm]."""
        return float(np.sqrt(np.nanmean(self.held)))

    @property
    def by_load(self) -> Array:
        """Root mean square error on each held-out load [mm], shape (G,)."""
        return np.asarray(np.sqrt(np.nanmean(np.square(self.load_errors), axis=1)))

    @property
    def left_load(self) -> float:
        """Mean of :attr:`by_load`; NaN with fewer than three loads."""
        return float(self.by_load.mean()) if len(self.load_errors) else float("nan")


@dataclass(frozen=True)
class Study:
    """A table with its folds and fitted models."""

    cells: Cells
    seed: int = 0

    @cached_property
    def lanes(self) -> Lanes:
        """Data sets with the folds."""
        cells = self.cells
        mean, root = cells.mean, np.sqrt(cells.counts) * cells.used
        kind, data, weight, target = _folds(cells, root)
        groups = range(len(cells.loads)) if len(cells.loads) >= 3 else range(0)
        without = np.array([root * (cells.group != g) for g in groups]).reshape(-1, len(mean))
        return Lanes(
            kind,
            np.concatenate([mean[None], data, np.broadcast_to(mean, without.shape)]),
            np.concatenate([root[None], weight, without]),
            target,
            len(without),
        )

    @cached_property
    def base(self) -> Model:
        """Load-blind model."""
        lanes = self.lanes
        return self.judged(fit(self.cells, (), lanes.data, lanes.weight, base_starts()))

    def extended(self, parents: Sequence[Model], terms: Sequence[Term], n: int = 0) -> Model:
        """Return a model that contains all ``parents``, fitted to the first ``n`` lanes or all."""
        lanes, n = self.lanes, n or len(self.lanes.data)
        fits = [parent.fit.first(n) for parent in parents]
        return self.judged(extend(self.cells, fits, terms, lanes.data[:n], lanes.weight[:n]))

    def refitted(self, terms: Sequence[Term], start: Array) -> Model:
        """Return a model fitted from one start, shape (n,) or (lanes, n)."""
        lanes = self.lanes
        return self.judged(fit(self.cells, terms, lanes.data, lanes.weight, [start]))

    def judged(self, fitted: Fit) -> Model:
        """Return a fit with its errors."""
        cells, lanes, mm = self.cells, self.lanes, self.cells.millimetres
        made = fitted.predict(cells)
        inside = 1 + len(lanes.target)
        if len(made) < len(lanes.data):
            made = np.concatenate([made[:1], np.full((len(lanes.data) - 1, made.shape[1]), np.nan)])
        held = np.square(lanes.target - made[1:inside])
        missed = np.where(cells.used, cells.mean - made, np.nan) * mm
        out = np.arange(lanes.loads)[:, None] == cells.group
        left = np.where(out, missed[inside:], np.nan)
        return Model(fitted, missed[0], mm**2 * _finite_mean(held), left)


def _finite_mean(values: Array) -> Array:
    """Return the mean of the finite values of each column, NaN without any."""
    seen = np.isfinite(values).sum(axis=0)
    return np.where(seen > 0, np.nansum(values, axis=0) / np.maximum(seen, 1), np.nan)


def blocked(cells: Cells, values: Array) -> Array:
    """Return sums over blocks, shape (..., blocks), of values of cells, shape (..., C)."""
    n = int(cells.block.max()) + 1
    member = np.zeros((len(cells.block), n))
    used = np.flatnonzero(cells.used)
    member[used, cells.block[used]] = 1.0
    return np.asarray(np.where(cells.used, values, 0.0) @ member)


def _resampled(study: Study, values: Array, name: str) -> Array:
    """Return sums over resampled blocks, shape (DRAWS, ...), of values of the cells (..., C)."""
    sums = blocked(study.cells, values)
    n = sums.shape[-1]
    random = np.random.default_rng([study.seed, *name.encode()])
    counts = random.multinomial(n, np.full(n, 1.0 / n), DRAWS)
    drawn = counts @ np.moveaxis(sums, -1, 0).reshape(n, -1)
    return np.asarray(drawn).reshape(DRAWS, *sums.shape[:-1])


def interval(draws: Array) -> Interval:
    """Return the 95 % interval of samples."""
    low, high = np.quantile(draws, [0.025, 0.975])
    return float(low), float(high)


def error_interval(study: Study, squares: Array) -> Interval:
    """Return the 95 % block-bootstrap interval of the root mean of squares (C,)."""
    both = np.array([np.nan_to_num(squares), np.isfinite(squares)])
    sums = _resampled(study, both, "error")
    return interval(np.sqrt(sums[:, 0] / np.maximum(sums[:, 1], 1e-12)))


def gain(study: Study, before: Model, after: Model) -> tuple[float, Interval]:
    """Return the log ratio of mean squared held-out errors, and its paired 95 % interval."""
    both = np.array([before.held, after.held])
    sums = _resampled(study, both, "gain")
    value = float(np.log(np.nanmean(before.held) / np.nanmean(after.held)))
    return value, interval(np.log(sums[:, 0] / sums[:, 1]))


def load_cut(study: Study, before: Model, after: Model) -> tuple[float, Interval]:
    """Return the relative decrease of the mean error on held-out loads, and its 95 % interval."""
    errors = np.array([before.load_errors, after.load_errors])
    both = np.array([np.nan_to_num(np.square(errors)), np.isfinite(errors)])
    sums = _resampled(study, both, "loads")
    means = np.sqrt(sums[:, 0] / np.maximum(sums[:, 1], 1e-12)).mean(axis=-1)
    return 1.0 - after.left_load / before.left_load, interval(1.0 - means[:, 1] / means[:, 0])


def slopes(study: Study, model: Model) -> Array:
    """Return the weighted Jacobian of the fit to all data, shape (C, n)."""
    fitted = model.fit
    at = predict(study.cells, fitted.values())
    found = jacobian(study.cells, fitted.numbers, fitted.theta[:1], at)
    return np.asarray(found[0] * study.lanes.weight[0][:, None])


def beyond(base: Array, columns: Array) -> Array:
    """Return the projection of columns on the complement of the span of ``base``."""
    u, s, _ = np.linalg.svd(base, full_matrices=False)
    u = u[:, s > 1e-7 * s[0]]
    return np.asarray(columns - u @ (u.T @ columns))


def spread(study: Study, model: Model) -> Array:
    """Return weighted residuals (C,), corrected for the degrees of freedom of the fit."""
    used, n = study.cells.used, len(model.fit.numbers)
    free = max(1.0, float(used.sum()) - n)
    residual = np.nan_to_num(model.residual) * study.lanes.weight[0]
    return np.asarray(residual * np.sqrt(used.sum() / free))


def p_value(study: Study, parent: Model, child: Model) -> float:
    """Return the p-value of the terms that a child adds to its parent.

    F statistic of the added directions, orthogonal to the parent's, with the scatter estimated
    from blocks (cluster-robust, for dependent neighbours) and from cells (for blocks that agree by
    chance); the larger of both p-values.
    """
    old, names = set(parent.fit.names), child.fit.names
    steep = slopes(study, child)
    fresh = [i for i, name in enumerate(names) if name not in old]
    rest = [i for i, name in enumerate(names) if name in old]
    added, _ = np.linalg.qr(beyond(steep[:, rest], steep[:, fresh]))
    better = float(parent.fit.cost[0] - child.fit.cost[0]) * study.cells.millimetres**2
    scores = blocked(study.cells, added.T * spread(study, child))
    scatter = scores @ scores.T
    q, blocks = len(fresh), scores.shape[1]
    free = int(study.cells.used.sum()) - len(names)
    if better <= 1e-12 or np.trace(scatter) <= 0.0 or blocks <= q + 1 or free < 1:
        return 1.0
    robust = stats.f.sf(better / np.trace(scatter), q, blocks - q)
    left_over = float(child.fit.cost[0]) * study.cells.millimetres**2 / free
    return float(max(robust, stats.f.sf(better / q / left_over, q, free)))


def parameter_draws(study: Study, model: Model) -> Array:
    """Return parameters of a wild block bootstrap with random signs, shape (REFITS, n)."""
    cells, weight = study.cells, study.lanes.weight[:1]
    random = np.random.default_rng([study.seed, 7])
    signs = random.choice([-1.0, 1.0], (REFITS, int(cells.block.max()) + 1))
    root = np.where(weight[0] > 0.0, weight[0], 1.0)
    moved = signs[:, np.maximum(cells.block, 0)] * spread(study, model) / root
    made = model.fit.predict(cells)[0]
    data = made + moved / cells.millimetres
    begin = np.broadcast_to(model.fit.theta[0], (REFITS, len(model.fit.numbers)))
    weights = np.broadcast_to(weight, data.shape)
    return improve(cells, model.fit.numbers, begin, data, weights, REFIT_GOOD)[0]


def lack_of_fit(study: Study, model: Model) -> tuple[float, float, float]:
    """Return F, p-value and size [mm] of the lack of fit against the repeats.

    The size is the part of the residual beyond the scatter of a cell's mean; all are NaN without
    repeats.
    """
    cells, weight = study.cells, study.lanes.weight[0]
    pure, free = pure_error(cells)
    left = max(1.0, float(cells.used.sum()) - len(model.fit.numbers))
    if np.isnan(pure):
        return float("nan"), float("nan"), float("nan")
    mean_square = float(np.nansum(np.square(weight * model.residual))) / left
    per_cell = float(np.mean(cells.counts[cells.used]))
    size = np.sqrt(max(0.0, mean_square - pure**2) / per_cell)
    ratio = mean_square / pure**2
    return ratio, float(stats.f.sf(ratio, left, free)), float(size)


def pure_error(cells: Cells) -> tuple[float, int]:
    """Return the scatter of repeats [mm], NaN without differing ones, and its freedom."""
    apart = (cells.readings - cells.mean)[:, cells.used] * cells.millimetres
    free = int(np.maximum(cells.counts[cells.used] - 1, 0).sum())
    size = float(np.sqrt(np.nansum(apart**2) / max(free, 1)))
    return size if size > 1e-9 else float("nan"), free


def floor(study: Study) -> Array:
    """Return mean squared differences [mm2] of repeats from the others (C,), NaN without."""
    cells, lanes = study.cells, study.lanes
    if lanes.kind != "repeats" or np.isnan(pure_error(cells)[0]):
        return np.full(len(cells.load), np.nan)
    apart = np.square(lanes.target - lanes.data[1 : 1 + len(lanes.target)])
    return np.asarray(_finite_mean(apart) * cells.millimetres**2)
