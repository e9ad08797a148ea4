"""Means with intervals over scenarios and seeds, and who is likely to do better than whom.

Interquartile mean, probability of improvement and performance profile are those of R. Agarwal et
al., "Deep reinforcement learning at the edge of the statistical precipice", NeurIPS 34 (2021):
runs are training seeds, tasks are paired episodes, and less is better.

Episodes are drawn again within their scenario (stratified), with a fixed seed, so that the same
scores give the same interval to the last bit. Training seeds are drawn as wholes, since one policy
answers in all scenarios. A group of n is resampled by n - 1 draws: with n draws the interval would
be too narrow by sqrt((n - 1) / n), a tenth for five seeds (J. N. K. Rao and C. F. J. Wu,
"Resampling inference with complex survey data", Journal of the American Statistical Association 83
(1988) 231).
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

BOOTSTRAP_SEED = 20_000_003
RESAMPLES = 5000
CONFIDENCE = 0.95
_LARGEST = 4_000_000
"""Numbers that resamples may hold at once."""

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
    return _indices(tuple(np.asarray(strata).tolist()), resamples, seed)


@lru_cache(maxsize=16)  # all rows of a track ask for the same
def _indices(strata: tuple[Hashable, ...], resamples: int, seed: int) -> NDArray[np.int64]:
    members: dict[Hashable, list[int]] = {}
    for place, label in enumerate(strata):
        members.setdefault(label, []).append(place)
    generator = np.random.Generator(np.random.PCG64(seed))
    parts = []
    for rows in map(np.array, members.values()):
        draws = max(1, len(rows) - 1)
        parts.append(rows[generator.integers(0, len(rows), (resamples, draws))])
    drawn = np.concatenate(parts, axis=1)
    drawn.setflags(write=False)
    return drawn


def draw_clusters(strata: ArrayLike, resamples: int, seed: int) -> NDArray[np.int64]:
    """Return row numbers of resamples of whole strata, and of the samples within each drawn one.

    Parameters
    ----------
    strata : (n,) array
        Label of each sample's stratum; all of one size.
    resamples : int
    seed : int

    Returns
    -------
    (resamples, m) array
    """
    return _clusters(tuple(np.asarray(strata).tolist()), resamples, seed)


@lru_cache(maxsize=8)
def _clusters(strata: tuple[Hashable, ...], resamples: int, seed: int) -> NDArray[np.int64]:
    members: dict[Hashable, list[int]] = {}
    for place, label in enumerate(strata):
        members.setdefault(label, []).append(place)
    sizes = {len(group) for group in members.values()}
    if len(sizes) != 1:
        raise ValueError(f"strata of {sorted(sizes)} samples: run all of them with the same seeds")
    rows, size = np.array(list(members.values())), sizes.pop()
    generator = np.random.Generator(np.random.PCG64(seed))
    chosen = generator.integers(0, len(rows), (resamples, max(1, len(rows) - 1)))
    within = generator.integers(0, size, (*chosen.shape, max(1, size - 1)))
    drawn = np.asarray(rows[chosen[..., None], within].reshape(resamples, -1))
    drawn.setflags(write=False)
    return drawn


def crossed(
    samples: ArrayLike, runs: Sequence[Hashable], pairs: Sequence[Hashable]
) -> tuple[Array, list[Any]]:
    """Return samples as a table of runs by pairs, and the pairs in order of their first mention.

    Parameters
    ----------
    samples : (n,) array
    runs, pairs : sequence of n
        Training seed and paired episode of each sample. Every run must have every pair once.

    Returns
    -------
    (number of runs, number of pairs) array, list

    Raises
    ------
    ValueError
        If an episode of a run is missing or there twice.
    """
    rows = {run: i for i, run in enumerate(dict.fromkeys(runs))}
    columns = {pair: k for k, pair in enumerate(dict.fromkeys(pairs))}
    values = np.asarray(samples, float)
    places = {(rows[run], columns[pair]) for run, pair in zip(runs, pairs, strict=True)}
    if len(places) != len(values) or len(values) != len(rows) * len(columns):
        raise ValueError(
            f"{len(values)} episodes of {len(rows)} training seeds and {len(columns)} scenarios x "
            "seeds: every training seed must be run in every episode, once"
        )
    table = np.empty((len(rows), len(columns)))
    for run, pair, value in zip(runs, pairs, values, strict=True):
        table[rows[run], columns[pair]] = value
    return table, list(columns)


def resampled(
    table: Array, strata: ArrayLike, statistic: Statistic, resamples: int, seed: int
) -> Array:
    """Return a statistic of resamples of a table: of its runs, and of episodes within strata.

    Parameters
    ----------
    table : (runs, n) array
    strata : (n,) array
        Of the columns. With one run the draws are those of the columns alone.

    Returns
    -------
    (resamples,) array
    """
    columns = resample_indices(strata, resamples, seed)
    if len(table) == 1:
        return np.asarray(statistic(table[0][columns]))
    rows = resample_indices(np.zeros(len(table)), resamples, seed + 1)
    chunk = max(1, _LARGEST // (rows.shape[1] * columns.shape[1]))
    parts = []
    for first in range(0, resamples, chunk):
        some = slice(first, first + chunk)
        drawn = table[rows[some, :, None], columns[some, None, :]]
        parts.append(statistic(drawn.reshape(len(drawn), -1)))
    return np.concatenate(parts)


def bootstrap(
    samples: ArrayLike,
    strata: ArrayLike,
    statistic: Statistic = mean,
    *,
    runs: Sequence[Hashable] | None = None,
    pairs: Sequence[Hashable] | None = None,
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
    runs, pairs : sequence of n, optional
        Training seed of each episode, and what is the same of one episode in all of them. Left
        out where there is no training. An episode that does not apply in one of the runs is left
        out in all.

    Returns
    -------
    Interval
        NaN throughout if no sample applies.
    """
    labels = np.asarray(strata)
    several = runs is not None and len(set(runs)) > 1
    if several and pairs is None:
        raise ValueError("samples of several training seeds need `pairs` to say which belong")
    if several:
        table, order = crossed(samples, runs or (), pairs or ())
        of_pair = dict(zip(pairs or (), labels.tolist(), strict=True))
        labels = np.array([of_pair[pair] for pair in order])
    else:
        table = np.asarray(samples, float)[None, :]
    applies = np.isfinite(table).all(axis=0)
    table, labels = table[:, applies], labels[applies]
    if not table.size:
        return Interval(float("nan"), float("nan"), float("nan"))
    drawn = resampled(table, labels, statistic, resamples, seed)
    return between(float(statistic(table.ravel())), drawn, confidence)


