"""Modified Maxwell-slip model: a nonlinear spring and elasto-slip elements in parallel.

Displacement in, force out, it is the sum of a spring ``g`` and stops (see
:mod:`~pam_envs.hysteresis.maxwell_slip`); force in, displacement out, it is a hysteresis whose
loops need not be symmetric. For a muscle the force is its pressure and the displacement its
stiffness ``s = tension / (length - shortest length)``:

    P = g(s) + sum_i k_i (s - w_i),    w_i = play(s, r_i)

with ``g`` piecewise linear on evenly spaced knots. The pressure of a desired stiffness is this sum.
The stiffness under a pressure is found by marching along the branch from kink to kink, where an
element begins to slip or the spring has a knot: exact, with no tolerance.

References: yeh2010, section 3; T.-J. Yeh, S.-W. Lu, T.-Y. Wu, "Modeling and identification of
hysteresis in piezoelectric actuators", J. Dyn. Sys., Meas., Control 128 (2006).
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.hysteresis.checks import (
    check_not_negative,
    check_thresholds,
    floats,
    series,
    single_rows,
    width_of,
)
from pam_envs.hysteresis.elements import ParallelElements, play
from pam_envs.hysteresis.everett import table_from_weights, weights_from_table
from pam_envs.hysteresis.protocol import HysteresisModel, Kernels, Start, Usage, register
from pam_envs.kernels.build import entry, kernel

FAR = 1e300
MOST = 16
"""Most elements that the plants' kernels simulate."""
BREAKS, STIFFNESSES, SPRING, SEGMENT = range(4)
"""Rows of a member's table."""


@kernel
def _cell(x: float, segment: float, cells: int) -> int:
    """Return the cell of the spring that contains ``x``; the end cells are unbounded."""
    last = cells - 1.0
    return int(max(0.0, min(last, x / segment)))


@kernel
def _next_knot(cell: int, rising: bool, cells: int, segment: float) -> float:
    """Return the knot at which the spring's slope changes next."""
    if rising:
        return (cell + 1) * segment if cell + 1 < cells else FAR
    return cell * segment if cell > 0 else -FAR


@kernel
def _next_slip(left: bool, w: float, threshold: float, rising: bool) -> float:
    """Return the stiffness at which an element that is ``left`` begins to slip."""
    if not left:
        return FAR if rising else -FAR
    return w + threshold if rising else w - threshold


@kernel
def _nearer(a: float, b: float, rising: bool) -> float:
    return min(a, b) if rising else max(a, b)


@kernel
def _beyond(x: float, mark: float, rising: bool) -> bool:
    return x > mark if rising else x < mark


@kernel
def _spring(x: float, spring: Any, segment: float) -> float:
    cell = _cell(x, segment, len(spring) - 1)
    low, high = spring[cell], spring[cell + 1]
    return low + (high - low) * (x / segment - cell)


@kernel
def pressure_step(
    x: float, state: Any, lane: int, breaks: Any, stiffnesses: Any, spring: Any, segment: float,
    width: float,
) -> float:  # fmt: skip
    """Advance the slip positions to the stiffness ``x`` and return the pressure: the inverse.

    Parameters
    ----------
    x : float
        Stiffness [N/m].
    state : rows of float, shape (n, lanes)
        Slip positions [N/m] of each ``lane``; changed in place.
    breaks, stiffnesses : row of float, shape (n,)
        Deflections [N/m] at which the elements slip, rising, and their stiffnesses [Pa m/N].
    spring : row of float, shape (m,)
        Pressures [Pa] of the spring at the stiffnesses ``0, segment, 2 segment, ...`` [N/m].
    width : float
        Factor on the hysteresis; 0 leaves the line between the tips of the major loop, plus the
        deviation of the spring from its own line.

    Returns
    -------
    float
        Pressure [Pa].
    """
    held, friction = 0.0, 0.0
    for i in range(len(breaks)):
        w = play(x, breaks[i], state[i][lane])
        state[i][lane] = w
        held = held + stiffnesses[i] * (x - w)
        friction = friction + stiffnesses[i] * breaks[i]
    along = 2.0 * x / ((len(spring) - 1) * segment) - 1.0  # from -1 to 1 between the tips
    return _spring(x, spring, segment) + width * held + (1.0 - width) * friction * along


