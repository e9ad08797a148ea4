"""Modified Maxwell-slip model from vented loops, by a linear programme.

A loop rises from rest at pressure 0 to a peak and falls back. From its bottom every element is
stretched to ``-r_m = -m delta``; at the stiffness ``x = 2 i delta`` on the way up, and after
falling by as much from any peak, the elements have changed by

    S_i = 2 delta sum_{m <= i} m k_m + 2 i delta sum_{m > i} k_m

so that the break pressures are linear in the stiffnesses ``k`` and in the spring ``g``:

    rising to x_i              F_i  = S_i + g_i - g_0
    falling from x_j by x_i    F'_i = F_j - S_i + g_{j-i} - g_j

The sum of absolute errors at the break points is least, with ``k >= 0``, a rising spring,
``g_0 = sum m delta k_m`` (a loop begins at pressure 0) and the major loop closed at its tip. In
equations (7) to (9) of the source the right-hand sides of the two branches are mixed up, the
second term of the sum repeats the first, and the two last constraints are missing;
:func:`printed_programme` keeps the mixed right-hand sides to show what they give.

A major loop does not determine every ``k``: the rank of the equations is returned with the names of
the open ones. The equations that a loop with a turn between two break points would add are below
the noise and are not counted.

References
----------
yeh2010, section 3.1. T.-J. Yeh, S.-W. Lu, T.-Y. Wu, "Modeling and identification of hysteresis in
piezoelectric actuators", J. Dyn. Sys., Meas., Control 128 (2006).
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import null_space
from scipy.optimize import linprog

from pam_envs.arrays import Array
from pam_envs.hysteresis.modified_maxwell_slip import ModifiedMaxwellSlip
from pam_envs.identification.preisach_forc import measured

Loop = tuple[ArrayLike, ArrayLike]
Form = Literal["corrected", "printed"]

LEAST_SLOPE = 1e-3
"""Least slope of the spring over that of the line between the tips of the major loop."""
WEAKEST = 1.2e-3
"""Least singular value of the equations, over the largest, that counts: smaller ones would amplify
the noise of a record almost a thousandfold."""
OPEN = 0.05  # least part of an open element in an undetermined combination
AT_ZERO = 0.02  # part of the largest stiffness within which a loop's bottom counts as 0


class OpenParameters(UserWarning):
    """The loops leave parameters open."""


@dataclass(frozen=True)
class SlipFit:
    """Identified model and its identifiability."""

    model: ModifiedMaxwellSlip  # among all optimal models, the one with the least friction
    objective: float  # sum of the absolute errors at the break points [Pa]
    relative_objective: float  # the same over the largest pressure
    rank: int  # of the equations
    unknowns: int  # 2 N + 1: k_1 .. k_N and g_0 .. g_N
    # names of the undetermined stiffnesses; k_N is always one of them: the last element never
    # slips, and acts as a part of the spring
    open: tuple[str, ...]

    @property
    def determined(self) -> bool:
        """True if all but the split between ``k_N`` and the spring is determined."""
        return self.unknowns - self.rank <= 1

    @property
    def note(self) -> str:
        """Unknowns that the loops leave open, in a sentence."""
        fixed = f"the loops fix {self.rank} of {self.unknowns} unknowns"
        if self.determined:
            return f"{fixed}; the last element acts as a part of the spring"
        return (
            f"{fixed}; {', '.join(self.open)} stay open, so that other loops than these may be"
            " predicted wrongly: add a minor loop, best of a peak just below the major one"
        )


def fit_slip_programme(loops: Sequence[Loop], elements: int = 10) -> SlipFit:
    """Return the modified Maxwell-slip model with ``elements`` that is nearest to some loops.

    Each loop is a pair of pressure [Pa] and stiffness [N/m], shapes (T,), from rest at pressure 0
    after a larger loop, up to a peak and back; the one with the largest stiffness is the major
    loop. Warns :class:`OpenParameters`, with their names, if more than the split between the last
    element and the spring is undetermined. A ValueError says that there is no loop, that one does
    not begin at rest, or that there is no solution.
    """
    found = _solution(loops, elements, "corrected")
    rank, names = _fixed(found.rows, elements)
    grid = found.grid
    model = ModifiedMaxwellSlip(
        tuple(found.stiffnesses), tuple(grid.breaks), tuple(found.spring), grid.segment
    )
    relative = found.objective / found.full
    fit = SlipFit(model, found.objective, relative, rank, 2 * elements + 1, names)
    if not fit.determined:
        warnings.warn(fit.note, OpenParameters, stacklevel=2)
    return fit


def printed_programme(loops: Sequence[Loop], elements: int = 10) -> tuple[float, Array]:
    """Return relative objective and spring (N + 1,) [Pa], which does not rise, as printed."""
    found = _solution(loops, elements, "printed")
    return found.objective / found.full, found.spring


@dataclass(frozen=True)
class _Grid:
    elements: int
    full: float

    @property
    def segment(self) -> float:
        return self.full / self.elements

    @property
    def breaks(self) -> Array:
        return np.asarray(0.5 * self.segment * np.arange(1, self.elements + 1))

    def changes(self, travel: float) -> Array:
        """Return the factor of each ``k`` after a travel from one turn."""
        return np.minimum(travel, 2.0 * self.breaks)

    def spring(self, x: float) -> Array:
        """Return the factor of each ``g`` at a stiffness."""
        knots = np.arange(self.elements + 1.0)
        return np.asarray(np.maximum(0.0, 1.0 - np.abs(x / self.segment - knots)))


@dataclass(frozen=True)
class _Solution:
    """Solution of a linear programme; ``full`` is the largest pressure [Pa]."""

    grid: _Grid
    rows: Array
    stiffnesses: Array
    spring: Array
    objective: float
    full: float


def _solution(loops: Sequence[Loop], elements: int, form: Form) -> _Solution:
    branches = [_branches(k, loop) for k, loop in enumerate(loops)]
    if not branches:
        raise ValueError("loops is empty; give one major loop at least, and a minor one")
    if elements < 1:
        raise ValueError(f"elements is {elements}; it must be at least 1: 10 is usual")
    major = max(branches, key=lambda branch: float(branch.stiffness[0]))
    grid, full = _Grid(elements, float(major.stiffness[0])), float(major.pressure[0])
    rows, right = _equations(grid, branches, form, full)
    ties, tied = _constraints(grid, major, form)
    k, g, objective = _programme(grid, rows, right, ties, tied, full, form)
    return _Solution(grid, np.vstack([rows, ties]), k, g, objective, full)


@dataclass(frozen=True)
class _Branches:
    """A loop: its peak first, then its two branches as functions of the stiffness."""

    stiffness: Array  # of the falling branch
    pressure: Array
    rising: tuple[Array, Array]

    def up(self, x: float) -> float:
        return float(np.interp(x, *self.rising))

    def down(self, x: float) -> float:
        return float(np.interp(x, self.stiffness[::-1], self.pressure[::-1]))


def _branches(number: int, loop: Loop) -> _Branches:
    pressure, stiffness = measured(*loop)
    top = int(np.argmax(stiffness))
    if min(top, len(stiffness) - 1 - top) < 1:
        raise ValueError(
            f"loop {number} does not rise and fall; it must go up to a peak and back: cut the"
            " record at its rests"
        )
    for name, values in (("stiffness", stiffness), ("pressure", pressure)):
        if abs(values[0]) > AT_ZERO * np.max(np.abs(values)):
            raise ValueError(
                f"loop {number} begins at a {name} of {values[0]:.4g}; it must begin at 0: vent"
                " the muscle before each loop"
            )
    up = np.maximum.accumulate(stiffness[: top + 1])
    down = np.minimum.accumulate(stiffness[top:])
    return _Branches(down, pressure[top:], (up, pressure[: top + 1]))


def _equations(
    grid: _Grid, branches: Sequence[_Branches], form: Form, full: float
) -> tuple[Array, Array]:
    rows, right = list[Array](), list[float]()
    zero = grid.spring(0.0)
    for branch in branches:
        peak = float(branch.stiffness[0])
        at_peak = np.concatenate([grid.changes(peak), grid.spring(peak) - zero])
        inner = np.arange(1, grid.elements) * grid.segment
        for x in inner[inner < peak * (1.0 - 1e-9)]:
            up = np.concatenate([grid.changes(x), grid.spring(x) - zero])
            back = np.concatenate([-grid.changes(peak - x), grid.spring(x) - grid.spring(peak)])
            if form == "corrected":
                rows += [up, at_peak + back]
                right += [branch.up(x), branch.down(x)]
            else:  # the signs of S on the wrong branches, as printed
                rows += [_mirrored(up, grid), _mirrored(back, grid)]
                right += [branch.up(x) - full, branch.down(x)]
        if form == "corrected" and peak < grid.full:
            rows.append(at_peak)
            right.append(float(branch.pressure[0]))
    return np.array(rows), np.array(right)


def _mirrored(row: Array, grid: _Grid) -> Array:
    return np.concatenate([-row[: grid.elements], row[grid.elements :]])


def _constraints(grid: _Grid, major: _Branches, form: Form) -> tuple[Array, Array]:
    """Return the equations that hold exactly: the loop begins at 0 and ends at its tip."""
    if form == "printed":
        return np.zeros((0, 2 * grid.elements + 1)), np.zeros(0)
    zero, full = grid.spring(0.0), grid.full
    start = np.concatenate([grid.breaks, -zero])
    tip = np.concatenate([grid.changes(full), grid.spring(full) - zero])
    return np.array([start, tip]), np.array([0.0, float(major.pressure[0])])


def _programme(
    grid: _Grid, rows: Array, right: Array, ties: Array, tied: Array, full: float, form: Form
) -> tuple[Array, Array, float]:
    """Solve twice: for the least error, and among its solutions for the least friction."""
    n, m, unknowns = grid.elements, len(rows), 2 * grid.elements + 1
    size = np.concatenate([np.full(n, full / grid.full), np.full(n + 1, full)])
    a, b, slack = rows * size / full, right / full, np.eye(m)
    above, below = [np.hstack([a, -slack]), np.hstack([-a, -slack])], [b, -b]
    if form == "corrected":
        falls = np.eye(n, n + 1) - np.eye(n, n + 1, 1)
        above.append(np.hstack([np.zeros((n, n)), falls, np.zeros((n, m))]))
        below.append(np.full(n, -LEAST_SLOPE / n))
    limits: dict[str, Any] = {
        "A_eq": np.hstack([ties * size / full, np.zeros((len(ties), m))]),
        "b_eq": tied / full,
        "bounds": [(0.0, None)] * n + [(None, None)] * (n + 1) + [(0.0, None)] * m,
    }
    errors = np.concatenate([np.zeros(unknowns), np.ones(m)])
    best = _solved(errors, np.vstack(above), np.concatenate(below), limits)
    above.append(errors[None, :])
    below.append(np.array([best[unknowns:].sum() * 1.001 + 1e-6]))
    friction = np.concatenate([np.arange(1.0, n + 1.0) / n, np.zeros(n + 1 + m)])
    found = _solved(friction, np.vstack(above), np.concatenate(below), limits)[:unknowns] * size
    objective = float(np.sum(np.abs(rows @ found - right)))
    return np.maximum(found[:n], 0.0), found[n:], objective


def _solved(cost: Array, above: Array, below: Array, limits: dict[str, Any]) -> Array:
    result = linprog(cost, A_ub=above, b_ub=below, method="highs", **limits)
    if result.status != 0:
        raise ValueError(
            f"the programme has no solution ({result.message.strip()}); a loop may not begin at"
            " rest, or not follow a larger one: look at the loops"
        )
    return np.asarray(result.x)


def _fixed(rows: Array, elements: int) -> tuple[int, tuple[str, ...]]:
    """Return the rank of the equations, and the names of the elements that they leave open."""
    sizes = np.linalg.norm(rows, axis=0)
    scaled = rows / np.where(sizes > 0.0, sizes, 1.0)
    free = null_space(scaled, rcond=WEAKEST)
    left_open = np.max(np.abs(free[:elements]), axis=1, initial=0.0) > OPEN
    names = tuple(f"k_{m + 1}" for m in np.flatnonzero(left_open))
    return rows.shape[1] - free.shape[1], names
