"""Simulation-error least squares, many fits side by side.

A *column* holds all parameters of a plant; a *free* parameter is changed by a fit. Every perturbed
or tried parameter set is a lane of one replay. Fits that share their first free parameters (the
base) and differ in a few more (a cause) share the base's Jacobian, computed once at the base's
optimum: near it the steps are close to Gauss-Newton, at a tenth of the simulations. A fit with a
Jacobian of its own follows it by secant updates (broyden1965); lanes of a replay that no step uses
compute its oldest columns again, and all of it is computed again when the updates no longer help.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any, Protocol

import numpy as np

from pam_envs.arrays import Array, Flags, Indices

DAMPINGS = (1e-9, 1e-6, 1e-4, 1e-3, 1e-2, 0.3)
"""Levenberg-Marquardt dampings tried side by side, each in a lane of the replay."""
FEW_DAMPINGS = (1e-6, 1e-3, 0.3)
LEAST_DAMPING = 1e-9  # regularisation of the normal equations
RENEWED = 5  # number of secant updates after which a column of a Jacobian is computed again
LANES = 16  # columns that a replay computes at the cost of one
STALLED = 1e3  # factor on all dampings after a round without improvement
REACH_LOG, REACH = 1.0, 30.0  # longest steps in internal coordinates
SHAPE_PRIOR = 50.0
"""Standard deviation of the size of a shape, over the noise."""
LEAST_SHARE = 1e-9
"""Least value over the upper bound, on a logarithmic scale whose lower bound is 0."""
WORST = 1e4  # largest weighted residual, also of a diverged simulation


@dataclass(frozen=True)
class Free:
    """A free parameter of a fit, in its own unit."""

    name: str
    place: int  # index in the column
    low: float
    high: float
    scale: float  # size of a meaningful change; not used on a logarithmic scale
    log: bool = False
    start: float = 0.0
    prior: float = np.inf  # standard deviation of a weak prior about start, in internal units

    def inner(self, value: float) -> float:
        """Return the internal coordinate of a value."""
        return float(np.log(value)) if self.log else value / self.scale

    def within(self, value: float) -> float:
        """Return a value moved into the bounds, positive on a logarithmic scale."""
        low = LEAST_SHARE * self.high if self.log and self.low <= 0.0 else self.low
        return float(np.clip(value, low, self.high))

    def outer(self, z: Array) -> Array:
        """Return the values of internal coordinates, clipped to the bounds."""
        raw = np.exp(np.clip(z, -700, 700)) if self.log else z * self.scale
        return np.clip(raw, self.low, self.high)

    @property
    def span(self) -> tuple[float, float]:
        """Bounds in internal coordinates."""
        return self.inner(max(self.low, 1e-300) if self.log else self.low), self.inner(self.high)

    @property
    def step(self) -> float:
        """Step of finite differences in internal coordinates."""
        return 0.01 if self.log else 0.02


@dataclass(frozen=True)
class Table:
    """Settings of several free parameters, each of shape (n,)."""

    place: Indices
    log: Flags
    scale: Array
    bounds: Array  # (2, n): in the parameters' own units
    spans: Array  # (2, n): in internal coordinates
    start: Array  # internal coordinates
    precision: Array  # 1 / prior**2, 0 without a prior

    def outer(self, z: Array) -> Array:
        """Return the values of internal coordinates (..., n), clipped to the bounds."""
        raw = np.where(self.log, np.exp(np.where(self.log, np.clip(z, -700, 700), 0.0)), 0.0)
        return np.clip(np.where(self.log, raw, z * self.scale), *self.bounds)


@lru_cache(maxsize=512)
def table_of(frees: tuple[Free, ...]) -> Table:
    """Return the settings of free parameters as arrays."""
    return Table(
        np.array([f.place for f in frees], np.int64),
        np.array([f.log for f in frees], bool),
        np.array([f.scale for f in frees]),
        np.array([[f.low for f in frees], [f.high for f in frees]]),
        np.array([f.span for f in frees]).reshape(len(frees), 2).T,
        np.array([f.inner(f.start) for f in frees]),
        np.array([f.prior**-2 if np.isfinite(f.prior) else 0.0 for f in frees]),
    )


class PlantFamily(Protocol):
    """A plant with fixed inputs that can be diagnosed; see also :attr:`Problem.tie`."""

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the outputs."""

    @property
    def column(self) -> Array:
        """Parameters of the plain plant, shape (p,)."""

    def simulate(self, columns: Array) -> Array:
        """Return sensor readings for parameter columns (n, p), shape (channels, T, n)."""

    def free(self, name: str, **changes: Any) -> Free:
        """Return the fit settings of a parameter: place, bounds, scale, start."""


