"""Resampling of episodes and training seeds for the bootstrap.

A group of n is resampled by n - 1 draws: with n draws an interval would be too narrow by
sqrt((n - 1) / n), a tenth for five seeds (rao1988, p. 231).
"""

from __future__ import annotations

from collections.abc import Hashable
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray


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


@lru_cache(maxsize=32)  # all rows of a track ask for the same
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


def counts(draws: NDArray[np.int64], size: int) -> NDArray[np.float64]:
    """Return the number of draws of each of ``size``, shape (resamples, size)."""
    table = np.zeros((len(draws), size))
    np.add.at(table, (np.arange(len(draws))[:, None], draws), 1.0)
    return table
