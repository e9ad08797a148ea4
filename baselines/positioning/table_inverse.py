"""Open-loop positioning from measured tables: one pressure curve for each load and branch.

The method of positioning2021: curves p(contraction), one for inflation and one for deflation at
each load; the set-point is the curve of the present branch (:mod:`baselines.positioning.branch`) at
the present reference. Nothing is measured after the start. The curves are

- monotone piecewise cubics through the mean readings, without fitting error ("table");
- the six published cubics (Eqs. 7 to 12) exactly as printed ("plc_as_printed"): some coefficients
  were truncated in print (0.00399 became 0.003 in Eq. 11), so that at 4.55 kg the pressure is up to
  2.6 bar wrong;
- the same cubics refitted to Table 6 in full precision, with its one wrong entry (4.55 kg,
  inflation, 2 mm) replaced by the value of Table 5 ("plc_refitted");
- one cubic a load for both branches ("one_cubic"), and a straight line a load ("linear"): without
  hysteresis.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import (
    Array,
    Prediction,
    Reader,
    RowController,
    encode_action,
    group_by_load,
    reader,
)
from baselines.core.entry import Entry
from baselines.positioning.branch import DEAD_BAND, Branch, first_branch, next_branch
from baselines.positioning.contraction_tables import (
    LOADS,
    ContractionInverse,
    one_cubic_inverse,
    pchip_inverse,
    published_inverse,
    table_6_inverse,
)
from pam_envs.data.tables import load_contraction_table
from pam_envs.parameters import Signal, Signals

LOWEST, HIGHEST = -0.01, 0.02
"""Range of contractions [m] of the look-up tables; the end values hold beyond."""
SPACING = 2e-6
"""Spacing [m] of the look-up tables; linear interpolation between is exact to 0.02 Pa."""


@dataclass(frozen=True)
class TwoBranch(RowController):
    """Curve of the present branch at the present reference.

    The two curves of a load are tabulated when that load first occurs.

    Attributes
    ----------
    curves : ContractionInverse
        Pressure for a contraction, a branch and a load.
    reader : Reader
        Of contraction, load and reference; the contraction is read at the start only.
    action_signal : Signal
    dead_band : float
        Of the branch logic [m].
    """

    curves: ContractionInverse
    reader: Reader
    action_signal: Signal
    dead_band: float = DEAD_BAND

    def initial_state(self, observation: ArrayLike) -> Branch:
        """See :class:`~baselines.core.controller.RowController`."""
        contraction, _, reference = self.reader.rows(observation)
        return first_branch(reference, contraction)

    def respond(self, observation: ArrayLike, state: Branch) -> Prediction:
        """See :class:`~baselines.core.controller.RowController`."""
        _, load, reference = self.reader.rows(observation)
        branch = next_branch(state, reference, self.dead_band)
        pressure = np.empty(len(load))
        for key, rows in group_by_load(load):
            grid, inflation, deflation = self._tabulated(key)
            up = np.interp(reference[rows], grid, inflation)
            down = np.interp(reference[rows], grid, deflation)
            pressure[rows] = np.where(branch.inflating[rows], up, down)
        return encode_action(self.action_signal, pressure, observation), branch

    @cached_property
    def _tables(self) -> dict[float, tuple[Array, Array, Array]]:
        return {}

    def _tabulated(self, load: float) -> tuple[Array, Array, Array]:
        """Return contractions [m] and the pressures [Pa] of inflation and deflation at a load."""
        if load not in self._tables:
            grid = np.arange(LOWEST, HIGHEST + 0.5 * SPACING, SPACING)
            up, down = (self.curves.pressure(grid, inflating, load) for inflating in (True, False))
            self._tables[load] = grid, up, down
        return self._tables[load]


@dataclass(frozen=True)
class Line(RowController):
    """``set_point = slope * reference``: straight line through the end points of a table.

    Attributes
    ----------
    reader : Reader
        Of load and reference.
    action_signal : Signal
    loads : tuple of float
        Loads [kg] of the tables.
    slopes : tuple of float
        Pressure over contraction [Pa/m] at each; that of the nearest load applies.
    """

    reader: Reader
    action_signal: Signal
    loads: tuple[float, ...]
    slopes: tuple[float, ...]

    def initial_state(self, observation: ArrayLike) -> None:
        """Return no state."""

    def respond(self, observation: ArrayLike, state: Any) -> Prediction:
        """See :class:`~baselines.core.controller.RowController`."""
        load, reference = self.reader.rows(observation)
        nearest = np.abs(load[:, None] - np.array(self.loads)).argmin(axis=1)
        value = np.array(self.slopes)[nearest] * reference
        return encode_action(self.action_signal, value, observation), None


def make_table_inverse(
    _plant: Any,
    signals: Signals,
    action_signals: Signals,
    curves: Callable[[], ContractionInverse] = pchip_inverse,
) -> TwoBranch:
    """Return the controller for inverse curves; the default interpolates the readings."""
    names = ["contraction", "load", "reference"]
    return TwoBranch(curves(), reader(signals, names), action_signals["pressure_set_point"])


def make_linear(_plant: Any, signals: Signals, action_signals: Signals) -> Line:
    """Return the straight line from (0, 0) to the mean contraction at the highest pressure."""
    table = load_contraction_table()
    ends = [(p[-1], x[-1].mean()) for p, x in (table.branch(load, True) for load in LOADS)]
    return Line(
        reader(signals, ["load", "reference"]),
        action_signals["pressure_set_point"],
        LOADS,
        tuple(float(p / x) for p, x in ends),
    )


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
