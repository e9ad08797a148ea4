"""Inverses of measured contraction tables: pressure as a function of contraction.

positioning2021 programs a proportional regulator with six cubics p(x), one for each load and
direction (Eqs. 7 to 12). They are provided exactly as printed, refitted in full precision, and
beside other curves through the same readings.

Between the measured loads the pressure is interpolated linearly; loads outside their range are
replaced by the nearest one. Both are assumptions: the paper measured only three loads. Pressures
may exceed the regulator's 0 to 6 bar; the caller clips them.

Curves are in the paper's units, mm and bar, in the order ``curves[load][branch]``, branch 0 being
inflation: the order of Equations 1 to 6 and 7 to 12.

Positioning errors of the inverses, by cross-validation over the repeats: an inverse is fitted to
four of the five repeats, and gives the pressure for every target from 2 to 14 mm; the contraction
at this pressure is read from the fifth repeat, linearly between its readings. Each repeat is left
out in turn, at every load, on both branches. Pressures are clipped to the regulator's 0 to 6 bar.
The published equations and those refitted to Table 6 used all five repeats.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from pam_envs.arrays import Array
from pam_envs.constants import BAR, MM
from pam_envs.data.tables import ContractionTable, load_contraction_table

Curve = Callable[[Array], Any]

LOADS = (0.0, 2.55, 4.55)
"""The loads [kg] of the paper's equations."""
BRANCHES = (True, False)
"""Inflating, deflating: the order of the equations at a load."""
TOP = 6.0
"""The highest pressure [bar] of the readings and of the regulator."""

PUBLISHED_FORWARD = np.array(
    [
        [(-0.053, 0.718, 0.079, 0.096), (-0.118, 1.005, 0.684, 0.296)],
        [(-0.053, 0.718, 0.079, 0.096), (-0.120, 1.092, 0.180, 0.439)],
        [(-0.055, 0.786, -0.421, 0.071), (-0.106, 1.016, 0.005, 0.270)],
    ]
)
"""Equations 1 to 6 as printed: x [mm] of p [bar], highest power first, shape (3, 2, 4).

Equation 3 repeats Equation 1, a misprint; Equation 5 misses Table 5 by 0.6 mm above 4 bar.
"""

PUBLISHED_INVERSE = np.array(
    [
        [(0.001, -0.028, 0.565, 0.637), (0.001, -0.0172, 0.376, 0.537)],
        [(0.001, -0.016, 0.452, 1.060), (0.002, -0.0470, 0.649, 0.024)],
        [(0.003, -0.106, 1.168, -0.461), (0.002, -0.0503, 0.653, 0.244)],
    ]
)
"""Equations 7 to 12 as printed: p [bar] of x [mm], highest power first, shape (3, 2, 4).

Three decimals are too few for a cube, and some were cut off rather than rounded (0.00399 to 0.003
in Equation 11): at 14 mm the pressure is up to 2.6 bar wrong. Equation 11 was also fitted to a
wrong entry of Table 6.
"""

TABLE_6_CONTRACTION = np.array([2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0])
"""Contractions [mm] of Table 6."""
TABLE_6_PRESSURE = np.array(
    [
        [(1.66, 2.54, 3.16, 3.86, 4.53, 4.94, 5.71), (1.24, 1.78, 2.43, 2.96, 3.40, 4.28, 4.98)],
        [(1.88, 2.72, 3.25, 3.90, 4.62, 5.14, 5.85), (1.16, 1.95, 2.64, 3.19, 3.72, 4.33, 5.19)],
        [(1.43, 2.91, 3.49, 4.07, 4.59, 5.19, 5.96), (1.38, 2.18, 2.84, 3.47, 4.10, 4.80, 5.93)],
    ]
)
"""Pressures [bar] of Table 6 as printed, shape (3, 2, 7)."""
TABLE_6_ERROR = (2, 0, 0)
"""Index of the wrong entry of Table 6: 4.55 kg, inflation, 2 mm reads 1.43 bar."""
TABLE_6_CORRECTION = 2.05
"""Its value interpolated from the readings of Table 5 [bar]."""


@dataclass(frozen=True, eq=False)
class BranchCurves:
    """Pressure as a function of contraction, branch and load.

    ``curves[load][branch]`` gives [bar] of [mm], element by element; the loads [kg] ascend.
    """

    loads: tuple[float, ...]
    curves: Sequence[Sequence[Curve]]

    def __call__(self, contraction: ArrayLike, inflating: ArrayLike, load: ArrayLike) -> Array:
        """Return the pressure [Pa], not clipped, of the shape to which the arguments broadcast.

        The arguments are desired contraction [m], direction (true if inflating), and payload [kg].
        """
        inflates, at = np.asarray(inflating, bool), np.asarray(load, float)
        scaled = np.asarray(contraction, float) / MM
        total: Array = np.zeros(())
        for (up, down), unit in zip(self.curves, np.eye(len(self.loads)), strict=True):
            hat = np.interp(at, self.loads, unit)  # 1 at the curves' own load, 0 at the others
            total = total + hat * np.where(inflates, up(scaled), down(scaled))
        return BAR * total


def polynomials(loads: tuple[float, ...], coefficients: Array, spans: Array | None) -> BranchCurves:
    """Return polynomials, coefficients of shape (n_loads, 2, degree + 1).

    Contractions outside ``spans``, shape (n_loads, 2, 2) [mm], are clipped, since high powers
    extrapolate badly; None for no limits.
    """
    limits = np.full((*coefficients.shape[:2], 2), [-np.inf, np.inf]) if spans is None else spans
    return BranchCurves(
        loads,
        [
            [partial(polynomial, *branch) for branch in zip(*load, strict=True)]
            for load in zip(coefficients, limits, strict=True)
        ],
    )