def between(value: float, drawn: Array, confidence: float = CONFIDENCE) -> Interval:
    """Return an estimate with the quantiles of its resamples."""
    low, high = np.quantile(drawn, [0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence])
    return Interval(value, float(low), float(high))


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


def difference_of_tables(
    first: Array,
    second: Array,
    strata: ArrayLike,
    *,
    resamples: int = RESAMPLES,
    seed: int = BOOTSTRAP_SEED,
) -> Interval:
    """Return the mean of ``first - second`` with its interval, paired by episode.

    Parameters
    ----------
    first, second : (runs, n) array
        Scores of two controllers, a row a training seed (one row for a classical controller) and
        a column an episode that both have run.
    strata : (n,) array
        Scenario of each column.
    """
    if len(first) == len(second) == 1:
        return paired_difference(first[0], second[0], strata, resamples=resamples, seed=seed)
    columns = resample_indices(strata, resamples, seed)
    averages = []
    for number, table in enumerate((first, second)):
        rows = resample_indices(np.zeros(len(table)), resamples, seed + 1 + number)
        shares = _counts(rows, len(table)) / rows.shape[1]
        averages.append(np.einsum("rt,tk->rk", shares, table))
    drawn = np.take_along_axis(averages[0] - averages[1], columns, axis=1).mean(axis=1)
    return between(float(np.mean(first.mean(axis=0) - second.mean(axis=0))), drawn)


def probability_of_improvement(
    first: ArrayLike,
    second: ArrayLike,
    strata: ArrayLike,
    *,
    resamples: int = RESAMPLES,
    seed: int = BOOTSTRAP_SEED,
) -> Interval:
    """Return how likely a run of ``first`` is below one of ``second``, over paired episodes.

    The share of pairs of runs in which the first is below, ties half (the Mann-Whitney statistic
    over the product of the numbers of runs), averaged over episodes. Drawn again are the training
    seeds of both, scenarios, and seeds within scenarios.

    Parameters
    ----------
    first, second : (runs, n) array
        A row a training seed (one for a classical controller), a column an episode.
    strata : (n,) array
        Scenario of each column.
    """
    a, b = np.atleast_2d(np.asarray(first, float)), np.atleast_2d(np.asarray(second, float))
    below = (a[:, None] < b[None]) + 0.5 * (a[:, None] == b[None])
    columns = draw_clusters(strata, resamples, seed)
    # counts and halves: every sum is exact, so that its order does not matter
    ours, theirs = (
        _counts(resample_indices(np.zeros(len(table)), resamples, seed + 1 + number), len(table))
        for number, table in enumerate((a, b))
    )
    hits = np.einsum("ra,rb,abk->rk", ours, theirs, below, optimize=True)
    total = ours[0].sum() * theirs[0].sum() * columns.shape[1]
    drawn = np.take_along_axis(hits, columns, axis=1).sum(axis=1) / total
    return between(float(np.mean(below)), drawn)


def performance_profile(scores: ArrayLike, thresholds: ArrayLike) -> Array:
    """Return the share of scores that are at most each threshold.

    Parameters
    ----------
    scores : (runs, n) array
        A row a training seed, a column an episode.
    thresholds : (m,) array

    Returns
    -------
    (m,) array
    """
    ordered = np.sort(np.asarray(scores, float).ravel())
    return np.searchsorted(ordered, np.asarray(thresholds, float), side="right") / len(ordered)


def _counts(draws: NDArray[np.int64], size: int) -> Array:
    """Return how often each of ``size`` was drawn, shape (resamples, size)."""
    table = np.zeros((len(draws), size))
    np.add.at(table, (np.arange(len(draws))[:, None], draws), 1.0)
    return table


def share_better(first: ArrayLike, second: ArrayLike) -> float:
    """Return the share of paired episodes in which ``first`` is below ``second``, ties half."""
    a, b = np.asarray(first, float), np.asarray(second, float)
    both = np.isfinite(a) & np.isfinite(b)
    if not both.any():
        return float("nan")
    return float(np.mean(np.where(a < b, 1.0, np.where(a == b, 0.5, 0.0))[both]))
