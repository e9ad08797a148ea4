"""Searches for the starting values of fits with many local optima.

A step or a drift starts where it explains most of the base's residual; an effect of events (a valve
that opens, a guide that breaks away) starts at the best points of a grid.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from pam_envs.arrays import Array
from pam_envs.diagnosis.fit.least_squares import Fit, PlantFamily, Problem, column_of

Starts = Sequence[tuple[float, ...]]

EARLIEST = 0.03  # share of a record at either end without candidates for a step: there it is a bias
APART = 0.02  # least distance of two candidates, as a share of the record
CANDIDATES = 2
LEAST_PART = 0.02  # least factor on the amounts of a grid


def step_starts(
    problem: Problem, family: PlantFamily, base: Fit, form: Any, output: int = 0
) -> Starts:
    """Return sizes [m], [Pa] and times [s] of steps of an output, best explanation first.

    A step at each sample is projected on the complement of the base's Jacobian and of the shapes
    that any reading may contain; cumulative sums give all samples in one pass.
    """
    samples = problem.measured.shape[1]
    good = problem.train & np.isfinite(problem.measured[output])
    residual = np.where(good, problem.rows(base.residual)[output], 0.0)
    slopes = base.slopes[:, : problem.seen]
    every = np.array([problem.rows(row)[output] for row in base.slopes])
    moved = np.where(good, every, 0.0)
    tails = np.cumsum(residual[::-1])[::-1]
    counts = np.cumsum(good[::-1])[::-1].astype(float)
    norm = counts - _taken(moved, np.einsum("im,jm->ij", slopes, slopes))
    if len(problem.shapes):
        # orthogonal to the Jacobian, since residuals are without them
        shapes = np.where(good, problem.shapes, 0.0)
        norm -= _taken(shapes, shapes @ shapes.T)
    edge = max(1, round(EARLIEST * samples))
    score = np.where(norm > 1.0, tails**2 / np.maximum(norm, 1.0), 0.0)
    score[:edge] = score[samples - edge :] = 0.0
    starts = []
    for _ in range(CANDIDATES):
        k = int(np.argmax(score))
        if score[k] <= 0.0:
            break
        size = float(-tails[k] / norm[k] * problem.noise[output])
        starts.append((size, float(problem.time[k])))
        reach = round(APART * samples)
        score[max(0, k - reach) : k + reach] = 0.0
    return starts


def _taken(rows: Array, gram: Array) -> Array:
    """Return the square of a step at each sample that rows (k, T) take up, (T,).

    ``gram`` are the inner products of the rows on all samples that a fit sees.
    """
    after = np.cumsum(rows[:, ::-1], axis=1)[:, ::-1]
    inverse = np.linalg.pinv(gram, rcond=1e-9)
    return np.asarray(np.einsum("it,ij,jt->t", after, inverse, after))


step_starts.trials = 100  # type: ignore[attr-defined]


def changes_of(output: int, durations: Sequence[float]) -> Callable[..., Starts]:
    """Return a search for changes of a reading about the best step, from each of ``durations`` [s].

    It gives size [m], [Pa], middle and duration [s].
    """

    def starts(problem: Problem, family: PlantFamily, base: Fit, form: Any) -> Starts:
        found = step_starts(problem, family, base, form, output)[:1]
        return [(size, middle, over) for size, middle in found for over in durations]

    starts.trials = 200  # type: ignore[attr-defined]
    return starts


@dataclass(frozen=True)
class Grid:
    """Search for the ``best`` points of a grid of the terms [SI], in one replay.

    Where amounts are 0 without the effect, their sizes are those that fit best if the effect is in
    proportion to them.
    """

    values: tuple[Sequence[float], ...]
    best: int = 3

    @property
    def points(self) -> list[tuple[float, ...]]:
        """All points of the grid."""
        return list(product(*self.values))

    @property
    def trials(self) -> int:
        """Number of points."""
        return int(np.prod([len(v) for v in self.values]))

    def __call__(self, problem: Problem, family: PlantFamily, base: Fit, form: Any) -> Starts:
        """Return the best points, best first."""
        points = self.points
        places = [family.free(t.name, log=False).place for t in form.terms]
        columns = np.tile(column_of(base, base.z), (len(points), 1))
        columns[:, places] = points
        residual, slopes = base.residual[: problem.seen], base.slopes[:, : problem.seen]
        traces = problem.residuals(columns)[:, : problem.seen] - residual
        inverse = np.linalg.pinv(slopes @ slopes.T, rcond=1e-9)
        moved, pull = slopes @ traces.T, slopes @ residual
        norms = np.sum(traces**2, axis=1) - np.sum(moved * (inverse @ moved), axis=0)
        slope = traces @ residual - moved.T @ (inverse @ pull)
        amounts = [t.amount for t in form.terms]
        neutral = family.column[np.array(places)[amounts]]
        sizes = np.ones(len(points))
        if not neutral.any():
            sizes = np.clip(-slope / np.maximum(norms, 1e-12), LEAST_PART, 1.0 / LEAST_PART)
        left = (2.0 * slope + sizes * norms) * sizes
        factors = np.where(amounts, sizes[:, None], 1.0)
        starts = np.array(points) * factors
        return [tuple(map(float, starts[k])) for k in np.argsort(left, kind="stable")[: self.best]]


def grid(*values: Sequence[float], best: int = 3) -> Grid:
    """Return the search of a grid given by the values of each term."""
    return Grid(values, best)