@kernel
def stiffness_step(
    pressure: float, state: Any, lane: int, breaks: Any, stiffnesses: Any, spring: Any,
    segment: float, width: float,
) -> float:  # fmt: skip
    """Advance the slip positions to the pressure [Pa] and return the stiffness [N/m].

    The other parameters are those of :func:`pressure_step`. Not-a-number gives not-a-number and
    leaves the state alone.

    In every state that the model can reach, no element slips at the slip position of the element
    that breaks first, and from there on the elements slip in the order of their thresholds.
    """
    n, cells = len(breaks), len(spring) - 1
    x = state[0][lane]
    held, holding, friction = 0.0, 0.0, 0.0
    for i in range(n):
        held = held + stiffnesses[i] * (x - state[i][lane])
        holding = holding + stiffnesses[i]
        friction = friction + stiffnesses[i] * breaks[i]
    held, holding, friction = width * held, width * holding, (1.0 - width) * friction
    tilt = 2.0 * friction / (cells * segment)
    reached = _spring(x, spring, segment) + held + tilt * x - friction
    rising = pressure > reached
    cell, k = _cell(x, segment, cells), 0
    for _ in range(n + cells):  # the most kinks on the way
        slope = tilt + (spring[cell + 1] - spring[cell]) / segment + holding
        next_one = min(k, n - 1)
        slip = _next_slip(k < n, state[next_one][lane], breaks[next_one], rising)
        kink = _nearer(_next_knot(cell, rising, cells, segment), slip, rising)
        there = reached + slope * (kink - x)
        if not _beyond(pressure, there, rising):
            break
        x, reached = kink, there
        slips = 1 if kink == slip else 0
        holding = holding - slips * width * stiffnesses[next_one]
        k = k + slips
        cell = cell + (1 - slips) * (1 if rising else -1)
    slope = tilt + (spring[cell + 1] - spring[cell]) / segment + holding
    x = x + (pressure - reached) / slope
    for i in range(n):
        state[i][lane] = play(x, breaks[i], state[i][lane])
    return x


@kernel
def slips_scaled(
    x: Any, y: Any, width: Any, rows: Any, fixed: Any, counts: Any, table: Any, elements: int,
    at: int, model: int, count: int, member: int, first: int, last: int,
) -> None:  # fmt: skip
    """Advance a tile to its pressures (:class:`~pam_envs.hysteresis.protocol.Kernels`)."""
    slips = rows[at : at + elements]
    for j in range(first, last):
        own = table[counts[member][j]]
        y[j] = stiffness_step(
            x[j], slips, j, own[BREAKS], own[STIFFNESSES], own[SPRING], own[SEGMENT][0], width[j]
        )


@kernel
def slips_begin(
    rows: Any, fixed: Any, counts: Any, table: Any, elements: int, at: int, model: int, count: int,
    member: int, j: int,
) -> None:  # fmt: skip
    """Write the slip positions of one lane after inflation and venting."""
    own = table[counts[member][j]]
    middle = 0.5 * (len(own[SPRING]) - 1) * own[SEGMENT][0]
    for k in range(elements):
        rows[at + k][j] = min(own[BREAKS][k], middle)


@entry
def _run(
    values: Array, state: Array, breaks: Array, stiffnesses: Array, spring: Array, segment: float,
    inverse: bool, out: Array,
) -> None:  # fmt: skip
    """Advance the lanes of ``state`` through records, ``values[t][lane]``."""
    for t in range(len(values)):
        for j in range(len(values[t])):
            x = values[t][j]
            if inverse:
                y = pressure_step(x, state, j, breaks, stiffnesses, spring, segment, 1.0)
            else:
                y = stiffness_step(x, state, j, breaks, stiffnesses, spring, segment, 1.0)
            out[t][j] = y