@dataclass(frozen=True)
class Shared:
    """Jacobian by the leading parameters that several fits have in common."""

    slopes: Array  # (n, m): derivatives on the training samples
    gram: Array  # (n, n): ``slopes @ slopes.T``


@dataclass
class Fit:
    """State of a fit."""

    frees: tuple[Free, ...]  # those of the base first
    z: Array  # (n,): internal coordinates
    column: Array  # all other parameters
    cost: float = np.inf  # sum of squares of the training residuals, priors included
    residual: Array = field(default_factory=lambda: np.zeros(0))  # (m,): simulated less measured
    slopes: Array = field(default_factory=lambda: np.zeros((0, 0)))  # (k, m): by the last k of z;
    # of a fit with secant updates perhaps on training samples only
    # (k,): number of steps since each of the slopes was computed by differences
    ages: Indices = field(default_factory=lambda: np.zeros(0, np.int64))
    shared: Shared | None = None  # derivatives by the coordinates before them
    damping: float = 1.0  # factor on the dampings of the next round
    done: bool = False  # whether the fit has converged or was stopped
    label: Any = None  # cause and form of the fit
    begins: dict[Any, Any] = field(default_factory=dict, repr=False)  # starting points by form

    @classmethod
    def at_start(cls, frees: tuple[Free, ...], column: Array) -> "Fit":
        """Return a fit at the starting values of its parameters."""
        return cls(frees, np.array([f.inner(f.start) for f in frees]), column)

    def take(self, slopes: Array) -> None:
        """Take slopes at other coordinates as a first approximation."""
        self.slopes, self.ages = slopes, np.ones(len(slopes), np.int64)

    @property
    def fresh(self) -> bool:
        """Whether all slopes are differences at the present coordinates."""
        return len(self.slopes) > 0 and not self.ages.any()

    @property
    def held(self) -> int:
        """Number of leading parameters with a shared Jacobian."""
        return 0 if self.shared is None else len(self.shared.gram)

    def values(self) -> dict[str, float]:
        """Return the fitted values by name."""
        outer = self.table.outer(self.z)
        return {f.name: float(v) for f, v in zip(self.frees, outer, strict=True)}

    @property
    def table(self) -> "Table":
        """Settings of the free parameters as arrays."""
        return table_of(self.frees)


def no_violations(columns: Array) -> Array:
    """Return the violations of columns (n, p) where nothing is checked, shape (n, 0)."""
    return np.zeros((len(columns), 0))


