"""Cells of a table of readings, and the play operators along its pressure paths."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from pam_envs.arrays import Array, Flags, Indices
from pam_envs.constants import MM
from pam_envs.data.tables import LOAD_TOLERANCE, ContractionTable

THRESHOLDS = (1 / 24, 1 / 16, 1 / 12, 1 / 8, 3 / 16)
"""Thresholds of the play operators over the highest pressure."""
BLOCK = 4  # number of neighbouring cells of one branch that form a block


@dataclass(frozen=True)
class Cells:
    """Cells of a table, shape (C,): one load and one step of a path each, with all repeats."""

    load: Array  # relative to the scale, as pressure and mean contraction
    pressure: Array
    mean: Array
    falling: Flags
    used: Flags  # not those that are zero by definition
    group: Indices  # index into loads
    path: Indices
    block: Indices  # of neighbouring cells with dependent errors, -1 if not used
    readings: Array  # (R, C), NaN where there are fewer repeats
    loads: tuple[float, ...]  # [kg]
    scale: tuple[float, float, float]  # largest load [kg], pressure [Pa], contraction [m]

    @cached_property
    def order(self) -> Indices:
        """Cells by step and path, shape (steps, paths); a shorter path repeats its last cell."""
        rows = [np.flatnonzero(self.path == k) for k in range(int(self.path[-1]) + 1)]
        longest = max(len(row) for row in rows)
        return np.array([np.pad(row, (0, longest - len(row)), "edge") for row in rows]).T

    @cached_property
    def lags(self) -> Array:
        """Lag of the play operators behind the pressure, shape (plays, 1, C)."""
        return stops(self.pressure[None], self.order)

    @property
    def counts(self) -> Indices:
        """Number of readings in each cell, shape (C,)."""
        return np.asarray(np.isfinite(self.readings).sum(axis=0))

    @property
    def millimetres(self) -> float:
        """Scale of the contraction [mm]."""
        return self.scale[2] / MM


def _blocks(path: Indices, falling: Flags, used: Flags) -> Indices:
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
    cycles: dict[tuple[float, bytes], list[Indices]] = {}
    for load in table.loads:
        for repeat in table.repeats(load):
            here = (np.abs(table.load_kg - load) < LOAD_TOLERANCE) & (table.repeat == repeat)
            rows = np.flatnonzero(here)
            cycles.setdefault((load, table.pressure_pa[rows].tobytes()), []).append(rows)
    most = max(len(rows) for rows in cycles.values())
    largest = max(float(np.abs(table.contraction_m).max()), 1e-12)
    scale = (max(table.loads) or 1.0, float(table.pressure_pa.max()) or 1.0, largest)
    parts: list[dict[str, Any]] = []
    for number, ((load, _), repeats) in enumerate(cycles.items()):
        n, first = len(repeats[0]), repeats[0]
        values = np.full((most, n), np.nan)
        values[: len(repeats)] = table.contraction_m[np.array(repeats)] / largest
        used = np.ones(n, bool)
        used[0] = bool(np.nanmax(np.abs(values[:, 0])) > 0.0)
        parts.append(
            {
                "load": np.ones(n) * load / scale[0],
                "pressure": table.pressure_pa[first] / scale[1],
                "mean": np.nanmean(values, axis=0),
                "falling": ~table.inflating[first],
                "used": used,
                "group": np.full(n, table.loads.index(load)),
                "path": np.full(n, number),
                "readings": values,
            }
        )
    columns: dict[str, Any] = {k: np.concatenate([p[k] for p in parts], -1) for k in parts[0]}
    block = _blocks(columns["path"], columns["falling"], columns["used"])
    return Cells(**columns, block=block, loads=table.loads, scale=scale)


def stops(pressure: Array, order: Indices) -> Array:
    """Return the lag of play operators behind a pressure (L, C), shape (plays, L, C)."""
    lag = np.array(THRESHOLDS)[:, None, None]
    behind = np.zeros((len(THRESHOLDS), *pressure.shape))
    play = np.zeros((len(THRESHOLDS), len(pressure), order.shape[1]))
    for at in order:
        value = pressure[:, at]
        play = np.clip(play, value - lag, value + lag)
        behind[:, :, at] = value - play
    return behind
