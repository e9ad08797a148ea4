"""Open-loop positioning from measured tables: one pressure curve for each load and branch.

The method of positioning2021: curves p(contraction), one for inflation and one for deflation at
each load; the setpoint is the curve of the present branch at the present reference. No measurement
is used after the start. The curves are

- monotone piecewise cubics through the mean readings, without fitting error ("table");
- the six published cubics (Eqs. 7 to 12) exactly as printed ("plc_as_printed"): some coefficients
  were truncated in print (0.00399 became 0.003 in Eq. 11), so that at 4.55 kg the pressure is up to
  2.6 bar wrong;
- the same cubics refitted to Table 6 in full precision, with its one wrong entry (4.55 kg,
  inflation, 2 mm) replaced by the value of Table 5 ("plc_refitted");
- one cubic a load for both branches ("one_cubic"), and a straight line a load ("linear"): without
  hysteresis.

The reference alone determines the branch, as in a programmable logic controller: it changes when
the reference has reversed by more than a dead band from the extremum since the last change. A held
reference keeps its branch, a step selects the correct one at once, and a slow ramp after the dead
band; sensor noise has no influence.

Limitation: after a small reversal, wider than the dead band, the curve jumps from one branch of the
*major* loop to the other, although the muscle has only entered a narrow minor loop. The setpoint
then jumps by up to the width of the major loop (1 bar), up to 3 mm of contraction. Minor loops
require a state of all extrema (:mod:`baselines.positioning.inverse`).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import (
    Prediction,
    Reader,
    RowController,
    Rows,
    by_load,
    encode_action,
    reader,
)
from baselines.core.entry import Entry, Spec
from baselines.positioning.contraction_tables import (
    LOADS,
    BranchCurves,
    one_cubic_inverse,
    pchip_inverse,
    published_inverse,
    table_6_inverse,
)
from pam_envs.arrays import Array
from pam_envs.data.tables import load_contraction_table
from pam_envs.parameters import Signal

DEAD_BAND = 5e-5
"""Dead band [m] of the branches: 0.05 mm, below the repeatability of the tables."""
LOWEST, HIGHEST = -0.01, 0.02
"""Range of contractions [m] of the look-up tables; beyond it the end values apply."""
SPACING = 2e-6
"""Spacing [m] of the look-up tables; linear interpolation between is exact to 0.02 Pa."""


class Branch(NamedTuple):
    """Direction, and extremum [m] of the reference since the last change, shapes (n_env,)."""

    inflating: Rows
    extremum: Array


def first_branch(reference: Array, contraction: Array) -> Branch:
    """Return the branch at an episode's start: from the contraction towards the reference [m]."""
    return Branch(reference >= contraction, reference)


def next_branch(branch: Branch, reference: Array) -> Branch:
    """Return the branch for the next reference [m]; the argument is unchanged."""
    back = np.where(branch.inflating, branch.extremum - reference, reference - branch.extremum)
    turned = back > DEAD_BAND
    extremum = np.where(turned | (back < 0.0), reference, branch.extremum)
    return Branch(branch.inflating ^ turned, extremum)


@dataclass(frozen=True)
class TwoBranch(RowController):
    """Curve of the present branch at the present reference, tabulated for each load.

    The signals read are contraction, at the start only, load and reference.
    """

    curves: BranchCurves
    reader: Reader
    action_signal: Signal

    def initial_state(self, observation: ArrayLike) -> Branch:
        """Return the first branch."""
        contraction, _, reference = self.reader.rows(observation)
        return first_branch(reference, contraction)

    def respond(self, observation: ArrayLike, state: Branch) -> Prediction:
        """Return the action and the next branch."""
        _, load, reference = self.reader.rows(observation)
        branch = next_branch(state, reference)

        def interpolated(key: float, target: Array, inflating: Rows) -> Array:
            grid, up, down = self._tabulated(key)
            return np.where(inflating, np.interp(target, grid, up), np.interp(target, grid, down))

        pressure = by_load(load, interpolated, reference, branch.inflating)
        return encode_action(self.action_signal, pressure, observation), branch

    @cached_property
    def _tabulated(self) -> Callable[[float], tuple[Array, Array, Array]]:
        """Return contractions [m] and pressures [Pa] of inflation and deflation for a load."""

        @cache
        def tabulated(load: float) -> tuple[Array, Array, Array]:
            grid = np.arange(LOWEST, HIGHEST + 0.5 * SPACING, SPACING)
            return grid, self.curves(grid, True, load), self.curves(grid, False, load)

        return tabulated


@dataclass(frozen=True)
class Line(RowController):
    """``set_point = slope * reference``, with the slope [Pa/m] of the nearest of ``LOADS``."""

    reader: Reader
    action_signal: Signal
    slopes: tuple[float, ...]

    def respond(self, observation: ArrayLike, state: Any) -> Prediction:
        """Return the action and no state."""
        load, reference = self.reader.rows(observation)
        nearest = np.abs(load[:, None] - np.array(LOADS)).argmin(axis=1)
        value = np.array(self.slopes)[nearest] * reference
        return encode_action(self.action_signal, value, observation), None


def make_table_inverse(
    spec: Spec[Any], curves: Callable[[], BranchCurves] = pchip_inverse
) -> TwoBranch:
    """Return the controller for inverse curves; the default interpolates the readings."""
    signals = reader(spec.signals, ["contraction", "load", "reference"])
    return TwoBranch(curves(), signals, spec.actions["pressure_set_point"])


def make_linear(spec: Spec[Any]) -> Line:
    """Return the straight line from (0, 0) to the mean contraction at the highest pressure."""
    table = load_contraction_table()
    ends = [(p[-1], x[-1].mean()) for p, x in (table.branch(load, True) for load in LOADS)]
    signals = reader(spec.signals, ["load", "reference"])
    slopes = tuple(float(p / x) for p, x in ends)
    return Line(signals, spec.actions["pressure_set_point"], slopes)


TABLES = partial(Entry, knowledge="tables", citation="positioning2021")
ENTRIES = {
    "linear": Entry(
        "straight line through the end points of the table at the nearest load",
        "tables",
        make_linear,
    ),
    "one_cubic": TABLES(
        "one cubic a load for both branches: hysteresis ignored",
        make=partial(make_table_inverse, curves=one_cubic_inverse),
    ),
    "plc_as_printed": TABLES(
        "the paper's Equations 7-12 exactly as printed, misprints included",
        make=partial(make_table_inverse, curves=published_inverse),
    ),
    "plc_refitted": TABLES(
        "the paper's cubics refitted to its Table 6 at full precision",
        make=partial(make_table_inverse, curves=table_6_inverse),
    ),
    "table": TABLES(
        "monotone interpolation of the tables' means, a curve for each load and branch",
        make=make_table_inverse,
    ),
}
