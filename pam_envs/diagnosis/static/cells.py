"""Cells of a table of readings, and the play operators along its pressure paths."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.data.tables import LOAD_TOLERANCE, MM, ContractionTable
from pam_envs.diagnosis.arrays import Array, Flags

THRESHOLDS = (1 / 24, 1 / 16, 1 / 12, 1 / 8, 3 / 16)
"""Thresholds of the play operators over the highest pressure."""
BLOCK = 4
"""Number of neighbouring cells of one branch that form a block."""


@dataclass(frozen=True)
class Cells:
    """Cells of a table: one load and one step of a path each, with all repeats.

    Attributes
    ----------
    load, pressure, mean : ndarray, shape (C,)
        Load, pressure and mean contraction over their largest values.
    falling : ndarray of bool, shape (C,)
        Whether the pressure was reached by deflation.
    used : ndarray of bool, shape (C,)
        False for readings that are zero by definition.
    group : ndarray of int, shape (C,)
        Index into ``loads``.
    path : ndarray of int, shape (C,)
        Number of the pressure path, which starts at rest.
    block : ndarray of int, shape (C,)
        Block of neighbouring cells with dependent errors; -1 if not used.
    readings : ndarray, shape (R, C)
        Repeats; NaN if there are fewer.
    loads : tuple of float
        Loads [kg].
    scale : tuple of float
        Largest load [kg], pressure [Pa] and contraction [m].
    """

    load: Array
    pressure: Array
    mean: Array
    falling: Flags
    used: Flags
    group: NDArray[np.int64]
    path: NDArray[np.int64]
    block: NDArray[np.int64]
    readings: Array
    loads: tuple[float, ...]
    scale: tuple[float, float, float]

    @cached_property
    def order(self) -> NDArray[np.int64]:
        """Cells by step and path, shape (steps, paths); a shorter path repeats its last cell."""
        rows = [np.flatnonzero(self.path == k) for k in range(int(self.path[-1]) + 1)]
        longest = max(len(row) for row in rows)
        return np.array([np.pad(row, (0, longest - len(row)), "edge") for row in rows]).T

    @cached_property
    def lags(self) -> Array:
        """Lag of the play operators behind the pressure, shape (plays, 1, C)."""
        return stops(self.pressure[None], self.order)

    @property
    def counts(self) -> NDArray[np.int64]:
        """Number of readings in each cell, shape (C,)."""
        return np.asarray(np.isfinite(self.readings).sum(axis=0))

    @property
    def millimetres(self) -> float:
        """Scale of the contraction [mm]."""
        return self.scale[2] / MM


def _paths(table: ContractionTable) -> dict[tuple[float, bytes], list[NDArray[np.int64]]]:
    """Return the rows of every cycle, grouped by load and pressure path."""
    found: dict[tuple[float, bytes], list[NDArray[np.int64]]] = {}
    for load in table.loads:
        for repeat in table.repeats(load):
            rows = np.flatnonzero(
                (np.abs(table.load_kg - load) < LOAD_TOLERANCE) & (table.repeat == repeat)
            )
            key = (load, table.pressure_pa[rows].tobytes())
            found.setdefault(key, []).append(rows)
    return found


def _blocks(path: NDArray[np.int64], falling: Flags, used: Flags) -> NDArray[np.int64]:
    """Return the block of each cell: at most ``BLOCK`` used cells of one branch; -1 if unused."""
    block, last, size = np.full(len(path), -1), -1, 0
    before: tuple[int, bool] | None = None
    for i in np.flatnonzero(used):
        way = (int(path[i]), bool(falling[i]))
        fresh = way != before or size == BLOCK
        last, size, before = last + fresh, 1 if fresh else size + 1, way
        block[i] = last
    return block


def cells_of(table: ContractionTable) -> Cells:
    """Return the cells of a table, load by load and path by path, in the order of the readings."""
    cycles = _paths(table)
    most = max(len(rows) for rows in cycles.values())
    largest = max(float(np.abs(table.contraction_m).max()), 1e-12)
    scale = (max(table.loads) or 1.0, float(table.pressure_pa.max()) or 1.0, largest)
    parts: list[tuple[NDArray[Any], ...]] = []
    for number, ((load, _), rows) in enumerate(cycles.items()):
        values = np.full((most, len(rows[0])), np.nan)
        values[: len(rows)] = table.contraction_m[np.array(rows)] / largest
        used = np.ones(values.shape[1], bool)
        used[0] = bool(np.nanmax(np.abs(values[:, 0])) > 0.0)
        ones = np.ones(values.shape[1])
        parts.append(
            (
                ones * load / scale[0],
                table.pressure_pa[rows[0]] / scale[1],
                np.nanmean(values, axis=0),
                ~table.inflating[rows[0]],
                used,
                (ones * table.loads.index(load)).astype(np.int64),
                (ones * number).astype(np.int64),
                values,
            )
        )
    names = ("load", "pressure", "mean", "falling", "used", "group", "path", "readings")
    columns: dict[str, Any] = {
        name: np.concatenate(column, axis=-1)
        for name, column in zip(names, zip(*parts, strict=True), strict=True)
    }
    block = _blocks(columns["path"], columns["falling"], columns["used"])
    return Cells(**columns, block=block, loads=table.loads, scale=scale)


def stops(pressure: Array, order: NDArray[np.int64]) -> Array:
    """Return the lag of play operators behind the pressure from rest, shape (plays, L, C).

    ``order`` is :attr:`Cells.order`; the pressure has the shape (L, C).
    """
    lag = np.array(THRESHOLDS)[:, None, None]
    behind = np.zeros((len(THRESHOLDS), *pressure.shape))
    play = np.zeros((len(THRESHOLDS), len(pressure), order.shape[1]))
    for at in order:
        value = pressure[:, at]
        play = np.clip(play, value - lag, value + lag)
        behind[:, :, at] = value - play
    return behind
