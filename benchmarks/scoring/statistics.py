"""Means with intervals over scenarios and seeds, and the probability of improvement.

Interquartile mean, probability of improvement and performance profile are those of R. Agarwal et
al., "Deep reinforcement learning at the edge of the statistical precipice", NeurIPS 34 (2021):
runs are training seeds, tasks are paired episodes, and less is better.

A table of scores has a row per training seed (one for a classical controller) and a column per
episode, shape (runs, n); ``strata`` are the scenarios of its columns, shape (n,).

Episodes are resampled within their scenario (stratified), with a fixed seed, so that the same
scores give the same interval to the last bit. Training seeds are resampled as clusters, since one
policy acts in all scenarios. Episodes of two scenarios must be independent, so they may not share a
seed. A group of n is resampled by n - 1 draws: with n draws an interval would be too narrow by
sqrt((n - 1) / n), a tenth for five seeds (rao1988, p. 231).
"""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from pam_envs.arrays import Array, Indices

BOOTSTRAP_SEED = 20_000_003
RESAMPLES = 5000
_BOUNDS = (0.025, 0.975)
_LARGEST = 4_000_000  # limit of the size of an array of resamples

Statistic = Callable[[Array], Array]


@dataclass(frozen=True)
class Interval:
    """An estimate with the bounds of its confidence interval."""

    value: float
    low: float
    high: float


NOTHING = Interval(float("nan"), float("nan"), float("nan"))
"""Estimate of a metric that is inapplicable in every episode."""


def mean(samples: Array) -> Array:
    """Return the mean over the last axis."""
    return np.asarray(np.mean(samples, axis=-1))


def interquartile_mean(samples: Array) -> Array:
    """Return the mean of the middle half over the last axis, (..., n) to (...).

    A quarter of n, rounded down, is omitted at either end. A resample of s strata has n - s
    episodes, so that with few of them it keeps another share: of two scenarios with five episodes
    each, 4 of 8 where the estimate keeps 6 of 10.
    """
    return np.asarray(stats.trim_mean(samples, 0.25, axis=-1))


def crossed(
    samples: ArrayLike, runs: Sequence[Any], pairs: Sequence[Any]
) -> tuple[Array, list[Any]]:
    """Return samples as a table of runs by pairs, and the pairs; both in ascending order.

    ``runs`` and ``pairs`` are the training seed and the paired episode of each of n samples. A
    ValueError says that an episode of a run is missing or duplicated.
    """
    rows, columns = (
        {label: k for k, label in enumerate(sorted(set(labels)))} for labels in (runs, pairs)
    )
    values = np.asarray(samples, float)
    table = np.empty((len(rows), len(columns)))
    filled = np.zeros(table.shape, int)
    for run, pair, value in zip(runs, pairs, values, strict=True):
        table[rows[run], columns[pair]] = value
        filled[rows[run], columns[pair]] += 1
    if (filled != 1).any():
        raise ValueError(
            f"{len(values)} episodes of {len(rows)} training seeds and {len(columns)} scenarios x "
            "seeds: every training seed must be run in every episode, once"
        )
    return table, list(columns)


