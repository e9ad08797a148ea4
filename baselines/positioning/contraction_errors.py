"""Positioning errors of the inverses of the contraction tables, by cross-validation over repeats.

An inverse is fitted to four of the five repeats, and gives the pressure for every target from 2 to
14 mm; the contraction at this pressure is read from the fifth repeat, linearly between its
readings. Each repeat is left out in turn, at every load, on both branches. Pressures are clipped to
the regulator's 0 to 6 bar. The published equations and those refitted to Table 6 used all five
repeats.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from baselines.core.controller import Array
from baselines.positioning import contraction_tables as tables
from baselines.positioning.contraction_tables import BRANCHES, TOP, BranchCurves
from pam_envs.data.tables import BAR, MM, ContractionTable, load_contraction_table

TARGETS = MM * np.arange(2.0, 14.01, 0.25)
"""Target contractions [m], shape (49,)."""

INVERSES: dict[str, Callable[[ContractionTable], BranchCurves]] = {
    "published": lambda _: tables.published_inverse(),
    "table 6 refit": lambda _: tables.table_6_inverse(corrected=False),
    "table 6 refit, corrected": lambda _: tables.table_6_inverse(),
    "cubic": tables.polynomial_inverse,
    "inverse of forward cubic": tables.forward_cubic_inverse,
    "quintic": partial(tables.polynomial_inverse, degree=5),
    "pchip": tables.pchip_inverse,
    "one cubic for both branches": tables.one_cubic_inverse,
}
"""Inverses of the error table, by name: from the repeats of the training set.

``"table 6 refit"`` keeps the paper's erroneous 1.43 bar.
"""


@dataclass(frozen=True)
class PositioningError:
    """Error [m] of one inverse over all targets, loads, branches and left-out repeats.

    ``per_equation`` is the RMS of each load and branch, in the order of Equations 7 to 12.
    """

    rms: float
    largest: float
    per_equation: tuple[float, ...]


def positioning_error_table(
    table: ContractionTable | None = None,
) -> dict[str, PositioningError]:
    """Return the positioning error of every inverse of :data:`INVERSES`, by its name."""
    readings = table or load_contraction_table()
    return {name: _positioning_error(make, readings) for name, make in INVERSES.items()}


def _positioning_error(
    make: Callable[[ContractionTable], BranchCurves], table: ContractionTable
) -> PositioningError:
    repeats = table.repeats(table.loads[0])
    errors = np.array([_errors(make(table.without_repeat(k)), table, k) for k in repeats])
    per_equation = np.sqrt(np.mean(errors**2, axis=(0, 2)))
    return PositioningError(
        float(np.sqrt(np.mean(errors**2))),
        float(np.abs(errors).max()),
        tuple(per_equation.tolist()),
    )


def _errors(inverse: BranchCurves, table: ContractionTable, repeat: int) -> Array:
    """Return reached less target contraction [m] on one repeat, shape (6, 49)."""
    rows = []
    for load in table.loads:
        for inflating in BRANCHES:
            command = np.clip(inverse(TARGETS, inflating, load), 0.0, TOP * BAR)
            pressure, contraction = table.branch(load, inflating)
            order = np.argsort(pressure)
            column = contraction[order, table.repeats(load).index(repeat)]
            rows.append(np.interp(command, pressure[order], column) - TARGETS)
    return np.array(rows)