def published_inverse() -> BranchCurves:
    """Return Equations 7 to 12 exactly as printed, misprints included."""
    return polynomials(LOADS, PUBLISHED_INVERSE, None)


def table_6_cubics(*, corrected: bool = True) -> Array:
    """Return the coefficients, (3, 2, 4), of cubics through Table 6 in full precision.

    ``corrected=False`` keeps the 1.43 bar of 4.55 kg, inflation, 2 mm in place of 2.05 bar, which
    reproduces the paper's coefficients and coefficient of determination.
    """
    pressures = TABLE_6_PRESSURE.copy()
    if corrected:
        pressures[TABLE_6_ERROR] = TABLE_6_CORRECTION
    return np.array([[np.polyfit(TABLE_6_CONTRACTION, p, 3) for p in load] for load in pressures])


def table_6_inverse(*, corrected: bool = True) -> BranchCurves:
    """Return Equations 7 to 12 refitted: see :func:`table_6_cubics`."""
    return polynomials(LOADS, table_6_cubics(corrected=corrected), None)


def polynomial_inverse(table: ContractionTable | None = None, degree: int = 3) -> BranchCurves:
    """Return least-squares polynomials p(x) through the single readings of each load and branch."""
    table = table or _published_table()
    clouds = [[_cloud(table, load, branch) for branch in BRANCHES] for load in table.loads]
    return _fitted(table, clouds, degree)


def one_cubic_inverse(table: ContractionTable | None = None) -> BranchCurves:
    """Return one cubic p(x) per load for both branches, without hysteresis.

    The common turning point counts in both branches.
    """
    table = table or _published_table()
    clouds = [np.hstack([_cloud(table, load, b) for b in BRANCHES]) for load in table.loads]
    return _fitted(table, [[cloud, cloud] for cloud in clouds], 3)


def fitted_forward(table: ContractionTable | None = None) -> Array:
    """Return the coefficients, (n_loads, 2, 4), of Equations 1 to 6 refitted to mean readings."""
    table = table or _published_table()
    means = [[_mean_curve(table, load, b) for b in BRANCHES] for load in table.loads]
    return np.array([[np.polyfit(*mean, 3) for mean in load] for load in means])


def forward_cubic_inverse(table: ContractionTable | None = None) -> BranchCurves:
    """Return the inverse of :func:`fitted_forward` over 0 to 6 bar.

    Where a cubic decreases (4.55 kg inflating below 0.4 bar, 0 kg deflating at the top), its
    running maximum is used, linear between steps of 0.001 bar.
    """
    table, pressure = table or _published_table(), np.linspace(0.0, TOP, 6001)
    rising = [
        [np.maximum.accumulate(np.polyval(cubic, pressure)) for cubic in load]
        for load in fitted_forward(table)
    ]
    curves = [[partial(np.interp, xp=x, fp=pressure) for x in load] for load in rising]
    return BranchCurves(table.loads, curves)


def pchip_inverse(table: ContractionTable | None = None) -> BranchCurves:
    """Return monotone piecewise cubics p(x) through the mean readings of each load and branch."""
    table = table or _published_table()
    curves = [[_pchip(*_mean_curve(table, load, b)) for b in BRANCHES] for load in table.loads]
    return BranchCurves(table.loads, curves)


@cache
def _published_table() -> ContractionTable:
    return load_contraction_table()


def _fitted(table: ContractionTable, clouds: Sequence[Sequence[Any]], degree: int) -> BranchCurves:
    """Return polynomials through clouds of (contraction, pressure), within their contractions."""
    fits = [[np.polyfit(x, p, degree) for x, p in load] for load in clouds]
    spans = [[(x.min(), x.max()) for x, _ in load] for load in clouds]
    return polynomials(table.loads, np.array(fits), np.array(spans))


def _cloud(table: ContractionTable, load: float, inflating: bool) -> tuple[Array, Array]:
    """Return contraction [mm] and pressure [bar] of every reading of a branch."""
    pressure, contraction = table.branch(load, inflating)
    return contraction.ravel() / MM, np.repeat(pressure / BAR, contraction.shape[1])


def _mean_curve(table: ContractionTable, load: float, inflating: bool) -> tuple[Array, Array]:
    """Return increasing pressure [bar] and mean contraction [mm] of a branch."""
    pressure, contraction = table.branch(load, inflating)
    order = np.argsort(pressure)
    return pressure[order] / BAR, contraction.mean(axis=1)[order] / MM


def polynomial(coefficients: Array, span: Array, contraction: Array) -> Array:
    """Return a polynomial of contractions [mm], highest power first, which are held in a span."""
    return np.asarray(np.polyval(coefficients, np.clip(contraction, *span)))


def _pchip(pressure: Array, contraction: Array) -> Curve:
    """Return the monotone interpolant p(x), held at its ends; decreasing means are omitted."""
    rising = np.r_[True, contraction[1:] > np.maximum.accumulate(contraction)[:-1]]
    curve = PchipInterpolator(contraction[rising], pressure[rising])
    return lambda target: np.asarray(curve(np.clip(target, curve.x[0], curve.x[-1])))


TARGETS = MM * np.arange(2.0, 14.01, 0.25)
"""Target contractions [m], shape (49,)."""

INVERSES: dict[str, Callable[[ContractionTable], BranchCurves]] = {
    "published": lambda _: published_inverse(),
    "table 6 refit": lambda _: table_6_inverse(corrected=False),
    "table 6 refit, corrected": lambda _: table_6_inverse(),
    "cubic": polynomial_inverse,
    "inverse of forward cubic": forward_cubic_inverse,
    "quintic": partial(polynomial_inverse, degree=5),
    "pchip": pchip_inverse,
    "one cubic for both branches": one_cubic_inverse,
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
