"""Least squares on simulation error, many fits side by side.

A *column* holds all parameters of a plant, a *free* is one that a fit moves. Every perturbed or
tried parameter set is a lane of one replay. Fits that share their first free parameters (the
base) and differ in a few more (a cause) share the base's Jacobian, taken once at the base's
optimum: near it the steps are nearly Gauss-Newton's, at a tenth of the simulations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
DAMPINGS = (1e-10, 1e-8, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0)
"""Levenberg-Marquardt dampings tried side by side: each is a lane, so many cost little."""
FEW_DAMPINGS = (1e-6, 1e-3, 0.3)
LEAST_DAMPING = 1e-9
"""Keeps the normal equations regular."""
STALLED = 1e3
"""By how much dampings grow where none of them helped."""
REACH_LOG, REACH = 1.0, 30.0
"""Longest steps, in internal coordinates."""
WORST = 1e4
"""Largest weighted residual, and that of a simulation that broke down."""


@dataclass(frozen=True)
class Free:
    """A parameter that a fit may move.

    Attributes
    ----------
    name : str
        Dotted name.
    place : int
        Where it stands in the column.
    low, high : float
        Bounds, in its unit.
    scale : float
        Size of a meaningful change, in its unit; ignored for logarithmic ones.
    log : bool
        Fitted on a logarithmic scale.
    start : float
        Where a fit begins.
    prior : float
        Standard deviation of a weak prior about ``start``, in internal units (infinite: none).
    """

    name: str
    place: int
    low: float
    high: float
    scale: float
    log: bool = False
    start: float = 0.0
    prior: float = np.inf

    def inner(self, value: float) -> float:
        """Return the internal coordinate of a value."""
        return float(np.log(value)) if self.log else value / self.scale

    def outer(self, z: Array) -> Array:
        """Return values, within the bounds, of internal coordinates."""
        raw = np.exp(np.clip(z, -700, 700)) if self.log else z * self.scale
        return np.clip(raw, self.low, self.high)

    @property
    def span(self) -> tuple[float, float]:
        """The bounds as internal coordinates."""
        return self.inner(max(self.low, 1e-300) if self.log else self.low), self.inner(self.high)

    @property
    def step(self) -> float:
        """Difference step, as an internal coordinate."""
        return 0.01 if self.log else 0.02


@dataclass(frozen=True)
class Shared:
    """The Jacobian by the leading parameters of several fits, taken once.

    Attributes
    ----------
    slopes : ndarray, shape (n, m)
        Over the training samples.
    gram : ndarray, shape (n, n)
        ``slopes @ slopes.T``.
    """

    slopes: Array
    gram: Array


@dataclass
class Fit:
    """A fit on its way, or done.

    Attributes
    ----------
    frees : tuple of Free
        The base's first.
    z : ndarray, shape (n,)
        Internal coordinates.
    column : ndarray
        All other parameters.
    cost : float
        Sum of squares over the training samples, of residuals over noise, priors included.
    residual : ndarray, shape (m,)
        Weighted residuals, simulation minus measurement, in the problem's order.
    slopes : ndarray, shape (k, m)
        Derivative of the residuals by the last k coordinates.
    shared : Shared or None
        The derivative by those before them.
    begins : dict
        Where fits of further causes begin, by form.
    """

    frees: tuple[Free, ...]
    z: Array
    column: Array
    cost: float = np.inf
    residual: Array = field(default_factory=lambda: np.zeros(0))
    slopes: Array = field(default_factory=lambda: np.zeros((0, 0)))
    shared: Shared | None = None
    damping: float = 1.0
    done: bool = False
    label: Any = None
    begins: dict[Any, Any] = field(default_factory=dict, repr=False)

    @property
    def held(self) -> int:
        """How many leading parameters keep the Jacobian they have."""
        return 0 if self.shared is None else len(self.shared.gram)

    def values(self) -> dict[str, float]:
        """Return the fitted values by name."""
        return {f.name: float(f.outer(z)) for f, z in zip(self.frees, self.z, strict=True)}


@dataclass(frozen=True)
class Problem:
    """What fits have in common.

    Weighted residuals of all channels stand in one vector, the training samples first.

    Attributes
    ----------
    simulate : callable
        From columns (n, p) to outputs (channels, T, n).
    measured : ndarray, shape (channels, T)
        NaN where there is no reading.
    noise : ndarray, shape (channels,)
        Standard deviation of each channel's noise.
    train : ndarray of bool, shape (T,)
        Samples that fits see.
    time : ndarray, shape (T,)
        [s].
    tie : callable
        Completes columns whose parameters depend on others, in place.
    """

    simulate: Callable[[Array], Array]
    measured: Array
    noise: Array
    train: NDArray[np.bool_]
    time: Array
    tie: Callable[[Array], None] = lambda columns: None

    @cached_property
    def order(self) -> NDArray[np.int64]:
        """Place in the flattened (channels, T) of each entry of a residual vector."""
        mask = np.tile(self.train, len(self.measured))
        return np.concatenate([np.flatnonzero(mask), np.flatnonzero(~mask)])

    @cached_property
    def seen(self) -> int:
        """How many leading entries of a residual vector are training samples."""
        return int(self.train.sum()) * len(self.measured)

    def residuals(self, columns: Array) -> Array:
        """Return weighted residuals, shape (n, channels * T); zero where there is no reading."""
        self.tie(columns)
        outputs = self.simulate(columns)
        outputs -= self.measured[:, :, None]
        outputs /= self.noise[:, None, None]
        np.clip(outputs, -WORST, WORST, out=outputs)
        bad = ~np.isfinite(outputs)
        if bad.any():
            outputs[bad] = WORST
            outputs[np.isnan(self.measured)] = 0.0
        flat = outputs.transpose(2, 0, 1).reshape(len(columns), -1)
        return np.take(flat, self.order, axis=1)

    def rows(self, residual: Array) -> Array:
        """Return a residual vector by channel and sample, shape (channels, T)."""
        out = np.empty(residual.size)
        out[self.order] = residual
        return out.reshape(self.measured.shape)


def column_of(fit: Fit, z: Array) -> Array:
    """Return the column at other internal coordinates."""
    column = fit.column.copy()
    for free, value in zip(fit.frees, z, strict=True):
        column[free.place] = free.outer(value)
    return column


def prior_cost(fit: Fit, z: Array) -> float:
    """Return what the weak priors add to the cost."""
    return float(
        sum(
            ((v - f.inner(f.start)) / f.prior) ** 2
            for f, v in zip(fit.frees, z, strict=True)
            if np.isfinite(f.prior)
        )
    )


def _cost(problem: Problem, fit: Fit, z: Array, residual: Array) -> float:
    seen = residual[: problem.seen]
    return float(np.einsum("i,i", seen, seen)) + prior_cost(fit, z)


def evaluate(problem: Problem, fits: Sequence[Fit]) -> None:
    """Simulate fits where they stand, and take residual and cost."""
    found = problem.residuals(np.array([column_of(f, f.z) for f in fits]))
    for fit, residual in zip(fits, found, strict=True):
        fit.residual = residual.copy()
        fit.cost = _cost(problem, fit, fit.z, residual)


def _shifted(fit: Fit, k: int) -> tuple[Array, float]:
    """Return coordinates with the ``k``-th moved inwards by its step, and the step taken."""
    z, high = fit.z.copy(), fit.frees[k].span[1]
    step = fit.frees[k].step
    if z[k] + step > high:
        step = -step
    z[k] += step
    return z, step


def differentiate(problem: Problem, fits: Sequence[Fit]) -> None:
    """Take the Jacobian of each fit by the parameters whose Jacobian it does not share."""
    columns, steps = [], []
    for fit in fits:
        for k in range(fit.held, len(fit.frees)):
            z, step = _shifted(fit, k)
            columns.append(column_of(fit, z))
            steps.append(step)
    if not columns:
        return
    found = problem.residuals(np.array(columns))
    at = 0
    for fit in fits:
        n = len(fit.frees) - fit.held
        fit.slopes = (found[at : at + n] - fit.residual) / np.array(steps[at : at + n])[:, None]
        at += n


def share(problem: Problem, fit: Fit) -> Shared:
    """Return a fit's Jacobian for others to share."""
    slopes = np.ascontiguousarray(fit.slopes[:, : problem.seen])
    return Shared(slopes, np.einsum("im,jm->ij", slopes, slopes))


