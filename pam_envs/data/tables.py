"""Measured contraction of one muscle over pressure cycles, checked while reading.

375 readings of a Festo MAS-10-N-100 (positioning2021, Tables 3 to 5): three hanging loads, five
cycles each, one cycle 0 to 6 bar and back in steps of 0.5 bar, a minute of rest before each
reading. Hysteresis makes a reading depend on those before it: the arrays keep their order.
"""

from __future__ import annotations

import csv
import dataclasses
from collections.abc import Callable, Mapping
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Parser = Callable[[str], Any]
"""Makes a value of a cell, or raises ``ValueError`` with a sentence."""
N = TypeVar("N", int, float)

BAR = 1e5
MM = 1e-3
LOAD_TOLERANCE = 1e-6
"""Two loads [kg] closer than this are the same load."""


@dataclasses.dataclass(frozen=True)
class ContractionTable:
    """Static contractions over pressure cycles under constant loads.

    All arrays have one entry per reading, shape (n,), and are read-only, sorted by load and
    repeat; a repeat is in the order of the cycle: pressure up, then down.

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
        """Return the pressures [Pa] and contractions [m] of one cycle, shape (m,), in their order.

        In the published tables m is 25: 0 to 6 bar and back to 0. Raises ValueError if there is no
        such load [kg] or repeat.
        """
        rows = self._at(load) & (self.repeat == repeat)
        if not rows.any():
            raise ValueError(
                f"no repeat {repeat!r} at {load:g} kg; the repeats there are {self.repeats(load)}"
            )
        return self.pressure_pa[rows], self.contraction_m[rows]

    def cycles(self, load: float) -> tuple[Array, Array]:
        """Return the path [Pa], shape (m,), and all contractions [m] at a load, (m, n_repeats)."""
        cycles = [self.cycle(load, repeat) for repeat in self.repeats(load)]
        return cycles[0][0], np.column_stack([contraction for _, contraction in cycles])

    def means(self, load: float) -> tuple[Array, Array]:
        """Return the path [Pa] and the contraction [m] averaged over the repeats, shape (m,)."""
        pressure, contraction = self.cycles(load)
        return pressure, contraction.mean(axis=1)

    def branch(self, load: float, inflating: bool) -> tuple[Array, Array]:
        """Return one branch of the loop at a load, both its ends included.

        The pressures [Pa] up to the turning point (``inflating``), or from it, in path order, and
        the contractions [m], shape (b, n_repeats).
        """
        pressure, contraction = self.cycles(load)
        top = int(np.argmax(pressure))
        part = slice(None, top + 1) if inflating else slice(top, None)
        return pressure[part], contraction[part]

    def without_repeat(self, repeat: int) -> ContractionTable:
        """Return the table without one repeat of every load; ValueError without it or others."""
        kept = self.repeat != repeat
        if kept.all() or not kept.any():
            raise ValueError(
                f"leaving out repeat {repeat!r} leaves {int(kept.sum())} of {kept.size} readings; "
                f"choose one of several repeats, here {sorted(set(self.repeat.tolist()))}"
            )
        return ContractionTable(**{name: values[kept] for name, values in vars(self).items()})

    def _at(self, load: float) -> NDArray[np.bool_]:
        rows: NDArray[np.bool_] = np.abs(self.load_kg - load) < LOAD_TOLERANCE
        if not rows.any():
            known = ", ".join(f"{one:g}" for one in self.loads)
            raise ValueError(f"no readings at {load!r} kg; the loads of this table are {known} kg")
        return rows


def number(low: float, high: float, unit: float = 1.0) -> Parser:
    """Return a parser of numbers within [low, high], in the file's ``unit`` (1e5 Pa for bar)."""
    return lambda cell: unit * _within(_converted(cell, float, "a number"), low, high)


def whole_number(low: int, high: int) -> Parser:
    """Return a parser of whole numbers within [low, high]."""
    return lambda cell: _within(_converted(cell, int, "a whole number"), low, high)


def one_of(*choices: str) -> Parser:
    """Return a parser of one of these words."""

    def parse(cell: str) -> str:
        if cell not in choices:
            allowed = " or ".join(map(repr, choices))
            raise ValueError(f"{cell!r} is not {allowed}; correct the cell")
        return cell

    return parse


COLUMNS: dict[str, Parser] = {
    "load_kg": number(0.0, 1000.0),
    "direction": one_of("inflation", "deflation"),
    "pressure_bar": number(0.0, 20.0, BAR),
    "repeat": whole_number(1, 100_000),
    "contraction_mm": number(-1000.0, 1000.0, MM),
}
"""The columns of a table of contractions."""


