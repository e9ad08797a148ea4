"""Preisach operators from measurements.

:func:`preisach_from_curves` reads the Everett map off first-order descending curves, one from
every level of the grid: the textbook identification, which needs a dedicated test.
:func:`fit_preisach` takes any record and solves for non-negative relay weights, drawn by a small
penalty to a *prior density*: the density of ``alpha - beta`` alone (loops of one width all over the
range, one unknown a diagonal) that fits the record best. Cells that the record does not determine
keep its proportions. Rank and the share of each cell that the data determine are returned.

References
----------
I. D. Mayergoyz, "Mathematical Models of Hysteresis", Springer 1991, section 1.2: identification by
first-order curves; congruency and wiping out as necessary and sufficient conditions.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import nnls

from pam_envs.arrays import Array
from pam_envs.hysteresis import everett as maps
from pam_envs.hysteresis.extrema import preisach_step
from pam_envs.hysteresis.preisach import Preisach
from pam_envs.hysteresis.protocol import Start
from pam_envs.kernels.build import entry, kernel


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


Curve = tuple[ArrayLike, ArrayLike]


@dataclass(frozen=True)
class CurveFit:
    """Operator read off first-order curves."""

    model: Preisach
    # share of relay weight that came out negative and was set to 0, by noise or misfit
    clipped: float


@dataclass(frozen=True)
class PreisachFit:
    """Operator fitted to a record, and its identifiability."""

    model: Preisach  # its output includes the constant (start_output) unless the start is virgin
    offset: float  # the constant (output in the start state), in the unit of the output
    rms: float  # of the residual
    rank: int  # of the regressors: one per cell, and the constant
    unknowns: int  # number of cells plus 1
    decided: Array  # (n - 1, n - 1): share of each weight that the record determines, 0 all prior
    prior: Array  # (n - 1, n - 1): relay weights of the prior


def curve_inputs(low: float, high: float, levels: int, points: int = 1) -> Array:
    """Return the input of a first-order test: from ``low`` up to each level in turn and back.

    There are ``levels - 1`` curves, and ``points`` samples per cell of the grid.
    """
    fine = np.linspace(low, high, (levels - 1) * points + 1)
    legs = [fine[:1]]
    for k in range(1, levels):
        up = fine[1 : k * points + 1]
        legs += [up, up[-2::-1], fine[:1]]
    return np.concatenate(legs)


def measured(x: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
    """Return a record as two float arrays, or say what is wrong with it."""
    inputs, outputs = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    if inputs.ndim != 1 or inputs.shape != outputs.shape or inputs.size < 2:
        raise ValueError(
            f"x has shape {inputs.shape} and y {outputs.shape}; give two series of one length,"
            " at least 2 samples"
        )
    for name, values in (("x", inputs), ("y", outputs)):
        if not np.all(np.isfinite(values)):
            t = int(np.argmin(np.isfinite(values)))
            raise ValueError(f"{name}[{t}] is {values[t]}; it must be finite: cut or fill the gap")
    return inputs, outputs


def descending_curves(x: ArrayLike, y: ArrayLike) -> list[tuple[Array, Array]]:
    """Return the falling runs of a record, each from its turn to its end, as (x, y) pairs."""
    inputs, outputs = measured(x, y)
    falling = np.diff(inputs) < 0.0
    edges = np.diff(np.concatenate([[0], falling.astype(int), [0]]))
    first, last = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    return [(inputs[a : b + 1], outputs[a : b + 1]) for a, b in zip(first, last, strict=True)]


def preisach_from_curves(
    curves: Sequence[Curve],
    low: float,
    high: float,
    levels: int,
    depth: int = 24,
    start_output: float = 0.0,
) -> CurveFit:
    """Return the Preisach operator of first-order descending curves.

    Each of the ``curves``, (x, y) pairs, begins at a turn on the ascending major branch and falls
    to ``low``; there must be one from every one of the ``levels`` of the grid above ``low``, in any
    order. ``depth`` is the number of extrema that the operator keeps, ``start_output`` the output
    at ``low``. The map is ``E(alpha, beta) = y(turn at alpha) - y(beta)``, negative weights set to
    0. A ValueError names a level without a curve, or a curve that does not reach ``low``.
    """
    points = np.linspace(low, high, levels)
    rising = np.zeros((levels, levels))
    found = np.zeros(levels, dtype=bool)
    for x, y in curves:
        inputs, outputs = measured(x, y)
        k = int(np.argmin(np.abs(points - inputs[0])))
        near = 1e-6 * (high - low)
        if abs(points[k] - inputs[0]) > near or k == 0:
            continue
        if inputs[-1] > low + near:
            raise ValueError(
                f"the curve from {inputs[0]} ends at {inputs[-1]}; it must reach {low}: measure it"
                " to the end of the range"
            )
        rising[k, :k] = outputs[0] - np.interp(points[:k], inputs[::-1], outputs[::-1])
        found[k] = True
    if not np.all(found[1:]):
        missing = points[1:][~found[1:]]
        raise ValueError(
            f"no curve turns at {missing[0]}, a level of the grid ({missing.size} missing); choose"
            " levels for which all were measured, or use fit_preisach, which takes any record"
        )
    weights = maps.weights_from_table(rising - rising.T)
    clipped = np.sum(np.abs(weights[weights < 0.0])) / max(np.sum(np.abs(weights)), 1e-300)
    model = Preisach.from_weights(
        np.maximum(weights, 0.0), low, high, depth, start_output=start_output
    )
    return CurveFit(model, float(clipped))


def fit_preisach(
    x: ArrayLike,
    y: ArrayLike,
    low: float,
    high: float,
    levels: int = 17,
    depth: int = 24,
    start: Start = "low",
    prior_weight: float = 1e-3,
) -> PreisachFit:
    """Return the Preisach operator, plus a constant, that is nearest to a record.

    Input ``x`` and output ``y``, shape (T,), are from the ``start`` state on; inputs beyond ``low``
    and ``high`` count as these. The grid has ``levels``, that is ``levels (levels - 1) / 2``
    unknown weights, and ``depth`` extrema are kept. A virgin start makes the weights symmetric,
    ``mu(a, b) = mu(-b, -a)``, and needs ``low = -high``. ``prior_weight``, above 0, is the penalty
    on the distance from the prior, relative to the largest singular value of the regressors.
    """
    inputs, outputs = measured(x, y)
    if not prior_weight > 0.0:
        raise ValueError(f"prior_weight is {prior_weight}; it must be above 0: 1e-3 is the default")
    up, down = np.tril_indices(levels - 1)
    regressors = relay_regressors(inputs, low, high, levels, depth, start)[:, up, down]
    join = _mirror_join(up, down, levels) if start == "virgin" else np.eye(len(up))
    columns = regressors @ join
    middle, level = columns.mean(axis=0), outputs.mean()
    if start == "virgin":  # nothing to add to an output that begins at 0
        middle, level = np.zeros_like(middle), 0.0
    centred, target = columns - middle, outputs - level
    sizes, directions = np.linalg.svd(centred, full_matrices=False)[1:]
    strength = prior_weight * max(sizes[0], 1e-300)
    prior = _gap_prior(centred, target, join, up - down)
    found = _drawn(centred, target, prior, strength)
    weights, prior_cells, decided = (np.zeros((levels - 1, levels - 1)) for _ in range(3))
    weights[up, down], prior_cells[up, down] = join @ found, join @ prior
    share = (sizes / np.hypot(sizes, strength))[:, None] * directions
    decided[up, down] = (join > 0.0) @ np.sum(share**2, axis=0)
    offset = float(level - middle @ found)
    model = Preisach.from_weights(weights, low, high, depth, start, offset)
    rms = float(np.sqrt(np.mean((outputs - offset - columns @ found) ** 2)))
    rank = int(np.sum(sizes > sizes[0] * max(centred.shape) * np.finfo(float).eps))
    extra = int(start != "virgin")
    return PreisachFit(
        model, offset, rms, rank + extra, columns.shape[1] + extra, decided, prior_cells
    )


def _mirror_join(up: NDArray[np.int64], down: NDArray[np.int64], levels: int) -> Array:
    """Return the matrix, (cells, pairs), that gives a cell and its mirror image one weight."""
    first = np.minimum(up * levels + down, (levels - 2 - down) * levels + levels - 2 - up)
    _, pair = np.unique(first, return_inverse=True)
    return np.eye(pair.max() + 1)[pair]


def _gap_prior(columns: Array, y: Array, join: Array, gaps: NDArray[np.int64]) -> Array:
    """Return the best weights that depend on the gap of the thresholds alone."""
    gap_of = (join.T @ gaps) / join.sum(axis=0)
    diagonals = np.eye(int(gaps.max()) + 1)[np.rint(gap_of).astype(int)]
    summed = columns @ diagonals
    size = np.maximum(np.sqrt(np.sum(summed**2, axis=0)), 1e-300)
    return diagonals @ (nnls(summed / size, y)[0] / size)


def _drawn(columns: Array, y: Array, prior: Array, strength: float) -> Array:
    """Return weights, not negative, near the data and drawn to the prior."""
    stacked = np.vstack([columns, strength * np.eye(columns.shape[1])])
    return nnls(stacked, np.concatenate([y, strength * prior]), maxiter=30 * columns.shape[1])[0]


def congruency_error(loops: Sequence[Curve]) -> float:
    """Return the error of congruency of minor loops between the same two inputs.

    ``loops`` are at least two records, (x, y) pairs, of the same closed excursion of the input with
    different histories, each from the same turn on. The error is the largest difference between two
    loops after moving their first points together, over the largest height of a loop: 0 (to
    rounding) for a Preisach operator; creep, or a width that depends on the level of the output,
    increases it. A ValueError says that there are fewer than two loops, or different inputs.
    """
    records = [measured(x, y) for x, y in loops]
    if len(records) < 2:
        raise ValueError(f"{len(records)} loops; congruency compares at least 2: record more")
    ends = [(x.min(), x.max(), x[0]) for x, _ in records]
    span = ends[0][1] - ends[0][0]
    for k, end in enumerate(ends):
        if np.max(np.abs(np.subtract(end, ends[0]))) > 1e-6 * span:
            raise ValueError(
                f"loop {k} is between {end[0]} and {end[1]} from {end[2]}, loop 0 between"
                f" {ends[0][0]} and {ends[0][1]} from {ends[0][2]}; compare equal loops"
            )
    travels = [np.concatenate([[0.0], np.cumsum(np.abs(np.diff(x)))]) for x, _ in records]
    shapes = [
        np.interp(travels[0], travel, y - y[0])
        for travel, (_, y) in zip(travels, records, strict=True)
    ]
    height = max(float(np.ptp(shape)) for shape in shapes)
    spread = float(np.max(np.ptp(np.array(shapes), axis=0)))
    return spread / height if height > 0.0 else 0.0
