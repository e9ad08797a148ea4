"""The measured contraction of one muscle over pressure cycles, checked as it is read.

375 readings of a Festo MAS-10-N-100 (seed 003, Tables 3 to 5): three hanging loads, five cycles
each, one cycle 0 to 6 bar and back in steps of 0.5 bar, a minute of rest before each reading.
A muscle remembers, so a reading means something only with those before it: the arrays keep the
order in which a cycle was gone through.
"""

from __future__ import annotations

import csv
import dataclasses
import math
from collections.abc import Callable, Iterator
from importlib import resources
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BAR = 1e5
MM = 1e-3
COLUMNS = ("load_kg", "direction", "pressure_bar", "repeat", "contraction_mm")
DIRECTIONS = ("inflation", "deflation")
LOAD_TOLERANCE = 1e-6
"""Two loads [kg] closer than this are the same load."""


@dataclasses.dataclass(frozen=True)
class ContractionTable:
    """Static contractions over pressure cycles under constant loads.

    All arrays have one entry per reading, shape (n,), and are read-only. Readings stand load by
    load, in a load repeat by repeat, in a repeat in the order of the cycle: pressure up, then down.

    Attributes
    ----------
    load_kg : ndarray of float
        Hanging mass [kg].
    inflating : ndarray of bool
        Whether the pressure had been raised to this reading; the reading at the turning point
        counts as inflating.
    pressure_pa : ndarray of float
        Gauge pressure [Pa].
    repeat : ndarray of int
        Number of the cycle at this load, from 1.
    contraction_m : ndarray of float
        Contraction [m] from the muscle's length at this load, without pressure, before the cycle.
    """

    load_kg: Array
    inflating: NDArray[np.bool_]
    pressure_pa: Array
    repeat: NDArray[np.int64]
    contraction_m: Array

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for field in dataclasses.fields(self):
            getattr(self, field.name).setflags(write=False)

    @property
    def loads(self) -> tuple[float, ...]:
        """The loads [kg], ascending."""
        return tuple(float(load) for load in np.unique(self.load_kg))

    def repeats(self, load: float) -> tuple[int, ...]:
        """Return the numbers of the cycles measured at ``load`` [kg]."""
        return tuple(int(number) for number in np.unique(self.repeat[self._at(load)]))

    def cycle(self, load: float, repeat: int) -> tuple[Array, Array]:
        """Return one cycle in the order it was gone through.

        Parameters
        ----------
        load : float
            One of :attr:`loads` [kg].
        repeat : int
            One of ``repeats(load)``.

        Returns
        -------
        pressure : ndarray, shape (25,)
            [Pa], 0 to 6 bar and back to 0 in the published tables.
        contraction : ndarray, shape (25,)
            [m].

        Raises
        ------
        ValueError
            If there is no such load or repeat.
        """
        rows = self._at(load) & (self.repeat == repeat)
        if not rows.any():
            raise ValueError(
                f"no repeat {repeat!r} at {load:g} kg; the repeats there are {self.repeats(load)}"
            )
        return self.pressure_pa[rows], self.contraction_m[rows]

    def cycles(self, load: float) -> tuple[Array, Array]:
        """Return all cycles at a load.

        Parameters
        ----------
        load : float
            One of :attr:`loads` [kg].

        Returns
        -------
        pressure : ndarray, shape (25,)
            Path [Pa], the same for all cycles.
        contraction : ndarray, shape (25, n_repeats)
            [m].
        """
        cycles = [self.cycle(load, repeat) for repeat in self.repeats(load)]
        return cycles[0][0], np.column_stack([contraction for _, contraction in cycles])

    def means(self, load: float) -> tuple[Array, Array]:
        """Return the pressure path [Pa] and the contraction [m] averaged over the repeats.

        Parameters
        ----------
        load : float
            One of :attr:`loads` [kg].

        Returns
        -------
        pressure, contraction : ndarray, shape (25,)
            In path order.
        """
        pressure, contraction = self.cycles(load)
        return pressure, contraction.mean(axis=1)

    def branch(self, load: float, inflating: bool) -> tuple[Array, Array]:
        """Return one branch of the loop, both its ends included.

        Parameters
        ----------
        load : float
            One of :attr:`loads` [kg].
        inflating : bool
            True for the pressures up to the turning point, False for those from it: the turning
            point is in both.

        Returns
        -------
        pressure : ndarray, shape (13,)
            [Pa], in path order: rising when inflating, falling otherwise.
        contraction : ndarray, shape (13, n_repeats)
            [m].
        """
        pressure, contraction = self.cycles(load)
        top = int(np.argmax(pressure))
        part = slice(None, top + 1) if inflating else slice(top, None)
        return pressure[part], contraction[part]

    def without_repeat(self, repeat: int) -> ContractionTable:
        """Return the table less one repeat of every load, for judging a fit on that repeat.

        Raises
        ------
        ValueError
            If there is no such repeat, or no other.
        """
        kept = self.repeat != repeat
        if kept.all() or not kept.any():
            raise ValueError(
                f"leaving out repeat {repeat!r} leaves {int(kept.sum())} of {kept.size} readings; "
                f"choose one of several repeats, here {sorted(set(self.repeat.tolist()))}"
            )
        columns = {
            field.name: getattr(self, field.name)[kept] for field in dataclasses.fields(self)
        }
        return ContractionTable(**columns)

    def _at(self, load: float) -> NDArray[np.bool_]:
        rows: NDArray[np.bool_] = np.abs(self.load_kg - load) < LOAD_TOLERANCE
        if not rows.any():
            known = ", ".join(f"{one:g}" for one in self.loads)
            raise ValueError(f"no readings at {load!r} kg; the loads of this table are {known} kg")
        return rows