@register
@dataclass(frozen=True)
class ModifiedMaxwellSlip(ParallelElements, HysteresisModel):
    """Stiffness [N/m] as a hysteresis of pressure [Pa], with an exact inverse.

    Parameters
    ----------
    stiffnesses : tuple of float
        Stiffnesses ``k`` [Pa m/N] of the elements, at least 0.
    break_stiffnesses : tuple of float
        Deflections ``r`` [N/m] at which the elements slip, rising, at least 0. The pressure that
        an element holds when it slips is ``k r``.
    spring : tuple of float
        Pressures [Pa] of the nonlinear spring at 0, ``segment``, ``2 segment``, ...: at least two,
        and rising, so that a pressure has one stiffness where every element slips.
    segment : float
        Distance of the spring's knots [N/m].

    Notes
    -----
    The state holds the slip positions, shape (..., n). Beyond its knots the spring has its
    end slopes.
    """

    kind: ClassVar[str] = "modified_maxwell_slip"
    choice: ClassVar[str] = "maxwell_slip"
    kernels: ClassVar[Kernels] = Kernels(scaled=slips_scaled, begin=slips_begin)
    state_rows: ClassVar[int] = MOST + 1

    stiffnesses: tuple[float, ...]
    break_stiffnesses: tuple[float, ...]
    spring: tuple[float, ...]
    segment: float

    def __post_init__(self) -> None:
        for name in ("stiffnesses", "break_stiffnesses", "spring"):
            object.__setattr__(self, name, floats(name, getattr(self, name)))
        object.__setattr__(self, "segment", floats("segment", (self.segment,))[0])
        check_thresholds(
            "break_stiffnesses", self.break_stiffnesses, len(self.stiffnesses), "stiffnesses"
        )
        check_not_negative("stiffnesses", self.stiffnesses, "to dissipate and not create energy")
        if not self.stiffnesses:
            raise ValueError(
                "stiffnesses is empty; the model needs 1 element: give 0 for no hysteresis"
            )
        if not self.segment > 0.0:
            raise ValueError(f"segment is {self.segment}; it must be above 0: give the knots' gap")
        _check_spring(self.spring)

    @property
    def range(self) -> float:
        """Stiffness [N/m] of the spring's last knot."""
        return (len(self.spring) - 1) * self.segment

    @property
    def total_slope(self) -> float:
        """Stiffness over pressure [N/(m Pa)] between the tips of the major loop."""
        return self.range / (self.spring[-1] - self.spring[0] + 2.0 * self.friction)

    # --- the protocol ---------------------------------------------------------------------------

    @property
    def elements(self) -> int:
        """Rows of the state that are in use: the elements and an idle one."""
        return len(self.spring)

    def table_rows(self) -> Array:
        """Return break stiffnesses, stiffnesses, spring and segment, shape (4, n + 1).

        Filled up with an element that does nothing.
        """
        table = np.zeros((4, len(self.spring)))
        table[BREAKS] = (*self.break_stiffnesses, 2.0 * max(self.range, self.break_stiffnesses[-1]))
        table[STIFFNESSES, :-1] = self.stiffnesses
        table[SPRING] = self.spring
        table[SEGMENT] = self.segment
        return table

    def check(self, usage: Usage) -> None:
        """Refuse a plant without pressure-driven stiffness, and too many elements."""
        n = len(self.stiffnesses)
        if usage.unit_slope:
            raise ValueError(
                f"hysteresis: a modified Maxwell-slip model turns pressure into stiffness, which "
                f"{usage.plant} does not have; give a PlayOperator, a Preisach operator or None"
            )
        if n > MOST or len(self.spring) != n + 1:
            raise ValueError(
                f"hysteresis: {n} elements and {len(self.spring)} knots of the spring; at most "
                f"{MOST} elements and one knot more than elements are simulated: "
                "identify with fewer elements, or interpolate the spring at its knots"
            )

    def everett_map(
        self, low: float, high: float, levels: int, start: Start
    ) -> tuple[Array, float]:
        """Return the Everett map of the first-order reversal curves, and the output at the start.

        An operator with this map agrees on every loop where the model's minor loops are congruent,
        as with a straight spring; relays of negative weight, which bends of the spring may need,
        are left out.
        """
        grid = np.linspace(low, high, levels)
        table = np.zeros((levels, levels))
        for i in range(1, levels):
            down = grid[:i][::-1]
            rise = self.simulate(np.concatenate([[high, low], grid[1 : i + 1]]))[0]
            fall = self.simulate(np.concatenate([[high, low], grid[1 : i + 1], down]))[0]
            table[i, :i] = rise[-1] - fall[-i:][::-1]
        return table_from_weights(np.maximum(weights_from_table(table), 0.0)), 0.0

    # --- operation ------------------------------------------------------------------------------

    @cached_property
    def arrays(self) -> tuple[Array, Array, Array, float]:
        """Arguments of the kernels: breaks, stiffnesses, spring, segment."""
        return *self.parts[:2], np.array(self.spring), self.segment

    @cached_property
    def parts(self) -> tuple[Array, Array, float]:
        """Break stiffnesses, stiffnesses, and the slope between the spring's ends."""
        slope = (self.spring[-1] - self.spring[0]) / self.range
        return np.array(self.break_stiffnesses), np.array(self.stiffnesses), slope

    def initial_state(self, batch_shape: tuple[int, ...] = ()) -> Array:
        """Return the slip positions after inflation and venting, shape ``(*batch_shape, n)``.

        An element that does not slip over the whole range starts from the middle of the range.
        """
        start = np.minimum(self.break_stiffnesses, 0.5 * self.range)
        return np.broadcast_to(start, (*batch_shape, len(start))).copy()

    def step(self, pressure: ArrayLike, state: ArrayLike) -> tuple[Array, Array]:
        """Return the stiffnesses [N/m] of pressures [Pa], shape (...), and the state after them.

        The state holds the slip positions [N/m], shape (..., n); the given state is not changed.
        """
        return self._rows(pressure, state, False)

    def inverse_step(self, stiffness: ArrayLike, state: ArrayLike) -> tuple[Array, Array]:
        """Return the pressure [Pa] that gives a stiffness [N/m], and the state it leaves.

        The shapes are those of :meth:`step`, whose exact inverse this is.
        """
        return self._rows(stiffness, state, True)

    def simulate(self, pressure: ArrayLike, state: ArrayLike | None = None) -> tuple[Array, Array]:
        """Return the stiffnesses, shape (T,), for pressures of shape (T,), and the last state."""
        return self._record(pressure, state, False)

    def inverse_simulate(
        self, stiffness: ArrayLike, state: ArrayLike | None = None
    ) -> tuple[Array, Array]:
        """Return the pressures, shape (T,), for stiffnesses of shape (T,), and the last state."""
        return self._record(stiffness, state, True)

    def scaled(self, width: float, slope: float | None = None) -> "ModifiedMaxwellSlip":
        """Return this model with its hysteresis ``width`` times as wide, 0 for none.

        The spring takes over the pressure of the elements at the tips of the major loop; the tips
        are the same, whatever ``slope``.
        """
        width = width_of(width)
        tilt = (1.0 - width) * self.friction * np.linspace(-1.0, 1.0, len(self.spring))
        stiffnesses = tuple(width * k for k in self.stiffnesses)
        return replace(self, stiffnesses=stiffnesses, spring=tuple(np.add(self.spring, tilt)))

    def _rows(self, values: ArrayLike, state: ArrayLike, inverse: bool) -> tuple[Array, Array]:
        shape, n = np.shape(state)[:-1], len(self.stiffnesses)
        if np.shape(state)[-1:] != (n,):
            raise ValueError(
                f"state has shape {np.shape(state)}; its last axis must be the {n} elements:"
                " begin with initial_state(batch_shape)"
            )
        rows = np.array(np.asarray(state, float).reshape(-1, n).T, order="C")
        taken = np.array(np.broadcast_to(np.asarray(values, float), shape)).reshape(1, -1)
        out = np.empty_like(taken)
        _run(taken, rows, *self.arrays, inverse, out)
        return out.reshape(shape), np.ascontiguousarray(rows.T).reshape(*shape, n)

    def _record(
        self, values: ArrayLike, state: ArrayLike | None, inverse: bool
    ) -> tuple[Array, Array]:
        taken = series(values)
        rows = single_rows(self.initial_state() if state is None else state, len(self.stiffnesses))
        out = np.empty_like(taken)
        _run(taken[:, None], rows, *self.arrays, inverse, out[:, None])
        return out, rows[:, 0]