@dataclass(frozen=True)
class Problem:
    """Data and simulation shared by fits.

    The weighted residuals of all channels form one vector, the training samples first; between
    them and the held-out samples are the violations.
    """

    simulate: Callable[[Array], Array]  # from columns (n, p) to outputs (channels, T, n)
    measured: Array  # (channels, T): readings; NaN where there is none
    noise: Array  # (channels,): standard deviation of each channel's noise
    train: Flags  # (T,): training samples
    time: Array  # (T,) [s]
    tie: Callable[[Array], None] = lambda columns: None  # completes columns in place
    # (k, T): shapes that the readings of every channel may contain beside the plant's (zero offset,
    # settling at the start); their sizes are solved for in every residual
    shapes: Array = field(default_factory=lambda: np.zeros((0, 0)))
    # violations of what is physical by columns (n, p), over their tolerance, shape (n, k)
    violations: Callable[[Array], Array] = no_violations
    checks: int = 0  # their number k

    @cached_property
    def order(self) -> Indices:
        """Index into the flattened (channels, T) of each sample of a residual vector."""
        mask = np.tile(self.train, len(self.measured))
        return np.concatenate([np.flatnonzero(mask), np.flatnonzero(~mask)])

    @cached_property
    def sampled(self) -> int:
        """Number of leading entries of a residual vector that are training samples."""
        return int(self.train.sum()) * len(self.measured)

    @cached_property
    def seen(self) -> int:
        """Number of leading entries of a residual vector that a fit sees."""
        return self.sampled + self.checks

    def residuals(self, columns: Array) -> Array:
        """Return weighted residuals, shape (n, channels * T); zero for missing readings."""
        self.tie(columns)
        outputs = self.simulate(columns)
        outputs -= self.measured[:, :, None]
        outputs /= self.noise[:, None, None]
        np.clip(outputs, -WORST, WORST, out=outputs)
        bad = ~np.isfinite(outputs)
        if bad.any():
            outputs[bad] = WORST
            outputs[np.isnan(self.measured)] = 0.0
        apart = outputs.transpose(2, 0, 1)
        if len(self.shapes):
            diverged = np.abs(outputs) >= WORST
            values = outputs[diverged]
            for k, (shapes, solver) in enumerate(self._solvers):
                apart[:, k] -= (apart[:, k] @ solver.T) @ shapes
            outputs[diverged] = values  # no shape explains a simulation that diverged
        flat = apart.reshape(len(columns), -1)
        return self.vectors(flat, self.violations(columns))

    def vectors(self, flat: Array, violations: Array | float = 0.0) -> Array:
        """Return residual vectors of flattened samples (n, channels * T) and violations (n, k)."""
        made = np.empty((len(flat), flat.shape[1] + self.checks))
        seen, order = self.sampled, self.order
        np.take(flat, order[:seen], axis=1, out=made[:, :seen])
        made[:, seen : self.seen] = violations
        np.take(flat, order[seen:], axis=1, out=made[:, self.seen :])
        return made

    @cached_property
    def _solvers(self) -> list[tuple[Array, Array]]:
        """Shapes without missing readings, and the matrix that gives their sizes, by channel.

        The sizes are those of the training samples, with a weak prior.
        """
        made = []
        for readings in self.measured:
            shapes = np.where(np.isfinite(readings), self.shapes, 0.0)
            seen = shapes * self.train
            normal = seen @ seen.T + SHAPE_PRIOR**-2 * np.eye(len(shapes))
            made.append((shapes, np.linalg.solve(normal, seen)))
        return made

    def shaped(self, outputs: Array) -> Array:
        """Return simulated outputs (channels, T) with the shapes that fit the readings best."""
        if not len(self.shapes):
            return outputs
        left = np.nan_to_num((outputs - self.measured) / self.noise[:, None])
        sizes = [solver @ row for (_, solver), row in zip(self._solvers, left, strict=True)]
        return np.asarray(outputs - np.array(sizes) @ self.shapes * self.noise[:, None])

    def carried(self, slopes: Array, other: "Problem") -> Array:
        """Return slopes (k, m) in the order of the residuals of a problem with other samples."""
        flat = np.array([self.rows(row).ravel() for row in slopes])
        return other.vectors(flat, slopes[:, self.sampled : self.seen])

    def rows(self, residual: Array) -> Array:
        """Return the samples of a residual vector as an array of shape (channels, T)."""
        out, seen = np.empty(self.measured.size), self.sampled
        out[self.order[:seen]] = residual[:seen]
        out[self.order[seen:]] = residual[self.seen :]
        return out.reshape(self.measured.shape)


def column_of(fit: Fit, z: Array) -> Array:
    """Return the columns of a fit at internal coordinates ``z`` (..., n), shape (..., p)."""
    column = np.tile(fit.column, (*z.shape[:-1], 1)) if z.ndim > 1 else fit.column.copy()
    column[..., fit.table.place] = fit.table.outer(z)
    return column


def _costs(problem: Problem, fit: Fit, tried: Array, residuals: Array) -> Array:
    """Return the costs of tried coordinates (k, n) with their residuals."""
    seen = residuals[:, : problem.seen]
    priors = (tried - fit.table.start) ** 2 @ fit.table.precision
    return np.asarray(np.einsum("ki,ki->k", seen, seen) + priors)


PROMISING = 10.0
"""Largest cost over the least one with which a fit continues."""


def promising(problem: Problem, fits: Sequence[Fit]) -> list[Fit]:
    """Evaluate fits at their starts; return those whose cost is near the least."""
    evaluate(problem, fits)
    return near(fits)


def near(fits: Sequence[Fit]) -> list[Fit]:
    """Return the fits whose cost is near the least."""
    least = min(fit.cost for fit in fits)
    return [fit for fit in fits if fit.cost <= PROMISING * least]


def evaluate(problem: Problem, fits: Sequence[Fit]) -> None:
    """Compute residual and cost of fits at their present coordinates."""
    if not fits:
        return
    columns = np.array([column_of(f, f.z) for f in fits])
    found = problem.residuals(columns)
    for k, fit in enumerate(fits):
        part = slice(k, k + 1)
        fit.residual = found[k].copy()
        fit.cost = float(_costs(problem, fit, fit.z[None], found[part])[0])