def read_columns(source: Path | Traversable, columns: Mapping[str, Parser]) -> dict[str, list[Any]]:
    """Read a CSV file whose every cell is checked, in the file's order.

    The first row holds exactly the names of ``columns``, in their order; their parsers make the
    values, see :func:`number`, :func:`whole_number` and :func:`one_of`.

    Raises
    ------
    ValueError
        For wrong columns, a row of the wrong length, a bad cell or no rows at all, naming file,
        row (the header is row 1), column and value.
    """
    # utf-8-sig: spreadsheets put a byte order mark before the first column's name.
    rows = csv.reader(source.read_text(encoding="utf-8-sig").splitlines())
    header = [cell.strip() for cell in next(rows, [])]
    if header != list(columns):
        raise ValueError(
            f"{source}, row 1: the columns must be {', '.join(columns)}, got {', '.join(header)!r}"
        )
    values: dict[str, list[Any]] = {name: [] for name in columns}
    for row, cells in enumerate(rows, 2):
        if cells:
            _add(values, cells, columns, f"{source}, row {row}")
    if not values[header[0]]:
        raise ValueError(f"{source} holds no readings; give at least one row below the header")
    return values


def load_contraction_table(path: str | Path | None = None) -> ContractionTable:
    """Read and check a table of contractions.

    Parameters
    ----------
    path : str or Path, optional
        A CSV file with the columns ``load_kg, direction, pressure_bar, repeat, contraction_mm``,
        each cycle's rows in the order of its readings; cycles may be mixed. Default: the published
        375 readings.

    Raises
    ------
    ValueError
        For a bad cell, naming file, row (the header is row 1), column and value; for a cycle whose
        pressures do not rise and then fall, or differ from those of the load's other cycles.
    """
    source = resources.files(__package__) / "mas10_contraction.csv" if path is None else Path(path)
    columns = {name: np.array(values) for name, values in read_columns(source, COLUMNS).items()}
    table = sorted_table(columns, columns["direction"] == "inflation")
    _check_cycles(table, str(source))
    return table


def _add(
    values: dict[str, list[Any]], cells: list[str], columns: Mapping[str, Parser], where: str
) -> None:
    """Add the values of one row to the columns."""
    if len(cells) != len(columns):
        raise ValueError(f"{where}: {len(columns)} cells are needed, got {len(cells)}: {cells!r}")
    for (name, parse), cell in zip(columns.items(), cells, strict=True):
        try:
            values[name].append(parse(cell.strip()))
        except ValueError as error:
            raise ValueError(f"{where}, column {name}: {error}") from None


def _converted(cell: str, kind: Callable[[str], N], allowed: str) -> N:
    try:
        return kind(cell)
    except ValueError:
        raise ValueError(f"{cell!r} is not {allowed}; correct the cell") from None


def _within(value: N, low: float, high: float) -> N:
    if not low <= value <= high:
        raise ValueError(f"{value!r} is outside [{low:g}, {high:g}]; correct the cell or its unit")
    return value


def sorted_table(columns: Mapping[str, Array], inflating: NDArray[np.bool_]) -> ContractionTable:
    """Return readings in SI sorted by load and repeat; within a cycle the given order stays."""
    order = np.lexsort((columns["repeat"], columns["load_kg"]))
    return ContractionTable(
        load_kg=np.asarray(columns["load_kg"], np.float64)[order],
        inflating=inflating[order],
        pressure_pa=np.asarray(columns["pressure_bar"], np.float64)[order],
        repeat=np.asarray(columns["repeat"], np.int64)[order],
        contraction_m=np.asarray(columns["contraction_mm"], np.float64)[order],
    )


def _check_cycles(table: ContractionTable, name: str) -> None:
    """Raise if a cycle is not one way up and one way down, or not the path of its load."""
    for load in table.loads:
        path, _ = table.cycle(load, table.repeats(load)[0])
        for repeat in table.repeats(load):
            rows = table._at(load) & (table.repeat == repeat)
            pressure, inflating = table.pressure_pa[rows], table.inflating[rows]
            where = f"{name}: load {load:g} kg, repeat {repeat}"
            ways = np.where(inflating[1:], np.diff(pressure) > 0.0, np.diff(pressure) < 0.0)
            if not inflating[0] or not ways.all() or np.any(np.diff(inflating.astype(int)) > 0):
                raise ValueError(
                    f"{where}: the pressures must rise along the inflation rows and then fall "
                    "along the deflation rows; put the rows in the order of the readings, each "
                    "pressure once a way"
                )
            if not np.array_equal(pressure, path):
                raise ValueError(
                    f"{where}: its pressures differ from those of the load's first repeat; "
                    "measure every repeat at the same pressures, in the same order"
                )
