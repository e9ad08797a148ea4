"""Friction elements driven by length, whose slip force may change along a history: passive models.

Springs of constant stiffness, each in series with a slider of its own (albender2005). The lag of
such a model, in the unit of its input, is the force over a stiffness:

    lag(x) = sum_k [phi_k(x) - phi_k(w_k)],    w_k = play(x, r_k limit)

with the sliders' positions ``w_k`` and rising curves ``phi_k``. The springs store
``phi_k(x) - phi_k(w_k)`` integrated from ``w_k`` to ``x``, and a slip, by motion or because the
``limit`` falls, only dissipates. So a muscle whose strands press on each other harder at a higher
pressure is passive in length and pressure, unlike one whose friction *stiffness* depends on
pressure, or whose pressure has the hysteresis (vominh2011).

:class:`StraightSlip` has straight curves. :class:`PreisachSlip` is a Preisach operator of relays
with a few half-gaps ``r_k``: a relay that switches up at ``c + r`` and down at ``c - r`` is up
where the play of threshold ``r`` is above ``c``, so that ``phi_k`` is the integral of the relay
density over ``c``.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.hysteresis.checks import check_not_negative, check_thresholds, floats, width_of
from pam_envs.hysteresis.elements import THRESHOLD, WEIGHT, play
from pam_envs.hysteresis.protocol import (
    ELEMENTS,
    HysteresisModel,
    Kernels,
    Start,
    Usage,
    padded,
    register,
)
from pam_envs.kernels.build import entry, kernel

LIMIT = ELEMENTS
"""Row of the state, after the sliders, with the factor on the thresholds: the plant writes it."""
CELL = ELEMENTS + 1
"""Row of scratch after it, with the cell of the input."""
STATE_ROWS = ELEMENTS + 2
LOW, PER_INPUT = WEIGHT, WEIGHT + 1
"""Rows of the numbers of curves: their first input, and cells per input."""


@kernel
def slip_begin(
    rows: Any, fixed: Any, counts: Any, table: Any, elements: int, at: int, model: int, count: int,
    member: int, j: int,
) -> None:  # fmt: skip
    """Begin with the declared thresholds."""
    rows[at + LIMIT][j] = 1.0


@kernel
def straight_lag(
    rows: Any, fixed: Any, counts: Any, table: Any, state: int, elements: int, x_at: int,
    lag_at: int, operators: int, model: int, count: int, member: int, first: int, last: int,
) -> None:  # fmt: skip
    """Advance the sliders and write the lags (:class:`~pam_envs.hysteresis.protocol.Kernels`)."""
    for m in range(operators):
        at = state + m * STATE_ROWS
        x, lag, limit = rows[x_at + m], rows[lag_at + m], rows[at + LIMIT]
        for j in range(first, last):
            lag[j] = 0.0
        for k in range(elements):
            threshold, weight = fixed[model + THRESHOLD + k], fixed[model + WEIGHT + k]
            position = rows[at + k]
            for j in range(first, last):
                w = play(x[j], threshold[j] * limit[j], position[j])
                position[j] = w
                lag[j] = lag[j] + weight[j] * (x[j] - w)


@kernel
def straight_peek(
    rows: Any, fixed: Any, counts: Any, table: Any, state: int, elements: int, x_at: int,
    lag_at: int, stick_at: int, operators: int, model: int, count: int, member: int, first: int,
    last: int,
) -> None:  # fmt: skip
    """Write the lags at inputs and their slopes, the weight of the sliders that do not move."""
    for m in range(operators):
        at = state + m * STATE_ROWS
        x, lag, stick = rows[x_at + m], rows[lag_at + m], rows[stick_at + m]
        limit = rows[at + LIMIT]
        for j in range(first, last):
            lag[j] = 0.0
            stick[j] = 0.0
        for k in range(elements):
            threshold, weight = fixed[model + THRESHOLD + k], fixed[model + WEIGHT + k]
            position = rows[at + k]
            for j in range(first, last):
                w = play(x[j], threshold[j] * limit[j], position[j])
                lag[j] = lag[j] + weight[j] * (x[j] - w)
                stick[j] = stick[j] + (weight[j] if w == position[j] else 0.0)


@kernel
def cell_of(u: float, curve: Any) -> int:
    """Return the cell of a curve at ``u`` cells from its first knot; the end ones have no end."""
    return max(0, min(int(u), len(curve) - 2))


@kernel
def curve_value(u: float, curve: Any) -> float:
    """Return a curve at ``u`` cells from its first knot, straight beyond its ends."""
    i = cell_of(u, curve)
    return curve[i] + (u - i) * (curve[i + 1] - curve[i])  # type: ignore[no-any-return]


@kernel
def curved_ahead(
    rows: Any, fixed: Any, counts: Any, table: Any, elements: int, at: int, x: Any, lag: Any,
    model: int, member: int, first: int, last: int,
) -> None:  # fmt: skip
    """Write the sum of all curves at the inputs, and the inputs' cells."""
    low, per, members = fixed[model + LOW], fixed[model + PER_INPUT], counts[member]
    cell = rows[at + CELL]
    for j in range(first, last):
        total = table[members[j]][elements]
        u = (x[j] - low[j]) * per[j]
        i = cell_of(u, total)
        cell[j] = i
        lag[j] = total[i] + (u - i) * (total[i + 1] - total[i])


