"""Layout of parameter sets and drives in tiles of plants."""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
P = TypeVar("P")


def first_of(plants: Sequence[P], *words: str) -> P:
    """Return the first of some plants that run side by side.

    ``words`` are attributes that need to be the same in all of them, since they choose the code.
    """
    if not plants:
        raise ValueError("no plants are given; give one or more")
    makes = {tuple(attrgetter(word)(plant) for word in words) for plant in plants}
    if len(makes) != 1:
        raise ValueError(
            f"plants that are simulated together need to be of one variant ({', '.join(words)}), "
            f"got {makes}"
        )
    return plants[0]


def in_tiles(parameters: ArrayLike, plants: int, lanes: int) -> Array:
    """Return parameter sets, shape (n, n_parameters), as (tiles, n_parameters, lanes).

    The last set is repeated up to ``plants`` columns, and to fill the last tile.
    """
    columns: NDArray[Any] = np.asarray(parameters, np.float64)
    tiles = -(-plants // lanes)
    columns = columns[np.minimum(np.arange(tiles * lanes), len(columns) - 1)]
    return np.ascontiguousarray(columns.T.reshape(-1, tiles, lanes).transpose(1, 0, 2))


def drives_of(channels: Sequence[ArrayLike]) -> Array:
    """Return channels side by side, shape (channels, T, n); each is (), (T,) or (T, n)."""
    given = [np.asarray(channel, np.float64) for channel in channels]
    periods = max(len(c) if c.ndim else 1 for c in given)
    columns = max(c.shape[1] if c.ndim == 2 else 1 for c in given)
    shaped = [c[:, None] if c.ndim == 1 else c for c in given]
    return np.array([np.broadcast_to(c, (periods, columns)) for c in shaped])
