"""Resampling of episodes and training seeds for the bootstrap.

A group of n is resampled by n - 1 draws: with n draws an interval would be too narrow by
sqrt((n - 1) / n), a tenth for five seeds (rao1988, p. 231).
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

Indices = NDArray[np.int64]


def resample_indices(strata: ArrayLike, resamples: int, seed: int) -> Indices:
    """Return indices of stratified resamples, shape (resamples, n - number of strata).

    ``strata`` are the labels of n samples. A stratum of one sample keeps it in every resample.
    """
    return _drawn(_within, tuple(np.asarray(strata).tolist()), resamples, seed)


def draw_clusters(strata: ArrayLike, resamples: int, seed: int) -> Indices:
    """Return indices of resamples of whole strata and of the samples within each drawn one.

    ``strata`` are the labels of n samples, all strata of one size; shape (resamples, m).
    """
    return _drawn(_clusters, tuple(np.asarray(strata).tolist()), resamples, seed)


Draw = Callable[[list[Indices], np.random.Generator, int], Indices]


@lru_cache(maxsize=40)  # all rows of a track ask for the same
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