@kernel
def curved_lag(
    rows: Any, fixed: Any, counts: Any, table: Any, state: int, elements: int, x_at: int,
    lag_at: int, operators: int, model: int, count: int, member: int, first: int, last: int,
) -> None:  # fmt: skip
    """Advance the sliders and write the lags (:class:`~pam_envs.hysteresis.protocol.Kernels`)."""
    low, per, members = fixed[model + LOW], fixed[model + PER_INPUT], counts[member]
    for m in range(operators):
        at = state + m * STATE_ROWS
        x, lag, limit = rows[x_at + m], rows[lag_at + m], rows[at + LIMIT]
        curved_ahead(rows, fixed, counts, table, elements, at, x, lag, model, member, first, last)
        for k in range(elements):
            threshold, position = fixed[model + THRESHOLD + k], rows[at + k]
            for j in range(first, last):
                w = play(x[j], threshold[j] * limit[j], position[j])
                position[j] = w
                lag[j] = lag[j] - curve_value((w - low[j]) * per[j], table[members[j]][k])


@kernel
def curved_peek(
    rows: Any, fixed: Any, counts: Any, table: Any, state: int, elements: int, x_at: int,
    lag_at: int, stick_at: int, operators: int, model: int, count: int, member: int, first: int,
    last: int,
) -> None:  # fmt: skip
    """Write the lags at inputs and their slopes, those of the curves whose sliders do not move."""
    low, per, members = fixed[model + LOW], fixed[model + PER_INPUT], counts[member]
    for m in range(operators):
        at = state + m * STATE_ROWS
        x, lag, stick = rows[x_at + m], rows[lag_at + m], rows[stick_at + m]
        limit, cell = rows[at + LIMIT], rows[at + CELL]
        curved_ahead(rows, fixed, counts, table, elements, at, x, lag, model, member, first, last)
        for j in range(first, last):
            stick[j] = 0.0
        for k in range(elements):
            threshold, position = fixed[model + THRESHOLD + k], rows[at + k]
            for j in range(first, last):
                w, curve = play(x[j], threshold[j] * limit[j], position[j]), table[members[j]][k]
                lag[j] = lag[j] - curve_value((w - low[j]) * per[j], curve)
                i = int(cell[j])
                rise = (curve[i + 1] - curve[i]) * per[j]
                stick[j] = stick[j] + (rise if w == position[j] else 0.0)