def load_contraction_table(path: str | Path | None = None) -> ContractionTable:
    """Read and check a table of contractions.

    Parameters
    ----------
    path : str or Path, optional
        A CSV file with the columns ``load_kg, direction, pressure_bar, repeat, contraction_mm``,
        each cycle's rows in the order of its readings. Default: the published 375 readings.

    Returns
    -------
    ContractionTable
        In SI, whatever order the file's cycles are mixed in.

    Raises
    ------
    ValueError
        For a bad cell, naming file, row (the header is row 1), column and value; for a cycle whose
        pressures do not rise and then fall, or differ from those of the load's other cycles.
    """
    source = resources.files(__package__) / "mas10_contraction.csv" if path is None else Path(path)
    # utf-8-sig: spreadsheets put a byte order mark before the first column's name.
    lines = source.read_text(encoding="utf-8-sig").splitlines()
    table = _in_cycle_order(_read(csv.reader(lines), str(source)))
    _check_cycles(table, str(source))
    return table


def _read(rows: Iterator[list[str]], name: str) -> list[tuple[float, bool, float, int, float]]:
    """Return the readings in SI, in the file's order."""
    header = tuple(cell.strip() for cell in next(rows, []))
    if header != COLUMNS:
        raise ValueError(
            f"{name}, row 1: the columns must be {', '.join(COLUMNS)}, got {', '.join(header)!r}"
        )
    readings = [_reading(cells, f"{name}, row {row}") for row, cells in enumerate(rows, 2) if cells]
    if not readings:
        raise ValueError(f"{name} holds no readings; give at least one cycle")
    return readings


def _reading(cells: list[str], where: str) -> tuple[float, bool, float, int, float]:
    """Return one reading (load kg, inflating, pressure Pa, repeat, contraction m)."""
    if len(cells) != len(COLUMNS):
        raise ValueError(f"{where}: {len(COLUMNS)} cells are needed, got {len(cells)}: {cells!r}")
    load, direction, pressure, repeat, contraction = (cell.strip() for cell in cells)
    return (
        _number(load, f"{where}, column load_kg", 0.0, 1000.0, float),
        _is_inflation(direction, f"{where}, column direction"),
        BAR * _number(pressure, f"{where}, column pressure_bar", 0.0, 20.0, float),
        int(_number(repeat, f"{where}, column repeat", 1, 100_000, int)),
        MM * _number(contraction, f"{where}, column contraction_mm", -1000.0, 1000.0, float),
    )


def _number(cell: str, where: str, low: float, high: float, kind: Callable[[str], float]) -> float:
    try:
        value = kind(cell)
    except ValueError:
        wanted = "a whole number" if kind is int else "a number"
        raise ValueError(f"{where}: {cell!r} is not {wanted}; correct the cell") from None
    if not (math.isfinite(value) and low <= value <= high):
        raise ValueError(
            f"{where}: {cell!r} is outside [{low:g}, {high:g}]; correct the cell or its unit"
        )
    return value


def _is_inflation(cell: str, where: str) -> bool:
    if cell not in DIRECTIONS:
        raise ValueError(f"{where}: {cell!r} is neither 'inflation' nor 'deflation'")
    return cell == "inflation"


def _in_cycle_order(readings: list[tuple[float, bool, float, int, float]]) -> ContractionTable:
    """Return the readings sorted by load and repeat; within a cycle the file's order stays."""
    ordered = sorted(readings, key=lambda reading: (reading[0], reading[3]))
    load, inflating, pressure, repeat, contraction = zip(*ordered, strict=True)
    return ContractionTable(
        load_kg=np.array(load, dtype=np.float64),
        inflating=np.array(inflating, dtype=np.bool_),
        pressure_pa=np.array(pressure, dtype=np.float64),
        repeat=np.array(repeat, dtype=np.int64),
        contraction_m=np.array(contraction, dtype=np.float64),
    )


def _check_cycles(table: ContractionTable, name: str) -> None:
    """Raise if a cycle is not one way up and one way down, or not the path of its load."""
    for load in table.loads:
        path, _ = table.cycle(load, table.repeats(load)[0])
        for repeat in table.repeats(load):
            rows = table._at(load) & (table.repeat == repeat)
            pressure, inflating = table.pressure_pa[rows], table.inflating[rows]
            where = f"{name}: load {load:g} kg, repeat {repeat}"
            _check_path(pressure, inflating, where)
            if not np.array_equal(pressure, path):
                raise ValueError(
                    f"{where}: its pressures differ from those of the load's first repeat; "
                    "measure every repeat at the same pressures, in the same order"
                )


def _check_path(pressure: Array, inflating: NDArray[np.bool_], where: str) -> None:
    rises = np.diff(pressure) > 0.0
    falls = np.diff(pressure) < 0.0
    good = inflating[0] and np.all(np.where(inflating[1:], rises, falls))
    if not good or np.any(np.diff(inflating.astype(int)) > 0):
        raise ValueError(
            f"{where}: the pressures must rise along the inflation rows and then fall along the "
            "deflation rows; put the rows in the order of the readings, each pressure once a way"
        )
