"""Classical Preisach operator, with its exact recursive inverse.

Relays of all switching thresholds in parallel, weighted by a density: the general rate-independent
hysteresis in which larger excursions wipe out smaller ones and all minor loops between the same two
inputs are congruent. The operator is represented by its Everett map
(:mod:`~pam_envs.hysteresis.everett`) and by a stack of dominant extrema
(:mod:`~pam_envs.hysteresis.extrema`): a few operations a step whatever the grid. Play operators are
the special case whose density depends on ``alpha - beta`` alone.

References
----------
I. D. Mayergoyz, "Mathematical Models of Hysteresis", Springer 1991, chapter 1.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.arrays import Array
from pam_envs.hysteresis import everett as maps
from pam_envs.hysteresis.checks import floats, series, width_of
from pam_envs.hysteresis.extrema import (
    DEPTH,
    STATE_ROWS,
    advance_rows,
    invert_rows,
    relays_begin,
    relays_peek,
    relays_step,
)
from pam_envs.hysteresis.protocol import (
    HysteresisModel,
    Kernels,
    Rows,
    RowsState,
    Start,
    Usage,
    padded,
    register,
)

SMALLEST_WEIGHT = -1e-12
"""Relay weights down to this part of the largest Everett value count as rounding errors."""


class PreisachState(NamedTuple):
    """History of a batch: extrema and outputs, shapes (depth, ...), and points in use."""

    stack: Array
    sums: Array
    counts: NDArray[np.int64]


@register
@dataclass(frozen=True)
class Preisach(HysteresisModel):
    """Preisach operator on the inputs from ``low`` to ``high``.

    Parameters
    ----------
    low, high : float
        Range [unit of the input]; an input beyond it counts as the nearest end.
    table : array_like, shape (n, n)
        Everett map at ``n >= 2`` evenly spaced inputs, antisymmetric, of relay weights that are
        nowhere negative; kept as a tuple of tuples. Interpolated bilinearly in between.
    depth : int
        Extrema that are kept, at least 3. If there are more, the smallest loop is dropped.
    start : {"low", "virgin"}
        State at the beginning: every relay down, at ``low``; or demagnetised, at 0 in a range with
        ``low = -high`` and a map with ``mu(a, b) = mu(-b, -a)``. A muscle at ``"low"`` has always
        been vented to ``low`` before.
    start_output : float
        Output at the beginning [unit of the output]. 0 for a virgin start.

    Raises
    ------
    ValueError
        If a value is out of bounds, or a relay weight is negative (the message names the cell).
    """

    kind: ClassVar[str] = "preisach"
    kernels: ClassVar[Kernels] = Kernels(relays_step, peek=relays_peek, begin=relays_begin)
    state_rows: ClassVar[int] = STATE_ROWS
    largest_count: ClassVar[int] = DEPTH

    low: float
    high: float
    table: tuple[tuple[float, ...], ...]
    depth: int = DEPTH
    start: Start = "low"
    start_output: float = 0.0

    def __post_init__(self) -> None:
        low, high, output = floats(
            "(low, high, start_output)", (self.low, self.high, self.start_output)
        )
        table = np.array(self.table, dtype=float)
        rows = tuple(tuple(row) for row in table.tolist()) if table.ndim == 2 else ()
        for name, value in (("low", low), ("high", high), ("start_output", output)):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "table", rows)
        if not low < high:
            raise ValueError(f"low is {low} and high is {high}; low must be below high: swap them")
        if self.depth < 3:
            raise ValueError(f"depth is {self.depth}; a loop needs 3 points: 24 is the default")
        _check_table(table)
        self._check_start(table)

    def _check_start(self, table: Array) -> None:
        if self.start not in ("low", "virgin"):
            raise ValueError(f"start is {self.start!r}; choose 'low' or 'virgin'")
        if self.start == "low":
            return
        if self.low != -self.high or self.start_output != 0.0:
            raise ValueError(
                f"start is 'virgin' with low = {self.low}, high = {self.high} and start_output ="
                f" {self.start_output}; it needs low = -high and 0: widen the range, or use 'low'"
            )
        error = maps.symmetry_error(table)
        if error > 1e-9:
            raise ValueError(
                f"start is 'virgin' and the table is asymmetric by {error:.2g} of its largest"
                " entry; it needs mu(a, b) = mu(-b, -a) to 1e-9: use start='low', or symmetrise"
            )

    # --- construction ---------------------------------------------------------------------------

    @classmethod
    def from_weights(
        cls, weights: ArrayLike, low: float, high: float, depth: int = 24, start: Start = "low",
        start_output: float = 0.0,
    ) -> "Preisach":  # fmt: skip
        """Return the operator with relay weights per cell, shape (n - 1, n - 1).

        ``weights[k][l]``, ``l <= k``, is the change of the output, in its unit, by the relays that
        switch up in cell ``k`` and down in cell ``l``.
        """
        table = maps.table_from_weights(weights)
        return cls(low, high, table, depth, start, start_output)  # type: ignore[arg-type]

    @classmethod
    def from_density(
        cls, density: Callable[[Array, Array], ArrayLike], low: float, high: float,
        levels: int = 33, depth: int = 24, start: Start = "low",
    ) -> "Preisach":  # fmt: skip
        """Return the operator of a density ``mu(alpha, beta)``, output per input squared.

        The density is taken at the middle of each cell; a cell on the diagonal, which is half a
        cell, at the middle of its triangle.
        """
        cell = (high - low) / (levels - 1)
        down, up = np.meshgrid(*2 * (low + cell * (np.arange(levels - 1) + 0.5),))
        near = np.eye(levels - 1) / 6.0 * cell
        values = np.broadcast_to(np.asarray(density(up + near, down - near), float), up.shape)
        area = cell**2 * (1.0 - 0.5 * np.eye(levels - 1))
        return cls.from_weights(np.tril(values * area), low, high, depth, start)

    @classmethod
    def resembling(
        cls, reference: Any, low: float, high: float, levels: int = 33, start: Start = "low",
        depth: int = DEPTH,
    ) -> "Preisach":  # fmt: skip
        """Return the operator with the Everett map of a reference model.

        For plays it is exact at the grid's inputs, and starts in their virgin state, or where they
        are after the input has come up to ``low`` from far below.
        """
        table, output = reference.everett_map(low, high, levels, start)
        return cls(low, high, table, depth, start, output)

    def plus_linear(self, slope: float) -> "Preisach":
        """Return this operator with ``slope * x`` added to its output."""
        return self._mixed(1.0, slope)

    def scaled(self, width: float, slope: float | None = None) -> "Preisach":
        """Return this operator with its hysteresis made ``width`` times as wide.

        The output is ``s x - width (s x - y)`` with ``s`` the ``slope``, :attr:`total_slope`
        unless given: 0 is the line ``s x``, 1 is this operator.
        """
        width = width_of(width)
        s = self.total_slope if slope is None else slope
        return self._mixed(width, (1.0 - width) * s)

    def _mixed(self, width: float, slope: float) -> "Preisach":
        table = width * self.everett + slope * (self.levels[:, None] - self.levels)
        start = self.low if self.start == "low" else 0.0
        output = width * self.start_output + slope * start
        return replace(self, table=table, start_output=output)  # type: ignore[arg-type]

    # --- properties of the map ------------------------------------------------------------------

    @cached_property
    def everett(self) -> Array:
        """The Everett map as a read-only array, shape (n, n)."""
        table = np.array(self.table)
        table.setflags(write=False)
        return table

    @cached_property
    def levels(self) -> Array:
        """The inputs of the map's rows and columns, shape (n,)."""
        return np.linspace(self.low, self.high, len(self.table))

    @cached_property
    def weights(self) -> Array:
        """The relay weights per cell, shape (n - 1, n - 1), lower triangle; none negative."""
        return maps.weights_from_table(self.everett)

    @property
    def inverse_cell(self) -> float:
        """Cells per unit of input."""
        return (len(self.table) - 1) / (self.high - self.low)

    @property
    def total_slope(self) -> float:
        """The slope at the two tips of the major loop: for plays, that where all of them move."""
        e = self.everett
        return float((2.0 * e[-1, 0] - e[-2, 0] - e[-1, 1]) / 2.0 * self.inverse_cell)

    @cached_property
    def largest_lag(self) -> float:
        """Half the largest distance between the branches of the widest loop."""
        e = self.everett
        return 0.5 * float(np.max(np.asarray(e[-1, 0] - e[-1] - e[:, 0])))

    # --- the protocol ---------------------------------------------------------------------------

    def numbers(self, full: float | None = None) -> list[float]:
        """Return the slope of the chord, range and cells per input, and the start."""
        cells, span = len(self.table) - 1, self.high - self.low
        low, per_input = self.low, cells / span
        if full is not None:
            low, per_input = -full, 0.5 * cells * (1.0 / full)
        bottom = self.low if self.start == "low" else 0.0
        high = low + cells / per_input  # as preisach_step has it
        return padded([self.table[-1][0] / span, low, per_input, high, bottom, self.start_output])

    def table_rows(self) -> Array:
        """Return the Everett map."""
        return self.everett

    def check(self, usage: Usage) -> None:
        """Refuse another start, range or depth than the plant simulates."""
        span, full = (self.low, self.high), usage.full
        needed = None
        if full is not None:
            needed = (-full, full) if usage.start == "virgin" else (0.0, full)
        wrong = needed is not None and not np.allclose(span, needed, rtol=1e-9)
        if wrong or self.start != usage.start or self.depth != DEPTH:
            text = "" if needed is None else f" from {needed[0]:g} to {needed[1]:g} (its range)"
            raise ValueError(
                f"hysteresis: the Everett map spans {span} with start {self.start!r} and depth "
                f"{self.depth}; {usage.plant} needs a map{text} with start {usage.start!r} and "
                f"depth {DEPTH}"
            )
        if self.high < usage.reach:
            raise ValueError(
                f"hysteresis: the Everett map spans +-{self.high:g} and {usage.plant} needs "
                f"+-{usage.reach:g}: give a wider map"
            )

    def rows(self) -> "PreisachRows":
        """Return the operator over rows of environments, whose state has the row first."""
        return PreisachRows(self)

    def record(self) -> dict[str, Any]:
        """Return range, map and a start other than virgin, in the layout of a plant file."""
        table = [[float(v) for v in row] for row in self.table]
        made = {"kind": self.kind, "low": self.low, "high": self.high, "table": table}
        return made | ({} if self.start == "virgin" else {"start": self.start})

    @classmethod
    def keys(cls) -> tuple[str, ...]:
        """Return the keys of a record."""
        return ("low", "high", "table")

    @classmethod
    def optional(cls) -> tuple[str, ...]:
        """Return the keys that a record may leave out."""
        return ("start",)

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> "Preisach":
        """Return the operator of a record, virgin unless it names another start."""
        table = tuple(tuple(float(v) for v in row) for row in record["table"])
        start = record.get("start", "virgin")
        return cls(float(record["low"]), float(record["high"]), table, start=start)

    # --- operation ------------------------------------------------------------------------------

    def initial_state(self, batch_shape: tuple[int, ...] = ()) -> PreisachState:
        """Return the state at the beginning, arrays of shape (depth, ...)."""
        stack = np.zeros((self.depth, *batch_shape))
        sums = np.zeros((self.depth, *batch_shape))
        stack[0] = self.low if self.start == "low" else 0.0
        sums[0] = self.start_output
        return PreisachState(stack, sums, np.ones(batch_shape, dtype=np.int64))

    def simulate(
        self, x: ArrayLike, state: PreisachState | None = None
    ) -> tuple[Array, PreisachState]:
        """Return the outputs, shape (T,), for inputs of shape (T,), and the last state."""
        values = series(x)
        start = self.initial_state() if state is None else state
        if np.ndim(start.counts) != 0:
            raise ValueError(
                f"state is of a batch of shape {np.shape(start.counts)}; "
                "simulate takes one: use step"
            )
        rows, y = self._rows(start), np.empty_like(values)
        advance_rows(values[:, None], *rows, self.everett, self.low, self.inverse_cell, y[:, None])
        return y, _shaped(rows, ())

    def step(self, x: ArrayLike, state: PreisachState) -> tuple[Array, PreisachState]:
        """Return the outputs and the new state for one sample of every row.

        ``x`` and the outputs have the batch's shape; ``state`` is not changed.
        """
        return self._each(advance_rows, x, state)

    def after(self, x: ArrayLike, state: PreisachState) -> PreisachState:
        """Return the state after inputs one after the other, shape ``(T, *batch)``."""
        values, rows = np.array(x, float).reshape(len(np.asarray(x)), -1), self._rows(state)
        outputs = np.empty_like(values)
        advance_rows(values, *rows, self.everett, self.low, self.inverse_cell, outputs)
        return _shaped(rows, np.shape(state.counts))

    def inverse_step(self, y: ArrayLike, state: PreisachState) -> tuple[Array, PreisachState]:
        """Return the input that takes the output to ``y``, and the state after that input.

        ``y`` has the batch's shape; an output out of reach gives the nearest end of the range of
        inputs. ``state`` is not changed.

        Raises
        ------
        ValueError
            If the output can rest while the input moves (a cell of the diagonal has no weight), so
            that there is no unique input.
        """
        k, weight = self._stiff_cell
        if weight <= 0.0:
            raise ValueError(
                f"the relay weight of the diagonal cell {k} is {weight}; it must be"
                " above 0 for an inverse, or the output does not move after a turn: add a line"
                " with plus_linear(slope)"
            )
        return self._each(invert_rows, y, state)

    @cached_property
    def _stiff_cell(self) -> tuple[int, float]:
        """Cell of the diagonal with the smallest relay weight, and that weight."""
        diagonal = np.diag(self.weights)
        k = int(np.argmin(diagonal))
        return k, diagonal[k]

    def _each(
        self, kernel: Callable[..., None], given: ArrayLike, state: PreisachState
    ) -> tuple[Array, PreisachState]:
        """Return the answers of a kernel for one sample of every row, and the new state."""
        shape = np.shape(state.counts)
        values = np.array(np.broadcast_to(np.asarray(given, float), shape)).reshape(1, -1)
        rows, answers = self._rows(state), np.empty_like(values)
        kernel(values, *rows, self.everett, self.low, self.inverse_cell, answers)
        return answers.reshape(shape), _shaped(rows, shape)

    def _rows(self, state: PreisachState) -> tuple[Array, Array, NDArray[np.int64]]:
        """Return copies of the arrays, shapes (depth, lanes) and (lanes,)."""
        shape = (len(state.stack), -1)
        stack, sums = (np.array(values, float).reshape(shape) for values in state[:2])
        return stack, sums, np.array(state.counts, dtype=np.int64).reshape(-1)