def normal_equations(problem: Problem, fit: Fit) -> tuple[Array, Array]:
    """Return the matrix and the gradient of the normal equations, priors included."""
    own, residual = fit.slopes[:, : problem.seen], fit.residual[: problem.seen]
    normal = np.einsum("im,jm->ij", own, own)
    gradient = np.einsum("im,m->i", own, residual)
    if fit.shared is not None:
        across = np.einsum("im,jm->ij", own, fit.shared.slopes)
        normal = np.block([[fit.shared.gram, across.T], [across, normal]])
        gradient = np.concatenate([np.einsum("im,m->i", fit.shared.slopes, residual), gradient])
    for k, (free, z) in enumerate(zip(fit.frees, fit.z, strict=True)):
        if np.isfinite(free.prior):
            normal[k, k] += free.prior**-2
            gradient[k] += (z - free.inner(free.start)) / free.prior**2
    return normal, gradient


def _steps(problem: Problem, fit: Fit, dampings: Sequence[float]) -> list[Array]:
    """Return where the dampings lead."""
    normal, gradient = normal_equations(problem, fit)
    spans = np.array([f.span for f in fit.frees])
    reach = np.array([REACH_LOG if f.log else REACH for f in fit.frees])
    low, high = spans[:, 0] - fit.z, spans[:, 1] - fit.z
    scale = np.sqrt(np.diag(normal)) + 1e-6
    scaled, slope = normal / np.outer(scale, scale), gradient / scale
    tried = []
    for relative in dampings:
        step = bounded_step(scaled, slope, fit.damping * relative, low * scale, high * scale)
        step /= scale
        tried.append(fit.z + step / max(1.0, float(np.max(np.abs(step) / reach))))
    return tried