@kernel
def slip_lag(
    x: float, limit: float, thresholds: Any, curves: Any, low: float, per: float, sliders: Any
) -> tuple[float, float]:
    """Return the lag at an input and its slope, for sliders at positions that do not change.

    ``thresholds``, shape (n,), and ``curves``, (n, knots), from ``low`` with ``per`` cells per
    input, are those of :attr:`SlipModel.arrays`.
    """
    u = (x - low) * per
    lag, slope = 0.0, 0.0
    for k in range(len(thresholds)):
        curve = curves[k]
        i = cell_of(u, curve)
        rise = curve[i + 1] - curve[i]
        w = play(x, thresholds[k] * limit, sliders[k])
        lag = lag + (curve[i] + (u - i) * rise - curve_value((w - low) * per, curve))
        slope = slope + (rise * per if w == sliders[k] else 0.0)
    return lag, slope


@kernel
def slip_to(x: float, limit: float, thresholds: Any, before: Any, after: Any) -> None:
    """Write the sliders' positions after motion to ``x`` from those before."""
    for k in range(len(thresholds)):
        after[k] = play(x, thresholds[k] * limit, before[k])


@entry
def slip_rows(
    x: Array, limit: Array, thresholds: Array, curves: Array, low: float, per: float,
    before: Array, lag: Array, after: Array,
) -> None:  # fmt: skip
    """Write the lags at inputs, shape (rows,), and the sliders, (rows, n), after ``before``."""
    for r in range(len(x)):
        lag[r] = slip_lag(x[r], limit[r], thresholds, curves, low, per, before[r])[0]
        slip_to(x[r], limit[r], thresholds, before[r], after[r])


def flat_rows(
    values: Sequence[ArrayLike], sliders: ArrayLike, elements: int
) -> tuple[tuple[int, ...], list[Array], Array]:
    """Return values of broadcast shape (...) and sliders, (..., elements), as rows for a loop.

    The shape comes first; the arrays are contiguous copies.
    """
    held, given = np.asarray(sliders, float), [np.asarray(v, float) for v in values]
    shape = np.broadcast_shapes(*(v.shape for v in given), held.shape[:-1])
    flat = [_whole(v, shape).reshape(-1) for v in given]
    return shape, flat, _whole(held, (*shape, elements)).reshape(math.prod(shape), elements)


def _whole(values: Array, shape: tuple[int, ...]) -> Array:
    """Return a contiguous copy in a shape."""
    same = values.shape == shape  # saves time
    return np.array(values if same else np.broadcast_to(values, shape), order="C")