def shifted(fit: Fit, k: int) -> tuple[Array, float]:
    """Return coordinates with the ``k``-th shifted within its bounds, and the shift."""
    z, high = fit.z.copy(), fit.frees[k].span[1]
    step = fit.frees[k].step
    if z[k] + step > high:
        step = -step
    z[k] += step
    return z, step


@dataclass(frozen=True)
class Differences:
    """Columns of a fit's Jacobian that are computed by differences."""

    fit: Fit
    places: list[int]  # among the parameters without a shared Jacobian

    @cached_property
    def shifts(self) -> list[tuple[Array, float]]:
        """Shifted coordinates of each column, and the shift."""
        return [shifted(self.fit, self.fit.held + k) for k in self.places]

    def columns(self) -> list[Array]:
        """Return the parameter columns to simulate."""
        return [column_of(self.fit, z) for z, _ in self.shifts]

    def write(self, found: Array) -> None:
        """Write the slopes from the residuals of the columns."""
        if not self.places:
            return
        fit, steps = self.fit, np.array([step for _, step in self.shifts])
        width = fit.slopes.shape[1]
        fit.slopes[self.places] = (found - fit.residual)[:, :width] / steps[:, None]
        fit.ages[self.places] = 0


def differentiate(problem: Problem, fits: Sequence[Fit], least: int = 0) -> None:
    """Compute the Jacobian of each fit by its parameters without a shared Jacobian.

    Columns that are younger than ``least`` steps remain as they are.
    """
    made = []
    for fit in fits:
        own = len(fit.frees) - fit.held
        if len(fit.slopes) != own or least == 0:
            fit.slopes = np.empty((own, len(fit.residual)))
            fit.ages = np.full(own, least)
        made.append(Differences(fit, list(np.flatnonzero(fit.ages >= least))))
    _simulate(problem, [], made)


def _simulate(problem: Problem, tried: list[Array], made: Sequence[Differences]) -> Array:
    """Return the residuals of tried columns, and write those of differences simulated with them."""
    columns = tried + [column for part in made for column in part.columns()]
    found = problem.residuals(np.array(columns)) if columns else np.zeros((0, 0))
    at = len(tried)
    for part in made:
        part.write(found[at : at + len(part.places)])
        at += len(part.places)
    return found[: len(tried)]


def _in_spare_lanes(fits: Sequence[Fit], used: int) -> list[Differences]:
    """Return the oldest columns of the fits' own Jacobians, as many as lanes are left."""
    places: dict[int, list[int]] = {}
    own = [(k, i) for k, fit in enumerate(fits) if not fit.held for i in np.flatnonzero(fit.ages)]
    own.sort(key=lambda at: -fits[at[0]].ages[at[1]])
    for k, i in own[: -used % LANES]:
        places.setdefault(k, []).append(int(i))
    return [Differences(fits[k], found) for k, found in places.items()]


def share(problem: Problem, fit: Fit) -> Shared:
    """Return the Jacobian of a fit for sharing with fits that extend it."""
    slopes = np.ascontiguousarray(fit.slopes[:, : problem.seen])
    return Shared(slopes, slopes @ slopes.T)


def normal_equations(problem: Problem, fit: Fit) -> tuple[Array, Array]:
    """Return the matrix and the gradient of the normal equations, priors included."""
    own, residual = fit.slopes[:, : problem.seen], fit.residual[: problem.seen]
    normal, gradient = own @ own.T, own @ residual
    if fit.shared is not None:
        across = own @ fit.shared.slopes.T
        normal = np.block([[fit.shared.gram, across.T], [across, normal]])
        gradient = np.concatenate([fit.shared.slopes @ residual, gradient])
    table = fit.table
    normal[np.diag_indices(len(fit.z))] += table.precision
    gradient += (fit.z - table.start) * table.precision
    return normal, gradient


