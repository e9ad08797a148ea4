"""Positioning errors of the inverses of the contraction tables, by cross-validation over repeats.

Of five repeats an inverse is made from four, and gives the pressure for every target from 2 to 14
mm; the contraction at this pressure is read from the fifth repeat, linearly between its readings.
Each repeat is left out in turn, at every load, on both branches. Pressures are clipped to the
regulator's 0 to 6 bar. The published equations and those refitted to Table 6 used all five repeats.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from baselines.positioning.contraction_tables import (
    BRANCHES,
    TABLE_6_CONTRACTION,
    TOP,
    Array,
    ContractionInverse,
    ForwardPolynomials,
    PolynomialInverse,
    fitted_forward,
    forward_cubic_inverse,
    one_cubic_inverse,
    pchip_inverse,
    polynomial_inverse,
    published_forward,
    published_inverse,
    quintic_inverse,
    table_6_inverse,
    table_6_pressures,
)
from pam_envs.data.tables import BAR, MM, ContractionTable, load_contraction_table

TARGETS = MM * np.arange(2.0, 14.01, 0.25)
"""Target contractions [m], shape (49,)."""

INVERSES: dict[str, Callable[[ContractionTable], ContractionInverse]] = {
    "published": lambda _: published_inverse(),
    "table 6 refit": lambda _: table_6_inverse(corrected=False),
    "table 6 refit, corrected": lambda _: table_6_inverse(),
    "cubic": polynomial_inverse,
    "inverse of forward cubic": forward_cubic_inverse,
    "quintic": quintic_inverse,
    "pchip": pchip_inverse,
    "one cubic for both branches": one_cubic_inverse,
}
"""Inverses of the error table, by name: from the repeats of the training set."""


@dataclasses.dataclass(frozen=True)
class PositioningError:
    """Error of one inverse over all targets, loads, branches and left-out repeats.

    Attributes
    ----------
    rms, largest : float
        Root mean square and largest magnitude [m].
    per_equation : tuple of float
        Root mean square [m] of each load and branch, in the order of Equations 7 to 12.
    """

    rms: float
    largest: float
    per_equation: tuple[float, ...]


@dataclasses.dataclass(frozen=True)
class FitError:
    """Residual of a polynomial fit.

    Attributes
    ----------
    equation : int
        The paper's number: 1 to 6 (contraction, in m) or 7 to 12 (pressure, in Pa).
    rms, largest : float
        Root mean square and largest magnitude, in m or Pa.
    determination : float
        Coefficient of determination, 1 less residual over total sum of squares.
    """

    equation: int
    rms: float
    largest: float
    determination: float


def positioning_error_table(
    table: ContractionTable | None = None,
) -> dict[str, PositioningError]:
    """Return the positioning error of every inverse of :data:`INVERSES`, by its name.

    ``"table 6 refit"`` keeps the paper's erroneous 1.43 bar; the corrected one is listed beside it.
    """
    readings = load_contraction_table() if table is None else table
    return {name: positioning_error(make, readings) for name, make in INVERSES.items()}


def positioning_error(
    make: Callable[[ContractionTable], ContractionInverse], table: ContractionTable
) -> PositioningError:
    """Return the positioning error of one kind of inverse, one repeat left out at a time.

    Parameters
    ----------
    make : callable
        Makes the inverse from a table without the validation repeat.
    table : ContractionTable
        The readings; every load needs the same repeats.
    """
    errors = np.array(
        [
            _errors(make(table.without_repeat(repeat)), table, repeat)
            for repeat in table.repeats(table.loads[0])
        ]
    )
    per_equation = np.sqrt(np.mean(errors**2, axis=(0, 2)))
    rms = np.sqrt(np.mean(errors**2))
    return PositioningError(
        float(rms), float(np.abs(errors).max()), tuple(float(one) for one in per_equation)
    )


def repeatability_floor(table: ContractionTable | None = None) -> float:
    """Return the RMS distance [m] of a reading from the mean of the other repeats, all readings.

    Lower bound of the error of a controller that knows the other repeats. The readings before a
    cycle, zero by definition, are included.
    """
    readings = load_contraction_table() if table is None else table
    cycles = [readings.cycles(load)[1] for load in readings.loads]
    away = [(x - x.mean(axis=1, keepdims=True)) * x.shape[1] / (x.shape[1] - 1) for x in cycles]
    return float(np.sqrt(np.mean(np.concatenate(away) ** 2)))


def forward_error_table(
    table: ContractionTable | None = None,
) -> dict[str, tuple[FitError, ...]]:
    """Return the residuals of Equations 1 to 6 on the mean readings [m], printed and refitted.

    Returns
    -------
    dict
        ``"published"`` and ``"refit"``, each six errors in the order of the equations.
    """
    readings = load_contraction_table() if table is None else table
    forwards = {"published": published_forward(), "refit": fitted_forward(readings)}
    return {name: _forward_errors(forward, readings) for name, forward in forwards.items()}


def table_6_error_table() -> dict[str, tuple[FitError, ...]]:
    """Return the residuals of Equations 7 to 12 on Table 6 [Pa].

    Returns
    -------
    dict
        ``"published"`` (as printed, against Table 6 as printed), ``"refit"`` (full precision, same
        table) and ``"refit, corrected"`` (both with 2.05 bar for 1.43), six errors each.
    """
    return {
        "published": _table_6_errors(published_inverse(), table_6_pressures(corrected=False)),
        "refit": _table_6_errors(
            table_6_inverse(corrected=False), table_6_pressures(corrected=False)
        ),
        "refit, corrected": _table_6_errors(table_6_inverse(), table_6_pressures()),
    }


def _errors(inverse: ContractionInverse, table: ContractionTable, repeat: int) -> Array:
    """Return reached less target contraction [m] on one repeat, shape (6, 49)."""
    rows = []
    for load in table.loads:
        for inflating in BRANCHES:
            command = np.clip(inverse.pressure(TARGETS, inflating, load), 0.0, TOP * BAR)
            rows.append(_reached(table, load, inflating, repeat, command) - TARGETS)
    return np.array(rows)


def _reached(
    table: ContractionTable, load: float, inflating: bool, repeat: int, command: Array
) -> Array:
    """Return the contraction [m] at commanded pressures [Pa] on a branch of one repeat."""
    pressure, contraction = table.branch(load, inflating)
    order = np.argsort(pressure)
    column = table.repeats(load).index(repeat)
    return np.interp(command, pressure[order], contraction[order, column])


def _forward_errors(forward: ForwardPolynomials, table: ContractionTable) -> tuple[FitError, ...]:
    errors: list[FitError] = []
    for load in table.loads:
        for inflating in BRANCHES:
            pressure, contraction = table.branch(load, inflating)
            fitted = forward.contraction(pressure, inflating, load)
            errors.append(_fit_error(len(errors) + 1, fitted, contraction.mean(axis=1)))
    return tuple(errors)


def _table_6_errors(inverse: PolynomialInverse, bars: Array) -> tuple[FitError, ...]:
    errors: list[FitError] = []
    for row, load in enumerate(inverse.loads):
        for branch, inflating in enumerate(BRANCHES):
            fitted = inverse.pressure(MM * TABLE_6_CONTRACTION, inflating, load)
            errors.append(_fit_error(len(errors) + 7, fitted, BAR * bars[row, branch]))
    return tuple(errors)


def _fit_error(equation: int, fitted: Array, measured: Array) -> FitError:
    """Return the statistics of ``fitted - measured``."""
    error = fitted - measured
    total = np.sum((measured - measured.mean()) ** 2)
    return FitError(
        equation,
        rms=float(np.sqrt(np.mean(error**2))),
        largest=float(np.abs(error).max()),
        determination=float(1.0 - np.sum(error**2) / total),
    )