class SlipModel(HysteresisModel):
    """Base of the friction elements driven by length; slope 1, virgin start."""

    drive: ClassVar[str] = "length"
    state_rows: ClassVar[int] = STATE_ROWS

    thresholds: tuple[float, ...]

    @property
    def curves(self) -> Array:
        """The elements' curves at evenly spaced knots, shape (n, knots), straight beyond them."""
        raise NotImplementedError

    @property
    def grid(self) -> tuple[float, float]:
        """First knot of the curves, and their cells per input."""
        raise NotImplementedError

    @cached_property
    def arrays(self) -> tuple[Array, Array, float, float]:
        """Thresholds, curves, first knot and cells per input, for kernels."""
        return np.array(self.thresholds), np.ascontiguousarray(self.curves), *self.grid

    @property
    def shares(self) -> Array:
        """Stiffness of each element by cell of the input, over the total, shape (n, cells)."""
        raise NotImplementedError

    @property
    def elements(self) -> int:
        """Number of elements."""
        return len(self.thresholds)

    @property
    def largest_lag(self) -> float:
        """Largest lag at any input, at the limit 1, to the width of a cell."""
        cells = (np.array(self.thresholds)[:, None] * self.shares).T
        return max(math.fsum(cell) for cell in cells)  # exact: the same on every processor

    def limited(self, limit: float) -> Self:
        """Return the model with its thresholds scaled."""
        return replace(self, thresholds=tuple(limit * r for r in self.thresholds))  # type: ignore[type-var]

    def initial_state(self, batch_shape: tuple[int, ...] = ()) -> Array:
        """Return the positions of the sliders, zeros of shape ``(*batch_shape, n)``."""
        return np.zeros((*batch_shape, self.elements))

    def lag(self, x: ArrayLike, state: ArrayLike, limit: ArrayLike = 1.0) -> tuple[Array, Array]:
        """Return the lag at inputs, shape (...), and the positions of the sliders, (..., n).

        ``limit``, shape (...), scales the thresholds. The states given do not change.
        """
        shape, (inputs, limits), before = flat_rows((x, limit), state, self.elements)
        lag, after = np.empty_like(inputs), np.empty_like(before)
        slip_rows(inputs, limits, *self.arrays, before, lag, after)
        return lag.reshape(shape), after.reshape(*shape, self.elements)

    def step(self, x: ArrayLike, state: ArrayLike) -> tuple[Array, Array]:
        """Return the output, the input less its lag, and the state after it."""
        lag, after = self.lag(x, state)
        return np.asarray(np.asarray(x, float) - lag), after

    def inverse_step(self, y: ArrayLike, state: ArrayLike) -> tuple[Array, Array]:
        """Return the input that gives the output ``y``, by bisection to rounding, and the state."""
        y = np.asarray(y, float)
        most = self.largest_lag
        low, high = y - most, y + most
        for _ in range(60):
            middle = 0.5 * (low + high)
            above = self.step(middle, state)[0] > y
            low, high = np.where(above, low, middle), np.where(above, middle, high)
        x = 0.5 * (low + high)
        return x, self.step(x, state)[1]


@register
@dataclass(frozen=True)
class StraightSlip(SlipModel):
    """Maxwell-slip elements of constant stiffness.

    Parameters
    ----------
    thresholds : tuple of float, shape (n,)
        Distances at which the elements slip, rising, in the unit of the input.
    weights : tuple of float, shape (n,)
        Share of each in the stiffness, not negative.
    """

    kind: ClassVar[str] = "maxwell_slip_length"
    choice: ClassVar[str | None] = "maxwell_slip"
    kernels: ClassVar[Kernels] = Kernels(lag=straight_lag, peek=straight_peek, begin=slip_begin)

    thresholds: tuple[float, ...]
    weights: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "thresholds", floats("thresholds", self.thresholds))
        object.__setattr__(self, "weights", floats("weights", self.weights))
        check_thresholds("thresholds", self.thresholds, len(self.weights), "weights")
        check_not_negative("weights", self.weights, "to dissipate and not create energy")

    @classmethod
    def resembling(
        cls, reference: Any, low: float, high: float, levels: int, start: Start
    ) -> "StraightSlip":
        """Return the elements of a play operator."""
        thresholds, weights, _ = reference.parts
        return cls(tuple(thresholds), tuple(weights))

    @property
    def shares(self) -> Array:
        """The weights, shape (n, 1)."""
        return np.array(self.weights)[:, None]

    def scaled(self, width: float, slope: float | None = None) -> "StraightSlip":
        """Return the model with its lag ``width`` times as large."""
        width = width_of(width)
        return replace(self, weights=tuple(width * w for w in self.weights))

    def numbers(self, full: float | None = None) -> list[float]:
        """Return the slope, thresholds and weights, in the rows of a play operator."""
        idle = [0.0] * (ELEMENTS - self.elements)
        return padded([1.0, 0.0, *self.thresholds, *idle, *self.weights, *idle])

    def check(self, usage: Usage) -> None:
        """Refuse too many elements."""
        if self.elements > ELEMENTS:
            raise ValueError(
                f"hysteresis: {self.elements} elements, at most {ELEMENTS} are simulated; merge "
                "neighbouring thresholds"
            )

    @property
    def curves(self) -> Array:
        """Straight lines, shape (n, 2)."""
        return np.stack([np.zeros(self.elements), self.weights], axis=-1)

    @property
    def grid(self) -> tuple[float, float]:
        """One cell from 0 to 1."""
        return 0.0, 1.0


