"""Regression of the force balance: starting values of static law, map, friction and strands.

In slow motion the load equals the force law, which is linear in its coefficients for given play
outputs. Errors of force are weighed by the compliance, so that the regression minimises errors of
contraction. The result only starts a fit, since the regressors contain noise.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, product

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.optimize import isotonic_regression, lsq_linear

from pam_envs.arrays import Array, Indices
from pam_envs.constants import GRAVITY
from pam_envs.diagnosis.fit.single_muscle import MuscleFamily, map_of
from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.kernels.build import entry
from pam_envs.kernels.yielding import deflected
from pam_envs.muscle.effective_area import MAP_SIZES
from pam_envs.muscle.effects import BREAKS

SLOW = 0.008  # speed [m/s] below which a sample is an equilibrium of forces
REVERSAL = 3.0  # least reversal of the smoothed path, over the noise
FEWEST, MOST = 200, 4000  # least and largest number of samples
ROUNDS = 4
USUAL_STIFF = 2000.0  # stiffness over strain [N] of the first weights
LEAST_STIFF = 0.15  # least stiffness of a weight, over the median
STIFF_SPREAD, STATE_SPREAD = 1.0, 1.0
"""Standard deviations of stiffness and slope, over those of the plain law: on average over all
samples, and at each of the states at which a fit checks them."""
BREAKS_IN_LENGTH, GROWTHS = (0.003, 0.006, 0.012, 0.025, 0.05, 0.09), (0.0, 1e-6, 4e-6, 1.5e-5)
"""Tried strains over which friction of the length builds up, and its growths with pressure
[1/Pa]."""
NEAR = (0.6, 0.77, 1.0, 1.3, 1.6)
"""Factors on the break, and on the growth, of a chosen friction that are tried next."""
BRAIDS = (0.008, 0.015, 0.06)
"""Tried strains over which the resistance of the braid falls."""
BREAKS_IN_PRESSURE = (1e4, 2e4, 4e4, 1e5)
"""Tried pressures over which friction of the pressure yields [Pa]."""
KINDS = "strands", "length", "pressure"
"""Kinds of friction."""
RATIOS, RATIOS_NEAR = (0.0, 1.0), (0.0, 0.5, 1.0)
"""Tried ratios of yielding elements, from springs back to the friction of Dahl."""
LEAST_GAIN = 0.03
"""Relative decrease of the squared error that a further friction needs."""
MAP_PRIOR = 20.0
"""Standard deviation of a term of the map [N]."""
LAW = (
    "muscle.area",
    "muscle.area_taper",
    "muscle.area_curve",
    "muscle.braid_force",
    "muscle.stiffness",
    "muscle.softening",
    "muscle.hardening",
    "muscle.stiffening",
)
PER_AREA = ("muscle.area_taper", "muscle.area_curve")
"""Terms of the law whose coefficient is in proportion to the area."""


@entry
def slipping(path: Array, span: Array, made: Array) -> None:
    """Write the deflections of a Maxwell element along a path (T,), at most ``span`` (T,)."""
    slip = path[0]
    for k in range(len(path)):
        made[k] = min(max(path[k] - slip, -span[k]), span[k])
        slip = path[k] - made[k]


@entry
def yielding(path: Array, span: Array, ratio: float, made: Array) -> None:
    """Write the deflections of a yielding element along a path (T,), at most ``span`` (T,)."""
    made[0] = 0.0
    for k in range(1, len(path)):
        made[k] = deflected(made[k - 1], path[k] - path[k - 1], span[k], ratio)[0]


@entry
def turning(path: Array, least: float, turns: Array) -> None:
    """Mark the samples (T,) at which a path turns by at least ``least``."""
    top = bottom = 0
    way = 0
    for k in range(len(path)):
        if path[k] > path[top]:
            top = k
        if path[k] < path[bottom]:
            bottom = k
        if way >= 0 and path[k] < path[top] - least:
            turns[top], way, bottom = 1.0, -1, k
        elif way <= 0 and path[k] > path[bottom] + least:
            turns[bottom], way, top = 1.0, 1, k


def without_jitter(path: Array, least: float) -> Array:
    """Return a path (T,), made monotonic between reversals of at least ``least``.

    Along the jitter of a reading, friction that yields would relax.
    """
    turns = np.zeros(len(path))
    turning(path, least, turns)
    made, inner = path.copy(), np.flatnonzero(turns[1:-1]) + 1
    for start, end in pairwise([0, *inner, len(path)]):
        part = path[start:end]
        made[start:end] = isotonic_regression(part, increasing=bool(part[-1] >= part[0])).x
    return made


@dataclass(frozen=True)
class Friction:
    """Friction with a given course, which a regression may add."""

    kind: str
    course: tuple[float, float, float]  # break, growth with pressure [1/Pa], ratio
    columns: Array  # (k, n): forces against the motion per coefficient
    names: tuple[str, ...]  # of the coefficients, (k,)
    fixed: dict[str, float]  # other parameters
    growth: str = ""  # parameter that grows with the first coefficient
    per: float = 0.0  # the growth, over the coefficient


@dataclass(frozen=True)
class Solution:
    """Coefficients of a regression."""

    coefficients: Array
    error: float  # squared error of the contraction, over the noise


@dataclass(frozen=True)
class Balance:
    """Slow samples of a recording."""

    family: MuscleFamily
    rows: Indices  # (n,)
    strain: Array  # (n,)
    pressure: Array  # (n,) [Pa]
    force: Array  # (n,): weight of the load [N]
    gaps: Array  # (plays, n): pressure less play output [Pa]
    speed: Array  # (n,): of the strain [1/s]
    path: Array  # (T,): strain, smoothed
    drive: Array  # (T,): pressure [Pa]
    noise: float  # of the contraction [m]
    braid: float  # strain over which the braid's resistance falls

    @classmethod
    def of(
        cls, family: MuscleFamily, contraction: Array, pressure: Array, noise: float
    ) -> "Balance | None":
        """Return the slow samples; None if they are too few.

        ``contraction`` (T,) are readings [m], NaN where there is none, ``pressure`` (T,) is
        simulated or smoothed [Pa].
        """
        plant, load, period = family.plant, family.inputs.load, family.inputs.period
        usable = np.isfinite(contraction)
        below = plant._absolute(np.zeros(1), load[:1])[0] if load[0] > 0 else 0.0
        contraction = contraction + float(below)  # relative to the unloaded rest length
        window = max(3, round(0.1 / period))
        known = np.interp(np.arange(len(load)), np.flatnonzero(usable), contraction[usable])
        smooth = without_jitter(uniform_filter1d(known, window), REVERSAL * noise)
        speed = np.gradient(smooth, period)
        rows = np.flatnonzero(usable & (uniform_filter1d(np.abs(speed), window) < SLOW))
        if len(rows) < FEWEST:
            return None
        rows = rows[:: max(1, len(rows) // MOST)]
        thresholds: tuple[float, ...] = plant.hysteresis.model.thresholds  # type: ignore[attr-defined]
        plays = [PlayOperator((size,), (1.0,), 0.0).simulate(pressure)[0] for size in thresholds]
        gaps = (pressure - np.reshape(plays, (len(thresholds), len(pressure))))[:, rows]
        path, force = smooth / plant.muscle.rest_length, load[rows] * GRAVITY
        speed = (speed / plant.muscle.rest_length)[rows]
        near = path[rows], pressure[rows], force, gaps, speed
        return cls(family, rows, *near, path, pressure, noise, plant.muscle.braid_strain)

    def with_best_braid(self) -> "Balance":
        """Return the samples with the braid that fits them best."""
        frictions = self._finer[1]
        errors = {b: replace(self, braid=b)._regressed(frictions).error for b in BRAIDS}
        best = min(errors, key=lambda braid: errors[braid])
        helps = errors[best] < (1.0 - LEAST_GAIN) * self._finer[0].error
        return replace(self, braid=best) if helps else self

    def solve(self) -> dict[str, float]:
        """Return coefficients of the static law and play weights."""
        return self._named(self._plain[0].coefficients)

    @cached_property
    def _plain(self) -> tuple[Solution, Array, Array]:
        """Solution of law and plays, with its taper and its stiffness over strain [N], (n,)."""
        taper, stiff = np.zeros(len(self.strain)), np.full(len(self.strain), USUAL_STIFF)
        area = self.family.plant.muscle.area
        for _ in range(ROUNDS):
            columns = np.vstack([self._law(), self._plays(taper), self._late(stiff)])
            limits = self._limits(area, len(columns))
            regression = Regression(columns, self.force, self._weights(stiff), limits)
            found = regression.solve(np.arange(len(columns)))
            taper, stiff = self._slopes(found.coefficients)
            area = max(found.coefficients[0], 1e-6)
        return found, taper, stiff

    @cached_property
    def _finer(self) -> tuple[Solution, list[Friction]]:
        """Solution with the map, and with the friction that reduces the error.

        Friction of each kind is added as long as it helps: strands and yielding elements.
        """
        chosen = self._chosen(self._frictions())
        nearer = [friction for one in chosen for friction in self._near(one)]
        chosen = self._chosen(nearer) if nearer else []
        return self._regressed(chosen), chosen

    def _chosen(self, tried: Iterable[Friction], gain: float = LEAST_GAIN) -> list[Friction]:
        """Return the friction that reduces the error by ``gain``, at most one of each kind."""
        tried = list(tried)
        regression, first = self._whole(tried)
        ends = np.cumsum([first, *(len(f.columns) for f in tried)])
        chosen: list[int] = []

        def error(of: list[int]) -> float:
            """Return the squared error with some friction."""
            parts = [np.arange(ends[k], ends[k + 1]) for k in of]
            return regression.solve(np.concatenate([np.arange(first), *parts])).error

        best = error(chosen)
        while True:
            used = {tried[k].kind for k in chosen}
            errors = {k: error([*chosen, k]) for k, f in enumerate(tried) if f.kind not in used}
            least = min(errors, key=lambda k: errors[k], default=None)
            if least is None or errors[least] > (1.0 - gain) * best:
                return [tried[k] for k in chosen]
            chosen.append(least)
            best = errors[least]

    def _regressed(self, frictions: list[Friction]) -> Solution:
        """Return the solution with some friction."""
        regression, _ = self._whole(frictions)
        return regression.solve(np.arange(len(regression.scale)))

    def _whole(self, frictions: list[Friction]) -> tuple["Regression", int]:
        """Return the regression on law, map and friction, and the columns before friction."""
        found, taper, stiff = self._plain
        always = [self._law(), self._plays(taper), self._late(stiff), self._terms()]
        columns = np.vstack([*always, *(f.columns for f in frictions)])
        limits = self._limits(max(found.coefficients[0], 1e-6), len(columns))
        first = sum(map(len, always))
        terms = slice(first - len(always[-1]), first)
        limits.low[terms], limits.precision[terms] = -np.inf, MAP_PRIOR**-2
        rows = self._weights(stiff), limits, self._kept()
        return Regression(columns, self.force, *rows), first

    def _kept(self) -> Array:
        """Return rows of a regression that keep the law near the plain one.

        Its stiffness at some samples, since readings under few loads alone are explained just as
        well by a law without stiffness, and its stiffness and its slope by pressure where a fit
        checks that they are positive. One row for each column of law, plays, lateness and map, and
        one for the target, (k + 1, m).
        """
        some = np.arange(0, len(self.rows), max(1, len(self.rows) // FEWEST))
        at = self.pressure[some], self.strain[some]
        spread = STIFF_SPREAD * np.sqrt(len(some) / len(self.rows))
        stiff, _ = self._near_plain(*at, spread)
        if not self.family.states.size:
            return stiff
        pressure, strain = self.family.states
        return np.hstack([stiff, *self._near_plain(pressure, strain, STATE_SPREAD)])

    def _near_plain(self, p: Array, e: Array, spread: float) -> tuple[Array, Array]:
        """Return rows for stiffness and slope by pressure [m2] at pressures [Pa] and strains."""
        c = self._plain[0].coefficients
        one, none = np.ones(len(e)), np.zeros(len(e))
        bend = np.exp(-e / self.braid) / self.braid
        stiff = np.array([none, p, 2 * e * p, bend, one, 2 * e, 3 * e**2, 4 * e**3])
        slope = np.array([one, -e, -(e**2), *[none] * 5])
        other = np.zeros((len(self.gaps) + 2, len(e)))
        _, by_pressure, by_strain = map_of(self.family.plant.muscle, p, e)
        made = []
        for law, terms in ((stiff, -by_strain), (slope, by_pressure)):
            wanted = c[: len(LAW)] @ law
            usual = max(float(np.median(np.abs(wanted))), 1e-12)
            wanted = np.maximum(wanted, LEAST_STIFF * usual)
            made.append(np.vstack([law, other, terms, wanted]) / (spread * wanted))
        return made[0], made[1]

    def flexible(self) -> dict[str, float]:
        """Return coefficients with the map and with further friction."""
        return self._with(*self._finer)

    def others(self) -> list[dict[str, float]]:
        """Return coefficients with friction of each kind alone, unless that is the chosen one."""
        made, best = [], [friction.kind for friction in self._finer[1]]
        for kind in KINDS:
            if best == [kind]:
                continue
            chosen = self._chosen((f for f in self._frictions() if f.kind == kind), 0.0)
            chosen = self._chosen((n for f in chosen for n in self._near(f)), 0.0)
            made.append(self._with(self._regressed(chosen), chosen))
        return made

    def _with(self, solved: Solution, frictions: list[Friction]) -> dict[str, float]:
        """Return the coefficients of a solution with some friction."""
        c, first = solved.coefficients, len(LAW) + len(self.gaps) + 2
        found = self._named(c[:first])
        at = first + len(MAP_SIZES)
        found |= {f"muscle.{k}": float(c) for k, c in zip(MAP_SIZES, c[first:at], strict=True)}
        for friction in frictions:
            values = c[at : at + len(friction.names)]
            found |= friction.fixed | dict(zip(friction.names, map(float, values), strict=True))
            if friction.growth:
                found[friction.growth] = friction.per * float(values[0])
            at += len(values)
        if "hysteresis.yield_width" in found:
            found["hysteresis.yield_width"] /= found["muscle.area"]
        return found

    def _frictions(self) -> Iterator[Friction]:
        """Yield friction with all tried courses."""
        for away, growth in product(BREAKS_IN_LENGTH, GROWTHS):
            yield self._strands(away, growth)
            for ratio in RATIOS:
                yield self._in_length(away, growth, ratio)
        for away, ratio in product(BREAKS_IN_PRESSURE, RATIOS):
            yield self._in_pressure(away, ratio)

    def _near(self, friction: Friction) -> Iterator[Friction]:
        """Yield friction of one kind with similar courses."""
        away, growth, ratio = friction.course
        for nearer in (factor * away for factor in NEAR):
            if friction.kind == "pressure":
                for other in sorted({ratio, *RATIOS_NEAR}):
                    yield self._in_pressure(nearer, other)
                continue
            for slower in (factor * growth for factor in (NEAR if growth else (0.0,))):
                if friction.kind == "strands":
                    yield self._strands(nearer, slower)
                else:
                    for other in sorted({ratio, *RATIOS_NEAR}):
                        yield self._in_length(nearer, slower, other)

    def _strands(self, away: float, growth: float) -> Friction:
        """Return Maxwell elements that break away over a strain, with growth by pressure [1/Pa]."""
        span, columns, made = away * (1.0 + growth * self.drive), [], np.empty(len(self.path))
        for part in BREAKS:
            slipping(self.path, part * span, made)
            columns.append(made[self.rows] / (part * away))
        names = tuple(f"muscle.strand_{k + 1}" for k in range(len(BREAKS)))
        fixed = {"muscle.strand_break": away, "muscle.strand_per_pressure": growth}
        return Friction("strands", (away, growth, 0.0), -np.array(columns), names, fixed)

    def _in_length(self, away: float, growth: float, ratio: float) -> Friction:
        """Return an element that yields over a strain, with growth by pressure [1/Pa]."""
        made = np.empty(len(self.path))
        yielding(self.path, away * (1.0 + growth * self.drive), ratio, made)
        name = "muscle.yield_"
        return Friction(
            "length",
            (away, growth, ratio),
            -made[None, self.rows] / away,
            (f"{name}force",),
            {f"{name}break": away, f"{name}ratio": ratio},
            f"{name}per_pressure",
            growth,
        )

    def _in_pressure(self, away: float, ratio: float) -> Friction:
        """Return an element that yields over a pressure [Pa]."""
        made = np.empty(len(self.drive))
        yielding(self.drive, np.full(len(self.drive), away), ratio, made)
        fixed = {"hysteresis.yield_break": away, "hysteresis.yield_ratio": ratio}
        column = -made[None, self.rows] / away * (1.0 - self._plain[1])
        names = ("hysteresis.yield_width",)
        return Friction("pressure", (away, 0.0, ratio), column, names, fixed)

    def _law(self) -> Array:
        """Return the terms of the static law, in the order of :data:`LAW`, (terms, n)."""
        e, p = self.strain, self.pressure
        bend = -np.expm1(-e / self.braid)
        return np.array([p, -e * p, -(e**2) * p, -bend, -e, -(e**2), -(e**3), -(e**4)])

    def _plays(self, taper: Array) -> Array:
        """Return the friction of each play, (plays, n)."""
        return np.asarray(-self.gaps * (1.0 - taper))

    def _late(self, stiff: Array) -> Array:
        """Return the forces of a viscous loss and of readings that come late, (2, n)."""
        return np.array([self.speed, self.speed * stiff])

    def _terms(self) -> Array:
        """Return the terms of the map, (terms, n)."""
        return map_of(self.family.plant.muscle, self.pressure, self.strain)[0]

    def _limits(self, area: float, columns: int) -> "Limits":
        """Return the limits of coefficients: those that a fit has, near an ``area`` [m2]."""
        n, count = len(LAW), len(self.gaps)
        limits = Limits(
            low=np.zeros(columns),
            high=np.full(columns, np.inf),
            centre=np.zeros(columns),
            precision=np.zeros(columns),
        )
        limits.low[n + count : n + count + 2] = -np.inf  # lateness
        for k, name in enumerate(LAW):
            free = self.family.free(name)
            factor = area if name in PER_AREA else 1.0
            limits.low[k], limits.high[k] = factor * free.low, factor * free.high
            if not free.log and np.isfinite(free.prior):
                limits.centre[k] = factor * free.start
                limits.precision[k] = (factor * free.scale * free.prior) ** -2
        return limits

    def _weights(self, stiff: Array) -> Array:
        """Return the contraction by force, over the noise, (n,)."""
        floor = LEAST_STIFF * float(np.median(stiff))
        weights = self.family.plant.muscle.rest_length / (np.maximum(stiff, floor) * self.noise)
        return np.asarray(weights)

    def _slopes(self, c: Array) -> tuple[Array, Array]:
        """Return the taper of the area and the stiffness over strain [N] of a static law."""
        e, p = self.strain, self.pressure
        bend = np.exp(-e / self.braid)
        taper = np.clip((c[1] * e + c[2] * e**2) / max(c[0], 1e-6), -1.0, 0.95)
        stiff = (c[1] + 2.0 * c[2] * e) * p + c[3] / self.braid * bend
        stiff += c[4] + 2.0 * c[5] * e + 3.0 * c[6] * e**2 + 4.0 * c[7] * e**3
        return taper, np.maximum(stiff, 1.0)

    def _named(self, c: Array) -> dict[str, float]:
        """Return coefficients of law and plays by parameter."""
        area, n = max(c[0], 1e-6), len(LAW)
        found = dict(zip(LAW, map(float, c), strict=False))
        found |= {
            "muscle.area": area,
            "muscle.area_taper": float(c[1]) / area,
            "muscle.area_curve": float(c[2]) / area,
            "muscle.braid_force": max(float(c[3]), 1e-3),
            "muscle.braid_strain": self.braid,
        }
        plays = c[n : n + len(self.gaps)]
        return found | {f"hysteresis.weight[{k}]": float(v) / area for k, v in enumerate(plays)}


@dataclass(frozen=True)
class Limits:
    """Limits of the coefficients of a regression, each of shape (k,)."""

    low: Array
    high: Array
    centre: Array  # of a prior
    precision: Array  # of the prior, over the variance of the target


class Regression:
    """Least squares on columns with bounds, for many choices of them."""

    def __init__(
        self,
        columns: Array,
        target: Array,
        weights: Array,
        limits: Limits,
        others: Array | None = None,
    ) -> None:
        """Take columns (k, n), target and weights (n,), and further weighted rows (j + 1, m).

        These hold the first ``j`` columns and the target.
        """
        self.limits = limits
        self.scale = np.linalg.norm(columns * weights, axis=1) + 1e-12
        whole = np.vstack([columns / self.scale[:, None], target]) * weights
        if others is not None:
            more, j = np.zeros((len(whole), others.shape[1])), len(others) - 1
            more[:j] = others[:-1] / self.scale[:j, None]
            more[-1] = others[-1]
            whole = np.hstack([whole, more])
        upper = np.asarray(np.linalg.qr(whole.T, mode="r"))
        self.matrix, self.target = upper[:, :-1], upper[:, -1]

    def solve(self, places: Indices) -> Solution:
        """Return the coefficients of some columns, within their limits."""
        scale, limits = self.scale[places], self.limits
        roots = np.sqrt(limits.precision[places])
        some = roots > 0.0
        matrix = np.vstack([self.matrix[:, places], np.diag(roots / scale)[some]])
        target = np.append(self.target, (roots * limits.centre[places])[some])
        bounds = limits.low[places] * scale, limits.high[places] * scale
        solved = lsq_linear(matrix, target, bounds, method="bvls")
        return Solution(solved.x / scale, 2.0 * float(solved.cost))
