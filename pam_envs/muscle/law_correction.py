"""Correction of a static force law: a smooth map of force over pressure and contraction.

    F(p, e) = law(p, e) + sum of map_ij T_i(2 p / map_pressure - 1) T_j(s)
    s = 2 (e - map_least) / map_strain - 1

For muscles of a pair, a bundle or a brace, whose laws have fewer terms than that of the single
muscle: beside the terms of its finer map (:mod:`pam_envs.muscle.effects`) there are those of lower
order. Inverses of a law, as of a feedforward, do not use it.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebval2d
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.kernels.arithmetic import count_on
from pam_envs.kernels.build import kernel
from pam_envs.muscle.effects import (
    MAP_TERMS,
    StaticMapEffects,
    map_coordinate,
    map_force,
    map_on,
    map_slopes,
)
from pam_envs.parameters import assumed, declarations, effect, named_rows

LOWER_TERMS = ((0, 0), (0, 1), (0, 2), (0, 3), (0, 4), (1, 0), (1, 1), (1, 2))
"""Orders in pressure and in strain of the terms that only this correction has."""
TERMS = (*MAP_TERMS, *LOWER_TERMS)
NAMES = tuple(f"map_{p}{e}" for p, e in TERMS)
"""Names of all terms, in the order of :data:`TERMS`."""
_TERM = "N", -5e4, 5e4


@dataclass(frozen=True, kw_only=True)
class LawCorrection(StaticMapEffects):
    """Correction of a static law; outside the range of the map it stays constant.

    ``map_strain`` is the extent of the strains from ``map_least``.
    """

    map_00: float = effect(*_TERM, "T_0(pressure) T_0(strain)")
    map_01: float = effect(*_TERM, "T_0(pressure) T_1(strain)")
    map_02: float = effect(*_TERM, "T_0(pressure) T_2(strain)")
    map_03: float = effect(*_TERM, "T_0(pressure) T_3(strain)")
    map_04: float = effect(*_TERM, "T_0(pressure) T_4(strain)")
    map_10: float = effect(*_TERM, "T_1(pressure) T_0(strain)")
    map_11: float = effect(*_TERM, "T_1(pressure) T_1(strain)")
    map_12: float = effect(*_TERM, "T_1(pressure) T_2(strain)")
    map_least: float = assumed(0.0, "1", -0.5, 0.5, "lower end of the map's strains")

    @property
    def corrects(self) -> bool:
        """Whether the law has a correction."""
        return any(getattr(self, name) != 0.0 for name in NAMES)

    def correction(self, pressure: ArrayLike, strain: ArrayLike) -> Array:
        """Return the force [N] of the correction at a pressure [Pa] and a strain [1]."""
        u, s = self._coordinates(pressure, strain)
        return np.asarray(chebval2d(u, s, self._sizes()))

    def correction_growth(self, pressure: ArrayLike, strain: ArrayLike) -> Array:
        """Return the derivative of :meth:`correction` by strain [N]."""
        u, s = self._coordinates(pressure, strain)
        inside = 2.0 / self.map_strain * (np.abs(s) < 1.0)
        return np.asarray(chebval2d(u, s, chebder(self._sizes(), axis=1)) * inside)

    def _sizes(self) -> Array:
        """Return the sizes [N] by order in pressure and strain, (6, 6)."""
        sizes = np.zeros((6, 6))
        for (p, e), name in zip(TERMS, NAMES, strict=True):
            sizes[p, e] = getattr(self, name)
        return sizes

    def _coordinates(self, pressure: ArrayLike, strain: ArrayLike) -> tuple[Array, Array]:
        """Return the coordinates from -1 to 1 in the range of the map."""
        u = np.clip(2.0 * np.asarray(pressure, float) / self.map_pressure - 1.0, -1.0, 1.0)
        beyond = np.asarray(strain, float) - self.map_least
        s = np.clip(2.0 * beyond / self.map_strain - 1.0, -1.0, 1.0)
        u, s = np.broadcast_arrays(u, s)
        return u, s


FIELDS = tuple(declarations(LawCorrection))
"""Parameters in the order of their rows."""
ROWS = named_rows(*FIELDS)
"""Rows of the correction, from its first."""
LOWEST = ROWS.map_00
"""Row of the first of :data:`LOWER_TERMS`; the others follow."""


@kernel
def correction_on(sizes: Any, first: int) -> int:
    """Return the number of terms that are not 0 in all lanes of a tile, in rows from ``first``."""
    on = map_on(sizes, first)
    for k in range(len(LOWER_TERMS)):
        on = on + count_on(sizes[first + LOWEST + k], 0.0)
    return on


@kernel
def correction_force(sizes: Any, j: int, first: int, drive: float, strain: float) -> float:
    """Return the force [N] of a correction at an effective pressure [Pa] and a strain.

    ``sizes`` holds the parameters of :class:`LawCorrection` in rows from ``first``, one lane a
    column.
    """
    t, _ = map_coordinate(drive, sizes[first + ROWS.map_pressure][j])
    beyond = strain - sizes[first + ROWS.map_least][j]
    s, _ = map_coordinate(beyond, sizes[first + ROWS.map_strain][j])
    s2 = s * s
    c2, c3, c4 = 2.0 * s2 - 1.0, (4.0 * s2 - 3.0) * s, 8.0 * (s2 * s2 - s2) + 1.0
    still = sizes[first + ROWS.map_00][j] + sizes[first + ROWS.map_01][j] * s
    still = still + sizes[first + ROWS.map_02][j] * c2 + sizes[first + ROWS.map_03][j] * c3
    still = still + sizes[first + ROWS.map_04][j] * c4
    driven = sizes[first + ROWS.map_10][j] + sizes[first + ROWS.map_11][j] * s
    driven = driven + sizes[first + ROWS.map_12][j] * c2
    return map_force(sizes, j, first, drive, beyond) + still + driven * t  # type: ignore[no-any-return]


@kernel
def correction_slope(sizes: Any, j: int, first: int, drive: float, strain: float) -> float:
    """Return minus the derivative of :func:`correction_force` by strain [N]."""
    t, _ = map_coordinate(drive, sizes[first + ROWS.map_pressure][j])
    beyond = strain - sizes[first + ROWS.map_least][j]
    s, per_strain = map_coordinate(beyond, sizes[first + ROWS.map_strain][j])
    s2 = s * s
    d3, d4 = 12.0 * s2 - 3.0, (32.0 * s2 - 16.0) * s
    still = sizes[first + ROWS.map_01][j] + sizes[first + ROWS.map_02][j] * 4.0 * s
    still = still + sizes[first + ROWS.map_03][j] * d3 + sizes[first + ROWS.map_04][j] * d4
    driven = sizes[first + ROWS.map_11][j] + sizes[first + ROWS.map_12][j] * 4.0 * s
    steeper, _ = map_slopes(sizes, j, first, drive, beyond)
    return steeper - (still + driven * t) * per_strain  # type: ignore[no-any-return]