def bounded_step(normal: Array, gradient: Array, damping: float, low: Array, high: Array) -> Array:
    """Return the damped Gauss-Newton step within bounds, by an active set."""
    n = len(gradient)
    step, free = np.zeros(n), ~(((low >= 0.0) & (gradient > 0)) | ((high <= 0.0) & (gradient < 0)))
    damped = normal + (damping + LEAST_DAMPING) * np.eye(n)
    for _ in range(n):
        if not free.any():
            break
        held = damped[np.ix_(free, ~free)] @ step[~free]
        inner, wanted = damped[np.ix_(free, free)], -gradient[free] - held
        try:
            step[free] = np.linalg.solve(inner, wanted)
        except np.linalg.LinAlgError:
            step[free] = np.linalg.lstsq(inner, wanted, rcond=None)[0]
        out = free & ((step < low) | (step > high))
        if not out.any():
            break
        step[out] = np.clip(step[out], low[out], high[out])
        free &= ~out
    return step


def improve(
    problem: Problem,
    fits: Sequence[Fit],
    rounds: int,
    tolerance: float,
    dampings: Sequence[float] = DAMPINGS,
) -> None:
    """Take rounds of damped Gauss-Newton steps, all fits side by side.

    Parameters
    ----------
    problem : Problem
        With the data.
    fits : sequence of Fit
        Evaluated; changed in place.
    rounds : int
        At most so many steps.
    tolerance : float
        A fit is done when a step lowers its cost by a smaller part.
    dampings : sequence of float
        Levenberg-Marquardt dampings to try in each round.
    """
    for _ in range(rounds):
        active = [f for f in fits if not f.done]
        if not active:
            return
        differentiate(problem, active)
        tried = [_steps(problem, f, dampings) for f in active]
        found = problem.residuals(
            np.array([column_of(f, z) for f, zs in zip(active, tried, strict=True) for z in zs])
        )
        for i, (fit, zs) in enumerate(zip(active, tried, strict=True)):
            rows = found[i * len(zs) : (i + 1) * len(zs)]
            costs = [_cost(problem, fit, z, r) for z, r in zip(zs, rows, strict=True)]
            best = int(np.argmin(costs))
            if costs[best] < fit.cost:
                fit.done = fit.cost - costs[best] < tolerance * fit.cost
                fit.cost, fit.z, fit.residual = costs[best], zs[best], rows[best].copy()
                fit.damping = 1.0
            elif fit.damping > 1.0:
                fit.done = True
            else:
                fit.damping = STALLED
