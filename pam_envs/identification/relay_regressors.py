"""Regressors of a Preisach fit: the share of every relay cell that is up, along a record."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.hysteresis.extrema import preisach_step
from pam_envs.hysteresis.preisach import Preisach
from pam_envs.hysteresis.protocol import Start
from pam_envs.kernels.build import entry, kernel

Array = NDArray[np.float64]


@kernel
def _spread(a: float, b: float, part: float, nodes: Any) -> None:
    """Add ``part`` times the bilinear weights of the map at ``(a, b)``, in cells."""
    last = nodes.shape[0] - 2
    i, j = min(int(a), last), min(int(b), last)
    s, t = a - i, b - j
    nodes[i, j] += part * (1.0 - s) * (1.0 - t)
    nodes[i, j + 1] += part * (1.0 - s) * t
    nodes[i + 1, j] += part * s * (1.0 - t)
    nodes[i + 1, j + 1] += part * s * t


@entry
def _node_weights(
    x: Array, stack: Any, sums: Any, count: Any, table: Any, low: float, inverse_cell: float,
    virgin: bool, nodes: Array,
) -> None:  # fmt: skip
    for t in range(len(x)):
        preisach_step(x[t], stack, sums, count, 0, table, low, inverse_cell)
        if virgin:
            a = (stack[0, 0] - low) * inverse_cell
            _spread(a, (-stack[0, 0] - low) * inverse_cell, 0.5, nodes[t])
        for k in range(1, count[0]):
            a = (stack[k, 0] - low) * inverse_cell
            b = (stack[k - 1, 0] - low) * inverse_cell
            _spread(a, b, 1.0, nodes[t])


def relay_regressors(
    x: Array, low: float, high: float, levels: int, depth: int = 24, start: Start = "low"
) -> Array:
    """Return the change of the output at each sample by a unit weight in each cell.

    It is the share of the cell's relays that is up, counted from the ``start`` state, shape
    (T, levels - 1, levels - 1): the output of :class:`Preisach`, less that of its start, is its
    sum with the weights. ``x`` is the input (T,) from the start state on.
    """
    blank = Preisach(low, high, np.zeros((levels, levels)), depth, start)  # type: ignore[arg-type]
    stack, sums, count = blank.initial_state((1,))
    nodes = np.zeros((len(x), levels, levels))
    series = np.ascontiguousarray(x, dtype=float)
    hysteresis = stack, sums, count, blank.everett, low, blank.inverse_cell
    _node_weights(series, *hysteresis, start == "virgin", nodes)
    rising = np.tril(nodes - nodes.transpose(0, 2, 1), -1)
    # a cell (k, l) counts in the map at every node (i > k, j <= l)
    after = np.cumsum(rising[:, ::-1, :], axis=1)[:, ::-1, :]
    return np.ascontiguousarray(np.cumsum(after, axis=2)[:, 1:, :-1])