def resampled(
    table: Array,
    strata: ArrayLike,
    statistic: Statistic,
    resamples: int,
    seed: int,
    run_seed: int | None = None,
) -> Array:
    """Return a statistic of resamples of a table's runs, and of its episodes within strata.

    With one run the draws are those of the columns alone. Tables of the same runs that share
    ``run_seed`` (``seed + 1`` by default) are resampled with the same runs.
    """
    columns = resample_indices(strata, resamples, seed)
    if len(table) == 1:
        return np.asarray(statistic(table[0][columns]))
    run_seed = seed + 1 if run_seed is None else run_seed
    rows = resample_indices(np.zeros(len(table)), resamples, run_seed)
    chunk = max(1, _LARGEST // (rows.shape[1] * columns.shape[1]))
    parts = []
    for first in range(0, resamples, chunk):
        some = slice(first, first + chunk)
        drawn = table[rows[some, :, None], columns[some, None, :]]
        parts.append(statistic(drawn.reshape(len(drawn), -1)))
    return np.concatenate(parts)


def applying(table: Array) -> NDArray[np.bool_]:
    """Return the mask of episodes in which a metric applies in every run, shape (n,)."""
    return np.asarray(np.isfinite(table).all(axis=0))


def of_table(
    table: Array,
    strata: ArrayLike,
    statistic: Statistic = mean,
    *,
    resamples: int = RESAMPLES,
) -> Interval:
    """Return a statistic of a table with its interval, NaN throughout if no episode applies.

    A NaN leaves its episode out in all runs. All strata must have the same number of episodes for
    the statistic of the resamples to weigh them as the samples do.
    """
    counts = applying(table)
    kept = table[:, counts]
    if not kept.size:
        return NOTHING
    drawn = resampled(kept, np.asarray(strata)[counts], statistic, resamples, BOOTSTRAP_SEED)
    return between(float(statistic(kept.ravel())), drawn)


def between(value: float, drawn: Array) -> Interval:
    """Return an estimate with the quantiles of its resamples."""
    low, high = np.quantile(drawn, _BOUNDS)
    return Interval(value, float(low), float(high))


def _run_counts(table: Array, resamples: int, number: int = 0) -> Array:
    """Return how often each run of the number-th table is drawn, shape (resamples, runs)."""
    seed = BOOTSTRAP_SEED + 1 + number
    return counts(resample_indices(np.zeros(len(table)), resamples, seed), len(table))


def _averages_of_runs(*tables: Array) -> list[Array]:
    """Return each episode's average over resampled runs of each table, shape (RESAMPLES, n)."""
    averages = []
    for number, table in enumerate(tables):
        drawn = _run_counts(table, RESAMPLES, number)
        averages.append(np.einsum("rt,tk->rk", drawn / drawn[0].sum(), table))
    return averages


def difference_of_tables(first: Array, second: Array, strata: ArrayLike) -> Interval:
    """Return the mean of ``first - second`` with its interval, paired by episode."""
    if len(first) == len(second) == 1:
        return of_table(first - second, strata)
    columns = resample_indices(strata, RESAMPLES, BOOTSTRAP_SEED)
    ours, theirs = _averages_of_runs(first, second)
    drawn = np.take_along_axis(ours - theirs, columns, axis=1).mean(axis=1)
    return between(float(np.mean(first.mean(axis=0) - second.mean(axis=0))), drawn)


def reduction_of_tables(first: Array, second: Array, strata: ArrayLike) -> Interval:
    """Return ``1 - mean(first) / mean(second)`` with its interval, paired by episode.

    Both means are of the same resampled episodes; NaN throughout if a mean of ``second`` is not
    positive.
    """
    columns = resample_indices(strata, RESAMPLES, BOOTSTRAP_SEED)
    ours, theirs = (
        np.take_along_axis(averages, columns, axis=1).mean(axis=1)
        for averages in _averages_of_runs(first, second)
    )
    whole = float(second.mean())
    if not (whole > 0.0 and (theirs > 0.0).all()):
        return NOTHING
    return between(1.0 - float(first.mean()) / whole, 1.0 - ours / theirs)


def difference_of_splits(
    first: Array, first_strata: ArrayLike, second: Array, second_strata: ArrayLike
) -> Interval:
    """Return the difference of the means of the same runs over two sets of episodes.

    Runs, in the same order in both, are paired, so that the scatter between policies cancels;
    episodes are not.
    """
    seed = BOOTSTRAP_SEED
    drawn = resampled(first, first_strata, mean, RESAMPLES, seed, seed + 1)
    drawn = drawn - resampled(second, second_strata, mean, RESAMPLES, seed + 2, seed + 1)
    return between(float(first.mean() - second.mean()), drawn)


def probability_of_improvement(first: ArrayLike, second: ArrayLike, strata: ArrayLike) -> Interval:
    """Return the probability that a run of ``first`` is below one of ``second``, paired.

    The share of pairs of runs in which the first is below, ties half (the Mann-Whitney statistic
    over the product of the numbers of runs), averaged over episodes. Drawn again are the training
    seeds of both, scenarios, and seeds within scenarios.
    """
    a, b = np.atleast_2d(np.asarray(first, float)), np.atleast_2d(np.asarray(second, float))
    below = (a[:, None] < b[None]) + 0.5 * (a[:, None] == b[None])
    labels = tuple(np.asarray(strata).tolist())
    columns = _drawn(_clusters, labels, RESAMPLES, BOOTSTRAP_SEED)
    # counts and halves: every sum is exact, so that its order does not matter
    ours, theirs = (_run_counts(table, RESAMPLES, number) for number, table in enumerate((a, b)))
    hits = np.einsum("ra,rb,abk->rk", ours, theirs, below, optimize=True)
    total = ours[0].sum() * theirs[0].sum() * columns.shape[1]
    drawn = np.take_along_axis(hits, columns, axis=1).sum(axis=1) / total
    return between(float(np.mean(below)), drawn)


def performance_profile(scores: ArrayLike, thresholds: ArrayLike) -> Array:
    """Return the share of scores that are at most each of m thresholds, shape (m,)."""
    ordered = np.sort(np.asarray(scores, float).ravel())
    return np.searchsorted(ordered, np.asarray(thresholds, float), side="right") / len(ordered)


def profile_band(
    scores: Array, strata: ArrayLike, thresholds: ArrayLike, *, resamples: int = 1000
) -> Array:
    """Return lower and upper bounds of the pointwise 95 % band of a profile, shape (2, m)."""
    below = (scores[:, :, None] <= np.asarray(thresholds, float)).astype(float)
    columns = counts(resample_indices(strata, resamples, BOOTSTRAP_SEED), scores.shape[1])
    rows = _run_counts(scores, resamples)
    hits = np.zeros((resamples, below.shape[2]))
    for weights, of_run in zip(rows.T, below, strict=True):
        hits += weights[:, None] * (columns @ of_run)
    return np.quantile(hits / (rows[0].sum() * columns[0].sum()), _BOUNDS, axis=0)


def resample_indices(strata: ArrayLike, resamples: int, seed: int) -> Indices:
    """Return indices of stratified resamples, shape (resamples, n - number of strata).

    ``strata`` are the labels of n samples. A stratum of one sample keeps it in every resample.
    """
    return _drawn(_within, tuple(np.asarray(strata).tolist()), resamples, seed)


Draw = Callable[[list[Indices], np.random.Generator, int], Indices]


@lru_cache(maxsize=40)  # all rows of a track need the same resamples
def _drawn(draw: Draw, strata: tuple[Hashable, ...], resamples: int, seed: int) -> Indices:
    members: dict[Hashable, list[int]] = {}
    for place, label in enumerate(strata):
        members.setdefault(label, []).append(place)
    generator = np.random.Generator(np.random.PCG64(seed))
    drawn = draw([np.array(rows) for rows in members.values()], generator, resamples)
    drawn.setflags(write=False)
    return drawn


def _within(members: list[Indices], generator: np.random.Generator, resamples: int) -> Indices:
    parts = [
        rows[generator.integers(0, len(rows), (resamples, max(1, len(rows) - 1)))]
        for rows in members
    ]
    return np.concatenate(parts, axis=1)


def _clusters(members: list[Indices], generator: np.random.Generator, resamples: int) -> Indices:
    """Return indices (resamples, m) of whole strata, all of one size, and of samples within."""
    sizes = {len(rows) for rows in members}
    if len(sizes) != 1:
        raise ValueError(f"strata of {sorted(sizes)} samples: run all of them with the same seeds")
    rows, size = np.array(members), sizes.pop()
    chosen = generator.integers(0, len(rows), (resamples, max(1, len(rows) - 1)))
    within = generator.integers(0, size, (*chosen.shape, max(1, size - 1)))
    return np.asarray(rows[chosen[..., None], within].reshape(resamples, -1))


def counts(draws: Indices, size: int) -> NDArray[np.float64]:
    """Return the number of draws of each of ``size``, shape (resamples, size)."""
    table = np.zeros((len(draws), size))
    np.add.at(table, (np.arange(len(draws))[:, None], draws), 1.0)
    return table