@dataclass(frozen=True)
class PreisachRows(Rows):
    """A Preisach operator over rows of environments; its state is kept with the row first."""

    operator: Preisach

    def initial(self, rows: int) -> RowsState:
        """Return extrema and outputs, shapes (rows, depth), and counts, (rows,)."""
        return _row_first(self.operator.initial_state((rows,)))

    def forward(self, x: Array, state: RowsState) -> tuple[Array, RowsState]:
        """Return the outputs for inputs, shape (rows,), and the states they leave."""
        output, after = self.operator.step(x, _row_last(state))
        return output, _row_first(after)

    def along(self, x: Array, state: RowsState) -> RowsState:
        """Return the states after inputs one after the other, in one loop."""
        return _row_first(self.operator.after(x, _row_last(state)))

    def inverse(self, y: Array, state: RowsState) -> Array:
        """Return the inputs by the recursion over the stack; the states do not change."""
        return self.operator.inverse_step(y, _row_last(state))[0]


def _row_first(state: PreisachState) -> RowsState:
    stack, sums, counts = state
    return stack.T, sums.T, counts


def _row_last(state: RowsState) -> PreisachState:
    stack, sums, counts = state
    return PreisachState(np.ascontiguousarray(stack.T), np.ascontiguousarray(sums.T), counts)


