"""Screening of starting points: the decrease of the cost that a linear model predicts for each.

The effect of every starting point is simulated once, on the flexible base. Projected on what a
refit of a model cannot absorb, it predicts what the cause would gain over that model, so that a
search fits only the few starting points with a prospect.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from pam_envs.arrays import Array
from pam_envs.diagnosis.cause import Cause, Form
from pam_envs.diagnosis.decide.isolability import changes
from pam_envs.diagnosis.fit import least_squares as lsq
from pam_envs.diagnosis.fit.candidate import frees_for, initial_fits
from pam_envs.diagnosis.fit.starting_values import Grid

STARTS_OF_FORM = 2  # largest number of starting points of a form that are fitted
RIDGE = 1e-9  # relative regularisation of several amounts

Prediction = tuple[float, Cause, Form, tuple[float, ...]]
"""Predicted decrease of the cost, and the starting values of a form of a cause."""


@dataclass(frozen=True)
class Start:
    """A starting point of a form, with its rows of the simulated effects."""

    cause: Cause
    form: Form
    values: tuple[float, ...]
    rows: slice  # one, or one for each amount
    both: bool  # whether the amount may have the other sign
    fixed: bool  # a point of a grid, whose amount is not scaled


@dataclass(frozen=True)
class Screen:
    """Simulated effects of the starting points of all causes."""

    starts: tuple[Start, ...]
    traces: Array  # (n, m): changes of the residual on training samples

    @classmethod
    def make(
        cls,
        problem: lsq.Problem,
        family: lsq.PlantFamily,
        base: lsq.Fit,
        causes: Sequence[Cause],
    ) -> "Screen":
        """Simulate the starting points on a base.

        Those that are found in a residual (the time of an event) are left to each search.
        """
        names = {f.name for f in base.frees}
        starts: list[Start] = []
        columns: list[Array] = []
        here = lsq.column_of(base, base.z)
        for cause in causes:
            for form in cause.forms:
                if not any(t.amount and t.name not in names for t in form.terms):
                    continue
                for values in points_of(form):
                    made, both = _columns(family, form, values, here, names)
                    rows = slice(len(columns), len(columns) + len(made))
                    fixed = isinstance(form.search, Grid)
                    starts.append(Start(cause, form, tuple(values), rows, both, fixed))
                    columns += made
        return cls(tuple(starts), _traces(problem, here, columns))

    def predictions(
        self,
        problem: lsq.Problem,
        family: lsq.PlantFamily,
        base: lsq.Fit,
        shared: lsq.Shared,
        causes: Sequence[Cause],
    ) -> list[Prediction]:
        """Return the predicted decrease of the cost of a fit by each starting point, best first."""
        wanted = {cause.name for cause in causes}
        present = {f.name for f in base.frees}
        measure = _Projection.of(problem, base, shared)
        found: list[Prediction] = []
        left = measure.left(self.traces)
        for start in self.starts:
            known = any(t.name in present for t in start.form.terms if t.amount)
            if start.cause.name not in wanted or known:
                continue
            gain = _decrease(*left(start.rows), start.both, start.fixed)
            found.append((gain, start.cause, start.form, start.values))
        found += self._found_in_residual(problem, family, base, measure, causes)
        return sorted(found, key=lambda p: -p[0])

    def _found_in_residual(
        self,
        problem: lsq.Problem,
        family: lsq.PlantFamily,
        base: lsq.Fit,
        measure: "_Projection",
        causes: Sequence[Cause],
    ) -> Iterator[Prediction]:
        fits = [
            fit
            for cause in causes
            for form in cause.forms
            if form.search is not None and not isinstance(form.search, Grid)
            for fit in initial_fits(problem, family, base, cause, form)
        ]
        if not fits:
            return
        here = lsq.column_of(base, base.z)
        traces = _traces(problem, here, [lsq.column_of(f, f.z) for f in fits])
        left = measure.left(traces)
        for k, fit in enumerate(fits):
            cause, form = fit.label
            values = tuple(free.start for free in fit.frees[len(base.frees) :])
            yield _decrease(*left(slice(k, k + 1)), False, False), cause, form, values


def points_of(form: Form) -> list[Sequence[float]]:
    """Return the starting points of a form that do not depend on a residual."""
    if isinstance(form.search, Grid):
        return list(form.search.points)
    if form.search is not None:
        return []
    return list(form.starts)


def _columns(
    family: lsq.PlantFamily, form: Form, values: Sequence[float], here: Array, names: set[str]
) -> tuple[list[Array], bool]:
    """Return the columns of a starting point, one for each amount outside a grid."""
    pairs = zip(frees_for(family, form, values), form.terms, strict=True)
    own = [(free, term) for free, term in pairs if free.name not in names]
    frees = [free for free, _ in own]
    amounts = [free.place for free, term in own if term.amount]
    whole = here.copy()
    for free in frees:
        whole[free.place] = np.clip(free.start, free.low, free.high)
    both = any(f.low < family.column[f.place] < f.high for f in frees if f.place in amounts)
    if len(amounts) < 2 or isinstance(form.search, Grid):
        return [whole], both
    made = []
    for place in amounts:
        column = whole.copy()
        for other in amounts:
            if other != place:
                column[other] = here[other]
        made.append(column)
    return made, True


def _traces(problem: lsq.Problem, here: Array, columns: Sequence[Array]) -> Array:
    """Return the changes of the training residual by parameter columns, shape (n, m)."""
    none = np.zeros((0, problem.seen))
    return np.vstack([none, *(t[:, : problem.seen] for t in changes(problem, here, columns))])


@dataclass(frozen=True)
class _Projection:
    """Linear model of a fit: what a refit of its parameters absorbs.

    A parameter at a bound beyond which the cost decreases further stays there.
    """

    residual: Array
    shared: lsq.Shared
    inverse: Array  # of the normal matrix
    gradient: Array

    @classmethod
    def of(cls, problem: lsq.Problem, base: lsq.Fit, shared: lsq.Shared) -> "_Projection":
        """Return the projection at the coordinates of a fit."""
        residual, table = base.residual[: problem.seen], base.table
        gradient = shared.slopes @ residual + (base.z - table.start) * table.precision
        low, high = table.spans
        held = ((base.z <= low) & (gradient > 0.0)) | ((base.z >= high) & (gradient < 0.0))
        normal = shared.gram + np.diag(table.precision)
        scale = np.where(held, 0.0, 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-12)))
        inverse = np.linalg.pinv(normal * np.outer(scale, scale), rcond=RIDGE, hermitian=True)
        return cls(residual, shared, inverse * np.outer(scale, scale), gradient)

    def left(self, traces: Array) -> Callable[[slice], tuple[Array, Array]]:
        """Return a function from rows of traces to what a refit leaves of them.

        Half the slopes of the cost along the traces, shape (n,), and their products, (n, n).
        """
        across = traces @ self.shared.slopes.T
        pulls = traces @ self.residual - across @ (self.inverse @ self.gradient)
        taken = across @ self.inverse

        def of(rows: slice) -> tuple[Array, Array]:
            some = traces[rows]
            return pulls[rows], some @ some.T - taken[rows] @ across[rows].T

        return of


def _decrease(pull: Array, size: Array, both: bool, fixed: bool) -> float:
    """Return the decrease of the cost along traces with given slopes and products."""
    if fixed:
        return float(-2.0 * pull[0] - size[0, 0])
    if len(pull) == 1:
        if pull[0] >= 0.0 and not both:
            return 0.0
        return float(pull[0] ** 2 / max(size[0, 0], 1e-9))
    damped = size + RIDGE * np.trace(size) * np.eye(len(pull))
    return float(pull @ np.linalg.lstsq(damped, pull, rcond=None)[0])


def chosen(predictions: Sequence[Prediction], most: int) -> list[Prediction]:
    """Return the best predictions, at most :data:`STARTS_OF_FORM` of each form."""
    kept: list[Prediction] = []
    counts: dict[int, int] = {}
    for prediction in predictions:
        form = id(prediction[2])
        if len(kept) < most and counts.get(form, 0) < STARTS_OF_FORM:
            kept.append(prediction)
            counts[form] = counts.get(form, 0) + 1
    return kept