@register
@dataclass(frozen=True)
class PreisachSlip(SlipModel):
    """Preisach operator of relays with a few half-gaps.

    Parameters
    ----------
    low, high : float
        Range [unit of the input] over which the density is given; the density of the last cell
        continues beyond it.
    thresholds : tuple of float, shape (n,)
        Half-gaps of the relays, rising, in the unit of the input.
    densities : tuple of tuple of float, shape (n, cells)
        Stiffness share of the relays of each half-gap, by the mean of their switching inputs in
        evenly spaced cells from ``low`` to ``high``. Nowhere negative.
    """

    kind: ClassVar[str] = "preisach_length"
    choice: ClassVar[str | None] = "preisach"
    kernels: ClassVar[Kernels] = Kernels(lag=curved_lag, peek=curved_peek, begin=slip_begin)

    low: float
    high: float
    thresholds: tuple[float, ...]
    densities: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        low, high = floats("(low, high)", (self.low, self.high))
        thresholds = floats("thresholds", self.thresholds)
        densities = tuple(floats(f"densities[{k}]", r) for k, r in enumerate(self.densities))
        object.__setattr__(self, "low", low)
        object.__setattr__(self, "high", high)
        object.__setattr__(self, "thresholds", thresholds)
        object.__setattr__(self, "densities", densities)
        check_thresholds("thresholds", thresholds, len(densities), "densities")
        if not low < high:
            raise ValueError(f"low is {low} and high is {high}; low must be below high: swap them")
        cells = {len(row) for row in densities}
        if len(cells) != 1 or cells == {0} or len(densities) > ELEMENTS:
            raise ValueError(
                f"densities has {len(densities)} rows of {sorted(cells)} cells; give 1 to "
                f"{ELEMENTS} rows of one length"
            )
        for k, row in enumerate(densities):
            check_not_negative(f"densities[{k}]", row, "to dissipate and not create energy")

    @classmethod
    def resembling(
        cls, reference: Any, low: float, high: float, levels: int, start: Start
    ) -> "PreisachSlip":
        """Return the operator of a play operator: a density that is the same at any input."""
        thresholds, weights, _ = reference.parts
        return cls(low, high, tuple(thresholds), tuple((float(w),) for w in weights))

    @cached_property
    def curves(self) -> Array:
        """The elements' curves at the knots, shape (n, cells + 1), 0 at ``low``; read-only."""
        cell = (self.high - self.low) / len(self.densities[0])
        steps = np.cumsum(self.shares * cell, axis=1)
        curves = np.concatenate([np.zeros((len(steps), 1)), steps], axis=1)
        curves.setflags(write=False)
        return curves

    @property
    def grid(self) -> tuple[float, float]:
        """``low``, and the number of cells over the range."""
        return self.low, len(self.densities[0]) / (self.high - self.low)

    @property
    def shares(self) -> Array:
        """The densities, shape (n, cells)."""
        return np.array(self.densities)

    def scaled(self, width: float, slope: float | None = None) -> "PreisachSlip":
        """Return the operator with its lag ``width`` times as large."""
        width = width_of(width)
        return replace(self, densities=tuple(tuple(width * d for d in r) for r in self.densities))

    def numbers(self, full: float | None = None) -> list[float]:
        """Return the slope, the thresholds, the first input of the curves and cells per input."""
        idle = [0.0] * (ELEMENTS - self.elements)
        return padded([1.0, 0.0, *self.thresholds, *idle, *self.grid])

    def table_rows(self) -> Array:
        """Return the curves, and their sum in the last row."""
        return np.concatenate([self.curves, self.curves.sum(axis=0)[None]])

    def check(self, usage: Usage) -> None:
        """Refuse a range that is too small."""
        if self.high < usage.reach:
            raise ValueError(
                f"hysteresis: the densities span up to {self.high:g} and {usage.plant} needs "
                f"{usage.reach:g}: give a wider range"
            )