def _check_spring(spring: tuple[float, ...]) -> None:
    if len(spring) < 2:
        raise ValueError(f"spring has {len(spring)} knots; it needs 2: give its two ends")
    for i, (low, high) in enumerate(pairwise(spring)):
        if not high > low:
            raise ValueError(
                f"spring[{i + 1}] is {high}, not above spring[{i}] = {low}; the spring must rise"
                " for a pressure to have one stiffness: refit with a least slope"
            )


def even_model(
    full_pressure: float, full_stiffness: float, friction: float, elements: int = 10
) -> ModifiedMaxwellSlip:
    """Return a model with a straight mean line and equal break pressures.

    Parameters
    ----------
    full_pressure, full_stiffness : float
        Pressure [Pa] and stiffness [N/m] of the major loop's upper tip; the lower one is at 0.
    friction : float
        Pressure [Pa] of all elements together when all slip; below half the full pressure.
    elements : int
        Number of elements ``N``; the ``i``-th slips at ``i full_stiffness / (2 N)``.
    """
    if not 0.0 <= friction < 0.5 * full_pressure:
        raise ValueError(
            f"friction is {friction}; it must be from 0 to below half of {full_pressure}, or the"
            " spring would fall: give a smaller friction"
        )
    breaks = 0.5 * full_stiffness * np.arange(1, elements + 1) / elements
    spring = np.linspace(friction, full_pressure - friction, elements + 1)
    return ModifiedMaxwellSlip(
        tuple(friction / elements / breaks), tuple(breaks), tuple(spring), full_stiffness / elements
    )
