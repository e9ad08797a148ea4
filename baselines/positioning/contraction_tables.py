"""Inverses of measured contraction tables: the pressure for a contraction.

positioning2021 programs a proportional regulator with six cubics p(x), one for each load and
direction (Eqs. 7 to 12): here exactly as printed, refitted with care, and compared with other
curves through the same readings. Each inverse has ``pressure(contraction, inflating, load)`` in SI,
element by element over arrays.

Between the measured loads the pressure is interpolated linearly; loads outside their range count as
the nearest one. Both are assumed: the paper measured three loads only. Pressures may exceed the
regulator's 0 to 6 bar; the caller clips them.

Curves are in the paper's units, mm and bar, in the order ``curves[load][branch]``, branch 0 being
inflation: the order of Equations 1 to 6 and 7 to 12. Positioning errors:
:mod:`baselines.positioning.contraction_errors`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import cache, partial
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator

from pam_envs.data.tables import BAR, MM, ContractionTable, load_contraction_table

Array = NDArray[np.float64]
Curve = Callable[[Array], Array]

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


class ContractionInverse(Protocol):
    """Pressure as a function of contraction, branch and load."""

    def pressure(self, contraction: ArrayLike, inflating: ArrayLike, load: ArrayLike) -> Array:
        """Return the pressure to command.

        Parameters
        ----------
        contraction : array_like of float
            Desired contraction [m].
        inflating : array_like of bool
            Whether the muscle comes from less contraction.
        load : array_like of float
            Hanging mass [kg].

        Returns
        -------
        ndarray
            Pressure [Pa], of the shape to which the arguments broadcast, not clipped.
        """
        ...


@dataclasses.dataclass(frozen=True, eq=False)
class PolynomialInverse:
    """Polynomials p(x), one for each load and branch.

    Attributes
    ----------
    loads : tuple of float
        Ascending [kg].
    coefficients : ndarray, shape (n_loads, 2, degree + 1)
        [bar] of [mm], highest power first.
    span : ndarray, shape (n_loads, 2, 2), optional
        Lowest and highest contraction [mm] of the readings behind each polynomial. Contractions
        outside are clipped, since high powers extrapolate badly. Default: no limits.
    """

    loads: tuple[float, ...]
    coefficients: Array
    span: Array | None = None

    def pressure(self, contraction: ArrayLike, inflating: ArrayLike, load: ArrayLike) -> Array:
        """See :meth:`ContractionInverse.pressure`."""
        return BAR * _between_loads(self.loads, self._curve, _in_mm(contraction), inflating, load)

    def _curve(self, load: int, branch: int, contraction: Array) -> Array:
        if self.span is not None:
            contraction = np.clip(contraction, *self.span[load, branch])
        return np.asarray(np.polyval(self.coefficients[load, branch], contraction))


@dataclasses.dataclass(frozen=True, eq=False)
class CurveInverse:
    """Monotone curves p(x), one for each load and branch, held at their ends.

    Attributes
    ----------
    loads : tuple of float
        Ascending [kg].
    curves : tuple of tuple of callable
        ``curves[load][branch]`` gives [bar] of [mm], element by element.
    """

    loads: tuple[float, ...]
    curves: tuple[tuple[Curve, ...], ...]

    def pressure(self, contraction: ArrayLike, inflating: ArrayLike, load: ArrayLike) -> Array:
        """See :meth:`ContractionInverse.pressure`."""
        return BAR * _between_loads(self.loads, self._curve, _in_mm(contraction), inflating, load)

    def _curve(self, load: int, branch: int, contraction: Array) -> Array:
        return self.curves[load][branch](contraction)


@dataclasses.dataclass(frozen=True, eq=False)
class ForwardPolynomials:
    """Polynomials x(p), one for each load and branch.

    Attributes
    ----------
    loads : tuple of float
        Ascending [kg].
    coefficients : ndarray, shape (n_loads, 2, degree + 1)
        [mm] of [bar], highest power first.
    """

    loads: tuple[float, ...]
    coefficients: Array

    def contraction(self, pressure: ArrayLike, inflating: ArrayLike, load: ArrayLike) -> Array:
        """Return the contraction [m] at a pressure [Pa], of the shape the arguments broadcast to.

        Parameters
        ----------
        pressure : array_like of float
            [Pa].
        inflating : array_like of bool
            Whether the pressure is being raised.
        load : array_like of float
            Hanging mass [kg]; between loads as for the inverses.
        """
        bars = np.asarray(pressure, float) / BAR
        return MM * _between_loads(self.loads, self._curve, bars, inflating, load)

    def _curve(self, load: int, branch: int, pressure: Array) -> Array:
        return np.asarray(np.polyval(self.coefficients[load, branch], pressure))


def published_inverse() -> PolynomialInverse:
    """Return Equations 7 to 12 exactly as printed, misprints included."""
    return PolynomialInverse(LOADS, PUBLISHED_INVERSE)


def table_6_pressures(*, corrected: bool = True) -> Array:
    """Return the pressures [bar] of Table 6, shape (3, 2, 7), with or without its one error."""
    pressures = TABLE_6_PRESSURE.copy()
    if corrected:
        pressures[TABLE_6_ERROR] = TABLE_6_CORRECTION
    return pressures


def table_6_inverse(*, corrected: bool = True) -> PolynomialInverse:
    """Return Equations 7 to 12 refitted: cubics through Table 6 in full precision.

    Parameters
    ----------
    corrected : bool
        True replaces the 1.43 bar of 4.55 kg, inflation, 2 mm by 2.05 bar; False keeps it, which
        reproduces the paper's coefficients and coefficient of determination.
    """
    pressures = table_6_pressures(corrected=corrected)
    fits = [[np.polyfit(TABLE_6_CONTRACTION, p, 3) for p in load] for load in pressures]
    return PolynomialInverse(LOADS, np.array(fits))


def polynomial_inverse(table: ContractionTable | None = None, degree: int = 3) -> PolynomialInverse:
    """Return least-squares polynomials p(x) through the single readings of each load and branch.

    Parameters
    ----------
    table : ContractionTable, optional
        Default: the published readings.
    degree : int
        3 for the paper's kind of curve.
    """
    table = _default(table)
    clouds = [[_cloud(table, load, branch) for branch in BRANCHES] for load in table.loads]
    fits = [[np.polyfit(x, p, degree) for x, p in load] for load in clouds]
    span = [[(x.min(), x.max()) for x, _ in load] for load in clouds]
    return PolynomialInverse(table.loads, np.array(fits), np.array(span))


def quintic_inverse(table: ContractionTable | None = None) -> PolynomialInverse:
    """Return :func:`polynomial_inverse` of degree 5."""
    return polynomial_inverse(table, 5)


def one_cubic_inverse(table: ContractionTable | None = None) -> PolynomialInverse:
    """Return one cubic p(x) a load for both branches, without hysteresis.

    Parameters
    ----------
    table : ContractionTable, optional
        Default: the published readings. The common turning point counts in both branches.
    """
    table = _default(table)
    fits, spans = [], []
    for load in table.loads:
        x, p = np.hstack([_cloud(table, load, branch) for branch in BRANCHES])
        fits.append([np.polyfit(x, p, 3)] * 2)
        spans.append([(x.min(), x.max())] * 2)
    return PolynomialInverse(table.loads, np.array(fits), np.array(spans))


def published_forward() -> ForwardPolynomials:
    """Return Equations 1 to 6 exactly as printed, misprints included."""
    return ForwardPolynomials(LOADS, PUBLISHED_FORWARD)


def fitted_forward(table: ContractionTable | None = None) -> ForwardPolynomials:
    """Return least-squares cubics x(p) through the mean readings: Equations 1 to 6 refitted."""
    table = _default(table)
    fits = [[np.polyfit(*_mean_curve(table, load, b), 3) for b in BRANCHES] for load in table.loads]
    return ForwardPolynomials(table.loads, np.array(fits))


def forward_cubic_inverse(table: ContractionTable | None = None) -> CurveInverse:
    """Return the inverse of :func:`fitted_forward` over 0 to 6 bar.

    Where a cubic decreases (4.55 kg inflating below 0.4 bar, 0 kg deflating at the top), its
    running maximum is used.
    """
    forward = fitted_forward(table)
    curves = [[_inverted(fit) for fit in load] for load in forward.coefficients]
    return CurveInverse(forward.loads, tuple(tuple(load) for load in curves))


def pchip_inverse(table: ContractionTable | None = None) -> CurveInverse:
    """Return monotone piecewise cubics p(x) through the mean readings of each load and branch."""
    table = _default(table)
    curves = [[_pchip(*_mean_curve(table, load, b)) for b in BRANCHES] for load in table.loads]
    return CurveInverse(table.loads, tuple(tuple(load) for load in curves))


@cache
def _published_table() -> ContractionTable:
    return load_contraction_table()


def _default(table: ContractionTable | None) -> ContractionTable:
    return _published_table() if table is None else table


def _in_mm(contraction: ArrayLike) -> Array:
    return np.asarray(contraction, float) / MM


def _cloud(table: ContractionTable, load: float, inflating: bool) -> tuple[Array, Array]:
    """Return contraction [mm] and pressure [bar] of every reading of a branch."""
    pressure, contraction = table.branch(load, inflating)
    return contraction.ravel() / MM, np.repeat(pressure / BAR, contraction.shape[1])


def _mean_curve(table: ContractionTable, load: float, inflating: bool) -> tuple[Array, Array]:
    """Return pressure [bar], rising, and mean contraction [mm] of a branch."""
    pressure, contraction = table.branch(load, inflating)
    order = np.argsort(pressure)
    return pressure[order] / BAR, contraction.mean(axis=1)[order] / MM


def _inverted(coefficients: Array) -> Curve:
    """Return p(x) of the running maximum of a polynomial x(p), linear between 0.001 bar steps."""
    pressure = np.linspace(0.0, TOP, 6001)
    contraction = np.maximum.accumulate(np.polyval(coefficients, pressure))
    return partial(_between_points, contraction, pressure)


def _between_points(contraction: Array, pressure: Array, target: Array) -> Array:
    return np.interp(target, contraction, pressure)


def _pchip(pressure: Array, contraction: Array) -> Curve:
    """Return the monotone interpolant p(x); means that do not increase are left out."""
    rising = np.r_[True, contraction[1:] > np.maximum.accumulate(contraction)[:-1]]
    return partial(_held, PchipInterpolator(contraction[rising], pressure[rising]))


def _held(curve: PchipInterpolator, target: Array) -> Array:
    """Return the interpolant within its readings and its end values beyond."""
    return np.asarray(curve(np.clip(target, curve.x[0], curve.x[-1])))


def _between_loads(
    loads: tuple[float, ...],
    curve: Callable[[int, int, Array], Array],
    argument: Array,
    inflating: ArrayLike,
    load: ArrayLike,
) -> Array:
    """Return the curves' values, interpolated between neighbouring loads, element by element."""
    inflates = np.asarray(inflating, bool)
    values = [
        np.where(inflates, curve(row, 0, argument), curve(row, 1, argument))
        for row in range(len(loads))
    ]
    # Hat functions: 1 at their own load, 0 at the others, the nearest load beyond the ends.
    at = np.asarray(load, float)
    hats = (np.interp(at, loads, unit) for unit in np.eye(len(loads)))
    return np.asarray(sum(hat * value for hat, value in zip(hats, values, strict=True)))
