"""Performance profiles: share of episodes whose error is at most a threshold."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from benchmarks.board import accessors as views
from benchmarks.runs.rows import Row
from benchmarks.scoring import statistics

Array = NDArray[np.float64]

POINTS = 60


def thresholds(rows: Sequence[Row], points: int = POINTS) -> Array:
    """Return errors [SI], evenly spaced in their logarithm, over the range that the rows have."""
    values = np.concatenate([views.scores(row).table.ravel() for row in rows])
    positive = values[np.isfinite(values) & (values > 0.0)]
    if not len(positive):
        return np.array([1.0])
    return np.geomspace(positive.min(), positive.max(), points)


def profile(row: Row, errors: Array) -> tuple[Array, Array]:
    """Return the share of the published episodes that is at most each error.

    Parameters
    ----------
    row : Row
    errors : (m,) array [SI]

    Returns
    -------
    (m,) array, (2, m) array
        The shares, of all training seeds, and their pointwise 95 % band.
    """
    found = views.scores(row)
    shares = statistics.performance_profile(found.table, errors)
    return shares, statistics.profile_band(found.table, found.strata, errors)
