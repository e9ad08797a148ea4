"""Means with intervals over scenarios and seeds.

Episodes are drawn again within their scenario (stratified), with a fixed seed, so that the same
scores give the same interval to the last bit. A scenario with n episodes is resampled by n - 1
draws: with n draws the interval would be too narrow by sqrt((n - 1) / n), a tenth for five seeds
(J. N. K. Rao and C. F. J. Wu, "Resampling inference with complex survey data", Journal of the
American Statistical Association 83 (1988) 231).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

BOOTSTRAP_SEED = 20_000_003
RESAMPLES = 5000
CONFIDENCE = 0.95

Array = NDArray[np.float64]
Statistic = Callable[[Array], Array]


@dataclass(frozen=True)
class Interval:
    """An estimate with the bounds of its confidence interval."""

    value: float
    low: float
    high: float

    def overlaps(self, other: Interval) -> bool:
        """Return whether the two intervals have a point in common."""
        return self.low <= other.high and other.low <= self.high


def mean(samples: Array) -> Array:
    """Return the mean over the last axis."""
    return np.asarray(np.mean(samples, axis=-1))


def interquartile_mean(samples: Array) -> Array:
    """Return the mean of the middle half over the last axis, shape (..., n) to (...)."""
    return np.asarray(stats.trim_mean(samples, 0.25, axis=-1))


def resample_indices(strata: ArrayLike, resamples: int, seed: int) -> NDArray[np.int64]:
    """Return row numbers of stratified resamples, shape (resamples, n - number of strata).

    Parameters
    ----------
    strata : (n,) array
        Label of each sample's stratum. A stratum of one sample keeps it in every resample.
    resamples : int
    seed : int
    """
    labels = np.asarray(strata)
    generator = np.random.Generator(np.random.PCG64(seed))
    parts = []
    for label in dict.fromkeys(labels.tolist()):
        rows = np.flatnonzero(labels == label)
        draws = max(1, len(rows) - 1)
        parts.append(rows[generator.integers(0, len(rows), (resamples, draws))])
    return np.concatenate(parts, axis=1)


def bootstrap(
    samples: ArrayLike,
    strata: ArrayLike,
    statistic: Statistic = mean,
    *,
    resamples: int = RESAMPLES,
    seed: int = BOOTSTRAP_SEED,
    confidence: float = CONFIDENCE,
) -> Interval:
    """Return a statistic with its percentile bootstrap interval, stratified.

    Parameters
    ----------
    samples : (n,) array
        One number per episode; NaN entries (not applicable) are left out.
    strata : (n,) array
        Scenario of each episode. All strata must have the same number of episodes for the
        statistic of the resamples to weigh them as the samples do.
    statistic : callable
        From (..., n) to (...).

    Returns
    -------
    Interval
        NaN throughout if no sample applies.
    """
    values, labels = np.asarray(samples, float), np.asarray(strata)
    applies = np.isfinite(values)
    values, labels = values[applies], labels[applies]
    if not len(values):
        return Interval(float("nan"), float("nan"), float("nan"))
    drawn = statistic(values[resample_indices(labels, resamples, seed)])
    low, high = np.quantile(drawn, [0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence])
    return Interval(float(statistic(values)), float(low), float(high))


def paired_difference(
    first: ArrayLike, second: ArrayLike, strata: ArrayLike, **options: Any
) -> Interval:
    """Return the mean of ``first - second`` with its interval, episode by episode.

    Parameters
    ----------
    first, second : (n,) array
        Scores of two controllers in the same episodes, in the same order.
    strata : (n,) array
    """
    difference = np.asarray(first, float) - np.asarray(second, float)
    return bootstrap(difference, strata, **options)


def share_better(first: ArrayLike, second: ArrayLike) -> float:
    """Return the share of paired episodes in which ``first`` is below ``second``, ties half."""
    a, b = np.asarray(first, float), np.asarray(second, float)
    both = np.isfinite(a) & np.isfinite(b)
    if not both.any():
        return float("nan")
    return float(np.mean(np.where(a < b, 1.0, np.where(a == b, 0.5, 0.0))[both]))
