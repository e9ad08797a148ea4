"""Everett map: change of a Preisach operator's output between two inputs.

``E(alpha, beta)`` is the change of the output when the input rises from ``beta`` to ``alpha`` (and
has been below ``beta`` before): the weight of all relays that switch up at or below ``alpha`` and
down at or above ``beta``; a relay goes from 0 to its weight. ``E(beta, alpha) = -E(alpha, beta)``
for a falling input, so the table is antisymmetric. Bilinear interpolation on a uniform grid spreads
the relays of a cell evenly over the cell; relays of a cell on the diagonal are free of hysteresis
(their loops are narrower than the grid resolves).

References
----------
I. D. Mayergoyz, "Mathematical Models of Hysteresis", Springer 1991. D. H. Everett, "A general
approach to hysteresis, part 4", Trans. Faraday Society 51 (1955).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.kernels.build import kernel

if TYPE_CHECKING:
    from pam_envs.hysteresis.maxwell_slip import PlayOperator


@kernel
def everett(a: float, b: float, table: Any) -> float:
    """Return the map between two inputs in cells, ``0 <= a, b <= len(table) - 1``.

    Exactly 0 on the diagonal and antisymmetric to the last bit, if the table is.
    """
    last = len(table) - 2
    i, j = min(int(a), last), min(int(b), last)
    s, t = a - i, b - j
    e00, e01 = table[i][j], table[i][j + 1]
    e10, e11 = table[i + 1][j], table[i + 1][j + 1]
    along = s * (e10 - e00) + t * (e01 - e00)
    return e00 + along + s * t * ((e00 + e11) - (e10 + e01))


def table_from_weights(weights: ArrayLike) -> Array:
    """Return the table, shape (n, n), of relay weights per cell, shape (n - 1, n - 1).

    ``weights[k][l]``, ``l <= k``, belongs to the relays that switch up in cell ``k`` and down in
    cell ``l``; entries above the diagonal are ignored.
    """
    w = np.tril(np.asarray(weights, dtype=float))
    n = len(w) + 1
    rising = np.zeros((n, n))
    rising[1:, :-1] = np.cumsum(np.cumsum(w, axis=0)[:, ::-1], axis=1)[:, ::-1]
    rising = np.tril(rising, -1)
    return rising - rising.T


def weights_from_table(table: ArrayLike) -> Array:
    """Return the relay weights per cell, shape (n - 1, n - 1), of a table of shape (n, n)."""
    rising = np.tril(np.asarray(table, dtype=float), -1)
    return np.tril(rising[1:, :-1] - rising[:-1, :-1] - rising[1:, 1:] + rising[:-1, 1:])


def play_table(operator: PlayOperator, levels: Array) -> Array:
    """Return the table of a play operator, exact at the grid's inputs.

    A play of threshold ``r`` moves by ``max(0, alpha - beta - 2 r)``. Between the grid's inputs the
    error of each play is at most a quarter of its weight times the cell for every stored extremum.
    """
    gap = levels[:, None] - levels[None, :]
    table = operator.linear * gap
    for threshold, weight in zip(operator.thresholds, operator.weights, strict=True):
        table = table + weight * (np.maximum(gap - 2 * threshold, 0.0))
        table = table - weight * (np.maximum(-gap - 2 * threshold, 0.0))
    return table


def symmetry_error(table: ArrayLike) -> float:
    """Return the asymmetry of a map, shape (n, n), inputs counted from mid-range.

    The largest ``abs(E(a, b) - E(-b, -a))`` over the largest entry; 0 when the descending branches
    are the ascending ones turned by half a turn.
    """
    values = np.asarray(table, dtype=float)
    mirrored = -values[::-1, ::-1]  # E(-b, -a) = -E(-a, -b)
    largest = float(np.max(np.abs(values)))
    return float(np.max(np.abs(values - mirrored))) / largest if largest > 0.0 else 0.0