def _steps(problem: Problem, fit: Fit, dampings: Sequence[float], boxed: bool) -> Array:
    """Return the coordinates reached with each damping, shape (steps, n).

    Where the leading parameters have a shared Jacobian, which holds only near the base's optimum, a
    further step moves the others alone. A step beyond the reach is shortened; with ``boxed``
    another one keeps each parameter within its own reach, since one that the data hardly determine
    would shorten the step of all.
    """
    normal, gradient = normal_equations(problem, fit)
    table = fit.table
    reach = np.where(table.log, REACH_LOG, REACH)
    scale = np.sqrt(np.diag(normal)) + 1e-6
    scaled, slope = normal / np.outer(scale, scale), gradient / scale
    low, high = (table.spans - fit.z) * scale
    every = slice(None)
    moves = [(every, damping) for damping in dampings]
    if fit.held:
        moves.append((slice(fit.held, None), dampings[0]))
    box = reach * scale
    tried = []
    for part, relative in moves:
        equations = scaled[part, part], slope[part], fit.damping * relative
        step = np.zeros(len(slope))
        step[part] = bounded_step(*equations, low[part], high[part])
        longest = max(1.0, float(np.max(np.abs(step) / box)))
        tried.append(fit.z + step / scale / longest)
        if boxed and longest > 1.0:
            within = np.zeros(len(slope))
            limits = np.maximum(low, -box)[part], np.minimum(high, box)[part]
            within[part] = bounded_step(*equations, *limits)
            tried.append(fit.z + within / scale)
    return np.array(tried)


def bounded_step(normal: Array, gradient: Array, damping: float, low: Array, high: Array) -> Array:
    """Return the damped Gauss-Newton step within bounds, by an active-set method."""
    n = len(gradient)
    step, free = np.zeros(n), ~(((low >= 0.0) & (gradient > 0)) | ((high <= 0.0) & (gradient < 0)))
    damped = normal + (damping + LEAST_DAMPING) * np.eye(n)
    for _ in range(n):
        if not free.any():
            break
        held = damped[np.ix_(free, ~free)] @ step[~free]
        inner, right = damped[np.ix_(free, free)], -gradient[free] - held
        try:
            step[free] = np.linalg.solve(inner, right)
        except np.linalg.LinAlgError:
            step[free] = np.linalg.lstsq(inner, right, rcond=None)[0]
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
    renew: bool = True,
    boxed: bool = False,
) -> None:
    """Improve fits by damped Gauss-Newton steps, all fits side by side.

    A fit ends when a step decreases its cost by less than ``tolerance``, relative to the cost, and
    with ``renew`` only if its Jacobian was fresh. With ``boxed`` steps that are limited for each
    parameter are tried too.
    """
    for _ in range(rounds):
        active = [f for f in fits if not f.done]
        if not active:
            return
        differentiate(problem, [f for f in active if f.held or not len(f.slopes)])
        if renew:
            differentiate(problem, [f for f in active if not f.held], RENEWED)
        tried = [_steps(problem, f, dampings, boxed) for f in active]
        columns = [c for f, zs in zip(active, tried, strict=True) for c in column_of(f, zs)]
        found = _simulate(problem, columns, _in_spare_lanes(active, len(columns)))
        at = 0
        for fit, zs in zip(active, tried, strict=True):
            part = slice(at, at + len(zs))
            at = part.stop
            costs = _costs(problem, fit, zs, found[part])
            best = int(np.argmin(costs))
            cost = float(costs[best])
            _step(problem, fit, zs[best], cost, found[part][best], tolerance, renew)


def _step(
    problem: Problem,
    fit: Fit,
    z: Array,
    cost: float,
    residual: Array,
    tolerance: float,
    renew: bool,
) -> None:
    """Take a step that decreases the cost; update the Jacobian, or ask for another one."""
    better = cost < fit.cost
    sufficient = fit.cost - cost >= tolerance * fit.cost
    own, fresh = not fit.held, fit.fresh
    if better:
        step, change = z - fit.z, residual - fit.residual
        fit.cost, fit.z, fit.residual = cost, z, residual.copy()
        fit.ages += 1
        if own:
            _secant(problem, fit, step, change)
        if sufficient:
            fit.damping = 1.0
            return
    if renew and own and not fresh:
        fit.ages[fit.ages > 0] = RENEWED
        fit.damping = 1.0
    elif better or fit.damping > 1.0:
        fit.done = True
    else:
        fit.damping = STALLED


def _secant(problem: Problem, fit: Fit, step: Array, change: Array) -> None:
    """Update a Jacobian by the change of the residual along a step."""
    seen = fit.slopes[:, : problem.seen]
    weights = np.einsum("im,im->i", seen, seen) * step
    length = float(weights @ step)
    if length > 0.0:
        missing = change[: fit.slopes.shape[1]] - step @ fit.slopes
        fit.slopes = fit.slopes + np.outer(weights / length, missing)