def _shaped(rows: tuple[Array, Array, NDArray[np.int64]], shape: tuple[int, ...]) -> PreisachState:
    stack, sums, count = rows
    full = (len(stack), *shape)
    return PreisachState(stack.reshape(full), sums.reshape(full), count.reshape(shape))


def _check_table(table: Array) -> None:
    if table.ndim != 2 or table.shape[0] != table.shape[1] or len(table) < 2:
        raise ValueError(f"table has shape {table.shape}; it must be square, 2 by 2 or larger")
    if not np.all(np.isfinite(table)):
        i, j = np.argwhere(~np.isfinite(table))[0]
        raise ValueError(f"table[{i}][{j}] is {table[i, j]}; it must be finite: fill the gap")
    if np.any(table != -table.T):
        i, j = np.argwhere(table != -table.T)[0]
        raise ValueError(
            f"table[{i}][{j}] is {table[i, j]} and table[{j}][{i}] is {table[j, i]}; E(b, a) must"
            " be -E(a, b): give both halves, or build the operator with from_weights"
        )
    weights = maps.weights_from_table(table)
    k, j = np.unravel_index(np.argmin(weights), weights.shape)
    rounding = SMALLEST_WEIGHT * np.max(np.abs(table)) - np.finfo(float).tiny
    if weights[k, j] < rounding:
        raise ValueError(
            f"the relay weight of cell ({k}, {j}) is {weights[k, j]:.3g}; it must be at least 0 or"
            " loops create energy: clip it with from_weights, or identify with fit_preisach"
        )
